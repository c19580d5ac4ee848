//! A job as an Open Job Description template (`jobtemplate-2023-09`), in JSON.
//!
//! A layer is a step. Steps depend as wholes, so what a layer waits for is a step's dependence, frame by
//! frame or not. Frames are a `CHUNK[INT]` parameter, so the scheduler forms the chunks: of frames in
//! rising order, of the layer's size or, to make them alike, a little less. Commands and environment come
//! from [`shell`]; memory and cores become host requirements. There are no retries: they are the
//! scheduler's.

use super::plan::{Plan, PlannedLayer};
use super::shell;
use serde_json::{Value, json};

/// Our programs tell the session how far they are.
const PROGRESS: (&str, &str) = ("CANDELABRA_PROGRESS", "openjd");
/// From SIGTERM to SIGKILL, as long as Slurm leaves. Without a notice OpenJD kills at once.
const NOTICE_SECONDS: u64 = 30;

/// The template of a plan whose commands run in `root`.
pub fn openjd(plan: &Plan, root: &str) -> Value {
    let steps: Vec<_> = plan.layers.iter().map(|layer| step(plan, layer, root)).collect();
    json!({
        "specificationVersion": "jobtemplate-2023-09",
        "extensions": ["TASK_CHUNKING"],
        "name": plan.job.full_name(),
        "steps": steps,
    })
}

fn step(plan: &Plan, planned: &PlannedLayer, root: &str) -> Value {
    let mut frames = planned.frames.clone();
    frames.sort_unstable();
    let is_contiguous = frames.windows(2).all(|pair| pair[1] == pair[0] + 1);
    // OpenJD's chunks are OpenCue's but for the sign of a step and a single frame, `7-7`.
    let script = format!(
        "frames=$(printf %s '{{{{Task.Param.Frame}}}}' | sed 's/:/x/g; s/^\\(-*[0-9]*\\)-\\1$/\\1/')\n{}",
        without_braces(&shell::chunk(plan, planned, root, PROGRESS))
    );
    let mut run = json!({
        "command": "sh",
        "args": ["{{Task.File.Run}}"],
        "cancelation": {
            "mode": "NOTIFY_THEN_TERMINATE",
            "notifyPeriodInSeconds": NOTICE_SECONDS,
        },
    });
    if let Some(minutes) = planned.layer.timeout_minutes {
        run["timeout"] = json!(minutes * 60);
    }
    let mut step = json!({
        "name": planned.layer.name,
        "parameterSpace": {"taskParameterDefinitions": [{
            "name": "Frame",
            "type": "CHUNK[INT]",
            "range": openjd_range(&frames),
            "chunks": {
                "defaultTaskCount": planned.layer.chunk,
                "rangeConstraint": if is_contiguous { "CONTIGUOUS" } else { "NONCONTIGUOUS" },
            },
        }]},
        "script": {
            "actions": {"onRun": run},
            "embeddedFiles": [{"name": "Run", "type": "TEXT", "filename": "run.sh", "data": script}],
        },
    });
    let waits = planned.waits.iter().map(|&(on, _)| plan.layers[on].layer.name.as_str());
    let mut names: Vec<_> = waits.collect();
    names.sort_unstable();
    names.dedup();
    if !names.is_empty() {
        step["dependencies"] = names.into_iter().map(|name| json!({"dependsOn": name})).collect();
    }
    let cores =
        planned.layer.core_points.map(|points| ("amount.worker.vcpu", f64::from(points) / 100.0));
    let memory = planned.layer.memory_mib.map(|mib| ("amount.worker.memory", mib as f64));
    let amounts: Vec<_> = [cores, memory]
        .into_iter()
        .flatten()
        .map(|(name, least)| json!({"name": name, "min": least}))
        .collect();
    if !amounts.is_empty() {
        step["hostRequirements"] = json!({"amounts": amounts});
    }
    step
}

/// Frames in rising order as OpenJD writes them: `1-9:2,12`.
fn openjd_range(frames: &[i32]) -> String {
    super::range::format(frames).replace('x', ":")
}

/// A script in which `{{` and `}}`, which OpenJD would take for a reference, are broken up. They can stand
/// in single quotes alone: in a command, a name or a value.
fn without_braces(script: &str) -> String {
    // The second time is for three in a row.
    let apart = |script: &str| script.replace("{{", "{''{").replace("}}", "}''}");
    apart(&apart(script))
}
