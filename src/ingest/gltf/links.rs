//! Linking: `extras.usdLinks` of geometry, `lightLink` and `shadowLink` in `extras.usdLux` of lights, `filterLink` in
//! `extras.usdLightFilter` of their filters.

use super::Output;
use super::document::{UsdLinks, UsdLux};
use crate::ingest::error::Fault;
use crate::scene::{Category, LinkRows, Linking, Links, Membership};
use gltf::json::Extras;
use std::collections::HashMap;

/// More sets than this are refused.
const MOST_SETS: u32 = 1 << 14;

/// More pairs of a set and a membership than this are refused: the renderer keeps each pair.
const MOST_PAIRS: u64 = 1 << 28;

const REMEDY: &str = "link lights that belong together by one collection";

/// The links that were read so far.
#[derive(Default)]
pub(super) struct LinkTable {
    rows: LinkRows,
    known: HashMap<Membership, u32>,
    /// Of the primitives of meshes that tell one, by the numbers of both.
    of_primitives: HashMap<[usize; 2], Option<u32>>,
    /// The objects that say in which sets they are, and the largest number of those.
    told: Vec<(u32, String)>,
    /// One past the largest set that a light or a filter names.
    sets: u32,
}

impl LinkTable {
    /// The membership of a prim: that of an object's extras, if they tell one, else the one from above.
    pub(super) fn membership(
        &mut self,
        output: &mut Output,
        extras: &Extras,
        above: Option<u32>,
        object: &str,
    ) -> Result<Option<u32>, Fault> {
        Ok(self.told(output, extras, object)?.unwrap_or(above))
    }

    /// The membership of a primitive of a mesh, by their numbers. Every instance asks; extras are read once.
    pub(super) fn of_primitive(
        &mut self,
        output: &mut Output,
        (primitive, extras): ([usize; 2], &Extras),
        above: Option<u32>,
        object: &str,
    ) -> Result<Option<u32>, Fault> {
        if let Some(&known) = self.of_primitives.get(&primitive) {
            return Ok(known);
        }
        let Some(told) = self.told(output, extras, object)? else { return Ok(above) };
        self.of_primitives.insert(primitive, told);
        Ok(told)
    }

    /// What an object's extras tell of its membership, if they do.
    fn told(
        &mut self,
        output: &mut Output,
        extras: &Extras,
        object: &str,
    ) -> Result<Option<Option<u32>>, Fault> {
        let Some(links) = UsdLinks::of(extras, object)? else { return Ok(None) };
        let membership = membership(links, object)?;
        if membership.numbers().is_empty() && matches!(membership, Membership::Outside(_)) {
            return Ok(Some(None));
        }
        if let Some(&row) = self.known.get(&membership) {
            return Ok(Some(Some(row)));
        }
        let bytes = 2 * size_of_val(membership.numbers()) + size_of::<Membership>() + object.len();
        output.budget.take(bytes as u64, || object.to_string())?;
        if let Some(&last) = membership.numbers().last() {
            self.told.push((last, object.to_string()));
        }
        let row = self.rows.memberships.len() as u32;
        self.rows.memberships.push(membership.clone());
        self.known.insert(membership, row);
        Ok(Some(Some(row)))
    }

    /// The sets that the light at a node lights and is shadowed by.
    pub(super) fn of_light(&mut self, lux: Option<&UsdLux>, object: &str) -> Result<Links, Fault> {
        let Some(lux) = lux else { return Ok(Links::default()) };
        let light = self.named(lux.light_link, "usdLux: lightLink", object)?;
        let shadow = self.named(lux.shadow_link, "usdLux: shadowLink", object)?;
        Ok(Links { membership: None, light, shadow })
    }

    /// A set that an object names.
    fn named(&mut self, told: Option<u64>, key: &str, object: &str) -> Result<Option<u32>, Fault> {
        let Some(set) = told else { return Ok(None) };
        if set >= u64::from(MOST_SETS) {
            let problem = format!("extras.{key} is {set}, and sets are 0 to {}", MOST_SETS - 1);
            return Err(Fault::new(object, problem).remedy(REMEDY));
        }
        self.sets = self.sets.max(set as u32 + 1);
        Ok(Some(set as u32))
    }

    /// Notes the set that a filter, by its row, filters for, if it names one.
    pub(super) fn add_filter(
        &mut self,
        output: &mut Output,
        told: Option<u64>,
        row: u32,
        object: &str,
    ) -> Result<(), Fault> {
        if let Some(set) = self.named(told, "usdLightFilter: filterLink", object)? {
            take_row(output)?;
            self.rows.filters.insert(row, set);
        }
        Ok(())
    }

    /// Notes the links of the instance that is added next.
    pub(super) fn add_instance(&mut self, output: &mut Output, links: Links) -> Result<(), Fault> {
        let row = output.scene.instances.len() as u32;
        if links != Links::default() {
            take_row(output)?;
            self.rows.instances.insert(row, links);
        }
        Ok(())
    }

    /// Notes the links of the light that is added next.
    pub(super) fn add_light(&mut self, output: &mut Output, links: Links) -> Result<(), Fault> {
        let row = output.scene.lights.len() as u32;
        if links != Links::default() {
            take_row(output)?;
            self.rows.lights.insert(row, links);
        }
        Ok(())
    }

    /// Notes the membership of the scene's fog.
    pub(super) fn set_medium(&mut self, membership: Option<u32>) {
        self.rows.medium = membership;
    }

    /// Gives the scene its links.
    pub(super) fn finish(self, output: &mut Output) -> Result<(), Fault> {
        let (sets, memberships) = (u64::from(self.sets), self.rows.memberships.len() as u64);
        for (last, object) in self.told {
            if last >= self.sets {
                let text = "extras.usdLinks names link sets that no light and no filter names; they have no meaning";
                output.notes.add(Category::Lights, object, text);
            }
        }
        if sets * memberships > MOST_PAIRS {
            let problem = format!(
                "{sets} link sets of lights and filters, and {memberships} memberships of geometry are too many"
            );
            return Err(Fault::new("extras.usdLinks", problem).remedy(REMEDY));
        }
        output.scene.linking = Linking::new(self.rows);
        Ok(())
    }
}

fn take_row(output: &mut Output) -> Result<(), Fault> {
    output.budget.take(2 * size_of::<(u32, Links)>() as u64, || "extras.usdLinks".to_string())
}

fn membership(links: UsdLinks, object: &str) -> Result<Membership, Fault> {
    let fault = |problem: &str| Fault::new(object, format!("extras.usdLinks: {problem}"));
    let (sets, is_inside) = match (links.inside, links.outside) {
        (Some(sets), None) => (sets, true),
        (None, Some(sets)) => (sets, false),
        _ => return Err(fault("has not just one of inside and outside")),
    };
    if !sets.is_sorted_by(|before, after| before < after) {
        return Err(fault("its numbers do not ascend"));
    }
    if let Some(&last) = sets.last()
        && last >= u64::from(MOST_SETS)
    {
        let problem = format!("names set {last}, and sets are 0 to {}", MOST_SETS - 1);
        return Err(fault(&problem).remedy(REMEDY));
    }
    let sets = sets.into_iter().map(|set| set as u32).collect();
    Ok(if is_inside { Membership::Inside(sets) } else { Membership::Outside(sets) })
}
