//! `candelabra-render`: renders the frames of a shot through a light tree.

mod arguments;
mod progress;
mod shot;

use arguments::Arguments;
use clap::Parser;
use std::process::ExitCode;

/// Some frames failed, or nothing could be rendered at all.
const FAILED: u8 = 1;
/// The tree file is stale or broken. (2 is clap's, for usage.)
const BAD_TREE: u8 = 3;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match shot::render(&arguments) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(failed) => {
            eprintln!("candelabra-render: {failed} frames failed; the others are done");
            ExitCode::from(FAILED)
        }
        Err(error) => {
            eprintln!("candelabra-render: {error:#}");
            let tree = error.downcast_ref::<candelabra::pipeline::TreeError>();
            ExitCode::from(if tree.is_some() { BAD_TREE } else { FAILED })
        }
    }
}
