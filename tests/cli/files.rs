//! Tiny glTF scenes on the disk, and the programs run on them.

use assert_cmd::Command;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{self, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A folder of its own, with a scene in it, in which the programs are run.
pub struct Shot {
    folder: TempDir,
    pub json: Value,
}

/// The file in which the scene is.
pub const SCENE: &str = "shot.gltf";

/// Base64, as data URIs have it.
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = |chunk: &[u8]| {
        let bits = (0..3).fold(0, |bits, i| bits << 8 | u32::from(*chunk.get(i).unwrap_or(&0)));
        let digit = |i: usize| match i <= chunk.len() {
            true => char::from(DIGITS[(bits >> (18 - 6 * i)) as usize & 63]),
            false => '=',
        };
        [digit(0), digit(1), digit(2), digit(3)]
    };
    bytes.chunks(3).flat_map(digits).collect()
}

/// A quad in the plane z = 0 that faces +Z, then key times 0 s and 1 s, then two places.
fn buffer() -> Vec<u8> {
    let corners = [[-1.0f32, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let positions = corners.iter().flat_map(|&[x, y]| [x, y, 0.0]);
    let keys = [0.0, 1.0, 0.0, 0.0, 1.0, 0.5, 0.0, 1.0];
    let uvs = corners.iter().flat_map(|&[x, y]| [0.5 + 0.5 * x, 0.5 - 0.5 * y]);
    let floats = positions.chain(keys).chain(uvs).flat_map(f32::to_le_bytes);
    let indices = [0u16, 1, 2, 0, 2, 3].into_iter().flat_map(u16::to_le_bytes);
    floats.chain(indices).collect()
}

/// A grey wall, a lamp before it that looks at it, a camera: one frame.
fn still() -> Value {
    let data = buffer();
    let uri = format!("data:application/octet-stream;base64,{}", base64(&data));
    let primitive = |material: u32| {
        json!({"primitives": [{
            "attributes": {"POSITION": 0, "TEXCOORD_0": 3}, "indices": 4, "material": material,
        }]})
    };
    json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_materials_emissive_strength"],
        "scene": 0,
        "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [
            {"name": "wall", "mesh": 0, "scale": [4, 4, 1]},
            // Turned about, it shines at the wall; the camera sees its back.
            {"name": "lamp", "mesh": 1, "translation": [0, 0, 1], "rotation": [0, 1, 0, 0],
             "scale": [0.25, 0.25, 1]},
            {"name": "eye", "camera": 0, "translation": [0, 0, 4]},
        ],
        "meshes": [primitive(0), primitive(1)],
        "materials": [
            {"name": "plaster", "pbrMetallicRoughness": {"metallicFactor": 0}},
            {"name": "glow", "emissiveFactor": [1, 1, 1],
             "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 20}}},
        ],
        "cameras": [{"type": "perspective",
            "perspective": {"yfov": 0.8, "aspectRatio": 1.5, "znear": 0.1}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
             "min": [-1, -1, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR",
             "min": [0], "max": [1]},
            {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"},
            {"bufferView": 3, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 4, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 8},
            {"buffer": 0, "byteOffset": 56, "byteLength": 24},
            {"buffer": 0, "byteOffset": 80, "byteLength": 32},
            {"buffer": 0, "byteOffset": 112, "byteLength": 12},
        ],
        "buffers": [{"uri": uri, "byteLength": data.len()}],
    })
}

impl Shot {
    /// A scene of one frame.
    pub fn still() -> Shot {
        let shot = Shot { folder: TempDir::new().unwrap(), json: still() };
        shot.save();
        shot
    }

    /// The same; the lamp moves from frame 1 to frame 25.
    pub fn moving() -> Shot {
        let mut shot = Shot::still();
        shot.json["animations"] = json!([{
            "samplers": [{"input": 1, "output": 2}],
            "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
        }]);
        shot.save();
        shot
    }

    /// Writes the scene.
    pub fn save(&self) {
        self.write(SCENE, self.json.to_string());
    }

    /// Changes the scene and writes it.
    pub fn edit(&mut self, change: impl FnOnce(&mut Value)) {
        change(&mut self.json);
        self.save();
    }

    /// Moves the scene's buffer to a file beside it.
    pub fn with_buffer_file(mut self) -> Shot {
        self.write("shot.bin", buffer());
        self.edit(|json| json["buffers"][0]["uri"] = json!("shot.bin"));
        self
    }

    /// Gives the wall a picture, in a file beside the scene.
    pub fn with_picture_file(mut self) -> Shot {
        self.write_picture([200, 100, 50]);
        self.edit(|json| {
            json["images"] = json!([{"uri": "wall.png"}]);
            json["textures"] = json!([{"source": 0}]);
            json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
        });
        self
    }

    /// That picture, of one colour.
    pub fn write_picture(&self, color: [u8; 3]) {
        let picture = image::RgbImage::from_pixel(4, 4, image::Rgb(color));
        picture.save(self.path("wall.png")).unwrap();
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// What lies in the folder, by name.
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).unwrap().map(Result::unwrap);
        let mut names: Vec<_> =
            entries.map(|entry| entry.file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// `candelabra`, told the words of a text.
    pub fn candelabra(&self, arguments: &str) -> Told {
        self.run(env!("CARGO_BIN_EXE_candelabra"), arguments)
    }

    /// `candelabra-render`, likewise; small and quick unless told otherwise.
    pub fn render(&self, arguments: &str) -> Told {
        self.run(env!("CARGO_BIN_EXE_candelabra-render"), &quick(arguments))
    }

    /// The same, told to stop after some time. How it ended.
    pub fn render_for(&self, arguments: &str, patience: Duration) -> Option<i32> {
        let mut command = process::Command::new(env!("CARGO_BIN_EXE_candelabra-render"));
        command.current_dir(self.folder.path()).args(quick(arguments).split_whitespace());
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let started = Instant::now();
        while started.elapsed() < patience && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(5));
        }
        // It may have ended by itself meanwhile.
        let _ = process::Command::new("kill").args(["-TERM", &child.id().to_string()]).output();
        child.wait().unwrap().code()
    }

    fn run(&self, program: &str, arguments: &str) -> Told {
        let mut command = Command::new(program);
        command.current_dir(self.folder.path()).args(arguments.split_whitespace());
        let output = command.output().unwrap();
        Told {
            code: output.status.code(),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

/// Arguments of the renderer that ask for little work, where they do not say how much.
fn quick(arguments: &str) -> String {
    let is_given = |names: &[&str]| arguments.split_whitespace().any(|word| names.contains(&word));
    let mut all = format!("{SCENE} {arguments} --threads 1");
    let effort = ["--spp", "--max-spp", "--error", "--time", "--plan"];
    for (names, value) in [(&["--res"][..], "12x8"), (&effort, "2"), (&["--depth"], "1")] {
        if !is_given(names) {
            all += &format!(" {} {value}", names[0]);
        }
    }
    all
}

/// What a program said, and how it ended.
#[derive(Debug)]
pub struct Told {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl Told {
    /// Asserts the exit code.
    #[track_caller]
    pub fn ends(self, code: i32) -> Told {
        assert_eq!(self.code, Some(code), "{self:#?}");
        self
    }

    /// Asserts that the program said something on standard output.
    #[track_caller]
    pub fn says(self, text: &str) -> Told {
        assert!(self.out.contains(text), "no '{text}' in {self:#?}");
        self
    }

    /// Asserts that the program did not say something on standard output.
    #[track_caller]
    pub fn keeps_quiet_about(self, text: &str) -> Told {
        assert!(!self.out.contains(text), "'{text}' in {self:#?}");
        self
    }

    /// Asserts that the program complained of something: of all these, in one line.
    #[track_caller]
    pub fn complains(self, texts: &[&str]) -> Told {
        let told = self.err.lines().any(|line| texts.iter().all(|text| line.contains(text)));
        assert!(told, "no line with {texts:?} in {self:#?}");
        assert!(!self.err.contains("panicked"), "{self:#?}");
        self
    }
}

/// Red, green and blue of all pixels, if a file is a whole picture.
pub fn picture(path: &Path) -> Option<Vec<[f32; 3]>> {
    let image = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| (size.width(), vec![[0.0; 3]; size.area()]),
        |(width, pixels): &mut (usize, Vec<_>), at, (r, g, b, _): (f32, f32, f32, f32)| {
            pixels[at.y() * *width + at.x()] = [r, g, b];
        },
    );
    Some(image.ok()?.layer_data.channel_data.pixels.1)
}
