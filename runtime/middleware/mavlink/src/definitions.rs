//! Definitions of messages: the layouts of payloads, read from the XML files of a dialect.
//!
//! Users name these files, so they can use any dialect. The number of files and their sizes are bounded, and a payload
//! is no longer than a frame can hold.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use roxmltree::{Document, Node, ParsingOptions};
use sesame_plan::Primitive;

use crate::frame::{Crc, LONGEST_PAYLOAD};

/// The largest file, in bytes. The files of the common dialects have up to half a million.
const LARGEST_FILE: u64 = 8_000_000;

/// The largest number of files, including those that other files include.
const MOST_FILES: usize = 100;

/// The largest number of nodes in the XML of one file.
const MOST_NODES: u32 = 2_000_000;

/// Numbers of messages are below this: they have three bytes.
const BEYOND_IDS: u32 = 1 << 24;

/// A message as it is on the wire.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Definition {
    /// Its number.
    pub(crate) id: u32,
    /// Its name, such as `HEARTBEAT`.
    pub(crate) name: String,
    /// Its fields, in the order of the wire.
    pub(crate) fields: Vec<Field>,
    /// A digest of the definition. It is part of every checksum, so only receivers with the same definition accept a
    /// frame.
    pub(crate) crc_extra: u8,
    /// The length of a payload without extensions, as in version 1, in bytes.
    pub(crate) base: usize,
    /// The length of a whole payload in bytes.
    pub(crate) whole: usize,
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) kind: FieldKind,
    /// How many elements an array has; `None` for one value.
    pub(crate) elements: Option<usize>,
    /// Where it begins in a payload.
    pub(crate) offset: usize,
}

/// What a field, or an element of an array, is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FieldKind {
    /// A number.
    Number(Primitive),
    /// A character; an array of them is a text.
    Char,
}

impl FieldKind {
    /// The one with this name in definitions.
    fn named(name: &str) -> Option<FieldKind> {
        let number = match name {
            "char" => return Some(FieldKind::Char),
            "int8_t" => Primitive::Int8,
            "uint8_t" => Primitive::Uint8,
            "int16_t" => Primitive::Int16,
            "uint16_t" => Primitive::Uint16,
            "int32_t" => Primitive::Int32,
            "uint32_t" => Primitive::Uint32,
            "int64_t" => Primitive::Int64,
            "uint64_t" => Primitive::Uint64,
            "float" => Primitive::Float32,
            "double" => Primitive::Float64,
            _ => return None,
        };
        Some(FieldKind::Number(number))
    }

    /// Its size in bytes.
    pub(crate) fn size(self) -> usize {
        match self {
            FieldKind::Number(Primitive::Int16 | Primitive::Uint16) => 2,
            FieldKind::Number(Primitive::Int32 | Primitive::Uint32 | Primitive::Float32) => 4,
            FieldKind::Number(Primitive::Int64 | Primitive::Uint64 | Primitive::Float64) => 8,
            FieldKind::Number(Primitive::Bool | Primitive::Int8 | Primitive::Uint8) | FieldKind::Char => 1,
        }
    }
}

impl Definition {
    /// A message with these fields, as pairs of a type and a name in the order of the file. `written` are the fields of
    /// both versions, `extensions` those of version 2 only. An error says what is wrong.
    pub(crate) fn new(
        id: u32,
        name: &str,
        written: &[(&str, &str)],
        extensions: &[(&str, &str)],
    ) -> Result<Definition, String> {
        let mut crc = Crc::default();
        crc.add(name.as_bytes());
        crc.add(b" ");
        let read = |&(ty, name): &(&str, &str)| {
            let (word, elements) = array(ty)?;
            // A sender puts the version of the protocol here.
            let word = if word == "uint8_t_mavlink_version" { "uint8_t" } else { word };
            let kind = FieldKind::named(word).ok_or_else(|| format!("field `{name}` has the unknown type `{ty}`"))?;
            Ok((word.to_owned(), Field { name: name.to_owned(), kind, elements, offset: 0 }))
        };
        let mut base = written.iter().map(read).collect::<Result<Vec<(String, Field)>, String>>()?;
        // Large fields come first, which aligns all of them; fields of equal size keep their order.
        base.sort_by_key(|(_, field)| std::cmp::Reverse(field.kind.size()));
        for (word, field) in &base {
            crc.add(word.as_bytes());
            crc.add(b" ");
            crc.add(field.name.as_bytes());
            crc.add(b" ");
            if let Some(elements) = field.elements {
                crc.add(&[u8::try_from(elements).unwrap_or(u8::MAX)]);
            }
        }
        let base_fields = base.len();
        let extensions = extensions.iter().map(read).collect::<Result<Vec<(String, Field)>, String>>()?;
        let mut fields: Vec<Field> = base.into_iter().chain(extensions).map(|(_, field)| field).collect();
        let mut names = BTreeSet::new();
        let (mut offset, mut base) = (0, 0);
        for (at, field) in fields.iter_mut().enumerate() {
            field.offset = offset;
            offset += field.kind.size() * field.elements.unwrap_or(1);
            if at < base_fields {
                base = offset;
            }
            if offset > LONGEST_PAYLOAD {
                return Err(format!("it has more than {LONGEST_PAYLOAD} bytes"));
            }
            if field.name.is_empty() || !names.insert(field.name.clone()) {
                return Err(format!("it has two fields `{}`, or one without a name", field.name));
            }
        }
        Ok(Definition { id, name: name.to_owned(), fields, crc_extra: crc.folded(), base, whole: offset })
    }

    /// The position of a field.
    pub(crate) fn position(&self, name: &str) -> Option<usize> {
        self.fields.iter().position(|field| field.name == name)
    }
}

/// The type of the elements and, for an array such as `uint8_t[20]`, their number.
fn array(ty: &str) -> Result<(&str, Option<usize>), String> {
    let Some((word, length)) = ty.split_once('[') else { return Ok((ty, None)) };
    let length = length.strip_suffix(']').and_then(|length| length.trim().parse::<usize>().ok());
    match length {
        Some(length @ 1..=LONGEST_PAYLOAD) => Ok((word, Some(length))),
        _ => Err(format!("`{ty}` is not an array of 1 to {LONGEST_PAYLOAD} elements")),
    }
}

/// The messages that some files define.
#[derive(Debug, Clone, Default)]
pub(crate) struct Definitions {
    by_name: BTreeMap<String, Definition>,
    names: BTreeMap<u32, String>,
}

impl Definitions {
    /// Reads these files, relative to a folder, and all files that they include. An error names the file.
    pub(crate) fn read(paths: &[String], folder: &Path) -> Result<Definitions, String> {
        let mut definitions = Definitions::default();
        let mut wanted: Vec<PathBuf> = paths.iter().map(|path| folder.join(path)).collect();
        let mut known = BTreeSet::new();
        while let Some(path) = wanted.pop() {
            let wrong = |problem: String| format!("the definitions in `{}` cannot be used: {problem}", path.display());
            // A file that is included twice, or includes itself, is read once.
            let own = path.canonicalize().map_err(|error| wrong(error.to_string()))?;
            if !known.insert(own) {
                continue;
            }
            if known.len() > MOST_FILES {
                return Err(wrong(format!("there are more than {MOST_FILES} files")));
            }
            let text = contents(&path).map_err(wrong)?;
            let includes = definitions.add(&text).map_err(wrong)?;
            let beside = path.parent().unwrap_or(Path::new(""));
            wanted.extend(includes.iter().map(|include| beside.join(include)));
        }
        Ok(definitions)
    }

    /// Adds the messages of a file and returns the files that it includes.
    pub(crate) fn add(&mut self, text: &str) -> Result<Vec<String>, String> {
        let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
        let document =
            Document::parse_with_options(text, options).map_err(|error| format!("it is not XML: {error}"))?;
        let root = document.root_element();
        if !root.has_tag_name("mavlink") {
            return Err("it does not begin with `<mavlink>`".to_owned());
        }
        let includes = children(root, "include").filter_map(|include| include.text());
        let includes = includes.map(|file| file.trim().to_owned()).collect();
        for message in children(root, "messages").flat_map(|messages| children(messages, "message")) {
            self.insert(definition(message)?)?;
        }
        Ok(includes)
    }

    pub(crate) fn insert(&mut self, definition: Definition) -> Result<(), String> {
        let Definition { id, name, .. } = &definition;
        let same_name = self.by_name.get(name).is_none_or(|known| *known == definition);
        if !same_name || self.names.get(id).is_some_and(|known| known != name) {
            return Err(format!("message `{name}` ({id}) is defined twice, in different ways"));
        }
        self.names.insert(*id, name.clone());
        self.by_name.insert(name.clone(), definition);
        Ok(())
    }

    /// The message with this name.
    pub(crate) fn named(&self, name: &str) -> Option<&Definition> {
        self.by_name.get(name)
    }

    /// All of them, by their names.
    #[cfg(test)]
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Definition> {
        self.by_name.values()
    }
}

fn children<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |child| child.has_tag_name(name))
}

fn definition(message: Node<'_, '_>) -> Result<Definition, String> {
    let name = message.attribute("name").unwrap_or_default();
    let id = message.attribute("id").and_then(|id| id.parse::<u32>().ok()).filter(|id| *id < BEYOND_IDS);
    let (Some(id), false) = (id, name.is_empty()) else {
        return Err(format!("message `{name}` has no name, or no number below {BEYOND_IDS}"));
    };
    let mut fields = [Vec::new(), Vec::new()];
    let mut extended = false;
    for child in message.children() {
        extended |= child.has_tag_name("extensions");
        if child.has_tag_name("field") {
            let attribute = |name| child.attribute(name).unwrap_or_default();
            fields[usize::from(extended)].push((attribute("type"), attribute("name")));
        }
    }
    let [base, extensions] = fields;
    Definition::new(id, name, &base, &extensions).map_err(|problem| format!("message `{name}`: {problem}"))
}

fn contents(path: &Path) -> Result<String, String> {
    let said = |error: std::io::Error| error.to_string();
    if !path.metadata().map_err(said)?.is_file() {
        return Err("it is not a file".to_owned());
    }
    let mut text = String::new();
    let read = File::open(path).map_err(said)?.take(LARGEST_FILE + 1).read_to_string(&mut text).map_err(said)?;
    if read as u64 > LARGEST_FILE {
        return Err(format!("it has more than {LARGEST_FILE} bytes"));
    }
    Ok(text)
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "they write files and ask another program")]
mod tests;
