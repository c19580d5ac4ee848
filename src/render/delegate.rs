//! The render delegate: a shot prepared once, its frames rendered one after the other.

use super::buffers::RenderBuffers;
use super::camera::CameraRays;
use super::direct::FoundByReflection;
use super::far_field::StillTables;
use super::film::{Film, Shown, half_of};
use super::fog::Fog;
use super::frame_times::FrameTimes;
use super::layers::Aov;
use super::links::{FrameLinks, ShotLinks};
use super::motion::Motion;
use super::passes::{Control, Progress, Uniform};
use super::path::{Integrator, PathScratch, TraceStats};
use super::picker::LightPicker;
use super::plan::{Plan, PlanError};
use super::rays::RayScene;
use super::settings::RenderSettings;
use super::surface::Surfaces;
use crate::emitter::{Emitters, InfiniteLight, PosedEmitters, PosedFilters, Skies};
use crate::light_tree::learned::Learned;
use crate::light_tree::{LightTree, NoSuchFrame};
use crate::math::random::{hash, stratified};
use crate::scene::{Camera, Scene};
use rayon::prelude::*;
use thiserror::Error;

/// After so many samples it is asked whether to stop.
const SAMPLES_BETWEEN_STOPS: u64 = 256;
/// Tells the random number that chooses a time from others.
const TIME: u32 = 0x7469_6d65;

/// What does not change between the frames of a shot: geometry, textures, ray acceleration.
pub struct RenderDelegate<'a> {
    scene: &'a Scene,
    emitters: &'a Emitters,
    geometry: RayScene,
    skies: Skies,
    links: Option<ShotLinks<'a>>,
    far_fields: StillTables,
    settings: RenderSettings,
    plan: Result<Plan, PlanError>,
    camera: Camera,
    learned: Option<Learned<'a>>,
    /// Whether a ray may hit an emitter.
    has_surfaces_that_shine: bool,
}

/// Why there is no frame.
#[derive(Debug, Error)]
pub enum RenderError {
    /// The tree lacks it.
    #[error(transparent)]
    NoSuchFrame(#[from] NoSuchFrame),
    /// The settings do not fit.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// [`Progress::is_stopped`] said so.
    #[error("stopped before the frame was finished; nothing of it is kept")]
    Stopped,
}

/// A finished frame. It owns its pixels, so that another thread can write it.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderedFrame {
    /// Its pixels.
    pub buffers: RenderBuffers,
    /// What it cost, and what was left out.
    pub stats: FrameStats,
}

/// What a frame cost, and what was left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameStats {
    /// Rays and picks.
    pub trace: TraceStats,
    /// Samples left out of their pixels because their radiance was infinite or no number.
    pub non_finite: u64,
    /// The first pixel with such a sample, row by row: column and row of the whole picture.
    pub first_non_finite: Option<(u32, u32)>,
}

impl<'a> RenderDelegate<'a> {
    /// Prepares a shot.
    pub fn new(
        scene: &'a Scene,
        emitters: &'a Emitters,
        camera: Camera,
        settings: RenderSettings,
    ) -> RenderDelegate<'a> {
        RenderDelegate {
            scene,
            emitters,
            geometry: RayScene::new(scene, &scene.pose_at(0.0)),
            skies: Skies::default(),
            links: ShotLinks::new(scene, emitters),
            far_fields: StillTables::default(),
            plan: Plan::new(scene, emitters, &settings),
            settings,
            camera,
            learned: None,
            has_surfaces_that_shine: emitters.have_surfaces(scene),
        }
    }

    /// Weighs lights by what has been learned of the shot from now on, wherever that belongs to the tree.
    pub fn set_learned(&mut self, learned: Option<Learned<'a>>) {
        self.learned = learned;
    }

    /// Renders with other settings from now on.
    pub fn set_settings(&mut self, settings: RenderSettings) {
        self.plan = Plan::new(self.scene, self.emitters, &settings);
        self.settings = settings;
    }

    /// Calls `work` with a frame that is ready to be traced. The tree must be that of the scene (see
    /// `pipeline::ShotTrees`).
    ///
    /// # Errors
    /// If the tree lacks the frame.
    ///
    /// # Panics
    /// If the tree has another number of emitters than the scene.
    pub fn at_frame<T>(
        &self,
        tree: &LightTree<impl AsRef<[u8]>>,
        frame: i32,
        work: impl FnOnce(&Integrator) -> T,
    ) -> Result<T, NoSuchFrame> {
        self.at_frame_knowing(tree, frame, self.learned.as_ref(), work)
    }

    /// The same, with what has been learned so far.
    ///
    /// # Errors
    /// As [`at_frame`](Self::at_frame).
    ///
    /// # Panics
    /// As [`at_frame`](Self::at_frame).
    pub fn at_frame_knowing<T>(
        &self,
        tree: &LightTree<impl AsRef<[u8]>>,
        frame: i32,
        learned: Option<&Learned>,
        work: impl FnOnce(&Integrator) -> T,
    ) -> Result<T, NoSuchFrame> {
        let size = [self.settings.width, self.settings.height];
        let instant = FrameTimes::instant(self.scene, &self.camera, frame.into(), size);
        self.at_times(tree, frame, &instant, learned, |integrators| work(&integrators[0]))
    }

    /// Does what is done for a frame before its first sample.
    ///
    /// # Errors
    /// As [`at_frame`](Self::at_frame).
    ///
    /// # Panics
    /// As [`at_frame`](Self::at_frame).
    pub fn prepare(
        &self,
        tree: &LightTree<impl AsRef<[u8]>>,
        frame: i32,
    ) -> Result<(), NoSuchFrame> {
        self.at_times(tree, frame, &self.times(frame), self.learned.as_ref(), |_| ())
    }

    /// When a frame is seen.
    fn times(&self, frame: i32) -> FrameTimes {
        let (scene, camera) = (self.scene, &self.camera);
        let size = [self.settings.width, self.settings.height];
        match self.settings.motion_blur {
            true => FrameTimes::of_shutter(scene, camera, frame, size),
            false => FrameTimes::instant(scene, camera, frame.into(), size),
        }
    }

    /// Calls `work` with a frame that is ready to be traced at each of some times. Lights at infinity, and what the tree
    /// is told of far fields, are as they are in the middle: these are laid out once.
    fn at_times<T>(
        &self,
        file: &LightTree<impl AsRef<[u8]>>,
        frame: i32,
        times: &FrameTimes,
        learned: Option<&Learned>,
        work: impl FnOnce(&[Integrator]) -> T,
    ) -> Result<T, NoSuchFrame> {
        let RenderDelegate { scene, emitters, settings, .. } = self;
        assert_eq!(file.emitter_count(), emitters.len(), "the tree belongs to another scene");
        let learned = learned.filter(|learned| learned.tree == file.still_key());
        let infinite = self.skies.lights(scene, times.middle());
        let at_pose = |pose| PosedEmitters { scene, emitters, pose };
        let middle = at_pose(times.middle());
        let tree = match &self.links {
            Some(links) => file.at_frame_linked(frame, links.lit_by())?,
            None => file.at_frame(frame)?,
        };
        let tree = match scene.profiles.is_empty() {
            true => tree,
            false => self.far_fields.told(file, tree, &middle),
        };
        let tree = match learned {
            Some(learned) => tree.veiled(learned.veils),
            None => tree,
        };
        let links = self.links.as_ref().map(|shot| FrameLinks { shot, infinite: &infinite });
        let picker = LightPicker::new(settings, tree, &infinite).linked(links);
        let tracers = self.geometry.for_poses(scene, times.poses());
        let fog = times.poses().par_iter().map(|pose| Fog::new(scene, pose, &self.camera));
        let fog: Vec<Option<Fog>> = fog.collect();
        let filters = times.poses().iter().map(|pose| PosedFilters::new(scene, pose));
        let filters: Vec<Option<PosedFilters>> = filters.collect();
        let integrator = |(view, camera): (usize, &CameraRays)| {
            let at = times.pose_of(view);
            let pose = &times.poses()[at];
            Integrator {
                settings,
                tracer: &tracers[at],
                surfaces: Surfaces::new(scene, pose),
                emitters: at_pose(pose),
                infinite: &infinite,
                picker: picker.clone(),
                links,
                camera: *camera,
                cells: learned.map(|learned| learned.cells),
                filters: filters[at].as_ref(),
                responses: Some(&scene.light_responses).filter(|all| !all.is_empty()),
                fog: fog[at].clone(),
                groups: self.plan.as_ref().ok().and_then(|plan| plan.groups.as_ref()),
                found_by_reflection: match settings.mis {
                    true if infinite.iter().any(InfiniteLight::meets_reflections) => {
                        FoundByReflection::Everything
                    }
                    true if self.has_surfaces_that_shine => FoundByReflection::Surfaces,
                    _ => FoundByReflection::Nothing,
                },
            }
        };
        let integrators: Vec<Integrator> = times.views.iter().enumerate().map(integrator).collect();
        Ok(work(&integrators))
    }

    /// A film for a frame that has no samples yet. It is exposed as the camera says at the frame itself, whatever the
    /// exposure is at other times at which the shutter is open.
    ///
    /// # Errors
    /// If the settings do not fit the scene.
    pub fn film(&self, frame: i32) -> Result<Film, PlanError> {
        let plan = self.plan.as_ref().map_err(Clone::clone)?;
        let size = [self.settings.width, self.settings.height];
        Ok(Film::new(size, plan, self.exposure_scale(frame)))
    }

    /// What a picture is over radiance.
    pub(super) fn exposure_scale(&self, frame: i32) -> f32 {
        self.scene.camera_at(&self.camera, frame.into()).exposure_scale
    }

    /// Renders one frame, or the part of it that is to be rendered, with the same number of samples in
    /// each pixel. The pixels depend on scene, tree, settings and frame number alone; those of a part
    /// are the whole frame's.
    ///
    /// # Errors
    /// If the tree lacks the frame, the settings do not fit the scene, or `progress` stops it.
    ///
    /// # Panics
    /// As [`at_frame`](Self::at_frame).
    pub fn render(
        &self,
        tree: &LightTree<impl AsRef<[u8]>>,
        frame: i32,
        progress: &impl Progress,
    ) -> Result<RenderedFrame, RenderError> {
        let mut control = Uniform(self.settings.samples);
        self.expose(tree, frame, &mut self.film(frame)?, &mut control, progress)
    }

    /// Exposes a film further, in the passes that a control asks for, and develops it. A film that has
    /// samples must be of the same frame and settings; it then becomes what it would have become at
    /// once. Where it is stopped, it has whole samples.
    ///
    /// # Errors
    /// As [`render`](Self::render).
    ///
    /// # Panics
    /// As [`at_frame`](Self::at_frame).
    pub fn expose(
        &self,
        tree: &LightTree<impl AsRef<[u8]>>,
        frame: i32,
        film: &mut Film,
        control: &mut dyn Control,
        progress: &impl Progress,
    ) -> Result<RenderedFrame, RenderError> {
        let plan = self.plan.as_ref().map_err(Clone::clone)?;
        let times = self.times(frame);
        self.at_times(tree, frame, &times, self.learned.as_ref(), |integrators| {
            let size = [self.settings.width, self.settings.height];
            let motion = || Motion::new(self.scene, times.middle(), &self.camera, times.time, size);
            let motion = plan.layers.iter().any(|layer| layer.aov == Aov::Motion).then(motion);
            let shown = integrators.iter().map(|integrator| Shown {
                layers: &plan.layers,
                origin: self.scene.origin,
                pose: integrator.emitters.pose,
                motion: motion.as_ref(),
                ids: plan.ids.as_ref(),
            });
            let shown: Vec<Shown> = shown.collect();
            let seed = hash(self.settings.seed, frame as u32);
            loop {
                if film.missing() > 0 {
                    progress.expects(film.samples(), control.expected(film));
                    let is_done = self.pass(integrators, &shown, seed, film, progress);
                    control.passed(film);
                    if !is_done && !control.is_done_if_stopped() {
                        return Err(RenderError::Stopped);
                    }
                    if !is_done {
                        break;
                    }
                }
                match control.next(film) {
                    Some(targets) => film.begin_pass(targets),
                    None => break,
                }
            }
            let mut buffers = film.develop(&shown[0]);
            buffers.manifest = plan.ids.as_ref().map(|ids| ids.manifest(self.scene, &buffers));
            Ok(RenderedFrame { buffers, stats: film.stats() })
        })?
    }

    /// Takes the samples that a film lacks, each at one of the frame's times. Whether it got that far before it
    /// was stopped.
    fn pass(
        &self,
        integrators: &[Integrator],
        shown: &[Shown],
        frame_seed: u32,
        film: &mut Film,
        progress: &impl Progress,
    ) -> bool {
        let window = film.window();
        let rows = film.rows_mut().map(|(y, mut row)| {
            let mut scratch = PathScratch::default();
            let (mut since_asked, mut since_told) = (0, 0);
            for (at, x) in (window.x0..window.x1).enumerate() {
                // A pixel's number is its place in the whole picture, so that a part of it has the same noise.
                let seed = hash(frame_seed, y * self.settings.width + x);
                while let Some(sample) = row.next_sample(at) {
                    if since_asked == 0 && progress.is_stopped() {
                        progress.samples_taken(since_told);
                        return (scratch.stats, false);
                    }
                    since_asked = (since_asked + 1) % SAMPLES_BETWEEN_STOPS;
                    since_told += 1;
                    let (seed, index) = scrambled(seed, sample);
                    let time = time_of(seed, index, integrators.len());
                    let path = integrators[time].trace(x, y, seed, index, &mut scratch);
                    row.add(at, &path, &scratch.by_group, scratch.blocked, &shown[time]);
                }
            }
            progress.samples_taken(since_told);
            (scratch.stats, true)
        });
        let (trace, is_done) = rows.reduce(
            || (TraceStats::default(), true),
            |(a, a_done), (b, b_done)| (a.plus(b), a_done && b_done),
        );
        film.add_trace(trace);
        is_done
    }
}

/// The sequence that a sample of a pixel belongs to, and its number there: see
/// [`film`](super::film).
fn scrambled(seed: u32, sample: u32) -> (u32, u32) {
    (hash(seed, half_of(sample) as u32), sample / 2)
}

/// Which of a frame's times a sample is taken at: stratified over the samples of a sequence.
#[inline]
fn time_of(seed: u32, index: u32, times: usize) -> usize {
    match times {
        1 => 0,
        _ => (stratified(hash(seed, TIME), index) * times as f32) as usize,
    }
}
