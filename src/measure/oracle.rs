//! The oracle: what a table of exact visibility would give.
//!
//! Each probe is a cell of its own, and each cluster that is looked into there is weighed by the share of
//! its light that exactly arrives. Nothing that is learned can know more with as many clusters.

use super::contributions::Contributions;
use crate::light_tree::veil::{BESIDE, encode};
use crate::light_tree::{FrameTree, Picked, Veil, Viewer, WIDTH};

/// The veils of a probe, for so many clusters, and for what is beside the tree. `all` is what it would receive
/// if nothing were in the way.
pub fn veils<V: Viewer>(
    tree: &FrameTree,
    viewer: &V,
    clusters: u32,
    (seen, all): (&Contributions, &Contributions),
) -> Vec<Veil> {
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
    let beside = seen.beside_count();
    let rows_beside = (0..beside.div_ceil(WIDTH)).map(|row| {
        let of_lane = |lane: usize| match row * WIDTH + lane {
            at if at < beside => {
                let light = Picked::Beside(at as u32);
                byte([seen.luminance(light), all.luminance(light)])
            }
            _ => 255,
        };
        Veil { group: BESIDE + row as u32, weights: std::array::from_fn(of_lane) }
    });
    rows.chain(rows_beside).collect()
}
