//! Floor 3: the renderer: a unidirectional path tracer that finds its lights through the tree.
//!
//! A [`RenderDelegate`] prepares a shot once and renders its frames; [`RenderSettings`] are the knobs,
//! [`RenderBuffers`](buffers::RenderBuffers) what a frame leaves behind. It knows a scene, its
//! emitters and a light tree; it never sees the files that these came from.
//!
//! | module | question |
//! |---|---|
//! | [`delegate`] | what is done once for a shot, and what for each frame? |
//! | `frame_times` | when does the camera see a frame? |
//! | [`path`], [`vertex`], `walk` | how does light get from a lamp to the eye, and where are its vertices? |
//! | [`direct`], [`fog`] | what do picked lights give a surface, what a stretch of fog? |
//! | `panes` | what becomes of a path that meets thin glass? |
//! | [`links`] | which lights light a surface, and what casts their shadows? |
//! | `far_field` | what do lights with a photometric profile tell the tree? |
//! | [`picker`] | which lights are sampled there, and how often is each expected to be? |
//! | [`knob`] | how readily are clusters split, if nobody says? |
//! | [`camera`] | which ray belongs to a point of the picture? |
//! | [`rays`] | what does a ray hit, and is a light visible? |
//! | [`surface`] | what is there: normals, textures, material? |
//! | [`bsdf`] | how does it reflect? |
//! | [`layers`], [`light_groups`], [`crop`] | what is kept of a frame, of which lights, of which part? |
//! | [`film`], `parts` | what do a pixel's samples come to? |
//! | [`passes`] | how many samples does each pixel get, and when is a frame done? |
//! | `motion`, `cryptomatte` | where does it move, and what is it? |
//! | [`buffers`] | where is it all kept? |
//! | [`noise`] | what is the error of a picture, and where are samples missing? |
//! | [`exr`], [`beauty`], [`png`] | how does it get to the disk? |
//! | [`frames`], [`frame_names`] | which frames, and under which names? |

pub mod beauty;
pub mod bsdf;
pub mod buffers;
pub mod camera;
pub mod crop;
mod cryptomatte;
pub mod delegate;
pub mod direct;
pub mod exr;
mod exr_header;
mod far_field;
pub mod film;
pub mod fog;
pub mod frame_names;
mod frame_times;
pub mod frames;
pub mod knob;
pub mod layers;
pub mod light_groups;
pub mod links;
mod motion;
pub mod noise;
mod panes;
mod parts;
pub mod passes;
pub mod path;
pub mod picker;
mod plan;
pub mod png;
pub mod rays;
pub mod settings;
pub mod surface;
pub mod vertex;
mod walk;

pub use crop::{CropError, Window};
pub use delegate::{FrameStats, RenderDelegate, RenderError, RenderedFrame};
pub use film::Film;
pub use knob::{Knobs, Split};
pub use layers::Aov;
pub use light_groups::{LightGroupError, LightGroupRule, LightGroups};
pub use passes::{Control, Progress};
pub use plan::PlanError;
pub use rays::kept_in_own_space;
pub use settings::{LightStrategy, RenderSettings, SplitBy};
