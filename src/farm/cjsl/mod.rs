//! CJSL 1.15, the XML in which OpenCue describes a job, as a tree of elements.
//!
//! [`read()`] checks a text against the rules of the language ([`schema`]), so a tree that exists is valid;
//! [`write()`] is its twin. What the elements mean is the matter of [`Job`](super::Job). No entity is expanded
//! but XML's own five, nothing outside the file is read, and a tree is as deep as the rules are.

mod read;
mod schema;
mod write;

pub use read::read;
pub use write::write;

use thiserror::Error;

/// An element with what is in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    /// Its name.
    pub name: &'static str,
    /// Names and values, in the file's order.
    pub attributes: Vec<(&'static str, String)>,
    /// The elements in it.
    pub children: Vec<Element>,
    /// The text in it, without spaces around; empty where there are children.
    pub text: String,
    /// Where it begins.
    pub at: Position,
}

/// A place in a file: line and column in characters, both from one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Position {
    /// Of lines, the first is 1.
    pub line: usize,
    /// Of characters in the line, the first is 1.
    pub column: usize,
}

/// Why a text is no valid job file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}:{}: {}", at.line, at.column, shortened(why))]
pub struct Refusal {
    /// Where.
    pub at: Position,
    /// What is wrong there, with the remedy.
    pub why: String,
}

/// No message is longer, in characters, however long what the file says.
const LONGEST_MESSAGE: usize = 800;

/// A message without its middle if it is too long: it begins with the fault and ends with the remedy.
fn shortened(why: &str) -> String {
    let half = LONGEST_MESSAGE / 2;
    let (head, tail) =
        (why.char_indices().nth(half), why.char_indices().rev().nth(half).map(|(at, _)| at));
    match (head, tail) {
        (Some((head, _)), Some(tail)) if head < tail => {
            format!("{} ... {}", &why[..head], &why[tail..])
        }
        _ => why.into(),
    }
}

impl Element {
    /// The first child of a name.
    pub fn child(&self, name: &str) -> Option<&Element> {
        self.children.iter().find(|child| child.name == name)
    }

    /// All children of a name.
    pub fn all(&self, name: &'static str) -> impl Iterator<Item = &Element> {
        self.children.iter().filter(move |child| child.name == name)
    }

    /// An attribute that may be absent.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| *key == name).map(|(_, value)| value.as_str())
    }

    /// Refuses the element.
    pub fn refuse(&self, why: impl Into<String>) -> Refusal {
        Refusal { at: self.at, why: why.into() }
    }
}
