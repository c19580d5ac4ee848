//! Linking: which geometry a light lights, which casts shadows from it, and for which a light filter filters (UsdLux's
//! `lightLink`, `shadowLink` and `filterLink`).
//!
//! A *link set* is the geometry that a collection holds. Sets are numbered. A light that lights everything, or is
//! shadowed by everything, has none, nor has a filter that filters for everything; geometry that is in every set has no
//! row either. So a scene without linking has empty tables.

use std::collections::{BTreeMap, HashMap};

/// The links of a scene. Made by [`Linking::new`], which brings them into their normal form: no two sets hold the
/// same, no set holds everything, no two memberships are equal, and none is in every set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Linking {
    sets: u32,
    memberships: Vec<Membership>,
    instances: BTreeMap<u32, Links>,
    lights: BTreeMap<u32, Links>,
    filters: BTreeMap<u32, u32>,
    medium: Option<u32>,
}

/// What a prim is linked by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Links {
    /// The sets that it is in as geometry: a row of [`Linking::memberships`]. `None` is every set.
    pub membership: Option<u32>,
    /// The set that it lights, if it is a light. `None` is everything.
    pub light: Option<u32>,
    /// The set that casts shadows from it, if it is a light. `None` is everything.
    pub shadow: Option<u32>,
}

/// Which sets some geometry is in. The numbers ascend.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Membership {
    /// In these and no others.
    Inside(Box<[u32]>),
    /// In all but these.
    Outside(Box<[u32]>),
}

impl Membership {
    /// Whether it is in a set.
    #[inline]
    pub fn contains(&self, set: u32) -> bool {
        match self {
            Membership::Inside(sets) => sets.binary_search(&set).is_ok(),
            Membership::Outside(sets) => sets.binary_search(&set).is_err(),
        }
    }

    /// The numbers that it is told by.
    pub fn numbers(&self) -> &[u32] {
        match self {
            Membership::Inside(sets) | Membership::Outside(sets) => sets,
        }
    }
}

/// Links as a file has them.
#[derive(Clone, Debug, Default)]
pub struct LinkRows {
    /// Memberships, to which the others refer by row.
    pub memberships: Vec<Membership>,
    /// By row of [`Scene::instances`](super::Scene::instances).
    pub instances: BTreeMap<u32, Links>,
    /// By row of [`Scene::lights`](super::Scene::lights); as geometry a light is the shape that casts shadows.
    pub lights: BTreeMap<u32, Links>,
    /// The set that a filter filters for, by row of [`LightFilters::all`](super::LightFilters::all).
    pub filters: BTreeMap<u32, u32>,
    /// The membership of the fog.
    pub medium: Option<u32>,
}

impl Linking {
    /// Links in their normal form. Sets that no light and no filter names have no meaning.
    pub fn new(rows: LinkRows) -> Linking {
        let named = || {
            let prims = rows.instances.values().chain(rows.lights.values());
            let of_lights = prims.flat_map(|links| [links.light, links.shadow]).flatten();
            of_lights.chain(rows.filters.values().copied())
        };
        let Some(last) = named().max() else { return Linking::default() };
        let new_number = Renumbering::of(last as usize + 1, &rows.memberships, named());
        let sets = new_number.sets;
        let mut memberships = Vec::new();
        let mut known = HashMap::new();
        let new_rows: Vec<Option<u32>> = rows
            .memberships
            .iter()
            .map(|old| {
                let membership = new_number.membership(old)?;
                let next = memberships.len() as u32;
                Some(*known.entry(membership).or_insert_with_key(|membership| {
                    memberships.push(membership.clone());
                    next
                }))
            })
            .collect();
        let set = |old: Option<u32>| new_number.new_of[old? as usize];
        let row = |old: Option<u32>| new_rows[old? as usize];
        let settled = |old: BTreeMap<u32, Links>| {
            let new = old.into_iter().map(|(at, Links { membership, light, shadow })| {
                let (light, shadow) = (set(light), set(shadow));
                (at, Links { membership: row(membership), light, shadow })
            });
            new.filter(|(_, links)| *links != Links::default()).collect()
        };
        let (instances, lights) = (settled(rows.instances), settled(rows.lights));
        let filters = rows.filters.iter().filter_map(|(&at, &old)| Some((at, set(Some(old))?)));
        let filters = filters.collect();
        let medium = row(rows.medium);
        match sets {
            0 => Linking::default(),
            _ => Linking { sets, memberships, instances, lights, filters, medium },
        }
    }

    /// Whether every light lights everything, everything casts shadows from it, and its filters filter for everything.
    pub fn is_empty(&self) -> bool {
        self.sets == 0
    }

    /// How many sets there are.
    pub fn sets(&self) -> u32 {
        self.sets
    }

    /// The memberships of geometry that is not in every set, each once.
    pub fn memberships(&self) -> &[Membership] {
        &self.memberships
    }

    /// The links of a row of [`Scene::instances`](super::Scene::instances).
    pub fn of_instance(&self, row: u32) -> Links {
        self.instances.get(&row).copied().unwrap_or_default()
    }

    /// The links of a row of [`Scene::lights`](super::Scene::lights).
    pub fn of_light(&self, row: u32) -> Links {
        self.lights.get(&row).copied().unwrap_or_default()
    }

    /// The set that a row of [`LightFilters::all`](super::LightFilters::all) filters for. `None` is everything.
    pub fn of_filter(&self, row: u32) -> Option<u32> {
        self.filters.get(&row).copied()
    }

    /// The membership of the fog.
    pub fn of_medium(&self) -> Option<u32> {
        self.medium
    }

    /// Whether geometry is in a set; `None` stands for every set and for a set of everything.
    pub fn holds(&self, set: Option<u32>, membership: Option<u32>) -> bool {
        match (set, membership) {
            (Some(set), Some(row)) => self.memberships[row as usize].contains(set),
            _ => true,
        }
    }

    /// All links that are not those of a prim without any, of instances and then of lights, with their rows.
    pub fn linked_instances(&self) -> impl Iterator<Item = (u32, Links)> + '_ {
        self.instances.iter().map(|(&row, &links)| (row, links))
    }

    /// The same of lights.
    pub fn linked_lights(&self) -> impl Iterator<Item = (u32, Links)> + '_ {
        self.lights.iter().map(|(&row, &links)| (row, links))
    }

    /// How many filters do not filter for everything.
    pub fn linked_filters(&self) -> usize {
        self.filters.len()
    }
}

/// Which sets hold the same, and which hold everything.
struct Renumbering {
    /// For each old number the new one; `None` if the set holds everything, or nothing names it.
    new_of: Vec<Option<u32>>,
    sets: u32,
}

impl Renumbering {
    /// Of so many sets, in the order in which they are `named`.
    fn of(
        count: usize,
        memberships: &[Membership],
        named: impl Iterator<Item = u32>,
    ) -> Renumbering {
        // Each membership divides the sets into those that hold it and the others. Two sets that none of them
        // divides are one.
        let mut part = vec![0u32; count];
        let mut parts = 1;
        let (mut inside_rows, mut inside_of) = (0, vec![0u32; count]);
        let mut lacks = vec![false; count];
        for membership in memberships {
            let numbers = membership.numbers();
            let own = &numbers[..numbers.partition_point(|&set| (set as usize) < count)];
            let mut divided = HashMap::new();
            for &set in own {
                let part = &mut part[set as usize];
                *part = *divided.entry(*part).or_insert_with(|| {
                    parts += 1;
                    parts - 1
                });
            }
            match membership {
                Membership::Inside(_) => {
                    inside_rows += 1;
                    own.iter().for_each(|&set| inside_of[set as usize] += 1);
                }
                Membership::Outside(_) => own.iter().for_each(|&set| lacks[set as usize] = true),
            }
        }
        let mut new_of = vec![None; count];
        let mut number_of_part = HashMap::new();
        for set in named {
            let at = set as usize;
            if lacks[at] || inside_of[at] < inside_rows {
                let next = number_of_part.len() as u32;
                new_of[at] = Some(*number_of_part.entry(part[at]).or_insert(next));
            }
        }
        Renumbering { new_of, sets: number_of_part.len() as u32 }
    }

    /// A membership by new numbers, told by the fewer of them; `None` if it is in every set.
    fn membership(&self, old: &Membership) -> Option<Membership> {
        let numbers = old.numbers().iter().filter_map(|&set| *self.new_of.get(set as usize)?);
        let mut numbers: Vec<u32> = numbers.collect();
        numbers.sort_unstable();
        numbers.dedup();
        let is_short = numbers.len() <= self.sets as usize / 2;
        let others = |numbers: &[u32]| -> Box<[u32]> {
            (0..self.sets).filter(|set| numbers.binary_search(set).is_err()).collect()
        };
        let is_even = 2 * numbers.len() == self.sets as usize;
        let new = match old {
            Membership::Outside(_) if is_short => Membership::Outside(numbers.into()),
            Membership::Outside(_) => Membership::Inside(others(&numbers)),
            // Of two ways that are as short, it is always the same.
            Membership::Inside(_) if is_short && !is_even => Membership::Inside(numbers.into()),
            Membership::Inside(_) => Membership::Outside(others(&numbers)),
        };
        (new != Membership::Outside(Box::default())).then_some(new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SETS: u32 = 12;

    fn membership() -> impl Strategy<Value = Membership> {
        let numbers = prop::collection::btree_set(0..SETS + 2, 0..6);
        (numbers, any::<bool>()).prop_map(|(numbers, inside)| {
            let numbers = numbers.into_iter().collect();
            if inside { Membership::Inside(numbers) } else { Membership::Outside(numbers) }
        })
    }

    fn rows() -> impl Strategy<Value = LinkRows> {
        prop::collection::vec(membership(), 0..8).prop_flat_map(|memberships| {
            let row = prop::option::of(0..memberships.len().max(1) as u32);
            let of_any = !memberships.is_empty();
            let row = row.prop_map(move |row| row.filter(|_| of_any));
            let set = || prop::option::of(0..SETS);
            let links = (row.clone(), set(), set()).prop_map(|(membership, light, shadow)| Links {
                membership,
                light,
                shadow,
            });
            let table = || prop::collection::btree_map(0u32..20, links.clone(), 0..12);
            let filters = prop::collection::btree_map(0u32..9, 0..SETS, 0..4);
            let all = (table(), table(), filters, row.clone());
            all.prop_map(move |(instances, lights, filters, medium)| LinkRows {
                memberships: memberships.clone(),
                instances,
                lights,
                filters,
                medium,
            })
        })
    }

    proptest! {
        /// The normal form says of every light and all geometry what the rows say.
        #[test]
        fn the_normal_form_says_the_same(rows in rows()) {
            let linking = Linking::new(rows.clone());
            let told = |set: Option<u32>, row: Option<u32>| match (set, row) {
                (Some(set), Some(row)) => rows.memberships[row as usize].contains(set),
                _ => true,
            };
            for (&light, of_light) in &rows.lights {
                let own = linking.of_light(light);
                for (&instance, of_instance) in &rows.instances {
                    let row = linking.of_instance(instance).membership;
                    let lit = told(of_light.light, of_instance.membership);
                    prop_assert_eq!(linking.holds(own.light, row), lit);
                    let shaded = told(of_light.shadow, of_instance.membership);
                    prop_assert_eq!(linking.holds(own.shadow, row), shaded);
                }
                let fog = told(of_light.light, rows.medium);
                prop_assert_eq!(linking.holds(own.light, linking.of_medium()), fog);
            }
            for (&filter, &set) in &rows.filters {
                for (&instance, of_instance) in &rows.instances {
                    let row = linking.of_instance(instance).membership;
                    let filtered = told(Some(set), of_instance.membership);
                    prop_assert_eq!(linking.holds(linking.of_filter(filter), row), filtered);
                }
            }
        }

        /// Nothing in it is there twice, or for nothing.
        #[test]
        fn the_normal_form_is_one(rows in rows()) {
            let linking = Linking::new(rows);
            let column = |set: u32| -> Vec<bool> {
                linking.memberships().iter().map(|row| row.contains(set)).collect()
            };
            for set in 0..linking.sets() {
                prop_assert!(column(set).contains(&false));
                prop_assert!((0..set).all(|other| column(other) != column(set)));
            }
            let row = |m: &Membership| -> Vec<bool> {
                (0..linking.sets()).map(|set| m.contains(set)).collect()
            };
            for (at, membership) in linking.memberships().iter().enumerate() {
                prop_assert!(row(membership).contains(&false));
                prop_assert!(membership.numbers().len() <= linking.sets() as usize / 2);
                let before = &linking.memberships()[..at];
                prop_assert!(before.iter().all(|other| row(other) != row(membership)));
            }
        }
    }

    #[test]
    fn a_set_of_everything_is_no_link() {
        let links = |light| Links { light: Some(light), ..Links::default() };
        let rows =
            LinkRows { lights: [(0, links(0)), (1, links(3))].into(), ..LinkRows::default() };
        assert!(Linking::new(rows.clone()).is_empty());
        let geometry = Links { membership: Some(0), ..Links::default() };
        let rows = LinkRows {
            memberships: vec![Membership::Outside([3].into())],
            instances: [(7, geometry)].into(),
            ..rows
        };
        let linking = Linking::new(rows);
        assert_eq!(
            (linking.sets(), linking.of_light(0).light, linking.of_light(1).light),
            (1, None, Some(0))
        );
        assert!(!linking.holds(Some(0), linking.of_instance(7).membership));
        assert!(linking.holds(Some(0), linking.of_instance(8).membership));
    }
}
