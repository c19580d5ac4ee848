//! From the elements of a job file to a job: what each means to Cuebot, and what of it is refused.

use super::cjsl::{self, Element, Refusal};
use super::job::{Depend, DependKind, Job, Layer, LayerKind};
use super::{order, range, tokens};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Cuebot takes no more layers in a job.
const MOST_LAYERS: usize = 1000;
/// No timeout is longer than this: a year of minutes.
const LONGEST_TIMEOUT: u64 = 366 * 24 * 60;

/// The job that a file's text describes; its commands run in `root`.
///
/// # Errors
/// The first thing that is wrong.
pub fn from_text(text: &str, path: &Path, root: &Path) -> Result<Job, Refusal> {
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
