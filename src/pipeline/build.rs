//! Building the trees of a shot.

use super::Survey;
use crate::light_tree::{ALGORITHM_VERSION, LightTreeWriter, Link};
use crate::store::AlignedBytes;

/// What a build is told besides the scene.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BuildOptions {
    /// The program and its version, for the file's `META`.
    pub program: String,
}

/// Builds the trees: one over what stands still, and one a frame over that tree and what moves.
/// The same survey gives the same bytes.
pub fn build_tree(survey: &Survey, options: &BuildOptions) -> AlignedBytes {
    let mut writer = LightTreeWriter::default();
    let fixed = writer.add_tree(&survey.fixed, |i| Link::Emitter(i as u32));
    let first_moving = survey.fixed.len() as u32;
    for (frame, moving) in &survey.moving {
        let mut bounds = moving.clone();
        bounds.extend(fixed.map(|tree| writer.bounds_of(tree)));
        let tree = writer.add_tree(&bounds, |i| match i < moving.len() {
            true => Link::Emitter(first_moving + i as u32),
            false => Link::Tree(fixed.unwrap_or_default()),
        });
        writer.add_frame(*frame, tree);
    }
    survey.lights.iter().for_each(|light| writer.add_light(light));
    let meta = serde_json::json!({
        "program": options.program,
        "algorithmVersion": ALGORITHM_VERSION,
    });
    writer.finish(&meta.to_string(), survey.fingerprint)
}
