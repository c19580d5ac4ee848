//! Prim paths, each given once.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// A name longer than this is cut: paths repeat the names of all ancestors.
const LONGEST_NAME: usize = 128;

/// Gives out paths; one that is taken gets a number: `/World/lamp`, `/World/lamp_2`.
#[derive(Default)]
pub(super) struct PrimPaths {
    /// Every path given.
    given: HashSet<Arc<str>>,
    /// The last number that was tried after a path, of those that were wanted again.
    tried: HashMap<Arc<str>, u32>,
}

impl PrimPaths {
    /// With room for so many.
    pub(super) fn with_room(paths: usize) -> PrimPaths {
        PrimPaths { given: HashSet::with_capacity(paths), ..PrimPaths::default() }
    }

    pub(super) fn claim(&mut self, wanted: &str) -> Arc<str> {
        let mut free: Arc<str> = wanted.into();
        if self.given.contains(wanted) {
            let number = self.tried.entry(free.clone()).or_insert(1);
            while self.given.contains(&free) {
                *number += 1;
                free = format!("{wanted}_{number}").into();
            }
        }
        self.given.insert(free.clone());
        free
    }
}

/// One component of a path: the name without what would break the path, or the spare if empty.
pub(super) fn component(name: &str, spare: impl FnOnce() -> String) -> String {
    let clean: String = name
        .trim()
        .chars()
        .map(|c| if c == '/' || c.is_control() { '_' } else { c })
        .take(LONGEST_NAME)
        .collect();
    if clean.is_empty() { spare() } else { clean }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_unique() {
        let mut paths = PrimPaths::default();
        let given: Vec<_> = ["/a", "/a", "/a_2", "/a"].map(|p| paths.claim(p)).into();
        assert_eq!(given, ["/a", "/a_2", "/a_2_2", "/a_3"].map(Arc::from));
    }

    #[test]
    fn names_cannot_break_a_path() {
        assert_eq!(component("a/b\n", String::new), "a_b");
        assert_eq!(component("  ", || "node_1".into()), "node_1");
        assert_eq!(component(&"x".repeat(1000), String::new).len(), LONGEST_NAME);
    }
}
