//! What a scene needs of the tree and the renderer.

use super::{AlphaMode, Camera, Keys, LightKind, Projection, Scene, Shaping, Visibility};
use serde::Serialize;

/// The features that a scene switches on. What is false or zero here costs nothing anywhere.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Requirements {
    /// Instances of meshes whose material emits.
    pub mesh_lights: usize,
    /// Mesh lights whose emission is textured.
    pub textured_mesh_lights: usize,
    /// Mesh lights and other lights with an emission profile.
    pub shaped_lights: usize,
    /// Those of them, and spots, whose profile is photometric.
    pub photometric_lights: usize,
    /// Mesh lights and other lights whose strength varies with time.
    pub varying_lights: usize,
    /// Sphere lights sampled as spheres.
    pub spheres: usize,
    /// Point lights.
    pub points: usize,
    /// Spot lights.
    pub spots: usize,
    /// Suns.
    pub suns: usize,
    /// Domes.
    pub domes: usize,
    /// Domes with a picture.
    pub pictured_domes: usize,
    /// Lights that are dark beyond a distance.
    pub ranges: usize,
    /// Mesh lights and other lights that are sampled at every point.
    pub forced: usize,
    /// Mesh lights, spheres and lights at infinity that some rays do not meet.
    pub hidden: usize,
    /// Mesh lights and other lights with filters.
    pub filtered_lights: usize,
    /// Mesh lights and other lights of which surfaces reflect more or less than they give.
    pub lights_with_multipliers: usize,
    /// Mesh lights and other lights that do not light everything.
    pub light_links: usize,
    /// Those from which not everything casts shadows.
    pub shadow_links: usize,
    /// Light filters that do not filter for everything.
    pub filter_links: usize,
    /// Meshes that more than one instance shares.
    pub shared_meshes: usize,
    /// Nodes that move.
    pub animated_nodes: usize,
    /// Materials with a coverage below one.
    pub cutouts: usize,
    /// Materials with a normal map, of their own or of their coat.
    pub normal_maps: usize,
    /// Materials with a specular lobe, and one for all meshes without a material.
    pub glossy: usize,
    /// Materials with a clear coat.
    pub coats: usize,
    /// Materials that light passes.
    pub glass: usize,
    /// Those of them that enclose a volume.
    pub solid_glass: usize,
    /// Images.
    pub textures: usize,
    /// Homogeneous fog, 0 or 1.
    pub fog: usize,
    /// Meshes that change their shape with time.
    pub deforming_meshes: usize,
    /// Cameras with a lens.
    pub lenses: usize,
    /// Cameras whose lens, exposure or clipping planes vary with time.
    pub lenses_over_time: usize,
    /// Orthographic cameras.
    pub orthographic_cameras: usize,
    /// Cameras with a shutter.
    pub shutters: usize,
}

impl Requirements {
    pub(super) fn of(scene: &Scene) -> Requirements {
        let mut needs = Requirements { textures: scene.textures.len(), ..Default::default() };
        let mut uses = vec![0u32; scene.meshes.len()];
        for (number, instance) in (0..).zip(&scene.instances) {
            uses[instance.mesh as usize] += 1;
            if let Some(material) = scene.material_of(instance.mesh)
                && scene.peak_rgb_of_instance(number).max_element() > 0.0
            {
                needs.mesh_lights += 1;
                needs.varying_lights +=
                    usize::from(instance.values.as_deref().is_some_and(Keys::varies));
                needs.textured_mesh_lights += usize::from(material.emission_texture.is_some());
                needs.shaped_lights += usize::from(instance.shaping.is_some());
                needs.photometric_lights += usize::from(is_photometric(instance.shaping));
                needs.forced += usize::from(instance.forced);
                needs.hidden += usize::from(instance.visibility != Visibility::ALL);
            }
        }
        let shines = |&row: &u32| scene.peak_rgb_of_instance(row).max_element() > 0.0;
        let filters = &scene.light_filters;
        needs.filtered_lights =
            filters.filtered_instances().filter(shines).count() + filters.filtered_lights().count();
        let responses = &scene.light_responses;
        needs.lights_with_multipliers =
            responses.instances().filter(shines).count() + responses.lights().count();
        let linking = &scene.linking;
        let of_meshes = linking.linked_instances().filter(|(row, _)| shines(row));
        for (_, links) in of_meshes.chain(linking.linked_lights()) {
            needs.light_links += usize::from(links.light.is_some());
            needs.shadow_links += usize::from(links.shadow.is_some());
        }
        needs.filter_links = linking.linked_filters();
        needs.shared_meshes = uses.iter().filter(|&&count| count > 1).count();
        for light in &scene.lights {
            needs.varying_lights += usize::from(light.values.as_deref().is_some_and(Keys::varies));
            needs.ranges += usize::from(light.range_m.is_some());
            needs.forced += usize::from(light.forced);
            match light.kind {
                LightKind::Point { .. } => needs.points += 1,
                LightKind::Spot { shaping, .. } => {
                    needs.spots += 1;
                    needs.photometric_lights += usize::from(is_photometric(Some(shaping)));
                }
                LightKind::Sphere { shaping, .. } => {
                    needs.spheres += 1;
                    needs.shaped_lights += usize::from(shaping.is_some());
                    needs.photometric_lights += usize::from(is_photometric(shaping));
                    needs.hidden += usize::from(light.visibility != Visibility::ALL);
                }
                LightKind::Distant { .. } => needs.suns += 1,
                LightKind::Dome { texture, .. } => {
                    needs.domes += 1;
                    needs.pictured_domes += usize::from(texture.is_some());
                }
            }
            if light.kind.is_infinite() {
                needs.hidden +=
                    usize::from(!light.visibility.camera || !light.visibility.reflections);
            }
        }
        needs.animated_nodes = scene.nodes.iter().filter(|n| !n.channels.is_empty()).count();
        for material in &scene.materials {
            needs.cutouts += usize::from(material.alpha_mode != AlphaMode::Opaque);
            needs.normal_maps += usize::from(material.has_normal_map());
            needs.glossy += usize::from(material.is_glossy());
            needs.coats += usize::from(material.coat.is_some());
            needs.glass += usize::from(material.transmission.is_some());
            needs.solid_glass += usize::from(material.is_solid_glass());
        }
        needs.glossy += usize::from(scene.meshes.iter().any(|mesh| mesh.material.is_none()));
        needs.deforming_meshes = scene.meshes.iter().filter(|m| m.deformation.is_some()).count();
        needs.fog = usize::from(scene.medium.is_some());
        needs.lenses = scene.cameras.iter().filter(|c| c.has_lens()).count();
        needs.lenses_over_time = scene.cameras.iter().filter(|c| c.over_time.is_some()).count();
        let is_parallel = |c: &&Camera| matches!(c.projection, Projection::Orthographic { .. });
        needs.orthographic_cameras = scene.cameras.iter().filter(is_parallel).count();
        needs.shutters = scene.cameras.iter().filter(|c| c.shutter.is_some()).count();
        needs
    }
}

fn is_photometric(shaping: Option<Shaping>) -> bool {
    matches!(shaping, Some(Shaping::Usd { profile: Some(_), .. }))
}
