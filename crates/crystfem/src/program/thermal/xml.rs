//! Small XML files as a tree.

use super::data_error;
use crate::error::Error;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::path::Path;

/// An XML element: name without prefix, attributes, text and children.
#[derive(Clone, Debug, Default)]
pub(super) struct XmlElement {
    pub name: String,
    attributes: Vec<(String, String)>,
    pub text: String,
    pub children: Vec<XmlElement>,
}

impl XmlElement {
    /// Returns an attribute, or an empty string.
    pub fn get(&self, key: &str) -> &str {
        self.attributes.iter().find(|(own, _)| own == key).map_or("", |(_, value)| value)
    }

    /// Returns the children with a name.
    pub fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Self> {
        self.children.iter().filter(move |child| child.name == name)
    }

    /// Returns the first child with a name.
    pub fn child<'a>(&'a self, name: &'a str) -> Option<&'a Self> {
        self.all(name).next()
    }

    /// Returns the element and all descendants, in file order.
    pub fn descendants(&self) -> Vec<&Self> {
        let mut found = vec![self];
        let mut at = 0;
        while let Some(node) = found.get(at).copied() {
            found.splice(at + 1..at + 1, &node.children);
            at += 1;
        }
        found
    }
}

/// Reads a file; the root of the tree has no name.
pub(super) fn read(path: &Path) -> Result<XmlElement, Error> {
    let text = std::fs::read_to_string(path).map_err(polycore::Error::from_io("read", path))?;
    let wrong = |reason: String| data_error(path, &reason);
    let mut reader = Reader::from_str(&text);
    let mut open = vec![XmlElement::default()];
    loop {
        let event = reader.read_event().map_err(|error| wrong(error.to_string()))?;
        match event {
            Event::Start(start) => open.push(parse_element(path, &start)?),
            Event::Empty(start) => {
                let node = parse_element(path, &start)?;
                open.last_mut().into_iter().for_each(|parent| parent.children.push(node.clone()));
            }
            Event::Text(text) => {
                let text = String::from_utf8_lossy(&text);
                open.last_mut().into_iter().for_each(|node| node.text.push_str(&text));
            }
            Event::End(_) => {
                if let (Some(node), Some(parent)) = (open.pop(), open.last_mut()) {
                    parent.children.push(node);
                }
            }
            Event::Eof => break,
            _ => {}
        }
        if open.len() > 100 {
            return Err(wrong("found more than 100 nested elements; allowed: at most 100".into()));
        }
    }
    match &mut open[..] {
        [all] => Ok(std::mem::take(all)),
        _ => Err(wrong("truncated: an element does not end".into())),
    }
}

fn parse_element(path: &Path, start: &BytesStart) -> Result<XmlElement, Error> {
    let name = String::from_utf8_lossy(start.local_name().as_ref()).into_owned();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let attributes = start.attributes().map(|attribute| {
        let attribute = attribute.map_err(|error| data_error(path, &format!("<{name}>: {error}")))?;
        Ok((text(attribute.key.as_ref()), text(&attribute.value)))
    });
    let attributes = attributes.collect::<Result<_, Error>>()?;
    Ok(XmlElement { name, attributes, ..XmlElement::default() })
}
