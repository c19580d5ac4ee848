//! The sums of a pixel: which there are, and where.

use super::super::cryptomatte::ObjectIds;
use super::super::layers::{Aov, Layer};
use super::super::motion::Motion;
use super::super::path::PathSample;
use crate::math::color::{Rgb, luminance};
use crate::scene::Pose;
use glam::{DVec2, DVec3};

/// What the layers of a frame need beside the samples, at one of its times.
pub(in super::super) struct Shown<'a> {
    /// What is asked for.
    pub layers: &'a [Layer],
    /// Where the scene's origin is, metres.
    pub origin: DVec3,
    /// Where everything is.
    pub pose: &'a Pose,
    /// Only for the layers of motion.
    pub motion: Option<&'a Motion<'a>>,
    /// Only for Cryptomatte.
    pub ids: Option<&'a ObjectIds>,
}

/// Radiance of each half, three numbers each.
const RADIANCE: usize = 0;
/// The squared luminance of blocked light.
const BLOCKED: usize = 6;
/// Of each half, the samples that were left out.
const LEFT_OUT: usize = 7;
/// Samples that hit anything.
pub(super) const COVERED: usize = 9;
/// The luminance of the brightest sample: no sum, but kept beside them.
const BRIGHTEST: usize = 10;
/// What every film has.
const ALWAYS: usize = 11;

/// Where a pixel's sums are that not every film has; `None` if nobody asked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    /// Metres, of the samples that hit anything.
    pub depth: Option<usize>,
    /// Likewise.
    pub normal: Option<usize>,
    /// Likewise.
    pub albedo: Option<usize>,
    /// Likewise.
    pub position: Option<usize>,
    /// Forward and backward.
    pub motion: Option<usize>,
    /// Light that was scattered never, once, more often.
    pub scatterings: Option<usize>,
    /// The light of each group.
    pub groups: Option<usize>,
    group_count: usize,
    stride: usize,
}

impl Layout {
    /// For some layers and so many light groups.
    pub fn new(layers: &[Layer], group_count: usize) -> Layout {
        let mut stride = ALWAYS;
        let mut place = |aovs: &[Aov], numbers: usize| {
            let is_asked = layers.iter().any(|layer| aovs.contains(&layer.aov));
            is_asked.then(|| {
                stride += numbers;
                stride - numbers
            })
        };
        Layout {
            depth: place(&[Aov::Depth], 1),
            normal: place(&[Aov::Normal], 3),
            albedo: place(&[Aov::Albedo], 3),
            position: place(&[Aov::Position], 3),
            motion: place(&[Aov::Motion], 4),
            scatterings: place(&Aov::BY_SCATTERINGS, 3 * 3),
            groups: place(&[Aov::LightGroups], 3 * group_count),
            group_count,
            stride,
        }
    }

    /// Sums of each pixel.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Light groups.
    pub fn group_count(&self) -> usize {
        self.group_count
    }

    /// Adds a sample to a half of a pixel; only radiance is kept by halves. Whether it was kept: it is left out if its radiance is not
    /// finite.
    #[inline]
    pub fn add(
        &self,
        sums: &mut [f64],
        half: usize,
        sample: &PathSample,
        by_group: &[Rgb],
        blocked: f64,
        shown: &Shown,
    ) -> bool {
        if !sample.radiance.is_finite() {
            sums[LEFT_OUT + half] += 1.0;
            return false;
        }
        add(sums, RADIANCE + 3 * half, sample.radiance);
        sums[BRIGHTEST] = sums[BRIGHTEST].max(luminance(sample.radiance).into());
        if blocked.is_finite() {
            sums[BLOCKED] += blocked;
        }
        if let Some(at) = self.scatterings {
            for (i, light) in sample.by_scatterings.iter().enumerate() {
                add(sums, at + 3 * i, *light);
            }
        }
        if let Some(at) = self.groups {
            for (i, light) in by_group.iter().enumerate() {
                add(sums, at + 3 * i, *light);
            }
        }
        if let (Some(at), Some(motion)) = (self.motion, shown.motion) {
            let [forward, backward] = motion.of(sample, shown.pose);
            let numbers = [forward.x, forward.y, backward.x, backward.y];
            sums[at..].iter_mut().zip(numbers).for_each(|(sum, own)| *sum += own);
        }
        if let Some(hit) = &sample.hit {
            sums[COVERED] += 1.0;
            if let Some(at) = self.depth {
                sums[at] += f64::from(sample.depth_m);
            }
            for (at, vector) in [
                (self.normal, sample.normal),
                (self.albedo, sample.albedo),
                (self.position, hit.anchor.position),
            ] {
                if let Some(at) = at {
                    add(sums, at, vector);
                }
            }
        }
        true
    }
}

fn add(sums: &mut [f64], at: usize, vector: Rgb) {
    let sums = &mut sums[at..at + 3];
    sums.iter_mut().zip(vector.to_array()).for_each(|(sum, own)| *sum += f64::from(own));
}

/// Three of a pixel's sums.
pub(super) fn vector(sums: &[f64], at: usize) -> DVec3 {
    DVec3::from_slice(&sums[at..at + 3])
}

/// Two of a pixel's sums.
pub(super) fn pair(sums: &[f64], at: usize) -> DVec2 {
    DVec2::from_slice(&sums[at..at + 2])
}

/// The radiance of a half, summed.
pub(super) fn radiance(sums: &[f64], half: usize) -> DVec3 {
    vector(sums, RADIANCE + 3 * half)
}

/// The squared luminance of blocked light, summed.
pub(super) fn blocked(sums: &[f64]) -> f64 {
    sums[BLOCKED]
}

/// The luminance of the brightest sample.
pub(super) fn brightest(sums: &[f64]) -> f64 {
    sums[BRIGHTEST]
}

/// Samples of each half that were left out.
pub(super) fn left_out(sums: &[f64]) -> [u32; 2] {
    [sums[LEFT_OUT] as u32, sums[LEFT_OUT + 1] as u32]
}
