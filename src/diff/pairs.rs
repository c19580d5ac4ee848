//! The lights of both versions, side by side: what is to be compared with what.

use super::change::{Difference, Verb};
use super::light::Light;
use super::links::LinkChanges;
use super::matching::matching;
use super::scene_side::{Dark, SceneSide};
use std::collections::HashMap;

/// A light of one version, or a prim that might be one and is dark.
#[derive(Clone, Copy, Debug)]
pub(super) enum Half<'a> {
    Lit(Light<'a>),
    Dark(&'a str, Dark),
}

/// Two versions of a light; or one, if the other does not have it.
pub(super) struct Pair<'a> {
    pub verb: Verb,
    pub before: Option<Half<'a>>,
    pub after: Option<Half<'a>>,
    /// The light's number, the same in both versions.
    pub number: u32,
    /// What differs in its links.
    pub links: Vec<Difference>,
}

impl Pair<'_> {
    /// Whether it has another path and nothing else differs.
    pub fn is_renamed_only(&self) -> bool {
        match (&self.before, &self.after) {
            (Some(Half::Lit(before)), Some(Half::Lit(after))) => {
                before.has_content_of(after) && self.links.is_empty()
            }
            _ => false,
        }
    }
}

/// All lights of both.
pub(super) struct Pairs<'a> {
    /// The pairs that are not known to be the same.
    pub changed: Vec<Pair<'a>>,
    /// The lights that are the same, by row of the version after.
    pub unchanged: Vec<u32>,
    /// The number of the light in each row of the version after. In the version before, a light's number
    /// is its row.
    pub number_of_after: Vec<u32>,
    /// How many numbers there are.
    pub count: usize,
}

impl<'a> Pairs<'a> {
    /// Pairs the lights of two versions. `scenes` is given only if both versions are scenes.
    pub fn of(
        scenes: Option<[&'a SceneSide<'a>; 2]>,
        [before, after]: [&[Light<'a>]; 2],
    ) -> Pairs<'a> {
        let found = matching(before, after);
        let both = found.same.iter().chain(&found.renamed);
        let links = both.map(|&(b, a)| (before[b as usize].link, after[a as usize].link));
        let changes = LinkChanges::new(scenes, links);
        let count = before.len() + found.added.len();
        let mut pairs = Pairs {
            changed: Vec::new(),
            unchanged: Vec::new(),
            number_of_after: vec![0; after.len()],
            count,
        };
        for (&row, number) in found.added.iter().zip(before.len() as u32..) {
            pairs.number_of_after[row as usize] = number;
        }
        let same = found.same.iter().map(|pair| (pair, Verb::Dirtied));
        let renamed = found.renamed.iter().map(|pair| (pair, Verb::Renamed));
        for (&(b, a), verb) in same.chain(renamed) {
            pairs.number_of_after[a as usize] = b;
            let (then, now) = (before[b as usize], after[a as usize]);
            let links = changes.of(&then, &now);
            if verb == Verb::Dirtied && then.has_content_of(&now) && links.is_empty() {
                pairs.unchanged.push(a);
            } else {
                let (then, now) = (Some(Half::Lit(then)), Some(Half::Lit(now)));
                pairs.changed.push(Pair { verb, before: then, after: now, number: b, links });
            }
        }
        // A light that one scene lacks may be there as a dark prim: then it was switched on or off.
        let dark = |side: usize, only: &[u32]| match scenes {
            Some(scenes) if !only.is_empty() => scenes[side].dark_prims(),
            _ => HashMap::new(),
        };
        let (dark_before, dark_after) = (dark(0, &found.added), dark(1, &found.removed));
        for &row in &found.removed {
            let light = before[row as usize];
            let after = dark_after.get(light.path).map(|&dark| Half::Dark(light.path, dark));
            let verb = if after.is_some() { Verb::Dirtied } else { Verb::Removed };
            let (before, links) = (Some(Half::Lit(light)), Vec::new());
            pairs.changed.push(Pair { verb, before, after, number: row, links });
        }
        for &row in &found.added {
            let light = after[row as usize];
            let before = dark_before.get(light.path).map(|&dark| Half::Dark(light.path, dark));
            let verb = if before.is_some() { Verb::Dirtied } else { Verb::Added };
            let number = pairs.number_of_after[row as usize];
            let (after, links) = (Some(Half::Lit(light)), Vec::new());
            pairs.changed.push(Pair { verb, before, after, number, links });
        }
        pairs
    }
}
