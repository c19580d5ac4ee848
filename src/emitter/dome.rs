//! A dome: light from all around, constant or from a picture that is sampled by its brightness.
//!
//! Directions go through the matrix of the dome's node as it is: a dome below an uneven scale shows its
//! picture stretched, and shows the picture's top where a sun aimed from there would stand. The density
//! knows the stretch ([`DirectionMap::stretch`]). A matrix that is flat counts as the rotation that is
//! left of it.

use super::picture::{PictureDistribution, direction_to_uv, uv_to_direction};
use crate::math::color::{Rgb, luminance};
use crate::math::directions::DirectionMap;
use crate::math::{Frame, warp};
use crate::scene::Texture;
use glam::{Affine3A, DVec2, Vec2, Vec3};
use std::f32::consts::PI;
use std::sync::Arc;

/// Light from infinity in every direction.
pub struct Dome<'a> {
    map: DirectionMap,
    radiance_nits: Rgb,
    picture: Option<(&'a Texture, Arc<PictureDistribution>)>,
    mean_luminance: f32,
}

/// A direction, found.
#[derive(Clone, Copy, Debug)]
pub struct DomeSample {
    /// Unit, world space.
    pub direction: Vec3,
    /// Radiance from there, nits.
    pub radiance: Rgb,
    /// Density over solid angle, 1/sr.
    pub pdf: f32,
}

impl<'a> Dome<'a> {
    /// A dome at a node with some local-to-world transform, and the [distribution](Self::distribution) of its
    /// picture there.
    pub fn new(
        to_world: &Affine3A,
        radiance_nits: Rgb,
        picture: Option<(&'a Texture, Arc<PictureDistribution>)>,
    ) -> Dome<'a> {
        let map = DirectionMap::of(to_world);
        let mean = picture.as_ref().map_or(Rgb::ONE, |(_, distribution)| distribution.mean);
        let mean_luminance = luminance(radiance_nits * mean);
        Dome { map, radiance_nits, picture, mean_luminance }
    }

    /// By how bright a picture is where, at such a node. It is work for a large picture.
    pub fn distribution(to_world: &Affine3A, texture: &Texture) -> PictureDistribution {
        PictureDistribution::new(texture, &DirectionMap::of(to_world))
    }

    /// Radiance from a direction (unit, world space), nits.
    pub fn radiance(&self, direction: Vec3) -> Rgb {
        match &self.picture {
            None => self.radiance_nits,
            Some((texture, _)) => {
                let uv = direction_to_uv(self.map.to_local(direction.as_dvec3()));
                self.picture_radiance(texture, uv)
            }
        }
    }

    fn picture_radiance(&self, texture: &Texture, uv: DVec2) -> Rgb {
        self.radiance_nits * texture.lookup(uv.as_vec2()).truncate()
    }

    /// A direction; by the cosine about a normal if the dome is constant, by brightness if not.
    pub fn sample(&self, normal: Vec3, u: Vec2) -> Option<DomeSample> {
        let Some((texture, distribution)) = &self.picture else {
            let direction = match normal == Vec3::ZERO {
                true => warp::sphere(u),
                false => Frame::around(normal).to_outer(warp::cosine_hemisphere(u)),
            };
            let (radiance, pdf) = (self.radiance_nits, self.pdf(normal, direction));
            return (pdf > 0.0).then_some(DomeSample { direction, radiance, pdf });
        };
        // Radiance and density are those of the place in the picture, before the direction is rounded
        // to 32 bits: rounding moves texels near the poles, but not their sum.
        let uv = distribution.sample(u);
        let local = uv_to_direction(uv);
        let pdf = (distribution.density(uv) / self.map.stretch(local)) as f32;
        let direction = self.map.to_outer(local).as_vec3();
        let radiance = self.picture_radiance(texture, uv);
        (pdf > 0.0).then_some(DomeSample { direction, radiance, pdf })
    }

    /// Density over solid angle of [`sample`](Self::sample), 1/sr.
    pub fn pdf(&self, normal: Vec3, direction: Vec3) -> f32 {
        match &self.picture {
            None if normal == Vec3::ZERO => 1.0 / (4.0 * PI),
            None => warp::cosine_hemisphere_pdf(normal.dot(direction)),
            Some((_, distribution)) => {
                let local = self.map.to_local(direction.as_dvec3());
                (distribution.density(direction_to_uv(local)) / self.map.stretch(local)) as f32
            }
        }
    }

    /// What it may contribute to any surface: its mean luminance over the sphere times pi, lux.
    pub fn illuminance_estimate(&self) -> f32 {
        PI * self.mean_luminance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Pixels, Wrap};
    use glam::{DMat3, DQuat, DVec3};
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    fn pictured<'a>(place: &Affine3A, sky: &'a Texture) -> Dome<'a> {
        let distribution = Dome::distribution(place, sky);
        Dome::new(place, Rgb::ONE, Some((sky, Arc::new(distribution))))
    }

    fn picture(width: u32, height: u32, texel: impl Fn(u32, u32) -> f32) -> Texture {
        let texel = |i: u32| [texel(i % width, i / width); 3];
        Texture {
            name: "sky".into(),
            width,
            height,
            pixels: Pixels::Float((0..width * height).map(texel).collect()),
            wrap: [Wrap::Repeat, Wrap::Clamp],
            bilinear: true,
        }
    }

    /// Dim, with one bright texel.
    fn sky() -> Texture {
        picture(32, 16, |x, y| if (x, y) == (20, 5) { 50.0 } else { 0.1 })
    }

    /// The mean of `f / pdf` over numbers that fill the square evenly (Roberts's R2 sequence).
    fn mean(dome: &Dome, f: impl Fn(&DomeSample) -> f64) -> f64 {
        let n = 1 << 18;
        let number = |i: u32, step: f64| (f64::from(i) * step).fract() as f32;
        (0..n)
            .map(|i| {
                Vec2::new(number(i, 0.754_877_666_246_692_7), number(i, 0.569_840_290_998_053_2))
            })
            .filter_map(|u| dome.sample(Vec3::Z, u))
            .map(|sample| f(&sample) / f64::from(sample.pdf))
            .sum::<f64>()
            / f64::from(n)
    }

    fn transform(matrix: DMat3) -> Affine3A {
        Affine3A::from_mat3(matrix.as_mat3())
    }

    #[test]
    fn sampling_integrates_the_picture_under_any_transform() {
        let sky = sky();
        let (a, b) = (DQuat::from_rotation_x(0.4), DQuat::from_rotation_z(1.1));
        let scale = |x: f64, y: f64, z: f64| DMat3::from_diagonal(DVec3::new(x, y, z));
        let [a, b] = [a, b].map(DMat3::from_quat);
        let mirrored_and_sheared = a * scale(-3.0, 1.0, 0.4) * b;
        for matrix in
            [a, a * 1e-12, scale(1.0, 4.0, 1.0) * a, mirrored_and_sheared, a * scale(1.0, 0.0, 2.0)]
        {
            let dome = pictured(&transform(matrix), &sky);
            let by_brightness = mean(&dome, |s| f64::from(s.radiance.x));
            let n = 1024;
            let cell = |i: usize| (i as f32 + 0.5) / n as f32;
            // Even in the picture's own space, each direction for as much as it is outside.
            let (mut light, mut all) = (0.0, 0.0);
            for i in 0..n * n {
                let local = warp::sphere(Vec2::new(cell(i % n), cell(i / n))).as_dvec3();
                let stretch = dome.map.stretch(local);
                let outer = dome.map.to_outer(local).as_vec3();
                light += f64::from(dome.radiance(outer).x) * stretch;
                all += stretch;
            }
            assert!((all / (n * n) as f64 - 1.0).abs() < 1e-3, "the whole sphere is all of it");
            let evenly = light / all;
            let ratio = by_brightness / (2.0 * TAU * evenly);
            assert!((ratio - 1.0).abs() < 5e-3, "{ratio} {matrix}");
            // The luminance that competes with the tree is the mean over the sphere.
            let estimate = f64::from(dome.illuminance_estimate() / PI);
            assert!((estimate / evenly - 1.0).abs() < 0.1, "{estimate} {evenly} {matrix}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Some rows are lit from a pole on, up to 8192 in all, tilted: flux is known in closed form.
        #[test]
        fn lit_rows_at_a_pole_give_their_flux(
            height in (1.0..13.01).prop_map(|e| 2f64.powf(e) as u32), lit in 0.0..1.0, is_south in any::<bool>(),
            [a, b] in prop::array::uniform2(-3.0..3.0), bilinear in any::<bool>(),
        ) {
            // Of few or of many.
            let lit = (f64::from(height).powf(lit) as u32).clamp(1, height);
            let is_lit = |y: u32| if is_south { y >= height - lit } else { y < lit };
            let sky = picture(8, height, |_, y| f32::from(u8::from(is_lit(y))));
            let sky = Texture { bilinear, ..sky };
            let turn = DMat3::from_euler(glam::EulerRot::XYZ, a, 0.7, b);
            let dome = pictured(&transform(turn), &sky);
            let flux = mean(&dome, |sample| f64::from(sample.radiance.x));
            // A bilinear lookup ramps down over a row about the edge: integrate by latitude.
            let n = 200_000;
            let radiance = |v: f64| f64::from(sky.lookup(Vec2::new(0.5, v as f32)).x);
            let reach = (f64::from(lit) + 1.0).min(f64::from(height)) / f64::from(height);
            let exact: f64 = (0..n)
                .map(|i| (f64::from(i) + 0.5) / f64::from(n) * reach)
                .map(|v| radiance(if is_south { 1.0 - v } else { v }) * (v * std::f64::consts::PI).sin())
                .sum::<f64>()
                * reach * std::f64::consts::PI * TAU / f64::from(n);
            prop_assert!((flux / exact - 1.0).abs() < 5e-3, "{flux} {exact}: {lit} of {height}");
            // A ray that finds the light another way is told the same density, but for those that
            // rounding takes over the edge of a texel.
            let told = |i: u32| {
                let u = Vec2::new((i as f32 * 0.377).fract(), (i as f32 * 0.719).fract());
                let sample = dome.sample(Vec3::Z, u).unwrap();
                (dome.pdf(Vec3::Z, sample.direction) / sample.pdf - 1.0).abs() < 1e-3
            };
            let same = (0..1000).filter(|&i| told(i)).count();
            prop_assert!(same >= 990, "{same}");
        }
    }

    #[test]
    fn a_dim_sky_beside_a_blinding_sun_is_all_found() {
        // One texel of 1e9 nits in a sky of 1: 24 bits cannot tell the others from none.
        let sky = picture(4096, 16, |x, y| if (x, y) == (100, 5) { 1e9 } else { 1.0 });
        let dome = pictured(&Affine3A::IDENTITY, &sky);
        let dark = (0..4096 * 16)
            .map(|i| DVec2::new(f64::from(i % 4096) + 0.5, f64::from(i / 4096) + 0.5))
            .map(|texel| uv_to_direction(texel / DVec2::new(4096.0, 16.0)).as_vec3())
            .filter(|&direction| dome.pdf(Vec3::Z, direction) <= 0.0)
            .count();
        assert_eq!(dark, 0);
    }

    #[test]
    fn a_dome_shows_its_picture_where_a_sun_would_stand() {
        let sky = picture(64, 32, |x, y| {
            f32::from(u8::from((31..33).contains(&x) && (15..17).contains(&y)))
        });
        for matrix in [
            DMat3::from_diagonal(DVec3::new(1.0, 4.0, 1.0)) * DMat3::from_rotation_x(-0.8),
            DMat3::from_cols(DVec3::X, DVec3::new(0.7, 1.0, 0.0), DVec3::Z * -2.0),
        ] {
            let dome = pictured(&transform(matrix), &sky);
            // The middle of the picture is local +Z, from where light travels along -Z.
            let sun = -crate::math::directions::aim(&transform(matrix)).as_vec3();
            assert!(dome.radiance(sun).x > 0.9);
            assert!(dome.radiance(-sun).x == 0.0);
        }
    }

    #[test]
    fn a_constant_dome_is_sampled_by_the_cosine() {
        let dome = Dome::new(&Affine3A::IDENTITY, Rgb::splat(2.0), None);
        for i in 0..64 {
            let u = Vec2::new((i as f32 * 0.37).fract(), (i as f32 * 0.71).fract());
            let s = dome.sample(Vec3::X, u).unwrap();
            assert!((s.radiance.x * s.direction.x / s.pdf - 2.0 * PI).abs() < 1e-3);
        }
    }

    #[test]
    fn a_black_picture_is_even_and_its_density_a_number() {
        let black = picture(32, 16, |_, _| 0.0);
        let dome = pictured(&Affine3A::IDENTITY, &black);
        assert!(dome.sample(Vec3::Z, Vec2::splat(0.3)).unwrap().pdf.is_finite());
        assert_eq!(dome.illuminance_estimate(), 0.0);
    }
}
