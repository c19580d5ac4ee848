//! What a tree file tells of its lights.
//!
//! The leaves of a light tell where it is: their decoded boxes and cones, which are a little wider than
//! what they bound. A light with a tree of its own also has a transform.

use super::card::{LightCard, Place};
use super::light::{Described, Light, Profile, Row, kind_of, without_crumbs};
use crate::bounds::{Cone, LightBounds};
use crate::light_tree::{InstanceRow, LightRow, LightTree, Link, Node, TreeKind, TreeRow};
use crate::pipeline::OpenedTree;
use glam::{Affine3A, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::f32::consts::PI;

/// The sections that list lights.
const ROWS: [&[u8; 4]; 3] = [b"LGHT", b"PATH", b"LINK"];
/// The sections that must be equal if the fingerprints are: the content determines them.
const TREES: [&[u8; 4]; 5] = [b"TREE", b"GRUP", b"INST", b"FRAM", b"FORC"];

/// A tree, opened.
pub(super) struct TreeSide<'a> {
    tree: LightTree<&'a [u8]>,
}

impl<'a> TreeSide<'a> {
    pub fn new(tree: &'a OpenedTree) -> TreeSide<'a> {
        TreeSide { tree: tree.by_reference() }
    }

    pub fn tree(&self) -> LightTree<&[u8]> {
        self.tree.by_reference()
    }

    /// The frames that have trees of their own.
    pub fn frames(&self) -> Vec<i32> {
        self.tree.frames().iter().map(|row| row.frame).collect()
    }

    pub fn fingerprint(&self) -> [u8; 32] {
        self.tree.fingerprint()
    }

    /// Whether fingerprint and checksums of the lights' rows are the same.
    pub fn has_rows_of(&self, other: &TreeSide) -> bool {
        self.fingerprint() == other.fingerprint() && self.has_sections_of(other, &ROWS)
    }

    /// Whether both have the same fingerprint but different trees. That is a contradiction, because the
    /// same content gives the same bytes.
    pub fn contradicts(&self, other: &TreeSide) -> bool {
        self.fingerprint() == other.fingerprint() && !self.has_sections_of(other, &TREES)
    }

    /// Whether lengths and checksums of some sections are the same.
    fn has_sections_of(&self, other: &TreeSide, names: &[&[u8; 4]]) -> bool {
        let sections = |side: &TreeSide| {
            let sections = side.tree.sections().iter();
            let wanted =
                sections.filter(|section| section.length > 0 && names.contains(&&section.id.0));
            wanted.map(|section| (section.id, section.length, section.checksum)).collect::<Vec<_>>()
        };
        sections(self) == sections(other)
    }

    pub fn lights(&self) -> Vec<Light<'_>> {
        let light = |(row, light)| of_row(&self.tree, row, light);
        (0..).zip(self.tree.lights()).map(light).collect()
    }
}

fn of_row<'a, D: AsRef<[u8]>>(tree: &'a LightTree<D>, row: u32, light: &'a LightRow) -> Light<'a> {
    Light {
        path: tree.light_path(light),
        row: Row::Near(row),
        fingerprint: light.fingerprint,
        class: light.class,
        kind: kind_of(&light.look),
        color: light.look.color,
        energy: without_crumbs(light.energy),
        emitters: light.emitter_count,
        link: tree.link_of(row as usize),
        profile: Profile::default(),
    }
}

/// Where the lights of a tree are in its first frame.
pub(super) struct Places<'a, D> {
    tree: &'a LightTree<D>,
    /// The leaves by ascending emitter, without those of lights with trees of their own.
    leaves: Vec<(u32, Node)>,
    /// The lights with trees of their own, by their first emitters.
    placed: HashMap<u32, &'a InstanceRow>,
}

impl<'a, D: AsRef<[u8]>> Places<'a, D> {
    pub fn find(tree: &'a LightTree<D>) -> Places<'a, D> {
        let mut places = Places { tree, leaves: Vec::new(), placed: HashMap::new() };
        let first_frame = tree.frames().first().map(|frame| frame.tree);
        for (row, own) in (0..).zip(tree.trees()) {
            let is_sampled = match TreeKind::of(own) {
                Some(TreeKind::Still) => true,
                Some(TreeKind::Frame) => Some(row) == first_frame,
                Some(TreeKind::Shared) | None => false,
            };
            if is_sampled {
                places.add_leaves(own);
            }
        }
        // Forced lights are in no tree but their own. Those that move stand in their first frame's.
        for &row in tree.forced() {
            let instance = &tree.instances()[row as usize];
            places.placed.entry(instance.first_emitter).or_insert(instance);
        }
        places.leaves.par_sort_unstable_by_key(|&(emitter, _)| emitter);
        places
    }

    fn add_leaves(&mut self, row: &TreeRow) {
        for node in self.tree.groups_of(row).iter().flat_map(|group| group.nodes()) {
            match node.link() {
                Link::Emitter(emitter) => self.leaves.push((emitter, node)),
                Link::Instance(row) => {
                    let instance = &self.tree.instances()[row as usize];
                    let below = &self.tree.trees()[instance.tree as usize];
                    if TreeKind::of(below) == Some(TreeKind::Shared) {
                        self.placed.insert(instance.first_emitter, instance);
                    }
                }
                Link::Inner(_) | Link::Nothing => {}
            }
        }
    }

    /// A light, described.
    pub fn describe(&self, light: &Light) -> Described {
        let mut described = light.described();
        let Row::Near(row) = light.row else { return described };
        let row = &self.tree.lights()[row as usize];
        let bounds = match self.placed.get(&row.first_emitter) {
            Some(instance) => {
                let (bounds, to_world) = self.of_placed(instance);
                described.to_world = Some(to_world);
                Some(bounds)
            }
            None => self.around_leaves(row),
        };
        if let Some(bounds) = bounds {
            described.two_sided = bounds.cone.two_sided;
            place(&mut described.card, &bounds);
        }
        described
    }

    fn of_placed(&self, instance: &InstanceRow) -> (LightBounds, Affine3A) {
        let to_local = instance.to_local.transform();
        let to_world = to_local.inverse();
        let own = self.tree.trees()[instance.tree as usize].root.bounds();
        let axis = to_world.transform_vector3(own.cone.axis).normalize_or(Vec3::Z);
        let bounds = LightBounds {
            aabb: own.aabb.transformed(&to_world),
            cone: Cone { axis, ..own.cone },
            range_m: own.range_m / instance.to_local.scale(),
            ..own
        };
        (bounds, to_world)
    }

    /// The bounds of a light's leaves, joined in the order of the emitters, so that they do not depend on
    /// the shape of the tree.
    fn around_leaves(&self, row: &LightRow) -> Option<LightBounds> {
        let first = self.leaves.partition_point(|&(emitter, _)| emitter < row.first_emitter);
        let own = self.leaves[first..].iter();
        let own = own.take_while(|(emitter, _)| emitter - row.first_emitter < row.emitter_count);
        let own: Vec<LightBounds> = own.map(|(_, node)| node.bounds()).collect();
        match own.as_slice() {
            [] => None,
            [one] => Some(*one),
            all => Some(LightBounds::around(all)),
        }
    }
}

/// Fills in what bounds tell.
pub(super) fn place(card: &mut LightCard, bounds: &LightBounds) {
    let LightBounds { aabb, cone, range_m, .. } = bounds;
    card.place =
        Some(Place { center_m: aabb.center().to_array(), size_m: aabb.extent().to_array() });
    card.axis = (cone.theta_o < PI).then(|| cone.axis.to_array());
    let half_angle = if cone.two_sided { PI } else { (cone.theta_o + cone.theta_e).min(PI) };
    card.half_angle_deg = half_angle.to_degrees();
    card.range_m = range_m.is_finite().then_some(*range_m);
}
