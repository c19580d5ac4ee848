//! Nodes, parents first, and what stands at them.

use super::animation::{self, Animated, Channels};
use super::cones::{self, Form};
use super::document::{Node as Row, Real, Transform, UsdFog, UsdLux, label, usd_path};
use super::filters::FilterTable;
use super::geometry::{Compiled, Meshes};
use super::lights::{self, Placed};
use super::links::LinkTable;
use super::posing::{Hung, Pose, Poses};
use super::profiles::Profiles;
use super::responses::{self, ResponseTable};
use super::{Output, Source, cameras, fog, instancing};
use crate::ingest::error::Fault;
use crate::ingest::paths::{PrimPaths, component};
use crate::math::color::Rgb;
use crate::scene::{
    Category, Channel, Instance, Keys, LensKeys, Light, Links, Node, Response, Trs,
};
use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::{Index, Mesh};
use std::collections::{BTreeMap, HashMap};
use std::mem;
use std::sync::Arc;

/// How far a scale may be from uniform for a sphere to stay a sphere.
const UNIFORM_TOLERANCE: f64 = 1e-4;

/// How far the length of a rotation's quaternion may be from one without a note.
const QUATERNION_TOLERANCE: f64 = 0.01;

/// How far the last row of a matrix may be from (0, 0, 0, 1) without a note.
const AFFINE_TOLERANCE: f64 = 1e-6;

/// A node of the file that is to be compiled.
struct Open {
    row: usize,
    parent: Option<u32>,
    visible: bool,
}

/// An instance that is to hang elsewhere than at the node where it stands.
struct Hanging {
    instance: u32,
    hung: Hung,
}

/// What grows while the hierarchy is walked.
struct Walk<'a> {
    source: &'a Source<'a>,
    channels: Channels,
    /// By camera of the file.
    lenses: BTreeMap<usize, Arc<LensKeys>>,
    /// By light of the file.
    strengths: BTreeMap<usize, Keys<Rgb>>,
    /// By light of the file.
    forms: BTreeMap<usize, Form>,
    /// For each node of the file where it was placed first.
    placed: Vec<Option<u32>>,
    meshes: Meshes,
    poses: Poses,
    /// Instances of skinned meshes, which stand at their nodes until all nodes are placed.
    hanging: Vec<Hanging>,
    paths: PrimPaths,
    links: LinkTable,
    filters: FilterTable,
    responses: ResponseTable,
    profiles: Profiles,
    /// For each node of the scene, whether neither it nor an ancestor ever scales unevenly.
    uniform: Vec<bool>,
}

/// Compiles the nodes of the file's scene and everything at them.
pub(super) fn compile(source: &Source, output: &mut Output) -> Result<(), Fault> {
    let Animated { channels, weights, lenses, strengths, glows, forms } =
        animation::compile(source, output)?;
    let mut walk = Walk {
        source,
        poses: Poses::new(source, output, &channels, weights)?,
        channels,
        lenses,
        strengths,
        forms,
        hanging: Vec::new(),
        placed: vec![None; source.document.nodes.len()],
        meshes: Meshes::new(source, glows),
        paths: PrimPaths::with_room(source.document.nodes.len()),
        links: LinkTable::default(),
        filters: FilterTable::default(),
        responses: ResponseTable::default(),
        profiles: Profiles::default(),
        uniform: Vec::new(),
    };
    let rows = &source.document.nodes;
    output.scene.nodes.reserve_exact(rows.len());
    output.scene.lights.reserve_exact(rows.iter().filter(|row| row.light.is_some()).count());
    // A stack, so that no depth of the hierarchy is a depth of calls.
    if let Some((number, scene)) = source.document.default_scene() {
        fog::of_scene(output, number, scene)?;
    }
    let open = |row: usize, parent, visible| Open { row, parent, visible };
    let roots = source.forest.roots.iter().rev();
    let mut stack: Vec<Open> = roots.map(|&row| open(row, None, true)).collect();
    while let Some(Open { row: number, parent, visible }) = stack.pop() {
        let row = &source.document.nodes[number];
        let visible = visible && !source.document.beside.hidden.contains(&number);
        let node = walk.place(output, number, row, parent)?;
        let object = label("node", number, row.name.as_deref());
        if let Some(camera) = row.camera() {
            let camera = (camera, walk.lenses.get(&camera.value()));
            cameras::compile(source, output, camera, row, (node, !visible), &object)?;
        }
        if visible {
            walk.furnish(output, number, row, node, &object)?;
        } else if row.mesh.is_some()
            || row.light.is_some()
            || UsdFog::of(&row.extras, &object)?.is_some()
        {
            // The file says that it is not to be seen: nothing is lost.
            output.notes.add(Category::Other, object, "is hidden (KHR_node_visibility); left out");
        }
        let children = source.forest.children(number).rev();
        stack.extend(children.map(|child| open(child, Some(node), visible)));
    }
    walk.hang(output)?;
    mem::take(&mut walk.filters).finish(output);
    mem::take(&mut walk.responses).finish(output);
    walk.links.finish(output)
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
        let object = || label("node", number, row.name.as_deref());
        let channels = match self.placed[number] {
            None => self.channels.remove(&number).unwrap_or_default(),
            // Below another parent it moves alike.
            Some(first) => {
                let channels = &output.scene.nodes[first as usize].channels;
                let keys = channels.iter().map(animation::byte_length).sum();
                output.budget.take(keys, object)?;
                channels.clone()
            }
        };
        let local = local(&row.transform, |text| {
            output.notes.add(Category::Geometry, object(), text);
        });
        let node = self.push(output, &path, parent, (local, channels))?;
        self.placed[number].get_or_insert(node);
        Ok(node)
    }

    fn push(
        &mut self,
        output: &mut Output,
        path: &str,
        parent: Option<u32>,
        (local, channels): (Trs, Vec<Channel>),
    ) -> Result<u32, Fault> {
        let mut node = Node { path: self.paths.claim(path), parent, local, channels };
        node.settle();
        let bytes = size_of::<Node>() + 2 * node.path.len();
        output.budget.take(bytes as u64, || "nodes".to_string())?;
        let above = node.parent.is_none_or(|parent| self.uniform[parent as usize]);
        self.uniform.push(above && node.scales_evenly(UNIFORM_TOLERANCE));
        output.scene.nodes.push(node);
        Ok(output.scene.nodes.len() as u32 - 1)
    }

    /// Adds the fog, light and meshes of a node.
    fn furnish(
        &mut self,
        output: &mut Output,
        number: usize,
        row: &Row,
        node: u32,
        object: &str,
    ) -> Result<(), Fault> {
        let membership = self.links.membership(output, &row.extras, None, object)?;
        let had_fog = output.scene.medium.is_some();
        fog::of_node(output, &row.extras, node, object)?;
        if !had_fog && output.scene.medium.is_some() {
            self.links.set_medium(membership);
        }
        self.filters.add(output, &mut self.links, &row.extras, node, object)?;
        let lux = UsdLux::of(&row.extras, object)?;
        let filters = self.filters.of_light(output, lux.as_ref(), object)?;
        let response = responses::of_light(lux.as_ref(), object)?;
        let links = Links { membership, ..self.links.of_light(lux.as_ref(), object)? };
        if let Some(group) = lux.as_ref().and_then(|lux| lux.group.as_ref()) {
            let bytes = size_of::<(u32, String)>() + group.len();
            output.budget.take(bytes as u64, || object.to_string())?;
            output.scene.light_groups.insert(node, group.clone());
        }
        let mut values = lights::values(lux.as_ref(), object)?;
        let shaping = self.profiles.shaping(self.source, output, lux.as_ref(), object)?;
        let told = (lux.as_ref(), shaping);
        let of_file = (number, &self.forms);
        let mut light = lights::of_node(self.source, output, of_file, told, node, object)?
            .map(|light| Light { values: values.take().map(Box::new), ..light });
        if let Some(light) = &mut light {
            lights::animate(self.source, output, number, light, &self.strengths)?;
        }
        let has_light = light.is_some();
        if let Some(light) = light {
            self.put_light(output, number, light, (links, filters, response))?;
        }
        let forced = lux.as_ref().is_some_and(|lux| lux.force);
        let document = self.source.document;
        let instances = document.beside.instances.get(&number);
        let Some(mesh) = row.mesh else {
            if instances.is_some() {
                let text = "has instances, but no mesh; left out";
                output.notes.add(Category::Geometry, object, text);
            }
            return Ok(());
        };
        if document.get(mesh).is_none() {
            // Whether it would emit is not known.
            let text = "its mesh is not in the file; left out";
            output.notes.add(Category::Lights, object, text);
            return Ok(());
        }
        let (lux, values) = (lux.as_ref(), values.as_ref());
        let visibility = lights::visibility(lux);
        let placed = Placed {
            lux,
            shaping,
            values,
            forced,
            visibility,
            links,
            filters,
            response,
            has_light,
            object,
        };
        let pose = self.poses.of(self.source, output, (number, row), mesh)?;
        let Some(instances) = instances else {
            if pose.is_skinned() && self.placed[number] != Some(node) {
                let text = "is skinned; it is drawn once, where its joints are";
                output.notes.add(Category::Animation, object, text);
                return Ok(());
            }
            return self.put_mesh(output, mesh, node, &placed, &pose);
        };
        if pose.is_skinned() {
            let text = "is skinned and has instances; they are drawn in its rest pose";
            output.notes.add(Category::Animation, object, text);
        }
        let pose = pose.without_skin();
        let locals = match instancing::transforms(self.source, output, instances, object)? {
            Ok(locals) => locals,
            Err(problem) => {
                let category = self.meshes.category(self.source, mesh);
                let text = format!("its instances cannot be read ({problem}); left out");
                output.notes.add(category, object, text);
                return Ok(());
            }
        };
        for (i, local) in locals.into_iter().enumerate() {
            let path = format!("{}[{i}]", output.scene.nodes[node as usize].path);
            let child = self.push(output, &path, Some(node), (local, Vec::new()))?;
            // The light of a node is not its instances'.
            let placed = Placed { has_light: false, ..placed };
            self.put_mesh(output, mesh, child, &placed, &pose)?;
        }
        Ok(())
    }

    /// Puts a light at its node: as many as it has cones and ranges over time, all but the first at nodes of their own.
    fn put_light(
        &mut self,
        output: &mut Output,
        number: usize,
        light: Light,
        (links, filters, response): (Links, Option<u32>, Response),
    ) -> Result<(), Fault> {
        let above = light.node;
        let parts = cones::split(self.source, output, number, light, &self.forms)?;
        for (i, (frame, light)) in parts.into_iter().enumerate() {
            let node = match i {
                0 => above,
                _ => {
                    let path =
                        format!("{}[shaping {frame}]", output.scene.nodes[above as usize].path);
                    self.push(output, &path, Some(above), (Trs::default(), Vec::new()))?
                }
            };
            self.links.add_light(output, links)?;
            self.filters.add_light(output, filters)?;
            self.responses.add_light(output, response)?;
            output.scene.lights.push(Light { node, ..light });
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
        pose: &Pose,
    ) -> Result<(), Fault> {
        if let Some(radius) = placed.sphere_radius()? {
            let material = self.meshes.only_material(self.source, output, mesh);
            let material = material.map(|m| &output.scene.materials[m as usize]);
            if let Some(material) = material.filter(|_| self.uniform[node as usize])
                && material.emission_texture.is_none()
            {
                let sphere = lights::sphere(material, radius, node, placed);
                let primitives = &self.source.document.meshes[mesh.value()].primitives;
                let glow = primitives.first().and_then(|first| self.meshes.glow(first));
                let values = placed.copy_values(output, glow)?;
                self.links.add_light(output, placed.links)?;
                self.filters.add_light(output, placed.filters)?;
                self.responses.add_light(output, placed.response)?;
                output.scene.lights.push(Light { values, ..sphere });
                return Ok(());
            }
            let text =
                "its sphere is stretched or textured; sampled as the triangles that stand for it";
            output.notes.add(Category::Lights, placed.object, text);
        }
        let pose = (&self.poses, pose);
        let compiled = self.meshes.primitives(self.source, output, mesh, pose)?;
        let mesh_number = mesh.value();
        let row = &self.source.document.meshes[mesh_number];
        for (i, compiled) in compiled.iter().enumerate() {
            let Some(Compiled { mesh, hung }) = *compiled else { continue };
            let above = output.scene.nodes[node as usize].path.clone();
            // A lone mesh is the node's prim; several, or one beside a light, are below it.
            let own = usd_path(&row.primitives[i].extras);
            let own = own.as_deref().and_then(|path| path.rsplit('/').next());
            let path = match own {
                Some(own) => self.paths.claim(&format!("{above}/{own}")),
                None if row.primitives.len() > 1 => self.paths.claim(&format!("{above}/prim_{i}")),
                None if placed.has_light => self.paths.claim(&format!("{above}/mesh")),
                None => above,
            };
            let Placed { shaping, forced, visibility, links, .. } = *placed;
            let bytes = size_of::<Instance>() + 2 * path.len();
            output.budget.take(bytes as u64, || placed.object.to_string())?;
            let values = placed.copy_values(output, self.meshes.glow(&row.primitives[i]))?;
            if values.is_some() && output.scene.material_of(mesh).is_none() {
                let text = "its light varies, but its mesh has no material; dark";
                output.notes.add(Category::Lights, placed.object, text);
            }
            let primitive = ([mesh_number, i], &row.primitives[i].extras);
            let above = links.membership;
            let membership = self.links.of_primitive(output, primitive, above, placed.object)?;
            self.links.add_instance(output, Links { membership, ..links })?;
            self.filters.add_instance(output, placed.filters)?;
            self.responses.add_instance(output, placed.response)?;
            if let Some(hung) = hung {
                let bytes = size_of::<Hanging>() as u64;
                output.budget.take(bytes, || placed.object.to_string())?;
                let instance = output.scene.instances.len() as u32;
                self.hanging.push(Hanging { instance, hung });
            }
            let lit = Instance { path, node, mesh, values, shaping, forced, visibility };
            output.scene.instances.push(lit);
        }
        Ok(())
    }

    /// Hangs skinned meshes where their joints say, at nodes of their own.
    fn hang(&mut self, output: &mut Output) -> Result<(), Fault> {
        let mut known = HashMap::new();
        for Hanging { instance, hung } in mem::take(&mut self.hanging) {
            let from = output.scene.instances[instance as usize].node;
            let key = (from, hung.below);
            let node = match known.get(&key) {
                Some(&node) => node,
                None => {
                    let path = format!("{}/posed", output.scene.nodes[from as usize].path);
                    let parent = hung.below.and_then(|row| self.placed[row]);
                    let still = (Trs::default(), Vec::new());
                    let node = self.push(output, &path, parent, still)?;
                    keep_group(output, from, node)?;
                    *known.entry(key).or_insert(node)
                }
            };
            output.scene.instances[instance as usize].node = node;
        }
        Ok(())
    }
}

/// Puts a node into the light group of another, if that is in one.
fn keep_group(output: &mut Output, of: u32, node: u32) -> Result<(), Fault> {
    let scene = &mut output.scene;
    let mut above = std::iter::successors(Some(of), |&node| scene.nodes[node as usize].parent);
    if let Some(group) = above.find_map(|node| scene.light_groups.get(&node)).cloned() {
        let bytes = size_of::<(u32, String)>() + group.len();
        output.budget.take(bytes as u64, || scene.nodes[node as usize].path.to_string())?;
        scene.light_groups.insert(node, group);
    }
    Ok(())
}

/// The transform of a node. Whatever it says can be composed; what had to be mended is noted.
pub(super) fn local(row: &Transform, mut note: impl FnMut(&'static str)) -> Trs {
    if let Some(matrix) = row.matrix.as_deref() {
        let columns = matrix.map(|value| value.f64());
        let last_row = [columns[3], columns[7], columns[11], columns[15] - 1.0];
        if last_row.iter().any(|part| part.abs() > AFFINE_TOLERANCE) {
            note("its matrix is not affine; its last row is taken for 0 0 0 1");
        }
        if row.translation.is_some() || row.rotation.is_some() || row.scale.is_some() {
            note("has a matrix beside translation, rotation or scale; the matrix counts");
        }
        return Trs::Matrix(DAffine3::from_mat4(DMat4::from_cols_array(&columns)));
    }
    let vector = |values: [Real; 3]| DVec3::from(values.map(|value| value.f64()));
    let rotation =
        row.rotation.as_deref().map(|parts| DQuat::from_array(parts.map(|part| part.f64())));
    let rotation = rotation.unwrap_or(DQuat::IDENTITY);
    let length = rotation.length();
    if (length - 1.0).abs() > QUATERNION_TOLERANCE {
        note(
            "its rotation is not a unit quaternion; brought to length 1, or left out if it has none",
        );
    }
    let has_direction = length > 0.0 && length.is_finite();
    Trs::Parts {
        translation: row.translation.map_or(DVec3::ZERO, vector),
        rotation: if has_direction { rotation / length } else { DQuat::IDENTITY },
        scale: row.scale.as_deref().copied().map_or(DVec3::ONE, vector),
    }
}
