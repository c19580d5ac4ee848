//! One light as it is matched, and as it is compared with another.

use super::card::{Kind, LightCard};
use crate::light_tree::{LightLook, LightRow};
use crate::scene::Response;
use glam::{Affine3A, Vec3, Vec3A};

/// What a light is matched by. It is kept small, because there may be millions of lights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Light<'a> {
    pub path: &'a str,
    pub row: Row,
    /// A hash of everything about the light that the tree depends on.
    pub fingerprint: [u8; 32],
    /// The bits of [`LightRow`]'s class.
    pub class: u32,
    pub kind: Option<Kind>,
    /// The hue, coded as in [`LightLook`].
    pub color: [u16; 3],
    /// In the unit of [`LightCard::energy`].
    pub energy: f32,
    pub emitters: u32,
    /// Its link number in its own version; 0 at infinity.
    pub link: u32,
    /// What only a scene tells; the default for a light of a tree.
    pub profile: Profile,
}

/// Where a light is found again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Row {
    /// In the order of the emitters.
    Near(u32),
    /// At infinity, in the order of the scene's lights.
    Infinite(u32),
}

/// How the light of a prim is distributed over its surface and over directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Profile {
    /// A hash of its texture and of its shaping without the half angle.
    pub pattern: u128,
    /// Half angle of the shaping, radians, if it has one.
    pub half_angle_rad: Option<f32>,
    /// A hash of its axes in the world, if a turn about the one that it is aimed along changes what it lights; else 0.
    pub turn: u64,
    /// How much of it surfaces reflect.
    pub response: Response,
}

/// Everything that two versions of a light are compared by.
#[derive(Clone, Debug)]
pub(super) struct Described {
    pub card: LightCard,
    /// From its own space to the world's, if that is known.
    pub to_world: Option<Affine3A>,
    /// A hash of its emitters in its own space, if they are known.
    pub shape: Option<u128>,
    /// Whether it shines to both sides of its axis.
    pub two_sided: bool,
    pub profile: Profile,
    /// Whether it has a tree of its own, which tells its place less exactly.
    pub placed: bool,
}

impl Described {
    /// The same, from another origin.
    pub fn shifted(mut self, shift: Vec3) -> Described {
        if let Some(place) = &mut self.card.place {
            place.center_m = (Vec3::from(place.center_m) + shift).to_array();
        }
        if let Some(to_world) = &mut self.to_world {
            to_world.translation += Vec3A::from(shift);
        }
        self
    }
}

impl Light<'_> {
    /// What is known without its place; a side may add the place.
    pub fn described(&self) -> Described {
        Described {
            card: self.card(),
            to_world: None,
            shape: None,
            two_sided: false,
            profile: self.profile,
            placed: self.is(LightRow::PLACED),
        }
    }

    /// Whether nothing of it differs, except perhaps the path.
    pub fn has_content_of(&self, other: &Light) -> bool {
        self.fingerprint == other.fingerprint
            && self.class == other.class
            && self.looks_like(other)
            && self.profile == other.profile
    }

    /// Whether kind and colour agree. An old tree file does not tell them; then they count as equal.
    fn looks_like(&self, other: &Light) -> bool {
        let told = self.kind.is_some() && other.kind.is_some();
        !told || (self.kind, self.color) == (other.kind, other.color)
    }

    pub fn is(&self, property: u32) -> bool {
        self.class & property != 0
    }

    /// Whether it moves, deforms or varies in strength with time.
    pub fn changes(&self) -> bool {
        self.is(LightRow::CHANGES)
    }

    /// Its card, without its place.
    pub fn card(&self) -> LightCard {
        LightCard {
            path: self.path.to_owned(),
            kind: self.kind,
            emitters: self.emitters,
            energy: self.energy,
            color: LightLook { kind: 0, color: self.color }.hue().map(|hue| hue.to_array()),
            place: None,
            axis: None,
            half_angle_deg: 180.0,
            range_m: None,
            forced: self.is(LightRow::FORCED),
            changes: self.changes(),
        }
    }
}

/// Turns a tiny energy into 0: a tree holds a positive energy even for a light that is dark in its first
/// frame.
pub(super) fn without_crumbs(energy: f32) -> f32 {
    if energy < 1e-30 { 0.0 } else { energy }
}

/// The kind that a tree's row tells.
pub(super) fn kind_of(look: &LightLook) -> Option<Kind> {
    match look.kind {
        LightLook::MESH => Some(Kind::Mesh),
        LightLook::POINT => Some(Kind::Point),
        LightLook::SPOT => Some(Kind::Spot),
        LightLook::SPHERE => Some(Kind::Sphere),
        _ => None,
    }
}
