//! What a farm's task runs: a few lines of `sh` that choose the frames, expand the tokens and run the command.
//!
//! A farm knows a task by a number or by frames, so what [`Plan::tasks`] expands here has to be
//! expanded there. The tests hold both against each other.

use super::plan::{Plan, PlannedLayer};
use super::{range, tokens};
use std::fmt::Write;

/// A script that carries out one chunk of a layer in the folder `root`. The chunk's frames stand in the shell
/// variable `frames`, as OpenCue writes them. `env` is what the farm adds to the environment; the layer's own
/// overrides it.
pub fn chunk(plan: &Plan, planned: &PlannedLayer, root: &str, env: (&str, &str)) -> String {
    let PlannedLayer { layer, frames, .. } = planned;
    let mut script = format!("cd {} || exit 1\n", quote(root));
    let own = layer.env.iter().map(|(name, value)| (name.as_str(), value.as_str()));
    for (name, value) in [env].into_iter().chain(own) {
        let _ = writeln!(script, "export {name}={}", quote(value));
    }
    let threads = match planned.threads() {
        Some(threads) => threads.to_string(),
        None => "${SLURM_CPUS_ON_NODE:-$(nproc)}".into(),
    };
    let job = &plan.job;
    let (job_name, size) = (job.full_name(), layer.chunk.to_string());
    let value = |token: &str| match token {
        "ZFRAME" => "$(printf %04d \"$first\")",
        "IFRAME" | "FRAME_START" => "$first",
        "FRAME_END" => "$last",
        "FRAME_CHUNK" => &size,
        "FRAMESPEC" => "$frames",
        "FRAME" => "$CUE_FRAME",
        "LAYER" => &layer.name,
        _ => &job_name,
    };
    let replace = tokens::TOKENS.map(|token| format!("s/#{token}#/{}/g", value(token))).join("; ");
    let _ = write!(
        script,
        r#"# The first and the last number of the list.
first=$(printf %s "$frames" | sed 's/^\(-*[0-9]*\).*/\1/')
last=$(printf %s "$frames" | sed 's/.*,//; s/x.*//; s/^\(-*[0-9][0-9]*\)-/\1 /; s/.* //')
export CUE_SHOW={show} CUE_SHOT={shot} CUE_USER={user} CUE_JOB={name} CUE_LAYER={layer}
export CUE_IFRAME=$first CUE_FRAME=$(printf %04d "$first")-{layer}
export CUE_RANGE={range} CUE_CHUNK={chunk} CUE_THREADS={threads}
command=$(printf %s {command} | sed "{replace}")
echo "$CUE_FRAME: $command"
exec sh -c "$command"
"#,
        show = quote(&job.show),
        shot = quote(&job.shot),
        user = quote(&job.user),
        name = job_name,
        layer = layer.name,
        range = quote(&range::format(frames)),
        chunk = size,
        command = quote(&layer.command),
    );
    script
}

/// A text as one word of `sh`. Always in single quotes, so that a farm's own marks can be broken up in it.
pub fn quote(text: &str) -> String {
    format!("'{}'", text.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::super::reader::from_text;
    use super::*;
    use crate::farm::{Plan, Selection};
    use std::path::Path;
    use std::process::Command;

    /// Every pair of tokens with a number sign in common, where the order of replacement tells.
    #[test]
    fn tokens_are_replaced_in_the_order_in_which_they_are_here() {
        let pairs = tokens::TOKENS.map(|first| {
            tokens::TOKENS.map(|second| format!("#{first}#{second}#{first}#")).join("|")
        });
        let text = format!(
            "<!DOCTYPE spec><spec><show>show</show><shot>shot</shot><user>jane</user>\
             <job name=\"job\"><layers><layer name=\"layer\" type=\"Render\">\
             <cmd>printf %s '{}'</cmd><range>-1-8x3</range><chunk>4</chunk></layer></layers></job></spec>",
            pairs.join("|")
        );
        let job = from_text(&text, Path::new("job.xml"), Path::new("/")).unwrap();
        let plan = Plan::new(&job, &Selection::default()).unwrap();
        let task = plan.tasks().next().unwrap();
        let script = chunk(&plan, &plan.layers[0], "/", ("NAME", "it's"));
        let frames = range::format(&task.frames);
        let output =
            Command::new("sh").env("frames", frames).args(["-c", &script]).output().unwrap();
        // The script tells what it runs, then runs it.
        let told = String::from_utf8(output.stdout).unwrap();
        let (command, printed) = told.split_once('\n').unwrap();
        assert_eq!(command, format!("{}: {}", task.name, task.command));
        assert_eq!(
            printed,
            task.command.strip_prefix("printf %s '").unwrap().trim_end_matches('\'')
        );
    }
}
