//! A tree as a page: what it is, where its lights and clusters are, and which matter.

mod plan;
mod table;

pub use table::table_html;

use super::features::{Feature, FeatureState};
use super::report::{LightReport, TreeReport, by_energy, light};
use super::scene::{LightGroupReport, SceneReport};
use crate::bounds::Aabb;
use crate::light_tree::LightTree;
use crate::page::{Cell, Column, Count, Ink, Page, Short, Table};
use plan::{light_boxes, plan};

/// Lights in the table, at most.
const MOST_ROWS: usize = 1_000;

/// The page of a tree file. `scene` is given if the tree was built from that scene; then the page tells
/// what the scene requires. The tree must have been verified.
pub fn html<D: AsRef<[u8]>>(
    tree: &LightTree<D>,
    report: &TreeReport,
    scene: Option<&SceneReport>,
) -> String {
    let mut page = Page::new(&report.file);
    summary(&mut page, report);
    let boxes = light_boxes(tree);
    page.heading("Where the lights are");
    match plan(tree, report, &boxes) {
        Some(plan) => page.add(&plan),
        None => page.text("Nothing shines."),
    }
    page.heading("Lights");
    page.add(&lights(tree, report, &boxes));
    if let Some(scene) = scene {
        page.heading("What the scene requires");
        page.add(&features(scene));
        if !scene.light_groups.is_empty() {
            page.add(&light_groups(scene));
        }
        scene.notes.iter().for_each(|note| page.text(&format!("Note: {note}")));
    }
    page.heading("Trees");
    page.text(
        "Depth: groups on the way to a leaf. Fill: lanes of the groups that are used. Cost: groups that \
         a viewer opens who opens the root, by the measure that the build keeps low.",
    );
    page.add(&trees(report));
    page.heading("Sections of the file");
    page.add(&sections(report));
    page.finish()
}

fn features(scene: &SceneReport) -> Table {
    let row = |feature: &Feature| {
        let ink = match feature.state {
            FeatureState::On => Ink::Orange,
            FeatureState::Off => Ink::Grey,
            FeatureState::Offered => Ink::Blue,
        };
        vec![
            Cell::Text(feature.name.into()),
            Cell::count(feature.found),
            Cell::Key(ink, feature.state.word().into()),
            feature.bytes.map_or(Cell::Empty, |bytes| Cell::count(bytes as usize)),
            feature.note.map_or(Cell::Empty, |note| Cell::Text(note.into())),
        ]
    };
    Table {
        caption: "What is found, and whether it is switched on. Bytes: what it takes there, if that is known."
            .into(),
        columns: vec![
            Column::text("feature"),
            Column::number("found"),
            Column::text("is"),
            Column::number("bytes"),
            Column::text("why, and at what cost"),
        ],
        rows: scene.features.iter().map(row).collect(),
    }
}

fn light_groups(scene: &SceneReport) -> Table {
    let row =
        |group: &LightGroupReport| vec![Cell::Text(group.name.clone()), Cell::count(group.lights)];
    Table {
        caption: "Light groups: a layer each, if asked.".into(),
        columns: vec![Column::text("light group"), Column::number("lights")],
        rows: scene.light_groups.iter().map(row).collect(),
    }
}

fn summary(page: &mut Page, report: &TreeReport) {
    let frames = report.frames.map(|frames| format!("{} to {}", frames.first, frames.last));
    let program = report.meta["program"].as_str().unwrap_or("?");
    page.facts([
        ("lights", Count(report.lights).to_string()),
        ("emitters", Count(report.emitters).to_string()),
        ("energy", format!("{} cd", Short(report.energy))),
        ("lights that change", Count(report.changing).to_string()),
        ("forced lights", Count(report.forced).to_string()),
        ("frames", frames.unwrap_or("any".into())),
        ("bytes", Count(report.bytes).to_string()),
        ("bytes an emitter", format!("{:.1}", report.bytes_per_emitter)),
        ("built by", program.into()),
        ("fingerprint", report.fingerprint[..16].into()),
    ]);
}

/// The colour of a light's mark: whether it is forced, changes or stands still.
fn ink(light: &LightReport) -> Ink {
    match light {
        LightReport { forced: true, .. } => Ink::Red,
        LightReport { changes: true, .. } => Ink::Orange,
        _ => Ink::Blue,
    }
}

fn lights<D: AsRef<[u8]>>(tree: &LightTree<D>, report: &TreeReport, boxes: &[Aabb]) -> Table {
    let row = |row: usize| {
        let light = light(tree, &tree.lights()[row], report.energy);
        let mut words = vec![light.kind];
        words.extend(light.changes.then_some("changes"));
        words.extend(light.forced.then_some("forced"));
        words.extend((light.placed && !light.forced).then_some("placed"));
        let mut cells = vec![
            Cell::Text(light.path.clone()),
            Cell::Key(ink(&light), words.join(", ")),
            Cell::short(light.energy.into()),
            Cell::short(100.0 * light.share),
            Cell::count(light.emitters as usize),
        ];
        match boxes[row] {
            aabb if aabb.is_empty() => cells.extend([const { Cell::Empty }; 4]),
            aabb => {
                let center = aabb.center().to_array();
                cells.extend(center.map(|metres| Cell::short(metres.into())));
                cells.push(Cell::short(aabb.extent().max_element().into()));
            }
        }
        cells
    };
    Table {
        caption: if report.lights > MOST_ROWS {
            format!("The {} heaviest of {}.", Count(MOST_ROWS), Count(report.lights))
        } else {
            "All of them.".into()
        },
        columns: vec![
            Column::text("path"),
            Column::text("kind"),
            Column::number("energy, cd"),
            Column::number("share, %"),
            Column::number("emitters"),
            Column::number("x, m"),
            Column::number("y, m"),
            Column::number("z, m"),
            Column::number("size, m"),
        ],
        rows: by_energy(tree).into_iter().take(MOST_ROWS).map(row).collect(),
    }
}

fn trees(report: &TreeReport) -> Table {
    let numbers = ["trees", "leaves", "groups", "fill, %", "deepest", "mean depth", "cost"];
    let mut columns = vec![Column::text("kind")];
    columns.extend(numbers.map(Column::number));
    let rows = report.trees.iter().map(|shape| {
        vec![
            Cell::Text(shape.kind.into()),
            Cell::count(shape.trees),
            Cell::count(shape.leaves),
            Cell::count(shape.groups),
            Cell::short(100.0 * shape.fill),
            Cell::count(shape.deepest),
            Cell::short(shape.mean_depth),
            Cell::short(shape.cost),
        ]
    });
    Table {
        caption: "By kind: lights in their own space, what stands still, each frame.".into(),
        columns,
        rows: rows.collect(),
    }
}

fn sections(report: &TreeReport) -> Table {
    let rows = report.sections.iter().map(|section| {
        let need = if section.required { "required" } else { "optional" };
        vec![
            Cell::Text(section.id.clone()),
            Cell::count(section.bytes as usize),
            Cell::Text(need.into()),
        ]
    });
    Table {
        caption: format!("{} bytes in all, with header and table.", Count(report.bytes)),
        columns: vec![Column::text("section"), Column::number("bytes"), Column::text("need")],
        rows: rows.collect(),
    }
}
