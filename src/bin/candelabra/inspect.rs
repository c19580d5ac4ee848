//! `candelabra inspect`: what is in a scene or in a tree file.

use anyhow::Result;
use candelabra::emitter::Emitters;
use candelabra::light_tree::LightRow;
use candelabra::pipeline;
use candelabra::scene::{Requirements, Scene};
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct Arguments {
    /// A scene (.gltf, .glb, .obj) or a tree file (.ltree)
    file: PathBuf,
}

/// Lights that are named.
const HEAVIEST: usize = 10;

pub fn run(arguments: &Arguments) -> Result<()> {
    let mut out = std::io::stdout().lock();
    if arguments.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("ltree")) {
        inspect_tree(&mut out, &arguments.file)
    } else {
        inspect_scene(&mut out, &pipeline::load_scene(&arguments.file)?)
    }
}

fn inspect_scene(out: &mut impl Write, scene: &Scene) -> Result<()> {
    let triangles_of = |mesh: u32| scene.meshes[mesh as usize].triangles.len();
    let stored: usize = scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    let placed: usize = scene.instances.iter().map(|i| triangles_of(i.mesh)).sum();
    writeln!(out, "{}", scene.source.display())?;
    writeln!(out, "  nodes       {}", scene.nodes.len())?;
    writeln!(out, "  meshes      {} with {stored} triangles", scene.meshes.len())?;
    writeln!(out, "  instances   {} with {placed} triangles", scene.instances.len())?;
    writeln!(out, "  materials   {}", scene.materials.len())?;
    for (i, camera) in scene.cameras.iter().enumerate() {
        let path = &scene.nodes[camera.node as usize].path;
        writeln!(out, "  camera {i}    {path}, {:.1} degrees high", camera.yfov_rad.to_degrees())?;
    }
    let frames = pipeline::frames_of(scene);
    if let ([first, .., last], rate) = (frames.as_slice(), scene.timeline.frames_per_second) {
        writeln!(out, "  frames      {first} to {last} at {rate} a second")?;
    }
    let emitters = Emitters::collect(scene);
    writeln!(
        out,
        "  emitters    {} of {} lights; {} change",
        emitters.len(),
        emitters.lights().len(),
        emitters.changing_count()
    )?;
    print_requirements(out, &scene.requirements())?;
    for note in &scene.notes {
        writeln!(out, "  note: {note}")?;
    }
    Ok(())
}

/// The features that the scene switches on.
fn print_requirements(out: &mut impl Write, needs: &Requirements) -> Result<()> {
    let features = [
        (needs.mesh_lights, "mesh lights"),
        (needs.textured_mesh_lights, "textured mesh lights"),
        (needs.shaped_lights, "emission profiles"),
        (needs.varying_lights, "lights that vary"),
        (needs.spheres, "sphere lights"),
        (needs.points, "point lights"),
        (needs.spots, "spot lights"),
        (needs.suns, "suns"),
        (needs.domes, "domes"),
        (needs.shared_meshes, "meshes shared by instances"),
        (needs.animated_nodes, "animated nodes"),
        (needs.textures, "textures"),
        (needs.cutouts, "cut-out materials"),
        (needs.normal_maps, "normal maps"),
        (needs.fog, "fog"),
        (needs.lenses, "camera lenses"),
    ];
    writeln!(out, "  requires")?;
    for (count, feature) in features.into_iter().filter(|(count, _)| *count > 0) {
        writeln!(out, "    {count:>8}  {feature}")?;
    }
    Ok(())
}

fn inspect_tree(out: &mut impl Write, path: &Path) -> Result<()> {
    let tree = pipeline::open_tree(path, true)?;
    let emitters = tree.emitter_count();
    let each = tree.byte_length() as f64 / emitters.max(1) as f64;
    writeln!(out, "{}: sound", path.display())?;
    writeln!(out, "  {} bytes, {each:.1} an emitter; {}", tree.byte_length(), tree.meta())?;
    for section in tree.sections() {
        let need = if section.required != 0 { "required" } else { "optional" };
        writeln!(out, "  section {}  {:>12} bytes  {need}", section.id, section.length)?;
    }
    let count = |class| tree.lights().iter().filter(|light| light.is(class)).count();
    writeln!(
        out,
        "  {emitters} emitters of {} lights, {} lights change, {} are forced; {} trees, {} instances, {} frames",
        tree.lights().len(),
        count(LightRow::CHANGES),
        count(LightRow::FORCED),
        tree.trees().len(),
        tree.instances().len(),
        tree.frames().len()
    )?;
    let total: f64 = tree.lights().iter().map(|light| f64::from(light.energy)).sum();
    let mut heaviest: Vec<_> = tree.lights().iter().collect();
    heaviest.sort_by(|a, b| b.energy.total_cmp(&a.energy));
    writeln!(out, "  heaviest lights")?;
    for light in heaviest.into_iter().take(HEAVIEST) {
        let share = 100.0 * f64::from(light.energy) / total;
        let count = light.emitter_count;
        writeln!(out, "    {share:>6.2} %  {count:>8} emitters  {}", tree.light_path(light))?;
    }
    Ok(())
}
