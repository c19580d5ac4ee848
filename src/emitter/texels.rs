//! Textured emission, integrated over a triangle.

use crate::math::color::Rgb;
use crate::scene::{Texture, TextureUse};
use glam::{DVec2, Vec2};
use std::sync::OnceLock;

/// Texels that are looked at for one triangle; of one that covers more the whole texture's mean is
/// taken...
const MOST_TEXELS: f64 = 4_000_000.0;
/// ...and for one of a mesh whose triangles together cover more than [`MOST_TOGETHER`].
const FEW_TEXELS: f64 = 16_384.0;
const MOST_TOGETHER: f64 = 200_000_000.0;

/// A texture's means over the triangles of one mesh.
pub struct TexelMeans<'a> {
    texture: &'a Texture,
    usage: TextureUse,
    most_texels: f64,
    whole: &'a OnceLock<Rgb>,
}

impl<'a> TexelMeans<'a> {
    /// Looks at how much the triangles cover, so that no mesh takes for ever. `whole` keeps the
    /// mean of all texels, once it has been needed.
    pub fn new(
        texture: &'a Texture,
        usage: TextureUse,
        triangles: impl Iterator<Item = [Vec2; 3]>,
        whole: &'a OnceLock<Rgb>,
    ) -> TexelMeans<'a> {
        let covered = |uvs| Footprint::of(texture, &usage, uvs).texels.min(MOST_TEXELS);
        let together: f64 = triangles.map(covered).sum();
        let most_texels = if together > MOST_TOGETHER { FEW_TEXELS } else { MOST_TEXELS };
        TexelMeans { texture, usage, most_texels, whole }
    }

    /// The mean of the texels that bilinear lookups inside a triangle can reach. Zero only if all of
    /// these are black: a triangle with mean zero emits nothing.
    pub fn over(&self, uvs: [Vec2; 3]) -> Rgb {
        let footprint = Footprint::of(self.texture, &self.usage, uvs);
        if footprint.texels <= self.most_texels {
            let all = texels(footprint.min, footprint.max);
            return mean_of(self.texture, all.filter(|&texel| touches(&footprint.corners, texel)));
        }
        *self.whole.get_or_init(|| {
            let size = DVec2::new(self.texture.width.into(), self.texture.height.into());
            mean_of(self.texture, texels(DVec2::ZERO, size - 1.0))
        })
    }
}

/// A triangle on a texture: texel (x, y) has its centre at whole coordinates (x, y).
struct Footprint {
    corners: [DVec2; 3],
    /// First and last texel that a lookup can reach.
    min: DVec2,
    max: DVec2,
    /// How many that rectangle has; infinite for coordinates that are not numbers.
    texels: f64,
}

impl Footprint {
    fn of(texture: &Texture, usage: &TextureUse, uvs: [Vec2; 3]) -> Footprint {
        let size = DVec2::new(texture.width.into(), texture.height.into());
        let corners = uvs.map(|uv| usage.map(uv).as_dvec2() * size - 0.5);
        let min = (corners[0].min(corners[1]).min(corners[2]) - 1.0).ceil();
        let max = (corners[0].max(corners[1]).max(corners[2]) + 1.0).floor();
        let spans = max - min + 1.0;
        let texels = spans.x * spans.y;
        Footprint {
            corners,
            min,
            max,
            texels: if texels.is_nan() { f64::INFINITY } else { texels },
        }
    }
}

/// All texels of a rectangle, both corners included.
fn texels(min: DVec2, max: DVec2) -> impl Iterator<Item = DVec2> {
    let (columns, rows) = ((max.x - min.x) as u64 + 1, (max.y - min.y) as u64 + 1);
    (0..rows).flat_map(move |y| (0..columns).map(move |x| min + DVec2::new(x as f64, y as f64)))
}

fn mean_of(texture: &Texture, texels: impl Iterator<Item = DVec2>) -> Rgb {
    let (mut sum, mut count) = (glam::DVec3::ZERO, 0u64);
    for texel in texels {
        sum += texture.texel(texel.x as i64, texel.y as i64).truncate().as_dvec3();
        count += 1;
    }
    if count == 0 { Rgb::ZERO } else { (sum / count as f64).as_vec3() }
}

/// Whether a triangle meets the open square of half width 1 around a texel's centre, where
/// bilinear weights of that texel are positive (separating axes; the box's own were used by the
/// caller).
fn touches(corners: &[DVec2; 3], texel: DVec2) -> bool {
    let [a, b, c] = corners.map(|corner| corner - texel);
    [(a, b, c), (b, c, a), (c, a, b)].into_iter().all(|(from, to, other)| {
        let normal = (to - from).perp();
        let reach = normal.x.abs() + normal.y.abs();
        let edge = normal.dot(from);
        let inner = normal.dot(other);
        let (low, high) = if inner < edge { (inner, edge) } else { (edge, inner) };
        // The square spans [-reach, reach] along the normal. Flat triangles have low == high.
        low <= reach && high >= -reach
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Pixels, Wrap};

    const USE: TextureUse = TextureUse { texture: 0, uv_set: 0, transform: None };

    fn mean_over_triangle(texture: &Texture, usage: &TextureUse, uvs: [Vec2; 3]) -> Rgb {
        TexelMeans::new(texture, *usage, std::iter::once(uvs), &OnceLock::new()).over(uvs)
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
        let whole = OnceLock::new();
        let many = (0..100_000).map(|_| tiled);
        let means = TexelMeans::new(&half, USE, many, &whole);
        assert!((0..100_000).all(|_| (means.over(tiled).x - 0.5).abs() < 1e-6));
    }

    #[test]
    fn absurd_coordinates_give_the_mean_of_all() {
        let half = texture(|x, _| x >= 32);
        for far in [1e9, f32::INFINITY, f32::NAN] {
            let corners = [Vec2::ZERO, Vec2::new(far, 0.0), Vec2::new(0.0, far)];
            assert!((mean_over_triangle(&half, &USE, corners).x - 0.5).abs() < 1e-6);
        }
    }
}
