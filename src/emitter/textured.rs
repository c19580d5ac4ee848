//! What an emission texture gives each triangle of a mesh: all of a textured light that is costly to
//! find, and so what a tree file keeps.

use super::texel_rows::TexelRows;
use super::texels::TexelMeans;
use crate::math::color::Rgb;
use crate::scene::{Mesh, Scene, Texture, TextureUse};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};

/// Part of every fingerprint: changes whenever the same texture would give other means.
const VERSION: u32 = 1;
/// Triangles that are integrated between two reports to whoever watches.
const TOGETHER: usize = 256;

/// The means of a texture over the triangles of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureMeans {
    /// BLAKE3 over everything that the means depend on: the texels and how they are looked up, the
    /// mesh's texture coordinates and its triangles.
    pub fingerprint: [u8; 32],
    /// Of the triangles that are not dark, ascending.
    pub lit: Vec<LitTriangle>,
}

/// A triangle over which a texture is not black.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LitTriangle {
    /// Its number in the mesh.
    pub triangle: u32,
    /// The mean of the texture over it, linear Rec. 709; not all zero.
    pub mean: Rgb,
}

/// Means that are known already, by fingerprint; and who watches while the others are worked out.
pub struct KnownMeans<'a> {
    /// What is known. What does not fit its mesh is not used.
    pub find: &'a (dyn Fn(&[u8; 32]) -> Option<Vec<LitTriangle>> + Sync),
    /// Is told how many triangles are integrated, of how many.
    pub watch: &'a (dyn Fn(u64, u64) + Sync),
}

impl KnownMeans<'static> {
    /// Nothing is known, and nobody watches.
    pub const NONE: KnownMeans<'static> = KnownMeans { find: &|_| None, watch: &|_, _| {} };
}

/// A mesh with an emission texture.
struct Textured<'a> {
    mesh: &'a Mesh,
    usage: TextureUse,
}

impl<'a> Textured<'a> {
    /// `None` if the emission is the same everywhere.
    fn of(scene: &'a Scene, mesh: u32) -> Option<Textured<'a>> {
        let usage = scene.material_of(mesh)?.emission_texture?;
        let mesh = &scene.meshes[mesh as usize];
        let uvs = mesh.uv_sets.get(usage.uv_set as usize)?;
        (!uvs.is_empty()).then_some(Textured { mesh, usage })
    }

    fn uvs(&self, triangle: &[u32; 3]) -> [glam::Vec2; 3] {
        let uvs = &self.mesh.uv_sets[self.usage.uv_set as usize];
        triangle.map(|corner| uvs[corner as usize])
    }

    /// Over all that its means depend on, the texture by its own fingerprint.
    fn fingerprint(&self, of_texture: &[u8; 32]) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&VERSION.to_le_bytes()).update(of_texture);
        let transform = self.usage.transform.map(|transform| transform.to_cols_array());
        hasher.update(&[transform.is_some().into()]);
        hasher.update(bytemuck::bytes_of(&transform.unwrap_or_default()));
        let uvs = &self.mesh.uv_sets[self.usage.uv_set as usize];
        hasher.update(&(uvs.len() as u64).to_le_bytes());
        hasher.update_rayon(bytemuck::cast_slice(uvs));
        hasher.update_rayon(bytemuck::cast_slice(&self.mesh.triangles));
        *hasher.finalize().as_bytes()
    }

    /// What is known of it, if that can be so.
    fn known(&self, fingerprint: &[u8; 32], known: &KnownMeans) -> Option<TextureMeans> {
        let lit = (known.find)(fingerprint)?;
        let is_mean =
            |mean: Rgb| mean.is_finite() && mean.min_element() >= 0.0 && mean != Rgb::ZERO;
        let fits = lit.is_sorted_by(|a, b| a.triangle < b.triangle)
            && lit.last().is_none_or(|lit| (lit.triangle as usize) < self.mesh.triangles.len())
            && lit.iter().all(|lit| is_mean(lit.mean));
        fits.then_some(TextureMeans { fingerprint: *fingerprint, lit })
    }

    fn integrate(&self, rows: &TexelRows, done: impl Fn(usize) + Sync) -> Vec<LitTriangle> {
        let triangles = &self.mesh.triangles;
        let means = TexelMeans::new(rows, self.usage, triangles.iter().map(|t| self.uvs(t)));
        let chunks = triangles.par_chunks(TOGETHER).enumerate().map(|(chunk, triangles)| {
            let numbers = (chunk * TOGETHER) as u32..;
            let lit = numbers.zip(triangles).filter_map(|(triangle, corners)| {
                let mean = means.over(self.uvs(corners));
                (mean != Rgb::ZERO).then_some(LitTriangle { triangle, mean })
            });
            let lit: Vec<LitTriangle> = lit.collect();
            done(triangles.len());
            lit
        });
        chunks.flatten_iter().collect()
    }
}

/// The means of all of some meshes that have an emission texture, by mesh.
pub(super) fn means_of(
    scene: &Scene,
    meshes: &[u32],
    known: &KnownMeans,
) -> HashMap<u32, TextureMeans> {
    let textured: Vec<(u32, Textured)> =
        meshes.iter().filter_map(|&mesh| Some((mesh, Textured::of(scene, mesh)?))).collect();
    let mut used: Vec<u32> = textured.iter().map(|(_, textured)| textured.usage.texture).collect();
    used.sort_unstable();
    used.dedup();
    let texture = |row: u32| &scene.textures[row as usize];
    let textures: HashMap<u32, ([u8; 32], TexelRows)> = used
        .into_par_iter()
        .map(|row| (row, (fingerprint_of(texture(row)), TexelRows::new(texture(row)))))
        .collect();
    let look_up = |(mesh, textured): &(u32, Textured)| {
        let fingerprint = textured.fingerprint(&textures[&textured.usage.texture].0);
        (*mesh, fingerprint, textured.known(&fingerprint, known))
    };
    let found: Vec<_> = textured.par_iter().map(look_up).collect();
    let is_unknown = |(_, found): &(&(u32, Textured), &(_, _, Option<_>))| found.2.is_none();
    let unknown = textured.iter().zip(&found).filter(is_unknown);
    let all: u64 = unknown.map(|((_, textured), _)| textured.mesh.triangles.len() as u64).sum();
    let done = AtomicU64::new(0);
    let report = |count: usize| {
        let before = done.fetch_add(count as u64, Ordering::Relaxed);
        (known.watch)(before + count as u64, all);
    };
    let work = textured.par_iter().zip(found).map(|((_, textured), (mesh, fingerprint, known))| {
        let rows = &textures[&textured.usage.texture].1;
        let integrate = || TextureMeans { fingerprint, lit: textured.integrate(rows, report) };
        (mesh, known.unwrap_or_else(integrate))
    });
    work.collect()
}

/// BLAKE3 over the texels and how they are looked up.
fn fingerprint_of(texture: &Texture) -> [u8; 32] {
    use crate::scene::{Pixels, Wrap};
    let coding = match texture.pixels {
        Pixels::Srgb8(_) => 0,
        Pixels::Linear8(_) => 1,
        Pixels::Float(_) => 2,
    };
    let [u, v] = texture.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    });
    let mut hasher = blake3::Hasher::new();
    hasher.update(&[coding, u, v, texture.bilinear.into()]);
    hasher.update(&texture.width.to_le_bytes()).update(&texture.height.to_le_bytes());
    hasher.update_rayon(texture.bytes());
    *hasher.finalize().as_bytes()
}
