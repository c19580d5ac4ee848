//! The order in which layers can be carried out.

use super::job::{Depend, DependKind, Layer, LayerKind};
use std::collections::BTreeSet;

/// What each layer waits for, the layers of a job by their places: its dependences, and for a Post layer
/// all that are of another kind.
pub fn waits(layers: &[Layer], depends: &[Depend]) -> Vec<Vec<(usize, DependKind)>> {
    let is_post = |layer: usize| layers[layer].kind == LayerKind::Post;
    let mut waits: Vec<Vec<_>> = vec![Vec::new(); layers.len()];
    for depend in depends {
        waits[depend.layer].push((depend.on, depend.kind));
    }
    for layer in (0..layers.len()).filter(|&layer| is_post(layer)) {
        let others = (0..layers.len()).filter(|&other| !is_post(other));
        waits[layer].extend(others.map(|other| (other, DependKind::LayerOnLayer)));
    }
    waits
}

/// The places of the layers: each comes after all that it waits for, and otherwise in the file's order.
///
/// # Errors
/// Layers that wait for each other in a ring; the last is the first again.
pub fn of(layers: &[Layer], depends: &[Depend]) -> Result<Vec<usize>, Vec<usize>> {
    let waits = waits(layers, depends);
    let mut waiters: Vec<Vec<usize>> = vec![Vec::new(); layers.len()];
    for (layer, on) in
        waits.iter().enumerate().flat_map(|(layer, ons)| ons.iter().map(move |on| (layer, on.0)))
    {
        waiters[on].push(layer);
    }
    let mut open: Vec<usize> = waits.iter().map(Vec::len).collect();
    let mut ready: BTreeSet<usize> = (0..layers.len()).filter(|&layer| open[layer] == 0).collect();
    let mut order = Vec::new();
    while let Some(layer) = ready.pop_first() {
        order.push(layer);
        for &waiter in &waiters[layer] {
            open[waiter] -= 1;
            if open[waiter] == 0 {
                ready.insert(waiter);
            }
        }
    }
    if order.len() < layers.len() { Err(ring(&waits, &open)) } else { Ok(order) }
}

/// A ring among the layers that still wait for something.
fn ring(waits: &[Vec<(usize, DependKind)>], open: &[usize]) -> Vec<usize> {
    let next = |layer: usize| waits[layer].iter().map(|&(on, _)| on).find(|&on| open[on] > 0);
    let mut path: Vec<usize> = (0..waits.len()).filter(|&layer| open[layer] > 0).take(1).collect();
    while let Some(on) = path.last().and_then(|&layer| next(layer)) {
        let seen = path.iter().position(|&layer| layer == on);
        path.push(on);
        if let Some(start) = seen {
            return path.split_off(start);
        }
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn layers(count: usize) -> Vec<Layer> {
        vec![Layer::example(); count]
    }

    proptest! {
        #[test]
        fn an_order_keeps_all_dependences_and_a_ring_is_made_of_them(
            pairs in prop::collection::vec((0..6usize, 0..6usize), 0..9),
        ) {
            let depends: Vec<_> = pairs
                .into_iter()
                .map(|(layer, on)| Depend { layer, on, kind: DependKind::FrameByFrame })
                .collect();
            let waits_for = |layer: usize, on: usize| depends.iter().any(|d| (d.layer, d.on) == (layer, on));
            match of(&layers(6), &depends) {
                Ok(order) => {
                    let place = |layer| order.iter().position(|&other| other == layer).unwrap();
                    prop_assert!(depends.iter().all(|depend| place(depend.on) < place(depend.layer)));
                }
                Err(ring) => {
                    prop_assert!(ring.len() > 1 && ring.first() == ring.last());
                    prop_assert!(ring.windows(2).all(|pair| waits_for(pair[0], pair[1])));
                }
            }
        }
    }

    #[test]
    fn what_may_come_first_does_in_the_order_of_the_file_and_post_layers_come_last() {
        let mut layers = layers(4);
        layers[0].kind = LayerKind::Post;
        let depends = [Depend { layer: 1, on: 2, kind: DependKind::LayerOnLayer }];
        assert_eq!(of(&layers, &depends), Ok(vec![2, 1, 3, 0]));
        assert_eq!(of(&layers, &[Depend { layer: 2, on: 0, ..depends[0] }]), Err(vec![0, 2, 0]));
    }
}
