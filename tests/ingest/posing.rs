//! Skins and morph targets: meshes in the shape of the first frame. What changes later is in `deforming`.

use crate::files::{File, lamp};
use candelabra::scene::{Mesh, Scene};
use glam::{Mat4, Quat, Vec3, Vec4};
use serde_json::{Value, json};
use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

/// A joint that moves a vertex, and by how much.
pub type Influence = (u16, f32);

/// Adds a skin and binds the vertices of the mesh to it, by sets of four influences each.
pub fn bind(
    file: &mut File,
    joints: &[usize],
    inverse_bind: Option<&[Mat4]>,
    sets: &[Vec<[Influence; 4]>],
) {
    for (set, vertices) in sets.iter().enumerate() {
        let numbers = vertices.iter().flatten().flat_map(|(joint, _)| joint.to_le_bytes());
        let numbers: Vec<u8> = numbers.collect();
        let numbers = file.array(&numbers, 5123, vertices.len(), "VEC4");
        let weights: Vec<f32> = vertices.iter().flatten().map(|(_, weight)| *weight).collect();
        let weights = file.floats(&weights, "VEC4");
        file.attribute(&format!("JOINTS_{set}"), numbers);
        file.attribute(&format!("WEIGHTS_{set}"), weights);
    }
    let mut skin = json!({"joints": joints});
    if let Some(matrices) = inverse_bind {
        let floats: Vec<f32> = matrices.iter().flat_map(Mat4::to_cols_array).collect();
        let bytes: Vec<u8> = floats.iter().flat_map(|value| value.to_le_bytes()).collect();
        skin["inverseBindMatrices"] = json!(file.array(&bytes, 5126, matrices.len(), "MAT4"));
    }
    let skin = file.add("skins", skin);
    file.json["nodes"][0]["skin"] = json!(skin);
}

/// Adds a morph target and returns its number.
pub fn target(file: &mut File, arrays: &[(&str, &[f32])]) -> usize {
    let mut row = json!({});
    for (name, values) in arrays {
        row[name] = json!(file.floats(values, "VEC3"));
    }
    let targets = &mut file.json["meshes"][0]["primitives"][0]["targets"];
    let mut rows = targets.as_array().cloned().unwrap_or_default();
    rows.push(row);
    *targets = rows.into();
    targets.as_array().unwrap().len() - 1
}

pub fn animate(file: &mut File, node: usize, path: &str, times: &[f32], values: &[f32], how: &str) {
    let input = file.times(times);
    let shape = match path {
        "weights" => "SCALAR",
        "rotation" => "VEC4",
        _ => "VEC3",
    };
    let output = file.floats(values, shape);
    file.add(
        "animations",
        json!({
            "samplers": [{"input": input, "output": output, "interpolation": how}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": path}}],
        }),
    );
}

pub fn all(influence: Influence) -> [Influence; 4] {
    [influence, (0, 0.0), (0, 0.0), (0, 0.0)]
}

pub fn load(file: &File) -> Scene {
    file.load().unwrap_or_else(|error| panic!("{error}"))
}

/// Where the vertices of an instance are at a time.
pub fn places(scene: &Scene, instance: usize, time_s: f64) -> Vec<Vec3> {
    let instance = &scene.instances[instance];
    let pose = scene.pose_at(time_s);
    let world = pose.world(instance.node);
    let positions = pose.positions(scene, instance.mesh);
    let in_world =
        |&place: &Vec3| (scene.origin + world.transform_point3(place).as_dvec3()).as_vec3();
    positions.iter().map(in_world).collect()
}

pub fn assert_near(found: &[Vec3], expected: &[Vec3]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        let tolerance = 1e-5 * (1.0 + expected.length());
        assert!(found.distance(*expected) <= tolerance, "{found} is not {expected}");
    }
}

/// What a mesh is, to the last bit.
fn bits(mesh: &Mesh) -> Value {
    let Mesh { positions, normals, tangents, uv_sets, triangles, .. } = mesh;
    let all = |vectors: &[Vec3]| -> Vec<[u32; 3]> {
        vectors.iter().map(|vector| vector.to_array().map(f32::to_bits)).collect()
    };
    let tangents: Vec<_> = tangents.iter().map(|t| t.to_array().map(f32::to_bits)).collect();
    let uv: Vec<_> = uv_sets.iter().flatten().map(|uv| uv.to_array().map(f32::to_bits)).collect();
    json!([all(positions), all(normals), tangents, uv, triangles])
}

/// The lamp with normals, tangents and what they are for.
pub fn shaded() -> File {
    let mut file = lamp();
    let normals: Vec<f32> = (0..3).flat_map(|i| [0.3 * i as f32, 0.1, 1.7]).collect();
    let tangents: Vec<f32> = (0..3).flat_map(|i| [1.3, 0.2 * i as f32, -0.4, -1.0]).collect();
    for (name, values, shape) in [
        ("NORMAL", &normals[..], "VEC3"),
        ("TANGENT", &tangents[..], "VEC4"),
        ("TEXCOORD_0", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0][..], "VEC2"),
    ] {
        let accessor = file.floats(values, shape);
        file.attribute(name, accessor);
    }
    let picture = file.view(&crate::files::png(2, 2, [128, 128, 255, 255]));
    file.add("images", json!({"bufferView": picture, "mimeType": "image/png"}));
    file.add("textures", json!({"source": 0}));
    file.json["materials"][0]["normalTexture"] = json!({"index": 0});
    file
}

/// A bar from 0 to 2 along x; its right half hangs on a joint at 1 that is bent to the left by 90 degrees.
pub fn bar() -> File {
    let mut file = lamp();
    let rows = (0..6).flat_map(|i| [(i % 3) as f32, (i / 3) as f32 * 0.25, 0.0]);
    let positions = file.floats(&rows.collect::<Vec<f32>>(), "VEC3");
    let normals = file.floats(&[0.0, 1.0, 0.0].repeat(6), "VEC3");
    file.attribute("POSITION", positions);
    file.attribute("NORMAL", normals);
    let corners = [0u16, 1, 3, 1, 4, 3, 1, 2, 4, 2, 5, 4];
    let bytes: Vec<u8> = corners.iter().flat_map(|corner| corner.to_le_bytes()).collect();
    let indices = file.array(&bytes, 5123, corners.len(), "SCALAR");
    file.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    // What moves the node of a skinned mesh has no meaning.
    file.json["nodes"][0]["translation"] = json!([7, 8, 9]);
    let half = FRAC_PI_2 / 2.0;
    let rotation = [0.0, 0.0, half.sin(), half.cos()];
    file.add("nodes", json!({"name": "elbow", "translation": [1, 0, 0], "rotation": rotation}));
    file.add("nodes", json!({"name": "shoulder", "children": [1]}));
    file.json["scenes"][0]["nodes"] = json!([0, 2]);
    let sets = (0..6).map(|i| match i % 3 {
        0 => all((0, 1.0)),
        // Twice as much as it should be.
        1 => [(0, 1.0), (1, 1.0), (0, 0.0), (1, 0.0)],
        _ => all((1, 0.5)),
    });
    let inverse_bind = [Mat4::IDENTITY, Mat4::from_translation(Vec3::NEG_X)];
    bind(&mut file, &[2, 1], Some(&inverse_bind), &[sets.collect()]);
    file
}

#[test]
fn a_bar_bends_at_its_joint() {
    let scene = load(&bar());
    assert_eq!(scene.notes, []);
    assert_eq!(&*scene.instances[0].path, "/lamp");
    // Between the joints a vertex is half way between what they make of it.
    let expected = [
        Vec3::ZERO,
        Vec3::X,
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(0.0, 0.25, 0.0),
        Vec3::new(0.5 * (1.0 + 0.75), 0.125, 0.0),
        Vec3::new(0.75, 1.0, 0.0),
    ];
    assert_near(&places(&scene, 0, 0.0), &expected);
    let diagonal = Vec3::new(-FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
    let turned = [Vec3::Y, diagonal, Vec3::NEG_X];
    assert_near(&scene.meshes[0].normals, &[turned, turned].concat());
}

#[test]
fn a_mesh_is_morphed_to_a_known_shape() {
    let mut file = shaded();
    target(&mut file, &[("POSITION", &[0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])]);
    let normals: Vec<f32> = (0..3).flat_map(|i| [1.0 - 0.3 * i as f32, -0.1, -1.7]).collect();
    target(
        &mut file,
        &[
            ("POSITION", &[1.0, 0.0, 0.0].repeat(3)),
            ("NORMAL", &normals),
            ("TANGENT", &[-1.3, 1.0, 0.4, -1.3, 0.8, 0.4, -1.3, 0.6, 0.4]),
        ],
    );
    let rest = load(&file);
    file.json["meshes"][0]["weights"] = json!([0.5, 1.0]);
    let scene = load(&file);
    assert_eq!(scene.notes, []);
    let shape = [Vec3::new(1.0, 0.0, 2.0), Vec3::X * 2.0, Vec3::new(1.0, 1.0, 0.0)];
    assert_near(&scene.meshes[0].positions, &shape);
    assert_near(&scene.meshes[0].normals, &[Vec3::X; 3]);
    let tangents = &scene.meshes[0].tangents;
    assert!(tangents.iter().all(|t| t.distance(Vec4::new(0.0, 1.0, 0.0, -1.0)) < 1e-6));
    // Sparse displacements, of one vertex of three.
    let mut sparse = file.json["accessors"][0].clone();
    sparse.as_object_mut().unwrap().remove("bufferView");
    let values = file.view(&[0.0f32, 0.0, 4.0].map(f32::to_le_bytes).concat());
    let indices = file.view(&[0u8]);
    sparse["sparse"] = json!({
        "count": 1,
        "indices": {"bufferView": indices, "componentType": 5121},
        "values": {"bufferView": values},
    });
    let sparse = file.add("accessors", sparse);
    file.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = json!(sparse);
    assert_eq!(bits(&load(&file).meshes[0]), bits(&scene.meshes[0]));
    // The node overrules the mesh, and the animation the node.
    file.json["nodes"][0]["weights"] = json!([0, 0]);
    assert_eq!(bits(&load(&file).meshes[0]), bits(&rest.meshes[0]));
    animate(&mut file, 0, "weights", &[0.0, 2.0], &[0.5, 1.0, 0.5, 1.0], "LINEAR");
    let held = load(&file);
    assert_eq!(bits(&held.meshes[0]), bits(&scene.meshes[0]));
    assert_eq!(held.notes, []);
}

#[test]
fn weights_are_those_of_the_first_frame() {
    // Four targets, each along a way of its own; second 0 is half way between the keys.
    for (how, values, expected) in [
        ("LINEAR", [[0.0, 1.0, 2.0, 3.0], [2.0, 1.0, 0.0, 5.0]].concat(), [1.0, 1.0, 1.0, 4.0]),
        ("STEP", [[0.0, 1.0, 2.0, 3.0], [2.0, 1.0, 0.0, 5.0]].concat(), [0.0, 1.0, 2.0, 3.0]),
        // A tangent of 4 in each second, which a spline follows for an eighth of two seconds.
        (
            "CUBICSPLINE",
            [[0.0; 4], [1.0; 4], [4.0, 0.0, 0.0, -4.0], [0.0; 4], [1.0; 4], [0.0; 4]].concat(),
            [2.0, 1.0, 1.0, 0.0],
        ),
    ] {
        let mut file = lamp();
        for axis in 0..4 {
            let mut way = [0.0; 3];
            way[axis % 3] = if axis == 3 { 100.0 } else { 1.0 };
            target(&mut file, &[("POSITION", &way.repeat(3))]);
        }
        animate(&mut file, 0, "weights", &[-1.0, 1.0], &values, how);
        let scene = load(&file);
        let [x, y, z, far] = expected;
        assert_near(&scene.meshes[0].positions[..1], &[Vec3::new(x + 100.0 * far, y, z)]);
        assert_eq!(scene.notes, []);
    }
}

/// An identity is told in two ways: by matrices that are one, and by some that cancel.
#[test]
fn an_identity_is_the_mesh_without_a_skin() {
    let rest = load(&shaded());
    let weights = vec![[(0, 0.3), (1, 0.45), (0, 0.25), (1, 0.0)]; 3];
    for (joint, inverse_bind) in [
        (json!({"name": "joint"}), None),
        (
            json!({"name": "joint", "translation": [4, -2, 0.5], "scale": [2, 2, 2]}),
            Some(
                [Mat4::from_scale_rotation_translation(
                    Vec3::splat(0.5),
                    Quat::IDENTITY,
                    Vec3::new(-2.0, 1.0, -0.25),
                ); 2],
            ),
        ),
    ] {
        let mut file = shaded();
        let joints = [0, 1].map(|_| file.add("nodes", joint.clone()));
        file.json["scenes"][0]["nodes"] = json!([0, joints[0], joints[1]]);
        bind(
            &mut file,
            &joints,
            inverse_bind.as_ref().map(|m| &m[..]),
            std::slice::from_ref(&weights),
        );
        let scene = load(&file);
        assert_eq!(bits(&scene.meshes[0]), bits(&rest.meshes[0]));
        assert_eq!(places(&scene, 0, 0.0), places(&rest, 0, 0.0));
        assert_eq!((scene.notes.len(), &scene.instances[0].path), (0, &rest.instances[0].path));
    }
}

/// A mesh whose joint mirrors it shows the same side, lit from the same side.
#[test]
fn a_mirrored_mesh_keeps_its_front() {
    let mut file = shaded();
    let joint = file.add("nodes", json!({"name": "mirror", "scale": [1, 1, -2]}));
    file.json["scenes"][0]["nodes"] = json!([0, joint]);
    let matrix = Mat4::from_scale(Vec3::new(1.0, 1.0, -0.5));
    bind(&mut file, &[joint], Some(&[matrix]), &[vec![all((0, 1.0)); 3]]);
    let scene = load(&file);
    let mesh = &scene.meshes[0];
    let [a, b, c] = mesh.triangles[0].map(|corner| mesh.positions[corner as usize]);
    let front = (b - a).cross(c - a);
    assert!(front.z < 0.0, "the node that mirrors turns it over once more");
    assert!(mesh.normals.iter().all(|normal| normal.dot(front) > 0.0), "{:?}", mesh.normals);
    assert!(mesh.tangents.iter().all(|tangent| tangent.w == 1.0), "{:?}", mesh.tangents);
}

#[test]
fn meshes_that_are_posed_alike_are_one() {
    let meshes = |weights: [Value; 3]| {
        let mut file = lamp();
        target(&mut file, &[("POSITION", &[1.0; 9])]);
        for (i, weights) in weights.into_iter().enumerate() {
            let node = if i == 0 { 0 } else { file.add("nodes", json!({"mesh": 0})) };
            file.json["nodes"][node]["weights"] = weights;
        }
        file.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
        load(&file).meshes.len()
    };
    assert_eq!(meshes([json!([1]), json!([1]), json!([1])]), 1);
    assert_eq!(meshes([json!([1]), json!([0.5]), json!([0.5])]), 2);
    assert_eq!(meshes([json!([1]), json!([0]), json!(null)]), 2);
    let mut file = bar();
    file.add("nodes", json!({"mesh": 0, "skin": 0, "translation": [1, 1, 1]}));
    file.json["scenes"][0]["nodes"] = json!([0, 2, 3]);
    let scene = load(&file);
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 2));
    assert_eq!(places(&scene, 0, 0.0), places(&scene, 1, 0.0));
    file.add("skins", json!({"joints": [1, 2]}));
    file.json["nodes"][3]["skin"] = json!(1);
    let scene = load(&file);
    assert_eq!(scene.meshes.len(), 2);
    assert_ne!(places(&scene, 0, 0.0), places(&scene, 1, 0.0));
}

/// A skinned mesh light is what it was, wherever it hangs.
#[test]
fn a_skinned_mesh_keeps_its_name_group_and_links() {
    let mut file = bar();
    let lux = json!({"type": "MeshLight", "group": "key", "force": true, "lightLink": 1});
    file.lux(lux);
    file.json["nodes"][0]["extras"]["usdLinks"] = json!({"outside": [1]});
    let scene = load(&file);
    let lit = &scene.instances[0];
    assert_eq!((&*lit.path, lit.forced), ("/lamp", true));
    assert_eq!(scene.light_groups.get(&lit.node).map(String::as_str), Some("key"));
    assert_eq!(scene.linking.of_instance(0).light, Some(0));
    assert!(scene.material_of(lit.mesh).is_some_and(|material| material.emits()));
    let mut paths: Vec<&str> = scene.nodes.iter().map(|node| &*node.path).collect();
    paths.sort_unstable();
    assert!(paths.windows(2).all(|pair| pair[0] != pair[1]), "{paths:?}");
}

#[test]
fn a_mesh_deforms_if_its_joints_move_against_each_other() {
    let moved = |node: usize, values: &[f32]| {
        let mut file = bar();
        // Above the skeleton is what is no joint.
        file.add("nodes", json!({"name": "cart", "children": [2]}));
        file.json["scenes"][0]["nodes"] = json!([0, 3]);
        animate(&mut file, node, "translation", &[0.0, 1.0], values, "LINEAR");
        let scene = load(&file);
        assert_eq!(scene.notes, []);
        let way = places(&scene, 0, 1.0)[0] - places(&scene, 0, 0.0)[0];
        (scene.meshes[0].deformation.is_some(), way)
    };
    let (goes, stays) = ([0.0, 0.0, 0.0, 0.0, 0.0, 3.0], [1.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    assert_eq!(moved(3, &goes), (false, Vec3::Z * 3.0));
    assert_eq!(moved(2, &goes), (false, Vec3::Z * 3.0));
    assert_eq!(moved(0, &goes), (false, Vec3::ZERO));
    assert_eq!(moved(1, &stays), (false, Vec3::ZERO));
    assert_eq!(moved(1, &goes), (true, Vec3::ZERO));
}
