//! Small job files, and the program run on them.

use std::fmt::Write;
use std::path::PathBuf;
use std::process::{Command, Output};
use tempfile::TempDir;

/// A job with layers of name, command, range and chunk, and dependences of layer, type and layer.
pub fn job(layers: &[(&str, &str, &str, usize)], depends: &[(&str, &str, &str)]) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<!DOCTYPE spec PUBLIC \"SPI Cue  Specification Language\" \
         \"http://localhost:8080/spcue/dtd/cjsl-1.15.dtd\">\n\
         <spec><show>testing</show><shot>sh010</shot><user>jane</user>\n<job name=\"tested\"><layers>\n",
    );
    for (name, command, range, chunk) in layers {
        let command = command.replace('&', "&amp;").replace('<', "&lt;");
        let _ = writeln!(
            text,
            "<layer name=\"{name}\" type=\"Render\">\n<cmd>{command}</cmd>\n<range>{range}</range>\n\
             <chunk>{chunk}</chunk>\n</layer>"
        );
    }
    text += "</layers></job>\n<depends>\n";
    for (layer, kind, on) in depends {
        let _ = writeln!(
            text,
            "<depend type=\"{kind}\" anyframe=\"False\">\n<depjob>tested</depjob><deplayer>{layer}</deplayer>\
             <onjob>tested</onjob><onlayer>{on}</onlayer></depend>"
        );
    }
    text + "</depends></spec>\n"
}

/// A folder with a job file in it.
pub struct Folder(pub TempDir);

/// Its name.
pub const JOB: &str = "tested.xml";

impl Folder {
    pub fn with(text: &str) -> Folder {
        let folder = Folder(TempDir::new().unwrap());
        folder.write(JOB, text);
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// `candelabra`, told the words of a text, in the folder.
    pub fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_candelabra"));
        command.current_dir(self.0.path()).args(arguments.split_whitespace());
        command
    }

    /// The same, run to its end, which has a code.
    #[track_caller]
    pub fn ends(&self, arguments: &str, code: i32) -> Told {
        let output = self.command(arguments).output().unwrap();
        let told = Told::from(output);
        assert_eq!(told.code, Some(code), "{arguments}: {told:#?}");
        told
    }
}

/// What a program said.
#[derive(Debug)]
pub struct Told {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl From<Output> for Told {
    fn from(output: Output) -> Told {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Told { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
    }
}
