//! What of a job is to be done: layers in order, frames in chunks, commands with their tokens expanded.

use super::job::{DependKind, Job, Layer};
use super::{order, range, tokens};
use crate::render::frames::Frames;
use std::collections::HashSet;
use thiserror::Error;

/// Which part of a job is wanted. All of it by default.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// These layers alone; what they wait for is taken as done.
    pub layers: Vec<String>,
    /// These frames alone, in layers of several frames. Layers of one frame prepare or conclude a shot and
    /// are carried out whole.
    pub frames: Option<Frames>,
}

/// Why a selection selects nothing.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PlanError {
    /// A layer that the job does not have.
    #[error("the job {job} has no layer '{layer}'; it has {has}")]
    NoLayer {
        /// The job.
        job: String,
        /// What was asked for.
        layer: String,
        /// Its layers.
        has: String,
    },
    /// Frames that a layer does not have.
    #[error("none of the frames asked for is in layer {layer}, which has {has}")]
    NoFrame {
        /// The layer.
        layer: String,
        /// Its frames.
        has: String,
    },
}

/// A part of a job, ready to be carried out or handed to a farm.
#[derive(Clone, Debug)]
pub struct Plan<'a> {
    /// The job.
    pub job: &'a Job,
    /// The layers that are wanted, each after all that it waits for.
    pub layers: Vec<PlannedLayer<'a>>,
}

/// A layer that is wanted.
#[derive(Clone, Debug)]
pub struct PlannedLayer<'a> {
    /// The layer.
    pub layer: &'a Layer,
    /// The frames that are wanted of it, in order; at least one.
    pub frames: Vec<i32>,
    /// What it waits for, by the place in [`Plan::layers`].
    pub waits: Vec<(usize, DependKind)>,
}

/// One command to be carried out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Task {
    /// Its layer, by the place in [`Plan::layers`].
    pub layer: usize,
    /// The frames that it makes; at least one.
    pub frames: Vec<i32>,
    /// Its name as OpenCue forms it, from its first frame: `1001-render`.
    pub name: String,
    /// A line of `sh`.
    pub command: String,
}

impl<'a> Plan<'a> {
    /// Plans a part of a job.
    ///
    /// # Errors
    /// A layer or frames that the job does not have.
    pub fn new(job: &'a Job, selection: &Selection) -> Result<Plan<'a>, PlanError> {
        // Whatever is asked for is conformed as names in job files are.
        let wanted: HashSet<_> =
            selection.layers.iter().map(|name| name.replace('-', "_").to_lowercase()).collect();
        let has = |name: &String| job.layers.iter().any(|layer| layer.name == *name);
        if let Some(layer) = wanted.iter().find(|name| !has(name)) {
            let names: Vec<_> = job.layers.iter().map(|layer| layer.name.as_str()).collect();
            let (job, layer, has) = (job.name.clone(), layer.clone(), names.join(", "));
            return Err(PlanError::NoLayer { job, layer, has });
        }
        let frames: Option<HashSet<i32>> =
            selection.frames.as_ref().map(|frames| frames.as_slice().iter().copied().collect());
        let waits = order::waits(&job.layers, &job.depends);
        // A job that was read has an order.
        let order = order::of(&job.layers, &job.depends).unwrap_or_default();
        let mut places = vec![None; job.layers.len()];
        let mut layers = Vec::new();
        for place in order {
            let layer = &job.layers[place];
            if !wanted.is_empty() && !wanted.contains(&layer.name) {
                continue;
            }
            let mut chosen = layer.frames.clone();
            if let (Some(frames), true) = (&frames, layer.frames.len() > 1) {
                chosen.retain(|frame| frames.contains(frame));
            }
            if chosen.is_empty() {
                let (layer, has) = (layer.name.clone(), range::format(&layer.frames));
                return Err(PlanError::NoFrame { layer, has });
            }
            let waits = waits[place].iter().filter_map(|&(on, kind)| Some((places[on]?, kind)));
            let waits = waits.collect();
            places[place] = Some(layers.len());
            layers.push(PlannedLayer { layer, frames: chosen, waits });
        }
        Ok(Plan { job, layers })
    }

    /// All tasks, in an order in which they can be carried out.
    pub fn tasks(&self) -> impl Iterator<Item = Task> {
        self.layers.iter().enumerate().flat_map(|(place, layer)| layer.tasks(place, self.job))
    }

    /// The environment that OpenCue gives a task, beside its layer's, but for the number of threads.
    pub fn environment(&self, task: &Task) -> [(&'static str, String); 9] {
        let PlannedLayer { layer, frames, .. } = &self.layers[task.layer];
        [
            ("CUE_SHOW", self.job.show.clone()),
            ("CUE_SHOT", self.job.shot.clone()),
            ("CUE_USER", self.job.user.clone()),
            ("CUE_JOB", self.job.full_name()),
            ("CUE_LAYER", layer.name.clone()),
            ("CUE_FRAME", task.name.clone()),
            ("CUE_IFRAME", task.frames[0].to_string()),
            ("CUE_RANGE", range::format(frames)),
            ("CUE_CHUNK", layer.chunk.to_string()),
        ]
    }
}

impl PlannedLayer<'_> {
    /// The frames of each task.
    pub fn chunks(&self) -> impl Iterator<Item = &[i32]> {
        self.frames.chunks(self.layer.chunk)
    }

    /// The cores that a task reserves, if the layer says so: at least one.
    pub fn threads(&self) -> Option<u32> {
        self.layer.core_points.map(|points| (points / 100).max(1))
    }

    fn tasks(&self, place: usize, job: &Job) -> impl Iterator<Item = Task> {
        let job_name = job.full_name();
        self.chunks().map(move |frames| {
            let [first, last] = [frames[0], frames[frames.len() - 1]];
            let name = frame_name(first, &self.layer.name);
            let (start, end, padded) = (first.to_string(), last.to_string(), format!("{first:04}"));
            let (spec, chunk) = (range::format(frames), self.layer.chunk.to_string());
            let command = tokens::expand(&self.layer.command, |token| match token {
                "IFRAME" | "FRAME_START" => &start,
                "ZFRAME" => &padded,
                "FRAME_END" => &end,
                "FRAME_CHUNK" => &chunk,
                "FRAMESPEC" => &spec,
                "FRAME" => &name,
                "LAYER" => &self.layer.name,
                _ => &job_name,
            });
            Task { layer: place, frames: frames.to_vec(), name, command }
        })
    }
}

/// The name of a task of a layer.
fn frame_name(first: i32, layer: &str) -> String {
    format!("{first:04}-{layer}")
}
