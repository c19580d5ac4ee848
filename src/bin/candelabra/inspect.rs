//! `candelabra inspect`: what is in a scene or in a tree file.

use crate::page;
use crate::stderr::say;
use anyhow::{Context, Result, ensure};
use candelabra::emitter::Emitters;
use candelabra::inspect::{self, SceneReport, TableReport, TreeReport};
use candelabra::light_tree::LightTree;
use candelabra::page::{Lines, Short, counted, plain_json};
use candelabra::pipeline::{self, Strict};
use clap::Args;
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// A scene (.gltf, .glb, .obj), a tree file (.ltree) or a table of what is hidden (.lvis)
    file: PathBuf,
    /// Name so many of a tree's heaviest lights
    #[arg(long, value_name = "COUNT", default_value_t = 10)]
    lights: usize,
    /// Print JSON
    #[arg(long, group = "form")]
    json: bool,
    /// Print the top of the tree as a graph for Graphviz (`| dot -Tsvg`); a scene's tree is built for it
    #[arg(long, group = "form")]
    dot: bool,
    /// How far down the graph goes
    #[arg(long, requires = "dot", default_value_t = 2)]
    depth: usize,
    /// Write a page with pictures of the lights and the clusters, or of where how much is hidden; a scene's tree is
    /// built for it
    #[arg(long, value_name = "FILE", group = "form")]
    html: Option<PathBuf>,
    /// Take notes about a scene for errors: all, or those of the categories given, such as
    /// --strict=lights,cameras (lights, materials, geometry, cameras, animation, other)
    #[arg(long, value_name = "CATEGORIES", num_args = 0..=1, require_equals = true, default_missing_value = Strict::EVERYTHING)]
    strict: Option<Strict>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    if let Some(page) = &arguments.html {
        page::check(page, &[&arguments.file])?;
    }
    if pipeline::is_tree_file(&arguments.file) {
        let tree = pipeline::open_tree(&arguments.file, true)?;
        show_tree(arguments, &tree, None)
    } else if pipeline::is_table_file(&arguments.file) {
        show_table(arguments)
    } else {
        show_scene(arguments)
    }
}

/// A table of what is hidden from where.
fn show_table(arguments: &Arguments) -> Result<()> {
    let file = arguments.file.display().to_string();
    ensure!(
        !arguments.dot,
        "{file}: --dot draws scenes and trees; of a table there are --json and --html"
    );
    let table = pipeline::open_learned(&arguments.file, true)?;
    let report = TableReport::of(&table);
    if arguments.json {
        return print_json(&report);
    }
    if let Some(page) = &arguments.html {
        return page::write(page, &inspect::table_html(&table, &report, &file));
    }
    let mut out = Lines(std::io::stdout().lock());
    writeln!(out, "{file}: sound")?;
    writeln!(out, "  {} bytes; {}", report.bytes, table.meta())?;
    let (cells, groups) = (counted(report.cells, "cell"), counted(report.groups, "group"));
    let share = 100.0 * report.hidden;
    writeln!(out, "  {cells}, {groups} in each; {share:.1} % of their clusters are hidden")?;
    if let Some(share) = report.light_hidden {
        let share = 100.0 * share;
        writeln!(out, "  {share:.1} % of the light is hidden, in the mean of the cells")?;
    }
    Ok(())
}

fn show_scene(arguments: &Arguments) -> Result<()> {
    let scene = pipeline::load_scene(&arguments.file)?;
    if let Some(Err(refused)) = arguments.strict.as_ref().map(|strict| strict.check(&scene)) {
        scene.notes.iter().for_each(|note| say(format_args!("note: {note}")));
        return Err(refused.into());
    }
    let emitters = Emitters::collect(&scene);
    let report = SceneReport::of(&scene, &emitters);
    if arguments.json {
        return print_json(&report);
    }
    if !arguments.dot && arguments.html.is_none() {
        return print_scene(&mut Lines(std::io::stdout().lock()), &report);
    }
    let survey = pipeline::survey(&scene, &emitters, &pipeline::frames_of(&scene))
        .with_context(|| arguments.file.display().to_string())?;
    let tree = LightTree::open(pipeline::build_tree(&survey))?;
    show_tree(arguments, &tree, Some(&report))
}

fn show_tree<D: AsRef<[u8]>>(
    arguments: &Arguments,
    tree: &LightTree<D>,
    scene: Option<&SceneReport>,
) -> Result<()> {
    let mut out = Lines(std::io::stdout().lock());
    let file = arguments.file.display().to_string();
    let report = TreeReport::of(tree, &file, arguments.lights);
    if arguments.json {
        return print_json(&report);
    }
    if arguments.dot {
        out.write_all(inspect::dot(tree, arguments.depth).as_bytes())?;
        return Ok(());
    }
    let Some(page) = &arguments.html else { return print_tree(&mut out, &report) };
    page::write(page, &inspect::html(tree, &report, scene))
}

fn print_json(report: &impl Serialize) -> Result<()> {
    let json = plain_json(&serde_json::to_string_pretty(report)?);
    writeln!(std::io::stdout().lock(), "{json}")?;
    Ok(())
}

fn print_scene(out: &mut impl Write, report: &SceneReport) -> Result<()> {
    writeln!(out, "{}", report.file)?;
    writeln!(out, "  nodes       {}", report.nodes)?;
    writeln!(out, "  meshes      {} with {} triangles", report.meshes, report.stored_triangles)?;
    writeln!(out, "  instances   {} with {} triangles", report.instances, report.placed_triangles)?;
    writeln!(out, "  materials   {}", report.materials)?;
    for (i, camera) in report.cameras.iter().enumerate() {
        let height = match (camera.height_deg, camera.height_m) {
            (Some(degrees), _) => {
                let last = camera.last_height.map(|last| format!(" to {last:.1}"));
                format!("{degrees:.1}{} degrees high", last.unwrap_or_default())
            }
            (None, metres) => {
                let last = camera.last_height.map(|last| format!(" to {}", Short(last.into())));
                let (first, last) = (Short(metres.unwrap_or(0.0).into()), last.unwrap_or_default());
                format!("orthographic, {first}{last} m high")
            }
        };
        let varies = if camera.lens_varies { ", its lens varies" } else { "" };
        let hidden = if camera.hidden { ", hidden" } else { "" };
        writeln!(out, "  camera {i}    {}, {height}{varies}{hidden}", camera.path)?;
    }
    if let Some(frames) = report.frames {
        let rate = report.frames_per_second;
        writeln!(out, "  frames      {} to {} at {rate} a second", frames.first, frames.last)?;
    }
    writeln!(
        out,
        "  emitters    {} of {} lights; {} change",
        report.emitters, report.lights, report.changing
    )?;
    writeln!(out, "  {:>10}  {:<31}  {:<8}  {:>12}", "found", "feature", "is", "bytes")?;
    for feature in &report.features {
        let (name, state) = (feature.name, feature.state.word());
        let bytes = feature.bytes.map_or(String::new(), |bytes| bytes.to_string());
        let note = feature.note.unwrap_or_default();
        let line = format!("  {:>10}  {name:<31}  {state:<8}  {bytes:>12}  {note}", feature.found);
        writeln!(out, "{}", line.trim_end())?;
    }
    for group in &report.light_groups {
        writeln!(out, "  light group {}: {}", group.name, counted(group.lights, "light"))?;
    }
    for note in &report.notes {
        writeln!(out, "  note: {note}")?;
    }
    Ok(())
}

fn print_tree(out: &mut impl Write, report: &TreeReport) -> Result<()> {
    let TreeReport { file, bytes, bytes_per_emitter, meta, .. } = report;
    writeln!(out, "{file}: sound")?;
    writeln!(out, "  {bytes} bytes, {bytes_per_emitter:.1} an emitter; {meta}")?;
    for section in &report.sections {
        let need = if section.required { "required" } else { "optional" };
        writeln!(out, "  section {}  {:>12} bytes  {need}", section.id, section.bytes)?;
    }
    writeln!(
        out,
        "  {} of {} ({} change, {} forced); {}, {}, {}",
        counted(report.emitters, "emitter"),
        counted(report.lights, "light"),
        report.changing,
        report.forced,
        counted(report.trees.iter().map(|shape| shape.trees).sum(), "tree"),
        counted(report.instances, "instance"),
        counted(report.frames.map_or(0, |frames| frames.count), "frame")
    )?;
    if report.linked > 0 {
        let (lights, sets) =
            (counted(report.linked, "light"), counted(report.link_sets, "link set"));
        writeln!(out, "  {lights} not for everything, in {sets}")?;
    }
    writeln!(
        out,
        "  {:<8} {:>6} {:>10} {:>10} {:>7} {:>8} {:>11} {:>7}",
        "trees", "", "leaves", "groups", "fill", "deepest", "mean depth", "cost"
    )?;
    for shape in &report.trees {
        writeln!(
            out,
            "  {:<8} {:>6} {:>10} {:>10} {:>5.1} % {:>8} {:>11.2} {:>7.2}",
            shape.kind,
            shape.trees,
            shape.leaves,
            shape.groups,
            100.0 * shape.fill,
            shape.deepest,
            shape.mean_depth,
            shape.cost
        )?;
    }
    writeln!(out, "  heaviest lights")?;
    for light in &report.heaviest {
        let share = Short(100.0 * light.share).to_string();
        writeln!(out, "    {share:>9} %  {:>8} emitters  {}", light.emitters, light.path)?;
    }
    Ok(())
}
