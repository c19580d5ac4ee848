//! `candelabra build`: a scene in, a tree file out.

use anyhow::{Context, Result, bail};
use candelabra::emitter::Emitters;
use candelabra::light_tree::LightTree;
use candelabra::page::{Lines, Plain, counted};
use candelabra::pipeline::{self, OpenedTree, Rebuilt, Strict, Survey, TreeError};
use candelabra::render::frames::Frames;
use candelabra::store::{AlignedBytes, write_atomically};
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
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let output = arguments.output.clone().unwrap_or(arguments.scene.with_extension("ltree"));
    let mut out = Lines(std::io::stdout().lock());

    let load = || {
        let started = Instant::now();
        pipeline::load_scene(&arguments.scene).map(|scene| (scene, started.elapsed()))
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
    pipeline::force_lights(&mut scene, &arguments.force_light)
        .with_context(|| arguments.scene.display().to_string())?;
    let real = |path: &Path| path.canonicalize().ok();
    if scene.files.iter().any(|input| real(input).is_some() && real(input) == real(&output)) {
        bail!("{}: is the scene's own file; choose another output", output.display());
    }
    pipeline::check_output(&output)?;
    let emitters = Emitters::collect(&scene);
    let frames = match &arguments.frames {
        Some(frames) => {
            let mut frames = frames.as_slice().to_vec();
            frames.sort_unstable();
            frames
        }
        None => pipeline::frames_of(&scene),
    };
    let survey = pipeline::survey(&scene, &emitters, &frames)
        .with_context(|| arguments.scene.display().to_string())?;
    writeln!(
        out,
        "{}: {}, {} ({} change), read in {}",
        arguments.scene.display(),
        counted(survey.lights.len(), "light"),
        counted(emitters.len(), "emitter"),
        emitters.changing_count(),
        Seconds(loading),
    )?;
    if before.as_ref().is_some_and(|before| pipeline::is_built_from(&before.tree, &survey)) {
        writeln!(out, "{}: up to date", output.display())?;
        return Ok(());
    }
    let base = match base {
        None => before,
        Some(Ok(base)) => Some(base),
        Some(Err(error)) => {
            eprintln!("note: not built upon {}", Plain(error));
            None
        }
    };
    let mut times = Times::default();
    let bytes = build(&survey, base, &mut times, &mut out)?;
    let started = Instant::now();
    // What is about to replace a good file must be one.
    let tree = LightTree::open(bytes).and_then(|tree| tree.verify().map(|()| tree));
    let bytes = tree.with_context(|| format!("{}: not written", output.display()))?.into_bytes();
    write_atomically(&output, |file| file.write_all(bytes.as_ref()))?;
    times.writing = started.elapsed();

    let started = Instant::now();
    pipeline::open_tree(&output, true)?;
    times.opening = started.elapsed();
    let size = bytes.as_ref().len();
    let each = size as f64 / emitters.len().max(1) as f64;
    writeln!(out, "{}: {size} bytes, {each:.1} an emitter", output.display())?;
    times.report(&mut out)?;
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
        let started = Instant::now();
        let tree = pipeline::open_base(path)?;
        Ok(Base { path: path.into(), tree, opening: started.elapsed() })
    }
}

fn build(
    survey: &Survey,
    base: Option<Base>,
    times: &mut Times,
    out: &mut impl Write,
) -> Result<AlignedBytes> {
    let started = Instant::now();
    let Some(Base { path, tree, opening }) = base else {
        let bytes = pipeline::build_tree(survey);
        times.building = started.elapsed();
        return Ok(bytes);
    };
    let rebuilt = pipeline::rebuild_tree(survey, &tree);
    times.building = started.elapsed();
    let Rebuilt { bytes, reused, leaves } = rebuilt;
    writeln!(
        out,
        "{}: {reused} of {leaves} leaves taken over, opened and verified in {}",
        path.display(),
        Seconds(opening)
    )?;
    times.is_partial = reused > 0;
    Ok(bytes)
}

/// What it took to make the file, and what it takes to use it.
#[derive(Default)]
struct Times {
    building: Duration,
    /// Verifying, writing and syncing.
    writing: Duration,
    /// Opening and verifying.
    opening: Duration,
    /// Whether part of the tree was taken over from a base.
    is_partial: bool,
}

impl Times {
    fn report(&self, out: &mut impl Write) -> Result<()> {
        let Times { building, writing, opening, is_partial } = *self;
        write!(
            out,
            "built in {}, written in {}, opens and verifies in {}",
            Seconds(building),
            Seconds(writing),
            Seconds(opening)
        )?;
        // Every process that builds its own tree spends `building`; with the file, `opening`.
        match building.checked_sub(opening) {
            _ if is_partial => writeln!(out)?,
            Some(saved) if !saved.is_zero() => {
                let made = building + writing;
                let processes = (made.as_secs_f64() / saved.as_secs_f64()).ceil().max(1.0);
                writeln!(
                    out,
                    "; a process that opens it saves {}: the file has paid for itself with process number {processes:.0}",
                    Seconds(saved)
                )?;
            }
            _ => writeln!(out, "; building anew is as fast as opening: the file pays as a record")?,
        }
        Ok(())
    }
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
