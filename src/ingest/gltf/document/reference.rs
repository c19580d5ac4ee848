//! References are 32 bits wide; the crate cuts larger numbers, and takes the largest for none.

use super::Row;
use serde_json::Value;

/// Members that refer to other objects: one, a list, or by name.
const MEMBERS: [&[&str]; 4] = [
    &["buffer", "bufferView", "indices", "inverseBindMatrices"],
    &["camera", "children", "joints", "light", "mesh", "nodes", "skin"],
    &["index", "material", "sampler", "source"],
    &["attributes", "input", "node", "output", "targets"],
];

/// Checks the references of an object that is not parsed yet.
pub(super) fn check(row: &Row) -> Result<(), String> {
    row.iter().try_for_each(|(key, value)| check_member(key, value))
}

fn check_member(key: &str, value: &Value) -> Result<(), String> {
    match value {
        Value::Number(number) if MEMBERS.iter().any(|names| names.contains(&key)) => {
            match number.as_u64() {
                Some(number) if number < u64::from(u32::MAX) => Ok(()),
                _ => Err(format!("invalid value {number} of {key}, expected an object's number")),
            }
        }
        Value::Array(values) => values.iter().try_for_each(|value| check_member(key, value)),
        Value::Object(members) => match key {
            "extras" => Ok(()),
            // A vendor's extension may mean anything.
            _ if key.contains('_') && !key.starts_with("KHR_") && !key.starts_with("EXT_") => {
                Ok(())
            }
            // Names with references to accessors.
            "attributes" | "targets" => {
                members.values().try_for_each(|value| check_member(key, value))
            }
            _ => check(members),
        },
        _ => Ok(()),
    }
}
