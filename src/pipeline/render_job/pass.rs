//! Frame after frame.

use super::clock::Clock;
use super::outputs::Outputs;
use super::report::FrameCounts;
use super::shot::Shot;
use super::writer::{Finished, Writer, write_preview};
use super::{RenderError, RenderJob, exposure};

use crate::emitter::Emitters;
use crate::light_tree::LightTree;
use crate::pipeline::{Event, PreviewStamp, Stamp, Stamper, Watch};
use crate::render::beauty::Beauty;
use crate::render::{self, PlanError, Progress, RenderDelegate};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// One pass over the frames of a shot.
pub(super) struct Pass<'a> {
    job: &'a RenderJob,
    shot: &'a Shot,
    emitters: &'a Emitters,
    tree: &'a LightTree<&'a [u8]>,
    outputs: &'a Outputs<'a>,
    stamper: Stamper,
    watch: &'a dyn Watch,
    clock: &'a mut Clock,
    /// Prepared when the first frame needs it: a shot that is done resumes at once.
    delegate: Option<RenderDelegate<'a, &'a [u8]>>,
    /// Stops of all previews of the shot, once they are needed.
    exposure: Option<f32>,
    /// Rows of a frame's window.
    height: u64,
    rows: Rows<'a>,
}

/// What became of a frame that did not fail.
enum Outcome {
    UpToDate,
    HandedOver,
    Stopped,
}

impl<'a> Pass<'a> {
    pub fn new(
        job: &'a RenderJob,
        shot: &'a Shot,
        (emitters, tree): (&'a Emitters, &'a LightTree<&'a [u8]>),
        outputs: &'a Outputs<'a>,
        watch: &'a dyn Watch,
        clock: &'a mut Clock,
    ) -> Result<Pass<'a>, RenderError> {
        let rest = (&job.fog, &job.force_lights, job.verify);
        let stamper = Stamper::new(&shot.scene, &shot.camera, &shot.settings, rest);
        shot.settings.check(&shot.scene, emitters)?;
        let height = u64::from(shot.settings.window().map_err(PlanError::from)?.height());
        let rows = height * shot.frames.as_slice().len() as u64;
        Ok(Pass {
            job,
            shot,
            emitters,
            tree,
            outputs,
            stamper: stamper.map_err(RenderError::Program)?,
            watch,
            clock,
            delegate: None,
            exposure: None,
            height,
            rows: Rows { watch, all: rows, done: AtomicU64::new(0), frame: 0 },
        })
    }

    /// Renders all frames and hands them over. Counts those that never get that far.
    pub fn render_all(&mut self, writer: &Writer) -> FrameCounts {
        let frames = self.shot.frames.as_slice();
        let mut counts = FrameCounts { asked: frames.len(), ..FrameCounts::default() };
        for &frame in frames {
            let before = self.rows.done.load(Relaxed);
            self.rows.frame = frame;
            let outcome = match self.watch.is_stopped() {
                true => Ok(Outcome::Stopped),
                false => self.render(frame, writer),
            };
            match outcome {
                Ok(Outcome::HandedOver) => {}
                Ok(Outcome::UpToDate) => counts.up_to_date += 1,
                Ok(Outcome::Stopped) => break,
                Err(why) => {
                    counts.failed += 1;
                    self.watch.tell(Event::FrameFailed { frame, why });
                }
            }
            self.rows.done.store(before, Relaxed);
            self.rows.rows_done(self.height);
        }
        counts
    }

    fn render(&mut self, frame: i32, writer: &Writer) -> Result<Outcome, String> {
        let in_words = |error: &dyn std::fmt::Display| error.to_string();
        if self.job.resume && self.is_up_to_date(frame).map_err(|error| in_words(&error))? {
            let output = self.outputs.picture(frame);
            self.watch.tell(Event::UpToDate { frame: Some(frame), output });
            return Ok(Outcome::UpToDate);
        }
        self.outputs.check_frame(frame).map_err(|error| in_words(&error))?;
        let exposure = self.exposure().map_err(|error| in_words(&error))?;
        let stamp = self.stamp(frame);
        self.prepared();
        let Pass { delegate: Some(delegate), rows, .. } = self else { return Ok(Outcome::Stopped) };
        let rendered = match delegate.render(frame, &*rows) {
            Ok(rendered) => rendered,
            Err(render::RenderError::Stopped) => return Ok(Outcome::Stopped),
            Err(error) => return Err(error.to_string()),
        };
        let seconds = self.clock.lap(|seconds| &mut seconds.rendering);
        writer.hand_over(Finished { rendered, stamp, seconds, exposure });
        self.clock.lap(|seconds| &mut seconds.waiting);
        Ok(Outcome::HandedOver)
    }

    /// Stops of previews, if there are any.
    fn exposure(&mut self) -> Result<Option<f32>, render::RenderError> {
        let Some(preview) = self.job.preview else { return Ok(None) };
        if let Some(stops) = preview.exposure.or(self.exposure) {
            return Ok(Some(stops));
        }
        let shot = self.shot;
        let stops = exposure::of_shot(shot, self.prepared())?;
        self.clock.lap(|seconds| &mut seconds.exposure);
        self.exposure = Some(stops);
        Ok(self.exposure)
    }

    fn stamp(&self, frame: i32) -> Stamp {
        self.stamper.stamp(frame, self.tree.fingerprint())
    }

    /// Whether a frame's picture is there, whole and of the same. Then a preview that is not is made again
    /// from it.
    fn is_up_to_date(&mut self, frame: i32) -> std::io::Result<bool> {
        let picture = self.outputs.picture(frame);
        let earlier = Stamp::of_picture(&picture);
        let is_same = earlier.filter(|stamp| stamp.fingerprint == self.stamper.fingerprint(frame));
        let is_same = is_same.is_some_and(|stamp| stamp == self.stamp(frame));
        if let (true, Some(preview)) = (is_same, self.outputs.preview(frame)) {
            let wanted = self.job.preview_stamp(&self.stamp(frame));
            if PreviewStamp::of_preview(&preview).as_ref() != Some(&wanted) {
                let Some(stops) = self.exposure().map_err(std::io::Error::other)? else {
                    return Ok(false);
                };
                write_preview(&preview, &Beauty::read(&picture)?, stops, &wanted)?;
            }
        }
        self.clock.lap(|seconds| &mut seconds.resume);
        Ok(is_same)
    }

    /// The delegate, with what rays hit prepared.
    fn prepared(&mut self) -> &mut RenderDelegate<'a, &'a [u8]> {
        let Pass { shot, emitters, tree, watch, clock, .. } = self;
        self.delegate.get_or_insert_with(|| {
            watch.tell(Event::Stage { name: "preparing rays".into() });
            let (camera, settings) = (shot.camera.clone(), shot.settings.clone());
            let delegate = RenderDelegate::new(&shot.scene, emitters, tree, camera, settings);
            clock.lap(|seconds| &mut seconds.rays);
            delegate
        })
    }
}

/// Counts rows of pixels over all frames.
struct Rows<'a> {
    watch: &'a dyn Watch,
    all: u64,
    done: AtomicU64,
    frame: i32,
}

impl Progress for Rows<'_> {
    fn rows_done(&self, rows: u64) {
        let done = self.done.fetch_add(rows, Relaxed) + rows;
        let done = done as f64 / self.all.max(1) as f64;
        self.watch.tell(Event::Progress { done, frame: Some(self.frame) });
    }

    fn is_stopped(&self) -> bool {
        self.watch.is_stopped()
    }
}
