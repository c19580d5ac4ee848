//! A job as a shell script that submits it to Slurm.
//!
//! A layer is a job array, a chunk a task of it. Slurm's indices end at 1,000 where nobody has raised
//! `MaxArraySize`, so an index is none of a frame: each array has a table from index to frames, and a layer
//! of more than 1,000 chunks is several arrays. What a layer waits for becomes `--dependency=afterok`, frame
//! by frame where both have the same chunks (`aftercorr`) and else as a whole. A layer whose predecessor
//! fails is cancelled. Commands and environment come from [`shell`]. There are no retries: `scontrol
//! requeue` makes them.

use super::job::DependKind;
use super::plan::{Plan, PlannedLayer};
use super::{range, shell};
use std::fmt::Write;

/// The tasks of an array: as many as every Slurm takes.
const ARRAY: usize = 1000;

/// The script that submits a plan whose commands run in `root` and whose logs go to `logs` in there.
/// It prints the id of each array that it has submitted.
pub fn slurm(plan: &Plan, root: &str, logs: &str) -> String {
    let logs = format!("{root}/{logs}/{}", plan.job.name);
    let mut script = format!(
        "#!/bin/sh\n# Submits {} to Slurm, layer by layer.\nset -eu\nmkdir -p {}\n",
        plan.job.full_name(),
        shell::quote(&logs)
    );
    for (place, planned) in plan.layers.iter().enumerate() {
        let chunks: Vec<String> = planned.chunks().map(range::format).collect();
        let run = shell::chunk(plan, planned, root, ("CUE_LOG_PATH", &logs));
        let _ = write!(script, "\n# {}\nids_{place}=\n", planned.layer.name);
        for (array, chunks) in chunks.chunks(ARRAY).enumerate() {
            submit(&mut script, plan, place, array, chunks, &run, &logs);
        }
    }
    script
}

fn submit(
    script: &mut String,
    plan: &Plan,
    place: usize,
    array: usize,
    chunks: &[String],
    run: &str,
    logs: &str,
) {
    let planned = &plan.layers[place];
    let layer = &planned.layer;
    let table = chunks.join("\n");
    let body = format!(
        "#!/bin/sh\nframes=$(sed -n \"$((SLURM_ARRAY_TASK_ID + 1))p\" <<'FRAMES'\n{table}\nFRAMES\n)\n{run}"
    );
    let mut options = format!(
        "--job-name={}.{} --array=0-{} --output={}",
        plan.job.name,
        layer.name,
        chunks.len() - 1,
        // Slurm has marks of its own in names.
        shell::quote(&format!("{}/{}.%A_%a.log", logs.replace('%', "%%"), layer.name)),
    );
    if let Some(threads) = planned.threads() {
        let _ = write!(options, " --cpus-per-task={threads}");
    }
    if let Some(mib) = layer.memory_mib {
        let _ = write!(options, " --mem={mib}M");
    }
    if let Some(minutes) = layer.timeout_minutes {
        let _ = write!(options, " --time={minutes}");
    }
    let waits: Vec<_> =
        planned.waits.iter().map(|&(on, kind)| wait(plan, planned, on, kind, array)).collect();
    if !waits.is_empty() {
        let _ = write!(options, " --kill-on-invalid-dep=yes --dependency={}", waits.join(","));
    }
    // A line that ends the body too early would be run here and now.
    let mut end = String::from("END_OF_LAYER");
    while body.lines().any(|line| line == end) {
        end.push('_');
    }
    let _ = write!(
        script,
        "id=$(sbatch --parsable {options} <<'{end}'\n{body}{end}\n)\nids_{place}=$ids_{place}:${{id%%;*}}\n\
         echo \"{}: ${{id%%;*}}\"\n",
        layer.name
    );
}

/// One part of `--dependency`.
fn wait(plan: &Plan, planned: &PlannedLayer, on: usize, kind: DependKind, array: usize) -> String {
    let other = &plan.layers[on];
    let is_same = planned.frames == other.frames && planned.layer.chunk == other.layer.chunk;
    if kind == DependKind::FrameByFrame && is_same {
        // The array of the same number in `:12:13`.
        return format!("aftercorr:$(echo \"$ids_{on}\" | cut -d: -f{})", array + 2);
    }
    format!("afterok$ids_{on}")
}
