//! Trees as a shot has them: shared ones put in many places, one over what stands still, one of a
//! frame above it, and forced lights of their own.

use crate::linking::numbered;
use crate::support::{Tree, direction, emitter, emitters, position};
use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::{
    LightList, LightLook, LightRow, LightSummary, LightTree, LightTreeWriter, Link, TreeKind,
};
use candelabra::math::Similarity;
use glam::{Affine3A, Mat3, Quat, Vec3};
use proptest::prelude::*;

/// What is put where.
#[derive(Clone, Debug)]
pub struct City {
    pub shared: Vec<Vec<LightBounds>>,
    pub still: Part,
    pub changing: Part,
    pub forced: Vec<Placed>,
}

/// Lights of their own, and shared ones in places.
#[derive(Clone, Debug, Default)]
pub struct Part {
    pub flat: Vec<LightBounds>,
    pub placed: Vec<Placed>,
}

#[derive(Clone, Debug)]
pub struct Placed {
    pub tree: usize,
    pub to_world: Affine3A,
    /// What energies of the shared tree are multiplied by, in world space.
    pub brightness: f32,
}

/// Turns, mirrors, moves and scales.
fn placing() -> impl Strategy<Value = Affine3A> {
    let scale = (-3f32..3.0).prop_map(|exponent| 10f32.powf(exponent));
    let scale = prop_oneof![2 => scale, 1 => Just(1.0)];
    (scale, any::<bool>(), direction(), 0f32..7.0, position()).prop_map(
        |(scale, mirrored, axis, angle, to)| {
            let sign = if mirrored { -1.0 } else { 1.0 };
            let scale = scale * Vec3::new(sign, 1.0, 1.0);
            let turn = Quat::from_axis_angle(axis.normalize(), angle);
            Affine3A::from_scale_rotation_translation(scale, turn, to * 3.0)
        },
    )
}

fn placed(most: usize) -> impl Strategy<Value = Vec<Placed>> {
    let brightness = prop_oneof![3 => Just(1f32), 1 => 0.01f32..100.0];
    let one = (any::<prop::sample::Index>(), placing(), brightness).prop_map(
        |(tree, to_world, brightness)| Placed { tree: tree.index(64), to_world, brightness },
    );
    prop::collection::vec(one, 0..most)
}

fn part() -> impl Strategy<Value = Part> {
    (prop::collection::vec(emitter(), 0..12), placed(10))
        .prop_map(|(flat, placed)| Part { flat, placed })
}

pub fn city() -> impl Strategy<Value = City> {
    let shared = prop::collection::vec(emitters(20), 1..4);
    let changing = prop_oneof![1 => Just(Part::default()), 2 => part()];
    (shared, part(), changing, placed(3)).prop_map(|(shared, still, changing, forced)| {
        let mut city = City { shared, still, changing, forced };
        let count = city.shared.len();
        city.every_placed_mut().for_each(|placed| placed.tree %= count);
        city
    })
}

impl City {
    fn every_placed_mut(&mut self) -> impl Iterator<Item = &mut Placed> {
        let City { still, changing, forced, .. } = self;
        still.placed.iter_mut().chain(&mut changing.placed).chain(forced)
    }

    /// The file, written in the order that the [format](candelabra::store) asks for. Frame 1 exists
    /// if anything changes; else any frame does.
    pub fn tree(&self) -> Tree {
        self.tree_linked(|_| 0)
    }

    /// The same, with the link number of each row of lights.
    pub fn tree_linked(&self, link: impl Fn(usize) -> u32) -> Tree {
        let mut writer = LightTreeWriter::default();
        for bounds in &self.shared {
            writer.add_tree(TreeKind::Shared, bounds, |i| Link::Emitter(i as u32));
        }
        let mut lights = Vec::new();
        let (links, bounds) = self.leaves(&self.still, 0, &mut writer, &mut lights);
        let still = writer.add_tree(TreeKind::Still, &bounds, |i| links[i]);
        let (mut links, mut bounds) = (Vec::new(), Vec::new());
        let changes = !self.changing.flat.is_empty() || !self.changing.placed.is_empty();
        if changes {
            if let Some(still) = still {
                let below = writer.add_instance(still, Similarity::IDENTITY, 0);
                links.push(Link::Instance(below));
                bounds.push(writer.bounds_of(still));
            }
            let class = LightRow::CHANGES;
            let above = self.leaves(&self.changing, class, &mut writer, &mut lights);
            links.extend(above.0);
            bounds.extend(above.1);
        }
        let forced = self.instances(&self.forced, 5, &mut writer, &mut lights);
        if changes {
            let tree = writer.add_tree(TreeKind::Frame, &bounds, |i| links[i]);
            writer.add_frame(1, [1; 32], tree, &forced);
        } else {
            writer.add_forced(&forced);
        }
        let of_lights = numbered((0..lights.len()).map(link));
        lights.iter_mut().zip(of_lights).for_each(|(light, number)| light.link = number);
        LightTree::open(writer.finish(&LightList::new(&lights), "{}", [3; 32])).expect("it opens")
    }

    fn leaves(
        &self,
        part: &Part,
        class: u32,
        writer: &mut LightTreeWriter,
        lights: &mut Vec<LightSummary>,
    ) -> (Vec<Link>, Vec<LightBounds>) {
        let count = part.flat.len() as u32;
        let first = next_emitter(lights);
        let mut links: Vec<Link> = (first..first + count).map(Link::Emitter).collect();
        if count > 0 {
            lights.push(summary("/flat".into(), count, class));
        }
        let class = class | LightRow::PLACED;
        let rows = self.instances(&part.placed, class, writer, lights);
        links.extend(rows.into_iter().map(Link::Instance));
        let mut bounds = part.flat.clone();
        bounds.extend(part.placed.iter().map(|placed| {
            let root = writer.bounds_of(placed.tree as u32);
            in_world(&root, placed)
        }));
        (links, bounds)
    }

    /// Adds instances, and a light for each.
    fn instances(
        &self,
        placed: &[Placed],
        class: u32,
        writer: &mut LightTreeWriter,
        lights: &mut Vec<LightSummary>,
    ) -> Vec<u32> {
        let mut rows = Vec::new();
        for (i, placed) in placed.iter().enumerate() {
            let to_local = Similarity::undoing(&placed.to_world).expect("it keeps shapes");
            let count = self.shared[placed.tree].len() as u32;
            rows.push(writer.add_instance(placed.tree as u32, to_local, next_emitter(lights)));
            lights.push(summary(format!("/placed_{i:03}"), count, class));
        }
        rows
    }

    /// The bounds in world space of every emitter that is not forced, in their order.
    pub fn flattened(&self) -> Vec<LightBounds> {
        let mut all = Vec::new();
        for part in [&self.still, &self.changing] {
            all.extend_from_slice(&part.flat);
            for placed in &part.placed {
                all.extend(self.shared[placed.tree].iter().map(|own| in_world(own, placed)));
            }
        }
        all
    }
}

fn next_emitter(lights: &[LightSummary]) -> u32 {
    lights.iter().map(|light| light.emitter_count).sum()
}

fn summary(path: String, emitter_count: u32, class: u32) -> LightSummary {
    LightSummary {
        path,
        fingerprint: [0; 32],
        emitter_count,
        energy: 1.0,
        class,
        look: LightLook::default(),
        link: 0,
    }
}

/// Bounds of a space of its own as they are in world space, as `pipeline::build` has them.
pub fn in_world(own: &LightBounds, placed: &Placed) -> LightBounds {
    let to_local = Similarity::undoing(&placed.to_world).expect("it keeps shapes");
    let inverse = Affine3A::from_mat3_translation(
        Mat3::from_cols_array_2d(&to_local.axes),
        Vec3::from_array(to_local.origin),
    );
    let to_world = inverse.inverse();
    let aabb = own.aabb.transformed(&to_world);
    let size = aabb.min.abs().max(aabb.max.abs()).max_element() + aabb.extent().max_element();
    let slack = Vec3::splat(4.0 * f32::EPSILON * size);
    LightBounds {
        aabb: Aabb { min: aabb.min - slack, max: aabb.max + slack },
        cone: Cone {
            axis: to_world.transform_vector3(own.cone.axis).normalize(),
            theta_o: (own.cone.theta_o + 1e-6).min(std::f32::consts::PI),
            ..own.cone
        },
        energy: (own.energy * placed.brightness).max(f32::MIN_POSITIVE),
        share: own.share,
        range_m: own.range_m / to_local.scale(),
    }
}
