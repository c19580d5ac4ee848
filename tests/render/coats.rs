//! Coats with normals of their own, in pictures.

use crate::stage::{Stage, at, by, coat, direct, facing, lambert};
use crate::statistics::Estimate;
use candelabra::render::LightStrategy;
use candelabra::scene::{Coat, LightKind, Material, Pixels, Texture, TextureUse, Wrap};
use glam::{DVec3, Vec3};

/// A picture that tilts normals by an angle, along growing u.
fn tilt(stage: &mut Stage, angle: f32) -> Option<TextureUse> {
    let texel = Vec3::new(angle.sin(), 0.0, angle.cos());
    stage.texture(Texture {
        name: "tilt".into(),
        width: 1,
        height: 1,
        pixels: Pixels::Float(vec![(texel * 0.5 + 0.5).to_array()]),
        wrap: [Wrap::Repeat; 2],
        bilinear: false,
    })
}

/// A black floor, seen from straight above, below a coat. Normals of the coat and of the floor are tilted.
fn floor(own: f32, below: f32, roughness: f32) -> Stage {
    let mut stage = Stage::default();
    stage.quad([2.0; 2], lambert(Vec3::ZERO), facing(DVec3::ZERO, DVec3::Y));
    let below = if below == 0.0 { None } else { tilt(&mut stage, below) };
    let own = if own == 0.0 { None } else { tilt(&mut stage, own) };
    let coat = coat(1.0, roughness).map(|coat| Coat { normal_texture: own, ..coat });
    let material = &mut stage.scene.materials[0];
    *material = Material { normal_texture: below, coat, ..material.clone() };
    stage.look(DVec3::new(0.0, 5.0, 1e-4), DVec3::ZERO, 0.05);
    stage
}

fn fresnel(cosine: f64) -> f64 {
    0.04 + 0.96 * (1.0 - cosine).powi(5)
}

/// Below a white sky a smooth coat is as bright as Fresnel's term says at its own normal, whatever the normals below.
#[test]
fn a_coat_reflects_about_its_own_normal() {
    for below in [0.0, 0.5, -0.6] {
        for own in [0.0, 0.3, -0.7] {
            let mut stage = floor(own, below, 0.0);
            let radiance_nits = Vec3::ONE;
            stage.light(LightKind::Dome { radiance_nits, texture: None }, at(DVec3::ZERO));
            let picture = stage.render(&direct(4, 256));
            let found = Estimate::of_picture(&picture).mean.x;
            let expected = fresnel(f64::from(own).cos());
            assert!(
                (found / expected - 1.0).abs() < 0.02,
                "{own} above {below}: {found} {expected}"
            );
        }
    }
}

/// Two lamps, alike to the coat's own normal. To normals that are tilted one of them is below the horizon.
fn lit(below: f32) -> Stage {
    let mut stage = floor(0.0, below, 0.5);
    for x in [3.0, -3.0] {
        let intensity_cd = Vec3::ONE;
        stage.light(LightKind::Point { intensity_cd }, at(DVec3::new(x, 2.0, 0.0)));
    }
    stage
}

/// Any way of picking finds the lamp, and what is below the coat, which is black, changes nothing.
#[test]
fn a_coat_is_lit_from_below_the_other_horizon() {
    let render = |below, strategy| {
        let settings = by(strategy, true, &direct(4, 4096));
        Estimate::of_picture(&lit(below).render(&settings))
    };
    let flat = render(0.0, LightStrategy::All);
    use LightStrategy::{All, Exhaustive, Tree, Uniform};
    for strategy in [All, Tree, Exhaustive, Uniform] {
        let found = render(1.3, strategy);
        let is_near =
            (found.mean.x / flat.mean.x - 1.0).abs() < 0.01 || found.distance(&flat) < 4.0;
        assert!(is_near, "{strategy:?}: {found} and not {flat}");
    }
}
