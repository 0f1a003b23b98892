//! Messages are written: changes into the sample from which they were read, or anew.

use std::sync::Arc;

use sesame_plan::Primitive;
use sesame_relay::value::Value;
use sesame_relay::wire::{bits_of, seconds_and_nanos};

use super::error::CodecError;
use super::layout::{Layout, Meaning, Selection, Shape, Ty};
use super::read::{Input, element};
use super::{HEADER, WIDE};

/// The bits of the header's last byte that hold how many bytes follow the last field (DDS-XTypes 1.3, 7.6.3.1.2).
const PADDING_COUNT: u8 = 3;

pub(super) fn write(layout: &Layout, selection: &Selection, message: &Value) -> Result<Arc<[u8]>, CodecError> {
    let Value::Record(record) = message else { return Err(CodecError::NoMessage(message.kind())) };
    let Some(origin) = record.origin() else {
        let mut output = Output { bytes: vec![0, 1, 0, 0], little: true };
        output.message(layout, layout.message(), message);
        return Ok(output.bytes.into());
    };
    if let Some(bytes) = record.unchanged() {
        return Ok(Arc::clone(bytes));
    }
    let mut input = Input::new(&origin.bytes)?;
    let mut output = Output { bytes: origin.bytes[..HEADER].to_vec(), little: input.little };
    // Some writers say there how many bytes follow the last field. Now none do; a reader would cut the message instead.
    output.bytes[HEADER - 1] &= !PADDING_COUNT;
    let mut pairs = record.values().iter().zip(&origin.values);
    let shape = layout.message();
    for (at, (ty, name)) in shape.types.iter().zip(shape.fields.names()).enumerate() {
        let read = match selection {
            Selection::Fields(_, fields) => !matches!(fields[at], Selection::Nothing),
            _ => true,
        };
        let pair = if read { pairs.next() } else { None };
        output.copy(layout, ty, pair, &mut input).map_err(|error| error.inside(name))?;
    }
    Ok(output.bytes.into())
}

struct Output {
    bytes: Vec<u8>,
    little: bool,
}

impl Output {
    fn align(&mut self, align: usize) {
        let at = self.bytes.len() - HEADER;
        self.bytes.resize(HEADER + at.next_multiple_of(align), 0);
    }

    fn bits(&mut self, bits: u64, size: usize) {
        self.align(size);
        if self.little {
            self.bytes.extend_from_slice(&bits.to_le_bytes()[..size]);
        } else {
            self.bytes.extend_from_slice(&bits.to_be_bytes()[8 - size..]);
        }
    }

    fn length(&mut self, length: usize) {
        self.bits(u64::try_from(length).unwrap_or(u64::MAX), 4);
    }

    /// Copies a value of a sample, with the changes from how it was read to how it is now.
    fn copy(
        &mut self,
        layout: &Layout,
        ty: &Ty,
        pair: Option<(&Value, &Value)>,
        input: &mut Input<'_>,
    ) -> Result<(), CodecError> {
        let Some((now, before)) = pair.filter(|(now, before)| !now.is_same(before)) else {
            return self.copy_unchanged(layout, ty, input);
        };
        match ty {
            Ty::Primitive(_) | Ty::String | Ty::WString => {
                input.skip(layout, ty)?;
                self.value(layout, ty, Some(now));
                Ok(())
            }
            Ty::Shape(at) => {
                let shape = &layout.shapes[*at];
                if shape.meaning == Meaning::Time {
                    input.skip(layout, ty)?;
                    self.value(layout, ty, Some(now));
                    return Ok(());
                }
                for (at, (ty, name)) in shape.types.iter().zip(shape.fields.names()).enumerate() {
                    let coordinate = |value: &Value| match value {
                        Value::Point(point) => Some(Value::Real(point[at])),
                        Value::Record(record) => record.get(name).cloned(),
                        _ => None,
                    };
                    let (now, before) = (coordinate(now), coordinate(before));
                    self.copy(layout, ty, now.as_ref().zip(before.as_ref()), input)
                        .map_err(|error| error.inside(name))?;
                }
                Ok(())
            }
            Ty::Array(of, length) => {
                let (now, before) = (items(now), items(before));
                for at in 0..*length {
                    let pair = now.get(at).zip(before.get(at));
                    self.copy(layout, of, pair, input).map_err(|error| element(error, at))?;
                }
                Ok(())
            }
            Ty::Sequence(of, bound) => {
                let (now, before) = (items(now), items(before));
                let was = input.length(*bound)?;
                let most = bound.map_or(usize::MAX, |bound| bound as usize);
                let is = now.len().min(most);
                self.length(is);
                for at in 0..was {
                    if at < is {
                        let pair = now.get(at).zip(before.get(at));
                        self.copy(layout, of, pair, input).map_err(|error| element(error, at))?;
                    } else {
                        input.skip(layout, of).map_err(|error| element(error, at))?;
                    }
                }
                for item in now.iter().take(is).skip(was) {
                    self.value(layout, of, Some(item));
                }
                Ok(())
            }
        }
    }

    /// Copies a value as it is.
    fn copy_unchanged(&mut self, layout: &Layout, ty: &Ty, input: &mut Input<'_>) -> Result<(), CodecError> {
        if let Some((primitive, count)) = layout.uniform(ty) {
            return self.copy_run(primitive, count, input);
        }
        match ty {
            Ty::Primitive(primitive) => self.copy_run(*primitive, 1, input),
            Ty::String => {
                let length = input.length(None)?;
                self.length(length);
                self.bytes.extend_from_slice(input.take(1, length)?);
                Ok(())
            }
            Ty::WString => {
                let length = input.length(None)?;
                self.length(length);
                self.copy_run(Primitive::Uint32, length, input)
            }
            Ty::Shape(at) => {
                let shape = &layout.shapes[*at];
                let mut fields = shape.types.iter().zip(shape.fields.names());
                fields.try_for_each(|(ty, name)| {
                    self.copy_unchanged(layout, ty, input).map_err(|error| error.inside(name))
                })
            }
            Ty::Array(of, length) => self.copy_items(layout, of, *length, input),
            Ty::Sequence(of, bound) => {
                let length = input.length(*bound)?;
                self.length(length);
                match layout.uniform(of) {
                    Some((primitive, count)) => self.copy_run(primitive, count.saturating_mul(length), input),
                    None => self.copy_items(layout, of, length, input),
                }
            }
        }
    }

    fn copy_items(&mut self, layout: &Layout, of: &Ty, length: usize, input: &mut Input<'_>) -> Result<(), CodecError> {
        (0..length).try_for_each(|at| self.copy_unchanged(layout, of, input).map_err(|error| element(error, at)))
    }

    fn copy_run(&mut self, primitive: Primitive, count: usize, input: &mut Input<'_>) -> Result<(), CodecError> {
        if count > 0 {
            let bytes = input.take(primitive.size(), primitive.size().saturating_mul(count))?;
            self.align(primitive.size());
            self.bytes.extend_from_slice(bytes);
        }
        Ok(())
    }

    /// Writes a message anew.
    fn message(&mut self, layout: &Layout, shape: &Shape, message: &Value) {
        for (ty, name) in shape.types.iter().zip(shape.fields.names()) {
            let field = if let Value::Record(record) = message { record.get(name) } else { None };
            self.value(layout, ty, field);
        }
    }

    /// Writes a value anew; without one, zero or nothing.
    fn value(&mut self, layout: &Layout, ty: &Ty, value: Option<&Value>) {
        match ty {
            Ty::Primitive(primitive) => self.bits(bits_of(*primitive, value), primitive.size()),
            Ty::String => {
                let text = if let Some(Value::Text(text)) = value { text.as_str() } else { "" };
                self.length(text.len() + 1);
                self.bytes.extend_from_slice(text.as_bytes());
                self.bytes.push(0);
            }
            Ty::WString => {
                let text = if let Some(Value::Text(text)) = value { text.as_str() } else { "" };
                self.length(text.encode_utf16().count());
                text.encode_utf16().for_each(|unit| self.bits(u64::from(unit), WIDE));
            }
            Ty::Array(of, length) => {
                let items = value.map_or(&[][..], items);
                (0..*length).for_each(|at| self.value(layout, of, items.get(at)));
            }
            Ty::Sequence(of, bound) => {
                let items = value.map_or(&[][..], items);
                let items = &items[..items.len().min(bound.map_or(usize::MAX, |bound| bound as usize))];
                self.length(items.len());
                for item in items {
                    self.value(layout, of, Some(item));
                }
            }
            Ty::Shape(at) => {
                let shape = &layout.shapes[*at];
                match (shape.meaning, value) {
                    (Meaning::Time, Some(Value::Real(time))) => {
                        let (seconds, nanos) = seconds_and_nanos(*time);
                        self.bits(bits_of(Primitive::Int32, Some(&Value::Int(seconds))), 4);
                        self.bits(nanos.into(), 4);
                    }
                    (Meaning::Point, Some(Value::Point(point))) => {
                        for (ty, coordinate) in shape.types.iter().zip(point) {
                            self.value(layout, ty, Some(&Value::Real(*coordinate)));
                        }
                    }
                    (_, value) => self.message(layout, shape, value.unwrap_or(&Value::Bool(false))),
                }
            }
        }
    }
}

fn items(value: &Value) -> &[Value] {
    if let Value::List(items) = value { items } else { &[] }
}
