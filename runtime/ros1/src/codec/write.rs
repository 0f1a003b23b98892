//! Messages are written: changes into the bytes from which they were read, or anew.

use std::sync::Arc;

use sesame_plan::Primitive;
use sesame_relay::value::Value;
use sesame_relay::wire::{bits_of, seconds_and_nanos};

use super::error::CodecError;
use super::layout::{Layout, Meaning, Selection, Shape, Ty};
use super::read::Input;

pub(super) fn write(layout: &Layout, selection: &Selection, message: &Value) -> Result<Arc<[u8]>, CodecError> {
    let Value::Record(record) = message else { return Err(CodecError::NoMessage(message.kind())) };
    let mut output = Output { layout, bytes: Vec::new() };
    let Some(origin) = record.origin() else {
        output.message(layout.message(), Some(message));
        return Ok(output.bytes.into());
    };
    if let Some(bytes) = record.unchanged() {
        return Ok(Arc::clone(bytes));
    }
    let mut input = Input::new(&origin.bytes);
    let mut pairs = record.values().iter().zip(&origin.values);
    let shape = layout.message();
    output.copy_before(shape, &mut input)?;
    for (at, (ty, name)) in shape.types.iter().zip(shape.fields.names()).enumerate() {
        let read = match selection {
            Selection::Fields(_, fields) => !matches!(fields[at], Selection::Nothing),
            Selection::All | Selection::Nothing => true,
        };
        let pair = if read { pairs.next() } else { None };
        output.copy(ty, pair, &mut input).map_err(|error| error.inside(name))?;
    }
    Ok(output.bytes.into())
}

struct Output<'a> {
    layout: &'a Layout,
    bytes: Vec<u8>,
}

impl Output<'_> {
    fn bits(&mut self, bits: u64, size: usize) {
        self.bytes.extend_from_slice(&bits.to_le_bytes()[..size]);
    }

    fn length(&mut self, length: usize) {
        self.bits(u64::try_from(length).unwrap_or(u64::MAX), size_of::<u32>());
    }

    /// Copies a value of a message, with the changes from how it was read to how it is now.
    fn copy(&mut self, ty: &Ty, pair: Option<(&Value, &Value)>, input: &mut Input<'_>) -> Result<(), CodecError> {
        let layout = self.layout;
        let Some((now, before)) = pair.filter(|(now, before)| !now.is_same(before)) else {
            let start = input.at;
            input.skip(layout, ty)?;
            self.bytes.extend_from_slice(input.since(start));
            return Ok(());
        };
        match ty {
            Ty::Primitive(_) | Ty::String => {
                input.skip(layout, ty)?;
                self.value(ty, Some(now));
                Ok(())
            }
            Ty::Shape(at) => {
                let shape = &layout.shapes[*at];
                if matches!(shape.meaning, Meaning::Time(_)) {
                    input.skip(layout, ty)?;
                    self.value(ty, Some(now));
                    return Ok(());
                }
                self.copy_before(shape, input)?;
                for (at, (ty, name)) in shape.types.iter().zip(shape.fields.names()).enumerate() {
                    let part = |value: &Value| match value {
                        Value::Point(point) => Some(Value::Real(point[at])),
                        Value::Record(record) => record.get(name).cloned(),
                        _ => None,
                    };
                    let (now, before) = (part(now), part(before));
                    self.copy(ty, now.as_ref().zip(before.as_ref()), input).map_err(|error| error.inside(name))?;
                }
                Ok(())
            }
            Ty::Array(of, length) => {
                let (now, before) = (items(now), items(before));
                (0..*length).try_for_each(|at| {
                    self.copy(of, now.get(at).zip(before.get(at)), input).map_err(|error| error.element(at))
                })
            }
            Ty::Sequence(of, bound) => {
                let (now, before) = (items(now), items(before));
                let was = input.length(layout.size(of).least, *bound)?;
                let is = now.len().min(bound.map_or(usize::MAX, |bound| bound as usize));
                self.length(is);
                for at in 0..was {
                    if at < is {
                        self.copy(of, now.get(at).zip(before.get(at)), input).map_err(|error| error.element(at))?;
                    } else {
                        input.skip(layout, of).map_err(|error| error.element(at))?;
                    }
                }
                for item in now.iter().take(is).skip(was) {
                    self.value(of, Some(item));
                }
                Ok(())
            }
        }
    }

    /// Copies what the layout does not have.
    fn copy_before(&mut self, shape: &Shape, input: &mut Input<'_>) -> Result<(), CodecError> {
        let start = input.at;
        input.skip_before(shape)?;
        self.bytes.extend_from_slice(input.since(start));
        Ok(())
    }

    /// Writes a message anew.
    fn message(&mut self, shape: &Shape, message: Option<&Value>) {
        self.bytes.resize(self.bytes.len() + shape.before, 0);
        for (ty, name) in shape.types.iter().zip(shape.fields.names()) {
            let field = if let Some(Value::Record(record)) = message { record.get(name) } else { None };
            self.value(ty, field);
        }
    }

    /// Writes a value anew; without one, zero or nothing.
    fn value(&mut self, ty: &Ty, value: Option<&Value>) {
        match ty {
            Ty::Primitive(primitive) => self.bits(bits_of(*primitive, value), primitive.size()),
            Ty::String => {
                let text = if let Some(Value::Text(text)) = value { text.as_str() } else { "" };
                self.length(text.len());
                self.bytes.extend_from_slice(text.as_bytes());
            }
            Ty::Array(of, length) => {
                let items = value.map_or(&[][..], items);
                (0..*length).for_each(|at| self.value(of, items.get(at)));
            }
            Ty::Sequence(of, bound) => {
                let items = value.map_or(&[][..], items);
                let items = &items[..items.len().min(bound.map_or(usize::MAX, |bound| bound as usize))];
                self.length(items.len());
                for item in items {
                    self.value(of, Some(item));
                }
            }
            Ty::Shape(at) => {
                let shape = &self.layout.shapes[*at];
                match (shape.meaning, value) {
                    (Meaning::Time(seconds_type), Some(Value::Real(time))) => {
                        let (seconds, nanos) = seconds_and_nanos(*time);
                        self.bits(bits_of(seconds_type, Some(&Value::Int(seconds))), seconds_type.size());
                        self.bits(nanos.into(), Primitive::Uint32.size());
                    }
                    (Meaning::Point, Some(Value::Point(point))) => {
                        for (ty, coordinate) in shape.types.iter().zip(point) {
                            self.value(ty, Some(&Value::Real(*coordinate)));
                        }
                    }
                    (_, value) => self.message(shape, value),
                }
            }
        }
    }
}

fn items(value: &Value) -> &[Value] {
    if let Value::List(items) = value { items } else { &[] }
}
