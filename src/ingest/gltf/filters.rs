//! Light filters: `extras.usdLightFilter` of nodes, `filters` in `extras.usdLux` of lights.

use super::Output;
use super::document::{UsdLightFilter, UsdLux, reals};
use super::links::LinkTable;
use crate::ingest::error::Fault;
use crate::math::color::Rgb;
use crate::scene::{BlockerShape, Category, FilterKind, LightFilter, LightFilters, Rod};
use glam::Vec3;
use gltf::json::Extras;
use std::collections::{BTreeMap, HashMap};

/// More filters of a light than this are refused: each is asked for each ray to it.
const MOST_OF_A_LIGHT: usize = 64;

/// More knots of a ramp than this are refused.
const MOST_KNOTS: usize = 1 << 12;

/// The filters that were read so far.
#[derive(Default)]
pub(super) struct FilterTable {
    filters: Vec<LightFilter>,
    /// By the path of the node.
    known: HashMap<String, u32>,
    /// What lights name, each list once; with the light that names it first.
    named: Vec<(Vec<String>, String)>,
    number_of: HashMap<Vec<String>, u32>,
    lights: BTreeMap<u32, u32>,
    instances: BTreeMap<u32, u32>,
}

impl FilterTable {
    /// Adds the filter at a node, if there is one, and its link.
    pub(super) fn add(
        &mut self,
        output: &mut Output,
        links: &mut LinkTable,
        extras: &Extras,
        node: u32,
        object: &str,
    ) -> Result<(), Fault> {
        let Some(filter) = UsdLightFilter::of(extras, object)? else { return Ok(()) };
        let Some(kind) = kind(&filter, object)? else {
            let text = format!("is a light filter of the unknown type {:?}; left out", filter.kind);
            output.notes.add(Category::Lights, object, text);
            return Ok(());
        };
        let path = output.scene.nodes[node as usize].path.to_string();
        let knots = filter.ramp.as_ref().map_or(0, Vec::len) * size_of::<[f32; 2]>();
        let bytes = size_of::<LightFilter>() + knots + 2 * path.len();
        output.budget.take(bytes as u64, || object.to_string())?;
        let row = self.filters.len() as u32;
        links.add_filter(output, filter.filter_link, row, object)?;
        self.known.insert(path, row);
        self.filters.push(LightFilter { node, kind });
        Ok(())
    }

    /// The number of the filters that the light at a node names, if it names any.
    pub(super) fn of_light(
        &mut self,
        output: &mut Output,
        lux: Option<&UsdLux>,
        object: &str,
    ) -> Result<Option<u32>, Fault> {
        let names = lux.map_or(&[][..], |lux| &lux.filters);
        if names.is_empty() {
            return Ok(None);
        }
        if names.len() > MOST_OF_A_LIGHT {
            let problem =
                format!("extras.usdLux: {} filters are more than {MOST_OF_A_LIGHT}", names.len());
            return Err(Fault::new(object, problem));
        }
        if let Some(&known) = self.number_of.get(names) {
            return Ok(Some(known));
        }
        let bytes: usize = names.iter().map(|name| 2 * (size_of::<String>() + name.len())).sum();
        output.budget.take((bytes + object.len()) as u64, || object.to_string())?;
        let number = self.named.len() as u32;
        self.named.push((names.to_vec(), object.to_string()));
        self.number_of.insert(names.to_vec(), number);
        Ok(Some(number))
    }

    /// Notes the filters of the light that is added next.
    pub(super) fn add_light(
        &mut self,
        output: &mut Output,
        filters: Option<u32>,
    ) -> Result<(), Fault> {
        let row = output.scene.lights.len() as u32;
        add_row(output, &mut self.lights, row, filters)
    }

    /// Notes the filters of the instance that is added next.
    pub(super) fn add_instance(
        &mut self,
        output: &mut Output,
        filters: Option<u32>,
    ) -> Result<(), Fault> {
        let row = output.scene.instances.len() as u32;
        add_row(output, &mut self.instances, row, filters)
    }

    /// Gives the scene its filters.
    pub(super) fn finish(self, output: &mut Output) {
        let mut sets = Vec::with_capacity(self.named.len());
        for (names, object) in &self.named {
            let rows = names.iter().filter_map(|name| {
                let row = self.known.get(name).copied();
                if row.is_none() {
                    let text = format!("its filter {name} is not in the file; it shines without");
                    output.notes.add(Category::Lights, object.as_str(), text);
                }
                row
            });
            sets.push(rows.collect());
        }
        output.scene.light_filters =
            LightFilters::new(self.filters, sets, self.lights, self.instances);
    }
}

fn add_row(
    output: &mut Output,
    table: &mut BTreeMap<u32, u32>,
    row: u32,
    filters: Option<u32>,
) -> Result<(), Fault> {
    if let Some(filters) = filters {
        let bytes = 4 * size_of::<u32>() as u64;
        output.budget.take(bytes, || "extras.usdLux: filters".to_string())?;
        table.insert(row, filters);
    }
    Ok(())
}

/// What a filter does; `None` if nobody knows its type.
fn kind(filter: &UsdLightFilter, object: &str) -> Result<Option<FilterKind>, Fault> {
    let fault =
        |problem: &str| Err(Fault::new(object, format!("extras.usdLightFilter: {problem}")));
    let share = |rgb: Option<[_; 3]>, usual: Rgb| rgb.map_or(usual, |rgb| reals(rgb).into());
    let [inside, outside, through, whole] = [
        share(filter.inside, Rgb::ZERO),
        share(filter.outside, Rgb::ONE),
        share(filter.through, Rgb::ZERO),
        share(filter.share, Rgb::ONE),
    ];
    if [inside, outside, through, whole].iter().any(|share| share.min_element() < 0.0) {
        return fault("a share is negative");
    }
    Ok(Some(match filter.kind.as_str() {
        "rod" => {
            let [min, max] =
                [filter.min, filter.max].map(|at| at.map_or(Vec3::ZERO, |at| reals(at).into()));
            let (radius, edge) = (filter.radius.f32(), filter.edge.f32());
            if radius < 0.0 || edge < 0.0 {
                return fault("radius or edge is negative");
            }
            if !min.cmple(max).all() {
                return fault("min is above max");
            }
            let ramp: Vec<[f32; 2]> = match &filter.ramp {
                Some(ramp) => ramp.iter().map(|&knot| reals(knot)).collect(),
                None => vec![[0.0, 0.0], [1.0, 1.0]],
            };
            if ramp.len() > MOST_KNOTS {
                return fault("its ramp has too many knots");
            }
            let ascends = ramp.is_sorted_by(|a, b| a[0] < b[0] && a[1] <= b[1]);
            if !ascends || ramp.first() != Some(&[0.0, 0.0]) || ramp.last() != Some(&[1.0, 1.0]) {
                return fault("its ramp does not ascend from (0, 0) to (1, 1)");
            }
            FilterKind::Rod(Rod { min, max, radius, edge, ramp, inside, outside })
        }
        "blocker" => {
            let shape = match filter.shape.as_deref() {
                Some("box") => BlockerShape::Box,
                Some("sphere") => BlockerShape::Sphere,
                Some("plane") => BlockerShape::Plane,
                _ => return fault("shape is none of box, sphere and plane"),
            };
            FilterKind::Blocker { shape, through }
        }
        "multiplier" => FilterKind::Multiplier(whole),
        "decay" => {
            let [near_m, far_m] = [filter.near, filter.far].map(|range| range.map(reals));
            if [near_m, far_m].iter().flatten().any(|[start, end]| start > end) {
                return fault("near or far ends before it starts");
            }
            FilterKind::Decay { near_m, far_m }
        }
        _ => return Ok(None),
    }))
}
