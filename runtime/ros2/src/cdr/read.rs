//! Samples are read.

use std::sync::Arc;

use sesame_plan::Primitive;
use sesame_relay::value::{Record, Text, Value};
use sesame_relay::wire::value_of;

use super::error::CodecError;
use super::layout::{Layout, Meaning, Selection, Shape, Ty};
use super::{HEADER, WIDE};

/// Padding that may follow the last field.
const PADDING: usize = 7;

/// What may follow it for each empty sequence: `rclpy` serialises into room for elements that are aligned, and hands
/// out all of it, even if there are none.
const OVERESTIMATED: usize = 4;

pub(super) fn read(layout: &Layout, selection: &Selection, sample: Arc<[u8]>) -> Result<Value, CodecError> {
    let mut input = Input::new(&sample)?;
    let (fields, values) = fields(layout, layout.message(), selection, &mut input)?;
    input.end()?;
    Ok(Record::decoded(&fields, values, sample).into())
}

/// A sample that is walked.
pub(super) struct Input<'a> {
    body: &'a [u8],
    pub(super) at: usize,
    pub(super) little: bool,
    /// How many bytes may follow the last field.
    surplus: usize,
}

impl<'a> Input<'a> {
    pub(super) fn new(sample: &'a [u8]) -> Result<Self, CodecError> {
        match sample {
            [0, order @ (0 | 1), _, _, body @ ..] => Ok(Input { body, at: 0, little: *order == 1, surplus: PADDING }),
            [first, second, _, _, ..] => Err(CodecError::Encoding(*first, *second)),
            _ => Err(CodecError::Short { path: String::new(), length: 0, needed: HEADER - sample.len() }),
        }
    }

    /// The next bytes, at a multiple of `align`.
    pub(super) fn take(&mut self, align: usize, size: usize) -> Result<&'a [u8], CodecError> {
        let start = self.at.next_multiple_of(align);
        let end = start.saturating_add(size);
        let Some(bytes) = self.body.get(start..end) else {
            let needed = end.saturating_sub(self.body.len());
            return Err(CodecError::Short { path: String::new(), length: self.body.len(), needed });
        };
        self.at = end;
        Ok(bytes)
    }

    /// The bits of the next number.
    pub(super) fn bits(&mut self, size: usize) -> Result<u64, CodecError> {
        let little = self.little;
        let bytes = self.take(size, size)?;
        let mut bits = [0; 8];
        if little {
            bits[..size].copy_from_slice(bytes);
            Ok(u64::from_le_bytes(bits))
        } else {
            bits[8 - size..].copy_from_slice(bytes);
            Ok(u64::from_be_bytes(bits))
        }
    }

    /// The length of a sequence, which the sample has room for: no element is smaller than a byte.
    pub(super) fn length(&mut self, bound: Option<u32>) -> Result<usize, CodecError> {
        let length = self.bits(4)?;
        #[expect(clippy::cast_possible_truncation, reason = "it has four bytes")]
        let (short, length) = (length as u32, length as usize);
        if let Some(bound) = bound.filter(|&bound| short > bound) {
            return Err(CodecError::Unbounded { path: String::new(), length: short, bound });
        }
        let left = self.left();
        if length > left {
            return Err(CodecError::Short { path: String::new(), length: self.body.len(), needed: length - left });
        }
        if length == 0 {
            self.surplus += OVERESTIMATED;
        }
        Ok(length)
    }

    /// How many bytes follow.
    fn left(&self) -> usize {
        self.body.len() - self.at
    }

    fn end(&self) -> Result<(), CodecError> {
        let surplus = self.left();
        if surplus > self.surplus { Err(CodecError::Long { surplus }) } else { Ok(()) }
    }

    /// Text, of which the zero at the end is not part.
    fn text(&mut self) -> Result<Text, CodecError> {
        let length = self.length(None)?;
        let bytes = self.take(1, length)?;
        let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        Ok(String::from_utf8_lossy(text).into_owned().into())
    }

    fn wide_text(&mut self) -> Result<Text, CodecError> {
        let length = self.length(None)?;
        let mut units = Vec::with_capacity(length.min(self.left() / WIDE));
        for _ in 0..length {
            // A unit that has more than its 16 bits is not UTF-16.
            units.push(u16::try_from(self.bits(WIDE)?).unwrap_or(0xFFFD));
        }
        Ok(String::from_utf16_lossy(&units).into())
    }

    /// Skips a value.
    pub(super) fn skip(&mut self, layout: &Layout, ty: &Ty) -> Result<(), CodecError> {
        if let Some((primitive, count)) = layout.uniform(ty) {
            return self.skip_run(primitive, count);
        }
        match ty {
            Ty::Primitive(primitive) => self.skip_run(*primitive, 1),
            Ty::String => {
                let length = self.length(None)?;
                self.take(1, length).map(drop)
            }
            Ty::WString => {
                let length = self.length(None)?;
                if length == 0 { Ok(()) } else { self.take(WIDE, length.saturating_mul(WIDE)).map(drop) }
            }
            Ty::Shape(at) => {
                let shape = &layout.shapes[*at];
                let mut fields = shape.fields.names().iter().zip(&shape.types);
                fields.try_for_each(|(name, ty)| self.skip(layout, ty).map_err(|error| error.inside(name)))
            }
            Ty::Array(of, length) => {
                (0..*length).try_for_each(|at| self.skip(layout, of).map_err(|error| element(error, at)))
            }
            Ty::Sequence(of, bound) => {
                let length = self.length(*bound)?;
                match layout.uniform(of) {
                    Some((primitive, count)) => self.skip_run(primitive, count.saturating_mul(length)),
                    None => (0..length).try_for_each(|at| self.skip(layout, of).map_err(|error| element(error, at))),
                }
            }
        }
    }

    fn skip_run(&mut self, primitive: Primitive, count: usize) -> Result<(), CodecError> {
        if count == 0 {
            return Ok(());
        }
        self.take(primitive.size(), primitive.size().saturating_mul(count)).map(drop)
    }
}

pub(super) fn element(error: CodecError, at: usize) -> CodecError {
    error.inside(&format!("[{at}]"))
}

type Chosen = (Arc<sesame_relay::value::Fields>, Vec<Value>);

/// The wanted fields of a message.
fn fields(layout: &Layout, shape: &Shape, selection: &Selection, input: &mut Input<'_>) -> Result<Chosen, CodecError> {
    let names = shape.fields.names();
    let mut values = Vec::with_capacity(match selection {
        Selection::Fields(fields, _) => fields.names().len(),
        _ => names.len(),
    });
    for (at, ty) in shape.types.iter().enumerate() {
        let selection = match selection {
            Selection::Fields(_, fields) => &fields[at],
            all => all,
        };
        let inside = |error: CodecError| error.inside(&names[at]);
        match selection {
            Selection::Nothing => input.skip(layout, ty).map_err(inside)?,
            selection => values.push(value(layout, ty, selection, input).map_err(inside)?),
        }
    }
    let fields = match selection {
        Selection::Fields(fields, _) => fields,
        _ => &shape.fields,
    };
    Ok((Arc::clone(fields), values))
}

fn value(layout: &Layout, ty: &Ty, selection: &Selection, input: &mut Input<'_>) -> Result<Value, CodecError> {
    let list = |length: usize, of: &Ty, input: &mut Input<'_>| {
        let items = (0..length).map(|at| value(layout, of, &Selection::All, input).map_err(|error| element(error, at)));
        items.collect::<Result<Vec<Value>, _>>().map(Value::List)
    };
    match ty {
        Ty::Primitive(primitive) => {
            let bits = input.bits(primitive.size())?;
            value_of(*primitive, bits).ok_or(CodecError::TooLarge { path: String::new(), number: bits })
        }
        Ty::String => input.text().map(Value::Text),
        Ty::WString => input.wide_text().map(Value::Text),
        Ty::Array(of, length) => list(*length, of, input),
        Ty::Sequence(of, bound) => {
            let length = input.length(*bound)?;
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
                Meaning::Time => {
                    #[expect(
                        clippy::cast_possible_truncation,
                        clippy::cast_possible_wrap,
                        reason = "it has four bytes"
                    )]
                    let seconds = input.bits(4)? as u32 as i32;
                    let nanos = input.bits(4)?;
                    Ok(Value::Real(f64::from(seconds) + nanos as f64 * 1e-9))
                }
            }
        }
    }
}
