//! Frame after frame.

use super::clock::Clock;
use super::outputs::Outputs;
use super::report::FrameCounts;
use super::shot::Shot;
use super::writer::{Finished, Writer, write_preview};
use super::{RenderError, RenderJob, exposure};
use crate::emitter::Emitters;
use crate::pipeline::{
    Event, PreviewStamp, ShotTrees, Stamp, Stamper, TreeError, Watch, frames_of,
};
use crate::render::beauty::Beauty;
use crate::render::{self, PlanError, Progress, RenderDelegate};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// One pass over the frames of a shot.
pub(super) struct Pass<'a> {
    job: &'a RenderJob,
    shot: &'a Shot,
    emitters: &'a Emitters,
    trees: ShotTrees<'a>,
    outputs: &'a Outputs<'a>,
    stamper: Stamper,
    watch: &'a dyn Watch,
    clock: &'a mut Clock,
    /// Prepared when the first frame needs it: a shot that is done resumes at once.
    delegate: Option<RenderDelegate<'a>>,
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
}

/// Why there is no picture of a frame.
enum Trouble {
    /// The other frames may do.
    OfFrame(String),
    /// No other frame will do.
    OfShot(RenderError),
    /// The job is to stop.
    Stopped,
}

impl From<std::io::Error> for Trouble {
    fn from(error: std::io::Error) -> Trouble {
        Trouble::OfFrame(error.to_string())
    }
}

impl From<TreeError> for Trouble {
    fn from(error: TreeError) -> Trouble {
        match error {
            TreeError::NoSuchFrame { .. } => Trouble::OfFrame(error.to_string()),
            _ => Trouble::OfShot(error.into()),
        }
    }
}

impl From<render::RenderError> for Trouble {
    fn from(error: render::RenderError) -> Trouble {
        match error {
            render::RenderError::Stopped => Trouble::Stopped,
            _ => Trouble::OfFrame(error.to_string()),
        }
    }
}

impl<'a> Pass<'a> {
    pub fn new(
        job: &'a RenderJob,
        shot: &'a Shot,
        emitters: &'a Emitters,
        trees: ShotTrees<'a>,
        outputs: &'a Outputs<'a>,
        watch: &'a dyn Watch,
        clock: &'a mut Clock,
    ) -> Result<Pass<'a>, RenderError> {
        let rest = (&job.fog, &job.force_lights, job.verify);
        let stamper = Stamper::new(&shot.scene, &shot.camera, &shot.settings, rest);
        shot.settings.check(&shot.scene, emitters)?;
        let height = shot.settings.window().map_err(PlanError::from)?.height().into();
        let rows = height * shot.frames.as_slice().len() as u64;
        Ok(Pass {
            job,
            shot,
            emitters,
            trees,
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
    ///
    /// # Errors
    /// If the tree turns out to be useless. What was handed over before is sound.
    pub fn render_all(&mut self, writer: &Writer) -> Result<FrameCounts, RenderError> {
        let frames = self.shot.frames.as_slice();
        let mut counts = FrameCounts { asked: frames.len(), ..FrameCounts::default() };
        for &frame in frames {
            let before = self.rows.done.load(Relaxed);
            self.rows.frame = frame;
            let outcome = match self.watch.is_stopped() {
                true => Err(Trouble::Stopped),
                false => self.render(frame, writer),
            };
            match outcome {
                Ok(Outcome::HandedOver) => {}
                Ok(Outcome::UpToDate) => counts.up_to_date += 1,
                Err(Trouble::Stopped) => break,
                Err(Trouble::OfShot(error)) => return Err(error),
                Err(Trouble::OfFrame(why)) => {
                    counts.failed += 1;
                    self.watch.tell(Event::FrameFailed { frame, why });
                }
            }
            self.rows.done.store(before, Relaxed);
            self.rows.rows_done(self.height);
        }
        Ok(counts)
    }

    fn render(&mut self, frame: i32, writer: &Writer) -> Result<Outcome, Trouble> {
        if self.job.resume && self.is_up_to_date(frame)? {
            let output = self.outputs.picture(frame);
            self.watch.tell(Event::UpToDate { frame: Some(frame), output });
            return Ok(Outcome::UpToDate);
        }
        self.outputs.check_frame(frame)?;
        let exposure = self.exposure()?;
        let stamp = self.stamp(frame)?;
        let Pass { delegate, shot, emitters, trees, rows, watch, clock, .. } = self;
        let delegate = prepared(delegate, shot, emitters, *watch, clock);
        let tree = trees.for_frame(frame)?;
        clock.lap(|seconds| &mut seconds.trees);
        let rendered = delegate.render(&tree, frame, &*rows)?;
        let seconds = clock.lap(|seconds| &mut seconds.rendering);
        trees.check_unwritten()?;
        let is_taken = writer.hand_over(Finished { rendered, stamp, seconds, exposure });
        self.clock.lap(|seconds| &mut seconds.waiting);
        if is_taken { Ok(Outcome::HandedOver) } else { Err(Trouble::Stopped) }
    }

    /// Stops of previews, if there are any.
    fn exposure(&mut self) -> Result<Option<f32>, Trouble> {
        let Some(preview) = self.job.preview else { return Ok(None) };
        if let Some(stops) = preview.exposure.or(self.exposure) {
            return Ok(Some(stops));
        }
        let Pass { delegate, shot, emitters, trees, watch, clock, .. } = self;
        let delegate = prepared(delegate, shot, emitters, *watch, clock);
        let frame = frames_of(&shot.scene)[0];
        let stops = match trees.for_frame(frame) {
            // The file may be of other frames; the exposure is the same all the same.
            Err(TreeError::NoSuchFrame { .. }) => {
                let mut own = ShotTrees::built(&shot.scene, emitters)?;
                exposure::of_frame(shot, delegate, &own.for_frame(frame)?, frame, *watch)
            }
            tree => exposure::of_frame(shot, delegate, &tree?, frame, *watch),
        }?;
        self.clock.lap(|seconds| &mut seconds.exposure);
        self.exposure = Some(stops);
        Ok(self.exposure)
    }

    fn stamp(&mut self, frame: i32) -> Result<Stamp, Trouble> {
        let tree = self.trees.for_frame(frame)?;
        let digest = tree.digest_at(frame).map_err(render::RenderError::from)?;
        let stamp = self.stamper.stamp(frame, digest);
        self.clock.lap(|seconds| &mut seconds.trees);
        Ok(stamp)
    }

    /// Whether a frame's picture is there, whole and of the same. Then a preview that is not is made again
    /// from it.
    fn is_up_to_date(&mut self, frame: i32) -> Result<bool, Trouble> {
        let picture = self.outputs.picture(frame);
        let earlier = Stamp::of_picture(&picture);
        self.clock.lap(|seconds| &mut seconds.resume);
        let fingerprint = self.stamper.fingerprint(frame);
        // The tree is looked at only if all else is the same.
        let Some(earlier) = earlier.filter(|stamp| stamp.fingerprint == fingerprint) else {
            return Ok(false);
        };
        let stamp = self.stamp(frame)?;
        if earlier != stamp {
            return Ok(false);
        }
        let Some(preview) = self.outputs.preview(frame) else { return Ok(true) };
        let wanted = self.job.preview_stamp(&stamp);
        if PreviewStamp::of_preview(&preview).as_ref() != Some(&wanted)
            && let Some(stops) = self.exposure()?
        {
            self.trees.check_unwritten()?;
            write_preview(&preview, &Beauty::read(&picture)?, stops, &wanted)?;
        }
        self.clock.lap(|seconds| &mut seconds.resume);
        Ok(true)
    }
}

/// The delegate, with what rays hit prepared.
fn prepared<'d, 'a>(
    delegate: &'d mut Option<RenderDelegate<'a>>,
    shot: &'a Shot,
    emitters: &'a Emitters,
    watch: &dyn Watch,
    clock: &mut Clock,
) -> &'d mut RenderDelegate<'a> {
    delegate.get_or_insert_with(|| {
        watch.tell(Event::Stage { name: "preparing rays".into() });
        let Shot { scene, camera, settings, .. } = shot;
        let delegate = RenderDelegate::new(scene, emitters, camera.clone(), settings.clone());
        clock.lap(|seconds| &mut seconds.rays);
        delegate
    })
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
