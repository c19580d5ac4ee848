//! Where the time of a job goes, and when it is over.

use super::report::Seconds;
use std::time::{Duration, Instant};

/// A clock whose laps are added to one account or another.
pub(super) struct Clock {
    started: Instant,
    lap: Instant,
    seconds: Seconds,
}

impl Clock {
    pub fn start() -> Clock {
        let now = Instant::now();
        Clock { started: now, lap: now, seconds: Seconds::default() }
    }

    /// When the job started.
    pub fn started(&self) -> Instant {
        self.started
    }

    /// Ends a lap, adds it to an account, and returns how long it was in seconds.
    pub fn lap(&mut self, account: impl FnOnce(&mut Seconds) -> &mut f64) -> f64 {
        let now = Instant::now();
        let lap = (now - self.lap).as_secs_f64();
        *account(&mut self.seconds) += lap;
        self.lap = now;
        lap
    }

    /// All accounts, with the time since the start.
    pub fn finish(mut self) -> Seconds {
        self.seconds.total = self.started.elapsed().as_secs_f64();
        self.seconds
    }
}

/// When a frame is to be done, and how many samples fit until then.
pub(super) struct Deadline {
    /// When the picture is to be on the disk.
    at: Instant,
    /// Seconds that the frame has.
    seconds: f64,
    /// Seconds that are kept for writing it.
    reserve: f64,
    pass: Option<(Instant, u64)>,
    /// Samples a second in the last pass.
    rate: f64,
}

/// A pass takes this share of the time that is left: how long samples take is not known well.
const SHARE: f64 = 0.6;
/// The frame is done when less than this share of its time is left.
const LEFT: f64 = 0.015;
/// It is interrupted where it is beyond its time by this share.
const BEYOND: f64 = 0.01;
/// Nothing is said of a frame that is late by a smaller share.
const TOLERATED: f64 = 0.03;

impl Deadline {
    /// A frame that has some seconds, until `at`, of which `reserve` are kept for writing it.
    pub fn new(at: Instant, seconds: f64, reserve: f64) -> Deadline {
        Deadline { at, seconds, reserve, pass: None, rate: 0.0 }
    }

    /// When rendering is interrupted whatever is missing.
    pub fn latest(&self) -> Instant {
        let slack = BEYOND * self.seconds - self.reserve;
        match slack >= 0.0 {
            true => self.at + Duration::from_secs_f64(slack),
            false => self.at.checked_sub(Duration::from_secs_f64(-slack)).unwrap_or(self.at),
        }
    }

    /// How late it may be without a word, seconds.
    pub fn tolerance(&self) -> f64 {
        TOLERATED * self.seconds
    }

    /// Whether it should have been interrupted.
    pub fn is_over(&self) -> bool {
        Instant::now() >= self.latest()
    }

    fn left(&self) -> f64 {
        let now = Instant::now();
        let until = self.at.saturating_duration_since(now).as_secs_f64();
        until - self.reserve
    }

    /// Whether it is known how long samples take.
    pub fn knows_rate(&self) -> bool {
        self.rate > 0.0
    }

    /// A pass begins, with so many samples taken.
    pub fn begin(&mut self, samples: u64) {
        self.pass = Some((Instant::now(), samples));
    }

    /// It ends.
    pub fn end(&mut self, samples: u64) {
        if let Some((began, before)) = self.pass.take() {
            let seconds = began.elapsed().as_secs_f64();
            if samples > before && seconds > 0.0 {
                self.rate = (samples - before) as f64 / seconds;
            }
        }
    }

    /// How many samples the next pass may have; `None` if the time is over.
    pub fn samples_of_next_pass(&self) -> Option<f64> {
        let left = self.left();
        (left > LEFT * self.seconds).then_some(SHARE * left * self.rate)
    }

    /// How many samples fit into what is left at a rate, samples a second.
    pub fn samples_at(&self, rate: f64) -> f64 {
        rate * self.left().max(0.0)
    }

    /// How many samples there will be in the end, if that is known.
    pub fn expected(&self, taken: u64) -> Option<u64> {
        self.knows_rate().then(|| taken + self.samples_at(self.rate) as u64)
    }
}
