//! Lights that are not meshes: `KHR_lights_punctual`, and what `extras.usdLux` adds.

use super::cones::{self, Form};
use super::document::{UsdLux, UsdValues, label, reals};
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::ingest::image::{self, Coding};
use crate::math::color::Rgb;
use crate::scene::{
    Category, Interpolation, Keys, Light, LightKind, Links, Material, Response, Shaping, Texture,
    Visibility, Wrap,
};
use gltf::json::extensions::scene::khr_lights_punctual::{Light as Row, Type};
use gltf::json::validation::Checked;
use std::collections::BTreeMap;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

/// More keys than this are refused: half a day of frames at 24 a second.
pub(super) const MOST_KEYS: usize = 1 << 20;

/// What a node says of the meshes at it.
#[derive(Clone, Copy)]
pub(super) struct Placed<'a> {
    pub lux: Option<&'a UsdLux>,
    pub shaping: Option<Shaping>,
    /// Of the node's light, unless that is no mesh.
    pub values: Option<&'a Keys<Rgb>>,
    pub forced: bool,
    pub visibility: Visibility,
    /// Of the node's light and of its geometry.
    pub links: Links,
    /// The number of the filters of the node's light.
    pub filters: Option<u32>,
    /// How much of the node's light surfaces reflect.
    pub response: Response,
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

    /// A copy of the values for one more light, or else of the emission over time of its material.
    pub(super) fn copy_values(
        &self,
        output: &mut Output,
        glow: Option<&Keys<Rgb>>,
    ) -> Result<Option<Box<Keys<Rgb>>>, Fault> {
        let values = self.values.or(glow);
        let bytes = values.map_or(0, |keys| keys.times_s.len() * size_of::<(f32, Rgb)>());
        output.budget.take(bytes as u64, || self.object.to_string())?;
        Ok(values.cloned().map(Box::new))
    }
}

/// The light at a node, other than its meshes; constant. One that cannot be read is left out. The forms are what is animated
/// of the cones and ranges of lights.
pub(super) fn of_node(
    source: &Source,
    output: &mut Output,
    (number, forms): (usize, &BTreeMap<usize, Form>),
    (lux, shaping): (Option<&UsdLux>, Option<Shaping>),
    node: u32,
    object: &str,
) -> Result<Option<Light>, Fault> {
    let (forced, visibility) = (lux.is_some_and(|lux| lux.force), visibility(lux));
    let light = |kind, range_m| Light { node, kind, values: None, range_m, forced, visibility };
    if let Some(lux) = lux.filter(|lux| lux.kind == "DomeLight") {
        return Ok(dome(source, output, lux, object)?.map(|kind| light(kind, None)));
    }
    let Some(index) = source.document.nodes[number].light else {
        if let Some(lux) = lux.filter(|_| source.document.nodes[number].mesh.is_none()) {
            let kind = &lux.kind;
            let text = format!(
                "nothing in the file gives the light of this {kind}; left out (the report of the \
                 export says why: \"lights\")"
            );
            output.notes.add(Category::Lights, object, text);
        }
        return Ok(None);
    };
    let Some(row) = source.document.get(index) else {
        output.notes.add(Category::Lights, object, "its light is not in the file; left out");
        return Ok(None);
    };
    let angle = lux.and_then(|lux| lux.angle).map_or(0.0, |angle| angle.f32());
    if !(0.0..=360.0).contains(&angle) {
        return Err(Fault::new(object, "extras.usdLux: angle is not in [0, 360]"));
    }
    let object = label("light", index.value(), row.name.as_deref());
    let mut note = |text: String| output.notes.add(Category::Lights, &*object, text);
    let row = &cones::opened(forms, index.value(), row);
    let Some(kind) = punctual(row, shaping, angle, &mut note) else { return Ok(None) };
    let is_distant = matches!(kind, LightKind::Distant { .. });
    let range_m = row.range.filter(|range| *range > 0.0 && range.is_finite() && !is_distant);
    if range_m.is_none() && row.range.is_some() && !is_distant {
        note("its range is not positive; it has none".into());
    }
    Ok(Some(light(kind, range_m)))
}

/// Gives a light what animations say of it, unless it has values.
pub(super) fn animate(
    source: &Source,
    output: &mut Output,
    number: usize,
    light: &mut Light,
    strengths: &BTreeMap<usize, Keys<Rgb>>,
) -> Result<(), Fault> {
    let is_other = light.values.is_some() || matches!(light.kind, LightKind::Dome { .. });
    let Some(index) = source.document.nodes[number].light.filter(|_| !is_other) else {
        return Ok(());
    };
    let Some(keys) = strengths.get(&index.value()) else { return Ok(()) };
    let bytes = keys.times_s.len() * size_of::<(f32, Rgb)>();
    output.budget.take(bytes as u64, || label("light", index.value(), None))?;
    light.values = Some(Box::new(keys.clone()));
    Ok(())
}

/// What a row of `KHR_lights_punctual` is, but for its range; `None` if that cannot be told.
fn punctual(
    row: &Row,
    shaping: Option<Shaping>,
    angle_deg: f32,
    note: &mut impl FnMut(String),
) -> Option<LightKind> {
    let Checked::Valid(kind) = row.type_ else {
        note("is of an unknown type; left out".into());
        return None;
    };
    let strength = Rgb::from(row.color).max(Rgb::ZERO) * row.intensity;
    if !strength.is_finite() || row.intensity < 0.0 {
        note("its light is negative, or too strong for a 32-bit number; left out".into());
        return None;
    }
    if row.color.iter().any(|&part| part < 0.0) {
        note("its colour is negative in part; that part is left out".into());
    }
    Some(match (kind, shaping) {
        (Type::Directional, _) => {
            LightKind::Distant { irradiance_lux: strength, angle_rad: angle_deg.to_radians() }
        }
        (_, Some(shaping)) => LightKind::Spot { intensity_cd: strength, shaping },
        (Type::Point, None) => LightKind::Point { intensity_cd: strength },
        (Type::Spot, None) => LightKind::Spot { intensity_cd: strength, shaping: cone(row, note)? },
    })
}

/// The cone of a spot. Equal angles are a hard edge; some programs write angles that only 64 bits tell apart.
pub(super) fn cone(row: &Row, note: &mut impl FnMut(String)) -> Option<Shaping> {
    let (inner, outer) = match &row.spot {
        Some(spot) => (spot.inner_cone_angle, spot.outer_cone_angle),
        None => {
            note("is a spot without cone angles; it has the default, 0 and pi/4".into());
            (0.0, FRAC_PI_4)
        }
    };
    if outer.is_nan() || outer <= 0.0 {
        note("is a spot whose outer cone angle is not positive; left out".into());
        return None;
    }
    if outer > FRAC_PI_2 + 1e-6 {
        note("is a spot whose outer cone angle is larger than pi/2; pi/2 instead".into());
    }
    let outer_rad = outer.min(FRAC_PI_2);
    if !(0.0..=outer).contains(&inner) {
        note(
            "is a spot whose inner cone angle is not between 0 and the outer; its edge is hard"
                .into(),
        );
        return Some(Shaping::Khr { inner_rad: outer_rad, outer_rad });
    }
    Some(Shaping::Khr { inner_rad: inner.min(outer_rad), outer_rad })
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

/// A dome; `None` if its texture cannot be read: without it, it would be far too bright.
fn dome(
    source: &Source,
    output: &mut Output,
    lux: &UsdLux,
    object: &str,
) -> Result<Option<LightKind>, Fault> {
    let radiance = lux.radiance.map_or([1.0; 3], reals);
    if radiance.iter().any(|&part| part < 0.0) {
        return Err(Fault::new(object, "extras.usdLux: radiance is negative"));
    }
    let radiance_nits = radiance.into();
    let Some(uri) = &lux.texture else {
        return Ok(Some(LightKind::Dome { radiance_nits, texture: None }));
    };
    let object = format!("{object}, dome texture {uri:?}");
    let picture = source
        .folder
        .read_uri(uri, &object)
        .and_then(|bytes| image::decode(&bytes, Coding::Srgb, &object, &mut output.picture_budget));
    let picture = match picture {
        Ok(picture) => picture,
        Err(fault) => {
            let text = format!("{}; the dome is left out", fault.into_problem());
            output.notes.add(Category::Lights, object, text);
            return Ok(None);
        }
    };
    output.scene.textures.push(Texture {
        name: uri.clone(),
        width: picture.width,
        height: picture.height,
        pixels: picture.pixels,
        wrap: [Wrap::Repeat, Wrap::Clamp],
        bilinear: true,
    });
    let texture = Some(output.scene.textures.len() as u32 - 1);
    Ok(Some(LightKind::Dome { radiance_nits, texture }))
}
