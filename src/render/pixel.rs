//! A pixel: the means over its samples, in the layers that were asked for.
//!
//! A sample whose radiance is not finite is left out of all means and counted: it would spoil the pixel,
//! and what is filtered over it later. Sums are in double precision.

use super::cryptomatte::{Coverage, ObjectIds};
use super::layers::{Aov, Layer};
use super::motion::Motion;
use super::parts::settle;
use super::path::PathSample;
use crate::math::color::Rgb;
use glam::{DVec2, DVec3, Vec3};

/// What the layers of a frame need beside the samples.
pub(super) struct Shown<'a> {
    /// What is asked for.
    pub layers: &'a [Layer],
    /// Factor on radiance.
    pub exposure_scale: f64,
    /// Where the scene's origin is, metres.
    pub origin: DVec3,
    /// Only for the layers of motion.
    pub motion: Option<Motion<'a>>,
    /// Only for Cryptomatte.
    pub ids: Option<&'a ObjectIds>,
}

/// Running means over a pixel's samples.
#[derive(Default)]
pub(super) struct PixelMean {
    count: u32,
    /// Samples left out because their radiance is not finite.
    pub non_finite: u32,
    covered: u32,
    radiance: DVec3,
    /// Sum of squared distances from the mean (Welford).
    spread: DVec3,
    depth_m: f64,
    normal: Vec3,
    albedo: DVec3,
    position: DVec3,
    by_scatterings: [DVec3; 3],
    by_group: Vec<DVec3>,
    motion: [DVec2; 2],
    coverage: Coverage,
}

impl PixelMean {
    /// Begins another pixel; keeps the memory.
    pub fn clear(&mut self) {
        let (mut by_group, mut coverage) =
            (std::mem::take(&mut self.by_group), std::mem::take(&mut self.coverage));
        by_group.clear();
        coverage.clear();
        *self = PixelMean { by_group, coverage, ..Default::default() };
    }

    /// Takes in a path, with its light by group.
    pub fn add(&mut self, sample: &PathSample, by_group: &[Rgb], shown: &Shown) {
        if !sample.radiance.is_finite() {
            self.non_finite += 1;
            return;
        }
        self.count += 1;
        let radiance = sample.radiance.as_dvec3();
        let off = radiance - self.radiance;
        self.radiance += off / f64::from(self.count);
        self.spread += off * (radiance - self.radiance);
        for (sum, light) in self.by_scatterings.iter_mut().zip(&sample.by_scatterings) {
            *sum += light.as_dvec3();
        }
        self.by_group.resize(by_group.len(), DVec3::ZERO);
        for (sum, light) in self.by_group.iter_mut().zip(by_group) {
            *sum += light.as_dvec3();
        }
        if let Some(motion) = &shown.motion {
            let [forward, backward] = motion.of(sample);
            self.motion[0] += forward;
            self.motion[1] += backward;
        }
        if let Some(hit) = &sample.hit {
            self.covered += 1;
            self.depth_m += f64::from(sample.depth_m);
            self.normal += sample.normal;
            self.albedo += sample.albedo.as_dvec3();
            self.position += hit.anchor.position.as_dvec3();
            if let Some(ids) = shown.ids {
                self.coverage.add(ids.of(&hit.surface));
            }
        }
    }

    /// The values of all channels, exposed: radiance is scaled, and its variance by the square.
    pub fn finish(&mut self, shown: &Shown, values: &mut Vec<f32>) {
        values.clear();
        let count = f64::from(self.count.max(1));
        let covered = f64::from(self.covered.max(1));
        let scale = shown.exposure_scale;
        let beauty = brief(self.radiance * scale);
        let mut parts = self.by_scatterings.map(|sum| brief(sum * (scale / count)));
        if shown.layers.iter().any(|layer| Aov::BY_SCATTERINGS.contains(&layer.aov)) {
            // In the order of their names, which is that of a file's channels.
            let [emission, direct, indirect] = parts;
            let mut sorted = [direct, emission, indirect];
            settle_rgb(&mut sorted, beauty);
            parts = [sorted[1], sorted[0], sorted[2]];
        }
        let [emission, direct, indirect] = parts;
        // The number of a layer among those of its kind.
        let (mut last, mut own) = (None, 0);
        for layer in shown.layers {
            own = if last == Some(layer.aov) { own + 1 } else { 0 };
            last = Some(layer.aov);
            match layer.aov {
                Aov::Beauty => {
                    values.extend(beauty.to_array());
                    values.push((f64::from(self.covered) / count) as f32);
                }
                Aov::Direct => values.extend(direct.to_array()),
                Aov::Emission => values.extend(emission.to_array()),
                Aov::Indirect => values.extend(indirect.to_array()),
                Aov::LightGroups if own > 0 => {}
                Aov::LightGroups => {
                    let groups = self.groups(layer_count(shown, layer), beauty, scale / count);
                    values.extend(groups.iter().flat_map(|light| light.to_array()));
                }
                Aov::Depth if self.covered == 0 => values.push(f32::INFINITY),
                Aov::Depth => values.push((self.depth_m / covered) as f32),
                Aov::Normal => values.extend(self.normal.normalize_or_zero().to_array()),
                Aov::Albedo => {
                    let albedo = (self.albedo / count).as_vec3();
                    values.extend(albedo.clamp(Rgb::ZERO, Rgb::ONE).to_array());
                }
                Aov::Position if self.covered == 0 => values.extend([0.0; 3]),
                Aov::Position => {
                    let position = self.position / covered + shown.origin;
                    values.extend(position.as_vec3().to_array());
                }
                Aov::Motion => {
                    let motion = self.motion[own] / count;
                    values.extend(motion.as_vec2().to_array());
                }
                Aov::Cryptomatte => {
                    let pairs = self.coverage.ranked(self.count);
                    values.extend(&pairs[4 * own..][..4]);
                }
                Aov::Variance => {
                    let degrees = count * (count - 1.0).max(1.0);
                    values.extend(brief(self.spread / degrees * (scale * scale)).to_array());
                }
                Aov::SampleCount => values.push(self.count as f32),
            }
        }
    }

    /// The light groups, all at once: they sum to the beauty together.
    fn groups(&self, count: usize, beauty: Rgb, scale: f64) -> Vec<Rgb> {
        let sum = |group| self.by_group.get(group).copied().unwrap_or_default();
        let mut parts: Vec<Rgb> = (0..count).map(|group| brief(sum(group) * scale)).collect();
        settle_rgb(&mut parts, beauty);
        parts
    }
}

/// How many layers are of one kind.
fn layer_count(shown: &Shown, layer: &Layer) -> usize {
    shown.layers.iter().filter(|other| other.aov == layer.aov).count()
}

fn settle_rgb(parts: &mut [Rgb], whole: Rgb) {
    for channel in 0..3 {
        let mut own: Vec<f32> = parts.iter().map(|part| part[channel]).collect();
        settle(&mut own, whole[channel]);
        parts.iter_mut().zip(own).for_each(|(part, own)| part[channel] = own);
    }
}

/// Light in 32 bits, finite.
fn brief(light: DVec3) -> Rgb {
    light.min(DVec3::splat(f32::MAX.into())).as_vec3()
}
