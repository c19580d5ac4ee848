//! What a farm's task runs: a few lines of `sh` that choose the frames, expand the tokens and run the command.
//!
//! A farm knows a task by a number or by frames, so what [`Plan::tasks`] expands here has to be
//! expanded there. The tests hold both against each other.

use super::plan::{Plan, PlannedLayer};
use super::range;
use std::fmt::Write;

/// A script that carries out one chunk of a layer, the frames of which stand in the shell variable `frames`, as OpenCue
/// writes them. Commands run in `root`.
pub fn chunk(plan: &Plan, planned: &PlannedLayer, root: &str) -> String {
    let PlannedLayer { layer, frames, .. } = planned;
    let mut script = format!("cd {} || exit 1\n", quote(root));
    for (name, value) in &layer.env {
        let _ = writeln!(script, "export {name}={}", quote(value));
    }
    let threads = match planned.threads() {
        Some(threads) => threads.to_string(),
        None => "${SLURM_CPUS_ON_NODE:-$(nproc)}".into(),
    };
    let job = &plan.job;
    let _ = write!(
        script,
        r#"# The first and the last number of the list.
first=$(printf %s "$frames" | sed 's/^\(-*[0-9]*\).*/\1/')
last=$(printf %s "$frames" | sed 's/.*,//; s/x.*//; s/^\(-*[0-9][0-9]*\)-/\1 /; s/.* //')
export CUE_SHOW={show} CUE_SHOT={shot} CUE_USER={user} CUE_JOB={name} CUE_LAYER={layer}
export CUE_IFRAME=$first CUE_FRAME=$(printf %04d "$first")-{layer}
export CUE_RANGE={range} CUE_CHUNK={chunk} CUE_THREADS={threads}
command=$(printf %s {command} | sed "
    s/#ZFRAME#/$(printf %04d "$first")/g; s/#IFRAME#/$first/g; s/#FRAME_START#/$first/g
    s/#FRAME_END#/$last/g; s/#FRAME_CHUNK#/{chunk}/g; s/#FRAMESPEC#/$frames/g
    s/#FRAME#/$CUE_FRAME/g; s/#LAYER#/{layer}/g; s/#JOB#/{name}/g")
echo "$CUE_FRAME: $command"
exec sh -c "$command"
"#,
        show = quote(&job.show),
        shot = quote(&job.shot),
        user = quote(&job.user),
        name = job.full_name(),
        layer = layer.name,
        range = quote(&range::format(frames)),
        chunk = layer.chunk,
        command = quote(&layer.command),
    );
    script
}

/// A text as one word of `sh`. Always in single quotes, so that a farm's own marks can be broken up in it.
pub fn quote(text: &str) -> String {
    format!("'{}'", text.replace('\'', r"'\''"))
}
