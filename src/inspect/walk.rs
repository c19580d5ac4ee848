//! Every cluster and emitter of a file's first frame, as it stands in the world.

use crate::bounds::Aabb;
use crate::light_tree::{Group, InstanceRow, LightTree, Link, Node, TreeKind, TreeRow};
use crate::pipeline::origin_of;
use glam::Affine3A;

/// A node that a walk visits.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// Its number among all stops.
    pub number: usize,
    /// The number of the cluster that it is part of; roots have none.
    pub parent: Option<usize>,
    /// Groups on the way to it; a root has 0.
    pub depth: usize,
    /// What it is.
    pub what: What,
    /// Its box, world space.
    pub aabb: Aabb,
    /// Its energy in world space, candela.
    pub energy: f64,
    /// The node, in the space of its tree.
    pub node: Node,
}

/// What a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// Emitters of several lights, or some of one.
    Cluster,
    /// All emitters of a light that has a tree of its own, by the light's row.
    Light(usize),
    /// One emitter of a light, by the light's row.
    Emitter(usize),
}

/// Walks down from the root of a file's first frame, and from each light that is forced in that frame.
/// Calls `visit` with a cluster before its parts, and visits the parts only if `visit` returns `true`.
/// The tree must have been verified.
pub fn walk<D: AsRef<[u8]>>(tree: &LightTree<D>, visit: impl FnMut(&Stop) -> bool) {
    let mut walk = Walk { tree, visit, open: Vec::new(), stops: 0 };
    let first = tree.frames().first().map_or(0, |row| row.frame);
    let Ok((root, forced)) = tree.roots_at(first) else { return };
    let world = Space {
        to_world: Affine3A::from_translation(origin_of(tree).as_vec3()),
        brightness: 1.0,
        first_emitter: 0,
    };
    if let Some(row) = root.and_then(|row| tree.trees().get(row as usize)) {
        walk.start(row, world, What::Cluster, f64::from(row.root.energy()));
    }
    for &instance in forced {
        let (row, space) = walk.placed(&world, &tree.instances()[instance as usize]);
        let light = walk.light_of(space.first_emitter);
        walk.start(row, space, What::Light(light), f64::from(tree.lights()[light].energy));
    }
}

struct Walk<'a, D, F> {
    tree: &'a LightTree<D>,
    visit: F,
    open: Vec<Place<'a>>,
    stops: usize,
}

/// The space that a tree is in.
#[derive(Clone, Copy)]
struct Space {
    to_world: Affine3A,
    /// The factor from energies in the tree to energies in the world.
    brightness: f64,
    /// The tree's emitters are numbered from here on.
    first_emitter: u32,
}

/// A group to go on from.
struct Place<'a> {
    groups: &'a [Group],
    space: Space,
    parent: usize,
    depth: usize,
}

impl<'a, D: AsRef<[u8]>, F: FnMut(&Stop) -> bool> Walk<'a, D, F> {
    /// Walks a whole tree.
    fn start(&mut self, row: &'a TreeRow, space: Space, what: What, energy: f64) {
        let space = Space { brightness: energy / f64::from(row.root.energy()), ..space };
        let groups = self.tree.groups_of(row);
        self.stop(None, 0, what, &row.root, &space, Some((groups, space)));
        while let Some(Place { groups, space, parent, depth }) = self.open.pop() {
            for node in groups[0].nodes() {
                let (what, below) = self.look(&node, groups, &space);
                self.stop(Some(parent), depth, what, &node, &space, below);
            }
        }
    }

    /// What a node is, and where its parts are.
    fn look(
        &self,
        node: &Node,
        groups: &'a [Group],
        space: &Space,
    ) -> (What, Option<(&'a [Group], Space)>) {
        match node.link() {
            Link::Inner(ahead) => (What::Cluster, Some((&groups[ahead as usize..], *space))),
            Link::Instance(row) => {
                let (row, mut inner) = self.placed(space, &self.tree.instances()[row as usize]);
                inner.brightness *= f64::from(node.energy()) / f64::from(row.root.energy());
                let what = match TreeKind::of(row) {
                    Some(TreeKind::Shared) => What::Light(self.light_of(inner.first_emitter)),
                    _ => What::Cluster,
                };
                (what, Some((self.tree.groups_of(row), inner)))
            }
            Link::Emitter(own) => (What::Emitter(self.light_of(space.first_emitter + own)), None),
            Link::Nothing => (What::Cluster, None),
        }
    }

    fn stop(
        &mut self,
        parent: Option<usize>,
        depth: usize,
        what: What,
        node: &Node,
        space: &Space,
        below: Option<(&'a [Group], Space)>,
    ) {
        let number = self.stops;
        let aabb = node.bounds().aabb.transformed(&space.to_world);
        let energy = f64::from(node.energy()) * space.brightness;
        self.stops += 1;
        let goes_on =
            (self.visit)(&Stop { number, parent, depth, what, aabb, energy, node: *node });
        if let (true, Some((groups, space))) = (goes_on, below) {
            self.open.push(Place { groups, space, parent: number, depth: depth + 1 });
        }
    }

    /// The tree that an instance places, and the space that it is in.
    fn placed(&self, around: &Space, instance: &InstanceRow) -> (&'a TreeRow, Space) {
        let to_local = instance.to_local.transform();
        let space = Space {
            to_world: around.to_world * to_local.inverse(),
            brightness: around.brightness,
            first_emitter: instance.first_emitter,
        };
        (&self.tree.trees()[instance.tree as usize], space)
    }

    /// The row of the light that an emitter belongs to.
    fn light_of(&self, emitter: u32) -> usize {
        self.tree.lights().partition_point(|light| light.first_emitter <= emitter) - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::{Cone, LightBounds};
    use crate::light_tree::{LightList, LightLook, LightRow, LightSummary, LightTreeWriter};
    use crate::math::Similarity;
    use crate::store::AlignedBytes;
    use glam::{Quat, Vec3};

    fn lamp(at: Vec3, energy: f32) -> LightBounds {
        let aabb = Aabb { min: at, max: at };
        LightBounds::of_emitter(aabb, Cone::ALL, energy, f32::INFINITY)
    }

    /// A lamp of its own, and a string of twelve that is put somewhere: turned, larger, brighter.
    fn placed_string(place: &Affine3A) -> LightTree<AlignedBytes> {
        let string: Vec<_> = (0..12).map(|i| lamp(Vec3::X * i as f32, 1.0)).collect();
        let mut writer = LightTreeWriter::default();
        let shared = writer.add_tree(TreeKind::Shared, &string, |i| Link::Emitter(i as u32));
        let shared = shared.unwrap();
        let own = writer.bounds_of(shared);
        let to_local = Similarity::undoing(place).unwrap();
        let instance = writer.add_instance(shared, to_local, 1);
        let around = own.aabb.transformed(place);
        let room = Vec3::splat(1e-3);
        let aabb = Aabb { min: around.min - room, max: around.max + room };
        let still = [lamp(Vec3::ZERO, 5.0), LightBounds { aabb, energy: 36.0, ..own }];
        let links = [Link::Emitter(0), Link::Instance(instance)];
        writer.add_tree(TreeKind::Still, &still, |i| links[i]);
        let lights = [("/lamp", 1, 5.0, 0), ("/string", 12, 36.0, LightRow::PLACED)];
        let lights = lights.map(|(path, emitter_count, energy, class)| {
            let (path, fingerprint, look) = (path.into(), [0; 32], LightLook::default());
            LightSummary { path, fingerprint, emitter_count, energy, class, look, link: 0 }
        });
        let tree = LightTree::open(writer.finish(&LightList::new(&lights), "{}", [0; 32])).unwrap();
        tree.verify().unwrap();
        tree
    }

    #[test]
    fn what_is_placed_stands_where_it_is_placed() {
        let place = Affine3A::from_scale_rotation_translation(
            Vec3::splat(2.0),
            Quat::from_rotation_y(1.0),
            Vec3::new(0.0, 3.0, 100.0),
        );
        let tree = placed_string(&place);
        let mut stops = Vec::new();
        walk(&tree, |stop| {
            stops.push(*stop);
            true
        });
        let emitters = |row| stops.iter().filter(move |stop| stop.what == What::Emitter(row));
        assert_eq!((emitters(0).count(), emitters(1).count()), (1, 12));
        assert!(emitters(1).all(|stop| (stop.energy - 3.0).abs() < 1e-6));
        for i in 0..12 {
            let wanted = place.transform_point3(Vec3::X * i as f32);
            let is_there = |stop: &Stop| (stop.aabb.center() - wanted).length() < 1e-3;
            assert_eq!(emitters(1).filter(|stop| is_there(stop)).count(), 1);
        }
    }

    #[test]
    fn parts_come_after_the_whole_and_make_it_up() {
        let tree = placed_string(&Affine3A::from_translation(Vec3::new(7.0, 0.0, -5.0)));
        let mut stops: Vec<Stop> = Vec::new();
        walk(&tree, |stop| {
            assert_eq!(stop.number, stops.len());
            if let Some(parent) = stop.parent {
                let parent = &stops[parent];
                let room = Vec3::splat(1e-3);
                let aabb = Aabb { min: parent.aabb.min - room, max: parent.aabb.max + room };
                assert!(aabb.contains_box(&stop.aabb) && stop.depth == parent.depth + 1);
            }
            stops.push(*stop);
            true
        });
        for whole in &stops {
            let parts = stops.iter().filter(|part| part.parent == Some(whole.number));
            let sum: f64 = parts.map(|part| part.energy).sum();
            let is_leaf = matches!(whole.what, What::Emitter(_));
            assert!(is_leaf || (sum / whole.energy - 1.0).abs() < 1e-6, "{whole:?}");
        }
        // Told not to, it goes no further.
        let mut count = 0;
        walk(&tree, |_| {
            count += 1;
            false
        });
        assert_eq!(count, 1);
    }
}
