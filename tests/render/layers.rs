//! Laws of layers: parts sum to the beauty to the last bit, crops are parts of the whole, and what else
//! is written is what it says.

use crate::moving::carousel;
use crate::rooms;
use crate::stage::{Set, Stage, at, direct, facing, lambert};
use candelabra::render::buffers::RenderBuffers;
use candelabra::render::exr::write_exr;
use candelabra::render::{Aov, LightStrategy, RenderDelegate, RenderError, RenderSettings, Window};
use candelabra::scene::{Camera, Channel, Interpolation, Keys, LightKind, Medium, Scene, Trs};
use clap::ValueEnum;
use exr::meta::attribute::AttributeValue;
use exr::prelude::{ReadChannels, ReadLayers, f16, read};
use glam::{DVec3, Quat, Vec3};
use std::collections::{BTreeMap, HashMap};

const FRAME: i32 = 13;

/// Every kind of light in fog, things that move, and groups by rule, by the scene and by neither.
fn everything() -> Stage {
    let mut stage = carousel();
    rooms::all_lights(&mut stage);
    let scattering = Vec3::new(0.05, 0.04, 0.03);
    let absorption = Vec3::splat(0.01);
    stage.scene.medium = Some(Medium { scattering, absorption, anisotropy: 0.2, region: None });
    for (number, name) in [(2, "sky.north"), (4, "zz"), (5, "Key")] {
        let node = stage.scene.lights[number].node;
        stage.scene.light_groups.insert(node, name.into());
    }
    stage
}

pub fn all_layers(size: u32, samples: u32) -> RenderSettings {
    RenderSettings {
        depth: 3,
        aovs: Aov::value_variants().to_vec(),
        light_groups: vec!["meshes=/mesh_*".parse().unwrap()],
        ..direct(size, samples)
    }
}

fn set_of(scene: &Scene) -> Set<'_> {
    Set::of(scene, &[FRAME])
}

/// Channels of a file by name, and its texts by attribute.
pub struct File {
    pub channels: Vec<(String, Vec<f32>)>,
    texts: HashMap<String, String>,
}

impl File {
    pub fn of(buffers: &RenderBuffers) -> File {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f.exr");
        write_exr(&path, buffers, "{}").unwrap();
        let layer = read().no_deep_data().largest_resolution_level().all_channels();
        let image = layer.first_valid_layer().all_attributes().from_file(path).unwrap().layer_data;
        let list = image.channel_data.list.into_iter();
        let text = |value| match value {
            AttributeValue::Text(text) => text.to_string(),
            _ => String::new(),
        };
        let other = image.attributes.other.into_iter();
        File {
            channels: list
                .map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()))
                .collect(),
            texts: other.map(|(name, value)| (name.to_string(), text(value))).collect(),
        }
    }

    pub fn channel(&self, name: &str) -> &[f32] {
        let found = self.channels.iter().find(|(own, _)| own == name);
        &found.unwrap_or_else(|| panic!("there is no {name}")).1
    }

    /// The layers of which `is_part` holds, added in the order of the file in 32 bits.
    fn sum(&self, channel: &str, is_part: impl Fn(&str) -> bool) -> (usize, Vec<f32>) {
        let parts = self.channels.iter().filter(|(name, _)| {
            name.rsplit_once('.').is_some_and(|(layer, own)| own == channel && is_part(layer))
        });
        let mut sum = vec![0f32; self.channels[0].1.len()];
        let count =
            parts.map(|(_, part)| sum.iter_mut().zip(part).for_each(|(s, p)| *s += p)).count();
        (count, sum)
    }
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn parts_read_back_sum_to_the_beauty_to_the_last_bit() {
    let stage = everything();
    let set = set_of(&stage.scene);
    for float_beauty in [true, false] {
        for samples in [1, 5] {
            let settings = RenderSettings { float_beauty, ..all_layers(24, samples) };
            let file = File::of(&set.render(&settings, FRAME));
            for channel in ["R", "G", "B"] {
                let stored = |value: f32| match float_beauty {
                    true => value,
                    false => f32::from(f16::from_f32(value.min(65504.0))),
                };
                let beauty = bits(file.channel(channel));
                let (groups, by_group) = file.sum(channel, |layer| layer.starts_with("RGBA_"));
                let is_path = |layer: &str| ["direct", "emission", "indirect"].contains(&layer);
                let (paths, by_path) = file.sum(channel, is_path);
                assert_eq!((groups, paths), (5, 3));
                for sum in [by_group, by_path] {
                    assert_eq!(bits(&sum.into_iter().map(stored).collect::<Vec<_>>()), beauty);
                }
            }
            for layer in ["RGBA_Key", "RGBA_default", "RGBA_meshes", "RGBA_sky_north", "RGBA_zz"] {
                assert!(file.channel(&format!("{layer}.G")).iter().any(|v| *v > 0.0), "{layer}");
            }
        }
    }
}

#[test]
fn no_layer_depends_on_what_else_is_asked_for() {
    let stage = everything();
    let set = set_of(&stage.scene);
    let all = set.render(&all_layers(12, 3), FRAME);
    for &aov in Aov::value_variants() {
        let one = set.render(&RenderSettings { aovs: vec![aov], ..all_layers(12, 3) }, FRAME);
        let names: Vec<String> = one.layers().iter().flat_map(|l| l.channel_names()).collect();
        assert!(names.len() >= 4 && (aov == Aov::Beauty) == (names.len() == 4), "{names:?}");
        for name in names {
            let plane = |buffers: &RenderBuffers| {
                bits(&buffers.channel(&name).unwrap().collect::<Vec<_>>())
            };
            assert_eq!(plane(&one), plane(&all), "{name}");
        }
    }
}

/// A floor under two points and a sky. Points and sky have the same random numbers whatever else there is.
pub fn floor(lights: [bool; 3]) -> Stage {
    let mut stage = Stage::default();
    stage.quad([8.0; 2], lambert([0.6, 0.5, 0.4]), facing(DVec3::ZERO, DVec3::Y));
    stage.quad([2.0; 2], lambert([0.2, 0.5, 0.4]), facing([0.0, 1.0, -2.0], [0.0, 1.0, 5.0]));
    let kinds = [
        LightKind::Point { intensity_cd: Vec3::new(3.0, 2.0, 1.0) },
        LightKind::Point { intensity_cd: Vec3::new(0.1, 0.2, 9.0) },
        LightKind::Dome { radiance_nits: Vec3::new(0.1, 0.2, 0.3), texture: None },
    ];
    let places = [[1.0, 1.5, 0.0], [-1.0, 0.7, 0.5], [0.0; 3]];
    for ((kind, place), name) in kinds.into_iter().zip(places).zip(["left", "right", "sky"]) {
        let node = stage.light(kind, at(place)).node;
        stage.scene.light_groups.insert(node, name.into());
    }
    let mut shines = lights.into_iter();
    stage.scene.lights.retain(|_| shines.next().unwrap());
    stage.look([0.0, 2.0, 4.0], [0.0, 0.5, 0.0], 1.0);
    stage
}

fn close(a: &[f32], b: &[f32]) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * a.abs().max(b.abs()) + 1e-9)
}

#[test]
fn a_group_is_the_picture_of_its_lights_alone() {
    let settings = RenderSettings { strategy: LightStrategy::All, ..all_layers(16, 8) };
    let settings = RenderSettings { light_groups: Vec::new(), ..settings };
    let together = floor([true; 3]).render(&settings);
    for (only, name) in ["left", "right", "sky"].into_iter().enumerate() {
        let mut lights = [false; 3];
        lights[only] = true;
        let alone = floor(lights).render(&settings);
        for channel in ["R", "G", "B"] {
            let group: Vec<f32> =
                together.channel(&format!("RGBA_{name}.{channel}")).unwrap().collect();
            let expected: Vec<f32> = alone.channel(channel).unwrap().collect();
            assert!(expected.iter().any(|value| *value > 0.0));
            assert!(close(&group, &expected), "{name}.{channel}");
        }
    }
    assert!(together.channel("RGBA_default.G").unwrap().all(|value| value == 0.0));
}

#[test]
fn light_is_told_apart_by_how_often_it_was_scattered() {
    let mut stage = everything();
    for fog in [true, false] {
        if !fog {
            stage.scene.medium = None;
        }
        let set = set_of(&stage.scene);
        let render = |depth| set.render(&RenderSettings { depth, ..all_layers(12, 4) }, FRAME);
        let (deep, once, never) = (render(3), render(1), render(0));
        let plane = |b: &RenderBuffers, name: &str| b.channel(name).unwrap().collect::<Vec<f32>>();
        assert!(close(&plane(&never, "G"), &plane(&deep, "emission.G")));
        assert!(close(&plane(&once, "direct.G"), &plane(&deep, "direct.G")));
        assert!(plane(&once, "indirect.G").iter().all(|value| *value == 0.0));
        for layer in ["direct.G", "emission.G", "indirect.G"] {
            assert!(plane(&deep, layer).iter().any(|value| *value > 0.0), "{layer}");
        }
    }
}

#[test]
fn any_tiling_by_crops_is_the_whole_picture() {
    let stage = everything();
    let set = set_of(&stage.scene);
    let settings = RenderSettings { width: 23, height: 17, ..all_layers(1, 2) };
    let whole = set.render(&settings, FRAME);
    let channels: usize = whole.layers().iter().map(|layer| layer.channels.len()).sum();
    for (columns, rows) in [(vec![0, 23], vec![0, 1, 17]), (vec![0, 7, 8, 23], vec![0, 16, 17])] {
        let mut pixels = 0;
        for (x, y) in columns.windows(2).flat_map(|x| rows.windows(2).map(move |y| (x, y))) {
            let crop = Window { x0: x[0], y0: y[0], x1: x[1], y1: y[1] };
            let part = set.render(&RenderSettings { crop: Some(crop), ..settings.clone() }, FRAME);
            assert_eq!((part.window(), part.size()), (crop, [23, 17]));
            // These two are pooled with what is around a pixel.
            let is_pooled = |name: &String| name.starts_with("variance") || name == "error";
            let names = whole.layers().iter().flat_map(|layer| layer.channel_names());
            let exact = (0..channels).zip(names).filter(|(_, name)| !is_pooled(name));
            for (channel, y) in exact.flat_map(|(c, _)| (crop.y0..crop.y1).map(move |y| (c, y))) {
                let own = part.row(channel, (y - crop.y0) as usize);
                let of_whole = &whole.row(channel, y as usize)[crop.x0 as usize..crop.x1 as usize];
                assert_eq!(bits(own), bits(of_whole), "channel {channel}, row {y}, {crop:?}");
            }
            pixels += crop.width() * crop.height();
        }
        assert_eq!(pixels, 23 * 17);
    }
    let crop = Some(Window { x0: 0, y0: 0, x1: 24, y1: 17 });
    let camera = stage.scene.cameras[0].clone();
    let settings = RenderSettings { crop, ..settings };
    assert!(settings.check(&stage.scene, &set.emitters).is_err());
    let delegate = RenderDelegate::new(&stage.scene, &set.emitters, camera, settings);
    assert!(matches!(delegate.render(&set.tree, FRAME, &()), Err(RenderError::Plan(_))));
}

fn linear<T>(values: [T; 2]) -> Keys<T> {
    Keys { times_s: vec![0.0, 1.0], values: values.into(), interpolation: Interpolation::Linear }
}

/// 24 frames from second 0, which is frame 1, to second 1.
#[test]
fn motion_is_where_things_were_and_will_be() {
    let mut stage = Stage::default();
    let quad = stage.quad([1.0, 4.0], lambert([0.5; 3]), at([-1.5, 0.0, 0.0])).node;
    stage.quad([1.0, 4.0], lambert([0.5; 3]), at([1.0, 0.0, 0.0]));
    let path = [Vec3::new(-1.5, -1.2, 0.0), Vec3::new(-1.5, 1.2, 0.0)];
    stage.scene.nodes[quad as usize].channels = vec![Channel::Translation(linear(path))];
    let camera = stage.look([0.0, 0.0, 5.0], DVec3::ZERO, 1.0);
    *camera = Camera::orthographic(camera.node, 4.0);
    let settings = RenderSettings { aovs: vec![Aov::Motion], ..direct(32, 4) };
    let set = Set::of(&stage.scene, &[1, FRAME, 25]);
    let at_frame = |frame| {
        let buffers = set.render(&settings, frame);
        ["forward.u", "forward.v", "backward.u", "backward.v"]
            .map(|name| buffers.channel(name).unwrap().collect::<Vec<f32>>())
    };
    // Eight pixels a metre, a tenth of a metre a frame.
    let (moving, still, nothing) = (16 * 32 + 4, 16 * 32 + 24, 16 * 32 + 14);
    let middle = at_frame(FRAME);
    assert!((middle[1][moving] - 0.8).abs() < 1e-3 && (middle[3][moving] + 0.8).abs() < 1e-3);
    assert!(middle[0][moving].abs() < 1e-4 && middle[2][moving].abs() < 1e-4);
    for pixel in [still, nothing] {
        assert!(middle.iter().all(|plane| plane[pixel] == 0.0));
    }
    let (first, last) = (at_frame(1), at_frame(25));
    assert!(first[3][moving] == 0.0 && (first[1][moving] - 0.8).abs() < 1e-3);
    assert!(last[1][moving] == 0.0 && (last[3][moving] + 0.8).abs() < 1e-3);
}

#[test]
fn a_camera_that_turns_moves_the_sky() {
    let mut stage = Stage::default();
    let radiance_nits = Vec3::ONE;
    stage.light(LightKind::Dome { radiance_nits, texture: None }, at(DVec3::ZERO));
    let node = stage.look(DVec3::ZERO, DVec3::NEG_Z, 1.0).node;
    // To the left by 0.01 a frame, so that everything moves to the right.
    let turns = [Quat::IDENTITY, Quat::from_rotation_y(0.24)];
    stage.scene.nodes[node as usize].channels = vec![Channel::Rotation(linear(turns))];
    let settings = RenderSettings { aovs: vec![Aov::Motion], ..direct(33, 1) };
    let buffers = Set::of(&stage.scene, &[1]).render(&settings, 1);
    let u: Vec<f32> = buffers.channel("forward.u").unwrap().collect();
    let focal = 33.0 / (2.0 * 0.5f32.tan());
    assert!((u[16 * 33 + 16] / (focal * 0.01f32.tan()) - 1.0).abs() < 1e-2, "{}", u[16 * 33 + 16]);
    assert!(buffers.channel("backward.u").unwrap().all(|u| u == 0.0), "nothing was before");
}

#[test]
fn mattes_cover_what_the_picture_covers_and_name_it() {
    let stage = everything();
    let settings = RenderSettings { aovs: vec![Aov::Cryptomatte], ..direct(24, 8) };
    let file = File::of(&set_of(&stage.scene).render(&settings, FRAME));
    let texts: BTreeMap<&str, &str> = file
        .texts
        .iter()
        .filter_map(|(name, text)| {
            Some((name.strip_prefix("cryptomatte/")?.get(8..)?, text.as_str()))
        })
        .collect();
    assert_eq!((texts["name"], texts["hash"]), ("CryptoObject", "MurmurHash3_32"));
    assert_eq!(texts["conversion"], "uint32_to_float32");
    let manifest: HashMap<String, String> = serde_json::from_str(texts["manifest"]).unwrap();
    let names: HashMap<u32, &String> =
        manifest.iter().map(|(name, id)| (u32::from_str_radix(id, 16).unwrap(), name)).collect();
    let known = |path: &str| {
        stage.scene.instances.iter().any(|i| &*i.path == path) || path.starts_with("/node_")
    };
    assert!(names.len() > 3 && names.values().all(|name| known(name)), "{names:?}");
    let mut seen = BTreeMap::new();
    let alpha = file.channel("A");
    for (pixel, alpha) in alpha.iter().enumerate() {
        let (mut sum, mut before) = (0.0, 1.0);
        for (level, (id, coverage)) in
            (0..3).flat_map(|level| [("R", "G"), ("B", "A")].map(|pair| (level, pair)))
        {
            let value = |c: &str| file.channel(&format!("CryptoObject0{level}.{c}"))[pixel];
            let (id, coverage) = (value(id), value(coverage));
            assert!(coverage <= before, "ranks descend");
            assert_eq!(coverage > 0.0, names.contains_key(&id.to_bits()), "{id} in pixel {pixel}");
            *seen.entry(id.to_bits()).or_insert(0.0) += coverage;
            (sum, before) = (sum + coverage, coverage);
        }
        assert!((sum - alpha).abs() < 1e-6, "{sum} of {alpha}");
    }
    assert_eq!(seen.len() - usize::from(seen.contains_key(&0)), names.len(), "no name too many");
}

#[test]
fn guides_of_denoisers_are_in_their_ranges() {
    let stage = everything();
    let buffers = set_of(&stage.scene).render(&all_layers(24, 4), FRAME);
    let vectors = |layer: &str, axes: [&str; 3]| {
        let [x, y, z] = axes
            .map(|axis| buffers.channel(&format!("{layer}.{axis}")).unwrap().collect::<Vec<f32>>());
        (0..x.len()).map(|i| Vec3::new(x[i], y[i], z[i])).collect::<Vec<_>>()
    };
    let (albedo, normal) = (vectors("albedo", ["R", "G", "B"]), vectors("N", ["X", "Y", "Z"]));
    let alpha: Vec<f32> = buffers.channel("A").unwrap().collect();
    for i in 0..alpha.len() {
        assert!(albedo[i].cmpge(Vec3::ZERO).all() && albedo[i].cmple(Vec3::ONE).all());
        assert!(normal[i].length() < 1.0 + 1e-6);
        assert!(alpha[i] > 0.0 || (albedo[i], normal[i]) == (Vec3::ZERO, Vec3::ZERO));
    }
}

#[test]
fn positions_are_in_the_world_of_the_file() {
    let mut stage = floor([true; 3]);
    let origin = DVec3::new(4096.0, -8192.0, 64.0);
    stage.scene.origin = origin;
    for node in &mut stage.scene.nodes {
        if let Trs::Parts { translation, .. } = &mut node.local {
            *translation += origin;
        }
    }
    let settings = RenderSettings { aovs: vec![Aov::Position], ..direct(9, 16) };
    let buffers = stage.render(&settings);
    let [x, y, alpha] =
        ["P.X", "P.Y", "A"].map(|n| buffers.channel(n).unwrap().collect::<Vec<f32>>());
    let middle = 4 * 9 + 4;
    assert!(alpha[middle] == 1.0 && (x[middle] - 4096.0).abs() < 0.05, "{}", x[middle]);
    assert!((y[8 * 9 + 4] + 8192.0).abs() < 1e-3, "the floor is at {}", y[8 * 9 + 4]);
}

#[test]
fn a_rule_goes_before_the_scene_and_the_first_before_the_second() {
    let stage = floor([true; 3]);
    let set = stage.set();
    let of = |rules: &[&str]| {
        let light_groups = rules.iter().map(|rule| rule.parse().unwrap()).collect();
        let settings = RenderSettings { light_groups, ..all_layers(4, 1) };
        settings.check(&stage.scene, &set.emitters)?;
        let buffers = set.render(&settings, 1);
        let groups = buffers.layers().iter().filter(|layer| layer.aov == Aov::LightGroups);
        Ok::<_, candelabra::render::PlanError>(
            groups.map(|layer| layer.name.clone()).collect::<Vec<_>>(),
        )
    };
    let lights: Vec<&str> = (0..3).map(|row| stage.scene.light_path(row)).collect();
    let (first, all) = (format!("a={}", lights[0]), "b=/node_*".to_string());
    assert_eq!(of(&[]).unwrap(), ["RGBA_default", "RGBA_left", "RGBA_right", "RGBA_sky"]);
    assert_eq!(of(&[&first]).unwrap(), ["RGBA_a", "RGBA_default", "RGBA_right", "RGBA_sky"]);
    assert_eq!(of(&[&first, &all]).unwrap(), ["RGBA_a", "RGBA_b", "RGBA_default"]);
    assert_eq!(of(&[&all, &first]).unwrap(), ["RGBA_b", "RGBA_default"]);
    let error = of(&["key=/nothing/*"]).unwrap_err().to_string();
    for word in ["/nothing/*", "'key'", "candelabra inspect"] {
        assert!(error.contains(word), "{error}");
    }
}
