//! Where a ray meets one surface.

use super::anchor::Anchor;
use super::blas::{BlasHit, TriangleId};
use super::prim::Prim;
use super::sphere::Sphere;
use super::triangles::{OfBlock, Ray, barycentric};
use glam::{DAffine3, DVec3, Vec2};

/// Relative error of a distance found in double precision, with room for what a scene may do to it.
const NOISE: f64 = 1.0 / (1_u64 << 48) as f64;

/// What a ray hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Position and geometric normal (of the front), from which further rays can start.
    pub anchor: Anchor,
    /// On what.
    pub surface: HitSurface,
}

/// On what a ray ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HitSurface {
    /// A triangle of a mesh.
    Triangle {
        /// Index into [`Scene::instances`](crate::scene::Scene::instances).
        instance: u32,
        /// Index into the mesh's triangles.
        triangle: u32,
        /// Weights of the second and third corner.
        barycentric: Vec2,
    },
    /// A sphere light.
    Sphere {
        /// Index into [`Scene::lights`](crate::scene::Scene::lights).
        light: u32,
    },
}

impl HitSurface {
    /// A number for each surface, to tell them apart.
    pub(super) fn order(&self) -> (u32, u32, u32) {
        match *self {
            HitSurface::Triangle { instance, triangle, .. } => (0, instance, triangle),
            HitSurface::Sphere { light } => (1, light, 0),
        }
    }
}

/// Where a ray meets a surface.
#[derive(Clone, Copy)]
pub(super) struct Meeting<'a> {
    /// In lengths of the ray's direction.
    pub t: f64,
    /// Which surface.
    pub on: On<'a>,
}

/// Which surface a ray meets.
#[derive(Clone, Copy)]
pub(super) enum On<'a> {
    /// A triangle.
    Triangle {
        /// Its name.
        id: TriangleId,
        /// Its corners, in the space of its set.
        triangle: OfBlock<'a>,
        /// That space; `None` is the world's.
        space: Option<&'a Space>,
    },
    /// A sphere.
    Sphere(&'a Sphere),
}

/// The space of a mesh that is kept in its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Space {
    pub to_world: DAffine3,
    pub to_local: DAffine3,
}

impl Space {
    /// A world-space ray in this space, its distances unchanged.
    #[inline]
    pub fn localize(&self, ray: &Ray) -> Ray {
        Ray {
            origin: self.to_local.transform_point3(ray.origin),
            direction: self.to_local.transform_vector3(ray.direction),
        }
    }
}

impl<'a> Meeting<'a> {
    #[inline]
    pub fn with_triangle(hit: &BlasHit<'a>, space: Option<&'a Space>) -> Meeting<'a> {
        Meeting { t: hit.t, on: On::Triangle { id: hit.id, triangle: hit.triangle, space } }
    }

    /// The number of the triangle in its mesh.
    pub fn triangle(&self) -> u32 {
        match &self.on {
            On::Triangle { id, .. } => id.triangle,
            On::Sphere(_) => 0,
        }
    }

    /// Normal of the surface's front in world space, of any length.
    fn normal(&self, ray: &Ray, prim: &Prim) -> DVec3 {
        match &self.on {
            On::Triangle { triangle, space, .. } => {
                let [a, b, c] = triangle.corners();
                let across = (b - a).cross(c - a);
                match space {
                    // Normals go by the transpose of the inverse, which keeps the front's side.
                    Some(space) => space.to_local.matrix3.transpose() * across,
                    None if prim.mirrors => -across,
                    None => across,
                }
            }
            On::Sphere(sphere) => ray.origin + self.t * ray.direction - sphere.center,
        }
    }

    /// Whether a world-space ray meets the front.
    #[inline]
    pub fn is_front(&self, ray: &Ray, prim: &Prim) -> bool {
        self.normal(ray, prim).dot(ray.direction) < 0.0
    }

    /// Cosine between a world-space ray and the normal, on either side.
    pub fn cosine(&self, ray: &Ray, prim: &Prim) -> f64 {
        let normal = self.normal(ray, prim);
        let lengths = (normal.length_squared() * ray.direction.length_squared()).sqrt();
        normal.dot(ray.direction).abs() / lengths
    }

    /// The hit in full.
    pub fn hit(&self, ray: &Ray, prim: &Prim) -> Hit {
        match &self.on {
            On::Triangle { id, triangle, space } => {
                self.triangle_hit(ray, prim, id, triangle.corners(), space)
            }
            On::Sphere(sphere) => self.sphere_hit(ray, sphere),
        }
    }

    fn triangle_hit(
        &self,
        ray: &Ray,
        prim: &Prim,
        id: &TriangleId,
        corners: [DVec3; 3],
        space: &Option<&Space>,
    ) -> Hit {
        let corners = match space {
            Some(space) => corners.map(|corner| space.to_world.transform_point3(corner)),
            None => corners,
        };
        let [a, b, c] = corners;
        let across = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        let normal = if prim.mirrors { -across } else { across };
        let position = ray.origin + self.t * ray.direction;
        let size = ray.origin.abs().max(a.abs()).max(b.abs()).max(c.abs()).max_element();
        let barycentric = barycentric(ray, corners);
        let TriangleId { instance, triangle } = *id;
        Hit {
            t: self.t as f32,
            anchor: Anchor::rounded(position, normal, NOISE * size),
            surface: HitSurface::Triangle { instance, triangle, barycentric },
        }
    }

    fn sphere_hit(&self, ray: &Ray, sphere: &Sphere) -> Hit {
        let met = ray.origin + self.t * ray.direction;
        let outward = (met - sphere.center).normalize_or_zero();
        let position = sphere.center + outward * sphere.radius_m;
        let size =
            sphere.center.abs().max_element() + sphere.radius_m + ray.origin.abs().max_element();
        Hit {
            t: self.t as f32,
            anchor: Anchor::rounded(position, outward.as_vec3(), NOISE * size),
            surface: HitSurface::Sphere { light: sphere.light },
        }
    }
}
