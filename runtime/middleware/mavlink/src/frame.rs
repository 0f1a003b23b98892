//! Frames of `MAVLink` as bytes: how they are found in a datagram, read, changed and made.
//!
//! No message is built in. The header alone is enough to find a frame; its [`Definition`] is needed to check it and to
//! read its payload.

use std::ops::Range;
use std::sync::Arc;

use sesame_interfaces::mavlink::{Crc, Definition, Field, FieldKind};
use sesame_plan::{CampaignPlan, Primitive, Type, mavlink};
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::{bits_of, value_of};

/// The first byte of a frame of each version, and the length of its header in bytes.
const VERSION_1: (u8, usize) = (0xFE, 6);
const VERSION_2: (u8, usize) = (0xFD, 10);

/// The flag of a frame with a signature after its checksum, and the length of the signature in bytes.
const SIGNED: u8 = 1;
const SIGNATURE: usize = 13;

/// The length of a checksum in bytes.
const CHECKSUM: usize = 2;

/// A frame in a datagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Frame<'a> {
    /// The whole frame.
    pub(crate) bytes: &'a [u8],
    /// The system that sent it.
    pub(crate) system: u8,
    /// Its component.
    pub(crate) component: u8,
    /// The number of the message.
    pub(crate) id: u32,
    /// The flags that receivers have to understand; version 1 has none.
    flags: u8,
    header: usize,
    length: usize,
}

impl<'a> Frame<'a> {
    /// The frame at the beginning of these bytes, if there is a whole one.
    pub(crate) fn first(bytes: &'a [u8]) -> Option<Frame<'a>> {
        let (&magic, &length) = (bytes.first()?, bytes.get(1)?);
        let length = usize::from(length);
        let frame = if magic == VERSION_1.0 {
            let &[_, _, _, system, component, id] = bytes.first_chunk()?;
            Frame { bytes, system, component, id: u32::from(id), flags: 0, header: VERSION_1.1, length }
        } else if magic == VERSION_2.0 {
            let &[_, _, flags, _, _, system, component, low, middle, high] = bytes.first_chunk()?;
            let id = u32::from_le_bytes([low, middle, high, 0]);
            Frame { bytes, system, component, id, flags, header: VERSION_2.1, length }
        } else {
            return None;
        };
        let signature = if frame.is_signed() { SIGNATURE } else { 0 };
        let whole = bytes.get(..frame.header + length + CHECKSUM + signature)?;
        Some(Frame { bytes: whole, ..frame })
    }

    /// Whether it has a signature, so that nobody without the key can change it.
    pub(crate) fn is_signed(&self) -> bool {
        self.flags & SIGNED != 0
    }

    /// Whether it has a flag that is unknown here, so that its layout is unknown, too.
    pub(crate) fn is_of_later_version(&self) -> bool {
        self.flags & !SIGNED != 0
    }

    fn is_version_1(&self) -> bool {
        self.header == VERSION_1.1
    }

    fn payload(&self) -> Range<usize> {
        self.header..self.header + self.length
    }

    /// Whether its checksum is right for this definition.
    fn is_intact(&self, definition: &Definition) -> bool {
        let end = self.payload().end;
        Crc::of_frame(&self.bytes[1..end], definition.crc_extra) == self.bytes[end..end + CHECKSUM]
    }

    /// The same frame with another payload and no signature. Version 2 leaves out zeros at the end of the payload.
    fn with_payload(&self, payload: &[u8], extra: u8) -> Vec<u8> {
        let mut payload = payload;
        if !self.is_version_1() {
            // The first byte stays, even if it is zero.
            while let [_, .., 0] = payload {
                payload = &payload[..payload.len() - 1];
            }
        }
        let mut bytes = self.bytes[..self.header].to_vec();
        bytes[1] = u8::try_from(payload.len()).expect("no definition is longer than a frame can be");
        bytes.extend_from_slice(payload);
        let checksum = Crc::of_frame(&bytes[1..], extra);
        bytes.extend_from_slice(&checksum);
        bytes
    }
}

/// The sender of a frame that the runner makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Sender {
    pub(crate) system: u8,
    pub(crate) component: u8,
    /// The number of the frame among those of the sender.
    pub(crate) sequence: u8,
}

/// How the messages of a topic are read and written.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    definition: Definition,
    names: Arc<Fields>,
    /// For each declared field its position in the definition and its declared type.
    declared: Vec<(usize, Type)>,
}

impl Layout {
    /// The layout for a topic of this type whose messages have this definition. An error says which field does not fit.
    pub(crate) fn new(plan: &CampaignPlan, ty: &Type, definition: &Definition) -> Result<Layout, String> {
        let Type::Message { id } = ty else { return Err("its type is not a `message`".to_owned()) };
        let fields = &plan.message(*id).fields;
        let declared = fields.iter().map(|declared| {
            let Some(at) = definition.position(&declared.name) else {
                let known: Vec<String> = definition.fields.iter().map(|field| format!("`{}`", field.name)).collect();
                return Err(format!(
                    "`{}` has no field `{}`; it has {}",
                    definition.name,
                    declared.name,
                    known.join(", ")
                ));
            };
            let field = &definition.fields[at];
            if fits(field, &declared.ty) {
                Ok((at, declared.ty.clone()))
            } else {
                Err(format!(
                    "field `{}` of `{}` is {}",
                    field.name,
                    definition.name,
                    mavlink::types_in_words(&field.wire_type())
                ))
            }
        });
        Ok(Layout {
            declared: declared.collect::<Result<_, _>>()?,
            names: Fields::new(fields.iter().map(|field| field.name.as_str())),
            definition: definition.clone(),
        })
    }

    /// The number of the message.
    pub(crate) fn id(&self) -> u32 {
        self.definition.id
    }

    /// Reads a frame. The message remembers `origin` as what it was read from. An error says why the frame cannot be
    /// read.
    pub(crate) fn read(&self, frame: &Frame<'_>, origin: Arc<[u8]>) -> Result<Value, String> {
        let payload = whole_payload(frame, &self.definition)?;
        let value = |(at, ty): &(usize, Type)| value_in(&self.definition.fields[*at], &payload, ty);
        let values = self.declared.iter().map(value).collect::<Result<_, _>>()?;
        Ok(Value::Record(Record::decoded(&self.names, values, origin)))
    }

    /// The frame with the values that have changed. Everything else stays as it was.
    pub(crate) fn write(&self, frame: &Frame<'_>, before: &[Value], now: &[Value]) -> Vec<u8> {
        let mut payload = frame.bytes[frame.payload()].to_vec();
        // The sender left out zeros at the end. Version 1 leaves nothing out and has no extensions.
        if !frame.is_version_1() {
            payload.resize(payload.len().max(self.definition.whole), 0);
        }
        for ((at, _), (before, now)) in self.declared.iter().zip(before.iter().zip(now)) {
            if !before.is_same(now) {
                put(&self.definition.fields[*at], &mut payload, Some(before), now);
            }
        }
        frame.with_payload(&payload, self.definition.crc_extra)
    }

    /// A frame that nobody sent before. Fields that the space does not declare are zero.
    pub(crate) fn make(&self, sender: Sender, values: &[Value]) -> Vec<u8> {
        let mut payload = vec![0; self.definition.whole];
        for ((at, _), value) in self.declared.iter().zip(values) {
            put(&self.definition.fields[*at], &mut payload, None, value);
        }
        let Sender { system, component, sequence } = sender;
        let [low, middle, high, _] = self.definition.id.to_le_bytes();
        let header = [VERSION_2.0, 0, 0, 0, sequence, system, component, low, middle, high];
        let (id, header_length) = (self.definition.id, VERSION_2.1);
        let frame = Frame { bytes: &header, system, component, id, flags: 0, header: header_length, length: 0 };
        frame.with_payload(&payload, self.definition.crc_extra)
    }
}

/// The payload of a frame with all fields of its definition. An error says why the frame cannot be read.
fn whole_payload(frame: &Frame<'_>, definition: &Definition) -> Result<Vec<u8>, String> {
    let Definition { name, base, whole, .. } = definition;
    if frame.is_of_later_version() {
        return Err("its flags ask for something that is not known here".to_owned());
    }
    if !frame.is_intact(definition) {
        return Err(format!(
            "its checksum is not that of a `{name}` as it is defined here; the sender may have another definition"
        ));
    }
    if frame.is_version_1() && frame.length != *base {
        return Err(format!("a `{name}` of version 1 has {base} bytes, and this one has {}", frame.length));
    }
    let mut payload = frame.bytes[frame.payload()].to_vec();
    payload.resize(payload.len().max(*whole), 0);
    Ok(payload)
}

/// All values of a frame, by the fields of its definition; `None` for a number that the language does not have. An
/// error says why the frame cannot be read.
pub(crate) fn values(frame: &Frame<'_>, definition: &Definition) -> Result<Vec<Option<Value>>, String> {
    let payload = whole_payload(frame, definition)?;
    let value = |field: &Field| {
        let one = match field.kind {
            FieldKind::Char => Type::Text,
            FieldKind::Number(Primitive::Float32 | Primitive::Float64) => Type::Real { unit: None },
            FieldKind::Number(_) => Type::Int { unit: None },
        };
        let ty = if field.elements.is_some() && field.kind != FieldKind::Char {
            Type::List { of: Box::new(one) }
        } else {
            one
        };
        value_in(field, &payload, &ty).ok()
    };
    Ok(definition.fields.iter().map(value).collect())
}

/// Whether a field can be declared with this type.
fn fits(field: &Field, ty: &Type) -> bool {
    let word = |ty: &Type| match ty {
        Type::Bool => "bool",
        Type::Int { .. } => "int",
        Type::Real { .. } => "real",
        Type::Text => "text",
        Type::Point { .. } | Type::List { .. } | Type::Message { .. } => "",
    };
    let (list, one) = if let Type::List { of } = ty { (true, &**of) } else { (false, ty) };
    mavlink::can_be_declared(&field.wire_type(), list, word(one))
}

/// The bytes of a field in a payload; fewer if the payload ends before.
fn bytes_of<'p>(field: &Field, payload: &'p [u8]) -> &'p [u8] {
    let end = (field.offset + field.kind.size() * field.elements.unwrap_or(1)).min(payload.len());
    &payload[field.offset.min(end)..end]
}

/// The value of a field in a whole payload.
fn value_in(field: &Field, payload: &[u8], ty: &Type) -> Result<Value, String> {
    let bytes = bytes_of(field, payload);
    match (field.kind, ty) {
        (FieldKind::Number(primitive), Type::List { of }) => {
            let each = bytes.chunks_exact(field.kind.size());
            each.map(|bytes| number(field, primitive, bytes, of)).collect::<Result<_, _>>().map(Value::List)
        }
        (FieldKind::Number(primitive), ty) => number(field, primitive, bytes, ty),
        (FieldKind::Char, _) => {
            let text = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
            Ok(Value::from(&*String::from_utf8_lossy(text)))
        }
    }
}

fn number(field: &Field, primitive: Primitive, bytes: &[u8], ty: &Type) -> Result<Value, String> {
    let mut wide = [0; 8];
    wide[..bytes.len()].copy_from_slice(bytes);
    let value = value_of(primitive, u64::from_le_bytes(wide));
    let value = value.ok_or_else(|| format!("field `{}` holds a number of 2⁶³ or more", field.name))?;
    Ok(match (ty, value) {
        (Type::Bool, Value::Int(number)) => Value::Bool(number != 0),
        (Type::Real { .. }, Value::Int(number)) => Value::Real(number as f64),
        (_, value) => value,
    })
}

/// Puts the value of a field into a payload. Numbers are clamped to the range of the field, and a text that is too long
/// is cut between two characters. Elements of a list that equal those of `before` keep their bytes. A field that the
/// payload does not have, as an extension in version 1, is left out.
fn put(field: &Field, payload: &mut [u8], before: Option<&Value>, now: &Value) {
    let size = field.kind.size();
    let end = (field.offset + size * field.elements.unwrap_or(1)).min(payload.len());
    let own = &mut payload[field.offset.min(end)..end];
    match (field.kind, now) {
        (FieldKind::Char, Value::Text(text)) => {
            let mut length = text.len().min(own.len());
            while !text.is_char_boundary(length) {
                length -= 1;
            }
            own.fill(0);
            own[..length].copy_from_slice(&text.as_bytes()[..length]);
        }
        (FieldKind::Number(primitive), Value::List(items)) => {
            let was = match before {
                Some(Value::List(was)) => was.as_slice(),
                _ => &[],
            };
            for (at, (bytes, item)) in own.chunks_exact_mut(size).zip(items).enumerate() {
                if !was.get(at).is_some_and(|was| was.is_same(item)) {
                    bytes.copy_from_slice(&bits_of(primitive, Some(item)).to_le_bytes()[..size]);
                }
            }
        }
        (FieldKind::Number(primitive), value) if own.len() == size => {
            own.copy_from_slice(&bits_of(primitive, Some(value)).to_le_bytes()[..size]);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests;
