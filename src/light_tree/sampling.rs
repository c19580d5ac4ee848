//! Picking one emitter for a viewer.
//!
//! From the root down, a child is chosen with the probability `I / sum of I` of its group, one
//! random number stretched over all choices (seed, "Method overview"). What takes more than one
//! sample is [beside](super::picks); what tells the probability of a pick, [too](super::probability).
//! All weigh a group by the same code, and there is no limit to the depth.

use super::cut::Picked;
use super::group::{Group, WIDTH};
use super::leaves::{LeafTable, Leaves, Placed};
use super::node::{Link, Node};
use super::records::{InstanceRow, LightRow, TreeRow};
use super::splitting::BELOW_ONE;
use super::tree::{LightTree, NoSuchFrame};
use super::viewer::Viewer;

/// One light, picked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// Which.
    pub light: Picked,
    /// The probability of picking it for this viewer, given what was drawn for clusters that were
    /// split: what its contribution is divided by. Positive.
    pub probability: f64,
    /// The expected number of samples of it for this viewer, whatever is drawn: what it is weighed
    /// with against other ways of finding it. Positive; equals `probability` without splitting.
    pub expected: f64,
    /// What is left of the random number: uniform in `[0, 1)` and fresh.
    pub leftover: f64,
}

/// The tree of one frame, ready to be sampled.
#[derive(Clone)]
pub struct FrameTree<'a> {
    pub(super) groups: &'a [Group],
    pub(super) trees: &'a [TreeRow],
    pub(super) instances: &'a [InstanceRow],
    pub(super) root: Option<u32>,
    pub(super) table: &'a LeafTable,
    /// The leaves of the frame's own tree, if things change.
    pub(super) own: Option<Leaves>,
    /// Forced lights, in the order of their emitters.
    pub(super) forced: Vec<Placed>,
    emitter_count: u32,
    /// The first emitter of a forced light, if there is one.
    unforced_count: u32,
}

impl<D: AsRef<[u8]>> LightTree<D> {
    /// The tree of a frame.
    ///
    /// # Errors
    /// [`NoSuchFrame`] if lights change and the file was built without this frame.
    pub fn at_frame<'a>(
        &'a self,
        frame: i32,
        table: &'a LeafTable,
    ) -> Result<FrameTree<'a>, NoSuchFrame> {
        let (root, forced) = self.roots_at(frame)?;
        let root = root.filter(|&row| (row as usize) < self.trees().len());
        let changing = self.first_of_class(LightRow::CHANGES);
        let placed = self.first_of_class(LightRow::CHANGES | LightRow::PLACED);
        let own = root.filter(|_| !self.frames().is_empty());
        let own = own.map(|row| self.leaves_of(&self.trees()[row as usize], changing..placed));
        let forced = forced.iter().filter_map(|&instance| {
            let row = self.instances().get(instance as usize)?;
            Some(Placed { first_emitter: row.first_emitter, instance, slot: 0 })
        });
        Ok(FrameTree {
            groups: self.groups(),
            trees: self.trees(),
            instances: self.instances(),
            root,
            table,
            own,
            forced: forced.collect(),
            emitter_count: self.emitter_count() as u32,
            unforced_count: self.first_of_class(LightRow::FORCED),
        })
    }
}

/// Where a walk stands: at a group of a tree, with the viewer in that tree's space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<V> {
    /// Row of the tree.
    row: u32,
    /// Number of the group.
    pub at: u32,
    /// The tree's emitters are numbered from here on.
    first_emitter: u32,
    pub viewer: V,
}

/// Where a lane leads.
pub(super) enum Next<V> {
    Emitter(u32),
    Group(Place<V>),
}

impl FrameTree<'_> {
    /// Picks an emitter with a random number in `[0, 1)`; `None` where nothing can arrive (which a
    /// descent may learn only below a cluster whose bounds were too wide to know).
    pub fn sample(&self, viewer: &impl Viewer, u: f64) -> Option<Pick> {
        self.descend(self.place_of_root(viewer)?, u)
    }

    /// Picks an emitter of a forced light, by its number among the forced lights.
    pub fn sample_forced(&self, light: usize, viewer: &impl Viewer, u: f64) -> Option<Pick> {
        self.descend(self.place_of_forced(light, viewer)?, u)
    }

    /// How many emitters belong to lights that are not forced: those that are come last.
    pub fn unforced_count(&self) -> u32 {
        self.unforced_count
    }

    /// How many lights are forced: sampled at every point, beside what is picked.
    pub fn forced_count(&self) -> usize {
        self.forced.len()
    }

    pub(super) fn descend<V: Viewer>(&self, mut place: Place<V>, mut u: f64) -> Option<Pick> {
        let mut probability = 1.0;
        loop {
            let group = self.group(&place)?;
            let weights = Weights::of(group, &place.viewer)?;
            let (lane, leftover) = weights.choose(u);
            u = leftover;
            probability *= weights.share(lane);
            match self.follow(&place, group.link(lane))? {
                Next::Group(next) => place = next,
                Next::Emitter(emitter) => {
                    let light = Picked::Emitter(emitter);
                    return Some(Pick { light, probability, expected: probability, leftover: u });
                }
            }
        }
    }

    pub(super) fn place_of_root<V: Viewer>(&self, viewer: &V) -> Option<Place<V>> {
        let row = self.root?;
        let at = self.trees[row as usize].first_group;
        Some(Place { row, at, first_emitter: 0, viewer: *viewer })
    }

    pub(super) fn place_of_forced<V: Viewer>(&self, light: usize, viewer: &V) -> Option<Place<V>> {
        let beyond = self.trees.len() as u32;
        self.enter(beyond, self.forced.get(light)?.instance, viewer)
    }

    #[inline]
    pub(super) fn group<V>(&self, place: &Place<V>) -> Option<&Group> {
        self.groups.get(place.at as usize)
    }

    /// Where a lane leads; `None` if it lies. Every walk ends, whatever the bytes: links lead onwards
    /// within a tree, and to earlier trees.
    #[inline]
    pub(super) fn follow<V: Viewer>(&self, place: &Place<V>, link: Link) -> Option<Next<V>> {
        match link {
            Link::Inner(ahead) => {
                let at = place.at.checked_add(ahead)?;
                Some(Next::Group(Place { at, ..*place }))
            }
            Link::Emitter(own) => {
                let emitter = place.first_emitter.checked_add(own)?;
                (emitter < self.emitter_count).then_some(Next::Emitter(emitter))
            }
            Link::Instance(row) => self.enter(place.row, row, &place.viewer).map(Next::Group),
            Link::Nothing => None,
        }
    }

    /// The root of an instance, which must be of an earlier tree than a row.
    fn enter<V: Viewer>(&self, before: u32, instance: u32, viewer: &V) -> Option<Place<V>> {
        let instance = self.instances.get(instance as usize)?;
        let row = Some(instance.tree).filter(|&row| row < before)?;
        let at = self.trees.get(row as usize)?.first_group;
        let viewer = viewer.within(&instance.to_local);
        Some(Place { row, at, first_emitter: instance.first_emitter, viewer })
    }

    /// The node of everything; `None` if nothing shines.
    pub fn root(&self) -> Option<&Node> {
        self.root.map(|row| &self.trees[row as usize].root)
    }

    /// The importance of everything at a viewer; 0 if nothing shines.
    pub fn total_importance(&self, viewer: &impl Viewer) -> f64 {
        self.root().map_or(0.0, |root| root.importance(viewer))
    }

    /// Calls `visit` with every emitter that is not forced, its importance to the viewer and its
    /// energy: what a perfect traversal would weigh. In a tree that nobody verified, some may be
    /// missing and some come twice.
    pub fn for_each_leaf(&self, viewer: &impl Viewer, mut visit: impl FnMut(u32, f64, f64)) {
        let Some(place) = self.place_of_root(viewer) else { return };
        let mut open = vec![(place, 1.0, 1.0)];
        while let Some((place, factor, energy_factor)) = open.pop() {
            let tree = &self.trees[place.row as usize];
            let rest = self.groups.get(tree.first_group as usize..).unwrap_or_default();
            for group in &rest[..rest.len().min(tree.group_count as usize)] {
                let weights = group.importances(&place.viewer);
                for (lane, weight) in weights.into_iter().enumerate() {
                    let Some(node) = group.node(lane) else { continue };
                    let energy = f64::from(node.energy());
                    match node.link() {
                        Link::Emitter(_) => {
                            if let Some(Next::Emitter(emitter)) = self.follow(&place, node.link())
                                && emitter < self.unforced_count
                            {
                                visit(emitter, weight * factor, energy * energy_factor);
                            }
                        }
                        Link::Instance(row) => {
                            let Some(below) = self.enter(place.row, row, &place.viewer) else {
                                continue;
                            };
                            // What the leaf says of the tree's energy, in the tree's own space.
                            let instance = &self.instances[row as usize];
                            let scale = f64::from(instance.to_local.scale());
                            let own = f64::from(self.trees[below.row as usize].root.energy());
                            let brighter = energy * scale * scale / own;
                            let outside = place.viewer.unit_of_importance(scale);
                            let energy_factor = energy_factor * energy / own;
                            open.push((below, factor * brighter * outside, energy_factor));
                        }
                        Link::Inner(_) | Link::Nothing => {}
                    }
                }
            }
        }
    }
}

/// The importances of a group's lanes, of which one at least is not zero.
pub(super) struct Weights {
    pub of_lane: [f64; WIDTH],
    /// Where each lane's stretch ends, all laid out along a line.
    ends: [f64; WIDTH],
}

impl Weights {
    #[inline]
    pub fn of(group: &Group, viewer: &impl Viewer) -> Option<Weights> {
        let of_lane = group.importances(viewer);
        let ends = running_sums(&of_lane);
        let total = ends[WIDTH - 1];
        (total > 0.0 && total.is_finite()).then_some(Weights { of_lane, ends })
    }

    /// The probability of a lane.
    #[inline]
    pub fn share(&self, lane: usize) -> f64 {
        self.of_lane[lane] / self.ends[WIDTH - 1]
    }

    /// Chooses a lane by its share, and returns what is left of the random number.
    #[inline]
    pub fn choose(&self, u: f64) -> (usize, f64) {
        let target = u * self.ends[WIDTH - 1];
        // The first that ends beyond the target has a weight; rounding may leave none.
        let before: usize = self.ends.iter().map(|&end| usize::from(end <= target)).sum();
        let lane = if before < WIDTH { before } else { self.last() };
        let begin = self.ends[lane] - self.of_lane[lane];
        (lane, ((target - begin) / self.of_lane[lane]).clamp(0.0, BELOW_ONE))
    }

    #[cold]
    fn last(&self) -> usize {
        self.of_lane.iter().rposition(|&weight| weight > 0.0).unwrap_or(0)
    }
}

/// The sums of the first one, two, ... eight numbers, none negative: by halves, which wait for three
/// additions and not for eight. They never fall, and stay where a number is zero.
#[inline(always)]
fn running_sums(of: &[f64; WIDTH]) -> [f64; WIDTH] {
    let [a, b, c, d, e, f, g, h] = *of;
    let (ab, cd, ef, gh) = (a + b, c + d, e + f, g + h);
    let abcd = ab + cd;
    [a, ab, ab + c, abcd, abcd + e, abcd + ef, abcd + (ef + g), abcd + (ef + gh)]
}
