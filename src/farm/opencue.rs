//! A job for OpenCue itself: the job file, made independent of the folder in which it is run.

use super::cjsl::{self, Element};
use super::plan::Plan;
use super::{range, shell};
use std::io;
use thiserror::Error;

/// Why a plan is none for OpenCue.
#[derive(Debug, Error)]
pub enum OpenCueError {
    /// Cuebot cannot tell the sign of a frame from the dash in a task's name.
    #[error(
        "layer {layer} has frame {frame}, and Cuebot knows no frames below zero; shift the shot"
    )]
    NegativeFrame {
        /// The layer.
        layer: String,
        /// The frame.
        frame: i32,
    },
    /// It cannot be written.
    #[error(transparent)]
    Write(#[from] io::Error),
}

/// Writes the job file of a plan. RQD runs commands in a folder of its own, so each begins with a change to
/// `root`. Layers and frames that are not wanted are left out, with their dependences; all else is kept.
pub fn opencue(plan: &Plan, root: &str, out: &mut impl io::Write) -> Result<(), OpenCueError> {
    for planned in &plan.layers {
        if let Some(&frame) = planned.frames.iter().find(|&&frame| frame < 0) {
            return Err(OpenCueError::NegativeFrame { layer: planned.layer.name.clone(), frame });
        }
    }
    let mut spec = plan.job.spec.clone();
    let root = shell::quote(root);
    let wanted = |name: &str| {
        let name = name.replace('-', "_").to_lowercase();
        plan.layers.iter().find(|planned| planned.layer.name == name)
    };
    let jobs = spec.children.iter_mut().filter(|child| child.name == "job");
    for layers in jobs.flat_map(|job| &mut job.children).filter(|child| child.name == "layers") {
        layers
            .children
            .retain(|layer| wanted(layer.attribute("name").unwrap_or_default()).is_some());
        for layer in &mut layers.children {
            let planned = wanted(layer.attribute("name").unwrap_or_default());
            for child in &mut layer.children {
                match (child.name, planned) {
                    ("cmd", _) => child.text = format!("cd {root} || exit 1; {}", child.text),
                    ("range", Some(planned)) if planned.frames != planned.layer.frames => {
                        child.text = range::format(&planned.frames);
                    }
                    _ => {}
                }
            }
        }
    }
    for depends in spec.children.iter_mut().filter(|child| child.name == "depends") {
        let is_wanted = |depend: &Element, name| {
            depend.child(name).is_some_and(|layer| wanted(&layer.text).is_some())
        };
        depends
            .children
            .retain(|depend| is_wanted(depend, "deplayer") && is_wanted(depend, "onlayer"));
    }
    cjsl::write(&spec, out)?;
    Ok(())
}
