//! What `extras` carry for Candelabra; see `carriers.md`.

use super::Real;
use crate::ingest::error::Fault;
use gltf::json::Extras;
use serde::Deserialize;
use serde::de::{DeserializeOwned, Deserializer, IgnoredAny, MapAccess, Visitor};
use serde_json::value::RawValue;
use std::borrow::Cow;
use std::fmt;

/// `asset.extras.usd`: the clock of the stage.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::ingest::gltf) struct AssetUsd {
    pub time_codes_per_second: Option<Real>,
    pub zero_time_code: Option<Real>,
    pub start_time_code: Option<Real>,
    pub end_time_code: Option<Real>,
}

/// `extras.usdCamera`: the lens, the exposure and the clipping planes.
#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct UsdCamera {
    #[serde(default, rename = "fStop")]
    pub f_stop: Real,
    #[serde(default, rename = "focalLength_m")]
    pub focal_length_m: Real,
    #[serde(default, rename = "focusDistance_m")]
    pub focus_distance_m: Real,
    #[serde(default, rename = "filmOffset")]
    pub film_offset: [Real; 2],
    #[serde(rename = "exposureScale")]
    pub exposure_scale: Option<Real>,
    #[serde(rename = "clippingRange_m")]
    pub clipping_range_m: Option<[Real; 2]>,
    pub shutter: Option<[Real; 2]>,
    #[serde(default)]
    pub hidden: bool,
    /// Read by itself: what is wrong with it is nothing that is wrong with the constants.
    pub values: Option<Box<RawValue>>,
}

/// `extras.usdCamera.values`: what of the lens varies, one value for each time.
#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct UsdLens {
    pub times: Vec<Real>,
    pub yfov: Option<Vec<Real>>,
    pub ymag: Option<Vec<Real>>,
    #[serde(rename = "fStop")]
    pub f_stop: Option<Vec<Real>>,
    #[serde(rename = "focalLength_m")]
    pub focal_length_m: Option<Vec<Real>>,
    #[serde(rename = "focusDistance_m")]
    pub focus_distance_m: Option<Vec<Real>>,
    #[serde(rename = "filmOffset")]
    pub film_offset: Option<Vec<[Real; 2]>>,
    #[serde(rename = "exposureScale")]
    pub exposure_scale: Option<Vec<Real>>,
    #[serde(rename = "clippingRange_m")]
    pub clipping_range_m: Option<Vec<[Real; 2]>>,
}

/// `extras.usdLux`: the light at a node.
#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct UsdLux {
    #[serde(rename = "type")]
    pub kind: String,
    pub radius: Option<Real>,
    pub shaping: Option<UsdShaping>,
    pub angle: Option<Real>,
    pub radiance: Option<[Real; 3]>,
    pub texture: Option<String>,
    #[serde(default)]
    pub force: bool,
    #[serde(default)]
    pub visibility: UsdVisibility,
    pub group: Option<String>,
    #[serde(default)]
    pub filters: Vec<String>,
    pub diffuse: Option<Real>,
    pub specular: Option<Real>,
    #[serde(rename = "lightLink")]
    pub light_link: Option<u64>,
    #[serde(rename = "shadowLink")]
    pub shadow_link: Option<u64>,
    pub values: Option<UsdValues>,
}

/// `extras.usdLux.visibility`: where it differs from what the type has.
#[derive(Clone, Copy, Default, Deserialize)]
pub(in crate::ingest::gltf) struct UsdVisibility {
    pub camera: Option<bool>,
    pub reflections: Option<bool>,
    pub shadows: Option<bool>,
}

/// `extras.usdLux.values`: the light's strength over time.
#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct UsdValues {
    pub times: Vec<Real>,
    pub rgb: Vec<[Real; 3]>,
}

/// `extras.usdLux.shaping`: UsdLux ShapingAPI, degrees.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::ingest::gltf) struct UsdShaping {
    pub cone_angle: Option<Real>,
    #[serde(default)]
    pub cone_softness: Real,
    #[serde(default)]
    pub focus: Real,
    #[serde(default)]
    pub focus_tint: [Real; 3],
    pub ies: Option<UsdIes>,
}

/// `extras.usdLux.shaping.ies`: a photometric profile.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::ingest::gltf) struct UsdIes {
    /// URI, relative to the file.
    pub file: String,
    #[serde(default)]
    pub angle_scale: Real,
    #[serde(default)]
    pub normalize: bool,
}

/// `extras.usdLightFilter`: what multiplies the light of lights that name the node.
#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct UsdLightFilter {
    #[serde(rename = "type")]
    pub kind: String,
    pub min: Option<[Real; 3]>,
    pub max: Option<[Real; 3]>,
    #[serde(default)]
    pub radius: Real,
    #[serde(default)]
    pub edge: Real,
    pub ramp: Option<Vec<[Real; 2]>>,
    pub inside: Option<[Real; 3]>,
    pub outside: Option<[Real; 3]>,
    pub shape: Option<String>,
    pub through: Option<[Real; 3]>,
    pub near: Option<[Real; 2]>,
    pub far: Option<[Real; 2]>,
    pub share: Option<[Real; 3]>,
    #[serde(rename = "filterLink")]
    pub filter_link: Option<u64>,
}

/// `extras.usdLinks`: the link sets that geometry is in, or those that it is not in.
#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct UsdLinks {
    pub inside: Option<Vec<u64>>,
    pub outside: Option<Vec<u64>>,
}

/// `extras.usdFog`: the homogeneous fog in a node's box, or everywhere.
#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct UsdFog {
    pub extinction: RealOrRgb,
    pub albedo: Option<[Real; 3]>,
    #[serde(default)]
    pub anisotropy: Real,
    pub min: Option<[Real; 3]>,
    pub max: Option<[Real; 3]>,
}

/// One number for all of a colour, or three.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged, expecting = "is neither a 32-bit number nor three of them")]
pub(in crate::ingest::gltf) enum RealOrRgb {
    Real(Real),
    Rgb([Real; 3]),
}

impl AssetUsd {
    pub(in crate::ingest::gltf) fn of(extras: &Extras) -> Result<Option<AssetUsd>, Fault> {
        member(extras, "usd", "asset")
    }
}

impl UsdCamera {
    pub(in crate::ingest::gltf) fn of(
        extras: &Extras,
        object: &str,
    ) -> Result<Option<UsdCamera>, Fault> {
        member(extras, "usdCamera", object)
    }
}

impl UsdLux {
    pub(in crate::ingest::gltf) fn of(
        extras: &Extras,
        object: &str,
    ) -> Result<Option<UsdLux>, Fault> {
        member(extras, "usdLux", object)
    }
}

impl UsdLinks {
    pub(in crate::ingest::gltf) fn of(
        extras: &Extras,
        object: &str,
    ) -> Result<Option<UsdLinks>, Fault> {
        member(extras, "usdLinks", object)
    }
}

impl UsdLightFilter {
    pub(in crate::ingest::gltf) fn of(
        extras: &Extras,
        object: &str,
    ) -> Result<Option<UsdLightFilter>, Fault> {
        member(extras, "usdLightFilter", object)
    }
}

impl UsdFog {
    pub(in crate::ingest::gltf) fn of(
        extras: &Extras,
        object: &str,
    ) -> Result<Option<UsdFog>, Fault> {
        member(extras, "usdFog", object)
    }
}

impl RealOrRgb {
    pub(in crate::ingest::gltf) fn rgb(self) -> [Real; 3] {
        match self {
            RealOrRgb::Real(value) => [value; 3],
            RealOrRgb::Rgb(values) => values,
        }
    }
}

/// `extras.usdPath`, if it is an absolute path; anything else is some other program's.
pub(in crate::ingest::gltf) fn usd_path(extras: &Extras) -> Option<String> {
    let path: String = serde_json::from_str(raw(extras, "usdPath")?).ok()?;
    Some(path).filter(|path| path.starts_with('/') && path.len() > 1)
}

fn member<T: DeserializeOwned>(
    extras: &Extras,
    key: &str,
    object: &str,
) -> Result<Option<T>, Fault> {
    let value = raw(extras, key).map(serde_json::from_str).transpose();
    value.map_err(|error| Fault::new(format!("{object}, extras.{key}"), error))
}

/// The text of a member; extras that are no object have none.
fn raw<'a>(extras: &'a Extras, key: &str) -> Option<&'a str> {
    let mut json = serde_json::Deserializer::from_str(extras.as_ref()?.get());
    json.deserialize_map(Member(key)).ok()?.map(RawValue::get)
}

/// Looks for a member of an object by its name, without keeping the others; of several, the last.
struct Member<'k>(&'k str);

impl<'de> Visitor<'de> for Member<'_> {
    type Value = Option<&'de RawValue>;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<Self::Value, A::Error> {
        let mut found = None;
        while let Some(name) = members.next_key::<Name>()? {
            match name.0 == self.0 {
                true => found = Some(members.next_value()?),
                false => drop(members.next_value::<IgnoredAny>()?),
            }
        }
        Ok(found)
    }
}

/// A member's name, copied only if it is escaped.
#[derive(Deserialize)]
struct Name<'a>(#[serde(borrow)] Cow<'a, str>);
