//! USD stages: exported to glTF where a job is given one, by `scripts/usd_to_gltf.py`.
//!
//! As with usdrecord nothing is left behind: the export goes to a temporary folder, and is gone when it has been read. (A
//! program that is killed leaves the folder, `candelabra-*`, to those who clear temporary files.)
//! [`StageOptions`] are usdrecord's and the exporter's own, and are handed on as they are. What the exporter says is told
//! as notes; what it refuses is the error, in its words.
//!
//! | variable of the environment | |
//! |---|---|
//! | `CANDELABRA_PYTHON` | the Python that runs the exporter; else the active virtual environment's, the project's own, `python3` |
//! | `CANDELABRA_EXPORTER` | the exporter; else `scripts/usd_to_gltf.py` in one of the four folders above the program |

use super::{Event, Strict, Watch};
use crate::scene::SourceFile;
use crate::store::open_regular;
use clap::Args;
use std::env;
use std::ffi::{OsStr, OsString};
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;

const PYTHON: &str = "CANDELABRA_PYTHON";
const EXPORTER: &str = "CANDELABRA_EXPORTER";
const SCRIPT: &str = "scripts/usd_to_gltf.py";
/// A program is in `bin` or in `target/release` of the folder that has the scripts, or a folder deeper.
const FOLDERS_ABOVE: usize = 4;
/// The exit code of the exporter for options that it does not take.
const USAGE: i32 = 2;
/// The stage of a job that runs the exporter.
const EXPORTING: &str = "exporting the stage";
/// How long a stopped job may take to notice it.
const PATIENCE: Duration = Duration::from_millis(20);

/// What of a USD stage is meant. Without meaning, and refused, for other files.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[command(next_help_heading = "Options of USD stages, which are exported first")]
pub struct StageOptions {
    /// Purposes to render beside default, of render,proxy,guide; render if not given
    #[arg(long, value_name = "LIST")]
    pub purposes: Option<String>,
    /// Only these prims, what is below them, and what they need
    #[arg(long, value_name = "/PRIM[,/PRIM...]")]
    pub mask: Option<String>,
    /// How far subdivision surfaces and curves are refined: low, medium, high or veryhigh; high if not given
    #[arg(long, value_name = "LEVEL")]
    pub complexity: Option<String>,
    /// Select a variant; may be given again, and is taken in this order
    #[arg(long, value_name = "/PRIM:SET=NAME")]
    pub variant: Vec<String>,
}

impl StageOptions {
    /// Refuses options that were given with a file that is no stage.
    ///
    /// # Errors
    /// If any were.
    pub(super) fn refuse_for(&self, scene: &Path) -> Result<(), StageError> {
        match self.arguments().join(" ") {
            none if none.is_empty() => Ok(()),
            options => Err(StageError::NoStage { scene: scene.into(), options }),
        }
    }

    /// As arguments of the exporter.
    pub(super) fn arguments(&self) -> Vec<String> {
        let given = [
            ("--purposes", &self.purposes),
            ("--mask", &self.mask),
            ("--complexity", &self.complexity),
        ];
        let given = given.into_iter().filter_map(|(name, value)| Some((name, value.as_ref()?)));
        let variants = self.variant.iter().map(|variant| ("--variant", variant));
        given.chain(variants).map(|(name, value)| format!("{name}={value}")).collect()
    }
}

/// Why a stage could not be exported.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// The options of stages were given with another file.
    #[error("{}: is no USD stage; leave out {options}", scene.display())]
    NoStage {
        /// The file.
        scene: PathBuf,
        /// The options.
        options: String,
    },
    /// The exporter is not where it is looked for.
    #[error(
        "{}: USD stages are exported by {SCRIPT}, which is {}; set {EXPORTER} to its path, or export the stage with it",
        scene.display(),
        looked_for.as_ref().map_or_else(
            || "in none of the four folders above this program".into(), |path| format!("not at {}", path.display())
        )
    )]
    NoExporter {
        /// The stage.
        scene: PathBuf,
        /// Where `CANDELABRA_EXPORTER` says that it is.
        looked_for: Option<PathBuf>,
    },
    /// Python does not start.
    #[error(
        "{}: {} cannot be started: {cause}; USD stages are exported by Python with usd-core: install python3, then \
         `python3 -m pip install -r scripts/requirements.txt`, or set {PYTHON}",
        scene.display(),
        python.display()
    )]
    NoPython {
        /// The stage.
        scene: PathBuf,
        /// The program that was tried.
        python: PathBuf,
        /// Why.
        cause: io::Error,
    },
    /// The stage is not there, or is no regular file.
    #[error("{}: cannot be read: {cause}; check the path", scene.display())]
    NoScene {
        /// The stage.
        scene: PathBuf,
        /// Why.
        cause: io::Error,
    },
    /// There is no room for the export.
    #[error("{}: cannot be exported to a temporary folder: {cause}; set TMPDIR to a folder with room", scene.display())]
    NoFolder {
        /// The stage.
        scene: PathBuf,
        /// Why.
        cause: io::Error,
    },
    /// The exporter refused, in its own words.
    #[error("{said}")]
    Refused {
        /// What it said.
        said: String,
        /// Whether that was about the options.
        is_usage: bool,
    },
    /// The job was to stop.
    #[error("stopped while {} was exported", .0.display())]
    Stopped(PathBuf),
}

/// Whether a file is a USD stage, by its name.
pub(super) fn is_stage(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    ["usd", "usda", "usdc", "usdz"].iter().any(|stage| extension == *stage)
}

/// A stage as glTF, as long as this lives.
pub(super) struct ExportedStage {
    folder: TempDir,
    name: OsString,
    source: PathBuf,
}

impl ExportedStage {
    /// Exports a stage.
    ///
    /// # Errors
    /// If there is no exporter, or it refuses.
    pub fn of(
        source: &Path,
        options: &StageOptions,
        strict: Option<&Strict>,
        watch: &dyn Watch,
    ) -> Result<ExportedStage, StageError> {
        let no_scene = |cause| StageError::NoScene { scene: source.into(), cause };
        open_regular(source).map_err(no_scene)?;
        let exporter = exporter(source)?;
        let no_folder = |cause| StageError::NoFolder { scene: source.into(), cause };
        let folder = tempfile::Builder::new().prefix("candelabra-").tempdir().map_err(no_folder)?;
        let mut name = source.file_stem().unwrap_or(OsStr::new("stage")).to_os_string();
        name.push(".glb");
        let exported = ExportedStage { folder, name, source: source.into() };
        let python = python(&exporter);
        let mut command = Command::new(&python);
        command.arg(&exporter).arg(absolute(source)).arg(exported.path());
        command.arg("--progress=json").args(options.arguments());
        if let Some(strict) = strict {
            command.arg(format!("--strict={strict}"));
        }
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        watch.tell(Event::Stage { name: EXPORTING.into() });
        let child = command.spawn();
        let child =
            child.map_err(|cause| StageError::NoPython { scene: source.into(), python, cause })?;
        listen(child, source, watch)?;
        Ok(exported)
    }

    /// The file of the export.
    pub fn path(&self) -> PathBuf {
        self.folder.path().join(&self.name)
    }

    /// The files that the exporter has really read, by its report. Their hashes are of its own digests.
    pub fn files(&self) -> Vec<SourceFile> {
        let mut report = self.name.clone();
        report.push(".report.json");
        let report = std::fs::read(self.folder.path().join(report)).unwrap_or_default();
        let report: serde_json::Value = serde_json::from_slice(&report).unwrap_or_default();
        let folder = absolute(&self.source).parent().map(Path::to_path_buf).unwrap_or_default();
        let rows = report["dependencies"].as_object().into_iter().flatten();
        let read = rows.filter_map(|(name, digest)| Some((name, digest.as_str()?)));
        let there = read.filter(|(_, digest)| *digest != "missing");
        there.map(|(name, digest)| SourceFile::new(folder.join(name), digest.as_bytes())).collect()
    }
}

/// Tells what the exporter says, and waits for its end.
fn listen(mut child: Child, source: &Path, watch: &dyn Watch) -> Result<(), StageError> {
    let stderr = child.stderr.take();
    let said = std::thread::spawn(move || lines_of(stderr).collect::<Vec<_>>());
    let (told, events) = std::sync::mpsc::channel();
    let stdout = child.stdout.take();
    // It ends with the pipe; who listens may have gone by then.
    std::thread::spawn(move || lines_of(stdout).try_for_each(|line| told.send(line)));
    let mut shown = 0;
    let ended = loop {
        for line in events.try_iter() {
            let Ok(Event::Progress { done, .. }) = serde_json::from_str(&line) else { continue };
            let tenths = (10.0 * done) as u32;
            if tenths > shown {
                shown = tenths;
                watch.tell(Event::Stage { name: format!("{EXPORTING}: {} %", 10 * tenths) });
            }
        }
        if watch.is_stopped() {
            // It may have ended by itself meanwhile.
            let _ = child.kill();
            let _ = child.wait();
            return Err(StageError::Stopped(source.into()));
        }
        match child.try_wait() {
            Ok(Some(status)) => break Ok(status),
            Ok(None) => std::thread::sleep(PATIENCE),
            Err(error) => break Err(error),
        }
    };
    let lines = said.join().unwrap_or_default();
    let (notes, rest): (Vec<_>, Vec<_>) =
        lines.into_iter().partition(|line| note_of(line).is_some());
    for line in &notes {
        watch.tell(Event::Note { text: note_of(line).unwrap_or(line).into() });
    }
    let code = ended.as_ref().ok().and_then(std::process::ExitStatus::code);
    if code == Some(0) {
        return Ok(());
    }
    if watch.is_stopped() {
        return Err(StageError::Stopped(source.into()));
    }
    // Its report goes with the folder; the lines of it have been told.
    let said = rest.join("\n");
    let said = said.split(" (see ").next().unwrap_or_default();
    let is_usage = code == Some(USAGE);
    let name = source.file_name().unwrap_or_default().to_string_lossy();
    let said = match said.strip_prefix("error: ").unwrap_or(said).trim() {
        "" => format!("{}: the exporter ended with {ended:?}, and said nothing", source.display()),
        said if is_usage || said.contains(&*name) => said.to_owned(),
        said => format!("{}: {said}", source.display()),
    };
    Err(StageError::Refused { said, is_usage })
}

/// What a pipe has to say, line by line.
fn lines_of(pipe: Option<impl Read>) -> impl Iterator<Item = String> {
    let lines = pipe.into_iter().flat_map(|pipe| BufReader::new(pipe).split(b'\n'));
    lines.map_while(Result::ok).map(|line| String::from_utf8_lossy(&line).trim_end().to_owned())
}

/// What a line of the exporter notes; `None` if it is an error.
fn note_of(line: &str) -> Option<&str> {
    ["warning: ", "note: "].iter().find_map(|word| line.strip_prefix(word))
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.into())
}

/// Where the exporter is.
fn exporter(scene: &Path) -> Result<PathBuf, StageError> {
    let missing = |looked_for| StageError::NoExporter { scene: scene.into(), looked_for };
    if let Some(path) = env::var_os(EXPORTER).filter(|path| !path.is_empty()).map(PathBuf::from) {
        return if path.is_file() { Ok(path) } else { Err(missing(Some(path))) };
    }
    let program = env::current_exe().unwrap_or_default();
    let above = program.ancestors().skip(1).take(FOLDERS_ABOVE);
    let mut scripts = above.map(|folder| folder.join(SCRIPT));
    scripts.find(|path| path.is_file()).ok_or_else(|| missing(None))
}

/// The Python that runs it.
fn python(exporter: &Path) -> PathBuf {
    if let Some(python) = env::var_os(PYTHON).filter(|path| !path.is_empty()) {
        return python.into();
    }
    let active = env::var_os("VIRTUAL_ENV").map(PathBuf::from);
    let own = exporter.parent().and_then(Path::parent).map(|root| root.join(".venv"));
    let environments = active.into_iter().chain(own).map(|folder| folder.join("bin/python"));
    environments.into_iter().find(|path| path.is_file()).unwrap_or_else(|| "python3".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_known_by_their_names() {
        for name in ["a.usd", "b/a.USDA", "a.usdc", "a.b.usdz"] {
            assert!(is_stage(Path::new(name)), "{name}");
        }
        for name in ["a.glb", "usd", "a.usdx", "a.usda.glb", ""] {
            assert!(!is_stage(Path::new(name)), "{name}");
        }
    }

    #[test]
    fn options_are_handed_on_as_they_are() {
        assert!(StageOptions::default().arguments().is_empty());
        let options = StageOptions {
            purposes: Some("proxy,guide".into()),
            mask: None,
            complexity: Some("low".into()),
            variant: vec!["/A:b=c".into(), "/D:e=--f".into()],
        };
        let told = [
            "--purposes=proxy,guide",
            "--complexity=low",
            "--variant=/A:b=c",
            "--variant=/D:e=--f",
        ];
        assert_eq!(options.arguments(), told);
    }
}
