//! The rules of the format, and what is said when one is broken.

use super::SectionId;
use std::fmt;

/// A rule of the format. The [page](super) states it under the same number, in the same words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rule {
    /// Whose rule it is: a section, or [`HEADER`](Rule::HEADER) or [`TABLE`](Rule::TABLE).
    pub part: SectionId,
    /// From 1 on.
    pub number: u8,
    /// What must be so.
    pub text: &'static str,
}

impl Rule {
    /// The part of rules about the header, which is no section.
    pub const HEADER: SectionId = SectionId(*b"HEAD");
    /// The part of rules about the section table, and the sections' places.
    pub const TABLE: SectionId = SectionId(*b"TABL");
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.part, self.number)
    }
}

/// Declares rules of one part, numbered from 1 on, and the list of all of them.
macro_rules! rules {
    ($part:expr, $all:ident: $($name:ident = $text:literal;)*) => {
        $crate::store::rules!(@ $part, 1; $($name = $text;)*);
        /// All rules of the part.
        pub const $all: &[$crate::store::Rule] = &[$($name),*];
    };
    (@ $part:expr, $number:expr;) => {};
    (@ $part:expr, $number:expr; $name:ident = $text:literal; $($rest:tt)*) => {
        #[doc = $text]
        pub const $name: $crate::store::Rule =
            $crate::store::Rule { part: $part, number: $number, text: $text };
        $crate::store::rules!(@ $part, $number + 1; $($rest)*);
    };
}
pub(crate) use rules;

/// Where in its part a rule is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Record {
    /// All of it.
    All,
    /// One of its elements, from 0 on.
    Row(u32),
    /// One node of a group, from 0 on.
    Lane {
        /// The group.
        group: u32,
        /// Which of its eight nodes.
        lane: u8,
    },
    /// The row of the section table that describes this section.
    Section(SectionId),
}

/// A broken rule, and where it is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Violation {
    /// Which rule.
    pub rule: Rule,
    /// What breaks it.
    pub record: Record,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.rule.part, self.record) {
            (Rule::HEADER, _) => write!(f, "the header"),
            (Rule::TABLE, Record::Section(section)) => write!(f, "section {section}"),
            (Rule::TABLE, _) => write!(f, "the section table"),
            (section, _) => write!(f, "section {section}"),
        }?;
        match self.record {
            Record::All | Record::Section(_) => {}
            Record::Row(row) => write!(f, ", row {row}")?,
            Record::Lane { group, lane } => write!(f, ", row {group}, lane {lane}")?,
        }
        write!(f, " breaks rule {}: {}", self.rule, self.rule.text)
    }
}
