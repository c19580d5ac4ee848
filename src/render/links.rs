//! Linking: which lights light a surface, and what casts shadows from them. A scene without links has none of this.
//!
//! A surface is lit by the lights whose light link holds it, however their light gets there: by sampling them, or by
//! a reflected ray that hits one. The eye sees every light. Light that other surfaces reflect is theirs, so it is
//! not linked. Fog is lit as the prim that it belongs to; fog without a prim is lit by all. Light filters are linked in
//! the same way to what they filter for ([`Lit`](crate::emitter::Lit)); who picks lights knows nothing of that.
//!
//! A shadow link is about rays to one light, and a reflected ray is not told for which light it is meant: it ends on
//! a surface that does not cast shadows from the light behind. So light from a light that has a shadow link is found
//! by sampling that light alone, and reflected rays find none of it. Every strategy then has the same mean, that of
//! light sampling; a smooth surface shows such a light with more noise.

use super::rays::Caster;
use crate::emitter::{Emitters, InfiniteLight};
use crate::light_tree::{LitBy, Picked, ReceiverClass};
use crate::scene::{Linking, Scene};
use std::collections::HashMap;
use std::sync::Arc;

/// The links of a shot.
pub struct ShotLinks<'a> {
    linking: &'a Linking,
    emitters: &'a Emitters,
    /// By class of receivers and link number. The numbers are those of [`Emitters::link_sets`]; behind them are the
    /// sets that lights at infinity alone have.
    lit_by: Arc<LitBy>,
    /// The class of each membership.
    classes: Vec<ReceiverClass>,
    /// The membership of each instance; [`EVERY`] if it is in every set.
    memberships: Vec<u32>,
    /// The link number of each light of the scene that is at infinity.
    numbers: HashMap<usize, u32>,
}

/// The membership of geometry that is in every set.
const EVERY: u32 = u32::MAX;

impl<'a> ShotLinks<'a> {
    /// The links of a scene, if it has any.
    pub fn new(scene: &'a Scene, emitters: &'a Emitters) -> Option<ShotLinks<'a>> {
        let linking = &scene.linking;
        if linking.is_empty() {
            return None;
        }
        let mut sets = emitters.link_sets().to_vec();
        let mut numbers = HashMap::new();
        for (row, light) in scene.lights.iter().enumerate() {
            let Some(set) = linking.of_light(row as u32).light.filter(|_| light.kind.is_infinite())
            else {
                continue;
            };
            let at = sets.iter().position(|&known| known == set).unwrap_or_else(|| {
                sets.push(set);
                sets.len() - 1
            });
            numbers.insert(row, at as u32 + 1);
        }
        // Memberships that differ only in sets that no light lights are one class.
        let (mut known, mut rows) = (HashMap::new(), Vec::new());
        let classes = linking.memberships().iter().map(|membership| {
            let of_sets = sets.iter().map(|&set| membership.contains(set));
            let lit: Vec<bool> = std::iter::once(true).chain(of_sets).collect();
            if !lit.contains(&false) {
                return ReceiverClass::ALL;
            }
            let next = ReceiverClass(rows.len() as u32);
            *known.entry(lit).or_insert_with_key(|lit| {
                rows.push(lit.clone());
                next
            })
        });
        let classes = classes.collect();
        let mut memberships = vec![EVERY; scene.instances.len()];
        for (row, links) in linking.linked_instances() {
            memberships[row as usize] = links.membership.unwrap_or(EVERY);
        }
        let lit_by = Arc::new(LitBy::new(sets.len() + 1, rows));
        Some(ShotLinks { linking, emitters, lit_by, classes, memberships, numbers })
    }

    /// Which link numbers light which classes.
    pub fn lit_by(&self) -> &Arc<LitBy> {
        &self.lit_by
    }

    fn class_of(&self, membership: Option<u32>) -> ReceiverClass {
        membership.map_or(ReceiverClass::ALL, |row| self.classes[row as usize])
    }
}

/// The links of a shot, with the lights at infinity that shine in a frame.
#[derive(Clone, Copy)]
pub struct FrameLinks<'a> {
    /// The shot's.
    pub shot: &'a ShotLinks<'a>,
    /// Those lights.
    pub infinite: &'a [InfiniteLight<'a>],
}

impl FrameLinks<'_> {
    /// The membership of an instance's surface, and its class.
    #[inline]
    pub fn of_instance(&self, instance: u32) -> (Option<u32>, ReceiverClass) {
        let row = self.shot.memberships[instance as usize];
        let membership = (row != EVERY).then_some(row);
        (membership, self.shot.class_of(membership))
    }

    /// The membership of the fog, and its class.
    pub fn of_fog(&self) -> (Option<u32>, ReceiverClass) {
        let membership = self.shot.linking.of_medium();
        (membership, self.shot.class_of(membership))
    }

    /// Whether a light lights a class.
    #[inline]
    pub fn lights(&self, class: ReceiverClass, light: Picked) -> bool {
        class == ReceiverClass::ALL || self.shot.lit_by.holds(class, self.number_of(light))
    }

    /// Whether reflected rays from a class find a light.
    #[inline]
    pub fn reflections_find(&self, class: ReceiverClass, light: Picked) -> bool {
        self.lights(class, light) && self.shadow_set(light).is_none()
    }

    /// The set that casts shadows from a light; `None` is everything.
    #[inline]
    pub fn shadow_set(&self, light: Picked) -> Option<u32> {
        match light {
            Picked::Emitter(emitter) => self.shot.emitters.light_of(emitter).links.shadow,
            Picked::Beside(row) => {
                let light = self.infinite[row as usize].light;
                self.shot.linking.of_light(light as u32).shadow
            }
        }
    }

    /// Whether a prim is in a set that casts shadows.
    #[inline]
    pub fn casts(&self, set: u32, caster: Caster) -> bool {
        let row = match caster {
            Caster::Instance(instance) => {
                let row = self.shot.memberships[instance as usize];
                (row != EVERY).then_some(row)
            }
            Caster::Sphere(light) => self.shot.linking.of_light(light).membership,
        };
        self.shot.linking.holds(Some(set), row)
    }

    fn number_of(&self, light: Picked) -> u32 {
        match light {
            Picked::Emitter(emitter) => self.shot.emitters.light_of(emitter).link,
            Picked::Beside(row) => {
                let light = self.infinite[row as usize].light;
                self.shot.numbers.get(&light).copied().unwrap_or(0)
            }
        }
    }
}
