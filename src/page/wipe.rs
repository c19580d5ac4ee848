//! Pictures of one thing, two of them under a slider.

use super::Part;
use super::escape::Escaped;
use super::raster::Raster;
use image::{DynamicImage, RgbImage};
use std::fmt::{self, Display};

/// Pictures of one size, side by side. A script lays two of them over each other, with a slider that shows
/// more of the one or of the other.
#[derive(Clone, Debug)]
pub struct Wipe {
    /// What they show.
    pub caption: String,
    /// The pictures and their names. The first and the last are laid over each other at first.
    pub pictures: Vec<(String, RgbImage)>,
}

impl Part for Wipe {}

impl Display for Wipe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("<figure class=\"wipe\">\n<div class=\"shots\">\n")?;
        for (name, picture) in &self.pictures {
            let name = Escaped(name);
            let raster = Raster(DynamicImage::from(picture.clone()).into_rgba8());
            writeln!(
                f,
                "<figure><img src=\"{raster}\" alt=\"{name}\"><figcaption>{name}</figcaption></figure>"
            )?;
        }
        writeln!(f, "</div>\n<figcaption>{}</figcaption>\n</figure>", Escaped(&self.caption))
    }
}
