//! A table of what is hidden as a page: from where how much of the light is hidden.

use crate::inspect::table::TableReport;
use crate::light_tree::learned::LearnedFile;
use crate::page::{Cell, Column, Count, Cuboid, Page, Plan, Scale, Table, counted};
use serde_json::Value;

/// Shares of hidden light are counted in so many steps.
const STEPS: usize = 10;

/// The page of a table, which must have been verified. `file` is its name.
pub fn table_html(
    table: &LearnedFile<impl AsRef<[u8]>>,
    report: &TableReport,
    file: &str,
) -> String {
    let mut page = Page::new(file);
    summary(&mut page, report);
    page.heading("From where how much is hidden");
    match plan(table) {
        Some(plan) => {
            page.add(&plan);
            page.heading("Cells");
            page.add(&steps(table.hidden()));
        }
        None if report.cells == 0 => {
            page.text("Nothing is hidden here, or next to nothing: the table is empty.");
        }
        None => page.text("The table does not tell."),
    }
    page.finish()
}

fn summary(page: &mut Page, report: &TableReport) {
    let learned = &report.learned;
    let number = |name: &str| learned[name].as_u64().map(|number| Count(number as usize));
    let number = |name: &str| number(name).map_or("?".into(), |number| number.to_string());
    let frames = learned["frames"].as_array().map(Vec::as_slice).unwrap_or_default();
    let frames: Vec<String> = frames.iter().map(Value::to_string).collect();
    let share = |share: Option<f64>| share.map_or("?".into(), |s| format!("{:.1} %", 100.0 * s));
    page.facts([
        ("cells", Count(report.cells).to_string()),
        ("groups in each", Count(report.groups).to_string()),
        ("light hidden, mean of the cells", share(report.light_hidden)),
        ("picks hidden without the table", share(learned["hidden"].as_f64())),
        ("clusters hidden", share(Some(report.hidden))),
        ("rays", number("rays")),
        ("frames looked at", frames.join(", ")),
        ("bytes", Count(report.bytes).to_string()),
        ("learned by", learned["program"].as_str().unwrap_or("?").into()),
    ]);
}

/// The cells, coloured; `None` if there are none, or if the file does not tell what is hidden there.
fn plan(table: &LearnedFile<impl AsRef<[u8]>>) -> Option<Plan> {
    let learned = table.view()?;
    let (around, hidden) = (table.area()?, table.hidden());
    let cells = hidden.len();
    let caption = format!(
        "{}, and the share of the light that is hidden there. Where cells lie above each other, or differ by \
         normals only, the mean of them.",
        counted(cells, "cell")
    );
    let [min, max] = around;
    let mut plan = Plan::new(&caption, Cuboid { min, max });
    learned.cells.for_each_box(around, &mut |cell, [min, max]| {
        if let Some(&share) = hidden.get(cell.0 as usize) {
            plan.paint(&Cuboid { min, max }, f64::from(share) / 255.0, &Scale::Shadow);
        }
    });
    (cells > 0).then_some(plan)
}

/// How many cells have how much hidden.
fn steps(hidden: &[u8]) -> Table {
    let mut counts = [0; STEPS];
    hidden.iter().for_each(|&share| counts[usize::from(share) * STEPS / 256] += 1);
    let row = |(step, &count): (usize, &usize)| {
        let of = |step: usize| 100 * step / STEPS;
        vec![
            Cell::Text(format!("{} to {} %", of(step), of(step + 1))),
            Cell::count(count),
            Cell::short(100.0 * count as f64 / hidden.len().max(1) as f64),
        ]
    };
    Table {
        caption: "In how many cells how much of the light is hidden.".into(),
        columns: vec![
            Column::text("of the light is hidden"),
            Column::number("cells"),
            Column::number("share, %"),
        ],
        rows: counts.iter().enumerate().map(row).collect(),
    }
}
