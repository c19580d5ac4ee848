//! Which light of one version corresponds to which of the other: content first, place in the file last.
//!
//! A path that the file gives identifies a light, whatever else changed. A path that ingest made unique
//! (see [`family`](super::family)) only says where in its file the light stands. Lights are matched in
//! this order:
//!
//! 1. Lights with the same path and the same content.
//! 2. Lights of one family with the same fingerprint.
//! 3. Lights with the same path, if the path is not one of a family.
//! 4. Lights with the same fingerprint under different paths: they were renamed.
//! 5. What is left of a family, in order of place in the file.
//! 6. Lights whose last path component, kind, emitter count, colour, class and energy agree: a prim
//!    above them was renamed or moved.
//!
//! Equal candidates pair in order of their paths. The order in which a version lists its lights does
//! not matter.

use super::family::Families;
use super::light::Light;
use rayon::prelude::*;
use std::cmp::Ordering;

/// Which light is which, by rows of either list.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Matching {
    /// The same light under the same name.
    pub same: Vec<(u32, u32)>,
    /// The same light under another name.
    pub renamed: Vec<(u32, u32)>,
    /// Those that only the version before has.
    pub removed: Vec<u32>,
    /// Those that only the version after has.
    pub added: Vec<u32>,
}

/// Matches two lists of lights.
pub(super) fn matching(before: &[Light], after: &[Light]) -> Matching {
    let lists = [before, after];
    let all = |lights: &[Light]| (0..lights.len() as u32).collect::<Vec<u32>>();
    let join = |rows, key| join(lists, rows, key);
    let (pairs, mut left) = join([all(before), all(after)], by_path);
    let is_unchanged = |&(b, a): &(u32, u32)| before[b as usize].has_content_of(&after[a as usize]);
    let (mut same, changed): (Vec<_>, Vec<_>) = pairs.into_iter().partition(is_unchanged);
    left[0].extend(changed.iter().map(|pair| pair.0));
    left[1].extend(changed.iter().map(|pair| pair.1));
    if left.iter().any(Vec::is_empty) {
        return Matching {
            same,
            renamed: Vec::new(),
            removed: left[0].clone(),
            added: left[1].clone(),
        };
    }

    let families = Families::of(lists, &left);
    let (numbered, left) = divide(lists, left, &families);
    let (pairs, numbered) = join_families(lists, numbered, |light| light.fingerprint);
    same.extend(pairs);
    let (pairs, left) = join(left, by_path);
    same.extend(pairs);
    let [mut b, mut a] = left;
    b.extend(numbered[0].iter().map(|row| row.0));
    a.extend(numbered[1].iter().map(|row| row.0));
    let (mut renamed, left) = join([b, a], by_content);
    let (numbered, [mut b, mut a]) = divide(lists, left, &families);
    let (pairs, numbered) = join_families(lists, numbered, |_| ());
    same.extend(pairs);
    b.extend(numbered[0].iter().map(|row| row.0));
    a.extend(numbered[1].iter().map(|row| row.0));
    let (carried, [removed, added]) = join([b, a], by_look);
    renamed.extend(carried);
    same.sort_by(|x, y| by_path(&after[x.1 as usize], &after[y.1 as usize]));
    Matching { same, renamed, removed, added }
}

/// Rows of lights with their families.
type Numbered = Vec<(u32, String)>;

/// Divides rows into those of numbered families and all others.
fn divide(
    lists: [&[Light]; 2],
    rows: [Vec<u32>; 2],
    families: &Families,
) -> ([Numbered; 2], [Vec<u32>; 2]) {
    let (mut numbered, mut others) = <([Numbered; 2], [Vec<u32>; 2])>::default();
    for side in 0..2 {
        for &row in &rows[side] {
            match families.family(side, lists[side][row as usize].path) {
                Some(family) => numbered[side].push((row, family)),
                None => others[side].push(row),
            }
        }
    }
    (numbered, others)
}

/// Pairs lights of the same family and the same key; equal ones pair in the order of their paths. Also
/// returns the rows of each version that found no partner.
fn join_families<K: Ord>(
    lists: [&[Light]; 2],
    mut rows: [Numbered; 2],
    key: impl Fn(&Light) -> K,
) -> (Vec<(u32, u32)>, [Numbered; 2]) {
    let key_of = |side: usize, row: u32| key(&lists[side][row as usize]);
    let compare = |sides: [usize; 2], x: &(u32, String), y: &(u32, String)| {
        x.1.cmp(&y.1).then_with(|| key_of(sides[0], x.0).cmp(&key_of(sides[1], y.0)))
    };
    for side in 0..2 {
        let path = |row: u32| lists[side][row as usize].path;
        rows[side].sort_by(|a, b| {
            // Shorter first: 9 comes before 10.
            let place = |row: u32| (path(row).len(), path(row));
            compare([side; 2], a, b).then_with(|| place(a.0).cmp(&place(b.0)))
        });
    }
    let (mut pairs, mut rest) = (Vec::new(), <[Numbered; 2]>::default());
    let [before, after] = rows;
    let (mut before, mut after) = (before.into_iter().peekable(), after.into_iter().peekable());
    loop {
        let order = match (before.peek(), after.peek()) {
            (Some(b), Some(a)) => compare([0, 1], b, a),
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (None, None) => return (pairs, rest),
        };
        let b = if order.is_le() { before.next() } else { None };
        let a = if order.is_ge() { after.next() } else { None };
        match (b, a) {
            (Some(b), Some(a)) => pairs.push((b.0, a.0)),
            (b, a) => {
                rest[0].extend(b);
                rest[1].extend(a);
            }
        }
    }
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
        // The energy of a mesh depends on its place by rounding, so it is compared in steps of 1/256
        // stop, about a quarter of a per cent.
        let energy = (light.energy.log2() * 256.0).round() as i32;
        (last_name, light.kind, light.emitters, light.color, light.class, energy)
    }
    look(a).cmp(&look(b))
}

/// Pairs rows of two lists that compare equal by `key`; several equal ones pair in the order of their
/// paths. Also returns the rows of each list that found no partner, in the order of their paths.
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
            link: 0,
            profile: Profile::default(),
        }
    }

    #[test]
    fn a_path_goes_before_content() {
        let before = [light("/a", 1), light("/b", 2)];
        let after = [light("/b", 1), light("/a", 2)];
        let found = matching(&before, &after);
        assert_eq!(found, Matching { same: vec![(0, 1), (1, 0)], ..Default::default() });
    }

    #[test]
    fn of_equal_names_content_goes_before_the_place_in_the_file() {
        let named = |contents: &[u8]| -> Vec<(String, u8)> {
            let path =
                |i| if i == 0 { "/room/lamp".into() } else { format!("/room/lamp_{}", i + 1) };
            contents.iter().enumerate().map(|(i, &content)| (path(i), content)).collect()
        };
        let lights = |named: &'static [(String, u8)]| -> Vec<Light<'static>> {
            named.iter().map(|(path, content)| light(path, *content)).collect()
        };
        let of = |contents: &[u8]| lights(named(contents).leak());
        for (before, after, same, changed) in [
            // Another order.
            (&[1, 2, 3, 4][..], &[3, 2, 4, 1][..], 4, 0),
            // One is put before all others, or taken away there.
            (&[1, 2, 3], &[9, 1, 2, 3], 3, 1),
            (&[9, 1, 2, 3], &[1, 2, 3], 3, 1),
            // Another order, and one changes; many are equal.
            (&[1, 2, 3, 4], &[4, 9, 1, 3], 3, 1),
            (&[5; 12], &[5; 12], 12, 0),
        ] {
            let (before, after) = (of(before), of(after));
            let found = matching(&before, &after);
            let is_same = |&(b, a): &(u32, u32)| {
                before[b as usize].fingerprint == after[a as usize].fingerprint
            };
            let unchanged = found.same.iter().filter(|pair| is_same(pair)).count();
            let others = found.same.len() - unchanged + found.removed.len() + found.added.len();
            assert_eq!((unchanged, others), (same, changed), "{found:?}");
            assert!(found.renamed.is_empty());
        }
    }

    #[test]
    fn lights_without_a_name_are_known_by_their_content() {
        let before = [light("/node_3", 1), light("/node_4", 2), light("/rig/node_9", 3)];
        let after = [light("/node_4", 1), light("/node_5", 2), light("/rig/node_11", 3)];
        let found = matching(&before, &after);
        assert_eq!((found.same.len(), found.renamed.len()), (3, 0), "{found:?}");
    }

    #[test]
    fn numbers_that_an_author_gave_are_names() {
        let before = [light("/lamp_1", 1), light("/lamp_2", 2)];
        let after = [light("/lamp_1", 2), light("/lamp_2", 1)];
        let found = matching(&before, &after);
        assert_eq!(found, Matching { same: vec![(0, 0), (1, 1)], ..Default::default() });
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
            let pairs = found.same.iter();
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
