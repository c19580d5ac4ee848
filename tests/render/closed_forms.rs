//! Direct light against formulas: `L = E albedo / pi` on a small receiver.

use crate::stage::{Stage, aimed, at, direct, facing, glow, lambert, picture, scaled};
use crate::statistics::assert_even;
use candelabra::render::RenderSettings;
use candelabra::scene::{AlphaMode, IesProfile, IesTable, LightKind, Material, Pole, Shaping};
use glam::{DVec3, Vec3};
use std::f64::consts::{FRAC_PI_3, PI};

/// Of the receiver.
pub const ALBEDO: f64 = 0.8;

/// A small receiver at the origin, seen from an angle and from near by, so that nothing which shines
/// on it stands in the way.
pub fn receiver(normal: DVec3) -> Stage {
    let mut stage = Stage::default();
    stage.quad([0.02; 2], lambert(Vec3::splat(ALBEDO as f32)), facing(DVec3::ZERO, normal));
    stage.look(0.1 * (normal + 0.8 * normal.any_orthonormal_vector()), DVec3::ZERO, 1e-2);
    stage
}

/// Asserts the irradiance of the receiver, by both ways of finding light and by one alone.
#[track_caller]
pub fn assert_irradiance(what: &str, stage: &Stage, expected_lux: f64) {
    for mis in [true, false] {
        let buffers = stage.render(&RenderSettings { mis, ..direct(8, 1024) });
        let way = if mis { "both ways" } else { "picking alone" };
        assert_even(&format!("{what}, {way}"), &buffers, expected_lux * ALBEDO / PI, 0.004);
    }
}

#[track_caller]
pub fn assert_dark(what: &str, stage: &Stage) {
    let buffers = stage.render(&direct(4, 256));
    assert!(buffers.beauty().all(|beauty| beauty == Vec3::ZERO), "{what} is not dark");
}

/// Irradiance from a polygon of radiance 1 that a receiver at the origin sees above its horizon
/// (Lambert 1760), zero from the polygon's back.
pub fn of_polygon(corners: &[DVec3], normal: DVec3) -> f64 {
    let mut above = Vec::new();
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        let (height_a, height_b) = (a.dot(normal), b.dot(normal));
        if height_a > 0.0 {
            above.push(a);
        }
        if (height_a > 0.0) != (height_b > 0.0) {
            above.push(a.lerp(b, height_a / (height_a - height_b)));
        }
    }
    let edge = |i: usize| {
        let (a, b) = (above[i], above[(i + 1) % above.len()]);
        let across = a.cross(b);
        across.normalize().dot(normal) * across.length().atan2(a.dot(b))
    };
    // Corners of the front go around counter-clockwise: seen from there, clockwise to the receiver.
    (-0.5 * (0..above.len()).map(edge).sum::<f64>()).max(0.0)
}

/// Corners of a `size` rectangle that faces from one point to another, as [`facing`] turns it.
pub fn panel([width, height]: [f64; 2], place: DVec3, target: DVec3) -> [DVec3; 4] {
    let turn = glam::DQuat::from_rotation_arc(DVec3::Z, (target - place).normalize());
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[x, y]| place + turn * DVec3::new(0.5 * x * width, 0.5 * y * height, 0.0))
}

/// Irradiance from a sphere of radiance 1: the cosine law above the horizon, and where it dips
/// below the closed form that Quilez gives ("Sphere ambient occlusion", with horizon clipping).
pub fn of_sphere(center: DVec3, radius: f64, normal: DVec3) -> f64 {
    let (cosine, h) = (center.normalize().dot(normal), center.length() / radius);
    let (h2, k2) = (h * h, 1.0 - h * h * cosine * cosine);
    if k2 <= 0.0 {
        return PI * cosine.max(0.0) / h2;
    }
    let angle = (-cosine * ((h2 - 1.0) / (1.0 - cosine * cosine)).sqrt()).acos();
    let inside = cosine * angle - (k2 * (h2 - 1.0)).sqrt();
    inside / h2 + (k2 / (h2 - 1.0)).sqrt().atan()
}

#[test]
fn rectangles_near_and_far_upright_and_tilted() {
    let up = DVec3::Y;
    let tilted = DVec3::new(0.5, 0.7, -0.4).normalize();
    let cases = [
        ("above", [1.0, 1.0], DVec3::Y, DVec3::ZERO, up),
        ("far above", [1.0, 0.5], DVec3::Y * 30.0, DVec3::ZERO, up),
        ("near and long", [8.0, 0.2], DVec3::Y * 0.3, DVec3::ZERO, up),
        ("aside", [1.0, 1.0], DVec3::new(2.0, 1.0, -1.0), DVec3::ZERO, up),
        (
            "aside, turned away",
            [1.0, 1.0],
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::new(0.5, -3.0, 0.0),
            up,
        ),
        ("half below the horizon", [1.0, 2.0], DVec3::new(1.5, 0.2, 0.0), DVec3::ZERO, up),
        ("above a tilted receiver", [1.0, 1.0], DVec3::new(0.5, 1.5, 0.0), DVec3::ZERO, tilted),
        (
            "below a tilted one's horizon",
            [2.0, 2.0],
            DVec3::new(0.0, 0.4, 1.2),
            DVec3::ZERO,
            tilted,
        ),
    ];
    for (what, size, place, target, normal) in cases {
        let mut stage = receiver(normal);
        stage.quad(size.map(|side| side as f32), glow(Vec3::splat(7.0)), facing(place, target));
        assert_irradiance(what, &stage, 7.0 * of_polygon(&panel(size, place, target), normal));
    }
}

#[test]
fn a_panel_shines_from_the_sides_it_should() {
    let (place, away) = (DVec3::new(0.3, 1.0, 0.2), DVec3::new(0.1, 3.0, 0.4));
    let mut back = panel([1.0; 2], place, away);
    back.reverse();
    let expected = of_polygon(&back, DVec3::Y);
    let with = |double_sided, mirror: Vec3| {
        let mut stage = receiver(DVec3::Y);
        let material = Material { double_sided, ..glow(Vec3::ONE) };
        stage.quad([1.0; 2], material, scaled(facing(place, away), mirror.as_dvec3()));
        stage
    };
    assert_dark("a panel from behind", &with(false, Vec3::ONE));
    assert_irradiance("a double-sided panel from behind", &with(true, Vec3::ONE), expected);
    // A mirror in the panel's own plane turns its front over; one across it does not.
    assert_irradiance(
        "a panel turned inside out",
        &with(false, Vec3::new(1.0, 1.0, -1.0)),
        expected,
    );
    assert_dark("a panel mirrored in x", &with(false, Vec3::new(-1.0, 1.0, 1.0)));
    assert_irradiance(
        "a double-sided mirrored panel",
        &with(true, Vec3::new(-1.0, 1.0, 1.0)),
        expected,
    );
}

#[test]
fn a_receiver_is_lit_from_either_side_and_lit_through_by_neither() {
    let light = |stage: &mut Stage| {
        stage.quad([1.0; 2], glow(Vec3::ONE), facing(DVec3::Y, DVec3::ZERO));
    };
    let expected = of_polygon(&panel([1.0; 2], DVec3::Y, DVec3::ZERO), DVec3::Y);
    let mut turned_over = Stage::default();
    turned_over.quad(
        [0.02; 2],
        lambert(Vec3::splat(ALBEDO as f32)),
        facing(DVec3::ZERO, -DVec3::Y),
    );
    turned_over.look(DVec3::new(0.1, 0.1, 0.0), DVec3::ZERO, 1e-2);
    light(&mut turned_over);
    assert_irradiance("a receiver's back", &turned_over, expected);
    let mut from_below = receiver(-DVec3::Y);
    light(&mut from_below);
    assert_dark("the side away from the light", &from_below);
}

#[test]
fn disks_and_spheres() {
    for (radius, height) in [(0.5, 1.0), (2.0, 0.3), (0.01, 1.0)] {
        let mut stage = receiver(DVec3::Y);
        stage.disk(radius as f32, glow(Vec3::splat(3.0)), facing(DVec3::Y * height, DVec3::ZERO));
        let expected = 3.0 * PI * radius * radius / (radius * radius + height * height);
        assert_irradiance(&format!("a disk of {radius} m at {height} m"), &stage, expected);
    }
    let spheres = [
        ("above", DVec3::Y * 2.0, 0.5),
        ("close above", DVec3::Y * 0.38, 0.28),
        ("aside", DVec3::new(1.0, 1.0, 0.5), 0.5),
        ("half below the horizon", DVec3::new(2.0, 0.0, 0.0), 1.0),
        ("mostly below the horizon", DVec3::new(2.0, -0.7, 0.0), 1.0),
        ("small and far", DVec3::new(30.0, 40.0, 0.0), 0.05),
    ];
    for (what, center, radius) in spheres {
        let mut stage = receiver(DVec3::Y);
        // Half the radius is the node's: a light's radius is in local units.
        let kind = LightKind::Sphere {
            radiance_nits: Vec3::splat(5.0),
            radius: 2.0 * radius as f32,
            shaping: None,
        };
        stage.light(kind, scaled(at(center), DVec3::new(0.5, -0.5, 0.5)));
        let expected = 5.0 * of_sphere(center, radius, DVec3::Y);
        assert_irradiance(&format!("a sphere {what}"), &stage, expected);
    }
}

#[test]
fn points_are_candela_over_squared_metres() {
    let intensity_cd = Vec3::splat(90.0);
    for place in [DVec3::Y * 3.0, DVec3::new(-2.0, 1.0, 2.0), DVec3::new(0.0, 300.0, 400.0)] {
        let mut stage = receiver(DVec3::Y);
        stage.light(LightKind::Point { intensity_cd }, at(place));
        let expected = 90.0 * place.normalize().y / place.length_squared();
        assert_irradiance("a point", &stage, expected);
        // glTF: max(1 - (d / range)^4, 0).
        stage.scene.lights[0].range_m = Some(1.25 * place.length() as f32);
        assert_irradiance("with a range", &stage, expected * (1.0 - 0.8f64.powi(4)));
        stage.scene.lights[0].range_m = Some(0.99 * place.length() as f32);
        assert_dark("beyond its range", &stage);
    }
}

#[test]
fn spots_on_the_axis_in_the_ramp_and_outside() {
    let (inner, outer, soft) = (0.3f64, 0.7f64, 0.5f64);
    let khr = Shaping::Khr { inner_rad: inner as f32, outer_rad: outer as f32 };
    let usd = Shaping::Usd {
        cone_rad: outer as f32,
        softness: soft as f32,
        focus: 2.0,
        focus_tint: [0.0; 3],
        profile: None,
    };
    let ramp = |angle: f64| {
        let line = (angle.cos() - outer.cos()) / (inner.cos() - outer.cos());
        line.clamp(0.0, 1.0).powi(2)
    };
    let smooth = |angle: f64| {
        let start = outer * (1.0 - soft);
        let t = ((angle - start) / (outer - start)).clamp(0.0, 1.0);
        angle.cos().powi(2) * (1.0 - t * t * (3.0 - 2.0 * t))
    };
    type Profile<'a> = (&'a str, Shaping, &'a dyn Fn(f64) -> f64);
    let profiles: [Profile; 2] = [("glTF's spot", khr, &ramp), ("USD's shaping", usd, &smooth)];
    let panel_side = 0.01;
    for (what, shaping, profile) in profiles {
        for angle in [0.0, 0.2, 0.45, 0.6, 0.8] {
            // The receiver faces the light, which aims past it by the angle.
            let place = DVec3::Y * 2.0;
            let target = place + DVec3::new(f64::sin(angle), -f64::cos(angle), 0.0);
            let mut spot = receiver(DVec3::Y);
            let intensity_cd = Vec3::splat(10.0);
            spot.light(LightKind::Spot { intensity_cd, shaping }, aimed(place, target));
            let mut sphere = receiver(DVec3::Y);
            let radiance_nits = Vec3::splat(1e4);
            let kind = LightKind::Sphere { radiance_nits, radius: 0.01, shaping: Some(shaping) };
            sphere.light(kind, aimed(place, target));
            // A profile counts from the node's -Z, whatever side the mesh shines from.
            let mut mesh = receiver(DVec3::Y);
            let material = Material { double_sided: true, ..glow(Vec3::splat(1e4)) };
            mesh.quad([panel_side; 2], material, aimed(place, target)).shaping = Some(shaping);
            let factor = profile(angle);
            if factor == 0.0 {
                assert_dark(what, &spot);
                assert_dark(what, &sphere);
                assert_dark(what, &mesh);
                continue;
            }
            let named = |kind: &str| format!("{what} of a {kind} at {angle} rad");
            assert_irradiance(&named("point"), &spot, 10.0 * factor / 4.0);
            let of_sphere = 1e4 * PI * 0.01f64.powi(2) / 4.0;
            assert_irradiance(&named("sphere"), &sphere, of_sphere * factor);
            let of_mesh = 1e4 * f64::from(panel_side).powi(2) * angle.cos() / 4.0;
            assert_irradiance(&named("mesh"), &mesh, of_mesh * factor);
        }
    }
}

/// A photometric profile that is a power of the cosine, on every kind of light that may have one, and however it hangs.
#[test]
fn a_profile_of_cosines_is_a_focus() {
    let fourth = |theta: f64| theta.cos().max(0.0).powi(4);
    let angles: Vec<f64> = (0..=1440).map(|i| PI * f64::from(i) / 1440.0).collect();
    let values = angles.iter().map(|&theta| fourth(theta) as f32).collect();
    let table = IesTable { pole: Pole::Nadir, polar_rad: angles, around_rad: vec![0.0], values };
    let profile = IesProfile::new("cosines.ies".into(), table, 0.0);
    let shaping = |profile, focus| Shaping::Usd {
        cone_rad: PI as f32,
        softness: 0.0,
        focus,
        focus_tint: [0.0; 3],
        profile,
    };
    for angle in [0.3, 1.2] {
        let place = DVec3::Y * 2.0;
        let target = place + DVec3::new(f64::sin(angle), -f64::cos(angle), 0.0);
        // The focus and the profile multiply.
        for (ies, focus) in [(true, 0.0), (false, 4.0), (true, 3.0)] {
            let shaping = shaping(ies.then_some(0), focus);
            let factor = if ies { fourth(angle) } else { 1.0 } * angle.cos().powf(f64::from(focus));
            let lit = |light: &dyn Fn(&mut Stage), expected: f64, kind: &str| {
                let mut stage = receiver(DVec3::Y);
                stage.scene.profiles.push(profile.clone());
                light(&mut stage);
                assert_irradiance(
                    &format!("a {kind} at {angle} rad, {ies} {focus}"),
                    &stage,
                    expected * factor,
                );
            };
            let spot = LightKind::Spot { intensity_cd: Vec3::splat(10.0), shaping };
            lit(
                &|stage| {
                    stage.light(spot.clone(), aimed(place, target));
                },
                10.0 / 4.0,
                "point",
            );
            let radiance_nits = Vec3::splat(1e4);
            let sphere = LightKind::Sphere { radiance_nits, radius: 0.01, shaping: Some(shaping) };
            let of_sphere = 1e4 * PI * 0.01f64.powi(2) / 4.0;
            lit(
                &|stage| {
                    stage.light(sphere.clone(), aimed(place, target));
                },
                of_sphere,
                "sphere",
            );
            let panel = |stage: &mut Stage| {
                let material = Material { double_sided: true, ..glow(radiance_nits) };
                // Sizes, even uneven ones, turn no profile.
                let place = scaled(aimed(place, target), DVec3::new(0.5, 2.0, 1.0));
                stage.quad([0.01; 2], material, place).shaping = Some(shaping);
            };
            lit(&panel, 1e4 * 1e-4 * angle.cos() / 4.0, "panel");
        }
    }
}

#[test]
fn suns_are_lux_on_a_facing_surface() {
    // UsdLux's DistantLight by default: 50,000 nits over 0.53 degrees are 3.3602 lux.
    let angle = 0.53f64.to_radians();
    let lux = 50_000.0 * PI * (0.5 * angle).sin().powi(2);
    assert!((lux - 3.3602).abs() < 1e-4);
    let sun = |angle: f64| LightKind::Distant {
        irradiance_lux: Vec3::splat(lux as f32),
        angle_rad: angle as f32,
    };
    for angle in [angle, 0.0, 1e-4, FRAC_PI_3] {
        for tilt in [0.0f64, 0.7] {
            let mut stage = receiver(DVec3::new(tilt.sin(), tilt.cos(), 0.0));
            stage.light(sun(angle), aimed(DVec3::ZERO, -DVec3::Y));
            assert_irradiance(&format!("a sun of {angle} rad"), &stage, lux * tilt.cos());
        }
    }
    let mut seen = Stage::default();
    seen.light(sun(angle), aimed(DVec3::ZERO, -DVec3::Y));
    seen.look(DVec3::ZERO, DVec3::Y, 1e-3);
    let disk = seen.render(&RenderSettings { depth: 0, ..direct(4, 16) });
    assert_even("the sun's disk", &disk, 50_000.0, 1e-6);
}

#[test]
fn domes_fill_the_sky() {
    for tilt in [0.0, FRAC_PI_3, PI] {
        let normal = DVec3::new(f64::sin(tilt), f64::cos(tilt), 0.0);
        let dome = |texture| LightKind::Dome { radiance_nits: Vec3::splat(2.0), texture };
        let mut even = receiver(normal);
        even.light(dome(None), at(DVec3::ZERO));
        assert_irradiance("a constant dome", &even, 2.0 * PI);
        // White above the horizon, black below: what a tilted roof sees of the sky.
        let mut sky = receiver(normal);
        let above = picture([8, 8], false, |_, y| [f32::from(u8::from(y < 4)); 3]);
        let texture = sky.texture(above).map(|used| used.texture);
        sky.light(dome(texture), at(DVec3::ZERO));
        if tilt == PI {
            assert_dark("a ceiling under the sky", &sky);
        } else {
            assert_irradiance("half a dome", &sky, 2.0 * PI * (1.0 + tilt.cos()) / 2.0);
        }
    }
}

#[test]
fn a_textured_panel_is_the_sum_of_its_texels() {
    const TEXELS: [[f32; 2]; 2] = [[4.0, 0.0], [1.0, 10.0]];
    let (place, target) = (DVec3::new(0.4, 1.0, 0.0), DVec3::ZERO);
    let mut stage = receiver(DVec3::Y);
    let texture = picture([2, 2], false, |x, y| [TEXELS[y as usize][x as usize]; 3]);
    let emission_texture = stage.texture(texture);
    let material = Material { emission_texture, ..glow(Vec3::splat(3.0)) };
    stage.quad([2.0, 1.0], material, facing(place, target));
    let [low_left, low_right, top_right, top_left] = panel([2.0, 1.0], place, target);
    let corner = |u: f64, v: f64| top_left.lerp(top_right, u).lerp(low_left.lerp(low_right, u), v);
    let mut expected = 0.0;
    for (y, row) in TEXELS.iter().enumerate() {
        for (x, texel) in row.iter().enumerate() {
            let (u, v) = (0.5 * x as f64, 0.5 * y as f64);
            let texel_corners = [(u, v + 0.5), (u + 0.5, v + 0.5), (u + 0.5, v), (u, v)];
            let quarter = texel_corners.map(|(u, v)| corner(u, v));
            expected += 3.0 * f64::from(*texel) * of_polygon(&quarter, DVec3::Y);
        }
    }
    assert_irradiance("a textured panel", &stage, expected);
}

/// A pane that covers everything above the receiver, of an alpha mode.
fn under_a_pane(alpha_mode: AlphaMode) -> Stage {
    let mut stage = receiver(DVec3::Y);
    stage.quad([1.0; 2], glow(Vec3::ONE), facing(DVec3::Y, DVec3::ZERO));
    let pane = Material { opacity: 0.4, alpha_mode, ..lambert(Vec3::ZERO) };
    stage.quad([9.0; 2], pane, facing(DVec3::Y * 0.6, DVec3::ZERO));
    stage
}

#[test]
fn cut_outs_let_through_what_they_do_not_cover() {
    let open = of_polygon(&panel([1.0; 2], DVec3::Y, DVec3::ZERO), DVec3::Y);
    assert_irradiance("a blended pane", &under_a_pane(AlphaMode::Blend), 0.6 * open);
    assert_irradiance("a pane below its cut-off", &under_a_pane(AlphaMode::Mask(0.5)), open);
    assert_dark("a pane above its cut-off", &under_a_pane(AlphaMode::Mask(0.3)));
    assert_dark("an opaque pane", &under_a_pane(AlphaMode::Opaque));
    // An emitter that is there by four tenths shines by four tenths.
    let mut stage = receiver(DVec3::Y);
    let blended = Material { opacity: 0.4, alpha_mode: AlphaMode::Blend, ..glow(Vec3::ONE) };
    stage.quad([1.0; 2], blended, facing(DVec3::Y, DVec3::ZERO));
    assert_irradiance("a blended emitter", &stage, 0.4 * open);
}
