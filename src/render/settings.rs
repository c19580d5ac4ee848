//! Render settings: the knobs of a render.

use super::crop::{CropError, Window};
use super::knob::Split;
use super::layers::Aov;
use super::light_groups::LightGroupRule;
use crate::light_tree::{SplitTest, Splitting};
use serde::{Deserialize, Serialize};

/// How a light is picked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightStrategy {
    /// Every light alike.
    Uniform,
    /// By energy alone, the same everywhere.
    Power,
    /// Through the light tree, by energy and distance alone: without any orientation.
    Distance,
    /// By importance, through the light tree.
    #[default]
    Tree,
    /// By the importance of every single emitter: what a perfect traversal would do. Slow.
    Exhaustive,
    /// None is picked: every light is sampled at every point, the traditional loop. Slow.
    All,
}

impl LightStrategy {
    /// Whether it walks the tree, so that clusters can be split.
    pub fn splits(self) -> bool {
        matches!(self, LightStrategy::Distance | LightStrategy::Tree)
    }
}

/// What makes a cluster worth splitting; see [`SplitTest`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SplitBy {
    /// Its part in the relative variance of one sample.
    #[default]
    Variance,
    /// The seed's: its solid angle times the peak of the BSDF. All clusters left are sampled.
    SolidAngle,
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
    /// How readily clusters are split. For the strategies that [split](LightStrategy::splits).
    pub split: Split,
    /// At most so many lights are sampled at a point, beside the forced ones.
    pub max_lights: u32,
    /// What makes a cluster worth splitting.
    pub split_by: SplitBy,
    /// Multiple importance sampling: picked lights are weighed against lights that reflected rays hit.
    /// Without it, lights are found by picking alone.
    pub mis: bool,
    /// What moves while the camera's shutter is open is blurred. Without it, a frame is an instant.
    pub motion_blur: bool,
    /// What is written of a frame. The beauty always is.
    pub aovs: Vec<Aov>,
    /// The beauty is stored in 32 bits instead of 16.
    pub float_beauty: bool,
    /// Which lights are in which light group, before what the scene says. For [`Aov::LightGroups`].
    pub light_groups: Vec<LightGroupRule>,
    /// The part of the picture that is rendered; all of it if `None`. Its pixels are the whole one's.
    pub crop: Option<Window>,
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
            split: Split::default(),
            max_lights: 64,
            split_by: SplitBy::default(),
            mis: true,
            motion_blur: true,
            aovs: Aov::DEFAULT.to_vec(),
            float_beauty: false,
            light_groups: Vec::new(),
            crop: None,
        }
    }
}

impl RenderSettings {
    /// The part of the picture that is rendered.
    ///
    /// # Errors
    /// If the crop is not a part of the picture.
    pub fn window(&self) -> Result<Window, CropError> {
        let whole = Window::whole(self.width, self.height);
        self.crop.unwrap_or(whole).inside(self.width, self.height)
    }

    /// How the tree is to be split for a point that a path reaches after so many bounces.
    pub fn splitting(&self, bounce: u32) -> Splitting {
        Splitting {
            knob: if self.strategy.splits() { self.split.knobs().at(bounce) } else { 0.0 },
            most: self.max_lights.max(1),
            test: match self.split_by {
                SplitBy::Variance => SplitTest::Variance,
                SplitBy::SolidAngle => SplitTest::SolidAngle,
            },
        }
    }
}
