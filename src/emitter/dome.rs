//! A dome: light from all around, constant or from a picture that is sampled by its brightness.

use crate::math::color::{Rgb, luminance};
use crate::math::{sum::Sum, warp};
use crate::scene::Texture;
use glam::{Quat, Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Light from infinity in every direction.
pub struct Dome<'a> {
    to_local: Quat,
    radiance_nits: Rgb,
    picture: Option<(&'a Texture, PictureDistribution)>,
    mean_luminance: f32,
}

/// A direction, found.
#[derive(Clone, Copy, Debug)]
pub struct DomeSample {
    /// Unit, world space.
    pub direction: Vec3,
    /// Density over solid angle, 1/sr.
    pub pdf: f32,
}

impl<'a> Dome<'a> {
    /// A dome whose local space is turned into the world by a rotation.
    pub fn new(to_world: Quat, radiance_nits: Rgb, texture: Option<&'a Texture>) -> Dome<'a> {
        let picture = texture.map(|texture| (texture, PictureDistribution::new(texture)));
        let mean = picture.as_ref().map_or(Rgb::ONE, |(_, distribution)| distribution.mean);
        Dome {
            to_local: to_world.inverse(),
            radiance_nits,
            mean_luminance: luminance(radiance_nits * mean),
            picture,
        }
    }

    /// Radiance from a direction (unit, world space), nits.
    pub fn radiance(&self, direction: Vec3) -> Rgb {
        match &self.picture {
            None => self.radiance_nits,
            Some((texture, _)) => {
                let uv = direction_to_uv(self.to_local * direction);
                self.radiance_nits * texture.lookup(uv).truncate()
            }
        }
    }

    /// A direction; by the cosine about a normal if the dome is constant, by brightness if not.
    pub fn sample(&self, normal: Vec3, u: Vec2) -> Option<DomeSample> {
        let direction = match &self.picture {
            None if normal == Vec3::ZERO => warp::sphere(u),
            None => crate::math::Frame::around(normal).to_outer(warp::cosine_hemisphere(u)),
            Some((_, distribution)) => {
                self.to_local.inverse() * uv_to_direction(distribution.sample(u))
            }
        };
        let pdf = self.pdf(normal, direction);
        (pdf > 0.0).then_some(DomeSample { direction, pdf })
    }

    /// Density over solid angle of [`sample`](Self::sample), 1/sr.
    pub fn pdf(&self, normal: Vec3, direction: Vec3) -> f32 {
        match &self.picture {
            None if normal == Vec3::ZERO => 1.0 / (4.0 * PI),
            None => warp::cosine_hemisphere_pdf(normal.dot(direction)),
            Some((_, distribution)) => {
                let local = self.to_local * direction;
                let sine = (1.0 - local.y * local.y).max(1e-12).sqrt();
                distribution.density(direction_to_uv(local)) / (2.0 * PI * PI * sine)
            }
        }
    }

    /// What it may contribute to any surface: its mean luminance over the sphere times pi, lux.
    pub fn illuminance_estimate(&self) -> f32 {
        PI * self.mean_luminance
    }
}

/// Where a direction (unit, dome space) is in the picture.
fn direction_to_uv(direction: Vec3) -> Vec2 {
    let u = (direction.z.atan2(direction.x) + FRAC_PI_2) / TAU;
    Vec2::new(u - u.floor(), direction.y.clamp(-1.0, 1.0).acos() / PI)
}

/// Its inverse.
fn uv_to_direction(uv: Vec2) -> Vec3 {
    let (sin_phi, cos_phi) = (uv.x * TAU - FRAC_PI_2).sin_cos();
    let (sin_theta, cos_theta) = (uv.y * PI).sin_cos();
    Vec3::new(sin_theta * cos_phi, cos_theta, sin_theta * sin_phi)
}

/// A piecewise constant density over the picture, proportional to the brightest of the texels that
/// a bilinear lookup in a cell can reach, times the cell's solid angle.
struct PictureDistribution {
    width: usize,
    height: usize,
    /// Running sums over the rows, and over the cells of each row; both end at 1.
    rows: Vec<f32>,
    cells: Vec<f32>,
    mean: Rgb,
}

impl PictureDistribution {
    fn new(texture: &Texture) -> PictureDistribution {
        let (width, height) = (texture.width as usize, texture.height as usize);
        let luminances: Vec<f32> = (0..width * height)
            .map(|i| luminance(texture.texel((i % width) as i64, (i / width) as i64).truncate()))
            .collect();
        let brightest = |x: usize, y: usize| {
            let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
            let columns = [(x + width - 1) % width, x, (x + 1) % width];
            rows.flat_map(|row| columns.map(|column| luminances[row * width + column]))
                .fold(0f32, f32::max)
        };
        let mut cells = vec![0.0; width * height];
        let mut row_weights = Vec::with_capacity(height);
        let (mut mean, mut solid_angle) = (glam::DVec3::ZERO, 0.0);
        for y in 0..height {
            let sine = f64::from(PI * (y as f32 + 0.5) / height as f32).sin();
            let row = &mut cells[y * width..][..width];
            let weights = (0..width).map(|x| f64::from(brightest(x, y)) * sine);
            row_weights.push(running_shares(weights, row));
            for x in 0..width {
                mean += texture.texel(x as i64, y as i64).truncate().as_dvec3() * sine;
                solid_angle += sine;
            }
        }
        let mut rows = vec![0.0; height];
        running_shares(row_weights.into_iter(), &mut rows);
        PictureDistribution { width, height, rows, cells, mean: (mean / solid_angle).as_vec3() }
    }

    fn row(&self, y: usize) -> &[f32] {
        &self.cells[y * self.width..][..self.width]
    }

    fn sample(&self, u: Vec2) -> Vec2 {
        let (y, v_in_cell) = pick(&self.rows, u.y);
        let (x, u_in_cell) = pick(self.row(y), u.x);
        Vec2::new(
            (x as f32 + u_in_cell) / self.width as f32,
            (y as f32 + v_in_cell) / self.height as f32,
        )
    }

    /// Density over the unit square of [`sample`](Self::sample).
    fn density(&self, uv: Vec2) -> f32 {
        let x = ((uv.x * self.width as f32) as usize).min(self.width - 1);
        let y = ((uv.y * self.height as f32) as usize).min(self.height - 1);
        share(&self.rows, y) * share(self.row(y), x) * (self.width * self.height) as f32
    }
}

/// Writes the running sums of some weights, scaled to end at 1, and returns their total. Without
/// any weight the shares are even.
fn running_shares(weights: impl Iterator<Item = f64> + Clone, shares: &mut [f32]) -> f64 {
    let total = weights.clone().collect::<Sum>().value();
    let even = 1.0 / shares.len() as f64;
    let mut running = 0.0;
    for (share, weight) in shares.iter_mut().zip(weights) {
        running += if total > 0.0 { weight / total } else { even };
        *share = running.min(1.0) as f32;
    }
    if let Some(last) = shares.last_mut() {
        *last = 1.0;
    }
    total
}

/// The share of one cell.
fn share(running: &[f32], i: usize) -> f32 {
    running[i] - if i == 0 { 0.0 } else { running[i - 1] }
}

/// The cell whose share holds `u`, and where in the cell.
fn pick(running: &[f32], u: f32) -> (usize, f32) {
    let i = running.partition_point(|&end| end <= u).min(running.len() - 1);
    let start = if i == 0 { 0.0 } else { running[i - 1] };
    let inside = (u - start) / (running[i] - start).max(f32::MIN_POSITIVE);
    (i, inside.clamp(0.0, 1.0 - f32::EPSILON / 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Pixels, Wrap};

    fn picture() -> Texture {
        let (width, height) = (32, 16);
        let texel = |i: u32| if (i % width, i / width) == (20, 5) { [50.0; 3] } else { [0.1; 3] };
        Texture {
            name: "sky".into(),
            width,
            height,
            pixels: Pixels::Float((0..width * height).map(texel).collect()),
            wrap: [Wrap::Repeat, Wrap::Clamp],
            bilinear: true,
        }
    }

    #[test]
    fn the_layout_is_usds() {
        // The middle of the picture is +Z, the top row +Y.
        assert!((uv_to_direction(Vec2::splat(0.5)) - Vec3::Z).length() < 1e-6);
        assert!((uv_to_direction(Vec2::new(0.3, 0.0)) - Vec3::Y).length() < 1e-6);
        for direction in [Vec3::new(0.3, 0.5, -0.8), Vec3::new(-0.9, -0.1, 0.2)] {
            let direction = direction.normalize();
            assert!((uv_to_direction(direction_to_uv(direction)) - direction).length() < 1e-5);
        }
    }

    #[test]
    fn sampling_integrates_the_picture() {
        let sky = picture();
        let turn = Quat::from_rotation_x(0.4);
        let dome = Dome::new(turn, Rgb::ONE, Some(&sky));
        let n = 512;
        let cell = |i: usize| (i as f32 + 0.5) / n as f32;
        let (mut by_brightness, mut evenly) = (0.0f64, 0.0f64);
        for i in 0..n * n {
            let u = Vec2::new(cell(i % n), cell(i / n));
            if let Some(s) = dome.sample(Vec3::Z, u) {
                by_brightness += f64::from(dome.radiance(s.direction).x / s.pdf);
            }
            evenly += f64::from(dome.radiance(warp::sphere(u)).x) * 4.0 * f64::from(PI);
        }
        assert!((by_brightness / evenly - 1.0).abs() < 5e-3, "{by_brightness} {evenly}");
        // The luminance that competes with the tree is the mean over the sphere.
        let mean = evenly / (n * n) as f64 / (4.0 * f64::from(PI));
        assert!((f64::from(dome.illuminance_estimate()) / f64::from(PI) / mean - 1.0).abs() < 0.02);
    }

    #[test]
    fn a_constant_dome_is_sampled_by_the_cosine() {
        let dome = Dome::new(Quat::IDENTITY, Rgb::splat(2.0), None);
        for i in 0..64 {
            let u = Vec2::new((i as f32 * 0.37).fract(), (i as f32 * 0.71).fract());
            let s = dome.sample(Vec3::X, u).unwrap();
            assert!((dome.radiance(s.direction).x * s.direction.x / s.pdf - 2.0 * PI).abs() < 1e-3);
        }
    }

    #[test]
    fn a_black_picture_is_even_and_not_a_number_of_nothing() {
        let mut black = picture();
        black.pixels = Pixels::Float(vec![[0.0; 3]; 32 * 16]);
        let dome = Dome::new(Quat::IDENTITY, Rgb::ONE, Some(&black));
        assert!(dome.sample(Vec3::Z, Vec2::splat(0.3)).unwrap().pdf.is_finite());
        assert_eq!(dome.illuminance_estimate(), 0.0);
    }
}
