//! Skinned meshes on rigs that nobody would build.

use crate::files::{File, lamp};
use crate::posing::{Influence, animate, assert_near, bind, load, places};
use glam::{DAffine3, DQuat, DVec3, Mat4, Quat, Vec3, Vec4};
use proptest::prelude::*;
use serde_json::json;

/// A node of a rig: which one it is below, and how it lies there.
#[derive(Clone, Debug)]
struct Bone {
    parent: Option<usize>,
    translation: [f32; 3],
    rotation: [f32; 4],
    scale: [f32; 3],
    moves: bool,
}

#[derive(Clone, Debug)]
struct Puppet {
    bones: Vec<Bone>,
    joints: Vec<usize>,
    inverse_bind: Vec<Mat4>,
    sets: Vec<Vec<[Influence; 4]>>,
}

fn bone() -> impl Strategy<Value = (Option<prop::sample::Index>, Bone)> {
    let near = || prop::array::uniform3(-2.0f32..2.0);
    let scale = prop::array::uniform3(prop_oneof![0.5f32..2.0, -2.0f32..-0.5]);
    let turn = prop::array::uniform4(prop_oneof![0.1f32..1.0, -1.0f32..-0.1]);
    let parent = prop::option::weighted(0.8, any::<prop::sample::Index>());
    (parent, near(), turn, scale, prop::bool::weighted(0.2)).prop_map(
        |(parent, translation, turn, scale, moves)| {
            let rotation = Quat::from_array(turn).normalize().to_array();
            (parent, Bone { parent: None, translation, rotation, scale, moves })
        },
    )
}

fn puppet() -> impl Strategy<Value = Puppet> {
    let bones = prop::collection::vec(bone(), 1..7).prop_map(|bones| {
        let below = |(i, (parent, bone)): (usize, (Option<prop::sample::Index>, Bone))| Bone {
            parent: parent.filter(|_| i > 0).map(|parent| parent.index(i)),
            ..bone
        };
        bones.into_iter().enumerate().map(below).collect::<Vec<Bone>>()
    });
    bones.prop_flat_map(|bones| {
        let joints = prop::collection::vec(0..bones.len(), 1..5);
        joints.prop_flat_map(move |joints| {
            let number = prop_oneof![-1.0f32..1.0, Just(0.0)];
            let matrix = prop::collection::vec(number, 12).prop_map(|n| {
                let column = |i: usize, w: f32| Vec4::new(n[3 * i], n[3 * i + 1], n[3 * i + 2], w);
                Mat4::from_cols(column(0, 0.0), column(1, 0.0), column(2, 0.0), column(3, 1.0))
            });
            let count = joints.len();
            let influence = (0..count as u16, prop_oneof![0.01f32..1.0, Just(0.0)]);
            let vertices = prop::collection::vec(prop::array::uniform4(influence), 3);
            let matrices = prop::collection::vec(matrix, count);
            let sets = prop::collection::vec(vertices, 1..3);
            (Just(bones.clone()), Just(joints), matrices, sets).prop_map(
                |(bones, joints, inverse_bind, sets)| Puppet { bones, joints, inverse_bind, sets },
            )
        })
    })
}

impl Puppet {
    fn file(&self) -> File {
        let mut file = lamp();
        let mut roots = vec![0];
        let base = 1;
        for (i, bone) in self.bones.iter().enumerate() {
            let Bone { translation, rotation, scale, .. } = bone;
            let children: Vec<usize> = (0..self.bones.len())
                .filter(|&child| self.bones[child].parent == Some(i))
                .map(|child| base + child)
                .collect();
            let mut row = json!({"name": format!("bone{i}"), "translation": translation,
                "rotation": rotation, "scale": scale});
            if !children.is_empty() {
                row["children"] = json!(children);
            }
            file.add("nodes", row);
            if bone.parent.is_none() {
                roots.push(base + i);
            }
        }
        file.json["scenes"][0]["nodes"] = json!(roots);
        for i in (0..self.bones.len()).filter(|&i| self.bones[i].moves) {
            let [x, y, z] = self.bones[i].translation;
            let values = [x, y, z, x + 1.0, y - 2.0, z + 0.5];
            animate(&mut file, base + i, "translation", &[0.0, 1.0], &values, "LINEAR");
        }
        let joints: Vec<usize> = self.joints.iter().map(|joint| base + joint).collect();
        bind(&mut file, &joints, Some(&self.inverse_bind), &self.sets);
        file
    }

    /// From a bone to the world at second 0 or 1.
    fn global(&self, bone: usize, time_s: f64) -> DAffine3 {
        let Bone { parent, translation, rotation, scale, moves } = &self.bones[bone];
        let way = if *moves { DVec3::new(1.0, -2.0, 0.5) * time_s } else { DVec3::ZERO };
        let local = DAffine3::from_scale_rotation_translation(
            DVec3::from(scale.map(f64::from)),
            DQuat::from_array(rotation.map(f64::from)).normalize(),
            DVec3::from(translation.map(f64::from)) + way,
        );
        parent.map_or(local, |parent| self.global(parent, time_s) * local)
    }

    /// Where the joints put the vertices of the lamp, by glTF's own words.
    fn expected(&self, time_s: f64) -> Vec<Vec3> {
        let rest = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let place = |vertex: usize| {
            let influences = || self.sets.iter().flat_map(move |set| set[vertex]);
            let total: f64 = influences().map(|(_, weight)| f64::from(weight)).sum();
            let part = |(joint, weight): Influence| {
                let joint = joint as usize;
                let bind = DAffine3::from_mat4(self.inverse_bind[joint].as_dmat4());
                let matrix = self.global(self.joints[joint], time_s) * bind;
                (matrix.transform_point3(rest[vertex]), f64::from(weight))
            };
            match total > 0.0 {
                true => influences().map(part).map(|(at, w)| at * (w / total)).sum::<DVec3>(),
                // A vertex without weights follows its first joint.
                false => part(self.sets[0][vertex][0]).0,
            }
        };
        (0..3).map(|vertex| place(vertex).as_vec3()).collect()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// At the first frame a skinned mesh is where its joints put it, and later too, unless a note says that it
    /// deforms.
    #[test]
    fn a_skinned_mesh_is_where_its_joints_put_it(puppet in puppet()) {
        let scene = load(&puppet.file());
        assert_near(&places(&scene, 0, 0.0), &puppet.expected(0.0));
        let deforms = scene.notes.iter().any(|note| note.text.contains("deforms"));
        if !deforms {
            assert_near(&places(&scene, 0, 1.0), &puppet.expected(1.0));
        }
        let moves = puppet.bones.iter().any(|bone| bone.moves);
        prop_assert!(moves || !deforms);
    }
}
