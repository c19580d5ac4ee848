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
//! | `importance` | what a cluster may send to a [`Receiver`] |
//! | `builder` | the partition (SAOH) and the bounds, deterministic and parallel |
//! | `writer`, `records`, `tree` | the trees of a shot as a file, and that file opened |
//! | `sampling` | picking an emitter, and the probability of the pick |
//! | `verify` | proof that a file keeps the format's promises |

mod builder;
mod group;
mod importance;
mod node;
mod records;
mod sampling;
mod tree;
mod verify;
mod writer;

pub use builder::ALGORITHM_VERSION;
pub use group::{Group, WIDTH};
pub use importance::Receiver;
pub use node::{Link, Node};
pub use records::{FrameRow, LightRow, Parent, TreeRow};
pub use sampling::{FrameTree, LeafTable, Pick};
pub use tree::{LightTree, NoSuchFrame};
pub use writer::{LightSummary, LightTreeWriter};
