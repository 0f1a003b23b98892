//! Messages are read.

use std::marker::PhantomData;
use std::sync::Arc;

use sesame_relay::value::{Fields, Record, Text, Value};
use sesame_relay::wire::value_of;

use crate::dialect::{ByteOrder, Dialect};
use crate::error::CodecError;
use crate::layout::{LENGTH, Layout, Meaning, Run, Size, Structure, Ty, WIDE};
use crate::selection::Selection;

/// The most elements of a sequence whose elements have no bytes, so that a few bytes cannot ask for much work.
const EMPTY_ELEMENTS: usize = 1 << 16;

pub(crate) fn read<D: Dialect>(
    layout: &Layout,
    selection: &Selection,
    message: Arc<[u8]>,
) -> Result<Value, CodecError> {
    let mut input = Input::<D>::new(&message)?;
    let (fields, values) = fields(layout, layout.message(), selection, &mut input)?;
    input.end()?;
    Ok(Record::decoded(&fields, values, message).into())
}

/// A message that is walked.
pub(crate) struct Input<'a, D> {
    /// What is behind its header.
    body: &'a [u8],
    at: usize,
    pub(crate) order: ByteOrder,
    /// How many bytes may follow the last field.
    surplus: usize,
    dialect: PhantomData<D>,
}

impl<'a, D: Dialect> Input<'a, D> {
    pub(crate) fn new(message: &'a [u8]) -> Result<Self, CodecError> {
        let order = D::byte_order(message)?;
        Ok(Input { body: &message[D::HEADER..], at: 0, order, surplus: D::PADDING, dialect: PhantomData })
    }

    /// The next run of bytes.
    pub(crate) fn take(&mut self, run: Run) -> Result<&'a [u8], CodecError> {
        if run.size == 0 {
            return Ok(&[]);
        }
        let start = self.at + D::padding(self.at, run.align);
        let end = start.saturating_add(run.size);
        let Some(bytes) = self.body.get(start..end) else {
            let needed = end.saturating_sub(self.body.len());
            return Err(CodecError::Short { path: String::new(), length: self.body.len(), needed });
        };
        self.at = end;
        Ok(bytes)
    }

    /// What is skipped by this, with all bytes between.
    pub(crate) fn skipped(
        &mut self,
        skip: impl FnOnce(&mut Self) -> Result<(), CodecError>,
    ) -> Result<&'a [u8], CodecError> {
        let start = self.at;
        skip(self)?;
        Ok(&self.body[start..self.at])
    }

    /// The bits of the next number.
    fn bits(&mut self, size: usize) -> Result<u64, CodecError> {
        let bytes = self.take(Run::number::<D>(size))?;
        let mut bits = [0; 8];
        if D::BIG_ENDIAN && self.order == ByteOrder::Big {
            bits[8 - size..].copy_from_slice(bytes);
            Ok(u64::from_be_bytes(bits))
        } else {
            bits[..size].copy_from_slice(bytes);
            Ok(u64::from_le_bytes(bits))
        }
    }

    /// The length of a sequence with elements of at least so many bytes, which the message has room for.
    pub(crate) fn length(&mut self, least: usize, bound: Option<u32>) -> Result<usize, CodecError> {
        let length = usize::try_from(self.bits(LENGTH)?).unwrap_or(usize::MAX);
        let bound = bound.map(|bound| bound as usize).or((least == 0).then_some(EMPTY_ELEMENTS));
        if let Some(bound) = bound.filter(|&bound| length > bound) {
            return Err(CodecError::Unbounded { path: String::new(), length, bound });
        }
        let needed = length.saturating_mul(least).saturating_sub(self.left());
        if needed > 0 {
            return Err(CodecError::Short { path: String::new(), length: self.body.len(), needed });
        }
        if length == 0 {
            self.surplus += D::OVERESTIMATED;
        }
        Ok(length)
    }

    /// The run of the bytes of a `string`, whose length is read.
    pub(crate) fn string(&mut self) -> Result<Run, CodecError> {
        Ok(Run::bytes(self.length(1, None)?))
    }

    /// The number of code units of a `wstring`, which is read.
    pub(crate) fn wide_string(&mut self) -> Result<usize, CodecError> {
        self.length(WIDE, None)
    }

    /// How many bytes follow.
    fn left(&self) -> usize {
        self.body.len() - self.at
    }

    /// Whether nothing follows the last field but what may.
    pub(crate) fn end(&self) -> Result<(), CodecError> {
        let surplus = self.left();
        if surplus > self.surplus { Err(CodecError::Long { surplus }) } else { Ok(()) }
    }

    /// Text, of which a zero at the end is not part.
    fn text(&mut self) -> Result<Text, CodecError> {
        let run = self.string()?;
        let bytes = self.take(run)?;
        let text = if D::TERMINATED { bytes.strip_suffix(&[0]).unwrap_or(bytes) } else { bytes };
        Ok(String::from_utf8_lossy(text).into_owned().into())
    }

    fn wide_text(&mut self) -> Result<Text, CodecError> {
        let length = self.wide_string()?;
        let mut units = Vec::with_capacity(length);
        for _ in 0..length {
            // A unit that has more than its 16 bits is not UTF-16.
            units.push(u16::try_from(self.bits(WIDE)?).unwrap_or(0xFFFD));
        }
        Ok(String::from_utf16_lossy(&units).into())
    }

    /// Skips a value.
    pub(crate) fn skip(&mut self, layout: &Layout, ty: &Ty) -> Result<(), CodecError> {
        match ty {
            Ty::Primitive(primitive) => self.take(Run::number::<D>(primitive.size())).map(drop),
            Ty::String(_) => {
                let run = self.string()?;
                self.take(run).map(drop)
            }
            Ty::WString(_) => {
                let units = self.wide_string()?;
                self.take(Run::number::<D>(WIDE).times(units)).map(drop)
            }
            Ty::Structure(at) => self.skip_structure(layout, &layout.structures[*at]),
            Ty::Array(of, length) => self.skip_items(layout, of, Size::of::<D>(of, &layout.structures), *length),
            Ty::Sequence(of, bound) => {
                let size = Size::of::<D>(of, &layout.structures);
                let length = self.length(size.least, *bound)?;
                self.skip_items(layout, of, size, length)
            }
        }
    }

    fn skip_items(&mut self, layout: &Layout, of: &Ty, size: Size, length: usize) -> Result<(), CodecError> {
        match size.run {
            Some(run) => self.take(run.times(length)).map(drop),
            None => (0..length).try_for_each(|at| self.skip(layout, of).map_err(|error| error.element(at))),
        }
    }

    /// Skips a message.
    pub(crate) fn skip_structure(&mut self, layout: &Layout, structure: &Structure) -> Result<(), CodecError> {
        if let Some(run) = structure.size.run {
            return self.take(run).map(drop);
        }
        self.hidden(structure)?;
        let mut fields = structure.fields.names().iter().zip(&structure.types);
        fields.try_for_each(|(name, ty)| self.skip(layout, ty).map_err(|error| error.inside(name)))
    }

    /// What is before the fields of a message and not among them.
    pub(crate) fn hidden(&mut self, structure: &Structure) -> Result<&'a [u8], CodecError> {
        match structure.hidden {
            Some(hidden) => self.take(Run::number::<D>(hidden.primitive.size())),
            None => Ok(&[]),
        }
    }
}

/// The wanted fields of a message.
fn fields<D: Dialect>(
    layout: &Layout,
    structure: &Structure,
    selection: &Selection,
    input: &mut Input<'_, D>,
) -> Result<(Arc<Fields>, Vec<Value>), CodecError> {
    let (chosen, selections) = match selection {
        Selection::Fields(fields, selections) => (fields, Some(selections)),
        Selection::All | Selection::Nothing => (&structure.fields, None),
    };
    input.hidden(structure)?;
    let mut values = Vec::with_capacity(chosen.names().len());
    for (at, (name, ty)) in structure.fields.names().iter().zip(&structure.types).enumerate() {
        match selections.map_or(&Selection::All, |selections| &selections[at]) {
            Selection::Nothing => input.skip(layout, ty).map_err(|error| error.inside(name))?,
            selection => values.push(value(layout, ty, selection, input).map_err(|error| error.inside(name))?),
        }
    }
    Ok((Arc::clone(chosen), values))
}

fn value<D: Dialect>(
    layout: &Layout,
    ty: &Ty,
    selection: &Selection,
    input: &mut Input<'_, D>,
) -> Result<Value, CodecError> {
    let list = |length: usize, of: &Ty, input: &mut Input<'_, D>| {
        let items = (0..length).map(|at| value(layout, of, &Selection::All, input).map_err(|error| error.element(at)));
        items.collect::<Result<Vec<Value>, _>>().map(Value::List)
    };
    match ty {
        Ty::Primitive(primitive) => {
            let bits = input.bits(primitive.size())?;
            value_of(*primitive, bits).ok_or(CodecError::TooLarge { path: String::new(), number: bits })
        }
        Ty::String(_) => input.text().map(Value::Text),
        Ty::WString(_) => input.wide_text().map(Value::Text),
        Ty::Array(of, length) => list(*length, of, input),
        Ty::Sequence(of, bound) => {
            let length = input.length(Size::of::<D>(of, &layout.structures).least, *bound)?;
            list(length, of, input)
        }
        Ty::Structure(at) => {
            let structure = &layout.structures[*at];
            match structure.meaning {
                Meaning::Message => {
                    let (fields, values) = fields(layout, structure, selection, input)?;
                    Ok(Record::new(&fields, values).into())
                }
                Meaning::Point => {
                    let mut coordinate = |at: usize| {
                        let read = value(layout, &structure.types[at], &Selection::All, input)?;
                        Ok(read.number_at::<&str>(&[]).unwrap_or(f64::NAN))
                    };
                    Ok(Value::Point([coordinate(0)?, coordinate(1)?, coordinate(2)?]))
                }
                Meaning::Time(seconds) => {
                    let seconds = value_of(seconds, input.bits(seconds.size())?);
                    let seconds = seconds.and_then(|seconds| seconds.number_at::<&str>(&[])).unwrap_or(f64::NAN);
                    let nanos = input.bits(size_of::<u32>())? as f64;
                    Ok(Value::Real(seconds + nanos * 1e-9))
                }
            }
        }
    }
}
