//! What a hit looks like, on a unit square with known attributes.

use super::*;
use crate::scene::{Coat, Instance, Node, Pixels, Texture, Trs, Wrap};
use glam::{DQuat, DVec3};

/// A unit square in the XY plane, front toward +Z, the picture upright on it.
fn square() -> Mesh {
    let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    Mesh {
        positions: vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
        uv_sets: vec![vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: Some(0),
        ..Default::default()
    }
}

fn scene_of(mesh: Mesh, material: Material, scale: DVec3) -> Scene {
    let local = Trs::Parts { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale };
    Scene {
        nodes: vec![Node::fixed("/square", None, local)],
        meshes: vec![mesh],
        materials: vec![material],
        instances: vec![Instance {
            path: "/square".into(),
            node: 0,
            mesh: 0,
            values: None,
            shaping: None,
            forced: false,
            visibility: Default::default(),
        }],
        ..Default::default()
    }
}

fn texture(pixels: Pixels) -> Texture {
    let wrap = [Wrap::Clamp; 2];
    Texture { name: "t".into(), width: 2, height: 1, pixels, wrap, bilinear: false }
}

const USED: Option<TextureUse> = Some(TextureUse { texture: 0, uv_set: 0, transform: None });

/// The surface at a point of the square's first triangle, seen from `wo`.
fn seen(scene: &Scene, weights: Vec2, wo: Vec3) -> Surface {
    let pose = scene.pose_at(0.0);
    let normal = Vec3::Z * pose.world(0).matrix3.z_axis.z.signum();
    let anchor = Anchor::computed(Vec3::ZERO, normal, 1.0);
    Surfaces::new(scene, &pose).at(0, 0, weights, anchor, wo.normalize())
}

const MIDDLE: Vec2 = Vec2::splat(1.0 / 3.0);

#[test]
fn factors_multiply_textures_and_vertex_colours() {
    let mut mesh = square();
    mesh.colors = vec![Vec4::new(0.5, 1.0, 1.0, 0.5); 4];
    let material = Material {
        base_color: Rgb::new(0.5, 0.5, 1.0),
        base_color_texture: USED,
        metallic: 0.5,
        roughness: 0.8,
        metallic_roughness_texture: USED,
        specular: 0.6,
        specular_color: Rgb::new(2.0, 1.0, 100.0),
        coat: Some(Coat {
            factor: 0.5,
            factor_texture: USED,
            roughness: 0.8,
            roughness_texture: USED,
            normal_texture: None,
            normal_scale: 1.0,
        }),
        opacity: 0.8,
        alpha_mode: AlphaMode::Blend,
        ..Default::default()
    };
    let mut scene = scene_of(mesh, material, DVec3::ONE);
    scene.textures.push(texture(Pixels::Linear8(vec![[255, 0, 51, 255], [255, 51, 102, 51]])));
    // The second corner is at the right of the picture.
    let surface = seen(&scene, Vec2::new(0.9, 0.05), Vec3::Z);
    let close = |a: Vec3, b: Vec3| assert!((a - b).abs().max_element() < 1e-6, "{a} {b}");
    close(surface.sample.base_color, Rgb::new(0.25, 0.1, 0.4));
    close(
        Vec3::new(surface.sample.metallic, surface.sample.roughness, 0.0),
        Vec3::new(0.2, 0.16, 0.0),
    );
    close(surface.sample.dielectric_f0, Rgb::new(0.08, 0.04, 1.0) * 0.6);
    assert_eq!(surface.sample.dielectric_f90, 0.6);
    let SurfaceSample { coat, coat_roughness, .. } = surface.sample;
    close(Vec3::new(coat, coat_roughness, 0.0), Vec3::new(0.5, 0.16, 0.0));
    let pose = scene.pose_at(0.0);
    let coverage = |scene: &Scene| Surfaces::new(scene, &pose).coverage(0, 0, Vec2::new(0.9, 0.05));
    assert!((coverage(&scene) - 0.8 * 0.5 * 0.2).abs() < 1e-6);
    for (cutoff, counts) in [(0.07, 1.0), (0.09, 0.0)] {
        scene.materials[0].alpha_mode = AlphaMode::Mask(cutoff);
        assert_eq!(coverage(&scene), counts);
    }
    scene.materials[0].alpha_mode = AlphaMode::Opaque;
    assert_eq!(coverage(&scene), 1.0);
}

#[test]
fn the_frame_is_on_the_side_that_is_looked_at() {
    for (scale, front) in [(DVec3::ONE, Vec3::Z), (DVec3::new(1.0, 1.0, -1.0), -Vec3::Z)] {
        let scene = scene_of(square(), Material::default(), scale);
        let from_front = seen(&scene, Vec2::new(0.9, 0.05), front);
        let from_back = seen(&scene, Vec2::new(0.9, 0.05), -front);
        assert!(from_front.front && !from_back.front);
        assert_eq!((from_front.frame.normal, from_back.frame.normal), (front, -front));
    }
}

#[test]
fn normals_interpolate_in_world_space_on_the_side_of_the_viewer() {
    let mut mesh = square();
    let tilted = Vec3::new(1.0, 0.0, 1.0).normalize();
    mesh.normals = vec![tilted; 4];
    for flip in [1.0, -1.0] {
        // A normal that points against the winding is turned.
        mesh.normals = vec![tilted * flip; 4];
        for (scale, expected) in [
            (DVec3::ONE, Vec3::new(1.0, 0.0, 1.0)),
            (DVec3::new(2.0, 1.0, 1.0), Vec3::new(0.5, 0.0, 1.0)),
            (DVec3::new(-1.0, 1.0, 1.0), Vec3::new(-1.0, 0.0, 1.0)),
            (DVec3::new(1.0, 1.0, -1.0), Vec3::new(1.0, 0.0, -1.0)),
        ] {
            let scene = scene_of(mesh.clone(), Material::default(), scale);
            let expected = expected.normalize();
            for side in [1.0, -1.0] {
                let normal = seen(&scene, MIDDLE, expected * side).frame.normal;
                assert!((normal - expected * side).length() < 1e-6, "{normal} {expected} {scale}");
            }
        }
    }
    let flat = scene_of(square(), Material::default(), DVec3::ONE);
    assert_eq!(seen(&flat, MIDDLE, Vec3::new(1.0, 1.0, 0.1)).frame.normal, Vec3::Z);
}

#[test]
fn the_viewer_is_above_every_shading_horizon() {
    let mut mesh = square();
    mesh.normals = vec![Vec3::new(0.99, 0.0, 0.1).normalize(); 4];
    let scene = scene_of(mesh, Material::default(), DVec3::ONE);
    for wo in [Vec3::new(-1.0, 0.0, 0.05), Vec3::new(-1.0, 0.0, -0.05), Vec3::new(-1.0, 0.0, 1e-6)]
    {
        let surface = seen(&scene, MIDDLE, wo);
        let least = LEAST_COSINE.min(wo.normalize().z.abs());
        assert!(surface.frame.normal.dot(wo.normalize()) >= least * 0.9);
        assert!((surface.frame.normal.length() - 1.0).abs() < 1e-5);
    }
}

#[test]
fn a_flat_surface_is_not_bent_however_grazing_the_view() {
    let scene = scene_of(square(), Material::default(), DVec3::ONE);
    for decade in 0..30 {
        let surface = seen(&scene, MIDDLE, Vec3::new(1.0, 0.0, 10f32.powi(-decade)));
        assert_eq!(surface.frame.normal, Vec3::Z);
    }
}

#[test]
fn normals_and_maps_do_not_know_the_size_of_their_node() {
    let mut mesh = square();
    mesh.normals = vec![Vec3::new(0.3, 0.2, 1.0).normalize(); 4];
    let material = Material { normal_texture: USED, ..Default::default() };
    let normal = |size: f64| {
        let scale = DVec3::new(-1.0, 2.0, 0.5) * size;
        let mut scene = scene_of(mesh.clone(), material.clone(), scale);
        scene.textures.push(texture(Pixels::Linear8(vec![[180, 100, 202, 255]; 2])));
        seen(&scene, MIDDLE, Vec3::Z).frame.normal
    };
    for decade in -30..=16 {
        assert!((normal(10f64.powi(decade)) - normal(1.0)).length() < 1e-6, "1e{decade}");
    }
}

/// A coat without a map follows the mesh, whatever map is below it; one that has the same map shares the frame.
#[test]
fn a_coat_has_its_own_normals() {
    let coat = |normal_texture, normal_scale| Coat {
        factor: 1.0,
        factor_texture: None,
        roughness: 0.0,
        roughness_texture: None,
        normal_texture,
        normal_scale,
    };
    let smooth = Vec3::new(0.3, 0.2, 1.0).normalize();
    let surface = |below, coat, wo| {
        let mut mesh = square();
        mesh.normals = vec![smooth; 4];
        let material = Material { normal_texture: below, coat: Some(coat), ..Default::default() };
        let mut scene = scene_of(mesh, material, DVec3::ONE);
        scene.textures.push(texture(Pixels::Linear8(vec![[229, 128, 202, 255]; 2])));
        seen(&scene, MIDDLE, wo)
    };
    for wo in [Vec3::Z, -Vec3::Z] {
        let bent = surface(USED, coat(USED, 1.0), wo);
        assert_eq!(bent.coat_normal, None);
        let bent = bent.frame.normal;
        assert_eq!(surface(None, coat(None, 1.0), wo).coat_normal, None);
        let above = surface(USED, coat(None, 1.0), wo);
        assert_eq!(above.frame.normal, bent);
        assert!(above.coat_normal.unwrap().distance(smooth * wo.z) < 1e-6);
        let own = surface(None, coat(USED, 1.0), wo);
        assert_eq!(own.coat_normal, Some(bent));
        assert!(own.frame.normal.distance(smooth * wo.z) < 1e-6);
        let less = surface(USED, coat(USED, 0.5), wo).coat_normal.unwrap();
        let angle = |normal: Vec3| normal.angle_between(smooth * wo.z);
        assert!(angle(less) > 0.1 && angle(less) < 0.8 * angle(bent), "{less} {bent}");
        assert!(surface(USED, coat(None, 1.0), wo).bsdf().toward(wo).has_two_horizons());
        assert!(!surface(USED, coat(USED, 1.0), wo).bsdf().toward(wo).has_two_horizons());
    }
    // Without strength there is no coat to be bent.
    let gone = Coat { factor: 0.0, ..coat(None, 1.0) };
    assert_eq!(surface(USED, gone, Vec3::Z).coat_normal, None);
}

#[test]
fn normal_maps_point_right_and_up_in_the_picture() {
    // Texels: bent to the right, bent up.
    let texels = vec![[229, 128, 202, 255], [128, 229, 202, 255]];
    let material = Material { normal_texture: USED, ..Default::default() };
    for derived in [true, false] {
        for (scale, right) in [(DVec3::ONE, Vec3::X), (DVec3::new(-1.0, 1.0, 1.0), -Vec3::X)] {
            let mut mesh = square();
            if !derived {
                mesh.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4];
            }
            let mut scene = scene_of(mesh, material.clone(), scale);
            scene.textures.push(texture(Pixels::Linear8(texels.clone())));
            for side in [1.0, -1.0] {
                let wo = Vec3::Z * side;
                let bent = seen(&scene, Vec2::new(0.05, 0.05), wo).frame.normal * side;
                assert!(bent.dot(right) > 0.7 && bent.y.abs() < 0.01, "{bent} {scale} {derived}");
                let bent = seen(&scene, Vec2::new(0.9, 0.05), wo).frame.normal * side;
                assert!(bent.y > 0.7 && bent.x.abs() < 0.01, "{bent} {scale} {derived}");
            }
        }
    }
    // A picture mirrored on the surface bends to the picture's right, the square's left.
    let mut mesh = square();
    mesh.uv_sets[0].iter_mut().for_each(|uv| uv.x = 1.0 - uv.x);
    let mut scene = scene_of(mesh, material, DVec3::ONE);
    scene.textures.push(texture(Pixels::Linear8(vec![texels[0]; 2])));
    assert!(seen(&scene, MIDDLE, Vec3::Z).frame.normal.x < -0.7);
    scene.textures[0].pixels = Pixels::Linear8(vec![texels[1]; 2]);
    assert!(seen(&scene, MIDDLE, Vec3::Z).frame.normal.y > 0.7);
}
