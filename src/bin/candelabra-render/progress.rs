//! A bar with the time left, on a terminal.

use candelabra::page::Plain;
use candelabra::render::Progress;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write;

/// Progress over all frames of a shot, counted in rows of pixels.
pub struct Bar(ProgressBar);

impl Bar {
    /// A bar for a number of frames of a height. Draws nothing where there is no terminal.
    pub fn new(frames: usize, height: u32) -> Bar {
        let bar = ProgressBar::new(frames as u64 * u64::from(height));
        let template = "{msg} {wide_bar} {percent}% {elapsed} elapsed, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Bar(bar)
    }

    /// Says that rays are being prepared.
    pub fn preparing(&self) {
        self.0.set_message("preparing rays");
        self.0.tick();
    }

    /// Says which frame is being rendered.
    pub fn frame(&self, frame: i32) {
        self.0.set_message(format!("frame {frame}"));
    }

    /// Prints a line above the bar, on standard output. A closed pipe (`| head`) does not stop the
    /// render.
    pub fn line(&self, text: &str) {
        self.0.suspend(|| {
            let _ = writeln!(std::io::stdout(), "{}", Plain(text));
        });
    }

    /// Counts a frame that needed no rendering.
    pub fn skip(&self, height: u32) {
        self.0.inc(height.into());
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

impl Progress for Bar {
    fn rows_done(&self, rows: u64) {
        self.0.inc(rows);
    }
}
