//! Rays from a camera.
//!
//! The pixel filter is a box one pixel wide: a pixel's value is the mean over its own square, so that it
//! can be compared with a reference picture. Pixel (0, 0) is the top left one. A picture with another
//! aspect than the camera's keeps the height that the camera sees: the vertical field of view of a
//! perspective camera, the metres of an orthographic one.
//!
//! Rays of a perspective camera start on its lens. Rays of an orthographic camera start on the plane
//! through the camera, and nothing behind that plane is seen. Clipping planes cut only the first stretch
//! of a path, by distance along the view axis.

use crate::math::warp;
use crate::scene::{Camera, Pose, Projection};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// A camera at one time and one resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRays {
    /// World space, metres.
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    /// Size of a pixel on the film plane, metres. The plane is one metre in front of a perspective
    /// camera, and goes through an orthographic one.
    pixel_m: f32,
    /// The film's top left corner on that plane, metres to the right and up.
    corner_m: Vec2,
    optics: Optics,
    /// Where surfaces begin and cease to be seen, metres along the view axis.
    clip_m: [f32; 2],
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Optics {
    Pinhole,
    /// Radius of the lens and distance of the plane in focus, metres.
    Lens(f32, f32),
    Parallel,
}

/// A ray into the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// World space, metres; on the near clipping plane.
    pub origin: Vec3,
    /// Unit, world space.
    pub direction: Vec3,
    /// Metres from the origin to the far clipping plane; mostly infinite.
    pub reach_m: f32,
}

impl CameraRays {
    /// Places the camera at its node. The node's scale is ignored, as glTF asks, and a mirrored node does
    /// not mirror the picture. The camera looks where the transform takes -Z. The top of the picture is
    /// where it takes +Y, projected at right angles to the view.
    pub fn new(camera: &Camera, pose: &Pose, [width, height]: [u32; 2]) -> CameraRays {
        let world = pose.world(camera.node);
        let [right, up, back] = view_axes(world.matrix3.as_dmat3().to_cols_array_2d());
        let height_m = match camera.projection {
            Projection::Perspective { yfov_rad } => 2.0 * (0.5 * yfov_rad).tan(),
            Projection::Orthographic { height_m } => height_m,
        };
        let pixel_m = height_m / height as f32;
        let size_m = Vec2::new(pixel_m * width as f32, height_m);
        let has_lens = camera.lens_radius_m > 0.0
            && camera.focus_distance_m > 0.0
            && camera.focus_distance_m.is_finite();
        CameraRays {
            position: world.translation.into(),
            right,
            up,
            forward: -back,
            pixel_m,
            corner_m: size_m * (Vec2::from(camera.film_offset) + Vec2::new(-0.5, 0.5)),
            optics: match camera.projection {
                Projection::Orthographic { .. } => Optics::Parallel,
                _ if has_lens => Optics::Lens(camera.lens_radius_m, camera.focus_distance_m),
                _ => Optics::Pinhole,
            },
            clip_m: camera.clip_m,
        }
    }

    /// The ray through a point of a pixel: `u_pixel` is the place in its square, from the top left;
    /// `u_lens` the place on the lens. Both in `[0, 1)^2`.
    #[inline]
    pub fn ray(&self, x: u32, y: u32, u_pixel: Vec2, u_lens: Vec2) -> CameraRay {
        let right = self.corner_m.x + (x as f32 + u_pixel.x) * self.pixel_m;
        let up = self.corner_m.y - (y as f32 + u_pixel.y) * self.pixel_m;
        let on_film = self.right * right + self.up * up;
        let (start, toward) = match self.optics {
            Optics::Pinhole => (Vec3::ZERO, self.forward + on_film),
            Optics::Lens(radius, focus) => {
                let at = warp::disk(u_lens) * radius;
                let on_lens = self.right * at.x + self.up * at.y;
                (on_lens, (self.forward + on_film) * focus - on_lens)
            }
            Optics::Parallel => (on_film, self.forward),
        };
        let direction = toward.normalize();
        // Metres along the ray for a metre along the view axis.
        let slant = 1.0 / direction.dot(self.forward);
        let [near, far] = self.clip_m;
        CameraRay {
            origin: self.position + start + direction * (near * slant),
            direction,
            reach_m: (far - near) * slant,
        }
    }

    /// Depth of a world-space point: metres in front of the camera along the view axis. This is
    /// what the `Z` buffer holds, in perspective and without.
    #[inline]
    pub fn depth_m(&self, point: Vec3) -> f32 {
        (point - self.position).dot(self.forward)
    }

    /// Where a world-space point is on the picture, seen through the middle of the lens: pixels to the
    /// right and up from its top left corner. `None` behind a perspective camera.
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        self.on_film(point - self.position.as_dvec3())
    }

    /// The same for a direction to a point that is infinitely far. `None` without perspective.
    pub fn project_direction(&self, direction: Vec3) -> Option<DVec2> {
        let has_perspective = !matches!(self.optics, Optics::Parallel);
        has_perspective.then(|| self.on_film(direction.as_dvec3())).flatten()
    }

    fn on_film(&self, toward: DVec3) -> Option<DVec2> {
        let [right, up, forward] = [self.right, self.up, self.forward].map(|axis| axis.as_dvec3());
        let depth = match self.optics {
            Optics::Parallel => 1.0,
            _ => toward.dot(forward),
        };
        let on_film = DVec2::new(toward.dot(right), toward.dot(up)) / depth;
        let from_corner = (on_film - self.corner_m.as_dvec2()) / f64::from(self.pixel_m);
        (depth > 0.0).then_some(from_corner)
    }
}

/// Right, up and back of a view, orthonormal, from the columns of a transform. An axis that the transform
/// collapses to zero is derived from the others. Double precision allows for any scale that a 32-bit
/// number can have.
fn view_axes(columns: [[f64; 3]; 3]) -> [Vec3; 3] {
    let [x, y, z] = columns.map(|column| DVec3::from(column).normalize_or_zero());
    let back = z.try_normalize().or_else(|| x.cross(y).try_normalize());
    let back = back.or_else(|| (y != DVec3::ZERO).then(|| y.any_orthonormal_vector()));
    let back = back.unwrap_or(DVec3::Z);
    let across = |up: DVec3| up.cross(back).try_normalize();
    let right = across(y).or_else(|| (x - back * x.dot(back)).try_normalize());
    let right = right.or_else(|| across(DVec3::Y)).unwrap_or(DVec3::X);
    [right, back.cross(right), back].map(|axis| axis.as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Node, Scene, Trs};
    use glam::{DAffine3, DMat3, DQuat, DVec3};

    const MIDDLE: Vec2 = Vec2::splat(0.5);

    fn camera() -> Camera {
        let camera = Camera::perspective(0, std::f32::consts::FRAC_PI_2);
        Camera { focus_distance_m: 4.0, ..camera }
    }

    fn pose(rotation: DQuat, scale: DVec3) -> Pose {
        let translation = DVec3::new(1.0, 2.0, 3.0);
        posed(Trs::Parts { translation, rotation, scale })
    }

    fn posed(local: Trs) -> Pose {
        let nodes = vec![Node::fixed("/camera", None, local)];
        Scene { nodes, ..Default::default() }.pose_at(0.0)
    }

    #[test]
    fn the_corners_span_the_vertical_field_of_view() {
        let pose = pose(DQuat::IDENTITY, DVec3::ONE);
        for (width, height) in [(200, 100), (100, 100), (50, 100), (1, 1)] {
            let rays = CameraRays::new(&camera(), &pose, [width, height]);
            let corner = rays.ray(0, 0, Vec2::ZERO, MIDDLE);
            assert_eq!(corner.origin, Vec3::new(1.0, 2.0, 3.0));
            let aspect = width as f32 / height as f32;
            let expected = Vec3::new(-aspect, 1.0, -1.0).normalize();
            assert!((corner.direction - expected).length() < 1e-6);
            let opposite = rays.ray(width - 1, height - 1, Vec2::ONE, MIDDLE).direction;
            let expected = Vec3::new(aspect, -1.0, -1.0).normalize();
            assert!((opposite - expected).length() < 1e-6);
        }
    }

    #[test]
    fn it_turns_with_its_node_and_ignores_scale() {
        let rotation = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
        for scale in [DVec3::ONE, DVec3::new(3.0, 0.1, 7.0)] {
            let rays = CameraRays::new(&camera(), &pose(rotation, scale), [2, 2]);
            let ahead = rays.ray(1, 1, Vec2::ZERO, MIDDLE).direction;
            assert!((ahead + Vec3::X).length() < 1e-6, "{ahead}");
            let top = rays.ray(1, 0, Vec2::ZERO, MIDDLE).direction;
            assert!(top.y > 0.7 && top.z.abs() < 1e-6, "{top}");
            assert!((rays.depth_m(Vec3::new(-4.0, 9.0, 9.0)) - 5.0).abs() < 1e-5);
        }
    }

    /// Whatever its parents do to the camera's node, rays are unit vectors, the axes are at right angles,
    /// and the camera looks where the transform takes -Z.
    #[test]
    fn any_transform_has_a_view() {
        let shear =
            DMat3::from_cols(DVec3::X, DVec3::new(0.7, 1.0, 0.2), DVec3::new(0.1, -3.0, 1.0));
        let turn = DMat3::from_euler(glam::EulerRot::YXZ, 0.5, -0.3, 0.2);
        let stretched = turn * DMat3::from_diagonal(DVec3::new(3.0, 0.01, 40.0));
        let mirrored = turn * DMat3::from_diagonal(DVec3::new(-2.0, 1.0, 1.0));
        let backwards = turn * DMat3::from_diagonal(DVec3::new(1.0, 1.0, -0.5));
        for linear in [shear, stretched, stretched * turn, mirrored, backwards] {
            for scale in [1e-30, 1e-9, 1.0, 1e9, 1e30] {
                let pose = posed(Trs::Matrix(DAffine3::from_mat3(linear * scale)));
                let rays = CameraRays::new(&camera(), &pose, [20, 10]);
                let ahead = (linear * -DVec3::Z).normalize().as_vec3();
                assert!((rays.forward - ahead).length() < 1e-6, "{linear} {scale}");
                assert!(rays.up.dot((linear * DVec3::Y).as_vec3()) > 0.0);
                assert_view(&rays);
            }
        }
        // If one axis is scaled to zero, it is derived from the other two, and the view is the same.
        for lost in 0..3 {
            let mut scale = DVec3::ONE;
            scale[lost] = 0.0;
            let pose = posed(Trs::Matrix(DAffine3::from_mat3(turn * DMat3::from_diagonal(scale))));
            let rays = CameraRays::new(&camera(), &pose, [20, 10]);
            assert!((rays.forward + turn.z_axis.as_vec3()).length() < 1e-6, "{lost}");
            assert!((rays.up - turn.y_axis.as_vec3()).length() < 1e-6, "{lost}");
            assert_view(&rays);
        }
        for scale in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z] {
            let linear = DMat3::from_diagonal(scale);
            assert_view(&CameraRays::new(
                &camera(),
                &posed(Trs::Matrix(DAffine3::from_mat3(linear))),
                [2, 2],
            ));
        }
    }

    fn assert_view(rays: &CameraRays) {
        let axes = [rays.right, rays.up, rays.forward];
        assert!(axes.iter().all(|axis| (axis.length() - 1.0).abs() < 1e-6), "{axes:?}");
        assert!((rays.right.cross(rays.up) + rays.forward).length() < 1e-6, "{axes:?}");
        let ray = rays.ray(0, 0, Vec2::ZERO, MIDDLE);
        assert!((ray.direction.length() - 1.0).abs() < 1e-6 && ray.origin.is_finite(), "{ray:?}");
    }

    #[test]
    fn parallel_rays_leave_the_film() {
        let node =
            pose(DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2), DVec3::new(1.0, 5.0, 2.0));
        let camera = Camera { film_offset: [0.25, 0.0], ..Camera::orthographic(0, 6.0) };
        let rays = CameraRays::new(&camera, &node, [40, 20]);
        // The camera looks along -X from (1, 2, 3): right is -Z. It sees 12 m by 6 m.
        for (x, y, u) in [(0, 0, Vec2::ZERO), (39, 19, Vec2::ONE), (20, 10, Vec2::ZERO)] {
            let ray = rays.ray(x, y, u, MIDDLE);
            assert!((ray.direction + Vec3::X).length() < 1e-6);
            let (right, up) = (x as f32 + u.x - 20.0 + 10.0, 10.0 - y as f32 - u.y);
            let expected = Vec3::new(1.0, 2.0 + 0.3 * up, 3.0 - 0.3 * right);
            assert!((ray.origin - expected).length() < 1e-5, "{ray:?}");
            assert!((rays.depth_m(ray.origin + 7.0 * ray.direction) - 7.0).abs() < 1e-5);
        }
    }

    /// Clipping is by planes, not by distance from the eye.
    #[test]
    fn rays_begin_and_end_at_the_clipping_planes() {
        let pose = pose(DQuat::from_rotation_x(0.4), DVec3::ONE);
        let cameras =
            [camera(), Camera { lens_radius_m: 0.2, ..camera() }, Camera::orthographic(0, 3.0)];
        for camera in cameras {
            let whole = CameraRays::new(&camera, &pose, [16, 8]).ray(2, 1, MIDDLE, Vec2::ZERO);
            assert_eq!(whole.reach_m, f32::INFINITY);
            let camera = Camera { clip_m: [0.5, 20.0], ..camera };
            let rays = CameraRays::new(&camera, &pose, [16, 8]);
            let ray = rays.ray(2, 1, MIDDLE, Vec2::ZERO);
            assert!((rays.depth_m(ray.origin) - 0.5).abs() < 1e-5);
            assert!((rays.depth_m(ray.origin + ray.direction * ray.reach_m) - 20.0).abs() < 1e-4);
            assert!((ray.origin - whole.origin).normalize().dot(whole.direction) > 1.0 - 1e-5);
            assert_eq!(ray.direction, whole.direction);
        }
    }

    #[test]
    fn the_film_moves_by_its_own_size() {
        let offset = Camera { film_offset: [0.5, 0.25], ..camera() };
        let rays = CameraRays::new(&offset, &pose(DQuat::IDENTITY, DVec3::ONE), [200, 100]);
        let center = rays.ray(100, 50, Vec2::ZERO, MIDDLE).direction;
        let expected = Vec3::new(2.0, 0.5, -1.0).normalize();
        assert!((center - expected).length() < 1e-6, "{center}");
    }

    #[test]
    fn all_rays_of_a_lens_meet_in_the_plane_of_focus() {
        let lens = Camera { lens_radius_m: 0.2, ..camera() };
        let pose = pose(DQuat::from_rotation_x(0.4), DVec3::ONE);
        let rays = CameraRays::new(&lens, &pose, [64, 48]);
        let pinhole = CameraRays::new(&camera(), &pose, [64, 48]);
        for (x, y) in [(0, 0), (32, 24), (63, 10)] {
            let straight = pinhole.ray(x, y, MIDDLE, MIDDLE);
            let reach = 4.0 / straight.direction.dot(pinhole.forward);
            let focus = straight.origin + straight.direction * reach;
            for i in 0..16 {
                let u = Vec2::new((i % 4) as f32 / 4.0, (i / 4) as f32 / 4.0);
                let ray = rays.ray(x, y, MIDDLE, u);
                assert!(ray.origin.distance(straight.origin) <= 0.2 + 1e-6);
                let along = (focus - ray.origin).dot(ray.direction);
                assert!((ray.origin + ray.direction * along).distance(focus) < 1e-5);
            }
        }
    }
}
