//! Who takes part: a way of picking lights, with a number of samples.

use crate::render::{LightStrategy, RenderSettings, Split, SplitBy};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// A way of picking lights. Displayed as it is written: `uniform`, `tree:0.5`, `tree:0.3:solid-angle`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Way {
    /// How a light is picked.
    pub strategy: LightStrategy,
    /// The knob of splitting; 0 for strategies that do not split. [`Split::Auto`] is what a render takes if
    /// nobody says anything.
    pub split: Split,
    /// The test of splitting; that by variance where nothing is split.
    pub split_by: SplitBy,
}

/// A way with a budget, displayed as it is written: `tree:0.5@16`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entrant {
    /// How lights are picked.
    pub way: Way,
    /// Samples of each pixel.
    pub samples: u32,
}

/// What a user wrote: a way, and samples if they are given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// How lights are picked.
    pub way: Way,
    /// Samples of each pixel; every budget if not given.
    pub samples: Option<u32>,
}

/// A text that is no entrant.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "'{0}' is not STRATEGY[:SPLIT[:TEST]][@SAMPLES]; the strategy is uniform, power, distance, tree, \
     exhaustive or all, SPLIT a number from 0 to 1 or auto, TEST variance or solid-angle, SAMPLES at least 1"
)]
pub struct NoEntrant(String);

/// Where there are more lights than these, weighing or sampling all of them at every point is not tried
/// unless it is asked for: it would take most of the time.
const FEW_LIGHTS: usize = 64;

impl Way {
    /// A way that splits by variance, if the strategy splits at all.
    pub fn new(strategy: LightStrategy, split: impl Into<Split>) -> Way {
        let split = if strategy.splits() { split.into() } else { Split::Fixed(0.0) };
        Way { strategy, split, split_by: SplitBy::Variance }
    }

    /// What is measured unless something else is asked for, in a scene with so many lights.
    pub fn usual(lights: usize) -> Vec<Way> {
        let mut ways = vec![
            Way::new(LightStrategy::Uniform, 0.0),
            Way::new(LightStrategy::Power, 0.0),
            Way::new(LightStrategy::Distance, 0.0),
            Way::new(LightStrategy::Tree, 0.0),
            Way::new(LightStrategy::Tree, Split::Auto),
        ];
        if lights <= FEW_LIGHTS {
            ways.extend([LightStrategy::Exhaustive, LightStrategy::All].map(|s| Way::new(s, 0.0)));
        }
        ways
    }
}

impl Entrant {
    /// The settings that it renders with, but for its seed. Where its knob is left open it is that of `base`.
    pub fn settings(&self, base: &RenderSettings) -> RenderSettings {
        let Way { strategy, split, split_by } = self.way;
        let split = if split == Split::Auto { base.split } else { split };
        RenderSettings { samples: self.samples, strategy, split, split_by, ..base.clone() }
    }
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(name(self.strategy))?;
        match self.split {
            Split::Fixed(knob) if self.strategy.splits() => write!(f, ":{knob}")?,
            Split::Auto if self.split_by == SplitBy::SolidAngle => f.write_str(":auto")?,
            _ => {}
        }
        if self.split_by == SplitBy::SolidAngle { f.write_str(":solid-angle") } else { Ok(()) }
    }
}

impl fmt::Display for Entrant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}", self.way, self.samples)
    }
}

fn name(strategy: LightStrategy) -> &'static str {
    match strategy {
        LightStrategy::Uniform => "uniform",
        LightStrategy::Power => "power",
        LightStrategy::Distance => "distance",
        LightStrategy::Tree => "tree",
        LightStrategy::Exhaustive => "exhaustive",
        LightStrategy::All => "all",
    }
}

impl FromStr for Asked {
    type Err = NoEntrant;

    fn from_str(text: &str) -> Result<Asked, NoEntrant> {
        read(text).ok_or_else(|| NoEntrant(text.into()))
    }
}

fn read(text: &str) -> Option<Asked> {
    let (how, samples) = match text.split_once('@') {
        Some((how, samples)) => (how, Some(samples.parse().ok().filter(|&samples| samples > 0)?)),
        None => (text, None),
    };
    let mut parts = how.split(':');
    let word = |text: &str| serde_json::Value::String(text.into());
    let strategy: LightStrategy = serde_json::from_value(word(parts.next()?)).ok()?;
    let split = match parts.next() {
        Some(_) if !strategy.splits() => return None,
        Some("auto") | None => Split::Auto,
        Some(text) => Split::Fixed(text.parse().ok().filter(|split| (0.0..=1.0).contains(split))?),
    };
    let split_by = match parts.next() {
        Some(text) => serde_json::from_value(word(text)).ok()?,
        None => SplitBy::Variance,
    };
    let way = Way { split_by, ..Way::new(strategy, split) };
    parts.next().is_none().then_some(Asked { way, samples })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_displayed_can_be_read() {
        for text in [
            "uniform",
            "tree",
            "tree:0",
            "tree:0.3:solid-angle",
            "tree:auto:solid-angle",
            "distance:1",
        ] {
            let asked: Asked = text.parse().unwrap();
            assert_eq!((asked.way.to_string(), asked.samples), (text.into(), None));
            let entrant: Asked = format!("{text}@24").parse().unwrap();
            assert_eq!((entrant.way, entrant.samples), (asked.way, Some(24)));
        }
    }

    #[test]
    fn nonsense_is_told_with_the_remedy() {
        let wrong =
            ["", "trees", "tree:nan", "tree:2", "uniform:0.5", "tree:0.5:x", "tree:1:variance:1"];
        for text in wrong.into_iter().chain(["tree@", "tree@0", "tree@-4", "tree@x"]) {
            let error = text.parse::<Asked>().unwrap_err().to_string();
            assert!(error.contains("STRATEGY[:SPLIT") && error.contains(text), "{error}");
        }
    }
}
