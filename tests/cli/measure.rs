//! `candelabra measure`: what it writes, what it keeps, what it refuses.

use crate::files::{SCENE, Shot};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Small and quick.
const SMALL: &str =
    "--res 12x8 --budgets 2,4 --seeds 2 --reference-spp 16 --probes 8 --cache cache";

fn report(shot: &Shot, arguments: &str) -> Value {
    let told = shot.candelabra(&format!("measure {SCENE} {SMALL} {arguments} --json -")).ends(0);
    serde_json::from_str(&told.out).unwrap()
}

#[test]
fn every_form_tells_the_same() {
    let shot = Shot::still();
    let files = "--json r.json --csv r.csv --html deep/r.html --svg r.svg";
    let told = shot.candelabra(&format!("measure {SCENE} {SMALL} {files}")).ends(0);
    let told =
        told.says("exact variance of picking").says("To reach error 0.05: ").says("tree:0.5");
    let report: Value = serde_json::from_slice(&shot.read("r.json")).unwrap();
    let trade = &report["trade"];
    // There are few lights: seven ways of two budgets.
    let rows = trade["rows"].as_array().unwrap();
    assert_eq!((rows.len(), trade["curves"].as_array().unwrap().len()), (14, 7));
    assert!(told.out.ends_with(&format!("{}\n", trade["recommendation"].as_str().unwrap())));
    assert!(rows.iter().any(|row| row["is_on_frontier"] == true));
    assert!(rows.iter().all(|row| row["seconds"].as_f64().unwrap() > 0.0));
    let text = |name: &str| String::from_utf8(shot.read(name)).unwrap();
    let csv = text("r.csv");
    assert_eq!(csv.lines().count(), 15);
    for (line, row) in csv.lines().skip(1).zip(rows) {
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!(fields[0], row["way"]["strategy"].as_str().unwrap());
        assert_eq!(fields[5].parse::<f64>().unwrap(), row["error"].as_f64().unwrap());
    }
    let (html, svg) = (text("deep/r.html"), text("r.svg"));
    assert!(svg.starts_with("<svg xmlns") && svg.contains(">tree<"));
    // Seven pictures and the reference; seven maps of error.
    let shots = html.split("class=\"shots\"").nth(1).unwrap().split("</div>").next().unwrap();
    assert_eq!(shots.matches("<img").count(), 8);
    assert_eq!(html.matches("class=\"heat\"").count(), 7);
    assert!(html.contains("class=\"chart\"") && html.contains("the reference"));
}

#[test]
fn a_second_run_renders_nothing_unless_it_is_told_to() {
    let shot = Shot::still();
    let ways = "tree:0 uniform@8";
    let first = report(&shot, ways);
    let names: Vec<&str> = first["trade"]["rows"]
        .as_array()
        .unwrap()
        .iter()
        .map(|r| r["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["tree:0@2", "tree:0@4", "uniform@8"]);
    let seconds = |report: &Value| -> Vec<f64> {
        let rows = report["trade"]["rows"].as_array().unwrap().iter();
        rows.map(|row| row["seconds"].as_f64().unwrap()).collect()
    };
    // No two renders take the same time to the nanosecond, let alone six; reading JSON rounds the last bit.
    let are_same = |a: &Value, b: &Value| {
        seconds(a).iter().zip(seconds(b)).all(|(a, b)| (a / b - 1.0).abs() < 1e-12)
    };
    assert!(are_same(&report(&shot, ways), &first));
    let fresh = report(&shot, &format!("{ways} --fresh"));
    assert!(!are_same(&fresh, &first));
    let errors = |report: &Value| {
        let rows = report["trade"]["rows"].as_array().unwrap().clone();
        rows.into_iter().map(|row| row["errors"].clone()).collect::<Vec<_>>()
    };
    assert_eq!(errors(&fresh), errors(&first));
    // Another scene under the same name is another scene.
    let mut shot = shot;
    shot.edit(|json| json["nodes"][1]["translation"] = serde_json::json!([1, 0, 1]));
    assert_ne!(errors(&report(&shot, ways)), errors(&first));
}

/// What an error buys stands beside numbers of samples, in every form.
#[test]
fn an_error_can_be_asked_for_in_the_place_of_samples() {
    let shot = Shot::still();
    let told = shot
        .candelabra(&format!("measure {SCENE} {SMALL} tree tree@0.5 --csv r.csv --html r.html"))
        .ends(0)
        .says("tree@0.5 ")
        .says("tree --error ");
    assert!(told.out.contains("\ntree "), "{}", told.out);
    let text = |name: &str| String::from_utf8(shot.read(name)).unwrap();
    let csv = text("r.csv");
    let ends: Vec<&str> =
        csv.lines().skip(1).map(|line| line.rsplit(',').next().unwrap()).collect();
    assert_eq!(ends, ["", "", "0.5"]);
    assert!(text("r.html").contains("tree --error") && text("r.html").contains("tree@0.5"));
    let rows = report(&shot, "tree tree@0.5")["trade"]["rows"].clone();
    assert_eq!((&rows[0]["samples"], rows[0].get("asked")), (&2.into(), None));
    assert_eq!(rows[2]["asked"], 0.5);
    assert!(rows[2]["samples"].as_u64().unwrap() >= 8, "{rows}");
}

#[test]
fn exact_variances_alone_render_and_keep_nothing() {
    let shot = Shot::still();
    let exact = format!("measure {SCENE} --exact --probes 16");
    let told = shot.candelabra(&exact).ends(0).says("tree:0.5").says("exhaustive");
    told.keeps_quiet_about("To reach");
    assert_eq!(shot.names(), [SCENE]);
    let told = shot.candelabra(&format!("{exact} tree:0.3:solid-angle uniform --json -")).ends(0);
    let report: Value = serde_json::from_str(&told.out).unwrap();
    assert_eq!(report["trade"], Value::Null);
    let rows = report["exact"]["strategies"].as_array().unwrap();
    let names: Vec<&str> = rows.iter().map(|row| row["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["tree:0.3:solid-angle", "uniform"]);
    for row in rows {
        let [variance, error] = ["variance", "error"].map(|name| row[name].as_f64().unwrap());
        assert!((error * error - variance).abs() < 1e-12);
    }
}

#[test]
fn nonsense_is_refused_before_any_work() {
    let shot = Shot::still();
    for wrong in [
        "trees",
        "tree:nan",
        "tree@0",
        "tree@1.5",
        "uniform:0.5",
        "--error 0",
        "--error nan",
        "--grey -1",
        "--budgets 0",
        "--exact --svg a.svg",
        "--frames 1-2",
        "--shot --frame 1",
        "--shot tree",
    ] {
        shot.candelabra(&format!("measure {SCENE} {wrong}")).ends(2);
    }
    shot.candelabra("race x").ends(2);
    let both = shot.candelabra(&format!("measure {SCENE} --json - --csv -")).ends(1);
    both.complains(&["standard output"]);
    for own in ["--html", "--json", "--svg"] {
        shot.candelabra(&format!("measure {SCENE} {own} ./{SCENE}"))
            .ends(1)
            .complains(&["another name"]);
    }
    assert_eq!(shot.names(), [SCENE]);
}

#[test]
fn a_shot_is_told_beforehand() {
    let shot = Shot::moving();
    let command =
        format!("measure {SCENE} --shot --res 48x32 --depth 1 --frames 1-25 --every 8 --error 0.2");
    let told = shot.candelabra(&command).ends(0);
    told.says("25 frames to error 0.2 (14 dB)").says("render with --error 0.2 --grey ");
    let told = shot.candelabra(&format!("{command} --json -")).ends(0);
    let cost: Value = serde_json::from_str(&told.out).unwrap();
    let numbers = |key: &str| -> Vec<i64> {
        let list = cost[key].as_array().unwrap().iter();
        list.map(|row| row.get("frame").or(row.get(0)).unwrap().as_i64().unwrap()).collect()
    };
    assert_eq!(numbers("pilots"), [1, 9, 17, 25]);
    assert_eq!(numbers("frames"), (1..=25).collect::<Vec<_>>());
    let seconds = cost["frames"].as_array().unwrap().iter().map(|row| row[1].as_f64().unwrap());
    assert!((seconds.sum::<f64>() - cost["seconds"].as_f64().unwrap()).abs() < 1e-9);
    // A smaller error takes more samples, on every frame.
    let told = shot
        .candelabra(&format!("{command} --error 0.005 --json -").replace("--error 0.2 ", ""))
        .ends(0);
    let finer: Value = serde_json::from_str(&told.out).unwrap();
    let samples = |cost: &Value| -> Vec<f64> {
        cost["pilots"]
            .as_array()
            .unwrap()
            .iter()
            .map(|row| row["samples"].as_f64().unwrap())
            .collect()
    };
    assert!(samples(&finer).iter().zip(samples(&cost)).all(|(fine, coarse)| *fine > coarse));
    assert_eq!(shot.names(), [SCENE]);
}

/// The results below a folder.
fn results(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut found: Vec<(String, Vec<u8>)> = entries
        .map(|entry| entry.unwrap().path())
        .flat_map(|path| match path.is_dir() {
            true => results(&path),
            false if path.extension().is_some_and(|e| e == "json") => {
                vec![(path.display().to_string(), std::fs::read(&path).unwrap())]
            }
            false => Vec::new(),
        })
        .collect();
    found.sort();
    found
}

#[cfg(unix)]
#[test]
fn a_signal_leaves_a_cache_that_can_be_gone_on_with() {
    let shot = Shot::still();
    let command = |seeds: u32| {
        let text = format!(
            "measure {SCENE} tree uniform --res 12x8 --budgets 2 --seeds {seeds} --probes 0 --cache cache"
        );
        let mut command = Command::new(env!("CARGO_BIN_EXE_candelabra"));
        command.current_dir(shot.path(".")).args(text.split_whitespace());
        command
    };
    let (out, err) = (Stdio::null(), Stdio::piped());
    let mut child = command(60_000).stdout(out).stderr(err).spawn().unwrap();
    let end = Instant::now() + Duration::from_secs(60);
    while results(&shot.path("cache")).len() < 8 {
        assert!(Instant::now() < end, "nothing is kept");
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(
        Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success()
    );
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert!(String::from_utf8_lossy(&output.stderr).contains("goes on from there"));
    let before = results(&shot.path("cache"));
    assert!(before.iter().all(|(_, json)| serde_json::from_slice::<Value>(json).is_ok()));
    assert!(command(4).output().unwrap().status.success());
    assert_eq!(results(&shot.path("cache")), before, "all eight pictures were there");
}
