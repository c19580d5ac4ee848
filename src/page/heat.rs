//! Numbers on a grid as colours.

use super::Part;
use super::escape::Escaped;
use super::raster::Raster;
use image::{Rgba, RgbaImage};
use std::fmt::{self, Display};

/// A grid of numbers, shown as an image with a key.
#[derive(Clone, Debug)]
pub struct HeatMap {
    /// What it shows.
    pub caption: String,
    /// Cells in a row, at least 1.
    pub width: u32,
    /// Row after row from the top left; not a number where there is nothing.
    pub values: Vec<f32>,
    /// What colours mean.
    pub scale: Scale,
}

/// What colours mean.
#[derive(Clone, Debug)]
pub enum Scale {
    /// From black at 0 to white at this and beyond, displayed by the square root.
    Grey {
        /// What is white; positive.
        white: f32,
    },
    /// From black at 0 through red and yellow to white at this and beyond.
    Heat {
        /// What is white; positive.
        white: f32,
    },
    /// From blue for a loss through grey for none to orange for a gain.
    Gain {
        /// What is as blue or as orange as can be; positive.
        limit: f32,
        /// What it is counted in.
        unit: String,
    },
    /// From lamplight at 0 to night at 1: a share that is dark.
    Shadow,
}

/// The ends and the middle of a gain's colours.
const LOSS: [f32; 3] = [20.0, 110.0, 220.0];
const NONE: [f32; 3] = [128.0, 128.0, 130.0];
const GAIN: [f32; 3] = [255.0, 140.0, 0.0];
/// The ends of a shadow's colours.
const LIT: [f32; 3] = [255.0, 226.0, 140.0];
const DARK: [f32; 3] = [38.0, 30.0, 92.0];
/// Pixels of a key.
const KEY: u32 = 128;

impl Scale {
    /// The colour of a number; clear, if it is none.
    pub(super) fn color(&self, value: f32) -> Rgba<u8> {
        if value.is_nan() {
            return Rgba([0; 4]);
        }
        let [r, g, b] = match self {
            Scale::Grey { white } => [255.0 * (value / white).clamp(0.0, 1.0).sqrt(); 3],
            Scale::Heat { white } => {
                // One channel after the other, as a body glows.
                let heat = 3.0 * (value / white).clamp(0.0, 1.0);
                std::array::from_fn(|i| 255.0 * (heat - i as f32).clamp(0.0, 1.0))
            }
            Scale::Gain { limit, .. } => {
                let share = (value / limit).clamp(-1.0, 1.0);
                let end = if share < 0.0 { LOSS } else { GAIN };
                std::array::from_fn(|i| NONE[i] + share.abs() * (end[i] - NONE[i]))
            }
            Scale::Shadow => {
                let share = value.clamp(0.0, 1.0);
                std::array::from_fn(|i| LIT[i] + share * (DARK[i] - LIT[i]))
            }
        };
        Rgba([r.round() as u8, g.round() as u8, b.round() as u8, 255])
    }

    /// The values at both ends of the key.
    fn ends(&self) -> [f32; 2] {
        match *self {
            Scale::Grey { white } | Scale::Heat { white } => [0.0, white],
            Scale::Gain { limit, .. } => [-limit, limit],
            Scale::Shadow => [0.0, 1.0],
        }
    }

    /// A strip of the colours between both ends.
    fn strip(&self) -> Raster {
        let [low, high] = self.ends();
        Raster(RgbaImage::from_fn(KEY, 1, |x, _| {
            self.color(low + (high - low) * (x as f32 + 0.5) / KEY as f32)
        }))
    }

    /// The key to the colours, as HTML.
    pub(super) fn key(&self) -> String {
        let [from, to] = self.words();
        let (from, to, strip) = (Escaped(&from), Escaped(&to), self.strip());
        format!("<span class=\"key\">{from}<img src=\"{strip}\" alt=\"to\">{to}</span>")
    }

    /// What stands at both ends of the key.
    fn words(&self) -> [String; 2] {
        match self {
            Scale::Grey { white } | Scale::Heat { white } => ["0".into(), format!("{white:.3}")],
            Scale::Gain { limit, unit } => [format!("-{limit} {unit}"), format!("+{limit} {unit}")],
            Scale::Shadow => ["nothing hidden".into(), "everything".into()],
        }
    }
}

impl Part for HeatMap {}

impl Display for HeatMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let height = (self.values.len() / self.width as usize) as u32;
        let pixels = RgbaImage::from_fn(self.width, height, |x, y| {
            self.scale.color(self.values[(y * self.width + x) as usize])
        });
        let (caption, key, pixels) = (Escaped(&self.caption), self.scale.key(), Raster(pixels));
        writeln!(
            f,
            "<figure class=\"heat\"><img src=\"{pixels}\" alt=\"{caption}\">\n\
             <figcaption>{caption}{key}</figcaption></figure>"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_tell_gain_from_loss_and_nothing_from_none() {
        let gain = Scale::Gain { limit: 2.0, unit: "stops".into() };
        let [low, none, high] = [-9.0, 0.0, f32::INFINITY].map(|value| gain.color(value).0);
        assert!(low[2] > low[0] && high[0] > high[2] && none[0].abs_diff(none[2]) < 9);
        assert_eq!(gain.color(f32::NAN).0[3], 0);
        let [lit, dark] = [0.0, 1.0].map(|value| Scale::Shadow.color(value).0);
        assert!(lit[..3].iter().zip(&dark[..3]).all(|(lit, dark)| lit > dark));
        let grey = Scale::Grey { white: 4.0 };
        let shown = [0.0, 1.0, 4.0, 5.0].map(|value| grey.color(value).0[0]);
        assert_eq!(shown, [0, 128, 255, 255]);
        let heat = Scale::Heat { white: 3.0 };
        let shown = [0.0, 1.0, 2.0, 9.0].map(|value| heat.color(value).0);
        let glow = [[0, 0, 0], [255, 0, 0], [255, 255, 0], [255, 255, 255]];
        assert!(shown.iter().zip(glow).all(|(rgba, rgb)| rgba[..3] == rgb));
    }
}
