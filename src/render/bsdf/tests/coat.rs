//! Laws of coats that have a normal of their own.

use super::*;

/// Normals of coats, in the shading frame: from next to it to far from it.
fn normals() -> impl Iterator<Item = Vec3> {
    let tilts = [1e-5f32, 1e-3, 0.05, 0.3, 0.7, 1.2];
    tilts.into_iter().flat_map(|tilt| {
        [0.0f32, 1.1, 2.6, 4.0].map(|turn| {
            let (sin, cos) = tilt.sin_cos();
            Vec3::new(sin * turn.cos(), sin * turn.sin(), cos)
        })
    })
}

fn bent(sample: &SurfaceSample, frame: Frame, normal: Vec3) -> Bsdf {
    Bsdf::new(sample, frame).coated_about(Some(frame.to_outer(normal).normalize()))
}

const UP: Frame = Frame { tangent: Vec3::X, bitangent: Vec3::Y, normal: Vec3::Z };

#[test]
fn its_own_normal_may_be_the_same_to_the_last_bit() {
    let frame = Frame::around(Vec3::new(0.3, -0.7, 0.2).normalize());
    for below in [metal(0.7, 0.4), dielectric(0.5, 0.8), lambert(0.6)] {
        let plain = Bsdf::new(&coated(below, 0.7, 0.2), frame);
        let same = plain.coated_about(Some(frame.normal));
        for cosine in COSINES {
            let wo = frame.to_outer(tilted(cosine));
            let [a, b] = [plain, same].map(|bsdf| bsdf.toward(wo));
            assert!(!b.has_two_horizons());
            assert_eq!((a.lobes(), a.albedo()), (b.lobes(), b.albedo()));
            for (lobe, u) in points(50) {
                assert_eq!(a.sample(lobe, u), b.sample(lobe, u));
            }
        }
    }
}

/// On black it is the coat of an upright surface, turned.
#[test]
fn on_black_it_is_an_upright_coat_turned() {
    for roughness in [0.1, 0.4, 1.0] {
        let sample = coated(lambert(0.0), 0.8, roughness);
        for normal in normals() {
            let own = Bsdf::new(&sample, Frame::around(normal));
            let below = bent(&sample, UP, normal);
            for wo in [Vec3::Z, tilted(0.6), Vec3::new(0.1, -0.8, 0.3).normalize()] {
                if wo.dot(normal) <= 1e-3 {
                    continue;
                }
                let [a, b] = [own, below].map(|bsdf| bsdf.toward(wo));
                for (_, u) in points(64) {
                    // All around, below either horizon too.
                    let z = 2.0 * u.x - 1.0;
                    let (sin, cos) = (TAU * u.y).sin_cos();
                    let wi = Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
                    if wi.dot(normal).abs() < 1e-3 {
                        continue;
                    }
                    let ((value, pdf), (found, density)) = (a.eval(wi), b.eval(wi));
                    assert!((value - found).abs().max_element() <= 1e-3 * value.x + 1e-7);
                    assert!((pdf - density).abs() <= 1e-3 * pdf + 1e-7, "{pdf} {density} {normal}");
                }
                let (expected, found) = (a.albedo().0, b.albedo().0);
                assert!((expected - found).abs().max_element() < 1e-5);
                let (lobes, about) = b.lobes().unwrap();
                assert!(about.distance(normal) < 1e-4 && lobes.alpha == a.lobes().unwrap().0.alpha);
            }
        }
    }
}

#[test]
fn no_bent_coat_creates_light_and_the_albedo_is_what_is_reflected() {
    for below in [metal(1.0, 0.3), dielectric(1.0, 0.6), lambert(1.0), dielectric(0.2, 1.0)] {
        for (strength, roughness) in [(1.0, 0.05), (0.6, 0.4), (1.0, 1.0)] {
            let sample = coated(below, strength, roughness);
            for normal in normals() {
                for wo in [Vec3::Z, tilted(0.5), Vec3::new(-0.9, 0.2, 0.15).normalize()] {
                    let bsdf = bent(&sample, UP, normal);
                    let reflected = furnace(&bsdf, wo);
                    let (specular, diffuse) = bsdf.toward(wo).albedo();
                    let foretold = f64::from(specular.x + diffuse.x);
                    // Two peaks in one place are hard to integrate.
                    assert!(foretold <= 1.0 + 1e-5, "{foretold} of {sample:?} about {normal}");
                    let error = (reflected - foretold).abs();
                    assert!(error < 2e-2, "{reflected}, {foretold} of {sample:?} about {normal}");
                }
            }
        }
    }
}

#[test]
fn samples_of_bent_coats_carry_their_own_value_and_density() {
    let frame = Frame::around(Vec3::new(0.3, -0.7, 0.2).normalize());
    let mut below_horizon = 0;
    let glass = |passage| SurfaceSample { passage, transmission: 0.7, ..dielectric(0.9, 0.4) };
    let solid = glass(Passage::Solid(1.5));
    for below in [metal(0.7, 0.4), dielectric(0.3, 0.2), lambert(0.6), glass(Passage::Thin), solid]
    {
        for roughness in [0.1, 0.4, 1.0] {
            for normal in normals() {
                let bsdf = bent(&coated(below, 1.0, roughness), frame, normal);
                for cosine in [1.0, 0.6, 0.1] {
                    let wo = frame.to_outer(tilted(cosine)).normalize();
                    let reflection = bsdf.toward(wo);
                    for drawn in points(60).filter_map(|(lobe, u)| reflection.sample(lobe, u)) {
                        let (value, pdf) = reflection.eval(drawn.wi);
                        assert!((pdf / drawn.pdf - 1.0).abs() < 5e-3, "{pdf} {}", drawn.pdf);
                        let expected = drawn.weight * pdf;
                        let off = (value - expected).abs().max_element();
                        assert!(off <= 5e-3 * expected.max_element() + 1e-7, "{value} {expected}");
                        assert!(drawn.weight.min_element() >= 0.0 && drawn.weight.is_finite());
                        let is_below = !reflection.is_above(drawn.wi);
                        below_horizon += u32::from(is_below && !reflection.transmits());
                    }
                }
            }
        }
    }
    assert!(below_horizon > 300, "{below_horizon}: a coat reflects below the other horizon");
}

/// All that is drawn, over all directions.
#[test]
fn densities_of_bent_coats_add_up_to_what_is_drawn() {
    let (rows, columns) = (300, 600);
    for below in [metal(0.9, 0.6), dielectric(0.5, 0.5), lambert(0.4)] {
        for normal in normals().step_by(3) {
            let reflection = bent(&coated(below, 0.8, 0.5), UP, normal).toward(tilted(0.6));
            let mut sum = 0.0;
            for i in 0..rows * columns {
                let z = 2.0 * ((i / columns) as f32 + 0.5) / rows as f32 - 1.0;
                let (sin, cos) = (TAU * (i % columns) as f32 / columns as f32).sin_cos();
                let sine = (1.0 - z * z).sqrt();
                sum += f64::from(reflection.eval(Vec3::new(sine * cos, sine * sin, z)).1);
            }
            let all = sum * 4.0 * std::f64::consts::PI / f64::from(rows * columns);
            let n = 20_000;
            let drawn = points(n).filter(|&(lobe, u)| reflection.sample(lobe, u).is_some()).count();
            let drawn = drawn as f64 / f64::from(n);
            assert!((all - drawn).abs() < 0.01, "{all} and {drawn} about {normal}");
        }
    }
}

/// Where light passes, a direction below the surface is of what passes alone.
#[test]
fn on_glass_a_bent_coat_stays_on_its_side() {
    let thin = SurfaceSample { passage: Passage::Thin, transmission: 1.0, ..dielectric(1.0, 0.3) };
    for normal in normals() {
        let reflection = bent(&coated(thin, 1.0, 0.5), UP, normal).toward(tilted(0.6));
        let plain = upright(&thin).toward(tilted(0.6));
        let n = 16384;
        let sum = points(n).filter_map(|(lobe, u)| reflection.sample(lobe, u));
        let all = sum.map(|drawn| f64::from(drawn.weight.x)).sum::<f64>() / f64::from(n);
        assert!(all < 1.0 + 2e-2, "{all} about {normal}");
        // What passes is the bare pane's, less what the coat reflects.
        for cosine in [-0.9, -0.4] {
            let wi = Vec3::new(-(1.0f32 - cosine * cosine).sqrt(), 0.0, cosine);
            let (found, bare) = (reflection.eval(wi).0.x, plain.eval(wi).0.x);
            let is_coated = tilted(0.6).dot(normal) > 0.0;
            let is_less = if is_coated { found < bare } else { found == bare };
            assert!(is_less && found > 0.2 * bare, "{found} {bare} about {normal}");
        }
    }
}

#[test]
fn a_bent_coat_stays_finite() {
    let sample = coated(metal(1.0, 0.0), 1.0, 0.0);
    for normal in normals().chain([Vec3::X, -Vec3::Z, Vec3::ZERO, Vec3::splat(f32::NAN)]) {
        let bsdf = bent(&sample, UP, normal);
        for cosine in [1.0_f32, 1e-3, 1e-6, 1e-20, 0.0, -0.5] {
            let wo = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            for wi in [wo, Vec3::Z, Vec3::X, -Vec3::X, -Vec3::Z, Vec3::new(-wo.x, 0.0, wo.z)] {
                let (value, pdf) = bsdf.toward(wo).eval(wi);
                assert!(value.is_finite() && value.min_element() >= 0.0, "{value} {wo} {wi}");
                assert!(pdf.is_finite() && pdf >= 0.0);
            }
            for (lobe, u) in points(32) {
                if let Some(drawn) = bsdf.toward(wo).sample(lobe, u) {
                    assert!(drawn.weight.is_finite() && drawn.wi.is_finite());
                }
            }
        }
    }
}
