//! `candelabra verify`: whether tree files are what the format says.

use crate::stderr::say;
use crate::texture_bar::TextureBar;
use anyhow::{Context, Result};
use candelabra::emitter::Emitters;
use candelabra::page::{Lines, counted};
use candelabra::pipeline::{self, LearnedError, OpenedTree, TreeError};
use candelabra::scene::Scene;
use candelabra::store::StoreError;
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// A file breaks a rule, or does not belong to the scene.
const UNSOUND: u8 = 1;
/// A file cannot be read; also what clap says of usage.
const TROUBLE: u8 = 2;

#[derive(Args)]
#[command(
    after_help = "Exit codes: 0 all files are sound, 1 a file is not, 2 a file cannot be read.\n\
    Rules are numbered as in the specification of the format, src/store/format.md.\n\
    A sound tree keeps its promises about its own leaves. That the leaves bound the lights of a scene,\n\
    only --scene shows: it integrates textures anew and compares every leaf."
)]
pub struct Arguments {
    /// Tree files, and tables of what is hidden (.lvis)
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The scene that the trees belong to: each leaf is compared with its light
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// As given to build; may be given again
    #[arg(long, value_name = "PATH", requires = "scene")]
    force_light: Vec<String>,
}

/// The scene that trees are held against.
struct Owner {
    scene: Scene,
    emitters: Emitters,
    forced: Vec<String>,
}

impl Owner {
    fn load(path: &Path, forced: &[String]) -> Result<Owner> {
        let mut scene = pipeline::load_scene(path)?;
        pipeline::force_lights(&mut scene, forced).with_context(|| path.display().to_string())?;
        let bar = TextureBar::new();
        let watch = |done, all| bar.show(done, all);
        let emitters = pipeline::collect_emitters(&scene, None::<&OpenedTree>, &watch);
        Ok(Owner { scene, emitters, forced: forced.to_vec() })
    }
}

/// Checks and reports on every file, even if others fail. The worst result decides the exit code.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let mut out = Lines(std::io::stdout().lock());
    let owner = match &arguments.scene {
        None => None,
        Some(path) => match Owner::load(path, &arguments.force_light) {
            Ok(owner) => Some(owner),
            Err(error) => {
                say(format_args!("candelabra: {error:#}"));
                return Ok(ExitCode::from(TROUBLE));
            }
        },
    };
    let mut worst = 0;
    for file in &arguments.files {
        let name = file.display();
        if pipeline::is_table_file(file) {
            worst = worst.max(verify_table(file, &mut out)?);
            continue;
        }
        worst = worst.max(match pipeline::open_tree(file, true) {
            Ok(tree) => {
                writeln!(out, "{name}: sound: {}", summary(&tree))?;
                match owner.as_ref().map(|owner| belongs(&tree, file, owner)) {
                    None => 0,
                    Some(Ok(())) => {
                        writeln!(out, "{name}: every leaf is what the scene gives")?;
                        0
                    }
                    Some(Err(error)) => {
                        writeln!(out, "{error}")?;
                        UNSOUND
                    }
                }
            }
            Err(TreeError::Broken { cause, .. }) => {
                match cause {
                    StoreError::Broken(violation) => writeln!(out, "{name}: unsound: {violation}")?,
                    _ => {
                        writeln!(out, "{name}: unsound: rule {}: {cause}", cause.violation().rule)?
                    }
                }
                UNSOUND
            }
            Err(error) => {
                say(format_args!("candelabra: {error}"));
                TROUBLE
            }
        });
    }
    Ok(ExitCode::from(worst))
}

/// The same of a table of what is hidden.
fn verify_table(file: &Path, out: &mut impl Write) -> Result<u8> {
    let name = file.display();
    match pipeline::open_learned(file, true) {
        Ok(table) => {
            let cells = table.view().map_or(0, |learned| learned.cells.count());
            let (cells, bytes) = (counted(cells, "cell"), counted(table.byte_length(), "byte"));
            writeln!(out, "{name}: sound: {cells}, {bytes}")?;
            Ok(0)
        }
        Err(LearnedError::Broken { cause, .. }) => {
            writeln!(out, "{name}: unsound: rule {}: {cause}", cause.violation().rule)?;
            Ok(UNSOUND)
        }
        Err(error) => {
            say(format_args!("candelabra: {error}"));
            Ok(TROUBLE)
        }
    }
}

fn belongs(tree: &OpenedTree, file: &Path, owner: &Owner) -> Result<(), TreeError> {
    let Owner { scene, emitters, forced } = owner;
    pipeline::check_fresh(tree, file, scene, emitters, forced, true)
}

fn summary(tree: &OpenedTree) -> String {
    let counts = [
        (tree.lights().len(), "light"),
        (tree.emitter_count(), "emitter"),
        (tree.trees().len(), "tree"),
        (tree.byte_length(), "byte"),
    ];
    let mut text = counts.map(|(count, what)| counted(count, what)).join(", ");
    if tree.link_numbers() > 1 {
        text += &format!(", {}", counted(tree.link_numbers() as usize - 1, "link set"));
    }
    text
}
