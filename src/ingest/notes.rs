//! Collects notes: what the file holds and the scene does not.

use crate::scene::{Category, Note};
use std::collections::BTreeMap;

/// A note names this many objects and counts the others.
const MOST_NAMED: usize = 3;

/// A category holds this many different texts; what comes later shares one text.
const MOST_TEXTS: usize = 100;

/// The text of what comes later.
const MORE: &str = "more is left out or mended than can be told one by one";

/// The notes of a file. Objects with the same text share a note.
#[derive(Default)]
pub(super) struct Notes {
    by_text: BTreeMap<(Category, String), Objects>,
}

#[derive(Default)]
struct Objects {
    named: Vec<String>,
    more: usize,
}

impl Notes {
    /// Adds a note. The text should not repeat what differs between objects, so that they share it.
    pub(super) fn add(
        &mut self,
        category: Category,
        object: impl Into<String>,
        text: impl Into<String>,
    ) {
        let mut key = (category, text.into());
        if !self.by_text.contains_key(&key)
            && self.by_text.keys().filter(|(known, _)| *known == category).count() >= MOST_TEXTS
        {
            key.1 = MORE.into();
        }
        let objects = self.by_text.entry(key).or_default();
        let object = object.into();
        if objects.named.contains(&object) {
            return;
        }
        match objects.named.len() < MOST_NAMED {
            true => objects.named.push(object),
            false => objects.more += 1,
        }
    }

    /// `mesh 3 "rope", mesh 4 "wire" and 7 more: lines are not drawn`, in order of category and text.
    pub(super) fn into_list(self) -> Vec<Note> {
        let note = |((category, text), objects): ((Category, String), Objects)| {
            let named = objects.named.join(", ");
            let text = match objects.more {
                0 => format!("{named}: {text}"),
                more => format!("{named} and {more} more: {text}"),
            };
            Note { category, text }
        };
        self.by_text.into_iter().map(note).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_with_the_same_text_share_a_note() {
        let mut notes = Notes::default();
        for i in 0..5 {
            notes.add(Category::Geometry, format!("mesh {i}"), "lines are not drawn");
        }
        notes.add(Category::Geometry, "mesh 0", "lines are not drawn");
        notes.add(Category::Lights, "light 0", "left out");
        let told: Vec<String> = notes.into_list().iter().map(Note::to_string).collect();
        assert_eq!(
            told,
            [
                "lights: light 0: left out",
                "geometry: mesh 0, mesh 1, mesh 2 and 2 more: lines are not drawn",
            ]
        );
    }

    #[test]
    fn a_file_cannot_make_notes_without_end() {
        let mut notes = Notes::default();
        for i in 0..100_000 {
            notes.add(Category::Other, "file", format!("EXT_{i} is not read"));
        }
        notes.add(Category::Lights, "light 0", "left out");
        let list = notes.into_list();
        assert_eq!(list.len(), MOST_TEXTS + 2);
        assert!(list.iter().any(|note| note.category == Category::Lights));
    }
}
