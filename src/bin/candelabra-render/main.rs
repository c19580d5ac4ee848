//! `candelabra-render`: renders the frames of a shot through a light tree.

mod arguments;
mod progress;
mod shot;
#[path = "../candelabra/texture_bar.rs"]
mod texture_bar;

use arguments::Arguments;
use candelabra::page::Plain;
use candelabra::pipeline::{TreeError, ViewError};
use candelabra::render::PlanError;
use candelabra::render::frame_names::FrameNamesError;
use clap::Parser;
use std::process::ExitCode;

/// Some frames failed, or nothing could be rendered at all.
const FAILED: u8 = 1;
/// Usage; mostly said by clap.
const USAGE: u8 = 2;
/// The tree file is stale or broken.
const BAD_TREE: u8 = 3;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match shot::render(&arguments) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(failed) => {
            let plural = if failed == 1 { "" } else { "s" };
            eprintln!("candelabra-render: {failed} frame{plural} failed; any others are done");
            ExitCode::from(FAILED)
        }
        Err(error) => {
            eprintln!("candelabra-render: {}", Plain(format_args!("{error:#}")));
            ExitCode::from(match error {
                error if is_bad_tree(&error) => BAD_TREE,
                error if is_usage(&error) => USAGE,
                _ => FAILED,
            })
        }
    }
}

/// Whether the options contradict each other although each is valid by itself.
fn is_usage(error: &anyhow::Error) -> bool {
    let is_crop = matches!(error.downcast_ref(), Some(PlanError::Crop(_)));
    is_crop
        || error.is::<FrameNamesError>()
        || error.downcast_ref().is_some_and(ViewError::is_usage)
}

/// Whether the tree file itself is at fault; not one that is absent.
fn is_bad_tree(error: &anyhow::Error) -> bool {
    use TreeError::{Broken, Contradicts, Stale};
    matches!(error.downcast_ref(), Some(Broken { .. } | Stale { .. } | Contradicts { .. }))
}
