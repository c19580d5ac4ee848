//! Floor 6: jobs of many frames, on this machine or for a farm.
//!
//! A [`Job`] is read once, from an OpenCue job file (CJSL 1.15), and checked whole: what Cuebot would
//! refuse, and what it would take and misunderstand, is refused with line, column and remedy. A [`Plan`] is
//! what of a job is to be done: its layers in the order of their dependences, their frames in chunks.
//! [`run()`] carries a plan out here, one command after another; [`openjd()`], [`slurm()`] and [`opencue()`] write
//! it down for a farm.
//!
//! This is no scheduler: nothing here knows of a second machine. It does not decide what is up to date
//! either: the commands do, and say so by [`Event`](crate::pipeline::Event)s.
//!
//! The meaning of a job file is Cuebot's and RQD's: a command is a line of `sh`; its
//! tokens ([`tokens`]) and its environment are those of OpenCue; frames are written in OpenCue's
//! way ([`range`]).

mod cjsl;
mod folder;
mod job;
mod opencue;
mod openjd;
mod order;
mod plan;
pub mod range;
mod reader;
mod run;
mod shell;
mod slurm;
pub mod tokens;

pub use cjsl::{Position, Refusal};
pub use folder::read_jobs;
pub use job::{Depend, DependKind, Job, JobError, Layer, LayerKind};
pub use opencue::{OpenCueError, opencue};
pub use openjd::openjd;
pub use plan::{Plan, PlanError, PlannedLayer, Selection, Task};
pub use run::{Fault, Outcome, RunEvent, RunOptions, RunWatch, Summary, check_logs, log_path, run};
pub use slurm::slurm;
