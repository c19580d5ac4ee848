//! Every index leads to a row of its table.

use crate::ingest::error::Fault;
use crate::ingest::gltf::document::{Document, label, source};
use gltf::json::buffer::Target;
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

/// Checks that a row refers to a row of a kind.
fn holds<T>(
    document: &Document,
    kind: &str,
    index: Index<T>,
    object: impl FnOnce() -> String,
) -> Result<(), Fault>
where
    Root: AsRef<[T]>,
{
    let rows: &[T] = document.as_ref();
    leads_into(rows, kind, index, object)
}

/// The same of a table inside a row.
fn leads_into<T>(
    rows: &[T],
    kind: &str,
    index: Index<T>,
    object: impl FnOnce() -> String,
) -> Result<(), Fault> {
    if index.value() < rows.len() {
        return Ok(());
    }
    let problem = match rows.len() {
        0 => format!("refers to {kind} {index}, but the file has none"),
        rows => format!("refers to {kind} {index}, but the last is {}", rows - 1),
    };
    Err(Fault::new(object(), problem))
}

pub(super) fn check(document: &Document) -> Result<(), Fault> {
    check_storage(document)?;
    check_nodes(document)?;
    check_looks(document)?;
    check_meshes(document)?;
    check_animations(document)
}

fn check_storage(document: &Document) -> Result<(), Fault> {
    for (i, view) in document.buffer_views.iter().enumerate() {
        let object = || label("buffer view", i, None);
        holds(document, "buffer", view.buffer, object)?;
        let declared = document.buffers[view.buffer.value()].byte_length.0;
        let length = view.byte_length.0;
        let end = view.byte_offset.unwrap_or_default().0.checked_add(length);
        if length == 0 || end.is_none_or(|end| end > declared) {
            let problem = format!("is not inside the {declared} bytes of buffer {}", view.buffer);
            return Err(Fault::new(object(), problem));
        }
        let Some(stride) = view.byte_stride.map(|stride| stride.0) else { continue };
        if !(stride.is_multiple_of(4) && (4..=252).contains(&stride)) {
            let problem = format!("stride {stride} is not a multiple of 4 from 4 to 252");
            return Err(Fault::new(object(), problem));
        }
        if view.target == Some(Checked::Valid(Target::ElementArrayBuffer)) {
            return Err(Fault::new(object(), "holds indices and has a stride"));
        }
        if stride as u64 > length {
            return Err(Fault::new(object(), "its stride is longer than itself"));
        }
    }
    for (i, accessor) in document.accessors.iter().enumerate() {
        let sparse = accessor.sparse.as_ref();
        let sparse = sparse.map(|sparse| [sparse.indices.buffer_view, sparse.values.buffer_view]);
        for view in accessor.buffer_view.into_iter().chain(sparse.into_iter().flatten()) {
            holds(document, "buffer view", view, || {
                label("accessor", i, accessor.name.as_deref())
            })?;
        }
    }
    for (i, image) in document.images.iter().enumerate() {
        let object = || label("image", i, image.name.as_deref());
        match (image.buffer_view, &image.uri) {
            (Some(view), None) => {
                holds(document, "buffer view", view, object)?;
                if image.mime_type.is_none() {
                    return Err(Fault::new(object(), "is in a buffer view but has no mimeType"));
                }
                if document.buffer_views[view.value()].byte_stride.is_some() {
                    return Err(Fault::new(object(), "its buffer view has a stride"));
                }
            }
            (None, Some(_)) => {}
            _ => return Err(Fault::new(object(), "needs either a URI or a buffer view")),
        }
    }
    Ok(())
}

fn check_nodes(document: &Document) -> Result<(), Fault> {
    for (i, node) in document.nodes.iter().enumerate() {
        let object = || label("node", i, node.name.as_deref());
        for &child in node.children.iter().flatten() {
            holds(document, "node", child, object)?;
        }
        node.mesh.map_or(Ok(()), |mesh| holds(document, "mesh", mesh, object))?;
        node.camera.map_or(Ok(()), |camera| holds(document, "camera", camera, object))?;
        node.skin.map_or(Ok(()), |skin| holds(document, "skin", skin, object))?;
        document.light_at(i).map_or(Ok(()), |light| holds(document, "light", light, object))?;
        for &accessor in
            document.beside.instances.get(&i).iter().flat_map(|i| i.attributes.values())
        {
            holds(document, "accessor", accessor, object)?;
        }
    }
    document.scene.map_or(Ok(()), |scene| holds(document, "scene", scene, || "scene".into()))?;
    for (i, scene) in document.scenes.iter().enumerate() {
        for &node in &scene.nodes {
            holds(document, "node", node, || label("scene", i, scene.name.as_deref()))?;
        }
    }
    for (i, skin) in document.skins.iter().enumerate() {
        let object = || label("skin", i, None);
        for &joint in skin.joints.iter().chain(&skin.skeleton) {
            holds(document, "node", joint, object)?;
        }
        let matrices = skin.inverse_bind_matrices;
        matrices.map_or(Ok(()), |matrices| holds(document, "accessor", matrices, object))?;
    }
    Ok(())
}

fn check_looks(document: &Document) -> Result<(), Fault> {
    for (i, material) in document.materials.iter().enumerate() {
        let occlusion = material.occlusion_texture.as_ref().map(|usage| usage.index);
        for index in document.texture_uses(i).map(|usage| usage.index).chain(occlusion) {
            let object = || label("material", i, material.name.as_deref());
            holds(document, "texture", index, object)?;
            // A texture that no material uses may lead nowhere, as real exporters leave them.
            let texture = &document.textures[index.value()];
            let object = || label("texture", index.value(), texture.name.as_deref());
            source(texture).map_or(Ok(()), |source| holds(document, "image", source, object))?;
        }
    }
    for (i, texture) in document.textures.iter().enumerate() {
        let object = || label("texture", i, texture.name.as_deref());
        texture.sampler.map_or(Ok(()), |sampler| holds(document, "sampler", sampler, object))?;
    }
    Ok(())
}

fn check_meshes(document: &Document) -> Result<(), Fault> {
    for (i, mesh) in document.meshes.iter().enumerate() {
        let object = || label("mesh", i, mesh.name.as_deref());
        for primitive in &mesh.primitives {
            for &accessor in primitive.attributes.values().chain(&primitive.indices) {
                holds(document, "accessor", accessor, object)?;
            }
            let material = primitive.material;
            material.map_or(Ok(()), |material| holds(document, "material", material, object))?;
        }
    }
    Ok(())
}

fn check_animations(document: &Document) -> Result<(), Fault> {
    for (i, animation) in document.animations.iter().enumerate() {
        let object = || label("animation", i, animation.name.as_deref());
        for channel in &document.beside.channels[i] {
            leads_into(&animation.samplers, "sampler", channel.sampler, object)?;
            let node = channel.target.node;
            node.map_or(Ok(()), |node| holds(document, "node", node, object))?;
        }
        for sampler in &animation.samplers {
            holds(document, "accessor", sampler.input, object)?;
            holds(document, "accessor", sampler.output, object)?;
        }
    }
    Ok(())
}
