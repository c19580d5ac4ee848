//! Lights that change, followed through the frames of two scenes.

use super::change::Apart;
use super::light::{Light, Row};
use super::pairs::{Half, Pair};
use super::profile::shape_of;
use super::scene_side::SceneSide;
use crate::bounds::Aabb;
use crate::emitter::{LightSource, MeshLight};
use crate::math::color::luminance;
use crate::scene::Pose;
use glam::{Affine3A, Vec3, Vec3A};
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};

/// What changes of a light.
#[derive(Clone, Copy)]
struct Animated<'a> {
    node: u32,
    /// Of a mesh: what it is an instance of.
    mesh: Option<&'a MeshLight>,
    /// Whether that changes its shape.
    deforms: bool,
    /// Middle of the mesh in its own space, where it does not.
    middle: Vec3,
    strength: Strength,
}

#[derive(Clone, Copy)]
enum Strength {
    Light(u32),
    Instance(u32),
}

/// How far apart the versions of each light come that changes in both scenes, by the light's number. All
/// frames of either scene count. `shift` is from the origin of the first scene to that of the second.
pub(super) fn apart(scenes: [&SceneSide; 2], pairs: &[Pair], shift: Vec3) -> HashMap<u32, Apart> {
    let animated: Vec<(u32, [Animated; 2])> = pairs
        .iter()
        .filter_map(|pair| match (&pair.before, &pair.after) {
            (Some(Half::Lit(a)), Some(Half::Lit(b))) if a.changes() && b.changes() => {
                Some((pair.number, [animated(scenes[0], a), animated(scenes[1], b)]))
            }
            _ => None,
        })
        .collect();
    let mut found = vec![Apart::default(); animated.len()];
    let frames: BTreeSet<i32> = match animated.is_empty() {
        true => BTreeSet::new(),
        false => scenes.iter().flat_map(|side| side.frames.iter().copied()).collect(),
    };
    for frame in frames {
        let poses = scenes.map(|side| side.pose_at(frame));
        found.par_iter_mut().zip(&animated).for_each(|(apart, (_, lights))| {
            let [a, mut b] = [0, 1].map(|side| lights[side].at(scenes[side], &poses[side]));
            b.0.translation += Vec3A::from(shift);
            let deforms = lights.iter().any(|light| light.deforms);
            let shape = |side: usize| lights[side].shape(scenes[side], &poses[side]);
            let is_reshaped = deforms && shape(0) != shape(1);
            if a == b && !is_reshaped {
                return;
            }
            apart.frames += 1;
            apart.reshaped += u32::from(is_reshaped);
            let middle = |side: usize| lights[side].middle(scenes[side], &poses[side]);
            let moved = (a.0.transform_point3(middle(0))).distance(b.0.transform_point3(middle(1)));
            apart.most_moved_m = apart.most_moved_m.max(moved);
            let stops = (luminance(b.1) / luminance(a.1)).log2().abs();
            // Dark in both is no difference.
            apart.most_stops = apart.most_stops.max(if stops.is_nan() { 0.0 } else { stops });
        });
    }
    animated.iter().map(|(number, _)| *number).zip(found).collect()
}

fn animated<'a>(side: &'a SceneSide, light: &Light) -> Animated<'a> {
    let SceneSide { scene, emitters, .. } = side;
    let source = match light.row {
        Row::Near(row) => emitters.lights()[row as usize].source,
        Row::Infinite(row) => LightSource::Light(side.infinite_row(row)),
    };
    match source {
        LightSource::Light(row) => Animated {
            node: scene.lights[row as usize].node,
            mesh: None,
            deforms: false,
            middle: Vec3::ZERO,
            strength: Strength::Light(row),
        },
        LightSource::Mesh { instance, mesh_light } => {
            let row = &scene.instances[instance as usize];
            Animated {
                node: row.node,
                mesh: Some(&emitters.mesh_lights()[mesh_light as usize]),
                deforms: scene.changes_shape(row.mesh),
                middle: middle_of(side.pose.positions(scene, row.mesh)),
                strength: Strength::Instance(instance),
            }
        }
    }
}

impl Animated<'_> {
    /// Where it is and how strong.
    fn at(&self, side: &SceneSide, pose: &Pose) -> (Affine3A, Vec3) {
        let rgb = match self.strength {
            Strength::Light(row) => side.scene.rgb_of_light(row, pose),
            Strength::Instance(row) => side.scene.rgb_of_instance(row, pose),
        };
        (pose.world(self.node), rgb)
    }

    /// The hash of its emitters in its own space, if it is a mesh.
    fn shape(&self, side: &SceneSide, pose: &Pose) -> Option<u128> {
        self.mesh.map(|mesh| shape_of(side.scene, mesh, pose))
    }

    /// The middle of its mesh in its own space.
    fn middle(&self, side: &SceneSide, pose: &Pose) -> Vec3 {
        match self.mesh.filter(|_| self.deforms) {
            Some(light) => middle_of(pose.positions(side.scene, light.mesh)),
            None => self.middle,
        }
    }
}

fn middle_of(positions: &[Vec3]) -> Vec3 {
    Aabb::around(positions.iter().copied()).center()
}
