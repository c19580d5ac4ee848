//! The nodes are a forest of reasonable depth, and scenes name its roots.

use crate::ingest::error::Fault;
use crate::ingest::gltf::document::{Document, label};

/// A path repeats the names of all ancestors; no rig comes near this depth.
const DEEPEST: u32 = 512;

pub(super) fn check(document: &Document) -> Result<(), Fault> {
    let nodes = &document.nodes;
    let object = |i: usize| label("node", i, nodes[i].name.as_deref());
    let mut parents: Vec<Option<u32>> = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for &child in &node.children {
            let parent = &mut parents[child as usize];
            if parent.is_some() {
                let problem = "is the child of two nodes, or twice of one";
                return Err(Fault::new(object(child as usize), problem)
                    .remedy("give each use its own node; nodes can share a mesh"));
            }
            *parent = Some(i as u32);
        }
    }
    // Down from the roots; what is not reached has no root above it.
    let mut depths = vec![0; nodes.len()];
    let mut open: Vec<usize> = (0..nodes.len()).filter(|&i| parents[i].is_none()).collect();
    open.iter().for_each(|&root| depths[root] = 1);
    while let Some(i) = open.pop() {
        for &child in &nodes[i].children {
            depths[child as usize] = depths[i] + 1;
            open.push(child as usize);
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
        if let Some(&root) = roots.iter().find(|&&root| parents[root as usize].is_some()) {
            return Err(Fault::new(object(), format!("names node {root}, which has a parent")));
        }
    }
    Ok(())
}
