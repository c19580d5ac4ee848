//! Which frames a shot has, where nobody says; and how to say it.

use crate::scene::{Channel, Keys, Scene};

/// The frames of a scene's own timeline: from its first to its last, or to the last animation key
/// if the file names no last frame. A scene that stands still has one.
pub fn frames_of(scene: &Scene) -> Vec<i32> {
    let timeline = &scene.timeline;
    let last_key = || {
        let channels = scene.nodes.iter().flat_map(|node| &node.channels);
        let seconds = channels.map(|channel| match channel {
            Channel::Translation(keys) | Channel::Scale(keys) => keys.times_s.last(),
            Channel::Rotation(keys) => keys.times_s.last(),
        });
        let of_lights = scene.lights.iter().filter_map(|light| light.values.as_ref());
        let of_meshes = scene.instances.iter().filter_map(|instance| instance.values.as_ref());
        let values = of_lights.chain(of_meshes).map(|keys: &Keys<_>| keys.times_s.last());
        let last_s = seconds.chain(values).flatten().fold(0f32, |last, &key| last.max(key));
        timeline.first_frame + f64::from(last_s) * timeline.frames_per_second
    };
    let last = timeline.last_frame.unwrap_or_else(last_key);
    let first = timeline.first_frame.round() as i32;
    // A clock that runs for years is a slip of the exporter; let the user say what is meant.
    let last = (last.ceil() as i32).clamp(first, first.saturating_add(100_000));
    (first..=last).collect()
}

/// Writes frames, which ascend, as the programs read them: as a range if they are evenly spaced.
pub(super) fn spell(frames: &[i32]) -> String {
    let step = |pair: &[i32]| i64::from(pair[1]) - i64::from(pair[0]);
    let mut steps = frames.windows(2).map(step);
    match (frames, steps.next()) {
        ([first, _, .., last], Some(by)) if steps.all(|step| step == by) => match by {
            1 => format!("{first}-{last}"),
            _ => format!("{first}-{last}x{by}"),
        },
        _ => frames.iter().map(i32::to_string).collect::<Vec<_>>().join(","),
    }
}

#[cfg(test)]
mod tests {
    use super::spell;
    use crate::render::frames::Frames;

    #[test]
    fn what_is_written_is_read() {
        for frames in [&[7][..], &[-3, -2, -1], &[1001, 1003, 1005], &[1, 2, 4], &[i32::MIN, 5]] {
            let read: Frames = spell(frames).parse().unwrap();
            assert_eq!(read.as_slice(), frames);
        }
    }
}
