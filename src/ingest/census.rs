//! How many emitters a scene may have: their numbers are made here, once for all programs.

use super::error::Fault;
use crate::scene::Scene;

/// A tree numbers fewer emitters than this: two of 32 bits tell what a number is of.
const MOST_EMITTERS: u64 = 1 << 30;

/// Instances that are stretched or deform cannot share a tree: each of their triangles is written out. They may be
/// this many, and twice as many as the file holds triangles.
const MOST_WRITTEN_OUT: u64 = 1 << 26;

/// A tree tells where a path is in 32 bits.
const MOST_PATH_BYTES: u64 = u32::MAX as u64;

/// Refuses a scene whose emitters cannot be numbered, or take memory out of proportion to the scene. Counted
/// are all triangles whose material emits, whether their texture is black or not.
pub(super) fn check(scene: &Scene) -> Result<(), Fault> {
    let rigid = scene.rigid_nodes();
    let (mut emitters, mut written_out, mut paths) = (0u64, 0u64, 0u64);
    let mut largest = (0u64, "");
    for (i, instance) in scene.instances.iter().enumerate() {
        if scene.peak_rgb_of_instance(i as u32).max_element() > 0.0 {
            let triangles = scene.meshes[instance.mesh as usize].triangles.len() as u64;
            emitters = emitters.saturating_add(triangles);
            if !rigid[instance.node as usize] || scene.changes_shape(instance.mesh) {
                written_out = written_out.saturating_add(triangles);
            }
            paths += instance.path.len() as u64;
            if triangles > largest.0 {
                largest = (triangles, &instance.path);
            }
        }
    }
    emitters = emitters.saturating_add(scene.lights.len() as u64);
    paths += (0..scene.lights.len()).map(|light| scene.light_path(light).len() as u64).sum::<u64>();
    let stored: u64 = scene.meshes.iter().map(|mesh| mesh.triangles.len() as u64).sum();
    let of_largest = || {
        let (triangles, path) = largest;
        format!("; the largest of them is {path}, with {triangles}")
    };
    if emitters >= MOST_EMITTERS {
        let problem = format!(
            "has {emitters} emitters (lights, and triangles that emit, in all instances); fewer than \
             {MOST_EMITTERS} can be told apart{}",
            of_largest()
        );
        let remedy = "divide the scene, or give its mesh lights fewer triangles or instances";
        return Err(Fault::new("scene", problem).remedy(remedy));
    }
    if written_out > MOST_WRITTEN_OUT.saturating_add(2 * stored) {
        let problem = format!(
            "has {written_out} triangles that emit in instances that are stretched or deform, out of proportion to the \
             {stored} triangles that it holds{}",
            of_largest()
        );
        let remedy = "scale the instances alike along all axes, and let none deform, so that they can share a tree";
        return Err(Fault::new("scene", problem).remedy(remedy));
    }
    if paths > MOST_PATH_BYTES {
        let problem = format!("the paths of its lights have {paths} bytes, which no tree can hold");
        return Err(Fault::new("scene", problem).remedy("shorten the names of its nodes"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::color::Rgb;
    use crate::scene::{
        Deformation, Instance, Keys, Light, LightKind, Material, Mesh, Node, Shape, Target, Trs,
        Visibility,
    };
    use glam::{DQuat, DVec3};
    use std::sync::Arc;

    /// Instances of one mesh of some triangles that emit.
    fn scene(triangles: usize, instances: usize, scale: DVec3, emission: Rgb) -> Scene {
        let local = Trs::Parts { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale };
        let triangles = vec![[0, 0, 0]; triangles];
        let instance = |i: usize| Instance {
            path: format!("/{i}").into(),
            node: 0,
            mesh: 0,
            values: None,
            shaping: None,
            forced: false,
            visibility: Visibility::ALL,
        };
        Scene {
            nodes: vec![Node::fixed("/n", None, local)],
            meshes: vec![Mesh { triangles, material: Some(0), ..Mesh::default() }],
            materials: vec![Material { emission_nits: emission, ..Material::default() }],
            instances: (0..instances).map(instance).collect(),
            ..Scene::default()
        }
    }

    #[test]
    fn emitters_are_counted_in_64_bits() {
        let check = |instances, scale, emission| {
            check(&scene(1 << 20, instances, scale, emission)).map_err(Fault::into_problem)
        };
        let uneven = DVec3::new(1.0, 2.0, 1.0);
        assert_eq!(check(1023, DVec3::ONE, Rgb::ONE), Ok(()));
        // 2^30, and what 32 bits would take for 2^27.
        for instances in [1 << 10, (1 << 12) + (1 << 7)] {
            let problem = check(instances, DVec3::ONE, Rgb::ONE).unwrap_err();
            assert!(problem.contains(&(instances << 20).to_string()), "{problem}");
        }
        assert_eq!(check((1 << 12) + (1 << 7), DVec3::ONE, Rgb::ZERO), Ok(()));
        assert_eq!(check(60, uneven, Rgb::ONE), Ok(()));
        assert!(check(100, uneven, Rgb::ONE).unwrap_err().contains("stretched"));
        // What deforms is written out too, however it is scaled; what could and never does is not.
        for (keys, emission, is_refused) in
            [(2, Rgb::ONE, true), (1, Rgb::ONE, false), (2, Rgb::ZERO, false)]
        {
            let mut scene = scene(1 << 20, 100, DVec3::ONE, emission);
            let (times_s, values) = (vec![0.0, 1.0], vec![Rgb::ZERO, Rgb::X]);
            let weights = Keys {
                times_s: times_s[..keys].into(),
                values: values[..keys].into(),
                interpolation: Default::default(),
            };
            scene.meshes[0].deformation = Some(Arc::new(Deformation {
                rest: Shape::default(),
                targets: vec![Target::default()],
                weights: [weights].into(),
                skin: None,
            }));
            assert_eq!(super::check(&scene).is_err(), is_refused, "{keys} {emission}");
        }
    }

    #[test]
    fn lights_count_too() {
        let mut scene = scene((1 << 20) - 1, 1 << 10, DVec3::ONE, Rgb::ONE);
        let kind = LightKind::Point { intensity_cd: Rgb::ONE };
        let light = Light {
            node: 0,
            kind,
            values: None,
            range_m: None,
            forced: false,
            visibility: Visibility::ALL,
        };
        scene.lights = vec![light; 1 << 10];
        assert!(check(&scene).unwrap_err().into_problem().contains("1073741824 emitters"));
        scene.lights.pop();
        assert!(check(&scene).is_ok());
    }
}
