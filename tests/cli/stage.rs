//! USD stages given to the programs, which export them first.
//!
//! Most tests put a script in Python's place, which shows what it was told; one exports a real stage, if the project's
//! environment for Python is there.

use crate::files::{SCENE, Shot, picture};
use assert_cmd::Command;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

const RENDER: &str = env!("CARGO_BIN_EXE_candelabra-render");
const TOOL: &str = env!("CARGO_BIN_EXE_candelabra");
const QUICK: &str = "--res 12x8 --spp 1 --threads 1 --progress none";

/// A folder with a stage, and a Python that does as it is told.
struct Stage {
    shot: Shot,
    /// Temporary files, which nobody else writes.
    scratch: tempfile::TempDir,
}

struct Ended {
    code: Option<i32>,
    err: String,
}

impl Stage {
    /// Its exporter writes down what it was told, and gives the scene of the folder.
    fn new() -> Stage {
        Stage::with(
            "printf '%s\\n' \"$@\" > \"$(dirname \"$2\")/told.txt\"\ncp \"$(dirname \"$2\")/shot.gltf\" \"$3\"",
        )
    }

    fn with(exporter: &str) -> Stage {
        let stage = Stage { shot: Shot::still(), scratch: tempfile::tempdir().unwrap() };
        stage.shot.write("scene.usda", "#usda 1.0\n");
        stage.shot.write("python", format!("#!/bin/sh\n{exporter}\n"));
        let python = stage.shot.path("python");
        fs::set_permissions(&python, fs::Permissions::from_mode(0o755)).unwrap();
        stage
    }

    fn command(&self, program: &str, arguments: &str) -> Command {
        let mut command = Command::new(program);
        command.current_dir(self.shot.path("")).args(arguments.split_whitespace());
        command.env("CANDELABRA_PYTHON", self.shot.path("python"));
        command.env("CANDELABRA_EXPORTER", exporter()).env("TMPDIR", self.scratch.path());
        command
    }

    fn render(&self, arguments: &str) -> Ended {
        end(&mut self.command(RENDER, &format!("scene.usda -o a.exr {QUICK} {arguments}")))
    }

    /// What the exporter was told after its own name, the stage, the output and how to tell its progress.
    fn options(&self) -> Vec<String> {
        let told = String::from_utf8(self.shot.read("told.txt")).unwrap();
        told.lines().skip(4).map(String::from).collect()
    }

    /// What lies in the folder and was not there before.
    fn left(&self) -> Vec<String> {
        let mut names = self.shot.names();
        names.retain(|name| ![SCENE, "python", "scene.usda", "told.txt"].contains(&name.as_str()));
        names
    }

    fn left_no_trace(&self) -> bool {
        fs::read_dir(self.scratch.path()).unwrap().next().is_none()
    }
}

fn end(command: &mut Command) -> Ended {
    let output = command.output().unwrap();
    Ended { code: output.status.code(), err: String::from_utf8(output.stderr).unwrap() }
}

fn exporter() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/usd_to_gltf.py")
}

#[test]
fn progress_of_the_exporter_is_told() {
    let stage = Stage::with(
        "for done in 0.05 0.21 0.26 0.9; do echo \"{\\\"event\\\":\\\"progress\\\",\\\"done\\\":$done,\\\"frame\\\":null}\"; done\n\
         echo written\nsleep 0.1\ncp \"$(dirname \"$2\")/shot.gltf\" \"$3\"",
    );
    let arguments = "scene.usda -o a.exr --res 12x8 --spp 1 --progress json";
    let output = stage.command(RENDER, arguments).output().unwrap();
    let told = String::from_utf8(output.stdout).unwrap();
    let stages = told.lines().filter(|line| line.contains("exporting")).collect::<Vec<_>>();
    let shown: Vec<bool> = ["stage\"", ": 20 %", ": 90 %"]
        .iter()
        .zip(&stages)
        .map(|(expected, line)| line.contains(expected))
        .collect();
    assert!(stages.len() == 3 && shown == [true; 3], "{told}");
}

#[test]
fn nothing_is_left_beside_the_picture() {
    let stage = Stage::new();
    let ended = stage.render("");
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert_eq!(stage.left(), ["a.exr"]);
    assert!(stage.left_no_trace());
    assert!(stage.options().is_empty());
    let pixels = picture(&stage.shot.path("a.exr")).unwrap();
    assert!(pixels.iter().any(|pixel| pixel[0] > 0.0));
    // The same as of the file that the exporter gives.
    let mut plain = stage.command(RENDER, &format!("{SCENE} -o plain.exr {QUICK}"));
    assert_eq!(end(&mut plain).code, Some(0));
    assert_eq!(picture(&stage.shot.path("plain.exr")).unwrap(), pixels);
}

#[test]
fn options_are_the_exporters() {
    let stage = Stage::new();
    let options = "--purposes proxy,guide --mask /A,/B --complexity low --variant /A:b=c --variant /D:e=f --strict=cameras";
    assert_eq!(stage.render(options).code, Some(0));
    let expected = [
        "--purposes=proxy,guide",
        "--mask=/A,/B",
        "--complexity=low",
        "--variant=/A:b=c",
        "--variant=/D:e=f",
        "--strict=cameras",
    ];
    assert_eq!(stage.options(), expected);
}

#[test]
fn a_tree_of_a_stage_stands_beside_it_and_is_fresh() {
    let stage = Stage::new();
    let ended = end(&mut stage.command(TOOL, "build scene.usda --progress none --complexity low"));
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert_eq!(stage.left(), ["scene.ltree"]);
    assert_eq!(stage.options(), ["--complexity=low"]);
    let ended = stage.render("--tree scene.ltree");
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    // A stale one is built again from the stage, not from what is gone by then.
    let scene = String::from_utf8(stage.shot.read(SCENE)).unwrap();
    stage.shot.write(SCENE, scene.replace("\"emissiveStrength\":20", "\"emissiveStrength\":30"));
    let ended = stage.render("--tree scene.ltree --complexity low --variant /A:b=c");
    assert_eq!(ended.code, Some(3), "{}", ended.err);
    let remedy = "candelabra build scene.usda -o scene.ltree '--complexity=low' '--variant=/A:b=c'";
    assert!(ended.err.contains(remedy), "{}", ended.err);
}

#[test]
fn pictures_of_a_stage_are_kept_until_it_changes() {
    let stage = Stage::new();
    assert_eq!(stage.render("").code, Some(0));
    let before = fs::metadata(stage.shot.path("a.exr")).unwrap().modified().unwrap();
    assert_eq!(stage.render("--resume").code, Some(0));
    assert_eq!(fs::metadata(stage.shot.path("a.exr")).unwrap().modified().unwrap(), before);
    let scene = String::from_utf8(stage.shot.read(SCENE)).unwrap();
    stage.shot.write(SCENE, scene.replace("\"emissiveStrength\":20", "\"emissiveStrength\":30"));
    assert_eq!(stage.render("--resume").code, Some(0));
    assert_ne!(fs::metadata(stage.shot.path("a.exr")).unwrap().modified().unwrap(), before);
}

#[test]
fn what_the_exporter_says_is_told() {
    let stage = Stage::with(
        "echo 'warning: lights: IES profile: /L: left out' >&2; echo 'note: other: UDIM: /M: one' >&2
        cp \"$(dirname \"$2\")/shot.gltf\" \"$3\"",
    );
    let ended = stage.render("");
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert!(ended.err.contains("note: lights: IES profile: /L: left out"), "{}", ended.err);
    assert!(ended.err.contains("note: other: UDIM: /M: one"), "{}", ended.err);
}

#[test]
fn errors_of_the_exporter_are_passed_on() {
    for (script, code, words) in [
        (
            "echo 'error: scene.usda: no prim /X' >&2; exit 1",
            1,
            "candelabra-render: scene.usda: no prim /X",
        ),
        (
            "echo 'usage: x' >&2; echo \"x: error: '/A' is no variant selection\" >&2; exit 2",
            2,
            "is no variant selection",
        ),
        (
            "echo 'error: s: 1 warning under --strict; nothing was written (see /tmp/x)' >&2; exit 1",
            1,
            "nothing was written\n",
        ),
        (
            "echo 'error: python3 lacks the package pxr' >&2; exit 1",
            1,
            "candelabra-render: scene.usda: python3 lacks the package pxr",
        ),
        ("exit 7", 1, "said nothing"),
        ("kill -9 $$", 1, "said nothing"),
        ("exit 0", 1, "scene.glb"),
    ] {
        let stage = Stage::with(script);
        let ended = stage.render("");
        assert_eq!(ended.code, Some(code), "{script}: {}", ended.err);
        assert!(ended.err.contains(words), "{script}: {}", ended.err);
        assert!(stage.left().is_empty() && stage.left_no_trace(), "{script}");
    }
}

#[test]
fn a_missing_python_or_exporter_is_named_with_the_remedy() {
    let stage = Stage::new();
    let arguments = format!("scene.usda -o a.exr {QUICK}");
    let ended = end(stage.command(RENDER, &arguments).env("CANDELABRA_PYTHON", "/gone/python"));
    assert_eq!(ended.code, Some(1));
    for words in ["/gone/python", "pip install -r scripts/requirements.txt", "CANDELABRA_PYTHON"] {
        assert!(ended.err.contains(words), "{}", ended.err);
    }
    let ended = end(stage.command(RENDER, &arguments).env("CANDELABRA_EXPORTER", "/gone/it.py"));
    assert_eq!(ended.code, Some(1));
    for words in ["/gone/it.py", "CANDELABRA_EXPORTER"] {
        assert!(ended.err.contains(words), "{}", ended.err);
    }
    assert!(stage.left().is_empty() && stage.left_no_trace());
}

/// It is told before any Python is looked for, and nobody waits for a pipe.
#[test]
fn a_stage_that_is_no_file_is_named() {
    let stage = Stage::with("echo 'error: python3 lacks the package pxr' >&2; exit 1");
    fs::create_dir(stage.shot.path("folder.usd")).unwrap();
    let pipe = std::process::Command::new("mkfifo").arg(stage.shot.path("pipe.usdc")).status();
    assert!(pipe.unwrap().success());
    for name in ["gone.usda", "folder.usd", "pipe.usdc"] {
        let ended = end(&mut stage.command(RENDER, &format!("{name} -o a.exr {QUICK}")));
        assert_eq!(ended.code, Some(1), "{}", ended.err);
        assert!(ended.err.contains(&format!("{name}: cannot be read")), "{}", ended.err);
        assert!(!ended.err.contains("pxr"), "{}", ended.err);
    }
}

#[test]
fn options_of_stages_belong_to_stages() {
    let stage = Stage::new();
    let arguments = format!("{SCENE} -o a.exr {QUICK} --complexity low");
    let ended = end(&mut stage.command(RENDER, &arguments));
    assert_eq!(ended.code, Some(2), "{}", ended.err);
    assert!(ended.err.contains("leave out --complexity=low"), "{}", ended.err);
    let ended = end(&mut stage.command(TOOL, &format!("build {SCENE} --mask /A")));
    assert_eq!(ended.code, Some(2), "{}", ended.err);
}

#[test]
fn a_stop_ends_the_exporter_too() {
    let stage = Stage::with("echo $$ > \"$(dirname \"$2\")/told.txt\"; exec sleep 60");
    let mut command = std::process::Command::new(RENDER);
    command
        .current_dir(stage.shot.path(""))
        .args(["scene.usda", "-o", "a.exr"])
        .args(QUICK.split(' '));
    command.env("CANDELABRA_PYTHON", stage.shot.path("python"));
    command.env("CANDELABRA_EXPORTER", exporter()).env("TMPDIR", stage.scratch.path());
    let mut child = command.stderr(std::process::Stdio::null()).spawn().unwrap();
    let told = stage.shot.path("told.txt");
    while fs::read_to_string(&told).unwrap_or_default().trim().is_empty() {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let stop = ["-TERM", &child.id().to_string()];
    assert!(std::process::Command::new("kill").args(stop).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(143));
    let exporter = fs::read_to_string(&told).unwrap();
    assert!(!Path::new("/proc").join(exporter.trim()).exists(), "the exporter goes on");
    assert!(stage.left().is_empty() && stage.left_no_trace());
}

/// Exports in earnest, with the project's own environment for Python.
#[test]
fn a_real_stage_is_rendered() {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv/bin/python");
    let has_usd = std::process::Command::new(&python).args(["-c", "import pxr"]).output();
    if !has_usd.is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: {} has no usd-core", python.display());
        return;
    }
    let stage = Stage::new();
    let scene = r#"#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Y"
)
def Plane "Lamp" (
    prepend apiSchemas = ["MaterialBindingAPI"]
    variants = { string power = "on" }
    prepend variantSets = "power"
)
{
    rel material:binding = </Lamp/Glow>
    uniform bool doubleSided = 1
    def Material "Glow"
    {
        token outputs:surface.connect = </Lamp/Glow/Surface.outputs:surface>
        def Shader "Surface"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0, 0, 0)
            token outputs:surface
        }
    }
    variantSet "power" = {
        "on" {
            over "Glow"
            {
                over "Surface"
                {
                    color3f inputs:emissiveColor = (5, 5, 5)
                }
            }
        }
        "off" {
        }
    }
}
"#;
    stage.shot.write("scene.usda", scene);
    let run = |options: &str| {
        let arguments = format!("scene.usda -o a.exr --look-from 0,0,-3 {QUICK} {options}");
        let ended = end(stage.command(RENDER, &arguments).env("CANDELABRA_PYTHON", &python));
        (ended.code, ended.err)
    };
    let brightest = || {
        let pixels = picture(&stage.shot.path("a.exr")).unwrap();
        pixels.iter().map(|pixel| pixel[0]).fold(0.0, f32::max)
    };
    assert_eq!(run("").0, Some(0), "{}", run("").1);
    assert_eq!(brightest(), 5.0);
    assert_eq!(run("--variant /Lamp:power=off").0, Some(0));
    assert_eq!(brightest(), 0.0);
    let (code, said) = run("--variant /Lamp:power=dim");
    assert_eq!(code, Some(1));
    assert!(said.contains("has no 'dim' (it has: off, on)"), "{said}");
    assert_eq!(run("--complexity most").0, Some(2));
    assert!(stage.left_no_trace());
}
