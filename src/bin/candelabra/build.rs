//! `candelabra build`: a scene in, a tree file out.

use crate::texture_bar::TextureBar;
use anyhow::{Context, Result, bail};
use candelabra::emitter::Emitters;
use candelabra::light_tree::LightTree;
use candelabra::page::{Lines, Plain, counted};
use candelabra::pipeline::{self, OpenedTree, Rebuilt, Standing, Strict, Survey, TreeError};
use candelabra::render::frames::Frames;
use candelabra::scene::Scene;
use candelabra::store::{AlignedBytes, check_writable, write_atomically};
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

#[derive(Args)]
pub struct Arguments {
    /// The scene: .gltf, .glb or .obj
    scene: PathBuf,
    /// The tree file to write; the scene's name with .ltree if not given
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Frames to build for, if lights change: 1001-1048, 1001-1048x2, 1,5,9; the scene's own if not
    /// given
    #[arg(long, allow_hyphen_values = true)]
    frames: Option<Frames>,
    /// Leave the lights at or below a prim path out of all estimates and sample them at every point;
    /// may be given again
    #[arg(long, value_name = "PATH")]
    force_light: Vec<String>,
    /// Threads; as many as there are cores if not given
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// A tree file of an earlier version of the scene, of which to take over what has not changed; the
    /// output's own earlier version if not given
    #[arg(long, value_name = "TREE")]
    base: Option<PathBuf>,
    /// Build even if the output is up to date, and all of it
    #[arg(long, conflicts_with = "base")]
    force: bool,
    /// Take notes about the scene for errors: all, or those of the categories given, such as
    /// --strict=lights,cameras (lights, materials, geometry, cameras, animation, other)
    #[arg(long, value_name = "CATEGORIES", num_args = 0..=1, require_equals = true, default_missing_value = Strict::EVERYTHING)]
    strict: Option<Strict>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let started = Instant::now();
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let output = arguments.output.clone().unwrap_or(arguments.scene.with_extension("ltree"));
    // An output that is there may be up to date, and need no writing.
    if !output.is_file() {
        check_writable(&output)?;
    }
    let mut out = Lines(std::io::stdout().lock());

    let load = || {
        let (loaded, loading) = timed(|| pipeline::load_scene(&arguments.scene));
        loaded.map(|scene| (scene, loading))
    };
    // While the scene is read, the output as it is and the base are verified.
    let open = || {
        let before = if arguments.force { None } else { Base::open(&output).ok() };
        (before, arguments.base.as_deref().map(Base::open))
    };
    let (loaded, (before, base)) = rayon::join(load, open);
    let (mut scene, loading) = loaded?;
    for note in &scene.notes {
        eprintln!("note: {}", Plain(note));
    }
    if let Some(strict) = &arguments.strict {
        strict.check(&scene)?;
    }
    let named = || arguments.scene.display().to_string();
    pipeline::force_lights(&mut scene, &arguments.force_light).with_context(named)?;
    let real = |path: &Path| path.canonicalize().ok();
    if scene
        .files
        .iter()
        .any(|input| real(&input.path).is_some() && real(&input.path) == real(&output))
    {
        bail!("{}: is the scene's own file; choose another output", output.display());
    }
    pipeline::check_output(&output)?;
    let (emitters, collecting) = timed(|| collect(&scene));
    let frames = match &arguments.frames {
        Some(frames) => {
            let mut frames = frames.as_slice().to_vec();
            frames.sort_unstable();
            frames
        }
        None => pipeline::frames_of(&scene),
    };
    let (survey, surveying) = timed(|| pipeline::survey(&scene, &emitters, &frames));
    let survey = survey.with_context(named)?;
    writeln!(
        out,
        "{}: {}, {} ({} change), read in {}",
        arguments.scene.display(),
        counted(survey.lights.len(), "light"),
        counted(emitters.len(), "emitter"),
        emitters.changing_count(),
        Seconds(loading),
    )?;
    let before = match before.map(|before| (pipeline::standing(&before.tree, &survey), before)) {
        Some((Standing::UpToDate, _)) => {
            writeln!(out, "{}: up to date", output.display())?;
            return Ok(());
        }
        Some((Standing::Contradicts(what), before)) => {
            let what = format!("{}: contradicts the scene: {what}", before.path.display());
            eprintln!("note: {}; built from the scene alone", Plain(what));
            None
        }
        Some((Standing::OutOfDate, before)) => Some(before),
        None => None,
    };
    check_writable(&output)?;
    let base = match base {
        None => before,
        Some(Ok(base)) => Some(base),
        Some(Err(error)) => {
            eprintln!("note: not built upon {}", Plain(error));
            None
        }
    };
    let (built, building) = timed(|| build(&survey, base, &mut out));
    let Built { bytes, is_partial } = built?;
    let (written, writing) = timed(|| {
        // Only a verified tree may replace the old file.
        let tree = LightTree::open(bytes).and_then(|tree| tree.verify().map(|()| tree));
        let tree = tree.with_context(|| format!("{}: not written", output.display()))?;
        let bytes = tree.into_bytes();
        write_atomically(&output, |file| file.write_all(bytes.as_ref()))?;
        anyhow::Ok(bytes.as_ref().len())
    });
    let size = written?;
    let each = size as f64 / emitters.len().max(1) as f64;
    writeln!(out, "{}: {size} bytes, {each:.1} an emitter", output.display())?;
    writeln!(
        out,
        "emitters found in {}, surveyed in {}, trees built in {}, written in {}",
        Seconds(collecting),
        Seconds(surveying),
        Seconds(building),
        Seconds(writing)
    )?;
    if is_partial {
        return Ok(());
    }
    // Somebody else may have written another tree there since.
    let Ok(with) = with_file(arguments, &scene, &output) else { return Ok(()) };
    let without = match survey.frames.len() {
        0 | 1 => collecting + surveying + building,
        _ => collecting + without_file(&scene, &emitters, frames[0])?,
    };
    report(&mut out, started.elapsed(), without, with)
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let started = Instant::now();
    let done = work();
    (done, started.elapsed())
}

/// The emitters of a scene, computed without a tree file, with a progress bar if that takes long.
fn collect(scene: &Scene) -> Emitters {
    let bar = TextureBar::new();
    pipeline::collect_emitters(scene, None::<&OpenedTree>, &|done, all| bar.show(done, all))
}

/// The time that a process with the file spends on lights, between reading the scene and its first frame.
fn with_file(arguments: &Arguments, scene: &Scene, output: &Path) -> Result<Duration, TreeError> {
    let (checked, with) = timed(|| {
        let tree = pipeline::open_tree(output, true)?;
        let emitters = pipeline::collect_emitters(scene, Some(&tree), &|_, _| {});
        pipeline::check_fresh(&tree, output, scene, &emitters, &arguments.force_light, true)
    });
    checked?;
    Ok(with)
}

/// The time that a process without the file spends on the tree of one frame.
fn without_file(scene: &Scene, emitters: &Emitters, frame: i32) -> Result<Duration> {
    let (survey, surveying) = timed(|| pipeline::survey(scene, emitters, &[frame]));
    let survey = survey?;
    let (_, building) = timed(|| pipeline::build_tree(&survey));
    Ok(surveying + building)
}

/// Reports after how many processes the file has paid for itself. `made` is the time of this process,
/// `without` and `with` are those of a render without and with the file.
fn report(out: &mut impl Write, made: Duration, without: Duration, with: Duration) -> Result<()> {
    write!(
        out,
        "before its first frame a process spends {} on lights without the file, {} with it",
        Seconds(without),
        Seconds(with)
    )?;
    match without.checked_sub(with) {
        Some(saved) if !saved.is_zero() => {
            let processes = (made.as_secs_f64() / saved.as_secs_f64()).ceil().max(1.0);
            writeln!(out, ": the file has paid for itself with process number {processes:.0}")?;
        }
        _ => writeln!(out, ": the file saves no time and serves as a record")?,
    }
    Ok(())
}

/// An earlier tree file, opened.
struct Base {
    path: PathBuf,
    tree: OpenedTree,
    opening: Duration,
}

impl Base {
    fn open(path: &Path) -> Result<Base, TreeError> {
        let (tree, opening) = timed(|| pipeline::open_base(path));
        Ok(Base { path: path.into(), tree: tree?, opening })
    }
}

/// The bytes of a file, and whether part of it was taken over from a base.
struct Built {
    bytes: AlignedBytes,
    is_partial: bool,
}

fn build(survey: &Survey, base: Option<Base>, out: &mut impl Write) -> Result<Built> {
    let Some(Base { path, tree, opening }) = base else {
        return Ok(Built { bytes: pipeline::build_tree(survey), is_partial: false });
    };
    let Rebuilt { bytes, reused, leaves, base_contradicts } = pipeline::rebuild_tree(survey, &tree);
    let path = path.display();
    if base_contradicts {
        eprintln!(
            "note: not built upon {path}: it contradicts the scene in lights that have not changed"
        );
    } else {
        writeln!(
            out,
            "{path}: {reused} of {leaves} leaves taken over, opened and verified in {}",
            Seconds(opening)
        )?;
    }
    Ok(Built { bytes, is_partial: reused > 0 })
}

/// A duration with three digits.
struct Seconds(Duration);

impl std::fmt::Display for Seconds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let seconds = self.0.as_secs_f64();
        if seconds < 0.1 {
            write!(f, "{:.2} ms", seconds * 1e3)
        } else {
            write!(f, "{seconds:.2} s")
        }
    }
}
