//! Keys of what a table of what is hidden is learned from, beside its tree.
//!
//! Each tells apart what the others do not, so that a table that is out of date can say why. None depends on names, on
//! the order in which meshes are listed or on how bright what shines is: that does not change what is seen from
//! where.

use crate::light_tree::learned::ViewKeys;
use crate::render::surface::is_pane;
use crate::scene::{
    AlphaMode, Camera, Channel, Deformation, Instance, Keys, LensKeys, LightKind, Links,
    Membership, Mesh, Pose, Scene, Skin,
};
use blake3::Hasher;
use bytemuck::{NoUninit, cast_slice};
use rayon::prelude::*;

type Key = [u8; 32];

/// The keys of a scene that is seen through a camera.
pub fn view_keys(scene: &Scene, camera: &Camera) -> ViewKeys {
    let places = places(scene);
    let (infinite, geometry) =
        rayon::join(|| infinite(scene, &places), || geometry(scene, &places));
    ViewKeys { infinite, geometry, camera: through(scene, camera, &places) }
}

/// Where each node is: what stands still by its place in the world, what moves by all that moves it.
fn places(scene: &Scene) -> Vec<Key> {
    let pose = scene.pose_at(0.0);
    let moving = scene.moving_nodes();
    let mut places: Vec<Key> = Vec::with_capacity(scene.nodes.len());
    for (at, node) in scene.nodes.iter().enumerate() {
        places.push(match moving[at] {
            false => still(&pose, at as u32),
            true => {
                let mut hasher = Hasher::new();
                let clock = clock(scene);
                hasher.update(format!("{:?} {clock:?} {}", node.local, scene.origin).as_bytes());
                hasher.update(&node.parent.map_or([0; 32], |parent| places[parent as usize]));
                node.channels.iter().for_each(|channel| add_channel(&mut hasher, channel));
                finish(&hasher)
            }
        });
    }
    places
}

/// What of the timeline says when a frame is.
fn clock(scene: &Scene) -> (f64, f64) {
    (scene.timeline.zero_frame, scene.timeline.frames_per_second)
}

fn still(pose: &Pose, node: u32) -> Key {
    let mut hasher = Hasher::new();
    // Zero has a sign that means nothing.
    let numbers = pose.world(node).to_cols_array().map(|number| number + 0.0);
    hasher.update(cast_slice(&numbers));
    finish(&hasher)
}

fn add_keys<T: NoUninit>(hasher: &mut Hasher, keys: &Keys<impl Sized>, values: &[T]) {
    hasher.update(format!("{:?} {}", keys.interpolation, values.len()).as_bytes());
    hasher.update(cast_slice(&keys.times_s)).update(cast_slice(values));
}

fn add_channel(hasher: &mut Hasher, channel: &Channel) {
    match channel {
        Channel::Translation(keys) => add_keys(hasher.update(b"t"), keys, &keys.values),
        Channel::Rotation(keys) => {
            let values: Vec<[f32; 4]> = keys.values.iter().map(|turn| turn.to_array()).collect();
            add_keys(hasher.update(b"r"), keys, &values);
        }
        Channel::Scale(keys) => add_keys(hasher.update(b"s"), keys, &keys.values),
    }
}

/// Lights at infinity, in the order of their rows: weights are told by row. One that never shines has none.
fn infinite(scene: &Scene, places: &[Key]) -> Key {
    let mut hasher = Hasher::new();
    let shines = |row: u32| scene.peak_rgb_of_light(row).max_element() > 0.0;
    for (_, light) in (0..).zip(&scene.lights).filter(|&(row, _)| shines(row)) {
        let text = match light.kind {
            LightKind::Distant { angle_rad, .. } => format!("sun {angle_rad}"),
            LightKind::Dome { texture: Some(texture), .. } => {
                let texture = &scene.textures[texture as usize];
                hasher.update(texture.bytes());
                format!("dome {} {}", texture.width, texture.height)
            }
            LightKind::Dome { texture: None, .. } => "dome".into(),
            _ => continue,
        };
        hasher.update(format!("{text} {} {:?}", light.forced, light.visibility).as_bytes());
        hasher.update(&places[light.node as usize]);
    }
    finish(&hasher)
}

fn geometry(scene: &Scene, places: &[Key]) -> Key {
    let shapes: Vec<Key> = scene.meshes.par_iter().map(|mesh| shape(scene, mesh)).collect();
    let instance = |(row, instance): (usize, &Instance)| {
        let mut hasher = Hasher::new();
        hasher.update(&shapes[instance.mesh as usize]).update(&places[instance.node as usize]);
        hasher.update(format!("{:?}", instance.visibility).as_bytes());
        add_links(&mut hasher, scene, scene.linking.of_instance(row as u32));
        finish(&hasher)
    };
    let mut keys: Vec<Key> = scene.instances.par_iter().enumerate().map(instance).collect();
    keys.par_sort_unstable();
    let mut hasher = Hasher::new();
    hasher.update(keys.as_flattened());
    // Which lights are shadowed by what.
    for (light, links) in scene.linking.linked_lights() {
        hasher.update(format!("{light} {:?}", links.shadow).as_bytes());
    }
    finish(&hasher)
}

/// The sets that geometry is in.
fn add_links(hasher: &mut Hasher, scene: &Scene, links: Links) {
    if let Some(row) = links.membership {
        let membership: &Membership = &scene.linking.memberships()[row as usize];
        hasher.update(format!("{membership:?}").as_bytes());
    }
}

/// The triangles of a mesh, and what of them lets light through.
fn shape(scene: &Scene, mesh: &Mesh) -> Key {
    let mut hasher = Hasher::new();
    hasher.update(format!("{} {}", mesh.positions.len(), mesh.triangles.len()).as_bytes());
    hasher.update_rayon(cast_slice(&mesh.positions));
    hasher.update_rayon(cast_slice(&mesh.triangles));
    if let Some(deformation) = &mesh.deformation {
        hasher.update(format!("{:?}", clock(scene)).as_bytes());
        add_deformation(&mut hasher, deformation);
    }
    let material = mesh.material.map(|material| &scene.materials[material as usize]);
    if let Some(material) = material.filter(|own| own.alpha_mode != AlphaMode::Opaque) {
        hasher.update(format!("{:?} {}", material.alpha_mode, material.opacity).as_bytes());
        let colors: Vec<f32> = mesh.colors.iter().map(|color| color.w).collect();
        hasher.update(cast_slice(&colors));
        if let Some(used) = material.base_color_texture {
            let texture = &scene.textures[used.texture as usize];
            let (size, wrap) = ([texture.width, texture.height], texture.wrap);
            let how = (used.transform, size, wrap, texture.bilinear);
            hasher.update(format!("{how:?}").as_bytes());
            if let Some(uvs) = mesh.uv_sets.get(used.uv_set as usize) {
                hasher.update_rayon(cast_slice(uvs));
            }
            let opacities: Vec<u8> = texture.opacities().collect();
            hasher.update_rayon(&opacities);
        }
    }
    if material.is_some_and(is_pane) {
        hasher.update(b"pane");
    }
    finish(&hasher)
}

/// All that decides how a mesh is bent.
fn add_deformation(hasher: &mut Hasher, deformation: &Deformation) {
    let Deformation { rest, targets, weights, skin } = deformation;
    let lengths = (targets.len(), weights.len(), skin.as_ref().map(|skin| skin.influences.len()));
    hasher.update(format!("{lengths:?}").as_bytes());
    hasher.update_rayon(cast_slice(&rest.positions));
    targets.iter().for_each(|target| {
        hasher.update_rayon(cast_slice(&target.positions));
    });
    weights.iter().for_each(|keys| add_keys(hasher, keys, &keys.values));
    let Some(Skin { skeleton, ends, influences }) = skin else { return };
    hasher.update(cast_slice(ends));
    influences.iter().for_each(|(joint, weight)| {
        hasher.update(&joint.to_le_bytes()).update(&weight.to_le_bytes());
    });
    for (parent, node) in &skeleton.nodes {
        hasher.update(format!("{parent:?} {:?}", node.local).as_bytes());
        node.channels.iter().for_each(|channel| add_channel(hasher, channel));
    }
    hasher.update(format!("{:?}", skeleton.joints).as_bytes());
}

fn through(scene: &Scene, camera: &Camera, places: &[Key]) -> Key {
    // A picture's brightness, and the place of its node in the list, are nothing that is seen. Blur shows little
    // that the frames on both sides do not.
    let lens = camera.over_time.as_deref();
    let lens = lens.map(|lens| LensKeys { exposure_scale: None, ..lens.clone() });
    let lens = lens.filter(|lens| !lens.is_empty());
    let looks = Camera {
        node: 0,
        exposure_scale: 1.0,
        shutter: None,
        over_time: None,
        is_hidden: false,
        ..camera.clone()
    };
    let mut hasher = Hasher::new();
    hasher.update(format!("{looks:?}").as_bytes()).update(&places[camera.node as usize]);
    if let Some(lens) = lens {
        hasher.update(format!("{lens:?} {:?}", clock(scene)).as_bytes());
    }
    finish(&hasher)
}

fn finish(hasher: &Hasher) -> Key {
    *hasher.finalize().as_bytes()
}
