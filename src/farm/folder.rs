//! All jobs of a folder.

use super::job::{Job, JobError};
use std::path::Path;
use walkdir::{DirEntry, WalkDir};

/// Reads a job file; or all of a folder and the folders in it, `*.xml` in the order of their paths, but
/// for hidden ones.
///
/// # Errors
/// All files that are refused. The list is never empty.
pub fn read_jobs(path: &Path) -> Result<Vec<Job>, Vec<JobError>> {
    let (mut jobs, mut errors) = (Vec::new(), Vec::new());
    let is_seen = |entry: &DirEntry| {
        entry.depth() == 0 || !entry.file_name().as_encoded_bytes().starts_with(b".")
    };
    for entry in WalkDir::new(path).sort_by_file_name().into_iter().filter_entry(is_seen) {
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
            Ok(job) => jobs.push(job),
            Err(error) => errors.push(error),
        }
    }
    if jobs.is_empty() && errors.is_empty() {
        errors.push(JobError::Empty { path: path.into() });
    }
    if errors.is_empty() { Ok(jobs) } else { Err(errors) }
}
