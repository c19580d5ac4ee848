//! Photometric profiles: `extras.usdLux.shaping.ies`.

use super::document::{UsdIes, UsdLux, reals};
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::ingest::ies;
use crate::scene::{Category, IesProfile, IesTable, Shaping};
use std::collections::HashMap;
use std::f64::consts::PI;

/// What was read so far: each file once, and each profile once.
#[derive(Default)]
pub(super) struct Profiles {
    /// By URI; nothing if a file cannot be read.
    files: HashMap<String, Option<IesTable>>,
    /// Rows of the scene's profiles.
    rows: HashMap<(String, u32, bool), u32>,
}

impl Profiles {
    /// The emission profile that `extras.usdLux` gives. A light whose file cannot be read shines without it.
    pub(super) fn shaping(
        &mut self,
        source: &Source,
        output: &mut Output,
        lux: Option<&UsdLux>,
        object: &str,
    ) -> Result<Option<Shaping>, Fault> {
        let Some(shaping) = lux.and_then(|lux| lux.shaping.as_ref()) else { return Ok(None) };
        // UsdLux's own default.
        let cone = shaping.cone_angle.map_or(90.0, |angle| angle.f32());
        let tint = reals(shaping.focus_tint);
        if cone < 0.0 || tint.iter().any(|&part| part < 0.0) {
            return Err(Fault::new(object, "extras.usdLux: shaping has a negative cone or tint"));
        }
        let profile = match &shaping.ies {
            Some(ies) => self.row(source, output, ies, object)?,
            None => None,
        };
        Ok(Some(Shaping::Usd {
            cone_rad: cone.to_radians(),
            softness: shaping.cone_softness.f32().clamp(0.0, 1.0),
            // A negative focus is ignored by UsdLux's definition.
            focus: shaping.focus.f32().max(0.0),
            focus_tint: tint,
            profile,
        }))
    }

    fn row(
        &mut self,
        source: &Source,
        output: &mut Output,
        ies: &UsdIes,
        object: &str,
    ) -> Result<Option<u32>, Fault> {
        let scale = ies.angle_scale.f32();
        let key = (ies.file.clone(), scale.to_bits(), ies.normalize);
        if let Some(&row) = self.rows.get(&key) {
            return Ok(Some(row));
        }
        let object = format!("{object}, IES profile {:?}", ies.file);
        if !self.files.contains_key(&ies.file) {
            let table = read(source, output, &ies.file, &object)?;
            self.files.insert(ies.file.clone(), table);
        }
        let Some(table) = &self.files[&ies.file] else { return Ok(None) };
        let bytes = 8 * (table.values.len() + table.polar_rad.len() + table.around_rad.len());
        output.budget.take((bytes + ies.file.len()) as u64, || object.clone())?;
        let mut table = table.clone();
        if ies.normalize {
            normalize(&mut table);
        }
        let row = output.scene.profiles.len() as u32;
        output.scene.profiles.push(IesProfile::new(ies.file.clone(), table, scale));
        self.rows.insert(key, row);
        Ok(Some(row))
    }
}

/// Reads a file; one that cannot be read is noted.
fn read(
    source: &Source,
    output: &mut Output,
    uri: &str,
    object: &str,
) -> Result<Option<IesTable>, Fault> {
    let bytes = match source.folder.read_uri(uri, object) {
        Ok(bytes) => bytes,
        Err(fault) => return Ok(left_out(output, fault)),
    };
    output.budget.grow(bytes.len() as u64);
    // Symmetric files name a quarter of their planes.
    output.budget.take(8 * bytes.len() as u64, || object.to_string())?;
    match ies::parse(&bytes, object) {
        Ok(photometry) => {
            for note in photometry.notes {
                output.notes.add(Category::Lights, object, note);
            }
            Ok(Some(photometry.table))
        }
        Err(fault) => Ok(left_out(output, fault)),
    }
}

fn left_out(output: &mut Output, fault: Fault) -> Option<IesTable> {
    let (object, problem) = fault.parts();
    let text = format!("{problem}; its lights shine without it");
    output.notes.add(Category::Lights, object, text);
    None
}

/// Divides by the profile's power: its mean over the sphere, or over the hemisphere if it has no more than that.
///
/// UsdLux says that the profile is "scaled by the overall power" and that this preserves "the overall energy output"; so
/// it is divided. hdEmbree's `PxrIESFile` has this mean, which "matches Karma & RIS".
fn normalize(table: &mut IesTable) {
    let (integral, is_sphere) = table.integral();
    let power = integral / if is_sphere { 4.0 * PI } else { 2.0 * PI };
    if power > 0.0 {
        // The least power of all divides by less than 32 bits hold; a factor beyond them is cut off.
        let share =
            |value: &mut f32| *value = (f64::from(*value) / power).min(f64::from(f32::MAX)) as f32;
        table.values.iter_mut().for_each(share);
    }
}
