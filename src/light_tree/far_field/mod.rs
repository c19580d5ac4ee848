//! Far fields: what lights send in each direction, where that is known better than a cone tells.
//!
//! A photometric profile may have a narrow peak and a wide skirt, which no cone describes. Whoever samples a tree can tell
//! it the [far field](FarField) of such lights: their intensity by direction. Then a leaf is weighed by the intensity
//! towards the viewer in place of what its cone lets expect. A cluster with such lights is weighed by a table, the
//! sum of the far fields below it in [directions](LaneTables) all around. Near a cluster that sum tells little, and the
//! table's mean takes its place.
//!
//! What is dark stays dark, and nothing else becomes it: cones decide that alone, and a weight is at least a small share
//! of its lane's energy. Picks, cuts, probabilities and moments agree, because all of them weigh groups by one function
//! (`place`).
//!
//! Tables follow from the tree and the far fields, so the file holds nothing of them. They are of trees in world space.
//! Lights that have a tree of their own, because they are instanced or move, are weighed as their cones tell. So are the clusters
//! of a tree in which more than 131,072 emitters have known far fields, as large meshes have triangles: its leaves alone
//! are weighed by intensity. Time and memory to make tables are bounded by that.

mod lane_tables;

pub use lane_tables::LaneTables;

use super::group::WIDTH;
use super::importance::importance;
use super::node::Link;
use super::place::Place;
use super::sampling::FrameTree;
use super::viewer::Viewer;
use glam::Vec3;
use lane_tables::OfLane;
use std::sync::Arc;

/// The far fields of emitters.
pub trait FarField: Sync {
    /// Whether the far field of an emitter is known better than its cone tells.
    fn is_known(&self, emitter: u32) -> bool;

    /// The intensity that leaves an emitter in a direction (unit, world space), in the unit of energies.
    fn intensity(&self, emitter: u32, direction: Vec3) -> f32;
}

/// The far fields of a frame.
#[derive(Clone)]
pub(super) struct FrameFields<'a> {
    lights: &'a dyn FarField,
    /// Of what stands still, and of the frame's own tree.
    parts: Vec<Arc<LaneTables>>,
}

/// The least share of a lane's energy that it is weighed by.
const LEAST: f32 = 0.02;
/// And the largest, so that no importance overflows.
const MOST: f32 = 1e6;

impl<'a> FrameTree<'a> {
    /// The same tree, which knows the far fields of lights. `still` is what this returned before for the same tree of
    /// what stands still and the same lights; nothing else may be given.
    pub fn with_far_fields(
        mut self,
        lights: &'a dyn FarField,
        still: Option<Arc<LaneTables>>,
    ) -> (FrameTree<'a>, Option<Arc<LaneTables>>) {
        if self.root.is_none() {
            return (self, still);
        }
        let still =
            still.or_else(|| self.still.map(|row| Arc::new(self.lane_tables(row, lights, None))));
        let own = self.root.filter(|&row| Some(row) != self.still);
        let own = own.map(|row| Arc::new(self.lane_tables(row, lights, still.as_deref())));
        let parts = [still.clone(), own].into_iter().flatten().filter(|part| !part.is_empty());
        let parts: Vec<Arc<LaneTables>> = parts.collect();
        let fields = (!parts.is_empty()).then_some(FrameFields { lights, parts });
        self.fields = fields;
        (self, still)
    }
}

impl FrameFields<'_> {
    /// Weighs those lanes of a group again whose far fields are known.
    pub fn weigh<V: Viewer>(
        &self,
        tree: &FrameTree,
        place: &Place<V>,
        importances: &mut [f64; WIDTH],
    ) {
        let Some((part, lanes)) =
            self.parts.iter().find_map(|part| Some((part, part.lanes(place.at)?)))
        else {
            return;
        };
        let Some(group) = tree.groups.get(place.at as usize) else { return };
        for (lane, of_lane) in lanes.iter().enumerate() {
            if importances[lane] == 0.0 || *of_lane == OfLane::UNKNOWN {
                continue;
            }
            let mut cluster = group.cluster(lane);
            // As if light left alike in every direction.
            (cluster.sin_half_theta_o, cluster.cos_theta_e) = (1.0, 0.0);
            let factors = place.viewer.factors(&cluster);
            let sight = factors.sight;
            let direction = -Vec3::from_array(sight.to);
            if direction == Vec3::ZERO {
                // A stretch of a ray is seen from many directions.
                continue;
            }
            let energy = group.energy(lane);
            let share = match (group.link(lane), part.table(*of_lane)) {
                (_, Some(table)) => {
                    let near = sight.sin_u * sight.sin_u;
                    let toward = table.toward(direction);
                    toward + near * (table.mean() - toward)
                }
                (Link::Emitter(own), None) => {
                    let emitter = place.first_emitter.saturating_add(own);
                    self.lights.intensity(emitter, direction) / energy
                }
                _ => continue,
            };
            // No number, if energies overflow; then the least.
            let share = if share > LEAST { share.min(MOST) } else { LEAST };
            let (reflected, _) = place.viewer.reflect(&sight);
            importances[lane] =
                importance(energy, factors.product * reflected * share, factors.decay);
        }
    }
}
