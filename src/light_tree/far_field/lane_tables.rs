//! Tables of the far fields of a tree's lanes: of each cluster that holds such a light, in directions all around.

use super::FarField;
use crate::light_tree::group::{Group, WIDTH};
use crate::light_tree::importance::{Cluster, factors};
use crate::light_tree::node::Link;
use crate::light_tree::sampling::FrameTree;
use crate::light_tree::viewer::Receiver;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Directions along an edge of the octahedral square (Cigolle et al. 2014).
const SIDE: usize = 16;
/// Directions of a table.
const COUNT: usize = SIDE * SIDE;
/// A direction of a table is the mean of so many by so many, so that no narrow beam falls between.
const PARTS: usize = 2;
/// Bytes of tables that are kept: 64 MB. Clusters further from the root are weighed as their cones tell.
const MOST_BYTES: usize = 64 << 20;
/// Emitters that tables are made of: each is asked 1,024 times. Trees with more that are known have no tables.
const MOST_EMITTERS: usize = 1 << 17;
/// Groups whose leaves are summed at once: 1 MB.
const CHUNK: usize = 1024;

/// The intensity of a cluster by direction, over its energy.
pub(super) struct Table {
    /// Of the codes 0 to 255, which stand for squares.
    largest: f32,
    mean: f32,
    codes: [u8; COUNT],
}

/// What is known of a lane: that nothing is, that it is a leaf whose light tells, or a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct OfLane(u32);

impl OfLane {
    pub const UNKNOWN: OfLane = OfLane(u32::MAX);
    const LEAF: OfLane = OfLane(u32::MAX - 1);
}

/// What is known of the far fields of a tree. See the [module page](super).
pub struct LaneTables {
    first_group: u32,
    /// By group, its row; `u32::MAX` if nothing is known of its lanes.
    rows: Vec<u32>,
    lanes: Vec<[OfLane; WIDTH]>,
    tables: Vec<Table>,
    /// The intensities of all.
    whole: Option<Sum>,
}

/// Intensities by direction.
type Sum = Box<[f32; COUNT]>;

impl LaneTables {
    pub(super) fn is_empty(&self) -> bool {
        self.lanes.is_empty()
    }

    /// What is known of the lanes of a group, if anything is.
    #[inline]
    pub(super) fn lanes(&self, group: u32) -> Option<&[OfLane; WIDTH]> {
        let row = *self.rows.get(group.checked_sub(self.first_group)? as usize)?;
        self.lanes.get(row as usize)
    }

    #[inline]
    pub(super) fn table(&self, lane: OfLane) -> Option<&Table> {
        self.tables.get(lane.0 as usize)
    }
}

impl Table {
    fn of(sum: &Sum, energy: f32) -> Table {
        let largest = sum.iter().copied().fold(0.0, f32::max).max(f32::MIN_POSITIVE);
        let code = |value: f32| (255.0 * (value / largest).sqrt()).round() as u8;
        let mut codes = [0; COUNT];
        for (code_of, &value) in codes.iter_mut().zip(sum.iter()) {
            *code_of = code(value);
        }
        let mean = sum.iter().map(|&value| f64::from(value)).sum::<f64>() / COUNT as f64;
        Table { largest: largest / energy, mean: mean as f32 / energy, codes }
    }

    /// In a direction, unit: interpolated.
    #[inline]
    pub(super) fn toward(&self, direction: Vec3) -> f32 {
        let at = (square(direction) * SIDE as f32 - 0.5)
            .clamp(Vec2::ZERO, Vec2::splat(SIDE as f32 - 1.0));
        let (column, row) = ((at.x as usize).min(SIDE - 2), (at.y as usize).min(SIDE - 2));
        let (x, y) = (at.x - column as f32, at.y - row as f32);
        let value = |at: usize| {
            let root = f32::from(self.codes[at]) * (1.0 / 255.0);
            root * root
        };
        let corner = row * SIDE + column;
        let [a, b, c, d] = [corner, corner + 1, corner + SIDE, corner + SIDE + 1].map(value);
        let (low, high) = (a + x * (b - a), c + x * (d - c));
        self.largest * (low + y * (high - low))
    }

    #[inline]
    pub(super) fn mean(&self) -> f32 {
        self.mean
    }
}

/// A direction as a point of the square `[0, 1]^2`.
#[inline]
fn square(direction: Vec3) -> Vec2 {
    let Vec3 { x, y, z } = direction / direction.abs().element_sum().max(f32::MIN_POSITIVE);
    let folded = if z >= 0.0 {
        Vec2::new(x, y)
    } else {
        Vec2::new((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y))
    };
    0.5 * folded + 0.5
}

/// The direction of a point of the square, unit.
fn direction(square: Vec2) -> Vec3 {
    let at = 2.0 * square - 1.0;
    let z = 1.0 - at.x.abs() - at.y.abs();
    let fold = (-z).max(0.0);
    Vec3::new(at.x - fold.copysign(at.x), at.y - fold.copysign(at.y), z).normalize()
}

/// Adds a function of directions to a sum: its means about the directions of tables.
fn add(sum: &mut Sum, parts: usize, of: impl Fn(Vec3) -> f32) {
    let step = 1.0 / (SIDE * parts) as f32;
    let weight = 1.0 / (parts * parts) as f32;
    for (at, own) in sum.iter_mut().enumerate() {
        let corner = Vec2::new((at % SIDE) as f32, (at / SIDE) as f32) / SIDE as f32;
        let part = |i: usize| Vec2::new((i % parts) as f32 + 0.5, (i / parts) as f32 + 0.5) * step;
        let mean: f32 = (0..parts * parts).map(|i| of(direction(corner + part(i)))).sum();
        // Of numbers that overflow nothing is known.
        *own = (*own + weight * mean).min(1e30);
    }
}

fn empty() -> Sum {
    Box::new([0.0; COUNT])
}

impl FrameTree<'_> {
    /// What is known of the lanes of a tree in world space. `still` is that of the tree of what stands still.
    pub(super) fn lane_tables(
        &self,
        row: u32,
        lights: &dyn FarField,
        still: Option<&LaneTables>,
    ) -> LaneTables {
        self.lane_tables_of(row, lights, still, MOST_EMITTERS)
    }

    /// The same, with tables if no more than so many emitters are known.
    fn lane_tables_of(
        &self,
        row: u32,
        lights: &dyn FarField,
        still: Option<&LaneTables>,
        most_emitters: usize,
    ) -> LaneTables {
        let tree = &self.trees[row as usize];
        let first = tree.first_group as usize;
        let count = tree.group_count as usize;
        let groups = self.groups.get(first..).unwrap_or(&[]);
        let groups = &groups[..count.min(groups.len())];
        let known: usize = groups.par_iter().map(|group| known_leaves(group, lights).count()).sum();
        let has_tables = known <= most_emitters;
        let mut found = LaneTables {
            first_group: tree.first_group,
            rows: vec![u32::MAX; groups.len()],
            lanes: Vec::new(),
            tables: Vec::new(),
            whole: None,
        };
        let mut of_groups: Vec<Option<Sum>> = vec![None; groups.len()];
        let places_still = |instance: u32| {
            let tree = self.instances.get(instance as usize).map(|instance| instance.tree);
            tree.is_some() && tree == self.still
        };
        // What a group leads to stands behind it, in preorder: few sums wait for their groups.
        let mut of_chunk: Vec<Option<Sum>> = Vec::new();
        for (at, group) in groups.iter().enumerate().rev() {
            if has_tables && of_chunk.is_empty() {
                let chunk = &groups[at / CHUNK * CHUNK..=at];
                of_chunk = chunk.par_iter().map(|group| of_leaves(group, lights)).collect();
            }
            let mut lanes = [OfLane::UNKNOWN; WIDTH];
            let mut sum = of_chunk.pop().flatten();
            for (lane, own) in lanes.iter_mut().enumerate() {
                let below = match group.link(lane) {
                    Link::Nothing => continue,
                    Link::Emitter(emitter) if lights.is_known(emitter) => {
                        *own = OfLane::LEAF;
                        continue;
                    }
                    Link::Emitter(_) => None,
                    Link::Inner(ahead) => {
                        of_groups.get_mut(at + ahead as usize).and_then(Option::take)
                    }
                    Link::Instance(row) if places_still(row) => {
                        still.and_then(|still| still.whole.clone())
                    }
                    Link::Instance(_) => None,
                };
                let Some(below) = below.filter(|_| has_tables) else { continue };
                let sum = sum.get_or_insert_with(empty);
                sum.iter_mut()
                    .zip(below.iter())
                    .for_each(|(sum, below)| *sum = (*sum + below).min(1e30));
                if (found.tables.len() + 1) * size_of::<Table>() <= MOST_BYTES {
                    *own = OfLane(found.tables.len() as u32);
                    found.tables.push(Table::of(&below, group.energy(lane)));
                }
            }
            if lanes == [OfLane::UNKNOWN; WIDTH] {
                continue;
            }
            found.rows[at] = found.lanes.len() as u32;
            found.lanes.push(lanes);
            let Some(mut sum) = sum else { continue };
            for lane in (0..WIDTH).filter(|&lane| lanes[lane] == OfLane::UNKNOWN) {
                if group.link(lane) != Link::Nothing {
                    add_expected(&mut sum, group, lane);
                }
            }
            of_groups[at] = Some(sum);
        }
        found.whole = of_groups.first_mut().and_then(Option::take);
        found
    }
}

/// The emitters of a group's leaves whose far fields are known.
fn known_leaves(group: &Group, lights: &dyn FarField) -> impl Iterator<Item = u32> {
    (0..WIDTH).filter_map(move |lane| match group.link(lane) {
        Link::Emitter(emitter) if lights.is_known(emitter) => Some(emitter),
        _ => None,
    })
}

/// The far fields of the leaves of a group that are known.
fn of_leaves(group: &Group, lights: &dyn FarField) -> Option<Sum> {
    let mut sum: Option<Sum> = None;
    for emitter in known_leaves(group, lights) {
        let sum = sum.get_or_insert_with(empty);
        add(sum, PARTS, |direction| lights.intensity(emitter, direction));
    }
    sum
}

/// Adds what the cone of a lane lets expect.
fn add_expected(sum: &mut Sum, group: &Group, lane: usize) {
    let point = [0.0; 3];
    let own = group.cluster(lane);
    let cluster = Cluster { center: point, half_extent: point, inverse_range2: 0.0, ..own };
    let energy = group.energy(lane);
    add(sum, 1, |direction| {
        energy * factors(&cluster, &Receiver { point: direction, normal: Vec3::ZERO }).product
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::{Aabb, Cone, LightBounds};
    use crate::light_tree::{
        LightList, LightLook, LightSummary, LightTree, LightTreeWriter, TreeKind,
    };
    use crate::store::AlignedBytes;
    use proptest::prelude::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    proptest! {
        #[test]
        fn a_direction_is_where_the_square_says([x, y, z] in prop::array::uniform3(-1f32..1.0)) {
            let Some(unit) = Vec3::new(x, y, z).try_normalize() else { return Ok(()) };
            prop_assert!(direction(square(unit)).distance(unit) < 1e-5);
        }
    }

    #[test]
    fn a_table_is_near_what_it_is_made_of() {
        let mut sum = empty();
        let lobe = |to: Vec3| 3.0 + to.dot(Vec3::new(0.48, -0.6, 0.64));
        add(&mut sum, PARTS, lobe);
        let table = Table::of(&sum, 2.0);
        for i in 0..500 {
            let turn = i as f32;
            let to = Vec3::new(turn.sin(), (1.7 * turn).cos(), (0.37 * turn).sin()).normalize();
            assert!((table.toward(to) - 0.5 * lobe(to)).abs() < 0.12, "{to}");
        }
        assert!((table.mean() - 1.5).abs() < 0.02);
    }

    /// Every emitter shines alike all around; counts how often it is asked.
    struct Even(AtomicUsize);

    impl FarField for Even {
        fn is_known(&self, _: u32) -> bool {
            true
        }

        fn intensity(&self, _: u32, _: Vec3) -> f32 {
            self.0.fetch_add(1, Ordering::Relaxed);
            1.0
        }
    }

    /// So many point lights in a row.
    fn row_of(count: u32) -> LightTree<AlignedBytes> {
        let bounds: Vec<LightBounds> = (0..count)
            .map(|i| {
                LightBounds::of_emitter(
                    Aabb { min: i as f32 * Vec3::X, max: i as f32 * Vec3::X },
                    Cone::ALL,
                    1.0,
                    f32::INFINITY,
                )
            })
            .collect();
        let mut writer = LightTreeWriter::default();
        writer.add_tree(TreeKind::Still, &bounds, |i| Link::Emitter(i as u32));
        let light = LightSummary {
            path: "/lights".into(),
            fingerprint: [1; 32],
            emitter_count: count,
            energy: count as f32,
            class: 0,
            look: LightLook::default(),
            link: 0,
        };
        LightTree::open(writer.finish(&LightList::new(&[light]), "{}", [2; 32])).unwrap()
    }

    /// In more chunks than one, every table is the sum of what is below it; beyond the bound nothing is asked.
    #[test]
    fn tables_are_made_of_all_intensities_up_to_a_bound() {
        const COUNT_OF_ALL: u32 = 9000;
        let tree = row_of(COUNT_OF_ALL);
        let frame = tree.at_frame(0).unwrap();
        assert!(frame.trees[0].group_count as usize > CHUNK);
        let of = |most: usize| {
            let lights = Even(AtomicUsize::new(0));
            let found = frame.lane_tables_of(0, &lights, None, most);
            (found, lights.0.into_inner())
        };
        let (found, asked) = of(COUNT_OF_ALL as usize);
        assert_eq!(asked, COUNT_OF_ALL as usize * COUNT * PARTS * PARTS);
        let whole = found.whole.as_ref().unwrap();
        assert!(whole.iter().all(|&sum| (sum - COUNT_OF_ALL as f32).abs() < 1.0));
        // Each has an energy of 1 an emitter.
        assert!(found.tables.iter().all(|table| (table.mean() - 1.0).abs() < 1e-3));
        let inner = |found: &LaneTables| {
            found.lanes.iter().flatten().filter(|&&lane| found.table(lane).is_some()).count()
        };
        assert_eq!(inner(&found), frame.trees[0].group_count as usize - 1);
        let (found, asked) = of(COUNT_OF_ALL as usize - 1);
        assert!(asked == 0 && found.whole.is_none() && found.tables.is_empty());
        // What a leaf is weighed by stays known.
        let leaves = found.lanes.iter().flatten().filter(|&&lane| lane == OfLane::LEAF).count();
        assert_eq!(leaves, COUNT_OF_ALL as usize);
    }
}
