//! Light groups: which lights' contribution goes to which layer.
//!
//! A light is in the group of the first [`LightGroupRule`] that names it, else in the one that the
//! scene gives it ([`Scene::light_groups`]), else in [`DEFAULT`]. Every light is in exactly one, so the
//! groups sum to the beauty.

use crate::emitter::{Emitters, InfiniteLight, LightSource};
use crate::scene::Scene;
use serde::Serialize;
use std::collections::BTreeMap;
use std::str::FromStr;
use thiserror::Error;

/// The group of lights that are in no other (Arnold's name for it).
pub const DEFAULT: &str = "default";
/// More layers than this are refused: each is a picture of its own.
const MOST_GROUPS: usize = 256;
/// OpenEXR's names of channels end after 255 characters.
const LONGEST_NAME: usize = 200;

/// `NAME=PATTERN`: the lights at prim paths that match, and below them, are in group NAME. In a
/// pattern, `*` stands for any characters and `?` for one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LightGroupRule {
    /// The group.
    pub name: String,
    /// Which paths.
    pub pattern: String,
}

/// Why lights cannot be grouped.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LightGroupError {
    /// A rule that is none.
    #[error(
        "'{0}' is not NAME=PATTERN; write key=/World/Lamps/key*, with a name of letters, digits, _ and -"
    )]
    Syntax(String),
    /// A pattern that no light matches.
    #[error(
        "no light matches '{pattern}' of light group '{name}'; `candelabra inspect` lists lights by \
         their paths, and * stands for any characters"
    )]
    NoLight {
        /// The group.
        name: String,
        /// The pattern.
        pattern: String,
    },
    /// More groups than anyone composites.
    #[error(
        "there are {0} light groups, and at most {MOST_GROUPS} are written; give fewer, or put lights \
         together with --light-group NAME=PATTERN"
    )]
    TooMany(usize),
}

/// The group of every light that shines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightGroups {
    names: Vec<String>,
    /// By row of [`Emitters::lights`].
    of_entry: Vec<u16>,
    /// By row of [`Scene::lights`]; those at infinity are looked up here.
    of_light: Vec<u16>,
}

impl LightGroups {
    /// Groups the lights of a scene.
    ///
    /// # Errors
    /// If a rule matches no light, or there are too many groups.
    pub fn new(
        scene: &Scene,
        emitters: &Emitters,
        rules: &[LightGroupRule],
    ) -> Result<LightGroups, LightGroupError> {
        let mut grouping = Grouping { scene, rules, is_used: vec![false; rules.len()] };
        let entries = emitters.lights().iter().map(|entry| match entry.source {
            LightSource::Mesh { instance, .. } => scene.instances[instance as usize].node,
            LightSource::Light(light) => scene.lights[light as usize].node,
        });
        let entries: Vec<String> = entries
            .zip(emitters.lights())
            .map(|(node, entry)| grouping.name_of(node, &entry.path))
            .collect();
        let infinite: Vec<Option<String>> = (0..scene.lights.len())
            .map(|row| {
                let light = &scene.lights[row];
                light
                    .kind
                    .is_infinite()
                    .then(|| grouping.name_of(light.node, scene.light_path(row)))
            })
            .collect();
        if let Some(unused) = grouping.is_used.iter().position(|is_used| !is_used) {
            let LightGroupRule { name, pattern } = rules[unused].clone();
            return Err(LightGroupError::NoLight { name, pattern });
        }
        let named = entries.iter().chain(infinite.iter().flatten()).map(String::as_str);
        // In the order of a file's channels, in whose names a dot comes behind the group's.
        let channel = |name: &str| format!("{name}.");
        let mut numbers: BTreeMap<String, u16> =
            named.chain([DEFAULT]).map(|name| (channel(name), 0)).collect();
        if numbers.len() > MOST_GROUPS {
            return Err(LightGroupError::TooMany(numbers.len()));
        }
        (0..).zip(numbers.values_mut()).for_each(|(number, own)| *own = number);
        let number = |name: &String| numbers[&channel(name)];
        Ok(LightGroups {
            names: numbers.keys().map(|name| name[..name.len() - 1].to_string()).collect(),
            of_entry: entries.iter().map(number).collect(),
            of_light: infinite.iter().map(|name| name.as_ref().map_or(0, number)).collect(),
        })
    }

    /// Names of the groups, in the order of their layers, which is that of a file's channels.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The number of an emitter's group.
    #[inline]
    pub fn of_emitter(&self, emitters: &Emitters, emitter: u32) -> usize {
        self.of_entry[emitters.get(emitter).light as usize].into()
    }

    /// The number of the group of a light at infinity.
    pub fn of_infinite(&self, light: &InfiniteLight) -> usize {
        self.of_light[light.light].into()
    }
}

/// Lights about to be grouped.
struct Grouping<'a> {
    scene: &'a Scene,
    rules: &'a [LightGroupRule],
    is_used: Vec<bool>,
}

impl Grouping<'_> {
    fn name_of(&mut self, node: u32, path: &str) -> String {
        let mut first = None;
        for (rule, is_used) in self.rules.iter().zip(&mut self.is_used) {
            if rule.matches(path) {
                *is_used = true;
                first = first.or(Some(&rule.name));
            }
        }
        if let Some(name) = first {
            return name.clone();
        }
        let parent = |&node: &u32| self.scene.nodes[node as usize].parent;
        let named = std::iter::successors(
            Some(node).filter(|_| !self.scene.light_groups.is_empty()),
            parent,
        )
        .find_map(|node| self.scene.light_groups.get(&node));
        named.map_or(DEFAULT.into(), |name| writable(name))
    }
}

impl LightGroupRule {
    /// Whether the pattern matches a path or one that it is below.
    fn matches(&self, path: &str) -> bool {
        let ends = path.char_indices().filter(|(_, c)| matches!(c, '/' | '[')).map(|(at, _)| at);
        let pattern = self.pattern.strip_suffix('/').unwrap_or(&self.pattern);
        ends.chain([path.len()]).any(|end| is_match(pattern.as_bytes(), &path.as_bytes()[..end]))
    }
}

impl FromStr for LightGroupRule {
    type Err = LightGroupError;

    fn from_str(text: &str) -> Result<LightGroupRule, LightGroupError> {
        match text.split_once('=') {
            Some((name, pattern))
                if !pattern.is_empty() && !name.is_empty() && writable(name) == name =>
            {
                Ok(LightGroupRule { name: name.into(), pattern: pattern.into() })
            }
            _ => Err(LightGroupError::Syntax(text.into())),
        }
    }
}

/// A name that can be a part of a channel's: other characters become `_`, as Blender has it.
fn writable(name: &str) -> String {
    let fits = |c: char| if c.is_ascii_alphanumeric() || "_-".contains(c) { c } else { '_' };
    name.chars().take(LONGEST_NAME).map(fits).collect()
}

/// Whether a pattern of `*`, `?` and plain bytes matches all of a text; in the product of their lengths.
fn is_match(pattern: &[u8], text: &[u8]) -> bool {
    let (mut p, mut t) = (0, 0);
    // Where the last `*` is, and how far into the text it reaches.
    let mut star: Option<(usize, usize)> = None;
    while t < text.len() {
        match pattern.get(p) {
            Some(b'*') => {
                star = Some((p, t));
                p += 1;
            }
            Some(&byte) if byte == b'?' || byte == text[t] => (p, t) = (p + 1, t + 1),
            _ => {
                let Some((at, reach)) = star else { return false };
                star = Some((at, reach + 1));
                (p, t) = (at + 1, reach + 1);
            }
        }
    }
    pattern[p..].iter().all(|&byte| byte == b'*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_match_paths_and_what_is_below() {
        for (pattern, path, expected) in [
            ("/World/Lamps", "/World/Lamps", true),
            ("/World/Lamps/", "/World/Lamps/key", true),
            ("/World/Lamps", "/World/Lamps/row/key", true),
            ("/World/Lamps", "/World/Lamps[12]", true),
            ("/World/Lamps", "/World/Lampshade", false),
            ("/World/Lamps*", "/World/Lampshade", true),
            ("*key*", "/World/Lamps/key_2", true),
            ("*/lamp_?", "/World/lamp_7/mesh", true),
            ("*/lamp_?", "/World/lamp_77", false),
            ("*", "/x", true),
            ("a*b*c", "a-b-b-c", true),
            ("a*b*c", "a-c-b", false),
            ("World", "/World", false),
        ] {
            let rule = LightGroupRule { name: "key".into(), pattern: pattern.into() };
            assert_eq!(rule.matches(path), expected, "{pattern} and {path}");
        }
    }

    #[test]
    fn rules_are_read_and_nonsense_is_refused() {
        let rule: LightGroupRule = "key=/World/a=b*".parse().unwrap();
        assert_eq!((rule.name.as_str(), rule.pattern.as_str()), ("key", "/World/a=b*"));
        for text in ["", "key", "=x", "key=", "a.b=/x", "a b=/x"] {
            let error = text.parse::<LightGroupRule>().unwrap_err();
            assert!(error.to_string().contains("NAME=PATTERN"), "{error}");
        }
        assert_eq!(writable("rim.left 2"), "rim_left_2");
    }
}
