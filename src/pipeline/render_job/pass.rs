//! Frame after frame.

use super::checkpoint::Checkpoint;
use super::clock::{Clock, Deadline};
use super::control::{FIRST_IN_TIME, FrameControl};
use super::effort::Effort;
use super::frame_noise::{FrameNoise, audit};
use super::outputs::Outputs;
use super::plan::{Plan, read_plan};
use super::progress::{Cut, FrameProgress, Patience};
use super::report::FrameCounts;
use super::shot::Shot;
use super::writer::{Finished, Writer, likely_seconds, write_preview};
use super::{RenderError, RenderJob};
use crate::emitter::Emitters;
use crate::light_tree::LightTree;
use crate::pipeline::{
    Event, Glimpse, LearnedError, OpenedTable, PreviewStamp, ShotTrees, Stamp, Stamper, TreeError,
    Watch, caveat, frames_of, frames_of_grey, glimpse, view_keys, with_knobs,
};
use crate::render::beauty::Beauty;
use crate::render::knob::{Aim, pilot};
use crate::render::layers::Aov;
use crate::render::noise::Grey;
use crate::render::passes::ErrorGoal;
use crate::render::{self, RenderDelegate, RenderSettings, Split};
use std::collections::BTreeMap;
use std::time::Duration;

/// One pass over the frames of a shot.
pub(super) struct Pass<'a> {
    job: &'a RenderJob,
    shot: &'a Shot,
    emitters: &'a Emitters,
    trees: ShotTrees<'a>,
    /// What is hidden from where.
    learned: Option<&'a OpenedTable>,
    /// Whether the user has been told what that is worth.
    caveat_is_told: bool,
    outputs: &'a Outputs<'a>,
    stamper: Stamper<'a>,
    watch: &'a dyn Watch,
    clock: &'a mut Clock,
    /// Prepared when the first frame needs it: a shot that is done resumes at once.
    delegate: Option<RenderDelegate<'a>>,
    /// Settings with the knobs of splitting found, once they are needed.
    settings: Option<RenderSettings>,
    /// Small pictures of frames, made when they are needed.
    glimpses: BTreeMap<i32, Glimpse>,
    progress: FrameProgress<'a>,
    /// Frames that were rendered, for their share of the time.
    rendered: u32,
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
        (emitters, trees, learned): (&'a Emitters, ShotTrees<'a>, Option<&'a OpenedTable>),
        outputs: &'a Outputs<'a>,
        watch: &'a dyn Watch,
        clock: &'a mut Clock,
    ) -> Result<Pass<'a>, RenderError> {
        let rest = (&job.fog, &job.force_lights, job.verify);
        let knobs = (&shot.settings, &job.effort);
        // A picture without a table has the stamp that it always had.
        let stamper = match learned.map(OpenedTable::fingerprint) {
            None => Stamper::new(&shot.scene, &shot.camera, knobs, rest),
            Some(table) => Stamper::new(&shot.scene, &shot.camera, knobs, (rest, table)),
        };
        shot.settings.check(&shot.scene, emitters)?;
        let frames = shot.frames.as_slice().len();
        Ok(Pass {
            job,
            shot,
            emitters,
            trees,
            learned,
            caveat_is_told: false,
            outputs,
            stamper: stamper.map_err(RenderError::Program)?,
            watch,
            clock,
            delegate: None,
            settings: None,
            glimpses: BTreeMap::new(),
            progress: FrameProgress::new(watch, frames),
            rendered: 0,
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
            self.progress.frame = frame;
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
            self.progress.frame_is_over();
        }
        Ok(counts)
    }

    fn render(&mut self, frame: i32, writer: &Writer) -> Result<Outcome, Trouble> {
        let plan = self.plan(frame)?;
        if self.job.resume && self.is_up_to_date(frame, plan.as_ref())? {
            let output = self.outputs.picture(frame);
            self.watch.tell(Event::UpToDate { frame: Some(frame), output });
            return Ok(Outcome::UpToDate);
        }
        self.outputs.check_frame(frame)?;
        let exposure = self.exposure()?;
        let grey = self.grey()?;
        let deadline = self.deadline(writer);
        let settings = self.settings(plan.as_ref(), deadline.as_ref())?;
        let stamp = self.stamp(frame, plan.as_ref())?;
        self.tell_caveat(frame)?;
        let until = deadline.as_ref().map(Deadline::latest);
        let tolerance = deadline.as_ref().map_or(0.0, Deadline::tolerance);
        let Pass { job, delegate, shot, emitters, trees, learned, progress, watch, clock, .. } =
            self;
        let delegate = prepared(delegate, shot, (emitters, *learned), *watch, clock);
        delegate.set_settings(settings.clone());
        let tree = trees.for_frame(frame)?;
        clock.lap(|seconds| &mut seconds.trees);
        let picture = self.outputs.picture(frame);
        let blank = || delegate.film(frame).map_err(render::RenderError::from);
        let checkpoint = job.checkpoint.then(|| Checkpoint::of(&picture, &stamp, *watch));
        let earlier = checkpoint.as_ref().map(|own| Ok::<_, Trouble>(own.restore(blank()?)));
        let mut film = match earlier.transpose()?.flatten() {
            Some(film) => film,
            None => blank()?,
        };
        film.set_grey(grey);
        let leftover = checkpoint.as_ref().map(|own| own.path().to_path_buf());
        let mut control = FrameControl::new(
            &job.effort,
            plan.map(|plan| plan.counts),
            grey,
            deadline,
            checkpoint,
        );
        progress.cut = until.map(|until| Cut { until, least: control.least_samples(&film) });
        let rendered = delegate.expose(&tree, frame, &mut film, &mut control, &*progress)?;
        if let Some(late) =
            until.map(|until| until.elapsed().as_secs_f64()).filter(|late| *late > tolerance)
        {
            watch.tell(Event::Note {
                text: format!(
                    "frame {frame}: preparation and {FIRST_IN_TIME} samples of each pixel took {late:.2} s \
                     longer than --time allows"
                ),
            });
        }
        let seconds = clock.lap(|seconds| &mut seconds.rendering);
        let (asked, allowed) = (job.effort.error, job.effort.samples);
        let mut noise = FrameNoise::of(&film, grey, asked, allowed);
        if let (Some(pixels), Some(grey), Some(noise)) = (job.audit, grey, &mut noise) {
            // Its time is over; the audit is beside it.
            let quiet = Patience(*watch);
            let audited =
                audit(delegate, &tree, frame, (&film, grey), &settings, (pixels, &quiet))?;
            noise.audit = Some(audited);
            clock.lap(|seconds| &mut seconds.audit);
        }
        let stamp = Stamp { knobs: Some(settings.split.knobs()), noise, ..stamp };
        self.check_unwritten()?;
        self.rendered += 1;
        let finished = Finished { rendered, stamp, seconds, exposure, leftover };
        let is_taken = writer.hand_over(finished);
        self.clock.lap(|seconds| &mut seconds.waiting);
        if is_taken { Ok(Outcome::HandedOver) } else { Err(Trouble::Stopped) }
    }

    /// The plan of a frame, if there is one.
    fn plan(&self, frame: i32) -> Result<Option<Plan>, Trouble> {
        let Some(names) = &self.job.effort.plan else { return Ok(None) };
        let path = names.path(frame);
        let plan = read_plan(&path)?;
        let window =
            self.shot.settings.window().map_err(|error| Trouble::OfFrame(error.to_string()))?;
        if plan.window != window {
            return Err(Trouble::OfFrame(format!(
                "{}: has other pixels than the picture to be rendered; give its size and crop, or \
                 leave --plan out",
                path.display()
            )));
        }
        Ok(Some(plan))
    }

    /// When the next frame is to be done, if that is asked for.
    fn deadline(&self, writer: &Writer) -> Option<Deadline> {
        let each = self.job.effort.seconds?;
        let all = Duration::try_from_secs_f64(each * f64::from(self.rendered + 1)).ok()?;
        let has_preview = self.job.preview.is_some();
        let likely = || likely_seconds(&self.shot.settings, has_preview);
        let reserve = writer.seconds_of_a_frame().unwrap_or_else(likely);
        Some(Deadline::new(self.clock.started() + all, each, reserve))
    }

    /// Stops of previews, if there are any.
    fn exposure(&mut self) -> Result<Option<f32>, Trouble> {
        let Some(preview) = self.job.preview else { return Ok(None) };
        match preview.exposure {
            Some(stops) => Ok(Some(stops)),
            None => Ok(Some(self.glimpse(frames_of(&self.shot.scene)[0])?.exposure)),
        }
    }

    /// The grey floor of the shot, if the noise of its frames is looked at.
    fn grey(&mut self) -> Result<Option<Grey>, Trouble> {
        let effort = &self.job.effort;
        let is_shown = || self.shot.settings.aovs.contains(&Aov::Error);
        if effort.grey.is_some() || !(effort.looks() || self.job.audit.is_some() || is_shown()) {
            return Ok(effort.grey);
        }
        let seen = frames_of_grey(&frames_of(&self.shot.scene));
        for &frame in &seen {
            self.glimpse(frame)?;
        }
        let glimpses = seen.iter().filter_map(|frame| self.glimpses.get(frame));
        Ok(Some(Grey::of(glimpses.flat_map(|glimpse| glimpse.luminances.iter().copied()))))
    }

    /// The settings, with the knobs of splitting that are best for the shot: by a pilot in the scene's first
    /// frame, whatever frames are asked for. A plan may have knobs of its own.
    fn settings(
        &mut self,
        plan: Option<&Plan>,
        deadline: Option<&Deadline>,
    ) -> Result<RenderSettings, Trouble> {
        let asked = &self.shot.settings;
        if let (Split::Auto, Some(knobs)) = (asked.split, plan.and_then(|plan| plan.knobs)) {
            return Ok(RenderSettings { split: Split::ByBounce(knobs), ..asked.clone() });
        }
        if let Some(settings) = &self.settings {
            return Ok(settings.clone());
        }
        let aim = self.aim()?;
        let frame = frames_of(&self.shot.scene)[0];
        let in_time = self.samples_in_time(deadline, frame)?;
        let Pass { delegate, shot, emitters, trees, learned, watch, clock, .. } = self;
        let delegate = prepared(delegate, shot, (emitters, *learned), *watch, clock);
        let found = with_knobs(delegate, &shot.settings, in_time, |delegate| {
            of_any_frame(shot, emitters, trees, frame, |tree| {
                Ok(pilot(delegate, tree, frame, aim)?)
            })
        })?;
        clock.lap(|seconds| &mut seconds.ahead);
        Ok(self.settings.insert(found).clone())
    }

    /// How many samples of a pixel the rest of its time is likely to pay for, if nothing but time tells how many there
    /// will be: by how long those of a small picture took. With checkpoints the clock is not asked: a frame that is gone
    /// on with must find the knobs that it began with.
    fn samples_in_time(
        &mut self,
        deadline: Option<&Deadline>,
        frame: i32,
    ) -> Result<Option<u32>, Trouble> {
        let decides = self.job.effort.time_decides();
        let Some(deadline) = deadline.filter(|_| decides) else { return Ok(None) };
        if self.job.checkpoint {
            return Ok(Some(u32::MAX));
        }
        let rate = self.glimpse(frame)?.rate;
        let [width, height] = [self.shot.settings.width, self.shot.settings.height].map(f64::from);
        Ok(Some((deadline.samples_at(rate) / (width * height)) as u32))
    }

    /// What decides how many samples a pixel gets.
    fn aim(&mut self) -> Result<Aim, Trouble> {
        let Effort { error, samples: most, .. } = self.job.effort;
        let grey = self.grey()?.filter(|_| self.job.effort.looks());
        Ok(match (grey, error) {
            (Some(grey), Some(error)) => Aim::Error(ErrorGoal { error, grey, most }),
            (Some(grey), None) => Aim::Time(grey),
            (None, _) => Aim::Even,
        })
    }

    /// A small picture of a frame.
    fn glimpse(&mut self, frame: i32) -> Result<&Glimpse, Trouble> {
        if !self.glimpses.contains_key(&frame) {
            let Pass { delegate, shot, emitters, trees, learned, watch, clock, .. } = self;
            let delegate = prepared(delegate, shot, (emitters, *learned), *watch, clock);
            let seen = of_any_frame(shot, emitters, trees, frame, |tree| {
                glimpse(delegate, &shot.settings, tree, frame, &Patience(*watch))
            })?;
            self.clock.lap(|seconds| &mut seconds.ahead);
            self.glimpses.insert(frame, seen);
        }
        Ok(&self.glimpses[&frame])
    }

    /// Makes sure that what was checked is what was sampled.
    fn check_unwritten(&self) -> Result<(), Trouble> {
        self.trees.check_unwritten()?;
        match self.learned.zip(self.job.learned.as_ref()) {
            Some((table, path)) if !table.data().is_unchanged() => {
                Err(Trouble::OfShot(LearnedError::Overwritten(path.clone()).into()))
            }
            _ => Ok(()),
        }
    }

    /// Tells, once, if the table of what is hidden does not belong to the shot.
    fn tell_caveat(&mut self, frame: i32) -> Result<(), Trouble> {
        if let Some((table, path)) = self.learned.zip(self.job.learned.as_ref())
            && !self.caveat_is_told
        {
            self.caveat_is_told = true;
            let view = view_keys(&self.shot.scene, &self.shot.camera);
            let text = caveat(table, path, self.trees.for_frame(frame)?.still_key(), &view);
            text.into_iter().for_each(|text| self.watch.tell(Event::Note { text }));
        }
        Ok(())
    }

    fn stamp(&mut self, frame: i32, plan: Option<&Plan>) -> Result<Stamp, Trouble> {
        let tree = self.trees.for_frame(frame)?;
        let digest = tree.digest_at(frame).map_err(render::RenderError::from)?;
        let stamp = self.stamper.stamp(frame, plan, digest);
        self.clock.lap(|seconds| &mut seconds.trees);
        Ok(stamp)
    }

    /// Whether a frame's picture is there, whole and of the same. Then a preview that is not is made again
    /// from it.
    fn is_up_to_date(&mut self, frame: i32, plan: Option<&Plan>) -> Result<bool, Trouble> {
        let picture = self.outputs.picture(frame);
        let earlier = Stamp::of_picture(&picture);
        self.clock.lap(|seconds| &mut seconds.resume);
        let fingerprint = self.stamper.fingerprint(frame, plan);
        // The tree is looked at only if all else is the same.
        let Some(earlier) = earlier.filter(|stamp| stamp.fingerprint == fingerprint) else {
            return Ok(false);
        };
        let stamp = self.stamp(frame, plan)?;
        if !earlier.is_of_same(&stamp) {
            return Ok(false);
        }
        let Some(preview) = self.outputs.preview(frame) else { return Ok(true) };
        let wanted = self.job.preview_stamp(&stamp);
        if PreviewStamp::of_preview(&preview).as_ref() != Some(&wanted)
            && let Some(stops) = self.exposure()?
        {
            self.check_unwritten()?;
            write_preview(&preview, &Beauty::read(&picture)?, stops, &wanted)?;
        }
        self.clock.lap(|seconds| &mut seconds.resume);
        Ok(true)
    }
}

/// Calls `work` with the tree of a frame of the scene. The file may be of other frames; then one is built.
fn of_any_frame<'a, T>(
    shot: &'a Shot,
    emitters: &'a Emitters,
    trees: &mut ShotTrees<'a>,
    frame: i32,
    work: impl FnOnce(&LightTree<&[u8]>) -> Result<T, render::RenderError>,
) -> Result<T, Trouble> {
    Ok(match trees.for_frame(frame) {
        Err(TreeError::NoSuchFrame { .. }) => {
            let mut own = ShotTrees::built(&shot.scene, emitters)?;
            work(&own.for_frame(frame)?)
        }
        tree => work(&tree?),
    }?)
}

/// The delegate, with what rays hit prepared.
fn prepared<'d, 'a>(
    delegate: &'d mut Option<RenderDelegate<'a>>,
    shot: &'a Shot,
    (emitters, learned): (&'a Emitters, Option<&'a OpenedTable>),
    watch: &dyn Watch,
    clock: &mut Clock,
) -> &'d mut RenderDelegate<'a> {
    delegate.get_or_insert_with(|| {
        watch.tell(Event::Stage { name: "preparing rays".into() });
        let Shot { scene, camera, settings, .. } = shot;
        let mut delegate = RenderDelegate::new(scene, emitters, camera.clone(), settings.clone());
        delegate.set_learned(learned.and_then(OpenedTable::view));
        clock.lap(|seconds| &mut seconds.rays);
        delegate
    })
}
