//! Small XML files as a tree.

use super::unusable;
use crate::error::Error;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::path::Path;

/// An element: its name without a prefix, attributes, text, and what is in it.
#[derive(Clone, Debug, Default)]
pub(super) struct Node {
    pub name: String,
    attributes: Vec<(String, String)>,
    pub text: String,
    pub children: Vec<Node>,
}

impl Node {
    /// An attribute; empty where it is not there.
    pub fn get(&self, key: &str) -> &str {
        self.attributes.iter().find(|(own, _)| own == key).map_or("", |(_, value)| value)
    }

    /// Children of a name.
    pub fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Self> {
        self.children.iter().filter(move |child| child.name == name)
    }

    /// The first child of a name.
    pub fn child<'a>(&'a self, name: &'a str) -> Option<&'a Self> {
        self.all(name).next()
    }

    /// Itself and all below it, from the top down.
    pub fn below(&self) -> Vec<&Self> {
        let mut found = vec![self];
        let mut at = 0;
        // in the order of the file
        while let Some(node) = found.get(at).copied() {
            found.splice(at + 1..at + 1, &node.children);
            at += 1;
        }
        found
    }
}

/// Reads a file; what holds all of it has no name.
pub(super) fn read(path: &Path) -> Result<Node, Error> {
    let text = std::fs::read_to_string(path).map_err(polycore::Error::from_io("read", path))?;
    let wrong = |reason: String| unusable(path, &reason);
    let mut reader = Reader::from_str(&text);
    let mut open = vec![Node::default()];
    loop {
        let event = reader.read_event().map_err(|error| wrong(error.to_string()))?;
        match event {
            Event::Start(start) => open.push(of(path, &start)?),
            Event::Empty(start) => {
                let node = of(path, &start)?;
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
            return Err(wrong("more than 100 elements in each other".into()));
        }
    }
    match &mut open[..] {
        [all] => Ok(std::mem::take(all)),
        _ => Err(wrong("the end of the file; allowed: elements that end".into())),
    }
}

fn of(path: &Path, start: &BytesStart) -> Result<Node, Error> {
    let name = String::from_utf8_lossy(start.local_name().as_ref()).into_owned();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let attributes = start.attributes().map(|attribute| {
        let attribute = attribute.map_err(|error| unusable(path, &format!("<{name}>: {error}")))?;
        Ok((text(attribute.key.as_ref()), text(&attribute.value)))
    });
    let attributes = attributes.collect::<Result<_, Error>>()?;
    Ok(Node { name, attributes, ..Node::default() })
}
