//! Lights that are not meshes: `KHR_lights_punctual`, and what `extras.usdLux` adds.

use super::document::{UsdLux, UsdValues, reals};
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::ingest::image::{self, Coding};
use crate::math::color::Rgb;
use crate::scene::{
    Interpolation, Keys, Light, LightKind, Material, Shaping, Texture, Visibility, Wrap,
};
use gltf::json::extensions::scene::khr_lights_punctual::{Light as Row, Type};
use gltf::json::validation::Checked;

/// More keys than this are refused: half a day of frames at 24 a second.
const MOST_KEYS: usize = 1 << 20;

/// What a node says of the meshes at it.
#[derive(Clone, Copy)]
pub(super) struct Placed<'a> {
    pub lux: Option<&'a UsdLux>,
    pub shaping: Option<Shaping>,
    /// Of the node's light, unless that is no mesh.
    pub values: Option<&'a Keys<Rgb>>,
    pub forced: bool,
    pub visibility: Visibility,
    /// Whether a light has the node's path already.
    pub has_light: bool,
    pub object: &'a str,
}

impl Placed<'_> {
    /// The radius of the sphere light that the mesh stands for, if it does.
    pub(super) fn sphere_radius(&self) -> Result<Option<f32>, Fault> {
        // One node has one light.
        let is_sphere = |lux: &&UsdLux| lux.kind == "SphereLight" && !self.has_light;
        let Some(lux) = self.lux.filter(is_sphere) else { return Ok(None) };
        match lux.radius.map(|radius| radius.f32()) {
            Some(radius) if radius <= 0.0 => {
                Err(Fault::new(self.object, "extras.usdLux: radius is not positive"))
            }
            radius => Ok(radius),
        }
    }

    /// A copy of the values for one more light.
    pub(super) fn copy_values(&self, output: &mut Output) -> Result<Option<Keys<Rgb>>, Fault> {
        let bytes = self.values.map_or(0, |keys| keys.times_s.len() * size_of::<(f32, Rgb)>());
        output.budget.take(bytes as u64, || self.object.to_string())?;
        Ok(self.values.cloned())
    }
}

/// The light at a node, other than its meshes; constant.
pub(super) fn of_node(
    source: &Source,
    output: &mut Output,
    number: usize,
    lux: Option<&UsdLux>,
    node: u32,
    object: &str,
) -> Result<Option<Light>, Fault> {
    let (forced, visibility) = (lux.is_some_and(|lux| lux.force), visibility(lux));
    let light =
        |kind, range_m| Some(Light { node, kind, values: None, range_m, forced, visibility });
    if let Some(lux) = lux.filter(|lux| lux.kind == "DomeLight") {
        return Ok(light(dome(source, output, lux, object)?, None));
    }
    let Some(punctual) = source.document.light_at(number) else {
        if let Some(lux) = lux.filter(|_| source.document.nodes[number].mesh.is_none()) {
            output.notes.add(object, format!("a {} has no carrier in glTF; left out", lux.kind));
        }
        return Ok(None);
    };
    let punctual = &source.document.lights()[punctual.value()];
    let kind = match shaping(lux, object)? {
        Some(shaping) if punctual.type_ != Checked::Valid(Type::Directional) => {
            LightKind::Spot { intensity_cd: strength(punctual, object)?, shaping }
        }
        _ => punctual_kind(punctual, lux, object)?,
    };
    let is_distant = matches!(kind, LightKind::Distant { .. });
    let range_m = punctual.range.filter(|_| !is_distant);
    Ok(light(kind, range_m))
}

fn punctual_kind(row: &Row, lux: Option<&UsdLux>, object: &str) -> Result<LightKind, Fault> {
    let strength = strength(row, object)?;
    Ok(match (row.type_, &row.spot) {
        (Checked::Valid(Type::Directional), _) => {
            let angle = lux.and_then(|lux| lux.angle).map_or(0.0, |angle| angle.f32());
            if !(0.0..=360.0).contains(&angle) {
                return Err(Fault::new(object, "extras.usdLux: angle is not in [0, 360]"));
            }
            LightKind::Distant { irradiance_lux: strength, angle_rad: angle.to_radians() }
        }
        (Checked::Valid(Type::Spot), Some(spot)) => {
            let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
            let outer_rad = outer.min(std::f32::consts::FRAC_PI_2);
            let shaping = Shaping::Khr { inner_rad: inner.min(outer_rad), outer_rad };
            LightKind::Spot { intensity_cd: strength, shaping }
        }
        _ => LightKind::Point { intensity_cd: strength },
    })
}

fn strength(row: &Row, object: &str) -> Result<Rgb, Fault> {
    let strength = Rgb::from(row.color) * row.intensity;
    match strength.is_finite() {
        true => Ok(strength),
        false => Err(Fault::new(object, "its light is too strong for a 32-bit number")),
    }
}

/// The strength over time that `extras.usdLux` gives, in the light's own unit. One key if it is
/// constant.
pub(super) fn values(lux: Option<&UsdLux>, object: &str) -> Result<Option<Keys<Rgb>>, Fault> {
    let Some(UsdValues { times, rgb }) = lux.and_then(|lux| lux.values.as_ref()) else {
        return Ok(None);
    };
    let fault =
        |problem: String| Err(Fault::new(object, format!("extras.usdLux.values: {problem}")));
    if times.is_empty() || times.len() > MOST_KEYS {
        return fault(format!("{} keys are not 1 to {MOST_KEYS}", times.len()));
    }
    if times.len() != rgb.len() {
        return fault(format!("{} times and {} rgb values", times.len(), rgb.len()));
    }
    let times_s: Vec<f32> = times.iter().map(|time| time.f32()).collect();
    if !times_s.is_sorted_by(|before, after| before < after) {
        return fault("its times do not ascend".into());
    }
    let values: Vec<Rgb> = rgb.iter().map(|&rgb| reals(rgb).into()).collect();
    if values.iter().any(|value| value.min_element() < 0.0) {
        return fault("an rgb value is negative".into());
    }
    Ok(Some(Keys { times_s, values, interpolation: Interpolation::Linear }.settled()))
}

/// The emission profile that `extras.usdLux` gives.
pub(super) fn shaping(lux: Option<&UsdLux>, object: &str) -> Result<Option<Shaping>, Fault> {
    let Some(shaping) = lux.and_then(|lux| lux.shaping.as_ref()) else { return Ok(None) };
    // UsdLux's own default.
    let cone = shaping.cone_angle.map_or(90.0, |angle| angle.f32());
    let tint = reals(shaping.focus_tint);
    if cone < 0.0 || tint.iter().any(|&part| part < 0.0) {
        return Err(Fault::new(object, "extras.usdLux: shaping has a negative cone or tint"));
    }
    Ok(Some(Shaping::Usd {
        cone_rad: cone.to_radians(),
        softness: shaping.cone_softness.f32().clamp(0.0, 1.0),
        // A negative focus is ignored by UsdLux's definition.
        focus: shaping.focus.f32().max(0.0),
        focus_tint: tint,
    }))
}

/// The sphere light that a tessellated mesh of this material stands for; constant.
pub(super) fn sphere(material: &Material, radius: f32, node: u32, placed: &Placed) -> Light {
    let radiance_nits = material.emission_nits;
    let kind = LightKind::Sphere { radiance_nits, radius, shaping: placed.shaping };
    let Placed { forced, visibility, .. } = *placed;
    Light { node, kind, values: None, range_m: None, forced, visibility }
}

/// Which rays meet the light at a node: by its type, and by what the node says itself.
pub(super) fn visibility(lux: Option<&UsdLux>) -> Visibility {
    let Some(UsdLux { kind, visibility, .. }) = lux else { return Visibility::ALL };
    let usual = match kind.as_str() {
        "RectLight" | "DiskLight" | "SphereLight" | "CylinderLight" => Visibility::LAMP,
        _ => Visibility::ALL,
    };
    Visibility {
        camera: visibility.camera.unwrap_or(usual.camera),
        reflections: visibility.reflections.unwrap_or(usual.reflections),
        shadows: visibility.shadows.unwrap_or(usual.shadows),
    }
}

fn dome(
    source: &Source,
    output: &mut Output,
    lux: &UsdLux,
    object: &str,
) -> Result<LightKind, Fault> {
    let radiance = lux.radiance.map_or([1.0; 3], reals);
    if radiance.iter().any(|&part| part < 0.0) {
        return Err(Fault::new(object, "extras.usdLux: radiance is negative"));
    }
    let texture = match &lux.texture {
        Some(uri) => {
            let object = format!("{object}, dome texture {uri:?}");
            let bytes = source.folder.read_uri(uri, &object)?;
            let picture = image::decode(&bytes, Coding::Srgb, &object, &mut output.picture_budget)?;
            output.scene.textures.push(Texture {
                name: uri.clone(),
                width: picture.width,
                height: picture.height,
                pixels: picture.pixels,
                wrap: [Wrap::Repeat, Wrap::Clamp],
                bilinear: true,
            });
            Some(output.scene.textures.len() as u32 - 1)
        }
        None => None,
    };
    Ok(LightKind::Dome { radiance_nits: radiance.into(), texture })
}
