//! Decoded images and how they are looked up.

use crate::math::color::srgb_to_linear;
use glam::{Affine2, DVec3, Vec2, Vec3, Vec4};
use std::ops::Range;
use std::sync::LazyLock;

/// An image, ready to be looked up.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Its name or URI, for messages.
    pub name: String,
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// Rows from the top, as glTF has them.
    pub pixels: Pixels,
    /// How coordinates outside [0, 1] wrap, in u and in v.
    pub wrap: [Wrap; 2],
    /// Bilinear; otherwise nearest.
    pub bilinear: bool,
}

/// Stored form of an image. Colour textures in 8 bits are kept encoded and decoded at lookup.
#[derive(Clone, Debug)]
pub enum Pixels {
    /// Eight bits, sRGB-encoded colour with linear alpha.
    Srgb8(Vec<[u8; 4]>),
    /// Eight bits, linear.
    Linear8(Vec<[u8; 4]>),
    /// Linear floats.
    Float(Vec<[f32; 3]>),
}

/// How a coordinate outside [0, 1] is brought back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every other one mirrored.
    Mirror,
    /// Holds the edge.
    Clamp,
}

/// A material's use of a texture: which image, by which coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureUse {
    /// Index into [`Scene::textures`](super::Scene::textures).
    pub texture: u32,
    /// Which of the mesh's texture sets.
    pub uv_set: u32,
    /// `KHR_texture_transform`, applied to the coordinates.
    pub transform: Option<Affine2>,
}

impl TextureUse {
    /// Applies the coordinates' transform.
    #[inline]
    pub fn map(&self, uv: Vec2) -> Vec2 {
        self.transform.map_or(uv, |transform| transform.transform_point2(uv))
    }
}

impl Texture {
    /// The opacity of each texel, 255 for all of it, row after row; nothing if it has no alpha.
    pub fn opacities(&self) -> impl Iterator<Item = u8> + '_ {
        let texels: &[[u8; 4]] = match &self.pixels {
            Pixels::Srgb8(texels) | Pixels::Linear8(texels) => texels,
            Pixels::Float(_) => &[],
        };
        texels.iter().map(|&[_, _, _, opacity]| opacity)
    }

    /// The bytes of the image as it is stored.
    pub fn bytes(&self) -> &[u8] {
        match &self.pixels {
            Pixels::Srgb8(texels) | Pixels::Linear8(texels) => texels.as_flattened(),
            Pixels::Float(texels) => bytemuck::cast_slice(texels),
        }
    }

    /// The linear colour and alpha at a texture coordinate (v downwards, as glTF has it).
    pub fn lookup(&self, uv: Vec2) -> Vec4 {
        let size = Vec2::new(self.width as f32, self.height as f32);
        let wrapped = Vec2::new(self.wrap[0].apply(uv.x), self.wrap[1].apply(uv.y));
        if !self.bilinear {
            let texel = (wrapped * size).floor();
            return self.texel(texel.x as i64, texel.y as i64);
        }
        let at = wrapped * size - 0.5;
        let corner = at.floor();
        let (fraction, x, y) = (at - corner, corner.x as i64, corner.y as i64);
        let top = self.texel(x, y).lerp(self.texel(x + 1, y), fraction.x);
        let bottom = self.texel(x, y + 1).lerp(self.texel(x + 1, y + 1), fraction.x);
        top.lerp(bottom, fraction.y)
    }

    /// One texel by column and row, wrapped if they are outside.
    pub fn texel(&self, x: i64, y: i64) -> Vec4 {
        let column = self.wrap[0].index(x, self.width);
        let row = self.wrap[1].index(y, self.height);
        self.stored(column, row)
    }

    /// The sum of the linear colours of some columns of a row, all inside.
    ///
    /// # Panics
    /// If a texel is behind the last.
    pub fn sum(&self, columns: Range<usize>, row: usize) -> DVec3 {
        fn add<T: Copy>(texels: &[T], color: impl Fn(T) -> [f32; 3]) -> DVec3 {
            let color = |&texel| DVec3::from_array(color(texel).map(f64::from));
            texels.iter().map(color).sum()
        }
        let first = row * self.width as usize;
        let run = first + columns.start..first + columns.end;
        match &self.pixels {
            Pixels::Srgb8(texels) => {
                let decoded: &[f32; 256] = &SRGB_DECODED;
                let decode = |code: u8| decoded[usize::from(code)];
                add(&texels[run], |[r, g, b, _]| [decode(r), decode(g), decode(b)])
            }
            Pixels::Linear8(texels) => {
                add(&texels[run], |[r, g, b, _]| [r, g, b].map(|code| f32::from(code) / 255.0))
            }
            Pixels::Float(texels) => add(&texels[run], |texel| texel),
        }
    }

    /// One texel by column and row, both inside.
    #[inline]
    fn stored(&self, column: usize, row: usize) -> Vec4 {
        let at = row * self.width as usize + column;
        match &self.pixels {
            Pixels::Srgb8(texels) => {
                let [r, g, b, a] = texels[at];
                let decode = |code: u8| SRGB_DECODED[code as usize];
                Vec4::new(decode(r), decode(g), decode(b), f32::from(a) / 255.0)
            }
            Pixels::Linear8(texels) => Vec4::from(texels[at].map(|code| f32::from(code) / 255.0)),
            Pixels::Float(texels) => Vec3::from(texels[at]).extend(1.0),
        }
    }
}

impl Wrap {
    /// Brings a coordinate into [0, 1].
    fn apply(self, x: f32) -> f32 {
        match self {
            Wrap::Repeat => x - x.floor(),
            Wrap::Mirror => 1.0 - ((x * 0.5 - (x * 0.5).floor()) * 2.0 - 1.0).abs(),
            Wrap::Clamp => x.clamp(0.0, 1.0),
        }
    }

    /// Brings a texel index back inside.
    pub fn index(self, i: i64, size: u32) -> usize {
        let size = i64::from(size);
        let inside = match self {
            Wrap::Repeat => i.rem_euclid(size),
            Wrap::Mirror => {
                let there_and_back = i.rem_euclid(2 * size);
                there_and_back.min(2 * size - 1 - there_and_back)
            }
            Wrap::Clamp => i.clamp(0, size - 1),
        };
        inside as usize
    }
}

/// Every 8-bit sRGB code, decoded.
static SRGB_DECODED: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| srgb_to_linear(code as f32 / 255.0)));

#[cfg(test)]
mod tests {
    use super::*;

    fn checker(wrap: Wrap, bilinear: bool) -> Texture {
        let (black, white) = ([0, 0, 0, 255], [255; 4]);
        let pixels = Pixels::Srgb8(vec![black, white, white, black]);
        Texture { name: "checker".into(), width: 2, height: 2, pixels, wrap: [wrap; 2], bilinear }
    }

    #[test]
    fn texels_are_found_where_they_are() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let nearest = checker(wrap, false);
            assert_eq!(nearest.lookup(Vec2::new(0.25, 0.25)).x, 0.0);
            assert_eq!(nearest.lookup(Vec2::new(0.75, 0.25)).x, 1.0);
        }
        assert_eq!(checker(Wrap::Repeat, false).lookup(Vec2::new(-0.25, 0.25)).x, 1.0);
        assert_eq!(checker(Wrap::Mirror, false).lookup(Vec2::new(-0.25, 0.25)).x, 0.0);
        assert_eq!(checker(Wrap::Clamp, false).lookup(Vec2::new(1.25, 0.25)).x, 1.0);
    }

    #[test]
    fn the_middle_of_a_checker_is_grey() {
        let grey = checker(Wrap::Repeat, true).lookup(Vec2::splat(0.5));
        assert!((grey.x - 0.5).abs() < 1e-6);
    }

    #[test]
    fn absurd_coordinates_stay_inside() {
        for uv in [1e30, -1e30, f32::MAX, f32::INFINITY, f32::NAN] {
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                checker(wrap, true).lookup(Vec2::splat(uv));
            }
        }
    }
}
