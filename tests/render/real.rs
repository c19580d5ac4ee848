//! Files that other people wrote: whatever loads can be built for, verified and rendered.

use crate::shared;
use crate::stage::Set;
use candelabra::emitter::Emitters;
use candelabra::light_tree::LightTree;
use candelabra::pipeline::{self, ASPECT, View};
use candelabra::render::{RenderDelegate, RenderSettings};
use candelabra::scene::{Light, LightKind, Node, Scene, Trs};
use glam::Vec3;
use std::path::Path;
use std::time::Instant;

/// Too large for a test of every day: 17.86 million emissive triangles; see below.
const HUGE: &str = "luxcore_lightinstances";

fn settings() -> RenderSettings {
    RenderSettings { width: 32, height: 18, samples: 2, depth: 2, ..Default::default() }
}

/// White light from all around, where the file has no light.
fn with_light(scene: &mut Scene) {
    if Emitters::collect(scene).is_empty() && scene.lights.is_empty() {
        scene.nodes.push(Node::fixed("/test_sky", None, Trs::default()));
        let kind = LightKind::Dome { radiance_nits: Vec3::ONE, texture: None };
        let node = scene.nodes.len() as u32 - 1;
        scene.lights.push(Light {
            node,
            kind,
            values: None,
            range_m: None,
            forced: false,
            visibility: Default::default(),
        });
    }
}

/// Builds, verifies and renders a scene's first frame as `candelabra-render` does without options; tells
/// how bright it is.
fn render(mut scene: Scene) -> f32 {
    with_light(&mut scene);
    let camera = pipeline::look(&mut scene, &View::default(), ASPECT).unwrap().camera;
    let frame = pipeline::frames_of(&scene)[0];
    let buffers = Set::of(&scene, &[frame]).seen_by(camera, &settings(), frame);
    let beauty = || buffers.beauty();
    assert!(beauty().all(|color| color.is_finite() && color.min_element() >= 0.0));
    beauty().map(|color| color.element_sum()).sum::<f32>() / (3 * beauty().count()) as f32
}

fn is_scene(file: &Path) -> bool {
    let extension = file.extension().and_then(|extension| extension.to_str());
    matches!(extension, Some("gltf" | "glb" | "obj"))
}

#[test]
fn every_file_that_loads_is_rendered() {
    let Some(folder) = shared::folder("real") else { return };
    let huge = folder.join(HUGE);
    let files = shared::files_below(&folder).into_iter();
    let (mut rendered, mut dark) = (0, Vec::new());
    for file in files.filter(|file| is_scene(file) && !file.starts_with(&huge)) {
        let Ok(scene) = pipeline::load_scene(&file) else { continue };
        let started = Instant::now();
        let brightness = render(scene);
        let (name, seconds) =
            (file.strip_prefix(&folder).unwrap(), started.elapsed().as_secs_f64());
        println!("{seconds:.2} s, brightness {brightness}: {}", name.display());
        rendered += 1;
        dark.extend((brightness == 0.0).then(|| name.to_path_buf()));
    }
    assert!(rendered >= 150, "only {rendered} scenes");
    assert!(dark.len() <= 5, "{dark:?} are dark");
}

/// `cargo test --release --test render -- --ignored --nocapture` shows what it costs.
#[test]
#[ignore = "17.86 million emissive triangles: half a minute and gigabytes"]
fn seventeen_million_emitters() {
    let Some(folder) = shared::folder("real") else { return };
    let started = Instant::now();
    let tell = |what: &str| {
        let peak = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let peak = peak.lines().find(|line| line.starts_with("VmHWM")).unwrap_or("").to_owned();
        println!("{:7.2} s {what}; {peak}", started.elapsed().as_secs_f64());
    };
    let file = folder.join(HUGE).join("gltf/lightinstances.gltf");
    let mut scene = pipeline::load_scene(&file).unwrap();
    tell("loaded");
    let camera = pipeline::look(&mut scene, &View::default(), ASPECT).unwrap().camera;
    tell("framed");
    let emitters = Emitters::collect(&scene);
    assert_eq!(emitters.len(), 17_859_968);
    tell("emitters collected");
    let survey = pipeline::survey(&scene, &emitters, &[1]).unwrap();
    tell("surveyed");
    let tree = LightTree::open(pipeline::build_tree(&survey)).unwrap();
    tell("built");
    tree.verify().unwrap();
    tell("verified");
    let delegate = RenderDelegate::new(&scene, &emitters, camera, settings());
    tell("geometry prepared");
    let buffers = delegate.render(&tree, 1, &()).unwrap().buffers;
    assert!(buffers.beauty().all(|beauty| beauty.is_finite()));
    tell("rendered");
}
