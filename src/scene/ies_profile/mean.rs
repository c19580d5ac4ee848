//! The mean of a profile over the cone of what is lit.
//!
//! It is summed over the table's own cells, so that no beam is too narrow to be seen.

use super::{IesProfile, LitCone, Pole};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Pieces of cells are no wider than this, radians.
const WIDEST: f64 = 0.1;
/// Within less than this, weights do not bend, radians.
const STRAIGHT: f64 = 0.02;
/// So near is the edge of a table met that runs through directions anyhow, radians.
const EDGE: f64 = 0.002;
/// Gauss's two points in an interval from -1 to 1, exact for cubics.
const TWO: [f64; 2] = [-0.577_350_269_189_625_8, 0.577_350_269_189_625_8];
/// The one in its middle, exact for what is linear.
const ONE: [f64; 1] = [0.0];

impl IesProfile {
    /// The mean of the factor over a cone that holds all that is lit, weighted as [`mean`](Self::mean) says.
    pub(super) fn mean_over(&self, cone: LitCone) -> f64 {
        let whole = cone.whole();
        if whole <= 0.0 {
            return 0.0;
        }
        let sum = match self.pole {
            // A scale turns the cells of a table about another axis into what no angles bound.
            Pole::Side if self.angle_scale != 0.0 => self.over_band(cone, [0.0, PI], EDGE),
            _ => self.over_cells(cone) + self.over_clamped(cone),
        };
        (sum / whole).min(f32::MAX.into())
    }

    fn over_cells(&self, cone: LitCone) -> f64 {
        let (width, planes) = (self.polar_rad.len(), self.around_rad.len());
        // About the pole every half plane weighs alike.
        let is_even = cone.axis.abs() == self.direction(0.0, 0.0).abs();
        let mut sum = 0.0;
        for plane in 0..planes.max(2) - 1 {
            let next = (plane + 1).min(planes - 1);
            let first = self.around_rad[plane];
            let turn = if planes == 1 { TAU } else { self.around_rad[next] - first };
            let columns = if is_even { 1 } else { pieces(turn) };
            let is_straight = is_even || turn / columns as f64 <= STRAIGHT;
            let across: &[f64] = if is_straight { &ONE } else { &TWO };
            for row in 0..width - 1 {
                let [low, high] = [plane, next].map(|plane| {
                    [row, row + 1].map(|row| f64::from(self.values[plane * width + row]))
                });
                if [low, high] == [[0.0; 2]; 2] {
                    continue;
                }
                let ends = [self.polar_rad[row], self.polar_rad[row + 1]];
                // Angles that were kept to `[0, pi]` may have become one.
                if ends[1] <= ends[0] {
                    continue;
                }
                let [from, to] = ends.map(|polar| self.unclamped(polar).clamp(0.0, PI));
                let rows = pieces(to - from);
                for (polar, height) in nodes([from, to], rows, &TWO) {
                    let along =
                        ((self.scaled(polar) - ends[0]) / (ends[1] - ends[0])).clamp(0.0, 1.0);
                    let [low, high] = [low, high].map(|ends| ends[0] + along * (ends[1] - ends[0]));
                    let area = height * polar.sin();
                    for (around, breadth) in nodes([0.0, turn], columns, across) {
                        let value = low + around / turn * (high - low);
                        let direction = self.direction(polar, first + around);
                        sum += value * area * breadth * cone.weight(direction);
                    }
                }
            }
        }
        sum
    }

    /// Over the directions that a scale of angles puts beyond a pole.
    fn over_clamped(&self, cone: LitCone) -> f64 {
        match self.angle_scale {
            scale if scale > 0.0 && scale < 1.0 => self.over_band(cone, [scale * PI, PI], STRAIGHT),
            scale if scale < 0.0 && scale > -1.0 => {
                self.over_band(cone, [0.0, PI + scale * PI], STRAIGHT)
            }
            _ => 0.0,
        }
    }

    /// Between two angles off the nadir, in rows no higher than `step`.
    fn over_band(&self, cone: LitCone, [from, to]: [f64; 2], step: f64) -> f64 {
        let rows = ((to - from) / step).ceil().max(1.0) as usize;
        let columns = (TAU / STRAIGHT).ceil() as usize;
        let mut sum = 0.0;
        for (polar, height) in nodes([from, to], rows, &ONE) {
            let (sin, cos) = polar.sin_cos();
            for (around, breadth) in nodes([0.0, TAU], columns, &ONE) {
                let (sine, cosine) = around.sin_cos();
                let direction = DVec3::new(-sin * cosine, -sin * sine, -cos);
                let value = f64::from(self.factor(direction));
                sum += value * sin * height * breadth * cone.weight(direction);
            }
        }
        sum
    }
}

impl LitCone {
    /// Beyond this angle off the axis weights fall.
    fn beyond(&self) -> f64 {
        (self.half_angle_rad - FRAC_PI_2).max(0.0)
    }

    /// How much a direction within the cone counts.
    fn weight(&self, direction: DVec3) -> f64 {
        let off = self.axis.cross(direction).length().atan2(self.axis.dot(direction));
        (off - self.beyond()).max(0.0).cos().max(0.0)
    }

    /// The integral of the weight over the cone.
    fn whole(&self) -> f64 {
        let (sin, cos) = self.beyond().sin_cos();
        if self.half_angle_rad <= FRAC_PI_2 {
            PI * self.half_angle_rad.sin().powi(2)
        } else {
            TAU * (1.0 - 0.5 * cos + 0.25 * PI * sin)
        }
    }
}

/// In how many pieces an interval is taken.
fn pieces(width: f64) -> usize {
    (width / WIDEST).ceil().max(1.0) as usize
}

/// Where a function is taken in the pieces of an interval, and the width that each stands for.
fn nodes(
    [from, to]: [f64; 2],
    pieces: usize,
    of_piece: &[f64],
) -> impl Iterator<Item = (f64, f64)> + '_ {
    let width = (to - from) / pieces as f64;
    let middles = (0..pieces).map(move |piece| from + (piece as f64 + 0.5) * width);
    let share = width / of_piece.len() as f64;
    middles.flat_map(move |middle| {
        of_piece.iter().map(move |node| (middle + 0.5 * width * node, share))
    })
}
