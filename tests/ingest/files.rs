//! Tiny scene files, made as they are needed.

use candelabra::ingest::{IngestError, load};
use candelabra::scene::Scene;
use serde_json::{Value, json};
use std::path::Path;
use tempfile::TempDir;

/// A glTF file and its buffer, to be edited before it is loaded.
pub struct File {
    pub json: Value,
    pub data: Vec<u8>,
}

/// A lamp: one triangle of 16-bit indices, an emissive material, a named node.
pub fn lamp() -> File {
    let mut data = Vec::new();
    for position in [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
        data.extend(position.iter().flat_map(|value| value.to_le_bytes()));
    }
    data.extend([0u16, 1, 2, 0].iter().flat_map(|index| index.to_le_bytes()));
    let json = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "lamp", "mesh": 0}],
        "meshes": [{"name": "flame", "primitives": [
            {"attributes": {"POSITION": 0}, "indices": 1, "material": 0},
        ]}],
        "materials": [{
            "name": "glow", "emissiveFactor": [1.0, 0.5, 0.25],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8.0}},
        }],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
             "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 0.0]},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 8},
        ],
        "buffers": [{"uri": "data.bin", "byteLength": 44}],
    });
    File { json, data }
}

impl File {
    /// Adds an accessor over new bytes and returns its number.
    pub fn array(&mut self, bytes: &[u8], component: u32, count: usize, shape: &str) -> usize {
        let view = self.view(bytes);
        push(
            &mut self.json,
            "accessors",
            json!({
                "bufferView": view, "componentType": component, "count": count, "type": shape,
            }),
        )
    }

    /// Animates what a pointer names.
    pub fn animate(&mut self, pointer: &str, times: &[f32], values: &[f32], how: &str) {
        let shape = match pointer.rsplit('/').next() {
            Some("color" | "emissiveFactor") => "VEC3",
            Some("scale") => "VEC2",
            _ => "SCALAR",
        };
        let (input, output) = (self.times(times), self.floats(values, shape));
        self.add(
            "animations",
            json!({
                "samplers": [{"input": input, "output": output, "interpolation": how}],
                "channels": [{"sampler": 0, "target": {"path": "pointer", "extensions": {
                    "KHR_animation_pointer": {"pointer": pointer}}}}],
            }),
        );
    }

    /// Adds an accessor of floats.
    pub fn floats(&mut self, values: &[f32], shape: &str) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let components = match shape {
            "SCALAR" => 1,
            shape => usize::from(shape.as_bytes()[3] - b'0'),
        };
        self.array(&bytes, 5126, values.len() / components, shape)
    }

    /// Adds key times, which must declare their bounds.
    pub fn times(&mut self, times: &[f32]) -> usize {
        let index = self.floats(times, "SCALAR");
        self.json["accessors"][index]["min"] = json!([times[0]]);
        self.json["accessors"][index]["max"] = json!([times[times.len() - 1]]);
        index
    }

    /// Adds a buffer view of new bytes and returns its number.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        let offset = self.data.len();
        self.data.extend(bytes);
        self.json["buffers"][0]["byteLength"] = json!(self.data.len());
        push(
            &mut self.json,
            "bufferViews",
            json!({
                "buffer": 0, "byteOffset": offset, "byteLength": bytes.len(),
            }),
        )
    }

    /// Adds a row to a table, which need not exist, and returns its number.
    pub fn add(&mut self, table: &str, row: Value) -> usize {
        push(&mut self.json, table, row)
    }

    /// Adds an attribute to the mesh.
    pub fn attribute(&mut self, semantic: &str, accessor: usize) {
        self.json["meshes"][0]["primitives"][0]["attributes"][semantic] = json!(accessor);
    }

    /// Sets what `extras` of the node say of its light.
    pub fn lux(&mut self, lux: Value) {
        self.json["nodes"][0]["extras"] = json!({"usdLux": lux});
    }

    /// Adds a light and puts it at the node.
    pub fn light(&mut self, light: Value) {
        self.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
        self.json["nodes"][0]["extensions"]["KHR_lights_punctual"] = json!({"light": 0});
    }

    /// Loads the file from a folder of its own.
    pub fn load(&self) -> Result<Scene, IngestError> {
        let folder = TempDir::new().unwrap();
        self.load_in(folder.path())
    }

    /// Loads the file from a folder in which other files may be.
    pub fn load_in(&self, folder: &Path) -> Result<Scene, IngestError> {
        std::fs::write(folder.join("data.bin"), &self.data).unwrap();
        let path = folder.join("scene.gltf");
        std::fs::write(&path, self.json.to_string()).unwrap();
        load(&path)
    }

    /// The same as one binary file.
    pub fn glb(mut self) -> Vec<u8> {
        self.json["buffers"][0].as_object_mut().unwrap().remove("uri");
        let mut text = self.json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        let length = 12 + 8 + text.len() + 8 + self.data.len();
        let word = |value: usize| (value as u32).to_le_bytes();
        let header = [b"glTF".to_vec(), word(2).into(), word(length).into()].concat();
        let chunk = |kind: &[u8; 4], data: &[u8]| [&word(data.len())[..], kind, data].concat();
        [header, chunk(b"JSON", &text), chunk(b"BIN\0", &self.data)].concat()
    }
}

fn push(json: &mut Value, table: &str, row: Value) -> usize {
    let rows = json[table].as_array().cloned().unwrap_or_default();
    let number = rows.len();
    json[table] = [rows, vec![row]].concat().into();
    number
}

/// A PNG of one colour.
pub fn png(width: u32, height: u32, color: [u8; 4]) -> Vec<u8> {
    let image = image::RgbaImage::from_pixel(width, height, image::Rgba(color));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}
