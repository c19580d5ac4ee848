//! Emitters at one time: light from a point of them.

use super::set::{EmitterPlace, Emitters};
use super::sphere::WorldSphere;
use super::triangle::WorldTriangle;
use crate::math::angle::OffAxis;
use crate::math::built_in;
use crate::math::color::Rgb;
use crate::math::directions::{aim, light_axes, mirrors};
use crate::scene::{Instance, Light, LightKind, Material, Pose, Scene, Shaping};
use glam::{Affine3A, DVec3, Vec2, Vec3};

/// The emitters of a scene, placed by a pose.
#[derive(Clone, Copy)]
pub struct PosedEmitters<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its emitters.
    pub emitters: &'a Emitters,
    /// Where everything is.
    pub pose: &'a Pose,
}

/// Light from a point of an emitter towards a receiver.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit, from the receiver.
    pub direction: Vec3,
    /// Where on the light, world space, metres.
    pub point: Vec3,
    /// Normal of the light's surface there, unit; zero for a point or a spot.
    pub normal: Vec3,
    /// The largest coordinate that `point` was computed from, metres: bounds its rounding.
    pub magnitude_m: f32,
    /// Radiance, nits; from a point or a spot the irradiance of a facing surface, lux.
    pub radiance: Rgb,
    /// Density over solid angle, 1/sr; `None` for a point or a spot, which no ray can hit.
    pub pdf: Option<f32>,
    /// Where on a mesh light: its coverage there, which a material may lower, is not in `radiance`.
    pub on_mesh: Option<MeshPlace>,
    /// Whether reflected rays meet the light.
    pub is_seen: bool,
}

/// A place on an instance of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct MeshPlace {
    /// Index into [`Scene::instances`].
    pub instance: u32,
    /// Index into the mesh's triangles.
    pub triangle: u32,
    /// Weights of the second and third corner.
    pub barycentric: Vec2,
}

/// A place on an emitter that a ray has hit.
#[derive(Clone, Copy, Debug)]
pub struct EmitterHit {
    /// Which emitter.
    pub emitter: u32,
    /// Barycentric coordinates of the second and third corner, on a triangle.
    pub barycentric: Vec2,
    /// World space, metres.
    pub point: Vec3,
}

impl<'a> PosedEmitters<'a> {
    /// Light from an emitter to a receiver; `None` if this point of it gives none.
    pub fn sample(&self, emitter: u32, receiver: Vec3, u: Vec2) -> Option<LightSample> {
        match self.emitters.place_of(emitter) {
            EmitterPlace::Triangle { instance: row, triangle: number } => {
                let triangle = self.triangle(&self.scene.instances[row as usize], number);
                let found = triangle.sample(receiver, u)?;
                let barycentric = found.barycentric;
                let point = triangle.at(barycentric);
                let direction = (point.as_dvec3() - receiver.as_dvec3()).try_normalize()?;
                let radiance =
                    self.triangle_radiance(row, number, &triangle, barycentric, direction);
                (radiance != Rgb::ZERO).then_some(LightSample {
                    direction: direction.as_vec3(),
                    point,
                    normal: triangle.normal(),
                    magnitude_m: triangle.magnitude_m(),
                    radiance,
                    pdf: Some(found.pdf),
                    on_mesh: Some(MeshPlace { instance: row, triangle: number, barycentric }),
                    is_seen: self.scene.instances[row as usize].visibility.reflections,
                })
            }
            EmitterPlace::Light(row) => self.sample_light(row, receiver, u),
        }
    }

    fn sample_light(&self, row: u32, receiver: Vec3, u: Vec2) -> Option<LightSample> {
        let light = &self.scene.lights[row as usize];
        let rgb = self.scene.rgb_of_light(row, self.pose);
        let sample = match &light.kind {
            LightKind::Point { .. } => self.sample_point(light, receiver, rgb, None)?,
            LightKind::Spot { shaping, .. } => {
                self.sample_point(light, receiver, rgb, Some(*shaping))?
            }
            LightKind::Sphere { shaping, .. } => {
                let found = self.sphere(light).sample(receiver, u)?;
                LightSample {
                    direction: found.direction,
                    point: found.point,
                    normal: found.normal,
                    magnitude_m: found.point.abs().max_element(),
                    radiance: rgb * self.profile(*shaping, light.node, found.direction.as_dvec3()),
                    pdf: Some(found.pdf),
                    on_mesh: None,
                    is_seen: light.visibility.reflections,
                }
            }
            LightKind::Distant { .. } | LightKind::Dome { .. } => return None,
        };
        (sample.radiance != Rgb::ZERO).then_some(sample)
    }

    /// `I / d^2`, with the profile and with glTF's window where the light has a range.
    fn sample_point(
        &self,
        light: &Light,
        receiver: Vec3,
        intensity_cd: Rgb,
        shaping: Option<Shaping>,
    ) -> Option<LightSample> {
        let point = Vec3::from(self.pose.world(light.node).translation);
        let to_light = point.as_dvec3() - receiver.as_dvec3();
        let distance = to_light.length();
        let direction = to_light.try_normalize()?;
        let profile = self.profile(shaping, light.node, to_light);
        let ratio = light
            .range_m
            .filter(|_| built_in::RANGE)
            .map_or(0.0, |range| distance / f64::from(range));
        let window = (1.0 - ratio.powi(4)).max(0.0);
        let radiance = intensity_cd * profile * (window / (distance * distance)) as f32;
        radiance.is_finite().then_some(LightSample {
            direction: direction.as_vec3(),
            point,
            normal: Vec3::ZERO,
            magnitude_m: 0.0,
            radiance,
            pdf: None,
            on_mesh: None,
            is_seen: false,
        })
    }

    /// The factor of an emission profile about a node's -Z on light that a viewer sees in some
    /// direction, of any length but zero.
    pub(super) fn profile(&self, shaping: Option<Shaping>, node: u32, direction: DVec3) -> Rgb {
        let Some(shaping) = shaping else { return Rgb::ONE };
        let factor = shaping.factor(OffAxis::between(self.aim(node), -direction));
        match shaping.ies(self.scene) {
            None => factor,
            Some(profile) if factor != Rgb::ZERO => {
                let axes = light_axes(&self.pose.world(node));
                factor * profile.factor(axes.transpose() * -direction.normalize())
            }
            Some(_) => factor,
        }
    }

    /// Radiance that a ray sees where it has hit an emitter, nits. `direction` is the ray's, unit.
    pub fn radiance(&self, hit: &EmitterHit, direction: Vec3) -> Rgb {
        match self.emitters.place_of(hit.emitter) {
            EmitterPlace::Triangle { instance, triangle: number } => {
                let triangle = self.triangle(&self.scene.instances[instance as usize], number);
                let (at, direction) = (hit.barycentric, direction.as_dvec3());
                self.triangle_radiance(instance, number, &triangle, at, direction)
            }
            EmitterPlace::Light(row) => match &self.scene.lights[row as usize] {
                Light { node, kind: LightKind::Sphere { shaping, .. }, .. } => {
                    self.scene.rgb_of_light(row, self.pose)
                        * self.profile(*shaping, *node, direction.as_dvec3())
                }
                _ => Rgb::ZERO,
            },
        }
    }

    /// The density over solid angle with which [`sample`](Self::sample), given this emitter, would
    /// have found the hit from a receiver, 1/sr.
    pub fn pdf(&self, hit: &EmitterHit, receiver: Vec3) -> f32 {
        match self.emitters.place_of(hit.emitter) {
            EmitterPlace::Triangle { instance, triangle } => {
                let instance = &self.scene.instances[instance as usize];
                self.triangle(instance, triangle).pdf(receiver, hit.point)
            }
            EmitterPlace::Light(row) => match &self.scene.lights[row as usize] {
                light if matches!(light.kind, LightKind::Sphere { .. }) => {
                    self.sphere(light).pdf(receiver)
                }
                _ => 0.0,
            },
        }
    }

    fn triangle_radiance(
        &self,
        row: u32,
        number: u32,
        triangle: &WorldTriangle,
        barycentric: Vec2,
        direction: DVec3,
    ) -> Rgb {
        let instance = &self.scene.instances[row as usize];
        let material = self.material(instance);
        let facing = -direction.dot(triangle.area_normal()) * self.handedness(instance);
        if facing == 0.0 || (facing < 0.0 && !material.double_sided) {
            return Rgb::ZERO;
        }
        let mut radiance = self.scene.rgb_of_instance(row, self.pose);
        if built_in::TEXTURES
            && let Some(usage) = material.emission_texture
        {
            let mesh = &self.scene.meshes[instance.mesh as usize];
            if let Some(uvs) = mesh.uv_sets.get(usage.uv_set as usize).filter(|set| !set.is_empty())
            {
                let corners = mesh.triangles[number as usize];
                let [a, b, c] = corners.map(|corner| uvs[corner as usize]);
                let uv = a + (b - a) * barycentric.x + (c - a) * barycentric.y;
                let texture = &self.scene.textures[usage.texture as usize];
                radiance *= texture.lookup(usage.map(uv)).truncate();
            }
        }
        radiance * self.profile(instance.shaping, instance.node, direction)
    }

    pub(super) fn material(&self, instance: &Instance) -> &'a Material {
        self.scene.material_of(instance.mesh).expect("an emitter has a material")
    }

    /// A triangle in world space.
    pub(super) fn triangle(&self, instance: &Instance, triangle: u32) -> WorldTriangle {
        self.triangle_through(&self.pose.world(instance.node), instance.mesh, triangle)
    }

    /// A triangle of a mesh, in the shape that the mesh has in this pose, seen through a transform.
    pub(super) fn triangle_through(
        &self,
        transform: &Affine3A,
        mesh: u32,
        triangle: u32,
    ) -> WorldTriangle {
        let corners = self.scene.meshes[mesh as usize].triangles[triangle as usize];
        let positions = self.pose.positions(self.scene, mesh);
        WorldTriangle {
            corners: corners.map(|corner| transform.transform_point3(positions[corner as usize])),
        }
    }

    /// -1 for an instance whose transform mirrors, and whose triangles therefore wind the other way.
    pub(super) fn handedness(&self, instance: &Instance) -> f64 {
        if mirrors(&self.pose.world(instance.node)) { -1.0 } else { 1.0 }
    }

    pub(super) fn sphere(&self, light: &Light) -> WorldSphere {
        let world = self.pose.world(light.node);
        let radius = match light.kind {
            LightKind::Sphere { radius, .. } => radius,
            _ => 0.0,
        };
        let radius = self.pose.world_radius(light.node, radius);
        WorldSphere { center: world.translation.into(), radius }
    }

    /// Where a node aims its light, unit, world space.
    pub(super) fn aim(&self, node: u32) -> DVec3 {
        aim(&self.pose.world(node))
    }
}
