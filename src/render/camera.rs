//! Rays from a camera.
//!
//! A pixel is a box filter one pixel wide: its value is the mean over its own square, which is
//! what a reference picture can be compared with. Pixel (0, 0) is the top left one. A render of
//! another shape than the file asks for keeps the vertical field of view.

use crate::math::warp;
use crate::scene::{Camera, Pose};
use glam::{Vec2, Vec3};

/// A camera at one time and one resolution.
#[derive(Clone, Copy, Debug)]
pub struct CameraRays {
    /// World space, metres.
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    /// Size of a pixel on the film plane one metre in front, metres.
    pixel_m: f32,
    /// The film's top left corner on that plane, metres to the right and up.
    corner_m: Vec2,
    /// Radius of the lens and distance of the plane in focus, metres; `None` is a pinhole.
    lens: Option<(f32, f32)>,
}

/// A ray into the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// World space, metres.
    pub origin: Vec3,
    /// Unit, world space.
    pub direction: Vec3,
}

impl CameraRays {
    /// The camera where its node stands. Scale and shear of the node are ignored, as glTF asks.
    pub fn new(camera: &Camera, pose: &Pose, width: u32, height: u32) -> CameraRays {
        let world = pose.world(camera.node);
        let forward = -Vec3::from(world.matrix3.z_axis).normalize_or(Vec3::Z);
        let up = Vec3::from(world.matrix3.y_axis);
        let fallback = forward.any_orthonormal_vector();
        let right = forward.cross(up).normalize_or(fallback);
        let height_m = 2.0 * (0.5 * camera.yfov_rad).tan();
        let pixel_m = height_m / height as f32;
        let size_m = Vec2::new(pixel_m * width as f32, height_m);
        let has_lens = camera.lens_radius_m > 0.0
            && camera.focus_distance_m > 0.0
            && camera.focus_distance_m.is_finite();
        CameraRays {
            position: world.translation.into(),
            right,
            up: right.cross(forward),
            forward,
            pixel_m,
            corner_m: size_m * (Vec2::from(camera.film_offset) + Vec2::new(-0.5, 0.5)),
            lens: has_lens.then_some((camera.lens_radius_m, camera.focus_distance_m)),
        }
    }

    /// The ray through a point of a pixel: `u_pixel` is the place in its square, from the top left;
    /// `u_lens` the place on the lens. Both in `[0, 1)^2`.
    #[inline]
    pub fn ray(&self, x: u32, y: u32, u_pixel: Vec2, u_lens: Vec2) -> CameraRay {
        let right = self.corner_m.x + (x as f32 + u_pixel.x) * self.pixel_m;
        let up = self.corner_m.y - (y as f32 + u_pixel.y) * self.pixel_m;
        let toward = self.forward + self.right * right + self.up * up;
        match self.lens {
            None => CameraRay { origin: self.position, direction: toward.normalize() },
            Some((radius, focus)) => {
                let at = warp::disk(u_lens) * radius;
                let on_lens = self.right * at.x + self.up * at.y;
                let direction = (toward * focus - on_lens).normalize();
                CameraRay { origin: self.position + on_lens, direction }
            }
        }
    }

    /// Depth of a world-space point: metres in front of the camera along the view axis. This is
    /// what the `Z` buffer holds.
    #[inline]
    pub fn depth_m(&self, point: Vec3) -> f32 {
        (point - self.position).dot(self.forward)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Node, Scene, Trs};
    use glam::{DQuat, DVec3};

    const MIDDLE: Vec2 = Vec2::splat(0.5);

    fn camera() -> Camera {
        Camera {
            node: 0,
            yfov_rad: std::f32::consts::FRAC_PI_2,
            aspect: None,
            lens_radius_m: 0.0,
            focus_distance_m: 4.0,
            film_offset: [0.0; 2],
        }
    }

    fn pose(rotation: DQuat, scale: DVec3) -> Pose {
        let translation = DVec3::new(1.0, 2.0, 3.0);
        let local = Trs::Parts { translation, rotation, scale };
        let nodes = vec![Node::fixed("/camera", None, local)];
        Scene { nodes, ..Default::default() }.pose_at(0.0)
    }

    #[test]
    fn the_corners_span_the_vertical_field_of_view() {
        let pose = pose(DQuat::IDENTITY, DVec3::ONE);
        for (width, height) in [(200, 100), (100, 100), (50, 100), (1, 1)] {
            let rays = CameraRays::new(&camera(), &pose, width, height);
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
            let rays = CameraRays::new(&camera(), &pose(rotation, scale), 2, 2);
            let ahead = rays.ray(1, 1, Vec2::ZERO, MIDDLE).direction;
            assert!((ahead + Vec3::X).length() < 1e-6, "{ahead}");
            let top = rays.ray(1, 0, Vec2::ZERO, MIDDLE).direction;
            assert!(top.y > 0.7 && top.z.abs() < 1e-6, "{top}");
            assert!((rays.depth_m(Vec3::new(-4.0, 9.0, 9.0)) - 5.0).abs() < 1e-5);
        }
    }

    #[test]
    fn the_film_moves_by_its_own_size() {
        let offset = Camera { film_offset: [0.5, 0.25], ..camera() };
        let rays = CameraRays::new(&offset, &pose(DQuat::IDENTITY, DVec3::ONE), 200, 100);
        let center = rays.ray(100, 50, Vec2::ZERO, MIDDLE).direction;
        let expected = Vec3::new(2.0, 0.5, -1.0).normalize();
        assert!((center - expected).length() < 1e-6, "{center}");
    }

    #[test]
    fn all_rays_of_a_lens_meet_in_the_plane_of_focus() {
        let lens = Camera { lens_radius_m: 0.2, ..camera() };
        let pose = pose(DQuat::from_rotation_x(0.4), DVec3::ONE);
        let rays = CameraRays::new(&lens, &pose, 64, 48);
        let pinhole = CameraRays::new(&camera(), &pose, 64, 48);
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
