//! What is read once for a shot.

use super::{RenderError, RenderJob, SceneCounts};
use crate::emitter::Emitters;
use crate::pipeline::read::read_scene;
use crate::pipeline::{ASPECT, Event, ShotTrees, Watch, frames_of, look, option};
use crate::render::RenderSettings;
use crate::render::frames::Frames;
use crate::scene::{Camera, Instance, Material, Scene};

/// A scene with its camera, and what is to be rendered of it.
pub(super) struct Shot {
    pub scene: Scene,
    pub camera: Camera,
    pub frames: Frames,
    pub settings: RenderSettings,
}

impl Shot {
    pub fn read(job: &RenderJob, watch: &dyn Watch) -> Result<Shot, RenderError> {
        let note = |text: String| watch.tell(Event::Note { text });
        let mut scene =
            read_scene(&job.scene, &job.stage, job.strict.as_ref(), &job.force_lights, watch)?;
        if let Some(fog) = &job.fog {
            scene.medium = Some(fog.clone());
        }
        let frames = frames_for(job.frames.as_ref(), &scene, &note);
        let aspect = job.size.map_or(ASPECT, |(width, height)| width as f32 / height as f32);
        let found = look(&mut scene, &job.view, aspect)?;
        found.note.into_iter().for_each(note);
        if !gives_light(&scene) {
            let source = scene.source.display();
            note(format!("{source}: nothing in the scene gives light; pictures are black"));
        }
        let camera = found.camera;
        let shape = || option::size_of(camera.aspect.unwrap_or(ASPECT), RenderJob::HEIGHT);
        let (width, height) = job.size.unwrap_or_else(shape);
        let samples = job.effort.samples;
        let settings = RenderSettings { width, height, samples, ..job.settings.clone() };
        Ok(Shot { scene, camera, frames, settings })
    }

    /// What it consists of.
    pub fn count(&self, emitters: &Emitters, trees: &ShotTrees) -> SceneCounts {
        let meshes = self.scene.instances.iter().map(|instance| instance.mesh as usize);
        SceneCounts {
            lights: emitters.lights().len(),
            emitters: emitters.len(),
            triangles: meshes.map(|mesh| self.scene.meshes[mesh].triangles.len() as u64).sum(),
            tree_file_bytes: trees.file_length(),
        }
    }
}

/// Whether it has lights or surfaces that glow, at some time.
fn gives_light(scene: &Scene) -> bool {
    let glows = |instance: &Instance| {
        instance.values.is_some() || scene.material_of(instance.mesh).is_some_and(Material::emits)
    };
    !scene.lights.is_empty() || scene.instances.iter().any(glows)
}

/// The frames that were asked for, or the first. Tells what may not be what the user means.
fn frames_for(asked: Option<&Frames>, scene: &Scene, note: &dyn Fn(String)) -> Frames {
    let own = frames_of(scene);
    let (first, last) = (own[0], own[own.len() - 1]);
    let source = scene.source.display();
    let Some(asked) = asked else {
        if own.len() > 1 {
            note(format!(
                "{source}: no frames were asked for; of its frames {first}-{last} the first is \
                 rendered (see --frames)"
            ));
        }
        return Frames::one(first);
    };
    let outside = asked.as_slice().iter().filter(|frame| !(first..=last).contains(frame)).count();
    if own.len() > 1 && outside > 0 {
        note(format!(
            "{source}: {outside} of the frames to be rendered are outside its own, {first}-{last}; \
             there, what moves stands as it does at the nearer end"
        ));
    }
    asked.clone()
}
