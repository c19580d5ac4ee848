//! All jobs of a folder.

use super::job::{Job, JobError};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

/// Reads a job file; or all of a folder and the folders in it, `*.xml` in the order of their paths.
///
/// # Errors
/// All files that are refused, and jobs of one name whose logs would be mixed up. The list is never empty.
pub fn read_jobs(path: &Path) -> Result<Vec<Job>, Vec<JobError>> {
    let (mut jobs, mut errors) = (Vec::new(), Vec::new());
    let mut names: HashMap<(PathBuf, String), PathBuf> = HashMap::new();
    for entry in WalkDir::new(path).sort_by_file_name() {
        let entry = match entry {
            Ok(entry) => entry,
            Err(error) => {
                let path = error.path().unwrap_or(path).to_owned();
                errors.push(JobError::Unreadable { path, error: error.into() });
                continue;
            }
        };
        // A file that is named by the user may have any name.
        let is_xml = entry.path().extension().is_some_and(|extension| extension == "xml");
        if entry.file_type().is_dir() || (entry.depth() > 0 && !is_xml) {
            continue;
        }
        match Job::read(entry.path()) {
            Ok(job) => {
                let key = (job.root.clone(), job.name.clone());
                match names.insert(key, job.path.clone()) {
                    None => jobs.push(job),
                    Some(other) => {
                        errors.push(JobError::SameName { name: job.name, path: job.path, other })
                    }
                }
            }
            Err(error) => errors.push(error),
        }
    }
    if jobs.is_empty() && errors.is_empty() {
        errors.push(JobError::Empty { path: path.into() });
    }
    if errors.is_empty() { Ok(jobs) } else { Err(errors) }
}
