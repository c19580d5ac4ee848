//! What lights look like, for people who compare tree files.

use crate::emitter::{LightSource, PosedEmitters};
use crate::light_tree::LightLook;
use crate::math::color::Rgb;
use crate::scene::{LightKind, Scene};
use rayon::prelude::*;

/// The looks of all lights in a pose, in their order.
pub(super) fn looks(posed: &PosedEmitters) -> Vec<LightLook> {
    let PosedEmitters { scene, emitters, pose } = *posed;
    let means: Vec<Rgb> = (0..emitters.mesh_lights().len())
        .into_par_iter()
        .map(|row| texture_mean(posed, row))
        .collect();
    let look = |source| match source {
        LightSource::Mesh { instance, mesh_light } => {
            let nits = scene.rgb_of_instance(instance, pose) * means[mesh_light as usize];
            LightLook::new(LightLook::MESH, nits)
        }
        LightSource::Light(row) => LightLook::new(kind(scene, row), scene.rgb_of_light(row, pose)),
    };
    emitters.lights().iter().map(|light| look(light.source)).collect()
}

fn kind(scene: &Scene, light: u32) -> u16 {
    match scene.lights[light as usize].kind {
        LightKind::Point { .. } => LightLook::POINT,
        LightKind::Spot { .. } => LightLook::SPOT,
        LightKind::Sphere { .. } => LightLook::SPHERE,
        LightKind::Distant { .. } | LightKind::Dome { .. } => {
            unreachable!("lights at infinity are no emitters")
        }
    }
}

/// The mean of a mesh light's emission texture over the area of its emitters; white without one.
fn texture_mean(posed: &PosedEmitters, row: usize) -> Rgb {
    let light = &posed.emitters.mesh_lights()[row];
    let mesh = &posed.scene.meshes[light.mesh as usize];
    let positions = posed.pose.positions(posed.scene, light.mesh);
    let sum = (0..light.count).fold(glam::DVec3::ZERO, |sum, own| {
        let corners = mesh.triangles[light.triangle(own) as usize];
        let [a, b, c] = corners.map(|corner| positions[corner as usize].as_dvec3());
        sum + light.texture_mean(own).as_dvec3() * (b - a).cross(c - a).length()
    });
    if sum == glam::DVec3::ZERO {
        // Without area, as a light may be that deforms: then all triangles count alike.
        let sum = (0..light.count).map(|own| light.texture_mean(own)).sum::<Rgb>();
        return sum / sum.max_element().max(f32::MIN_POSITIVE);
    }
    // `LightLook` wants a hue, whatever its strength; but numbers must stay in range.
    (sum / sum.max_element().max(f64::MIN_POSITIVE)).as_vec3()
}
