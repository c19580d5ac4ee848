//! Light filters in one pose: the share of a light's light that gets to a point.
//!
//! A filter is no part of a light's bounds. The tree weighs the light without it, so a light has some weight wherever it
//! may shine.

use crate::math::color::Rgb;
use crate::scene::{BlockerShape, FilterKind, LightFilters, Linking, Pose, Rod, Scene};
use glam::{DAffine3, DVec3, Vec3};

/// Where light comes from.
#[derive(Clone, Copy, Debug)]
pub enum Source {
    /// A point, world space, metres.
    Point(Vec3),
    /// A direction towards a light at infinity, unit, world space.
    Direction(Vec3),
}

/// What light falls on.
#[derive(Clone, Copy, Debug)]
pub struct Lit {
    /// The point, world space, metres.
    pub point: Vec3,
    /// The link sets that its surface, or the fog, is in: a row of [`Linking::memberships`]; `None` is every set.
    pub membership: Option<u32>,
}

/// The filters of a scene, placed by a pose.
pub struct PosedFilters<'a> {
    filters: &'a LightFilters,
    linking: &'a Linking,
    /// The link set that each filter is for; `None` is everything.
    links: Vec<Option<u32>>,
    /// World space to each filter's own; `None` where that is flattened to nothing.
    to_local: Vec<Option<DAffine3>>,
}

impl<'a> PosedFilters<'a> {
    /// The filters of a scene, if any light has some.
    pub fn new(scene: &'a Scene, pose: &Pose) -> Option<PosedFilters<'a>> {
        let filters = &scene.light_filters;
        let to_local = filters.all().iter().map(|filter| {
            let world = pose.world(filter.node);
            let translation = Vec3::from(world.translation).as_dvec3();
            let to_world = DAffine3 { matrix3: world.matrix3.as_dmat3(), translation };
            Some(to_world.inverse()).filter(DAffine3::is_finite)
        });
        let linking = &scene.linking;
        (!filters.is_empty()).then(|| PosedFilters {
            filters,
            linking,
            links: (0..filters.all().len() as u32).map(|row| linking.of_filter(row)).collect(),
            to_local: to_local.collect(),
        })
    }

    /// The share of a light's light from a source that gets to what is lit.
    pub fn of_light(&self, light: u32, at: Lit, source: Source) -> Rgb {
        self.passing(self.filters.of_light(light), at, source)
    }

    /// The same of an instance's light.
    pub fn of_instance(&self, instance: u32, at: Lit, source: Source) -> Rgb {
        self.passing(self.filters.of_instance(instance), at, source)
    }

    fn passing(&self, rows: &[u32], Lit { point, membership }: Lit, source: Source) -> Rgb {
        let mut share = Rgb::ONE;
        for &row in rows {
            if !self.linking.holds(self.links[row as usize], membership) {
                continue;
            }
            let to_local = self.to_local[row as usize].as_ref();
            share *= match &self.filters.all()[row as usize].kind {
                FilterKind::Rod(rod) => {
                    rod.at(to_local.map(|to| to.transform_point3(point.as_dvec3())))
                }
                FilterKind::Blocker { shape, through } => {
                    let meets =
                        to_local.is_some_and(|to| shape.is_met(&Way::between(to, point, source)));
                    if meets { *through } else { Rgb::ONE }
                }
                FilterKind::Multiplier(share) => *share,
                FilterKind::Decay { near_m, far_m } => {
                    let distance = match source {
                        Source::Point(from) => f64::from(from.distance(point)),
                        Source::Direction(_) => f64::INFINITY,
                    };
                    let near = near_m.map_or(1.0, |range| smoothstep(range, distance));
                    let far = far_m.map_or(0.0, |range| smoothstep(range, distance));
                    Rgb::splat((near * (1.0 - far)) as f32)
                }
            };
            if share == Rgb::ZERO {
                break;
            }
        }
        share
    }
}

impl Rod {
    /// The share of the light at a point in its own space; `None` is far away.
    fn at(&self, point: Option<DVec3>) -> Rgb {
        let (min, max) = (self.min.as_dvec3(), self.max.as_dvec3());
        let outside = point.map_or(f64::INFINITY, |point| {
            let beyond = (point - 0.5 * (min + max)).abs() - 0.5 * (max - min);
            beyond.max(DVec3::ZERO).length() - f64::from(self.radius)
        });
        if outside <= 0.0 {
            return self.inside;
        }
        let edge = f64::from(self.edge);
        if outside >= edge {
            return self.outside;
        }
        self.inside.lerp(self.outside, self.ramp_at((outside / edge) as f32))
    }

    fn ramp_at(&self, share: f32) -> f32 {
        let after = self.ramp.partition_point(|knot| knot[0] <= share);
        match (after.checked_sub(1).map(|before| self.ramp[before]), self.ramp.get(after)) {
            (Some([x, y]), Some(&[next_x, next_y])) => {
                y + (next_y - y) * ((share - x) / (next_x - x))
            }
            (Some([_, y]), None) => y,
            (None, _) => 0.0,
        }
    }
}

/// A straight way from a point, in a filter's own space: `start + t * step` for `t` from 0 to `end`.
struct Way {
    start: DVec3,
    step: DVec3,
    end: f64,
}

impl Way {
    fn between(to_local: &DAffine3, point: Vec3, source: Source) -> Way {
        let start = to_local.transform_point3(point.as_dvec3());
        match source {
            Source::Point(from) => {
                let step = to_local.transform_point3(from.as_dvec3()) - start;
                Way { start, step, end: 1.0 }
            }
            Source::Direction(direction) => {
                let step = to_local.transform_vector3(direction.as_dvec3());
                Way { start, step, end: f64::INFINITY }
            }
        }
    }
}

impl BlockerShape {
    fn is_met(self, &Way { start, step, end }: &Way) -> bool {
        match self {
            BlockerShape::Box => {
                let (mut from, mut to) = (0.0f64, end);
                for axis in 0..3 {
                    let (at, by) = (start[axis], step[axis]);
                    // Parallel to a face both quotients are infinite or NaN; the start alone decides.
                    if by == 0.0 {
                        if at.abs() > 0.5 {
                            return false;
                        }
                        continue;
                    }
                    let (a, b) = ((-0.5 - at) / by, (0.5 - at) / by);
                    from = from.max(a.min(b));
                    to = to.min(a.max(b));
                }
                from <= to
            }
            BlockerShape::Sphere => {
                let length = step.length_squared();
                let nearest =
                    if length > 0.0 { (-start.dot(step) / length).clamp(0.0, end) } else { 0.0 };
                (start + nearest * step).length_squared() <= 0.25
            }
            BlockerShape::Plane => {
                let at = -start.z / step.z;
                let on = start + at * step;
                (0.0..=end).contains(&at) && on.x.abs() <= 0.5 && on.y.abs() <= 0.5
            }
        }
    }
}

/// From 0 at the start of a range to 1 at its end; of an empty range a jump.
fn smoothstep([start, end]: [f32; 2], at: f64) -> f64 {
    let (start, end) = (f64::from(start), f64::from(end));
    if at >= end {
        return 1.0;
    }
    let share = ((at - start) / (end - start)).max(0.0);
    share * share * (3.0 - 2.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rod(min: Vec3, max: Vec3, radius: f32, edge: f32) -> Rod {
        let ramp = vec![[0.0, 0.0], [0.5, 0.25], [1.0, 1.0]];
        Rod { min, max, radius, edge, ramp, inside: Rgb::ZERO, outside: Rgb::ONE }
    }

    #[test]
    fn a_rod_is_soft_across_its_shell() {
        let ball = rod(Vec3::ZERO, Vec3::ZERO, 1.0, 0.5);
        let at = |x: f64| ball.at(Some(DVec3::new(0.0, x, 0.0))).x;
        for (x, share) in [
            (0.0, 0.0),
            (1.0, 0.0),
            (1.125, 0.125),
            (1.25, 0.25),
            (1.375, 0.625),
            (1.5, 1.0),
            (9.0, 1.0),
        ] {
            assert!((at(x) - share).abs() < 1e-6, "{x}: {}", at(x));
        }
        assert_eq!(ball.at(None), Rgb::ONE);
        // At a corner the distance is that from the corner.
        let cube = rod(Vec3::splat(-1.0), Vec3::splat(1.0), 0.0, 1.0);
        let share = cube.at(Some(DVec3::splat(1.0 + 0.5 / 3f64.sqrt()))).x;
        assert!((share - 0.25).abs() < 1e-6, "{share}");
        // A hard one, off its node.
        let hard = rod(Vec3::new(2.0, -1.0, -1.0), Vec3::new(4.0, 1.0, 1.0), 0.0, 0.0);
        let sides = [1.99, 2.0, 4.0, 4.01].map(|x| hard.at(Some(DVec3::new(x, 0.0, 0.0))).x);
        assert_eq!(sides, [1.0, 0.0, 0.0, 1.0]);
    }

    fn way(start: [f64; 3], end: [f64; 3]) -> Way {
        let [start, to] = [start, end].map(DVec3::from);
        Way { start, step: to - start, end: 1.0 }
    }

    #[test]
    fn shapes_stop_what_passes_them_and_nothing_else() {
        use BlockerShape::{Box, Plane, Sphere};
        for (start, end, met) in [
            ([0.0, 0.0, -2.0], [0.0, 0.0, 2.0], [true, true, true]),
            ([0.0, 0.0, 2.0], [0.0, 0.0, -2.0], [true, true, true]),
            // It ends before, and begins behind.
            ([0.0, 0.0, 2.0], [0.0, 0.0, 0.6], [false, false, false]),
            ([0.0, 0.0, -0.6], [0.0, 0.0, -2.0], [false, false, false]),
            // It begins and ends inside.
            ([0.1, 0.0, 0.1], [0.0, 0.1, 0.2], [true, true, false]),
            // Through a corner that the ball does not have.
            ([0.45, 0.45, -2.0], [0.45, 0.45, 2.0], [true, false, true]),
            // Along a face, inside and outside.
            ([-2.0, 0.0, 0.2], [2.0, 0.0, 0.2], [true, true, false]),
            ([-2.0, 0.6, 0.0], [2.0, 0.6, 0.0], [false, false, false]),
            // No way at all.
            ([0.2, 0.2, 0.2], [0.2, 0.2, 0.2], [true, true, false]),
            ([2.0, 2.0, 2.0], [2.0, 2.0, 2.0], [false, false, false]),
        ] {
            let found = [Box, Sphere, Plane].map(|shape| shape.is_met(&way(start, end)));
            assert_eq!(found, met, "{start:?} {end:?}");
        }
        let up = Way { start: DVec3::new(0.0, 0.0, -9.0), step: DVec3::Z, end: f64::INFINITY };
        assert!([Box, Sphere, Plane].iter().all(|shape| shape.is_met(&up)));
        let down = Way { step: -DVec3::Z, ..up };
        assert!(![Box, Sphere, Plane].iter().any(|shape| shape.is_met(&down)));
    }

    proptest! {
        /// A shape is met where one of many points along the way is in it, and not where none is near.
        #[test]
        fn shapes_are_met_where_points_of_the_way_are_in_them(
            start in prop::array::uniform3(-1.5..1.5), end in prop::array::uniform3(-1.5..1.5)
        ) {
            let way = way(start, end);
            let points: Vec<DVec3> = (0..=4000).map(|i| way.start + f64::from(i) / 4000.0 * way.step).collect();
            let by = |size: fn(DVec3) -> f64| points.iter().map(|&p| size(p)).fold(f64::INFINITY, f64::min);
            for (shape, nearest) in [
                (BlockerShape::Box, by(|p| p.abs().max_element())), (BlockerShape::Sphere, by(|p| p.length())),
            ] {
                let met = shape.is_met(&way);
                prop_assert!(met || nearest > 0.5, "{shape:?} {nearest}");
                prop_assert!(!met || nearest < 0.502, "{shape:?} {nearest}");
            }
        }
    }

    #[test]
    fn decay_fades_in_and_out() {
        assert_eq!([1.0, 2.0, 3.0, 4.0].map(|at| smoothstep([2.0, 4.0], at)), [0.0, 0.0, 0.5, 1.0]);
        assert_eq!([1.9, 2.0, f64::INFINITY].map(|at| smoothstep([2.0, 2.0], at)), [0.0, 1.0, 1.0]);
        assert_eq!(smoothstep([2.0, 2.0], 1.0), 0.0);
    }
}
