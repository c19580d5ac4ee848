//! Where in a camera's view direct light changed.

/// A coarse picture of direct light before and after: what the first surface behind the middle of each
/// cell reflects to the camera of all lights. Each version is seen through its own camera.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatMap {
    /// Cells in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row after row from the top left. `None` where neither version has a surface that reflects.
    pub cells: Vec<Option<HeatCell>>,
    /// Whether what stands in a light's way was counted; else every light shines through.
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
