//! `candelabra measure --shot`: what a shot will take at an error, before a farm is started.

use crate::display::Display;
use crate::measure::{Arguments, Teller};
use crate::stderr::say;
use anyhow::{Context, Result};
use candelabra::measure::{FrameCost, Onlooker, ShotCost, Subject};
use candelabra::page::{Lines, Short, counted};
use candelabra::pipeline::{self, Effort, Event, ShotTrees, Watch};
use candelabra::render::knob::{self, Aim};
use candelabra::render::noise::{Grey, decibels};
use candelabra::render::passes::ErrorGoal;
use candelabra::render::{Progress, RenderDelegate, RenderError, RenderSettings};
use std::io::Write;

/// Frames that are looked at unless the user says how many.
const PILOTS: usize = 8;

/// The frames of a shot that are looked at: the first, every so many after it, and the last.
fn pilots(frames: &[i32], every: Option<u32>) -> Vec<i32> {
    let step = every.map_or(frames.len().div_ceil(PILOTS - 1), |every| every as usize).max(1);
    let mut pilots: Vec<i32> = frames.iter().step_by(step).copied().collect();
    pilots.extend(frames.last().filter(|last| pilots.last() != Some(last)));
    pilots
}

/// Looks at some frames of a shot.
pub fn run(arguments: &Arguments, display: &Display) -> Result<ShotCost> {
    display.tell(Event::Stage { name: "reading the scene".into() });
    let (width, height) = arguments.res.unwrap_or((1280, 720));
    let path = arguments.scene.scene();
    let mut scene = pipeline::load_scene(path)?;
    let look = pipeline::look(&mut scene, arguments.scene.view(), width as f32 / height as f32)?;
    look.note.iter().for_each(|note| say(format_args!("note: {note}")));
    let mut frames = match &arguments.frames {
        Some(frames) => frames.as_slice().to_vec(),
        None => pipeline::frames_of(&scene),
    };
    frames.sort_unstable();
    let emitters = pipeline::collect_emitters::<&[u8]>(&scene, None, &|_, _| {});
    let mut trees =
        ShotTrees::built(&scene, &emitters).with_context(|| path.display().to_string())?;
    let usual = RenderSettings::default();
    let base = RenderSettings {
        width,
        height,
        samples: Effort::MOST,
        depth: arguments.depth.unwrap_or(usual.depth),
        max_lights: arguments.max_lights,
        seed: arguments.seed,
        ..usual
    };
    let mut delegate = RenderDelegate::new(&scene, &emitters, look.camera, base.clone());
    let teller = Teller(display);
    let own = pipeline::frames_of(&scene);
    // As a render of the shot will find them out.
    let grey = match arguments.grey {
        Some(grey) => grey,
        None => {
            let mut luminances = Vec::new();
            for frame in pipeline::frames_of_grey(&own) {
                let tree = trees.for_frame(frame)?;
                let quiet = Quiet(&teller);
                let seen = pipeline::glimpse(&mut delegate, &base, &tree, frame, &quiet)?;
                luminances.extend(seen.luminances);
            }
            Grey::of(luminances.into_iter())
        }
    };
    let goal = ErrorGoal { error: arguments.error, grey, most: Effort::MOST };
    let base = pipeline::with_knobs(&mut delegate, &base, None, |delegate| {
        let aim = Aim::Error(goal);
        anyhow::Ok(knob::pilot(delegate, &trees.for_frame(own[0])?, own[0], aim)?)
    })?;
    let mut shot = Shot { trees, delegate, base };
    let pilots = pilots(&frames, arguments.every);
    let mut costs: Vec<FrameCost> = Vec::new();
    for (number, &frame) in pilots.iter().enumerate() {
        let done = number as f64 / pilots.len() as f64;
        display.tell(Event::Progress { done, frame: Some(frame) });
        costs.push(shot.at(frame, |subject| subject.pilot(goal, &Quiet(&teller)))?);
    }
    Ok(ShotCost::new(goal, costs, &frames))
}

/// A shot, prepared.
struct Shot<'a> {
    trees: ShotTrees<'a>,
    delegate: RenderDelegate<'a>,
    base: RenderSettings,
}

impl Shot<'_> {
    /// Looks at a frame.
    fn at<T>(
        &mut self,
        frame: i32,
        look: impl FnOnce(&mut Subject<&[u8]>) -> Result<T, RenderError>,
    ) -> Result<T> {
        let (tree, base) = (self.trees.for_frame(frame)?, self.base.clone());
        Ok(look(&mut Subject { delegate: &mut self.delegate, tree: &tree, frame, base })?)
    }
}

/// Hears when to stop, and leaves it to the loop over the frames to tell how far it is.
struct Quiet<'a, 'b>(&'a Teller<'b>);

impl Onlooker for Quiet<'_, '_> {
    fn begins(&self, _: &str) {}

    fn is_at(&self, _: f64) {}

    fn is_stopped(&self) -> bool {
        self.0.is_stopped()
    }
}

impl Progress for Quiet<'_, '_> {
    fn is_stopped(&self) -> bool {
        self.0.is_stopped()
    }
}

/// Prints what a shot will take.
pub fn print(out: &mut impl Write, cost: &ShotCost) -> Result<()> {
    let out = &mut Lines(out);
    writeln!(
        out,
        "{:<8} {:>16} {:>12} {:>16}",
        "frame", "samples a pixel", "seconds", "at the most"
    )?;
    for FrameCost { frame, samples, seconds, capped } in &cost.pilots {
        writeln!(out, "{frame:<8} {samples:>16.1} {seconds:>12.1} {:>14.2} %", 100.0 * capped)?;
    }
    let grey = Short(cost.grey.luminance());
    writeln!(
        out,
        "{} to error {} ({:.0} dB): {} on this machine, the longest {}",
        counted(cost.frames.len(), "frame"),
        cost.error,
        decibels(cost.error),
        duration(cost.seconds),
        duration(cost.frames.iter().map(|frame| frame.1).fold(0.0, f64::max))
    )?;
    writeln!(
        out,
        "render with --error {} --grey {grey}, so that all frames have one floor",
        cost.error
    )?;
    Ok(())
}

/// Seconds as people say them.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{s:.1} s"),
        s if s < 6000.0 => format!("{:.1} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_and_the_last_frame_are_looked_at() {
        let frames: Vec<i32> = (1001..=1048).collect();
        assert_eq!(pilots(&frames, None), [1001, 1008, 1015, 1022, 1029, 1036, 1043, 1048]);
        assert_eq!(pilots(&frames, Some(40)), [1001, 1041, 1048]);
        assert_eq!(pilots(&frames[..1], None), [1001]);
        assert_eq!(pilots(&frames[..3], None), [1001, 1002, 1003]);
    }

    #[test]
    fn durations_are_short() {
        let told = [1.25, 600.0, 7200.0].map(duration);
        assert_eq!(told, ["1.2 s", "10.0 min", "2.0 h"]);
    }
}
