//! Floor 1: the scene index, the scene in memory after ingest.
//!
//! A [`Scene`] is a simple normal form: flat tables that name each other by index. Whatever a file
//! format can say is compiled down to it by `ingest`, so that nothing above ever asks where a prim
//! came from. It holds data and answers questions about it ([`Scene::pose_at`],
//! [`Scene::requirements`]); it reads no files and it is immutable while a frame renders.
//!
//! | table | what a row is |
//! |---|---|
//! | [`nodes`](Scene::nodes) | a place in the transform hierarchy, perhaps animated; parents first |
//! | [`meshes`](Scene::meshes) | triangles with one material, in their own space |
//! | [`materials`](Scene::materials), [`textures`](Scene::textures) | how a surface reflects and emits |
//! | [`instances`](Scene::instances) | a mesh put at a node: what a ray can hit |
//! | [`lights`](Scene::lights) | lights that are not meshes: points, spots, spheres, suns, domes |
//! | [`profiles`](Scene::profiles) | how the light of a luminaire was measured to depend on direction |
//! | [`light_groups`](Scene::light_groups) | a name for the lights at a node and below |
//! | [`light_filters`](Scene::light_filters) | what multiplies the light of some lights on its way |
//! | [`light_responses`](Scene::light_responses) | how much of some lights surfaces reflect |
//! | [`linking`](Scene::linking) | what lights light, and what casts their shadows, where that is not everything |
//! | [`medium`](Scene::medium) | the fog that fills it, or a box of it; one or none |
//! | [`cameras`](Scene::cameras) | a view from a node |
//! | [`notes`](Scene::notes) | what the file holds and the scene does not |
//!
//! Units: metres, seconds, radians; +Y is up. Emission is in the file's own photometric numbers
//! (nits, candela, lux): radiance 1 in the file is 1 in the picture.
//! Spaces: a mesh and a light are in their node's *local* space; [`Pose`] takes local to *world*,
//! whose origin is [`Scene::origin`].

mod camera;
mod deformation;
mod ies_profile;
mod lens;
mod light;
mod light_filter;
mod light_response;
mod linking;
mod material;
mod medium;
mod mesh;
mod note;
mod pose;
mod posing;
mod requirements;
mod shutter;
mod source_file;
mod steady;
mod texture;
mod timeline;
mod values;
mod visibility;

pub use camera::{Camera, Projection};
pub use deformation::{Deformation, FARTHEST_M, Shape, Skeleton, Skin, Target, is_near};
pub use ies_profile::{IesProfile, IesTable, LitCone, Pole};
pub use lens::LensKeys;
pub use light::{Light, LightKind, Shaping};
pub use light_filter::{BlockerShape, FilterKind, LightFilter, LightFilters, Rod};
pub use light_response::{LightResponses, Response};
pub use linking::{LinkRows, Linking, Links, Membership};
pub use material::{AlphaMode, Coat, Material, Transmission, Volume};
pub use medium::{FogBox, Medium};
pub use mesh::{Instance, Mesh};
pub use note::{Category, Note};
pub use pose::{Blend, Channel, Interpolation, Keys, Node, Pose, Trs};
pub use posing::Posing;
pub use requirements::Requirements;
pub use shutter::Shutter;
pub use source_file::SourceFile;
pub use texture::{Pixels, Texture, TextureUse, Wrap};
pub use timeline::Timeline;
pub use visibility::Visibility;

use crate::math::built_in;
use glam::DVec3;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// USD's name of a stage's primary camera (`UsdUtilsGetPrimaryCameraName`).
const MAIN_CAMERA: &str = "main_cam";

/// Everything ingest found, by index. See the [module page](self).
#[derive(Debug, Default)]
pub struct Scene {
    /// The file this scene was read from, for messages.
    pub source: PathBuf,
    /// That file, and every file that was read because it refers to it, as they were read.
    pub files: Vec<SourceFile>,
    /// The transform hierarchy. A parent stands before its children.
    pub nodes: Vec<Node>,
    /// Triangle meshes, one material each.
    pub meshes: Vec<Mesh>,
    /// Materials. A mesh without one uses [`Material::default`].
    pub materials: Vec<Material>,
    /// Decoded images with their sampling rule.
    pub textures: Vec<Texture>,
    /// Meshes put into the world.
    pub instances: Vec<Instance>,
    /// Lights that are not meshes.
    pub lights: Vec<Light>,
    /// Photometric profiles of lights.
    pub profiles: Vec<IesProfile>,
    /// Light groups by node: of the lights at it, and of those below that have none of their own.
    pub light_groups: BTreeMap<u32, String>,
    /// Which lights have which filters.
    pub light_filters: LightFilters,
    /// How much of which lights surfaces reflect, where that is not all.
    pub light_responses: LightResponses,
    /// Which lights light what, and what casts shadows from them.
    pub linking: Linking,
    /// The fog in it, if there is any.
    pub medium: Option<Medium>,
    /// Cameras, in the file's order.
    pub cameras: Vec<Camera>,
    /// Where the origin of poses is, in the file's world, metres: what is subtracted from every
    /// position before it is rounded to 32 bits, and added to those that are shown.
    pub origin: DVec3,
    /// How frame numbers map to seconds.
    pub timeline: Timeline,
    /// What was left out, mended or approximated on the way from the file, by category; each note
    /// names its objects.
    pub notes: Vec<Note>,
}

impl Scene {
    /// Where everything is and how strong it shines at `time_s` seconds on the file's clock.
    pub fn pose_at(&self, time_s: f64) -> Pose {
        Pose::evaluate(self, time_s)
    }

    /// Whether two poses differ in nothing but from where the scene is seen, and in lights at infinity.
    pub fn is_alike(&self, one: &Pose, other: &Pose) -> bool {
        let instances = self.instances.iter().map(|instance| instance.node);
        let lights = || (0..).zip(&self.lights).filter(|(_, light)| !light.kind.is_infinite());
        let fog = self.medium.iter().filter_map(|medium| Some(medium.region?.node));
        let filters = self.light_filters.all().iter().map(|filter| filter.node);
        let placed = instances.chain(lights().map(|(_, light)| light.node));
        let mut nodes = placed.chain(fog).chain(filters);
        nodes.all(|node| one.world(node) == other.world(node))
            && lights().all(|(row, _)| one.light_rgb(row) == other.light_rgb(row))
            && one.instance_rgb == other.instance_rgb
            && one.shapes.are_alike(&other.shapes)
    }

    /// Whether any light but those at infinity moves, varies in strength or changes its shape.
    pub fn has_lights_that_change(&self) -> bool {
        let moving = self.moving_nodes();
        let changes = |node: u32, values: Option<&Keys<_>>| {
            moving[node as usize] || values.is_some_and(Keys::varies)
        };
        let shines = |row: &usize| self.peak_rgb_of_instance(*row as u32).max_element() > 0.0;
        let mut meshes = (0..self.instances.len()).filter(shines).map(|row| &self.instances[row]);
        let mut lights = self.lights.iter().filter(|light| !light.kind.is_infinite());
        meshes
            .any(|mesh| changes(mesh.node, mesh.values.as_deref()) || self.changes_shape(mesh.mesh))
            || lights.any(|light| changes(light.node, light.values.as_deref()))
    }

    /// For each node, whether it moves with time.
    pub fn moving_nodes(&self) -> Vec<bool> {
        pose::moving(&self.nodes)
    }

    /// For each node, whether it keeps shapes however it moves: neither it nor an ancestor scales
    /// unevenly at any time, or down to nothing.
    pub fn rigid_nodes(&self) -> Vec<bool> {
        pose::rigid(&self.nodes)
    }

    /// Whether a mesh has a shape that changes with time.
    pub fn changes_shape(&self, mesh: u32) -> bool {
        let deformation = self.meshes[mesh as usize].deformation.as_ref();
        built_in::MOTION && deformation.is_some_and(|deformation| deformation.varies())
    }

    /// Whether an instance has the shapes of a mesh that deforms, which may all be alike.
    pub fn deforms(&self, instance: u32) -> bool {
        let mesh = self.instances[instance as usize].mesh;
        built_in::MOTION && self.meshes[mesh as usize].deformation.is_some()
    }

    /// The material of a mesh, if it has one of its own.
    pub fn material_of(&self, mesh: u32) -> Option<&Material> {
        self.meshes[mesh as usize].material.map(|material| &self.materials[material as usize])
    }

    /// The prim path of an instance, such as `/World/Lamps/lamp_12`.
    pub fn instance_path(&self, instance: usize) -> &str {
        &self.instances[instance].path
    }

    /// The prim path of a light.
    pub fn light_path(&self, light: usize) -> &str {
        &self.nodes[self.lights[light].node as usize].path
    }

    /// The camera that is looked through if none is named: one called `main_cam`, as in `usdrecord`, or else the
    /// first. One that the file hides is looked through only if it hides all.
    pub fn default_camera(&self) -> Option<&Camera> {
        let is_main = |camera: &&Camera| {
            let path = &self.nodes[camera.node as usize].path;
            path.rsplit('/').next() == Some(MAIN_CAMERA)
        };
        let choose = |is_hidden: bool| {
            let mut of_these =
                self.cameras.iter().filter(move |camera| camera.is_hidden == is_hidden);
            let first = of_these.clone().next();
            of_these.find(is_main).or(first)
        };
        choose(false).or_else(|| choose(true))
    }

    /// Which features of the renderer and the tree this scene switches on.
    pub fn requirements(&self) -> Requirements {
        Requirements::of(self)
    }
}
