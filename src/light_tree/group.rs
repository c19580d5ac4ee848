//! A group: the eight children of a cluster, side by side in four cache lines.
//!
//! A step down the tree chooses among eight clusters at once. Compared with a binary tree, this takes
//! fewer steps of the same latency each. It chooses better, because no estimate of an intermediate
//! cluster blurs the choice. And the file is smaller, because there are no intermediate clusters.
//! Each field is an array over the lanes, as vector instructions need it.

use super::importance::{Cluster, Sight, importance};
use super::node::{self, Link, Node};
use super::viewer::Viewer;
use super::wide;
use crate::bounds::LightBounds;
use crate::math::built_in;
use bytemuck::{Pod, Zeroable};

/// Children of a cluster.
pub const WIDTH: usize = 8;

/// Up to eight siblings. A lane that is not used is all zero. The layout is in the
/// [format](crate::store).
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Group {
    center: [[f32; WIDTH]; 3],
    energy: [f32; WIDTH],
    half_extent: [[u8; WIDTH]; 3],
    half_exponent: [u8; WIDTH],
    axis: [[i16; WIDTH]; 2],
    theta_o: [u16; WIDTH],
    theta_e: [u8; WIDTH],
    range: [u8; WIDTH],
    link: [u32; WIDTH],
}

/// All lanes, decoded field by field: each loop is one kind of conversion.
pub(super) struct Lanes {
    center: [[f32; WIDTH]; 3],
    half_extent: [[f32; WIDTH]; 3],
    axis: [[f32; WIDTH]; 3],
    sin_half_theta_o: [f32; WIDTH],
    cos_theta_e: [f32; WIDTH],
    /// Nonzero if it is.
    two_sided: [u32; WIDTH],
    inverse_range2: [f32; WIDTH],
}

impl Group {
    /// One lane as a node; `None` if it is not used.
    pub fn node(&self, lane: usize) -> Option<Node> {
        (self.link[lane] != 0).then(|| self.lane(lane))
    }

    fn lane(&self, lane: usize) -> Node {
        Node {
            center: self.center.map(|axis| axis[lane]),
            energy: self.energy[lane],
            half_extent: self.half_extent.map(|axis| axis[lane]),
            half_exponent: self.half_exponent[lane],
            axis: self.axis.map(|part| part[lane]),
            theta_o: self.theta_o[lane],
            theta_e: self.theta_e[lane],
            range: self.range[lane],
            link: self.link[lane],
        }
    }

    /// The nodes of the lanes that are used.
    pub fn nodes(&self) -> impl Iterator<Item = Node> + '_ {
        (0..WIDTH).filter_map(|lane| self.node(lane))
    }

    /// The bounds around all lanes, as the nodes store them: rounded outwards.
    ///
    /// # Panics
    /// If no lane is used.
    pub(super) fn bounds(&self) -> LightBounds {
        let rounded: Vec<LightBounds> = self.nodes().map(|node| node.bounds()).collect();
        LightBounds::around(&rounded)
    }

    /// A lane, decoded for the importance.
    #[inline]
    pub(super) fn cluster(&self, lane: usize) -> Cluster {
        self.lane(lane).cluster()
    }

    /// Fills a lane.
    pub(super) fn set(&mut self, lane: usize, node: &Node) {
        for axis in 0..3 {
            self.center[axis][lane] = node.center[axis];
            self.half_extent[axis][lane] = node.half_extent[axis];
        }
        self.energy[lane] = node.energy;
        self.half_exponent[lane] = node.half_exponent;
        self.axis[0][lane] = node.axis[0];
        self.axis[1][lane] = node.axis[1];
        self.theta_o[lane] = node.theta_o;
        self.theta_e[lane] = node.theta_e;
        self.range[lane] = node.range;
        self.link[lane] = node.link;
    }

    pub(super) fn set_link(&mut self, lane: usize, link: Link) {
        self.link[lane] = link.encode();
    }

    /// Where a lane leads.
    #[inline]
    pub fn link(&self, lane: usize) -> Link {
        Link::decode(self.link[lane])
    }

    #[inline]
    pub(super) fn energy(&self, lane: usize) -> f32 {
        self.energy[lane]
    }

    /// Whether an unused lane holds anything but zeros.
    pub(super) fn has_dirty_lane(&self) -> bool {
        let mut unused = (0..WIDTH).filter(|&lane| self.link[lane] == 0);
        unused.any(|lane| bytemuck::bytes_of(&self.lane(lane)) != [0; size_of::<Node>()])
    }

    /// Whether every lane that is used sends light in every direction.
    #[inline(always)]
    fn is_round(&self) -> bool {
        let of = |lane| node::is_round(self.theta_o[lane]) | (self.link[lane] == 0);
        (0..WIDTH).fold(true, |all, lane| all & of(lane))
    }

    #[inline(always)]
    fn decode<const ENDLESS: bool>(&self) -> Lanes {
        let half_extent = |axis: usize| {
            each(|lane| {
                f32::from(self.half_extent[axis][lane]) * node::scale(self.half_exponent[lane])
            })
        };
        let [mut x, mut y, mut z] = [[0.0; WIDTH]; 3];
        for (lane, (&i, &j)) in self.axis[0].iter().zip(&self.axis[1]).enumerate() {
            [x[lane], y[lane], z[lane]] = node::decode_axis([i, j]);
        }
        Lanes {
            center: self.center,
            half_extent: [half_extent(0), half_extent(1), half_extent(2)],
            axis: [x, y, z],
            sin_half_theta_o: each(|lane| node::decode_sin_half_theta_o(self.theta_o[lane])),
            cos_theta_e: each(|lane| node::decode_cos_theta_e(self.theta_e[lane])),
            two_sided: each(|lane| u32::from(node::is_two_sided(self.theta_o[lane]))),
            inverse_range2: if ENDLESS {
                [0.0; WIDTH]
            } else {
                each(|lane| node::decode_inverse_range2(self.range[lane]))
            },
        }
    }
}

/// One value for each lane, by a plain loop: the compiler does not vectorise `array::from_fn`.
#[inline(always)]
fn each<T: Copy + Default>(of: impl Fn(usize) -> T) -> [T; WIDTH] {
    let mut all = [T::default(); WIDTH];
    for (lane, one) in all.iter_mut().enumerate() {
        *one = of(lane);
    }
    all
}

impl Group {
    /// The importance of each lane to a viewer; 0 for a lane that is not used.
    #[inline]
    pub fn importances(&self, viewer: &impl Viewer) -> [f64; WIDTH] {
        self.weigh(viewer).0
    }

    /// The importance of each lane to a viewer, and how uncertain each is.
    #[inline]
    pub(super) fn weigh(&self, viewer: &impl Viewer) -> ([f64; WIDTH], [f32; WIDTH]) {
        wide::weigh(self, viewer)
    }

    #[inline(always)]
    pub(super) fn weigh_lanes(&self, viewer: &impl Viewer) -> ([f64; WIDTH], [f32; WIDTH]) {
        // Written once and compiled thrice: few scenes have a light with a range, and half of the formula is about
        // where clusters send their light, which those of points and spheres send everywhere.
        match (!built_in::RANGE || self.range == [0; WIDTH], self.is_round()) {
            (true, true) => self.weigh_as::<true, true>(viewer),
            (true, false) => self.weigh_as::<true, false>(viewer),
            (false, _) => self.weigh_as::<false, false>(viewer),
        }
    }

    /// `ENDLESS` if no lane has a range, `ROUND` if all [are](Self::is_round).
    #[inline(always)]
    fn weigh_as<const ENDLESS: bool, const ROUND: bool>(
        &self,
        viewer: &impl Viewer,
    ) -> ([f64; WIDTH], [f32; WIDTH]) {
        // Each quantity has an array over the lanes, so that the compiler computes all lanes together.
        let (mut products, mut decays, mut spreads) = ([0.0; WIDTH], [0.0; WIDTH], [0.0; WIDTH]);
        let mut sights = Sights::default();
        let lanes = self.decode::<ENDLESS>();
        for lane in 0..WIDTH {
            let factors = viewer.factors(&lanes.cluster::<ENDLESS, ROUND>(lane));
            (products[lane], decays[lane]) = (factors.product, factors.decay);
            spreads[lane] = factors.spread;
            sights.set(lane, &factors.sight);
        }
        for lane in 0..WIDTH {
            let (reflected, unsure) = viewer.reflect(&sights.get(lane));
            products[lane] *= reflected;
            spreads[lane] += unsure;
        }
        let mut weights = [0.0; WIDTH];
        for lane in 0..WIDTH {
            weights[lane] = importance(self.energy(lane), products[lane], decays[lane]);
        }
        (weights, spreads)
    }
}

impl Lanes {
    #[inline(always)]
    fn cluster<const ENDLESS: bool, const ROUND: bool>(&self, lane: usize) -> Cluster {
        let of = |field: &[[f32; WIDTH]; 3]| [field[0][lane], field[1][lane], field[2][lane]];
        Cluster {
            center: of(&self.center),
            half_extent: of(&self.half_extent),
            axis: of(&self.axis),
            // A constant tells the compiler what can be left out.
            sin_half_theta_o: if ROUND { 1.0 } else { self.sin_half_theta_o[lane] },
            cos_theta_e: self.cos_theta_e[lane],
            two_sided: self.two_sided[lane] != 0,
            inverse_range2: if ENDLESS { 0.0 } else { self.inverse_range2[lane] },
        }
    }
}

/// Eight sights, lane by lane.
#[derive(Default)]
struct Sights {
    to: [[f32; WIDTH]; 3],
    cosine: [f32; WIDTH],
    cos_u: [f32; WIDTH],
    sin_u: [f32; WIDTH],
}

impl Sights {
    #[inline(always)]
    fn set(&mut self, lane: usize, sight: &Sight) {
        for (part, to) in self.to.iter_mut().zip(sight.to) {
            part[lane] = to;
        }
        self.cosine[lane] = sight.cosine;
        (self.cos_u[lane], self.sin_u[lane]) = (sight.cos_u, sight.sin_u);
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Sight {
        Sight {
            to: [self.to[0][lane], self.to[1][lane], self.to[2][lane]],
            cosine: self.cosine[lane],
            cos_u: self.cos_u[lane],
            sin_u: self.sin_u[lane],
        }
    }
}
