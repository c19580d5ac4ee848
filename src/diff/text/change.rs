//! One change as a sentence.

use crate::diff::{Change, Difference, Kind, LightCard, Relinked, RelinkedFilter, Verb};
use crate::page::{Short, Triple, counted};

/// What is said of a change after its path.
pub fn details(change: &Change) -> String {
    let mut parts: Vec<String> = Vec::new();
    match (change.verb, &change.before, &change.after) {
        (Verb::Added, _, Some(card)) | (Verb::Removed, Some(card), _) => {
            parts.push(described(card))
        }
        (Verb::Renamed, Some(before), _) => parts.push(format!("was {}", before.path)),
        _ => {}
    }
    let cards = [&change.before, &change.after];
    let infinite = cards.into_iter().flatten().any(LightCard::is_infinite);
    parts.extend(change.differences.iter().map(|difference| amount(difference, infinite)));
    parts.join(", ")
}

/// A whole light.
fn described(card: &LightCard) -> String {
    let kind = card.kind.map_or("light", Kind::name);
    let energy = Short(card.energy.into());
    match card.place {
        Some(place) => {
            let emitters = counted(card.emitters as usize, "emitter");
            format!("{kind}, {emitters}, {energy} cd at {}", Triple(place.center_m))
        }
        None => format!("{kind}, {energy} {}", unit(card.is_infinite())),
    }
}

fn unit(infinite: bool) -> &'static str {
    if infinite { "lux" } else { "cd" }
}

fn amount(difference: &Difference, infinite: bool) -> String {
    let short = |value: f32| Short(value.into());
    match *difference {
        Difference::Transform { moved_m, turned_deg, scaled } => {
            let parts = [
                (moved_m != 0.0).then(|| format!("moved {} m", short(moved_m))),
                (turned_deg != 0.0).then(|| format!("turned {} deg", short(turned_deg))),
                (scaled != 1.0).then(|| format!("scaled by {}", short(scaled))),
            ];
            let parts: Vec<String> = parts.into_iter().flatten().collect();
            if parts.is_empty() { "transform rounded".into() } else { parts.join(", ") }
        }
        Difference::Topology { before, after } if before == after => {
            format!("topology: {} of another shape", counted(after as usize, "emitter"))
        }
        Difference::Topology { before, after } => {
            format!("topology {before} -> {}", counted(after as usize, "emitter"))
        }
        Difference::Energy { before, after, stops } => {
            let stops = stops.map_or(String::new(), |stops| {
                format!(" (x{}, {stops:+.2} stops)", short(after / before))
            });
            format!("energy {} -> {} {}{stops}", short(before), short(after), unit(infinite))
        }
        Difference::Color { before, after } => {
            let hue =
                |hue: Option<[f32; 3]>| hue.map_or("unknown".into(), |h| Triple(h).to_string());
            format!("colour {} -> {}", hue(before), hue(after))
        }
        Difference::Cone { before_deg, after_deg } => {
            format!("cone {} -> {} deg", short(before_deg), short(after_deg))
        }
        Difference::Kind { before, after } => {
            let name = |kind: Option<Kind>| kind.map_or("unknown", Kind::name);
            format!("kind {} -> {}", name(before), name(after))
        }
        Difference::Range { before_m, after_m } => {
            let reach =
                |m: Option<f32>| m.map_or("unlimited".into(), |m| format!("{} m", short(m)));
            format!("range {} -> {}", reach(before_m), reach(after_m))
        }
        Difference::Forced { after, .. } => {
            if after { "now forced" } else { "no longer forced" }.into()
        }
        Difference::Response { before, after } => {
            let told = ["diffuse", "specular"].into_iter().zip(before.into_iter().zip(after));
            let told = told.filter(|(_, (before, after))| before != after);
            let told = told.map(|(name, (before, after))| {
                format!("{name} multiplier {} -> {}", short(before), short(after))
            });
            told.collect::<Vec<_>>().join(", ")
        }
        Difference::LightLink { ref prims } => format!("lights {}", relinked(prims.as_ref())),
        Difference::ShadowLink { ref prims } => {
            format!("is shadowed by {}", relinked(prims.as_ref()))
        }
        Difference::FilterLink { ref filters } => {
            let one = |filter: &RelinkedFilter| {
                format!("{} filters for {}", filter.path, relinked(Some(&filter.prims)))
            };
            filters.iter().map(one).collect::<Vec<_>>().join(", ")
        }
        Difference::OverTime { apart: Some(apart), .. } => {
            let parts = [
                (apart.most_moved_m > 0.0).then(|| format!("{} m", short(apart.most_moved_m))),
                (apart.most_stops > 0.0).then(|| format!("{:.2} stops", apart.most_stops)),
            ];
            let parts: Vec<String> = parts.into_iter().flatten().collect();
            let by = if parts.is_empty() { "" } else { ", up to " };
            let frames = counted(apart.frames as usize, "frame");
            let shape = if apart.reshaped > 0 { ", of another shape" } else { "" };
            format!("over time: differs in {frames}{by}{}{shape}", parts.join(" and "))
        }
        Difference::OverTime { before, after, .. } => match (before, after) {
            (false, true) => "now changes with time",
            (true, false) => "no longer changes with time",
            _ => "changes otherwise with time",
        }
        .into(),
        Difference::Pattern => "pattern of its emission".into(),
    }
}

/// Which prims a set holds otherwise than before.
fn relinked(prims: Option<&Relinked>) -> String {
    let Some(Relinked { gained, gained_named, lost, lost_named }) = prims else {
        return "others than before".into();
    };
    let one = |count: usize, named: &[String], word: &str| {
        let more = if count > named.len() { ", ..." } else { "" };
        (count > 0).then(|| format!("{count} {word} ({}{more})", named.join(", ")))
    };
    let parts = [one(*gained, gained_named, "more"), one(*lost, lost_named, "fewer")];
    parts.into_iter().flatten().collect::<Vec<_>>().join(" and ")
}
