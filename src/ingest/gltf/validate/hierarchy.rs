//! The nodes are a forest of reasonable depth, and scenes name its roots.

use crate::ingest::error::Fault;
use crate::ingest::gltf::document::{Document, label};
use std::mem;

/// A path repeats the names of all ancestors; no rig comes near this depth.
const DEEPEST: u32 = 512;

pub(super) fn check(document: &Document) -> Result<(), Fault> {
    let nodes = &document.nodes;
    let object = |i: usize| label("node", i, nodes[i].name.as_deref());
    let mut has_parent = vec![false; nodes.len()];
    for child in nodes.iter().flat_map(|node| node.children.iter().flatten()) {
        if mem::replace(&mut has_parent[child.value()], true) {
            let problem = "is the child of two nodes, or twice of one";
            return Err(Fault::new(object(child.value()), problem)
                .remedy("give each use its own node; nodes can share a mesh"));
        }
    }
    // Down from the roots; what is not reached has no root above it.
    let mut depths = vec![0; nodes.len()];
    let mut open: Vec<usize> = (0..nodes.len()).filter(|&i| !has_parent[i]).collect();
    open.iter().for_each(|&root| depths[root] = 1);
    while let Some(i) = open.pop() {
        for child in nodes[i].children.iter().flatten() {
            depths[child.value()] = depths[i] + 1;
            open.push(child.value());
        }
        if depths[i] > DEEPEST {
            let problem = format!("has more than {DEEPEST} ancestors");
            return Err(Fault::new(object(i), problem).remedy("flatten the hierarchy"));
        }
    }
    if let Some(i) = depths.iter().position(|&depth| depth == 0) {
        return Err(Fault::new(object(i), "is its own ancestor")
            .remedy("break the cycle in the nodes' children"));
    }
    for (i, scene) in document.scenes.iter().enumerate() {
        let object = || label("scene", i, scene.name.as_deref());
        let mut roots = scene.nodes.clone();
        roots.sort_unstable();
        if roots.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(Fault::new(object(), "names a node twice"));
        }
        if let Some(&root) = roots.iter().find(|&&root| has_parent[root.value()]) {
            return Err(Fault::new(object(), format!("names node {root}, which has a parent")));
        }
    }
    Ok(())
}
