//! The frames of a shot when the user names none, and how frames are written.

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
        let of_lights = scene.lights.iter().filter_map(|light| light.values.as_deref());
        let of_meshes = scene.instances.iter().filter_map(|instance| instance.values.as_deref());
        let values = of_lights.chain(of_meshes).map(|keys: &Keys<_>| keys.times_s.last());
        let deformations = scene.meshes.iter().filter_map(|mesh| mesh.deformation.as_ref());
        let weights = deformations.flat_map(|deformation| deformation.weights.iter());
        let values = values.chain(weights.map(|keys| keys.times_s.last()));
        let lenses = scene.cameras.iter().filter_map(|camera| camera.over_time.as_ref()?.last_s());
        let last_s = seconds.chain(values).flatten().copied().chain(lenses);
        let last_s = last_s.fold(0f32, f32::max);
        f64::from(last_s)
    };
    let last_s = timeline.last_frame.map_or_else(last_key, |frame| timeline.seconds_at(frame));
    // A 32-bit time may be a hair beyond its frame; that does not add another frame.
    let last = timeline.frame_at(last_s);
    let first = timeline.first_frame.round() as i32;
    // A shot longer than this is taken for an exporter's error; the user can still name its frames.
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
    use super::{frames_of, spell};
    use crate::render::frames::Frames;
    use crate::scene::{Channel, Interpolation, Keys, Node, Scene, Timeline, Trs};
    use glam::Vec3;

    #[test]
    fn a_shot_ends_with_the_frame_of_its_last_key() {
        for rate in [24.0, 24000.0 / 1001.0, 25.0, 30000.0 / 1001.0, 30.0, 60.0] {
            for first_frame in [0.0, 1.0, 1001.0] {
                for frames in (1..2000).chain([86_400, 99_999]) {
                    let keys = Keys {
                        times_s: vec![0.0, (f64::from(frames) / rate) as f32],
                        values: vec![Vec3::ZERO, Vec3::ONE],
                        interpolation: Interpolation::Linear,
                    };
                    let mut node = Node::fixed("/node", None, Trs::default());
                    node.channels = vec![Channel::Scale(keys)];
                    let timeline = Timeline {
                        zero_frame: first_frame,
                        first_frame,
                        frames_per_second: rate,
                        last_frame: None,
                    };
                    let mut scene = Scene { nodes: vec![node], timeline, ..Default::default() };
                    let first = first_frame as i32;
                    assert_eq!(frames_of(&scene).last(), Some(&(first + frames)), "{rate}");
                    // Half a frame more is another frame; a hair more is none, as in a file's own words.
                    for (more, last) in [(0.5, 1), (1e-6, 0)] {
                        let end = f64::from(first + frames) + more;
                        scene.timeline.last_frame = Some(end);
                        assert_eq!(frames_of(&scene).last(), Some(&(first + frames + last)));
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_written_is_read() {
        for frames in [&[7][..], &[-3, -2, -1], &[1001, 1003, 1005], &[1, 2, 4], &[i32::MIN, 5]] {
            let read: Frames = spell(frames).parse().unwrap();
            assert_eq!(read.as_slice(), frames);
        }
    }
}
