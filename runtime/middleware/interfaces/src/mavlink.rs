//! Messages of `MAVLink`: the layouts of payloads, read from the XML files of a dialect.
//!
//! Users name these files, so they can use any dialect. The caller provides the text of each file and
//! bounds its size. The number of files is bounded here, and a payload is no longer than a frame can hold.

mod checksum;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use roxmltree::{Document, Node, ParsingOptions};
use sesame_plan::{Interface, InterfaceField, Primitive, WireType};

pub use checksum::Crc;

/// The longest payload, in bytes.
pub const LONGEST_PAYLOAD: usize = 255;

/// The largest number of files, including those that other files include.
const MOST_FILES: usize = 100;

/// The largest number of nodes in the XML of one file.
const MOST_NODES: u32 = 2_000_000;

/// Numbers of messages are below this: they have three bytes.
const BEYOND_IDS: u32 = 1 << 24;

/// A message as it is on the wire.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Definition {
    /// Its number.
    pub id: u32,
    /// Its name, such as `HEARTBEAT`.
    pub name: String,
    /// Its fields, in the order of the wire.
    pub fields: Vec<Field>,
    /// A digest of the definition. It is part of every checksum, so only receivers with the same definition accept a
    /// frame.
    pub crc_extra: u8,
    /// The length of a payload without extensions, as in version 1, in bytes.
    pub base: usize,
    /// The length of a whole payload in bytes.
    pub whole: usize,
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// What it is, or each of its elements.
    pub kind: FieldKind,
    /// How many elements an array has; `None` for one value.
    pub elements: Option<usize>,
    /// Where it begins in a payload.
    pub offset: usize,
    /// Its unit, as the file has it, such as `m/s`.
    pub unit: Option<String>,
    /// The name of the enumeration whose entries are its values.
    pub enumeration: Option<String>,
}

/// A value of an enumeration with its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Its name, such as `MAV_STATE_ACTIVE`.
    pub name: String,
    /// Its number.
    pub value: u64,
}

/// What a field, or an element of an array, is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldKind {
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
    pub fn size(self) -> usize {
        match self {
            FieldKind::Number(Primitive::Int16 | Primitive::Uint16) => 2,
            FieldKind::Number(Primitive::Int32 | Primitive::Uint32 | Primitive::Float32) => 4,
            FieldKind::Number(Primitive::Int64 | Primitive::Uint64 | Primitive::Float64) => 8,
            FieldKind::Number(Primitive::Bool | Primitive::Int8 | Primitive::Uint8) | FieldKind::Char => 1,
        }
    }
}

impl Field {
    /// Its type, as a type of ROS would be: an array of characters is a text.
    pub fn wire_type(&self) -> WireType {
        let FieldKind::Number(primitive) = self.kind else { return WireType::STRING };
        let number = WireType::Primitive { primitive };
        match self.elements.and_then(|elements| u32::try_from(elements).ok()) {
            Some(length) => WireType::Array { of: Box::new(number), length },
            None => number,
        }
    }
}

impl Definition {
    /// A message with these fields, as pairs of a type and a name in the order of the file. `written` are the fields of
    /// both versions, `extensions` those of version 2 only. An error says what is wrong.
    pub fn new(
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
            Ok((
                word.to_owned(),
                Field { name: name.to_owned(), kind, elements, offset: 0, unit: None, enumeration: None },
            ))
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

    /// Its fields without their places in a payload.
    pub fn interface(&self) -> Interface {
        let field = |field: &Field| InterfaceField { name: field.name.clone(), ty: field.wire_type() };
        Interface { name: self.name.clone(), fields: self.fields.iter().map(field).collect() }
    }

    /// The position of a field.
    pub fn position(&self, name: &str) -> Option<usize> {
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

/// A file that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the definitions in `{}` cannot be used: {problem}", path.display())]
pub struct Unusable {
    /// The position of the file that was named: this one, or one that includes it.
    pub named: usize,
    /// Whether another file includes it.
    pub included: bool,
    /// Where it is.
    pub path: PathBuf,
    /// What is wrong with it, in a clause.
    pub problem: String,
}

impl Unusable {
    /// What is wrong with the file that was named, in a clause.
    pub fn why(&self) -> String {
        if self.included {
            format!("it includes `{}`, and {}", self.path.display(), self.problem)
        } else {
            self.problem.clone()
        }
    }
}

/// The messages that some files define.
#[derive(Debug, Clone, Default)]
pub struct Definitions {
    by_name: BTreeMap<String, Definition>,
    names: BTreeMap<u32, String>,
    /// The entries of each enumeration, of all files that define it.
    enumerations: BTreeMap<String, Vec<Entry>>,
}

impl Definitions {
    /// Reads these files, relative to a folder, and all files that they include; `contents` gives the text of each, or
    /// says why there is none. Each of these files with a mistake is reported once.
    pub fn read(
        files: &[String],
        folder: &Path,
        contents: &dyn Fn(&Path) -> Result<String, String>,
    ) -> Result<Definitions, Vec<Unusable>> {
        let (mut definitions, mut unusable) = (Definitions::default(), Vec::new());
        let mut known = BTreeSet::new();
        for (named, file) in files.iter().enumerate() {
            let mut wanted = vec![folder.join(file)];
            while let Some(path) = wanted.pop() {
                // A file that is included twice, or includes itself, is read once.
                if !known.insert(without_detours(&path)) {
                    continue;
                }
                let text = if known.len() > MOST_FILES {
                    Err(format!("there are more than {MOST_FILES} files"))
                } else {
                    contents(&path)
                };
                match text.and_then(|text| definitions.add(&text)) {
                    Ok(includes) => {
                        let beside = path.parent().unwrap_or(Path::new(""));
                        wanted.extend(includes.iter().map(|include| beside.join(include)));
                    }
                    Err(problem) => {
                        let included = path != folder.join(file);
                        unusable.push(Unusable { named, included, path, problem });
                        break;
                    }
                }
            }
        }
        if unusable.is_empty() { Ok(definitions) } else { Err(unusable) }
    }

    /// Adds the messages of a file and returns the files that it includes.
    pub fn add(&mut self, text: &str) -> Result<Vec<String>, String> {
        let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
        let document =
            Document::parse_with_options(text, options).map_err(|error| format!("it is not XML: {error}"))?;
        let root = document.root_element();
        if !root.has_tag_name("mavlink") {
            return Err("it does not begin with `<mavlink>`".to_owned());
        }
        let includes = children(root, "include").filter_map(|include| include.text());
        let includes = includes.map(|file| file.trim().to_owned()).collect();
        for enumeration in children(root, "enums").flat_map(|enums| children(enums, "enum")) {
            self.enumerate(enumeration)?;
        }
        for message in children(root, "messages").flat_map(|messages| children(messages, "message")) {
            self.insert(definition(message)?)?;
        }
        Ok(includes)
    }

    /// Adds a message. An error says that another one has its name or its number.
    pub fn insert(&mut self, definition: Definition) -> Result<(), String> {
        let Definition { id, name, .. } = &definition;
        let same_name = self.by_name.get(name).is_none_or(|known| *known == definition);
        if !same_name || self.names.get(id).is_some_and(|known| known != name) {
            return Err(format!("message `{name}` ({id}) is defined twice, in different ways"));
        }
        self.names.insert(*id, name.clone());
        self.by_name.insert(name.clone(), definition);
        Ok(())
    }

    /// Adds the entries of an enumeration, which other files may extend. An error says that an entry has no number, or
    /// that another one has its name.
    fn enumerate(&mut self, enumeration: Node<'_, '_>) -> Result<(), String> {
        let of = enumeration.attribute("name").unwrap_or_default();
        let known = self.enumerations.entry(of.to_owned()).or_default();
        let mut next = Some(0);
        for entry in children(enumeration, "entry") {
            let name = entry.attribute("name").unwrap_or_default();
            // An entry without a number has the one after that of the entry before.
            let value = entry.attribute("value").map_or(next, number);
            let (Some(value), false) = (value, name.is_empty()) else {
                return Err(format!("entry `{name}` of the enumeration `{of}` has no name, or no number"));
            };
            next = value.checked_add(1);
            match known.iter().find(|entry| entry.name == name) {
                Some(entry) if entry.value == value => {}
                Some(_) => {
                    return Err(format!(
                        "entry `{name}` of the enumeration `{of}` is defined twice, with different numbers"
                    ));
                }
                None => known.push(Entry { name: name.to_owned(), value }),
            }
        }
        Ok(())
    }

    /// The fields of a message that are enumerations, each with every value that it may have by name.
    pub fn entries<'d>(&'d self, of: &'d Definition) -> impl Iterator<Item = (&'d Field, &'d Entry)> {
        of.fields.iter().flat_map(|field| {
            let entries = field.enumeration.as_ref().and_then(|name| self.enumerations.get(name));
            entries.into_iter().flatten().map(move |entry| (field, entry))
        })
    }

    /// The message with this name.
    pub fn named(&self, name: &str) -> Option<&Definition> {
        self.by_name.get(name)
    }

    /// The message with this number.
    pub fn numbered(&self, id: u32) -> Option<&Definition> {
        self.names.get(&id).and_then(|name| self.by_name.get(name))
    }

    /// All of them, by their names.
    pub fn iter(&self) -> impl Iterator<Item = &Definition> {
        self.by_name.values()
    }
}

/// A path without `.` and `..`, so that a file has one name, links aside.
fn without_detours(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if plain.file_name().is_some() => {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    plain
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
    let (mut units, mut enumerations) = (BTreeMap::new(), BTreeMap::new());
    let mut extended = false;
    for child in message.children() {
        extended |= child.has_tag_name("extensions");
        if child.has_tag_name("field") {
            let attribute = |name| child.attribute(name).unwrap_or_default();
            fields[usize::from(extended)].push((attribute("type"), attribute("name")));
            units.extend(child.attribute("units").map(|unit| (attribute("name"), unit.to_owned())));
            enumerations.extend(child.attribute("enum").map(|of| (attribute("name"), of.to_owned())));
        }
    }
    let [base, extensions] = fields;
    let definition = Definition::new(id, name, &base, &extensions);
    let mut definition = definition.map_err(|problem| format!("message `{name}`: {problem}"))?;
    for field in &mut definition.fields {
        field.unit = units.remove(field.name.as_str());
        field.enumeration = enumerations.remove(field.name.as_str());
    }
    Ok(definition)
}

/// The number of an entry, as files write it: `16`, `0x10`, `0b10000` or `2**4`.
fn number(written: &str) -> Option<u64> {
    let written = written.trim();
    if let Some(power) = written.strip_prefix("2**") {
        return 1u64.checked_shl(power.parse().ok()?);
    }
    match (written.strip_prefix("0x"), written.strip_prefix("0b")) {
        (Some(digits), _) => u64::from_str_radix(digits, 16).ok(),
        (_, Some(digits)) => u64::from_str_radix(digits, 2).ok(),
        (None, None) => written.parse().ok(),
    }
}

#[cfg(test)]
mod tests;
