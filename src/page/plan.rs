//! Marks in space, as an architect draws them: the plan, from above, and below it the elevation,
//! from the side that is at the plan's lower edge, in one scale and in line. What is longer than it is
//! wide lies across.

use super::axes::ticks;
use super::escape::Escaped;
use super::shade::Shade;
use super::{Ink, Part};
use glam::Vec3;
use std::fmt::{self, Display};

/// A box in space, metres, Y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    /// Smallest corner.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
}

/// A spot in space.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Where, metres, Y up.
    pub at: Vec3,
    /// Where it was, if that is to be shown: a line leads there.
    pub from: Option<Vec3>,
    /// Its area is in proportion, down to a size that can still be seen. Not negative.
    pub weight: f32,
    /// Its colour, which [`Plan::kinds`] explains.
    pub ink: Ink,
    /// What is said of it when it is pointed at.
    pub label: String,
}

/// Boxes that are shown together.
#[derive(Clone, Debug)]
pub struct Level {
    /// What they are.
    pub name: String,
    /// They.
    pub boxes: Vec<Cuboid>,
}

/// Plan and elevation of marks, with one of several levels of boxes.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What the colours mean.
    pub kinds: Vec<(Ink, String)>,
    /// The spots.
    pub marks: Vec<Mark>,
    /// The boxes; a slider leafs through them.
    pub levels: Vec<Level>,
    /// Which level is shown first.
    pub shown: usize,
    caption: String,
    views: [View; 2],
    shades: Option<[Shade; 2]>,
}

/// Sides of the picture, in units of the drawing: pixels, if there is room.
const WIDTH: f64 = 960.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 8.0;
const ABOVE: f64 = 26.0;
const BELOW: f64 = 22.0;
/// At most so high.
const HEIGHTS: [f64; 2] = [520.0, 300.0];
const LEAST_HEIGHT: f64 = 60.0;
/// Radius of the heaviest mark, and of the lightest.
const RADII: [f64; 2] = [11.0, 1.4];
/// Marks cover no more of a picture than this, the lightest aside.
const COVERED: f64 = 0.08;
/// Side of a cell of the ground.
const CELL: f64 = 2.0;

/// One way of looking at a box.
#[derive(Clone, Copy, Debug)]
struct View {
    name: &'static str,
    /// The coordinate that goes across, and the one that goes down or up.
    axes: [usize; 2],
    goes_up: bool,
    /// Upper edge and height in the drawing.
    top: f64,
    height: f64,
    /// The smallest of both coordinates, metres.
    least: [f64; 2],
    per_metre: f64,
}

impl Plan {
    /// An empty picture of what a box holds.
    pub fn new(caption: &str, around: Cuboid) -> Plan {
        Plan {
            kinds: Vec::new(),
            marks: Vec::new(),
            levels: Vec::new(),
            shown: 0,
            caption: caption.into(),
            views: views(around),
            shades: None,
        }
    }

    /// Adds to the density that is drawn below everything.
    pub fn shade(&mut self, at: Vec3, weight: f64) {
        let views = self.views;
        let cells = |length: f64| (length / CELL).ceil().max(1.0) as u32;
        let new = || views.map(|view| Shade::new(cells(View::WIDTH), cells(view.height)));
        for (shade, view) in self.shades.get_or_insert_with(new).iter_mut().zip(views) {
            let [x, y] = view.at(at);
            shade.add([(x - LEFT) / View::WIDTH, (y - view.top) / view.height], weight);
        }
    }
}

impl Plan {
    /// Radius over the square root of a weight: the heaviest as large as may be, unless all together
    /// would cover too much.
    fn radius_per_root(&self) -> f64 {
        let weights = || self.marks.iter().map(|mark| f64::from(mark.weight));
        let most = weights().fold(f64::MIN_POSITIVE, f64::max);
        let free = COVERED * View::WIDTH * self.views[0].height / std::f64::consts::PI;
        let covered = (free / weights().map(|weight| weight / most).sum::<f64>()).sqrt();
        RADII[0].min(covered) / most.sqrt()
    }
}

/// Both views of a box, with room around it.
fn views(around: Cuboid) -> [View; 2] {
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
    const WIDTH: f64 = WIDTH - LEFT - RIGHT;

    /// Where a place is in the drawing.
    fn at(&self, p: Vec3) -> [f64; 2] {
        let [across, along] =
            [0, 1].map(|i| (f64::from(p[self.axes[i]]) - self.least[i]) * self.per_metre);
        [LEFT + across, self.down(along)]
    }

    /// How far down something is that is so far along.
    fn down(&self, along: f64) -> f64 {
        if self.goes_up { self.top + self.height - along } else { self.top + along }
    }

    fn write_axes(&self, f: &mut fmt::Formatter) -> fmt::Result {
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

    fn write_boxes(&self, f: &mut fmt::Formatter, boxes: &[Cuboid]) -> fmt::Result {
        for Cuboid { min, max } in boxes {
            let ([left, one], [right, other]) = (self.at(*min), self.at(*max));
            let (width, top, height) = (right - left, one.min(other), (one - other).abs());
            write!(f, "M{left:.1} {top:.1}h{width:.1}v{height:.1}h-{width:.1}z")?;
        }
        Ok(())
    }
}

impl Part for Plan {}

impl Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let caption = Escaped(&self.caption);
        let [.., last] = self.views;
        let height = last.top + last.height + BELOW;
        writeln!(
            f,
            "<figure class=\"plan\">\n\
             <svg viewBox=\"0 0 {WIDTH} {height:.1}\" role=\"img\" aria-label=\"{caption}\">"
        )?;
        let mut marks: Vec<&Mark> = self.marks.iter().collect();
        // What is there and nothing more below, then the heaviest, so that they hide no other.
        marks.sort_by(|a, b| {
            let is_quiet = |mark: &Mark| mark.ink == Ink::Grey;
            is_quiet(b).cmp(&is_quiet(a)).then(b.weight.total_cmp(&a.weight))
        });
        let per_root = self.radius_per_root();
        for (number, view) in self.views.iter().enumerate() {
            view.write_axes(f)?;
            if let Some(shades) = &self.shades {
                let (raster, width) = (shades[number].raster(), View::WIDTH);
                writeln!(
                    f,
                    "<image href=\"{raster}\" x=\"{LEFT}\" y=\"{:.1}\" width=\"{width}\" \
                     height=\"{:.1}\" preserveAspectRatio=\"none\"/>",
                    view.top, view.height
                )?;
            }
            for (row, level) in self.levels.iter().enumerate() {
                let hidden = if row == self.shown { "" } else { " hidden" };
                write!(f, "<path class=\"boxes\" data-level=\"{row}\"{hidden} d=\"")?;
                view.write_boxes(f, &level.boxes)?;
                f.write_str("\"/>\n")?;
            }
            for mark in &marks {
                let [x, y] = view.at(mark.at);
                let radius = (f64::from(mark.weight).sqrt() * per_root).max(RADII[1]);
                let (class, label) = (mark.ink.class(), Escaped(&mark.label));
                if let Some([x0, y0]) = mark.from.map(|from| view.at(from)) {
                    writeln!(
                        f,
                        "<path class=\"trace {class}\" d=\"M{x0:.1} {y0:.1}L{x:.1} {y:.1}\"/>"
                    )?;
                }
                writeln!(
                    f,
                    "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\">\
                     <title>{label}</title></circle>"
                )?;
            }
        }
        writeln!(f, "</svg>\n<figcaption>{caption}\n<div>")?;
        for (ink, name) in &self.kinds {
            let (class, name) = (ink.class(), Escaped(name));
            writeln!(f, "<span class=\"key\"><i class=\"{class}\"></i>{name}</span>")?;
        }
        if let Some(last) = self.levels.len().checked_sub(1) {
            let shown = self.shown;
            writeln!(
                f,
                "<label class=\"key\"><i class=\"box\"></i>\
                 <input type=\"range\" min=\"0\" max=\"{last}\" value=\"{shown}\">"
            )?;
            for (row, level) in self.levels.iter().enumerate() {
                let hidden = if row == shown { "" } else { " hidden" };
                let name = Escaped(&level.name);
                writeln!(f, "<span data-level=\"{row}\"{hidden}>{name}</span>")?;
            }
            f.write_str("</label>")?;
        }
        f.write_str("</div>\n</figcaption>\n</figure>\n")
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

    #[test]
    fn the_area_of_a_mark_is_in_proportion_to_its_weight() {
        let mut plan = Plan::new("", Cuboid { min: Vec3::ZERO, max: Vec3::ONE });
        for weight in [1.0, 4.0, 0.0] {
            let mark =
                Mark { at: Vec3::ZERO, from: None, weight, ink: Ink::Blue, label: String::new() };
            plan.marks.push(mark);
        }
        let html = plan.to_string();
        let radii: Vec<&str> =
            html.split(" r=\"").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
        assert_eq!(radii, ["11.0", "5.5", "1.4", "11.0", "5.5", "1.4"]);
    }

    #[test]
    fn heavy_marks_hide_no_light_ones_and_grey_ones_none() {
        let mut plan = Plan::new("", Cuboid { min: Vec3::ZERO, max: Vec3::ONE });
        for (weight, ink) in [(1.0, Ink::Grey), (1.0, Ink::Blue), (2.0, Ink::Red), (2.0, Ink::Grey)]
        {
            let label = format!("{ink:?} {weight}");
            plan.marks.push(Mark { at: Vec3::ZERO, from: None, weight, ink, label });
        }
        let html = plan.to_string();
        let places = ["Grey 2", "Grey 1", "Red 2", "Blue 1"].map(|label| html.find(label).unwrap());
        assert!(places.is_sorted(), "{html}");
    }

    #[test]
    fn many_marks_are_small() {
        let mut plan = Plan::new("", Cuboid { min: Vec3::ZERO, max: Vec3::ONE });
        let mark =
            Mark { at: Vec3::ZERO, from: None, weight: 3.0, ink: Ink::Blue, label: String::new() };
        plan.marks = vec![mark; 1000];
        let area = 1000.0 * std::f64::consts::PI * 3.0 * plan.radius_per_root().powi(2);
        let [view, _] = plan.views;
        assert!((area / (View::WIDTH * view.height) / COVERED - 1.0).abs() < 1e-9);
    }
}
