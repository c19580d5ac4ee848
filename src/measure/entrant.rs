//! Who takes part: a way of picking lights, with a number of samples or an error.

use crate::render::noise::Grey;
use crate::render::passes::ErrorGoal;
use crate::render::{LightStrategy, RenderSettings, Split, SplitBy};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
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

/// What ends a picture; displayed as it is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// So many samples in each pixel: a whole number.
    Samples(u32),
    /// The error of the picture is as small as this, below 1, with 95 % certainty. Samples go where the error is
    /// ([`ToError`](crate::render::passes::ToError)).
    Error(f64),
}

/// A way with a budget, displayed as it is written: `tree:0.5@16`, `tree@0.05`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Entrant {
    /// How lights are picked.
    pub way: Way,
    /// What ends a picture. A [`Row`](super::Row) tells both what was asked for and what was taken.
    #[serde(skip)]
    pub budget: Budget,
}

/// What a user wrote: a way, and a budget if one is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// How lights are picked.
    pub way: Way,
    /// What ends a picture; all numbers of samples that are tried if not given.
    pub budget: Option<Budget>,
}

/// A text that is no entrant.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "'{0}' is not STRATEGY[:SPLIT[:TEST]][@SAMPLES or @ERROR]; the strategy is uniform, power, distance, tree, \
     exhaustive or all, SPLIT a number from 0 to 1 or auto, TEST variance or solid-angle, SAMPLES a whole \
     number, at least 1, ERROR from 0.0001 to below 1"
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

impl Budget {
    /// The error that is asked for, if one is.
    pub fn error(self) -> Option<f64> {
        match self {
            Budget::Samples(_) => None,
            Budget::Error(error) => Some(error),
        }
    }

    /// The number of samples that is asked for, if one is.
    pub fn samples(self) -> Option<u32> {
        match self {
            Budget::Samples(samples) => Some(samples),
            Budget::Error(_) => None,
        }
    }

    /// From little work to much: numbers of samples, then errors.
    pub fn by_work(&self, other: &Budget) -> Ordering {
        match (self, other) {
            (Budget::Samples(a), Budget::Samples(b)) => a.cmp(b),
            (Budget::Error(a), Budget::Error(b)) => b.total_cmp(a),
            (Budget::Samples(_), Budget::Error(_)) => Ordering::Less,
            (Budget::Error(_), Budget::Samples(_)) => Ordering::Greater,
        }
    }

    fn read(text: &str) -> Option<Budget> {
        if let Ok(samples) = text.parse() {
            return Some(Budget::Samples(samples)).filter(|_| samples > 0);
        }
        let error = text.parse().ok().filter(|error| (1e-4..1.0).contains(error))?;
        Some(Budget::Error(error))
    }
}

impl Entrant {
    /// What is asked of the noise, if anything is. No pixel gets more than `most` samples.
    pub fn goal(&self, grey: Grey, most: u32) -> Option<ErrorGoal> {
        Some(ErrorGoal { error: self.budget.error()?, grey, most })
    }

    /// The settings that it renders with, but for its seed. Where its knob is left open it is that of `base`.
    pub fn settings(&self, base: &RenderSettings) -> RenderSettings {
        let Way { strategy, split, split_by } = self.way;
        let split = if split == Split::Auto { base.split } else { split };
        let samples = self.budget.samples().unwrap_or(base.samples);
        RenderSettings { samples, strategy, split, split_by, ..base.clone() }
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

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Budget::Samples(samples) => samples.fmt(f),
            Budget::Error(error) => error.fmt(f),
        }
    }
}

impl fmt::Display for Entrant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}", self.way, self.budget)
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
    let (how, budget) = match text.split_once('@') {
        Some((how, budget)) => (how, Some(Budget::read(budget)?)),
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
    parts.next().is_none().then_some(Asked { way, budget })
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
            assert_eq!((asked.way.to_string(), asked.budget), (text.into(), None));
            for (end, budget) in [("24", Budget::Samples(24)), ("0.05", Budget::Error(0.05))] {
                let text = format!("{text}@{end}");
                let entrant: Asked = text.parse().unwrap();
                assert_eq!((entrant.way, entrant.budget), (asked.way, Some(budget)));
                assert_eq!(Entrant { way: asked.way, budget }.to_string(), text);
            }
        }
    }

    #[test]
    fn nonsense_is_told_with_the_remedy() {
        let wrong =
            ["", "trees", "tree:nan", "tree:2", "uniform:0.5", "tree:0.5:x", "tree:1:variance:1"];
        for text in wrong
            .into_iter()
            .chain(["tree@", "tree@0", "tree@-4", "tree@x", "tree@1.5", "tree@0.0", "tree@nan"])
        {
            let error = text.parse::<Asked>().unwrap_err().to_string();
            assert!(error.contains("STRATEGY[:SPLIT") && error.contains(text), "{error}");
        }
    }
}
