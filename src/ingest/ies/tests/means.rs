//! Means of profiles, and cones of what of them is lit.

use super::*;

#[test]
fn the_mean_of_a_uniform_profile_is_its_value_and_beams_up_are_about_z() {
    for (from, to) in [(0.0, 180.0), (0.0, 90.0), (90.0, 180.0), (0.0, 3.0)] {
        let web = profile(&file(1, &steps(from, to, 3), &[0.0], |_, _| 4.0));
        assert!(near(web.mean(), 4.0), "{} {}", web.mean(), to);
        let lit = web.lit();
        let half = if from == 0.0 { to } else { 180.0 - from };
        assert!((lit.half_angle_rad - f64::to_radians(half)).abs() < 1e-4);
        assert_eq!(lit.axis, if from == 0.0 { DVec3::NEG_Z } else { DVec3::Z });
    }
    // A wall washer shines to one side only.
    let side = |_: f64, h: f64| if h.min(360.0 - h) < 50.0 { 1.0 } else { 0.0 };
    let web = profile(&file(1, &steps(60.0, 90.0, 6), &steps(0.0, 360.0, 72), side));
    assert!(web.lit().half_angle_rad < FRAC_PI_2 && web.lit().axis.x < -0.8, "{:?}", web.lit());
    let dark = profile(&file(1, &[0.0, 90.0], &[0.0], |_, _| 0.0));
    assert_eq!((dark.mean(), dark.factor(DVec3::NEG_Z)), (0.0, 0.0));
}

/// A beam of some width in a dim hemisphere: its share of the mean is its integral times the cosine there, over pi.
#[test]
fn the_mean_sees_beams_however_narrow_and_wherever_they_are() {
    for width in [1.0, 0.1, 1e-3] {
        for (theta, phi) in [(60.0, 11.25), (20.0, 3.7), (85.0, 181.3)] {
            let beside = |at: f64| [at - 0.5 * width, at, at + 0.5 * width];
            let (v, h) = (
                [vec![0.0], beside(theta).to_vec(), vec![90.0]].concat(),
                [vec![0.0], beside(phi).to_vec(), vec![360.0]].concat(),
            );
            let at = |v: f64, h: f64| if v == theta && h == phi { 1e4 } else { 1e-3 };
            let table = table(&file(1, &v, &h, at));
            let dim = 1e-3 * TAU;
            let beam = table.integral().0 - dim;
            let mean = IesProfile::new(String::new(), table, 0.0).mean();
            let expected = 1e-3 + beam * theta.to_radians().cos() / PI;
            assert!(
                (f64::from(mean) / expected - 1.0).abs() < 1e-3,
                "{width} {theta}: {mean} {expected}"
            );
        }
    }
}

/// Means of any table, against very many directions of the cone.
#[test]
fn the_mean_is_that_over_directions_of_the_lit_cone() {
    let waves = |v: f64, h: f64| (2.0 + (v / 17.0).sin() + (h / 23.0).cos()).max(0.0);
    let whole = |v: f64, h: f64| waves(v, h.min(360.0 - h));
    let side = |v: f64, h: f64| if (40.0..=100.0).contains(&h) { waves(v, h) } else { 0.0 };
    let all = steps(-90.0, 90.0, 18);
    let texts = [
        file(1, &steps(0.0, 180.0, 18), &steps(0.0, 360.0, 36), whole),
        file(1, &steps(30.0, 80.0, 5), &steps(0.0, 360.0, 36), side),
        file(1, &steps(0.0, 180.0, 18), &[0.0], waves),
        file(2, &all, &all, waves),
        file(3, &all, &all, waves),
    ];
    for (number, text) in texts.iter().enumerate() {
        for scale in [0.0, 0.4, 1.7, -0.6, -1.5] {
            let web = IesProfile::new(String::new(), table(text), scale);
            let (lit, (mut sum, mut weights)) = (web.lit(), (0.0, 0.0));
            let beyond = (lit.half_angle_rad - FRAC_PI_2).max(0.0);
            // A spiral over the sphere.
            const COUNT: usize = 200_000;
            for i in 0..COUNT {
                let z = 1.0 - 2.0 * (i as f64 + 0.5) / COUNT as f64;
                let (sine, cosine) = (i as f64 * 2.399_963_229_728_653).sin_cos();
                let across = (1.0 - z * z).sqrt();
                let toward = DVec3::new(across * cosine, across * sine, z);
                let off = lit.axis.angle_between(toward);
                if off <= lit.half_angle_rad {
                    let weight = (off - beyond).max(0.0).cos();
                    sum += weight * f64::from(web.factor(toward));
                    weights += weight;
                }
            }
            let (mean, expected) = (f64::from(web.mean()), sum / weights);
            assert!((mean / expected - 1.0).abs() < 0.01, "{number} {scale}: {mean} {expected}");
        }
    }
}

/// As many angles as a file may have, in one plane and in planes: what is lit is found without pieces that are kept.
#[test]
fn a_fine_profile_is_lit_where_it_shines() {
    let polar_rad: Vec<f64> = (0..65_536).map(|i| PI * f64::from(i) / 65_535.0).collect();
    let values: Vec<f32> =
        polar_rad.iter().map(|&polar| f32::from(u8::from(polar < 1.0))).collect();
    let one = |around_rad: Vec<f64>| {
        let values = values.repeat(around_rad.len());
        let table = IesTable {
            pole: crate::scene::Pole::Nadir,
            polar_rad: polar_rad.clone(),
            around_rad,
            values,
        };
        IesProfile::new(String::new(), table, 0.0)
    };
    for web in [one(vec![0.0]), one(vec![0.0, 2.0, TAU])] {
        assert_eq!(web.lit().axis, DVec3::NEG_Z);
        assert!((web.lit().half_angle_rad - 1.0).abs() < 1e-3 && (web.mean() - 1.0).abs() < 1e-3);
        assert!(web.is_round());
    }
}

/// Rounding may put an angle beyond a pole. Kept to the pole, two angles are one, and nothing of width 0 counts.
#[test]
fn angles_beyond_a_pole_change_nothing() {
    let vertical = [0.0, 45.0, 90.0, 135.0, 180.0];
    let beyond = [0.0, 45.0, 90.0, 135.0, 180.0, 180.005];
    let horizontal = steps(0.0, 360.0, 8);
    let at = |v: f64, h: f64| 10.0 + v.min(180.0) + h.min(360.0 - h);
    // Type B: both ends of its horizontal angles.
    let (sides, wider) =
        (steps(-90.0, 90.0, 6), [vec![-90.005], steps(-90.0, 90.0, 6), vec![90.005]].concat());
    let aside = |v: f64, h: f64| 10.0 + v + h.clamp(-90.0, 90.0);
    for scale in [0.0, 0.5, 2.0, -0.5] {
        let of = |text: String| IesProfile::new(String::new(), table(&text), scale);
        for [plain, rounded] in [
            [file(1, &vertical, &horizontal, at), file(1, &beyond, &horizontal, at)],
            [
                file(2, &steps(-90.0, 90.0, 6), &sides, aside),
                file(2, &steps(-90.0, 90.0, 6), &wider, aside),
            ],
        ] {
            let (plain, rounded) = (of(plain), of(rounded));
            let [a, b] = [&plain, &rounded].map(IesProfile::mean);
            assert!((a - b).abs() <= 1e-6 * a, "{scale}: {a}, {b}");
            assert!(rounded.lit().half_angle_rad.is_finite());
            for theta in steps(0.0, 180.0, 12) {
                let to = direction(theta, 30.0);
                assert!(near(rounded.factor(to), plain.factor(to).into()), "{scale}, {theta}");
            }
        }
    }
}
