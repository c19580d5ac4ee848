//! What a job tells while it works, and how it is stopped.
//!
//! Jobs print nothing. They tell [`Event`]s to a [`Watch`]: a bar on a terminal, lines for a farm, or a
//! flag that a signal sets. As JSON, one object a line, events are what `--progress json` prints and what
//! `candelabra run` reads from the programs that it starts.

use super::render_job::FrameNoise;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Something that happened in a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// Something that the user should know, and that is no error.
    Note {
        /// In words.
        text: String,
    },
    /// Work has begun that belongs to no frame.
    Stage {
        /// What is done: `reading the scene`, `preparing rays`.
        name: String,
    },
    /// How far the whole job is.
    Progress {
        /// From 0 to 1.
        done: f64,
        /// The frame that is being rendered, if one is.
        frame: Option<i32>,
    },
    /// A frame has been rendered and written.
    FrameDone {
        /// Its number.
        frame: i32,
        /// How long it was rendered, without the writing.
        seconds: f64,
        /// Rays of all kinds.
        rays: u64,
        /// Lights picked.
        light_picks: u64,
        /// What its noise has come to, if that was looked at.
        #[serde(default)]
        noise: Option<FrameNoise>,
        /// The picture.
        output: PathBuf,
    },
    /// An output was made of the same by an earlier job, and is kept.
    UpToDate {
        /// The frame, if the output belongs to one.
        frame: Option<i32>,
        /// The file.
        output: PathBuf,
    },
    /// A frame could not be rendered or written. The others go on.
    FrameFailed {
        /// Its number.
        frame: i32,
        /// Why, with the remedy.
        why: String,
    },
}

/// Receives what jobs tell, from any of their threads.
pub trait Watch: Sync {
    /// Takes notice of an event.
    fn tell(&self, event: Event);

    /// Whether the job should stop as soon as it can. Asked often.
    fn is_stopped(&self) -> bool {
        false
    }
}

/// Listens to nothing and never stops a job.
impl Watch for () {
    fn tell(&self, _: Event) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_is_one_line_of_json_and_comes_back() {
        let events = [
            Event::Note { text: "two\nlines".into() },
            Event::Stage { name: "preparing rays".into() },
            Event::Progress { done: 0.25, frame: Some(-3) },
            Event::FrameDone {
                frame: 1001,
                seconds: 1.5,
                rays: 7,
                light_picks: 3,
                noise: None,
                output: "out/street.1001.exr".into(),
            },
            Event::UpToDate { frame: None, output: "street.ltree".into() },
            Event::FrameFailed { frame: 1002, why: "no space left".into() },
        ];
        for event in events {
            let line = serde_json::to_string(&event).unwrap();
            assert!(!line.contains('\n'), "{line}");
            assert_eq!(serde_json::from_str::<Event>(&line).unwrap(), event);
        }
        let line = serde_json::to_string(&Event::Progress { done: 0.5, frame: None }).unwrap();
        assert_eq!(line, r#"{"event":"progress","done":0.5,"frame":null}"#);
    }
}
