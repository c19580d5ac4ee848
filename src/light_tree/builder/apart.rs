//! Puts together the groups that tasks built separately.

use super::Below;
use super::reuse::Found;
use crate::bounds::LightBounds;
use crate::light_tree::group::Group;
use crate::light_tree::node::Link;
use rayon::prelude::*;

/// The groups of a part of a cluster.
pub enum Apart<'a> {
    /// No groups: the part is a single item.
    Leaf,
    Found(Found<'a>),
    Built {
        groups: Vec<Group>,
        bounds: LightBounds,
    },
}

impl Apart<'_> {
    fn group_count(&self) -> usize {
        match self {
            Apart::Leaf => 0,
            Apart::Found(found) => found.group_count(),
            Apart::Built { groups, .. } => groups.len(),
        }
    }

    fn group(&self, at: usize, link: impl Fn(usize) -> Link) -> Group {
        match self {
            Apart::Leaf => unreachable!("one item has no groups"),
            Apart::Found(found) => found.group(at, link),
            Apart::Built { groups, .. } => groups[at],
        }
    }
}

/// Appends the groups of some parts, one after the other, and returns where those of each begin.
pub fn append(
    parts: &[Apart],
    link: &(impl Fn(usize) -> Link + Sync),
    out: &mut Vec<Group>,
) -> Vec<Option<Below>> {
    let start = out.len();
    let mut end = 0;
    let starts_and_ends = parts.iter().map(|part| {
        let start = end;
        end += part.group_count();
        (start, end)
    });
    let places: Vec<(usize, usize)> = starts_and_ends.collect();
    let group = |at: usize| {
        let part = places.partition_point(|&(_, end)| end <= at);
        parts[part].group(at - places[part].0, link)
    };
    out.par_extend((0..end).into_par_iter().map(group));
    let below = |(part, &(at, _)): (&Apart, &(usize, usize))| {
        let first = start + at;
        let bounds = match part {
            Apart::Leaf => return None,
            Apart::Found(_) => out[first].bounds(),
            Apart::Built { bounds, .. } => *bounds,
        };
        Some(Below { first, bounds })
    };
    parts.iter().zip(&places).map(below).collect()
}
