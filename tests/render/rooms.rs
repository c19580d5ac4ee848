//! Small rooms that between them have every kind of light, material, side and hand.
//!
//! All are seen in the same way: from above, floor only, so that no light is in the picture and
//! its mean is reflected light alone. A wall stands behind, a card throws a shadow.

use crate::stage::{
    Stage, aimed, at, coat, facing, filter, glow, lambert, milk, picture, scaled, solid,
};
use candelabra::scene::{
    AlphaMode, Coat, IesProfile, IesTable, LightKind, Material, Node, Pixels, Pole, Shaping,
    Texture, TextureUse, Transmission, Wrap,
};
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// A scene, and how many bounces of it are looked at.
pub struct Room {
    pub name: String,
    pub stage: Stage,
    pub depth: u32,
}

const ABOVE: DVec3 = DVec3::new(0.0, 1.5, 0.0);

fn plaster() -> Material {
    lambert(Vec3::new(0.7, 0.6, 0.5))
}

/// The floor, of some material, and what stands on it.
fn furnished(floor: Material) -> Stage {
    let mut stage = Stage::default();
    stage.quad([5.0; 2], floor, facing(DVec3::ZERO, DVec3::Y));
    stage.quad([5.0, 3.0], plaster(), at(DVec3::new(0.0, 1.5, -1.5)));
    let card = DVec3::new(0.3, 0.35, 0.1);
    stage.quad([0.5, 0.4], plaster(), facing(card, card + DVec3::new(0.3, 1.0, 0.2)));
    stage.look(DVec3::new(0.0, 1.6, 2.2), DVec3::new(0.0, 0.0, -0.1), 0.7);
    stage
}

fn room(name: &str, floor: Material, lights: impl FnOnce(&mut Stage)) -> Room {
    let mut stage = furnished(floor);
    lights(&mut stage);
    Room { name: name.into(), stage, depth: 2 }
}

/// A panel of light that is one quad.
fn panel(stage: &mut Stage, side: f32, material: Material, place: DVec3, target: DVec3) {
    stage.quad([side; 2], material, facing(place, target));
}

fn sphere(radiance: Vec3, radius: f32, shaping: Option<Shaping>) -> LightKind {
    LightKind::Sphere { radiance_nits: radiance, radius, shaping }
}

const USD: Shaping = Shaping::Usd {
    cone_rad: 0.9,
    softness: 0.4,
    focus: 3.0,
    focus_tint: [0.5, 0.1, 0.0],
    profile: None,
};
const KHR: Shaping = Shaping::Khr { inner_rad: 0.3, outer_rad: 0.8 };

/// A lamp with a narrow peak, a wide skirt and a dark side.
fn photometric(stage: &mut Stage) -> Shaping {
    let (rows, planes) = (37, 25);
    let angles =
        |count: usize, most: f64| (0..count).map(move |i| most * i as f64 / (count - 1) as f64);
    let value = |theta: f64, phi: f64| {
        let side = (1.0 + phi.cos()).max(0.0);
        ((-40.0 * theta * theta).exp() * 9.0 + 0.4 * theta.cos().max(0.0) * side) as f32
    };
    let values =
        angles(planes, TAU).flat_map(|phi| angles(rows, PI).map(move |theta| value(theta, phi)));
    let table = IesTable {
        pole: Pole::Nadir,
        polar_rad: angles(rows, PI).collect(),
        around_rad: angles(planes, TAU).collect(),
        values: values.collect(),
    };
    stage.scene.profiles.push(IesProfile::new("lamp.ies".into(), table, 0.0));
    let profile = Some(stage.scene.profiles.len() as u32 - 1);
    Shaping::Usd { cone_rad: 2.0, softness: 0.2, focus: 0.0, focus_tint: [0.0; 3], profile }
}

/// Points, spheres and a panel of such lamps, some of which aim elsewhere.
fn photometric_lights(stage: &mut Stage) {
    let shaping = photometric(stage);
    spot(stage, shaping);
    spheres(stage, Some(shaping));
    for i in 0..12 {
        let turn = f64::from(i);
        let place = DVec3::new(1.3 * turn.cos(), 0.5 + 0.07 * turn, 0.9 * turn.sin());
        let target = DVec3::new(0.8 * (2.0 * turn).sin(), 0.0, 0.6 * (3.0 * turn).cos());
        let kind =
            LightKind::Spot { intensity_cd: Vec3::new(0.3, 0.2 + 0.02 * i as f32, 0.4), shaping };
        stage.light(kind, aimed(place, target));
    }
    let place = aimed(DVec3::new(0.1, 1.1, 0.3), DVec3::new(0.3, 0.0, 0.2));
    let material = Material { double_sided: true, ..glow(Vec3::new(2.0, 3.0, 4.0)) };
    stage.quad([0.4; 2], material, place).shaping = Some(shaping);
    point(stage);
}

/// Panels around the floor, some of which turn their backs to it.
fn mesh_lights(stage: &mut Stage, double_sided: bool) {
    for i in 0..6 {
        let angle = f64::from(i);
        let place = DVec3::new(1.4 * angle.cos(), 0.8 + 0.2 * angle, 1.4 * angle.sin());
        let target = place + DVec3::new(-angle.sin(), (2.0 * angle).cos(), 0.5);
        let color = Vec3::new(1.0 + i as f32, 3.0, 6.0 - i as f32);
        panel(stage, 0.3, Material { double_sided, ..glow(color) }, place, target);
    }
    stage.ball(0.15, 2, glow(Vec3::new(2.0, 4.0, 1.0)), at(DVec3::new(-0.8, 0.9, 0.6)));
}

/// A panel of four texels' squares, of which half are black, and triangles all in the black.
fn textured_light(stage: &mut Stage) {
    let checks = picture([4, 4], true, |x, y| {
        if (x / 2 + y / 2) % 2 == 0 { [0.0; 3] } else { [1.0, 0.4 * x as f32, 0.3 * y as f32] }
    });
    let used = stage.texture(checks);
    let material =
        Material { emission_texture: used, base_color: Vec3::ONE, ..glow(Vec3::splat(9.0)) };
    stage.quad([1.2, 0.8], material.clone(), facing(ABOVE, DVec3::ZERO));
    // Every facet of this ball takes one texel or a few of them.
    let place = at(DVec3::new(-0.9, 0.7, 0.3));
    stage.ball(0.25, 3, material, place);
    let mesh = stage.scene.meshes.last_mut().unwrap();
    let uvs = mesh.positions.iter().map(|p| 2.0 * p.truncate() + 0.5).collect();
    mesh.uv_sets = vec![uvs];
}

fn point(stage: &mut Stage) {
    let intensity_cd = Vec3::new(2.0, 1.5, 1.0);
    stage.light(LightKind::Point { intensity_cd }, at(DVec3::new(-0.4, 0.9, 0.5)));
}

fn points_with_ranges(stage: &mut Stage) {
    for (x, range) in [(-0.5, 0.9), (0.5, 1.6)] {
        let kind = LightKind::Point { intensity_cd: Vec3::new(1.0, 2.0, 1.0) };
        stage.light(kind, at(DVec3::new(x, 0.6, 0.3))).range_m = Some(range);
    }
}

fn spot(stage: &mut Stage, shaping: Shaping) {
    for x in [-0.6, 0.7] {
        let kind = LightKind::Spot { intensity_cd: Vec3::new(5.0, 4.0, 3.0), shaping };
        stage.light(kind, aimed(DVec3::new(x, 1.2, 0.4), DVec3::new(0.3 * x, 0.0, 0.0)));
    }
    // One that aims away from everything.
    let kind = LightKind::Spot { intensity_cd: Vec3::splat(50.0), shaping };
    stage.light(kind, aimed(ABOVE, 2.0 * ABOVE));
}

fn spheres(stage: &mut Stage, shaping: Option<Shaping>) {
    let kind = sphere(Vec3::new(20.0, 15.0, 10.0), 0.1, shaping);
    stage.light(kind, aimed(DVec3::new(0.6, 0.8, 0.4), DVec3::ZERO));
    let kind = sphere(Vec3::new(1.0, 2.0, 4.0), 0.4, shaping);
    stage.light(kind, aimed(DVec3::new(-1.3, 0.9, -0.2), DVec3::ZERO));
}

fn sun(stage: &mut Stage, angle_rad: f32) {
    let kind = LightKind::Distant { irradiance_lux: Vec3::new(3.0, 2.5, 2.0), angle_rad };
    stage.light(kind, aimed(DVec3::ZERO, DVec3::new(-0.5, -1.0, -0.4)));
    // One below the floor.
    let kind = LightKind::Distant { irradiance_lux: Vec3::splat(9.0), angle_rad };
    stage.light(kind, aimed(DVec3::ZERO, DVec3::Y));
}

fn dome(stage: &mut Stage) {
    let radiance_nits = Vec3::new(0.6, 0.8, 1.0);
    stage.light(LightKind::Dome { radiance_nits, texture: None }, at(DVec3::ZERO));
}

fn textured_dome(stage: &mut Stage) {
    // A bright spot, a gradient, and black below.
    let sky = picture([16, 8], true, |x, y| match (x, y) {
        (4..6, 2) => [40.0, 30.0, 20.0],
        (_, 0..4) => [0.2, 0.3, 0.1 * x as f32],
        _ => [0.0; 3],
    });
    let texture = stage.texture(sky).map(|used| used.texture);
    let kind = LightKind::Dome { radiance_nits: Vec3::ONE, texture };
    stage.light(kind, facing(DVec3::ZERO, DVec3::new(1.0, 0.2, 0.5)));
}

pub fn of_every_light() -> Vec<Room> {
    let on_plaster = |name: &str, lights: &dyn Fn(&mut Stage)| room(name, plaster(), lights);
    vec![
        on_plaster("mesh lights", &|stage| mesh_lights(stage, false)),
        on_plaster("double-sided mesh lights", &|stage| mesh_lights(stage, true)),
        on_plaster("textured mesh lights", &textured_light),
        on_plaster("shaped mesh lights", &|stage| {
            for (x, shaping) in [(-0.6, USD), (0.6, KHR)] {
                let place = aimed(DVec3::new(x, 1.2, 0.3), DVec3::new(0.0, 0.0, 0.2));
                let material = Material { double_sided: true, ..glow(Vec3::new(9.0, 8.0, 7.0)) };
                stage.quad([0.5; 2], material, place).shaping = Some(shaping);
            }
        }),
        on_plaster("spheres", &|stage| spheres(stage, None)),
        on_plaster("spheres with USD's shaping", &|stage| spheres(stage, Some(USD))),
        on_plaster("spheres with glTF's shaping", &|stage| spheres(stage, Some(KHR))),
        on_plaster("a point", &point),
        on_plaster("points with ranges", &points_with_ranges),
        on_plaster("glTF's spots", &|stage| spot(stage, KHR)),
        on_plaster("USD's spots", &|stage| spot(stage, USD)),
        on_plaster("photometric lights", &photometric_lights),
        on_plaster("spots with hard edges", &|stage| {
            spot(stage, Shaping::Khr { inner_rad: 0.39, outer_rad: 0.4 });
            let hard = Shaping::Usd {
                cone_rad: 0.5,
                softness: 0.0,
                focus: 0.0,
                focus_tint: [0.0; 3],
                profile: None,
            };
            spheres(stage, Some(hard));
        }),
        on_plaster("suns without size", &|stage| sun(stage, 0.0)),
        on_plaster("suns of some size", &|stage| sun(stage, 0.3)),
        on_plaster("a constant dome", &dome),
        on_plaster("a textured dome", &textured_dome),
        on_plaster("all lights together", &all_lights),
    ]
}

/// One plain room, lit by a few lights.
pub fn lambert_room() -> Stage {
    room("Lambert", plaster(), some_lights).stage
}

pub fn all_lights(stage: &mut Stage) {
    mesh_lights(stage, false);
    textured_light(stage);
    spheres(stage, Some(USD));
    point(stage);
    points_with_ranges(stage);
    spot(stage, KHR);
    sun(stage, 0.3);
    dome(stage);
    textured_dome(stage);
}

/// One light of each way of being found: a triangle near and far, a sphere, a point, a dome.
fn some_lights(stage: &mut Stage) {
    panel(stage, 0.6, glow(Vec3::new(6.0, 5.0, 4.0)), DVec3::new(-0.9, 1.0, 0.4), DVec3::ZERO);
    stage.light(sphere(Vec3::splat(12.0), 0.15, None), at(DVec3::new(0.9, 0.7, -0.3)));
    stage.light(LightKind::Point { intensity_cd: Vec3::ONE }, at(DVec3::new(0.0, 1.2, 0.8)));
    let radiance_nits = Vec3::new(0.2, 0.3, 0.4);
    stage.light(LightKind::Dome { radiance_nits, texture: None }, at(DVec3::ZERO));
}

/// Bumps in the manner of a quilt.
fn bumps(stage: &mut Stage) -> Option<TextureUse> {
    let texel = |i: usize| {
        let (x, y) = ((i % 8) as f32, (i / 8) as f32);
        let normal = Vec3::new(0.8 * (x * 0.8).sin(), 0.8 * (y * 0.8).cos(), 1.0).normalize();
        let [r, g, b] = (normal * 127.5 + 127.5).to_array().map(|code| code.round() as u8);
        [r, g, b, 255]
    };
    stage.texture(Texture {
        name: "bumps".into(),
        width: 8,
        height: 8,
        pixels: Pixels::Linear8((0..64).map(texel).collect()),
        wrap: [Wrap::Repeat; 2],
        bilinear: true,
    })
}

/// A picture with holes: alpha goes from nothing to all.
fn holes(stage: &mut Stage) -> Option<TextureUse> {
    let texel = |i: usize| [200, 150, 100, (i % 8 * 36) as u8];
    stage.texture(Texture {
        name: "holes".into(),
        width: 8,
        height: 8,
        pixels: Pixels::Srgb8((0..64).map(texel).collect()),
        wrap: [Wrap::Repeat; 2],
        bilinear: true,
    })
}

/// Cut-outs above the floor, one of which shines, and cut-out ground.
fn cut_outs(stage: &mut Stage, alpha_mode: AlphaMode) {
    some_lights(stage);
    let base_color_texture = holes(stage);
    let cut = Material { base_color_texture, alpha_mode, ..plaster() };
    stage.quad([2.0; 2], cut.clone(), facing(DVec3::Y * 0.5, DVec3::Y));
    let shining = Material { double_sided: true, emission_nits: Vec3::splat(4.0), ..cut };
    let place = DVec3::new(-0.5, 0.8, -0.4);
    stage.quad([0.6; 2], shining, facing(place, DVec3::ZERO));
}

/// Panes that lie above the floor and stand before the eye; one shines, one is a cut-out. What they mirror is rough,
/// or picking alone could not find it.
fn panes(stage: &mut Stage) {
    some_lights(stage);
    let tinted = Material { coat: coat(1.0, 0.4), ..filter(Vec3::new(0.9, 0.6, 0.8)) };
    stage.quad([2.0, 1.0], tinted.clone(), facing(DVec3::Y * 0.55, DVec3::new(0.2, 2.0, 0.1)));
    let transmission = Some(Transmission { factor: 0.7, factor_texture: None, volume: None });
    let front = Material { transmission, ..tinted };
    stage.quad([2.0; 2], front, facing(DVec3::new(0.0, 1.1, 1.4), DVec3::ZERO));
    let shining = Material { emission_nits: Vec3::new(1.0, 2.0, 3.0), ..filter(Vec3::splat(0.5)) };
    stage.quad([0.7; 2], shining, facing(DVec3::new(-0.3, 0.7, 0.2), DVec3::ZERO));
    let base_color_texture = holes(stage);
    let alpha_mode = AlphaMode::Blend;
    let holed = Material { base_color_texture, alpha_mode, ..filter(Vec3::splat(0.7)) };
    stage.quad([1.5; 2], holed, facing(DVec3::new(0.5, 0.4, 0.0), DVec3::new(0.5, 2.0, 0.3)));
}

/// Lights above the floor and, brighter, below it.
fn lights_on_both_sides(stage: &mut Stage) {
    some_lights(stage);
    panel(stage, 0.6, glow(Vec3::new(9.0, 5.0, 4.0)), DVec3::new(0.5, -0.8, 0.2), DVec3::ZERO);
    stage.light(sphere(Vec3::splat(20.0), 0.1, None), at(DVec3::new(-0.5, -0.6, 0.3)));
    let intensity_cd = Vec3::splat(2.0);
    stage.light(LightKind::Point { intensity_cd }, at(DVec3::new(0.1, -0.7, -0.2)));
}

pub fn of_every_material() -> Vec<Room> {
    let metal = |roughness| Material {
        base_color: Vec3::new(0.9, 0.7, 0.4),
        metallic: 1.0,
        roughness,
        ..Default::default()
    };
    let varnish = Material { roughness: 0.4, ..Material { specular: 1.0, ..plaster() } };
    let absorption = Vec3::new(0.1, 0.5, 0.3);
    let frosted = Material { roughness: 0.7, ..solid(1.4, absorption) };
    let paint = |factor, roughness| Material { coat: coat(factor, roughness), ..plaster() };
    vec![
        Room { name: "Lambert".into(), stage: lambert_room(), depth: 2 },
        room("rough metal", metal(0.8), some_lights),
        room("smooth metal", metal(0.4), some_lights),
        room("varnish", varnish, some_lights),
        room("a coat on plaster", paint(1.0, 0.3), some_lights),
        room("a flat coat above bumps", plaster(), |stage| {
            some_lights(stage);
            let normal_texture = bumps(stage);
            let floor = Material { normal_texture, roughness: 0.5, specular: 1.0, ..plaster() };
            stage.scene.materials[0] = Material { coat: coat(1.0, 0.3), ..floor };
        }),
        room("a coat with bumps of its own", plaster(), |stage| {
            some_lights(stage);
            let normal_texture = bumps(stage);
            let coat = coat(1.0, 0.3).map(|coat| Coat { normal_texture, ..coat });
            stage.scene.materials[0].coat = coat;
        }),
        room("a flat coat above bumps of milk glass", milk(0.6, 0.7), |stage| {
            lights_on_both_sides(stage);
            let normal_texture = bumps(stage);
            let floor = Material { normal_texture, ..milk(0.6, 0.7) };
            stage.scene.materials[0] = Material { coat: coat(1.0, 0.4), ..floor };
        }),
        room("a thin coat on metal", Material { coat: coat(0.5, 0.4), ..metal(0.7) }, some_lights),
        room("panes", plaster(), panes),
        room("panes above a smooth metal", metal(0.4), panes),
        room("a floor of milk glass", milk(0.6, 0.7), lights_on_both_sides),
        room("a floor of rough solid glass", frosted, lights_on_both_sides),
        room("masked cut-outs", plaster(), |stage| cut_outs(stage, AlphaMode::Mask(0.5))),
        room("blended cut-outs", plaster(), |stage| cut_outs(stage, AlphaMode::Blend)),
        room("a normal map", plaster(), |stage| {
            some_lights(stage);
            let normal_texture = bumps(stage);
            let floor = Material { normal_texture, roughness: 0.5, specular: 1.0, ..plaster() };
            stage.scene.materials[0] = floor;
        }),
    ]
}

pub fn of_every_side() -> Vec<Room> {
    let mut rooms = vec![
        room("a floor seen from its back", plaster(), |stage| {
            some_lights(stage);
            let place = facing(DVec3::ZERO, -DVec3::Y);
            stage.scene.nodes[0].local = place;
        }),
        room("light through a crack from below", plaster(), |stage| {
            // Lights under a floor of two halves with a gap, which light what hangs above it.
            some_lights(stage);
            stage.quad([3.0; 2], glow(Vec3::splat(5.0)), facing(-DVec3::Y, DVec3::ZERO));
            let half = scaled(facing(DVec3::X * 1.3, DVec3::new(1.3, 1.0, 0.0)), DVec3::splat(0.5));
            stage.scene.nodes[0].local = half;
        }),
        room("panels that turn their backs", plaster(), |stage| {
            some_lights(stage);
            let away = DVec3::new(-0.2, 2.0, 0.0);
            panel(stage, 0.8, glow(Vec3::splat(30.0)), DVec3::new(-0.2, 0.7, 0.3), away);
            panel(stage, 0.3, glow(Vec3::splat(3.0)), DVec3::new(0.2, 1.7, 0.3), DVec3::ZERO);
        }),
    ];
    for mirror in MIRRORS {
        rooms.push(Room {
            name: format!("mirrored by {mirror}"),
            stage: mirrored(mirror),
            depth: 2,
        });
    }
    rooms
}

/// Scales that mirror: in one axis, in all three.
pub const MIRRORS: [DVec3; 3] =
    [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, 1.0, -1.0), DVec3::splat(-1.0)];

/// A room of things that have a hand, camera included, all under a node that mirrors it.
pub fn mirrored(mirror: DVec3) -> Stage {
    let mut stage = lambert_room();
    let normal_texture = bumps(&mut stage);
    stage.scene.materials[0].normal_texture = normal_texture;
    stage.ball(0.2, 2, glow(Vec3::splat(2.0)), at(DVec3::new(0.2, 0.9, 0.7)));
    let place = aimed(DVec3::new(0.5, 1.4, 0.2), DVec3::ZERO);
    stage.light(sphere(Vec3::splat(9.0), 0.1, Some(USD)), place);
    // A parent stands before its children.
    let parent = Node::fixed("/mirror", None, scaled(at(DVec3::ZERO), mirror));
    let scene = &mut stage.scene;
    scene.nodes.insert(0, parent);
    scene.nodes[1..].iter_mut().for_each(|node| node.parent = Some(0));
    scene.instances.iter_mut().for_each(|instance| instance.node += 1);
    scene.lights.iter_mut().for_each(|light| light.node += 1);
    scene.cameras.iter_mut().for_each(|camera| camera.node += 1);
    stage
}
