//! Textured emission, integrated over a triangle.

use super::texel_rows::TexelRows;
use crate::math::color::Rgb;
use crate::scene::TextureUse;
use glam::{DVec2, DVec3, Vec2};

/// Rows of texels that are looked at for one triangle. One that covers more, of a texture that is
/// tiled over it, gets the mean of the whole texture...
const MOST_ROWS: f64 = 65_536.0;
/// ...and so does one that covers more than this, of a mesh whose triangles together cover more than
/// [`MOST_TOGETHER`].
const FEW_ROWS: f64 = 128.0;
const MOST_TOGETHER: f64 = 50_000_000.0;
/// Columns are counted without loss up to here.
const MOST_COLUMNS: f64 = (1u64 << 50) as f64;
/// How far a lookup may be off where exact arithmetic has it, relative to the coordinates: what `f32`
/// loses between corners and texels.
const SLACK: f64 = 4.0 * f32::EPSILON as f64;

/// A texture's means over the triangles of one mesh.
pub struct TexelMeans<'a> {
    rows: &'a TexelRows<'a>,
    usage: TextureUse,
    most_rows: f64,
}

impl<'a> TexelMeans<'a> {
    /// Looks at how much the triangles cover, so that no mesh takes for ever.
    pub fn new(
        rows: &'a TexelRows<'a>,
        usage: TextureUse,
        triangles: impl Iterator<Item = [Vec2; 3]>,
    ) -> TexelMeans<'a> {
        let covered = |uvs| Footprint::of(rows, &usage, uvs).row_count().min(MOST_ROWS);
        let together: f64 = triangles.map(covered).sum();
        let most_rows = if together > MOST_TOGETHER { FEW_ROWS } else { MOST_ROWS };
        TexelMeans { rows, usage, most_rows }
    }

    /// The mean of the texels that bilinear lookups inside a triangle can reach. Zero only if all of
    /// these are black: a triangle with mean zero emits nothing.
    pub fn over(&self, uvs: [Vec2; 3]) -> Rgb {
        let footprint = Footprint::of(self.rows, &self.usage, uvs);
        if !footprint.is_countable() || footprint.row_count() > self.most_rows {
            return positive(self.rows.mean());
        }
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        for row in footprint.first_row as i64..=footprint.last_row as i64 {
            let Some([first, last]) = footprint.columns(row as f64) else { continue };
            if first <= last {
                sum += self.rows.sum(row, first as i64, last as i64);
                count += last - first + 1.0;
            }
        }
        positive(if count == 0.0 { DVec3::ZERO } else { sum / count })
    }
}

/// Rounded to `f32`, but never from above zero to zero.
fn positive(mean: DVec3) -> Rgb {
    let least = |exact: f64| if exact > 0.0 { f32::MIN_POSITIVE } else { 0.0 };
    mean.as_vec3().max(Rgb::from_array(mean.to_array().map(least)))
}

/// A triangle on a texture: texel (x, y) has its centre at whole coordinates (x, y).
struct Footprint {
    corners: [DVec2; 3],
    /// How far from a texel's centre a lookup can be that it has a part in.
    reach: DVec2,
    first_row: f64,
    last_row: f64,
}

impl Footprint {
    fn of(rows: &TexelRows, usage: &TextureUse, uvs: [Vec2; 3]) -> Footprint {
        let texture = rows.texture();
        let size = DVec2::new(texture.width.into(), texture.height.into());
        let corners = uvs.map(|uv| usage.map(uv).as_dvec2() * size - 0.5);
        let largest = uvs.iter().fold(Vec2::ONE, |largest, &uv| {
            let parts = usage.transform.map_or(Vec2::ZERO, |transform| {
                transform.matrix2.x_axis.abs() * uv.x.abs()
                    + transform.matrix2.y_axis.abs() * uv.y.abs()
                    + transform.translation.abs()
            });
            largest.max(uv.abs()).max(parts)
        });
        let reach = 1.0 + SLACK * largest.as_dvec2() * size;
        let [a, b, c] = corners.map(|corner| corner.y);
        Footprint {
            corners,
            reach,
            first_row: (a.min(b).min(c) - reach.y).ceil(),
            last_row: (a.max(b).max(c) + reach.y).floor(),
        }
    }

    /// Whether columns and rows are numbers that can be counted with.
    fn is_countable(&self) -> bool {
        let is_near = |corner: &DVec2| corner.abs().cmplt(DVec2::splat(MOST_COLUMNS)).all();
        self.corners.iter().all(is_near)
    }

    /// Infinite for coordinates that are not numbers.
    fn row_count(&self) -> f64 {
        let count = self.last_row - self.first_row + 1.0;
        if count.is_nan() { f64::INFINITY } else { count }
    }

    /// First and last column that lookups inside the triangle can reach in a row.
    fn columns(&self, row: f64) -> Option<[f64; 2]> {
        let (low, high) = (row - self.reach.y, row + self.reach.y);
        let [a, b, c] = self.corners;
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for (a, b) in [(a, b), (b, c), (c, a)] {
            let (a, b) = if a.y <= b.y { (a, b) } else { (b, a) };
            if b.y < low || a.y > high {
                continue;
            }
            let at = |y: f64| a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y));
            let from = if a.y < low { at(low) } else { a.x };
            let to = if b.y > high { at(high) } else { b.x };
            least = least.min(from).min(to);
            most = most.max(from).max(to);
        }
        let found = [(least - self.reach.x).ceil(), (most + self.reach.x).floor()];
        (least <= most).then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::hash;
    use crate::scene::{Pixels, Texture, Wrap};
    use proptest::prelude::*;

    const USE: TextureUse = TextureUse { texture: 0, uv_set: 0, transform: None };

    fn mean_over_triangle(texture: &Texture, usage: &TextureUse, uvs: [Vec2; 3]) -> Rgb {
        let rows = TexelRows::new(texture);
        TexelMeans::new(&rows, *usage, std::iter::once(uvs)).over(uvs)
    }

    /// 64 x 64, white where `lit` says so.
    fn texture(lit: impl Fn(usize, usize) -> bool) -> Texture {
        let texel = |i: usize| [if lit(i % 64, i / 64) { 255 } else { 0 }; 4];
        Texture {
            name: "test".into(),
            width: 64,
            height: 64,
            pixels: Pixels::Linear8((0..64 * 64).map(texel).collect()),
            wrap: [Wrap::Repeat; 2],
            bilinear: true,
        }
    }

    #[test]
    fn black_texels_mean_exactly_no_light() {
        let half = texture(|x, _| x >= 32);
        let dark = [Vec2::new(0.05, 0.1), Vec2::new(0.4, 0.1), Vec2::new(0.2, 0.9)];
        assert_eq!(mean_over_triangle(&half, &USE, dark), Rgb::ZERO);
        let reaching = [Vec2::new(0.05, 0.1), Vec2::new(0.5, 0.1), Vec2::new(0.2, 0.9)];
        assert!(mean_over_triangle(&half, &USE, reaching).x > 0.0);
    }

    #[test]
    fn one_bright_texel_is_never_missed() {
        let dot = texture(|x, y| (x, y) == (40, 17));
        let big = [Vec2::new(0.0, 0.0), Vec2::new(1.0, 0.0), Vec2::new(1.0, 1.0)];
        let mean = mean_over_triangle(&dot, &USE, big).x;
        assert!(mean > 0.0 && (mean * 64.0 * 64.0 / 2.0 - 1.0).abs() < 0.2, "{mean}");
    }

    #[test]
    fn the_mean_is_the_covered_share() {
        let half = texture(|x, _| x >= 32);
        let across = [Vec2::new(0.25, 0.25), Vec2::new(0.75, 0.25), Vec2::new(0.5, 0.75)];
        assert!((mean_over_triangle(&half, &USE, across).x - 0.5).abs() < 0.02);
        let point = [Vec2::splat(0.75); 3];
        assert_eq!(mean_over_triangle(&half, &USE, point).x, 1.0);
    }

    #[test]
    fn many_tiled_triangles_take_the_whole_mean() {
        let half = texture(|x, _| x >= 32);
        let tiled = [Vec2::ZERO, Vec2::new(30.0, 0.0), Vec2::new(0.0, 30.0)];
        let rows = TexelRows::new(&half);
        let means = TexelMeans::new(&rows, USE, (0..100_000).map(|_| tiled));
        assert!((0..100_000).all(|_| (means.over(tiled).x - 0.5).abs() < 1e-6));
    }

    #[test]
    fn absurd_coordinates_give_the_mean_of_all() {
        let half = texture(|x, _| x >= 32);
        for far in [1e9, 1e30, f32::INFINITY, f32::NAN] {
            for corners in [
                [Vec2::ZERO, Vec2::new(far, 0.0), Vec2::new(0.0, far)],
                [Vec2::ZERO, Vec2::new(far, 0.0), Vec2::new(far, 1.0)],
            ] {
                assert!((mean_over_triangle(&half, &USE, corners).x - 0.5).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_faint_mean_is_not_rounded_to_nothing() {
        let mut faint = texture(|_, _| false);
        let mut texels = vec![[0.0; 3]; 64 * 64];
        texels[1000] = [1e-45, 0.0, 0.0];
        faint.pixels = Pixels::Float(texels);
        let big = [Vec2::ZERO, Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)];
        let mean = mean_over_triangle(&faint, &USE, big);
        assert!(mean.x > 0.0 && mean.y == 0.0, "{mean}");
    }

    fn any_uv() -> impl Strategy<Value = Vec2> {
        let coordinate =
            || prop_oneof![3 => -1.5f32..2.5, 1 => (-64..128).prop_map(|i| i as f32 / 64.0)];
        let size = prop_oneof![3 => Just(1f32), 1 => Just(0.02), 1 => Just(30.0)];
        (coordinate(), coordinate(), size).prop_map(|(u, v, size)| Vec2::new(u, v) * size)
    }

    proptest! {
        /// Zero is a theorem: a lookup anywhere inside a triangle whose mean is zero finds black.
        /// And a texel in which lookups have a part is never left out.
        #[test]
        fn zero_is_proved(
            uvs in prop::array::uniform3(any_uv()),
            lit in any::<u32>(),
            share in 1u32..400,
            wrap in prop_oneof![Just(Wrap::Repeat), Just(Wrap::Mirror), Just(Wrap::Clamp)],
            bilinear in any::<bool>(),
        ) {
            let spots = |x: usize, y: usize| hash(lit, (x + 64 * y) as u32) % 400 < share % 7;
            let texture = Texture { wrap: [wrap; 2], bilinear, ..texture(spots) };
            let is_dark = mean_over_triangle(&texture, &USE, uvs) == Rgb::ZERO;
            let [a, b, c] = uvs;
            for i in 0..300 {
                let [x, y] = [0, 1].map(|k| hash(lit ^ k, i) as f32 / u32::MAX as f32);
                // Inside, on an edge, at a corner.
                let (x, y) = match i % 4 {
                    0 => (x, 0.0),
                    1 => (x, 1.0 - x),
                    2 => (x.round(), y.round().min(1.0 - x.round())),
                    _ if x + y > 1.0 => (1.0 - x, 1.0 - y),
                    _ => (x, y),
                };
                let found = texture.lookup(a + (b - a) * x + (c - a) * y);
                prop_assert!(!is_dark || found.truncate() == Rgb::ZERO, "{uvs:?}");
            }
        }
    }
}
