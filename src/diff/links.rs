//! Which lights light other prims than before, are shadowed by others, or have filters that filter for others.
//!
//! Two scenes are compared by the prims that both have: a prim that is new is not gained. A tree file tells only which
//! lights light the same, by their link numbers.

use super::change::{Difference, Relinked, RelinkedFilter};
use super::light::{Light, Row};
use super::scene_side::SceneSide;
use crate::emitter::LightSource;
use crate::light_tree::SameLinks;
use crate::scene::Links;
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};

/// Prims that a difference names.
const MOST_NAMED: usize = 3;

/// The name of fog.
const FOG: &str = "fog";

/// Finds the differences of links.
pub(super) struct LinkChanges<'a> {
    scenes: Option<[&'a SceneSide<'a>; 2]>,
    /// The prims that both scenes have, by path, with their memberships; without those in every set of both.
    prims: BTreeMap<&'a str, [Option<u32>; 2]>,
    /// What is known of two sets.
    known: RefCell<HashMap<[Option<u32>; 2], Option<Relinked>>>,
    /// Of trees, which link numbers stand for the same.
    numbers: SameLinks,
}

impl<'a> LinkChanges<'a> {
    /// Of two scenes, or of versions of which one is a tree. `lights` are the link numbers, before and after, of the
    /// lights that both have.
    pub fn new(
        scenes: Option<[&'a SceneSide<'a>; 2]>,
        lights: impl Iterator<Item = (u32, u32)>,
    ) -> LinkChanges<'a> {
        let prims = scenes.map_or_else(BTreeMap::new, common_prims);
        LinkChanges { scenes, prims, known: RefCell::default(), numbers: SameLinks::of(lights) }
    }

    /// What differs in the links of a light.
    pub fn of(&self, before: &Light, after: &Light) -> Vec<Difference> {
        let Some(scenes) = self.scenes else {
            let is_same = self.numbers.are_same(before.link, after.link);
            let difference = (!is_same).then_some(Difference::LightLink { prims: None });
            return difference.into_iter().collect();
        };
        let [a, b] =
            [(scenes[0], before), (scenes[1], after)].map(|(scene, light)| links_of(scene, light));
        let light = self.between([a.light, b.light]);
        let shadow = self.between([a.shadow, b.shadow]);
        let light = light.map(|prims| Difference::LightLink { prims: Some(prims) });
        let shadow = shadow.map(|prims| Difference::ShadowLink { prims: Some(prims) });
        let filters = self.refiltered(scenes, [before, after]);
        let filters = (!filters.is_empty()).then_some(Difference::FilterLink { filters });
        [light, shadow, filters].into_iter().flatten().collect()
    }

    /// The filters that both versions of a light have, and that filter for other prims.
    fn refiltered(
        &self,
        scenes: [&'a SceneSide<'a>; 2],
        [before, after]: [&Light; 2],
    ) -> Vec<RelinkedFilter> {
        let path = |side: &SceneSide<'a>, row: u32| -> &'a str {
            let node = side.scene.light_filters.all()[row as usize].node;
            &side.scene.nodes[node as usize].path
        };
        let [old, new] = scenes;
        let others = filters_of(new, after);
        let relinked = filters_of(old, before).iter().filter_map(|&row| {
            let path_of = path(old, row);
            let other = *others.iter().find(|&&other| path(new, other) == path_of)?;
            let sets = [(old, row), (new, other)].map(|(s, row)| s.scene.linking.of_filter(row));
            Some(RelinkedFilter { path: path_of.to_owned(), prims: self.between(sets)? })
        });
        relinked.collect()
    }

    /// How two sets of the two scenes differ; `None` if they do not.
    fn between(&self, sets: [Option<u32>; 2]) -> Option<Relinked> {
        let scenes = self.scenes.filter(|_| sets != [None, None])?;
        let compare = || {
            let mut found = Relinked::default();
            for (path, memberships) in &self.prims {
                let held = [0, 1]
                    .map(|side| scenes[side].scene.linking.holds(sets[side], memberships[side]));
                let (count, named) = match held {
                    [false, true] => (&mut found.gained, &mut found.gained_named),
                    [true, false] => (&mut found.lost, &mut found.lost_named),
                    _ => continue,
                };
                *count += 1;
                if named.len() < MOST_NAMED {
                    named.push((*path).to_owned());
                }
            }
            (found != Relinked::default()).then_some(found)
        };
        self.known.borrow_mut().entry(sets).or_insert_with(compare).clone()
    }
}

/// The links of a light of a scene.
fn links_of(side: &SceneSide, light: &Light) -> Links {
    match light.row {
        Row::Near(row) => side.emitters.lights()[row as usize].links,
        Row::Infinite(row) => side.scene.linking.of_light(side.infinite_row(row)),
    }
}

/// The rows of the filters of a light of a scene.
fn filters_of<'a>(side: &'a SceneSide, light: &Light) -> &'a [u32] {
    let filters = &side.scene.light_filters;
    match light.row {
        Row::Near(row) => match side.emitters.lights()[row as usize].source {
            LightSource::Mesh { instance, .. } => filters.of_instance(instance),
            LightSource::Light(row) => filters.of_light(row),
        },
        Row::Infinite(row) => filters.of_light(side.infinite_row(row)),
    }
}

fn common_prims<'a>(scenes: [&'a SceneSide<'a>; 2]) -> BTreeMap<&'a str, [Option<u32>; 2]> {
    let mut prims = BTreeMap::new();
    if scenes.iter().all(|side| side.scene.linking.is_empty()) {
        return prims;
    }
    let rows = scenes.map(|side| -> HashMap<&str, u32> {
        (0..).zip(&side.scene.instances).map(|(row, instance)| (&*instance.path, row)).collect()
    });
    for (path, row) in &rows[0] {
        let Some(other) = rows[1].get(path) else { continue };
        let of = |side: usize, row: u32| scenes[side].scene.linking.of_instance(row).membership;
        let memberships = [of(0, *row), of(1, *other)];
        if memberships != [None, None] {
            prims.insert(*path, memberships);
        }
    }
    let fog = scenes.map(|side| side.scene.linking.of_medium());
    if scenes.iter().all(|side| side.scene.medium.is_some()) && fog != [None, None] {
        prims.insert(FOG, fog);
    }
    prims
}
