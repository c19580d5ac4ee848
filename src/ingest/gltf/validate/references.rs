//! Every index leads to a row of its table.

use crate::ingest::error::Fault;
use crate::ingest::gltf::document::{Document, label};

/// A table that an index leads into.
struct Table {
    kind: &'static str,
    rows: usize,
}

impl Table {
    fn holds(&self, index: u32, object: impl FnOnce() -> String) -> Result<(), Fault> {
        if (index as usize) < self.rows {
            return Ok(());
        }
        let problem = match self.rows {
            0 => format!("refers to {} {index}, but the file has none", self.kind),
            rows => format!("refers to {} {index}, but the last is {}", self.kind, rows - 1),
        };
        Err(Fault::new(object(), problem))
    }
}

pub(super) fn check(document: &Document) -> Result<(), Fault> {
    check_storage(document)?;
    check_nodes(document)?;
    check_looks(document)?;
    check_meshes(document)?;
    check_animations(document)
}

fn check_storage(document: &Document) -> Result<(), Fault> {
    let buffers = Table { kind: "buffer", rows: document.buffers.len() };
    let views = Table { kind: "buffer view", rows: document.buffer_views.len() };
    for (i, view) in document.buffer_views.iter().enumerate() {
        let object = || label("buffer view", i, None);
        buffers.holds(view.buffer, object)?;
        let declared = document.buffers[view.buffer as usize].byte_length;
        let end = view.byte_offset.checked_add(view.byte_length);
        if view.byte_length == 0 || end.is_none_or(|end| end > declared) {
            let problem = format!("is not inside the {declared} bytes of buffer {}", view.buffer);
            return Err(Fault::new(object(), problem));
        }
        if let Some(stride) = view.byte_stride
            && !(stride % 4 == 0 && (4..=252).contains(&stride))
        {
            let problem = format!("stride {stride} is not a multiple of 4 from 4 to 252");
            return Err(Fault::new(object(), problem));
        }
        const ELEMENT_ARRAY_BUFFER: u32 = 34963;
        if view.byte_stride.is_some() && view.target == Some(ELEMENT_ARRAY_BUFFER) {
            return Err(Fault::new(object(), "holds indices and has a stride"));
        }
        if view.byte_stride.is_some_and(|stride| stride > view.byte_length) {
            return Err(Fault::new(object(), "its stride is longer than itself"));
        }
    }
    for (i, accessor) in document.accessors.iter().enumerate() {
        let sparse = accessor.sparse.as_ref();
        let sparse = sparse.map(|sparse| [sparse.indices.buffer_view, sparse.values.buffer_view]);
        for view in accessor.buffer_view.into_iter().chain(sparse.into_iter().flatten()) {
            views.holds(view, || label("accessor", i, accessor.name.as_deref()))?;
        }
    }
    for (i, image) in document.images.iter().enumerate() {
        let object = || label("image", i, image.name.as_deref());
        match (image.buffer_view, &image.uri) {
            (Some(view), None) => {
                views.holds(view, object)?;
                if image.mime_type.is_none() {
                    return Err(Fault::new(object(), "is in a buffer view but has no mimeType"));
                }
                if document.buffer_views[view as usize].byte_stride.is_some() {
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
    let nodes = Table { kind: "node", rows: document.nodes.len() };
    let meshes = Table { kind: "mesh", rows: document.meshes.len() };
    let cameras = Table { kind: "camera", rows: document.cameras.len() };
    let skins = Table { kind: "skin", rows: document.skins.len() };
    let lights = Table { kind: "light", rows: document.lights.len() };
    let accessors = Table { kind: "accessor", rows: document.accessors.len() };
    for (i, node) in document.nodes.iter().enumerate() {
        let object = || label("node", i, node.name.as_deref());
        node.children.iter().try_for_each(|&child| nodes.holds(child, object))?;
        node.mesh.map_or(Ok(()), |mesh| meshes.holds(mesh, object))?;
        node.camera.map_or(Ok(()), |camera| cameras.holds(camera, object))?;
        node.skin.map_or(Ok(()), |skin| skins.holds(skin, object))?;
        let extensions = &node.extensions;
        extensions.light.as_ref().map_or(Ok(()), |light| lights.holds(light.light, object))?;
        for &accessor in extensions.instancing.iter().flat_map(|i| i.attributes.values()) {
            accessors.holds(accessor, object)?;
        }
    }
    let scenes = Table { kind: "scene", rows: document.scenes.len() };
    document.scene.map_or(Ok(()), |scene| scenes.holds(scene, || "scene".into()))?;
    for (i, scene) in document.scenes.iter().enumerate() {
        for &node in &scene.nodes {
            nodes.holds(node, || label("scene", i, scene.name.as_deref()))?;
        }
    }
    for (i, skin) in document.skins.iter().enumerate() {
        for &joint in skin.joints.iter().chain(&skin.skeleton) {
            nodes.holds(joint, || label("skin", i, None))?;
        }
        let matrices = skin.inverse_bind_matrices;
        matrices.map_or(Ok(()), |matrices| accessors.holds(matrices, || label("skin", i, None)))?;
    }
    Ok(())
}

fn check_looks(document: &Document) -> Result<(), Fault> {
    let textures = Table { kind: "texture", rows: document.textures.len() };
    let images = Table { kind: "image", rows: document.images.len() };
    let samplers = Table { kind: "sampler", rows: document.samplers.len() };
    for (i, material) in document.materials.iter().enumerate() {
        for usage in material.texture_uses() {
            textures.holds(usage.index, || label("material", i, material.name.as_deref()))?;
            // A texture that no material uses may lead nowhere, as real exporters leave them.
            let texture = &document.textures[usage.index as usize];
            let object = || label("texture", usage.index as usize, texture.name.as_deref());
            texture.source.map_or(Ok(()), |source| images.holds(source, object))?;
        }
    }
    for (i, texture) in document.textures.iter().enumerate() {
        let object = || label("texture", i, texture.name.as_deref());
        texture.sampler.map_or(Ok(()), |sampler| samplers.holds(sampler, object))?;
    }
    Ok(())
}

fn check_meshes(document: &Document) -> Result<(), Fault> {
    let accessors = Table { kind: "accessor", rows: document.accessors.len() };
    let materials = Table { kind: "material", rows: document.materials.len() };
    for (i, mesh) in document.meshes.iter().enumerate() {
        let object = || label("mesh", i, mesh.name.as_deref());
        for primitive in &mesh.primitives {
            let targets = primitive.targets.iter().flat_map(|target| target.values());
            let all = primitive.attributes.values().chain(&primitive.indices).chain(targets);
            for &accessor in all {
                accessors.holds(accessor, object)?;
            }
            primitive.material.map_or(Ok(()), |material| materials.holds(material, object))?;
        }
    }
    Ok(())
}

fn check_animations(document: &Document) -> Result<(), Fault> {
    let accessors = Table { kind: "accessor", rows: document.accessors.len() };
    let nodes = Table { kind: "node", rows: document.nodes.len() };
    for (i, animation) in document.animations.iter().enumerate() {
        let object = || label("animation", i, animation.name.as_deref());
        let samplers = Table { kind: "sampler", rows: animation.samplers.len() };
        for channel in &animation.channels {
            samplers.holds(channel.sampler, object)?;
            channel.target.node.map_or(Ok(()), |node| nodes.holds(node, object))?;
        }
        for sampler in &animation.samplers {
            accessors.holds(sampler.input, object)?;
            accessors.holds(sampler.output, object)?;
        }
    }
    Ok(())
}
