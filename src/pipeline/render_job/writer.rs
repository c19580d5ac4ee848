//! Writing a frame while the next one is rendered.

use super::RenderJob;
use super::outputs::Outputs;
use super::report::FrameCounts;
use crate::pipeline::{Event, PreviewStamp, Stamp, Watch};
use crate::render::beauty::Beauty;
use crate::render::exr::write_exr;
use crate::render::path::TraceStats;
use crate::render::png::write_png;
use crate::render::{RenderSettings, RenderedFrame};
use crate::store::is_full;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Scope, ScopedJoinHandle};
use std::time::Instant;

/// A frame that has been rendered.
pub(super) struct Finished {
    pub rendered: RenderedFrame,
    pub stamp: Stamp,
    /// How long it took.
    pub seconds: f64,
    /// Stops of its preview, if it has one.
    pub exposure: Option<f32>,
    /// Its checkpoint, which goes when the picture is there.
    pub leftover: Option<PathBuf>,
}

/// How pictures are written.
pub(super) struct Writing<'a> {
    pub job: &'a RenderJob,
    pub outputs: &'a Outputs<'a>,
    pub watch: &'a dyn Watch,
    /// How long writing a frame took last, nanoseconds.
    pub nanoseconds: &'a AtomicU64,
}

/// Seconds to develop a pixel and write it, and as many for that of a preview: two cores, the usual layers.
const SECONDS_A_PIXEL: f64 = 1e-6;

/// How long writing a frame is likely to take, seconds, before one has been written.
pub(super) fn likely_seconds(settings: &RenderSettings, has_preview: bool) -> f64 {
    let pixels = f64::from(settings.width) * f64::from(settings.height);
    pixels * SECONDS_A_PIXEL * if has_preview { 2.0 } else { 1.0 }
}

/// What a writer did.
#[derive(Default)]
pub(super) struct Written {
    pub frames: FrameCounts,
    pub seconds: f64,
    pub trace: TraceStats,
    pub non_finite: u64,
}

/// A thread that writes what it is handed. It takes one frame at a time, so that there are never more than
/// two in memory.
pub(super) struct Writer<'scope> {
    sender: SyncSender<Finished>,
    thread: ScopedJoinHandle<'scope, Written>,
    nanoseconds: &'scope AtomicU64,
}

impl<'scope> Writer<'scope> {
    pub fn start<'a: 'scope>(
        scope: &'scope Scope<'scope, '_>,
        writing: Writing<'a>,
    ) -> Writer<'scope> {
        let (sender, receiver) = sync_channel(0);
        let nanoseconds = writing.nanoseconds;
        Writer { sender, thread: scope.spawn(move || writing.write_all(&receiver)), nanoseconds }
    }

    /// How long it took to write the last frame, in seconds, if one was written.
    pub fn seconds_of_a_frame(&self) -> Option<f64> {
        let nanoseconds = self.nanoseconds.load(Relaxed);
        (nanoseconds > 0).then_some(nanoseconds as f64 * 1e-9)
    }

    /// Hands over a frame. Waits until the one before is written. Whether it was taken: only a panic ends the
    /// thread early, which comes to light when it is joined.
    pub fn hand_over(&self, frame: Finished) -> bool {
        self.sender.send(frame).is_ok()
    }

    /// Waits until everything is written.
    pub fn finish(self) -> Written {
        drop(self.sender);
        match self.thread.join() {
            Ok(written) => written,
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }
}

impl Writing<'_> {
    fn write_all(&self, receiver: &Receiver<Finished>) -> Written {
        let mut written = Written::default();
        for frame in receiver {
            let started = Instant::now();
            let stats = frame.rendered.stats;
            written.trace = written.trace.plus(stats.trace);
            written.non_finite += stats.non_finite;
            match self.write(&frame) {
                Ok(()) => written.frames.done += 1,
                Err(error) => {
                    written.frames.failed += 1;
                    let why = format!("it was rendered, but cannot be written: {error}");
                    self.watch.tell(Event::FrameFailed { frame: frame.stamp.frame, why });
                }
            }
            let elapsed = started.elapsed();
            self.nanoseconds.store(elapsed.as_nanos() as u64, Relaxed);
            written.seconds += elapsed.as_secs_f64();
        }
        written
    }

    fn write(&self, frame: &Finished) -> io::Result<()> {
        let Finished { rendered, stamp, seconds, exposure, leftover } = frame;
        if let Some((x, y)) = rendered.stats.first_non_finite {
            let text = format!(
                "frame {}: {} samples were infinite or no number and were left out, the first in pixel \
                 {x},{y}",
                stamp.frame, rendered.stats.non_finite
            );
            self.watch.tell(Event::Note { text });
        }
        let output = self.outputs.picture(stamp.frame);
        let metadata = serde_json::to_string(stamp)?;
        match write_exr(&output, &rendered.buffers, &metadata) {
            Ok(bytes) => self.outputs.note_length(bytes),
            Err(error) => {
                if is_full(&error) {
                    // As long as it could be: the next frame is not rendered for nothing.
                    self.outputs.note_length(rendered.buffers.byte_length());
                }
                return Err(error);
            }
        }
        if let (Some(stops), Some(preview)) = (exposure, self.outputs.preview(stamp.frame)) {
            let beauty = Beauty::of(&rendered.buffers, self.job.settings.float_beauty);
            write_preview(&preview, &beauty, *stops, &self.job.preview_stamp(stamp))?;
        }
        // Nothing is lost if it stays: it is of a picture that is there.
        leftover.iter().for_each(|path| drop(fs::remove_file(path)));
        self.watch.tell(Event::FrameDone {
            frame: stamp.frame,
            seconds: *seconds,
            rays: rendered.stats.trace.rays,
            light_picks: rendered.stats.trace.light_picks,
            noise: stamp.noise,
            output,
        });
        Ok(())
    }
}

/// Writes a preview with its stamp.
pub(super) fn write_preview(
    path: &Path,
    picture: &Beauty,
    stops: f32,
    stamp: &PreviewStamp,
) -> io::Result<()> {
    write_png(path, picture, stops, &serde_json::to_string(stamp)?)
}
