//! What the commands that look at one frame of a shot have in common.

use crate::stderr::say;
use anyhow::{Context, Result, anyhow};
use candelabra::emitter::Emitters;
use candelabra::light_tree::LightTree;
use candelabra::pipeline::{self, Look, View};
use candelabra::scene::{Camera, Scene};
use candelabra::store::AlignedBytes;
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[group(skip)]
pub struct Arguments {
    /// The scene: .gltf, .glb or .obj
    scene: PathBuf,
    /// The frame; the first of the scene if not given
    #[arg(long, allow_negative_numbers = true)]
    frame: Option<i32>,
    #[command(flatten)]
    view: View,
}

impl Arguments {
    /// The file of the scene.
    pub fn scene(&self) -> &Path {
        &self.scene
    }

    /// What to look at it through.
    pub fn view(&self) -> &View {
        &self.view
    }
}

/// A scene with the tree of one frame.
pub struct Shot {
    pub scene: Scene,
    pub emitters: Emitters,
    pub tree: LightTree<AlignedBytes>,
    pub camera: Camera,
    pub frame: i32,
}

impl Shot {
    /// Reads a scene and builds its tree. `aspect` is that of the picture to come.
    pub fn prepare(arguments: &Arguments, aspect: f32) -> Result<Shot> {
        let mut scene = pipeline::load_scene(&arguments.scene)?;
        let name = || arguments.scene.display().to_string();
        let Look { camera, note } = pipeline::look(&mut scene, &arguments.view, aspect)?;
        if let Some(note) = note {
            say(format_args!("note: {note}"));
        }
        let emitters = Emitters::collect(&scene);
        let frame = arguments.frame.unwrap_or_else(|| pipeline::frames_of(&scene)[0]);
        let survey = pipeline::survey(&scene, &emitters, &[frame]).with_context(name)?;
        let bytes = pipeline::build_tree(&survey);
        let tree = LightTree::open(bytes).map_err(|error| anyhow!("{}: {error}", name()))?;
        Ok(Shot { scene, emitters, tree, camera, frame })
    }
}
