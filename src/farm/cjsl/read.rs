//! From a text to a tree of elements.

use super::schema::Rule;
use super::{Element, Position, Refusal};
use quick_xml::escape::resolve_xml_entity;
use quick_xml::events::{BytesRef, BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

/// What a valid file begins with.
const DOCTYPE: &str = "<!DOCTYPE spec PUBLIC \"SPI Cue  Specification Language\" \
                       \"http://localhost:8080/spcue/dtd/cjsl-1.15.dtd\">";

/// Reads and validates a job file's text.
///
/// # Errors
/// The first thing that is wrong, and where.
pub fn read(text: &str) -> Result<Element, Refusal> {
    let mut tree = Tree { places: Places::of(text), open: Vec::new(), root: None };
    let mut reader = Reader::from_str(text);
    reader.config_mut().expand_empty_elements = true;
    let mut has_doctype = false;
    loop {
        let start = reader.buffer_position() as usize;
        let event = reader.read_event();
        let at = tree.places.of_byte(start);
        match event {
            Ok(Event::Start(start)) => tree.start(&start, at)?,
            Ok(Event::End(_)) => tree.end(at)?,
            Ok(Event::Text(text)) => tree.text(&text.xml_content(XmlVersion::Implicit1_0), at)?,
            Ok(Event::CData(text)) => tree.text(&text.xml_content(XmlVersion::Implicit1_0), at)?,
            Ok(Event::GeneralRef(reference)) => tree.text(&character(&reference, at)?, at)?,
            Ok(Event::DocType(text)) => {
                doctype(&text.into_inner(), at)?;
                if has_doctype || tree.root.is_some() || !tree.open.is_empty() {
                    return refuse(at, "the DOCTYPE stands once, before <spec>");
                }
                has_doctype = true;
            }
            Ok(Event::Decl(declaration)) => {
                let encoding =
                    declaration.encoding().and_then(Result::ok).unwrap_or("UTF-8".into());
                if !encoding.eq_ignore_ascii_case("UTF-8")
                    && !encoding.eq_ignore_ascii_case("ASCII")
                {
                    return refuse(
                        at,
                        format!("the encoding is {encoding}; save the file as UTF-8"),
                    );
                }
            }
            Ok(Event::Comment(_) | Event::PI(_) | Event::Empty(_)) => {}
            Ok(Event::Eof) => break,
            Err(error) => {
                let at = tree.places.of_byte(reader.error_position() as usize);
                return refuse(at, format!("this is no XML: {error}"));
            }
        }
    }
    if let Some((element, _)) = tree.open.last() {
        return refuse(element.at, format!("<{}> is never closed", element.name));
    }
    match tree.root {
        None => refuse(Position { line: 1, column: 1 }, "no <spec> is here; this is no job file"),
        Some(root) if !has_doctype => {
            refuse(root.at, format!("Cuebot wants a DOCTYPE before <spec>: {DOCTYPE}"))
        }
        Some(root) => Ok(root),
    }
}

fn refuse<T>(at: Position, why: impl Into<String>) -> Result<T, Refusal> {
    Err(Refusal { at, why: why.into() })
}

/// Checks a DOCTYPE, of which the root's name is given and what follows.
fn doctype(text: &str, at: Position) -> Result<(), Refusal> {
    if text.contains('[') {
        return refuse(at, "the DOCTYPE declares entities or rules of its own; take out its [...]");
    }
    match text.split_whitespace().next() {
        Some("spec") => Ok(()),
        _ => refuse(at, "the DOCTYPE is none of a job file, whose root is spec"),
    }
}

/// What an entity stands for: one of XML's own five, or a character by its number.
fn character(reference: &BytesRef, at: Position) -> Result<String, Refusal> {
    let name = reference.borrow().into_inner();
    if let Ok(Some(character)) = reference.resolve_char_ref() {
        return Ok(character.into());
    }
    match resolve_xml_entity(&name) {
        Some(text) => Ok(text.into()),
        None => refuse(at, format!("the entity '&{name};' is not known; write & as &amp;")),
    }
}

/// The elements that are open, and the root once it is closed.
struct Tree<'a> {
    places: Places<'a>,
    open: Vec<(Element, Rule)>,
    root: Option<Element>,
}

impl Tree<'_> {
    fn start(&mut self, start: &BytesStart, at: Position) -> Result<(), Refusal> {
        let name = start.name().0;
        match self.open.last_mut() {
            Some((parent, _)) if !parent.text.trim().is_empty() => {
                return refuse(at, format!("<{}> holds text; take <{name}> out", parent.name));
            }
            Some((_, rule)) => rule.admit(name, at)?,
            None if self.root.is_some() => return refuse(at, "a job file has one <spec>"),
            None if name != "spec" => {
                return refuse(at, format!("a job file's root is <spec>, not <{name}>"));
            }
            None => {}
        }
        let Some(rule) = Rule::of(name) else {
            return refuse(at, format!("there is no <{name}> in CJSL 1.15"));
        };
        let mut attributes: Vec<(&'static str, String)> = Vec::new();
        for attribute in start.attributes() {
            let wrong = |error: &dyn std::fmt::Display| Refusal {
                at,
                why: format!("an attribute of <{name}> cannot be read: {error}"),
            };
            let attribute = attribute.map_err(|error| wrong(&error))?;
            let value = attribute
                .normalized_value(XmlVersion::Implicit1_0)
                .map_err(|error| wrong(&error))?;
            attributes.push((rule.attribute(attribute.key.0, &value, at)?, value.into_owned()));
        }
        let has = |name: &str| attributes.iter().any(|(key, _)| *key == name);
        if let Some(missing) = rule.lacks(has) {
            return refuse(at, format!("<{name}> needs the attribute '{missing}'"));
        }
        let (children, text) = (Vec::new(), String::new());
        self.open.push((Element { name: rule.name, attributes, children, text, at }, rule));
        Ok(())
    }

    fn end(&mut self, at: Position) -> Result<(), Refusal> {
        let Some((mut element, rule)) = self.open.pop() else {
            return refuse(at, "this closes nothing");
        };
        rule.close(at)?;
        element.text = element.text.trim().into();
        match self.open.last_mut() {
            Some((parent, _)) => parent.children.push(element),
            None => self.root = Some(element),
        }
        Ok(())
    }

    fn text(&mut self, text: &str, at: Position) -> Result<(), Refusal> {
        if let Some(c) = text.chars().find(|c| c.is_control() && !matches!(c, '\t' | '\n' | '\r')) {
            return refuse(at, format!("the character {} is none of XML's", c.escape_debug()));
        }
        match self.open.last_mut() {
            Some((element, rule)) if rule.is_text => element.text.push_str(text),
            _ if text.trim().is_empty() => {}
            Some((element, _)) => {
                return refuse(at, format!("<{}> holds elements and no text", element.name));
            }
            None => return refuse(at, "text stands outside of <spec>"),
        }
        Ok(())
    }
}

/// Line and column of bytes that are asked for in rising order.
struct Places<'a> {
    text: &'a str,
    byte: usize,
    here: Position,
}

impl<'a> Places<'a> {
    fn of(text: &'a str) -> Places<'a> {
        Places { text, byte: 0, here: Position { line: 1, column: 1 } }
    }

    fn of_byte(&mut self, byte: usize) -> Position {
        let passed = self.text.get(self.byte..byte).unwrap_or_default();
        for c in passed.chars() {
            let Position { line, column } = self.here;
            self.here = match c {
                '\n' => Position { line: line + 1, column: 1 },
                _ => Position { line, column: column + 1 },
            };
        }
        self.byte = self.byte.max(byte);
        self.here
    }
}
