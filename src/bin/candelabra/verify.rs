//! `candelabra verify`: whether tree files are what the format says.

use anyhow::Result;
use candelabra::page::{Lines, Plain, counted};
use candelabra::pipeline::{self, OpenedTree, TreeError};
use candelabra::store::StoreError;
use clap::Args;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// A file breaks a rule.
const UNSOUND: u8 = 1;
/// A file cannot be read; also what clap says of usage.
const TROUBLE: u8 = 2;

#[derive(Args)]
#[command(
    after_help = "Exit codes: 0 all files are sound, 1 a file is not, 2 a file cannot be read.\n\
    Rules are numbered as in the specification of the format, src/store/format.md."
)]
pub struct Arguments {
    /// Tree files
    #[arg(required = true)]
    files: Vec<PathBuf>,
}

/// Checks each file and says of each what it is, whatever the others are. The worst decides the code.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let mut out = Lines(std::io::stdout().lock());
    let mut worst = 0;
    for file in &arguments.files {
        let name = file.display();
        worst = worst.max(match pipeline::open_tree(file, true) {
            Ok(tree) => {
                writeln!(out, "{name}: sound: {}", summary(&tree))?;
                0
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
                eprintln!("candelabra: {}", Plain(error));
                TROUBLE
            }
        });
    }
    Ok(ExitCode::from(worst))
}

fn summary(tree: &OpenedTree) -> String {
    let counts = [
        (tree.lights().len(), "light"),
        (tree.emitter_count(), "emitter"),
        (tree.trees().len(), "tree"),
        (tree.byte_length(), "byte"),
    ];
    counts.map(|(count, what)| counted(count, what)).join(", ")
}
