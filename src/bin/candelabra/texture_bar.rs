//! A progress bar for the integration of emission textures, shown only if that takes long.

use indicatif::{ProgressBar, ProgressStyle};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Time before the bar is shown.
const PATIENCE: Duration = Duration::from_secs(1);

/// Counts triangles. Draws nothing where there is no terminal.
pub struct TextureBar {
    started: Instant,
    bar: OnceLock<ProgressBar>,
}

impl TextureBar {
    /// A bar that is not drawn yet.
    pub fn new() -> TextureBar {
        TextureBar { started: Instant::now(), bar: OnceLock::new() }
    }

    /// Says how many triangles are done, of how many.
    pub fn show(&self, done: u64, all: u64) {
        let elapsed = self.started.elapsed();
        if elapsed < PATIENCE {
            return;
        }
        let bar = self.bar.get_or_init(|| {
            let bar = ProgressBar::new(all).with_elapsed(elapsed);
            let template = "textures of lights {wide_bar} {percent}% {elapsed} elapsed, {eta} left";
            match ProgressStyle::with_template(template) {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        });
        bar.set_position(done);
    }
}

impl Drop for TextureBar {
    fn drop(&mut self) {
        if let Some(bar) = self.bar.get() {
            bar.finish_and_clear();
        }
    }
}
