//! A camera carried from one scene into another, with the nodes that it stands at.

use crate::scene::{
    Camera, Channel, Interpolation, Keys, LensKeys, Node, Scene, Shutter, Timeline,
};
use std::ops::Mul;
use std::sync::Arc;

/// Adds a camera's node and all above it to another scene, and returns the camera there. At every frame
/// the camera is where it was in its own scene, with the lens that it had there, even if the two scenes time their frames differently. The
/// other scene keeps its frames. The camera keeps its shutter unless lights of the other scene change, and none of
/// that scene's cameras has the same: its trees hold where they are when its own shutters are open.
pub fn carry_camera(from: &Scene, camera: &Camera, into: &mut Scene) -> Camera {
    let frames = super::frames_of(into);
    into.timeline.last_frame = frames.last().map(|&last| f64::from(last));
    let mut chain = vec![camera.node];
    while let Some(parent) = from.nodes[chain[chain.len() - 1] as usize].parent {
        chain.push(parent);
    }
    let mut parent = None;
    for &number in chain.iter().rev() {
        let Node { path, local, channels, .. } = from.nodes[number as usize].clone();
        let path = format!("{}:{path}", from.source.display());
        let mut node = Node { path: path.into(), parent, local, channels };
        if from.timeline != into.timeline {
            node.channels.iter_mut().for_each(|c| retime(c, &from.timeline, &into.timeline));
        }
        parent = Some(into.nodes.len() as u32);
        into.nodes.push(node);
    }
    let is_known =
        |shutter: &Shutter| !into.has_lights_that_change() || into.shutters().contains(shutter);
    let shutter = camera.shutter.filter(is_known);
    let retimed = |lens: &Arc<LensKeys>| match from.timeline == into.timeline {
        true => lens.clone(),
        false => Arc::new(retime_lens(lens, &from.timeline, &into.timeline)),
    };
    let over_time = camera.over_time.as_ref().map(retimed);
    Camera { node: into.nodes.len() as u32 - 1, shutter, over_time, ..camera.clone() }
}

fn retime_lens(lens: &LensKeys, from: &Timeline, into: &Timeline) -> LensKeys {
    let mut lens = lens.clone();
    let LensKeys { height, lens_radius_m, focus_distance_m, film_offset, exposure_scale, clip_m } =
        &mut lens;
    for keys in [height, lens_radius_m, focus_distance_m, exposure_scale].into_iter().flatten() {
        retime_keys(keys, from, into);
    }
    [film_offset, clip_m].into_iter().flatten().for_each(|keys| retime_keys(keys, from, into));
    lens
}

fn retime(channel: &mut Channel, from: &Timeline, into: &Timeline) {
    match channel {
        Channel::Translation(keys) | Channel::Scale(keys) => retime_keys(keys, from, into),
        Channel::Rotation(keys) => retime_keys(keys, from, into),
    }
}

/// Moves keys from the seconds of one timeline to those of another, frame by frame.
fn retime_keys<T>(keys: &mut Keys<T>, from: &Timeline, into: &Timeline)
where
    T: Copy + Mul<f32, Output = T>,
{
    let frame = |seconds: f64| from.zero_frame + seconds * from.frames_per_second;
    for time in &mut keys.times_s {
        *time = into.seconds_at(frame(f64::from(*time))) as f32;
    }
    if keys.interpolation == Interpolation::Cubic {
        // Tangents are per second.
        let slower = (into.frames_per_second / from.frames_per_second) as f32;
        for tangents in keys.values.chunks_exact_mut(3) {
            tangents[0] = tangents[0] * slower;
            tangents[2] = tangents[2] * slower;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Light, LightKind, Projection, Trs};
    use glam::Vec3;

    #[test]
    fn a_shutter_is_kept_where_trees_do_not_depend_on_it() {
        let carried = |lights_move: bool, own: Option<Shutter>| {
            let mut from = Scene { source: "cam.glb".into(), ..Default::default() };
            from.nodes = vec![Node::fixed("/eye", None, Trs::default())];
            let mut into = Scene::default();
            let mut node = Node::fixed("/lamp", None, Trs::default());
            let values = vec![Vec3::ZERO, Vec3::ONE];
            let keys =
                Keys { times_s: vec![0.0, 1.0], values, interpolation: Interpolation::Linear };
            node.channels.extend(lights_move.then_some(Channel::Translation(keys)));
            into.nodes = vec![node];
            into.lights = vec![Light {
                node: 0,
                kind: LightKind::Point { intensity_cd: Vec3::ONE },
                values: None,
                range_m: None,
                forced: false,
                visibility: Default::default(),
            }];
            into.cameras = vec![Camera { shutter: own, ..Camera::perspective(0, 0.5) }];
            let shutter = Shutter::new(0.0, 0.5);
            let camera = Camera { shutter, ..Camera::perspective(0, 0.5) };
            carry_camera(&from, &camera, &mut into).shutter == shutter
        };
        let (same, other) = (Shutter::new(0.0, 0.5), Shutter::new(-0.25, 0.25));
        assert!(carried(false, None) && carried(false, other) && carried(true, same));
        assert!(!carried(true, None) && !carried(true, other));
    }

    #[test]
    fn a_camera_moves_as_it_did_frame_by_frame() {
        for interpolation in [Interpolation::Linear, Interpolation::Step, Interpolation::Cubic] {
            let keys = |times: &[f32]| {
                let per_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
                let value = |i: usize| Vec3::new((i * i) as f32, 1.0, -(i as f32));
                let values = (0..times.len() * per_key).map(value).collect();
                Channel::Translation(Keys { times_s: times.into(), values, interpolation })
            };
            let mut from = Scene { source: "cam.glb".into(), ..Default::default() };
            from.timeline = Timeline {
                zero_frame: 1000.0,
                first_frame: 1001.0,
                frames_per_second: 25.0,
                last_frame: None,
            };
            from.nodes = vec![
                Node::fixed("/other", None, Trs::default()),
                Node::fixed("/rig", None, Trs::default()),
                Node::fixed("/rig/eye", Some(1), Trs::default()),
            ];
            from.nodes[1].channels = vec![keys(&[0.0, 2.0])];
            from.nodes[2].channels = vec![keys(&[0.0, 0.4, 4.0])];
            let mut into = Scene::default();
            (into.timeline.zero_frame, into.timeline.first_frame) = (990.0, 990.0);
            into.nodes = vec![Node::fixed("/rig", None, Trs::default())];
            let frames = super::super::frames_of(&into);

            let number = |factor: f32| {
                let per_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
                let values = (0..2 * per_key).map(|i| factor * (1 + i) as f32).collect();
                Some(Keys { times_s: vec![0.1, 2.0], values, interpolation })
            };
            let lens = LensKeys {
                height: number(0.1),
                exposure_scale: number(3.0),
                ..LensKeys::default()
            };
            let zoom = Camera { over_time: Some(Arc::new(lens)), ..Camera::perspective(2, 0.5) };
            let camera = carry_camera(&from, &zoom, &mut into);
            assert_eq!(into.nodes.len(), 3);
            assert_eq!(&*into.nodes[2].path, "cam.glb:/rig/eye");
            assert_eq!(super::super::frames_of(&into), frames, "the shot is no longer than it was");
            for frame in [1000.0, 1001.0, 1005.5, 1020.0, 1100.0, 1200.0] {
                let place = |scene: &Scene, node: u32| {
                    scene.pose_at(scene.timeline.seconds_at(frame)).world(node).translation
                };
                let (was, is) = (place(&from, 2), place(&into, camera.node));
                assert!((was - is).length() < 1e-3 * (1.0 + was.length()), "{frame}: {was} {is}");
                let (was, is) = (from.camera_at(&zoom, frame), into.camera_at(&camera, frame));
                let Projection::Perspective { yfov_rad: was_rad } = was.projection else {
                    panic!()
                };
                let Projection::Perspective { yfov_rad } = is.projection else { panic!() };
                assert!((was_rad - yfov_rad).abs() < 1e-4, "{frame}: {was_rad} {yfov_rad}");
                assert!((was.exposure_scale - is.exposure_scale).abs() < 1e-3, "{frame}");
            }
        }
    }
}
