//! The comparison itself.

use super::amounts::differences;
use super::change::{Apart, Change, Verb};
use super::describe::Describer;
use super::heat;
use super::light::{Light, Profile, Row};
use super::over_time::apart;
use super::pairs::{Half, Pair, Pairs};
use super::picking::{PickingChange, Picks, picking_change};
use super::probes::{box_around, probes};
use super::side::{Side, SideError, Surveyed};
use super::totals::{Tally, Totals};
use super::{Diff, SideName};
use crate::light_tree::LightTree;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::PathBuf;

/// What a comparison is to find out besides what changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DiffOptions {
    /// Where the lights stand that are the same: [`Diff::unchanged`].
    pub unchanged: bool,
    /// Where in the camera's view light changed: [`Diff::heat`].
    pub heat: bool,
}

/// Compares two versions.
///
/// # Errors
/// If a scene has a light that no tree can hold, or if a tree has the fingerprint of the other version
/// and contradicts it.
pub fn compare(before: &Side, after: &Side, options: &DiffOptions) -> Result<Diff, SideError> {
    let surveyed = Surveyed::both(before, after)?;
    let sides = [&surveyed[0], &surveyed[1]];
    if sides[0].contradicts(sides[1]) {
        let [before, after] = [before, after].map(|side| PathBuf::from(&side.name().file));
        return Err(SideError::Contradiction { before, after });
    }
    let names = [before, after].map(|side| side.name().clone());
    let looks_closer = *options != DiffOptions::default();
    if sides[0].has_rows_of(sides[1]) && !looks_closer {
        return Ok(same(names, tally(&sides[0].lights())));
    }
    let scenes = match sides.map(Surveyed::scene) {
        [Some(before), Some(after)] => Some([before, after]),
        _ => None,
    };
    let [lights_before, lights_after] = comparable(sides, scenes.is_some());
    let lights = [lights_before.as_slice(), lights_after.as_slice()];
    let pairs = Pairs::of(scenes, lights);
    let tallies = lights.map(tally);
    let is_same = sides[0].fingerprint() == sides[1].fingerprint() && pairs.changed.is_empty();
    if is_same && !looks_closer {
        return Ok(same(names, tallies[0]));
    }
    let [mut room_before, mut room_after] = [None, None];
    let (tree_before, tree_after) =
        rayon::join(|| sides[0].tree(&mut room_before), || sides[1].tree(&mut room_after));
    let trees = [&tree_before, &tree_after];
    let origins = [before, after].map(Side::origin);
    let shift = (origins[1] - origins[0]).as_vec3();
    let (picking, moved) = match shift == Vec3::ZERO {
        true => compare_picking(sides, trees, lights, &pairs),
        // Positions have different origins, so no probe fits both trees.
        false => (None, vec![0.0; pairs.count]),
    };
    let describer = Describer::new(scenes, trees, shift);
    let apart = scenes.map_or_else(HashMap::new, |scenes| apart(scenes, &pairs.changed, shift));
    let weigher = Weigher::new(trees, tallies, &moved, &apart);
    let found = pairs.changed.par_iter().map(|pair| weigher.change(pair, &describer));
    let mut changes: Vec<Change> = found.flatten().collect();
    changes.par_sort_by(|a, b| {
        (b.share.total_cmp(&a.share))
            .then_with(|| strength(b).total_cmp(&strength(a)))
            .then_with(|| a.path().cmp(b.path()))
    });
    let mark = |&row: &u32| describer.mark(&lights[1][row as usize]);
    let marked = if options.unchanged { pairs.unchanged.as_slice() } else { &[] };
    let heat = scenes.filter(|_| options.heat).and_then(|scenes| heat::map(scenes, trees));
    let [before, after] = names;
    let diff = Diff {
        before,
        after,
        totals: totals(tallies, &changes, pairs.count),
        picking,
        changes,
        table: None,
        unchanged: marked.par_iter().filter_map(mark).collect(),
        heat,
    };
    Ok(in_world(diff, origins[0]))
}

/// What is shown, with all positions in the world of the files.
fn in_world(mut diff: Diff, origin: DVec3) -> Diff {
    let move_out = |at: &mut [f32; 3]| {
        *at = (Vec3::from(*at).as_dvec3() + origin).as_vec3().to_array();
    };
    for change in &mut diff.changes {
        let cards = [&mut change.before, &mut change.after];
        let places = cards.into_iter().flatten().filter_map(|card| card.place.as_mut());
        places.for_each(|place| move_out(&mut place.center_m));
    }
    diff.unchanged.iter_mut().for_each(|mark| move_out(&mut mark.center_m));
    if let Some(picking) = &mut diff.picking {
        move_out(&mut picking.worst_at_m);
    }
    diff
}

/// Nothing differs.
fn same([before, after]: [SideName; 2], tally: Tally) -> Diff {
    Diff {
        before,
        after,
        totals: totals([tally; 2], &[], tally.lights),
        picking: None,
        changes: Vec::new(),
        table: None,
        unchanged: Vec::new(),
        heat: None,
    }
}

/// What both versions tell: a tree holds neither infinite lights nor emission profiles.
fn comparable<'a>(sides: [&'a Surveyed; 2], both_scenes: bool) -> [Vec<Light<'a>>; 2] {
    sides.map(|side| {
        let mut lights = side.lights();
        if !both_scenes {
            lights.retain(|light| matches!(light.row, Row::Near(_)));
            lights.iter_mut().for_each(|light| light.profile = Profile::default());
        }
        lights
    })
}

fn tally(lights: &[Light]) -> Tally {
    let sum = |infinite: bool| {
        let of = lights.iter().filter(|light| matches!(light.row, Row::Infinite(_)) == infinite);
        of.map(|light| f64::from(light.energy)).sum()
    };
    Tally {
        lights: lights.len(),
        emitters: lights.iter().map(|light| light.emitters as usize).sum(),
        energy_cd: sum(false),
        illuminance_lux: sum(true),
    }
}

/// `lights` of both versions in all, each counted once.
fn totals([before, after]: [Tally; 2], changes: &[Change], lights: usize) -> Totals {
    let count = |verb| changes.iter().filter(|change| change.verb == verb).count();
    Totals {
        before,
        after,
        added: count(Verb::Added),
        removed: count(Verb::Removed),
        dirtied: count(Verb::Dirtied),
        renamed: count(Verb::Renamed),
        unchanged: lights - changes.len(),
    }
}

fn compare_picking(
    sides: [&Surveyed; 2],
    trees: [&LightTree<&[u8]>; 2],
    lights: [&[Light]; 2],
    pairs: &Pairs,
) -> (Option<PickingChange>, Vec<f64>) {
    if lights.iter().all(|lights| lights.is_empty()) {
        return (None, Vec::new());
    }
    let scenes = sides.map(Surveyed::scene);
    let (places, probes) = probes(scenes, trees);
    let before: Vec<u32> = (0..lights[0].len() as u32).collect();
    let both_scenes = scenes.iter().all(Option::is_some);
    let beside = scenes.map(|scene| scene.filter(|_| both_scenes));
    let picks = [
        Picks::new(trees[0], beside[0], &before),
        Picks::new(trees[1], beside[1], &pairs.number_of_after),
    ];
    let (change, moved) = picking_change([&picks[0], &picks[1]], pairs.count, places, &probes);
    (Some(change), moved)
}

/// The strength that ties are told by.
fn strength(change: &Change) -> f32 {
    let cards = [&change.before, &change.after].into_iter().flatten();
    cards.map(|card| card.energy).fold(0.0, f32::max)
}

/// Tells how much a change matters.
struct Weigher<'a> {
    /// Energy of the stronger version.
    total: f64,
    /// Squared half diagonal of the box around the lights, m2. Times it, the illuminance of an infinite
    /// light is the energy of a point light at that distance that gives the same illuminance.
    radius2: f64,
    /// By number of the light, the share of picks that it gained or lost.
    moved: &'a [f64],
    /// By number of the light, how far its versions come apart in time, if they change.
    apart: &'a HashMap<u32, Apart>,
}

impl<'a> Weigher<'a> {
    fn new(
        trees: [&LightTree<&[u8]>; 2],
        tallies: [Tally; 2],
        moved: &'a [f64],
        apart: &'a HashMap<u32, Apart>,
    ) -> Weigher<'a> {
        let radius2 = f64::from((0.5 * box_around(trees).extent()).length_squared());
        let radius2 = if radius2 > 0.0 { radius2 } else { 1.0 };
        let energies = tallies.map(|t| t.energy_cd + t.illuminance_lux * radius2);
        Weigher { total: energies[0].max(energies[1]), radius2, moved, apart }
    }

    /// The change of a pair; `None` if the descriptions of both versions do not differ.
    fn change(&self, pair: &Pair, describer: &Describer) -> Option<Change> {
        let before = pair.before.as_ref().map(|half| describer.describe(0, half));
        let after = pair.after.as_ref().map(|half| describer.describe(1, half));
        let differences = match (&before, &after) {
            (Some(before), Some(after)) if !pair.is_renamed_only() => {
                differences(before, after, &pair.links, self.apart.get(&pair.number).copied())
            }
            _ => Vec::new(),
        };
        if pair.verb == Verb::Dirtied && differences.is_empty() {
            return None;
        }
        let energy = |half: &Option<Half>| match half {
            Some(Half::Lit(light)) => match light.row {
                Row::Near(_) => f64::from(light.energy),
                Row::Infinite(_) => f64::from(light.energy) * self.radius2,
            },
            _ => 0.0,
        };
        let gained = (energy(&pair.after) - energy(&pair.before)).abs();
        let of_energy = if gained > 0.0 { gained / self.total } else { 0.0 };
        // A light that was only renamed gains or loses picks only because other lights changed.
        let is_renamed_only = pair.verb == Verb::Renamed && differences.is_empty();
        let of_picks = if is_renamed_only { 0.0 } else { self.moved[pair.number as usize] };
        Some(Change {
            verb: pair.verb,
            share: of_energy.max(of_picks),
            before: before.map(|described| described.card),
            after: after.map(|described| described.card),
            differences,
        })
    }
}
