//! What the file holds and the scene does not.

use std::collections::BTreeMap;

/// How many objects a note names before it counts the rest.
const NAMED: usize = 3;

/// Collects notes; objects with the same one share a line.
#[derive(Default)]
pub(super) struct Notes {
    objects_by_text: BTreeMap<String, Objects>,
}

#[derive(Default)]
struct Objects {
    named: Vec<String>,
    more: usize,
}

impl Notes {
    pub(super) fn add(&mut self, object: impl Into<String>, text: impl Into<String>) {
        let objects = self.objects_by_text.entry(text.into()).or_default();
        let object = object.into();
        if objects.named.contains(&object) {
            return;
        }
        match objects.named.len() < NAMED {
            true => objects.named.push(object),
            false => objects.more += 1,
        }
    }

    /// One line a note: `mesh 3 "rope", mesh 4 "wire" and 7 more: lines are not drawn`.
    pub(super) fn into_lines(self) -> Vec<String> {
        let line = |(text, objects): (String, Objects)| {
            let named = objects.named.join(", ");
            match objects.more {
                0 => format!("{named}: {text}"),
                more => format!("{named} and {more} more: {text}"),
            }
        };
        self.objects_by_text.into_iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_note_is_said_once() {
        let mut notes = Notes::default();
        for i in 0..5 {
            notes.add(format!("mesh {i}"), "lines are not drawn");
        }
        notes.add("mesh 0", "lines are not drawn");
        assert_eq!(
            notes.into_lines(),
            ["mesh 0, mesh 1, mesh 2 and 2 more: lines are not drawn".to_string()]
        );
    }
}
