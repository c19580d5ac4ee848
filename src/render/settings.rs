//! Render settings: the knobs of a render.

use serde::Serialize;

/// How a light is picked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LightStrategy {
    /// Every light alike.
    Uniform,
    /// By energy alone, the same everywhere.
    Power,
    /// By importance, through the light tree.
    #[default]
    Tree,
    /// By the importance of every single emitter: what a perfect traversal would do. Slow.
    Exhaustive,
}

/// The knobs of a render. Together with scene, tree and frame they decide every pixel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RenderSettings {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Samples of each pixel, at least 1.
    pub samples: u32,
    /// Bounces of light on its way to the eye: 0 shows emitters only, 1 adds direct light.
    pub depth: u32,
    /// Another seed, another noise.
    pub seed: u32,
    /// How a light is picked.
    pub strategy: LightStrategy,
    /// Weigh picked lights and lights that reflected rays hit against each other. Without, lights
    /// are found by picking alone.
    pub mis: bool,
}

impl Default for RenderSettings {
    fn default() -> Self {
        RenderSettings {
            width: 1280,
            height: 720,
            samples: 64,
            depth: 5,
            seed: 0,
            strategy: LightStrategy::default(),
            mis: true,
        }
    }
}
