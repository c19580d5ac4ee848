//! Floor 2: light bounds -> trees; sampling them.
//!
//! A light tree is a bounding hierarchy over emitters, each node with a box, a cone of orientations
//! and an energy (Conty Estevez and Kulla, HPG 2018); here an eight-way one. A receiver picks an
//! emitter by walking from the root and choosing at each step among eight children by *importance*,
//! an estimate of what each sends to it.
//! This room knows [`LightBounds`](crate::bounds::LightBounds) and numbers of emitters; what an
//! emitter is, it does not know.
//!
//! | file | what |
//! |---|---|
//! | `node` | 32 bytes: bounds rounded outwards, and a link |
//! | `group` | the eight children of a cluster, lane by lane |
//! | `viewer` | who asks: a [`Receiver`], a [`Glossy`] one, or a stretch of a ray ([`Segment`]) |
//! | `importance`, `glossy`, `segment` | what a cluster may send to each |
//! | `wide` | the same code for wider vector registers |
//! | `builder` | the partition (SAOH) and the bounds, deterministic and parallel |
//! | `writer`, `records`, `tree` | the trees of a shot as a file, and that file opened |
//! | `base` | what of an earlier version of the file has stayed the same |
//! | `place` | where a walk stands, in which space; the one function that weighs a group |
//! | `sampling` | picking an emitter |
//! | `splitting`, `cut` | how many samples a viewer is worth; the clusters they are taken from |
//! | `picks` | picking those, and how often each light is expected to be |
//! | `leaves`, `probability` | the way back from an emitter to its probability |
//! | `variance` | how far off an estimate is, in closed form |
//! | `verify` | proof that a file, or what a frame samples of it, keeps the format's promises |
//! | `digest` | what a frame samples, in 32 bytes |
//! | `known` | what has been found out about a file |
//! | `front` | the groups that matter most to some viewers |
//! | `learned` | where receivers are, and what they see |
//! | `veil` | what is known of how much of each cluster is hidden |
//! | `linking` | which lights light which receivers |
//! | `far_field` | what lights send in each direction, where that was measured |

mod base;
mod builder;
mod cut;
mod digest;
pub mod far_field;
mod front;
mod glossy;
mod group;
mod importance;
mod known;
pub mod learned;
mod leaves;
pub mod linking;
mod node;
mod picks;
mod place;
mod probability;
mod records;
mod sampling;
mod segment;
mod splitting;
mod tree;
mod variance;
pub mod veil;
mod verify;
mod viewer;
mod wide;
mod writer;

pub use base::Base;
pub use builder::ALGORITHM_VERSION;
pub use cut::{Picked, Scratch};
pub use front::{Front, FrontGroup};
pub use glossy::{Glossy, Lobes};
pub use group::{Group, WIDTH};
pub use linking::{Linked, LitBy, ReceiverClass, SameLinks};
pub use node::{Link, Node};
pub use records::{
    FrameRow, InstanceRow, LightLook, LightRow, MeanRow, Numbering, TextureRow, TreeKind, TreeRow,
};
pub use sampling::{FrameTree, Pick};
pub use segment::Segment;
pub use splitting::{SplitTest, Splitting};
pub use tree::{LightTree, NoSuchFrame};
pub use variance::Moments;
pub use veil::{Cell, Veil, Veiled, Veils};
pub use verify::rules::RULES;
pub use viewer::{DistanceOnly, Receiver, Viewer};
pub use writer::{LightList, LightSummary, LightTreeWriter};
