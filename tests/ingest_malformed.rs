//! Files that others collected because they broke something.

#[path = "ingest/shared.rs"]
mod shared;

use candelabra::ingest::load;
use serde_json::Value;
use std::path::Path;

/// Errors of the Khronos validator that are none here, each with the reason. A file is excused if
/// all its errors are.
const HARMLESS: &[(&str, &str)] = &[];

/// Files without errors for the Khronos validator that are refused here, each with the reason.
const STRICTER: &[(&str, &str)] = &[];

struct Verdict {
    codes: Vec<String>,
}

fn verdict(file: &Path) -> Option<Verdict> {
    let report = std::fs::read(format!("{}.report.json", file.display())).ok()?;
    let report: Value = serde_json::from_slice(&report).unwrap();
    let messages = report["issues"]["messages"].as_array().cloned().unwrap_or_default();
    let errors = messages.iter().filter(|message| message["severity"] == 0);
    let codes = errors.map(|message| message["code"].as_str().unwrap().to_string()).collect();
    Some(Verdict { codes })
}

#[test]
fn gltf_verdicts_agree_with_the_khronos_validator() {
    let Some(folder) = shared::folder("real/malformed") else { return };
    let mut disagreements = Vec::new();
    let mut judged = 0;
    for file in shared::files_below(&folder) {
        if !matches!(file.extension().and_then(|e| e.to_str()), Some("gltf" | "glb")) {
            continue;
        }
        let result = load(&file);
        let Some(verdict) = verdict(&file) else {
            println!("no verdict: {} {:?}", file.display(), result.map(|s| s.notes));
            continue;
        };
        judged += 1;
        let name = file.strip_prefix(&folder).unwrap().display().to_string();
        match (result, verdict.codes.is_empty()) {
            (Ok(_), true) | (Err(_), false) => {}
            (Ok(_), false) => {
                let harmless = |code: &String| HARMLESS.iter().any(|(known, _)| known == code);
                if !verdict.codes.iter().all(harmless) {
                    disagreements.push(format!("{name} loads, but has {:?}", verdict.codes));
                }
            }
            (Err(error), true) => {
                if !STRICTER.iter().any(|(known, _)| name.ends_with(known)) {
                    disagreements.push(format!("{name} should load: {error}"));
                }
            }
        }
    }
    assert!(judged > 200, "only {judged} files with a verdict below {}", folder.display());
    assert!(disagreements.is_empty(), "{}", disagreements.join("\n"));
}
