//! Building the trees of a shot.

use super::Survey;
use super::survey::{Group, PlacedLight, SurveyedFrame};
use super::surveyor::Surveyor;
use super::{fingerprint, textures};
use crate::bounds::{Aabb, Cone, LightBounds};
use crate::light_tree::{
    ALGORITHM_VERSION, Base, LightList, LightSummary, LightTree, LightTreeWriter, Link, TreeKind,
};
use crate::math::Similarity;
use crate::store::AlignedBytes;
use glam::{DVec3, Vec3};
use std::borrow::Cow;
use std::collections::HashMap;

/// A file, built upon an earlier one.
pub struct Rebuilt {
    /// Its bytes: those that [`build_tree`] gives.
    pub bytes: AlignedBytes,
    /// How many leaves its trees have.
    pub leaves: usize,
    /// How many of them were taken over from the base.
    pub reused: usize,
    /// Whether the base contradicts the scene about lights that have not changed. If so, nothing of it was
    /// taken over.
    pub base_contradicts: bool,
}

/// Builds the trees: one in its own space for each light that is shared, carried along or forced; one
/// over what stands still; and one a frame over that tree and what changes. Frames that are alike share
/// theirs. The same survey gives the same bytes.
pub fn build_tree(survey: &Survey) -> AlignedBytes {
    let lights = LightList::new(&survey.lights);
    write(survey, &lights, LightTreeWriter::default()).bytes
}

/// The same, in less time: copies every subtree of an earlier file whose lights have not changed. The
/// base must come from [`open_base`](super::open_base).
pub fn rebuild_tree<D: AsRef<[u8]>>(survey: &Survey, base: &LightTree<D>) -> Rebuilt {
    let lights = LightList::new(&survey.lights);
    let writer = LightTreeWriter::upon(Base::new(base, &lights));
    let rebuilt = write(survey, &lights, writer);
    if !rebuilt.base_contradicts {
        return rebuilt;
    }
    Rebuilt { base_contradicts: true, ..write(survey, &lights, LightTreeWriter::default()) }
}

fn write(survey: &Survey, lights: &LightList, writer: LightTreeWriter) -> Rebuilt {
    let mut builder = Builder { writer, shared: Vec::new() };
    builder.share(survey);
    let forced = builder.still(&survey.still, None);
    builder.frames(&survey.frames, forced);
    let mut writer = builder.writer;
    for means in &survey.textures {
        writer.add_texture(means.fingerprint, textures::rows(means));
    }
    let mut meta = serde_json::json!({
        "program": concat!("candelabra ", env!("CARGO_PKG_VERSION")),
        ALGORITHM: ALGORITHM_VERSION,
    });
    if survey.origin != DVec3::ZERO {
        meta[ORIGIN] = survey.origin.to_array().into();
    }
    let (leaves, reused) = (writer.leaf_count(), writer.reused_leaf_count());
    let base_contradicts = writer.base_contradicts();
    let bytes = writer.finish(lights, &meta.to_string(), survey.fingerprint);
    Rebuilt { bytes, leaves, reused, base_contradicts }
}

/// Builds the trees of one frame, or of none if nothing changes, to be sampled and not to be kept: `lights`
/// need no paths. What stands still, and what is carried along, is copied from the trees of an earlier frame
/// of the shot, if there are any.
pub(super) fn build_frame<D: AsRef<[u8]>>(
    surveyor: &Surveyor,
    frame: &[SurveyedFrame],
    lights: &[LightSummary],
    earlier: Option<&LightTree<D>>,
) -> AlignedBytes {
    let mut builder = Builder { writer: LightTreeWriter::default(), shared: Vec::new() };
    let copied = earlier.map_or(0, |_| surveyor.lasting);
    for (row, shared) in (0..).zip(&surveyor.shared) {
        let tree = match earlier.filter(|_| (row as usize) < copied) {
            Some(earlier) => Some(builder.writer.add_copy(earlier, row)),
            None => builder.writer.add_tree(TreeKind::Shared, &shared.bounds, own),
        };
        builder.shared.extend(tree);
    }
    let still = earlier.map(|earlier| {
        let row = earlier.still_tree()?;
        Some(builder.writer.add_copy(earlier, row))
    });
    let forced = builder.still(&surveyor.still, still);
    builder.frames(frame, forced);
    let prints = frame.iter().map(|frame| (frame.number, frame.fingerprint));
    let fingerprint = fingerprint::of_shot(&surveyor.still_fingerprint, prints);
    builder.writer.finish(&LightList::new(lights), "{}", fingerprint)
}

/// The key in `META` of the algorithm's version.
const ALGORITHM: &str = "algorithmVersion";

/// The version of the algorithm that a file was built by, if it says so.
pub(super) fn algorithm_of<D: AsRef<[u8]>>(tree: &LightTree<D>) -> Option<u32> {
    let meta: serde_json::Value = serde_json::from_str(tree.meta()).ok()?;
    meta[ALGORITHM].as_u64()?.try_into().ok()
}

/// The key in `META` of the origin.
const ORIGIN: &str = "origin";

/// The offset from positions in a file to those in the scene's world, metres.
pub fn origin_of<D: AsRef<[u8]>>(tree: &LightTree<D>) -> DVec3 {
    let meta: serde_json::Value = serde_json::from_str(tree.meta()).unwrap_or_default();
    let origin = [0, 1, 2].map(|axis| meta[ORIGIN][axis].as_f64().unwrap_or(0.0));
    DVec3::from(origin)
}

/// In its own space a light numbers its emitters from 0 on.
fn own(emitter: usize) -> Link {
    Link::Emitter(emitter as u32)
}

struct Builder<'a> {
    writer: LightTreeWriter<'a>,
    /// Row of the tree of each row of the survey's shared lights.
    shared: Vec<u32>,
}

/// What all frames have in common.
struct Still {
    /// The row of its tree, if there is one.
    tree: Option<u32>,
    /// The forced lights, by rows of instances.
    forced: Vec<u32>,
}

impl Builder<'_> {
    /// The trees of lights that have one of their own.
    fn share(&mut self, survey: &Survey) {
        let frames = survey.frames.iter().map(|frame| &*frame.group);
        let mut users = vec![Vec::new(); survey.shared.len()];
        for group in std::iter::once(&survey.still).chain(frames) {
            for placed in group.placed.iter().chain(&group.forced) {
                users[placed.shared as usize].push(placed.light as usize);
            }
        }
        // A forced light that moves has one a frame.
        let mut trees_of = vec![0; survey.lights.len()];
        for (shared, mut users) in survey.shared.iter().zip(users) {
            users.sort_unstable();
            users.dedup();
            let unchanged = (users.iter()).find_map(|&light| {
                self.writer.add_tree_of_base(light, trees_of[light], &shared.bounds)
            });
            users.iter().for_each(|&light| trees_of[light] += 1);
            let tree = unchanged
                .or_else(|| self.writer.add_tree(TreeKind::Shared, &shared.bounds, own))
                .expect("a light has emitters");
            self.shared.push(tree);
        }
    }

    /// The tree of what stands still. `copied` is its row, or that there is none, if it is there already.
    fn still(&mut self, group: &Group, copied: Option<Option<u32>>) -> Still {
        let links = self.links(group, None);
        let tree = copied.unwrap_or_else(|| {
            let bounds = self.bounds(group, None);
            self.writer.add_tree(TreeKind::Still, &bounds, |i| links[i])
        });
        Still { tree, forced: self.instances(&group.forced) }
    }

    /// The trees of frames; if there are none, every frame samples what stands still.
    fn frames(&mut self, frames: &[SurveyedFrame], Still { tree: still, forced }: Still) {
        if frames.is_empty() {
            return self.writer.add_forced(&forced);
        }
        let below = still.map(|still| {
            let leaf = self.writer.bounds_of(still);
            (Link::Instance(self.writer.add_instance(still, Similarity::IDENTITY, 0)), leaf)
        });
        let mut seen = HashMap::new();
        for SurveyedFrame { number, group, fingerprint } in frames {
            let (tree, forced) = seen.entry(fingerprint).or_insert_with(|| {
                let own = self.instances(&group.forced);
                let forced = [&forced[..], &own].concat();
                if group.flat.is_empty() && group.placed.is_empty() {
                    return (still, forced);
                }
                let links = self.links(group, below.as_ref());
                let bounds = self.bounds(group, below.as_ref());
                (self.writer.add_tree(TreeKind::Frame, &bounds, |i| links[i]), forced)
            });
            self.writer.add_frame(*number, *fingerprint, *tree, forced);
        }
    }

    /// The links of a group's leaves, and of the tree below if there is one.
    fn links(&mut self, group: &Group, below: Option<&(Link, LightBounds)>) -> Vec<Link> {
        let flat = (group.first..).take(group.flat.len()).map(Link::Emitter);
        let mut links: Vec<Link> = flat.collect();
        links.extend(self.instances(&group.placed).into_iter().map(Link::Instance));
        links.extend(below.map(|(link, _)| *link));
        links
    }

    /// The bounds of the leaves, in the order of their links.
    fn bounds<'g>(
        &self,
        group: &'g Group,
        below: Option<&(Link, LightBounds)>,
    ) -> Cow<'g, [LightBounds]> {
        if group.placed.is_empty() && below.is_none() {
            return Cow::Borrowed(&group.flat);
        }
        let mut bounds = group.flat.clone();
        bounds.extend(group.placed.iter().map(|placed| {
            let own = self.writer.bounds_of(self.shared[placed.shared as usize]);
            in_world(&own, placed)
        }));
        bounds.extend(below.map(|(_, leaf)| *leaf));
        Cow::Owned(bounds)
    }

    fn instances(&mut self, placed: &[PlacedLight]) -> Vec<u32> {
        let add = |p: &PlacedLight| {
            let tree = self.shared[p.shared as usize];
            self.writer.add_instance(tree, p.to_local, p.first_emitter)
        };
        placed.iter().map(add).collect()
    }
}

/// The bounds of a tree, taken from its own space to world space and widened a little against rounding.
pub(super) fn in_world(own: &LightBounds, placed: &PlacedLight) -> LightBounds {
    /// What rounding may turn an axis by, radians.
    const TURN: f32 = 1e-6;
    let to_local = placed.to_local.transform();
    let to_world = to_local.inverse();
    let box_in_world = own.aabb.transformed(&to_world);
    let size = box_in_world.min.abs().max(box_in_world.max.abs()).max_element()
        + box_in_world.extent().max_element();
    let slack = Vec3::splat(4.0 * f32::EPSILON * size);
    let is_flat = own.cone.theta_o == 0.0;
    LightBounds {
        aabb: Aabb { min: box_in_world.min - slack, max: box_in_world.max + slack },
        cone: Cone {
            axis: to_world.transform_vector3(own.cone.axis).normalize_or(Vec3::Z),
            theta_o: if is_flat {
                TURN
            } else {
                (own.cone.theta_o + TURN).min(std::f32::consts::PI)
            },
            ..own.cone
        },
        energy: (own.energy * placed.brightness).max(f32::MIN_POSITIVE),
        share: own.share,
        range_m: own.range_m / placed.to_local.scale(),
    }
}
