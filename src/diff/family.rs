//! Paths that a file did not give.
//!
//! Names in a file may be equal or missing. Ingest then makes paths unique by the place of a prim in its
//! file: `/lamp`, `/lamp_2`, `/lamp_3`; `/node_7`, where there is no name. Such a path does not identify
//! a light: if the prims are reordered, their paths change. Lights whose paths differ only in these
//! numbers are a *family*.

use super::light::Light;
use std::collections::HashSet;

/// The prefixes of names that ingest makes up; a number follows.
const MADE_UP: [&str; 2] = ["node_", "object_"];

/// The families of the lights of two versions.
pub(super) struct Families<'a> {
    /// The paths of both versions, ascending.
    paths: [Vec<&'a str>; 2],
    /// The families in which at least one light has a numbered path.
    numbered: HashSet<String>,
}

impl<'a> Families<'a> {
    /// The families of two lists of lights. `rows` are the lights that it will be asked about.
    pub fn of(lists: [&[Light<'a>]; 2], rows: &[Vec<u32>; 2]) -> Families<'a> {
        let paths = lists.map(|lights| {
            let mut paths: Vec<&str> = lights.iter().map(|light| light.path).collect();
            paths.sort_unstable();
            paths
        });
        let mut families = Families { paths, numbered: HashSet::new() };
        let numbered = [0, 1].into_iter().flat_map(|side: usize| {
            let families = &families;
            rows[side].iter().filter_map(move |&row| {
                let path = lists[side][row as usize].path;
                families.without_numbers(side, path).filter(|family| family != path)
            })
        });
        families.numbered = numbered.collect();
        families
    }

    /// The family of a light of one version; `None` if its path was given by the file.
    pub fn family(&self, side: usize, path: &str) -> Option<String> {
        self.without_numbers(side, path).filter(|family| self.numbered.contains(family))
    }

    /// The path without the numbers that ingest may have added; `None` if it has no component.
    fn without_numbers(&self, side: usize, path: &str) -> Option<String> {
        let mut family = String::with_capacity(path.len());
        let mut begin = 0;
        for component in path.strip_prefix('/')?.split('/') {
            let above = &path[..begin];
            begin += 1 + component.len();
            family.push('/');
            family.push_str(match component.rsplit_once('_') {
                Some((_, number)) if !is_number(number) => component,
                Some((name, _)) if MADE_UP.contains(&&component[..name.len() + 1]) => name,
                Some((name, _)) if self.is_there(side, &format!("{above}/{name}")) => name,
                _ => component,
            });
        }
        Some(family)
    }

    /// Whether a light of a version has this path, or one below it.
    fn is_there(&self, side: usize, path: &str) -> bool {
        let paths = &self.paths[side];
        let from = paths.partition_point(|other| *other < path);
        let equal = paths.get(from).is_some_and(|other| *other == path);
        let below = format!("{path}/");
        let from = paths.partition_point(|other| *other < below.as_str());
        equal || paths.get(from).is_some_and(|other| other.starts_with(&below))
    }
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|digit| digit.is_ascii_digit())
}
