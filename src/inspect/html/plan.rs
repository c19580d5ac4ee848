//! Where the lights of a tree's first frame are, and the clusters around them.

use super::ink;
use crate::bounds::Aabb;
use crate::inspect::report::{TreeReport, by_energy, light};
use crate::inspect::walk::{What, walk};
use crate::light_tree::LightTree;
use crate::page::{Count, Cuboid, Ink, Level, Mark, Plan, Short};

/// Lights that are drawn one by one, at most. If not all are, a density below shows all emitters.
const MOST_MARKS: usize = 10_000;
/// Boxes of a level, at most: more would hide each other.
const MOST_BOXES: usize = 2_000;
/// Boxes of the level that is shown first, at most.
const CLEAR_BOXES: usize = 100;

/// The box of each light in the first frame, world space; empty if it is dark then.
pub fn light_boxes<D: AsRef<[u8]>>(tree: &LightTree<D>) -> Vec<Aabb> {
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

/// The picture of all that shines; `None` if nothing does.
pub fn plan<D: AsRef<[u8]>>(
    tree: &LightTree<D>,
    report: &TreeReport,
    boxes: &[Aabb],
) -> Option<Plan> {
    let around = boxes.iter().fold(Aabb::EMPTY, |all, aabb| all.union(aabb));
    if around.is_empty() {
        return None;
    }
    let marks = marks(tree, report, boxes);
    let is_shaded = report.emitters > marks.len();
    let mut caption = caption(marks.len(), report.lights);
    if is_shaded {
        let emitters = Count(report.emitters);
        caption += &format!(" The grey ground is the energy of all {emitters} emitters.");
    }
    let mut plan = Plan::new(&caption, Cuboid { min: around.min, max: around.max });
    plan.marks = marks;
    let kinds = [
        (Ink::Blue, "stands still"),
        (Ink::Orange, "changes with time, here in the first frame"),
        (Ink::Red, "forced"),
    ];
    let is_there = |ink| plan.marks.iter().any(|mark| mark.ink == ink);
    let kinds = kinds.into_iter().filter(|&(ink, _)| is_there(ink));
    plan.kinds = kinds.map(|(ink, name)| (ink, name.into())).collect();

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
    let clear = levels.into_iter().take_while(|boxes| boxes.len() <= MOST_BOXES);
    let name = |(depth, boxes): (usize, Vec<Cuboid>)| {
        let name = format!("clusters at depth {depth}: {}", Count(boxes.len()));
        Level { name, boxes }
    };
    plan.levels = clear.enumerate().map(name).collect();
    let is_clear = |level: &Level| level.boxes.len() <= CLEAR_BOXES;
    plan.shown = plan.levels.iter().rposition(is_clear).unwrap_or(0);
    Some(plan)
}

fn caption(drawn: usize, lights: usize) -> String {
    let area = "their area in proportion to their energy, down to a size that can be seen.";
    match (drawn, lights > MOST_MARKS) {
        (0, true) => format!("Of {} lights none is heavier than the rest.", Count(lights)),
        (_, true) => format!("The {} heaviest of {} lights, {area}", Count(drawn), Count(lights)),
        (_, false) => format!("All lights, {area}"),
    }
}

/// The heaviest lights. Of lights with equal energy either all are drawn or none.
fn marks<D: AsRef<[u8]>>(tree: &LightTree<D>, report: &TreeReport, boxes: &[Aabb]) -> Vec<Mark> {
    let rows = by_energy(tree);
    let energy = |row: usize| tree.lights()[row].energy;
    let left_out = rows.get(MOST_MARKS).map_or(f32::NEG_INFINITY, |&row| energy(row));
    let rows = rows.into_iter().take_while(|&row| energy(row) > left_out);
    let rows = rows.filter(|&row| !boxes[row].is_empty());
    let mark = |row: usize| {
        let light = light(tree, &tree.lights()[row], report.energy);
        let (energy, share) = (Short(light.energy.into()), Short(100.0 * light.share));
        let emitters = Count(light.emitters as usize);
        Mark {
            at: boxes[row].center(),
            from: None,
            weight: light.energy,
            ink: ink(&light),
            label: format!("{}\n{energy} cd, {share} %, emitters: {emitters}", light.path),
        }
    };
    rows.map(mark).collect()
}
