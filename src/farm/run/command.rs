//! One command: started, listened to, stopped if need be.

use super::log::{self, Sign};
use super::{Fault, RunEvent, RunOptions, RunWatch};
use crate::farm::plan::{Plan, Task};
use crate::pipeline::Event;
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};
use std::io::{self, Write};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

/// Between two looks at signals and clocks.
const LOOK: Duration = Duration::from_millis(50);
/// Signs of life that wait to be heard; a command that prints faster is slowed down.
const SIGNS: usize = 1000;
/// What a command has after the polite signal of a timeout.
const GRACE: Duration = Duration::from_secs(10);
/// How long the last words of a command that has ended are awaited.
const LAST_WORDS: Duration = Duration::from_secs(2);

/// How a command ended.
pub struct Ending {
    /// What went wrong, if anything did.
    pub fault: Option<Fault>,
    /// The signal that was passed on to it, if one was.
    pub signal: Option<i32>,
    /// Whether it said that nothing was to be done.
    pub up_to_date: bool,
}

impl Ending {
    /// The end of what could not begin.
    pub fn of(fault: Fault) -> Ending {
        Ending { fault: Some(fault), signal: None, up_to_date: false }
    }
}

/// Runs the command of a task to its end.
///
/// # Errors
/// It cannot be started, or its log not be opened.
pub fn run(
    plan: &Plan,
    options: &RunOptions,
    task: &Task,
    attempt: u32,
    log_path: &Path,
    watch: &mut dyn RunWatch,
) -> io::Result<Ending> {
    let layer = plan.layers[task.layer].layer;
    let no_log =
        |error: io::Error| io::Error::new(error.kind(), format!("{}: {error}", log_path.display()));
    let mut log = log::open(log_path, attempt).map_err(no_log)?;
    writeln!(log, "# attempt {attempt} in {}\n# {}", options.root.display(), task.command)
        .map_err(no_log)?;
    let mut last_line = log.try_clone()?;
    let (output, input) = io::pipe()?;
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let mut command = Command::new("sh");
    command
        .arg("-c")
        .arg(&task.command)
        .current_dir(&options.root)
        .envs(layer.env.iter().map(|(name, value)| (name, value)))
        .envs(plan.environment(task))
        .env("CUE_THREADS", threads.to_string())
        .env("CUE_LOG_PATH", options.logs.join(&plan.job.name))
        .env("CANDELABRA_PROGRESS", "json")
        .stdin(Stdio::null())
        .stdout(input.try_clone()?)
        .stderr(input)
        .process_group(0);
    let mut child = command.spawn().map_err(|error| {
        let why = format!("no command can be started in {}: {error}", options.root.display());
        io::Error::new(error.kind(), why)
    })?;
    // The writing ends in `command` would keep the pipe open.
    drop(command);
    let group = Group(Pid::from_child(&child));
    let (sender, signs) = mpsc::sync_channel(SIGNS);
    thread::spawn(move || log::copy(output, log, &sender));

    let mut listener = Listener { task, watch, made: false, kept: false, lost: None };
    let (began, mut heard) = (Instant::now(), Instant::now());
    let (mut signal, mut overdue) = (None, None::<(Fault, Instant)>);
    while !group.has_ended() {
        match signs.recv_timeout(LOOK) {
            Ok(sign) => {
                heard = Instant::now();
                listener.hear(sign);
            }
            // The command has closed its outputs: it is about to end, or works on in silence.
            Err(RecvTimeoutError::Disconnected) => thread::sleep(LOOK / 10),
            Err(RecvTimeoutError::Timeout) => {}
        }
        if let Some(number) = listener.watch.take_signal() {
            match signal.replace(number) {
                None => group.send(Signal::from_named_raw(number).unwrap_or(Signal::TERM)),
                // A terminal that closes sends it twice.
                Some(_) if number == Signal::HUP.as_raw() => {}
                Some(_) => group.send(Signal::KILL),
            }
        }
        match &overdue {
            None => {
                overdue = late(layer, began, heard).map(|fault| (fault, Instant::now()));
                if overdue.is_some() {
                    group.send(Signal::TERM);
                }
            }
            Some((_, since)) if since.elapsed() > GRACE => group.send(Signal::KILL),
            Some(_) => {}
        }
    }
    // What the command has left running goes with it. Only then is its number given back.
    group.send(Signal::KILL);
    let status = child.wait()?;
    listener.hear_out(&signs);
    let fault = match (overdue, status.code(), status.signal()) {
        (Some((fault, _)), _, _) => Some(fault),
        (None, Some(0), _) => listener.lost.take().map(Fault::System),
        (None, Some(code), _) => Some(Fault::Code(code)),
        (None, None, signal) => Some(Fault::Signal(signal.unwrap_or(0))),
    };
    let end = fault.as_ref().map_or("done".into(), Fault::to_string);
    // The log may be what failed.
    let _ = writeln!(last_line, "# {end}");
    Ok(Ending { fault, signal, up_to_date: listener.kept && !listener.made })
}

/// Whether a command has used up its time.
fn late(layer: &crate::farm::Layer, began: Instant, heard: Instant) -> Option<Fault> {
    let is_over =
        |minutes: &u64, since: Instant| since.elapsed() >= Duration::from_secs(minutes * 60);
    let timeout =
        layer.timeout_minutes.filter(|minutes| is_over(minutes, began)).map(Fault::Timeout);
    let silence =
        layer.silence_minutes.filter(|minutes| is_over(minutes, heard)).map(Fault::Silence);
    timeout.or(silence)
}

/// Passes on what a command tells, and remembers what it means.
struct Listener<'a> {
    task: &'a Task,
    watch: &'a mut dyn RunWatch,
    /// Whether something was made.
    made: bool,
    /// Whether something was up to date.
    kept: bool,
    /// Why the log is not whole.
    lost: Option<String>,
}

impl Listener<'_> {
    fn hear(&mut self, sign: Sign) {
        match sign {
            Sign::Line => {}
            Sign::Lost(error) => self.lost = Some(format!("its log cannot be written: {error}")),
            Sign::Told(event) => {
                self.made |= matches!(event, Event::FrameDone { .. } | Event::FrameFailed { .. });
                self.kept |= matches!(event, Event::UpToDate { .. });
                self.watch.tell(RunEvent::Told { task: self.task, event: &event });
            }
        }
    }

    /// Hears the rest. A process that has left the group may keep the pipe open for ever.
    fn hear_out(&mut self, signs: &Receiver<Sign>) {
        let end = Instant::now() + LAST_WORDS;
        while let left = end.saturating_duration_since(Instant::now())
            && !left.is_zero()
            && let Ok(sign) = signs.recv_timeout(left)
        {
            self.hear(sign);
        }
    }
}

/// The process group of a command, which its first process leads.
struct Group(Pid);

impl Group {
    /// Whether the leader has ended. It is not waited for, so that its number stays its own.
    fn has_ended(&self) -> bool {
        let look = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        // An error means that there is no such child.
        waitid(WaitId::Pid(self.0), look).map_or(true, |status| status.is_some())
    }

    fn send(&self, signal: Signal) {
        // A group that is gone needs no signal.
        let _ = kill_process_group(self.0, signal);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::Layer;

    #[test]
    fn a_command_is_late_when_it_takes_too_long_or_is_silent_too_long() {
        let layer = |timeout_minutes, silence_minutes| Layer {
            timeout_minutes,
            silence_minutes,
            ..Layer::example()
        };
        // A clock that has run for three minutes.
        let began = Instant::now();
        let ago = |minutes: u64| began.checked_sub(Duration::from_secs(minutes * 60)).unwrap();
        assert_eq!(late(&layer(None, None), ago(3), ago(3)), None);
        assert_eq!(late(&layer(Some(4), Some(2)), ago(3), ago(1)), None);
        assert_eq!(late(&layer(Some(3), None), ago(3), ago(0)), Some(Fault::Timeout(3)));
        assert_eq!(late(&layer(Some(4), Some(2)), ago(3), ago(2)), Some(Fault::Silence(2)));
    }
}
