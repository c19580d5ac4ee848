//! What is refused of a job file: with file, line, column and remedy, and by every command.

use crate::job_file::{Folder, JOB, job};
use candelabra::farm::{Job, JobError, Plan, Selection};
use proptest::prelude::*;
use std::path::Path;

/// Layers one and two, two after one.
fn text() -> String {
    job(
        &[("one", "true", "1", 1), ("two", "echo #FRAMESPEC#", "1-10", 4)],
        &[("two", "LAYER_ON_LAYER", "one")],
    )
}

/// The message that a text is refused with.
#[track_caller]
fn refusal(text: &str) -> String {
    let folder = Folder::with(text);
    match Job::read(&folder.path(JOB)) {
        Err(error @ JobError::Refused { .. }) => error.to_string(),
        other => panic!("not refused: {other:?}\n{text}"),
    }
}

#[test]
fn a_good_job_is_read_whole() {
    let folder = Folder::with(&text());
    let job = Job::read(&folder.path(JOB)).unwrap();
    assert_eq!(
        (job.name.as_str(), job.full_name().as_str()),
        ("tested", "testing-sh010-jane_tested")
    );
    assert_eq!(
        job.layers.iter().map(|layer| layer.name.as_str()).collect::<Vec<_>>(),
        ["one", "two"]
    );
    assert_eq!(job.layers[1].frames, (1..=10).collect::<Vec<_>>());
    assert_eq!((job.depends[0].layer, job.depends[0].on), (1, 0));
    let chunks: Vec<_> = Plan::new(&job, &Selection::default()).unwrap().tasks().skip(1).collect();
    let commands: Vec<_> = chunks.iter().map(|task| task.command.as_str()).collect();
    assert_eq!(commands, ["echo 1-4", "echo 5-8", "echo 9-10"]);
    assert_eq!(chunks[1].name, "0005-two");
}

#[test]
fn each_fault_is_named_with_its_place_and_remedy() {
    // What is replaced, by what, the place, and words of the message.
    let cases: &[(&str, &str, &str, &[&str])] = &[
        // XML.
        ("</spec>", "", ":3:1:", &["<spec> is never closed"]),
        ("</show>", "</shot>", ":3:", &["no XML"]),
        ("testing", "&bomb;", ":3:13:", &["&bomb;", "&amp;"]),
        ("testing", "te&#1;st", ":3:", &["\\u{1}"]),
        (
            "<?xml version=\"1.0\"?>",
            "<?xml version=\"1.0\" encoding=\"latin1\"?>",
            ":1:1:",
            &["UTF-8"],
        ),
        ("cjsl-1.15.dtd\">", "cjsl-1.15.dtd\" [<!ENTITY a \"b\">]>", ":2:1:", &["[...]"]),
        ("<!DOCTYPE spec", "<!DOCTYPE html", ":2:1:", &["root is spec"]),
        ("</spec>", "</spec><spec/>", "", &["one <spec>"]),
        ("</spec>", "</spec>more", "", &["outside of <spec>"]),
        // The rules of CJSL.
        ("<spec>", "<jobs>", ":3:1:", &["root is <spec>, not <jobs>"]),
        (
            "<chunk>4</chunk>",
            "<colour>red</colour>",
            "",
            &["no <colour>", "it takes cmd, range, chunk"],
        ),
        ("<range>1</range>\n", "", ":7:1:", &["lacks <range>", "cmd, range, chunk"]),
        ("<chunk>4</chunk>\n", "", ":13:1:", &["lacks <chunk>"]),
        (
            "<cmd>true</cmd>\n<range>1</range>",
            "<range>1</range>\n<cmd>true</cmd>",
            ":6:1:",
            &["lacks <cmd>"],
        ),
        (
            "<chunk>4</chunk>",
            "<chunk>4</chunk><memory>1g</memory><cores>1.0</cores>",
            ":13:36:",
            &["<cores> must stand before <memory>"],
        ),
        ("<chunk>4</chunk>", "<chunk>4</chunk><chunk>4</chunk>", ":13:17:", &["takes one <chunk>"]),
        ("<cmd>true", "<cmd><b/>true", ":6:6:", &["holds no elements", "<b>"]),
        ("<layers>", "<layers>text", ":4:28:", &["no text"]),
        ("name=\"two\" type", "name=\"two\" kind", ":10:1:", &["no attribute 'kind'"]),
        (
            "name=\"two\" type=\"Render\"",
            "type=\"Render\"",
            ":10:1:",
            &["needs the attribute 'name'"],
        ),
        (
            "name=\"two\" type=\"Render\"",
            "name=\"two\" type=\"Paint\"",
            ":10:1:",
            &["Render, Util, Post"],
        ),
        // What Cuebot makes of it.
        ("jane", "root", ":3:45:", &["root", "<user>"]),
        ("sh010", "sh 010", ":3:27:", &["letters"]),
        ("sh010", "s1", ":3:27:", &["three or more"]),
        ("name=\"two\"", "name=\"t!o\"", ":10:1:", &["letters"]),
        ("name=\"two\"", "name=\"One\"", ":10:1:", &["second layer is called one"]),
        ("<cmd>true</cmd>", "<cmd> </cmd>", ":6:1:", &["<cmd> is empty"]),
        ("#FRAMESPEC#", "#FRAMES#", ":11:1:", &["#FRAMES# is no token", "#FRAMESPEC#"]),
        ("1-10<", "1-10x0<", ":12:1:", &["never reaches"]),
        ("1-10<", "1-100001<", ":12:1:", &["100000 frames"]),
        ("1-10<", "10<", "", &[]),
        ("<chunk>4", "<chunk>0", ":13:1:", &["whole number from 1"]),
        (
            "<chunk>4</chunk>",
            "<chunk>4</chunk><cores>2</cores>",
            ":13:17:",
            &["core points", "write 2.0"],
        ),
        ("<chunk>4</chunk>", "<chunk>4</chunk><memory>lots</memory>", ":13:17:", &["512m or 4g"]),
        ("<chunk>4</chunk>", "<chunk>4</chunk><timeout>-1</timeout>", ":13:17:", &["whole number"]),
        (
            "<chunk>4</chunk>",
            "<chunk>4</chunk><env><key name=\"A-B\">1</key></env>",
            ":13:22:",
            &["A-B"],
        ),
        ("LAYER_ON_LAYER", "JOB_ON_JOB", ":17:1:", &["JOB_ON_JOB are for Cuebot alone"]),
        ("anyframe=\"False\"", "anyframe=\"True\"", ":17:1:", &["anyframe=\"False\""]),
        ("<deplayer>two", "<deplayer>three", "", &["no layer three"]),
        ("<depjob>tested", "<depjob>other", ":18:1:", &["is not the job of this file"]),
        ("<deplayer>two", "<deplayer>one", ":17:1:", &["wait for each other: one -> one"]),
    ];
    let mut wrong = Vec::new();
    for (old, new, place, words) in cases {
        let good = text();
        assert!(good.contains(old), "{old} is not in\n{good}");
        let bad = good.replacen(old, new, 1);
        if words.is_empty() {
            // The counterpart: a change that is none.
            Job::read(&Folder::with(&bad).path(JOB)).unwrap();
            continue;
        }
        let message = refusal(&bad);
        let is_told = words.iter().chain([place]).all(|word| message.contains(word));
        if !is_told {
            wrong.push(format!(
                "{old} -> {new}: {place} {words:?} are not all in
{message}"
            ));
        }
    }
    assert!(
        wrong.is_empty(),
        "{}",
        wrong.join(
            "
"
        )
    );
}

#[test]
fn a_message_is_short_and_has_its_remedy_however_long_the_fault() {
    let long = "é".repeat(1 << 20);
    for (old, remedy) in [
        ("testing", "alone"),
        ("sh010", "digits, _ - and . alone"),
        ("<chunk>4", "write a whole number"),
        ("1-10<", "write 1001-1048"),
        ("name=\"two", "take three or more letters"),
        ("<deplayer>two", "take three or more letters"),
    ] {
        let good = text();
        assert!(good.contains(old), "{old}");
        let new = format!(
            "{}{long}{}",
            old.trim_end_matches('<'),
            &old[old.trim_end_matches('<').len()..]
        );
        let message = refusal(&good.replacen(old, &new, 1));
        assert!(message.len() < 2500 && message.contains(remedy), "{old}: {message:.3000}");
    }
}

#[test]
fn a_ring_is_refused_at_one_of_its_dependences() {
    let layers = ["one", "two", "three"].map(|name| (name, "true", "1", 1));
    let message = refusal(&job(
        &layers,
        &[
            ("two", "LAYER_ON_LAYER", "one"),
            ("three", "FRAME_BY_FRAME", "two"),
            ("two", "FRAME_BY_FRAME", "three"),
        ],
    ));
    let told = ":26:1: layers wait for each other: two -> three -> two;";
    assert!(message.contains(told), "{message}");
}

#[test]
fn entity_bombs_and_files_without_end_are_refused_without_being_read() {
    let bomb = text().replacen(
        "cjsl-1.15.dtd\">",
        "cjsl-1.15.dtd\" [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;\">]>",
        1,
    );
    assert!(refusal(&bomb).contains("declares entities"), "{bomb}");
    for path in ["/dev/zero", "/"] {
        let error = Job::read(Path::new(path)).unwrap_err();
        assert!(matches!(error, JobError::Unreadable { .. }), "{error}");
    }
    let folder = Folder::with(&" ".repeat((16 << 20) + 1));
    assert!(Job::read(&folder.path(JOB)).unwrap_err().to_string().contains("more than"));
    let deep = "<layers>".repeat(100_000);
    assert!(refusal(&text().replacen("<layers>", &deep, 1)).contains("<layers>"));
}

#[test]
fn every_command_refuses_and_leaves_nothing() {
    let folder = Folder::with(&text().replacen("#FRAMESPEC#", "#FRAME_SPEC#", 1));
    for arguments in
        ["run tested.xml", "run .", "run tested.xml --dry-run", "farm tested.xml --to slurm -o x"]
    {
        let told = folder.ends(arguments, 2);
        assert!(told.err.contains("tested.xml:11:1: #FRAME_SPEC# is no token"), "{told:#?}");
    }
    assert_eq!(std::fs::read_dir(folder.0.path()).unwrap().count(), 1);
    let folder = Folder::with(&text());
    let told = folder.ends("run tested.xml --layer three", 2);
    assert!(told.err.contains("no layer 'three'; it has one, two"), "{told:#?}");
    let told = folder.ends("run tested.xml --frames 11-12", 2);
    assert!(told.err.contains("layer two, which has 1-10"), "{told:#?}");
    folder.ends("run nothing.xml", 2);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Whatever is done to a job file, it is read or refused.
    #[test]
    fn no_file_makes_the_reader_panic(cuts in prop::collection::vec((0..1000usize, "[<>&;/a1\" -]{0,3}"), 1..4)) {
        let mut text = text();
        for (at, put) in cuts {
            let at = at % text.len();
            text.replace_range(at..(at + put.len()).min(text.len()), &put);
        }
        let folder = Folder::with(&text);
        if let Err(error) = Job::read(&folder.path(JOB)) {
            prop_assert!(error.to_string().contains(JOB));
        }
    }
}
