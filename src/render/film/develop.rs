//! From sums to the pixels of a picture.

use super::super::buffers::{RenderBuffers, set_pixel};
use super::super::layers::Aov;
use super::super::noise::{Estimate, Grey, Halves, pool};
use super::super::parts::settle;
use super::sums::{self, COVERED, Shown, pair, vector};
use super::{Film, counts};
use crate::math::color::Rgb;
use glam::DVec3;
use rayon::prelude::*;

/// A pixel about to be developed.
struct Pixel<'a> {
    film: &'a Film,
    sums: &'a [f64],
    coverage: Option<&'a super::Coverage>,
    /// What sums of light are multiplied by: exposure over count.
    weight: f64,
    /// Samples that were taken.
    taken: u32,
    /// Those that are in the means.
    count: f64,
    covered: f64,
    /// Variance of the beauty.
    variance: DVec3,
    /// Error of its luminance.
    error: f64,
}

impl Film {
    /// The picture of all samples so far.
    pub(in super::super) fn develop(&self, shown: &Shown) -> RenderBuffers {
        let mut buffers = RenderBuffers::new(self.size, self.window, shown.layers.to_vec());
        let width = self.window.width() as usize;
        let is_shown = |aov| shown.layers.iter().any(|layer| layer.aov == aov);
        let variance = if is_shown(Aov::Variance) { self.variance() } else { Vec::new() };
        let error = if is_shown(Aov::Error) { self.error() } else { Vec::new() };
        buffers.rows_mut().enumerate().for_each(|(y, row)| {
            let mut values = Vec::new();
            for x in 0..width {
                let at = y * width + x;
                self.pixel(at, variance.get(at), error.get(at)).values(shown, &mut values);
                set_pixel(row, width, x, &values);
            }
        });
        buffers
    }

    fn pixel(&self, at: usize, variance: Option<&DVec3>, error: Option<&f64>) -> Pixel<'_> {
        let stride = self.layout.stride();
        let sums = &self.sums[at * stride..][..stride];
        let [a, b] = counts(sums, self.taken[at]).map(f64::from);
        let count = (a + b).max(1.0);
        Pixel {
            film: self,
            sums,
            coverage: self.coverage.get(at),
            weight: self.exposure_scale / count,
            taken: self.taken[at],
            count,
            covered: sums[COVERED].max(1.0),
            variance: variance.copied().unwrap_or_default(),
            error: error.copied().unwrap_or_default(),
        }
    }

    /// The error of each pixel, told by its neighbours; infinite where there are less than two samples, of which nothing
    /// can be told. Without a floor it is relative to that of this picture.
    fn error(&self) -> Vec<f64> {
        let halves = self.halves();
        let own = || Grey::of(halves.iter().map(Halves::luminance));
        let width = self.window.width() as usize;
        let estimate = Estimate::of(&halves, width, self.grey.unwrap_or_else(own));
        let told = |(pixel, halves): (usize, &Halves)| match halves.counts {
            [0, _] | [_, 0] => f64::INFINITY,
            _ if estimate.is_spoilt(pixel) => f64::INFINITY,
            _ => estimate.told(pixel),
        };
        halves.iter().enumerate().map(told).collect()
    }

    /// The variance of each pixel's beauty, pooled over what is around it.
    fn variance(&self) -> Vec<DVec3> {
        let (stride, width) = (self.layout.stride(), self.window.width() as usize);
        let pixels = || self.sums.par_chunks(stride).zip(&self.taken);
        let of_one: Vec<DVec3> = pixels()
            .map(|(sums, &taken)| {
                let [a, b] = counts(sums, taken).map(f64::from);
                let mean = |half, count: f64| sums::radiance(sums, half) / count.max(1.0);
                let off = (mean(0, a) - mean(1, b)) * self.exposure_scale;
                off * off * (a * b / (a + b).max(1.0))
            })
            .collect();
        let channel = |channel: usize| {
            let own: Vec<f64> = of_one.iter().map(|variance| variance[channel]).collect();
            pool(&own, width)
        };
        let [red, green, blue] = [0, 1, 2].map(channel);
        let mean = |(i, &taken): (usize, &u32)| {
            DVec3::new(red[i], green[i], blue[i]) / f64::from(taken.max(1))
        };
        self.taken.iter().enumerate().map(mean).collect()
    }
}

impl Pixel<'_> {
    /// The values of all channels, exposed: radiance is scaled, and its variance by the square.
    fn values(&self, shown: &Shown, values: &mut Vec<f32>) {
        values.clear();
        let Pixel { sums, count, covered, weight, .. } = *self;
        let layout = &self.film.layout;
        let is_covered = sums[COVERED] > 0.0;
        let mean =
            |at: Option<usize>, count: f64| at.map_or(DVec3::ZERO, |at| vector(sums, at) / count);
        let light = |at: usize| brief(vector(sums, at) * weight);
        let beauty = brief((sums::radiance(sums, 0) + sums::radiance(sums, 1)) * weight);
        let mut parts = [Rgb::ZERO; 3];
        if let Some(at) = layout.scatterings {
            let [emission, direct, indirect] = [0, 3, 6].map(|i| light(at + i));
            // In the order of their names, which is that of a file's channels.
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
                    values.push((sums[COVERED] / count) as f32);
                }
                Aov::Direct => values.extend(direct.to_array()),
                Aov::Emission => values.extend(emission.to_array()),
                Aov::Indirect => values.extend(indirect.to_array()),
                Aov::LightGroups if own > 0 => {}
                Aov::LightGroups => {
                    let at = layout.groups.unwrap_or_default();
                    let groups = layout.group_count();
                    let mut parts: Vec<Rgb> =
                        (0..groups).map(|group| light(at + 3 * group)).collect();
                    settle_rgb(&mut parts, beauty);
                    values.extend(parts.iter().flat_map(|light| light.to_array()));
                }
                Aov::Depth if !is_covered => values.push(f32::INFINITY),
                Aov::Depth => {
                    let depth = layout.depth.map_or(0.0, |at| sums[at]);
                    values.push((depth / covered) as f32);
                }
                Aov::Normal => {
                    let normal = mean(layout.normal, covered).as_vec3();
                    values.extend(normal.normalize_or_zero().to_array());
                }
                Aov::Albedo => {
                    let albedo = mean(layout.albedo, count).as_vec3();
                    values.extend(albedo.clamp(Rgb::ZERO, Rgb::ONE).to_array());
                }
                Aov::Position if !is_covered => values.extend([0.0; 3]),
                Aov::Position => {
                    let position = mean(layout.position, covered) + shown.origin;
                    values.extend(position.as_vec3().to_array());
                }
                Aov::Motion => {
                    let motion = layout.motion.map(|at| pair(sums, at + 2 * own) / count);
                    values.extend(motion.unwrap_or_default().as_vec2().to_array());
                }
                Aov::Cryptomatte => {
                    let pairs = self.coverage.map(|own| own.ranked(count as u32));
                    values.extend(&pairs.unwrap_or_default()[4 * own..][..4]);
                }
                Aov::Variance => values.extend(brief(self.variance).to_array()),
                Aov::Error => values.push(self.error as f32),
                Aov::SampleCount => values.push(self.taken as f32),
            }
        }
    }
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
