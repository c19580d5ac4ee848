//! The front: the groups of the tree that matter most to some viewers, as a subtree from the root on.
//!
//! It is opened where most light is expected to come from, group by group, whatever is known to be hidden.
//! It is what a [veil](super::veil) can be told of.

use super::group::WIDTH;
use super::leaves::lane_toward;
use super::node::Link;
use super::sampling::FrameTree;
use super::viewer::Viewer;

/// Groups of the tree of what stands still, by ascending number.
#[derive(Clone, Debug, Default)]
pub struct Front {
    /// Each begins after the one whose child it is.
    pub groups: Vec<FrontGroup>,
}

/// A group of the front.
#[derive(Clone, Copy, Debug)]
pub struct FrontGroup {
    /// Its number.
    pub group: u32,
    /// Of each lane the importance, in the mean over the viewers.
    pub importances: [f64; WIDTH],
    /// Of each lane its own group, if that is of the front: the place among [`Front::groups`].
    pub inner: [Option<usize>; WIDTH],
}

impl FrameTree<'_> {
    /// The front of at most `most` groups for some viewers.
    pub fn front<V: Viewer>(&self, viewers: &[V], most: usize) -> Front {
        let mut found: Vec<FrontGroup> = Vec::new();
        let mut open: Vec<(f64, u32)> =
            self.first_still_group().map(|first| (f64::INFINITY, first)).into_iter().collect();
        while found.len() < most {
            // The first of the weightiest: there are few.
            let weightiest = |best: Option<usize>, at: usize| match best {
                Some(best) if open[best].0 >= open[at].0 => Some(best),
                _ => Some(at),
            };
            let Some(next) = (0..open.len()).fold(None, weightiest) else { break };
            let (_, group) = open.remove(next);
            let Some(row) = self.groups.get(group as usize) else { continue };
            let mut importances = [0.0; WIDTH];
            for viewer in viewers {
                let own = row.importances(viewer);
                for (sum, own) in importances.iter_mut().zip(own) {
                    *sum += own / viewers.len() as f64;
                }
            }
            for lane in (0..WIDTH).filter(|&lane| importances[lane] > 0.0) {
                if let Link::Inner(ahead) = row.link(lane)
                    && let Some(child) = group.checked_add(ahead)
                {
                    open.push((importances[lane], child));
                }
            }
            found.push(FrontGroup { group, importances, inner: [None; WIDTH] });
        }
        found.sort_unstable_by_key(|row| row.group);
        let numbers: Vec<u32> = found.iter().map(|row| row.group).collect();
        for row in &mut found {
            for lane in 0..WIDTH {
                if let Link::Inner(ahead) = self.groups[row.group as usize].link(lane) {
                    row.inner[lane] = numbers.binary_search(&(row.group + ahead)).ok();
                }
            }
        }
        Front { groups: found }
    }

    /// Calls `visit` with every group and lane on the way to an emitter in the tree of what stands still.
    pub fn for_each_lane_toward(&self, emitter: u32, mut visit: impl FnMut(u32, usize)) {
        let Some((slot, mut at)) = self.table.in_still(emitter).zip(self.first_still_group())
        else {
            return;
        };
        let target = slot / WIDTH as u32;
        while let Some(group) = self.groups.get(at as usize)
            && at < target
        {
            let Some(lane) = lane_toward(group, target - at) else { return };
            visit(at, lane);
            let Link::Inner(ahead) = group.link(lane) else { return };
            at += ahead;
        }
        visit(target, slot as usize % WIDTH);
    }

    fn first_still_group(&self) -> Option<u32> {
        Some(self.trees.get(self.still? as usize)?.first_group)
    }
}
