//! A job carried out here: order, tokens, logs, failures, retries, parts of a job.

use crate::job_file::{Folder, JOB, job};

/// Each task adds a line to a file.
fn trace(name: &str) -> String {
    format!("echo {name} #FRAMESPEC# >> trace")
}

#[test]
fn tasks_are_carried_out_in_the_order_of_their_dependences() {
    let [a, b, c] = ["a", "b", "c"].map(trace);
    let folder = Folder::with(&job(
        &[("last", &c, "1", 1), ("middle", &b, "1-5", 2), ("first", &a, "1", 1)],
        &[("last", "LAYER_ON_LAYER", "middle"), ("middle", "LAYER_ON_LAYER", "first")],
    ));
    let told = folder.ends("run tested.xml", 0);
    assert_eq!(folder.read("trace"), "a 1\nb 1-2\nb 3-4\nb 5\nc 1\n");
    assert!(told.out.ends_with("tested: 5 of 5 tasks done\n"), "{told:#?}");
    // One log a task, with what was run.
    assert!(folder.read("out/logs/tested/0003-middle.rqlog").contains("echo b 3-4"));
}

#[test]
fn a_dry_run_prints_what_a_run_runs() {
    let folder = Folder::with(&job(&[("only", &trace("#LAYER#"), "1001-1003", 2)], &[]));
    let commands = folder.ends("run tested.xml --dry-run", 0).out;
    assert!(!folder.path("trace").exists() && !folder.path("out").exists());
    let printed: Vec<_> = commands.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(printed, ["echo only 1001-1002 >> trace", "echo only 1003 >> trace"]);
    folder.ends("run tested.xml", 0);
    assert_eq!(folder.read("trace"), "only 1001-1002\nonly 1003\n");
}

#[test]
fn tokens_and_environment_are_those_of_opencue() {
    let command = "echo #ZFRAME# #IFRAME# #FRAME_START# #FRAME_END# #FRAME_CHUNK# #FRAMESPEC# #FRAME# #LAYER# #JOB#; \
                   echo $CUE_FRAME $CUE_IFRAME $CUE_LAYER $CUE_JOB $CUE_RANGE $CUE_CHUNK $CUE_SHOW $CUE_SHOT $CUE_THREADS $MINE";
    let text = job(&[("paint", command, "7-11x2,20", 3)], &[]);
    let env = "<chunk>3</chunk><cores>3.5</cores><env><key name=\"MINE\">it's</key></env>";
    let folder = Folder::with(&text.replace("<chunk>3</chunk>", env));
    folder.ends("run tested.xml", 0);
    let log = folder.read("out/logs/tested/0007-paint.rqlog");
    let said: Vec<_> = log.lines().filter(|line| !line.starts_with('#')).collect();
    let tokens = "0007 7 7 11 3 7-11x2 0007-paint paint testing-sh010-jane_tested";
    // A task has the machine for itself, whatever it reserves on a farm.
    let threads = std::thread::available_parallelism().unwrap();
    let environment = format!(
        "0007-paint 7 paint testing-sh010-jane_tested 7-11x2,20 3 testing sh010 {threads} it's"
    );
    assert_eq!(said, [tokens, &environment]);
    assert!(
        folder.read("out/logs/tested/0020-paint.rqlog").contains("\n0020 20 20 20 3 20 0020-paint")
    );
}

#[test]
fn commands_run_beside_the_pipelines() {
    let text = job(&[("where", "pwd > here; echo $PWD", "1", 1)], &[]);
    let folder = Folder::with("");
    folder.write("shots/a/pipelines/x.xml", &text);
    folder.write("shots/b/x.xml", &text);
    folder.write("shots/.venv/no_job.xml", "<table/>");
    std::fs::remove_file(folder.path(JOB)).unwrap();
    folder.ends("run shots", 0);
    for root in ["shots/a", "shots/b"] {
        let here = folder.read(&format!("{root}/here"));
        assert_eq!(here.trim_end(), folder.path(root).canonicalize().unwrap().to_str().unwrap());
        assert!(folder.path(&format!("{root}/out/logs/tested/0001-where.rqlog")).exists());
    }
    let elsewhere = folder.path("elsewhere");
    std::fs::create_dir(&elsewhere).unwrap();
    folder.ends(&format!("run shots/b/x.xml --root {}", elsewhere.display()), 0);
    assert!(elsewhere.join("here").exists());
}

#[test]
fn jobs_whose_logs_would_be_mixed_up_are_refused() {
    let text = job(&[("where", &trace("x"), "1", 1)], &[]);
    let folder = Folder::with(&text);
    folder.write("other/tested.xml", &text);
    let logs = folder.path("logs");
    for options in ["--root other", &format!("--logs {}", logs.display()), "--root . --dry-run"] {
        let told = folder.ends(&format!("run . {options}"), 2);
        assert!(told.err.contains("tested.xml: its job is called tested as that of"), "{told:#?}");
    }
    assert!(!folder.path("trace").exists() && !folder.path("other/trace").exists());
    folder.ends("run .", 0);
    folder.write("copy.xml", &text);
    folder.ends("run .", 2);
}

#[test]
fn a_run_in_a_run_is_understood() {
    let inner = job(&[("inner", "true", "1-4", 1)], &[]);
    let command = format!("{} run inner/tested.xml", env!("CARGO_BIN_EXE_candelabra"));
    let folder = Folder::with(&job(&[("outer", &command, "1", 1)], &[]));
    folder.write("inner/tested.xml", &inner);
    let told = folder.ends("run tested.xml --progress json", 0);
    assert!(
        told.out.contains(r#""told":{"done":0.75,"event":"progress","frame":null}"#),
        "{told:#?}"
    );
    // Who wants another form says so, or has it in the environment.
    let mut command = folder.command("run inner/tested.xml");
    let output = command.env("CANDELABRA_PROGRESS", "alfred").output().unwrap();
    assert!(
        String::from_utf8(output.stdout)
            .unwrap()
            .ends_with("ALF_PROGRESS 75%\nALF_PROGRESS 100%\n")
    );
}

#[test]
fn a_reader_of_errors_that_has_gone_ends_nothing() {
    let folder =
        Folder::with(&job(&[("bad", "false", "1", 1), ("after", &trace("after"), "1", 1)], &[]));
    let code = |arguments: &str| {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        folder.command(arguments).stderr(writer).output().unwrap().status.code()
    };
    assert_eq!(code("run tested.xml --retries 1"), Some(1));
    assert_eq!(folder.read("trace"), "after 1\n");
    assert_eq!(code("run nothing.xml"), Some(2));
    assert_eq!(code("build nothing.glb"), Some(1));
    assert_eq!(code("verify nothing.ltree"), Some(2));
}

#[test]
fn a_failure_stops_only_what_waits_for_it_and_the_summary_says_how_to_go_on() {
    let bad = "echo #IFRAME# >> bad; test #IFRAME# -ne 3 || test -e mended";
    let [good, free, after] = ["good", "free", "after"].map(trace);
    let folder = Folder::with(&job(
        &[
            ("good", &good, "1", 1),
            ("bad", bad, "1-4", 1),
            ("by_frame", &trace("by"), "1-4", 2),
            ("after", &after, "1", 1),
            ("free", &free, "1", 1),
        ],
        &[
            ("bad", "LAYER_ON_LAYER", "good"),
            ("by_frame", "FRAME_BY_FRAME", "bad"),
            ("after", "LAYER_ON_LAYER", "by_frame"),
        ],
    ));
    let told = folder.ends("run tested.xml", 1);
    // All frames of the layer are tried, and frames that do not need the bad one are made.
    assert_eq!(folder.read("bad"), "1\n2\n3\n4\n");
    assert_eq!(folder.read("trace"), "good 1\nby 1-2\nfree 1\n");
    for line in [
        "tested: 6 of 9 tasks done",
        "  0003-bad failed: exit code 1; log ",
        "  0003-by_frame not run: it waits for bad",
        "  0001-after not run: it waits for by_frame",
        "go on with: candelabra run tested.xml --layer bad --layer by_frame --layer after",
    ] {
        assert!(told.err.contains(line), "no '{line}' in {told:#?}");
    }
    folder.write("mended", "");
    let again = told.err.lines().last().unwrap().strip_prefix("go on with: candelabra ").unwrap();
    folder.ends(again, 0);
    assert_eq!(folder.read("trace"), "good 1\nby 1-2\nfree 1\nby 1-2\nby 3-4\nafter 1\n");
}

#[test]
fn a_task_that_fails_is_tried_again() {
    let text = job(&[("flaky", "echo x >> tries; test $(wc -l < tries) -ge 3", "1", 1)], &[]);
    let count = |folder: &Folder| folder.read("tries").lines().count();
    let folder = Folder::with(&text);
    folder.ends("run tested.xml", 1);
    assert_eq!(count(&folder), 1);
    let folder = Folder::with(&text);
    let told = folder.ends("run tested.xml --retries 5", 0);
    assert_eq!(count(&folder), 3);
    assert!(told.err.contains("0001-flaky: exit code 1; once more"), "{told:#?}");
    let log = folder.read("out/logs/tested/0001-flaky.rqlog");
    assert_eq!(log.matches("# attempt").count(), 3, "{log}");
    // The job's own wish, which the option overrides.
    let wish = text.replace("<layers>", "<maxretries>2</maxretries><layers>");
    let folder = Folder::with(&wish);
    folder.ends("run tested.xml", 0);
    let folder = Folder::with(&wish);
    folder.ends("run tested.xml --retries 1", 1);
    assert_eq!(count(&folder), 2);
}

#[test]
fn what_would_fail_alike_is_not_tried_again() {
    for (code, tries) in [(1, 3), (2, 1), (3, 3), (4, 3)] {
        let command = format!("echo x >> tries; exit {code}");
        let folder = Folder::with(&job(&[("fails", &command, "1", 1)], &[]));
        let told = folder.ends("run tested.xml --retries 2", 1);
        assert_eq!(folder.read("tries").lines().count(), tries, "{told:#?}");
    }
}

#[test]
fn parts_of_a_job_are_chosen_by_layer_and_frame() {
    let [a, b, c] = ["a", "b", "c"].map(trace);
    let folder = Folder::with(&job(
        &[("one", &a, "1", 1), ("two", &b, "1-10", 2), ("three", &c, "1", 1)],
        &[("two", "LAYER_ON_LAYER", "one"), ("three", "LAYER_ON_LAYER", "two")],
    ));
    folder.ends("run tested.xml --frames 2-5,99", 0);
    assert_eq!(folder.read("trace"), "a 1\nb 2-3\nb 4-5\nc 1\n");
    std::fs::remove_file(folder.path("trace")).unwrap();
    folder.ends("run tested.xml --layer two --layer three --frames 7", 0);
    assert_eq!(folder.read("trace"), "b 7\nc 1\n");
}

#[test]
fn events_are_read_and_told_and_what_is_no_event_is_logged() {
    let command = r#"echo plain; echo '{"event":"up-to-date","frame":1,"output":"a.exr"}'; printf 'no end' >&2"#;
    let made = r#"echo '{"event":"frame-done","frame":1,"seconds":1.5,"rays":1,"light_picks":1,"output":"b.exr"}'"#;
    let folder = Folder::with(&job(&[("kept", command, "1", 1), ("new", made, "1", 1)], &[]));
    let told = folder.ends("run tested.xml", 0);
    assert!(told.out.contains("0001-kept: up to date\n"), "{told:#?}");
    assert!(told.out.contains("  frame 1 in 1.5 s"), "{told:#?}");
    assert!(told.out.contains("2 of 2 tasks done, 1 of them up to date before"), "{told:#?}");
    let log = folder.read("out/logs/tested/0001-kept.rqlog");
    assert!(log.contains("\nplain\na.exr: up to date\nno end"), "{log}");
    let told = folder.ends("run tested.xml --progress json", 0);
    for line in told.out.lines() {
        let value: serde_json::Value = serde_json::from_str(line).unwrap();
        let event = value["event"].as_str().unwrap();
        assert!(
            event.starts_with("task-") || ["job-started", "progress"].contains(&event),
            "{line}"
        );
    }
    assert!(told.out.contains(r#""outcome":"up-to-date""#), "{told:#?}");
    assert!(
        folder.ends("run tested.xml --progress alfred", 0).out.ends_with("ALF_PROGRESS 100%\n")
    );
    assert!(
        folder.ends("run tested.xml --progress openjd", 0).out.contains("openjd_progress: 50\n")
    );
    assert_eq!(folder.ends("run tested.xml --progress none", 0).out, "");
}

#[test]
fn what_a_command_leaves_running_is_ended_with_it() {
    let folder =
        Folder::with(&job(&[("left", "(sleep 600; touch late) & echo $! > left", "1", 1)], &[]));
    folder.ends("run tested.xml", 0);
    let number = folder.read("left");
    let is_there = std::path::Path::new("/proc").join(number.trim()).join("stat");
    // It may be a zombie for a moment.
    let state = std::fs::read_to_string(is_there).unwrap_or_default();
    assert!(state.is_empty() || state.contains(") Z "), "{state}");
}

#[test]
fn a_process_that_has_left_its_group_and_prints_for_ever_does_not_keep_the_run() {
    let command = "setsid sh -c 'touch left; while test -e go; do echo x; sleep 0.01; done' & \
                   while ! test -e left; do sleep 0.01; done";
    let folder = Folder::with(&job(&[("left", command, "1", 1)], &[]));
    folder.write("go", "");
    folder.ends("run tested.xml", 0);
    std::fs::remove_file(folder.path("go")).unwrap();
}

#[test]
fn logs_that_cannot_be_written_stop_the_run_before_it_begins() {
    let folder = Folder::with(&job(&[("only", &trace("x"), "1", 1)], &[]));
    folder.write("out/logs", "in the way");
    folder.write("next/tested.xml", &job(&[("next", &trace("next"), "1", 1)], &[]));
    let told = folder.ends("run tested.xml", 1);
    assert!(told.err.contains("out/logs/tested"), "{told:#?}");
    assert!(!folder.path("trace").exists());
    // Other jobs go on.
    std::fs::rename(folder.path("next"), folder.path("z")).unwrap();
    let told = folder.ends("run .", 1);
    assert!(
        told.err.contains("tested: not begun: ") && told.err.contains("out/logs/tested"),
        "{told:#?}"
    );
    assert_eq!(folder.read("z/trace"), "next 1\n");
}
