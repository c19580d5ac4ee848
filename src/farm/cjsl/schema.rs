//! Which elements may stand where: the rules of `cjsl-1.15.dtd`.
//!
//! All content of CJSL is either text or a sequence of elements, so one line says each element's rule. Cuebot
//! validates, so the order counts.

use super::Position;
use super::Refusal;

/// Name; the children in their order, `?` optional, `*` any number, `+` at least one, or `TEXT`; the attributes,
/// `?` optional, with their values if these are listed.
type Row = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

const TEXT: &str = "#text";

const ROWS: &[Row] = &[
    ("spec", "facility? dept? show shot user email? uid? job* depends*", &[]),
    (
        "job",
        "paused? priority? maxretries? maxcores? maxgpus? autoeat? localbook? os? env* layers?",
        &[("name", "")],
    ),
    ("localbook", "", &[("host", ""), ("cores", ""), ("memory", ""), ("threads", ""), ("gpu", "")]),
    ("layers", "layer+", &[]),
    (
        "layer",
        "cmd range chunk cores? threadable? memory? gpus? gpu? gpu_memory? timeout? timeout_llu? tags? \
         limits? env* services? outputs*",
        &[("name", ""), ("type", "Render Util Post")],
    ),
    ("limits", "limit+", &[]),
    ("services", "service+", &[]),
    ("outputs", "output*", &[]),
    ("output", TEXT, &[("name", "")]),
    ("env", "key*", &[]),
    ("key", TEXT, &[("name", "")]),
    ("depends", "depend*", &[]),
    (
        "depend",
        "depjob deplayer? depframe? onjob onlayer? onframe?",
        &[
            ("anyframe?", ""),
            (
                "type",
                "LAYER_ON_SIM_FRAME PREVIOUS_FRAME JOB_ON_JOB JOB_ON_LAYER JOB_ON_FRAME LAYER_ON_JOB \
                 LAYER_ON_FRAME LAYER_ON_LAYER FRAME_ON_JOB FRAME_ON_LAYER FRAME_ON_FRAME FRAME_BY_FRAME",
            ),
        ],
    ),
];

/// Elements that hold text alone and have no attributes.
const PLAIN: &[&str] = &[
    "facility",
    "dept",
    "show",
    "shot",
    "user",
    "email",
    "uid",
    "paused",
    "priority",
    "maxretries",
    "maxcores",
    "maxgpus",
    "autoeat",
    "os",
    "cmd",
    "range",
    "chunk",
    "cores",
    "threadable",
    "memory",
    "gpus",
    "gpu",
    "gpu_memory",
    "timeout",
    "timeout_llu",
    "tags",
    "service",
    "limit",
    "depjob",
    "onjob",
    "deplayer",
    "onlayer",
    "depframe",
    "onframe",
];

/// The rule of an element, and how far its children have come.
pub struct Rule {
    pub name: &'static str,
    children: Vec<(&'static str, Times)>,
    attributes: &'static [(&'static str, &'static str)],
    pub is_text: bool,
    /// The child that was seen last, and how often.
    last: usize,
    count: usize,
}

#[derive(Clone, Copy, PartialEq)]
enum Times {
    Once,
    AtMostOnce,
    Any,
    AtLeastOnce,
}

impl Rule {
    /// The rule of an element, if there is such a one.
    pub fn of(name: &str) -> Option<Rule> {
        let plain =
            || PLAIN.iter().find(|plain| **plain == name).map(|&name| (name, TEXT, &[][..]));
        let (name, content, attributes) =
            ROWS.iter().find(|row| row.0 == name).copied().or_else(plain)?;
        let is_text = content == TEXT;
        let words = content.split_whitespace().filter(|_| !is_text);
        let children = words.map(|word| match word.split_at(word.len() - 1) {
            (name, "?") => (name, Times::AtMostOnce),
            (name, "*") => (name, Times::Any),
            (name, "+") => (name, Times::AtLeastOnce),
            _ => (word, Times::Once),
        });
        Some(Rule { name, children: children.collect(), attributes, is_text, last: 0, count: 0 })
    }

    /// Admits the next child.
    pub fn admit(&mut self, child: &str, at: Position) -> Result<(), Refusal> {
        let refuse = |why| Err(Refusal { at, why });
        let Some(place) = self.children.iter().position(|(name, _)| *name == child) else {
            let inside = self.name;
            return refuse(match self.children.is_empty() {
                true => format!("<{inside}> holds no elements; take <{child}> out"),
                false => format!("<{inside}> has no <{child}>; it takes {}", self.sequence()),
            });
        };
        if place < self.last {
            let before = self.children[self.last].0;
            return refuse(format!(
                "<{child}> must stand before <{before}>; the order in <{}> is {}",
                self.name,
                self.sequence()
            ));
        }
        if place > self.last {
            self.pass(place, at)?;
            (self.last, self.count) = (place, 0);
        }
        self.count += 1;
        if self.count > 1 && matches!(self.children[place].1, Times::Once | Times::AtMostOnce) {
            return refuse(format!("<{}> takes one <{child}>; take this one out", self.name));
        }
        Ok(())
    }

    /// Checks that nothing is missing at the end.
    pub fn close(&self, at: Position) -> Result<(), Refusal> {
        self.pass(self.children.len(), at)
    }

    /// Checks that all children before a place that must be there are.
    fn pass(&self, place: usize, at: Position) -> Result<(), Refusal> {
        let start = self.last + usize::from(self.count > 0);
        let passed = self.children.get(start..place).unwrap_or_default();
        match passed.iter().find(|(_, times)| matches!(times, Times::Once | Times::AtLeastOnce)) {
            None => Ok(()),
            Some((missing, _)) => Err(Refusal {
                at,
                why: format!(
                    "<{}> lacks <{missing}>; the order in it is {}",
                    self.name,
                    self.sequence()
                ),
            }),
        }
    }

    /// Takes an attribute and gives its name for keeps.
    pub fn attribute(&self, key: &str, value: &str, at: Position) -> Result<&'static str, Refusal> {
        let refuse = |why| Err(Refusal { at, why });
        let of = self.name;
        let Some((name, values)) =
            self.attributes.iter().find(|(name, _)| name.trim_end_matches('?') == key)
        else {
            return refuse(format!("<{of}> has no attribute '{key}'; take it out"));
        };
        if !values.is_empty() && !values.split_whitespace().any(|listed| listed == value) {
            let listed: Vec<_> = values.split_whitespace().collect();
            return refuse(format!("the {key} of <{of}> is one of {}", listed.join(", ")));
        }
        let is_name_token = |c: char| c.is_alphanumeric() || matches!(c, '.' | '_' | '-' | ':');
        if value.is_empty() || !value.chars().all(is_name_token) {
            return refuse(format!(
                "the {key} of <{of}> must be of letters, digits and . _ - : alone"
            ));
        }
        Ok(name.trim_end_matches('?'))
    }

    /// The first attribute that must be there and is not.
    pub fn lacks(&self, is_there: impl Fn(&str) -> bool) -> Option<&'static str> {
        self.attributes
            .iter()
            .map(|(name, _)| *name)
            .find(|name| !name.ends_with('?') && !is_there(name))
    }

    fn sequence(&self) -> String {
        self.children.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
    }
}
