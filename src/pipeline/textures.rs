//! The means of emission textures: worked out, or taken from a tree file that has them.

use crate::emitter::{Emitters, KnownMeans, LitTriangle, TextureMeans};
use crate::light_tree::{LightTree, MeanRow};
use crate::math::color::Rgb;
use crate::scene::Scene;

/// The emitters of a scene. The means of emission textures over triangles are looked up in a tree file by
/// the fingerprint of all that they depend on. Those that it lacks are computed, and `watch` is told how
/// many triangles are done, of how many.
pub fn collect_emitters<D: AsRef<[u8]> + Sync>(
    scene: &Scene,
    tree: Option<&LightTree<D>>,
    watch: &(dyn Fn(u64, u64) + Sync),
) -> Emitters {
    let find = |fingerprint: &[u8; 32]| {
        let means = tree?.means_of(fingerprint)?;
        Some(means.iter().map(lit).collect())
    };
    Emitters::collect_knowing(scene, &KnownMeans { find: &find, watch })
}

fn lit(row: &MeanRow) -> LitTriangle {
    LitTriangle { triangle: row.triangle, mean: Rgb::from_array(row.mean) }
}

/// The rows of a file that keep some means.
pub(super) fn rows(means: &TextureMeans) -> impl Iterator<Item = MeanRow> + '_ {
    let row = |lit: &LitTriangle| MeanRow { triangle: lit.triangle, mean: lit.mean.to_array() };
    means.lit.iter().map(row)
}

/// Whether a file has just these means.
pub(super) fn has_just<D: AsRef<[u8]>>(tree: &LightTree<D>, textures: &[TextureMeans]) -> bool {
    let has = |means: &TextureMeans| {
        let found = tree.means_of(&means.fingerprint);
        found.is_some_and(|found| found.iter().copied().eq(rows(means)))
    };
    tree.textures().len() == textures.len() && textures.iter().all(has)
}
