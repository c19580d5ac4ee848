//! Which link numbers of two versions stand for the same.

use std::cmp::Reverse;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Which link numbers of two versions stand for the same. They are counted in the order of the lights, so that one
/// light more may shift them all.
#[derive(Clone, Debug)]
pub struct SameLinks {
    after_of: HashMap<u32, u32>,
}

impl SameLinks {
    /// From the numbers, before and after, of the lights that both versions have. Two numbers stand for the same if
    /// more lights have both than have one of them and another. Number 0 is the same as itself alone: a light that
    /// lights everything is never the same as one that does not.
    pub fn of(lights: impl Iterator<Item = (u32, u32)>) -> SameLinks {
        let mut counts = BTreeMap::new();
        lights.for_each(|numbers| *counts.entry(numbers).or_insert(0u32) += 1);
        let mut numbers: Vec<((u32, u32), u32)> = counts.into_iter().collect();
        numbers.sort_by_key(|&(_, count)| Reverse(count));
        let (mut after_of, mut taken) = (HashMap::from([(0, 0)]), HashSet::from([0]));
        for ((before, after), _) in numbers {
            if !after_of.contains_key(&before) && taken.insert(after) {
                after_of.insert(before, after);
            }
        }
        SameLinks { after_of }
    }

    /// Whether two numbers, before and after, stand for the same.
    pub fn are_same(&self, before: u32, after: u32) -> bool {
        self.after_of.get(&before) == Some(&after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For each light whether it is told to be linked otherwise.
    fn told(lights: &[(u32, u32)]) -> Vec<bool> {
        let same = SameLinks::of(lights.iter().copied());
        lights.iter().map(|&(before, after)| !same.are_same(before, after)).collect()
    }

    #[test]
    fn numbers_that_are_shifted_are_the_same() {
        assert_eq!(told(&[(1, 2), (2, 3), (1, 2), (0, 0), (2, 3), (7, 9)]), [false; 6]);
    }

    #[test]
    fn the_light_that_changed_its_set_is_told_and_no_other() {
        // The first of three leaves them for the set of a fourth, which shifts the numbers.
        assert_eq!(told(&[(1, 1), (1, 2), (1, 2), (2, 1)]), [true, false, false, false]);
        // One of two sets is split, and two sets become one: some light is told.
        assert!(told(&[(1, 1), (1, 2)]).contains(&true) && told(&[(1, 1), (2, 1)]).contains(&true));
    }

    #[test]
    fn everything_is_the_same_as_everything_alone() {
        assert_eq!(told(&[(0, 1), (0, 1), (1, 0), (0, 0)]), [true, true, true, false]);
    }
}
