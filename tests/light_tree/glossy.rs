//! Picking for surfaces that reflect more than diffusely.

use crate::support::{emitters, glossy, position, with_tree};
use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::{Glossy, Link, Node, Picked, SplitTest, Splitting};
use candelabra::math::Frame;
use candelabra::math::color::{Rgb, luminance};
use candelabra::render::bsdf::{Bsdf, SurfaceSample};
use glam::Vec3;
use proptest::prelude::*;
use std::f32::consts::PI;

fn point_light(at: Vec3, energy: f32) -> LightBounds {
    LightBounds::of_emitter(Aabb::around([at]), Cone::ALL, energy, f32::INFINITY)
}

/// A real surface and the receiver that stands for it.
fn surface() -> impl Strategy<Value = (Bsdf, Glossy)> {
    let unit = || prop_oneof![1 => Just(0f32), 1 => Just(1f32), 4 => 0f32..1.0];
    (glossy(), unit(), unit(), 0.05f32..1.0).prop_filter_map(
        "below the horizon",
        |(any, base, metallic, roughness)| {
            let base_color = Rgb::splat(base);
            let (dielectric_f0, dielectric_f90) = (Rgb::splat(0.04), 1.0);
            let (coat, coat_roughness) = (0.0, 0.0);
            let sample = SurfaceSample {
                base_color,
                metallic,
                roughness,
                dielectric_f0,
                dielectric_f90,
                coat,
                coat_roughness,
                transmission: 0.0,
                passage: Default::default(),
            };
            let bsdf = Bsdf::new(&sample, Frame::around(any.receiver.normal));
            let (lobes, about) = bsdf.toward(any.to_eye).lobes()?;
            Some((bsdf, Glossy { lobes, about, ..any }))
        },
    )
}

proptest! {
    /// Of a point light the importance is what the surface reflects of it: an oracle that knows
    /// nothing of half angles and cones.
    #[test]
    fn a_point_weighs_what_is_reflected((bsdf, receiver) in surface(), at in position()) {
        let away = at - receiver.receiver.point;
        let to_light = away.normalize();
        prop_assume!(away.length() > 1e-2 && to_light.dot(receiver.receiver.normal) > 0.02);
        prop_assume!(receiver.to_eye.dot(receiver.receiver.normal) > 0.02);
        let node = Node::encode(&point_light(at, 3.0), Link::Emitter(0));
        let (reflected, _) = bsdf.toward(receiver.to_eye).eval(to_light);
        let expected = f64::from(3.0 * PI * luminance(reflected) / away.length_squared());
        let found = node.importance(&receiver);
        // The floor: a millionth of what a white surface would reflect.
        let floor = f64::from(4e-6 / away.length_squared());
        prop_assert!((found - expected).abs() <= 1e-2 * expected + floor, "{found} {expected}");
    }

    /// How a surface reflects never says that there is no light: only the horizon does, and the bounds.
    #[test]
    fn dark_is_what_is_dark_to_paper(bounds in emitters(2), receiver in glossy()) {
        let node = Node::encode(&bounds[0], Link::Emitter(0));
        let (paper, glossy) = (node.importance(&receiver.receiver), node.importance(&receiver));
        prop_assert_eq!(paper > 0.0, glossy > 0.0);
        prop_assert!(glossy.is_finite());
    }

    /// Whatever its lobes, a surface gives a cluster no more than all that arrives, each way of
    /// reflecting taken at its best: the lobe's energy is bounded, however sharp.
    #[test]
    fn a_sharp_lobe_does_not_outweigh_the_room(receiver in glossy(), radius in 0.2f32..0.9) {
        // A sphere of directions seen under a wide angle, at distance 1.
        let center = receiver.receiver.point + receiver.receiver.normal;
        let aabb = Aabb { min: center - radius / 3f32.sqrt(), max: center + radius / 3f32.sqrt() };
        let bounds = LightBounds::of_emitter(aabb, Cone::ALL, 1.0, f32::INFINITY);
        let node = Node::encode(&bounds, Link::Emitter(0));
        let solid_angle = 2.0 * PI * (1.0 - (1.0 - radius * radius).sqrt());
        let white = 1.0 + PI / solid_angle;
        prop_assert!(node.importance(&receiver) <= 2.1 * f64::from(white));
    }
}

/// Small lamps over a surface like wet stone, and over one like a painted car: the exact variance of a pick by what the surface reflects,
/// and by its irradiance alone.
#[test]
fn a_reflection_is_found() {
    let stone = SurfaceSample {
        base_color: Rgb::splat(0.2),
        metallic: 0.0,
        roughness: 0.15,
        dielectric_f0: Rgb::splat(0.04),
        dielectric_f90: 1.0,
        coat: 0.0,
        coat_roughness: 0.0,
        transmission: 0.0,
        passage: Default::default(),
    };
    let paint = SurfaceSample { roughness: 0.6, coat: 1.0, coat_roughness: 0.15, ..stone };
    for sample in [stone, paint] {
        let (knowing, blind) = variances(&sample);
        println!("relative variance: {knowing:.4} knowing the surface, {blind:.4} not");
        assert!(knowing < 0.1 * blind, "{knowing} {blind} of {sample:?}");
    }
}

/// Of a pick by what a surface reflects, and by its irradiance.
fn variances(sample: &SurfaceSample) -> (f64, f64) {
    let random = |i: u32, n: u32| candelabra::math::random::hash(i, n) as f32 / u32::MAX as f32;
    let lamps: Vec<LightBounds> = (0..2000)
        .map(|i| {
            let at = Vec3::new(random(i, 0) - 0.5, 0.2 * random(i, 1) + 0.1, random(i, 2) - 0.5);
            point_light(at * 40.0, 0.5 + random(i, 3))
        })
        .collect();
    let bsdf = Bsdf::new(sample, Frame::around(Vec3::Y));
    let default = Splitting { knob: 0.5, most: 64, test: SplitTest::Variance };
    let (mut knowing, mut blind) = (0.0, 0.0);
    with_tree(&lamps, |tree| {
        for i in 0..40 {
            let point = Vec3::new(random(i, 10) - 0.5, 0.0, random(i, 11) - 0.5) * 20.0;
            let to_eye = Vec3::new(random(i, 12) - 0.5, 0.3, random(i, 13) - 0.5).normalize();
            let receiver = candelabra::light_tree::Receiver { point, normal: Vec3::Y };
            let (lobes, about) = bsdf.toward(to_eye).lobes().unwrap();
            let glossy = Glossy { receiver, about, to_eye, lobes, toward: Vec3::Y };
            let contribution = |light: Picked, _: f64| {
                let lamp = &lamps[light.emitter().unwrap() as usize];
                let away = lamp.aabb.center() - point;
                let (reflected, _) = bsdf.toward(to_eye).eval(away.normalize());
                f64::from(luminance(reflected) * lamp.energy / away.length_squared())
            };
            let [a, b] = [
                tree.moments(&glossy, &[], &default, &contribution),
                tree.moments(&receiver, &[], &default, &contribution),
            ];
            assert!((a.mean / b.mean - 1.0).abs() < 1e-9);
            knowing += a.variance / (a.mean * a.mean);
            blind += b.variance / (b.mean * b.mean);
        }
    });
    (knowing / 40.0, blind / 40.0)
}
