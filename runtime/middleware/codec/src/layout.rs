//! Interfaces as they are walked: every name is looked up once, and every size is known.

use std::sync::Arc;

use sesame_plan::{Interface, InterfaceField, Primitive, WireType};
use sesame_relay::value::Fields;

use crate::dialect::{Dialect, Hidden};
use crate::error::{LARGEST, LayoutError};

/// How many bytes the length of a text or of a sequence has.
pub(crate) const LENGTH: usize = size_of::<u32>();

/// How many bytes a code unit of a `wstring` has.
pub(crate) const WIDE: usize = size_of::<u32>();

/// The structures of a message and of all that it contains. The last one is the message.
#[derive(Debug)]
pub(crate) struct Layout {
    pub(crate) structures: Vec<Structure>,
}

/// A message type on the wire.
#[derive(Debug)]
pub(crate) struct Structure {
    pub(crate) fields: Arc<Fields>,
    pub(crate) types: Vec<Ty>,
    pub(crate) meaning: Meaning,
    /// What is before its fields and not among them.
    pub(crate) hidden: Option<Hidden>,
    pub(crate) size: Size,
}

/// What a nested message is in the language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Meaning {
    Message,
    /// `x`, `y`, `z`.
    Point,
    /// Seconds and nanoseconds; the seconds have this type.
    Time(Primitive),
}

/// A type on the wire.
#[derive(Debug)]
pub(crate) enum Ty {
    Primitive(Primitive),
    /// With at most so many bytes.
    String(Option<u32>),
    /// With at most so many units of two bytes.
    WString(Option<u32>),
    /// Position in [`Layout::structures`].
    Structure(usize),
    Array(Box<Ty>, usize),
    Sequence(Box<Ty>, Option<u32>),
}

/// How many bytes a value has.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Size {
    /// At least so many.
    pub(crate) least: usize,
    /// The same, where a message without bytes counts as one: this limits the work on arrays of such messages too.
    work: usize,
    /// All of them, if they are the same run of bytes whatever the value is.
    pub(crate) run: Option<Run>,
}

/// Bytes without a gap between them, wherever the first one is at a multiple of the alignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) align: usize,
    pub(crate) size: usize,
}

impl Run {
    /// A number of so many bytes.
    pub(crate) fn number<D: Dialect>(size: usize) -> Self {
        Run { align: if D::ALIGNED { size } else { 1 }, size }
    }

    /// Single bytes, so many.
    pub(crate) fn bytes(size: usize) -> Self {
        Run { align: 1, size }
    }

    /// One after another, so many.
    pub(crate) fn times(self, count: usize) -> Self {
        Run { size: self.size.saturating_mul(count), ..self }
    }

    /// This run and the next one, if there is never a gap between them.
    fn and(self, next: Run) -> Option<Run> {
        match (self.size, next.size) {
            (_, 0) => Some(self),
            (0, _) => Some(next),
            (size, more) => (self.align == next.align).then_some(Run { size: size.saturating_add(more), ..self }),
        }
    }
}

impl Size {
    /// What is always so many bytes without a gap.
    fn fixed(run: Run) -> Self {
        Size { least: run.size, work: run.size, run: Some(run) }
    }

    fn and(self, next: Size) -> Self {
        Size {
            least: self.least.saturating_add(next.least),
            work: self.work.saturating_add(next.work),
            run: self.run.zip(next.run).and_then(|(run, next)| run.and(next)),
        }
    }

    fn times(self, count: usize) -> Self {
        Size {
            least: self.least.saturating_mul(count),
            work: self.work.saturating_mul(count),
            run: self.run.map(|run| run.times(count)),
        }
    }

    /// The size of a value of this type. Shapes that it contains are among these.
    pub(crate) fn of<D: Dialect>(ty: &Ty, structures: &[Structure]) -> Self {
        match ty {
            Ty::Primitive(primitive) => Size::fixed(Run::number::<D>(primitive.size())),
            Ty::String(_) | Ty::WString(_) | Ty::Sequence(..) => Size { least: LENGTH, work: LENGTH, run: None },
            Ty::Structure(at) => structures[*at].size,
            Ty::Array(of, length) => Size::of::<D>(of, structures).times(*length),
        }
    }
}

impl Layout {
    /// The layout of the interface of this name. Each interface comes after those that it contains.
    pub(crate) fn new<D: Dialect>(interfaces: &[Interface], name: &str) -> Result<Self, LayoutError> {
        let names: Vec<_> = interfaces.iter().map(|interface| D::type_name(&interface.name)).collect();
        let position = |name: &str, before: usize| {
            let wanted = D::type_name(name);
            let found = names[..before].iter().position(|name| *name == wanted);
            found.ok_or_else(|| LayoutError::Missing { name: name.to_owned() })
        };
        let last = position(name, interfaces.len())?;
        let mut structures: Vec<Structure> = Vec::with_capacity(last + 1);
        for (at, interface) in interfaces[..=last].iter().enumerate() {
            structures.push(structure::<D>(interface, &names[at], &|name| position(name, at), &structures)?);
        }
        Ok(Layout { structures })
    }

    /// The message itself.
    pub(crate) fn message(&self) -> &Structure {
        &self.structures[self.structures.len() - 1]
    }
}

/// The position of an interface among those before the one that names it.
type Position<'a> = &'a dyn Fn(&str) -> Result<usize, LayoutError>;

fn structure<D: Dialect>(
    interface: &Interface,
    type_name: &str,
    position: Position<'_>,
    structures: &[Structure],
) -> Result<Structure, LayoutError> {
    let fields = || interface.fields.iter().filter(|field| D::has_field(&field.name));
    let names: Vec<&str> = fields().map(|field| field.name.as_str()).collect();
    let types = fields().map(|field| ty::<D>(&field.ty, interface, field, position)).collect::<Result<Vec<_>, _>>()?;
    let all = |primitive| types.iter().all(|ty| matches!(ty, Ty::Primitive(other) if *other == primitive));
    let meaning = match names.as_slice() {
        ["sec", "nanosec"] => D::seconds(type_name).map_or(Meaning::Message, Meaning::Time),
        ["x", "y", "z"] if all(Primitive::Float64) || all(Primitive::Float32) => Meaning::Point,
        _ => Meaning::Message,
    };
    let hidden = D::hidden(type_name, &names);
    let before = hidden.map_or(Run::bytes(0), |hidden| Run::number::<D>(hidden.primitive.size()));
    let mut size = types.iter().map(|ty| Size::of::<D>(ty, structures)).fold(Size::fixed(before), Size::and);
    size.work = size.work.max(1);
    if size.work > LARGEST {
        return Err(LayoutError::TooLarge { name: interface.name.clone() });
    }
    Ok(Structure { fields: Fields::new(names), types, meaning, hidden, size })
}

fn ty<D: Dialect>(
    of: &WireType,
    interface: &Interface,
    field: &InterfaceField,
    position: Position<'_>,
) -> Result<Ty, LayoutError> {
    Ok(match of {
        WireType::Primitive { primitive } => Ty::Primitive(*primitive),
        WireType::String { bound } => Ty::String(*bound),
        WireType::WString { bound } if D::WIDE => Ty::WString(*bound),
        WireType::WString { .. } => {
            return Err(LayoutError::Wide { name: interface.name.clone(), field: field.name.clone() });
        }
        WireType::Interface { name } => Ty::Structure(position(name)?),
        WireType::Array { of, length } => {
            Ty::Array(Box::new(ty::<D>(of, interface, field, position)?), *length as usize)
        }
        WireType::Sequence { of, bound } => Ty::Sequence(Box::new(ty::<D>(of, interface, field, position)?), *bound),
    })
}
