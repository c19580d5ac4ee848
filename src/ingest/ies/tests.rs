mod means;

use super::*;
use crate::scene::IesProfile;
use glam::DVec3;
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A file of 1995; intensities by vertical and horizontal angle, degrees.
fn file(
    kind: u8,
    vertical: &[f64],
    horizontal: &[f64],
    candela: impl Fn(f64, f64) -> f64,
) -> String {
    let words = |list: &[f64]| list.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let mut text = format!(
        "IESNA:LM-63-1995\n[TEST] a test\nTILT=NONE\n1 -1 2 {} {} {kind} 2 0 0 0\n0.5 7 100\n{}\n{}\n",
        vertical.len(),
        horizontal.len(),
        words(vertical),
        words(horizontal),
    );
    for &h in horizontal {
        let row: Vec<f64> = vertical.iter().map(|&v| candela(v, h)).collect();
        text += &format!("{}\n", words(&row));
    }
    text
}

fn steps(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|i| from + (to - from) * i as f64 / count as f64).collect()
}

fn table(text: &str) -> IesTable {
    read(text).unwrap().table
}

fn profile(text: &str) -> IesProfile {
    IesProfile::new("test.ies".into(), table(text), 0.0)
}

/// A direction of a light at an angle off its nadir (-Z) and about it, from -X towards -Y, degrees.
fn direction(theta: f64, phi: f64) -> DVec3 {
    let ((sin, cos), (sine, cosine)) = (theta.to_radians().sin_cos(), phi.to_radians().sin_cos());
    DVec3::new(-sin * cosine, -sin * sine, -cos)
}

fn near(value: f32, expected: f64) -> bool {
    (f64::from(value) - expected).abs() <= 1e-5 * expected.abs() + 1e-6
}

#[test]
fn type_c_has_its_nadir_along_minus_z_and_counts_from_minus_x_towards_minus_y() {
    let at = |v: f64, h: f64| 100.0 + v + 7.0 * h.min(360.0 - h);
    let web = profile(&file(1, &steps(0.0, 180.0, 18), &steps(0.0, 360.0, 36), at));
    for (toward, v, h) in [
        (DVec3::NEG_X, 90.0, 0.0),
        (DVec3::NEG_Y, 90.0, 90.0),
        (DVec3::X, 90.0, 180.0),
        (DVec3::Y, 90.0, 270.0),
    ] {
        assert!(near(web.factor(toward), at(v, h)), "{toward}");
    }
    assert!(
        near(web.factor(DVec3::Z), at(180.0, 0.0)) && near(web.factor(DVec3::NEG_Z), at(0.0, 0.0))
    );
    assert!(near(web.factor(direction(90.0, 120.0)), at(90.0, 120.0)));
    // Bilinear in between; the seam is closed from both sides.
    assert!(near(web.factor(direction(33.0, 57.0)), at(33.0, 57.0)));
    let seam = [-1e-12, 0.0, 1e-12].map(|h| web.factor(direction(60.0, h)));
    assert!(seam.iter().all(|&value| near(value, at(60.0, 0.0))), "{seam:?}");
}

#[test]
fn symmetric_files_are_those_that_name_every_plane() {
    let v = steps(0.0, 90.0, 9);
    // Symmetric about 0-180, about 90-270, and in quadrants.
    let bilateral = |_: f64, h: f64| 10.0 + h.min(360.0 - h);
    let other = |_: f64, h: f64| 10.0 + ((h + 90.0) % 360.0).min(360.0 - (h + 90.0) % 360.0);
    let quadrant = |_: f64, h: f64| 10.0 + (h % 180.0).min(180.0 - h % 180.0);
    let whole = steps(0.0, 360.0, 36);
    let pairs = [
        (file(1, &v, &steps(0.0, 180.0, 18), bilateral), file(1, &v, &whole, bilateral)),
        (file(1, &v, &steps(90.0, 270.0, 18), other), file(1, &v, &whole, other)),
        (file(1, &v, &steps(0.0, 90.0, 9), quadrant), file(1, &v, &whole, quadrant)),
        (file(1, &v, &whole[..36], bilateral), file(1, &v, &whole, bilateral)),
        (file(1, &v, &[0.0], |v, _| v), file(1, &v, &whole, |v, _| v)),
    ];
    for (number, (short, long)) in pairs.iter().enumerate() {
        let (short, long) = (profile(short), profile(long));
        for h in 0..72 {
            for theta in [0.0, 20.0, 33.3, 89.0, 91.0] {
                let toward = direction(theta, 5.1 * f64::from(h));
                let (short, long) = (short.factor(toward), long.factor(toward));
                assert!(near(short, long.into()), "{number}: {theta} {h}: {short} {long}");
            }
        }
    }
}

/// Type A: the horizon is where the angles begin; type B: planes about a horizontal axis.
#[test]
fn types_a_and_b_have_the_axes_of_the_standard() {
    let all = steps(-90.0, 90.0, 18);
    let at = |v: f64, h: f64| 1000.0 + v + 3.0 * h;
    let a = profile(&file(3, &all, &all, at));
    assert!(
        near(a.factor(DVec3::NEG_X), at(0.0, 0.0)) && near(a.factor(DVec3::NEG_Z), at(-90.0, 0.0))
    );
    // Clockwise from above: towards +Y.
    assert!(near(a.factor(direction(90.0, -40.0)), at(0.0, 40.0)));
    assert!(near(a.factor(direction(60.0, 40.0)), at(-30.0, -40.0)));
    assert_eq!(a.factor(DVec3::X), 0.0);
    let b = profile(&file(2, &all, &all, at));
    assert!(
        near(b.factor(DVec3::NEG_Z), at(0.0, 0.0)) && near(b.factor(DVec3::NEG_X), at(90.0, 0.0))
    );
    assert!(near(b.factor(DVec3::Y), at(0.0, 90.0)) || near(b.factor(DVec3::Y), at(-90.0, 90.0)));
    let (v, h) = (20f64.to_radians(), 30f64.to_radians());
    let toward = h.cos() * (v.cos() * DVec3::NEG_Z + v.sin() * DVec3::NEG_X) + h.sin() * DVec3::Y;
    assert!(near(b.factor(toward), at(20.0, 30.0)), "{}", b.factor(toward));
    assert_eq!(b.factor(DVec3::Z), 0.0);
    // Files that begin at 0 are the same on the other side.
    for kind in [2, 3] {
        let half = profile(&file(kind, &all, &steps(0.0, 90.0, 9), |v, h| 500.0 + v + h));
        for toward in [direction(50.0, 20.0), direction(80.0, 60.0)] {
            let other = DVec3::new(toward.x, -toward.y, toward.z);
            assert!(
                half.factor(toward) > 0.0 && near(half.factor(toward), half.factor(other).into())
            );
        }
    }
}

/// Type B with both angles from 0 to 90, as it is with all of them; type A's verticals are those that it names.
#[test]
fn type_b_is_the_same_on_all_sides_of_what_begins_at_0() {
    let (half, all) = (steps(0.0, 90.0, 9), steps(-90.0, 90.0, 18));
    let at = |v: f64, h: f64| 1000.0 - 4.0 * v.abs() - 3.0 * h.abs() + 0.01 * v.abs() * h.abs();
    let whole = profile(&file(2, &all, &all, at));
    for (v, h) in [(&half, &half), (&half, &all), (&all, &half)] {
        let web = profile(&file(2, v, h, at));
        for phi in 0..72 {
            for theta in [0.0, 20.0, 33.3, 60.0, 89.0] {
                let toward = direction(theta, 5.1 * f64::from(phi));
                let (own, expected) = (web.factor(toward), whole.factor(toward));
                assert!(own > 0.0 && near(own, expected.into()), "{toward}: {own} {expected}");
            }
        }
        assert_eq!(web.factor(DVec3::Z), 0.0);
    }
    // Verticals that begin beside 0 are those that there are; those that begin about 0 ascend.
    let one_side = profile(&file(2, &steps(10.0, 90.0, 8), &half, at));
    assert_eq!(one_side.factor(direction(50.0, 180.0)), 0.0);
    assert!(one_side.factor(direction(50.0, 0.0)) > 0.0);
    let rounded = table(&file(2, &[-0.005, 0.003, 45.0, 90.0], &[-0.004, 0.002, 90.0], at));
    for angles in [rounded.around_rad, rounded.polar_rad] {
        assert!(angles.len() > 3 && angles.windows(2).all(|two| two[0] < two[1]), "{angles:?}");
    }
    let upward = profile(&file(3, &half, &all, at));
    assert_eq!(upward.factor(direction(60.0, 0.0)), 0.0);
    assert!(upward.factor(direction(120.0, 0.0)) > 0.0);
}

#[test]
fn a_cosine_has_its_flux_in_every_type() {
    // I = cos of the angle off the nadir: flux pi.
    let c = table(&file(1, &steps(0.0, 90.0, 90), &[0.0], |v, _| v.to_radians().cos()));
    let b = table(&file(2, &steps(-90.0, 90.0, 180), &steps(-90.0, 90.0, 180), |v, h| {
        v.to_radians().cos() * h.to_radians().cos()
    }));
    let a = table(&file(3, &steps(-90.0, 0.0, 90), &steps(-90.0, 90.0, 180), |v, _| {
        -v.to_radians().sin()
    }));
    let expected = [PI, PI, PI / 2.0];
    for (table, expected) in [c, b, a].iter().zip(expected) {
        let (flux, _) = table.integral();
        assert!((flux / expected - 1.0).abs() < 2e-4, "{flux} {expected}");
    }
}

#[test]
fn the_integral_of_a_bilinear_table_is_exact() {
    // 5 + 2 theta - phi over all directions, with patches of very different sizes.
    let (v, h) = ([0.0, 1e-4, 3.0, 90.0, 179.0, 180.0], [0.0, 0.5, 200.0, 360.0]);
    let (flux, is_sphere) =
        table(&file(1, &v, &h, |v, h| 7.0 + 2.0 * v.to_radians() - h.to_radians())).integral();
    let expected = 4.0 * PI * 7.0 + TAU * 2.0 * PI - 2.0 * TAU * PI;
    assert!(is_sphere && (flux / expected - 1.0).abs() < 1e-6, "{flux} {expected}");
}

#[test]
fn the_scale_of_angles_is_usds() {
    let text = file(1, &steps(0.0, 180.0, 180), &[0.0], |v, _| 1.0 + v);
    let scaled = |scale: f32| IesProfile::new(String::new(), table(&text), scale);
    let cases: [(f32, f64, f64); 8] = [
        (0.0, 50.0, 50.0),
        (0.5, 50.0, 100.0),
        (0.5, 120.0, 180.0),
        (2.0, 50.0, 25.0),
        (-0.5, 150.0, 120.0),
        (-0.5, 50.0, 0.0),
        (-2.0, 60.0, 120.0),
        (-1.0, 33.0, 33.0),
    ];
    for (scale, theta, ies) in cases {
        for phi in [0.0, 100.0, 270.0] {
            let value = scaled(scale).factor(direction(theta, phi));
            assert!(near(value, 1.0 + ies), "{scale} {theta}: {value} {ies}");
        }
    }
    // The schema's example: a cone of 60 degrees becomes one of 30.
    let spot = file(1, &[0.0, 29.9, 30.0, 90.0], &[0.0], |v, _| if v < 30.0 { 1.0 } else { 0.0 });
    let half = IesProfile::new(String::new(), table(&spot), 0.5);
    assert!(half.factor(direction(14.9, 0.0)) > 0.99 && half.factor(direction(15.1, 0.0)) == 0.0);
    assert!((half.lit().half_angle_rad - 15f64.to_radians()).abs() < 1e-4);
}

#[test]
fn editions_differ_in_the_factor_of_ballast_and_lamp() {
    let text = |first: &str| {
        format!("{first}\nTILT=NONE\n1 1000 2 2 1 1 1 0 0 0\n0.5 0.25 60\n0 90\n0\n100 50\n")
    };
    for first in ["IESNA:LM-63-1995", "IESNA:LM-63-2002", "IES:LM-63-2019", "IESNA:LM-63-02"] {
        assert_eq!(table(&text(first)).values, [100.0, 50.0], "{first}");
    }
    for first in ["IESNA91", "a lamp of 1995", "IESNA:LM-63-1991"] {
        assert_eq!(table(&text(first)).values, [25.0, 12.5], "{first}");
    }
}

#[test]
fn real_files_break_lines_anywhere_and_may_have_a_tilt() {
    let text = "\u{feff}a lamp\r\nof 1986\r\n tilt=include\r\n1\r\n3\r\n0 90,180\r\n1 1 1\r\n1,1000 1 2\r\n1 1 1 0 0 \
                0\r\n1 1\r\n60 0\r\n\r\n90\r\n0 100 50\r\n\u{1a}";
    let found = read(text).unwrap();
    assert_eq!((found.table.values.as_slice(), found.notes.len()), ([100.0, 50.0].as_slice(), 0));
    let tilted = text.replace("1 1 1\r\n1,1000", "1 .9 .8\r\n1,1000");
    assert_eq!(read(&tilted).unwrap().notes, ["how its lamp depends on tilt is left out"]);
    let beside = "TILT=lamp.tlt\n1 1 1 2 1 1 1 0 0 0 1 1 1 0 90 0 5 -3";
    let found = read(beside).unwrap();
    assert_eq!((found.table.values, found.notes.len()), (vec![5.0, 0.0], 2));
}

#[test]
fn what_cannot_be_told_is_refused_with_its_line() {
    let good = "IESNA91\nTILT=NONE\n1 1000 1 2 2 1 1 0 0 0\n1 1 60\n0 90\n0 90\n1 2\n3 4\n";
    assert!(read(good).is_ok());
    let change = |from: &str, to: &str| good.replacen(from, to, 1);
    let cases = [
        (String::new(), "no line TILT="),
        (change("TILT=NONE", "NO TILT"), "no line TILT="),
        (change("TILT=NONE", "TILT=INCLUDE"), "it ends where an angle of tilt should be"),
        (change("1 2 2 1 1 0", "1 -2 2 1 1 0"), "line 3: vertical angles: -2"),
        (change("1 2 2 1 1 0", "1 2 0 1 1 0"), "line 3: horizontal angles: 0"),
        (change("1 2 2 1 1 0", "1 2.5 2 1 1 0"), "2.5 is not a whole number"),
        (change("1 2 2 1 1 0", "1 60000 60000 1 1 0"), "promises 60000 x 60000"),
        (change("1 2 2 1 1 0", "1 1e99 2 1 1 0"), "vertical angles"),
        (change("1 2 2 1 1 0", "1 2 2 4 1 0"), "photometric type: 4"),
        (change("1000 1 2 2", "1000 -1 2 2"), "negative or no number"),
        (change("1000 1 2 2", "1000 1e300 2 2"), "line 7: an intensity is beyond"),
        (change("1000 1 2 2", "1000 NaN 2 2"), "line 3: \"NaN\""),
        (change("1 1 60", "inf 1 60"), "line 4: \"inf\""),
        (change("0 90\n0 90", "90 0\n0 90"), "line 5: a vertical angle, 0, does not ascend"),
        (change("0 90\n0 90", "0 190\n0 90"), "vertical angle 190"),
        (change("0 90\n0 90", "0 90\n0 45"), "horizontal angles go from 0 to 45"),
        (change("3 4", "3"), "it ends where an intensity should be"),
        (change("3 4", "3 x4"), "line 8: \"x4\""),
        (
            change("1 2 2 1 1 0", "1 2 1 2 1 0").replacen("0 90\n0 90", "0 90\n0", 1),
            "types A and B",
        ),
    ];
    for (text, expected) in cases {
        let problem = read(&text).unwrap_err();
        assert!(problem.contains(expected), "{text}\n{problem}");
    }
}

proptest! {
    /// No bytes panic, and nothing that is read is other than its promise.
    #[test]
    fn any_numbers_are_read_or_refused(
        kind in 0u8..5, counts in prop::array::uniform2(-1i64..6), tail in prop::collection::vec(
            prop_oneof![(-200i32..400).prop_map(f64::from), any::<f64>()], 0..60),
        tilt in prop_oneof![Just("NONE"), Just("INCLUDE")], noise in ".{0,12}",
    ) {
        let tail: Vec<String> = tail.iter().map(f64::to_string).collect();
        let [v, h] = counts;
        let text = format!("TILT={tilt}\n1 1 1 {v} {h} {kind} 1 0 0 0 1 1 1 {}{noise}", tail.join(" "));
        if let Ok(Photometry { table, .. }) = read(&text) {
            prop_assert_eq!(table.values.len(), table.polar_rad.len() * table.around_rad.len());
            prop_assert!(table.values.iter().all(|value| value.is_finite() && *value >= 0.0));
            let web = IesProfile::new(String::new(), table, 0.3);
            prop_assert!(web.mean().is_finite() && web.factor(DVec3::X).is_finite());
        }
    }

    /// Outside its lit cone a profile is dark, whatever its type and scale; and the cone is no wider than it must be
    /// where all of a round beam is known.
    #[test]
    fn the_lit_cone_holds_all_light(
        kind in 1u8..4, lit in prop::collection::vec(prop::bool::weighted(0.2), 49),
        scale in prop_oneof![Just(0f32), 0.2f32..3.0, -3f32..-0.2], (theta, phi) in (0.0..180.0, 0.0..360.0),
    ) {
        let (v, h) = match kind {
            1 => (steps(0.0, 180.0, 6), steps(0.0, 360.0, 6)),
            _ => (steps(-90.0, 90.0, 6), steps(-90.0, 90.0, 6)),
        };
        let at = |list: &[f64], angle: f64| list.iter().position(|&own| own == angle).unwrap();
        let text = file(kind, &v, &h, |a, b| f64::from(u8::from(lit[7 * at(&v, a) + at(&h, b)])));
        let web = IesProfile::new(String::new(), table(&text), scale);
        let toward = direction(theta, phi);
        let cone = web.lit();
        let off = cone.axis.cross(toward).length().atan2(cone.axis.dot(toward));
        prop_assert!(web.factor(toward) == 0.0 || off <= cone.half_angle_rad, "{off} {cone:?}");
    }
}
