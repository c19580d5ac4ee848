//! Keys that say the same at all times: exporters write a track for every channel of a node that has
//! one, and most of these hold still. What is judged is the values, not that there are keys.
//!
//! All keys count, also those outside the frames that someone renders: which frames these will be, no
//! scene knows.

use super::pose::{Channel, Interpolation, Keys, Node, Trs};
use crate::math::color::Rgb;
use glam::{Quat, Vec2, Vec3};

/// How far keys of one scale or one direction may be apart, relative or in radians: a few dozen
/// roundings of 32-bit numbers, as decomposing matrices leaves them.
const NOISE: f64 = 32.0 * f32::EPSILON as f64;
/// How far keys of one place may be apart, relative to its distance from the origin: a few roundings.
/// No more, for far from the origin that is a real distance.
const PLACE_NOISE: f64 = 4.0 * f32::EPSILON as f64;
/// And in any case: less than light can show, in metres.
const LEAST_MOTION: f64 = 1e-9;
/// How far keys of one strength may be apart, relative to the largest part.
const STRENGTH_NOISE: f64 = 8.0 * f32::EPSILON as f64;

impl<T: Copy> Keys<T> {
    /// The value that holds at all times, if all keys are as near to the first as `is_near` says and
    /// all tangents change a value by as little as `is_little` says.
    fn steady(
        &self,
        is_near: impl Fn(T, T) -> bool,
        is_little: impl Fn(T, f64) -> bool,
    ) -> Option<T> {
        let is_spline = self.interpolation == Interpolation::Cubic;
        let (first, step) = if is_spline { (1, 3) } else { (0, 1) };
        let value = *self.values.get(first)?;
        let mut keys = self.values.iter().skip(first).step_by(step);
        let is_steady = keys.all(|&key| is_near(value, key));
        // Out of one key and into the next, over the time between them.
        let is_flat = |(key, times): (usize, &[f32])| {
            let step_s = f64::from(times[1]) - f64::from(times[0]);
            let tangents = [3 * key + 2, 3 * key + 3].map(|at| self.values[at]);
            tangents.into_iter().all(|tangent| is_little(tangent, step_s))
        };
        let is_flat = !is_spline || self.times_s.windows(2).enumerate().all(is_flat);
        (is_steady && is_flat).then_some(value)
    }
}

impl Keys<Vec3> {
    /// The vector that holds at all times, up to a distance.
    fn steady_within(&self, tolerance: f64) -> Option<Vec3> {
        let is_near = |a: Vec3, b: Vec3| a.as_dvec3().distance(b.as_dvec3()) <= tolerance;
        self.steady(is_near, |tangent, step_s| tangent.as_dvec3().length() * step_s <= tolerance)
    }

    /// Whether one vector holds at all times, up to a distance.
    pub fn is_steady(&self, tolerance: f64) -> bool {
        self.steady_within(tolerance).is_some()
    }

    /// The longest of the values.
    fn longest(&self) -> f64 {
        self.values.iter().map(|value| value.as_dvec3().length()).fold(0.0, f64::max)
    }
}

impl Keys<Quat> {
    /// The rotation that holds at all times. A quaternion and its opposite are the same.
    fn steady_rotation(&self) -> Option<Quat> {
        let is_near = |a: Quat, b: Quat| {
            let (a, b) = (a.as_dquat().normalize(), b.as_dquat().normalize());
            // A chord of the unit sphere is half the angle of the rotation between.
            (a - b).length().min((a + b).length()) * 2.0 <= NOISE
        };
        // Between opposites a spline passes through zero.
        let keeps_sign = |a: Quat, b: Quat| is_near(a, b) && a.dot(b) > 0.0;
        let is_little = |tangent: Quat, step_s| tangent.as_dquat().length() * step_s * 2.0 <= NOISE;
        match self.interpolation {
            Interpolation::Cubic => self.steady(keeps_sign, is_little),
            Interpolation::Linear | Interpolation::Step => self.steady(is_near, is_little),
        }
    }
}

impl Keys<Rgb> {
    /// The same keys, but one alone where all say the same: then they do not
    /// [vary](Keys::varies).
    pub fn settled(self) -> Keys<Rgb> {
        let peak = f64::from(self.peak().max_element());
        match self.steady_within(STRENGTH_NOISE * peak) {
            Some(value) => Keys {
                times_s: vec![self.times_s[0]],
                values: vec![value],
                interpolation: Interpolation::Step,
            },
            None => self,
        }
    }
}

impl Keys<f32> {
    /// The number that holds at all times, if one does.
    pub fn steady_number(&self) -> Option<f32> {
        let largest = self.values.iter().fold(0f32, |largest, value| largest.max(value.abs()));
        let near = |difference: f64| difference.abs() <= STRENGTH_NOISE * f64::from(largest);
        let is_near = |a: f32, b: f32| near(f64::from(a) - f64::from(b));
        self.steady(is_near, |tangent, step_s| near(f64::from(tangent) * step_s))
    }
}

impl Keys<Vec2> {
    /// The pair of numbers that holds at all times, if one does.
    pub fn steady_pair(&self) -> Option<Vec2> {
        let part = |which: fn(Vec2) -> f32| Keys {
            times_s: self.times_s.clone(),
            values: self.values.iter().map(|&pair| which(pair)).collect(),
            interpolation: self.interpolation,
        };
        let x = part(|pair| pair.x).steady_number()?;
        Some(Vec2::new(x, part(|pair| pair.y).steady_number()?))
    }
}

impl<T> Keys<T> {
    /// Whether there is more than one key.
    pub fn varies(&self) -> bool {
        self.times_s.len() > 1
    }
}

impl Node {
    /// Puts what channels say at all times in the place of the channels.
    pub fn settle(&mut self) {
        if self.channels.is_empty() {
            return;
        }
        let Trs::Parts { translation, rotation, scale } = &mut self.local else { return };
        // A later channel of the same part would override what is settled: it stays, and so do both.
        let kinds: Vec<_> = self.channels.iter().map(std::mem::discriminant).collect();
        self.channels.retain(|channel| {
            let kind = std::mem::discriminant(channel);
            if kinds.iter().filter(|other| **other == kind).count() > 1 {
                return true;
            }
            let settled = match channel {
                Channel::Translation(keys) => {
                    let tolerance = (PLACE_NOISE * keys.longest()).max(LEAST_MOTION);
                    keys.steady_within(tolerance).map(|value| *translation = value.as_dvec3())
                }
                Channel::Rotation(keys) => {
                    let value = keys.steady_rotation();
                    value.map(|value| *rotation = value.as_dquat().normalize())
                }
                Channel::Scale(keys) => {
                    let tolerance = NOISE * keys.longest();
                    keys.steady_within(tolerance).map(|value| *scale = value.as_dvec3())
                }
            };
            settled.is_none()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys<T: Copy>(values: &[T], interpolation: Interpolation) -> Keys<T> {
        let in_a_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
        let times_s = (0..values.len() / in_a_key).map(|key| key as f32).collect();
        Keys { times_s, values: values.to_vec(), interpolation }
    }

    fn settled(channel: Channel) -> (bool, Trs) {
        let mut node = Node::fixed("/lamp", None, Trs::default());
        node.channels.push(channel);
        node.settle();
        (node.channels.is_empty(), node.local)
    }

    #[test]
    fn equal_keys_settle_and_others_do_not() {
        use Interpolation::{Cubic, Linear, Step};
        let place = Vec3::new(3.0, -4.0, 12.0);
        let off = |by: f32| place + Vec3::new(by, 0.0, 0.0);
        for how in [Linear, Step] {
            let moves = |values: &[Vec3]| !settled(Channel::Translation(keys(values, how))).0;
            assert!(!moves(&[place]) && !moves(&[place, place, off(1e-6)]));
            assert!(moves(&[place, off(1e-4), place]));
            assert!(
                !moves(&[Vec3::ZERO, Vec3::splat(1e-17)]) && moves(&[Vec3::ZERO, Vec3::X * 1e-6])
            );
            let grows = |values: &[f32]| {
                let values: Vec<Vec3> = values.iter().map(|&s| Vec3::splat(s)).collect();
                !settled(Channel::Scale(keys(&values, how))).0
            };
            assert!(!grows(&[1.0, 1.000_000_2, 0.999_999_8]) && grows(&[1.0, 1.001]));
            assert!(!grows(&[1e-6, 1e-6]) && grows(&[1e-6, 2e-6]) && grows(&[0.0, 1.0]));
        }
        let (rest, none) = (Vec3::splat(2.0), Vec3::ZERO);
        let cubic = |values: &[Vec3]| settled(Channel::Scale(keys(values, Cubic))).0;
        assert!(cubic(&[none, rest, none, none, rest, none]));
        // The first tangent and the last lead nowhere.
        assert!(cubic(&[rest, rest, none, none, rest, rest]));
        assert!(!cubic(&[none, rest, Vec3::X * 0.1, none, rest, none]));
        assert!(!cubic(&[none, rest, none, Vec3::X * 0.1, rest, none]));
    }

    #[test]
    fn a_quaternion_and_its_opposite_are_one_rotation() {
        use Interpolation::{Cubic, Linear};
        let turn = |angle: f32| Quat::from_rotation_y(angle);
        let still = |values: &[Quat], how| settled(Channel::Rotation(keys(values, how))).0;
        assert!(still(&[turn(0.7), -turn(0.7), turn(0.7 + 3e-7)], Linear));
        assert!(!still(&[turn(0.7), turn(0.7001)], Linear));
        let zero = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        let spline = |a: Quat, b: Quat| still(&[zero, a, zero, zero, b, zero], Cubic);
        assert!(spline(turn(1.0), turn(1.0)) && !spline(turn(1.0), -turn(1.0)));
    }

    #[test]
    fn what_settles_is_what_was_said() {
        let value = Vec3::new(1.0, 2.0, 3.0);
        let said = settled(Channel::Scale(keys(&[value, value], Interpolation::Linear))).1;
        assert!(matches!(said, Trs::Parts { scale, .. } if scale == value.as_dvec3()));
        let varies = |values: &[Rgb]| keys(values, Interpolation::Linear).settled().varies();
        assert!(!varies(&[value, value * 1.000_000_1]) && varies(&[value, value * 1.001]));
        assert!(!varies(&[Rgb::ZERO; 3]) && varies(&[Rgb::ZERO, Rgb::splat(1e-30)]));
        // One part alone.
        assert!(varies(&[value, value.with_x(1.1)]));
    }
}
