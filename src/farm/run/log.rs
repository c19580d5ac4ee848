//! What a command prints: to its log, and its events to whoever watches.

use crate::pipeline::Event;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, PipeReader, Read, Write};
use std::path::Path;
use std::sync::mpsc::Sender;

/// Longer lines are taken in pieces.
const LONGEST_LINE: u64 = 64 << 10;

/// Opens a log: anew at the first attempt, to go on at others.
pub fn open(path: &Path, attempt: u32) -> io::Result<File> {
    match attempt {
        1 => File::create(path),
        _ => OpenOptions::new().create(true).append(true).open(path),
    }
}

/// A sign of life of a command.
pub enum Sign {
    /// It has printed something.
    Line,
    /// It has told an event.
    Told(Event),
    /// The log cannot be written.
    Lost(io::Error),
}

/// Copies all that a command prints to its log, until it prints no more. A log that cannot be written stops
/// neither the copying nor the command.
pub fn copy(output: PipeReader, mut log: File, signs: &Sender<Sign>) {
    let mut output = BufReader::new(output);
    let (mut line, mut percent, mut is_lost) = (Vec::new(), None, false);
    loop {
        line.clear();
        match output.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return,
            Ok(_) => {}
        }
        let event = serde_json::from_slice::<Event>(&line).ok();
        if let Some(event) = &event {
            line = match text(event, &mut percent) {
                Some(text) => format!("{text}\n").into_bytes(),
                None => Vec::new(),
            };
        }
        if let (false, Err(error)) = (is_lost, log.write_all(&line)) {
            is_lost = true;
            let _ = signs.send(Sign::Lost(error));
        }
        // Nobody listens any more if the command has ended and a process that it left still prints.
        let _ = signs.send(event.map_or(Sign::Line, Sign::Told));
    }
}

/// An event in words; of progress every tenth.
fn text(event: &Event, last: &mut Option<u64>) -> Option<String> {
    Some(match event {
        Event::Note { text } => format!("note: {text}"),
        Event::Stage { name } => name.clone(),
        Event::Progress { done, .. } => {
            let tenth = Some((done * 10.0) as u64);
            if tenth == std::mem::replace(last, tenth) {
                return None;
            }
            format!("{} %", (done * 100.0) as u64)
        }
        Event::FrameDone { frame, seconds, output, .. } => {
            format!("frame {frame}: {} in {seconds:.1} s", output.display())
        }
        Event::UpToDate { output, .. } => format!("{}: up to date", output.display()),
        Event::FrameFailed { frame, why } => format!("frame {frame}: failed: {why}"),
    })
}
