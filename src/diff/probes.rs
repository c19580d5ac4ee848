//! Where picking is compared.

use super::picking::ProbePlaces;
use super::scene_side::SceneSide;
use crate::bounds::Aabb;
use crate::light_tree::{LightTree, Receiver, TreeKind, TreeRow};
use crate::measure::visited;
use crate::render::{RenderDelegate, RenderSettings};
use glam::Vec3;

/// How many probes.
const PROBES: u32 = 64;
/// Pixels to either side of the picture that probes are spread over.
const PICTURE: u32 = 1024;

/// Points that paths from the camera of a scene visit; `None` if it has no camera, or sees
/// nothing.
pub(super) fn on_camera_paths<D: AsRef<[u8]> + Sync>(
    side: &SceneSide,
    tree: &LightTree<D>,
) -> Option<Vec<Receiver>> {
    let camera = side.camera?.clone();
    let settings = RenderSettings { width: PICTURE, height: PICTURE, ..Default::default() };
    let delegate = RenderDelegate::new(side.scene, &side.emitters, camera, settings);
    let found = delegate.at_frame(tree, side.frame(), |integrator| {
        (0..PROBES).filter_map(|i| visited(integrator, i, PROBES, 0)).map(|v| v.receiver).collect()
    });
    found.ok().filter(|found: &Vec<Receiver>| !found.is_empty())
}

/// Points spread evenly over a box that is enlarged by half its size on every side. They receive light
/// from every direction.
pub(super) fn around(lights: &Aabb) -> Vec<Receiver> {
    let diagonal = lights.extent().length();
    // Around a single point, a metre is as good as any distance.
    let margin = if diagonal > 0.0 {
        0.5 * lights.extent().max(Vec3::splat(0.1 * diagonal))
    } else {
        Vec3::ONE
    };
    let (low, size) = (lights.min - margin, lights.extent() + 2.0 * margin);
    // The R3 sequence (Roberts, 2018): a lattice of rank 1 with steps g^-1, g^-2, g^-3, g^4 = g + 1.
    let step = [0.819_172_513_4_f64, 0.671_043_606_7, 0.549_700_477_9];
    let at = |i: u32| Vec3::from(step.map(|step| (0.5 + step * f64::from(i)).fract() as f32));
    (0..PROBES).map(|i| Receiver { point: low + size * at(i), normal: Vec3::ZERO }).collect()
}

/// The probes and where they are: on camera paths of the version after, else of the version before, else
/// in the box around all lights.
pub(super) fn probes<D: AsRef<[u8]> + Sync>(
    sides: [Option<&SceneSide>; 2],
    trees: [&LightTree<D>; 2],
) -> (ProbePlaces, Vec<Receiver>) {
    let through = |side: usize| on_camera_paths(sides[side]?, trees[side]);
    match through(1).or_else(|| through(0)) {
        Some(found) => (ProbePlaces::CameraPaths, found),
        None => (ProbePlaces::BoxAroundLights, around(&box_around(trees))),
    }
}

/// The box around all emitters that are not forced, of all frames; around the origin if there are none.
pub(super) fn box_around<D: AsRef<[u8]>>(trees: [&LightTree<D>; 2]) -> Aabb {
    let in_world = |row: &&TreeRow| TreeKind::of(row) != Some(TreeKind::Shared);
    let roots = trees.into_iter().flat_map(|tree| tree.trees()).filter(in_world);
    let all = roots.fold(Aabb::EMPTY, |all, row| all.union(&row.root.bounds().aabb));
    if all.is_empty() { Aabb::around([Vec3::ZERO]) } else { all }
}
