//! How far a shot is, and when its frames are interrupted.

use crate::pipeline::{Event, Watch};
use crate::render::Progress;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Instant;

/// Tells nothing, and hears when to stop.
pub(super) struct Patience<'a>(pub &'a dyn Watch);

impl Progress for Patience<'_> {
    fn is_stopped(&self) -> bool {
        self.0.is_stopped()
    }
}

/// When rendering is interrupted for time.
pub(super) struct Cut {
    pub until: Instant,
    /// Not in a pass that begins with fewer samples.
    pub least: u64,
}

/// How far a shot is: frames, and the samples of the one that is rendered.
pub(super) struct FrameProgress<'a> {
    watch: &'a dyn Watch,
    frames: usize,
    over: usize,
    pub frame: i32,
    /// When the time of the frame interrupts it.
    pub cut: Option<Cut>,
    /// Samples when the pass began.
    before: AtomicU64,
    taken: AtomicU64,
    all: AtomicU64,
}

impl FrameProgress<'_> {
    pub fn new(watch: &dyn Watch, frames: usize) -> FrameProgress<'_> {
        let [before, taken, all] = [0, 0, 1].map(AtomicU64::new);
        FrameProgress { watch, frames, over: 0, frame: 0, cut: None, before, taken, all }
    }

    pub fn frame_is_over(&mut self) {
        self.over += 1;
        self.cut = None;
        self.expects(0, 1);
    }

    fn tell(&self, share_of_frame: f64) {
        let done = (self.over as f64 + share_of_frame.min(1.0)) / self.frames.max(1) as f64;
        self.watch.tell(Event::Progress { done, frame: Some(self.frame) });
    }
}

impl Progress for FrameProgress<'_> {
    fn expects(&self, taken: u64, all: u64) {
        self.before.store(taken, Relaxed);
        self.taken.store(taken, Relaxed);
        self.all.store(all.max(1), Relaxed);
        self.tell(taken as f64 / all.max(1) as f64);
    }

    fn samples_taken(&self, samples: u64) {
        let taken = self.taken.fetch_add(samples, Relaxed) + samples;
        self.tell(taken as f64 / self.all.load(Relaxed) as f64);
    }

    fn is_stopped(&self) -> bool {
        let is_late =
            |cut: &Cut| self.before.load(Relaxed) >= cut.least && Instant::now() >= cut.until;
        self.watch.is_stopped() || self.cut.as_ref().is_some_and(is_late)
    }
}
