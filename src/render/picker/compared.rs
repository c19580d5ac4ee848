//! The strategies that the tree is compared with: every light alike, by power, or by weighing them all.

use super::{LightPick, LightPicker, Wanted};
use crate::emitter::InfiniteLight;
use crate::light_tree::{FrameTree, Picked, Receiver};
use glam::Vec3;

impl LightPicker<'_> {
    /// Number of lights that are not forced.
    pub fn count(&self) -> u32 {
        self.tree.unforced_count()
            + self.infinite.iter().filter(|light| !light.forced).count() as u32
    }

    /// An unforced light by number: emitters come first, then infinite lights.
    pub(super) fn light(&self, at: u32) -> Picked {
        match at.checked_sub(self.tree.unforced_count()) {
            None => Picked::Emitter(at),
            Some(at) => {
                let mut unforced = (0..).zip(self.infinite).filter(|(_, light)| !light.forced);
                Picked::Beside(unforced.nth(at as usize).map_or(0, |(row, _)| row))
            }
        }
    }

    /// Picks with probabilities that are the same for every viewer; nothing, if the light does not light it.
    pub(super) fn pick_blindly(&self, wanted: &Wanted, u: f64, mut visit: impl FnMut(LightPick)) {
        let Some(last) = self.count().checked_sub(1) else { return };
        let at = match self.running_power.last() {
            Some(total) => self.running_power.partition_point(|&end| end <= u * total) as u32,
            None => (u * f64::from(self.count())) as u32,
        };
        let light = self.light(at.min(last));
        let probability = self.blind_probability(light);
        if probability > 0.0 && self.lights(wanted, light) {
            visit(LightPick { light, probability, expected: probability, weighed: 0 });
        }
    }

    /// The probability of a light that is the same for every viewer: by power or uniform.
    pub fn blind_probability(&self, light: Picked) -> f64 {
        match self.running_power.is_empty() {
            true => 1.0 / f64::from(self.count()),
            false => self.share_of_power(light),
        }
    }

    fn share_of_power(&self, light: Picked) -> f64 {
        let index = match light {
            Picked::Emitter(emitter) => emitter as usize,
            Picked::Beside(row) => {
                let unforced = self.infinite[..row as usize].iter().filter(|light| !light.forced);
                self.tree.unforced_count() as usize + unforced.count()
            }
        };
        let before = if index == 0 { 0.0 } else { self.running_power[index - 1] };
        let total = self.running_power.last().copied().unwrap_or(0.0);
        if total > 0.0 { (self.running_power[index] - before) / total } else { 0.0 }
    }

    pub(super) fn pick_exhaustively(
        &self,
        wanted: &Wanted,
        u: f64,
        mut visit: impl FnMut(LightPick),
    ) {
        let mut total = 0.0;
        self.for_each_importance(wanted, |_, importance| total += importance);
        let (mut left, mut picked) = (u * total, None);
        self.for_each_importance(wanted, |light, importance| {
            if importance > 0.0 && left >= 0.0 {
                picked = Some((light, importance));
                left -= importance;
            }
        });
        if let Some((light, importance)) = picked {
            let probability = importance / total;
            visit(LightPick { light, probability, expected: probability, weighed: 0 });
        }
    }

    pub(super) fn exhaustive_probability(&self, wanted: &Wanted, light: Picked) -> f64 {
        let (mut total, mut found) = (0.0, 0.0);
        self.for_each_importance(wanted, |other, importance| {
            total += importance;
            found = if other == light { importance } else { found };
        });
        if found > 0.0 { found / total } else { 0.0 }
    }
}

/// Energies in the emitters' order, then those of the lights at infinity, summed up. A light at
/// infinity counts as the point light that gives its irradiance at the tree's radius.
pub(super) fn running_power(tree: &FrameTree, infinite: &[InfiniteLight]) -> Vec<f64> {
    let mut power = vec![0.0; tree.unforced_count() as usize];
    let anywhere = Receiver { point: Vec3::ZERO, normal: Vec3::ZERO };
    tree.for_each_leaf(&anywhere, |emitter, _, energy| power[emitter as usize] = energy);
    let radius2 = tree.root().map_or(1.0, |root| f64::from(root.half_extent().length_squared()));
    let radius2 = if radius2 > 0.0 { radius2 } else { 1.0 };
    let unforced = infinite.iter().filter(|light| !light.forced);
    power.extend(unforced.map(|light| light.importance(Vec3::ZERO) * radius2));
    let mut sum = 0.0;
    for entry in &mut power {
        sum += *entry;
        *entry = sum;
    }
    power
}
