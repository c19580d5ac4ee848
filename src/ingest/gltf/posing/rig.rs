//! Where joints are.

use crate::ingest::error::Fault;
use crate::ingest::gltf::animation::{Channels, byte_length};
use crate::ingest::gltf::hierarchy::local;
use crate::ingest::gltf::{Output, Source};
use crate::scene::{Node, Skeleton, Trs};
use glam::DAffine3;
use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// The joints of all skins and the nodes above them, by their numbers in the file. Of a node with several
/// parents it is the one that is placed first.
#[derive(Default)]
pub(super) struct Rig {
    nodes: HashMap<usize, Joint>,
    skeletons: RefCell<HashMap<Place, Arc<Skeleton>>>,
}

/// A skin, and the node that its meshes hang at.
type Place = (usize, Option<usize>);

struct Joint {
    parent: Option<usize>,
    /// How many nodes are above it.
    depth: u32,
    /// How it moves against its parent.
    node: Arc<Node>,
}

impl Rig {
    pub(super) fn new(
        source: &Source,
        output: &mut Output,
        channels: &Channels,
    ) -> Result<Rig, Fault> {
        let document = source.document;
        if document.skins.is_empty() {
            return Ok(Rig::default());
        }
        let rows = document.nodes.len();
        // A parent and a visit of each node; and of some of them a joint, in a map that is half empty.
        let bytes = rows * (size_of::<(Option<usize>, bool, usize)>() + 2 * size_of::<Joint>());
        output.budget.take(bytes as u64, || "skins".to_string())?;
        let parents = parents(source);
        let mut rig = Rig::default();
        let joints = document.skins.iter().flat_map(|skin| &skin.joints);
        for joint in joints.map(|joint| joint.value()) {
            // From the joint up to what is there already, then down again.
            let mut path = Vec::new();
            let mut next = parents.get(&joint).map(|_| joint);
            while let Some(row) = next.filter(|row| !rig.nodes.contains_key(row)) {
                path.push(row);
                next = parents[&row];
            }
            for row in path.into_iter().rev() {
                let parent = parents[&row];
                let mut node = Node::fixed("", None, local(&document.nodes[row].transform, |_| {}));
                let own = channels.get(&row);
                let keys = own.into_iter().flatten().map(byte_length).sum();
                output.budget.take(keys, || "skins".to_string())?;
                node.channels = own.cloned().unwrap_or_default();
                node.settle();
                let joint = Joint {
                    parent,
                    depth: parent.map_or(0, |parent| rig.nodes[&parent].depth + 1),
                    node: Arc::new(node),
                };
                rig.nodes.insert(row, joint);
            }
        }
        Ok(rig)
    }

    /// Whether a node is in the scene.
    pub(super) fn has(&self, node: usize) -> bool {
        self.nodes.contains_key(&node)
    }

    /// The deepest node that is each of two or above it; `None` is the world. All of the rig.
    pub(super) fn meet(&self, a: Option<usize>, b: Option<usize>) -> Option<usize> {
        let (mut a, mut b) = (a, b);
        while a != b {
            let depth = |node: Option<usize>| node.map(|node| self.nodes[&node].depth);
            let deeper = if depth(a) >= depth(b) { &mut a } else { &mut b };
            *deeper = deeper.and_then(|node| self.nodes[&node].parent);
        }
        a
    }

    /// The node itself, or the next one above it that is not among some.
    pub(super) fn above(&self, node: Option<usize>, joints: &HashSet<usize>) -> Option<usize> {
        let mut node = node;
        while let Some(joint) = node.filter(|joint| joints.contains(joint)) {
            node = self.nodes[&joint].parent;
        }
        node
    }

    /// The nodes from one up to another that is above it, without that one; all of them, if it is `None`.
    fn path(&self, node: usize, below: Option<usize>) -> impl Iterator<Item = usize> {
        let own = move |node: Option<usize>| node.filter(|_| node != below);
        std::iter::successors(own(Some(node)), move |node| own(self.nodes[node].parent))
    }

    /// Whether a node ever moves against another above it.
    pub(super) fn moves(&self, node: usize, against: Option<usize>) -> bool {
        self.path(node, against).any(|node| !self.nodes[&node].node.channels.is_empty())
    }

    /// The joints of a skin as they are below a node, or in the world. A joint that is not in the scene or not below
    /// that node moves nothing.
    pub(super) fn skeleton(
        &self,
        (skin, below): Place,
        joints: &[usize],
        inverse_bind: impl Fn(usize) -> DAffine3,
    ) -> Arc<Skeleton> {
        let mut skeletons = self.skeletons.borrow_mut();
        let skeleton = skeletons.entry((skin, below)).or_insert_with(|| {
            let (mut nodes, mut numbers) = (Vec::new(), HashMap::new());
            let joint = |(number, &joint): (usize, &usize)| {
                let is_below = self.has(joint) && self.meet(Some(joint), below) == below;
                if !is_below {
                    return None;
                }
                if Some(joint) == below {
                    // The space itself.
                    nodes.push((None, Arc::new(Node::fixed("", None, Trs::default()))));
                    return Some((nodes.len() as u32 - 1, inverse_bind(number)));
                }
                let path: Vec<usize> = self.path(joint, below).collect();
                for &row in path.iter().rev() {
                    if !numbers.contains_key(&row) {
                        let parent = self.nodes[&row].parent;
                        let parent = parent.and_then(|parent| numbers.get(&parent).copied());
                        numbers.insert(row, nodes.len() as u32);
                        nodes.push((parent, self.nodes[&row].node.clone()));
                    }
                }
                Some((numbers[&joint], inverse_bind(number)))
            };
            let joints = joints.iter().enumerate().map(joint).collect();
            Arc::new(Skeleton { nodes, joints })
        });
        skeleton.clone()
    }
}

/// For each node of the scene its parent, by which it is reached first.
fn parents(source: &Source) -> HashMap<usize, Option<usize>> {
    let mut parents = HashMap::new();
    let mut open: Vec<(usize, Option<usize>)> =
        source.forest.roots.iter().rev().map(|&root| (root, None)).collect();
    while let Some((node, parent)) = open.pop() {
        if parents.contains_key(&node) {
            continue;
        }
        parents.insert(node, parent);
        let children = source.forest.children(node).rev();
        open.extend(children.map(|child| (child, Some(node))));
    }
    parents
}
