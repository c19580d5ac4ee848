//! Describes both versions from the same kind of source, so that descriptions differ only by changes.

use super::Mark;
use super::light::{Described, Light};
use super::pairs::Half;
use super::scene_side::SceneSide;
use super::tree_side::Places;
use crate::light_tree::LightTree;
use glam::Vec3;

/// Describes lights of either version: from the scenes if both versions are scenes, else from both
/// trees. Positions are relative to the origin of the version before.
pub(super) struct Describer<'a> {
    sources: Sources<'a>,
    /// From that origin to the one of the version after.
    shift: Vec3,
}

enum Sources<'a> {
    Scenes([&'a SceneSide<'a>; 2]),
    Trees([Places<'a, &'a [u8]>; 2]),
}

impl<'a> Describer<'a> {
    pub fn new(
        scenes: Option<[&'a SceneSide<'a>; 2]>,
        trees: [&'a LightTree<&'a [u8]>; 2],
        shift: Vec3,
    ) -> Describer<'a> {
        let sources = match scenes {
            Some(scenes) => Sources::Scenes(scenes),
            None => Sources::Trees(trees.map(Places::find)),
        };
        Describer { sources, shift }
    }

    /// Half a pair; `side` is 0 before and 1 after.
    pub fn describe(&self, side: usize, half: &Half) -> Described {
        let described = match (half, &self.sources) {
            (Half::Lit(light), Sources::Scenes(scenes)) => scenes[side].describe(light),
            (Half::Lit(light), Sources::Trees(places)) => places[side].describe(light),
            (Half::Dark(path, dark), Sources::Scenes(scenes)) => {
                scenes[side].describe_dark(path, *dark)
            }
            (Half::Dark(..), Sources::Trees(_)) => unreachable!("a tree knows no dark prims"),
        };
        if side == 0 { described } else { described.shifted(self.shift) }
    }

    /// Where a light of the version after is.
    pub fn mark(&self, light: &Light) -> Option<Mark> {
        let card = self.describe(1, &Half::Lit(*light)).card;
        Some(Mark { center_m: card.place?.center_m, energy_cd: card.energy })
    }
}
