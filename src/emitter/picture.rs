//! Picking directions of a latitude-longitude picture by their brightness.
//!
//! The sphere is divided into the picture's texels. The density is constant over the solid angle of
//! each, so it has no pole where the picture has one, and sampling and density agree exactly: shares
//! are whole numbers of 2^-32, of which every texel that has any light has one at least.

use crate::math::color::{Rgb, luminance};
use crate::math::directions::DirectionMap;
use crate::math::random::widen;
use crate::scene::Texture;
use glam::{DVec2, DVec3, Vec2};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Where a direction is in the picture, both in `[0, 1]`. UsdLux's layout: see
/// [`LightKind::Dome`](crate::scene::LightKind::Dome). Accurate at the poles, where `acos` is not.
pub(super) fn direction_to_uv(direction: DVec3) -> DVec2 {
    let u = (direction.z.atan2(direction.x) + FRAC_PI_2) / TAU;
    let across = direction.x.hypot(direction.z);
    DVec2::new(u - u.floor(), across.atan2(direction.y) / PI)
}

/// Its inverse, unit.
pub(super) fn uv_to_direction(uv: DVec2) -> DVec3 {
    let (sin_phi, cos_phi) = (uv.x * TAU - FRAC_PI_2).sin_cos();
    let (sin_theta, cos_theta) = (uv.y * PI).sin_cos();
    DVec3::new(sin_theta * cos_phi, cos_theta, sin_theta * sin_phi)
}

/// A density over the sphere that is constant over each texel, and there proportional to the
/// brightest texel that a bilinear lookup there can reach.
pub(super) struct PictureDistribution {
    width: usize,
    height: usize,
    rows: Shares,
    /// Of the texels of each row.
    cells: Vec<Shares>,
    /// The mean over the outer sphere.
    pub mean: Rgb,
}

impl PictureDistribution {
    /// Of a picture whose directions a map takes to the outer space, which is where light is even.
    pub fn new(texture: &Texture, map: &DirectionMap) -> PictureDistribution {
        let (width, height) = (texture.width as usize, texture.height as usize);
        let luminances: Vec<f32> = (0..width * height)
            .into_par_iter()
            .map(|i| luminance(texture.texel((i % width) as i64, (i / width) as i64).truncate()))
            .collect();
        let brightest = |x: usize, y: usize| {
            let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
            let columns = [(x + width - 1) % width, x, (x + 1) % width];
            rows.flat_map(|row| columns.map(|column| luminances[row * width + column]))
                .fold(0f32, f32::max)
        };
        let columns: Vec<(f64, f64)> = (0..width)
            .map(|x| uv_to_direction(DVec2::new((x as f64 + 0.5) / width as f64, 0.5)))
            .map(|direction| (direction.x, direction.z))
            .collect();
        let row = |y: usize| {
            let (sin, cos) = (PI * (y as f64 + 0.5) / height as f64).sin_cos();
            let solid_angle = row_solid_angle(y, height) / width as f64;
            let mut weights = Vec::with_capacity(width);
            let (mut light, mut all) = (DVec3::ZERO, 0.0);
            for (x, &(cos_phi, sin_phi)) in columns.iter().enumerate() {
                let direction = DVec3::new(sin * cos_phi, cos, sin * sin_phi);
                let outer = solid_angle * map.stretch(direction);
                weights.push(f64::from(brightest(x, y)) * outer);
                light += texture.texel(x as i64, y as i64).truncate().as_dvec3() * outer;
                all += outer;
            }
            (weights.iter().sum(), Shares::new(&weights), light, all)
        };
        let rows: Vec<(f64, Shares, DVec3, f64)> = (0..height).into_par_iter().map(row).collect();
        let weights: Vec<f64> = rows.iter().map(|row| row.0).collect();
        let light = rows.iter().map(|row| row.2).sum::<DVec3>();
        let all = rows.iter().map(|row| row.3).sum::<f64>();
        PictureDistribution {
            width,
            height,
            rows: Shares::new(&weights),
            cells: rows.into_iter().map(|row| row.1).collect(),
            mean: (light / all).as_vec3(),
        }
    }

    /// A place in the picture.
    pub fn sample(&self, u: Vec2) -> DVec2 {
        // 24 random bits do not address every texel of a large picture.
        let [by_row, by_column] =
            [(u.y, u.x), (u.x, u.y)].map(|(u, other)| widen(u, other.to_bits()));
        let (y, down) = self.rows.pick(by_row);
        let (x, across) = self.cells[y].pick(by_column);
        let v = row_quantile(y, self.height, down);
        DVec2::new((x as f64 + across) / self.width as f64, v)
    }

    /// Density over local solid angle of [`sample`](Self::sample), 1/sr.
    pub fn density(&self, uv: DVec2) -> f64 {
        let x = ((uv.x * self.width as f64) as usize).min(self.width - 1);
        let y = ((uv.y * self.height as f64) as usize).min(self.height - 1);
        let share = self.rows.share(y) * self.cells[y].share(x);
        share * self.width as f64 / row_solid_angle(y, self.height)
    }
}

/// The solid angle of a row, sr: `2 pi (cos a - cos b)`, as a product.
fn row_solid_angle(y: usize, height: usize) -> f64 {
    let half_row = 0.5 * PI / height as f64;
    2.0 * TAU * ((2 * y + 1) as f64 * half_row).sin() * half_row.sin()
}

/// The latitude `v` above which a share of a row's solid angle lies.
fn row_quantile(y: usize, height: usize, share: f64) -> f64 {
    // Counted from the nearer pole, where `1 - cos = 2 sin^2` of the half angle keeps its digits.
    let is_south = 2 * y >= height;
    let (row, share) = if is_south { (height - 1 - y, 1.0 - share) } else { (y, share) };
    let square = |edge: usize| (0.5 * PI * edge as f64 / height as f64).sin().powi(2);
    let (above, below) = (square(row), square(row + 1));
    let v = 2.0 / PI * (above + share * (below - above)).sqrt().min(1.0).asin();
    let v = if is_south { 1.0 - v } else { v };
    // Inside the row whatever the rounding.
    v.clamp((y as f64) / height as f64, ((y + 1) as f64 / height as f64).next_down())
}

/// Shares of a whole, in units of 2^-32: where each begins. The last ends at the whole.
struct Shares(Vec<u32>);

const WHOLE: u64 = 1 << 32;

impl Shares {
    /// In proportion to some weights, but at least one unit for each that is not zero; even if all are
    /// zero.
    fn new(weights: &[f64]) -> Shares {
        // In the order of the loop below, so that it ends at the very same sum.
        let total: f64 = weights.iter().sum();
        let is_dark = !(total > 0.0 && total.is_finite());
        let total = if is_dark { weights.len() as f64 } else { total };
        let weight = |&w: &f64| if is_dark { 1.0 } else { w };
        let lit = weights.iter().map(weight).filter(|&w| w > 0.0).count() as u64;
        // One unit is left over: what is dark at the end has to begin below the whole.
        let spread = (WHOLE - 1 - lit) as f64;
        let (mut running, mut before) = (0.0, 0);
        let starts = weights.iter().map(weight).map(|w| {
            let start = (running / total * spread) as u64 + before;
            running += w;
            before += u64::from(w > 0.0);
            start as u32
        });
        Shares(starts.collect())
    }

    fn ends(&self, i: usize) -> u64 {
        self.0.get(i + 1).map_or(WHOLE, |&start| u64::from(start))
    }

    fn share(&self, i: usize) -> f64 {
        (self.ends(i) - u64::from(self.0[i])) as f64 / WHOLE as f64
    }

    /// Whose share holds `u`, and where in it, inside `(0, 1)`.
    fn pick(&self, u: f64) -> (usize, f64) {
        let at = u * WHOLE as f64;
        let i = self.0.partition_point(|&start| f64::from(start) <= at).max(1) - 1;
        let (start, end) = (f64::from(self.0[i]), self.ends(i) as f64);
        (i, ((at - start) / (end - start)).clamp(f64::EPSILON, 1.0 - f64::EPSILON))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_layout_is_usds_and_inverts_up_to_the_poles(
            v in prop_oneof![(-9.0..-0.31).prop_map(|e| 10f64.powf(e)), 0.0..1.0], u in 0.0..1.0
        ) {
            for v in [v, 1.0 - v] {
                let direction = uv_to_direction(DVec2::new(u, v));
                let back = direction_to_uv(direction);
                // The rounding of 1 - v and of pi.
                prop_assert!((back.y - v).abs() < 2e-16 + 1e-9 * v.min(1.0 - v), "{back} {v}");
                let around = (back.x - u + 0.5).rem_euclid(1.0) - 0.5;
                prop_assert!(around.abs() < 1e-6, "{back} {u}");
            }
        }

        /// Rows of any number, up to the pole, are divided evenly by solid angle.
        #[test]
        fn a_row_is_even_in_solid_angle(
            rows in (0.0..17.0).prop_map(|e| 2f64.powf(e) as usize), at in 0.0..1.0, share in 0.0..1.0
        ) {
            let y = ((at * at * rows as f64) as usize).min(rows - 1);
            for y in [y, rows - 1 - y, 0, rows - 1] {
                let v = row_quantile(y, rows, share);
                prop_assert_eq!((v * rows as f64) as usize, y);
                // cos a - cos b, as a product.
                let between = |a: f64, b: f64| {
                    (0.5 * PI * (a + b)).sin() * (0.5 * PI * (b - a)).sin()
                };
                let edges = [y, y + 1].map(|edge| edge as f64 / rows as f64);
                let got = between(edges[0], v) / between(edges[0], edges[1]);
                prop_assert!((got - share).abs() < 1e-6, "{got} {share} row {y} of {rows}");
            }
        }

        /// Whatever the weights, each is picked as often as it says, and all that are lit are.
        #[test]
        fn shares_are_what_is_picked(
            weights in prop::collection::vec(
                prop_oneof![2 => Just(0.0), 3 => (-30.0..30.0).prop_map(|e| 10f64.powf(e))], 1..40
            )
        ) {
            let shares = Shares::new(&weights);
            let total: f64 = weights.iter().sum();
            let told: f64 = (0..weights.len()).map(|i| shares.share(i)).sum();
            prop_assert_eq!(told, 1.0);
            for (i, &weight) in weights.iter().enumerate() {
                let share = shares.share(i);
                if total > 0.0 {
                    let unit = 1.0 / WHOLE as f64;
                    prop_assert!((share - weight / total).abs() < unit * weights.len() as f64 + unit);
                    prop_assert!(share > 0.0 || weight == 0.0);
                }
                if share > 0.0 {
                    for within in [0.0, 0.5, 0.999_999] {
                        let begin = f64::from(shares.0[i]) / WHOLE as f64;
                        prop_assert_eq!(shares.pick(begin + within * share).0, i);
                    }
                }
            }
            prop_assert!(shares.pick(1.0 - f64::EPSILON).0 < weights.len());
        }
    }

    #[test]
    fn the_middle_of_the_picture_is_z_and_its_top_row_y() {
        assert!((uv_to_direction(DVec2::splat(0.5)) - DVec3::Z).length() < 1e-12);
        assert!((uv_to_direction(DVec2::new(0.3, 0.0)) - DVec3::Y).length() < 1e-12);
    }
}
