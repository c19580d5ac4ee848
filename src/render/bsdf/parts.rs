//! What of reflected light is diffuse, for lights with multipliers.

use super::Reflection;
use crate::math::color::Rgb;
use glam::Vec3;

impl Reflection {
    /// The part of [`eval`](Self::eval)'s value that the diffuse lobe reflects.
    #[inline]
    pub fn diffuse_part(&self, wi: Vec3) -> Rgb {
        let cos_i = self.frame.to_local(wi).z;
        match self.specular_probability {
            Some(_) if cos_i > 0.0 => self.diffuse * cos_i,
            _ => Rgb::ZERO,
        }
    }

    /// That part's share of the whole; 0 where nothing is reflected.
    pub fn diffuse_share(&self, wi: Vec3) -> Rgb {
        let (whole, part) = (self.eval(wi).0, self.diffuse_part(wi));
        Rgb::select(whole.cmpgt(Rgb::ZERO), part / whole, Rgb::ZERO)
    }
}
