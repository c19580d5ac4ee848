//! Material libraries: the parameters of each material as text, whatever they are.

use super::text::{decode, statements};
use crate::ingest::error::Fault;
use crate::ingest::notes::Notes;
use crate::ingest::uri::Folder;
use crate::scene::Category;
use std::collections::HashMap;

/// Words of a line of libraries beyond which names with spaces are not sought.
const MOST_WORDS: usize = 32;

/// One material: what follows each keyword.
pub(super) struct Row {
    pub name: String,
    parameters: HashMap<String, String>,
}

impl Row {
    /// What follows a keyword, in upper or lower case.
    pub(super) fn get(&self, keyword: &str) -> Option<&str> {
        self.parameters.get(&keyword.to_ascii_lowercase()).map(String::as_str)
    }

    /// The keywords, in lower case, in order.
    pub(super) fn keywords(&self) -> Vec<&str> {
        let mut keywords: Vec<&str> = self.parameters.keys().map(String::as_str).collect();
        keywords.sort_unstable();
        keywords
    }
}

/// The materials of all libraries, by name. Of two with one name the first counts.
#[derive(Default)]
pub(super) struct Library {
    pub rows: Vec<Row>,
    by_name: HashMap<String, usize>,
}

impl Library {
    /// Reads the libraries that some `mtllib` statements name. Absent and broken ones are noted.
    pub(super) fn read(folder: &Folder, lines: &[String], notes: &mut Notes) -> Library {
        let mut library = Library::default();
        let mut read = Vec::new();
        for name in lines.iter().flat_map(|line| names_in(folder, line)) {
            if read.contains(&name) {
                continue;
            }
            let object = format!("material library {name:?}");
            let text = || -> Result<Vec<u8>, Fault> {
                folder.read(&folder.resolve(&name, &object)?, &object)
            };
            let bytes = text().map_err(Fault::into_problem);
            let text = match &bytes {
                Ok(bytes) => decode(bytes).map_err(String::from),
                Err(problem) => Err(problem.clone()),
            };
            match text {
                Ok(text) => library.parse(&text, notes),
                // What it says of light is not known.
                Err(problem) => notes.add(
                    Category::Lights,
                    object,
                    format!("{problem}; surfaces have the default material, and none emits"),
                ),
            }
            read.push(name);
        }
        library
    }

    /// The number of a material.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    fn parse(&mut self, text: &str, notes: &mut Notes) {
        let mut open: Option<Row> = None;
        for statement in statements(text) {
            let keyword = statement.keyword.to_ascii_lowercase();
            if keyword == "newmtl" {
                let name = statement.rest.into_owned();
                self.close(open.replace(Row { name, parameters: HashMap::new() }), notes);
            } else if let Some(row) = &mut open {
                row.parameters.insert(keyword, statement.rest.into_owned());
            }
        }
        self.close(open, notes);
    }

    fn close(&mut self, row: Option<Row>, notes: &mut Notes) {
        let Some(row) = row else { return };
        if self.by_name.contains_key(&row.name) {
            let object = format!("material {:?}", row.name);
            let text = "is defined more than once; the first definition counts";
            notes.add(Category::Materials, object, text);
            return;
        }
        self.by_name.insert(row.name.clone(), self.rows.len());
        self.rows.push(row);
    }
}

/// The files that a line names: the format parts them by spaces, but many programs write one name that
/// holds spaces. The longest names that are there count.
fn names_in(folder: &Folder, line: &str) -> Vec<String> {
    let line = line.strip_prefix('"').and_then(|line| line.strip_suffix('"')).unwrap_or(line);
    let is_there = |name: &str| folder.resolve(name, "").is_ok();
    let words: Vec<&str> = line.split_whitespace().collect();
    if words.len() <= 1 || words.len() > MOST_WORDS || is_there(line) {
        return vec![line.to_string()];
    }
    let (mut names, mut from) = (Vec::new(), 0);
    while from < words.len() {
        let longest =
            (from + 1..=words.len()).rev().find(|&to| is_there(&words[from..to].join(" ")));
        let to = longest.unwrap_or(from + 1);
        names.push(words[from..to].join(" "));
        from = to;
    }
    // If none is there it is one name as likely as several.
    if names.iter().any(|name| is_there(name)) { names } else { vec![line.to_string()] }
}
