//! One way of looking at a box: where things are in a drawing, and the axes around it.

use super::axes::ticks;
use super::plan::Cuboid;
use super::raster::Raster;
use glam::Vec3;
use std::fmt;

/// Sides of the picture, in units of the drawing: pixels, if there is room.
pub const WIDTH: f64 = 960.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 8.0;
const ABOVE: f64 = 26.0;
const BELOW: f64 = 22.0;
/// The largest heights of the plan and of the elevation.
const HEIGHTS: [f64; 2] = [520.0, 300.0];
const LEAST_HEIGHT: f64 = 60.0;
/// Side of a cell of the ground.
const CELL: f64 = 2.0;

/// One way of looking at a box.
#[derive(Clone, Copy, Debug)]
pub struct View {
    name: &'static str,
    /// The coordinate that goes across, and the one that goes down or up.
    axes: [usize; 2],
    goes_up: bool,
    /// Upper edge and height in the drawing.
    pub top: f64,
    pub height: f64,
    /// The smallest of both coordinates, metres.
    least: [f64; 2],
    per_metre: f64,
}

/// Both views of a box, with room around it.
pub fn views(around: Cuboid) -> [View; 2] {
    let (min, max) = (around.min.as_dvec3(), around.max.as_dvec3());
    let longest = (max - min).max_element();
    // A single point has no size: give it a metre.
    let room = if longest > 0.0 { 0.04 * longest } else { 0.5 };
    let (min, extent) = (min - room, max - min + 2.0 * room);
    const X: usize = 0;
    const Y: usize = 1;
    const Z: usize = 2;
    // X to the right, Z to the reader; or turned, Z to the right and X away from the reader.
    let turned = extent.z > extent.x;
    let [across, depth] = if turned { [Z, X] } else { [X, Z] };
    let per_metre =
        (View::WIDTH / extent[across]).min(HEIGHTS[0] / extent[depth]).min(HEIGHTS[1] / extent.y);
    let mut top = ABOVE;
    let mut view = |name, axis: usize, goes_up| {
        let height = (extent[axis] * per_metre).max(LEAST_HEIGHT);
        let sides = [(across, View::WIDTH), (axis, height)];
        let least = sides.map(|(axis, side)| min[axis] + 0.5 * (extent[axis] - side / per_metre));
        let axes = [across, axis];
        let view = View { name, axes, goes_up, top, height, least, per_metre };
        top += height + BELOW + ABOVE;
        view
    };
    let side = if turned { "Elevation, along x" } else { "Elevation, against z" };
    [view("Plan, from above", depth, turned), view(side, Y, true)]
}

impl View {
    /// Without the axes.
    pub const WIDTH: f64 = WIDTH - LEFT - RIGHT;

    /// Where a place is in the drawing.
    pub fn at(&self, p: Vec3) -> [f64; 2] {
        let [across, along] =
            [0, 1].map(|i| (f64::from(p[self.axes[i]]) - self.least[i]) * self.per_metre);
        [LEFT + across, self.down(along)]
    }

    /// Where a place is in the view, from (0, 0) at the top left to (1, 1).
    pub fn share(&self, p: Vec3) -> [f64; 2] {
        let [x, y] = self.at(p);
        [(x - LEFT) / View::WIDTH, (y - self.top) / self.height]
    }

    /// A ground of so many columns and rows that its cells can just be seen.
    pub fn cells<T>(&self, new: impl Fn(u32, u32) -> T) -> T {
        let cells = |length: f64| (length / CELL).ceil().max(1.0) as u32;
        new(cells(View::WIDTH), cells(self.height))
    }

    /// An image that fills the view.
    pub fn write_image(&self, f: &mut fmt::Formatter, image: &Raster) -> fmt::Result {
        writeln!(
            f,
            "<image href=\"{image}\" x=\"{LEFT}\" y=\"{:.1}\" width=\"{}\" height=\"{:.1}\" \
             preserveAspectRatio=\"none\"/>",
            self.top,
            View::WIDTH,
            self.height
        )
    }

    /// Where the drawing ends if there is nothing below.
    pub fn end(&self) -> f64 {
        self.top + self.height + BELOW
    }

    /// The y coordinate in the drawing of a distance along the vertical axis.
    fn down(&self, along: f64) -> f64 {
        if self.goes_up { self.top + self.height - along } else { self.top + along }
    }

    pub fn write_axes(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let View { top, height, least, per_metre, .. } = *self;
        let bottom = top + height;
        writeln!(
            f,
            "<text class=\"title\" x=\"{LEFT}\" y=\"{:.1}\">{}</text>",
            top - 8.0,
            self.name
        )?;
        for (at, label) in ticks(least[0], least[0] + View::WIDTH / per_metre, 8.0) {
            let x = LEFT + (at - least[0]) * per_metre;
            let below = bottom + 14.0;
            writeln!(
                f,
                "<path class=\"grid\" d=\"M{x:.1} {top:.1}V{bottom:.1}\"/>\
                 <text class=\"x\" x=\"{x:.1}\" y=\"{below:.1}\">{label}</text>"
            )?;
        }
        for (at, label) in ticks(least[1], least[1] + height / per_metre, (height / 60.0).max(2.0))
        {
            let y = self.down((at - least[1]) * per_metre);
            let (right, left) = (WIDTH - RIGHT, LEFT - 6.0);
            writeln!(
                f,
                "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{right}\"/>\
                 <text class=\"y\" x=\"{left}\" y=\"{:.1}\">{label}</text>",
                y + 4.0
            )?;
        }
        let [across, along] = self.axes.map(|axis| ["x", "y", "z"][axis]);
        let way = if self.goes_up { "up" } else { "down" };
        let (right, above) = (WIDTH - RIGHT, top - 8.0);
        writeln!(
            f,
            "<text class=\"y\" x=\"{right}\" y=\"{above:.1}\">{across} across, {along} {way}, metres</text>"
        )?;
        let width = View::WIDTH;
        writeln!(
            f,
            "<rect class=\"frame\" x=\"{LEFT}\" y=\"{top:.1}\" width=\"{width}\" height=\"{height:.1}\"/>"
        )
    }

    /// The boxes as the data of a path.
    pub fn write_boxes(&self, f: &mut fmt::Formatter, boxes: &[Cuboid]) -> fmt::Result {
        for Cuboid { min, max } in boxes {
            let ([left, one], [right, other]) = (self.at(*min), self.at(*max));
            let (width, top, height) = (right - left, one.min(other), (one - other).abs());
            write!(f, "M{left:.1} {top:.1}h{width:.1}v{height:.1}h-{width:.1}z")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a view draws the corners of a box.
    fn drawn(around: Cuboid) -> [[[f64; 2]; 2]; 2] {
        views(around).map(|view| [view.at(around.min), view.at(around.max)])
    }

    #[test]
    fn everything_fits_and_both_views_are_in_line() {
        let at = |x, y, z| Vec3::new(x, y, z);
        let far = [at(40.0, 3.0, 9.0), at(9.0, 3.0, 40.0), at(1e-5, 7.0, 1e-4), at(1e9, 0.0, 1e6)];
        for max in far.into_iter().chain([at(-2.0, -3.0, -1.0)]) {
            let around = Cuboid { min: at(-2.0, -3.0, -1.0), max };
            let [plan, elevation] = drawn(around);
            assert_eq!([plan[0][0], plan[1][0]], [elevation[0][0], elevation[1][0]]);
            for (view, corners) in views(around).iter().zip([plan, elevation]) {
                for [x, y] in corners {
                    assert!((LEFT..=WIDTH - RIGHT).contains(&x), "{corners:?}");
                    assert!((view.top..=view.top + view.height).contains(&y), "{corners:?}");
                }
            }
        }
    }

    #[test]
    fn both_views_are_seen_and_none_is_mirrored() {
        for (max, turned) in [(Vec3::new(2.0, 1.0, 1.0), false), (Vec3::new(1.0, 1.0, 2.0), true)] {
            let [plan, elevation] = drawn(Cuboid { min: Vec3::ZERO, max });
            // In the plan X to the right and Z down, or Z to the right and X up: Y looks at the reader.
            assert_eq!(plan[1][1] < plan[0][1], turned);
            assert!(plan[1][0] > plan[0][0] && elevation[1][1] < elevation[0][1]);
        }
    }
}
