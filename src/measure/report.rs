//! What was measured, as tables, JSON and CSV have it.

use super::entrant::{Entrant, Way};
use super::frontier::{Point, Reach, frontier, reach, slope};
use super::machine::Machine;
use super::probes::ProbeReport;
use super::trade::Cell;
use crate::page::Short;
use crate::render::RenderSettings;
use crate::render::noise::{Grey, decibels};
use serde::Serialize;

/// The version of the JSON.
const VERSION: u32 = 1;

/// All that a run of `candelabra measure` found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The version of this form.
    pub version: u32,
    /// The scene's file.
    pub scene: String,
    /// The frame.
    pub frame: i32,
    /// Lights: emitters and those at infinity.
    pub lights: usize,
    /// What was measured on.
    pub machine: Machine,
    /// The settings that all pictures have in common.
    pub settings: RenderSettings,
    /// Error against time, unless only exact variances were asked for.
    pub trade: Option<Trade>,
    /// Exact variances, unless they were not asked for.
    pub exact: Option<ProbeReport>,
}

/// What errors are measured against.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Terms {
    /// The grey floor, in the picture's unit.
    pub grey: Grey,
    /// Samples of each pixel of the reference.
    pub reference_samples: u32,
    /// The reference's own error, which is taken off all others.
    pub reference_error: f64,
    /// Pictures by each entrant.
    pub seeds: u32,
    /// The error that [`Curve::reach`] is about.
    pub error: f64,
}

/// Error against time.
#[derive(Clone, Debug, Serialize)]
pub struct Trade {
    /// What errors are measured against.
    #[serde(flatten)]
    pub terms: Terms,
    /// One a way and budget.
    pub rows: Vec<Row>,
    /// One a way.
    pub curves: Vec<Curve>,
    /// What to do, in one sentence.
    pub recommendation: String,
}

/// One entrant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// What it is called.
    pub name: String,
    /// Its way.
    #[serde(flatten)]
    pub entrant: Entrant,
    /// Samples of a pixel, in the mean over pixels and seeds, rounded.
    pub samples: u32,
    /// The error that was asked for, if that and not a number of samples was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub asked: Option<f64>,
    /// Seconds a picture, the median.
    pub seconds: f64,
    /// Its error: the root of the mean squared error over all seeds.
    pub error: f64,
    /// That in decibels; nothing if there is no error.
    pub decibels: Option<f64>,
    /// Of the seeds, the least and the largest error.
    pub errors: [f64; 2],
    /// The pooled error that 99 % of the noisy pixels do not exceed, the median.
    pub worst_percent: f64,
    /// The mean luminance over that of the reference, less 1; in the mean over the seeds.
    pub mean_off: f64,
    /// Lights sampled for a path, in the mean.
    pub lights: f64,
    /// Samples left out of all pictures because they were infinite or no number.
    pub non_finite: u64,
    /// No other has less error in no more time.
    pub is_on_frontier: bool,
}

/// All budgets of one way: numbers of samples, or errors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// What it is called.
    pub name: String,
    /// The way.
    #[serde(flatten)]
    pub way: Way,
    /// Whether its budgets are errors.
    pub to_error: bool,
    /// The exponent of time in its error.
    pub slope: Option<f64>,
    /// What the error that was asked for takes.
    pub reach: Option<Reach>,
}

impl Report {
    /// A report without results.
    pub fn new(scene: String, frame: i32, machine: Machine, settings: RenderSettings) -> Report {
        let (version, lights, trade, exact) = (VERSION, 0, None, None);
        Report { version, scene, frame, lights, machine, settings, trade, exact }
    }
}

impl Row {
    /// Of the pictures of an entrant, at least one.
    pub fn of(entrant: Entrant, cells: &[Cell]) -> Row {
        let count = cells.len().max(1) as f64;
        let sum = |of: fn(&Cell) -> f64| cells.iter().map(of).sum::<f64>();
        let error = (sum(|cell| cell.error * cell.error) / count).sqrt();
        let errors = cells.iter().fold([f64::INFINITY, 0.0_f64], |[least, most], cell| {
            [least.min(cell.error), most.max(cell.error)]
        });
        Row {
            name: entrant.to_string(),
            entrant,
            samples: (sum(|cell| cell.samples) / count).round() as u32,
            asked: entrant.budget.error(),
            seconds: median(cells.iter().map(|cell| cell.seconds)),
            error,
            decibels: Some(decibels(error)).filter(|decibels| decibels.is_finite()),
            errors,
            worst_percent: median(cells.iter().map(|cell| cell.worst_percent)),
            mean_off: sum(|cell| cell.mean_off) / count,
            lights: sum(|cell| cell.lights) / count,
            non_finite: cells.iter().map(|cell| cell.non_finite).sum(),
            is_on_frontier: false,
        }
    }

    /// Its place among the curves.
    pub fn point(&self) -> Point {
        let Row { samples, seconds, error, .. } = *self;
        Point { samples: samples.into(), seconds, error }
    }

    /// Its way, with the error if one was asked for. Its samples are told beside it.
    pub fn way(&self) -> String {
        if self.asked.is_some() { self.name.clone() } else { self.entrant.way.to_string() }
    }

    /// What its curve is of: its way, and whether an error was asked for.
    fn kind(&self) -> (Way, bool) {
        (self.entrant.way, self.asked.is_some())
    }

    /// Whether it belongs to a curve.
    pub fn is_of(&self, curve: &Curve) -> bool {
        self.kind() == (curve.way, curve.to_error)
    }
}

impl Trade {
    /// Curves and frontier of some entrants, which are sorted by way, and what to do to reach an error.
    pub fn new(mut rows: Vec<Row>, terms: Terms, settings: &RenderSettings) -> Trade {
        let error = terms.error;
        let points: Vec<Point> = rows.iter().map(Row::point).collect();
        rows.iter_mut().zip(frontier(&points)).for_each(|(row, is_on)| row.is_on_frontier = is_on);
        let mut kinds: Vec<(Way, bool)> = Vec::new();
        for row in &rows {
            if !kinds.contains(&row.kind()) {
                kinds.push(row.kind());
            }
        }
        rows.sort_by_key(|row| kinds.iter().position(|kind| *kind == row.kind()));
        let curve = |&(way, to_error): &(Way, bool)| {
            let points = points_of(&rows, (way, to_error));
            let (slope, reach) = (slope(&points), reach(&points, error));
            let name = if to_error { format!("{way} --error") } else { way.to_string() };
            Curve { name, way, to_error, slope, reach }
        };
        let curves: Vec<Curve> = kinds.iter().map(curve).collect();
        Trade { recommendation: recommendation(&curves, error, settings), terms, rows, curves }
    }

    /// Of each way the entrant whose time is nearest to one that all of them have: that of the largest budget
    /// of the quickest way.
    pub fn at_equal_times(&self) -> Vec<Entrant> {
        let of = |curve: &Curve| -> Vec<&Row> {
            self.rows.iter().filter(|row| row.is_of(curve)).collect()
        };
        let longest = |curve| of(curve).iter().map(|row| row.seconds).fold(0.0, f64::max);
        let common = self.curves.iter().map(longest).fold(f64::INFINITY, f64::min);
        let off = |row: &Row| (row.seconds / common).ln().abs();
        let nearest = |curve| {
            of(curve).into_iter().min_by(|a, b| off(a).total_cmp(&off(b))).map(|row| row.entrant)
        };
        self.curves.iter().filter_map(nearest).collect()
    }
}

fn points_of(rows: &[Row], kind: (Way, bool)) -> Vec<Point> {
    let own = rows.iter().filter(|row| row.kind() == kind);
    let mut points: Vec<Point> = own.map(Row::point).collect();
    points.sort_by(|a, b| a.samples.total_cmp(&b.samples));
    points
}

/// The way that reaches an error first, in one sentence.
fn recommendation(curves: &[Curve], error: f64, settings: &RenderSettings) -> String {
    let mut reached: Vec<(&str, Reach)> =
        curves.iter().filter_map(|curve| Some((&*curve.name, curve.reach?))).collect();
    reached.sort_by(|a, b| a.1.seconds.total_cmp(&b.1.seconds));
    let Some((name, best)) = reached.first() else { return "Nothing was measured.".into() };
    let RenderSettings { width, height, depth, .. } = settings;
    let bounces = if *depth == 1 { "1 bounce".into() } else { format!("{depth} bounces") };
    let sure = if best.is_beyond { ", by extrapolation" } else { "" };
    let second = reached.get(1).map_or(String::new(), |(name, second)| {
        format!("; the next best, {name}, takes {} s", Short(two_digits(second.seconds)))
    });
    format!(
        "To reach error {error}: {name}, {} samples, {} s a frame ({width}x{height}, {bounces}{sure}){second}.",
        best.samples,
        Short(two_digits(best.seconds))
    )
}

/// Times are not known better.
fn two_digits(value: f64) -> f64 {
    if value <= 0.0 || !value.is_finite() {
        return value;
    }
    let unit = 10f64.powf(value.log10().floor() - 1.0);
    (value / unit).round() * unit
}

/// The value in the middle; 0 of none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// The rows as CSV, with a line of headings.
pub fn csv(trade: &Trade) -> String {
    let mut text = String::from(
        "strategy,split,split_by,samples,seconds,error,decibels,least_error,largest_error,\
         worst_percent,mean_off,lights,on_frontier,asked\n",
    );
    let word = |value: serde_json::Result<serde_json::Value>| match value {
        Ok(serde_json::Value::String(word)) => word,
        _ => String::new(),
    };
    for row in &trade.rows {
        let Way { strategy, split, split_by } = row.entrant.way;
        let (strategy, by) =
            (word(serde_json::to_value(strategy)), word(serde_json::to_value(split_by)));
        let [decibels, asked] =
            [row.decibels, row.asked].map(|own| own.map_or(String::new(), |own| own.to_string()));
        let [least, largest] = row.errors;
        let Row {
            samples, seconds, error, worst_percent, mean_off, lights, is_on_frontier, ..
        } = row;
        text += &format!(
            "{strategy},{split},{by},{samples},{seconds},{error},{decibels},{least},{largest},\
             {worst_percent},{mean_off},{lights},{is_on_frontier},{asked}\n"
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::Budget;
    use crate::render::LightStrategy;

    fn row(strategy: LightStrategy, samples: u32, seconds: f64, errors: [f64; 2]) -> Row {
        let cells = errors.map(|error| Cell {
            samples: samples.into(),
            seconds,
            error,
            worst_percent: error,
            mean_off: 0.0,
            lights: 1.0,
            non_finite: 0,
        });
        let budget = Budget::Samples(samples);
        Row::of(Entrant { way: Way::new(strategy, 0.5), budget }, &cells)
    }

    fn example() -> Trade {
        let (slow, quick) = (LightStrategy::Power, LightStrategy::Tree);
        let rows = vec![
            row(slow, 4, 1.0, [0.4, 0.4]),
            row(quick, 4, 2.0, [0.1, 0.1]),
            row(slow, 16, 4.0, [0.2, 0.2]),
            row(quick, 16, 8.0, [0.05, 0.05]),
        ];
        let terms = Terms {
            grey: Grey::below(1.0),
            reference_samples: 64,
            reference_error: 0.001,
            seeds: 2,
            error: 0.05,
        };
        Trade::new(rows, terms, &RenderSettings::default())
    }

    #[test]
    fn squares_are_averaged_and_seconds_are_medians() {
        let row = row(LightStrategy::Tree, 4, 1.5, [0.3, 0.1]);
        assert!((row.error - 0.05_f64.sqrt()).abs() < 1e-12 && row.seconds == 1.5);
        assert_eq!(row.errors, [0.1, 0.3]);
        assert!((row.decibels.unwrap() - 13.01).abs() < 0.01);
    }

    #[test]
    fn the_sentence_names_the_way_that_is_there_first() {
        let trade = example();
        let text = &trade.recommendation;
        assert!(
            text.starts_with("To reach error 0.05: tree:0.5, 16 samples, 8 s a frame"),
            "{text}"
        );
        assert!(text.ends_with("the next best, power, takes 64 s."), "{text}");
        assert_eq!(trade.curves.len(), 2);
        let on: Vec<bool> = trade.rows.iter().map(|row| row.is_on_frontier).collect();
        assert_eq!(on, [true, false, true, true]);
    }

    /// What asks for errors is a curve of its own, beside the same way with numbers of samples.
    #[test]
    fn errors_that_are_asked_for_are_a_curve() {
        let mut rows = example().rows;
        for row in rows.iter_mut().filter(|row| row.entrant.way.strategy == LightStrategy::Power) {
            let budget = Budget::Error(row.error);
            let cell = Cell {
                samples: 2.5 * f64::from(row.samples),
                seconds: row.seconds,
                error: 0.9 * row.error,
                worst_percent: 0.0,
                mean_off: 0.0,
                lights: 1.0,
                non_finite: 0,
            };
            let way = Way::new(LightStrategy::Tree, 0.5);
            *row = Row::of(Entrant { way, budget }, &[cell, cell]);
        }
        let trade = Trade::new(rows, example().terms, &RenderSettings::default());
        let names: Vec<&str> = trade.curves.iter().map(|curve| &*curve.name).collect();
        assert_eq!(names, ["tree:0.5 --error", "tree:0.5"]);
        let own: Vec<&Row> = trade.rows.iter().filter(|row| row.is_of(&trade.curves[0])).collect();
        let told: Vec<(&str, u32)> = own.iter().map(|row| (&*row.name, row.samples)).collect();
        assert_eq!(told, [("tree:0.5@0.4", 10), ("tree:0.5@0.2", 40)]);
        assert!(csv(&trade).lines().nth(1).unwrap().ends_with(",0.4"));
        let json = serde_json::to_value(&trade).unwrap();
        assert_eq!(json["rows"][0]["asked"], 0.4);
        assert_eq!(json["rows"][2].get("asked"), None);
        let shown: Vec<String> = trade.at_equal_times().iter().map(Entrant::to_string).collect();
        assert_eq!(shown, ["tree:0.5@0.2", "tree:0.5@4"]);
    }

    #[test]
    fn pictures_that_are_shown_took_about_as_long() {
        let names: Vec<String> =
            example().at_equal_times().iter().map(|entrant| entrant.to_string()).collect();
        assert_eq!(names, ["power@16", "tree:0.5@4"]);
    }

    #[test]
    fn a_line_of_csv_has_a_value_for_every_heading() {
        let text = csv(&example());
        let counts: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(counts, [14; 5]);
        assert!(
            text.lines().nth(3).unwrap().starts_with("tree,0.5,variance,4,2,0.1,20,"),
            "{text}"
        );
    }
}
