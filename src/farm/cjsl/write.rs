//! From a tree of elements to a text.

use super::Element;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};
use std::io;

/// Writes a job file: indented, with Cuebot's DOCTYPE of CJSL 1.15.
pub fn write(root: &Element, out: &mut impl io::Write) -> io::Result<()> {
    let mut writer = Writer::new_with_indent(out, b' ', 2);
    writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    writer.write_event(Event::DocType(BytesText::from_escaped(
        "spec PUBLIC \"SPI Cue  Specification Language\" \
         \"http://localhost:8080/spcue/dtd/cjsl-1.15.dtd\"",
    )))?;
    element(root, &mut writer)?;
    writer.into_inner().write_all(b"\n")
}

fn element(element: &Element, writer: &mut Writer<impl io::Write>) -> io::Result<()> {
    let attributes = element.attributes.iter().map(|(name, value)| (*name, value.as_str()));
    let start = BytesStart::new(element.name).with_attributes(attributes);
    if element.children.is_empty() && element.text.is_empty() {
        return writer.write_event(Event::Empty(start));
    }
    writer.write_event(Event::Start(start))?;
    if !element.text.is_empty() {
        writer.write_event(Event::Text(BytesText::new(&element.text)))?;
    }
    for child in &element.children {
        self::element(child, writer)?;
    }
    writer.write_event(Event::End(BytesEnd::new(element.name)))
}
