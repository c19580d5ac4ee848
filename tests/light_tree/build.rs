//! What the build promises: sound files, whose bytes depend on the set of bounds alone.

use crate::support::{Tree, emitters, nodes, tree_over};
use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::{
    LightList, LightTree, LightTreeWriter, Link, Receiver, TreeKind, WIDTH,
};
use candelabra::store::AlignedBytes;
use glam::Vec3;
use proptest::prelude::*;

fn point(p: Vec3, energy: f32) -> LightBounds {
    LightBounds::of_emitter(Aabb::around([p]), Cone::ALL, energy, f32::INFINITY)
}

/// Groups above the deepest leaf.
fn depth(bounds: &[LightBounds]) -> usize {
    nodes(&tree_over(bounds)).into_iter().map(|(_, depth)| depth).max().unwrap_or_default()
}

fn groups_as_bytes(tree: &Tree) -> &[u8] {
    bytemuck::cast_slice(tree.groups())
}

proptest! {
    #[test]
    fn every_tree_verifies(bounds in emitters(200)) {
        let tree = tree_over(&bounds);
        prop_assert_eq!(tree.verify(), Ok(()));
        // The leaves are a permutation of the emitters, and each contains its own.
        for (bounds, leaf) in bounds.iter().zip(leaf_bounds(&tree)) {
            prop_assert!(leaf.aabb.contains_box(&bounds.aabb));
            prop_assert_eq!(leaf.energy, bounds.energy);
        }
    }

    #[test]
    fn the_order_of_the_input_does_not_show(bounds in emitters(100), seed in any::<u64>()) {
        let mut shuffled = bounds.clone();
        let mut state = seed;
        for i in (1..shuffled.len()).rev() {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            shuffled.swap(i, (state >> 33) as usize % (i + 1));
        }
        let (a, b) = (tree_over(&bounds), tree_over(&shuffled));
        // Leaves name their emitters by number, which the shuffle changed: compare what they bound.
        let bounds_in_order = |tree: &Tree| {
            nodes(tree).into_iter().map(|(node, depth)| (node.bounds(), depth)).collect::<Vec<_>>()
        };
        prop_assert_eq!(bounds_in_order(&a), bounds_in_order(&b));
    }

    #[test]
    fn damaged_bytes_are_refused_or_at_least_harmless(
        bounds in emitters(20), at in any::<prop::sample::Index>(), bit in 0u8..8
    ) {
        let mut writer = LightTreeWriter::default();
        writer.add_tree(TreeKind::Still, &bounds, |i| Link::Emitter(i as u32));
        let bytes = writer.finish(&LightList::new(&[]), "", [0; 32]);
        let mut damaged = bytes.as_ref().to_vec();
        damaged[at.index(bytes.as_ref().len())] ^= 1 << bit;
        let Ok(tree) = LightTree::open(AlignedBytes::copy_of(&damaged)) else { return Ok(()) };
        prop_assert!(tree.verify().is_err());
        let frame = tree.at_frame(0).unwrap();
        let receiver = Receiver { point: Vec3::ONE, normal: Vec3::Z };
        for i in 0..16 {
            frame.sample(&receiver, f64::from(i) / 16.0);
            frame.probability(&receiver, i);
        }
    }
}

/// The leaf bounds of each emitter, in the emitters' order.
fn leaf_bounds(tree: &Tree) -> Vec<LightBounds> {
    let leaf = |(node, _): (candelabra::light_tree::Node, usize)| match node.link() {
        Link::Emitter(emitter) => Some((emitter, node.bounds())),
        _ => None,
    };
    let mut found: Vec<_> = nodes(tree).into_iter().filter_map(leaf).collect();
    found.sort_by_key(|(emitter, _)| *emitter);
    found.into_iter().map(|(_, bounds)| bounds).collect()
}

#[test]
fn one_thread_and_two_give_the_same_bytes() {
    let bounds: Vec<_> = (0..50_000)
        .map(|i| {
            let t = i as f32;
            point(Vec3::new(t.sin() * t, (t * 0.37).cos() * t, (t * 0.11).sin()), 1.0 + t.fract())
        })
        .collect();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| groups_as_bytes(&tree_over(&bounds)).to_vec())
    };
    assert!(with(1) == with(2));
}

#[test]
fn coincident_lights_make_a_balanced_tree() {
    // 1024 = 8 * 8 * 8 * 2: four groups above a leaf, the first at depth 0.
    assert_eq!(depth(&vec![point(Vec3::ONE, 1.0); 1024]), 3);
}

#[test]
fn lights_on_a_line_or_plane_are_sorted_along_any_axis() {
    let on = |place: &dyn Fn(f32) -> Vec3| -> Vec<_> {
        (0..512).map(|i| point(place(((i * 37) % 512) as f32), 1.0)).collect()
    };
    let lines: [&dyn Fn(f32) -> Vec3; 3] =
        [&|t| Vec3::new(t, 0.0, 0.0), &|t| Vec3::new(1.0, t, 2.0), &|t| Vec3::new(0.0, 0.0, t)];
    for line in lines {
        let tree = tree_over(&on(line));
        assert_eq!(tree.verify(), Ok(()));
        // A sorted tree: the children of a group divide their stretch of the line.
        for group in tree.groups() {
            let mut children: Vec<_> = group.nodes().collect();
            let along = |node: &candelabra::light_tree::Node| node.center().element_sum();
            children.sort_by(|a, b| along(a).total_cmp(&along(b)));
            for pair in children.windows(2) {
                let apart = along(&pair[1]) - along(&pair[0]);
                let reach = (pair[0].half_extent() + pair[1].half_extent()).max_element();
                assert!(reach <= apart * 1.02, "{reach} {apart}");
            }
        }
    }
}

#[test]
fn energies_of_sixty_orders_of_magnitude_add_up() {
    let bounds: Vec<_> =
        (0..61).map(|i| point(Vec3::splat(i as f32), 10f32.powi(i - 30))).collect();
    assert_eq!(tree_over(&bounds).verify(), Ok(()));
    assert!(depth(&bounds) <= 16);
}

#[test]
fn no_lights_make_an_empty_file_and_one_light_a_root() {
    let none = tree_over(&[]);
    assert!(none.trees().is_empty() && none.groups().is_empty());
    let one = tree_over(&[point(Vec3::ZERO, 3.0)]);
    assert_eq!(one.verify(), Ok(()));
    assert_eq!((one.trees().len(), one.groups().len()), (1, 1));
    assert_eq!(one.groups()[0].link(0), Link::Emitter(0));
    assert!((1..WIDTH).all(|lane| one.groups()[0].link(lane) == Link::Nothing));
}
