//! What the user or the farm sees of a job: bars, lines, or a protocol.

use crate::stderr::say;
use crate::stop::Stop;
use candelabra::page::Plain;
use candelabra::pipeline::{Audit, Event, FrameNoise, Watch};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How progress is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Form {
    /// A bar with the time left on a terminal; elsewhere a line for each frame, and at least one a minute
    #[default]
    Auto,
    /// ALF_PROGRESS lines, as Alfred, Tractor and what imitates them read
    Alfred,
    /// openjd_progress and openjd_status lines, as Open Job Description sessions read
    Openjd,
    /// Every event as a JSON object on a line of its own
    Json,
    /// Nothing but notes and errors
    None,
}

/// The option that chooses one.
#[derive(Args, Clone, Copy, Debug)]
pub struct Progress {
    /// How progress is shown
    #[arg(
        long = "progress",
        value_enum,
        default_value_t,
        env = "CANDELABRA_PROGRESS",
        value_name = "FORM"
    )]
    pub form: Form,
}

/// Farms take a silent program for a dead one.
pub const LONGEST_SILENCE: Duration = Duration::from_secs(55);
/// Steps of a bar.
const STEPS: u64 = 10_000;

/// Shows the events of a job.
pub struct Display {
    shared: Arc<Shared>,
    heart: Option<(Sender<()>, JoinHandle<()>)>,
    stop: Stop,
}

struct Shared {
    form: Form,
    bar: ProgressBar,
    state: Mutex<State>,
}

struct State {
    started: Instant,
    /// When anything was printed last.
    spoke: Instant,
    done: f64,
    /// What is being done.
    doing: String,
    /// What was told last: a percentage.
    told: u64,
}

impl Display {
    /// A display that hears when the job should stop.
    pub fn new(Progress { form }: Progress, stop: &Stop) -> Display {
        let bar = match form == Form::Auto && std::io::stderr().is_terminal() {
            true => ProgressBar::new(STEPS),
            false => ProgressBar::hidden(),
        };
        let template = "{msg} {wide_bar} {percent}% {elapsed} elapsed, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        let now = Instant::now();
        let state = State { started: now, spoke: now, done: 0.0, doing: String::new(), told: 0 };
        let shared = Arc::new(Shared { form, bar, state: Mutex::new(state) });
        let speaks = form != Form::None && shared.bar.is_hidden();
        let heart = speaks.then(|| beat(shared.clone()));
        Display { shared, heart, stop: stop.clone() }
    }
}

/// A thread that speaks when nothing else has for long.
fn beat(shared: Arc<Shared>) -> (Sender<()>, JoinHandle<()>) {
    let (sender, receiver) = channel::<()>();
    let thread = std::thread::spawn(move || {
        while receiver.recv_timeout(Duration::from_secs(1)) == Err(RecvTimeoutError::Timeout) {
            let state = shared.state();
            if state.spoke.elapsed() >= LONGEST_SILENCE {
                shared.speak_up(state);
            }
        }
    });
    (sender, thread)
}

impl Drop for Display {
    fn drop(&mut self) {
        self.shared.bar.finish_and_clear();
        if let Some((sender, thread)) = self.heart.take() {
            drop(sender);
            let _ = thread.join();
        }
    }
}

impl Watch for Display {
    fn tell(&self, event: Event) {
        self.shared.tell(event);
    }

    fn is_stopped(&self) -> bool {
        self.stop.signal().is_some()
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn tell(&self, event: Event) {
        let mut state = self.state();
        let mut is_news = true;
        match &event {
            Event::Stage { name } => {
                is_news = state.doing != *name;
                state.doing.clone_from(name);
            }
            Event::Progress { done, frame } => {
                state.done = *done;
                if let Some(frame) = frame {
                    state.doing = format!("frame {frame}");
                }
                let percent = (done * 100.0) as u64;
                is_news = percent != state.told;
                state.told = percent;
            }
            _ => {}
        }
        self.bar.set_message(state.doing.clone());
        self.bar.set_position((state.done * STEPS as f64) as u64);
        match self.form {
            Form::None => {}
            Form::Json if is_news => {
                self.out(&mut state, &serde_json::to_string(&event).unwrap_or_default());
            }
            Form::Alfred if is_news && matches!(event, Event::Progress { .. }) => {
                let line = format!("ALF_PROGRESS {}%", state.told);
                self.out(&mut state, &line);
            }
            Form::Openjd if is_news => self.tell_openjd(&mut state, &event),
            _ => {}
        }
        if matches!(self.form, Form::Auto | Form::Alfred | Form::Openjd)
            && let Some(line) = line_of(&event)
        {
            self.out(&mut state, &line);
        }
        self.tell_trouble(&event);
    }

    fn tell_openjd(&self, state: &mut State, event: &Event) {
        match event {
            Event::Progress { .. } => self.out(state, &format!("openjd_progress: {}", state.told)),
            Event::Stage { name } => self.out(state, &format!("openjd_status: {name}")),
            _ => {}
        }
    }

    /// Notes and failures, which go to standard error whatever the form.
    fn tell_trouble(&self, event: &Event) {
        let text = match event {
            Event::Note { text } => format!("note: {text}"),
            Event::FrameFailed { frame, why } => format!("frame {frame}: failed: {why}"),
            _ => return,
        };
        self.bar.suspend(|| say(text));
    }

    /// Says how far the job is, in a line that no event asks for.
    fn speak_up(&self, mut state: MutexGuard<State>) {
        let percent = (state.done * 100.0) as u64;
        let line = match self.form {
            Form::Alfred => format!("ALF_PROGRESS {percent}%"),
            Form::Openjd => format!("openjd_progress: {percent}"),
            Form::Json => {
                let event = Event::Progress { done: state.done, frame: None };
                serde_json::to_string(&event).unwrap_or_default()
            }
            Form::Auto | Form::None => {
                let elapsed_s = state.started.elapsed().as_secs_f64();
                let left = match state.done > 0.0 {
                    true => {
                        let left_s = elapsed_s * (1.0 / state.done - 1.0);
                        format!(", about {:.0} min left", (left_s / 60.0).ceil())
                    }
                    false => String::new(),
                };
                format!("{}: {percent} % of the job{left}", state.doing)
            }
        };
        self.out(&mut state, &line);
    }

    /// Prints a line on standard output. A closed pipe (`| head`) does not stop the job.
    fn out(&self, state: &mut State, line: &str) {
        state.spoke = Instant::now();
        self.bar.suspend(|| {
            let mut out = std::io::stdout().lock();
            let _ = writeln!(out, "{}", Plain(line)).and_then(|()| out.flush());
        });
    }
}

/// What a person reads of an event.
fn line_of(event: &Event) -> Option<String> {
    match event {
        Event::FrameDone { frame, seconds, rays, light_picks, noise, output } => Some(format!(
            "frame {frame}: {seconds:.2} s, {:.2} million rays a second, {light_picks} light picks \
             -> {}{}",
            *rays as f64 / seconds / 1e6,
            output.display(),
            noise.map(|noise| format!("; {}", told(&noise))).unwrap_or_default(),
        )),
        Event::UpToDate { frame: Some(frame), output } => {
            Some(format!("frame {frame}: {} is up to date", output.display()))
        }
        _ => None,
    }
}

/// What a person reads of a frame's noise.
fn told(noise: &FrameNoise) -> String {
    let FrameNoise { error, bound, decibels, samples, most, capped, spoilt, .. } = *noise;
    let asked = noise.asked.map(|asked| format!("{asked} asked; ")).unwrap_or_default();
    let mut text = format!(
        "error {error:.4}, at most {bound:.4} with 95 % certainty ({asked}{decibels:.1} dB); \
         {samples:.0} samples a pixel, {most} at most"
    );
    if capped > 0 {
        text +=
            &format!("; {capped} pixels have as many as they may and are not settled (--max-spp)");
    }
    if spoilt > 0 {
        text += &format!("; {spoilt} pixels cannot be judged: samples were infinite or no number");
    }
    if let Some(Audit { pixels, error, from, to }) = noise.audit {
        text += &format!(
            "; audit: {error:.4}, {from:.4} to {to:.4} with 95 % certainty, by {pixels} pixels \
             rendered again"
        );
    }
    text
}
