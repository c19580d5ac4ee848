//! Which light to sample at a receiver: the strategies, side by side.
//!
//! All answer the same two questions, pick one and tell the probability of a given one, so the
//! integrator cannot tell them apart and a picture has the same mean under each.

use super::settings::LightStrategy;
use crate::emitter::InfiniteLight;
use crate::light_tree::{FrameTree, Receiver};
use crate::math::random::widen;

/// A light that can be sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// An emitter of the tree, by number.
    Emitter(u32),
    /// A light at infinity, by row.
    Infinite(u32),
}

/// A light, picked.
#[derive(Clone, Copy, Debug)]
pub struct LightPick {
    /// Which.
    pub target: Target,
    /// With what probability; positive.
    pub probability: f64,
}

/// Picks lights for one frame.
pub struct LightPicker<'a> {
    strategy: LightStrategy,
    tree: FrameTree<'a>,
    infinite: &'a [InfiniteLight<'a>],
    emitter_count: usize,
    /// Running sums of energy over emitters, then lights at infinity; only for the power strategy.
    running_power: Vec<f64>,
}

impl<'a> LightPicker<'a> {
    /// A picker over the tree's emitters and the lights at infinity.
    pub fn new(
        strategy: LightStrategy,
        tree: FrameTree<'a>,
        emitter_count: usize,
        infinite: &'a [InfiniteLight<'a>],
    ) -> LightPicker<'a> {
        let running_power = if strategy == LightStrategy::Power {
            running_power(&tree, emitter_count, infinite)
        } else {
            Vec::new()
        };
        LightPicker { strategy, tree, infinite, emitter_count, running_power }
    }

    /// Picks a light with a random number in `[0, 1)`; `None` where no light can arrive.
    pub fn pick(&self, receiver: &Receiver, u: f32) -> Option<LightPick> {
        let u = widen(u, receiver.point.x.to_bits() ^ receiver.point.z.to_bits());
        match self.strategy {
            LightStrategy::Uniform => {
                let count = self.emitter_count + self.infinite.len();
                let at = ((u * count as f64) as usize).min(count.checked_sub(1)?);
                Some(LightPick { target: self.target(at), probability: 1.0 / count as f64 })
            }
            LightStrategy::Power => {
                let total = *self.running_power.last()?;
                let at = self.running_power.partition_point(|&end| end <= u * total);
                let target = self.target(at.min(self.running_power.len() - 1));
                let probability = self.probability(receiver, target);
                (probability > 0.0).then_some(LightPick { target, probability })
            }
            LightStrategy::Tree => self.pick_infinite_or(
                receiver,
                u,
                || self.tree.total_importance(receiver),
                |u| {
                    let pick = self.tree.sample(receiver, u)?;
                    let target = Target::Emitter(pick.emitter);
                    Some(LightPick { target, probability: pick.probability })
                },
            ),
            LightStrategy::Exhaustive => {
                let total = self.sum_of_importances(receiver);
                self.pick_infinite_or(
                    receiver,
                    u,
                    || total,
                    |u| {
                        let mut left = u * total;
                        let mut picked = None;
                        self.tree.for_each_leaf(|emitter, node| {
                            let importance = node.importance(receiver);
                            if importance > 0.0 && left >= 0.0 {
                                picked = Some((emitter, importance));
                                left -= importance;
                            }
                        });
                        let (emitter, importance) = picked?;
                        let probability = importance / total;
                        Some(LightPick { target: Target::Emitter(emitter), probability })
                    },
                )
            }
        }
    }

    /// The probability with which [`pick`](Self::pick) picks a light for a receiver.
    pub fn probability(&self, receiver: &Receiver, target: Target) -> f64 {
        let index = match target {
            Target::Emitter(emitter) => emitter as usize,
            Target::Infinite(row) => self.emitter_count + row as usize,
        };
        match self.strategy {
            LightStrategy::Uniform => 1.0 / (self.emitter_count + self.infinite.len()) as f64,
            LightStrategy::Power => {
                let before = if index == 0 { 0.0 } else { self.running_power[index - 1] };
                let total = self.running_power.last().copied().unwrap_or(0.0);
                if total > 0.0 { (self.running_power[index] - before) / total } else { 0.0 }
            }
            LightStrategy::Tree => self.share(
                receiver,
                target,
                || self.tree.total_importance(receiver),
                |emitter| self.tree.probability(receiver, emitter),
            ),
            LightStrategy::Exhaustive => {
                let total = self.sum_of_importances(receiver);
                self.share(
                    receiver,
                    target,
                    || total,
                    |wanted| {
                        let mut found = 0.0;
                        self.tree.for_each_leaf(|emitter, node| {
                            if emitter == wanted {
                                found = node.importance(receiver) / total;
                            }
                        });
                        found
                    },
                )
            }
        }
    }

    fn target(&self, at: usize) -> Target {
        match at.checked_sub(self.emitter_count) {
            Some(row) => Target::Infinite(row as u32),
            None => Target::Emitter(at as u32),
        }
    }

    /// Lights at infinity compete with the tree's root, each by its estimated irradiance.
    fn pick_infinite_or(
        &self,
        receiver: &Receiver,
        u: f64,
        of_tree: impl FnOnce() -> f64,
        pick_in_tree: impl FnOnce(f64) -> Option<LightPick>,
    ) -> Option<LightPick> {
        if self.infinite.is_empty() {
            return pick_in_tree(u);
        }
        let of_tree = of_tree();
        let total = of_tree + self.infinite_importance(receiver);
        let mut left = u * total;
        for (row, light) in self.infinite.iter().enumerate() {
            let importance = light.importance(receiver.normal);
            if left < importance {
                let target = Target::Infinite(row as u32);
                return Some(LightPick { target, probability: importance / total });
            }
            left -= importance;
        }
        if of_tree <= 0.0 {
            return None;
        }
        let rest = (left / of_tree).clamp(0.0, 1.0 - f64::EPSILON / 2.0);
        let pick = pick_in_tree(rest)?;
        Some(LightPick { probability: pick.probability * of_tree / total, ..pick })
    }

    /// The probability that belongs to [`pick_infinite_or`](Self::pick_infinite_or).
    fn share(
        &self,
        receiver: &Receiver,
        target: Target,
        of_tree: impl FnOnce() -> f64,
        in_tree: impl FnOnce(u32) -> f64,
    ) -> f64 {
        let chance = |part: f64, whole: f64| if part > 0.0 { part / whole } else { 0.0 };
        match target {
            Target::Emitter(emitter) if self.infinite.is_empty() => in_tree(emitter),
            Target::Emitter(emitter) => {
                let of_tree = of_tree();
                let total = of_tree + self.infinite_importance(receiver);
                in_tree(emitter) * chance(of_tree, total)
            }
            Target::Infinite(row) => {
                let importance = self.infinite[row as usize].importance(receiver.normal);
                chance(importance, of_tree() + self.infinite_importance(receiver))
            }
        }
    }

    fn infinite_importance(&self, receiver: &Receiver) -> f64 {
        self.infinite.iter().map(|light| light.importance(receiver.normal)).sum()
    }

    fn sum_of_importances(&self, receiver: &Receiver) -> f64 {
        let mut sum = 0.0;
        self.tree.for_each_leaf(|_, node| sum += node.importance(receiver));
        sum
    }
}

/// Energies in the emitters' order, then those of the lights at infinity, summed up. A light at
/// infinity counts as the point light that gives its irradiance at the tree's radius.
fn running_power(tree: &FrameTree, emitters: usize, infinite: &[InfiniteLight]) -> Vec<f64> {
    let mut power = vec![0.0; emitters];
    tree.for_each_leaf(|emitter, node| power[emitter as usize] = f64::from(node.energy()));
    let radius2 = tree.root().map_or(1.0, |root| f64::from(root.half_extent().length_squared()));
    let radius2 = if radius2 > 0.0 { radius2 } else { 1.0 };
    power.extend(infinite.iter().map(|light| light.importance(glam::Vec3::ZERO) * radius2));
    let mut sum = 0.0;
    for entry in &mut power {
        sum += *entry;
        *entry = sum;
    }
    power
}
