//! A measurement as a page: curves, pictures, maps of error, tables, the machine.

use super::entrant::Entrant;
use super::picture::luminances;
use super::probes::ProbeReport;
use super::reference::Converged;
use super::report::{Report, Row, Terms, Trade};
use crate::page::{
    Cell, Chart, Column, Count, Curve, Dot, HeatMap, Ink, Page, Scale, Short, Table, Wipe,
};
use crate::render::RenderSettings;
use crate::render::beauty::Beauty;
use crate::render::png::{exposure_for, shown};
use image::RgbImage;

/// A colour for each way; beyond these, the same again, dashed.
const INKS: [Ink; 6] = [Ink::Grey, Ink::Blue, Ink::Green, Ink::Orange, Ink::Red, Ink::Violet];
/// What is white in a map of error, over the middle between the least and the largest error of the pictures.
const WHITE: f64 = 2.0;

/// The page of a report. `pictures` are those that it shows, at [`equal times`](Trade::at_equal_times), beside
/// the converged one; a report without pictures has none.
pub fn html(report: &Report, pictures: Option<(&Converged, &[(Entrant, Beauty)])>) -> String {
    let mut page = Page::new(&format!("The trade: {}", report.scene));
    if let Some(trade) = &report.trade {
        page.text(&trade.recommendation);
        terms(&mut page, report, &trade.terms);
        page.heading("Error against time");
        page.add(&chart(trade));
        if let Some((converged, pictures)) = pictures {
            look(&mut page, trade, converged, pictures);
        }
        page.heading("Budgets");
        page.add(&budgets(trade));
        page.heading("Ways");
        page.add(&ways(trade));
    }
    if let Some(exact) = &report.exact {
        page.heading("Exact variance of picking");
        page.text(
            "All lights are enumerated at points that camera paths visit. The variance of one estimate over \
             the square of the light there plus the grey floor: what picking alone costs, without shadows unless \
             they were asked for, and without noise of its own.",
        );
        page.add(&exact_table(exact));
    }
    page.heading("Machine and settings");
    machine(&mut page, report);
    page.finish()
}

/// The curves alone, as a picture: SVG.
pub fn svg(trade: &Trade) -> String {
    chart(trade).svg()
}

fn terms(page: &mut Page, report: &Report, terms: &Terms) {
    page.facts([
        ("frame", report.frame.to_string()),
        ("lights", Count(report.lights).to_string()),
        ("grey floor", Short(terms.grey.luminance()).to_string()),
        ("samples of the reference", Count(terms.reference_samples as usize).to_string()),
        ("its own error", Short(terms.reference_error).to_string()),
        ("pictures by each", terms.seeds.to_string()),
    ]);
    page.text(
        "The error of a pixel is how far it is off in the logarithm of its luminance plus the grey floor: 0.05 is 5 % of \
         the light, or of the floor where it is darker. That of a picture is the root of the mean square of its noisy \
         pixels. Half the error takes about four times the time.",
    );
}

/// What is said of an entrant.
fn label(row: &Row) -> String {
    let decibels = row.decibels.map_or(String::new(), |db| format!(" ({} dB)", Short(db)));
    let (error, seconds) = (Short(row.error), Short(row.seconds));
    format!(
        "{}: error {error}{decibels}, {seconds} s, {} lights a path",
        row.name,
        Short(row.lights)
    )
}

fn chart(trade: &Trade) -> Chart {
    let curves = trade.curves.iter().enumerate().map(|(number, curve)| {
        let own = trade.rows.iter().filter(|row| row.is_of(curve));
        let mut own: Vec<&Row> = own.collect();
        own.sort_by_key(|row| row.samples);
        let dot = |row: &&Row| Dot {
            at: [row.seconds, row.error],
            range: (trade.terms.seeds > 1).then_some(row.errors),
            label: label(row),
            is_marked: row.is_on_frontier,
        };
        Curve {
            name: curve.name.clone(),
            ink: INKS[number % INKS.len()],
            is_dashed: number >= INKS.len(),
            dots: own.iter().map(dot).collect(),
        }
    });
    Chart {
        caption: "Each dot is one number of samples, or one error that is asked for; lower and further left is better. Dots that no other \
                  beats are ringed and joined by the broad line."
            .into(),
        axes: ["seconds a picture".into(), "error".into()],
        curves: curves.collect(),
        goal: Some((trade.terms.error, format!("error {}", trade.terms.error))),
    }
}

fn look(page: &mut Page, trade: &Trade, converged: &Converged, pictures: &[(Entrant, Beauty)]) {
    page.heading("Pictures at equal times");
    let error_of = |entrant: &Entrant| {
        let row = trade.rows.iter().find(|row| row.entrant == *entrant);
        row.map_or(f64::INFINITY, |row| row.error)
    };
    let mut pictures: Vec<&(Entrant, Beauty)> = pictures.iter().collect();
    pictures.sort_by(|a, b| error_of(&a.0).total_cmp(&error_of(&b.0)));
    let exposure = exposure_for(&converged.beauty);
    let picture = |name: String, beauty: &Beauty| {
        let pixels = shown(beauty, exposure);
        RgbImage::from_raw(beauty.width, beauty.height, pixels).map(|pixels| (name, pixels))
    };
    let name = |entrant: &Entrant| {
        let row = trade.rows.iter().find(|row| row.entrant == *entrant);
        let took = row.map_or(String::new(), |row| {
            format!(", {} s, error {}", Short(row.seconds), Short(row.error))
        });
        format!("{entrant}{took}")
    };
    let own = pictures.iter().filter_map(|(entrant, beauty)| picture(name(entrant), beauty));
    let reference = picture("the reference".into(), &converged.beauty);
    page.add(&Wipe {
        caption: "Of each way the budget that takes about as long as those of the others, the best first."
            .into(),
        pictures: own.chain(reference).collect(),
    });
    page.heading("Where the error is");
    let ends =
        [pictures.first(), pictures.last()].map(|end| end.map_or(0.0, |end| error_of(&end.0)));
    let white = (WHITE * (ends[0] * ends[1]).sqrt()).max(f64::from(f32::MIN_POSITIVE)) as f32;
    for (entrant, beauty) in pictures {
        let squares = converged.reference.squared_errors(&luminances(beauty), converged.grey);
        page.add(&HeatMap {
            caption: name(entrant),
            width: beauty.width,
            values: squares.iter().map(|square| square.max(0.0).sqrt() as f32).collect(),
            scale: Scale::Heat { white },
        });
    }
}

fn budgets(trade: &Trade) -> Table {
    let headings =
        ["samples", "seconds", "error", "dB", "least", "largest", "worst 1 %", "mean off, %"];
    let mut columns = vec![Column::text("way")];
    columns.extend(headings.map(Column::number));
    columns.extend([Column::number("lights"), Column::text("frontier")]);
    let rows = trade.rows.iter().map(|row| {
        let ink = trade.curves.iter().position(|curve| row.is_of(curve)).unwrap_or(0);
        let mut cells =
            vec![Cell::Key(INKS[ink % INKS.len()], row.way()), Cell::count(row.samples as usize)];
        cells.extend([row.seconds, row.error].map(Cell::short));
        cells.push(row.decibels.map_or(Cell::Empty, Cell::short));
        cells.extend([row.errors[0], row.errors[1], row.worst_percent].map(Cell::short));
        cells.extend([100.0 * row.mean_off, row.lights].map(Cell::short));
        cells.push(Cell::Text(if row.is_on_frontier { "yes" } else { "" }.into()));
        cells
    });
    Table {
        caption: "Seconds are medians over the pictures of an entrant, errors roots of mean squares. Means \
                  that are off by more than their noise would tell of bias."
            .into(),
        columns,
        rows: rows.collect(),
    }
}

fn ways(trade: &Trade) -> Table {
    let rows = trade.curves.iter().enumerate().map(|(number, curve)| {
        let mut cells = vec![Cell::Key(INKS[number % INKS.len()], curve.name.clone())];
        cells.push(curve.slope.map_or(Cell::Empty, Cell::short));
        match curve.reach {
            Some(reach) => cells.extend([
                Cell::count(reach.samples as usize),
                Cell::short(reach.seconds),
                Cell::Text(if reach.is_beyond { "extrapolated" } else { "measured" }.into()),
            ]),
            None => cells.extend([const { Cell::Empty }; 3]),
        }
        cells
    });
    Table {
        caption: format!(
            "The slope is the exponent of time in the error; independent samples have -0.5. Then what error {} \
             takes.",
            trade.terms.error
        ),
        columns: vec![
            Column::text("way"),
            Column::number("slope"),
            Column::number("samples"),
            Column::number("seconds"),
            Column::text("known"),
        ],
        rows: rows.collect(),
    }
}

fn exact_table(exact: &ProbeReport) -> Table {
    let headings =
        ["error", "variance", "median", "nine in ten below", "lights", "most lights", "ns"];
    let mut columns = vec![Column::text("way")];
    columns.extend(headings.map(Column::number));
    let rows = exact.strategies.iter().map(|row| {
        let numbers = [
            row.error,
            row.variance,
            row.median,
            row.ninth_decile,
            row.lights,
            row.most_lights,
            row.nanoseconds,
        ];
        let mut cells = vec![Cell::Text(row.name.clone())];
        cells.extend(numbers.map(Cell::short));
        cells
    });
    Table {
        caption: format!(
            "{} points that lights reach; grey floor {}.",
            Count(exact.probes),
            Short(exact.grey.luminance())
        ),
        columns,
        rows: rows.collect(),
    }
}

fn machine(page: &mut Page, report: &Report) {
    let RenderSettings { width, height, depth, seed, max_lights, mis, .. } = report.settings;
    let machine = &report.machine;
    page.facts([
        ("processor", machine.processor.clone()),
        ("threads", machine.threads.to_string()),
        ("system", machine.system.clone()),
        ("program", machine.program.clone()),
        ("size", format!("{width}x{height}")),
        ("bounces", depth.to_string()),
        ("seed", seed.to_string()),
        ("lights at a point, at most", Count(max_lights as usize).to_string()),
        ("multiple importance sampling", if mis { "yes" } else { "no" }.into()),
    ]);
}
