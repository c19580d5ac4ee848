//! The planes of a file, by its symmetry all around, as a table about a pole.

use super::Photometric;
use crate::scene::{IesTable, Pole};

/// What a file holds, as it stands there.
pub(super) struct Web {
    pub kind: Photometric,
    /// Ascending, degrees.
    pub vertical_deg: Vec<f64>,
    /// Ascending, degrees.
    pub horizontal_deg: Vec<f64>,
    /// For each horizontal angle and in it each vertical angle.
    pub candela: Vec<f32>,
}

/// Angles in files are rounded to this, degrees.
const ROUNDING: f64 = 0.01;

fn is(angle: f64, other: f64) -> bool {
    (angle - other).abs() <= ROUNDING
}

/// A plane: its angle, and which of the file's planes it is.
type Plane = (f64, usize);

impl Web {
    pub fn into_table(self) -> Result<IesTable, String> {
        let (least, most) = if self.kind == Photometric::C { (0.0, 180.0) } else { (-90.0, 90.0) };
        let off = self
            .vertical_deg
            .iter()
            .find(|angle| !(least - ROUNDING..=most + ROUNDING).contains(*angle));
        if let Some(angle) = off {
            return Err(format!("its vertical angle {angle} is not from {least} to {most}"));
        }
        match self.kind {
            Photometric::C => self.type_c(),
            Photometric::B => self.type_b(),
            Photometric::A => self.type_a(),
        }
    }

    /// Vertical angles from the nadir, planes counter-clockwise.
    fn type_c(self) -> Result<IesTable, String> {
        let given: Vec<Plane> = self.horizontal_deg.iter().copied().zip(0..).collect();
        let (first, last) = (given[0].0, given[given.len() - 1].0);
        let planes = if given.len() == 1 {
            given
        } else if is(first, 0.0) && is(last, 90.0) {
            mirrored(&mirrored(&given, 90.0), 180.0)
        } else if is(first, 0.0) && is(last, 180.0) {
            mirrored(&given, 180.0)
        } else if is(first, 90.0) && is(last, 270.0) {
            // Symmetric about the planes of 90 and 270 degrees (LM-63-1995).
            mirrored(&given, 270.0)
        } else if is(last - first, 360.0) {
            given
        } else if is(first, 0.0) && last > 180.0 && last < 360.0 {
            [given, vec![(360.0, 0)]].concat()
        } else {
            return Err(format!(
                "its horizontal angles go from {first} to {last}; in LM-63's type C they are 0, or go from 0 to 90, 180 or \
                 360, or from 90 to 270"
            ));
        };
        let around_rad = radians(planes.iter().map(|plane| plane.0));
        let polar_rad = radians(self.vertical_deg.iter().map(|angle| angle.clamp(0.0, 180.0)));
        let width = self.vertical_deg.len();
        let values = planes.iter().flat_map(|&(_, row)| &self.candela[row * width..][..width]);
        Ok(IesTable { pole: Pole::Nadir, polar_rad, around_rad, values: values.copied().collect() })
    }

    /// Vertical angles from the horizon, planes clockwise.
    fn type_a(self) -> Result<IesTable, String> {
        let mut planes = self.horizontal_planes(180.0)?;
        planes.reverse();
        let around_rad = radians(planes.iter().map(|plane| -plane.0));
        let polar_rad =
            radians(self.vertical_deg.iter().map(|angle| (angle + 90.0).clamp(0.0, 180.0)));
        let width = self.vertical_deg.len();
        let values = planes.iter().flat_map(|&(_, row)| &self.candela[row * width..][..width]);
        Ok(IesTable { pole: Pole::Nadir, polar_rad, around_rad, values: values.copied().collect() })
    }

    /// Vertical angles turn about a horizontal axis, horizontal angles are to its side, clockwise. Either may begin at 0.
    fn type_b(self) -> Result<IesTable, String> {
        let mut planes = self.horizontal_planes(90.0)?;
        planes.reverse();
        let polar_rad = radians(planes.iter().map(|plane| (90.0 - plane.0).clamp(0.0, 180.0)));
        let turns = both_sides(self.vertical_deg.iter().copied().zip(0..).collect());
        let around_rad = radians(turns.iter().map(|turn| turn.0));
        let width = self.vertical_deg.len();
        let at = |&(_, column): &Plane| planes.iter().map(move |&(_, row)| row * width + column);
        let values = turns.iter().flat_map(at).map(|at| self.candela[at]);
        Ok(IesTable { pole: Pole::Side, polar_rad, around_rad, values: values.collect() })
    }

    /// The planes of types A and B. Those that begin at 0 are symmetric about it.
    fn horizontal_planes(&self, most: f64) -> Result<Vec<Plane>, String> {
        let given: Vec<Plane> = self.horizontal_deg.iter().copied().zip(0..).collect();
        let (first, last) = (given[0].0, given[given.len() - 1].0);
        if given.len() == 1 || first < -most - ROUNDING || last > most + ROUNDING {
            return Err(format!(
                "its horizontal angles go from {first} to {last}; in LM-63's types A and B they go from 0 or -90 to 90"
            ));
        }
        Ok(both_sides(given))
    }
}

/// Planes, or angles in them, that begin at 0 are symmetric about it: then those of the other side too.
fn both_sides(given: Vec<Plane>) -> Vec<Plane> {
    if !is(given[0].0, 0.0) {
        return given;
    }
    // What rounding has put before 0 is not mirrored to behind it, so that angles ascend.
    let other_side = given.iter().rev().filter(|plane| plane.0 > given[0].0.abs());
    other_side.map(|&(angle, row)| (-angle, row)).chain(given.iter().copied()).collect()
}

/// Planes up to an angle, and behind it the same in a mirror.
fn mirrored(planes: &[Plane], at: f64) -> Vec<Plane> {
    let behind =
        planes[..planes.len() - 1].iter().rev().map(|&(angle, row)| (2.0 * at - angle, row));
    planes.iter().copied().chain(behind).collect()
}

fn radians(degrees: impl Iterator<Item = f64>) -> Vec<f64> {
    degrees.map(f64::to_radians).collect()
}
