//! A run that is stopped: the command hears it, what it makes of it is awaited, and the run can go on.

use crate::job_file::{Folder, Told, job};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

fn wait_for(path: &Path) {
    let end = Instant::now() + Duration::from_secs(60);
    while !path.exists() {
        assert!(Instant::now() < end, "{} never appears", path.display());
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Starts the job, sends signals once it is under way, and returns what was said.
fn stopped_by(folder: &Folder, signals: &[&str]) -> Told {
    stop(folder.command("run tested.xml"), folder, signals)
}

fn stop(mut command: Command, folder: &Folder, signals: &[&str]) -> Told {
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for(&folder.path("started"));
    for signal in signals {
        let status =
            Command::new("kill").args([signal, &*child.id().to_string()]).status().unwrap();
        assert!(status.success());
        // Two signals at once are one.
        std::thread::sleep(Duration::from_millis(300));
    }
    Told::from(child.wait_with_output().unwrap())
}

#[test]
fn a_command_that_is_stopped_cleans_up_and_the_run_says_how_to_go_on() {
    let command = "trap 'touch cleaned; exit 3' INT TERM; touch started; test -e go || while :; do sleep 0.05; done";
    let layers = [("long", command, "1-2", 1), ("next", "touch next", "1", 1)];
    for (signal, code) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        let folder = Folder::with(&job(&layers, &[]));
        let told = stopped_by(&folder, &[signal]);
        assert_eq!(told.code, Some(code), "{told:#?}");
        assert_eq!(folder.path("cleaned").exists(), signal != "-HUP");
        assert!(!folder.path("next").exists());
        for line in
            ["0001-long not done", "0002-long not done", "go on with: candelabra run tested.xml"]
        {
            assert!(told.err.contains(line), "no '{line}' in {told:#?}");
        }
        folder.write("go", "");
        folder.ends("run tested.xml", 0);
        assert!(folder.path("next").exists());
    }
}

#[test]
fn a_command_that_ends_well_in_spite_of_a_signal_has_done_its_work() {
    let command = "trap 'touch work; exit 0' TERM; touch started; while :; do sleep 0.05; done";
    let folder =
        Folder::with(&job(&[("long", command, "1", 1), ("next", "touch next", "1", 1)], &[]));
    let told = stopped_by(&folder, &["-TERM"]);
    assert_eq!(told.code, Some(143), "{told:#?}");
    assert!(
        told.err.contains("1 of 2 tasks done") && told.err.contains("--layer next"),
        "{told:#?}"
    );
}

#[test]
fn a_run_under_nohup_outlives_its_terminal() {
    let folder = Folder::with(&job(
        &[("long", "touch started; sleep 1", "1", 1), ("next", "touch next", "1", 1)],
        &[],
    ));
    let mut command = Command::new("sh");
    let ignoring = format!("trap '' HUP; exec {} run tested.xml", env!("CARGO_BIN_EXE_candelabra"));
    command.current_dir(folder.0.path()).args(["-c", &ignoring]);
    let told = stop(command, &folder, &["-HUP"]);
    assert_eq!(told.code, Some(0), "{told:#?}");
    assert!(folder.path("next").exists());
}

#[test]
fn a_folder_that_is_stopped_tells_what_was_not_begun_and_goes_on_as_a_whole() {
    let text = |name: &str, command: &str| {
        job(&[("only", command, "1-2", 1)], &[]).replace("tested", name)
    };
    let folder = Folder::with("");
    std::fs::remove_file(folder.path("tested.xml")).unwrap();
    let long = "echo b >> trace; touch ../started; test -e go || while :; do sleep 0.05; done";
    for (name, command) in [
        ("job_a", "echo a >> trace"),
        ("job_b", long),
        ("job_c", "echo c >> trace"),
        ("job_d", "true"),
    ] {
        folder.write(&format!("shots/{name}.xml"), &text(name, command));
    }
    let told = stop(folder.command("run shots --frames 1 --progress none"), &folder, &["-TERM"]);
    assert_eq!(told.code, Some(143), "{told:#?}");
    let (job_b, rest) = told.err.split_once("  job_c not begun: the run was stopped\n").unwrap();
    assert!(
        job_b.contains("go on with: candelabra run shots/job_b.xml --layer only --frames 1\n"),
        "{job_b}"
    );
    let again = "candelabra run shots --frames 1";
    assert_eq!(
        rest,
        format!("  job_d not begun: the run was stopped\ngo on with all jobs: {again}\n")
    );
    folder.write("shots/go", "");
    folder.ends(again.strip_prefix("candelabra ").unwrap(), 0);
    assert_eq!(folder.read("shots/trace"), "a\nb\na\nb\nc\n");
}

#[test]
fn a_second_signal_kills_what_does_not_listen() {
    let command = "trap '' INT TERM; touch started; while :; do sleep 0.05; done";
    let folder = Folder::with(&job(&[("deaf", command, "1", 1)], &[]));
    let told = stopped_by(&folder, &["-INT", "-INT"]);
    assert_eq!(told.code, Some(130), "{told:#?}");
}
