//! Photometric profiles: how the light of a luminaire depends on direction, as it was measured.

mod mean;

use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A goniophotometer's table of factors on emission.
///
/// UsdLux ShapingAPI (schema of usd-core 26.11, `ies:file`, `ies:angleScale`, `ies:normalize`): the factor is looked up in
/// the direction of emission in the light's own space and multiplies its luminance. The table is bilinear in its two
/// angles, as hdEmbree reads it. Beyond the angles that it has, it is dark.
///
/// The luminaire hangs with its nadir along the light's -Z. Its horizontal angle 0 is along -X and counts towards -Y,
/// counter-clockwise seen from +Z (LM-63-2002, section 3). UsdLux does not say where angle 0 is; hdEmbree has it there.
#[derive(Clone, Debug, PartialEq)]
pub struct IesProfile {
    /// The file that it was read from, for messages.
    pub name: String,
    pole: Pole,
    /// Angles from the pole, ascending, radians in `[0, pi]`.
    polar_rad: Vec<f64>,
    /// Angles of the half planes about the pole, ascending, radians; one alone is all of them. They span a full turn
    /// or less.
    around_rad: Vec<f64>,
    /// The factors of each half plane by polar angle; not negative.
    values: Vec<f32>,
    angle_scale: f64,
    lit: LitCone,
    mean: f64,
}

/// The axis that the half planes of a table share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pole {
    /// Straight down, -Z; half planes count from -X towards -Y. LM-63's types A and C.
    Nadir,
    /// Horizontal, +Y; half planes count from -Z towards -X. LM-63's type B.
    Side,
}

/// A cone that holds every direction in which a profile is not dark, in the light's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LitCone {
    /// Unit.
    pub axis: DVec3,
    /// Radians in `[0, pi]`.
    pub half_angle_rad: f64,
}

/// The angles and factors of a table, as [`IesProfile`] holds them.
#[derive(Clone, Debug, PartialEq)]
pub struct IesTable {
    /// The axis that its half planes share.
    pub pole: Pole,
    /// Angles from the pole, strictly ascending, radians in `[0, pi]`.
    pub polar_rad: Vec<f64>,
    /// Angles of its half planes, strictly ascending within a turn, radians; not empty.
    pub around_rad: Vec<f64>,
    /// A factor for each half plane and in it each polar angle; finite, not negative.
    pub values: Vec<f32>,
}

/// What angles lose where they are computed, radians.
const SLACK: f64 = 1e-9;

impl IesTable {
    /// The integral of the table over all directions, and whether it reaches beyond a hemisphere about its pole.
    /// Each patch is bilinear, so the integral is exact but for rounding.
    pub fn integral(&self) -> (f64, bool) {
        let width = self.polar_rad.len();
        let plane = |row: usize| -> f64 {
            let values = &self.values[row * width..][..width];
            let patches = self.polar_rad.windows(2).zip(values.windows(2));
            patches
                .map(|(angles, ends)| along_meridian([angles[0], angles[1]], [ends[0], ends[1]]))
                .sum()
        };
        let sum = match self.around_rad.as_slice() {
            [_] => TAU * plane(0),
            several => {
                let planes: Vec<f64> = (0..several.len()).map(plane).collect();
                let pairs = several.windows(2).zip(planes.windows(2));
                pairs.map(|(at, ends)| 0.5 * (at[1] - at[0]) * (ends[0] + ends[1])).sum()
            }
        };
        let reach = self.polar_rad[width - 1] - self.polar_rad[0];
        (sum, reach > FRAC_PI_2 + 0.1)
    }
}

/// The integral of a linear function times the sine, from one angle to another.
fn along_meridian([from, to]: [f64; 2], [first, last]: [f32; 2]) -> f64 {
    let (first, last) = (f64::from(first), f64::from(last));
    // From the middle of the patch nothing cancels, however narrow it is.
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    if half <= 0.0 {
        return 0.0;
    }
    let (sin, cos) = middle.sin_cos();
    // sin h - h cos h
    let odd = if half < 1e-2 {
        half.powi(3) * (1.0 / 3.0 - half * half / 30.0)
    } else {
        half.sin() - half * half.cos()
    };
    (first + last) * sin * half.sin() + (last - first) * cos * odd / half
}

impl IesProfile {
    /// The profile of a table. `angle_scale` is UsdLux's.
    ///
    /// # Panics
    /// If the table is not as its fields say, or the scale is not finite.
    pub fn new(name: String, table: IesTable, angle_scale: f32) -> IesProfile {
        let IesTable { pole, polar_rad, around_rad, values } = table;
        assert!(!around_rad.is_empty() && polar_rad.len() > 1 && angle_scale.is_finite());
        assert_eq!(values.len(), polar_rad.len() * around_rad.len());
        let everywhere = LitCone { axis: DVec3::NEG_Z, half_angle_rad: PI };
        let angle_scale = f64::from(angle_scale);
        let mut profile = IesProfile {
            name,
            pole,
            polar_rad,
            around_rad,
            values,
            angle_scale,
            lit: everywhere,
            mean: 0.0,
        };
        let lit = profile.find_lit();
        profile.mean = profile.mean_over(lit);
        // A hair for what rounding loses.
        let wider = (lit.half_angle_rad * (1.0 + 1e-6) + 1e-6).min(PI);
        let half_angle_rad = if lit.half_angle_rad > 0.0 { wider } else { 0.0 };
        profile.lit = LitCone { half_angle_rad, ..lit };
        profile
    }

    /// The factor on what leaves in a direction: unit, in the light's own space.
    pub fn factor(&self, direction: DVec3) -> f32 {
        let mut direction = direction;
        if self.angle_scale != 0.0 {
            let across = direction.x.hypot(direction.y);
            let (sin, cos) = self.scaled(across.atan2(-direction.z)).sin_cos();
            let aside = if across > 0.0 { sin / across } else { 0.0 };
            direction = DVec3::new(direction.x * aside, direction.y * aside, -cos);
        }
        let DVec3 { x, y, z } = direction;
        let (polar, around) = match self.pole {
            // Subtracted, so that no zero is negative: the angle of a pole itself is 0.
            Pole::Nadir => (x.hypot(y).atan2(-z), (0.0 - y).atan2(0.0 - x)),
            Pole::Side => (x.hypot(z).atan2(y), (0.0 - x).atan2(0.0 - z)),
        };
        self.look_up(polar, around)
    }

    /// A cone outside which it is dark.
    pub fn lit(&self) -> LitCone {
        self.lit
    }

    /// The mean of the factor over directions, weighted as a light's cone of orientations is: evenly, or by the cosine
    /// to the axis of a cone within a hemisphere.
    pub fn mean(&self) -> f32 {
        self.mean as f32
    }

    /// Whether no turn about -Z changes it.
    pub fn is_round(&self) -> bool {
        let (first, last) = (self.around_rad[0], self.around_rad[self.around_rad.len() - 1]);
        let mut planes = self.values.chunks_exact(self.polar_rad.len());
        let one = planes.next();
        let is_all_around = self.around_rad.len() == 1 || last - first > TAU - SLACK;
        self.pole == Pole::Nadir && is_all_around && planes.all(|plane| Some(plane) == one)
    }

    /// Its numbers, for hashes: angles in radians, then factors; the scale of angles last.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let pole = f64::from(self.pole as u8);
        let sizes = [pole, self.polar_rad.len() as f64];
        let angles = self.polar_rad.iter().chain(&self.around_rad).copied();
        let values = self.values.iter().map(|&value| f64::from(value));
        sizes.into_iter().chain(angles).chain(values).chain([self.angle_scale])
    }

    /// `applyAngleScale` of UsdLux, kept to `[0, pi]`.
    fn scaled(&self, theta: f64) -> f64 {
        let scaled = match self.angle_scale {
            scale if scale > 0.0 => theta / scale,
            scale if scale < 0.0 => (theta - PI) / -scale + PI,
            _ => theta,
        };
        scaled.clamp(0.0, PI)
    }

    fn look_up(&self, polar: f64, around: f64) -> f32 {
        let Some((row, aside)) = bracket(&self.polar_rad, polar) else { return 0.0 };
        let width = self.polar_rad.len();
        let in_plane = |plane: usize| {
            let [low, high] = [row, row + 1].map(|at| f64::from(self.values[plane * width + at]));
            low + aside * (high - low)
        };
        let first = self.around_rad[0];
        if self.around_rad.len() == 1 {
            return in_plane(0) as f32;
        }
        let turned = (around - first).rem_euclid(TAU);
        // Just before the first plane is beside it.
        let turned = if turned > TAU - 1e-9 { 0.0 } else { turned };
        let Some((plane, ahead)) = bracket(&self.around_rad, first + turned) else { return 0.0 };
        let (low, high) = (in_plane(plane), in_plane(plane + 1));
        (low + ahead * (high - low)) as f32
    }

    /// The angle that is [scaled](Self::scaled) to one of the table, where no pole stands for what is beyond it. It may be
    /// beyond `[0, pi]`.
    fn unclamped(&self, scaled: f64) -> f64 {
        match self.angle_scale {
            scale if scale > 0.0 => scaled * scale,
            scale if scale < 0.0 => PI - (PI - scaled) * -scale,
            _ => scaled,
        }
    }

    /// The angles off the nadir between which a stretch of scaled angles lies.
    fn unscaled(&self, [from, to]: [f64; 2]) -> [f64; 2] {
        let [low, high] = [from, to].map(|scaled| self.unclamped(scaled).clamp(0.0, PI));
        // Beyond a pole the angle stays that of the pole.
        match self.angle_scale {
            scale if scale > 0.0 => [low, if to >= PI - SLACK { PI } else { high }],
            scale if scale < 0.0 => [if from <= SLACK { 0.0 } else { low }, high],
            _ => [from, to],
        }
    }

    /// Whether the scale spreads a pole at the end of a row's stretch over directions of all planes.
    fn is_spread(&self, row: usize) -> bool {
        match self.angle_scale {
            scale if scale > 0.0 => self.polar_rad[row + 1] >= PI - SLACK,
            scale if scale < 0.0 => self.polar_rad[row] <= SLACK,
            _ => false,
        }
    }

    /// A cone outside which it is dark, but for rounding.
    fn find_lit(&self) -> LitCone {
        let everywhere = LitCone { axis: DVec3::NEG_Z, half_angle_rad: PI };
        if self.pole == Pole::Side && self.angle_scale != 0.0 {
            return everywhere;
        }
        let (width, planes) = (self.polar_rad.len(), self.around_rad.len());
        let lit = |plane: usize, row: usize| self.values[plane * width + row] > 0.0;
        let is_lit = |plane: usize, row: usize| {
            let next = if planes == 1 { plane } else { plane + 1 };
            [(plane, row), (plane, row + 1), (next, row), (next, row + 1)]
                .iter()
                .any(|&(p, r)| lit(p, r))
        };
        let cells = || {
            (0..planes.max(2) - 1)
                .flat_map(|plane| (0..width - 1).map(move |row| (plane, row)))
                .filter(|&(plane, row)| is_lit(plane, row))
        };
        let polar = |row: usize| {
            let stretch = [self.polar_rad[row], self.polar_rad[row + 1]];
            if self.pole == Pole::Nadir { self.unscaled(stretch) } else { stretch }
        };
        let stretches = cells().map(|(_, row)| polar(row));
        let (low, high) =
            stretches.fold((PI, 0.0f64), |(low, high), [from, to]| (low.min(from), high.max(to)));
        if low >= high {
            return LitCone { axis: DVec3::NEG_Z, half_angle_rad: 0.0 };
        }
        let pole = self.direction(0.0, 0.0);
        let mut best = LitCone { axis: pole, half_angle_rad: high };
        if PI - low < high {
            best = LitCone { axis: -pole, half_angle_rad: PI - low };
        }
        if planes == 1 || cells().any(|(_, row)| self.is_spread(row)) {
            return best;
        }
        // About the middle of what is lit, from pieces of cells that are small enough to count as discs. There may be many
        // more pieces than values, so they are gone through twice and not kept.
        let pieces = || {
            cells().flat_map(|(plane, row)| {
                let [from, to] = polar(row);
                let first = self.around_rad[plane];
                let turn = self.around_rad[plane + 1] - first;
                let steps = (turn / 0.1).ceil().max(1.0);
                let widest =
                    if (from..=to).contains(&FRAC_PI_2) { 1.0 } else { from.sin().max(to.sin()) };
                let radius = 0.5 * (to - from) + 0.5 * widest * turn / steps;
                let area = (from.cos() - to.cos()) * turn / steps;
                (0..steps as usize).map(move |step| {
                    let around = first + (step as f64 + 0.5) * turn / steps;
                    (self.direction(0.5 * (from + to), around), radius, area)
                })
            })
        };
        let sum: DVec3 = pieces().map(|(middle, _, area)| middle * area).sum();
        if let Some(axis) = sum.try_normalize() {
            let off = |middle: DVec3| axis.cross(middle).length().atan2(axis.dot(middle));
            let half = pieces().map(|(middle, radius, _)| off(middle) + radius).fold(0.0, f64::max);
            if half < best.half_angle_rad {
                best = LitCone { axis, half_angle_rad: half };
            }
        }
        best
    }

    /// The direction of two angles of the table, unit, in the light's own space.
    fn direction(&self, polar: f64, around: f64) -> DVec3 {
        let ((sin, cos), (sine, cosine)) = (polar.sin_cos(), around.sin_cos());
        match self.pole {
            Pole::Nadir => DVec3::new(-sin * cosine, -sin * sine, -cos),
            Pole::Side => DVec3::new(-sin * sine, cos, -sin * cosine),
        }
    }
}

/// The interval of an ascending list that a number is in, and where in it: 0 at its beginning, 1 at its end.
fn bracket(list: &[f64], at: f64) -> Option<(usize, f64)> {
    let (first, last) = (list[0], list[list.len() - 1]);
    if !(first - SLACK..=last + SLACK).contains(&at) {
        return None;
    }
    let next = list.partition_point(|&own| own <= at).clamp(1, list.len() - 1);
    let (low, high) = (list[next - 1], list[next]);
    // Angles that were kept to `[0, pi]` may have become one.
    let ahead = if high > low { (at - low) / (high - low) } else { 0.0 };
    Some((next - 1, ahead.clamp(0.0, 1.0)))
}
