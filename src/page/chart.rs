//! Curves over logarithmic axes: what falls by a power is straight.

use super::axes::powers;
use super::escape::Escaped;
use super::{Ink, Part};
use std::fmt::{self, Display, Write};

/// Curves over two logarithmic axes, each named at its end. Whoever points at a dot is told its label.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What it shows.
    pub caption: String,
    /// What goes to the right, and what goes up.
    pub axes: [String; 2],
    /// The curves; what is not positive is not drawn.
    pub curves: Vec<Curve>,
    /// A value on the axis that goes up, and what it is.
    pub goal: Option<(f64, String)>,
}

/// A curve.
#[derive(Clone, Debug)]
pub struct Curve {
    /// What it is called.
    pub name: String,
    /// Its colour.
    pub ink: Ink,
    /// Tells it from another of the same colour.
    pub is_dashed: bool,
    /// Its dots, in order.
    pub dots: Vec<Dot>,
}

/// A dot of a curve.
#[derive(Clone, Debug)]
pub struct Dot {
    /// Where it is on both axes.
    pub at: [f64; 2],
    /// How far up and down it might be.
    pub range: Option<[f64; 2]>,
    /// What is said of it when it is pointed at.
    pub label: String,
    /// Whether no other dot is below it and to its left. These are joined by a broad line.
    pub is_marked: bool,
}

/// Sides of the drawing and the room around the field, in units of the drawing: pixels, if there is room.
const SIZE: [f64; 2] = [960.0, 520.0];
const LEFT: f64 = 64.0;
const RIGHT: f64 = 150.0;
const ABOVE: f64 = 28.0;
const BELOW: f64 = 44.0;
const FIELD: [f64; 2] = [SIZE[0] - LEFT - RIGHT, SIZE[1] - ABOVE - BELOW];
/// Names of curves are so far apart at least.
const LINE: f64 = 15.0;

/// The ends of the axes.
#[derive(Clone, Copy)]
struct Field {
    ends: [[f64; 2]; 2],
}

impl Field {
    fn around(chart: &Chart) -> Field {
        let mut ends = [[f64::INFINITY, 0.0_f64]; 2];
        let dots = chart.curves.iter().flat_map(|curve| &curve.dots).filter(|dot| dot.is_drawn());
        for at in dots.map(|dot| dot.at) {
            for (end, value) in ends.iter_mut().zip(at) {
                *end = [end[0].min(value), end[1].max(value)];
            }
        }
        // Room around the outermost dots; a decade if there are none.
        let ends = ends.map(|[low, high]| match low <= high {
            true => [low / 1.35, high * 1.35],
            false => [1.0, 10.0],
        });
        Field { ends }
    }

    fn share(&self, axis: usize, value: f64) -> f64 {
        let [low, high] = self.ends[axis];
        (value / low).ln() / (high / low).ln()
    }

    fn at(&self, at: [f64; 2]) -> [f64; 2] {
        let [x, y] = [self.share(0, at[0]), self.share(1, at[1])];
        [LEFT + FIELD[0] * x, ABOVE + FIELD[1] * (1.0 - y)]
    }

    /// A height, kept inside the field.
    fn height(&self, value: f64) -> f64 {
        let share = self.share(1, value.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        ABOVE + FIELD[1] * (1.0 - share)
    }

    fn write_axes(&self, f: &mut fmt::Formatter, axes: &[String; 2]) -> fmt::Result {
        let (right, bottom) = (LEFT + FIELD[0], ABOVE + FIELD[1]);
        for (value, label) in powers(self.ends[0][0], self.ends[0][1]) {
            let ([x, _], below) = (self.at([value, self.ends[1][0]]), bottom + 15.0);
            writeln!(
                f,
                "<path class=\"grid\" d=\"M{x:.1} {ABOVE}V{bottom}\"/>\
                 <text class=\"x\" x=\"{x:.1}\" y=\"{below}\">{label}</text>"
            )?;
        }
        for (value, label) in powers(self.ends[1][0], self.ends[1][1]) {
            let ([_, y], left) = (self.at([self.ends[0][0], value]), LEFT - 6.0);
            writeln!(
                f,
                "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{right}\"/>\
                 <text class=\"y\" x=\"{left}\" y=\"{:.1}\">{label}</text>",
                y + 4.0
            )?;
        }
        let [across, up] = axes.each_ref().map(|name| Escaped(name));
        writeln!(
            f,
            "<text class=\"title\" x=\"{LEFT}\" y=\"{}\">{up}</text>\n\
             <text class=\"title y\" x=\"{right}\" y=\"{}\">{across}</text>\n\
             <rect class=\"frame\" x=\"{LEFT}\" y=\"{ABOVE}\" width=\"{}\" height=\"{}\"/>",
            ABOVE - 9.0,
            bottom + 36.0,
            FIELD[0],
            FIELD[1]
        )
    }
}

impl Dot {
    fn is_drawn(&self) -> bool {
        self.at.iter().all(|value| *value > 0.0 && value.is_finite())
    }
}

impl Curve {
    fn drawn(&self) -> impl Iterator<Item = &Dot> {
        self.dots.iter().filter(|dot| dot.is_drawn())
    }

    fn write(&self, f: &mut fmt::Formatter, field: &Field) -> fmt::Result {
        let (class, dashed) = (self.ink.class(), if self.is_dashed { " dashed" } else { "" });
        let places: Vec<[f64; 2]> = self.drawn().map(|dot| field.at(dot.at)).collect();
        writeln!(f, "<path class=\"curve {class}{dashed}\" d=\"{}\"/>", Line(&places))?;
        for (dot, [x, y]) in self.drawn().zip(&places) {
            if let Some([low, high]) = dot.range {
                let (from, to) = (field.height(low), field.height(high));
                writeln!(f, "<path class=\"range {class}\" d=\"M{x:.1} {from:.1}V{to:.1}\"/>")?;
            }
            let marked = if dot.is_marked { " marked" } else { "" };
            writeln!(
                f,
                "<circle class=\"{class}{marked}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4.5\">\
                 <title>{}</title></circle>",
                Escaped(&dot.label)
            )?;
        }
        Ok(())
    }
}

/// The data of a path through some places.
struct Line<'a>(&'a [[f64; 2]]);

impl Display for Line<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, [x, y]) in self.0.iter().enumerate() {
            write!(f, "{}{x:.1} {y:.1}", if number == 0 { 'M' } else { 'L' })?;
        }
        Ok(())
    }
}

impl Chart {
    /// The drawing as a file of its own: SVG.
    pub fn svg(&self) -> String {
        let mut svg = String::new();
        let [width, height] = SIZE;
        let style = concat!(include_str!("colors.css"), include_str!("drawing.css"));
        let written = write!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n<style>\n{style}\
             svg {{ font: 11px system-ui, sans-serif; }}\n</style>\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"var(--ground)\"/>\n{}</svg>\n",
            Escaped(&self.caption),
            Drawing(self)
        );
        written.expect("a text takes any text");
        svg
    }

    /// Where the names of the curves stand: at their ends, from the top, and apart from each other.
    fn names(&self, field: &Field) -> Vec<(&Curve, f64)> {
        let end = |curve: &Curve| curve.drawn().last().map(|dot| field.at(dot.at)[1] + 4.0);
        let mut names: Vec<(&Curve, f64)> =
            self.curves.iter().filter_map(|curve| Some((curve, end(curve)?))).collect();
        names.sort_by(|a, b| a.1.total_cmp(&b.1));
        for i in 1..names.len() {
            names[i].1 = names[i].1.max(names[i - 1].1 + LINE);
        }
        // What was pushed out below moves up again.
        let mut lowest = ABOVE + FIELD[1] + 4.0;
        for name in names.iter_mut().rev() {
            name.1 = name.1.min(lowest);
            lowest = name.1 - LINE;
        }
        names
    }
}

/// What is inside the frame of a chart, and around it.
struct Drawing<'a>(&'a Chart);

impl Display for Drawing<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let chart = self.0;
        let field = Field::around(chart);
        field.write_axes(f, &chart.axes)?;
        let dots = chart.curves.iter().flat_map(Curve::drawn).filter(|dot| dot.is_marked);
        let mut best: Vec<[f64; 2]> = dots.map(|dot| field.at(dot.at)).collect();
        best.sort_by(|a, b| a[0].total_cmp(&b[0]));
        writeln!(f, "<path class=\"frontier\" d=\"{}\"/>", Line(&best))?;
        let [low, high] = field.ends[1];
        if let Some((value, name)) = &chart.goal
            && (low..=high).contains(value)
        {
            let ([_, y], right) = (field.at([field.ends[0][0], *value]), LEFT + FIELD[0]);
            let (x, above, name) = (LEFT + 6.0, y - 5.0, Escaped(name));
            writeln!(
                f,
                "<path class=\"goal\" d=\"M{LEFT} {y:.1}H{right}\"/>\
                 <text x=\"{x}\" y=\"{above:.1}\">{name}</text>"
            )?;
        }
        chart.curves.iter().try_for_each(|curve| curve.write(f, &field))?;
        for (curve, y) in chart.names(&field) {
            let (class, name) = (curve.ink.class(), Escaped(&curve.name));
            let (right, x) = (LEFT + FIELD[0], LEFT + FIELD[0] + 28.0);
            let dashed = if curve.is_dashed { " dashed" } else { "" };
            let (from, middle) = (right + 6.0, y - 4.0);
            writeln!(
                f,
                "<path class=\"curve {class}{dashed}\" d=\"M{from} {middle:.1}h18\"/>\
                 <text class=\"name {class}\" x=\"{x}\" y=\"{y:.1}\">{name}</text>"
            )?;
        }
        Ok(())
    }
}

impl Part for Chart {}

impl Display for Chart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let caption = Escaped(&self.caption);
        let [width, height] = SIZE;
        writeln!(
            f,
            "<figure class=\"chart\">\n\
             <svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{caption}\">\n{}</svg>\n\
             <figcaption>{caption}<div><output></output></div></figcaption>\n</figure>",
            Drawing(self)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(curves: &[&[[f64; 2]]]) -> Chart {
        let dot = |at: &[f64; 2]| Dot { at: *at, range: None, label: "l".into(), is_marked: false };
        let curve = |dots: &&[[f64; 2]]| Curve {
            name: "n".into(),
            ink: Ink::Blue,
            is_dashed: false,
            dots: dots.iter().map(dot).collect(),
        };
        Chart {
            caption: String::new(),
            axes: ["seconds".into(), "error".into()],
            curves: curves.iter().map(curve).collect(),
            goal: Some((0.05, "asked".into())),
        }
    }

    #[test]
    fn a_power_is_a_straight_line() {
        let chart = chart(&[&[[1.0, 0.4], [4.0, 0.2], [16.0, 0.1], [64.0, 0.05]]]);
        let field = Field::around(&chart);
        let places: Vec<[f64; 2]> =
            chart.curves[0].dots.iter().map(|dot| field.at(dot.at)).collect();
        for pair in places.windows(2).collect::<Vec<_>>().windows(2) {
            let step = |i: usize| [0, 1].map(|axis| pair[i][1][axis] - pair[i][0][axis]);
            let [one, other] = [step(0), step(1)];
            assert!(one.iter().zip(other).all(|(one, other)| (one - other).abs() < 1e-9));
        }
        assert!(places[3][0] > places[0][0] && places[3][1] > places[0][1], "right and down");
    }

    #[test]
    fn names_are_apart_and_stay_in_the_drawing() {
        let same: &[[f64; 2]] = &[[1.0, 0.1]];
        let chart = chart(&[same; 20]);
        let names = chart.names(&Field::around(&chart));
        assert_eq!(names.len(), 20);
        assert!(names.windows(2).all(|pair| pair[1].1 - pair[0].1 > LINE - 1e-9));
        assert!(names.iter().all(|name| (0.0..SIZE[1]).contains(&name.1)));
    }

    #[test]
    fn what_is_not_positive_is_not_drawn() {
        let html = chart(&[&[[1.0, 0.0], [f64::NAN, 1.0], [2.0, 0.05]], &[]]).to_string();
        assert_eq!(html.matches("<circle").count(), 1);
        assert!(!html.contains("NaN") && !html.contains("inf"), "{html}");
        assert!(html.contains(">asked<"));
        assert!(!chart(&[]).to_string().contains("NaN"));
    }
}
