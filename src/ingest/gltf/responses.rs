//! How much of lights surfaces reflect: `diffuse` and `specular` in `extras.usdLux`.

use super::Output;
use super::document::UsdLux;
use crate::ingest::error::Fault;
use crate::scene::{LightResponses, Response};
use std::collections::BTreeMap;

/// The multipliers that were read so far, by rows of the scene.
#[derive(Default)]
pub(super) struct ResponseTable {
    lights: BTreeMap<u32, Response>,
    instances: BTreeMap<u32, Response>,
}

/// The multipliers of the light at a node.
pub(super) fn of_light(lux: Option<&UsdLux>, object: &str) -> Result<Response, Fault> {
    let Some(lux) = lux else { return Ok(Response::PLAIN) };
    let [diffuse, specular] =
        [&lux.diffuse, &lux.specular].map(|own| own.as_ref().map_or(1.0, |own| own.f32()));
    if diffuse < 0.0 || specular < 0.0 {
        return Err(Fault::new(object, "extras.usdLux: diffuse or specular is negative"));
    }
    Ok(Response { diffuse, specular })
}

impl ResponseTable {
    /// Notes the multipliers of the light that is added next.
    pub(super) fn add_light(
        &mut self,
        output: &mut Output,
        response: Response,
    ) -> Result<(), Fault> {
        let row = output.scene.lights.len() as u32;
        add_row(output, &mut self.lights, row, response)
    }

    /// Notes those of the light of the instance that is added next.
    pub(super) fn add_instance(
        &mut self,
        output: &mut Output,
        response: Response,
    ) -> Result<(), Fault> {
        let row = output.scene.instances.len() as u32;
        add_row(output, &mut self.instances, row, response)
    }

    /// Gives the scene its multipliers.
    pub(super) fn finish(self, output: &mut Output) {
        output.scene.light_responses = LightResponses::new(self.lights, self.instances);
    }
}

fn add_row(
    output: &mut Output,
    table: &mut BTreeMap<u32, Response>,
    row: u32,
    response: Response,
) -> Result<(), Fault> {
    if response != Response::PLAIN {
        let bytes = 2 * size_of::<(u32, Response)>() as u64;
        output.budget.take(bytes, || "extras.usdLux: diffuse, specular".to_string())?;
        table.insert(row, response);
    }
    Ok(())
}
