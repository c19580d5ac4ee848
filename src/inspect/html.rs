//! A tree as a page: what it is, where its lights and clusters are, and which matter.

use super::report::{LightReport, TreeReport, by_energy, light};
use super::scene::SceneReport;
use super::walk::{What, walk};
use crate::bounds::Aabb;
use crate::light_tree::LightTree;
use crate::page::{
    Cell, Column, Cuboid, Ink, Level, Mark, Page, Plan, Table, bytes, count, rounded,
};

/// Lights in the table, at most.
const MOST_ROWS: usize = 1_000;
/// Lights that are drawn one by one, at most; all are in the ground of density.
const MOST_MARKS: usize = 10_000;
/// Boxes of a level, at most: beyond, they hide each other.
const MOST_BOXES: usize = 2_000;
/// The level that is shown first has at most so many.
const CLEAR_BOXES: usize = 100;

/// The page of a tree file; of the scene too, if that is what the tree was built from. The tree must
/// have been verified.
pub fn html<D: AsRef<[u8]>>(
    tree: &LightTree<D>,
    report: &TreeReport,
    scene: Option<&SceneReport>,
) -> String {
    let mut page = Page::new(&report.file);
    summary(&mut page, report);
    if let Some(scene) = scene {
        page.heading("What the scene requires");
        page.facts(scene.features().map(|(number, feature)| (feature, count(number))));
        scene.notes.iter().for_each(|note| page.text(&format!("Note: {note}")));
    }
    let boxes = light_boxes(tree);
    page.heading("Where the lights are");
    match plan(tree, report, &boxes) {
        Some(plan) => page.add(&plan),
        None => page.text("Nothing shines."),
    }
    page.heading("Lights");
    page.add(&lights(tree, report, &boxes));
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

fn summary(page: &mut Page, report: &TreeReport) {
    page.facts([
        ("lights", count(report.lights)),
        ("emitters", count(report.emitters)),
        ("energy", format!("{} cd", rounded(report.energy))),
        ("change", count(report.changing)),
        ("forced", count(report.forced)),
        (
            "frames",
            report
                .frames
                .map_or("any".into(), |frames| format!("{} to {}", frames.first, frames.last)),
        ),
        ("file", bytes(report.bytes)),
        ("an emitter", format!("{:.1} bytes", report.bytes_per_emitter)),
        ("built by", report.meta["program"].as_str().unwrap_or("?").into()),
        ("fingerprint", report.fingerprint[..16].into()),
    ]);
}

/// The box of each light in the first frame, world space; empty if it is dark then.
fn light_boxes<D: AsRef<[u8]>>(tree: &LightTree<D>) -> Vec<Aabb> {
    let mut boxes = vec![Aabb::EMPTY; tree.lights().len()];
    walk(tree, |stop| match stop.what {
        What::Cluster => true,
        What::Light(row) | What::Emitter(row) => {
            boxes[row] = boxes[row].union(&stop.aabb);
            false
        }
    });
    boxes
}

fn ink(light: &LightReport) -> Ink {
    match light {
        LightReport { forced: true, .. } => Ink::Red,
        LightReport { changes: true, .. } => Ink::Orange,
        _ => Ink::Blue,
    }
}

fn plan<D: AsRef<[u8]>>(tree: &LightTree<D>, report: &TreeReport, boxes: &[Aabb]) -> Option<Plan> {
    let around = boxes.iter().fold(Aabb::EMPTY, |all, aabb| all.union(aabb));
    if around.is_empty() {
        return None;
    }
    let drawn = report.lights.min(MOST_MARKS);
    let is_shaded = report.emitters > drawn;
    let mut caption = format!(
        "{}, their area in proportion to their energy, down to a size that can be seen.",
        if drawn < report.lights {
            format!("The {} heaviest of {} lights", count(drawn), count(report.lights))
        } else {
            "All lights".into()
        }
    );
    if is_shaded {
        caption +=
            &format!(" The grey ground is the energy of all {} emitters.", count(report.emitters));
    }
    let mut plan = Plan::new(&caption, Cuboid { min: around.min, max: around.max });
    let mut inks = Vec::new();
    for row in by_energy(tree).into_iter().take(MOST_MARKS).filter(|&row| !boxes[row].is_empty()) {
        let light = light(tree, &tree.lights()[row], report.energy);
        let label = format!(
            "{}\n{} cd, {} %, {} emitters",
            light.path,
            rounded(light.energy.into()),
            rounded(100.0 * light.share),
            count(light.emitters as usize)
        );
        let ink = ink(&light);
        inks.push(ink);
        plan.marks.push(Mark {
            at: boxes[row].center(),
            from: None,
            weight: light.energy,
            ink,
            label,
        });
    }
    let names = [
        (Ink::Blue, "stands still"),
        (Ink::Orange, "changes with time, here in the first frame"),
        (Ink::Red, "forced"),
    ];
    let used = names.into_iter().filter(|(ink, _)| inks.contains(ink));
    plan.kinds = used.map(|(ink, name)| (ink, name.into())).collect();
    let mut levels: Vec<Vec<Cuboid>> = Vec::new();
    walk(tree, |stop| {
        if let What::Emitter(_) = stop.what {
            if is_shaded {
                plan.shade(stop.aabb.center(), stop.energy);
            }
            return false;
        }
        if levels.len() <= stop.depth {
            levels.resize(stop.depth + 1, Vec::new());
        }
        // One more than may be shows that there are too many.
        if levels[stop.depth].len() <= MOST_BOXES {
            levels[stop.depth].push(Cuboid { min: stop.aabb.min, max: stop.aabb.max });
        }
        true
    });
    let levels = levels.into_iter().take_while(|boxes| boxes.len() <= MOST_BOXES);
    plan.levels = levels
        .enumerate()
        .map(|(depth, boxes)| Level {
            name: format!("clusters at depth {depth}: {}", count(boxes.len())),
            boxes,
        })
        .collect();
    let is_clear = |level: &Level| level.boxes.len() <= CLEAR_BOXES;
    plan.shown = plan.levels.iter().rposition(is_clear).unwrap_or(0);
    Some(plan)
}

fn lights<D: AsRef<[u8]>>(tree: &LightTree<D>, report: &TreeReport, boxes: &[Aabb]) -> Table {
    let number = |value: f64| Cell::Number(value, rounded(value));
    let rows = by_energy(tree).into_iter().take(MOST_ROWS).map(|row| {
        let light = light(tree, &tree.lights()[row], report.energy);
        let mut words = vec![light.kind, if light.changes { "changes" } else { "still" }];
        words.extend(light.forced.then_some("forced"));
        words.extend((light.placed && !light.forced).then_some("placed"));
        let mut cells = vec![
            Cell::Text(light.path.clone()),
            Cell::Key(ink(&light), words.join(", ")),
            number(light.energy.into()),
            number(100.0 * light.share),
            Cell::Number(light.emitters.into(), count(light.emitters as usize)),
        ];
        let aabb = boxes[row];
        match aabb.is_empty() {
            true => cells.extend([Cell::Empty, Cell::Empty, Cell::Empty, Cell::Empty]),
            false => {
                cells.extend(aabb.center().to_array().map(|metres| number(metres.into())));
                cells.push(number(aabb.extent().max_element().into()));
            }
        }
        cells
    });
    Table {
        caption: if report.lights > MOST_ROWS {
            format!("The {} heaviest of {}.", count(MOST_ROWS), count(report.lights))
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
        rows: rows.collect(),
    }
}

fn trees(report: &TreeReport) -> Table {
    let number = |value: usize| Cell::Number(value as f64, count(value));
    let real = |value: f64, text: String| Cell::Number(value, text);
    Table {
        caption: "By kind: lights in their own space, what stands still, each frame.".into(),
        columns: [Column::text("kind")]
            .into_iter()
            .chain(
                ["trees", "leaves", "groups", "fill, %", "deepest", "mean depth", "cost"]
                    .map(Column::number),
            )
            .collect(),
        rows: report
            .trees
            .iter()
            .map(|shape| {
                vec![
                    Cell::Text(shape.kind.into()),
                    number(shape.trees),
                    number(shape.leaves),
                    number(shape.groups),
                    real(shape.fill, format!("{:.1}", 100.0 * shape.fill)),
                    number(shape.deepest),
                    real(shape.mean_depth, format!("{:.2}", shape.mean_depth)),
                    real(shape.cost, format!("{:.2}", shape.cost)),
                ]
            })
            .collect(),
    }
}

fn sections(report: &TreeReport) -> Table {
    Table {
        caption: format!("{} in all.", bytes(report.bytes)),
        columns: vec![Column::text("section"), Column::number("bytes"), Column::text("")],
        rows: report
            .sections
            .iter()
            .map(|section| {
                let need = if section.required { "required" } else { "optional" };
                vec![
                    Cell::Text(section.id.clone()),
                    Cell::Number(section.bytes as f64, count(section.bytes as usize)),
                    Cell::Text(need.into()),
                ]
            })
            .collect(),
    }
}
