//! `candelabra diff`: what changed between two versions of a scene, and by how much.

use crate::page;
use crate::stderr::say;
use anyhow::{Result, bail};
use candelabra::diff::{
    DiffOptions, Side, SideError, TableDiff, TableStanding, Text, compare, compare_folders, html,
    look_at, look_at_both, names_table,
};
use candelabra::pipeline::{View, is_table_file, open_learned};
use clap::Args;
use std::fmt::Display;
use std::io::{self, BufWriter, StdoutLock, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Compares the lights of two versions: tree files (.ltree), scenes (.gltf, .glb, .obj), or one of
/// each; or all shots of two folders, matched by name. A table of what is hidden (.lvis) is held against a
/// scene, a tree or another table: is it out of date, and why?
///
/// Lights are listed by their share: of all energy or of all picks, whichever they gained or lost more
/// of. Picks are compared where paths from the camera of a scene go, of two trees around the lights. A
/// scene without a camera is seen as the other version is, or as by --fit. Prims that send no light are
/// not compared.
///
/// Ends with 0 if they are the same, 1 if they differ and 2 if they cannot be compared. A table that is out of
/// date is a difference.
#[derive(Args)]
pub struct Arguments {
    /// The version before
    before: PathBuf,
    /// The version after
    after: PathBuf,
    /// List every light that differs, and not only those that matter most to the light
    #[arg(long)]
    all: bool,
    /// Print JSON (schema candelabra.diff, version 1), which lists them all
    #[arg(long)]
    json: bool,
    /// Write a page too, with pictures of the lights and of what the camera sees; not of folders
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Tell whether this table of what is hidden (.lvis) is out of date for the version after, and why
    #[arg(long, value_name = "TABLE")]
    learned: Option<PathBuf>,
    #[command(flatten)]
    view: View,
    /// Threads; as many as there are cores if not given
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

/// Lights that are listed, of each shot.
const LISTED: usize = 20;
const DIFFERENT: u8 = 1;
/// The exit code of every failure of this command, as of Unix `diff`.
pub const TROUBLE: u8 = 2;

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let Arguments { before, after, .. } = arguments;
    if let Some(page) = &arguments.html {
        page::check(page, &[before, after])?;
    }
    if names_table(before, after) {
        return run_of_table(arguments);
    }
    match [before, after].map(|path| path.is_dir()) {
        [false, false] => {
            let (before, after) = rayon::join(|| Side::open(before), || Side::open(after));
            let (mut before, mut after) = (before?, after?);
            if before.scene().is_none() && after.scene().is_none() && !arguments.view.is_default() {
                bail!("{}: is a tree; a view is one of scenes", arguments.before.display());
            }
            if let Some(note) = look_at_both(&mut before, &mut after, &arguments.view)? {
                say(format_args!("note: {note}"));
            }
            let for_page = arguments.html.is_some();
            let options = DiffOptions { unchanged: for_page, heat: for_page };
            let mut diff = compare(&before, &after, &options)?;
            if let Some(path) = &arguments.learned {
                diff.table = Some(TableStanding::of(path, &open_learned(path, true)?, &after)?);
            }
            let is_same = diff.is_same() && diff.table.as_ref().is_none_or(|t| t.is_up_to_date());
            if let Some(page) = &arguments.html {
                page::write(page, &html(&diff))?;
            }
            print(arguments, |out| diff.write_json(out), |most| Text { of: &diff, most })?;
            Ok(if is_same { ExitCode::SUCCESS } else { DIFFERENT.into() })
        }
        [true, true] if arguments.learned.is_some() => {
            bail!("{}: a table is of one shot, and this is a folder", after.display())
        }
        [true, true] if arguments.html.is_some() => {
            bail!("{}: a page compares two files, and these are folders", before.display())
        }
        [true, true] => {
            let diff = compare_folders(before, after, &arguments.view)?;
            print(arguments, |out| diff.write_json(out), |most| Text { of: &diff, most })?;
            Ok(match (diff.has_trouble(), diff.is_same()) {
                (true, _) => TROUBLE.into(),
                (false, true) => ExitCode::SUCCESS,
                (false, false) => DIFFERENT.into(),
            })
        }
        [is_folder, _] => {
            let (folder, file) = if is_folder { (before, after) } else { (after, before) };
            bail!(SideError::FolderAndFile { folder: folder.clone(), file: file.clone() })
        }
    }
}

/// A table against a scene, a tree or another table.
fn run_of_table(arguments: &Arguments) -> Result<ExitCode> {
    let Arguments { before, after, .. } = arguments;
    if arguments.html.is_some() || arguments.learned.is_some() {
        let table = if is_table_file(before) { before } else { after };
        bail!(
            "{}: is a table of what is hidden; --html and --learned are for scenes and trees",
            table.display()
        );
    }
    let diff = match [before, after].map(|path| is_table_file(path)) {
        [true, true] => TableDiff::of_two(before, after)?,
        [_, is_after] => {
            let (table, version) = if is_after { (after, before) } else { (before, after) };
            let mut side = Side::open(version)?;
            if let Some(note) = look_at(&mut side, &arguments.view)? {
                say(format_args!("note: {note}"));
            }
            TableDiff::of(table, &side, is_after)?
        }
    };
    print(arguments, |out| diff.write_json(out), |most| Text { of: &diff, most })?;
    Ok(if diff.is_same() { ExitCode::SUCCESS } else { DIFFERENT.into() })
}

fn print<T: Display>(
    arguments: &Arguments,
    json: impl FnOnce(&mut BufWriter<StdoutLock>) -> io::Result<()>,
    text: impl FnOnce(usize) -> T,
) -> io::Result<()> {
    let mut out = BufWriter::new(io::stdout().lock());
    let written = match arguments.json {
        true => json(&mut out),
        false => write!(out, "{}", text(if arguments.all { usize::MAX } else { LISTED })),
    };
    // A closed pipe (`| head`) is no error: the exit code still tells whether the versions differ.
    match written.and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}
