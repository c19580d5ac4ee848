//! Stamps: what a picture was rendered from, kept in its metadata.
//!
//! A stamp speaks of what was used, not of what is on the disk by now: the scene's files are hashed as they
//! are read, the tree as it is sampled, the program as it runs. So a picture of an old scene never gets the
//! stamp of a new one, however the files change while it is rendered.

use super::content::scene_fingerprint;
use super::render_job::{Effort, FrameNoise, Plan};
use crate::light_tree::ALGORITHM_VERSION;
use crate::render::RenderSettings;
use crate::render::exr::read_metadata;
use crate::render::knob::Knobs;
use crate::render::png::read_text;
use crate::scene::{Camera, Node, Scene};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::fmt;
use std::fs::File;
use std::io;
use std::path::Path;

const SOFTWARE: &str = concat!("candelabra-render ", env!("CARGO_PKG_VERSION"));

/// What one picture was rendered from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stamp {
    /// Program and version, for people.
    pub software: String,
    /// The frame.
    pub frame: i32,
    /// BLAKE3 over all that the pixels depend on, but for the tree: the bytes of the scene's files, the
    /// program, settings, camera and frame.
    pub fingerprint: String,
    /// BLAKE3 over what the frame can sample of the light tree.
    pub tree: String,
    /// The settings, for people.
    pub settings: serde_json::Value,
    /// The camera at the frame, for people.
    pub camera: serde_json::Value,
    /// The knobs of splitting that it was rendered with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub knobs: Option<Knobs>,
    /// What its noise has come to, if that was looked at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<FrameNoise>,
}

impl Stamp {
    /// Whether two pictures are of the same. What their noise is found to be may differ: it can be looked
    /// at more or less closely. Their knobs follow from the rest.
    pub fn is_of_same(&self, other: &Stamp) -> bool {
        let of = |stamp: &Stamp| Stamp { knobs: None, noise: None, ..stamp.clone() };
        of(self) == of(other)
    }

    /// The stamp of a picture, if every byte of its file is as it was written.
    pub fn of_picture(path: &Path) -> Option<Stamp> {
        serde_json::from_str(&read_metadata(path)?).ok()
    }
}

/// What a preview was made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PreviewStamp {
    /// Of the picture.
    pub fingerprint: String,
    /// Of the picture.
    pub tree: String,
    /// Stops, as they were asked for; `None` if they were left to the program.
    pub exposure: Option<f32>,
}

impl PreviewStamp {
    /// The stamp of the preview of a picture.
    pub fn new(picture: &Stamp, exposure: Option<f32>) -> PreviewStamp {
        let Stamp { fingerprint, tree, .. } = picture.clone();
        PreviewStamp { fingerprint, tree, exposure }
    }

    /// The stamp of a preview, if its file is whole.
    pub fn of_preview(path: &Path) -> Option<PreviewStamp> {
        serde_json::from_str(&read_text(path)?).ok()
    }
}

/// Makes the stamps of a shot.
pub struct Stamper<'a> {
    common: blake3::Hasher,
    settings: serde_json::Value,
    scene: &'a Scene,
    camera: Camera,
}

impl<'a> Stamper<'a> {
    /// For a scene as it was read, seen through a camera. `rest` is whatever else the pixels depend on.
    ///
    /// # Errors
    /// If this program cannot be read.
    pub fn new(
        scene: &'a Scene,
        camera: &Camera,
        (settings, effort): (&RenderSettings, &Effort),
        rest: impl fmt::Debug,
    ) -> io::Result<Stamper<'a>> {
        let mut settings = serde_json::to_value(settings).map_err(io::Error::other)?;
        settings["effort"] = serde_json::to_value(effort).map_err(io::Error::other)?;
        let place = place_of(scene, camera);
        let mut common = blake3::Hasher::new();
        common.update(&scene_fingerprint(scene));
        common.update(&program_fingerprint()?);
        let text =
            format!("{SOFTWARE} {ALGORITHM_VERSION} {camera:?} {place:?} {rest:?} {settings}");
        common.update(text.as_bytes());
        Ok(Stamper { common, settings, scene, camera: camera.clone() })
    }

    /// The fingerprint of a frame, without its tree. `plan` has the numbers of samples of its pixels, if
    /// they are given.
    pub fn fingerprint(&self, frame: i32, plan: Option<&Plan>) -> String {
        let mut hasher = self.common.clone();
        hasher.update(&frame.to_le_bytes());
        if let Some(plan) = plan {
            hasher.update(bytemuck::cast_slice(&plan.counts));
            let knobs = plan.knobs.iter().flat_map(|knobs| knobs.by_bounce);
            knobs.for_each(|knob| _ = hasher.update(&knob.to_le_bytes()));
        }
        hasher.finalize().to_hex().to_string()
    }

    /// The stamp of a frame, with the digest of what it samples of the tree.
    pub fn stamp(&self, frame: i32, plan: Option<&Plan>, tree: [u8; 32]) -> Stamp {
        let Stamper { scene, camera, .. } = self;
        let exposure_scale = scene.camera_at(camera, frame.into()).exposure_scale;
        let path = &*scene.nodes[camera.node as usize].path;
        Stamp {
            software: SOFTWARE.into(),
            frame,
            fingerprint: self.fingerprint(frame, plan),
            tree: blake3::Hash::from(tree).to_hex().to_string(),
            settings: self.settings.clone(),
            camera: json!({ "path": path, "exposure_scale": exposure_scale }),
            knobs: None,
            noise: None,
        }
    }
}

/// The camera's node, and all above it.
fn place_of<'a>(scene: &'a Scene, camera: &Camera) -> Vec<&'a Node> {
    let node = |number: u32| &scene.nodes[number as usize];
    let above = |node_: &&'a Node| node_.parent.map(node);
    std::iter::successors(Some(node(camera.node)), above).collect()
}

/// This very program, by its content: another build may make other pictures.
fn program_fingerprint() -> io::Result<[u8; 32]> {
    // The link leads to the file that runs, even if another has taken its name since.
    let program = match File::open("/proc/self/exe") {
        Ok(file) => file,
        Err(_) => File::open(std::env::current_exe()?)?,
    };
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(program)?;
    Ok(*hasher.finalize().as_bytes())
}
