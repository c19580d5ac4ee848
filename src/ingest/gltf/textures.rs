//! Textures: images with a sampling rule, decoded when the first material uses them.

use super::document::{label, source as image_of};
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::ingest::image::{self, Coding};
use crate::scene::{Category, Texture, TextureUse, Wrap};
use glam::{Affine2, Mat2, Vec2};
use gltf::json::texture::{Info, MagFilter, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{Image, Index};
use std::borrow::Cow;
use std::collections::HashMap;

/// How a texture's image is sampled: wrapping, bilinear or not, and what its values mean.
type Rule = ([Wrap; 2], bool, Coding);

/// A number of the scene's textures, or why there is none.
type Compiled = Result<u32, String>;

/// The textures that were compiled.
#[derive(Default)]
pub(super) struct Textures {
    /// By image; few rules exist.
    compiled: HashMap<Index<Image>, Vec<(Rule, Compiled)>>,
}

impl Textures {
    /// Compiles a material's use of a texture; else says why it cannot be read, and of what.
    pub(super) fn texture_use(
        &mut self,
        source: &Source,
        output: &mut Output,
        info: &Info,
        coding: Coding,
    ) -> Result<TextureUse, String> {
        let document = source.document;
        let absent = || format!("texture {} is not in the file", info.index);
        let row = document.get(info.index).ok_or_else(absent)?;
        let image = image_of(row).ok_or_else(|| {
            let object = label("texture", info.index.value(), row.name.as_deref());
            format!("{object} has no image in a format that is read")
        })?;
        let sampler = row.sampler.and_then(|sampler| document.get(sampler));
        let wrap = sampler.map_or([Wrap::Repeat; 2], |s| [s.wrap_s, s.wrap_t].map(wrap));
        let nearest = Some(Checked::Valid(MagFilter::Nearest));
        let bilinear = sampler.and_then(|s| s.mag_filter) != nearest;
        let texture = self.texture(source, output, image, (wrap, bilinear, coding))?;
        let extensions = info.extensions.as_ref();
        let transform = extensions.and_then(|extensions| extensions.texture_transform.as_ref());
        let uv_set = transform.and_then(|transform| transform.tex_coord).unwrap_or(info.tex_coord);
        let transform = transform.map(|transform| {
            let (sin, cos) = transform.rotation.0.sin_cos();
            // v points down, so counter-clockwise is this way round.
            let rotation = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
            Affine2 {
                matrix2: rotation * Mat2::from_diagonal(transform.scale.0.into()),
                translation: transform.offset.0.into(),
            }
        });
        if transform.is_some_and(|transform| !transform.is_finite()) {
            let object = label("texture", info.index.value(), row.name.as_deref());
            let text = "has a transform that is not finite; left out";
            output.notes.add(Category::Materials, object, text);
        }
        let transform = transform.filter(Affine2::is_finite);
        Ok(TextureUse { texture, uv_set, transform })
    }

    fn texture(
        &mut self,
        source: &Source,
        output: &mut Output,
        image: Index<Image>,
        rule: Rule,
    ) -> Result<u32, String> {
        let known = self.compiled.get(&image).into_iter().flatten();
        if let Some((_, texture)) = known.into_iter().find(|(known, _)| *known == rule) {
            return texture.clone();
        }
        let texture = decode(source, output, image, rule).map_err(Fault::told);
        self.compiled.entry(image).or_default().push((rule, texture.clone()));
        texture
    }
}

fn decode(
    source: &Source,
    output: &mut Output,
    image: Index<Image>,
    (wrap, bilinear, coding): Rule,
) -> Result<u32, Fault> {
    let row = source.document.get(image);
    let row = row.ok_or_else(|| Fault::new(format!("image {image}"), "is not in the file"))?;
    let object = label("image", image.value(), row.name.as_deref());
    let bytes = bytes(source, row, &object)?;
    let picture = image::decode_surface(&bytes, coding, &object, &mut output.picture_budget)?;
    let uri = row.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
    let name = row.name.as_deref().or(uri).unwrap_or(&object).to_string();
    let (width, height, pixels) = (picture.width, picture.height, picture.pixels);
    output.scene.textures.push(Texture { name, width, height, pixels, wrap, bilinear });
    Ok(output.scene.textures.len() as u32 - 1)
}

fn bytes<'a>(source: &'a Source, row: &Image, object: &str) -> Result<Cow<'a, [u8]>, Fault> {
    let fault = |problem| Fault::new(object, problem);
    match (row.buffer_view, &row.uri) {
        (Some(view), _) => {
            source.buffers.view(source.document, view).map(Cow::Borrowed).map_err(fault)
        }
        (None, Some(uri)) => Ok(Cow::Owned(source.folder.read_uri(uri, object)?)),
        (None, None) => Err(fault("has no data".into())),
    }
}

fn wrap(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}
