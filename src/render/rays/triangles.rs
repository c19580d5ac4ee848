//! Triangles, four at a time.
//!
//! A line goes through a triangle by Woop, Benthin and Wald 2013 ("Watertight Ray/Triangle
//! Intersection"): along a shared edge two triangles compute the same number with opposite signs,
//! so no ray slips between them. *Where* it goes through is then found in double precision from
//! the plane alone: the distance is right to about 1e-15 of the coordinates, whatever the size of
//! the triangle or the scene, so a ray that starts an ulp in front of a surface is in front of it.

use glam::{DVec3, Vec2, Vec3, Vec4};

/// A ray as the kernel carries it: exact for distances, rounded for the search.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Where it goes, any length; distances are in its lengths.
    pub direction: DVec3,
}

/// What Woop's test needs of a ray.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    /// The axis along which the direction is longest comes last.
    axes: [usize; 3],
    /// By these axes.
    origin: [Vec4; 3],
    shear_x: Vec4,
    shear_y: Vec4,
    scale_z: Vec4,
}

impl ShearedRay {
    /// `direction` must not be 0.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let [x, y, z] = direction.abs().to_array();
        let axes = if x >= y && x >= z {
            [1, 2, 0]
        } else if y >= z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        };
        let [dx, dy, dz] = axes.map(|axis| direction[axis]);
        let scale = 1.0 / dz;
        ShearedRay {
            axes,
            origin: axes.map(|axis| Vec4::splat(origin[axis])),
            shear_x: Vec4::splat(dx * scale),
            shear_y: Vec4::splat(dy * scale),
            scale_z: Vec4::splat(scale),
        }
    }
}

/// Four triangles: corner, axis, lane. Lanes without a triangle are NaN and are never hit.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    corners: [[Vec4; 3]; 3],
}

impl Block {
    /// No triangles.
    pub const EMPTY: Block = Block { corners: [[Vec4::NAN; 3]; 3] };

    /// Puts a triangle into a lane.
    pub fn set(&mut self, lane: usize, triangle: [Vec3; 3]) {
        for (corner, point) in self.corners.iter_mut().zip(triangle) {
            for (axis, coordinate) in corner.iter_mut().zip(point.to_array()) {
                axis[lane] = coordinate;
            }
        }
    }

    /// The corners in a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> [DVec3; 3] {
        let point = |[x, y, z]: &[Vec4; 3]| Vec3::new(x[lane], y[lane], z[lane]).as_dvec3();
        let [a, b, c] = &self.corners;
        [point(a), point(b), point(c)]
    }

    /// A bit for each lane whose triangle the line goes through, some of it between 0 and `tmax`.
    #[inline(always)]
    pub fn candidates(&self, ray: &ShearedRay, tmax: f32) -> u32 {
        let [kx, ky, kz] = ray.axes;
        let sheared = |corner: usize| {
            let corner: &[Vec4; 3] = &self.corners[corner];
            let z = corner[kz % 3] - ray.origin[2];
            let x = (corner[kx % 3] - ray.origin[0]) - ray.shear_x * z;
            let y = (corner[ky % 3] - ray.origin[1]) - ray.shear_y * z;
            (x, y, z * ray.scale_z)
        };
        let (a, b, c) = (sheared(0), sheared(1), sheared(2));
        let u = c.0 * b.1 - c.1 * b.0;
        let v = a.0 * c.1 - a.1 * c.0;
        let w = b.0 * a.1 - b.1 * a.0;
        let zero = Vec4::ZERO;
        let front = u.cmpge(zero) & v.cmpge(zero) & w.cmpge(zero);
        let back = u.cmple(zero) & v.cmple(zero) & w.cmple(zero);
        // The distance lies between those of the corners.
        let within =
            a.2.max(b.2).max(c.2).cmpge(zero) & a.2.min(b.2).min(c.2).cmple(Vec4::splat(tmax));
        ((front | back) & within).bitmask()
    }
}

/// One triangle of a block.
#[derive(Clone, Copy, Debug)]
pub struct OfBlock<'a> {
    /// The block.
    pub block: &'a Block,
    /// Its lane.
    pub lane: usize,
}

impl OfBlock<'_> {
    /// Its corners.
    #[inline]
    pub fn corners(&self) -> [DVec3; 3] {
        self.block.get(self.lane)
    }
}

/// Distance along the ray to the triangle's plane, or `None` if it runs along it.
#[inline]
pub fn plane_distance(ray: &Ray, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let normal = (b - a).cross(c - a);
    let along = normal.dot(ray.direction);
    (along != 0.0).then(|| normal.dot(a - ray.origin) / along)
}

/// Barycentric coordinates of the second and third corner where the ray meets the triangle, inside
/// `[0, 1]` with a sum of at most 1.
pub fn barycentric(ray: &Ray, [a, b, c]: [DVec3; 3]) -> Vec2 {
    let (ab, ac) = (b - a, c - a);
    let along = ab.cross(ac).dot(ray.direction);
    let turned = ray.direction.cross(ray.origin - a);
    let (u, v) = (ac.dot(turned) / along, -ab.dot(turned) / along);
    let (u, v) = (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0));
    let over = (u + v).max(1.0);
    Vec2::new((u / over) as f32, (v / over) as f32)
}
