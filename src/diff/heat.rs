//! Where in a camera's view direct light changed.

use super::scene_side::SceneSide;
use crate::light_tree::LightTree;
use crate::measure::direct_light;
use crate::pipeline::ASPECT;
use crate::render::{RenderDelegate, RenderSettings};

/// A coarse picture of direct light before and after. The camera ray through the middle of each cell
/// finds a surface; the cell tells how much light from all lights this surface reflects to the camera.
/// Each version is seen through its own camera.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatMap {
    /// Cells in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row after row from the top left. `None` where neither version has a surface that reflects.
    pub cells: Vec<Option<HeatCell>>,
    /// Whether surfaces cast shadows; if not, light passes through everything.
    pub shadows: bool,
}

/// One cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeatCell {
    /// Reflected luminance before, nits; 0 if nothing is hit.
    pub before_nits: f32,
    /// Reflected luminance after, nits.
    pub after_nits: f32,
}

impl HeatCell {
    /// `log2` of the ratio: 1 is twice as bright. 0 where both are dark, infinite where one is.
    pub fn stops(&self) -> f32 {
        if self.before_nits == self.after_nits {
            return 0.0;
        }
        (self.after_nits / self.before_nits).log2()
    }
}

/// Cells in a row, at most.
const WIDTH: u32 = 96;
/// Cells times emitters, at most, so that a map takes seconds rather than minutes.
const MOST_LIGHTINGS: u64 = 1 << 26;
/// Cells times emitters, at most, if each is a shadow ray.
const MOST_RAYS: u64 = 1 << 23;
/// Cells in a row, at least, even beyond [`MOST_LIGHTINGS`]: a coarser map would tell nothing.
const LEAST_WIDTH: u32 = 16;

/// The map of two scenes, each seen through its own camera; `None` if one has no camera. The more
/// emitters there are, the coarser the map is.
pub(super) fn map<D: AsRef<[u8]> + Sync>(
    sides: [&SceneSide; 2],
    trees: [&LightTree<D>; 2],
) -> Option<HeatMap> {
    let [Some(before), Some(after)] = sides.map(|side| side.camera.cloned()) else { return None };
    let aspect = after.aspect.unwrap_or(ASPECT);
    let emitters = sides.map(|side| side.emitters.len().max(1)).into_iter().max()? as u64;
    let (width, height) = size(emitters, aspect);
    let shadows = u64::from(width * height) * emitters <= MOST_RAYS;
    let settings = RenderSettings { width, height, ..Default::default() };
    let picture = |side: usize, camera| {
        let SceneSide { scene, emitters, .. } = sides[side];
        let delegate = RenderDelegate::new(scene, emitters, camera, settings.clone());
        direct_light(&delegate, trees[side], sides[side].frame(), shadows).ok()
    };
    let (before, after) = (picture(0, before)?, picture(1, after)?);
    let cell = |(before, after): (&Option<f32>, &Option<f32>)| {
        before.or(*after)?;
        Some(HeatCell { before_nits: before.unwrap_or(0.0), after_nits: after.unwrap_or(0.0) })
    };
    let cells = before.iter().zip(&after).map(cell).collect();
    Some(HeatMap { width, height, cells, shadows })
}

/// Cells in a row, and rows.
fn size(emitters: u64, aspect: f32) -> (u32, u32) {
    let rows = |width: u32| ((width as f32 / aspect).round() as u32).clamp(1, 4 * width);
    let fits = |width: &u32| u64::from(width * rows(*width)) * emitters <= MOST_LIGHTINGS;
    let width = (LEAST_WIDTH..=WIDTH).rev().find(fits).unwrap_or(LEAST_WIDTH);
    (width, rows(width))
}
