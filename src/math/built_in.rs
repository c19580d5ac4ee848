//! Features that a build may leave out, so that `scripts/what_is_paid.py` can measure what each costs a
//! scene without it.
//!
//! Each has a Cargo feature `without-NAME`, which takes out the branches of the inner loops that belong to
//! it. Such a build must render no scene that needs what it lacks.

/// Textures: of surfaces, and of emission.
pub const TEXTURES: bool = !cfg!(feature = "without-textures");
/// Fog: what it scatters, and what it lets through.
pub const FOG: bool = !cfg!(feature = "without-fog");
/// Nodes that move and lights that vary.
pub const MOTION: bool = !cfg!(feature = "without-motion");
/// Suns and domes: the lights beside the tree.
pub const DOMES: bool = !cfg!(feature = "without-domes");
/// Meshes and trees of lights in spaces of their own.
pub const INSTANCES: bool = !cfg!(feature = "without-instances");
/// More than one light at a point.
pub const SPLITTING: bool = !cfg!(feature = "without-splitting");
/// Distances beyond which a light is dark.
pub const RANGE: bool = !cfg!(feature = "without-range");
/// The specular lobe.
pub const GLOSSY: bool = !cfg!(feature = "without-glossy");
/// Light that passes through glass.
pub const TRANSMISSION: bool = !cfg!(feature = "without-transmission");
/// Links of lights to what they light, and to what casts their shadows.
pub const LINKS: bool = !cfg!(feature = "without-links");
/// Light filters.
pub const FILTERS: bool = !cfg!(feature = "without-filters");
/// Lights whose diffuse and specular light is multiplied.
pub const MULTIPLIERS: bool = !cfg!(feature = "without-multipliers");
/// What was learned of hidden lights: tables of veils.
pub const VISIBILITY: bool = !cfg!(feature = "without-visibility");
/// Profiles of lights, IES.
pub const PROFILES: bool = !cfg!(feature = "without-profiles");
