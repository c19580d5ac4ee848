//! How far a tree is from what it promises.

use crate::support::{Tree, can_light, dead_probability, nodes, tree_over};
use candelabra::bounds::LightBounds;
use candelabra::light_tree::{FrameTree, Receiver, Scratch, Splitting};
use candelabra::math::random::hash;

/// Numbers drawn at each receiver, an even grid.
const DRAWS: u32 = 1 << 14;
/// At most so many lights are held against what could light a receiver.
const LIT_TRIED: usize = 4096;

/// The worst found over some receivers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Worst {
    pub lights: usize,
    /// Groups from the root to the deepest leaf.
    pub depth: usize,
    /// Off one: the sum of all probabilities and of the probability of nothing.
    pub sum: f64,
    /// Off one: what a pick says of itself over what is told of its light, split or not.
    pub told: f64,
    /// How many picks of an even grid a light is off its probability. Up to 1 is exact.
    pub frequency: f64,
    /// Lights called dark that could light the receiver.
    pub dark: usize,
    /// Picks above the cap.
    pub beyond_cap: usize,
}

impl Worst {
    /// Over some lights, for some receivers.
    pub fn of(bounds: &[LightBounds], receivers: &[Receiver]) -> Worst {
        let tree = tree_over(bounds);
        assert_eq!(tree.verify(), Ok(()));
        let frame = tree.at_frame(0).unwrap();
        let depth = 1 + nodes(&tree).into_iter().map(|(_, depth)| depth).max().unwrap();
        let mut worst = Worst { lights: bounds.len(), depth, ..Worst::default() };
        for receiver in receivers {
            worst.add_probabilities(&tree, &frame, bounds, receiver);
            worst.add_splitting(&frame, receiver);
        }
        worst
    }

    /// That nothing is worse than rounding in double precision explains.
    pub fn assert_exact(&self) {
        assert!(self.sum < 1e-9 && self.told < 1e-12, "{self:?}");
        assert!(self.frequency <= 1.0 + 1e-6, "{self:?}");
        assert!(self.dark == 0 && self.beyond_cap == 0, "{self:?}");
    }

    fn add_probabilities(
        &mut self,
        tree: &Tree,
        frame: &FrameTree,
        bounds: &[LightBounds],
        receiver: &Receiver,
    ) {
        let all = 0..bounds.len() as u32;
        let shares: Vec<f64> = all.map(|e| frame.probability(receiver, e)).collect();
        let sum = shares.iter().sum::<f64>() + dead_probability(tree, receiver);
        self.sum = self.sum.max((sum - 1.0).abs());
        let mut counts = vec![0u32; bounds.len()];
        for i in 0..DRAWS {
            let u = (f64::from(i) + 0.5) / f64::from(DRAWS);
            let Some(pick) = frame.sample(receiver, u) else { continue };
            let emitter = pick.light.emitter().unwrap() as usize;
            counts[emitter] += 1;
            self.told = self.told.max((pick.probability / shares[emitter] - 1.0).abs());
        }
        for (count, share) in counts.iter().zip(&shares) {
            let off = (f64::from(*count) - share * f64::from(DRAWS)).abs();
            self.frequency = self.frequency.max(off);
        }
        let tried = shares.iter().zip(bounds).step_by(bounds.len().div_ceil(LIT_TRIED));
        self.dark += tried.filter(|(share, b)| **share == 0.0 && can_light(b, receiver)).count();
    }

    fn add_splitting(&mut self, frame: &FrameTree, receiver: &Receiver) {
        let mut scratch = Scratch::default();
        for i in 0..64 {
            let how = Splitting {
                knob: [0.2, 0.7, 1.0][i as usize % 3],
                most: [1, 7, 40][i as usize / 3 % 3],
                ..Splitting::NONE
            };
            let u = f64::from(hash(i, 3)) / 4_294_967_296.0;
            let mut count = 0;
            let mut picks = Vec::new();
            let random = (u, i);
            frame.for_each_pick(receiver, &[1.0], &how, random, &mut scratch, |p| picks.push(p));
            for pick in picks {
                let told = frame.expected(receiver, &[1.0], &how, pick.light, &mut scratch);
                self.told = self.told.max((pick.expected / told - 1.0).abs());
                count += 1usize;
            }
            self.beyond_cap = self.beyond_cap.max(count.saturating_sub(how.most as usize));
        }
    }
}
