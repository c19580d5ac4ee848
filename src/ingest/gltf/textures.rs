//! Textures: images with a sampling rule, decoded when the first material uses them.

use super::document::{label, source as image_of};
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::ingest::image::{self, Coding};
use crate::scene::{Texture, TextureUse, Wrap};
use glam::{Affine2, Mat2, Vec2};
use gltf::json::texture::{Info, MagFilter, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{Image, Index};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

/// How a texture's image is sampled: wrapping, bilinear or not, and what its values mean.
type Rule = ([Wrap; 2], bool, Coding);

/// The textures that were compiled.
#[derive(Default)]
pub(super) struct Textures {
    /// By image; few rules exist.
    compiled: HashMap<Index<Image>, Vec<(Rule, u32)>>,
    /// Images that cannot be read and were noted.
    unread: HashSet<Index<Image>>,
}

/// Every image leads to something inside the scene's folder, whether it is used or not.
pub(super) fn check_references(source: &Source) -> Result<(), Fault> {
    for (i, row) in source.document.images.iter().enumerate() {
        let object = label("image", i, row.name.as_deref());
        match &row.uri {
            Some(uri) if uri.starts_with("data:") => drop(source.folder.read_uri(uri, &object)?),
            Some(uri) => drop(source.folder.resolve_uri(uri, &object)?),
            None => {}
        }
    }
    Ok(())
}

impl Textures {
    /// Compiles a material's use of a texture; `None` if its image is not read.
    pub(super) fn texture_use(
        &mut self,
        source: &Source,
        output: &mut Output,
        info: &Info,
        coding: Coding,
    ) -> Result<Option<TextureUse>, Fault> {
        let row = &source.document.textures[info.index.value()];
        let Some(image) = image_of(row) else {
            let object = label("texture", info.index.value(), row.name.as_deref());
            output.notes.add(object, "has no image that can be read; drawn without");
            return Ok(None);
        };
        let sampler = row.sampler.map(|sampler| &source.document.samplers[sampler.value()]);
        let wrap = sampler.map_or([Wrap::Repeat; 2], |s| [s.wrap_s, s.wrap_t].map(wrap));
        let nearest = Some(Checked::Valid(MagFilter::Nearest));
        let bilinear = sampler.and_then(|s| s.mag_filter) != nearest;
        let Some(texture) = self.texture(source, output, image, (wrap, bilinear, coding))? else {
            return Ok(None);
        };
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
        Ok(Some(TextureUse { texture, uv_set, transform }))
    }

    fn texture(
        &mut self,
        source: &Source,
        output: &mut Output,
        image: Index<Image>,
        rule: Rule,
    ) -> Result<Option<u32>, Fault> {
        let known = self.compiled.get(&image).into_iter().flatten();
        if let Some((_, texture)) = known.into_iter().find(|(known, _)| *known == rule) {
            return Ok(Some(*texture));
        }
        if self.unread.contains(&image) {
            return Ok(None);
        }
        let row = &source.document.images[image.value()];
        let object = label("image", image.value(), row.name.as_deref());
        let bytes = bytes(source, row, &object)?;
        if !image::is_surface_format(&bytes) {
            output.notes.add(object, "is neither PNG nor JPEG; drawn without");
            self.unread.insert(image);
            return Ok(None);
        }
        let (wrap, bilinear, coding) = rule;
        let picture = image::decode(&bytes, coding, &object, &mut output.picture_budget)?;
        let uri = row.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
        let name = row.name.as_deref().or(uri).unwrap_or(&object).to_string();
        let (width, height, pixels) = (picture.width, picture.height, picture.pixels);
        output.scene.textures.push(Texture { name, width, height, pixels, wrap, bilinear });
        let texture = output.scene.textures.len() as u32 - 1;
        self.compiled.entry(image).or_default().push((rule, texture));
        Ok(Some(texture))
    }
}

fn bytes<'a>(source: &'a Source, row: &Image, object: &str) -> Result<Cow<'a, [u8]>, Fault> {
    match (row.buffer_view, &row.uri) {
        (Some(view), _) => Ok(Cow::Borrowed(source.buffers.view(source.document, view, object)?)),
        (None, Some(uri)) => Ok(Cow::Owned(source.folder.read_uri(uri, object)?)),
        (None, None) => Err(Fault::new(object, "has no data")),
    }
}

fn wrap(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}
