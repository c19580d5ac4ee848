//! A shot: prepared once, then frame after frame.

use crate::arguments::Arguments;
use crate::progress::Bar;
use crate::texture_bar::TextureBar;
use anyhow::{Context, Result, bail};
use candelabra::emitter::Emitters;
use candelabra::light_tree::{ALGORITHM_VERSION, LightTree};
use candelabra::page::Plain;
use candelabra::pipeline::{self, OpenedTree, TreeChoice, TreeError, with_trees};
use candelabra::render::exr::{ExrOptions, read_metadata, write_exr};
use candelabra::render::frames::Frames;
use candelabra::render::png::{exposure_for, write_png};
use candelabra::render::{RenderDelegate, RenderSettings};
use candelabra::scene::{Camera, Node, Scene};
use candelabra::store::check_writable;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::io;
use std::path::Path;
use std::str::FromStr;
use std::time::Instant;

/// Renders what the arguments ask for and returns how many frames failed.
pub fn render(arguments: &Arguments) -> Result<usize> {
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    if let Some(frames) = &arguments.frames {
        check_names(arguments, frames)?;
    }
    let mut scene = pipeline::load_scene(&arguments.scene)?;
    for note in &scene.notes {
        eprintln!("note: {}", Plain(note));
    }
    if let Some(strict) = &arguments.strict {
        strict.check(&scene)?;
    }
    pipeline::force_lights(&mut scene, &arguments.force_light)
        .with_context(|| arguments.scene.display().to_string())?;
    if let Some(fog) = &arguments.fog {
        scene.medium = Some(fog.clone());
    }
    let frames = match &arguments.frames {
        Some(frames) => frames.clone(),
        None => {
            let first = Frames::from_str(&pipeline::frames_of(&scene)[0].to_string())?;
            check_names(arguments, &first)?;
            first
        }
    };
    let look = pipeline::look(&mut scene, &arguments.view, arguments.aspect())?;
    if let Some(note) = &look.note {
        eprintln!("note: {}", Plain(note));
    }
    let camera = look.camera;
    refuse_to_overwrite(arguments, &scene, &frames)?;
    if let Some(path) = &arguments.tree {
        let choice = TreeChoice {
            file: Some(path.clone()),
            forced: arguments.force_light.clone(),
            verify: !arguments.no_verify,
        };
        let bar = TextureBar::new();
        return with_trees(
            &scene,
            &choice,
            &|done, all| bar.show(done, all),
            |emitters, mut trees| {
                let mut checked = None;
                for &frame in frames.as_slice() {
                    match trees.for_frame(frame) {
                        Ok(_) => checked = Some(frame),
                        // If there is another frame, the delegate says so of this one.
                        Err(TreeError::NoSuchFrame { .. }) => {}
                        Err(error) => return Err(error.into()),
                    }
                }
                let tree = trees.for_frame(checked.unwrap_or(frames.as_slice()[0]))?;
                render_frames(arguments, &scene, emitters, &tree, camera, &frames)
            },
        );
    }
    let emitters = collect(&scene);
    let mut ascending = frames.as_slice().to_vec();
    ascending.sort_unstable();
    let survey = pipeline::survey(&scene, &emitters, &ascending)?;
    let bytes = pipeline::build_tree(&survey);
    let tree = LightTree::open(bytes)?;
    render_frames(arguments, &scene, &emitters, &tree, camera, &frames)
}

/// The emitters of a scene, with a progress bar if that takes long.
fn collect(scene: &Scene) -> Emitters {
    let bar = TextureBar::new();
    pipeline::collect_emitters(scene, None::<&OpenedTree>, &|done, all| bar.show(done, all))
}

/// No picture may replace what it is rendered from.
fn refuse_to_overwrite(arguments: &Arguments, scene: &Scene, frames: &Frames) -> Result<()> {
    for &frame in frames.as_slice() {
        let picture = arguments.output.path(frame);
        for output in [picture.with_extension("png"), picture] {
            let is_tree = || arguments.tree.as_ref().is_some_and(|tree| same_file(tree, &output));
            if scene.files.iter().any(|input| same_file(input, &output)) || is_tree() {
                bail!("{}: is an input of this render; choose another name", output.display());
            }
        }
    }
    Ok(())
}

/// Refuses a shot whose frames would share a name, or of which none can be written. A shot to be resumed
/// may be done, and then nothing has to be written.
fn check_names(arguments: &Arguments, frames: &Frames) -> Result<()> {
    arguments.output.check(frames)?;
    if arguments.resume {
        return Ok(());
    }
    let mut checks = frames.as_slice().iter().map(|&frame| check_outputs(arguments, frame));
    let first = checks.next().expect("there is a frame");
    if first.is_err() && !checks.any(|check| check.is_ok()) {
        first?;
    }
    Ok(())
}

/// Makes sure that a frame's picture, and its preview if there is to be one, can be written.
fn check_outputs(arguments: &Arguments, frame: i32) -> io::Result<()> {
    let picture = arguments.output.path(frame);
    if arguments.png {
        check_writable(&picture.with_extension("png"))?;
    }
    check_writable(&picture)
}

fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// This very program, by its content: another build may make other pictures.
fn program_fingerprint() -> [u8; 32] {
    let bytes = std::env::current_exe().and_then(std::fs::read).unwrap_or_default();
    *blake3::hash(&bytes).as_bytes()
}

/// What a picture was rendered from, kept in its metadata.
#[derive(Serialize, Deserialize)]
struct Stamp {
    software: String,
    frame: i32,
    fingerprint: String,
    settings: serde_json::Value,
    camera: serde_json::Value,
}

/// Preparations that take less, in seconds, are not worth a line.
const LEAST_TOLD_S: f64 = 0.1;
const SOFTWARE: &str = concat!("candelabra-render ", env!("CARGO_PKG_VERSION"));

impl Stamp {
    /// The fingerprint covers everything that the pixels depend on. The tree is not part of it: a fresh one
    /// follows from the scene and the algorithm, and its own fingerprint covers all frames that it was
    /// built for.
    fn new(
        content: &[[u8; 32]; 2],
        (camera, place): (&Camera, &[&Node]),
        arguments: &Arguments,
        settings: &RenderSettings,
        frame: i32,
    ) -> Result<Stamp> {
        let settings = serde_json::to_value(settings)?;
        let mut hasher = blake3::Hasher::new();
        hasher.update(content.as_flattened());
        let (float, sound) = (arguments.float, !arguments.no_verify);
        let (fog, forced) = (&arguments.fog, &arguments.force_light);
        let rest = format!(
            "{SOFTWARE} {ALGORITHM_VERSION} {camera:?} {place:?} {fog:?} {forced:?} {float} {sound} \
             {settings} {frame}"
        );
        hasher.update(rest.as_bytes());
        let fingerprint = hasher.finalize().to_hex().to_string();
        let camera = json!({
            "path": place[0].path,
            "exposure_scale": camera.exposure_scale,
        });
        Ok(Stamp { software: SOFTWARE.into(), frame, fingerprint, settings, camera })
    }

    /// Whether a picture is there, whole, and rendered from the same.
    fn is_on(&self, path: &Path) -> bool {
        let metadata = read_metadata(path);
        let stamp = metadata.and_then(|text| serde_json::from_str::<Stamp>(&text).ok());
        stamp.is_some_and(|stamp| stamp.fingerprint == self.fingerprint)
    }
}

fn render_frames<D: AsRef<[u8]> + Sync>(
    arguments: &Arguments,
    scene: &Scene,
    emitters: &Emitters,
    tree: &LightTree<D>,
    camera: Camera,
    frames: &Frames,
) -> Result<usize> {
    let settings = arguments.settings(camera.aspect);
    let content = [pipeline::scene_fingerprint(scene)?, program_fingerprint()];
    let place = place_of(scene, &camera);
    let stamp_of = |frame| Stamp::new(&content, (&camera, &place), arguments, &settings, frame);
    let height = settings.height;
    let bar = Bar::new(frames.as_slice().len(), height);
    // Prepared when the first frame needs it: a finished shot resumes at once.
    let mut delegate = None;
    let (mut failed, mut exposure) = (0, arguments.exposure);
    for &frame in frames.as_slice() {
        let path = arguments.output.path(frame);
        let stamp = stamp_of(frame)?;
        let has_preview = !arguments.png || path.with_extension("png").exists();
        if arguments.resume && has_preview && stamp.is_on(&path) {
            bar.line(&format!("frame {frame}: {} is up to date", path.display()));
            bar.skip(height);
            continue;
        }
        let rendered =
            check_outputs(arguments, frame).map_err(anyhow::Error::from).and_then(|()| {
                let delegate = delegate.get_or_insert_with(|| {
                    bar.preparing();
                    let started = Instant::now();
                    let delegate = RenderDelegate::new(
                        scene,
                        emitters,
                        tree,
                        camera.clone(),
                        settings.clone(),
                    );
                    let seconds = started.elapsed().as_secs_f64();
                    if seconds >= LEAST_TOLD_S {
                        bar.line(&format!("rays prepared in {seconds:.2} s"));
                    }
                    delegate
                });
                bar.frame(frame);
                render_frame(delegate, arguments, &stamp, &path, &bar, &mut exposure)
            });
        match rendered {
            Ok(line) => bar.line(&line),
            Err(error) => {
                failed += 1;
                bar.skip(height);
                bar.line(&format!("frame {frame}: failed: {error:#}"));
            }
        }
    }
    Ok(failed)
}

/// The camera's node, and all above it.
fn place_of<'a>(scene: &'a Scene, camera: &Camera) -> Vec<&'a Node> {
    let node = |number: u32| &scene.nodes[number as usize];
    let above = |node_: &&'a Node| node_.parent.map(node);
    std::iter::successors(Some(node(camera.node)), above).collect()
}

/// Renders and writes one frame; returns the line that tells what was done.
fn render_frame<D: AsRef<[u8]> + Sync>(
    delegate: &RenderDelegate<D>,
    arguments: &Arguments,
    stamp: &Stamp,
    path: &Path,
    bar: &Bar,
    exposure: &mut Option<f32>,
) -> Result<String> {
    let started = Instant::now();
    let rendered = delegate.render(stamp.frame, bar)?;
    let seconds = started.elapsed().as_secs_f64();
    let options = ExrOptions {
        float_beauty: arguments.float,
        depth: true,
        normal: true,
        albedo: true,
        variance: true,
        sample_count: true,
    };
    let metadata = serde_json::to_string(stamp)?;
    write_exr(path, &rendered.buffers, &options, &metadata)
        .with_context(|| "writing the picture")?;
    if arguments.png {
        // One exposure for the shot, or the previews would flicker.
        let stops = *exposure.get_or_insert_with(|| exposure_for(&rendered.buffers));
        write_png(&path.with_extension("png"), &rendered.buffers, stops)
            .with_context(|| "writing the preview")?;
    }
    let stats = rendered.stats;
    Ok(format!(
        "frame {}: {seconds:.2} s, {:.2} million rays a second, {} light picks -> {}",
        stamp.frame,
        stats.rays as f64 / seconds / 1e6,
        stats.light_picks,
        path.display()
    ))
}
