//! What is kept of each frame of a shot: settled once, from the settings and the scene.

use super::crop::{CropError, Window};
use super::cryptomatte::ObjectIds;
use super::layers::{Aov, Layer, layers_of};
use super::light_groups::{LightGroupError, LightGroups};
use super::settings::RenderSettings;
use crate::emitter::Emitters;
use crate::scene::Scene;
use thiserror::Error;

/// What is to be kept of each frame.
pub(super) struct Plan {
    pub window: Window,
    pub layers: Vec<Layer>,
    pub groups: Option<LightGroups>,
    pub ids: Option<ObjectIds>,
}

/// Settings that do not fit the picture or the scene.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PlanError {
    /// A crop that is not in the picture.
    #[error(transparent)]
    Crop(#[from] CropError),
    /// Lights cannot be grouped.
    #[error(transparent)]
    LightGroups(#[from] LightGroupError),
}

impl Plan {
    pub fn new(
        scene: &Scene,
        emitters: &Emitters,
        settings: &RenderSettings,
    ) -> Result<Plan, PlanError> {
        let asks = |aov| settings.aovs.contains(&aov);
        let groups = asks(Aov::LightGroups)
            .then(|| LightGroups::new(scene, emitters, &settings.light_groups))
            .transpose()?;
        let names = groups.as_ref().map_or(&[][..], LightGroups::names);
        Ok(Plan {
            window: settings.window()?,
            layers: layers_of(&settings.aovs, settings.float_beauty, names),
            ids: asks(Aov::Cryptomatte).then(|| ObjectIds::new(scene)),
            groups,
        })
    }
}

impl RenderSettings {
    /// Whether crop and light groups fit the picture and the scene: what rendering would say, before any
    /// work.
    ///
    /// # Errors
    /// If they do not.
    pub fn check(&self, scene: &Scene, emitters: &Emitters) -> Result<(), PlanError> {
        Plan::new(scene, emitters, self).map(drop)
    }
}
