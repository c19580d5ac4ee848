//! Marks in space, as an architect draws them: a plan from above, and below it an elevation, seen from
//! the plan's lower edge. Both have one scale and are aligned. The longer horizontal side of the box
//! runs across the page.

use super::escape::Escaped;
use super::ground::Ground;
use super::shade::Shade;
use super::view::{View, WIDTH, views};
use super::{Ink, Part, Scale};
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
    /// The boxes.
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
    grounds: Option<([Ground; 2], Scale)>,
}

/// Radius of the heaviest mark, and of the lightest.
const RADII: [f64; 2] = [11.0, 1.4];
/// The share of a picture that marks cover, at most; marks of the smallest radius may exceed it.
const COVERED: f64 = 0.08;

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
            grounds: None,
        }
    }

    /// Adds a box with a number, which its colour tells, below everything. Where boxes lie above each other, the
    /// colour is that of their mean. The scale that is given first counts.
    pub fn paint(&mut self, cuboid: &Cuboid, value: f64, scale: &Scale) {
        let views = self.views;
        let new = || (views.map(|view| view.cells(Ground::new)), scale.clone());
        let (grounds, _) = self.grounds.get_or_insert_with(new);
        for (ground, view) in grounds.iter_mut().zip(views) {
            ground.add(view.share(cuboid.min), view.share(cuboid.max), value);
        }
    }

    /// Adds to the density that is drawn below everything.
    pub fn shade(&mut self, at: Vec3, weight: f64) {
        let views = self.views;
        let new = || views.map(|view| view.cells(Shade::new));
        for (shade, view) in self.shades.get_or_insert_with(new).iter_mut().zip(views) {
            shade.add(view.share(at), weight);
        }
    }

    /// The radius of a mark over the square root of its weight. The heaviest mark has the largest radius
    /// allowed, unless all marks together would cover too much.
    fn radius_per_root(&self) -> f64 {
        let weights = || self.marks.iter().map(|mark| f64::from(mark.weight));
        let most = weights().fold(f64::MIN_POSITIVE, f64::max);
        let free = COVERED * View::WIDTH * self.views[0].height / std::f64::consts::PI;
        let covered = (free / weights().map(|weight| weight / most).sum::<f64>()).sqrt();
        RADII[0].min(covered) / most.sqrt()
    }
}

impl Part for Plan {}

impl Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let caption = Escaped(&self.caption);
        let [.., last] = self.views;
        let height = last.end();
        writeln!(
            f,
            "<figure class=\"plan\">\n\
             <svg viewBox=\"0 0 {WIDTH} {height:.1}\" role=\"img\" aria-label=\"{caption}\">"
        )?;
        let mut marks: Vec<&Mark> = self.marks.iter().collect();
        // Grey marks are drawn first and heavy ones before light ones, so that they hide no others.
        marks.sort_by(|a, b| {
            let is_quiet = |mark: &Mark| mark.ink == Ink::Grey;
            is_quiet(b).cmp(&is_quiet(a)).then(b.weight.total_cmp(&a.weight))
        });
        let per_root = self.radius_per_root();
        for (number, view) in self.views.iter().enumerate() {
            view.write_axes(f)?;
            let ground = self.grounds.as_ref().map(|(of, scale)| of[number].raster(scale));
            let shade = self.shades.as_ref().map(|of| of[number].raster());
            for raster in [ground, shade].into_iter().flatten() {
                view.write_image(f, &raster)?;
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
        if let Some((_, scale)) = &self.grounds {
            f.write_str(&scale.key())?;
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
