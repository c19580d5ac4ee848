//! Laws: energy, densities, limits. The Monte Carlo here is a fixed Hammersley set, so a failure
//! is a failure every time.

mod coat;
mod glass;

use super::*;
use std::f32::consts::{PI, TAU};

fn points(n: u32) -> impl Iterator<Item = (f32, Vec2)> {
    (0..n).map(move |i| {
        let x = (i as f32 + 0.5) / n as f32;
        let y = i.reverse_bits() as f32 / 2.0_f32.powi(32);
        // The lobe is chosen by a third, irrational, sequence.
        ((i as f64 * 0.618_033_988_749_895).fract() as f32, Vec2::new(x, y))
    })
}

fn dielectric(base: f32, roughness: f32) -> SurfaceSample {
    SurfaceSample {
        base_color: Rgb::splat(base),
        metallic: 0.0,
        roughness,
        dielectric_f0: Rgb::splat(0.04),
        dielectric_f90: 1.0,
        coat: 0.0,
        coat_roughness: 0.0,
        transmission: 0.0,
        passage: Default::default(),
    }
}

fn metal(base: f32, roughness: f32) -> SurfaceSample {
    SurfaceSample { metallic: 1.0, ..dielectric(base, roughness) }
}

fn lambert(base: f32) -> SurfaceSample {
    SurfaceSample { dielectric_f0: Rgb::ZERO, dielectric_f90: 0.0, ..dielectric(base, 0.3) }
}

fn coated(below: SurfaceSample, coat: f32, coat_roughness: f32) -> SurfaceSample {
    SurfaceSample { coat, coat_roughness, ..below }
}

fn tilted(cosine: f32) -> Vec3 {
    Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine)
}

fn upright(sample: &SurfaceSample) -> Bsdf {
    Bsdf::new(sample, Frame { tangent: Vec3::X, bitangent: Vec3::Y, normal: Vec3::Z })
}

/// What a surface reflects of an environment of radiance 1.
fn furnace(bsdf: &Bsdf, wo: Vec3) -> f64 {
    let n = 16384;
    let sum: f64 = points(n)
        .filter_map(|(lobe, u)| bsdf.toward(wo).sample(lobe, u))
        .map(|s| f64::from(s.weight.x))
        .sum();
    sum / f64::from(n)
}

const COSINES: [f32; 6] = [1.0, 0.9, 0.6, 0.3, 0.1, 0.02];

#[test]
fn white_surfaces_return_all_light() {
    for roughness in [0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0] {
        let half = SurfaceSample { metallic: 0.5, ..dielectric(1.0, roughness) };
        let bare = [metal(1.0, roughness), dielectric(1.0, roughness), half, lambert(1.0)];
        let smooth = bare.map(|below| coated(below, 1.0, 0.1));
        let rough = bare.map(|below| coated(below, 0.6, 0.7));
        for sample in bare.into_iter().chain(smooth).chain(rough) {
            for cosine in COSINES {
                let reflected = furnace(&upright(&sample), tilted(cosine));
                let error = (reflected - 1.0).abs();
                assert!(error < 8e-3, "{reflected} at cosine {cosine} of {sample:?}");
            }
        }
    }
}

#[test]
fn no_surface_creates_light_and_the_albedo_is_what_it_reflects() {
    for roughness in [0.0, 0.2, 0.6, 1.0] {
        for base in [0.0, 0.18, 0.8] {
            let bare = [metal(base, roughness), dielectric(base, roughness), lambert(base)];
            let coats = bare.map(|below| coated(below, 0.8, 0.6 - 0.5 * roughness));
            for sample in bare.into_iter().chain(coats) {
                for cosine in COSINES {
                    let bsdf = upright(&sample);
                    let reflected = furnace(&bsdf, tilted(cosine));
                    let (specular, diffuse) = bsdf.toward(tilted(cosine)).albedo();
                    let foretold = f64::from(specular.x + diffuse.x);
                    assert!(foretold <= 1.0 + 1e-5);
                    let error = (reflected - foretold).abs();
                    assert!(error < 8e-3, "{reflected}, {foretold} at {cosine} of {sample:?}");
                }
            }
        }
    }
}

#[test]
fn without_specular_it_is_exactly_lambertian() {
    let bsdf = upright(&lambert(0.5));
    for cosine in COSINES {
        let wi = Vec3::new(0.0, 0.6, 0.8);
        let (value, pdf) = bsdf.toward(tilted(cosine)).eval(wi);
        assert_eq!(value, Rgb::splat(0.5 * FRAC_1_PI * 0.8));
        assert_eq!(pdf, 0.8 * FRAC_1_PI);
    }
}

#[test]
fn samples_carry_their_own_value_and_density() {
    let frame = Frame::around(Vec3::new(0.3, -0.7, 0.2).normalize());
    for roughness in [0.0, 0.1, 0.4, 1.0] {
        let bare = [metal(0.7, roughness), dielectric(0.3, roughness), lambert(0.6)];
        let coats = bare.map(|below| coated(below, 1.0, roughness));
        for sample in bare.into_iter().chain(coats) {
            let bsdf = Bsdf::new(&sample, frame);
            for cosine in COSINES {
                let wo = frame.to_outer(tilted(cosine)).normalize();
                for drawn in points(200).filter_map(|(lobe, u)| bsdf.toward(wo).sample(lobe, u)) {
                    let (value, pdf) = bsdf.toward(wo).eval(drawn.wi);
                    // A mirror's density moves by percents within the rounding of a direction.
                    let tolerance = if roughness == 0.0 { 0.05 } else { 2e-3 };
                    assert!((pdf / drawn.pdf - 1.0).abs() < tolerance, "{pdf} {}", drawn.pdf);
                    let expected = drawn.weight * pdf;
                    assert!(((value - expected) / expected).abs().max_element() < tolerance);
                    assert!(drawn.weight.max_element() < 4.0 && drawn.weight.min_element() >= 0.0);
                    assert!((drawn.wi.length() - 1.0).abs() < 1e-5);
                }
            }
        }
    }
}

/// Integral of the density over a cell of (cos, phi).
fn mass(bsdf: &Bsdf, wo: Vec3, cell: [f32; 4], grid: usize) -> f64 {
    let [z0, z1, p0, p1] = cell;
    let mut sum = 0.0;
    for i in 0..grid * grid {
        let s = (i % grid) as f32 + 0.5;
        let t = (i / grid) as f32 + 0.5;
        let z = z0 + (z1 - z0) * s / grid as f32;
        let (sin, cos) = (p0 + (p1 - p0) * t / grid as f32).sin_cos();
        let sine = (1.0 - z * z).sqrt();
        sum += f64::from(bsdf.toward(wo).eval(Vec3::new(sine * cos, sine * sin, z)).1);
    }
    sum * f64::from((z1 - z0) * (p1 - p0)) / (grid * grid) as f64
}

#[test]
fn directions_fall_where_the_density_says() {
    const ROWS: usize = 10;
    const COLUMNS: usize = 16;
    let n = 40_000;
    let bare = [metal(0.9, 0.6), dielectric(0.5, 0.5), metal(0.9, 1.0), lambert(0.4)];
    let coats = [coated(metal(0.3, 0.9), 1.0, 0.5), coated(lambert(0.1), 0.7, 0.6)];
    for sample in bare.into_iter().chain(coats) {
        for cosine in [0.95_f32, 0.5, 0.1] {
            let (bsdf, wo) = (upright(&sample), tilted(cosine));
            let mut counts = [0_u32; ROWS * COLUMNS];
            let mut lost = 0;
            // Independent numbers, so that chi-square has its distribution.
            let mut state = 12345_u32;
            let mut uniform = || {
                state = crate::math::random::hash(state, 77);
                (state >> 8) as f32 / (1 << 24) as f32
            };
            for _ in 0..n {
                let (lobe, u) = (uniform(), Vec2::new(uniform(), uniform()));
                let Some(drawn) = bsdf.toward(wo).sample(lobe, u) else {
                    lost += 1;
                    continue;
                };
                let phi = drawn.wi.y.atan2(drawn.wi.x).rem_euclid(TAU);
                let row = ((drawn.wi.z * ROWS as f32) as usize).min(ROWS - 1);
                let column = ((phi / TAU * COLUMNS as f32) as usize).min(COLUMNS - 1);
                counts[row * COLUMNS + column] += 1;
            }
            let (mut chi2, mut cells, mut total) = (0.0, 0, 0.0);
            for (i, &count) in counts.iter().enumerate() {
                let z = (i / COLUMNS) as f32 / ROWS as f32;
                let phi = (i % COLUMNS) as f32 * TAU / COLUMNS as f32;
                let cell = [z, z + 1.0 / ROWS as f32, phi, phi + TAU / COLUMNS as f32];
                let expected = mass(&bsdf, wo, cell, 24) * f64::from(n);
                total += expected;
                if expected > 8.0 {
                    chi2 += (f64::from(count) - expected).powi(2) / expected;
                    cells += 1;
                }
            }
            // Five sigma of chi-square with that many degrees of freedom.
            let limit = f64::from(cells) + 5.0 * (2.0 * f64::from(cells)).sqrt();
            assert!(chi2 < limit, "chi2 {chi2} over {limit} at {cosine} of {sample:?}");
            let kept = total / f64::from(n) + f64::from(lost) / f64::from(n);
            assert!((kept - 1.0).abs() < 0.01, "density and losses sum to {kept}");
        }
    }
}

#[test]
fn the_horizon_and_the_mirror_stay_finite() {
    let wild = SurfaceSample {
        base_color: Rgb::new(f32::NAN, f32::INFINITY, -1.0),
        metallic: f32::NAN,
        roughness: -3.0,
        dielectric_f0: Rgb::splat(7.0),
        dielectric_f90: f32::INFINITY,
        coat: f32::INFINITY,
        coat_roughness: -1.0,
        transmission: f32::NAN,
        passage: Default::default(),
    };
    let mirrors = coated(metal(1.0, 0.0), 1.0, 0.0);
    for sample in [wild, mirrors, metal(1.0, 0.0), dielectric(1.0, 0.0), dielectric(0.0, 1.0)] {
        let bsdf = upright(&sample);
        for cosine in [1.0_f32, 1e-3, 1e-6, 1e-20, 1e-38, 0.0, -0.5] {
            let wo = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let mirror = Vec3::new(-wo.x, 0.0, wo.z);
            for wi in [mirror, wo, Vec3::Z, Vec3::X, -Vec3::Z, Vec3::new(-1.0, 0.0, 1e-30)] {
                let (value, pdf) = bsdf.toward(wo).eval(wi);
                assert!(value.is_finite() && value.min_element() >= 0.0, "{value} {wo} {wi}");
                assert!(pdf.is_finite() && pdf >= 0.0);
                if cosine <= 0.0 || wi.z <= 0.0 {
                    assert_eq!((value, pdf), (Rgb::ZERO, 0.0));
                }
            }
            let corners = [0.0, 0.5, 1.0 - f32::EPSILON / 2.0];
            for i in 0..27 {
                let (lobe, u, v) = (corners[i % 3], corners[i / 3 % 3], corners[i / 9]);
                if let Some(drawn) = bsdf.toward(wo).sample(lobe, Vec2::new(u, v)) {
                    assert!(cosine > 0.0 && drawn.weight.is_finite() && drawn.wi.is_finite());
                    assert!(drawn.weight.max_element() < 1e4, "{drawn:?} at {cosine}");
                }
            }
        }
    }
    let black = upright(&lambert(0.0));
    assert_eq!(black.toward(Vec3::Z).eval(Vec3::Z), (Rgb::ZERO, 0.0));
    assert!(black.toward(Vec3::Z).sample(0.5, Vec2::splat(0.5)).is_none());
}

#[test]
fn single_scattering_is_reciprocal() {
    for alpha in [0.01, 0.3, 1.0] {
        let (a, b) = (tilted(0.3), Vec3::new(-0.5, 0.1, 0.7).normalize());
        let forth = ggx::visibility_cos(a.z, b.z, alpha) / b.z;
        let back = ggx::visibility_cos(b.z, a.z, alpha) / a.z;
        assert!((forth / back - 1.0).abs() < 1e-6);
    }
    let bsdf = upright(&lambert(0.7));
    let (a, b) = (tilted(0.3), tilted(0.8));
    let forth = bsdf.toward(a).eval(b).0 / b.z;
    let back = bsdf.toward(b).eval(a).0 / a.z;
    assert!((forth - back).abs().max_element() < 1e-7);
}

/// A coat of no strength is none, to the last bit; a smooth one is `KHR_materials_clearcoat`'s: what is below is
/// darkened by Fresnel's term at `wo`, and away from the mirror direction nothing is added.
#[test]
fn a_smooth_coat_darkens_what_is_below_by_its_fresnel_term() {
    let wi = Vec3::new(0.0, 0.6, 0.8);
    for below in [metal(0.7, 0.4), dielectric(0.5, 0.8), lambert(0.6)] {
        for cosine in [1.0_f32, 0.7, 0.4] {
            let wo = tilted(cosine);
            let (bare, pdf) = upright(&below).toward(wo).eval(wi);
            let none = upright(&coated(below, 0.0, 0.3)).toward(wo);
            assert_eq!(none.eval(wi), (bare, pdf));
            assert_eq!(none.lobes(), upright(&below).toward(wo).lobes());
            for strength in [0.5, 1.0] {
                let coat = upright(&coated(below, strength, 0.0)).toward(wo);
                let fresnel = COAT_F0 + (1.0 - COAT_F0) * (1.0 - cosine).powi(5);
                let ratio = coat.eval(wi).0 / bare;
                let expected = 1.0 - strength * fresnel;
                assert!((ratio - expected).abs().max_element() < 2e-3, "{ratio} {expected}");
            }
        }
    }
}

/// A coat on black is the lobe of a black dielectric.
#[test]
fn a_coat_on_black_is_a_dielectric() {
    for roughness in [0.05, 0.3, 1.0] {
        let coat = upright(&coated(lambert(0.0), 1.0, roughness));
        let dielectric = upright(&dielectric(0.0, roughness));
        for cosine in COSINES {
            let wo = tilted(cosine);
            let [a, b] = [&coat, &dielectric].map(|bsdf| bsdf.toward(wo));
            for wi in [wo, tilted(0.5), Vec3::new(-wo.x, 0.0, wo.z), Vec3::new(0.6, 0.48, 0.64)] {
                let ((value, pdf), (expected, density)) = (a.eval(wi), b.eval(wi));
                assert!((value - expected).abs().max_element() <= 1e-5 * expected.x);
                assert!((pdf - density).abs() <= 1e-5 * density);
            }
            let (found, expected) = (a.albedo().0, b.albedo().0);
            assert!((found - expected).abs().max_element() < 1e-6, "{found} {expected}");
        }
    }
}

#[test]
fn microfacets_project_to_the_area_they_stand_on() {
    for alpha in [0.1_f32, 0.5, 1.0] {
        let n = 2000;
        let mut sum = 0.0_f64;
        for i in 0..n {
            // theta = (pi/2) t^2 keeps points where a narrow lobe is.
            let t = (i as f32 + 0.5) / n as f32;
            let (sin, cos) = (t * t * PI / 2.0).sin_cos();
            let density = ggx::distribution(Vec3::new(sin, 0.0, cos), alpha);
            sum += f64::from(density * cos * sin * TAU * PI * t) / f64::from(n);
        }
        assert!((sum - 1.0).abs() < 2e-3, "{sum} at {alpha}");
    }
}
