//! Files that other people wrote, against what their READMEs say is in them.

use crate::shared;
use candelabra::ingest::load;
use candelabra::scene::{Keys, LightKind, Scene};
use glam::Vec3;
use std::path::PathBuf;

fn real(file: &str) -> Option<Scene> {
    let path = shared::folder("real")?.join(file);
    Some(load(&path).unwrap_or_else(|error| panic!("{error}")))
}

fn reference(file: &str) -> Option<Scene> {
    let path = shared::folder("reference")?.join(file);
    Some(load(&path).unwrap_or_else(|error| panic!("{error}")))
}

/// Triangles that emit, those of an instanced mesh once for each instance.
fn emissive_triangles(scene: &Scene) -> usize {
    let triangles = |mesh: u32| {
        let mesh = &scene.meshes[mesh as usize];
        let emits = mesh.material.is_some_and(|m| scene.materials[m as usize].emits());
        if emits { mesh.triangles.len() } else { 0 }
    };
    scene.instances.iter().map(|instance| triangles(instance.mesh)).sum()
}

/// How many points, spots and suns there are.
fn punctual(scene: &Scene) -> [usize; 3] {
    let needs = scene.requirements();
    [needs.points, needs.spots, needs.suns]
}

#[test]
fn every_file_loads() {
    let Some(folder) = shared::folder("real") else { return };
    let files: Vec<PathBuf> = shared::files_below(&folder)
        .into_iter()
        .filter(|file| !file.starts_with(folder.join("malformed")))
        .filter(|file| {
            let extension = file.extension().and_then(|e| e.to_str());
            matches!(extension, Some("gltf" | "glb" | "obj"))
        })
        .collect();
    assert!(files.len() >= 15, "only {} scenes below {}", files.len(), folder.display());
    for file in files {
        match load(&file) {
            Ok(_) => {}
            // Their buffers were not fetched when the collection was made.
            Err(error) if file.starts_with(folder.join("atteneder_lights")) => {
                assert!(error.to_string().contains("Git LFS pointer"), "{error}");
            }
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn instances_share_their_meshes() {
    let Some(scene) = real("luxcore_lightinstances/gltf/lightinstances.gltf") else { return };
    let emits =
        |mesh: u32| scene.materials[scene.meshes[mesh as usize].material.unwrap() as usize].emits();
    let mut emissive: Vec<u32> =
        scene.instances.iter().map(|i| i.mesh).filter(|&mesh| emits(mesh)).collect();
    assert_eq!(emissive.len(), 4501);
    emissive.sort_unstable();
    emissive.dedup();
    assert_eq!(emissive.len(), 2);
    assert_eq!(emissive_triangles(&scene), 17_859_968);
}

#[test]
fn gpu_instances_share_their_mesh() {
    let Some(scene) = real("teapots_galore/teapots_galore.gltf") else { return };
    let triangles: usize =
        scene.instances.iter().map(|i| scene.meshes[i.mesh as usize].triangles.len()).sum();
    assert_eq!(triangles, 7_656_770);
    assert!(scene.meshes.len() <= 2);
    assert!(scene.instances[12].path.ends_with("]"), "{}", scene.instances[12].path);
}

#[test]
fn an_emissive_texture_stays_a_texture() {
    let Some(scene) = real("toycar/ToyCar.gltf") else { return };
    assert_eq!(emissive_triangles(&scene), 88_837);
    assert_eq!(scene.requirements().textured_mesh_lights, 1);
    assert_eq!(scene.cameras.len(), 8);
}

#[test]
fn strengths_multiply_emission() {
    let file = "blenderio_emission_and_pointer/14_emission_strength/14_emission_strength.gltf";
    let Some(scene) = real(file) else { return };
    let strengths: Vec<f32> = scene
        .instances
        .iter()
        .map(|i| scene.meshes[i.mesh as usize].material.unwrap() as usize)
        .map(|material| scene.materials[material].emission_nits.max_element())
        .filter(|&strength| strength > 0.0)
        .collect();
    assert_eq!(strengths.len(), 16);
    // Factors from 0.2 to 0.9, half of them times 5.
    let most = strengths.iter().copied().fold(0.0, f32::max);
    assert_eq!((most, strengths.iter().filter(|&&strength| strength == 4.5).count()), (4.5, 8));
}

#[test]
fn animation_pointers_to_nodes_are_animation() {
    let file = "blenderio_emission_and_pointer/24_animation_pointer/24_animation_pointer.gltf";
    let Some(scene) = real(file) else { return };
    assert!(scene.requirements().animated_nodes > 4);
    assert_eq!(scene.requirements().lenses_over_time, 3);
    let notes = |text: &str| scene.notes.iter().any(|note| note.text.contains(text));
    for lost in ["of a light", "emission", "shapes"] {
        assert!(!notes(&format!("animation of this part of {lost}")), "{:?}", scene.notes);
        assert!(!notes(&format!("animation of {lost}")), "{:?}", scene.notes);
    }
    assert!(scene.notes.len() < 20, "{:#?}", scene.notes);
    // One spot after the other is lit in the place of each that opens and closes.
    let pose = scene.pose_at(1.0);
    let lit = |path: &str| {
        let rows = (0..scene.lights.len()).filter(|&row| scene.light_path(row).contains(path));
        rows.filter(|&row| scene.rgb_of_light(row as u32, &pose).max_element() > 0.0).count()
    };
    assert!((1..=2).contains(&lit("punctual-spot2")), "{}", lit("punctual-spot2"));
    assert!((40..4000).contains(&scene.lights.len()), "{}", scene.lights.len());
    let glows =
        scene.instances.iter().filter(|one| one.values.as_deref().is_some_and(Keys::varies));
    assert_eq!(glows.count(), 1);
}

#[test]
fn punctual_lights_are_counted() {
    let Some(scene) = real("godot_tps_lights/lights.glb") else { return };
    assert_eq!(punctual(&scene), [7, 13, 0]);
    assert_eq!(punctual(&real("frogfood_simple_scene/simple_scene.glb").unwrap()), [4, 10, 0]);
    let man = real("cesium_man_with_light/cesium_man_with_light.glb").unwrap();
    assert_eq!(punctual(&man), [0, 1, 0]);
    assert!(man.requirements().animated_nodes > 0);
}

/// The world box of an instance at a time, seconds.
fn bounds(scene: &Scene, path: &str, time_s: f64) -> [Vec3; 2] {
    let found = scene.instances.iter().find(|instance| instance.path.ends_with(path));
    let instance = found.unwrap_or_else(|| panic!("{path}"));
    let pose = scene.pose_at(time_s);
    let world = pose.world(instance.node);
    let places =
        pose.positions(scene, instance.mesh).iter().map(|&place| world.transform_point3(place));
    places.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}

/// Boxes that another program found, which reads nothing but accessors and keys (numpy). At rest the man's arms are spread
/// along z, and the cylinder stands upright.
#[test]
fn skinned_meshes_are_where_others_see_them() {
    let Some(man) = real("cesium_man_with_light/cesium_man_with_light.glb") else { return };
    let near = |found: [Vec3; 2], low: [f32; 3], high: [f32; 3]| {
        let off = (found[0] - Vec3::from(low)).abs().max((found[1] - Vec3::from(high)).abs());
        assert!(off.max_element() < 1e-5, "{found:?}");
    };
    // He walks.
    for (second, low, high) in [
        (0.0, [-0.451214, -0.008300, -0.194338], [0.461872, 1.441551, 0.301814]),
        (0.5, [-0.405723, 0.017486, -0.189907], [0.371770, 1.501988, 0.254668]),
        (1.0, [-0.507518, -0.001425, -0.166843], [0.462331, 1.457234, 0.202182]),
        (1.7, [-0.423779, 0.013753, -0.186766], [0.459339, 1.466918, 0.263370]),
    ] {
        near(bounds(&man, "Cesium_Man", second), low, high);
    }
    assert!(man.notes.iter().all(|note| !note.text.contains("deforms")), "{:?}", man.notes);
    let file = "blenderio_emission_and_pointer/24_animation_pointer/24_animation_pointer.gltf";
    let found = bounds(&real(file).unwrap(), "Cylinder", 0.0);
    near(found, [1.173684, -0.014593, -2.557314], [2.763228, 0.763949, -2.057314]);
}

#[test]
fn rooms_have_their_lamps() {
    let Some(scene) = real("luxcore_manylights/gltf/manylights.gltf") else { return };
    assert_eq!(emissive_triangles(&scene), 120);
    assert_eq!(emissive_triangles(&real("cornell_gltf/cornellBox.gltf").unwrap()), 12);
    assert_eq!(emissive_triangles(&real("cornell_bevy/CornellBox.glb").unwrap()), 2);
}

#[test]
fn obj_emission_is_read() {
    let Some(scene) = real("stochastic_lightcuts_cornell/cornell.obj") else { return };
    assert_eq!(emissive_triangles(&scene), 12_146);
    assert_eq!(scene.requirements().mesh_lights, 13);
    assert_eq!(scene.notes, []);
}

#[test]
fn reference_scenes_are_read() {
    let Some(scene) = reference("spiral10k.glb") else { return };
    assert_eq!(punctual(&scene), [10_000, 0, 0]);
    assert!(scene.lights.iter().all(|light| matches!(light.kind, LightKind::Point { .. })));
    assert!(scene.materials.iter().all(|material| material.specular == 0.0));
    assert_eq!(scene.cameras.len(), 1);
    let scene = reference("spiralmesh.glb").unwrap();
    assert_eq!(emissive_triangles(&scene), 20_004);
    let ribbon = scene.materials.iter().find(|material| material.emits()).unwrap();
    assert!(!ribbon.double_sided, "the ribbon emits from its front");
}
