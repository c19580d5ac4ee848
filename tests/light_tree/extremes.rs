//! Lights and receivers as unkind as they come, and what is promised all the same. The worst of each is
//! written down in `docs/extremes.md` by `scripts/extremes.sh`.

use crate::invariance::{
    receivers, scattered, worst_by_axes, worst_by_energy, worst_by_scale, worst_by_shift,
};
use crate::measure::Worst;
use crate::scenes::{SunWorst, worst_of_suns};
use crate::support::with_tree;
use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::Receiver;
use candelabra::math::random::hash;
use glam::Vec3;
use std::fmt::Write;
use std::io::Write as _;

/// Declares cases: a test of each, which asserts that all promises are kept, and the list of all.
macro_rules! cases {
    ($($name:ident: $what:literal, $lights:expr, $receivers:expr;)*) => {
        $(#[test] fn $name() { Worst::of(&$lights, &$receivers).assert_exact(); })*

        /// What each case is, and the worst found in it.
        fn all_cases() -> Vec<(&'static str, Worst)> {
            vec![$(($what, Worst::of(&$lights, &$receivers)),)*]
        }
    };
}

cases! {
    a_million_coincident_lights: "a million lights in one point",
        vec![point(Vec3::ONE, 1.0); 1_000_000], one();
    a_million_scattered_lights: "a million lights in a box",
        (0..1_000_000).map(|i| point(random(i), 1.0)).collect::<Vec<_>>(), one();
    lights_on_the_x_axis: "4096 lights on the x axis", line(Vec3::X), receivers();
    lights_on_the_y_axis: "4096 lights on the y axis", line(Vec3::Y), receivers();
    lights_on_the_z_axis: "4096 lights on the z axis", line(Vec3::Z), receivers();
    lights_on_a_slanted_line: "4096 lights on a slanted line", line(Vec3::new(0.3, -0.5, 0.8)), receivers();
    lights_in_the_xy_plane: "4096 faces in the xy plane", plane([0, 1, 2]), receivers();
    lights_in_the_yz_plane: "4096 faces in the yz plane", plane([1, 2, 0]), receivers();
    lights_in_the_zx_plane: "4096 faces in the zx plane", plane([2, 0, 1]), receivers();
    degenerate_triangles: "triangles without area, and needles 1e-6 as wide as long",
        degenerate(), receivers();
    energies_of_sixty_decades: "energies from 1e-30 to 1e30",
        (0..3000).map(|i| point(random(i), decades(i, 3000, -30, 30))).collect::<Vec<_>>(), receivers();
    a_micrometre_and_a_megametre: "lights of 1e-6 m and of 1e6 m side by side",
        small_and_large(), receivers();
    far_from_the_origin: "a scene of 1 km, 1e7 m from the origin", far(), far_receivers();
    on_an_emitter: "receivers on an emitter, in its plane, at a cluster's centre, in every box",
        around_the_origin(), awkward_receivers();
    deeper_than_64: "a chain of lights, each 1 % farther and brighter than the last",
        chain(), [Receiver { point: Vec3::ZERO, normal: Vec3::X }, in_medium(Vec3::X), in_medium(Vec3::ZERO)];
    a_single_light: "one light", [point(Vec3::ONE, 1.0)], receivers();
}

fn point(p: Vec3, energy: f32) -> LightBounds {
    LightBounds::of_emitter(Aabb::around([p]), Cone::ALL, energy, f32::INFINITY)
}

/// A point of the cube from -1 to 1.
fn random(i: u32) -> Vec3 {
    let of = |n: u32| hash(i, n) as f32 / u32::MAX as f32 * 2.0 - 1.0;
    Vec3::new(of(0), of(1), of(2))
}

/// The powers of ten between two exponents, one after the other.
fn decades(i: u32, count: u32, from: i32, to: i32) -> f32 {
    let part = f64::from(i) / f64::from(count - 1);
    10f64.powf(f64::from(from) + part * f64::from(to - from)) as f32
}

fn in_medium(point: Vec3) -> Receiver {
    Receiver { point, normal: Vec3::ZERO }
}

/// One receiver: for trees that take long to sum.
fn one() -> [Receiver; 1] {
    [Receiver { point: Vec3::new(0.3, 0.2, -1.5), normal: Vec3::new(0.6, 0.0, 0.8) }]
}

fn line(along: Vec3) -> Vec<LightBounds> {
    (0..4096).map(|i| point(along * random(i).x, 1.0)).collect()
}

/// Faces of 1 mm, of both sides or one.
fn plane([u, v, w]: [usize; 3]) -> Vec<LightBounds> {
    let face = |i: u32| {
        let (mut min, mut normal) = (Vec3::ZERO, Vec3::ZERO);
        (min[u], min[v], normal[w]) = (random(i).x, random(i).y, 1.0);
        let mut max = min;
        (max[u], max[v]) = (min[u] + 1e-3, min[v] + 1e-3);
        let cone = Cone::flat(normal, i.is_multiple_of(2));
        LightBounds::of_emitter(Aabb { min, max }, cone, 1.0, f32::INFINITY)
    };
    (0..4096).map(face).collect()
}

/// Triangles as ingest gives them: those without an area keep the least energy there is and a made-up
/// normal.
fn degenerate() -> Vec<LightBounds> {
    let triangle = |i: u32| {
        let (a, b) = (random(i), random(i) + 0.1 * random(!i));
        let c = match i % 4 {
            0 => a,
            1 => a + 0.5 * (b - a),
            2 => b + 1e-6 * random(i + 7),
            _ => b + 0.1 * random(i + 7),
        };
        let area_normal = (b - a).cross(c - a);
        let cone = Cone::flat(area_normal.normalize_or(Vec3::Z), false);
        let energy = (0.5 * area_normal.length()).max(f32::MIN_POSITIVE);
        LightBounds::of_emitter(Aabb::around([a, b, c]), cone, energy, f32::INFINITY)
    };
    (0..2000).map(triangle).collect()
}

fn small_and_large() -> Vec<LightBounds> {
    let light = |i: u32| {
        let size = decades(i, 600, -6, 6);
        let place = random(i) * if i.is_multiple_of(2) { 1.0 } else { size };
        let aabb = Aabb { min: place, max: place + size };
        LightBounds { aabb, energy: size * size, ..point(place, 1.0) }
    };
    (0..600).map(light).collect()
}

/// A place where numbers are 1 m apart.
const FAR: Vec3 = Vec3::new(1e7, -7e6, 8e6);

fn far() -> Vec<LightBounds> {
    let faces = scattered(2000, 5, true);
    let shifted = |b: &LightBounds| LightBounds {
        aabb: Aabb { min: 500.0 * b.aabb.min + FAR, max: 500.0 * b.aabb.max + FAR },
        ..*b
    };
    faces.iter().map(shifted).collect()
}

fn far_receivers() -> Vec<Receiver> {
    let shifted = |r: Receiver| Receiver { point: 500.0 * r.point + FAR, ..r };
    receivers().into_iter().map(shifted).collect()
}

/// Boxes and faces that all hold the origin, some of them with a corner there.
fn around_the_origin() -> Vec<LightBounds> {
    let light = |i: u32| {
        let half = random(i).abs();
        let aabb = match i % 3 {
            0 => Aabb { min: -half, max: half },
            1 => Aabb { min: Vec3::ZERO, max: half },
            _ => {
                Aabb { min: -half * Vec3::new(1.0, 1.0, 0.0), max: half * Vec3::new(1.0, 1.0, 0.0) }
            }
        };
        let cone = if i % 3 == 2 { Cone::flat(Vec3::Z, false) } else { Cone::ALL };
        LightBounds::of_emitter(aabb, cone, 1.0, f32::INFINITY)
    };
    (0..500).map(light).collect()
}

fn awkward_receivers() -> Vec<Receiver> {
    let points =
        [Vec3::ZERO, Vec3::splat(1e-30), Vec3::new(0.5, 0.0, 0.0), Vec3::new(0.9, 0.9, 0.0)];
    let normals = [Vec3::ZERO, Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(0.6, 0.0, -0.8)];
    let all = points.iter().flat_map(|&point| normals.map(|normal| Receiver { point, normal }));
    all.collect()
}

/// Cuts of such a chain part few lights from all others: the tree gets deeper than any word has bits.
fn chain() -> Vec<LightBounds> {
    let (mut x, mut energy) = (1e-44f64, 1e-37f64);
    let mut chain = Vec::new();
    while x < 1e18 && energy < 1e36 {
        chain.push(point(Vec3::X * x as f32, energy as f32));
        (x, energy) = (x * 1.01, energy * 1.01);
    }
    chain
}

#[test]
fn chains_of_lights_make_trees_deeper_than_64() {
    assert!(Worst::of(&chain(), &[in_medium(Vec3::ZERO)]).depth > 64);
}

#[test]
fn without_lights_nothing_is_picked() {
    with_tree(&[], |tree| {
        let receiver = in_medium(Vec3::ZERO);
        assert!(tree.sample(&receiver, 0.5).is_none() && tree.root().is_none());
        assert_eq!((tree.total_importance(&receiver), tree.unforced_count()), (0.0, 0));
    });
}

#[test]
fn what_is_not_a_number_is_refused() {
    let sound = point(Vec3::ONE, 1.0);
    assert!(sound.is_sound());
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let aabb = Aabb { max: Vec3::new(1.0, bad, 1.0), ..sound.aabb };
        let cone = Cone { axis: Vec3::new(bad, 0.0, 0.0), ..sound.cone };
        for broken in [
            LightBounds { aabb, ..sound },
            LightBounds { aabb: Aabb { min: Vec3::splat(bad), ..sound.aabb }, ..sound },
            LightBounds { cone, ..sound },
            LightBounds { cone: Cone { theta_o: bad, ..sound.cone }, ..sound },
            LightBounds { cone: Cone { theta_e: bad, ..sound.cone }, ..sound },
            LightBounds { energy: bad, ..sound },
        ] {
            assert!(!broken.is_sound(), "{broken:?}");
        }
    }
    for range_m in [f32::NAN, 0.0, -1.0] {
        assert!(!LightBounds { range_m, ..sound }.is_sound());
    }
    for energy in [0.0, -1.0] {
        assert!(!LightBounds { energy, ..sound }.is_sound());
    }
}

/// The least power of ten for which something fails, if it does.
fn first_failure(exponents: std::ops::Range<i32>, fails: impl Fn(f32) -> bool) -> Option<i32> {
    exponents.into_iter().find(|&exponent| fails(10f32.powi(exponent)))
}

/// Squared distances leave the range of `f32`.
fn dark_at_distance(distance: f32) -> bool {
    with_tree(&[point(Vec3::X * distance, 1.0)], |tree| {
        tree.sample(&in_medium(Vec3::ZERO), 0.5).is_none()
    })
}

#[test]
fn lights_shine_as_far_as_squares_of_distances_are_numbers() {
    assert_eq!(first_failure(0..39, dark_at_distance), Some(20));
}

/// Rewrites the page, if the environment says so.
#[test]
fn the_page_of_extremes_is_rewritten_when_asked() {
    if std::env::var_os("CANDELABRA_EXTREMES").is_none() {
        return;
    }
    let mut page = String::from(
        "# Extremes\n\n\
         Written by `scripts/extremes.sh` from `tests/light_tree/extremes.rs`, which asserts what is promised.\n\n\
         ## Lights and receivers\n\n\
         The worst over all receivers of a case. *sum*: off one, the sum of all probabilities and of the\n\
         probability of nothing. *told*: off one, what a pick says of its probability or its expected\n\
         count over what is told of its light. *frequency*: by how many of 16384 evenly drawn picks a\n\
         light is off its probability (up to 1 is exact). *dark*: lights called dark that could light the\n\
         receiver. *cap*: picks above `most`.\n\n\
         | case | lights | depth | sum | told | frequency | dark | cap |\n|---|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for (what, worst) in all_cases() {
        let Worst { lights, depth, sum, told, frequency, dark, beyond_cap } = worst;
        writeln!(
            page,
            "| {what} | {lights} | {depth} | {sum:.0e} | {told:.0e} | {frequency:.3} | {dark} | {beyond_cap} |"
        )
        .unwrap();
    }
    page.push_str(
        "\n## What must not show\n\n\
         Which part of the samples, in the mean, goes to other lights when the scene is changed so: over\n\
         150 lights of about 2 cm in a box of 2 m, at 24 receivers, split or not; the worst of all.\n\n\
         | change | moved |\n|---|--:|\n",
    );
    let mut row = |what: String, moved: f64| writeln!(page, "| {what} | {moved:.0e} |").unwrap();
    for exponent in [-6, -3, 3, 6] {
        row(format!("lengths times 1e{exponent}"), worst_by_scale(10f32.powi(exponent)));
    }
    for exponent in [-30, 30] {
        row(format!("energies times 1e{exponent}"), worst_by_energy(10f32.powi(exponent)));
    }
    row("axes swapped and mirrored, lights of one side".into(), worst_by_axes(false));
    row("axes swapped and mirrored, some lights of both sides".into(), worst_by_axes(true));
    for exponent in [1, 2, 3, 4, 5] {
        let shift = 10f32.powi(exponent);
        row(format!("moved by 1e{exponent} m"), worst_by_shift(shift, false));
        row(format!("moved by 1e{exponent} m, no digit lost"), worst_by_shift(shift, true));
    }
    page.push_str(
        "\n## Suns\n\n\
         Fifty places of the sky, 4096 samples each. *irradiance*: off one, what the samples bring over\n\
         what the sun gives. *missed*: the part of the samples that the sun does not own up to as a\n\
         direction towards it.\n\n\
         | full angle, rad | irradiance | missed |\n|--:|--:|--:|\n",
    );
    for angle in [1e-2, 1e-3, 1e-4, 1e-5] {
        let SunWorst { irradiance, missed } = worst_of_suns(angle);
        let missed = missed as f64 / (50.0 * 4096.0);
        writeln!(page, "| {angle:.0e} | {irradiance:.0e} | {missed:.0e} |").unwrap();
    }
    let shifted = first_failure(0..8, |shift| worst_by_shift(shift, false) > 0.01);
    let dark = first_failure(0..39, dark_at_distance);
    page.push_str("\n## Where numbers end\n\n| promise | kept up to |\n|---|---|\n");
    let below = |exponent: Option<i32>| exponent.map_or("all".into(), |e| format!("1e{} m", e - 1));
    writeln!(
        page,
        "| moving a scene of 2 m moves less than 1 % of the samples | {} |",
        below(shifted)
    )
    .unwrap();
    writeln!(page, "| a light that shines on a receiver is found by it | {} |", below(dark))
        .unwrap();
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/docs");
    let mut file = tempfile::NamedTempFile::new_in(folder).unwrap();
    file.write_all(page.as_bytes()).unwrap();
    file.persist(format!("{folder}/extremes.md")).unwrap();
}
