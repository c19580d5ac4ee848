//! How a run is shown: bars of the layers on a terminal, lines elsewhere, marks for programs.

use anyhow::Result;
use candelabra::farm::{Fault, Outcome, Plan, RunEvent, RunWatch, Task, range};
use candelabra::page::Plain;
use candelabra::pipeline::Event;
use clap::ValueEnum;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use serde_json::json;
use std::fmt::Display as Show;
use std::io::{self, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// How progress is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Progress {
    /// Bars on a terminal, else lines
    Auto,
    /// A line when a task begins and ends, and at least one a minute
    Plain,
    /// Lines that Alfred and Tractor read: ALF_PROGRESS 42%
    Alfred,
    /// Lines that OpenJD reads: openjd_progress: 42
    Openjd,
    /// One JSON object a line
    Json,
    /// Nothing
    None,
}

/// Parts of a frame that a bar shows.
const PARTS: f64 = 1000.0;
/// The longest time without a line.
const SILENCE: Duration = Duration::from_secs(55);

/// Shows a run and hears signals.
pub struct Display {
    progress: Progress,
    signal: Arc<AtomicUsize>,
    bars: MultiProgress,
    layers: Vec<LayerBar>,
    /// Frames of all tasks, of those that have ended, and the part of those of the running one that is done.
    all: usize,
    ended: usize,
    part: f64,
    /// When the running task was started, and when something was said last.
    began: Instant,
    said: Instant,
    percent: Option<u64>,
}

impl Display {
    /// A display for all plans; SIGINT, SIGTERM and SIGHUP are heard from now on.
    pub fn new(progress: Progress, plans: &[Plan]) -> Result<Display> {
        let progress = match progress {
            Progress::Auto if !io::stderr().is_terminal() => Progress::Plain,
            other => other,
        };
        let signal = Arc::new(AtomicUsize::new(0));
        for number in
            [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM, signal_hook::consts::SIGHUP]
        {
            signal_hook::flag::register_usize(number, signal.clone(), number as usize)?;
        }
        let layers = plans.iter().flat_map(|plan| &plan.layers);
        let (began, said) = (Instant::now(), Instant::now());
        Ok(Display {
            progress,
            signal,
            bars: MultiProgress::new(),
            layers: Vec::new(),
            all: layers.map(|planned| planned.frames.len()).sum(),
            ended: 0,
            part: 0.0,
            began,
            said,
            percent: None,
        })
    }

    /// Begins a job.
    pub fn begin(&mut self, plan: &Plan) {
        let layers: Vec<_> =
            plan.layers.iter().map(|planned| planned.layer.name.as_str()).collect();
        let job = &plan.job.name;
        match self.progress {
            Progress::Plain => self.line(format_args!("{job}: {}", layers.join(", "))),
            Progress::Json => {
                self.line(json!({"event": "job-started", "job": job, "layers": layers}))
            }
            _ => {}
        }
        if self.progress != Progress::Auto {
            return;
        }
        let width = plan.layers.iter().map(|planned| planned.layer.name.len()).max().unwrap_or(0);
        let template = format!("{{prefix:{width}}} {{bar:30}} {{percent:>3}}% {{msg}}");
        let style = ProgressStyle::with_template(&template).unwrap_or(ProgressStyle::default_bar());
        for planned in &plan.layers {
            let length = planned.frames.len() as f64 * PARTS;
            let bar = self.bars.add(ProgressBar::new(length as u64).with_style(style.clone()));
            bar.set_prefix(planned.layer.name.clone());
            bar.tick();
            self.layers.push(LayerBar {
                bar,
                frames: planned.frames.len(),
                done: 0,
                trouble: None,
                began: None,
            });
        }
    }

    /// Ends a job with its summary.
    pub fn end(&mut self, summary: &str, is_done: bool) {
        for layer in self.layers.drain(..) {
            layer.bar.abandon();
        }
        match (is_done, self.progress) {
            (false, _) => summary.lines().for_each(|line| eprintln!("{}", Plain(line))),
            (true, Progress::Auto | Progress::Plain) => self.line(summary),
            (true, _) => {}
        }
    }

    /// A line on standard output. A closed pipe (`| head`) stops no run.
    fn line(&mut self, text: impl Show) {
        self.said = Instant::now();
        let mut out = io::stdout().lock();
        let _ = writeln!(out, "{}", Plain(text)).and_then(|()| out.flush());
    }

    /// Tells how far all is, if that is another percent than before.
    fn percent(&mut self, task: &Task) {
        let done = (self.ended as f64 + self.part * task.frames.len() as f64) / self.all as f64;
        let percent = (100.0 * done) as u64;
        if self.percent.replace(percent) != Some(percent) {
            match self.progress {
                Progress::Alfred => self.line(format_args!("ALF_PROGRESS {percent}%")),
                Progress::Openjd => self.line(format_args!("openjd_progress: {percent}")),
                _ => {}
            }
        }
    }

    fn started(&mut self, task: &Task, attempt: u32, log: &std::path::Path) {
        (self.began, self.part) = (Instant::now(), 0.0);
        let (name, frames) = (&task.name, range::format(&task.frames));
        match self.progress {
            Progress::Plain => self.line(format_args!("{name}: frames {frames}")),
            Progress::Openjd => self.line(format_args!("openjd_status: {name}")),
            Progress::Json => self.line(json!({
                "event": "task-started", "task": name, "frames": frames, "attempt": attempt, "log": log,
            })),
            _ => {}
        }
        if let Some(layer) = self.layers.get_mut(task.layer) {
            layer.began.get_or_insert_with(Instant::now);
            layer.bar.set_message(format!("frames {frames}"));
        }
    }

    fn told(&mut self, task: &Task, event: &Event) {
        if let Event::Progress { done, .. } = event {
            self.part = done.clamp(0.0, 1.0);
        }
        if self.progress == Progress::Json {
            self.line(json!({"event": "task-told", "task": task.name, "told": event}));
        }
        self.show(task, event);
        self.percent(task);
        self.heartbeat();
    }

    /// Moves the bar of a layer.
    fn show(&self, task: &Task, event: &Event) {
        let Some(layer) = self.layers.get(task.layer) else { return };
        match event {
            Event::Progress { frame, .. } => {
                let frame = frame.map_or(String::new(), |frame| format!("frame {frame}, "));
                let left = layer.advance(self.part * task.frames.len() as f64);
                layer.bar.set_message(format!("{frame}{left}"));
            }
            Event::Stage { name } => layer.bar.set_message(name.clone()),
            _ => {}
        }
    }

    fn again(&mut self, task: &Task, fault: &Fault) {
        match self.progress {
            Progress::Json => self.line(json!({
                "event": "task-failed", "task": task.name, "why": fault.to_string(), "again": true,
            })),
            Progress::None => {}
            _ => eprintln!("{}: {}; once more", task.name, Plain(fault)),
        }
    }

    fn ended(&mut self, task: &Task, outcome: &Outcome) {
        (self.ended, self.part) = (self.ended + task.frames.len(), 0.0);
        let (code, text) = match outcome {
            Outcome::Done { up_to_date: true } => ("up-to-date", "up to date".into()),
            Outcome::Done { .. } => ("done", format!("done in {}", time(self.began.elapsed()))),
            Outcome::Failed(fault) => ("failed", format!("failed: {fault}")),
            Outcome::Blocked { by } => ("blocked", format!("not run, {by} has failed")),
            Outcome::Stopped => ("stopped", "stopped".into()),
        };
        match self.progress {
            Progress::Plain => self.line(format_args!("{}: {text}", task.name)),
            Progress::Json => self.line(json!({
                "event": "task-ended", "task": task.name, "outcome": code, "text": text,
            })),
            _ => {}
        }
        if let Some(layer) = self.layers.get_mut(task.layer) {
            layer.end(task.frames.len(), outcome, text);
        }
        self.percent(task);
    }

    /// Says something if nothing was said for long.
    fn heartbeat(&mut self) {
        if self.said.elapsed() > SILENCE {
            let (percent, minutes) = ((100.0 * self.part) as u64, time(self.began.elapsed()));
            match self.progress {
                Progress::Plain => self.line(format_args!("  {percent} % after {minutes}")),
                Progress::Openjd => {
                    self.line(format_args!("openjd_status: {percent} % after {minutes}"))
                }
                Progress::Alfred => {
                    self.line(format_args!("ALF_PROGRESS {}%", self.percent.unwrap_or(0)))
                }
                _ => {}
            }
        }
    }
}

/// The bar of a layer.
struct LayerBar {
    bar: ProgressBar,
    frames: usize,
    /// Frames of tasks that have ended well, and what is said of those that have not.
    done: usize,
    trouble: Option<String>,
    began: Option<Instant>,
}

impl LayerBar {
    /// Ends a task of so many frames.
    fn end(&mut self, frames: usize, outcome: &Outcome, text: String) {
        match outcome {
            Outcome::Done { .. } => self.done += frames,
            _ => self.trouble = Some(text.clone()),
        }
        let left = self.advance(0.0);
        let whole = match (outcome, self.began) {
            (Outcome::Done { up_to_date: false }, Some(began)) => {
                format!("done in {}", time(began.elapsed()))
            }
            _ => text,
        };
        let message = if self.done < self.frames { left } else { whole };
        self.bar.set_message(self.trouble.clone().unwrap_or(message));
    }

    /// Moves the bar to so many frames beyond those that are done; says what time is left.
    fn advance(&self, frames: f64) -> String {
        let done = self.done as f64 + frames;
        self.bar.set_position((done * PARTS) as u64);
        match self.began {
            Some(began) if done > 0.0 => {
                let left = began.elapsed().mul_f64((self.frames as f64 / done - 1.0).max(0.0));
                format!("{} left", time(left))
            }
            _ => String::new(),
        }
    }
}

impl RunWatch for Display {
    fn tell(&mut self, event: RunEvent) {
        match event {
            RunEvent::Started { task, attempt, log } => self.started(task, attempt, log),
            RunEvent::Told { task, event } => self.told(task, event),
            RunEvent::Again { task, fault } => self.again(task, fault),
            RunEvent::Ended { task, outcome } => self.ended(task, outcome),
        }
    }

    fn take_signal(&mut self) -> Option<i32> {
        self.heartbeat();
        let signal = self.signal.swap(0, Ordering::SeqCst);
        (signal != 0).then_some(signal as i32)
    }
}

/// A time to be read: `3 s`, `2:05`, `1:02:03`.
fn time(time: Duration) -> String {
    let seconds = time.as_secs();
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, seconds) => format!("{seconds} s"),
        (0, minutes, seconds) => format!("{minutes}:{seconds:02}"),
        (hours, minutes, seconds) => format!("{hours}:{minutes:02}:{seconds:02}"),
    }
}
