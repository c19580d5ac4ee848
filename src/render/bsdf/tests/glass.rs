//! Laws of glass that is rough or solid.

use super::*;

fn glass(passage: Passage, roughness: f32, transmission: f32) -> SurfaceSample {
    SurfaceSample { passage, transmission, ..dielectric(1.0, roughness) }
}

/// Solid glass from outside and from inside.
const SIDES: [f32; 4] = [1.5, 1.0 / 1.5, 2.4, 1.0 / 1.1];

/// What of an environment of radiance 1, on both sides, leaves a surface, less what radiance gains in a medium.
fn both_sides(bsdf: &Bsdf, wo: Vec3) -> f64 {
    let n = 16384;
    let gain = match bsdf.passage {
        Passage::Solid(eta) => eta * eta,
        _ => 1.0,
    };
    let sum: f64 = points(n)
        .filter_map(|(lobe, u)| bsdf.toward(wo).sample(lobe, u))
        .map(|s| f64::from(s.weight.x * if s.wi.z < 0.0 { gain } else { 1.0 }))
        .sum();
    sum / f64::from(n)
}

#[test]
fn white_glass_loses_no_light() {
    for share in [0.4, 1.0] {
        for roughness in [0.05, 0.2, 0.4, 0.7, 1.0] {
            let thin = glass(Passage::Thin, roughness, share);
            for sample in [thin, coated(thin, 1.0, 0.1)] {
                for cosine in COSINES {
                    let (bsdf, wo) = (upright(&sample), tilted(cosine));
                    let left = both_sides(&bsdf, wo);
                    // Two peaks in one place are hard to integrate.
                    let tolerance = if sample.coat > 0.0 { 2.5e-2 } else { 1.5e-2 };
                    assert!((left - 1.0).abs() < tolerance, "{left} at {cosine} of {sample:?}");
                    assert!((bsdf.toward(wo).whole_albedo().x - 1.0).abs() < 1e-4);
                }
            }
        }
        for eta in SIDES {
            for (roughness, loss) in [(0.0, 2e-3), (0.2, 6e-3), (0.5, 0.16), (1.0, 0.6)] {
                let sample = glass(Passage::Solid(eta), roughness, share);
                for cosine in COSINES {
                    let left = both_sides(&upright(&sample), tilted(cosine));
                    // At grazing angles nearly all of the microfacets of a rough surface are in shadow.
                    let is_told = cosine >= 0.6 || roughness == 0.0;
                    let fits = left < 1.0 + 1.5e-2 && (left > 1.0 - loss || !is_told);
                    assert!(fits, "{left} at {cosine} of {sample:?}");
                }
            }
        }
    }
}

/// Also that half of a surface is one that reflects.
#[test]
fn samples_of_glass_carry_their_own_value_and_density() {
    let frame = Frame::around(Vec3::new(0.3, -0.7, 0.2).normalize());
    for passage in SIDES.map(Passage::Solid).into_iter().chain([Passage::Thin]) {
        for (roughness, share) in [(0.1, 1.0), (0.4, 0.5), (1.0, 1.0)] {
            let bsdf = Bsdf::new(&glass(passage, roughness, share), frame);
            for cosine in COSINES {
                let wo = frame.to_outer(tilted(cosine)).normalize();
                let mut beyond = 0;
                for drawn in points(300).filter_map(|(lobe, u)| bsdf.toward(wo).sample(lobe, u)) {
                    let (value, pdf) = bsdf.toward(wo).eval(drawn.wi);
                    let tolerance = if roughness < 0.2 { 2e-2 } else { 2e-3 };
                    assert!((pdf / drawn.pdf - 1.0).abs() < tolerance, "{pdf} {}", drawn.pdf);
                    let expected = drawn.weight * pdf;
                    let off = (value - expected).abs().max_element();
                    assert!(
                        off <= tolerance * expected.max_element(),
                        "{value} {expected} {passage:?} {roughness} {cosine} {drawn:?}"
                    );
                    beyond += usize::from(!bsdf.toward(wo).is_above(drawn.wi));
                }
                let is_total = matches!(passage, Passage::Solid(eta) if eta < 1.0);
                assert!(beyond > 0 || is_total);
            }
        }
    }
}

/// Chi-square over the whole sphere of directions.
#[test]
fn light_passes_where_the_density_says() {
    const ROWS: usize = 20;
    const COLUMNS: usize = 12;
    let n = 40_000;
    let cases = [
        glass(Passage::Thin, 0.6, 0.7),
        glass(Passage::Solid(1.5), 0.6, 1.0),
        glass(Passage::Solid(1.0 / 1.5), 0.7, 1.0),
        coated(glass(Passage::Solid(1.0 / 1.3), 0.8, 0.5), 1.0, 0.6),
    ];
    for sample in cases {
        for cosine in [0.95_f32, 0.5, 0.15] {
            let (bsdf, wo) = (upright(&sample), tilted(cosine));
            let mut counts = [0_u32; ROWS * COLUMNS];
            let mut state = 4321_u32;
            let mut uniform = || {
                state = crate::math::random::hash(state, 77);
                (state >> 8) as f32 / (1 << 24) as f32
            };
            for _ in 0..n {
                let (lobe, u) = (uniform(), Vec2::new(uniform(), uniform()));
                let Some(drawn) = bsdf.toward(wo).sample(lobe, u) else { continue };
                let phi = drawn.wi.y.atan2(drawn.wi.x).rem_euclid(TAU);
                let row = ((0.5 * (drawn.wi.z + 1.0) * ROWS as f32) as usize).min(ROWS - 1);
                let column = ((phi / TAU * COLUMNS as f32) as usize).min(COLUMNS - 1);
                counts[row * COLUMNS + column] += 1;
            }
            let (mut chi2, mut cells) = (0.0, 0);
            for (i, &count) in counts.iter().enumerate() {
                let z = (i / COLUMNS) as f32 * 2.0 / ROWS as f32 - 1.0;
                let phi = (i % COLUMNS) as f32 * TAU / COLUMNS as f32;
                let cell = [z, z + 2.0 / ROWS as f32, phi, phi + TAU / COLUMNS as f32];
                let expected = mass(&bsdf, wo, cell, 40) * f64::from(n);
                if expected > 8.0 {
                    chi2 += (f64::from(count) - expected).powi(2) / expected;
                    cells += 1;
                }
            }
            let limit = f64::from(cells) + 5.0 * (2.0 * f64::from(cells)).sqrt();
            assert!(chi2 < limit, "chi2 {chi2} over {limit} at {cosine} of {sample:?}");
        }
    }
}

/// Light that takes the same way back is passed alike, but for what radiance gains in the medium.
#[test]
fn solid_glass_is_reciprocal() {
    let up = Frame { tangent: Vec3::X, bitangent: Vec3::Y, normal: Vec3::Z };
    let down = Frame { tangent: Vec3::X, bitangent: -Vec3::Y, normal: -Vec3::Z };
    for ior in [1.1_f32, 1.5, 2.4] {
        for roughness in [0.3, 0.6, 1.0] {
            let outside = Bsdf::new(&glass(Passage::Solid(ior), roughness, 1.0), up);
            let inside = Bsdf::new(&glass(Passage::Solid(1.0 / ior), roughness, 1.0), down);
            let ways = [0.9, 0.4].into_iter().flat_map(|cosine| {
                let drawn = points(40)
                    .filter_map(move |(lobe, u)| outside.toward(tilted(cosine)).sample(lobe, u));
                drawn.filter(|s| s.wi.z < 0.0).map(move |s| (tilted(cosine), s.wi))
            });
            for (a, b) in ways {
                let forth = outside.toward(a).eval(b).0.x / b.z.abs() * ior * ior;
                let back = inside.toward(b).eval(a).0.x / a.z.abs();
                assert!(forth > 0.0 && (forth / back - 1.0).abs() < 1e-3, "{forth} {back}");
            }
        }
    }
}

/// Smooth glass bends light by Snell's law, and mirrors all of it where it cannot leave.
#[test]
fn smooth_glass_obeys_snell() {
    for eta in SIDES {
        let bsdf = upright(&glass(Passage::Solid(eta), 0.0, 1.0));
        for cosine in [1.0_f32, 0.9, 0.75, 0.5, 0.2] {
            let sine = (1.0 - cosine * cosine).sqrt() / eta;
            let mut mirrored = 0;
            for drawn in
                points(500).filter_map(|(lobe, u)| bsdf.toward(tilted(cosine)).sample(lobe, u))
            {
                let expected = match drawn.wi.z < 0.0 {
                    true => Vec3::new(-sine, 0.0, -(1.0 - sine * sine).max(0.0).sqrt()),
                    false => Vec3::new(-tilted(cosine).x, 0.0, cosine),
                };
                mirrored += usize::from(drawn.wi.z > 0.0);
                // The lobe of the smoothest surface has a tail.
                assert!((drawn.wi - expected).length() < 0.2, "{} {expected}", drawn.wi);
            }
            assert_eq!(mirrored == 500, sine >= 1.0, "{mirrored} at {cosine} of {eta}");
        }
    }
}

/// What the density of radiance takes where a path enters glass, it gives back where the path leaves: without it no
/// light is made or lost.
#[test]
fn weights_times_the_concentration_are_shares_of_power() {
    for ior in [1.001, 1.5, 2.4, 1e3] {
        for eta in [ior, 1.0 / ior] {
            let sample = SurfaceSample {
                transmission: 1.0,
                passage: Passage::Solid(eta),
                dielectric_f0: Rgb::ZERO,
                dielectric_f90: 0.0,
                ..dielectric(1.0, 0.0)
            };
            let reflection = upright(&sample).toward(Vec3::Z);
            let passed = points(256)
                .filter_map(|(lobe, u)| reflection.sample(lobe, u))
                .filter(|sample| !reflection.is_above(sample.wi));
            let shares: Vec<f32> =
                passed.map(|sample| sample.weight.x * reflection.concentration()).collect();
            assert!(!shares.is_empty(), "{eta}");
            let off = shares.iter().map(|share| (share - 1.0).abs()).fold(0.0, f32::max);
            assert!(off < 0.02, "{eta}: off by {off}");
        }
    }
}
