//! Version 2 of the format: a list of nodes, and elements with their tags
//! (<https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format-version-2-_0028Legacy_0029>).

use std::collections::HashMap;

use super::{MshReader, Numbers, kind_of, place, read_label};
use crate::content::FileNode;
use crate::error::Error;

/// Limit on the tags of an element: groups, an entity, partitions.
const MAX_TAGS: i64 = 10_000;

impl MshReader {
    pub(super) fn nodes_version2(&mut self, numbers: &mut Numbers) -> Result<(), Error> {
        for _ in 0..count(numbers, "number of nodes")? {
            let (label, point) = (read_label(numbers, "number of a node")?, place(numbers)?);
            self.content.nodes.push(FileNode { label, line: numbers.line(), point });
        }
        Ok(())
    }

    /// Reads elements; solids repeated for each of their groups become one.
    pub(super) fn elements_version2(&mut self, numbers: &mut Numbers) -> Result<(), Error> {
        let (all, mut read, mut again) = (count(numbers, "number of elements")?, 0, 0);
        let mut known: HashMap<Vec<u64>, u32> = HashMap::new();
        while read < all {
            // binary elements come in blocks of one type
            let binary = numbers.is_binary();
            let (mut label, mut block) = (0, 1);
            if !binary {
                label = read_label(numbers, "number of an element")?;
            }
            let code = numbers.int("type of an element")?;
            let kind = kind_of(numbers, code)?;
            if binary {
                block = read_label(numbers, "elements of one type")?;
            }
            let tags = numbers.int("number of tags")?;
            if !(0..=MAX_TAGS).contains(&tags) || block == 0 || block > all - read {
                let found = format!("{block} elements with {tags} tags");
                return Err(numbers.error("elements", found, format!("1 to {} with tags", all - read)));
            }
            for _ in 0..block {
                if binary {
                    label = read_label(numbers, "number of an element")?;
                }
                let mut group = 0;
                for tag in 0..tags {
                    let value = numbers.int("tag of an element")?;
                    // the sign is an orientation
                    group = if tag == 0 { value.abs() } else { group };
                }
                self.element(numbers, label, code, kind, |numbers| {
                    read_label(numbers, "node of an element")
                })?;
                let mut own = self.content.elements.len() as u32 - 1;
                if kind.solid().is_some() {
                    let first = self.content.elements[own as usize].first;
                    let nodes = self.content.element_labels[first..].to_vec();
                    let place = *known.entry(nodes).or_insert(own);
                    if place != own {
                        self.content.elements.pop();
                        self.content.element_labels.truncate(first);
                        (own, again) = (place, again + 1);
                    }
                }
                if group > 0 {
                    self.add_to(numbers, kind.dimension() as i64, group, own..own + 1)?;
                }
            }
            read += block;
        }
        if again > 0 {
            let note =
                format!("{again} elements of several physical groups are in each of them, once in the mesh");
            self.content.notes.push(note);
        }
        Ok(())
    }
}

/// Reads a count on its own line, text in binary files too.
fn count(numbers: &mut Numbers, what: &str) -> Result<u64, Error> {
    let line = numbers.text_line();
    line.trim().parse().map_err(|_| numbers.error(what, line, "a count"))
}
