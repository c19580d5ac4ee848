//! The transform hierarchy, and what is animated evaluated at a time.
//!
//! A key counts as at a frame's time if it is [meant to be](Timeline::is_same).

use super::deformation::{Shape, Shapes};
use super::{Scene, Timeline};
use crate::math::built_in;
use crate::math::color::Rgb;
use glam::{Affine3A, DAffine3, DQuat, DVec2, DVec3, Quat, Vec2, Vec3};
use std::iter::Sum;
use std::ops::Mul;
use std::sync::Arc;

/// A place in the transform hierarchy.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// The prim path, `/World/Lamps/lamp_12`; unique in the scene.
    pub path: Arc<str>,
    /// Index of the parent, smaller than this node's own.
    pub parent: Option<u32>,
    /// Local to parent, where no channel says otherwise.
    pub local: Trs,
    /// Animated parts of the local transform; later channels override earlier ones.
    pub channels: Vec<Channel>,
}

/// A local transform: a matrix as the file gives it, or translation, rotation and scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trs {
    /// Any affine matrix. Cannot be animated.
    Matrix(DAffine3),
    /// Scale, then rotation, then translation.
    Parts {
        /// Metres.
        translation: DVec3,
        /// Unit quaternion.
        rotation: DQuat,
        /// Along the local axes.
        scale: DVec3,
    },
}

/// One animated part of a node's transform.
#[derive(Clone, Debug, PartialEq)]
pub enum Channel {
    /// Metres.
    Translation(Keys<Vec3>),
    /// Unit quaternions.
    Rotation(Keys<Quat>),
    /// Along the local axes.
    Scale(Keys<Vec3>),
}

/// Key times and values of a channel, or of a light.
#[derive(Clone, Debug, PartialEq)]
pub struct Keys<T> {
    /// Seconds on the file's clock, ascending, not empty.
    pub times_s: Vec<f32>,
    /// One value a key; with [`Interpolation::Cubic`] three: in-tangent, value, out-tangent.
    pub values: Vec<T>,
    /// What holds between keys.
    pub interpolation: Interpolation,
}

/// What holds between two keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Linear; spherical for rotations.
    #[default]
    Linear,
    /// The earlier key's value.
    Step,
    /// glTF's cubic Hermite spline.
    Cubic,
}

/// Whatever varies, at one time: world transforms of all nodes, strengths of the lights with keys, shapes of the meshes
/// that deform.
#[derive(Clone, Debug)]
pub struct Pose {
    pub(super) world: Vec<Affine3A>,
    /// By row of [`Scene::lights`]; empty if none has keys.
    pub(super) light_rgb: Vec<Option<Rgb>>,
    /// By row of [`Scene::instances`]; empty if none has keys.
    pub(super) instance_rgb: Vec<Option<Rgb>>,
    /// Of the meshes that deform.
    pub(super) shapes: Shapes,
}

impl Default for Trs {
    fn default() -> Self {
        Trs::Parts { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE }
    }
}

impl Pose {
    /// Composes the hierarchy in double precision, so that only the result is rounded.
    pub(super) fn evaluate(scene: &Scene, time_s: f64) -> Pose {
        let at = Instant { time_s, timeline: scene.timeline };
        // Of millions of nodes few are parents: only theirs are kept, and where each is.
        let mut exact: Vec<DAffine3> = Vec::new();
        let mut kept = vec![u32::MAX; scene.nodes.len()];
        for parent in scene.nodes.iter().filter_map(|node| node.parent) {
            kept[parent as usize] = 0;
        }
        let world = scene.nodes.iter().enumerate().map(|(row, node)| {
            let above = node.parent.map(|parent| &exact[kept[parent as usize] as usize]);
            let transform = node.in_world(scene.origin, above, at);
            if kept[row] == 0 {
                kept[row] = exact.len() as u32;
                exact.push(transform);
            }
            transform.as_affine3a()
        });
        let world = world.collect();
        Pose::with(scene, world, at)
    }

    /// Given the transforms of all nodes.
    pub(super) fn with(scene: &Scene, world: Vec<Affine3A>, at: Instant) -> Pose {
        let lights = scene.lights.iter().map(|light| light.values.as_deref());
        let instances = scene.instances.iter().map(|instance| instance.values.as_deref());
        Pose {
            world,
            light_rgb: values_at(lights, at),
            instance_rgb: values_at(instances, at),
            shapes: Shapes::at(scene, at.time_s),
        }
    }

    /// The world-space radius of a sphere of some local radius at a node, metres. It grows with the
    /// cube root of the volume. Sampling and intersection both use it: they must agree to the last bit.
    pub fn world_radius(&self, node: u32, radius: f32) -> f32 {
        let volume = self.world(node).matrix3.as_dmat3().determinant().abs();
        (f64::from(radius) * volume.cbrt()) as f32
    }

    /// The strength of a light that varies, in its own unit: candela, nits or lux.
    #[inline]
    pub fn light_rgb(&self, light: u32) -> Option<Rgb> {
        self.light_rgb.get(light as usize).copied().flatten().filter(|_| built_in::MOTION)
    }

    /// The emission of a mesh light that varies, nits, before its texture.
    #[inline]
    pub fn instance_rgb(&self, instance: u32) -> Option<Rgb> {
        self.instance_rgb.get(instance as usize).copied().flatten().filter(|_| built_in::MOTION)
    }

    /// The shape of a mesh, if it deforms. The scene must be the one that was posed.
    #[inline]
    pub fn shape(&self, scene: &Scene, mesh: u32) -> Option<&Shape> {
        self.shapes.of(scene, mesh).filter(|_| built_in::MOTION)
    }

    /// The positions of a mesh, which may deform, in its own space, metres.
    #[inline]
    pub fn positions<'a>(&'a self, scene: &'a Scene, mesh: u32) -> &'a [Vec3] {
        let own = &scene.meshes[mesh as usize];
        // Asked at each point of each triangle that shines: most meshes keep their shape.
        match own.deformation.is_some().then(|| self.shape(scene, mesh)).flatten() {
            Some(shape) => &shape.positions,
            None => &own.positions,
        }
    }

    /// Local to world for a node, from [`Scene::origin`] on.
    #[inline]
    pub fn world(&self, node: u32) -> Affine3A {
        self.world[node as usize]
    }
}

/// The values of a table at a time; no table if it has no keys.
fn values_at<'a>(
    rows: impl Iterator<Item = Option<&'a Keys<Rgb>>> + Clone,
    at: Instant,
) -> Vec<Option<Rgb>> {
    if rows.clone().all(|keys| keys.is_none()) {
        return Vec::new();
    }
    rows.map(|keys| Some(keys?.blend_at(at).as_vec3())).collect()
}

/// Which nodes move: those with channels, and all below them.
pub(super) fn moving(nodes: &[Node]) -> Vec<bool> {
    let mut moves: Vec<bool> = Vec::with_capacity(nodes.len());
    for node in nodes {
        let carried = node.parent.is_some_and(|parent| moves[parent as usize]);
        moves.push(built_in::MOTION && (carried || !node.channels.is_empty()));
    }
    moves
}

/// Which nodes never change what is below them but by a similarity, at any time.
pub(super) fn rigid(nodes: &[Node]) -> Vec<bool> {
    let mut rigid: Vec<bool> = Vec::with_capacity(nodes.len());
    for node in nodes {
        let above = node.parent.is_none_or(|parent| rigid[parent as usize]);
        let keeps_size = node.channels.iter().all(|channel| match channel {
            Channel::Scale(keys) => keys.never_vanishes(),
            _ => true,
        });
        rigid.push(above && keeps_size && node.scales_evenly(RIGID_TOLERANCE));
    }
    rigid
}

/// How far a scale may be from uniform for a shape to be kept, to the last bits.
const RIGID_TOLERANCE: f64 = 1e-6;
/// A scale that falls below this part of its largest is flat for a while.
const LEAST_OF_LARGEST: f32 = 1e-4;

impl Node {
    /// Whether the node's own transform keeps shapes at every time, up to a relative tolerance.
    pub fn scales_evenly(&self, tolerance: f64) -> bool {
        let even = |scale: DVec3| {
            let size = scale.abs();
            size.max_element() - size.min_element() <= tolerance * size.max_element()
        };
        let at_rest = match self.local {
            Trs::Parts { scale, .. } => even(scale),
            Trs::Matrix(matrix) => {
                let m = matrix.matrix3;
                let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
                let lengths = DVec3::new(x.length(), y.length(), z.length());
                let skew = x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs());
                even(lengths) && skew <= tolerance * lengths.max_element().powi(2)
            }
        };
        let animated = |channel: &Channel| match channel {
            Channel::Scale(keys) => keys.values.iter().all(|scale| even(scale.as_dvec3())),
            _ => true,
        };
        at_rest && self.channels.iter().all(animated)
    }

    /// A node that stands still.
    pub fn fixed(path: impl Into<Arc<str>>, parent: Option<u32>, local: Trs) -> Node {
        Node { path: path.into(), parent, local, channels: Vec::new() }
    }

    /// Local to parent at a time, seconds on the clock of a timeline.
    pub fn to_parent(&self, time_s: f64, timeline: Timeline) -> DAffine3 {
        self.local_at(Instant { time_s, timeline })
    }

    /// Local to world at a time, seen from an origin, given that of its parent.
    pub(super) fn in_world(
        &self,
        origin: DVec3,
        parent: Option<&DAffine3>,
        at: Instant,
    ) -> DAffine3 {
        let local = self.local_at(at);
        match parent {
            Some(parent) => *parent * local,
            None => DAffine3 { translation: local.translation - origin, ..local },
        }
    }

    /// Local to parent at a time.
    fn local_at(&self, at: Instant) -> DAffine3 {
        let (mut translation, mut rotation, mut scale) = match self.local {
            Trs::Matrix(matrix) => return matrix,
            Trs::Parts { translation, rotation, scale } => (translation, rotation, scale),
        };
        for channel in &self.channels {
            match channel {
                Channel::Translation(keys) => translation = keys.blend_at(at),
                Channel::Scale(keys) => scale = keys.blend_at(at),
                Channel::Rotation(keys) => rotation = keys.rotation_at(at),
            }
        }
        DAffine3::from_scale_rotation_translation(scale, rotation, translation)
    }
}

/// A time at which everything is evaluated.
#[derive(Clone, Copy)]
pub(super) struct Instant {
    pub(super) time_s: f64,
    pub(super) timeline: Timeline,
}

/// Where a time falls among keys: the two neighbours, the fraction between them, their distance.
struct Between {
    before: usize,
    after: usize,
    fraction: f64,
    step_s: f64,
}

impl<T: Copy> Keys<T> {
    fn find(&self, at: Instant) -> Between {
        let after = self.times_s.partition_point(|&key| f64::from(key) <= at.time_s);
        let last = self.times_s.len() - 1;
        let held = |i| Between { before: i, after: i, fraction: 0.0, step_s: 0.0 };
        if after == 0 || after > last {
            return held(after.min(last));
        }
        let before = after - 1;
        let [t0, t1] = [before, after].map(|i| f64::from(self.times_s[i]));
        let (since, step_s) = (at.time_s - t0, t1 - t0);
        // The nearer key decides whether the time is that of a key.
        let (nearer, key_s) = if 2.0 * since < step_s { (before, t0) } else { (after, t1) };
        if at.timeline.is_same(at.time_s, key_s) {
            return held(nearer);
        }
        Between { before, after, fraction: since / step_s, step_s }
    }

    /// Hermite weights of (value, out-tangent, value, in-tangent), glTF 2.0 appendix C.
    fn hermite(at: &Between) -> [f64; 4] {
        let (t, step) = (at.fraction, at.step_s);
        let (t2, t3) = (t * t, t * t * t);
        [
            2.0 * t3 - 3.0 * t2 + 1.0,
            step * (t3 - 2.0 * t2 + t),
            -2.0 * t3 + 3.0 * t2,
            step * (t3 - t2),
        ]
    }

    /// The four values that the Hermite weights multiply.
    fn hermite_values(&self, at: &Between) -> [T; 4] {
        let (a, b) = (3 * at.before, 3 * at.after);
        [self.values[a + 1], self.values[a + 2], self.values[b + 1], self.values[b]]
    }
}

impl Keys<Vec3> {
    /// The largest of each component over all keys: what values that are no spline never exceed.
    pub(super) fn peak(&self) -> Vec3 {
        self.values.iter().fold(Vec3::ZERO, |peak, &value| peak.max(value))
    }

    /// Whether a scale, the same along all axes, stays well away from zero between keys too.
    fn never_vanishes(&self) -> bool {
        let largest = self.values.iter().fold(0f32, |largest, value| largest.max(value.x.abs()));
        let least = LEAST_OF_LARGEST * largest;
        let (above, below) = (Vec3::splat(least), Vec3::splat(-least));
        // A spline may pass through zero between keys that do not.
        self.interpolation != Interpolation::Cubic
            && (self.values.iter().all(|value| value.cmpgt(above).all())
                || self.values.iter().all(|value| value.cmplt(below).all()))
    }
}

/// What is blended component by component between keys.
pub trait Blend: Copy {
    /// The same in double precision.
    type Exact: Mul<f64, Output = Self::Exact> + Sum;

    /// The value in double precision.
    fn exact(self) -> Self::Exact;
    /// What is a share of the way from one value to another.
    fn lerp(from: Self::Exact, to: Self::Exact, share: f64) -> Self::Exact;
}

impl Blend for f32 {
    type Exact = f64;

    fn exact(self) -> f64 {
        self.into()
    }

    fn lerp(from: f64, to: f64, share: f64) -> f64 {
        from * (1.0 - share) + to * share
    }
}

impl Blend for Vec2 {
    type Exact = DVec2;

    fn exact(self) -> DVec2 {
        self.as_dvec2()
    }

    fn lerp(from: DVec2, to: DVec2, share: f64) -> DVec2 {
        from.lerp(to, share)
    }
}

impl Blend for Vec3 {
    type Exact = DVec3;

    fn exact(self) -> DVec3 {
        self.as_dvec3()
    }

    fn lerp(from: DVec3, to: DVec3, share: f64) -> DVec3 {
        from.lerp(to, share)
    }
}

impl<T: Blend> Keys<T> {
    /// The value at a time, seconds on the clock of a timeline.
    pub fn at(&self, time_s: f64, timeline: Timeline) -> T::Exact {
        self.blend_at(Instant { time_s, timeline })
    }

    pub(super) fn blend_at(&self, at: Instant) -> T::Exact {
        let at = self.find(at);
        match self.interpolation {
            Interpolation::Linear => {
                T::lerp(self.values[at.before].exact(), self.values[at.after].exact(), at.fraction)
            }
            Interpolation::Step => self.values[at.before].exact(),
            Interpolation::Cubic => {
                let weights = Self::hermite(&at);
                let values = self.hermite_values(&at);
                (0..4).map(|i| values[i].exact() * weights[i]).sum()
            }
        }
    }
}

impl Keys<Quat> {
    fn rotation_at(&self, at: Instant) -> DQuat {
        let at = self.find(at);
        match self.interpolation {
            Interpolation::Linear => {
                let (a, b) = (self.values[at.before].as_dquat(), self.values[at.after].as_dquat());
                a.normalize().slerp(b.normalize(), at.fraction)
            }
            Interpolation::Step => self.values[at.before].as_dquat().normalize(),
            Interpolation::Cubic => {
                let weights = Self::hermite(&at);
                let values = self.hermite_values(&at);
                let sum = (0..4).fold(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), |sum, i| {
                    sum + values[i].as_dquat() * weights[i]
                });
                sum.normalize()
            }
        }
    }
}
