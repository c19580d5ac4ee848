//! A job: layers of frames, and which waits for which.

use super::cjsl::{self, Element, Refusal};
use super::{order, range, tokens};
use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// No job file is longer than this: 16 MiB.
const LONGEST_FILE: u64 = 16 << 20;
/// Cuebot takes no more layers in a job.
const MOST_LAYERS: usize = 1000;
/// No timeout is longer than this: a year of minutes.
const LONGEST_TIMEOUT: u64 = 366 * 24 * 60;

/// A job, as its file describes it. Names are as Cuebot makes them: lower case, dashes as underscores.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Its name.
    pub name: String,
    /// The show that it is for.
    pub show: String,
    /// The shot that it is for.
    pub shot: String,
    /// Who runs it on an OpenCue farm.
    pub user: String,
    /// How often a task that fails is tried again.
    pub retries: u32,
    /// What is to be done, in the file's order; at least one.
    pub layers: Vec<Layer>,
    /// Which layer waits for which.
    pub depends: Vec<Depend>,
    /// The file.
    pub path: PathBuf,
    /// The folder in which its commands run: the one that holds `pipelines/` if the file is in a folder of
    /// that name, else the file's own. Absolute.
    pub root: PathBuf,
    /// The file's elements, whole.
    pub(super) spec: Element,
}

/// Frames that one command makes.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Its name.
    pub name: String,
    /// What kind of work it is.
    pub kind: LayerKind,
    /// A line of `sh`, with [`tokens`].
    pub command: String,
    /// Its frames in order, each once; at least one.
    pub frames: Vec<i32>,
    /// How many frames a task takes; at least one.
    pub chunk: usize,
    /// Cores that a task reserves, in hundredths.
    pub core_points: Option<u32>,
    /// Memory that a task reserves, in MiB.
    pub memory_mib: Option<u64>,
    /// A task is stopped after so many minutes.
    pub timeout_minutes: Option<u64>,
    /// A task is stopped if it has said nothing for so many minutes.
    pub silence_minutes: Option<u64>,
    /// Environment of the commands, the job's included.
    pub env: Vec<(String, String)>,
}

/// What kind of work a layer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayerKind {
    /// Frames.
    Render,
    /// Preparation.
    Util,
    /// What is done after all layers that are not of this kind.
    Post,
}

/// A dependence of one layer on another, both by their place in [`Job::layers`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Depend {
    /// The layer that waits.
    pub layer: usize,
    /// The layer that it waits for.
    pub on: usize,
    /// For what of it.
    pub kind: DependKind,
}

/// What a layer waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DependKind {
    /// The whole of the other layer.
    LayerOnLayer,
    /// The tasks of the other layer that make the same frames.
    FrameByFrame,
}

/// Why a job file is refused.
#[derive(Debug, Error)]
pub enum JobError {
    /// It cannot be read.
    #[error("{}: {error}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// It is no valid job; the message has line, column and remedy.
    #[error("{}:{refusal}", path.display())]
    Refused {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        refusal: Refusal,
    },
    /// Another job of the same folder has its name, so their logs would be mixed up.
    #[error("{}: its job is called {name} as that of {} is; rename one", path.display(), other.display())]
    SameName {
        /// The file.
        path: PathBuf,
        /// The other one.
        other: PathBuf,
        /// The name.
        name: String,
    },
    /// A folder without job files.
    #[error("{}: no job file (*.xml) is in this folder", path.display())]
    Empty {
        /// The folder.
        path: PathBuf,
    },
}

impl Job {
    /// Reads a job file and checks all of it.
    ///
    /// # Errors
    /// The first thing in the file that is wrong: see [`JobError`].
    pub fn read(path: &Path) -> Result<Job, JobError> {
        let unreadable = |error| JobError::Unreadable { path: path.into(), error };
        let text = read_text(path).map_err(unreadable)?;
        let absolute = std::path::absolute(path).map_err(unreadable)?;
        let folder = absolute.parent().unwrap_or(Path::new("/"));
        let is_pipelines = folder.file_name().is_some_and(|name| name == "pipelines");
        let root = if is_pipelines { folder.parent().unwrap_or(folder) } else { folder };
        let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
        Job::parse(text, path, root)
            .map_err(|refusal| JobError::Refused { path: path.into(), refusal })
    }

    fn parse(text: &str, path: &Path, root: &Path) -> Result<Job, Refusal> {
        let spec = cjsl::read(text)?;
        let (show, shot) = (word(&spec, "show")?.to_owned(), word(&spec, "shot")?);
        let shot = conformed(spec.child("shot").unwrap_or(&spec), "shot", shot)?;
        let user = word(&spec, "user")?.to_owned();
        let is_root = |child: &&Element| child.text == "root" || child.text.parse() == Ok(0);
        if let Some(root) = spec.child("uid").filter(is_root).or(spec.child("user").filter(is_root)) {
            return Err(root.refuse("Cuebot runs nothing as root; name another <user>"));
        }
        let element = only_job(&spec)?;
        let prefix = format!("{show}-{shot}-{user}_");
        let name = job_name(element, element.attribute("name").unwrap_or_default(), &prefix)?;
        let retries = integer(element, "maxretries", 0..=1000)?.unwrap_or(0) as u32;
        let layers = layers(element)?;
        let depends = depends(&spec, &name, &prefix, &layers)?;
        let (path, root) = (path.into(), root.into());
        Ok(Job { name, show, shot, user, retries, layers, depends, path, root, spec })
    }

    /// What Cuebot calls the job: `show-shot-user_name`.
    pub fn full_name(&self) -> String {
        format!("{}-{}-{}_{}", self.show, self.shot, self.user, self.name).to_lowercase()
    }
}

/// A text file of bounded length.
fn read_text(path: &Path) -> io::Result<String> {
    let file = File::open(path)?;
    if !file.metadata()?.is_file() {
        return Err(io::Error::other("is no file; give a job file"));
    }
    let mut bytes = Vec::new();
    file.take(LONGEST_FILE + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LONGEST_FILE {
        return Err(io::Error::other("is longer than 16 MiB; this is no job file"));
    }
    String::from_utf8(bytes).map_err(|_| io::Error::other("is not UTF-8; save it as UTF-8"))
}

/// The text of a child that must be there and say something.
fn required<'a>(parent: &'a Element, name: &str) -> Result<&'a str, Refusal> {
    let child = parent.child(name).ok_or_else(|| parent.refuse(format!("<{name}> is missing")))?;
    match child.text.as_str() {
        "" => Err(child.refuse(format!("<{name}> is empty; say what it is"))),
        text => Ok(text),
    }
}

/// The same, of a text that can be a part of names.
fn word<'a>(parent: &'a Element, name: &str) -> Result<&'a str, Refusal> {
    let text = required(parent, name)?;
    let is_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    match text.chars().all(is_word) {
        true => Ok(text),
        false => Err(parent.child(name).unwrap_or(parent).refuse(format!(
            "<{name}> is '{text}', which becomes a part of names; take letters, digits, _ - and . alone"
        ))),
    }
}

/// The whole number in a child, if it is there.
fn integer(
    parent: &Element,
    name: &str,
    allowed: std::ops::RangeInclusive<u64>,
) -> Result<Option<u64>, Refusal> {
    let Some(child) = parent.child(name) else { return Ok(None) };
    match child.text.parse() {
        Ok(number) if allowed.contains(&number) => Ok(Some(number)),
        _ => {
            let (least, most) = (allowed.start(), allowed.end());
            let why = format!(
                "<{name}> is '{}'; write a whole number from {least} to {most}",
                child.text
            );
            Err(child.refuse(why))
        }
    }
}

/// A name as Cuebot conforms it.
fn conformed(element: &Element, of: &str, name: &str) -> Result<String, Refusal> {
    let conformed = name.replace('-', "_").to_lowercase();
    let is_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.');
    match conformed.len() >= 3 && conformed.chars().all(is_word) {
        true => Ok(conformed),
        false => Err(element.refuse(format!(
            "the {of} name '{name}' is none of Cuebot's; take three or more letters, digits, _ or ."
        ))),
    }
}

/// A job's name, with or without Cuebot's prefix.
fn job_name(element: &Element, name: &str, prefix: &str) -> Result<String, Refusal> {
    conformed(element, "job", name.strip_prefix(prefix).unwrap_or(name))
}

fn environment(parent: &Element) -> Result<Vec<(String, String)>, Refusal> {
    let keys = parent.all("env").flat_map(|env| &env.children);
    keys.map(|key| {
        let name = key.attribute("name").unwrap_or_default();
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        match name.chars().all(is_word) && !name.starts_with(|c: char| c.is_ascii_digit()) {
            true => Ok((name.to_owned(), key.text.clone())),
            false => Err(key.refuse(format!(
                "no shell knows a variable '{name}'; take letters, digits and _ alone"
            ))),
        }
    })
    .collect()
}

fn only_job(spec: &Element) -> Result<&Element, Refusal> {
    let mut jobs = spec.all("job");
    match (jobs.next(), jobs.next()) {
        (Some(job), None) => Ok(job),
        (_, Some(second)) => {
            Err(second.refuse("a second <job> is here; give each job a file of its own"))
        }
        (None, _) => Err(spec.refuse("<spec> has no <job>; put one in")),
    }
}

/// The layers of a job: at least one, of different names, of no more frames than Cuebot takes.
fn layers(job: &Element) -> Result<Vec<Layer>, Refusal> {
    let env = environment(job)?;
    let (mut layers, mut names, mut frames) = (Vec::new(), HashSet::new(), 0);
    for element in job.child("layers").map_or(&[][..], |layers| &layers.children) {
        let layer = layer(element, &env)?;
        frames += layer.frames.len();
        if !names.insert(layer.name.clone()) {
            let why = format!("a second layer is called {}; rename it", layer.name);
            return Err(element.refuse(why));
        }
        if names.len() > MOST_LAYERS || frames > range::MOST_FRAMES {
            let most = range::MOST_FRAMES;
            let why =
                format!("Cuebot takes {MOST_LAYERS} layers and {most} frames in a job; divide it");
            return Err(element.refuse(why));
        }
        layers.push(layer);
    }
    if layers.is_empty() {
        return Err(job.refuse("<job> has no layers; put <layers> with one in"));
    }
    Ok(layers)
}

fn layer(element: &Element, job_env: &[(String, String)]) -> Result<Layer, Refusal> {
    let name = conformed(element, "layer", element.attribute("name").unwrap_or_default())?;
    let command = required(element, "cmd")?;
    let child = |name| element.child(name).unwrap_or(element);
    if let Some(slip) = tokens::unknown(command) {
        let known = tokens::TOKENS.map(|token| format!("#{token}#")).join(" ");
        return Err(child("cmd").refuse(format!("#{slip}# is no token; take one of {known}")));
    }
    let frames = range::parse(required(element, "range")?)
        .map_err(|error| child("range").refuse(error.to_string()))?;
    let chunk = integer(element, "chunk", 1..=u64::from(u32::MAX))?.unwrap_or(1) as usize;
    let mut env = job_env.to_vec();
    env.extend(environment(element)?);
    let minutes =
        |name| Ok(integer(element, name, 0..=LONGEST_TIMEOUT)?.filter(|&minutes| minutes > 0));
    Ok(Layer {
        name,
        kind: match element.attribute("type") {
            Some("Util") => LayerKind::Util,
            Some("Post") => LayerKind::Post,
            _ => LayerKind::Render,
        },
        command: command.into(),
        frames,
        chunk,
        core_points: element.child("cores").map(core_points).transpose()?,
        memory_mib: element.child("memory").map(memory_mib).transpose()?,
        timeout_minutes: minutes("timeout")?,
        silence_minutes: minutes("timeout_llu")?,
        env,
    })
}

/// `2.0` is two cores, `200` is two cores in core points, `2` is next to nothing.
fn core_points(element: &Element) -> Result<u32, Refusal> {
    let text = element.text.as_str();
    let points = match text.contains('.') {
        true => text.parse().ok().map(|cores: f64| (cores * 100.0).round()),
        false => text.parse::<u32>().ok().map(f64::from),
    };
    match points {
        Some(points) if !text.contains('.') && points < 100.0 => Err(element.refuse(format!(
            "<cores> is {text} core points, {text} hundredths of a core; write {text}.0 for {text} cores"
        ))),
        Some(points) if (0.0..=80_000.0).contains(&points) => Ok(points as u32),
        _ => Err(element.refuse(format!("<cores> is '{text}'; write cores as 2.0 or core points as 200"))),
    }
}

/// `4g`, `512m`, or a number of gigabytes.
fn memory_mib(element: &Element) -> Result<u64, Refusal> {
    let text = element.text.to_ascii_lowercase();
    let mib = match text.strip_suffix('m') {
        Some(number) => number.parse().ok().map(|mib: f64| mib.ceil()),
        None => text
            .strip_suffix('g')
            .unwrap_or(&text)
            .parse::<u32>()
            .ok()
            .map(|gib| f64::from(gib) * 1024.0),
    };
    match mib {
        Some(mib) if (1.0..=1e9).contains(&mib) => Ok(mib as u64),
        _ => Err(element.refuse(format!("<memory> is '{}'; write 512m or 4g", element.text))),
    }
}

/// The dependences among layers, each once; without rings.
fn depends(
    spec: &Element,
    job: &str,
    prefix: &str,
    layers: &[Layer],
) -> Result<Vec<Depend>, Refusal> {
    let names = layers.iter().enumerate().map(|(place, layer)| (layer.name.as_str(), place));
    let names: HashMap<&str, usize> = names.collect();
    let (mut depends, mut elements) = (Vec::new(), HashMap::new());
    for element in spec.all("depends").flat_map(|depends| &depends.children) {
        let depend = depend(element, job, prefix, &names)?;
        if elements.insert(depend, element).is_none() {
            depends.push(depend);
        }
    }
    if let Err(ring) = order::of(layers, &depends) {
        let is_first = |depend: &&Depend| depend.layer == ring[0] && depend.on == ring[1];
        // Post layers wait without a <depend>.
        let first = depends.iter().find(is_first).or(depends.first());
        let ring: Vec<_> = ring.iter().map(|&layer| layers[layer].name.as_str()).collect();
        return Err(first.map_or(spec, |depend| elements[depend]).refuse(format!(
            "layers wait for each other: {}; take one <depend> out",
            ring.join(" -> ")
        )));
    }
    Ok(depends)
}

fn depend(
    element: &Element,
    job: &str,
    prefix: &str,
    names: &HashMap<&str, usize>,
) -> Result<Depend, Refusal> {
    let kind = match element.attribute("type") {
        Some("LAYER_ON_LAYER") => DependKind::LayerOnLayer,
        Some("FRAME_BY_FRAME") => DependKind::FrameByFrame,
        other => {
            return Err(element.refuse(format!(
                "dependences {} are for Cuebot alone; write LAYER_ON_LAYER or FRAME_BY_FRAME",
                other.unwrap_or_default()
            )));
        }
    };
    if element.attribute("anyframe").is_some_and(|any| any.eq_ignore_ascii_case("true")) {
        return Err(
            element.refuse("to wait for any frame is for Cuebot alone; write anyframe=\"False\"")
        );
    }
    if let Some(frame) = element.child("depframe").or(element.child("onframe")) {
        return Err(frame.refuse("a dependence is between layers here; take this frame out"));
    }
    for name in ["depjob", "onjob"] {
        let child = element.child(name).unwrap_or(element);
        if job_name(child, required(element, name)?, prefix)? != job {
            return Err(child.refuse(format!("<{name}> is not the job of this file, {job}")));
        }
    }
    let layer = |name| -> Result<usize, Refusal> {
        let child = element.child(name).unwrap_or(element);
        let conformed = conformed(child, "layer", required(element, name)?)?;
        let place = names.get(conformed.as_str()).copied();
        place.ok_or_else(|| child.refuse(format!("the job has no layer {conformed}")))
    };
    Ok(Depend { layer: layer("deplayer")?, on: layer("onlayer")?, kind })
}
