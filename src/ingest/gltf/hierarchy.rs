//! Nodes, parents first, and what stands at them.

use super::document::{Real, Transform, UsdFog, UsdLux, label, usd_path};
use super::geometry::Meshes;
use super::lights::{self, Placed};
use super::{Output, Source, animation, cameras, fog, instancing};
use crate::ingest::error::Fault;
use crate::ingest::paths::{PrimPaths, component};
use crate::scene::{Channel, Instance, Light, Node, Trs};
use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::{Index, Mesh, Node as Row};

/// How far a scale may be from uniform for a sphere to stay a sphere.
const UNIFORM_TOLERANCE: f64 = 1e-4;

/// A node of the file that is to be compiled.
struct Open {
    row: usize,
    parent: Option<u32>,
    visible: bool,
}

/// What grows while the hierarchy is walked.
struct Walk<'a> {
    source: &'a Source<'a>,
    channels: Vec<Vec<Channel>>,
    meshes: Meshes,
    paths: PrimPaths,
    /// For each node of the scene, whether neither it nor an ancestor ever scales unevenly.
    uniform: Vec<bool>,
}

/// Compiles the nodes of the file's scene and everything at them.
pub(super) fn compile(source: &Source, output: &mut Output) -> Result<(), Fault> {
    let mut walk = Walk {
        source,
        channels: animation::compile(source, output)?,
        meshes: Meshes::new(source),
        paths: PrimPaths::default(),
        uniform: Vec::new(),
    };
    // A stack, so that no depth of the hierarchy is a depth of calls.
    let roots = roots(source, output)?;
    let open = |row: usize, parent, visible| Open { row, parent, visible };
    let mut stack: Vec<Open> = roots.into_iter().rev().map(|row| open(row, None, true)).collect();
    while let Some(Open { row: number, parent, visible }) = stack.pop() {
        let row = &source.document.nodes[number];
        let visible = visible && !source.document.beside.hidden.contains(&number);
        let node = walk.place(output, number, row, parent)?;
        let object = label("node", number, row.name.as_deref());
        if visible {
            walk.furnish(output, number, row, node, &object)?;
        } else if row.mesh.is_some()
            || source.document.light_at(number).is_some()
            || UsdFog::of(&row.extras, &object)?.is_some()
        {
            output.notes.add(object, "is hidden (KHR_node_visibility); left out");
        }
        let children = row.children.iter().flatten().rev();
        stack.extend(children.map(|child| open(child.value(), Some(node), visible)));
    }
    Ok(())
}

/// The roots of the default scene, whose fog it adds; else of the first, else all.
fn roots(source: &Source, output: &mut Output) -> Result<Vec<usize>, Fault> {
    let document = source.document;
    let default = document.scene.map_or(0, |scene| scene.value());
    match document.scenes.get(default) {
        Some(scene) => {
            fog::of_scene(output, default, scene)?;
            if document.scenes.len() > 1 {
                let object = format!("scene {default}");
                output.notes.add(object, "only this one of the file's scenes is read");
            }
            Ok(scene.nodes.iter().map(Index::value).collect())
        }
        None => {
            let mut is_root = vec![true; document.nodes.len()];
            for child in document.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
                is_root[child.value()] = false;
            }
            Ok((0..is_root.len()).filter(|&i| is_root[i]).collect())
        }
    }
}

impl Walk<'_> {
    /// Adds a node to the scene.
    fn place(
        &mut self,
        output: &mut Output,
        number: usize,
        row: &Row,
        parent: Option<u32>,
    ) -> Result<u32, Fault> {
        let path = match usd_path(&row.extras) {
            Some(path) => path,
            None => {
                let above = parent.map_or("", |parent| &output.scene.nodes[parent as usize].path);
                let name = row.name.as_deref().unwrap_or_default();
                format!("{above}/{}", component(name, || format!("node_{number}")))
            }
        };
        let channels = std::mem::take(&mut self.channels[number]);
        self.push(
            output,
            Node {
                path,
                parent,
                local: local(&self.source.document.beside.transforms[number]),
                channels,
            },
        )
    }

    fn push(&mut self, output: &mut Output, mut node: Node) -> Result<u32, Fault> {
        node.path = self.paths.claim(node.path);
        node.settle();
        let bytes = size_of::<Node>() + 2 * node.path.len();
        output.budget.take(bytes as u64, || "nodes".to_string())?;
        let above = node.parent.is_none_or(|parent| self.uniform[parent as usize]);
        self.uniform.push(above && node.scales_evenly(UNIFORM_TOLERANCE));
        output.scene.nodes.push(node);
        Ok(output.scene.nodes.len() as u32 - 1)
    }

    /// Adds the camera, fog, light and meshes of a node.
    fn furnish(
        &mut self,
        output: &mut Output,
        number: usize,
        row: &Row,
        node: u32,
        object: &str,
    ) -> Result<(), Fault> {
        if let Some(camera) = row.camera {
            cameras::compile(self.source, output, camera, row, node, object);
        }
        fog::of_node(output, &row.extras, node, object)?;
        let lux = UsdLux::of(&row.extras, object)?;
        let mut values = lights::values(lux.as_ref(), object)?;
        let light = lights::of_node(self.source, output, number, lux.as_ref(), node, object)?
            .map(|light| Light { values: values.take(), ..light });
        let has_light = light.is_some();
        output.scene.lights.extend(light);
        let shaping = lights::shaping(lux.as_ref(), object)?;
        let forced = lux.as_ref().is_some_and(|lux| lux.force);
        let instances = self.source.document.beside.instances.get(&number);
        let Some(mesh) = row.mesh else {
            if instances.is_some() {
                output.notes.add(object, "has instances, but no mesh; left out");
            }
            return Ok(());
        };
        let (lux, values) = (lux.as_ref(), values.as_ref());
        let visibility = lights::visibility(lux);
        let placed = Placed { lux, shaping, values, forced, visibility, has_light, object };
        let Some(instances) = instances else {
            return self.put_mesh(output, mesh, node, &placed);
        };
        for (i, local) in
            instancing::transforms(self.source, output, instances, object)?.into_iter().enumerate()
        {
            let path = format!("{}[{i}]", output.scene.nodes[node as usize].path);
            let child = self.push(output, Node::fixed(path, Some(node), local))?;
            // The light of a node is not its instances'.
            self.put_mesh(output, mesh, child, &Placed { has_light: false, ..placed })?;
        }
        Ok(())
    }

    /// Puts a mesh at a node of the scene: as a sphere light if it stands for one.
    fn put_mesh(
        &mut self,
        output: &mut Output,
        mesh: Index<Mesh>,
        node: u32,
        placed: &Placed,
    ) -> Result<(), Fault> {
        if let Some(radius) = placed.sphere_radius()? {
            let material = self.meshes.only_material(self.source, output, mesh)?;
            let material = material.map(|m| &output.scene.materials[m as usize]);
            if let Some(material) = material.filter(|_| self.uniform[node as usize])
                && material.emission_texture.is_none()
            {
                let sphere = lights::sphere(material, radius, node, placed);
                let values = placed.copy_values(output)?;
                output.scene.lights.push(Light { values, ..sphere });
                return Ok(());
            }
            output.notes.add(
                placed.object,
                "its sphere is stretched or textured; sampled as the triangles that stand for it",
            );
        }
        let compiled = self.meshes.primitives(self.source, output, mesh)?;
        let row = &self.source.document.meshes[mesh.value()];
        for (i, &mesh) in compiled.iter().enumerate() {
            let Some(mesh) = mesh else { continue };
            let above = output.scene.nodes[node as usize].path.clone();
            // A lone mesh is the node's prim; several, or one beside a light, are below it.
            let own = usd_path(&row.primitives[i].extras);
            let own = own.as_deref().and_then(|path| path.rsplit('/').next());
            let path = match own {
                Some(own) => self.paths.claim(format!("{above}/{own}")),
                None if row.primitives.len() > 1 => self.paths.claim(format!("{above}/prim_{i}")),
                None if placed.has_light => self.paths.claim(format!("{above}/mesh")),
                None => above,
            };
            let Placed { shaping, forced, visibility, .. } = *placed;
            let bytes = size_of::<Instance>() + 2 * path.len();
            output.budget.take(bytes as u64, || placed.object.to_string())?;
            let values = placed.copy_values(output)?;
            if values.is_some() && output.scene.material_of(mesh).is_none() {
                output
                    .notes
                    .add(placed.object, "its light varies, but its mesh has no material; dark");
            }
            let lit = Instance { path, node, mesh, values, shaping, forced, visibility };
            output.scene.instances.push(lit);
        }
        Ok(())
    }
}

fn local(row: &Transform) -> Trs {
    if let Some(matrix) = row.matrix {
        let columns = matrix.map(|value| value.f64());
        return Trs::Matrix(DAffine3::from_mat4(DMat4::from_cols_array(&columns)));
    }
    let vector = |values: [Real; 3]| DVec3::from(values.map(|value| value.f64()));
    let rotation = row.rotation.map(|parts| DQuat::from_array(parts.map(|part| part.f64())));
    Trs::Parts {
        translation: row.translation.map_or(DVec3::ZERO, vector),
        // Validation has seen that it has a length.
        rotation: rotation.map_or(DQuat::IDENTITY, DQuat::normalize),
        scale: row.scale.map_or(DVec3::ONE, vector),
    }
}
