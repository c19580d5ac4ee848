//! Layers of a picture (AOVs): which there are, their channels and their sample types.
//!
//! An [`Aov`] is what a user asks for; a [`Layer`] is what a file holds. Most are one and the same, but light
//! groups are a layer each, and motion and Cryptomatte are several. `docs/layers.md` is the list for users.
//!
//! Names are those that compositing programs know: the main picture is unnamed (OpenEXR's convention),
//! light groups are `RGBA_NAME` (Arnold), motion is `forward` and `backward` (Nuke), object ids are
//! `CryptoObject00` (the Cryptomatte specification).

use clap::ValueEnum;
use serde::Serialize;

/// What can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Aov {
    /// R, G, B, A: the picture; always written
    Beauty,
    /// direct.RGB: light scattered once on its way to the eye
    Direct,
    /// emission.RGB: light that was not scattered: lamps and sky as the camera sees them
    Emission,
    /// indirect.RGB: light scattered more than once
    Indirect,
    /// RGBA_NAME.RGB: the light of each light group, by its name, and RGBA_default of all others
    LightGroups,
    /// Z: metres in front of the camera
    Depth,
    /// N.XYZ: shading normal, world space
    Normal,
    /// albedo.RGB: share of white light that the first surface reflects
    Albedo,
    /// P.XYZ: world-space position, metres
    Position,
    /// forward.uv, backward.uv: pixels to where the surface is in the next and in the last frame
    Motion,
    /// CryptoObject00 to 02: ids and coverages of the prims, with their names
    Cryptomatte,
    /// variance.RGB: variance of the mean in the beauty
    Variance,
    /// error: how far the pixel is off, as --error means it: told by its neighbours
    Error,
    /// sampleCount: samples that the mean is of
    SampleCount,
}

impl Aov {
    /// What is written if nothing is asked for.
    pub const DEFAULT: [Aov; 6] =
        [Aov::Beauty, Aov::Depth, Aov::Normal, Aov::Albedo, Aov::Variance, Aov::SampleCount];
    /// The parts of the beauty by how often light was scattered: never, once, more often.
    pub const BY_SCATTERINGS: [Aov; 3] = [Aov::Emission, Aov::Direct, Aov::Indirect];
}

/// How a channel is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleType {
    /// 16-bit floats, clamped to what they hold (65504).
    Half,
    /// 32-bit floats.
    Float,
}

/// Some channels that belong together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layer {
    /// What it shows.
    pub aov: Aov,
    /// Its name; empty for the channels that have no layer.
    pub name: String,
    /// The last parts of the channels' names.
    pub channels: &'static [&'static str],
    /// How all of them are stored.
    pub sample_type: SampleType,
}

impl Layer {
    /// Full names of the channels, `albedo.R` or `Z`.
    pub fn channel_names(&self) -> impl Iterator<Item = String> {
        let prefix = if self.name.is_empty() { String::new() } else { format!("{}.", self.name) };
        self.channels.iter().map(move |channel| format!("{prefix}{channel}"))
    }
}

const RGB: &[&str] = &["R", "G", "B"];
const RGBA: &[&str] = &["R", "G", "B", "A"];
const XYZ: &[&str] = &["X", "Y", "Z"];
const UV: &[&str] = &["u", "v"];

/// The layers of a picture: the beauty first, the others in the order of [`Aov`], each once.
/// `float_beauty` stores the beauty in 32 bits, `groups` are the names of the light groups.
pub fn layers_of(aovs: &[Aov], float_beauty: bool, groups: &[String]) -> Vec<Layer> {
    let mut asked: Vec<Aov> = aovs.iter().copied().chain([Aov::Beauty]).collect();
    asked.sort_unstable();
    asked.dedup();
    let mut layers = Vec::new();
    for aov in asked {
        let mut add = |name: &str, channels| {
            let is_half = aov == Aov::Beauty && !float_beauty;
            let sample_type = if is_half { SampleType::Half } else { SampleType::Float };
            layers.push(Layer { aov, name: name.into(), channels, sample_type });
        };
        match aov {
            Aov::Beauty => add("", RGBA),
            Aov::Direct => add("direct", RGB),
            Aov::Emission => add("emission", RGB),
            Aov::Indirect => add("indirect", RGB),
            Aov::LightGroups => groups.iter().for_each(|name| add(&format!("RGBA_{name}"), RGB)),
            Aov::Depth => add("", &["Z"]),
            Aov::Normal => add("N", XYZ),
            Aov::Albedo => add("albedo", RGB),
            Aov::Position => add("P", XYZ),
            Aov::Motion => ["forward", "backward"].iter().for_each(|name| add(name, UV)),
            Aov::Cryptomatte => {
                let level = |level| format!("{}{level:02}", super::cryptomatte::NAME);
                (0..super::cryptomatte::LEVELS).for_each(|number| add(&level(number), RGBA));
            }
            Aov::Variance => add("variance", RGB),
            Aov::Error => add("", &["error"]),
            Aov::SampleCount => add("", &["sampleCount"]),
        }
    }
    layers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_has_a_name_of_its_own() {
        let groups = ["default".to_string(), "key".to_string()];
        let layers = layers_of(Aov::value_variants(), false, &groups);
        let names: Vec<String> = layers.iter().flat_map(Layer::channel_names).collect();
        let mut distinct = names.clone();
        distinct.sort();
        distinct.dedup();
        assert_eq!(names.len(), distinct.len());
        assert_eq!(names[..4], ["R", "G", "B", "A"]);
        for name in ["Z", "N.X", "RGBA_key.G", "forward.v", "CryptoObject02.A", "sampleCount"] {
            assert!(names.iter().any(|own| own == name), "{name}");
        }
    }

    #[test]
    fn the_beauty_is_always_there_and_nothing_is_there_twice() {
        let layers = layers_of(&[Aov::Depth, Aov::Depth], true, &[]);
        assert_eq!(
            layers.iter().map(|layer| layer.aov).collect::<Vec<_>>(),
            [Aov::Beauty, Aov::Depth]
        );
        assert_eq!(layers[0].sample_type, SampleType::Float);
        assert_eq!(layers_of(&[], false, &[])[0].sample_type, SampleType::Half);
    }
}
