//! From a hit to a shading point: normals, textures, material.
//!
//! [`Surfaces`] answers for one frame. It evaluates a [`Material`] (factors times textures times
//! vertex colour) and the mesh's attributes at a point of a triangle. It does not trace, and it does not
//! evaluate emission.
//!
//! Sides. The geometric normal of a hit is the front's. Reflection is two-sided, so the shading frame is
//! flipped to the side of `wo`. A normal of the file that points against the winding is flipped. If the
//! file has no normals, the triangle's normal is used. A normal that a normal map or interpolation bends
//! away from `wo` is bent back until `wo` is above its horizon. It is not bent past the cosine between
//! `wo` and the triangle's normal: a flat surface is never bent, however grazing `wo` is. A coat's own normals are
//! treated alike.

use super::bsdf::{ALPHA_MIN, Bsdf, Passage, SurfaceSample};
use super::rays::{Anchor, Hit, HitSurface};
use crate::math::color::Rgb;
use crate::math::directions::mirrors;
use crate::math::{Frame, built_in};
use crate::scene::{AlphaMode, Material, Mesh, Pose, Scene, Shape, TextureUse};
use glam::{Affine3A, DMat3, DVec3, Vec2, Vec3, Vec4};
use std::ops::{Add, Mul};

/// The smallest cosine between `wo` and a shading normal that is not the triangle's own.
const LEAST_COSINE: f32 = 1e-3;

/// Solid glass bends light at least like this: without any bend, directions of 32 bits could not tell a lobe.
const LEAST_IOR: f32 = 1.001;
/// And at most like this: the square of what is larger could vanish in 32 bits.
const MOST_IOR: f32 = 1e3;

/// Whether a material is a pane: thin glass, so smooth that light passes it straight. Its GGX alpha is at most
/// [`ALPHA_MIN`] everywhere, which is that of a roughness of 0.0316.
pub fn is_pane(material: &Material) -> bool {
    let is_thin = material.transmission.is_some_and(|passes| passes.volume.is_none());
    is_thin && material.roughness * material.roughness <= ALPHA_MIN
}

/// Looks up what is at a hit, for one pose of a scene.
#[derive(Clone, Debug)]
pub struct Surfaces<'a> {
    scene: &'a Scene,
    pose: &'a Pose,
    plain: Material,
    /// Whether any glass is solid.
    has_volumes: bool,
}

/// A point that light arrives at and leaves from.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// World-space position and geometric normal *of the front*.
    pub anchor: Anchor,
    /// Whether `wo` is on the front's side.
    pub front: bool,
    /// Shading frame, world space; its normal is on `wo`'s side.
    pub frame: Frame,
    /// Of the coat, on `wo`'s side, where it has others than what is below.
    pub coat_normal: Option<Vec3>,
    /// The material here.
    pub sample: SurfaceSample,
}

impl Surface {
    /// How this point reflects.
    pub fn bsdf(&self) -> Bsdf {
        Bsdf::new(&self.sample, self.frame).coated_about(self.coat_normal)
    }
}

/// A point of a triangle of an instance.
#[derive(Clone, Copy)]
struct At<'a> {
    mesh: &'a Mesh,
    /// Of a mesh that deforms.
    shape: Option<&'a Shape>,
    corners: [usize; 3],
    weights: [f32; 3],
}

impl<'a> Surfaces<'a> {
    /// The surfaces of a scene as it stands in `pose`.
    pub fn new(scene: &'a Scene, pose: &'a Pose) -> Surfaces<'a> {
        let has_volumes = scene.materials.iter().any(Material::is_solid_glass);
        Surfaces { scene, pose, plain: Material::default(), has_volumes }
    }

    /// The share of light that a point blocks, in `[0, 1]`: its opacity in a blended material, 0 or 1 in
    /// a masked one, 1 in an opaque one. A ray counts a hit if this exceeds a random number from
    /// `[0, 1)`.
    pub fn coverage(&self, instance: u32, triangle: u32, barycentric: Vec2) -> f32 {
        let (at, material) = self.locate(instance, triangle, barycentric);
        let opacity = || {
            let texture = self.lookup(&at, &material.base_color_texture);
            (material.opacity * texture.w * at.color().w).clamp(0.0, 1.0)
        };
        match material.alpha_mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask(cutoff) => f32::from(u8::from(opacity() >= cutoff)),
            AlphaMode::Blend => opacity(),
        }
    }

    /// The shading point of a triangle hit, seen from the unit direction `wo`.
    pub fn at(
        &self,
        instance: u32,
        triangle: u32,
        barycentric: Vec2,
        anchor: Anchor,
        wo: Vec3,
    ) -> Surface {
        let (at, material) = self.locate(instance, triangle, barycentric);
        let front = anchor.normal.dot(wo) >= 0.0;
        let node = self.scene.instances[instance as usize].node;
        let to_world = self.pose.world(node);
        let least = anchor.normal.dot(wo).abs().min(LEAST_COSINE);
        let bent = |map: Option<(TextureUse, f32)>| {
            let normal = self.shading_normal(&at, map, &to_world, anchor.normal);
            toward(if front { normal } else { -normal }, wo, least)
        };
        let frame = Frame::around(bent(normal_map(material)));
        let mut sample = self.evaluate(&at, material);
        let coat_normal = (sample.coat > 0.0 && material.has_coat_normals())
            .then(|| bent(coat_normal_map(material)));
        if let Passage::Solid(ior) = sample.passage {
            sample.passage = Passage::Solid(if front { ior } else { 1.0 / ior });
        }
        Surface { anchor, front, frame, coat_normal, sample }
    }

    /// What is behind the surface of solid glass: its absorption, 1/m. `None` if it is none.
    #[inline]
    pub fn volume(&self, instance: u32) -> Option<Rgb> {
        if !(built_in::TRANSMISSION && self.has_volumes) {
            return None;
        }
        let mesh = &self.scene.meshes[self.scene.instances[instance as usize].mesh as usize];
        let material = &self.scene.materials[mesh.material? as usize];
        Some(material.transmission?.volume?.absorption)
    }

    /// The share of light that a pane lets through along a unit direction, either way; none if the hit is on something
    /// else.
    pub fn tint(&self, pane: &Hit, direction: Vec3) -> Rgb {
        let HitSurface::Triangle { instance, triangle, barycentric } = pane.surface else {
            return Rgb::ZERO;
        };
        let (at, material) = self.locate(instance, triangle, barycentric);
        let node = self.scene.instances[instance as usize].node;
        let to_world = self.pose.world(node);
        // Not bent towards either end, so that both ends see the same tint.
        let cosine = |map: Option<(TextureUse, f32)>| {
            let normal = self.shading_normal(&at, map, &to_world, pane.anchor.normal);
            normal.dot(direction).abs()
        };
        let own = cosine(normal_map(material));
        let coat = match material.has_coat_normals() {
            true => cosine(coat_normal_map(material)),
            false => own,
        };
        self.evaluate(&at, material).tint(own, coat)
    }

    fn locate(&self, instance: u32, triangle: u32, barycentric: Vec2) -> (At<'a>, &Material) {
        let number = self.scene.instances[instance as usize].mesh;
        let mesh = &self.scene.meshes[number as usize];
        let shape = self.pose.shape(self.scene, number);
        let corners = mesh.triangles[triangle as usize].map(|corner| corner as usize);
        let [u, v] = barycentric.to_array();
        let material = mesh.material.map_or(&self.plain, |m| &self.scene.materials[m as usize]);
        (At { mesh, shape, corners, weights: [1.0 - u - v, u, v] }, material)
    }

    /// White where there is no texture.
    #[inline]
    fn lookup(&self, at: &At, texture: &Option<TextureUse>) -> Vec4 {
        match texture {
            Some(used) if built_in::TEXTURES => {
                let uv = used.map(at.interpolate(at.uv_set(used)));
                self.scene.textures[used.texture as usize].lookup(uv)
            }
            _ => Vec4::ONE,
        }
    }

    fn evaluate(&self, at: &At, material: &Material) -> SurfaceSample {
        let base = self.lookup(at, &material.base_color_texture) * at.color();
        let rough_metal = self.lookup(at, &material.metallic_roughness_texture);
        let specular = material.specular * self.lookup(at, &material.specular_texture).w;
        let tint = self.lookup(at, &material.specular_color_texture).truncate();
        let reflected = ((material.ior - 1.0) / (material.ior + 1.0)).powi(2);
        let f0 = (reflected * material.specular_color * tint).min(Rgb::ONE);
        let (coat, coat_roughness) = match &material.coat {
            None => (0.0, 0.0),
            Some(coat) => (
                coat.factor * self.lookup(at, &coat.factor_texture).x,
                coat.roughness * self.lookup(at, &coat.roughness_texture).y,
            ),
        };
        let (transmission, passage) = match &material.transmission {
            Some(passes) if built_in::TRANSMISSION => {
                let passage = match passes.volume {
                    Some(_) => Passage::Solid(material.ior.clamp(LEAST_IOR, MOST_IOR)),
                    None if is_pane(material) => Passage::Straight,
                    None => Passage::Thin,
                };
                (passes.factor * self.lookup(at, &passes.factor_texture).x, passage)
            }
            _ => (0.0, Passage::Straight),
        };
        SurfaceSample {
            base_color: material.base_color * base.truncate(),
            metallic: material.metallic * rough_metal.z,
            roughness: material.roughness * rough_metal.y,
            dielectric_f0: f0 * specular,
            dielectric_f90: specular,
            coat,
            coat_roughness,
            transmission,
            passage,
        }
    }

    /// With a normal map and its scale, or none. Unit, world space, on the front's side.
    fn shading_normal(
        &self,
        at: &At,
        map: Option<(TextureUse, f32)>,
        to_world: &Affine3A,
        flat: Vec3,
    ) -> Vec3 {
        // Products of axes of 1e-20 m vanish in 32 bits.
        let (mirrored, matrix) = (mirrors(to_world), to_world.matrix3.as_dmat3());
        let normals = at.shape.map_or(&at.mesh.normals, |shape| &shape.normals);
        let smooth = if normals.is_empty() {
            flat
        } else {
            let local = at.interpolate(normals).as_dvec3();
            let across = cofactor(matrix) * local;
            let normal = across.try_normalize().map_or(flat, |across| across.as_vec3());
            if normal.dot(flat) < 0.0 { -normal } else { normal }
        };
        let Some((used, scale)) = map.filter(|_| built_in::TEXTURES) else {
            return smooth;
        };
        let texel = self.lookup(at, &Some(used)).truncate() * 2.0 - 1.0;
        let bent = texel * Vec3::new(scale, scale, 1.0);
        let Some((tangent, turn)) = at.tangent(&used) else { return smooth };
        let tangent = (matrix * tangent).reject_from_normalized(smooth.as_dvec3());
        let Some(tangent) = tangent.try_normalize().map(|tangent| tangent.as_vec3()) else {
            return smooth;
        };
        let turn = if mirrored { -turn } else { turn };
        let bitangent = smooth.cross(tangent) * turn;
        (tangent * bent.x + bitangent * bent.y + smooth * bent.z).normalize_or(smooth)
    }
}

impl At<'_> {
    /// Zero where there are no values.
    fn interpolate<T>(&self, values: &[T]) -> T
    where
        T: Copy + Default + Mul<f32, Output = T> + Add<Output = T>,
    {
        if values.is_empty() {
            return T::default();
        }
        let [a, b, c] = self.corners.map(|corner| values[corner]);
        a * self.weights[0] + b * self.weights[1] + c * self.weights[2]
    }

    fn uv_set(&self, used: &TextureUse) -> &[Vec2] {
        self.mesh.uv_sets.get(used.uv_set as usize).map_or(&[], Vec::as_slice)
    }

    fn color(&self) -> Vec4 {
        if self.mesh.colors.is_empty() { Vec4::ONE } else { self.interpolate(&self.mesh.colors) }
    }

    /// Local tangent, and the sign of the bitangent `normal x tangent`. Derived where the mesh has
    /// none: along growing u; the bitangent then goes up the picture, against growing v.
    fn tangent(&self, used: &TextureUse) -> Option<(DVec3, f32)> {
        let tangents = self.shape.map_or(&self.mesh.tangents, |shape| &shape.tangents);
        if !tangents.is_empty() {
            let tangent = self.interpolate(tangents);
            return Some((tangent.truncate().as_dvec3(), 1.0_f32.copysign(tangent.w)));
        }
        let uvs = self.uv_set(used);
        if uvs.is_empty() {
            return None;
        }
        let positions = self.shape.map_or(&self.mesh.positions, |shape| &shape.positions);
        let [a, b, c] = self.corners.map(|corner| positions[corner].as_dvec3());
        let [ta, tb, tc] = self.corners.map(|corner| used.map(uvs[corner]).as_dvec2());
        let (ab, ac) = (b - a, c - a);
        let (tb, tc) = (tb - ta, tc - ta);
        let area = tb.perp_dot(tc);
        let along_u = (ab * tc.y - ac * tb.y) * 1f64.copysign(area);
        // With v downwards a texture that is not mirrored winds the other way than its triangle.
        (area != 0.0).then_some((along_u, -1f32.copysign(area as f32)))
    }
}

/// The normal map of what is below the coat, and its scale.
fn normal_map(material: &Material) -> Option<(TextureUse, f32)> {
    Some((material.normal_texture?, material.normal_scale))
}

/// That of the coat.
fn coat_normal_map(material: &Material) -> Option<(TextureUse, f32)> {
    let coat = material.coat?;
    Some((coat.normal_texture?, coat.normal_scale))
}

/// `det(M) M^-T`, which takes normals along; finite for any matrix.
fn cofactor(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

/// The unit normal, bent towards `wo` just until their cosine is at least `least`.
fn toward(normal: Vec3, wo: Vec3, least: f32) -> Vec3 {
    let cosine = normal.dot(wo);
    if cosine >= least {
        return normal;
    }
    (normal + wo * (least - cosine)).normalize_or(wo)
}

#[cfg(test)]
mod tests;
