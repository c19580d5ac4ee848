//! One picture, with what it took: the only place where measuring meets rendering.

use crate::light_tree::LightTree;
use crate::math::color::luminance;
use crate::render::beauty::Beauty;
use crate::render::{Progress, RenderDelegate, RenderError, RenderSettings};
use std::time::Instant;

/// A frame of a shot that is rendered again and again.
pub struct Subject<'a, 'b, D> {
    /// The shot, prepared.
    pub delegate: &'b mut RenderDelegate<'a>,
    /// Its tree.
    pub tree: &'b LightTree<D>,
    /// The frame.
    pub frame: i32,
    /// The settings that all pictures have in common.
    pub base: RenderSettings,
}

/// A picture and what it took.
pub struct Picture {
    /// The pixels, in all their digits.
    pub beauty: Beauty,
    /// Seconds from the settings to the last pixel.
    pub seconds: f64,
    /// Lights sampled for a path, in the mean.
    pub lights: f64,
    /// Samples left out because they were infinite or no number.
    pub non_finite: u64,
}

impl<D: AsRef<[u8]>> Subject<'_, '_, D> {
    /// Renders the frame.
    ///
    /// # Errors
    /// If the tree lacks the frame, the settings do not fit the scene, or `progress` stops it.
    pub fn render(
        &mut self,
        settings: RenderSettings,
        progress: &impl Progress,
    ) -> Result<Picture, RenderError> {
        let settings = RenderSettings { aovs: Vec::new(), float_beauty: true, ..settings };
        let paths = f64::from(settings.width) * f64::from(settings.height);
        let paths = paths * f64::from(settings.samples);
        let started = Instant::now();
        self.delegate.set_settings(settings);
        let frame = self.delegate.render(self.tree, self.frame, progress)?;
        Ok(Picture {
            seconds: started.elapsed().as_secs_f64(),
            beauty: Beauty::of(&frame.buffers, true),
            lights: frame.stats.trace.light_picks as f64 / paths,
            non_finite: frame.stats.non_finite,
        })
    }
}

/// The luminance of each pixel.
pub fn luminances(beauty: &Beauty) -> Vec<f64> {
    beauty.pixels.iter().map(|&color| f64::from(luminance(color))).collect()
}
