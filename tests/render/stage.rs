//! Tiny scenes built in memory, and pictures of them.
//!
//! A [`Stage`] is a scene under construction: everything is put at a node of its own. [`Set`] is what
//! a shot is prepared to: emitters, a verified tree, a delegate for each setting.

use candelabra::emitter::Emitters;
use candelabra::light_tree::LightTree;
use candelabra::pipeline;
use candelabra::render::buffers::RenderBuffers;
use candelabra::render::{LightStrategy, RenderDelegate, RenderSettings};
use candelabra::scene::{
    Camera, Coat, Instance, Light, LightKind, Material, Mesh, Node, Pixels, Scene, Texture,
    TextureUse, Transmission, Trs, Volume, Wrap,
};
use candelabra::store::AlignedBytes;
use glam::{DQuat, DVec3, Vec2, Vec3};
use std::f32::consts::TAU;

/// A scene under construction.
#[derive(Default)]
pub struct Stage {
    pub scene: Scene,
}

/// A scene with its emitters and its tree.
pub struct Set<'a> {
    pub scene: &'a Scene,
    pub emitters: Emitters,
    pub tree: LightTree<AlignedBytes>,
}

/// A place without a turn.
pub fn at(place: impl Into<DVec3>) -> Trs {
    Trs::Parts { translation: place.into(), rotation: DQuat::IDENTITY, scale: DVec3::ONE }
}

/// A place whose local +Z looks at a point: what [`Stage::quad`] and [`Stage::disk`] face.
pub fn facing(place: impl Into<DVec3>, target: impl Into<DVec3>) -> Trs {
    let place = place.into();
    let rotation = DQuat::from_rotation_arc(DVec3::Z, (target.into() - place).normalize());
    Trs::Parts { translation: place, rotation, scale: DVec3::ONE }
}

/// A place whose local -Z looks at a point: what lights aim along.
pub fn aimed(place: impl Into<DVec3>, target: impl Into<DVec3>) -> Trs {
    let place = place.into();
    facing(place, 2.0 * place - target.into())
}

/// The same place, with its local axes scaled.
pub fn scaled(place: Trs, by: impl Into<DVec3>) -> Trs {
    match place {
        Trs::Parts { translation, rotation, scale } => {
            Trs::Parts { translation, rotation, scale: scale * by.into() }
        }
        Trs::Matrix(_) => unreachable!("stages are built of parts"),
    }
}

/// A surface that reflects like Lambert's and nothing else.
pub fn lambert(albedo: impl Into<Vec3>) -> Material {
    Material { base_color: albedo.into(), specular: 0.0, ..Default::default() }
}

/// What a material is coated with.
pub fn coat(factor: f32, roughness: f32) -> Option<Coat> {
    Some(Coat {
        factor,
        factor_texture: None,
        roughness,
        roughness_texture: None,
        normal_texture: None,
        normal_scale: 1.0,
    })
}

/// A pane of smooth glass of some colour that mirrors nothing: it lets through the colour's share at every angle.
pub fn filter(color: impl Into<Vec3>) -> Material {
    let transmission = Some(Transmission { factor: 1.0, factor_texture: None, volume: None });
    Material { transmission, roughness: 0.0, ..lambert(color) }
}

/// A wall of white glass without thickness, of some roughness and share that passes.
pub fn milk(roughness: f32, factor: f32) -> Material {
    let transmission = Some(Transmission { factor, factor_texture: None, volume: None });
    Material { transmission, roughness, ..Default::default() }
}

/// The surface of smooth solid glass.
pub fn solid(ior: f32, absorption: Vec3) -> Material {
    let volume = Some(Volume { absorption });
    let transmission = Some(Transmission { factor: 1.0, factor_texture: None, volume });
    Material { transmission, roughness: 0.0, ior, ..Default::default() }
}

/// The same with the reflections of glass.
pub fn pane(color: impl Into<Vec3>) -> Material {
    Material { specular: 1.0, ..filter(color) }
}

/// A black surface that shines from its front.
pub fn glow(radiance: impl Into<Vec3>) -> Material {
    Material { emission_nits: radiance.into(), ..lambert(Vec3::ZERO) }
}

/// A linear picture whose texels are given by column and row.
pub fn picture(size: [u32; 2], bilinear: bool, texel: impl Fn(u32, u32) -> [f32; 3]) -> Texture {
    let [width, height] = size;
    let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
    Texture {
        name: "picture".into(),
        width,
        height,
        pixels: Pixels::Float(texels),
        wrap: [Wrap::Repeat, Wrap::Clamp],
        bilinear,
    }
}

/// Settings of a square picture of direct light, through the tree.
pub fn direct(size: u32, samples: u32) -> RenderSettings {
    RenderSettings { width: size, height: size, samples, depth: 1, ..Default::default() }
}

/// The same with another strategy.
pub fn by(strategy: LightStrategy, mis: bool, settings: &RenderSettings) -> RenderSettings {
    RenderSettings { strategy, mis, ..settings.clone() }
}

impl Stage {
    /// Adds a node below the root.
    pub fn node(&mut self, place: Trs) -> u32 {
        let number = self.scene.nodes.len();
        self.scene.nodes.push(Node::fixed(format!("/node_{number}"), None, place));
        number as u32
    }

    pub fn texture(&mut self, texture: Texture) -> Option<TextureUse> {
        self.scene.textures.push(texture);
        let texture = self.scene.textures.len() as u32 - 1;
        Some(TextureUse { texture, uv_set: 0, transform: None })
    }

    /// Puts a mesh at a new node and returns its instance.
    pub fn mesh(&mut self, mesh: Mesh, material: Material, place: Trs) -> &mut Instance {
        let node = self.node(place);
        self.scene.materials.push(material);
        let material = Some(self.scene.materials.len() as u32 - 1);
        self.scene.meshes.push(Mesh { material, ..mesh });
        self.again(self.scene.meshes.len() as u32 - 1, node)
    }

    /// Puts a mesh that is there already at a node.
    pub fn again(&mut self, mesh: u32, node: u32) -> &mut Instance {
        let path = format!("/mesh_{}", self.scene.instances.len());
        let (values, shaping) = (None, None);
        self.scene.instances.push(Instance {
            path: path.into(),
            node,
            mesh,
            values,
            shaping,
            forced: false,
            visibility: Default::default(),
        });
        self.scene.instances.last_mut().unwrap()
    }

    /// A rectangle about the origin of its node that faces local +Z, with a texture set.
    pub fn quad(&mut self, size: [f32; 2], material: Material, place: Trs) -> &mut Instance {
        self.mesh(quad(size), material, place)
    }

    /// A disk about the origin of its node that faces local +Z.
    pub fn disk(&mut self, radius: f32, material: Material, place: Trs) -> &mut Instance {
        const CORNERS: u32 = 256;
        // A polygon of the disk's own area.
        let step = TAU / CORNERS as f32;
        let reach = radius * (step / step.sin()).sqrt();
        let corner = |i: u32| Vec2::from_angle(i as f32 * step).extend(0.0) * reach;
        let positions = std::iter::once(Vec3::ZERO).chain((0..CORNERS).map(corner)).collect();
        let triangles = (0..CORNERS).map(|i| [0, 1 + i, 1 + (i + 1) % CORNERS]).collect();
        self.mesh(Mesh { positions, triangles, ..Default::default() }, material, place)
    }

    /// A ball of flat facets.
    pub fn ball(&mut self, radius: f32, facets: u32, material: Material, place: Trs) {
        self.mesh(ball(radius, facets), material, place);
    }

    /// Puts a light at a new node.
    pub fn light(&mut self, kind: LightKind, place: Trs) -> &mut Light {
        let node = self.node(place);
        self.scene.lights.push(Light {
            node,
            kind,
            values: None,
            range_m: None,
            forced: false,
            visibility: Default::default(),
        });
        self.scene.lights.last_mut().unwrap()
    }

    /// Puts a pinhole camera that looks from one point at another.
    pub fn look(
        &mut self,
        from: impl Into<DVec3>,
        at: impl Into<DVec3>,
        yfov_rad: f32,
    ) -> &mut Camera {
        let node = self.node(aimed(from, at));
        self.scene.cameras.push(Camera::perspective(node, yfov_rad));
        self.scene.cameras.last_mut().unwrap()
    }

    /// The scene with its tree, which is verified.
    pub fn set(&self) -> Set<'_> {
        Set::of(&self.scene, &[1])
    }

    /// One frame of a scene that does not move.
    pub fn render(&self, settings: &RenderSettings) -> RenderBuffers {
        self.set().render(settings, 1)
    }
}

impl<'a> Set<'a> {
    pub fn of(scene: &'a Scene, frames: &[i32]) -> Set<'a> {
        let emitters = Emitters::collect(scene);
        let bytes = tree_bytes(scene, frames);
        let tree = LightTree::open(bytes).expect("a tree just built opens");
        tree.verify().expect("a tree just built is sound");
        Set { scene, emitters, tree }
    }

    /// A frame, seen by the first camera.
    pub fn render(&self, settings: &RenderSettings, frame: i32) -> RenderBuffers {
        self.seen_by(self.scene.cameras[0].clone(), settings, frame)
    }

    /// A frame, seen by a camera that stands at a node of the scene.
    pub fn seen_by(&self, camera: Camera, settings: &RenderSettings, frame: i32) -> RenderBuffers {
        RenderDelegate::new(self.scene, &self.emitters, camera, settings.clone())
            .render(&self.tree, frame, &())
            .unwrap_or_else(|error| panic!("{error}"))
            .buffers
    }
}

/// The tree file of a scene.
pub fn tree_bytes(scene: &Scene, frames: &[i32]) -> AlignedBytes {
    let survey = pipeline::survey(scene, &Emitters::collect(scene), frames).unwrap();
    pipeline::build_tree(&survey)
}

fn quad([width, height]: [f32; 2]) -> Mesh {
    let corner = |[u, v]: [f32; 2]| Vec3::new((u - 0.5) * width, (0.5 - v) * height, 0.0);
    let uvs = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    Mesh {
        positions: uvs.map(corner).into(),
        uv_sets: vec![uvs.map(Vec2::from).into()],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Default::default()
    }
}

/// A sphere of `2 facets` meridians and `facets` parallels.
fn ball(radius: f32, facets: u32) -> Mesh {
    let around = 2 * facets;
    let corner = |i: u32| {
        let (theta, phi) =
            ((i / around) as f32 * TAU / around as f32, (i % around) as f32 * TAU / around as f32);
        let (sin, cos) = theta.sin_cos();
        Vec3::new(sin * phi.cos(), cos, -sin * phi.sin()) * radius
    };
    let square = |i: u32| {
        let (row, column) = (i / around, i % around);
        let [a, b] = [column, (column + 1) % around].map(|column| row * around + column);
        [[a, a + around, b + around], [a, b + around, b]]
    };
    let triangles: Vec<[u32; 3]> = (0..facets * around).flat_map(square).collect();
    let positions: Vec<Vec3> = (0..(facets + 1) * around).map(corner).collect();
    Mesh { positions, triangles, ..Default::default() }
}
