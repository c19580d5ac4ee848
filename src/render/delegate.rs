//! The render delegate: a shot prepared once, its frames rendered one after the other.

use super::buffers::{Pixel, RenderBuffers};
use super::camera::CameraRays;
use super::fog::Fog;
use super::path::{Integrator, PathSample, PathScratch, TraceStats};
use super::picker::LightPicker;
use super::rays::RayScene;
use super::settings::RenderSettings;
use super::surface::Surfaces;
use crate::emitter::{Emitters, PosedEmitters, infinite_lights};
use crate::light_tree::{LeafTable, LightTree, NoSuchFrame};
use crate::math::random::hash;
use crate::scene::{Camera, Scene};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// What does not change between the frames of a shot: geometry, textures, ray acceleration, the
/// mapped tree.
pub struct RenderDelegate<'a, D> {
    scene: &'a Scene,
    emitters: &'a Emitters,
    tree: &'a LightTree<D>,
    static_leaves: LeafTable,
    geometry: RayScene,
    settings: RenderSettings,
    camera: Camera,
}

/// A finished frame.
pub struct RenderedFrame {
    /// Its pixels.
    pub buffers: RenderBuffers,
    /// What it cost.
    pub stats: TraceStats,
}

/// Receives the progress of a frame.
pub trait Progress: Sync {
    /// Some of the frame's rows are done.
    fn rows_done(&self, rows: u64);
}

/// Ignores progress.
impl Progress for () {
    fn rows_done(&self, _: u64) {}
}

impl<'a, D: AsRef<[u8]> + Sync> RenderDelegate<'a, D> {
    /// Prepares a shot. The tree must be fresh (see `pipeline::check_fresh`).
    ///
    /// # Panics
    /// If the tree has another number of emitters than the scene.
    pub fn new(
        scene: &'a Scene,
        emitters: &'a Emitters,
        tree: &'a LightTree<D>,
        camera: Camera,
        settings: RenderSettings,
    ) -> RenderDelegate<'a, D> {
        assert_eq!(tree.emitter_count(), emitters.len(), "the tree belongs to another scene");
        RenderDelegate {
            scene,
            emitters,
            tree,
            static_leaves: tree.leaf_table(),
            geometry: RayScene::new(scene, &scene.pose_at(0.0)),
            settings,
            camera,
        }
    }

    /// Renders with other settings from now on.
    pub fn set_settings(&mut self, settings: RenderSettings) {
        self.settings = settings;
    }

    /// Calls `work` with a frame that is ready to be traced.
    ///
    /// # Errors
    /// If the tree lacks the frame.
    pub fn at_frame<T>(
        &self,
        frame: i32,
        work: impl FnOnce(&Integrator) -> T,
    ) -> Result<T, NoSuchFrame> {
        let pose = self.scene.pose_at(self.scene.timeline.seconds_at(f64::from(frame)));
        let infinite = infinite_lights(self.scene, &pose);
        let tree = self.tree.at_frame(frame, &self.static_leaves)?;
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
        }))
    }

    /// Renders one frame. The picture depends on scene, settings and frame number alone.
    ///
    /// # Errors
    /// If the tree lacks the frame.
    pub fn render(
        &self,
        frame: i32,
        progress: &impl Progress,
    ) -> Result<RenderedFrame, NoSuchFrame> {
        self.at_frame(frame, |integrator| self.render_with(integrator, frame, progress))
    }

    fn render_with(
        &self,
        integrator: &Integrator,
        frame: i32,
        progress: &impl Progress,
    ) -> RenderedFrame {
        let (width, height) = (self.settings.width, self.settings.height);
        let exposure_scale = f64::from(self.camera.exposure_scale);
        let frame_seed = hash(self.settings.seed, frame as u32);
        let mut buffers = RenderBuffers::new(width, height);
        let stats = buffers
            .pixels_mut()
            .par_chunks_mut(width as usize)
            .enumerate()
            .map(|(y, row)| {
                let mut scratch = PathScratch::default();
                for (x, pixel) in row.iter_mut().enumerate() {
                    let seed = hash(frame_seed, y as u32 * width + x as u32);
                    let mut mean = PixelMean::default();
                    for index in 0..self.settings.samples {
                        mean.add(&integrator.trace(x as u32, y as u32, seed, index, &mut scratch));
                    }
                    *pixel = mean.finish(exposure_scale);
                }
                progress.rows_done(1);
                scratch.stats
            })
            .reduce(TraceStats::default, TraceStats::plus);
        RenderedFrame { buffers, stats }
    }
}

/// Running means over a pixel's samples, in double precision.
#[derive(Default)]
struct PixelMean {
    count: u32,
    covered: u32,
    radiance: DVec3,
    /// Sum of squared distances from the mean (Welford).
    spread: DVec3,
    depth_m: f64,
    normal: Vec3,
    albedo: DVec3,
}

impl PixelMean {
    fn add(&mut self, sample: &PathSample) {
        self.count += 1;
        let radiance = sample.radiance.as_dvec3();
        let off = radiance - self.radiance;
        self.radiance += off / f64::from(self.count);
        self.spread += off * (radiance - self.radiance);
        if sample.covered {
            self.covered += 1;
            self.depth_m += f64::from(sample.depth_m);
            self.normal += sample.normal;
            self.albedo += sample.albedo.as_dvec3();
        }
    }

    /// The pixel, exposed: radiance is scaled, and its variance by the square.
    fn finish(&self, exposure_scale: f64) -> Pixel {
        let count = f64::from(self.count.max(1));
        let degrees = count * (count - 1.0).max(1.0);
        Pixel {
            beauty: (self.radiance * exposure_scale).as_vec3(),
            alpha: (f64::from(self.covered) / count) as f32,
            depth_m: if self.covered > 0 {
                (self.depth_m / f64::from(self.covered)) as f32
            } else {
                f32::INFINITY
            },
            normal: self.normal.normalize_or_zero(),
            albedo: (self.albedo / count).as_vec3(),
            variance: (self.spread / degrees * exposure_scale.powi(2)).as_vec3(),
            samples: self.count,
        }
    }
}
