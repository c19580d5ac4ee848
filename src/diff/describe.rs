//! Both versions described from like sources, so that nothing differs but what changed.

use super::Mark;
use super::light::{Described, Light};
use super::pairs::Half;
use super::scene_side::SceneSide;
use super::tree_side::Places;
use crate::light_tree::LightTree;

/// Describes lights of either version: from the scenes if both are, else from both trees.
pub(super) enum Describer<'a> {
    Scenes([&'a SceneSide<'a>; 2]),
    Trees([Places<'a, &'a [u8]>; 2]),
}

impl<'a> Describer<'a> {
    pub fn new(
        scenes: Option<[&'a SceneSide<'a>; 2]>,
        trees: [&'a LightTree<&'a [u8]>; 2],
    ) -> Describer<'a> {
        match scenes {
            Some(scenes) => Describer::Scenes(scenes),
            None => Describer::Trees(trees.map(Places::find)),
        }
    }

    /// Half a pair; `side` is 0 before and 1 after.
    pub fn describe(&self, side: usize, half: &Half) -> Described {
        match (half, self) {
            (Half::Lit(light), Describer::Scenes(scenes)) => scenes[side].describe(light),
            (Half::Lit(light), Describer::Trees(places)) => places[side].describe(light),
            (Half::Dark(path, dark), Describer::Scenes(scenes)) => {
                scenes[side].describe_dark(path, *dark)
            }
            (Half::Dark(..), Describer::Trees(_)) => unreachable!("a tree knows no dark prims"),
        }
    }

    /// Where a light of the version after is.
    pub fn mark(&self, light: &Light) -> Option<Mark> {
        let card = self.describe(1, &Half::Lit(*light)).card;
        Some(Mark { center_m: card.place?.center_m, energy_cd: card.energy })
    }
}
