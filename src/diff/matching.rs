//! Which light of one version is which of the other.
//!
//! A light is known by its path. Of those that are left, two are the same light under another name if
//! nothing else of them differs; and of those that are left then, if their last names and their looks
//! agree: they were carried along by a prim above them. Many equal ones pair in the order of their
//! paths. The order in which the versions list their lights does not matter.

use super::light::Light;
use rayon::prelude::*;
use std::cmp::Ordering;

/// Which light is which, by rows of either list.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Matching {
    /// Of the same path, in the order of that.
    pub same_path: Vec<(u32, u32)>,
    /// Of different paths.
    pub renamed: Vec<(u32, u32)>,
    /// Those that only the version before has.
    pub removed: Vec<u32>,
    /// Those that only the version after has.
    pub added: Vec<u32>,
}

/// Matches two lists of lights.
pub(super) fn matching(before: &[Light], after: &[Light]) -> Matching {
    let all = |lights: &[Light]| (0..lights.len() as u32).collect::<Vec<u32>>();
    let join = |rows, key| join([before, after], rows, key);
    let (same_path, left) = join([all(before), all(after)], by_path);
    let (mut renamed, left) = join(left, by_content);
    let (carried, [removed, added]) = join(left, by_look);
    renamed.extend(carried);
    Matching { same_path, renamed, removed, added }
}

type Order = fn(&Light, &Light) -> Ordering;

fn by_path(a: &Light, b: &Light) -> Ordering {
    a.path.cmp(b.path)
}

fn by_content(a: &Light, b: &Light) -> Ordering {
    a.fingerprint.cmp(&b.fingerprint)
}

fn by_look(a: &Light, b: &Light) -> Ordering {
    fn look<'a>(light: &Light<'a>) -> impl Ord + use<'a> {
        let last_name = light.path.rsplit('/').next();
        // Energies of meshes carry the rounding of their place: a quarter of a per cent is the same.
        let energy = (light.energy.log2() * 256.0).round() as i32;
        (last_name, light.kind, light.emitters, light.color, light.class, energy)
    }
    look(a).cmp(&look(b))
}

/// Pairs rows of two lists that are equal by some order, equal ones in the order of their paths; and
/// what is left of either, in the order of its paths.
fn join(lists: [&[Light]; 2], rows: [Vec<u32>; 2], key: Order) -> (Vec<(u32, u32)>, [Vec<u32>; 2]) {
    let [left, right] = [0, 1].map(|side: usize| {
        let of = |&row: &u32| &lists[side][row as usize];
        let mut rows = rows[side].clone();
        // Stable and quick on runs: lights are listed in runs of ascending paths.
        rows.par_sort_by(|a, b| key(of(a), of(b)).then_with(|| by_path(of(a), of(b))));
        rows
    });
    let (mut pairs, mut rest) = (Vec::new(), [Vec::new(), Vec::new()]);
    let (mut l, mut r) = (left.iter().peekable(), right.iter().peekable());
    while let (Some(&&a), Some(&&b)) = (l.peek(), r.peek()) {
        let order = key(&lists[0][a as usize], &lists[1][b as usize]);
        match order {
            Ordering::Equal => pairs.push((a, b)),
            Ordering::Less => rest[0].push(a),
            Ordering::Greater => rest[1].push(b),
        }
        if order != Ordering::Greater {
            l.next();
        }
        if order != Ordering::Less {
            r.next();
        }
    }
    rest[0].extend(l);
    rest[1].extend(r);
    for (side, rest) in rest.iter_mut().enumerate() {
        rest.sort_by(|&a, &b| by_path(&lists[side][a as usize], &lists[side][b as usize]));
    }
    (pairs, rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diff::card::Kind;
    use crate::diff::light::{Profile, Row};

    fn light(path: &str, content: u8) -> Light<'_> {
        Light {
            path,
            row: Row::Near(0),
            fingerprint: [content; 32],
            class: 0,
            kind: Some(Kind::Point),
            color: [65535; 3],
            energy: 2.0,
            emitters: 1,
            profile: Profile::default(),
        }
    }

    #[test]
    fn a_path_goes_before_content() {
        let before = [light("/a", 1), light("/b", 2)];
        let after = [light("/b", 1), light("/a", 2)];
        let found = matching(&before, &after);
        assert_eq!(found, Matching { same_path: vec![(0, 1), (1, 0)], ..Default::default() });
    }

    #[test]
    fn equal_content_under_another_path_is_renamed() {
        let before = [light("/b", 7), light("/a", 7), light("/gone", 3)];
        let after = [light("/z", 7), light("/y", 7), light("/new", 4)];
        let found = matching(&before, &after);
        assert_eq!(found.renamed, [(1, 1), (0, 0)], "in the order of their paths");
        assert_eq!((found.removed, found.added), (vec![2], vec![2]));
    }

    #[test]
    fn what_a_prim_above_carries_along_is_told_by_its_last_name() {
        let brighter = Light { energy: 3.0, ..light("/new/lamp_2", 6) };
        let before = [light("/old/lamp_1", 1), light("/old/lamp_2", 2)];
        let after = [light("/new/lamp_1", 5), brighter];
        let found = matching(&before, &after);
        assert_eq!((found.renamed, found.removed, found.added), (vec![(0, 0)], vec![1], vec![1]));
    }

    #[test]
    fn the_order_of_lists_does_not_matter() {
        let names: Vec<String> = (0..40).map(|i| format!("/{}", i * 7 % 40)).collect();
        let before: Vec<Light> = names.iter().map(|name| light(name, 1)).collect();
        let mut after: Vec<Light> = names[5..].iter().map(|name| light(name, 2)).collect();
        let paths = |after: &[Light]| {
            let found = matching(&before, after);
            let pairs = found.same_path.iter();
            let pairs = pairs.map(|&(b, a)| (before[b as usize].path, after[a as usize].path));
            let removed = found.removed.iter().map(|&b| before[b as usize].path);
            (
                pairs.map(|(b, _)| b.to_owned()).collect::<Vec<_>>(),
                removed.map(str::to_owned).collect::<Vec<_>>(),
            )
        };
        let first = paths(&after);
        after.reverse();
        assert_eq!(paths(&after), first);
        assert_eq!((first.0.len(), first.1.len()), (35, 5));
    }
}
