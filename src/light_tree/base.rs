//! An earlier version of a file, and what in it has stayed the same.
//!
//! Lights are compared by their fingerprints, which cover everything that a tree depends on. A light
//! with the fingerprint of a light of the base is unchanged, even if its name or its place among the
//! others is not. Its leaves must then be those that a build would give it now. If they are not, the
//! base [contradicts](Base::contradicts) the scene, and none of it can be used.

use super::builder::{CHANGED, Earlier};
use super::group::{Group, WIDTH};
use super::leaves::Leaves;
use super::node::{Link, Node};
use super::records::{LightRow, TreeKind, TreeRow};
use super::tree::LightTree;
use super::writer::{LightList, LightSummary};
use crate::bounds::LightBounds;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Leaves that are looked up by one task.
const CHUNK: usize = 1 << 12;

/// The base of a build.
pub struct Base<'a> {
    tree: LightTree<&'a [u8]>,
    /// The lights of the new file.
    list: &'a LightList<'a>,
    /// For each of them the first emitter of the same light in the base; `None` if it has changed.
    old_firsts: Vec<Option<u32>>,
    /// Whether the unchanged lights are in the same order as in the base.
    in_order: bool,
    /// The first emitters of the base's placed lights, with the rows of their trees; ascending.
    placed: Vec<(u32, u32)>,
    /// Whether a leaf was found that is not what its light's bounds give.
    contradicts: AtomicBool,
}

impl<'a> Base<'a> {
    /// Compares the lights of a new file, in their order, with those of an earlier one, which must be
    /// sound (see [`verify`](LightTree::verify)) and built by this version of the algorithm.
    pub fn new<D: AsRef<[u8]>>(tree: &'a LightTree<D>, list: &'a LightList<'a>) -> Base<'a> {
        let tree = tree.by_reference();
        let placed = tree.instances().iter().map(|row| (row.first_emitter, row.tree));
        let is_shared = |(_, row): &(u32, u32)| kind_of(&tree, *row) == Some(TreeKind::Shared);
        let mut placed: Vec<_> = placed.filter(is_shared).collect();
        placed.sort_unstable();
        placed.dedup();
        let old_firsts = same_lights(&tree, list.lights);
        let in_order = old_firsts.iter().flatten().is_sorted();
        let contradicts = AtomicBool::new(false);
        Base { list, old_firsts, in_order, placed, contradicts, tree }
    }

    /// Whether a leaf of an unchanged light was found that is not what the light's bounds give.
    pub fn contradicts(&self) -> bool {
        self.contradicts.load(Ordering::Relaxed)
    }

    /// Whether a leaf is what some bounds give. If not, notes that the base contradicts the scene.
    fn agrees(&self, leaf: Option<Node>, bounds: Option<&LightBounds>) -> bool {
        let agrees = leaf.zip(bounds).is_some_and(|(leaf, bounds)| {
            leaf.difference(&Node::encode(bounds, Link::Nothing)).is_none()
        });
        if !agrees {
            self.contradicts.store(true, Ordering::Relaxed);
        }
        agrees
    }

    /// The `nth` tree that a light has for itself; `None` if the light has changed. `bounds` are those
    /// of the light now.
    pub(super) fn own_tree(
        &self,
        light: usize,
        nth: usize,
        bounds: &[LightBounds],
    ) -> Option<(&TreeRow, &[Group])> {
        let old = (*self.old_firsts.get(light)?)?;
        let first = self.placed.partition_point(|&(emitter, _)| emitter < old);
        let &(emitter, row) = self.placed.get(first + nth)?;
        let tree = &self.tree.trees()[row as usize];
        let groups = self.tree.groups_of(tree);
        let agrees = |node: Node| match node.link() {
            Link::Emitter(own) => self.agrees(Some(node), bounds.get(own as usize)),
            _ => true,
        };
        let agree = || groups.par_iter().all(|group| group.nodes().all(agrees));
        (emitter == old && agree()).then_some((tree, groups))
    }

    /// The base's tree of what stands still, and where in it the leaves of the new one are. `leaf` tells
    /// what each new leaf stands for, in the order of their emitters.
    pub(super) fn still(
        &self,
        bounds: &[LightBounds],
        leaf: impl Fn(usize) -> Leaf + Sync,
    ) -> Option<Earlier<'_>> {
        let own = 0..self.tree.first_of_class(LightRow::PLACED);
        Some(self.earlier(self.still_row()?, own, bounds, leaf))
    }

    /// The same for the tree of a frame, by its place among the frames.
    pub(super) fn frame(
        &self,
        frame: usize,
        bounds: &[LightBounds],
        leaf: impl Fn(usize) -> Leaf + Sync,
    ) -> Option<Earlier<'_>> {
        let row = self.tree.frames().get(frame)?.tree;
        let is_own = kind_of(&self.tree, row) == Some(TreeKind::Frame);
        let first = |class| self.tree.first_of_class(class);
        let own = first(LightRow::CHANGES)..first(LightRow::CHANGES | LightRow::PLACED);
        is_own.then(|| self.earlier(&self.tree.trees()[row as usize], own, bounds, leaf))
    }

    fn still_row(&self) -> Option<&TreeRow> {
        self.tree.still_tree().map(|row| &self.tree.trees()[row as usize])
    }

    fn earlier(
        &self,
        row: &TreeRow,
        own: std::ops::Range<u32>,
        bounds: &[LightBounds],
        leaf: impl Fn(usize) -> Leaf + Sync,
    ) -> Earlier<'_> {
        let old: Leaves = self.tree.leaves_of(row, own);
        let still = self.still_row().map(|row| bytemuck::bytes_of(&row.root));
        let starts = &self.list.starts;
        let slot = |leaf: Leaf, light: &mut usize| match leaf {
            Leaf::Below(tree) => {
                old.below.filter(|_| still == Some(bytemuck::bytes_of(&tree.root)))
            }
            Leaf::Emitter(emitter) => {
                let later = &starts.get(*light + 1..).unwrap_or_default();
                *light += later.iter().take_while(|(first, _)| *first <= emitter).count();
                let within = emitter.checked_sub(starts.get(*light)?.0)?;
                let old_emitter = self.old_firsts[*light]? + within;
                old.find(old_emitter).map(|(slot, _)| slot)
            }
        };
        let first = row.first_group * WIDTH as u32;
        let node = |slot: u32| {
            let group = self.tree.groups().get(slot as usize / WIDTH)?;
            group.node(slot as usize % WIDTH)
        };
        let mut slots = vec![CHANGED; bounds.len()];
        slots.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, slots)| {
            // Leaves come in the order of their emitters.
            let mut light = self.light_before(leaf(chunk * CHUNK));
            for (i, entry) in slots.iter_mut().enumerate() {
                let at = chunk * CHUNK + i;
                let found = slot(leaf(at), &mut light);
                let found = found.filter(|&slot| self.agrees(node(slot), bounds.get(at)));
                *entry = found.map_or(CHANGED, |slot| slot - first);
            }
        });
        Earlier { groups: self.tree.groups_of(row), slots, in_order: self.in_order }
    }

    /// The place of the light that a leaf belongs to; 0 if it belongs to none.
    fn light_before(&self, leaf: Leaf) -> usize {
        match leaf {
            Leaf::Emitter(emitter) => {
                let behind = self.list.starts.partition_point(|(first, _)| *first <= emitter);
                behind.saturating_sub(1)
            }
            Leaf::Below(_) => 0,
        }
    }
}

/// What a leaf of a new tree stands for.
#[derive(Clone, Copy)]
pub(super) enum Leaf {
    /// An emitter, or the first of a light that is placed.
    Emitter(u32),
    /// The tree of what stands still.
    Below(TreeRow),
}

fn kind_of(tree: &LightTree<&[u8]>, row: u32) -> Option<TreeKind> {
    tree.trees().get(row as usize).and_then(TreeKind::of)
}

/// For each light the first emitter of the light in the tree with the same class and content; `None` if
/// there is none. Each light of the tree is matched at most once.
fn same_lights(tree: &LightTree<&[u8]>, lights: &[LightSummary]) -> Vec<Option<u32>> {
    let rows = tree.lights();
    let is_same = |row: &LightRow, light: &LightSummary| {
        (row.class, row.fingerprint) == (light.class, light.fingerprint)
    };
    let at = |old: Option<usize>, new: usize| {
        let row = rows.get(old?)?;
        is_same(row, &lights[new]).then_some(row.first_emitter)
    };
    // Usually only some lights in the middle differ. All others are as far from the start as they were,
    // or as far from the end.
    let mut found: Vec<_> =
        (0..lights.len()).into_par_iter().map(|new| at(Some(new), new)).collect();
    let ahead = found.iter().take_while(|found| found.is_some()).count();
    let longer = rows.len() as isize - lights.len() as isize;
    if longer != 0 {
        let rest = found[ahead..].par_iter_mut().enumerate();
        rest.for_each(|(i, found)| *found = at((ahead + i).checked_add_signed(longer), ahead + i));
    }
    let same_to_end = found[ahead..].iter().rev().take_while(|found| found.is_some()).count();
    let behind = same_to_end.min(rows.len() - ahead);
    let (old_end, new_end) = (rows.len() - behind, lights.len() - behind);
    found[ahead..new_end].fill(None);
    // Both lists are in order of class and path, so merging them finds most of the pairs.
    let (mut gone, mut come) = (Vec::new(), Vec::new());
    let (mut old, mut new) = (ahead, ahead);
    while old < old_end && new < new_end {
        let (row, light) = (&rows[old], &lights[new]);
        if is_same(row, light) {
            found[new] = Some(row.first_emitter);
            (old, new) = (old + 1, new + 1);
            continue;
        }
        let place = (row.class, tree.light_path(row)).cmp(&(light.class, &light.path));
        if place.is_le() {
            gone.push(old);
            old += 1;
        }
        if place.is_ge() {
            come.push(new);
            new += 1;
        }
    }
    gone.extend(old..old_end);
    come.extend(new..new_end);
    // The rest is paired by content alone.
    let content = |row: &LightRow| (row.class, row.fingerprint);
    let content_of_new = |light: &LightSummary| (light.class, light.fingerprint);
    gone.sort_by_key(|&old| content(&rows[old]));
    come.sort_by_key(|&new| content_of_new(&lights[new]));
    let mut gone = gone.into_iter().peekable();
    for new in come {
        let wanted = content_of_new(&lights[new]);
        while gone.next_if(|&old| content(&rows[old]) < wanted).is_some() {}
        if let Some(old) = gone.next_if(|&old| content(&rows[old]) == wanted) {
            found[new] = Some(rows[old].first_emitter);
        }
    }
    found
}
