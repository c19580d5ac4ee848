//! The oracle: what a table of exact visibility would give.
//!
//! Each probe is a cell of its own, and each cluster that is looked into there is weighed by the share of
//! its light that exactly arrives. Nothing that is learned can know more with as many clusters.

use super::contributions::Contributions;
use crate::light_tree::veil::encode;
use crate::light_tree::{FrameTree, Picked, Veil, Viewer, WIDTH};

/// The veils of a probe, for so many clusters: of the tree, and beside it. `all` is what it would receive
/// if nothing were in the way.
pub fn veils<V: Viewer>(
    tree: &FrameTree,
    viewer: &V,
    clusters: u32,
    (seen, all): (&Contributions, &Contributions),
) -> (Vec<Veil>, Vec<u8>) {
    let groups = tree.front(&[*viewer], (clusters as usize).div_ceil(WIDTH)).groups;
    let mut sums = vec![[[0.0; 2]; WIDTH]; groups.len()];
    for emitter in 0..tree.unforced_count() {
        let light = Picked::Emitter(emitter);
        let own = [seen.luminance(light), all.luminance(light)];
        tree.for_each_lane_toward(emitter, |group, lane| {
            if let Ok(at) = groups.binary_search_by_key(&group, |row| row.group) {
                sums[at][lane] = [0, 1].map(|i| sums[at][lane][i] + own[i]);
            }
        });
    }
    let byte = |[seen, all]: [f64; 2]| if all > 0.0 { encode((seen / all).sqrt()) } else { 255 };
    let rows = groups.iter().zip(sums);
    let rows = rows.map(|(row, sums)| Veil { group: row.group, weights: sums.map(byte) });
    let beside = (0..seen.beside_count() as u32).map(Picked::Beside);
    let beside = beside.map(|light| byte([seen.luminance(light), all.luminance(light)]));
    (rows.collect(), beside.collect())
}
