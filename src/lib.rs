//! Candelabra: light trees for scenes with very many lights.
//!
//! A city at night, a neon mesh of a hundred thousand triangles, a ceiling of five thousand lamps: a
//! renderer that loops over such lights is too slow, one that picks them blindly too noisy. A *light
//! tree* (Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting",
//! HPG 2018) bounds clusters of emitters by boxes and cones, and a shading point picks from it by an
//! estimate of what each cluster sends. Here trees are a product of the pipeline: built once when a
//! scene is published, written to a file, and memory-mapped by a batch renderer for every frame.
//!
//! # A tour
//!
//! The house has eight floors; a room imports only from floors below its own.
//!
//! | floor | rooms | |
//! |---|---|---|
//! | 7 | `bin/candelabra`, `bin/candelabra-render` | arguments, progress, exit codes |
//! | 6 | [`diff`], [`farm`], [`inspect`] | two versions of a scene; jobs of many frames; one scene |
//! | 5 | [`pipeline`] | jobs and stages: the only place where ingest meets the tree |
//! | 4 | [`learn`], [`measure`] | what is hidden from where; strategies side by side: variance, error against time |
//! | 3 | [`render`] | a path tracer that finds its lights through the tree |
//! | 2 | [`ingest`], [`emitter`], [`light_tree`] | files to scene; scene to emitters; bounds to tree |
//! | 1 | [`scene`], [`bounds`], [`store`], [`page`] | a scene's tables; box, cone, energy; bytes on disk; HTML |
//! | 0 | [`math`] | frames, warps, sums, random numbers |
//!
//! The rooms `emitter` and `light_tree` meet in [`bounds::LightBounds`] alone: the tree is built over
//! bounds, whatever they bound, and can be tested with random ones.
//!
//! # From a scene to a picked light
//!
//! ```no_run
//! use candelabra::emitter::Emitters;
//! use candelabra::light_tree::{LightTree, Receiver};
//! use candelabra::pipeline;
//! use glam::Vec3;
//! use std::path::Path;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene = pipeline::load_scene(Path::new("street.glb"))?;
//! let emitters = Emitters::collect(&scene);
//!
//! // What the tree depends on, and the bytes of its file.
//! let survey = pipeline::survey(&scene, &emitters, &pipeline::frames_of(&scene))?;
//! let bytes = pipeline::build_tree(&survey);
//!
//! // The same type over bytes just built and over a mapped file (`pipeline::open_tree`).
//! let tree = LightTree::open(bytes)?;
//! let frame = tree.at_frame(1001)?;
//! let receiver = Receiver { point: Vec3::ZERO, normal: Vec3::Y };
//! if let Some(pick) = frame.sample(&receiver, 0.25) {
//!     assert!(pick.probability > 0.0);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! The tree file is specified in [`store`]; what a glTF file carries beyond glTF, in [`ingest`].

pub mod bounds;
pub mod diff;
pub mod emitter;
pub mod farm;
pub mod ingest;
pub mod inspect;
pub mod learn;
pub mod light_tree;
pub mod math;
pub mod measure;
pub mod page;
pub mod pipeline;
pub mod render;
pub mod scene;
pub mod store;
