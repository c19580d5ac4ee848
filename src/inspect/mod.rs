//! Floor 6: looking inside tree files, tables of what is hidden and scenes.
//!
//! [`TreeReport`], [`TableReport`] and [`SceneReport`] are numbers, for programs and for people. [`dot()`] draws the
//! top of a tree as a graph, [`html()`] and [`table_html()`] make pages with pictures. None of them changes what it looks
//! at, and none samples lights: [`measure`](crate::measure) tells how good a tree is at a point.
//!
//! | file | what |
//! |---|---|
//! | `report` | a tree file, its trees by kind and its heaviest lights |
//! | `shape` | how deep, how full and how good a tree is |
//! | `scene` | what is in a scene |
//! | `features` | what a scene requires, and what that switches on |
//! | `table` | a table of what is hidden |
//! | `walk` | every cluster and emitter of a frame as it stands in the world |
//! | `dot` | the top of a tree for Graphviz |
//! | `html` | the page |

mod dot;
mod features;
mod html;
mod report;
mod scene;
mod shape;
mod table;
mod walk;

pub use dot::dot;
pub use features::{Feature, FeatureState};
pub use html::{html, table_html};
pub use report::{FrameSpan, LightReport, SectionReport, TreeReport};
pub use scene::{CameraReport, LightGroupReport, SceneReport};
pub use shape::{Shape, shapes};
pub use table::TableReport;

/// The version of the reports as JSON. Within a version fields may be added, and none changes or is
/// removed. Units are candela, metres and degrees; shares are in `[0, 1]`. Since version 2 notes have a
/// category and a text.
pub const VERSION: u32 = 2;
