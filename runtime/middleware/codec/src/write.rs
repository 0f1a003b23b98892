//! Messages are written: changes into the bytes from which they were read, or anew.

use std::marker::PhantomData;
use std::sync::Arc;

use sesame_plan::Primitive;
use sesame_relay::value::{Text, Value};
use sesame_relay::wire::{bits_of, seconds_and_nanos};

use crate::dialect::{ByteOrder, Dialect};
use crate::error::CodecError;
use crate::layout::{LENGTH, Layout, Meaning, Run, Size, Structure, Ty, WIDE};
use crate::read::Input;
use crate::selection::Selection;

pub(crate) fn write<D: Dialect>(
    layout: &Layout,
    selection: &Selection,
    message: &Value,
) -> Result<Arc<[u8]>, CodecError> {
    let Value::Record(record) = message else { return Err(CodecError::NoMessage(message.kind())) };
    let Some(origin) = record.origin() else {
        let mut output = Output::<D>::new(layout, ByteOrder::Little, None);
        output.message(layout.message(), Some(message));
        return Ok(output.bytes.into());
    };
    if let Some(bytes) = record.unchanged() {
        return Ok(Arc::clone(bytes));
    }
    let mut input = Input::<D>::new(&origin.bytes)?;
    let mut output = Output::<D>::new(layout, input.order, Some(&origin.bytes));
    let mut pairs = record.values().iter().zip(&origin.values);
    let structure = layout.message();
    output.copy_hidden(structure, &mut input)?;
    for (at, (ty, name)) in structure.types.iter().zip(structure.fields.names()).enumerate() {
        let read = match selection {
            Selection::Fields(_, fields) => !matches!(fields[at], Selection::Nothing),
            Selection::All | Selection::Nothing => true,
        };
        let pair = if read { pairs.next() } else { None };
        output.copy(ty, pair, &mut input).map_err(|error| error.inside(name))?;
    }
    Ok(output.bytes.into())
}

struct Output<'a, D> {
    layout: &'a Layout,
    bytes: Vec<u8>,
    order: ByteOrder,
    dialect: PhantomData<D>,
}

impl<'a, D: Dialect> Output<'a, D> {
    /// With the header of a message that is written anew, or of a changed one.
    fn new(layout: &'a Layout, order: ByteOrder, came: Option<&[u8]>) -> Self {
        let mut bytes = Vec::with_capacity(came.map_or(0, <[u8]>::len));
        D::write_header(&mut bytes, came);
        Output { layout, bytes, order, dialect: PhantomData }
    }

    fn align(&mut self, align: usize) {
        let padding = D::padding(self.bytes.len() - D::HEADER, align);
        self.bytes.resize(self.bytes.len() + padding, 0);
    }

    fn bits(&mut self, bits: u64, size: usize) {
        self.align(size);
        if D::BIG_ENDIAN && self.order == ByteOrder::Big {
            self.bytes.extend_from_slice(&bits.to_be_bytes()[8 - size..]);
        } else {
            self.bytes.extend_from_slice(&bits.to_le_bytes()[..size]);
        }
    }

    fn length(&mut self, length: usize) {
        self.bits(u64::try_from(length).unwrap_or(u64::MAX), LENGTH);
    }

    /// Copies a value of a message, with the changes from how it was read to how it is now.
    fn copy(&mut self, ty: &Ty, pair: Option<(&Value, &Value)>, input: &mut Input<'_, D>) -> Result<(), CodecError> {
        let layout = self.layout;
        let Some((now, before)) = pair.filter(|(now, before)| !now.is_same(before)) else {
            return self.copy_unchanged(ty, input);
        };
        match ty {
            Ty::Primitive(_) | Ty::String(_) | Ty::WString(_) => self.replace(ty, now, input),
            Ty::Structure(at) => {
                let structure = &layout.structures[*at];
                if matches!(structure.meaning, Meaning::Time(_)) {
                    return self.replace(ty, now, input);
                }
                self.copy_hidden(structure, input)?;
                for (at, (ty, name)) in structure.types.iter().zip(structure.fields.names()).enumerate() {
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
                let (now, before) = (items(Some(now)), items(Some(before)));
                (0..*length).try_for_each(|at| {
                    self.copy(of, now.get(at).zip(before.get(at)), input).map_err(|error| error.element(at))
                })
            }
            Ty::Sequence(of, bound) => {
                let (now, before) = (up_to(items(Some(now)), *bound), items(Some(before)));
                let was = input.length(Size::of::<D>(of, &layout.structures).least, *bound)?;
                self.length(now.len());
                for at in 0..was {
                    let copied = match now.get(at) {
                        Some(now) => self.copy(of, before.get(at).map(|before| (now, before)), input),
                        None => input.skip(layout, of),
                    };
                    copied.map_err(|error| error.element(at))?;
                }
                now.iter().skip(was).for_each(|item| self.value(of, Some(item)));
                Ok(())
            }
        }
    }

    /// Writes a value in the place of another one.
    fn replace(&mut self, ty: &Ty, now: &Value, input: &mut Input<'_, D>) -> Result<(), CodecError> {
        input.skip(self.layout, ty)?;
        self.value(ty, Some(now));
        Ok(())
    }

    /// Copies a value as it is.
    fn copy_unchanged(&mut self, ty: &Ty, input: &mut Input<'_, D>) -> Result<(), CodecError> {
        let layout = self.layout;
        // Without alignment it has the same bytes at any place; with it, there may be other gaps than there were.
        if !D::ALIGNED {
            self.bytes.extend_from_slice(input.skipped(|input| input.skip(layout, ty))?);
            return Ok(());
        }
        match ty {
            Ty::Primitive(primitive) => self.copy_run(Run::number::<D>(primitive.size()), input),
            Ty::String(_) => {
                let run = input.string()?;
                self.length(run.size);
                self.copy_run(run, input)
            }
            Ty::WString(_) => {
                let units = input.wide_string()?;
                self.length(units);
                self.copy_run(Run::number::<D>(WIDE).times(units), input)
            }
            Ty::Structure(at) => {
                let structure = &layout.structures[*at];
                if let Some(run) = structure.size.run {
                    return self.copy_run(run, input);
                }
                self.copy_hidden(structure, input)?;
                let mut fields = structure.types.iter().zip(structure.fields.names());
                fields.try_for_each(|(ty, name)| self.copy_unchanged(ty, input).map_err(|error| error.inside(name)))
            }
            Ty::Array(of, length) => self.copy_items(of, Size::of::<D>(of, &layout.structures), *length, input),
            Ty::Sequence(of, bound) => {
                let size = Size::of::<D>(of, &layout.structures);
                let length = input.length(size.least, *bound)?;
                self.length(length);
                self.copy_items(of, size, length, input)
            }
        }
    }

    fn copy_items(&mut self, of: &Ty, size: Size, length: usize, input: &mut Input<'_, D>) -> Result<(), CodecError> {
        match size.run {
            Some(run) => self.copy_run(run.times(length), input),
            None => (0..length).try_for_each(|at| self.copy_unchanged(of, input).map_err(|error| error.element(at))),
        }
    }

    fn copy_run(&mut self, run: Run, input: &mut Input<'_, D>) -> Result<(), CodecError> {
        if run.size > 0 {
            let bytes = input.take(run)?;
            self.align(run.align);
            self.bytes.extend_from_slice(bytes);
        }
        Ok(())
    }

    /// Copies what is before the fields of a message and not among them.
    fn copy_hidden(&mut self, structure: &Structure, input: &mut Input<'_, D>) -> Result<(), CodecError> {
        match structure.hidden {
            Some(hidden) => self.copy_run(Run::number::<D>(hidden.primitive.size()), input),
            None => Ok(()),
        }
    }

    /// Writes a message anew.
    fn message(&mut self, structure: &Structure, message: Option<&Value>) {
        if let Some(hidden) = structure.hidden {
            self.bits(0, hidden.primitive.size());
        }
        for (ty, name) in structure.types.iter().zip(structure.fields.names()) {
            let field = if let Some(Value::Record(record)) = message { record.get(name) } else { None };
            self.value(ty, field);
        }
    }

    /// Writes a value anew; without one, zero or nothing.
    fn value(&mut self, ty: &Ty, value: Option<&Value>) {
        match ty {
            Ty::Primitive(primitive) => self.bits(bits_of(*primitive, value), primitive.size()),
            Ty::String(bound) => {
                let text = fitting(text(value), *bound, char::len_utf8);
                self.length(text.len() + usize::from(D::TERMINATED));
                self.bytes.extend_from_slice(text.as_bytes());
                if D::TERMINATED {
                    self.bytes.push(0);
                }
            }
            Ty::WString(bound) => {
                let text = fitting(text(value), *bound, char::len_utf16);
                self.length(text.encode_utf16().count());
                text.encode_utf16().for_each(|unit| self.bits(u64::from(unit), WIDE));
            }
            Ty::Array(of, length) => {
                let items = items(value);
                (0..*length).for_each(|at| self.value(of, items.get(at)));
            }
            Ty::Sequence(of, bound) => {
                let items = up_to(items(value), *bound);
                self.length(items.len());
                for item in items {
                    self.value(of, Some(item));
                }
            }
            Ty::Structure(at) => {
                let structure = &self.layout.structures[*at];
                match (structure.meaning, value) {
                    (Meaning::Time(seconds_type), Some(Value::Real(time))) => {
                        let (seconds, nanos) = seconds_and_nanos(*time);
                        self.bits(bits_of(seconds_type, Some(&Value::Int(seconds))), seconds_type.size());
                        self.bits(nanos.into(), Primitive::Uint32.size());
                    }
                    (Meaning::Point, Some(Value::Point(point))) => {
                        for (ty, coordinate) in structure.types.iter().zip(point) {
                            self.value(ty, Some(&Value::Real(*coordinate)));
                        }
                    }
                    (_, value) => self.message(structure, value),
                }
            }
        }
    }
}

fn text(value: Option<&Value>) -> &str {
    if let Some(Value::Text(text)) = value { Text::as_str(text) } else { "" }
}

/// The longest beginning of a text that fits its bound, if each character has this length.
fn fitting(text: &str, bound: Option<u32>, length: impl Fn(char) -> usize) -> &str {
    let Some(bound) = bound else { return text };
    let mut total = 0;
    for (at, character) in text.char_indices() {
        total += length(character);
        if total > bound as usize {
            return &text[..at];
        }
    }
    text
}

fn items(value: Option<&Value>) -> &[Value] {
    if let Some(Value::List(items)) = value { items } else { &[] }
}

/// The first items of a list, as many as a sequence may have.
fn up_to(items: &[Value], bound: Option<u32>) -> &[Value] {
    &items[..items.len().min(bound.map_or(usize::MAX, |bound| bound as usize))]
}
