//! Prim paths, each given once.

use std::collections::HashMap;

/// A name longer than this is cut: paths repeat the names of all ancestors.
const LONGEST_NAME: usize = 128;

/// Gives out paths; one that is taken gets a number: `/World/lamp`, `/World/lamp_2`.
#[derive(Default)]
pub(super) struct PrimPaths {
    /// Every path given, with the last number that was tried after it.
    given: HashMap<String, u32>,
}

impl PrimPaths {
    pub(super) fn claim(&mut self, wanted: String) -> String {
        if !self.given.contains_key(&wanted) {
            self.given.insert(wanted.clone(), 1);
            return wanted;
        }
        let mut number = self.given[&wanted];
        let free = loop {
            number += 1;
            let numbered = format!("{wanted}_{number}");
            if !self.given.contains_key(&numbered) {
                break numbered;
            }
        };
        self.given.insert(wanted, number);
        self.given.insert(free.clone(), 1);
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
        let given: Vec<_> = ["/a", "/a", "/a_2", "/a"].map(|p| paths.claim(p.into())).into();
        assert_eq!(given, ["/a", "/a_2", "/a_2_2", "/a_3"]);
    }

    #[test]
    fn names_cannot_break_a_path() {
        assert_eq!(component("a/b\n", String::new), "a_b");
        assert_eq!(component("  ", || "node_1".into()), "node_1");
        assert_eq!(component(&"x".repeat(1000), String::new).len(), LONGEST_NAME);
    }
}
