//! How a run is shown: bars of the layers on a terminal, lines elsewhere, marks for programs.

use crate::display::{Form, LONGEST_SILENCE};
use crate::stderr::say;
use crate::stop::signals;
use anyhow::Result;
use candelabra::farm::{Fault, Outcome, Plan, RunEvent, RunWatch, Task, range};
use candelabra::page::Plain;
use candelabra::pipeline::Event;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;
use std::fmt::Display as Show;
use std::io::{self, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Parts of a frame that a bar shows.
const PARTS: f64 = 1000.0;

/// Shows a run and hears signals.
pub struct Display {
    form: Form,
    /// Whether lines are printed in place of bars.
    is_plain: bool,
    signal: Arc<AtomicUsize>,
    bars: MultiProgress,
    layers: Vec<LayerBar>,
    /// Frames of all tasks, of those that have ended, of the running one, and the part of these that is done.
    all: usize,
    ended: usize,
    running: usize,
    part: f64,
    /// When the running task was started, and when something was said last.
    began: Instant,
    said: Instant,
    percent: Option<u64>,
}

impl Display {
    /// A display for so many frames; [`signals`] are heard from now on. They end nothing: the running command
    /// has to be stopped first.
    pub fn new(form: Form, frames: usize) -> Result<Display> {
        let is_plain = form == Form::Auto && !io::stderr().is_terminal();
        let signal = Arc::new(AtomicUsize::new(0));
        for number in signals() {
            signal_hook::flag::register_usize(number, signal.clone(), number as usize)?;
        }
        let (began, said) = (Instant::now(), Instant::now());
        Ok(Display {
            form,
            is_plain,
            signal,
            bars: match form {
                Form::Auto if !is_plain => MultiProgress::new(),
                _ => MultiProgress::with_draw_target(ProgressDrawTarget::hidden()),
            },
            layers: Vec::new(),
            all: frames,
            ended: 0,
            running: 0,
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
        match self.form {
            Form::Auto if self.is_plain => self.line(format_args!("{job}: {}", layers.join(", "))),
            Form::Json => self.line(json!({"event": "job-started", "job": job, "layers": layers})),
            _ => {}
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
        match (is_done, self.form) {
            (false, _) => summary.lines().for_each(|line| self.complain(line)),
            (true, Form::Auto) => self.line(summary),
            (true, _) => {}
        }
    }

    /// A line on standard output. A closed pipe (`| head`) stops no run.
    fn line(&mut self, text: impl Show) {
        self.said = Instant::now();
        self.bars.suspend(|| {
            let mut out = io::stdout().lock();
            let _ = writeln!(out, "{}", Plain(text)).and_then(|()| out.flush());
        });
    }

    /// A line on standard error.
    fn complain(&self, text: impl Show) {
        self.bars.suspend(|| say(text));
    }

    /// How much of all is done, from 0 to 1.
    fn done(&self) -> f64 {
        (self.ended as f64 + self.part * self.running as f64) / self.all.max(1) as f64
    }

    /// How far all is, in the words of a protocol, if one is spoken. In JSON it is the event of our other programs,
    /// so a run in a run is understood.
    fn mark(&self) -> Option<String> {
        let done = self.done();
        let percent = (100.0 * done) as u64;
        match self.form {
            Form::Alfred => Some(format!("ALF_PROGRESS {percent}%")),
            Form::Openjd => Some(format!("openjd_progress: {percent}")),
            Form::Json => serde_json::to_string(&Event::Progress { done, frame: None }).ok(),
            Form::Auto | Form::None => None,
        }
    }

    /// Tells how far all is, if that is another percent than before.
    fn percent(&mut self) {
        let percent = (100.0 * self.done()) as u64;
        if self.percent.replace(percent) != Some(percent)
            && let Some(mark) = self.mark()
        {
            self.line(mark);
        }
    }

    fn started(&mut self, task: &Task, attempt: u32, log: &std::path::Path) {
        (self.began, self.running, self.part) = (Instant::now(), task.frames.len(), 0.0);
        let (name, frames) = (&task.name, range::format(&task.frames));
        match self.form {
            Form::Auto if self.is_plain => self.line(format_args!("{name}: frames {frames}")),
            Form::Openjd => self.line(format_args!("openjd_status: {name}")),
            Form::Json => self.line(json!({
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
        if self.form == Form::Json {
            self.line(json!({"event": "task-told", "task": task.name, "told": event}));
        }
        self.show(task, event);
        self.percent();
        self.heartbeat();
    }

    /// Moves the bar of a layer, or tells of a frame.
    fn show(&mut self, task: &Task, event: &Event) {
        let Some(layer) = self.layers.get(task.layer) else { return };
        match event {
            Event::Progress { frame, .. } => {
                let frame = frame.map_or(String::new(), |frame| format!("frame {frame}, "));
                let left = layer.advance(self.part * task.frames.len() as f64);
                layer.bar.set_message(format!("{frame}{left}"));
            }
            Event::Stage { name } => layer.bar.set_message(name.clone()),
            Event::FrameDone { frame, seconds, .. } if self.is_plain => {
                let left = layer.advance(self.part * task.frames.len() as f64);
                self.line(format_args!("  frame {frame} in {seconds:.1} s, {left}"));
            }
            Event::FrameFailed { frame, why } if self.is_plain => {
                self.line(format_args!("  frame {frame} failed: {why}"));
            }
            _ => {}
        }
    }

    fn again(&mut self, task: &Task, fault: &Fault) {
        match self.form {
            Form::Json => self.line(json!({
                "event": "task-failed", "task": task.name, "why": fault.to_string(), "again": true,
            })),
            Form::None => {}
            _ => self.complain(format_args!("{}: {fault}; once more", task.name)),
        }
    }

    fn ended(&mut self, task: &Task, outcome: &Outcome) {
        (self.ended, self.running, self.part) = (self.ended + task.frames.len(), 0, 0.0);
        let (code, text) = match outcome {
            Outcome::Done { up_to_date: true } => ("up-to-date", "up to date".into()),
            Outcome::Done { .. } => ("done", format!("done in {}", time(self.began.elapsed()))),
            Outcome::Failed(fault) => ("failed", format!("failed: {fault}")),
            Outcome::Blocked { by } => ("blocked", format!("not run, {by} has failed")),
            Outcome::Stopped => ("stopped", "stopped".into()),
        };
        match self.form {
            Form::Auto if self.is_plain => self.line(format_args!("{}: {text}", task.name)),
            Form::Json => self.line(json!({
                "event": "task-ended", "task": task.name, "outcome": code, "text": text,
            })),
            _ => {}
        }
        if let Some(layer) = self.layers.get_mut(task.layer) {
            layer.end(task.frames.len(), outcome, text);
        }
        self.percent();
    }

    /// Says something if nothing was said for long.
    fn heartbeat(&mut self) {
        if self.said.elapsed() > LONGEST_SILENCE
            && let Some(sign) = self.sign_of_life()
        {
            self.line(sign);
        }
    }

    fn sign_of_life(&self) -> Option<String> {
        let (percent, minutes) = ((100.0 * self.part) as u64, time(self.began.elapsed()));
        let plain = || self.is_plain.then(|| format!("  {percent} % after {minutes}"));
        self.mark().or_else(plain)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_that_speaks_has_a_sign_of_life() {
        let sign = |form, is_plain| {
            let mut display = Display::new(form, 8).unwrap();
            (display.is_plain, display.ended, display.running, display.part) =
                (is_plain, 2, 4, 0.5);
            display.sign_of_life()
        };
        assert_eq!(sign(Form::Alfred, false).unwrap(), "ALF_PROGRESS 50%");
        assert_eq!(sign(Form::Openjd, false).unwrap(), "openjd_progress: 50");
        assert!(sign(Form::Auto, true).unwrap().starts_with("  50 % after "));
        let event: Event = serde_json::from_str(&sign(Form::Json, false).unwrap()).unwrap();
        assert_eq!(event, Event::Progress { done: 0.5, frame: None });
        // Bars are seen to live.
        assert_eq!((sign(Form::Auto, false), sign(Form::None, false)), (None, None));
    }
}
