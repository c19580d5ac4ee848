//! Same input, same bytes: whatever the threads, whatever the order of the scene's tables.

use crate::moving::{FRAMES, carousel};
use crate::rooms;
use crate::stage::{Set, Stage, direct, tree_bytes};
use candelabra::render::RenderSettings;
use candelabra::render::exr::write_exr;
use candelabra::scene::{LightKind, Scene};

/// Every kind of light, textures, cut-outs, and lights that move.
fn everything() -> Stage {
    let mut stage = carousel();
    rooms::all_lights(&mut stage);
    stage
}

fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

/// The bytes of the tree file and of one frame's picture.
fn bytes(scene: &Scene, seed: u32) -> (Vec<u8>, Vec<u8>) {
    let set = Set::of(scene, &FRAMES);
    let settings = RenderSettings { depth: 3, seed, ..direct(40, 4) };
    let buffers = set.render(&settings, 13);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    write_exr(&path, &buffers, "{}").unwrap();
    (tree_bytes(scene, &FRAMES).as_ref().to_vec(), std::fs::read(path).unwrap())
}

#[test]
fn threads_do_not_show() {
    let stage = everything();
    let alone = with_threads(1, || bytes(&stage.scene, 0));
    for threads in [1, 2, 5] {
        let (tree, picture) = with_threads(threads, || bytes(&stage.scene, 0));
        assert!(tree == alone.0, "{threads} threads build another tree");
        assert!(picture == alone.1, "{threads} threads make another picture");
    }
    let (tree, picture) = bytes(&stage.scene, 1);
    assert!(tree == alone.0 && picture != alone.1, "the seed changes the noise alone");
}

/// Every table turned around; parents stay before their children.
fn turned_around(scene: &mut Scene) {
    let depth = |scene: &Scene, node: usize| {
        let parent = |&node: &usize| scene.nodes[node].parent.map(|parent| parent as usize);
        std::iter::successors(Some(node), parent).count()
    };
    let mut order: Vec<usize> = (0..scene.nodes.len()).rev().collect();
    order.sort_by_key(|&node| depth(scene, node));
    let mut place = vec![0; order.len()];
    for (new, &old) in (0..).zip(&order) {
        place[old] = new;
    }
    let moved = |node: u32| place[node as usize];
    scene.nodes = order.iter().map(|&old| scene.nodes[old].clone()).collect();
    for node in &mut scene.nodes {
        node.parent = node.parent.map(moved);
    }
    let from_end = |index: u32, length: usize| length as u32 - 1 - index;
    let [meshes, materials, textures] =
        [scene.meshes.len(), scene.materials.len(), scene.textures.len()];
    for instance in &mut scene.instances {
        instance.node = moved(instance.node);
        instance.mesh = from_end(instance.mesh, meshes);
    }
    for mesh in &mut scene.meshes {
        mesh.material = mesh.material.map(|material| from_end(material, materials));
    }
    for material in &mut scene.materials {
        let uses = [&mut material.emission_texture, &mut material.base_color_texture];
        for used in uses.into_iter().flatten() {
            used.texture = from_end(used.texture, textures);
        }
    }
    for light in &mut scene.lights {
        light.node = moved(light.node);
        if let LightKind::Dome { texture: Some(texture), .. } = &mut light.kind {
            *texture = from_end(*texture, textures);
        }
    }
    scene.meshes.reverse();
    scene.materials.reverse();
    scene.textures.reverse();
    scene.instances.reverse();
    scene.lights.reverse();
}

#[test]
fn the_order_of_the_tables_does_not_show_in_the_tree() {
    let mut stage = everything();
    let expected = tree_bytes(&stage.scene, &FRAMES);
    let (first, last) = (stage.scene.nodes[0].path.clone(), stage.scene.instances.len());
    turned_around(&mut stage.scene);
    assert!(stage.scene.nodes[0].path != first && last > 10, "nothing was turned around");
    assert!(tree_bytes(&stage.scene, &FRAMES).as_ref() == expected.as_ref());
}
