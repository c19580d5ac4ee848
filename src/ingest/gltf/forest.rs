//! The nodes as they can be walked: without cycles, and not too deep.

use super::document::{Document, label};
use crate::ingest::error::Fault;
use crate::ingest::notes::Notes;
use crate::scene::Category;

/// A path repeats the names of all ancestors; no rig comes near this depth.
const DEEPEST: u32 = 512;

/// The nodes of a file: for each its children, for the whole its roots.
pub(super) struct Forest {
    /// Of all nodes, one node's after the other's.
    children: Vec<u32>,
    /// Where those of each node end.
    ends: Vec<u32>,
    pub roots: Vec<usize>,
}

impl Forest {
    /// Takes the children of all nodes, and the roots of the scene that is read: the default, else the
    /// first, else all nodes without a parent.
    pub(super) fn new(document: &Document, notes: &mut Notes) -> Result<Forest, Fault> {
        let nodes = &document.nodes;
        let mut parents = vec![0u32; nodes.len()];
        let (mut children, mut ends) = (Vec::new(), Vec::with_capacity(nodes.len()));
        for (i, node) in nodes.iter().enumerate() {
            let mut note = |text| {
                notes.add(Category::Geometry, label("node", i, node.name.as_deref()), text);
            };
            let mut known = node.children.to_vec();
            known.sort_unstable();
            known.dedup();
            if known.len() < node.children.len() {
                note("names a child twice; it is drawn once");
            }
            if known.last().is_some_and(|&last| last as usize >= nodes.len()) {
                note("has children that are not in the file; left out");
            }
            let mut taken = vec![false; known.len()];
            for child in &node.children {
                let Ok(at) = known.binary_search(child) else { continue };
                let is_first = !std::mem::replace(&mut taken[at], true);
                if let Some(parents) = parents.get_mut(*child as usize).filter(|_| is_first) {
                    children.push(*child);
                    *parents += 1;
                }
            }
            ends.push(children.len() as u32);
        }
        for (i, _) in parents.iter().enumerate().filter(|(_, parents)| **parents > 1) {
            let object = label("node", i, nodes[i].name.as_deref());
            let text = "is the child of several nodes; it is drawn below each";
            notes.add(Category::Geometry, object, text);
        }
        let forest = Forest { children, ends, roots: roots(document, &parents, notes) };
        forest.check_depth(document, parents)?;
        Ok(forest.without_repeated_roots(notes))
    }

    pub(super) fn children(
        &self,
        node: usize,
    ) -> impl ExactSizeIterator<Item = usize> + DoubleEndedIterator {
        let start = node.checked_sub(1).map_or(0, |before| self.ends[before]);
        let own = &self.children[start as usize..self.ends[node] as usize];
        own.iter().map(|&child| child as usize)
    }

    /// Goes down from the nodes without a parent, each node after all its parents.
    fn check_depth(&self, document: &Document, mut parents: Vec<u32>) -> Result<(), Fault> {
        let object = |i: usize| label("node", i, document.nodes[i].name.as_deref());
        let mut depths = vec![1; parents.len()];
        let mut open: Vec<usize> = (0..parents.len()).filter(|&i| parents[i] == 0).collect();
        let mut reached = 0;
        while let Some(i) = open.pop() {
            reached += 1;
            if depths[i] > DEEPEST {
                let problem = format!("has more than {DEEPEST} ancestors");
                return Err(Fault::new(object(i), problem).remedy("flatten the hierarchy"));
            }
            for child in self.children(i) {
                depths[child] = depths[child].max(depths[i] + 1);
                parents[child] -= 1;
                if parents[child] == 0 {
                    open.push(child);
                }
            }
        }
        match parents.iter().position(|&waiting| waiting > 0) {
            Some(i) if reached < parents.len() => {
                Err(Fault::new(object(i), "is its own ancestor, or is below such a node")
                    .remedy("break the cycle in the nodes' children"))
            }
            _ => Ok(()),
        }
    }

    /// A root that another root stands above is drawn below that one only.
    fn without_repeated_roots(mut self, notes: &mut Notes) -> Forest {
        let mut below = vec![false; self.ends.len()];
        let mut open: Vec<usize> = self.roots.clone();
        while let Some(node) = open.pop() {
            for child in self.children(node) {
                if !std::mem::replace(&mut below[child], true) {
                    open.push(child);
                }
            }
        }
        let all = self.roots.len();
        self.roots.retain(|&root| !below[root]);
        if self.roots.len() < all {
            let text = "names nodes that are below others of it; they are drawn there only";
            notes.add(Category::Geometry, "scene", text);
        }
        self
    }
}

fn roots(document: &Document, parents: &[u32], notes: &mut Notes) -> Vec<usize> {
    let Some((number, scene)) = document.default_scene() else {
        return (0..parents.len()).filter(|&i| parents[i] == 0).collect();
    };
    let object = || label("scene", number, scene.name.as_deref());
    if document.scene.is_some_and(|wanted| wanted.value() != number) {
        notes.add(Category::Other, "file", "its default scene is not in it; the first is read");
    }
    if document.scenes.len() > 1 {
        notes.add(Category::Other, object(), "only this one of the file's scenes is read");
    }
    let mut seen = vec![false; parents.len()];
    let (mut roots, mut text) = (Vec::new(), None);
    for node in scene.nodes.iter().map(|node| node.value()) {
        match seen.get_mut(node) {
            None => text = Some("names nodes that are not in the file; left out"),
            Some(true) => text = Some("names a node twice; it is drawn once"),
            Some(seen) => {
                *seen = true;
                roots.push(node);
            }
        }
    }
    if let Some(text) = text {
        notes.add(Category::Geometry, object(), text);
    }
    roots
}
