//! One picture, with what it took: the only place where measuring meets rendering.

use crate::light_tree::LightTree;
use crate::math::color::luminance;
use crate::render::beauty::Beauty;
use crate::render::passes::{Control, ErrorGoal, ToError, Uniform};
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
    /// Samples of a pixel, in the mean.
    pub samples: f64,
    /// Lights sampled for a path, in the mean.
    pub lights: f64,
    /// Samples left out because they were infinite or no number.
    pub non_finite: u64,
}

impl<D: AsRef<[u8]>> Subject<'_, '_, D> {
    /// Renders the frame: to a goal, or without one with the samples of the settings in every pixel.
    ///
    /// # Errors
    /// If the tree lacks the frame, the settings do not fit the scene, or `progress` stops it.
    pub fn render(
        &mut self,
        settings: RenderSettings,
        goal: Option<ErrorGoal>,
        progress: &impl Progress,
    ) -> Result<Picture, RenderError> {
        let settings = RenderSettings { aovs: Vec::new(), float_beauty: true, ..settings };
        let mut even = Uniform(settings.samples);
        let mut to_error = goal.map(ToError::new);
        let control: &mut dyn Control = match &mut to_error {
            Some(control) => control,
            None => &mut even,
        };
        let started = Instant::now();
        self.delegate.set_settings(settings);
        let mut film = self.delegate.film(self.frame)?;
        let frame = self.delegate.expose(self.tree, self.frame, &mut film, control, progress)?;
        Ok(Picture {
            seconds: started.elapsed().as_secs_f64(),
            beauty: Beauty::of(&frame.buffers, true),
            samples: film.samples() as f64 / film.taken().len() as f64,
            lights: frame.stats.trace.light_picks as f64 / film.samples().max(1) as f64,
            non_finite: frame.stats.non_finite,
        })
    }
}

/// The luminance of each pixel.
pub fn luminances(beauty: &Beauty) -> Vec<f64> {
    beauty.pixels.iter().map(|&color| f64::from(luminance(color))).collect()
}
