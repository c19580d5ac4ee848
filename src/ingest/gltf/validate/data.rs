//! Every stored number is finite and within the bounds that its accessor declares.

use crate::ingest::error::Fault;
use crate::ingest::gltf::accessors::Accessor;
use crate::ingest::gltf::document::{Document, label};
use serde_json::Value;

/// How far data may lie outside the declared bounds, relative to the largest of them: writers
/// round bounds to few digits.
const BOUNDS_TOLERANCE: f64 = 1e-4;

/// What one look at an array tells; several uses of it ask.
pub(super) struct Facts {
    /// The largest number that is stored.
    pub largest: f64,
    /// Not negative, and each larger than the one before.
    pub ascends: bool,
}

pub(super) fn check(document: &Document, accessors: &[Accessor]) -> Result<Vec<Facts>, Fault> {
    let mut facts = Vec::with_capacity(accessors.len());
    for (i, (row, accessor)) in document.accessors.iter().zip(accessors).enumerate() {
        let fault = |problem: &str| Fault::new(label("accessor", i, row.name.as_deref()), problem);
        let components = accessor.shape.multiplicity();
        let (min, max) = bounds(&row.min)
            .zip(bounds(&row.max))
            .ok_or_else(|| fault("its min or max is not a list of 32-bit numbers"))?;
        if [&min, &max].into_iter().flatten().any(|bounds| bounds.len() != components) {
            return Err(fault("its min or max has another number of components"));
        }
        if !accessor.has_data() {
            facts.push(Facts { largest: 0.0, ascends: false });
            continue;
        }
        let (mut least, mut most) = ([f64::INFINITY; 16], [f64::NEG_INFINITY; 16]);
        let (mut finite, mut ascends, mut last) = (true, true, f64::NEG_INFINITY);
        accessor.for_each_raw(|component, value| {
            finite &= value.is_finite();
            ascends &= value >= 0.0 && value > last;
            last = value;
            least[component] = least[component].min(value);
            most[component] = most[component].max(value);
        });
        if !finite {
            return Err(fault("holds a number that is infinite or not a number"));
        }
        let declared = min.iter().chain(&max).flatten().map(|bound| bound.abs());
        let slack = BOUNDS_TOLERANCE * declared.fold(0.0, f64::max);
        let below = min.iter().flatten().zip(least).any(|(min, v)| v < min - slack);
        let above = max.iter().flatten().zip(most).any(|(max, v)| v > max + slack);
        if below || above {
            return Err(fault("holds numbers outside the min and max that it declares"));
        }
        facts.push(Facts { largest: most.into_iter().fold(0.0, f64::max), ascends });
    }
    Ok(facts)
}

/// The outer `None` is what cannot be read.
fn bounds(value: &Option<Value>) -> Option<Option<Vec<f64>>> {
    let Some(value) = value else { return Some(None) };
    let number = |number: &Value| number.as_f64().filter(|&number| (number as f32).is_finite());
    value.as_array()?.iter().map(number).collect::<Option<_>>().map(Some)
}
