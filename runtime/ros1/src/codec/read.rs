//! Messages are read.

use std::sync::Arc;

use sesame_relay::value::{Fields, Record, Text, Value};
use sesame_relay::wire::value_of;

use super::error::CodecError;
use super::layout::{Layout, Meaning, Selection, Shape, Ty};

/// The most elements of an array whose elements have no bytes, so that a few bytes cannot ask for much work.
const EMPTY_ELEMENTS: usize = 1 << 16;

pub(super) fn read(layout: &Layout, selection: &Selection, message: Arc<[u8]>) -> Result<Value, CodecError> {
    let mut input = Input::new(&message);
    let (fields, values) = fields(layout, layout.message(), selection, &mut input)?;
    input.end()?;
    Ok(Record::decoded(&fields, values, message).into())
}

/// A message that is walked.
pub(super) struct Input<'a> {
    bytes: &'a [u8],
    pub(super) at: usize,
}

impl<'a> Input<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Input { bytes, at: 0 }
    }

    /// The next bytes.
    fn take(&mut self, size: usize) -> Result<&'a [u8], CodecError> {
        let end = self.at.saturating_add(size);
        let Some(bytes) = self.bytes.get(self.at..end) else {
            let needed = end.saturating_sub(self.bytes.len());
            return Err(CodecError::Short { path: String::new(), length: self.bytes.len(), needed });
        };
        self.at = end;
        Ok(bytes)
    }

    /// What was walked since a place.
    pub(super) fn since(&self, start: usize) -> &'a [u8] {
        &self.bytes[start..self.at]
    }

    /// The bits of a number.
    fn bits(&mut self, size: usize) -> Result<u64, CodecError> {
        let mut bits = [0; 8];
        bits[..size].copy_from_slice(self.take(size)?);
        Ok(u64::from_le_bytes(bits))
    }

    /// The length of an array with elements of at least so many bytes, which the message has room for.
    pub(super) fn length(&mut self, least: usize, bound: Option<u32>) -> Result<usize, CodecError> {
        let length = usize::try_from(self.bits(size_of::<u32>())?).unwrap_or(usize::MAX);
        let bound = bound.map(|bound| bound as usize).or((least == 0).then_some(EMPTY_ELEMENTS));
        if let Some(bound) = bound.filter(|&bound| length > bound) {
            return Err(CodecError::Unbounded { path: String::new(), length, bound });
        }
        let left = self.bytes.len() - self.at;
        let needed = length.saturating_mul(least).saturating_sub(left);
        if needed > 0 {
            return Err(CodecError::Short { path: String::new(), length: self.bytes.len(), needed });
        }
        Ok(length)
    }

    pub(super) fn end(&self) -> Result<(), CodecError> {
        let surplus = self.bytes.len() - self.at;
        if surplus > 0 { Err(CodecError::Long { surplus }) } else { Ok(()) }
    }

    fn text(&mut self) -> Result<Text, CodecError> {
        let length = self.length(1, None)?;
        Ok(String::from_utf8_lossy(self.take(length)?).into_owned().into())
    }

    /// Skips a value.
    pub(super) fn skip(&mut self, layout: &Layout, ty: &Ty) -> Result<(), CodecError> {
        let size = layout.size(ty);
        if size.fixed {
            return self.take(size.least).map(drop);
        }
        match ty {
            Ty::Primitive(primitive) => self.take(primitive.size()).map(drop),
            Ty::String => {
                let length = self.length(1, None)?;
                self.take(length).map(drop)
            }
            Ty::Shape(at) => self.skip_shape(layout, &layout.shapes[*at]),
            Ty::Array(of, length) => self.skip_items(layout, of, *length),
            Ty::Sequence(of, bound) => {
                let size = layout.size(of);
                let length = self.length(size.least, *bound)?;
                if size.fixed {
                    return self.take(length.saturating_mul(size.least)).map(drop);
                }
                self.skip_items(layout, of, length)
            }
        }
    }

    fn skip_items(&mut self, layout: &Layout, of: &Ty, length: usize) -> Result<(), CodecError> {
        (0..length).try_for_each(|at| self.skip(layout, of).map_err(|error| error.element(at)))
    }

    pub(super) fn skip_shape(&mut self, layout: &Layout, shape: &Shape) -> Result<(), CodecError> {
        let size = Layout::size_of(shape);
        if size.fixed {
            return self.take(size.least).map(drop);
        }
        self.skip_before(shape)?;
        let mut fields = shape.fields.names().iter().zip(&shape.types);
        fields.try_for_each(|(name, ty)| self.skip(layout, ty).map_err(|error| error.inside(name)))
    }

    /// Skips what the layout does not have.
    pub(super) fn skip_before(&mut self, shape: &Shape) -> Result<(), CodecError> {
        self.take(shape.before).map(drop)
    }
}

/// The wanted fields of a message.
fn fields(
    layout: &Layout,
    shape: &Shape,
    selection: &Selection,
    input: &mut Input<'_>,
) -> Result<(Arc<Fields>, Vec<Value>), CodecError> {
    let (chosen, selections) = match selection {
        Selection::Fields(fields, selections) => (fields, Some(selections)),
        Selection::All | Selection::Nothing => (&shape.fields, None),
    };
    input.skip_before(shape)?;
    let mut values = Vec::with_capacity(chosen.names().len());
    for (at, (name, ty)) in shape.fields.names().iter().zip(&shape.types).enumerate() {
        match selections.map_or(&Selection::All, |selections| &selections[at]) {
            Selection::Nothing => input.skip(layout, ty).map_err(|error| error.inside(name))?,
            selection => values.push(value(layout, ty, selection, input).map_err(|error| error.inside(name))?),
        }
    }
    Ok((Arc::clone(chosen), values))
}

fn value(layout: &Layout, ty: &Ty, selection: &Selection, input: &mut Input<'_>) -> Result<Value, CodecError> {
    let list = |length: usize, of: &Ty, input: &mut Input<'_>| {
        let items = (0..length).map(|at| value(layout, of, &Selection::All, input).map_err(|error| error.element(at)));
        items.collect::<Result<Vec<Value>, _>>().map(Value::List)
    };
    match ty {
        Ty::Primitive(primitive) => {
            let bits = input.bits(primitive.size())?;
            value_of(*primitive, bits).ok_or(CodecError::TooLarge { path: String::new(), number: bits })
        }
        Ty::String => input.text().map(Value::Text),
        Ty::Array(of, length) => list(*length, of, input),
        Ty::Sequence(of, bound) => {
            let length = input.length(layout.size(of).least, *bound)?;
            list(length, of, input)
        }
        Ty::Shape(at) => {
            let shape = &layout.shapes[*at];
            match shape.meaning {
                Meaning::Message => {
                    let (fields, values) = fields(layout, shape, selection, input)?;
                    Ok(Record::new(&fields, values).into())
                }
                Meaning::Point => {
                    let mut coordinate = |at: usize| {
                        let read = value(layout, &shape.types[at], &Selection::All, input)?;
                        Ok(read.number_at::<&str>(&[]).unwrap_or(f64::NAN))
                    };
                    Ok(Value::Point([coordinate(0)?, coordinate(1)?, coordinate(2)?]))
                }
                Meaning::Time(seconds) => {
                    let seconds = value_of(seconds, input.bits(4)?).and_then(|it| it.number_at::<&str>(&[]));
                    let nanos = input.bits(4)? as f64;
                    Ok(Value::Real(seconds.unwrap_or(f64::NAN) + nanos * 1e-9))
                }
            }
        }
    }
}
