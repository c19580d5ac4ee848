//! What a picture of a scene should show.
//!
//! Medians and quantiles decide, never the farthest point: one vertex at 1e6 metres must not make the
//! rest of the scene a dot. A quantile is compared with what lies beyond it by a ratio, so the rules are
//! the same for a scene of a micrometre and for one of a thousand kilometres.

use crate::bounds::Aabb;
use crate::pipeline::frames_of;
use crate::scene::{Mesh, Pose, Scene};
use glam::{DVec3, Vec3};

/// At most so many corners of a mesh are looked at.
const MOST_CORNERS: usize = 1 << 17;
/// At most so many points are framed one by one; of more, the box around them.
const MOST_POINTS: usize = 1 << 18;
/// At most so many moments of a shot are looked at.
const MOST_MOMENTS: usize = 16;
/// A backdrop is so many times as large as all that is in front of it...
const BACKDROP: f32 = 8.0;
/// ...and either no thicker than this share of its size, as a ground is, or far from the rest, as a sky is.
const FLAT: f32 = 0.05;
/// At most so many vertices are asked whether they are far from the rest.
const MOST_VERTICES: usize = 1 << 12;
/// Lights are framed if they are so near to the rest, in diagonals of its box.
const NEAR_LIGHT: f32 = 0.5;

/// What a picture should show.
pub(super) struct Subject {
    /// Points that are to be inside the picture, world space, metres. Never empty.
    pub points: Vec<DVec3>,
    /// The box around them.
    pub bounds: Aabb,
    /// By instance: whether it is part of the subject and no backdrop, stray or empty.
    pub shown: Vec<bool>,
    /// By mesh: a box, in its own space, outside of which are stray vertices only.
    pub reaches: Vec<Aabb>,
}

impl Subject {
    /// Finds the subject of a scene.
    pub fn of(scene: &Scene) -> Subject {
        let at_rest = |mesh: &Mesh| Outline::of(mesh, &mesh.positions);
        let outlines: Vec<Outline> = scene.meshes.iter().map(at_rest).collect();
        let moments = moments(scene);
        // The box of what deforms is that of its shape at each moment.
        let outline_in = |pose: &Pose, mesh: u32| {
            let shape = pose.shape(scene, mesh);
            shape.map(|shape| Outline::of(&scene.meshes[mesh as usize], &shape.positions))
        };
        let mut boxes = vec![Aabb::EMPTY; scene.instances.len()];
        let mut lamps = vec![Aabb::EMPTY; scene.lights.len()];
        each_pose(scene, &moments, |pose| {
            for (instance, bounds) in scene.instances.iter().zip(&mut boxes) {
                let own = outline_in(pose, instance.mesh);
                let outline = own.as_ref().unwrap_or(&outlines[instance.mesh as usize]);
                if !outline.bounds.is_empty() {
                    let placed = outline.bounds.transformed(&pose.world(instance.node));
                    *bounds = bounds.union(&placed);
                }
            }
            for (light, bounds) in scene.lights.iter().zip(&mut lamps) {
                if !light.kind.is_infinite() {
                    let place = Vec3::from(pose.world(light.node).translation);
                    *bounds = bounds.union(&Aabb::around([place]));
                }
            }
        });
        let lamps: Vec<Aabb> = lamps.into_iter().filter(|lamp| !lamp.is_empty()).collect();
        let (shown, lamps) = choose(scene, moments[0], &boxes, &lamps);
        let mut points: Vec<DVec3> = lamps.iter().flat_map(corners).collect();
        let chosen =
            || (0..).zip(&shown).filter(|(_, shown)| **shown).map(|(row, _): (usize, _)| row);
        let outline_of =
            |row: usize| outlines[scene.instances[row].mesh as usize].points.as_slice();
        let count: usize = chosen().map(|row| outline_of(row).len()).sum();
        if count * moments.len() > MOST_POINTS {
            let all = chosen().fold(Aabb::EMPTY, |all, row| all.union(&boxes[row]));
            points.extend(corners(&all));
        } else {
            each_pose(scene, &moments, |pose| {
                for row in chosen() {
                    let world = pose.world(scene.instances[row].node);
                    let own = outline_in(pose, scene.instances[row].mesh);
                    let outline = own.as_ref().map_or(outline_of(row), |own| &own.points);
                    let placed = outline.iter().map(|&point| world.transform_point3(point));
                    points.extend(placed.map(|point| point.as_dvec3()));
                }
            });
        }
        if points.is_empty() {
            points.extend(fog_corners(scene));
        }
        if points.is_empty() {
            points.push(DVec3::ZERO);
        }
        let bounds = Aabb::around(points.iter().map(|point| point.as_vec3()));
        let reaches = outlines.iter().map(Outline::reach).collect();
        Subject { points, bounds, shown, reaches }
    }

    /// The middle of it, world space, metres.
    pub fn middle(&self) -> DVec3 {
        self.bounds.center().as_dvec3()
    }

    /// Half its diagonal, metres, and never zero: a metre if it is a point, and more than what rounding
    /// does to a point so far from the origin.
    pub fn radius_m(&self) -> f64 {
        let radius = self.half_diagonal_m();
        let radius = if radius > 0.0 { radius } else { 1.0 };
        radius.max(self.rounding_m())
    }

    /// Whether it is a point, as far as numbers tell so far from the origin.
    pub fn is_point(&self) -> bool {
        self.half_diagonal_m() <= self.rounding_m()
    }

    fn half_diagonal_m(&self) -> f64 {
        0.5 * f64::from(self.bounds.extent().length())
    }

    /// Less than this cannot be told from nothing, with room for a picture.
    fn rounding_m(&self) -> f64 {
        1e-5 * self.middle().abs().max_element()
    }

    /// Whether there is nothing at any place.
    pub fn is_nowhere(&self) -> bool {
        self.points == [DVec3::ZERO]
    }
}

/// The instances that are shown, and the boxes of the lights that are.
fn choose(scene: &Scene, moment: f64, boxes: &[Aabb], lamps: &[Aabb]) -> (Vec<bool>, Vec<Aabb>) {
    // What is scaled to a point, to hide it, cannot be seen.
    let is_seen = |row: &usize| boxes[*row].extent().max_element() > 0.0;
    let emits = |row: &usize| scene.peak_rgb_of_instance(*row as u32).max_element() > 0.0;
    let (mut lit, mut plain): (Vec<usize>, Vec<usize>) =
        (0..boxes.len()).filter(is_seen).partition(emits);
    plain.retain(|&row| scene.instances[row].visibility.camera);
    // Meshes that shine are lights, unless there is nothing else.
    let plain = if plain.is_empty() { std::mem::take(&mut lit) } else { plain };
    let pose = scene.pose_at(moment);
    let kept = without_backdrops(boxes, without_strays(boxes, plain), |row, inside| {
        is_backdrop(scene, &pose, row, &boxes[row], inside)
    });
    let mut shown = vec![false; boxes.len()];
    kept.iter().for_each(|&row| shown[row] = true);
    if kept.is_empty() {
        let all = (0..lamps.len()).collect();
        return (shown, without_strays(lamps, all).into_iter().map(|row| lamps[row]).collect());
    }
    let mut around = kept.iter().fold(Aabb::EMPTY, |all, &row| all.union(&boxes[row]));
    // A light may be near by way of others, as the lamps of a street are. Each time round the box grows by
    // a share of itself, so there are few times.
    let (mut shown_lamps, mut lamps) = (Vec::new(), lamps.to_vec());
    loop {
        let margin = Vec3::splat(NEAR_LIGHT * around.extent().length());
        let near = Aabb { min: around.min - margin, max: around.max + margin };
        let mut found =
            lit.extract_if(.., |row| near.contains_box(&boxes[*row])).collect::<Vec<_>>();
        let count = shown_lamps.len();
        shown_lamps.extend(lamps.extract_if(.., |lamp| near.contains_box(lamp)));
        if found.is_empty() && shown_lamps.len() == count {
            return (shown, shown_lamps);
        }
        for row in found.drain(..) {
            shown[row] = true;
            around = around.union(&boxes[row]);
        }
        around = shown_lamps[count..].iter().fold(around, |all, lamp| all.union(lamp));
    }
}

/// Leaves out boxes that are far from the others.
fn without_strays(boxes: &[Aabb], rows: Vec<usize>) -> Vec<usize> {
    if rows.len() < 3 {
        return rows;
    }
    let middle = median(rows.iter().map(|&row| boxes[row].center()));
    let half = |row: usize| 0.5 * boxes[row].extent();
    // How far the nearest part of a box is from the middle, by its farthest axis.
    let gap = |row: usize| {
        ((boxes[row].center() - middle).abs() - half(row)).max(Vec3::ZERO).max_element()
    };
    let mut sizes: Vec<f32> = rows.iter().map(|&row| half(row).max_element()).collect();
    let size = quantile(&mut sizes, 0.5);
    let limit = limit(rows.iter().map(|&row| gap(row)).collect(), size);
    rows.into_iter().filter(|&row| gap(row) <= limit).collect()
}

/// Leaves out what is behind or below the rest: the largest boxes, if all of them are backdrops of the
/// others. At least a third of the boxes stays.
fn without_backdrops(
    boxes: &[Aabb],
    mut rows: Vec<usize>,
    is_backdrop: impl Fn(usize, &Aabb) -> bool,
) -> Vec<usize> {
    rows.sort_by(|&a, &b| size(&boxes[a]).total_cmp(&size(&boxes[b])).then(a.cmp(&b)));
    let mut inside = Aabb::EMPTY;
    for count in 1..rows.len() {
        inside = inside.union(&boxes[rows[count - 1]]);
        let is_surrounded = size(&boxes[rows[count]]) >= BACKDROP * size(&inside);
        if 3 * count >= rows.len()
            && is_surrounded
            && rows[count..].iter().all(|&row| is_backdrop(row, &inside))
        {
            rows.truncate(count);
            break;
        }
    }
    rows
}

/// Whether a large instance is a backdrop of what is in a box, and not a body that the box is a part of.
fn is_backdrop(scene: &Scene, pose: &Pose, row: usize, bounds: &Aabb, inside: &Aabb) -> bool {
    if bounds.extent().min_element() <= FLAT * size(bounds) {
        return true;
    }
    let instance = &scene.instances[row];
    let positions = pose.positions(scene, instance.mesh);
    let world = pose.world(instance.node);
    let margin = Vec3::splat(size(inside));
    let near = Aabb { min: inside.min - margin, max: inside.max + margin };
    let stride = positions.len().div_ceil(MOST_VERTICES).max(1);
    positions.iter().step_by(stride).all(|&p| !near.contains(world.transform_point3(p)))
}

/// The longest edge.
fn size(bounds: &Aabb) -> f32 {
    bounds.extent().max_element()
}

/// The distance beyond which what few points have is a slip: 8 times that of nine points in ten, or 64
/// times that of three in four. `least` is a distance that is none.
fn limit(mut distances: Vec<f32>, least: f32) -> f32 {
    let ninth_decile = quantile(&mut distances, 0.9).max(least);
    let third_quartile = quantile(&mut distances, 0.75).max(least);
    let limit = (8.0 * ninth_decile).min(64.0 * third_quartile);
    if limit > 0.0 { limit } else { f32::INFINITY }
}

/// The value that a share of all does not exceed, rounded down to one of them. There must be one.
fn quantile(values: &mut [f32], share: f64) -> f32 {
    let at = (share * (values.len() - 1) as f64) as usize;
    *values.select_nth_unstable_by(at, f32::total_cmp).1
}

/// The median of each coordinate. There must be a point.
fn median(points: impl Iterator<Item = Vec3> + Clone) -> Vec3 {
    let of = |axis: usize| quantile(&mut points.clone().map(|p| p[axis]).collect::<Vec<_>>(), 0.5);
    Vec3::new(of(0), of(1), of(2))
}

/// The shape of a mesh without its stray vertices, local space.
struct Outline {
    bounds: Aabb,
    /// The corners that are farthest in each of 26 directions.
    points: Vec<Vec3>,
}

impl Outline {
    /// Of a mesh with some positions.
    fn of(mesh: &Mesh, positions: &[Vec3]) -> Outline {
        let corners = mesh.triangles.as_flattened();
        let stride = corners.len().div_ceil(MOST_CORNERS).max(1);
        let seen: Vec<Vec3> =
            corners.iter().step_by(stride).map(|&corner| positions[corner as usize]).collect();
        if seen.is_empty() {
            return Outline { bounds: Aabb::EMPTY, points: Vec::new() };
        }
        let middle = median(seen.iter().copied());
        let distance = |point: &Vec3| (*point - middle).abs().max_element();
        let limit = limit(seen.iter().map(distance).collect(), 0.0);
        let mut farthest = [(f32::NEG_INFINITY, Vec3::ZERO); 26];
        for &point in seen.iter().filter(|point| distance(point) <= limit) {
            for (found, direction) in farthest.iter_mut().zip(directions()) {
                let along = (point - middle).dot(direction);
                if along > found.0 {
                    *found = (along, point);
                }
            }
        }
        let points = farthest.map(|(_, point)| point).to_vec();
        Outline { bounds: Aabb::around(points.iter().copied()), points }
    }

    /// The box with room for what is between the corners that were looked at.
    fn reach(&self) -> Aabb {
        let Aabb { min, max } = self.bounds;
        let margin = 0.05 * (max - min).max_element().max(0.0);
        Aabb { min: min - margin, max: max + margin }
    }
}

/// To the faces, edges and corners of a cube.
fn directions() -> impl Iterator<Item = Vec3> {
    let steps = |i: u32| Vec3::from([i % 3, i / 3 % 3, i / 9].map(|step| step as f32 - 1.0));
    (0..27).map(steps).filter(|direction| *direction != Vec3::ZERO)
}

fn corners(bounds: &Aabb) -> [DVec3; 8] {
    let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
    std::array::from_fn(|corner| {
        let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
        DVec3::new(pick(0), pick(1), pick(2))
    })
}

/// The corners of the box that fog fills.
fn fog_corners(scene: &Scene) -> Vec<DVec3> {
    let Some(region) = scene.medium.as_ref().and_then(|medium| medium.region) else {
        return Vec::new();
    };
    let world = scene.pose_at(0.0).world(region.node);
    corners(&Aabb { min: region.min, max: region.max }.transformed(&world)).to_vec()
}

/// Moments that are spread over the whole of the scene's own frames, in seconds; one if nothing moves.
fn moments(scene: &Scene) -> Vec<f64> {
    let frames = frames_of(scene);
    let deforms = scene.meshes.iter().any(|mesh| mesh.deformation.is_some());
    let moves = deforms || scene.nodes.iter().any(|node| !node.channels.is_empty());
    let count = if moves { frames.len().min(MOST_MOMENTS) } else { 1 };
    let frame = |i: usize| frames[i * (frames.len() - 1) / (count - 1).max(1)];
    (0..count).map(|i| scene.timeline.seconds_at(f64::from(frame(i)))).collect()
}

fn each_pose(scene: &Scene, moments: &[f64], mut look: impl FnMut(&Pose)) {
    for &moment in moments {
        look(&scene.pose_at(moment));
    }
}
