//! Which lights to sample for a viewer: all strategies behind one interface.
//!
//! Every strategy does two things: it picks lights, and it tells how often a given light is expected to
//! be picked. So the integrator cannot tell strategies apart, and a picture has the same mean under each.
//! Forced lights bypass the strategy: each is always sampled.

mod compared;

use super::knob::Knobs;
use super::links::FrameLinks;
use super::settings::{LightStrategy, RenderSettings};
use crate::emitter::InfiniteLight;
use crate::light_tree::{
    Cell, DistanceOnly, FrameTree, Glossy, Linked, Moments, Pick, Picked, Receiver, ReceiverClass,
    Scratch, Segment, SplitTest, Splitting, Veiled, Viewer,
};
use crate::math::built_in;
use crate::math::random::{hash, widen};
use compared::running_power;
use glam::Vec3;
use std::sync::Arc;

/// A light, picked.
#[derive(Clone, Copy, Debug)]
pub struct LightPick {
    /// An emitter by number, or a light at infinity by row.
    pub light: Picked,
    /// What its contribution is divided by; positive.
    pub probability: f64,
    /// Expected number of picks, which enters the power heuristic; positive.
    pub expected: f64,
    /// Groups that were weighed to find it below its cluster.
    pub weighed: u32,
}

/// What light is wanted for, and what is known of it.
#[derive(Clone, Copy, Debug)]
pub struct Wanted {
    /// What for.
    pub site: Site,
    /// The cell that tells what is hidden from there; [`Cell::NONE`] if nothing is known.
    pub cell: Cell,
    /// The class that tells which lights light it.
    pub class: ReceiverClass,
}

/// What light is wanted for.
#[derive(Clone, Copy, Debug)]
pub enum Site {
    /// A point of a surface.
    At(Receiver),
    /// The same, and how it reflects.
    Glossy(Glossy),
    /// A stretch of a ray in a medium, with the length over which it transmits light.
    Along(Segment, f32),
}

/// Buffers for picking, to be reused.
#[derive(Debug, Default)]
pub struct PickScratch {
    beside: Vec<f64>,
    tree: TreeScratch,
}

#[derive(Debug, Default)]
struct TreeScratch {
    at: Room<Receiver>,
    glossy: Room<Glossy>,
    along: Room<Segment>,
    distance_at: Room<DistanceOnly<Receiver>>,
    distance_along: Room<DistanceOnly<Segment>>,
}

/// Buffers for viewers of a kind: those that all lights light, and the others.
#[derive(Debug)]
struct Room<V> {
    plain: Scratch<Veiled<V>>,
    linked: Scratch<Linked<Veiled<V>>>,
}

impl<V> Default for Room<V> {
    fn default() -> Self {
        Room { plain: Scratch::default(), linked: Scratch::default() }
    }
}

impl<V> Room<V> {
    fn weighed(&self) -> u64 {
        self.plain.weighed + self.linked.weighed
    }
}

/// Evaluates an expression with the viewer that something is wanted for, and its room in the scratch.
macro_rules! with_viewer {
    ($picker:expr, $wanted:expr, $scratch:expr, |$viewer:ident, $room:ident| $body:expr) => {{
        let scratch: &mut TreeScratch = $scratch;
        let by_distance = $picker.strategy == LightStrategy::Distance;
        let Wanted { site, cell, class } = *$wanted;
        // A receiver that every light lights skips links.
        macro_rules! with {
            ($one:expr, $of_kind:expr) => {{
                let (viewer, room) = (Veiled { viewer: $one, cell }, $of_kind);
                if class == ReceiverClass::ALL {
                    let ($viewer, $room) = (&viewer, &mut room.plain);
                    $body
                } else {
                    let ($viewer, $room) = (&Linked { viewer, class }, &mut room.linked);
                    $body
                }
            }};
        }
        match site {
            Site::At(receiver) | Site::Glossy(Glossy { receiver, .. }) if by_distance => {
                let viewer = DistanceOnly(Receiver { normal: Vec3::ZERO, ..receiver });
                with!(viewer, &mut scratch.distance_at)
            }
            Site::Along(segment, _) if by_distance => {
                with!(DistanceOnly(segment), &mut scratch.distance_along)
            }
            Site::At(viewer) => with!(viewer, &mut scratch.at),
            Site::Glossy(viewer) => with!(viewer, &mut scratch.glossy),
            Site::Along(viewer, _) => with!(viewer, &mut scratch.along),
        }
    }};
}

/// Picks lights for one frame.
#[derive(Clone)]
pub struct LightPicker<'a> {
    strategy: LightStrategy,
    /// Of a path's points, by how many bounces lie before them; the last is that of all later ones.
    splitting: [Splitting; Knobs::KINDS],
    tree: FrameTree<'a>,
    infinite: &'a [InfiniteLight<'a>],
    /// Which lights light what, if not all light everything.
    links: Option<FrameLinks<'a>>,
    /// Running sums of energy over emitters, then lights at infinity; only for the power strategy.
    running_power: Arc<[f64]>,
}

impl PickScratch {
    /// Groups weighed to open the tree, since this was made.
    pub fn weighed(&self) -> u64 {
        let TreeScratch { at, glossy, along, distance_at, distance_along } = &self.tree;
        let by_distance = distance_at.weighed() + distance_along.weighed();
        at.weighed() + glossy.weighed() + along.weighed() + by_distance
    }
}

impl<'a> LightPicker<'a> {
    /// A picker over the tree's emitters and the lights at infinity.
    pub fn new(
        settings: &RenderSettings,
        tree: FrameTree<'a>,
        infinite: &'a [InfiniteLight<'a>],
    ) -> LightPicker<'a> {
        let strategy = settings.strategy;
        let by_power = strategy == LightStrategy::Power;
        let running_power = if by_power { running_power(&tree, infinite) } else { Vec::new() };
        let running_power = running_power.into();
        let splitting = std::array::from_fn(|bounce| settings.splitting(bounce as u32));
        LightPicker { strategy, splitting, tree, infinite, links: None, running_power }
    }

    /// The same, with the links of the frame. The tree must be [of them](crate::light_tree::LightTree::at_frame_linked).
    pub fn linked(self, links: Option<FrameLinks<'a>>) -> LightPicker<'a> {
        LightPicker { links, ..self }
    }

    /// Whether a light lights what something is wanted for.
    #[inline]
    fn lights(&self, wanted: &Wanted, light: Picked) -> bool {
        !built_in::LINKS
            || self.links.as_ref().is_none_or(|links| links.lights(wanted.class, light))
    }

    /// The tree that is picked from.
    pub fn tree(&self) -> &FrameTree<'a> {
        &self.tree
    }

    /// How clusters are split for a point that a path reaches after so many bounces.
    pub fn splitting(&self, bounce: u32) -> &Splitting {
        &self.splitting[Knobs::kind(bounce)]
    }

    /// Whether more than one light may be picked at a point, so that each needs numbers of its own.
    pub fn takes_several(&self, how: &Splitting) -> bool {
        !how.is_off()
            || self.strategy == LightStrategy::All
            || self.tree.forced_count() > 0
            || self.infinite.iter().any(|light| light.forced)
    }

    /// Whether picking is by the full importance, which depends on orientation and reflection.
    pub fn looks(&self) -> bool {
        matches!(self.strategy, LightStrategy::Tree | LightStrategy::Exhaustive)
    }

    /// Whether the test of splitting asks for a direction that the surface reflects to.
    pub fn asks_for_direction(&self) -> bool {
        let asks = |how: &Splitting| !how.is_off() && how.test == SplitTest::SolidAngle;
        self.splitting.iter().any(asks)
    }

    /// Picks lights with a random number in `[0, 1)` and calls `visit` with each. `salt` identifies the
    /// point or stretch, `how` tells how clusters are split for it.
    pub fn pick(
        &self,
        wanted: &Wanted,
        how: &Splitting,
        (u, salt): (f32, u32),
        scratch: &mut PickScratch,
        mut visit: impl FnMut(LightPick),
    ) {
        let u = widen(u, salt);
        self.pick_forced(wanted, u, salt, &mut visit);
        match self.strategy {
            LightStrategy::Uniform | LightStrategy::Power => self.pick_blindly(wanted, u, visit),
            LightStrategy::All => {
                let one = |light| LightPick { light, probability: 1.0, expected: 1.0, weighed: 0 };
                let all = (0..self.count()).map(|at| self.light(at));
                all.filter(|&light| self.lights(wanted, light)).for_each(|light| visit(one(light)));
            }
            LightStrategy::Exhaustive => self.pick_exhaustively(wanted, u, visit),
            LightStrategy::Tree | LightStrategy::Distance => {
                let PickScratch { beside, tree } = scratch;
                self.weigh_infinite(wanted, beside);
                with_viewer!(self, wanted, tree, |viewer, room| {
                    self.pick_from_tree(viewer, beside, how, (u, salt), room, visit)
                });
            }
        }
    }

    /// How often [`pick`](Self::pick) is expected to pick a light.
    pub fn expected(
        &self,
        wanted: &Wanted,
        how: &Splitting,
        light: Picked,
        scratch: &mut PickScratch,
    ) -> f64 {
        match light {
            _ if !self.lights(wanted, light) => return 0.0,
            Picked::Beside(row) if self.infinite[row as usize].forced => return 1.0,
            Picked::Emitter(emitter) if emitter >= self.tree.unforced_count() => {
                return with_viewer!(self, wanted, &mut scratch.tree, |viewer, _room| {
                    self.tree.probability(viewer, emitter)
                });
            }
            _ => {}
        }
        match self.strategy {
            LightStrategy::All => 1.0,
            LightStrategy::Uniform | LightStrategy::Power => self.blind_probability(light),
            LightStrategy::Exhaustive => self.exhaustive_probability(wanted, light),
            LightStrategy::Tree | LightStrategy::Distance => {
                let PickScratch { beside, tree } = scratch;
                self.weigh_infinite(wanted, beside);
                with_viewer!(self, wanted, tree, |viewer, room| {
                    self.tree.expected(viewer, beside, how, light, room)
                })
            }
        }
    }

    /// The exact moments of an estimate by the tree, given what each light contributes.
    pub fn moments(
        &self,
        wanted: &Wanted,
        how: &Splitting,
        contribution: &impl Fn(Picked, f64) -> f64,
    ) -> Moments {
        let PickScratch { mut beside, mut tree } = PickScratch::default();
        self.weigh_infinite(wanted, &mut beside);
        with_viewer!(self, wanted, &mut tree, |viewer, _room| {
            self.tree.moments(viewer, &beside, how, contribution)
        })
    }

    fn pick_from_tree<V: Viewer>(
        &self,
        viewer: &V,
        beside: &[f64],
        how: &Splitting,
        (u, salt): (f64, u32),
        scratch: &mut Scratch<V>,
        mut visit: impl FnMut(LightPick),
    ) {
        let mut visit = |pick: Pick| {
            let Pick { light, probability, expected, weighed, .. } = pick;
            visit(LightPick { light, probability, expected, weighed });
        };
        if how.is_off() && (beside.is_empty() || !built_in::DOMES) {
            self.tree.sample(viewer, u).into_iter().for_each(visit);
        } else {
            self.tree.for_each_pick(viewer, beside, how, (u, salt), scratch, &mut visit);
        }
    }

    fn pick_forced(&self, wanted: &Wanted, u: f64, salt: u32, visit: &mut impl FnMut(LightPick)) {
        for light in 0..self.tree.forced_count() {
            let turned = u + f64::from(hash(salt, !(light as u32))) / 4_294_967_296.0;
            let u = if turned >= 1.0 { turned - 1.0 } else { turned };
            let pick = with_viewer!(self, wanted, &mut TreeScratch::default(), |viewer, _room| {
                self.tree.sample_forced(light, viewer, u)
            });
            if let Some(pick) = pick {
                let probability = pick.probability;
                let weighed = pick.weighed;
                visit(LightPick { light: pick.light, probability, expected: probability, weighed });
            }
        }
        for (row, _) in (0..).zip(self.infinite).filter(|(_, light)| light.forced) {
            let light = Picked::Beside(row);
            if !self.lights(wanted, light) {
                continue;
            }
            visit(LightPick { light, probability: 1.0, expected: 1.0, weighed: 0 });
        }
    }

    /// Calls `visit` with the importance of every light that is not forced.
    pub fn for_each_importance(&self, wanted: &Wanted, mut visit: impl FnMut(Picked, f64)) {
        with_viewer!(self, wanted, &mut TreeScratch::default(), |viewer, _room| {
            self.tree.for_each_leaf(viewer, |emitter, importance, _| {
                let light = Picked::Emitter(emitter);
                // Below the leaf of a placed tree nothing is masked.
                visit(light, if self.lights(wanted, light) { importance } else { 0.0 });
            })
        });
        for (row, light) in (0..).zip(self.infinite).filter(|(_, light)| !light.forced) {
            visit(Picked::Beside(row), self.importance_beside(row as usize, light, wanted));
        }
    }

    /// The importances of the lights at infinity, in the unit of the tree's.
    fn weigh_infinite(&self, wanted: &Wanted, importances: &mut Vec<f64>) {
        importances.clear();
        let infinite = self.infinite.iter().enumerate().filter(|_| built_in::DOMES);
        importances.extend(infinite.map(|(row, light)| match light.forced {
            true => 0.0,
            false => self.importance_beside(row, light, wanted),
        }));
    }

    fn importance_beside(&self, row: usize, light: &InfiniteLight, wanted: &Wanted) -> f64 {
        if !self.lights(wanted, Picked::Beside(row as u32)) {
            return 0.0;
        }
        importance_of(light, &wanted.site) * self.tree.weight_beside(wanted.cell, row)
    }
}

/// An estimate of the irradiance, lux; along a segment integrated over the length that transmits.
fn importance_of(light: &InfiniteLight, site: &Site) -> f64 {
    match site {
        Site::At(receiver) => light.importance(receiver.normal),
        Site::Glossy(glossy) => match light.disk() {
            _ if light.importance(glossy.receiver.normal) == 0.0 => 0.0,
            Some((towards, half_angle_rad)) => {
                let reflects = glossy.reflects_from(towards, half_angle_rad);
                light.importance(Vec3::ZERO) * f64::from(reflects)
            }
            None => light.importance(glossy.receiver.normal) * f64::from(glossy.albedo()),
        },
        Site::Along(_, length) => light.importance(Vec3::ZERO) * f64::from(*length),
    }
}
