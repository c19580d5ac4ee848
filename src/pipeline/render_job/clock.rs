//! Where the time of a job goes.

use super::report::Seconds;
use std::time::Instant;

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
