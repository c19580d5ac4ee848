//! The arrays of a primitive, and whether they have types that their meaning allows.

use super::Source;
use super::accessors::Accessor;
use glam::{DVec3, Vec3};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use serde_json::Value;

/// How far positions may be outside their declared bounds, relative to the largest: writers round bounds.
const BOUNDS_TOLERANCE: f64 = 1e-4;

/// The arrays of a primitive.
pub(super) struct Attributes<'a> {
    pub source: &'a Source<'a>,
    pub primitive: &'a Primitive,
}

impl<'a> Attributes<'a> {
    /// An attribute, if there is one; else what is wrong with it.
    pub(super) fn get(&self, semantic: Semantic) -> Result<Option<&'a Accessor<'a>>, String> {
        let semantic = Checked::Valid(semantic);
        let Some(&index) = self.primitive.attributes.get(&semantic) else { return Ok(None) };
        let name = semantic.to_string();
        let accessor = self.source.accessors.get(index);
        let accessor =
            accessor.map_err(|problem| format!("its {name} cannot be read: {problem}"))?;
        match allows(&semantic, accessor) {
            true => Ok(Some(accessor)),
            false => {
                let (component, components) = (accessor.component, accessor.shape.multiplicity());
                Err(format!("its {name} cannot be {component:?} x {components}"))
            }
        }
    }

    /// The same of an attribute beside positions, which must be one for every position.
    pub(super) fn beside(
        &self,
        semantic: Semantic,
        positions: usize,
    ) -> Result<Option<&'a Accessor<'a>>, String> {
        let name = Checked::Valid(semantic.clone()).to_string();
        match self.get(semantic)? {
            Some(accessor) if accessor.count < positions => {
                Err(format!("its {name} has fewer elements than there are positions"))
            }
            accessor => Ok(accessor),
        }
    }

    /// The displacements by which a morph target moves an attribute, if it does.
    pub(super) fn of_target(
        &self,
        target: usize,
        semantic: Semantic,
        positions: usize,
    ) -> Result<Option<&'a Accessor<'a>>, String> {
        let name = Checked::Valid(semantic.clone()).to_string();
        let own = Semantic::Extras(format!("target {target} {name}"));
        let Some(accessor) = self.get(own)? else { return Ok(None) };
        // They have no handedness, and tangents else do.
        let semantic = if semantic == Semantic::Tangents { Semantic::Normals } else { semantic };
        match allows(&Checked::Valid(semantic), accessor) {
            true if accessor.count >= positions => Ok(Some(accessor)),
            true => Err(format!("morph target {target} has fewer {name} than there are positions")),
            false => Err(format!("the {name} of morph target {target} has a type it cannot have")),
        }
    }

    /// Whether morph targets displace anything that is not part of the shape.
    pub(super) fn targets_color(&self) -> bool {
        self.primitive.attributes.keys().any(|key| match key {
            Checked::Valid(Semantic::Extras(name)) => {
                name.strip_prefix("target ").and_then(|name| name.split_once(' ')).is_some_and(
                    |(_, what)| what.starts_with("COLOR_") || what.starts_with("TEXCOORD_"),
                )
            }
            _ => false,
        })
    }

    /// Whether positions are inside the bounds that the file declares, if it does and they are floats.
    pub(super) fn bounds_hold(&self, positions: &[Vec3]) -> bool {
        let index = self.primitive.attributes.get(&Checked::Valid(Semantic::Positions));
        let Some(row) = index.and_then(|&index| self.source.document.get(index)) else {
            return true;
        };
        if !matches!(row.component_type, Checked::Valid(kind) if kind.0 == ComponentType::F32) {
            return true;
        }
        let bound = |value: &Option<Value>| {
            let list = value.as_ref()?.as_array()?;
            let number = |i: usize| list.get(i).and_then(Value::as_f64);
            Some(DVec3::new(number(0)?, number(1)?, number(2)?))
        };
        let declared = bound(&row.min).zip(bound(&row.max));
        let Some((min, max)) = declared else { return row.min.is_none() && row.max.is_none() };
        let slack = BOUNDS_TOLERANCE * min.abs().max(max.abs()).max_element();
        let is_inside = |place: &Vec3| {
            let place = place.as_dvec3();
            place.cmpge(min - slack).all() && place.cmple(max + slack).all()
        };
        positions.iter().all(is_inside)
    }

    /// The indices, if there are any; else what is wrong with them. They may be out of range.
    pub(super) fn indices(&self) -> Result<Option<&'a Accessor<'a>>, String> {
        let Some(index) = self.primitive.indices else { return Ok(None) };
        let indices = self.source.accessors.get(index);
        let indices =
            indices.map_err(|problem| format!("its indices cannot be read: {problem}"))?;
        match indices.is_unsigned() && indices.shape == Type::Scalar {
            true => Ok(Some(indices)),
            false => Err("its indices are not unsigned integers".into()),
        }
    }
}

/// Core glTF's table of attributes (3.7.2.1) and `KHR_mesh_quantization`'s, whether the file names that
/// extension or not.
fn allows(semantic: &Checked<Semantic>, accessor: &Accessor) -> bool {
    let (component, normalized, shape) = (accessor.component, accessor.normalized, accessor.shape);
    let float = component == ComponentType::F32;
    let small = !float && component != ComponentType::U32;
    let unsigned_norm = small && accessor.is_unsigned() && normalized;
    let signed_norm = small && !accessor.is_unsigned() && normalized;
    let Checked::Valid(semantic) = semantic else { return false };
    match semantic {
        Semantic::Positions => shape == Type::Vec3 && (float || small),
        Semantic::Normals => shape == Type::Vec3 && (float || signed_norm),
        Semantic::Tangents => shape == Type::Vec4 && (float || signed_norm),
        Semantic::TexCoords(_) => shape == Type::Vec2 && (float || small),
        Semantic::Colors(_) => {
            (shape == Type::Vec3 || shape == Type::Vec4) && (float || unsigned_norm)
        }
        Semantic::Joints(_) => {
            shape == Type::Vec4 && small && accessor.is_unsigned() && !normalized
        }
        Semantic::Weights(_) => shape == Type::Vec4 && (float || small && accessor.is_unsigned()),
        Semantic::Extras(_) => true,
    }
}
