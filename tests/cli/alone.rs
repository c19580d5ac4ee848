//! A renderer that is left alone: signals, kills, replaced inputs, full disks, and what a farm hears.
#![cfg(target_os = "linux")]

use crate::files::{SCENE, Shot, Told, picture};
use candelabra::math::random::hash;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

const PROGRAM: &str = env!("CARGO_BIN_EXE_candelabra-render");
const SMALL: &str = "--res 12x8 --depth 1 --threads 1";

/// A render that goes on while the test looks at what it says.
struct Running {
    child: Child,
    out: BufReader<std::process::ChildStdout>,
}

impl Running {
    fn start(shot: &Shot, arguments: &str) -> Running {
        let arguments = format!("{SCENE} {SMALL} --progress json {arguments}");
        let mut child = Command::new(PROGRAM)
            .current_dir(shot.path(""))
            .args(arguments.split_whitespace())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        Running { child, out }
    }

    /// Waits for the first line that holds a text.
    fn until(mut self, text: &str) -> Running {
        let mut line = String::new();
        while !line.contains(text) {
            line.clear();
            assert!(self.out.read_line(&mut line).unwrap() > 0, "it ended before it said {text}");
        }
        self
    }

    fn signal(self, name: &str) -> Running {
        signal(self.child.id(), name);
        self
    }

    fn end(mut self) -> Told {
        let mut out = String::new();
        self.out.read_to_string(&mut out).unwrap();
        let output = self.child.wait_with_output().unwrap();
        let code = output.status.code().or(output.status.signal().map(|signal| -signal));
        Told { code, out, err: String::from_utf8(output.stderr).unwrap() }
    }
}

fn signal(process: u32, name: &str) {
    let sent = Command::new("kill").args([&format!("-{name}"), &process.to_string()]).status();
    assert!(sent.unwrap().success());
}

#[test]
fn a_signal_drops_the_frame_and_keeps_the_finished_ones() {
    for (name, code) in [("TERM", 143), ("INT", 130), ("HUP", 129)] {
        let shot = Shot::moving();
        // The third frame would take for ever.
        shot.render("--frames 1-2 -o a.#.exr --spp 4").ends(0);
        let whole = shot.read("a.2.exr");
        let slow =
            Running::start(&shot, "--frames 3 -o b.#.exr --spp 400000000").until("preparing");
        let told = slow.signal(name).end();
        assert_eq!(told.code, Some(code), "{told:?}");
        told.complains(&["stopped", "0 of 1 frames", "--resume"]);
        assert_eq!(shot.names(), ["a.1.exr", "a.2.exr", SCENE], "nothing is left of the frame");
        assert!(shot.read("a.2.exr") == whole);
    }
}

/// A shell without job control starts background jobs deaf to Ctrl-C. What comes before the program listens is lost.
#[test]
fn a_background_job_hears_an_interrupt() {
    let shot = Shot::still();
    let script = format!(
        "said=$(mktemp); {PROGRAM} {SCENE} {SMALL} --progress json --spp 400000000 -o a.exr > $said & child=$!; \
         until grep -q preparing $said; do sleep 0.1; kill -0 $child || break; done; \
         kill -INT $child; wait $child; code=$?; rm $said; exit $code"
    );
    let status = Command::new("sh").current_dir(shot.path("")).args(["-c", &script]).status();
    assert_eq!(status.unwrap().code(), Some(130));
    assert_eq!(shot.names(), [SCENE]);
}

/// Killed again and again at any moment, and resumed: the files of an undisturbed run, and no other.
#[test]
fn a_shot_survives_kills() {
    kill_and_resume(12);
}

#[test]
#[ignore = "takes minutes; scripts/long_tests.sh runs it"]
fn a_shot_survives_a_hundred_kills() {
    kill_and_resume(100);
}

fn kill_and_resume(kills: u32) {
    let shot = Shot::moving();
    let frames = "--frames 1-24 --spp 16 --png --resume --progress none";
    shot.render(&format!("{frames} --res 12x8 -o whole/a.#.exr")).ends(0);
    let run = |target: &str| {
        let arguments = format!("{SCENE} {SMALL} {frames} -o {target}/a.#.exr");
        let mut command = Command::new(PROGRAM);
        command.current_dir(shot.path("")).args(arguments.split_whitespace());
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    for kill in 0..kills {
        let mut child = run("killed");
        std::thread::sleep(Duration::from_millis(u64::from(hash(kill, 1) % 150)));
        signal_or_done(&mut child, ["KILL", "TERM", "INT"][kill as usize % 3]);
        let _ = child.wait().unwrap();
        // Some work is undone, or there would soon be nothing to kill.
        let lost = shot.path(&format!("killed/a.{}.exr", 1 + hash(kill, 2) % 24));
        let _ = std::fs::remove_file(lost);
    }
    assert!(run("killed").wait().unwrap().success());
    let files = |folder: &str| {
        let entries = std::fs::read_dir(shot.path(folder)).unwrap().map(Result::unwrap);
        let read = |path: std::path::PathBuf| std::fs::read(path).unwrap();
        let mut files: Vec<_> =
            entries.map(|entry| (entry.file_name(), read(entry.path()))).collect();
        files.sort();
        files
    };
    let (whole, killed) = (files("whole"), files("killed"));
    assert_eq!(whole.len(), 48);
    for (whole, killed) in whole.iter().zip(&killed) {
        assert!(whole == killed, "{:?} {:?}", whole.0, killed.0);
    }
    assert_eq!(whole.len(), killed.len());
}

fn signal_or_done(child: &mut Child, name: &str) {
    if child.try_wait().unwrap().is_none() {
        signal(child.id(), name);
    }
}

/// A scene that is published while a render has read the one before: its pictures are of the old one, and
/// say so.
#[test]
fn a_picture_has_the_stamp_of_what_was_read() {
    let mut shot = Shot::moving();
    let arguments = "--resume -o a.exr --spp 2000";
    let running = Running::start(&shot, arguments).until("looking at the light tree");
    shot.edit(|json| json["materials"][1]["emissiveFactor"] = json!([0, 1, 0]));
    assert_eq!(running.end().code, Some(0));
    let old = picture(&shot.path("a.exr")).unwrap();
    let is_red = |pixels: &[[f32; 3]]| pixels.iter().any(|pixel| pixel[0] > 0.0);
    assert!(is_red(&old));
    shot.render(arguments).ends(0).keeps_quiet_about("up to date");
    assert!(!is_red(&picture(&shot.path("a.exr")).unwrap()));
    shot.render(arguments).ends(0).says("up to date");
}

/// `cp` over a tree or a table in use: the wrong way to publish. No frame gets a stamp of what was not sampled.
#[test]
fn a_file_that_is_written_to_while_it_is_in_use_is_told() {
    let shot = Shot::moving();
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    shot.candelabra(&format!("learn {SCENE} --tree shot.ltree --rays 0.01")).ends(0);
    for name in ["shot.ltree", "shot.lvis"] {
        write_to_while_in_use(&shot, name);
    }
}

fn write_to_while_in_use(shot: &Shot, name: &str) {
    let whole = shot.read(name);
    let begin = || {
        let arguments = "--tree shot.ltree --learned shot.lvis --frames 1-4 -o a.#.exr --spp 4000";
        Running::start(shot, arguments).until("preparing")
    };
    // Of the same bytes, and shorter: with pages that nobody can read any more.
    for length in [whole.len(), 64] {
        let running = begin();
        let file = std::fs::File::create(shot.path(name)).unwrap();
        std::io::Write::write_all(&mut &file, &whole[..length]).unwrap();
        let told = running.end();
        assert_eq!(told.code, Some(3), "{told:?}");
        told.complains(&["in use", "rename it over the old one", "--resume"]);
        assert!(shot.names().iter().all(|name| !name.ends_with(".exr")), "{:?}", shot.names());
        shot.write(name, &whole);
    }
    // The right way: those who have the old one keep it.
    let running = begin();
    shot.write("other", &whole[..64]);
    std::fs::rename(shot.path("other"), shot.path(name)).unwrap();
    assert_eq!(running.end().code, Some(0));
    shot.write(name, &whole);
    (1..=4).for_each(|frame| std::fs::remove_file(shot.path(&format!("a.{frame}.exr"))).unwrap());
}

#[test]
fn files_are_as_open_as_the_mask_says() {
    use std::os::unix::fs::PermissionsExt;
    let shot = Shot::still();
    for (mask, mode) in [("022", 0o644), ("027", 0o640), ("002", 0o664)] {
        let script = format!("umask {mask}; {PROGRAM} {SCENE} {SMALL} --spp 1 --png -o {mask}.exr");
        let status = Command::new("sh").current_dir(shot.path("")).args(["-c", &script]).output();
        assert!(status.unwrap().status.success());
        for kind in ["exr", "png"] {
            let there = std::fs::metadata(shot.path(&format!("{mask}.{kind}"))).unwrap();
            assert_eq!(there.permissions().mode() & 0o777, mode, "{mask} {kind}");
        }
    }
}

/// Where no file may grow beyond 2 KiB, nothing is rendered: it would take for ever.
#[test]
fn a_full_disk_is_found_before_a_frame_is_rendered() {
    let shot = Shot::moving();
    let run = |spp: &str, frames: &str| {
        let script = format!(
            "trap '' XFSZ; ulimit -f 2; exec {PROGRAM} {SCENE} --res 256x192 --depth 1 --threads 1 \
             --spp {spp} --frames {frames} -o a.#.exr"
        );
        let mut command = assert_cmd::Command::new("bash");
        let output = command.current_dir(shot.path("")).args(["-c", &script]).output().unwrap();
        let [out, err] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
        Told { code: output.status.code(), out, err }
    };
    let told = run("400000000", "1-3").ends(1);
    told.complains(&["a.1.exr", "cannot be written", "free some space"]);
    assert_eq!(shot.names(), [SCENE]);
}

#[test]
fn farms_hear_what_they_understand() {
    let shot = Shot::moving();
    let lines = |form: &str| {
        let told = shot.render(&format!("--frames 1-2 -o {form}.#.exr --progress {form}")).ends(0);
        told.out.lines().map(String::from).collect::<Vec<_>>()
    };
    let percents = |prefix: &str, lines: &[String]| -> Vec<f64> {
        let numbers = lines.iter().filter_map(|line| line.strip_prefix(prefix));
        numbers.map(|number| number.trim_end_matches('%').parse().unwrap()).collect()
    };
    for (form, prefix) in [("alfred", "ALF_PROGRESS "), ("openjd", "openjd_progress: ")] {
        let told = percents(prefix, &lines(form));
        assert!(told.len() > 2 && told.is_sorted(), "{told:?}");
        assert_eq!(told.last(), Some(&100.0));
    }
    let events: Vec<Value> =
        lines("json").iter().map(|line| serde_json::from_str(line).unwrap()).collect();
    let named = |name: &str| events.iter().filter(|event| event["event"] == name).count();
    assert_eq!((named("frame-done"), named("stage")), (2, 3), "{events:?}");
    let done: Vec<f64> = events.iter().filter_map(|event| event["done"].as_f64()).collect();
    assert!(done.is_sorted() && done.last() == Some(&1.0), "{done:?}");
    assert!(lines("none").is_empty());
    let built = || shot.candelabra("build shot.gltf --progress json").ends(0).out;
    assert!(built().contains(r#"{"event":"stage","name":"building the trees"}"#));
    assert!(built().contains(r#"{"event":"up-to-date","frame":null,"output":"shot.ltree"}"#));
}

#[test]
fn statistics_count_frames_and_account_for_the_time() {
    let shot = Shot::moving();
    shot.render("--frames 1 -o a.#.exr").ends(0);
    let told = shot.render("--frames 1-3 -o a.#.exr --resume --stats=json").ends(0);
    let stats: Value = serde_json::from_str(told.out.lines().last().unwrap()).unwrap();
    let frames = json!({"asked": 3, "done": 2, "up_to_date": 1, "failed": 0});
    assert_eq!(stats["frames"], frames);
    assert_eq!(stats["stopped"], false);
    assert!(stats["peak_memory_bytes"].as_u64().unwrap() > 1 << 20);
    assert!(stats["rays"].as_u64().unwrap() > 0);
    let seconds = stats["seconds"].as_object().unwrap();
    let second = |name: &str| seconds[name].as_f64().unwrap();
    // All but what another thread did beside.
    let parts: f64 = seconds.keys().map(|name| second(name)).sum();
    let parts = parts - second("total") - second("writing");
    assert!(parts <= second("total") && parts > 0.5 * second("total"), "{seconds:?}");
}

#[test]
fn frames_that_may_not_be_meant_are_noted() {
    let shot = Shot::moving();
    shot.render("-o a.exr").ends(0).complains(&["1-25", "--frames"]);
    let told = shot.render("-o a.#.exr --frames 24-26").ends(0);
    told.complains(&["1 of the frames", "outside its own, 1-25"]);
    let told = Shot::still().render("-o a.exr").ends(0);
    assert!(told.err.is_empty(), "{told:?}");
}
