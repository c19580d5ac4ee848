//! IES files: ANSI/IESNA LM-63 of 1986, 1991, 1995, 2002 and 2019, photometric types A, B and C.
//!
//! A file is a heading, a line `TILT=`, and numbers in a fixed order. Real files break the rules in small ways, so what
//! can be told is read: line breaks anywhere between numbers, missing keywords, planes up to 350 degrees. What
//! cannot be told is refused, with the line.
//!
//! Left out: how a lamp's output depends on its tilt, for nothing says how a scene's lights hang; the size of
//! the luminous opening, for a UsdLux light has its own; electrical data.

mod planes;
mod words;

use super::error::Fault;
use crate::scene::IesTable;
use planes::Web;
use words::Words;

/// More angles than this are refused: 1/180 of a degree over a turn.
const MOST_ANGLES: usize = 1 << 16;

/// What a file says.
#[derive(Debug, PartialEq)]
pub(super) struct Photometry {
    /// Candela, or shares of them.
    pub table: IesTable,
    /// What was left out or mended.
    pub notes: Vec<&'static str>,
}

/// The coordinates of a file (LM-63-2002, section 3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Photometric {
    /// Vertical planes about a vertical axis, vertical angles from the nadir.
    C,
    /// Planes about a horizontal axis.
    B,
    /// Vertical planes about a vertical axis, vertical angles from the horizon.
    A,
}

/// Reads a file. The object names it in errors.
///
/// # Errors
/// Names the line and what is wrong with it.
pub(super) fn parse(bytes: &[u8], object: &str) -> Result<Photometry, Fault> {
    let text = String::from_utf8_lossy(bytes);
    read(&text).map_err(|problem| {
        let remedy =
            "check the file in a photometric viewer, or get it from the luminaire's maker again";
        Fault::new(object, problem).remedy(remedy)
    })
}

fn read(text: &str) -> Result<Photometry, String> {
    let mut words = Words::after_heading(text)?;
    let mut notes = Vec::new();
    if words.skip_tilt()? {
        notes.push("how its lamp depends on tilt is left out");
    }
    words.number("the number of lamps")?;
    words.number("the lumens of a lamp")?;
    let multiplier = words.number("the candela multiplier")?;
    let verticals = words.count("vertical angles", 2..=MOST_ANGLES)?;
    let horizontals = words.count("horizontal angles", 1..=MOST_ANGLES)?;
    let kind = match words.count("the photometric type", 1..=3)? {
        1 => Photometric::C,
        2 => Photometric::B,
        _ => Photometric::A,
    };
    for what in ["the unit of length", "the width", "the length", "the height"] {
        words.number(what)?;
    }
    let ballast = words.number("the ballast factor")?;
    // Since 1995 this number is for future use, and since 2019 it tells how the file was made.
    let lamp = words.number("the ballast-lamp photometric factor")?;
    let lamp = if words.is_before_1995() { lamp } else { 1.0 };
    words.number("the input watts")?;
    let factor = multiplier * ballast * lamp;
    if !factor.is_finite() || factor < 0.0 {
        return Err(format!(
            "its multiplier and ballast factors give {factor}, which is negative or no number"
        ));
    }
    // Each takes two bytes at least, so nothing is allocated that the file does not hold.
    let wanted = verticals + horizontals + verticals * horizontals;
    if wanted > words.bytes_left() / 2 + 1 {
        return Err(format!(
            "it promises {verticals} x {horizontals} intensities, and ends long before"
        ));
    }
    let vertical_deg = words.angles(verticals, "a vertical angle")?;
    let horizontal_deg = words.angles(horizontals, "a horizontal angle")?;
    let mut is_negative = false;
    let mut candela = Vec::with_capacity(verticals * horizontals);
    for _ in 0..verticals * horizontals {
        let value = words.number("an intensity")? * factor;
        is_negative |= value < 0.0;
        let value = value.max(0.0) as f32;
        if !value.is_finite() {
            return Err(format!(
                "{}: an intensity is beyond the range of numbers (3e38)",
                words.line()
            ));
        }
        candela.push(value);
    }
    if is_negative {
        notes.push("negative intensities are taken for 0");
    }
    let table = Web { kind, vertical_deg, horizontal_deg, candela }.into_table()?;
    Ok(Photometry { table, notes })
}

#[cfg(test)]
mod tests;
