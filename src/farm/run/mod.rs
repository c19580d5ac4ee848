//! Carrying out a plan on this machine: one command after another.
//!
//! A command is run by `sh -c` with OpenCue's environment, as RQD does, in the job's root. It has a process
//! group of its own; when the command ends, what it has left running in there is killed. All that it prints
//! goes to the log of its task, `LOGS/JOB/1001-render.rqlog`; lines that are [`Event`]s are told to the
//! [`RunWatch`] and logged in words. Commands use all cores themselves, so two at a time would gain nothing,
//! and `CUE_THREADS` is the machine's cores, whatever a layer reserves on a farm.
//!
//! A task that fails does not stop those that do not wait for it. A signal is passed on to the command, and
//! what it makes of that is awaited; a second one kills it. The clock is read for timeouts alone.

mod command;
mod log;

use super::job::{DependKind, JobError};
use super::plan::{Plan, Task};
use crate::pipeline::Event;
use command::Ending;
use std::collections::{HashMap, HashSet};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// How a plan is carried out.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// The folder in which the commands run.
    pub root: PathBuf,
    /// The folder of the logs; each job has a folder in there.
    pub logs: PathBuf,
    /// How often a task that fails is tried again. One that ends with 2 (usage) is not.
    pub retries: u32,
}

/// What happens in a run.
#[derive(Debug)]
pub enum RunEvent<'a> {
    /// A command is started, for the first time or again.
    Started {
        /// Which task.
        task: &'a Task,
        /// Counted from one.
        attempt: u32,
        /// Where its output goes.
        log: &'a Path,
    },
    /// A command tells something.
    Told {
        /// Of which task.
        task: &'a Task,
        /// What.
        event: &'a Event,
    },
    /// A command has failed and is tried again.
    Again {
        /// Of which task.
        task: &'a Task,
        /// Why.
        fault: &'a Fault,
    },
    /// Nothing more happens to a task.
    Ended {
        /// Which one.
        task: &'a Task,
        /// How it ended.
        outcome: &'a Outcome,
    },
}

/// Follows a run, and may stop it.
pub trait RunWatch {
    /// Takes notice of an event.
    fn tell(&mut self, event: RunEvent);

    /// A signal that has come since this was asked last, by its number.
    fn take_signal(&mut self) -> Option<i32>;
}

/// How a task ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Well.
    Done {
        /// Whether the command said that nothing was to be done.
        up_to_date: bool,
    },
    /// Badly, at the last attempt.
    Failed(Fault),
    /// It was not started, since a layer that it waits for has failed.
    Blocked {
        /// That layer.
        by: String,
    },
    /// The run was stopped before or while it was carried out.
    Stopped,
}

/// Why a command failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// It ended with a code other than 0.
    Code(i32),
    /// A signal killed it.
    Signal(i32),
    /// It took longer than its layer allows, in minutes.
    Timeout(u64),
    /// It said nothing for longer than its layer allows, in minutes.
    Silence(u64),
    /// It could not be started, or its log not be written.
    System(String),
}

impl Fault {
    /// Whether another attempt would end alike: a usage error.
    fn is_final(&self) -> bool {
        matches!(self, Fault::Code(2))
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Fault::Code(code) => write!(f, "exit code {code}"),
            Fault::Signal(signal) => write!(f, "killed by signal {signal}"),
            Fault::Timeout(minutes) => write!(f, "stopped after {minutes} minutes (timeout)"),
            Fault::Silence(minutes) => {
                write!(f, "stopped after {minutes} silent minutes (timeout_llu)")
            }
            Fault::System(why) => f.write_str(why),
        }
    }
}

/// What came of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Every task with its end, in order.
    pub tasks: Vec<(Task, Outcome)>,
    /// The signal that stopped the run, if one did.
    pub signal: Option<i32>,
}

impl Summary {
    /// Whether all was done.
    pub fn is_done(&self) -> bool {
        self.tasks.iter().all(|(_, outcome)| matches!(outcome, Outcome::Done { .. }))
    }
}

/// Checks that each job has a folder of its own for its logs.
///
/// # Errors
/// [`JobError::SameName`], of the first that has not.
pub fn check_logs(runs: &[(Plan, RunOptions)]) -> Result<(), JobError> {
    let mut folders = HashMap::new();
    for (plan, options) in runs {
        let (name, path) = (&plan.job.name, &plan.job.path);
        if let Some(other) = folders.insert(options.logs.join(name), path) {
            let (name, path, other) = (name.clone(), path.clone(), other.clone());
            return Err(JobError::SameName { name, path, other });
        }
    }
    Ok(())
}

/// The log of a task.
pub fn log_path(options: &RunOptions, plan: &Plan, task: &Task) -> PathBuf {
    options.logs.join(&plan.job.name).join(format!("{}.rqlog", task.name))
}

/// Carries out a plan. What fails is in the summary.
///
/// # Errors
/// The folder of the logs cannot be made; nothing has been started then.
pub fn run(plan: &Plan, options: &RunOptions, watch: &mut dyn RunWatch) -> io::Result<Summary> {
    let logs = options.logs.join(&plan.job.name);
    std::fs::create_dir_all(&logs)
        .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", logs.display())))?;
    let mut summary = Summary::default();
    let mut missed = vec![HashSet::new(); plan.layers.len()];
    for task in plan.tasks() {
        summary.signal = summary.signal.or_else(|| watch.take_signal());
        let outcome = if summary.signal.is_some() {
            Outcome::Stopped
        } else if let Some(by) = blocker(plan, &task, &missed) {
            Outcome::Blocked { by }
        } else {
            attempt(plan, options, &task, watch, &mut summary.signal)
        };
        if !matches!(outcome, Outcome::Done { .. }) {
            missed[task.layer].extend(task.frames.iter().copied());
        }
        watch.tell(RunEvent::Ended { task: &task, outcome: &outcome });
        summary.tasks.push((task, outcome));
    }
    Ok(summary)
}

/// The layer because of which a task cannot be carried out, given the frames that each layer has not made.
fn blocker(plan: &Plan, task: &Task, missed: &[HashSet<i32>]) -> Option<String> {
    let is_missed = |&&(on, kind): &&(usize, DependKind)| match kind {
        DependKind::LayerOnLayer => !missed[on].is_empty(),
        DependKind::FrameByFrame => task.frames.iter().any(|frame| missed[on].contains(frame)),
    };
    let waits = &plan.layers[task.layer].waits;
    waits.iter().find(is_missed).map(|&(on, _)| plan.layers[on].layer.name.clone())
}

fn attempt(
    plan: &Plan,
    options: &RunOptions,
    task: &Task,
    watch: &mut dyn RunWatch,
    stopped: &mut Option<i32>,
) -> Outcome {
    let log = log_path(options, plan, task);
    for attempt in 1.. {
        watch.tell(RunEvent::Started { task, attempt, log: &log });
        let ending = command::run(plan, options, task, attempt, &log, watch);
        let Ending { fault, signal, up_to_date } =
            ending.unwrap_or_else(|error| Ending::of(Fault::System(error.to_string())));
        match fault {
            None => {
                *stopped = signal;
                return Outcome::Done { up_to_date };
            }
            Some(_) if signal.is_some() => {
                *stopped = signal;
                return Outcome::Stopped;
            }
            Some(fault) if attempt > options.retries || fault.is_final() => {
                return Outcome::Failed(fault);
            }
            Some(fault) => watch.tell(RunEvent::Again { task, fault: &fault }),
        }
    }
    Outcome::Stopped
}
