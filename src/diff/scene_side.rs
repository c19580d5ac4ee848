//! What a scene tells of its lights: everything.

use super::card::{Kind, LightCard};
use super::infinite::{self, Infinite};
use super::light::{Described, Light, Profile, Row, kind_of, without_crumbs};
use super::profile::Profiles;
use super::side::SideError;
use super::tree_side::place;
use crate::bounds::{Aabb, LightBounds};
use crate::emitter::{Emitters, InfiniteLight, LightSource, PosedEmitters, infinite_lights};
use crate::light_tree::LightTree;
use crate::pipeline::{self, Survey};
use crate::scene::{Camera, LightKind, Pose, Scene};
use crate::store::AlignedBytes;
use glam::Vec3;
use std::collections::HashMap;
use std::path::Path;

/// A scene, surveyed as for a build.
pub(super) struct SceneSide<'a> {
    pub scene: &'a Scene,
    pub camera: Option<&'a Camera>,
    pub emitters: Emitters,
    /// The survey of all frames, but with the bounds of the first only.
    pub survey: Survey,
    pub frames: Vec<i32>,
    /// The pose in the first frame.
    pub pose: Pose,
    profiles: Profiles,
    infinite: Vec<Infinite>,
}

impl<'a> SceneSide<'a> {
    /// Surveys a scene for some frames, or for its own if none are given. `beside` is a tree to compare
    /// it with. If that tree says that it was built from this scene, its leaves must agree with it.
    pub fn survey(
        scene: &'a Scene,
        camera: Option<&'a Camera>,
        frames: Option<&[i32]>,
        beside: Option<(&Path, LightTree<&[u8]>)>,
    ) -> Result<Self, SideError> {
        let own = || pipeline::frames_of(scene);
        let frames = frames.map_or_else(own, <[i32]>::to_vec);
        let tree = beside.as_ref().map(|(_, tree)| tree);
        let emitters = pipeline::collect_emitters(scene, tree, &|_, _| {});
        let mut survey = pipeline::survey(scene, &emitters, &frames)
            .map_err(|cause| SideError::Survey { path: scene.source.clone(), cause })?;
        if let Some((path, tree)) = &beside {
            pipeline::check_agreement(tree, path, scene, &survey, &[], true)?;
        }
        survey.frames.truncate(1);
        let pose = pose_at(scene, frames[0]);
        let profiles = Profiles::of(scene, &emitters, &pose);
        let infinite = infinite::find(scene, &pose, &frames);
        Ok(SceneSide { scene, camera, emitters, survey, frames, pose, profiles, infinite })
    }

    /// The first frame.
    pub fn frame(&self) -> i32 {
        self.frames[0]
    }

    /// Where everything is in a frame.
    pub fn pose_at(&self, frame: i32) -> Pose {
        pose_at(self.scene, frame)
    }

    /// The row in the scene of a light at infinity.
    pub fn infinite_row(&self, row: u32) -> u32 {
        self.infinite[row as usize].light
    }

    /// The tree of the first frame.
    pub fn build(&self) -> LightTree<AlignedBytes> {
        let bytes = pipeline::build_tree(&self.survey);
        LightTree::open(bytes).expect("what was just built can be opened")
    }

    /// The infinite lights that shine in the first frame and are not forced, each with its number.
    /// `numbers` are those of the infinite lights, in the order of [`lights`](Self::lights).
    pub fn infinite_to_pick(&self, numbers: &[u32]) -> Vec<(u32, InfiniteLight<'_>)> {
        let picked = infinite_lights(self.scene, &self.pose).into_iter().filter(|l| !l.forced);
        let number = |light: &InfiniteLight| {
            let row = self.infinite.iter().position(|own| own.light as usize == light.light);
            numbers[row.expect("what shines now shines in some frame")]
        };
        picked.map(|light| (number(&light), light)).collect()
    }

    pub fn lights(&self) -> Vec<Light<'_>> {
        let near = (0..).zip(self.emitters.lights()).zip(&self.survey.lights);
        let near = near.map(|((row, entry), summary)| Light {
            path: &entry.path,
            row: Row::Near(row),
            fingerprint: summary.fingerprint,
            class: summary.class,
            kind: kind_of(&summary.look),
            color: summary.look.color,
            energy: without_crumbs(summary.energy),
            emitters: summary.emitter_count,
            link: summary.link,
            profile: self.profiles.of_light(self.scene, &self.pose, entry.source),
        });
        let infinite =
            (0..).zip(&self.infinite).map(|(row, light)| light.as_light(self.scene, row));
        near.chain(infinite).collect()
    }

    fn posed(&self) -> PosedEmitters<'_> {
        PosedEmitters { scene: self.scene, emitters: &self.emitters, pose: &self.pose }
    }

    /// A light, described.
    pub fn describe(&self, light: &Light) -> Described {
        let mut described = light.described();
        let row = match light.row {
            Row::Near(row) => row,
            Row::Infinite(row) => {
                let node = self.scene.lights[self.infinite_row(row) as usize].node;
                let to_world = self.pose.world(node);
                described.to_world = Some(to_world);
                if let Some(half_angle) = light.profile.half_angle_rad {
                    let toward = -Vec3::from(to_world.matrix3.z_axis);
                    described.card.axis = toward.try_normalize().map(|axis| axis.to_array());
                    described.card.half_angle_deg = half_angle.to_degrees();
                }
                return described;
            }
        };
        let entry = &self.emitters.lights()[row as usize];
        let bounds = self.posed().bounds(entry.first..entry.first + entry.count);
        // A light with a tree of its own is in range in its own space, but may not be in world space.
        let around = bounds.map(|bounds| match bounds.as_slice() {
            [one] => *one,
            all => LightBounds::around(all),
        });
        if let Ok(bounds) = around {
            described.two_sided = bounds.cone.two_sided;
            place(&mut described.card, &bounds);
        }
        if let Some(half_angle) = light.profile.half_angle_rad {
            described.card.half_angle_deg = half_angle.to_degrees();
        }
        let node = match entry.source {
            LightSource::Mesh { instance, mesh_light } => {
                described.shape = Some(self.profiles.shape(mesh_light));
                self.scene.instances[instance as usize].node
            }
            LightSource::Light(row) => self.scene.lights[row as usize].node,
        };
        described.to_world = Some(self.pose.world(node));
        described
    }

    /// The instances and lights of the scene that emit nothing, by path.
    pub fn dark_prims(&self) -> HashMap<&str, Dark> {
        let is_lit: std::collections::HashSet<&str> =
            self.lights().iter().map(|light| light.path).collect();
        let meshes = (0..)
            .zip(&self.scene.instances)
            .map(|(row, instance)| (&*instance.path, Dark::Mesh(row)));
        let lights = (0..self.scene.lights.len())
            .map(|row| (self.scene.light_path(row), Dark::Light(row as u32)));
        meshes.chain(lights).filter(|(path, _)| !is_lit.contains(path)).collect()
    }

    /// One of them, described.
    pub fn describe_dark(&self, path: &str, dark: Dark) -> Described {
        let (node, kind, forced, aabb) = match dark {
            Dark::Mesh(row) => {
                let instance = &self.scene.instances[row as usize];
                let world = self.pose.world(instance.node);
                let positions = self.pose.positions(self.scene, instance.mesh);
                let corners = positions.iter().map(|&p| world.transform_point3(p));
                (instance.node, Kind::Mesh, instance.forced, Aabb::around(corners))
            }
            Dark::Light(row) => {
                let light = &self.scene.lights[row as usize];
                let here = self.pose.world(light.node).translation.into();
                (light.node, kind(&light.kind), light.forced, Aabb::around([here]))
            }
        };
        let mut card = LightCard {
            path: path.to_owned(),
            kind: Some(kind),
            emitters: 0,
            energy: 0.0,
            color: None,
            place: None,
            axis: None,
            half_angle_deg: 180.0,
            range_m: None,
            forced,
            changes: false,
        };
        if !kind.is_infinite() && !aabb.is_empty() {
            card.place = Some(super::Place {
                center_m: aabb.center().to_array(),
                size_m: aabb.extent().to_array(),
            });
        }
        Described {
            card,
            to_world: Some(self.pose.world(node)),
            shape: None,
            two_sided: false,
            profile: Profile::default(),
            placed: false,
        }
    }
}

fn pose_at(scene: &Scene, frame: i32) -> Pose {
    scene.pose_at(scene.timeline.seconds_at(f64::from(frame)))
}

/// A prim that might shine and does not.
#[derive(Clone, Copy, Debug)]
pub(super) enum Dark {
    /// A row of the scene's instances.
    Mesh(u32),
    /// A row of the scene's lights.
    Light(u32),
}

/// The word for a kind of the scene.
pub(super) fn kind(kind: &LightKind) -> Kind {
    match kind {
        LightKind::Point { .. } => Kind::Point,
        LightKind::Spot { .. } => Kind::Spot,
        LightKind::Sphere { .. } => Kind::Sphere,
        LightKind::Distant { .. } => Kind::Sun,
        LightKind::Dome { .. } => Kind::Dome,
    }
}
