//! Whether a tree agrees with its scene about the lights.
//!
//! `verify` proves from the file alone that clusters bound their leaves. Only the scene can show that the
//! leaves bound the emitters: this module compares each leaf, bit by bit, with the bounds that it must
//! have been built from. Both together prove that the tree takes no light for dark that is not. Neither
//! proves that the tree is as good as a new build: clusters may be wider than necessary or badly split,
//! which makes pictures noisier but not wrong.

use super::build::in_world;
use super::survey::{Group, PlacedLight, SharedBounds, Survey, SurveyedFrame, numbering_of};
use super::textures;
use crate::bounds::LightBounds;
use crate::emitter::{Emitters, TextureMeans};
use crate::light_tree::{
    InstanceRow, LightList, LightRow, LightSummary, LightTree, Link, Node, TreeKind, TreeRow, WIDTH,
};
use rayon::prelude::*;
use std::fmt;

/// A difference between a tree and its scene, mostly about one light.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contradiction {
    /// Prim path of the light; empty if it is about no single light.
    pub path: String,
    /// What differs, in words.
    pub what: &'static str,
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Contradiction { path, what } = self;
        match path.is_empty() {
            true => write!(f, "{what}"),
            false => write!(f, "light {path}: {what}"),
        }
    }
}

/// How a tree file relates to a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Standing {
    /// It is what a build would write, as far as a comparison can tell.
    UpToDate,
    /// It belongs to another scene or an earlier version of this one, or lacks what a build would add.
    OutOfDate,
    /// It has the scene's fingerprint, but differs from the scene.
    Contradicts(Contradiction),
}

/// How a tree file, which must have been verified, relates to a surveyed scene.
pub fn standing<D: AsRef<[u8]> + Sync>(tree: &LightTree<D>, survey: &Survey) -> Standing {
    if tree.fingerprint() != survey.fingerprint {
        return Standing::OutOfDate;
    }
    match find_contradiction(tree, survey, true) {
        Some(contradiction) => Standing::Contradicts(contradiction),
        None if tree.textures().is_empty() && !survey.textures.is_empty() => Standing::OutOfDate,
        None => Standing::UpToDate,
    }
}

/// The first difference between a tree and the survey whose fingerprint it has. Compares the rows of
/// lights and, if the file has any, the means of textures; with `leaves`, also all leaves.
pub(super) fn find_contradiction<D: AsRef<[u8]> + Sync>(
    tree: &LightTree<D>,
    survey: &Survey,
    leaves: bool,
) -> Option<Contradiction> {
    let agreement = Agreement::with_survey(tree, survey);
    let of_trees = || {
        let frames = || survey.frames.iter().find_map(|frame| agreement.of_frame(frame));
        agreement.of_shared().or_else(|| agreement.of_still()).or_else(frames)
    };
    (agreement.of_lights(&survey.lights))
        .or_else(|| agreement.of_fingerprints(&survey.frames))
        .or_else(|| agreement.of_textures(&survey.textures))
        .or_else(|| if leaves { agreement.of_number_of_trees().or_else(of_trees) } else { None })
}

/// A tree, and what has been surveyed of its scene.
pub(super) struct Agreement<'a, D> {
    pub tree: &'a LightTree<D>,
    pub shared: &'a [SharedBounds],
    /// How many of them have the same rows in the file.
    pub lasting: usize,
    pub still: &'a Group,
    /// What changes, as far as it is surveyed.
    pub changing: Vec<&'a Group>,
}

impl<'a, D: AsRef<[u8]> + Sync> Agreement<'a, D> {
    fn with_survey(tree: &'a LightTree<D>, survey: &'a Survey) -> Self {
        let Survey { shared, still, frames, .. } = survey;
        let changing = frames.iter().map(|frame| &*frame.group).collect();
        Agreement { tree, shared, lasting: shared.len(), still, changing }
    }

    /// The rows of lights.
    fn of_lights(&self, lights: &[LightSummary]) -> Option<Contradiction> {
        let list = LightList::new(lights);
        let rows = self.tree.lights();
        if rows.len() != lights.len() {
            return Some(self.in_general("the number of lights"));
        }
        let differs = |(at, row): (usize, &LightRow)| {
            let now = list.row(at);
            let path = &lights[at].path;
            let what = if self.tree.light_path(row) != path {
                "its path"
            } else if (row.first_emitter, row.emitter_count)
                != (now.first_emitter, now.emitter_count)
            {
                "its emitters"
            } else if row.class != now.class {
                "its class"
            } else if row.fingerprint != now.fingerprint {
                "its fingerprint"
            } else if row.energy.to_bits() != now.energy.to_bits() {
                "its energy"
            } else if row.look != now.look {
                "its kind or colour"
            } else if self.tree.link_of(at) != lights[at].link {
                "its link"
            } else {
                return None;
            };
            Some(Contradiction { path: path.clone(), what })
        };
        rows.par_iter().enumerate().find_map_first(differs)
    }

    /// The fingerprints of frames.
    fn of_fingerprints(&self, frames: &[SurveyedFrame]) -> Option<Contradiction> {
        let told = self.tree.frames().iter().map(|row| row.frame).zip(self.tree.fingerprints());
        let is_so = told.eq(frames.iter().map(|frame| (frame.number, &frame.fingerprint)));
        (!is_so).then(|| self.in_general("the fingerprints of the frames"))
    }

    /// The means of textures.
    fn of_textures(&self, means: &[TextureMeans]) -> Option<Contradiction> {
        let is_so = self.tree.textures().is_empty() || textures::has_just(self.tree, means);
        (!is_so).then(|| self.in_general("the means of the emission textures"))
    }

    /// How many trees there are of lights that have their own.
    fn of_number_of_trees(&self) -> Option<Contradiction> {
        let is_shared = |row: &&TreeRow| TreeKind::of(row) == Some(TreeKind::Shared);
        let shared = self.tree.trees().iter().take_while(is_shared).count();
        let what = "the number of lights that have trees of their own";
        (shared != self.shared.len()).then(|| self.in_general(what))
    }

    /// How emitters are numbered.
    pub fn of_numbering(&self, emitters: &Emitters) -> Option<Contradiction> {
        let what = "how the emitters are numbered";
        (self.tree.numbering() != numbering_of(emitters)).then(|| self.in_general(what))
    }

    /// The link numbers of lights, and where the lights begin; nothing, if every light lights everything.
    pub fn of_links(&self, emitters: &Emitters) -> Option<Contradiction> {
        let (rows, lights) = (self.tree.lights(), emitters.lights());
        if emitters.link_sets().is_empty() && self.tree.light_links().is_empty() {
            return None;
        }
        if rows.len() != lights.len() {
            return Some(self.in_general("the number of lights"));
        }
        let differs = |(at, row): (usize, &LightRow)| {
            let (light, told) = (&lights[at], (row.first_emitter, row.emitter_count));
            let what = match self.tree.link_of(at) == light.link {
                false => "its link",
                true if told != (light.first, light.count) => "its emitters",
                true => return None,
            };
            Some(Contradiction { path: light.path.to_string(), what })
        };
        rows.par_iter().enumerate().find_map_first(differs)
    }

    /// The leaves of the lights that have trees of their own in every frame.
    pub fn of_shared(&self) -> Option<Contradiction> {
        let rows = (0..self.lasting).into_par_iter();
        rows.find_map_first(|row| self.of_own_tree(row as u32, row))
    }

    /// The leaves of a tree that a light has for itself.
    fn of_own_tree(&self, row: u32, shared: usize) -> Option<Contradiction> {
        let bounds = &self.shared[shared].bounds;
        let leaf = |link| match link {
            Link::Emitter(own) => bounds.get(own as usize).copied(),
            _ => None,
        };
        match self.tree.trees().get(row as usize) {
            Some(tree) if TreeKind::of(tree) == Some(TreeKind::Shared) => {
                self.of_leaves(tree, bounds.len(), leaf, |_| self.light_of_shared(shared))
            }
            _ => Some(self.in_general("the number of lights that have trees of their own")),
        }
    }

    /// What stands still, and the forced lights of a file without frames.
    pub fn of_still(&self) -> Option<Contradiction> {
        let still = self.still;
        let row = self.tree.still_tree();
        let of_row = match row {
            Some(row) => self.of_group(&self.tree.trees()[row as usize], still, 0),
            None if still.flat.is_empty() && still.placed.is_empty() => None,
            None => Some(self.in_general("that nothing stands still")),
        };
        let forced = || match self.tree.frames().is_empty() {
            true => self.of_forced(self.tree.forced(), [still].into_iter()),
            false => None,
        };
        of_row.or_else(forced)
    }

    /// What changes, in one frame.
    pub fn of_frame(&self, frame: &SurveyedFrame) -> Option<Contradiction> {
        let SurveyedFrame { number, group, .. } = frame;
        let Ok((row, forced)) = self.tree.roots_at(*number) else {
            return Some(self.in_general("the frames"));
        };
        let still = self.tree.still_tree();
        let of_row = match row {
            _ if group.flat.is_empty() && group.placed.is_empty() => {
                (row != still).then(|| self.in_general("that something changes"))
            }
            Some(row) => match self.tree.trees().get(row as usize) {
                Some(row) => self.of_group(row, group, usize::from(still.is_some())),
                None => Some(self.in_general("the tree of a frame")),
            },
            None => Some(self.in_general("that nothing shines in a frame")),
        };
        of_row.or_else(|| self.of_forced(forced, [self.still, group].into_iter()))
    }

    /// The tree over a group. `below` is 1 if the tree of what stands still is one of its leaves, else 0.
    fn of_group(&self, row: &TreeRow, group: &Group, below: usize) -> Option<Contradiction> {
        let count = group.flat.len() + group.placed.len() + below;
        let bounds_of = |link| match link {
            Link::Emitter(emitter) => {
                let at = emitter.checked_sub(group.first)?;
                group.flat.get(at as usize).copied()
            }
            Link::Instance(instance) => {
                let instance = self.tree.instances().get(instance as usize)?;
                let below = self.tree.trees().get(instance.tree as usize)?;
                if TreeKind::of(below) == Some(TreeKind::Still) {
                    return Some(below.root.bounds());
                }
                let placed = self.placed(&group.placed, instance.first_emitter)?;
                let is_placed_so =
                    instance.to_local == placed.to_local && instance.tree == placed.shared;
                is_placed_so.then(|| in_world(&below.root.bounds(), placed))
            }
            Link::Inner(_) | Link::Nothing => None,
        };
        let light_of = |link| match link {
            Link::Emitter(emitter) => self.light_of(emitter),
            Link::Instance(row) => {
                let row = self.tree.instances().get(row as usize);
                row.map_or_else(String::new, |row| self.light_of(row.first_emitter))
            }
            Link::Inner(_) | Link::Nothing => String::new(),
        };
        self.of_leaves(row, count, bounds_of, light_of)
    }

    /// The leaves of a tree; there must be `count` of them.
    fn of_leaves(
        &self,
        row: &TreeRow,
        count: usize,
        bounds_of: impl Fn(Link) -> Option<LightBounds> + Sync,
        light_of: impl Fn(Link) -> String + Sync,
    ) -> Option<Contradiction> {
        if row.leaf_count as usize != count {
            return Some(self.in_general("the number of leaves of a tree"));
        }
        let differs = |node: Node| {
            let link = node.link();
            if let Link::Inner(_) = link {
                return None;
            }
            let what = match bounds_of(link) {
                Some(bounds) => node.difference(&Node::encode(&bounds, link))?,
                None => "its place in a tree",
            };
            Some(Contradiction { path: light_of(link), what })
        };
        /// Groups looked at by one task.
        const TOGETHER: usize = 1 << 8;
        let chunks = self.tree.groups_of(row).par_chunks(TOGETHER);
        chunks.find_map_first(|groups| {
            let lanes = groups.iter().flat_map(|group| (0..WIDTH).map(|lane| group.node(lane)));
            lanes.flatten().find_map(differs)
        })
    }

    /// The forced lights of a frame, against those of groups, one after the other.
    fn of_forced<'g>(
        &self,
        rows: &[u32],
        groups: impl Iterator<Item = &'g Group>,
    ) -> Option<Contradiction> {
        let mut rows = rows.iter();
        for placed in groups.flat_map(|group| &group.forced) {
            let row = rows.next().and_then(|&row| self.tree.instances().get(row as usize));
            let differs = |row: &InstanceRow| {
                let is_placed_so =
                    (row.to_local, row.first_emitter) == (placed.to_local, placed.first_emitter);
                let shared = placed.shared as usize;
                match shared < self.lasting {
                    true => !is_placed_so || row.tree != placed.shared,
                    // Its tree is that of one frame, and has another row in the file than here.
                    false => !is_placed_so || self.of_own_tree(row.tree, shared).is_some(),
                }
            };
            if row.is_none_or(differs) {
                let path = self.light_of(placed.first_emitter);
                return Some(Contradiction { path, what: "where it is placed, or its tree" });
            }
        }
        rows.next().map(|_| self.in_general("the number of forced lights"))
    }

    fn placed<'g>(&self, placed: &'g [PlacedLight], first: u32) -> Option<&'g PlacedLight> {
        let at = placed.binary_search_by_key(&first, |placed| placed.first_emitter).ok()?;
        Some(&placed[at])
    }

    /// The path of an emitter's light.
    fn light_of(&self, emitter: u32) -> String {
        let rows = self.tree.lights();
        let behind = rows.partition_point(|row| row.first_emitter <= emitter);
        let row = behind.checked_sub(1).and_then(|at| rows.get(at));
        row.map_or_else(String::new, |row| self.tree.light_path(row).to_owned())
    }

    /// The path of the first light that a shared tree serves.
    fn light_of_shared(&self, shared: usize) -> String {
        let groups = std::iter::once(self.still).chain(self.changing.iter().copied());
        let mut placed = groups.flat_map(|group| group.placed.iter().chain(&group.forced));
        let found = placed.find(|placed| placed.shared as usize == shared);
        found.map_or_else(String::new, |placed| self.light_of(placed.first_emitter))
    }

    fn in_general(&self, what: &'static str) -> Contradiction {
        Contradiction { path: String::new(), what }
    }
}
