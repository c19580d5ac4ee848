//! The render delegate: a shot prepared once, its frames rendered one after the other.

use super::buffers::{RenderBuffers, set_pixel};
use super::camera::CameraRays;
use super::crop::Window;
use super::fog::Fog;
use super::layers::Aov;
use super::motion::Motion;
use super::path::{Integrator, PathScratch, TraceStats};
use super::picker::LightPicker;
use super::pixel::{PixelMean, Shown};
use super::plan::{Plan, PlanError};
use super::rays::RayScene;
use super::settings::RenderSettings;
use super::surface::Surfaces;
use crate::emitter::{Emitters, PosedEmitters, Skies};
use crate::light_tree::{LightTree, NoSuchFrame};
use crate::math::random::hash;
use crate::scene::{Camera, Scene};
use rayon::prelude::*;
use thiserror::Error;

/// After so many samples it is asked whether to stop.
const SAMPLES_BETWEEN_STOPS: u64 = 256;

/// What does not change between the frames of a shot: geometry, textures, ray acceleration.
pub struct RenderDelegate<'a> {
    scene: &'a Scene,
    emitters: &'a Emitters,
    geometry: RayScene,
    skies: Skies,
    settings: RenderSettings,
    plan: Result<Plan, PlanError>,
    camera: Camera,
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

impl FrameStats {
    /// Of two parts of a frame, the upper one first.
    fn plus(self, below: FrameStats) -> FrameStats {
        FrameStats {
            trace: self.trace.plus(below.trace),
            non_finite: self.non_finite + below.non_finite,
            first_non_finite: self.first_non_finite.or(below.first_non_finite),
        }
    }
}

/// Receives the progress of a frame.
pub trait Progress: Sync {
    /// Some of the frame's rows are done.
    fn rows_done(&self, rows: u64);

    /// Whether the frame is to be given up. Asked often, from all threads.
    fn is_stopped(&self) -> bool {
        false
    }
}

/// Ignores progress.
impl Progress for () {
    fn rows_done(&self, _: u64) {}
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
            plan: Plan::new(scene, emitters, &settings),
            settings,
            camera,
        }
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
        let pose = self.scene.pose_at(self.scene.timeline.seconds_at(f64::from(frame)));
        let infinite = self.skies.lights(self.scene, &pose);
        assert_eq!(tree.emitter_count(), self.emitters.len(), "the tree belongs to another scene");
        let tree = tree.at_frame(frame)?;
        let (width, height) = (self.settings.width, self.settings.height);
        Ok(work(&Integrator {
            settings: &self.settings,
            tracer: self.geometry.for_pose(self.scene, &pose),
            surfaces: Surfaces::new(self.scene, &pose),
            emitters: PosedEmitters { scene: self.scene, emitters: self.emitters, pose: &pose },
            infinite: &infinite,
            picker: LightPicker::new(&self.settings, tree, &infinite),
            camera: CameraRays::new(&self.camera, &pose, width, height),
            fog: Fog::new(self.scene, &pose, &self.camera),
            groups: self.plan.as_ref().ok().and_then(|plan| plan.groups.as_ref()),
        }))
    }

    /// Renders one frame, or the part of it that is to be rendered. The pixels depend on scene, tree,
    /// settings and frame number alone; those of a part are the whole frame's.
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
        let plan = self.plan.as_ref().map_err(Clone::clone)?;
        self.at_frame(tree, frame, |integrator| {
            self.render_with(integrator, plan, frame, progress)
        })?
        .ok_or(RenderError::Stopped)
    }

    /// `None` if it was stopped.
    fn render_with(
        &self,
        integrator: &Integrator,
        plan: &Plan,
        frame: i32,
        progress: &impl Progress,
    ) -> Option<RenderedFrame> {
        let size = [self.settings.width, self.settings.height];
        let shows_motion = plan.layers.iter().any(|layer| layer.aov == Aov::Motion);
        let pose = integrator.emitters.pose;
        let shown = Shown {
            layers: &plan.layers,
            exposure_scale: self.camera.exposure_scale.into(),
            origin: self.scene.origin,
            motion: shows_motion.then(|| Motion::new(self.scene, pose, &self.camera, frame, size)),
            ids: plan.ids.as_ref(),
        };
        let frame_seed = hash(self.settings.seed, frame as u32);
        let mut buffers = RenderBuffers::new(size, plan.window, plan.layers.clone());
        let stats = buffers
            .rows_mut()
            .zip(plan.window.y0..plan.window.y1)
            .map(|(row, y)| {
                let stats = self.render_row(
                    integrator,
                    &shown,
                    (frame_seed, plan.window, y),
                    row,
                    progress,
                )?;
                progress.rows_done(1);
                Some(stats)
            })
            .try_reduce(FrameStats::default, |above, below| Some(above.plus(below)))?;
        buffers.manifest = plan.ids.as_ref().map(|ids| ids.manifest(self.scene, &buffers));
        Some(RenderedFrame { buffers, stats })
    }

    fn render_row(
        &self,
        integrator: &Integrator,
        shown: &Shown,
        (frame_seed, window, y): (u32, Window, u32),
        row: &mut [f32],
        progress: &impl Progress,
    ) -> Option<FrameStats> {
        let (mut scratch, mut mean, mut values) =
            (PathScratch::default(), PixelMean::default(), Vec::new());
        let (mut stats, mut traced) = (FrameStats::default(), 0_u64);
        for (at, x) in (window.x0..window.x1).enumerate() {
            // A pixel's number is its place in the whole picture, so that a part of it has the same noise.
            let seed = hash(frame_seed, y * self.settings.width + x);
            mean.clear();
            for index in 0..self.settings.samples {
                if traced % SAMPLES_BETWEEN_STOPS == 0 && progress.is_stopped() {
                    return None;
                }
                traced += 1;
                let sample = integrator.trace(x, y, seed, index, &mut scratch);
                mean.add(&sample, &scratch.by_group, shown);
            }
            mean.finish(shown, &mut values);
            set_pixel(row, window.width() as usize, at, &values);
            if mean.non_finite > 0 {
                stats.non_finite += u64::from(mean.non_finite);
                stats.first_non_finite.get_or_insert((x, y));
            }
        }
        stats.trace = scratch.stats;
        Some(stats)
    }
}
