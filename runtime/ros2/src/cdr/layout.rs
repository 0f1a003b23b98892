//! Interfaces as they are walked: every name is looked up once.

use std::sync::Arc;

use sesame_plan::{Interface, Primitive, WireType};
use sesame_relay::value::Fields;
use sesame_relay::wire::Wanted;

use super::error::{LARGEST, LayoutError};

/// The shapes of a message and of all that it contains. The last one is the message.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) shapes: Vec<Shape>,
}

/// A message on the wire.
#[derive(Debug)]
pub(super) struct Shape {
    pub(super) fields: Arc<Fields>,
    pub(super) types: Vec<Ty>,
    pub(super) meaning: Meaning,
    /// The size and alignment of one whose size is always the same wherever it begins at a multiple of its alignment:
    /// a run of equal primitives.
    uniform: Option<(Primitive, usize)>,
    /// The bytes that it has without padding and without elements of sequences. Without any field it counts as one, so
    /// that this limits the work on arrays of such messages too.
    least: usize,
}

/// What a nested message is in the language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meaning {
    Message,
    /// `x`, `y`, `z`.
    Point,
    /// Seconds and nanoseconds.
    Time,
}

/// A type on the wire.
#[derive(Debug)]
pub(super) enum Ty {
    Primitive(Primitive),
    String,
    WString,
    /// Position in [`Layout::shapes`].
    Shape(usize),
    Array(Box<Ty>, usize),
    Sequence(Box<Ty>, Option<u32>),
}

/// What is read of a type.
#[derive(Debug, Clone)]
pub(super) enum Selection {
    Nothing,
    All,
    /// Of a message: some of its fields, with their names.
    Fields(Arc<Fields>, Vec<Selection>),
}

impl Layout {
    pub(super) fn new(interfaces: &[Interface], name: &str) -> Result<Self, LayoutError> {
        let position = |name: &str, before: usize| {
            let found = interfaces[..before].iter().position(|interface| interface.name == name);
            found.ok_or_else(|| LayoutError::Missing { name: name.to_owned() })
        };
        let last = position(name, interfaces.len())?;
        let mut shapes: Vec<Shape> = Vec::with_capacity(last + 1);
        for (at, interface) in interfaces[..=last].iter().enumerate() {
            let types: Vec<Ty> = interface
                .fields
                .iter()
                .map(|field| ty(&field.ty, &|name| position(name, at)))
                .collect::<Result<_, _>>()?;
            let names: Vec<&str> = interface.fields.iter().map(|field| field.name.as_str()).collect();
            let all = |primitive| types.iter().all(|ty| matches!(ty, Ty::Primitive(other) if *other == primitive));
            let meaning = match (interface.name.as_str(), names.as_slice()) {
                ("builtin_interfaces/msg/Time" | "builtin_interfaces/msg/Duration", ["sec", "nanosec"]) => {
                    Meaning::Time
                }
                (_, ["x", "y", "z"]) if all(Primitive::Float64) || all(Primitive::Float32) => Meaning::Point,
                _ => Meaning::Message,
            };
            let uniform = uniform(&types, &shapes);
            let least = types.iter().map(|ty| least(ty, &shapes)).fold(0, usize::saturating_add).max(1);
            if least > LARGEST {
                return Err(LayoutError::TooLarge { name: interface.name.clone() });
            }
            shapes.push(Shape { fields: Fields::new(names), types, meaning, uniform, least });
        }
        Ok(Layout { shapes })
    }

    /// The message itself.
    pub(super) fn message(&self) -> &Shape {
        &self.shapes[self.shapes.len() - 1]
    }

    /// What is read, as this layout walks it.
    pub(super) fn select(&self, wanted: &Wanted) -> Selection {
        match wanted {
            // The top level is always a record.
            Wanted::All => Selection::All,
            Wanted::Fields(_) => self.select_shape(self.message(), wanted),
        }
    }

    fn select_shape(&self, shape: &Shape, wanted: &Wanted) -> Selection {
        let Wanted::Fields(wanted) = wanted else { return Selection::All };
        let names = shape.fields.names();
        let chosen = names.iter().filter(|name| wanted.contains_key(name.as_str()));
        let fields = Fields::new(chosen.map(sesame_relay::value::Text::as_str));
        let selections = names.iter().zip(&shape.types).map(|(name, ty)| match (wanted.get(name.as_str()), ty) {
            (None, _) => Selection::Nothing,
            (Some(wanted), Ty::Shape(at)) if self.shapes[*at].meaning == Meaning::Message => {
                self.select_shape(&self.shapes[*at], wanted)
            }
            // Coordinates, elements.
            (Some(_), _) => Selection::All,
        });
        Selection::Fields(fields, selections.collect())
    }

    /// If a type is always the same number of values of one primitive: of which, and how many.
    pub(super) fn uniform(&self, of: &Ty) -> Option<(Primitive, usize)> {
        uniform_type(of, &self.shapes)
    }
}

fn ty(of: &WireType, position: &dyn Fn(&str) -> Result<usize, LayoutError>) -> Result<Ty, LayoutError> {
    Ok(match of {
        WireType::Primitive { primitive } => Ty::Primitive(*primitive),
        WireType::String => Ty::String,
        WireType::WString => Ty::WString,
        WireType::Interface { name } => Ty::Shape(position(name)?),
        WireType::Array { of, length } => Ty::Array(Box::new(ty(of, position)?), *length as usize),
        WireType::Sequence { of, bound } => Ty::Sequence(Box::new(ty(of, position)?), *bound),
    })
}

fn uniform(types: &[Ty], shapes: &[Shape]) -> Option<(Primitive, usize)> {
    let mut types = types.iter().map(|ty| uniform_type(ty, shapes));
    let (primitive, first) = types.next()??;
    types.try_fold((primitive, first), |(primitive, sum), next| {
        let (other, count) = next?;
        (other == primitive).then_some((primitive, sum.saturating_add(count)))
    })
}

fn uniform_type(ty: &Ty, shapes: &[Shape]) -> Option<(Primitive, usize)> {
    match ty {
        Ty::Primitive(primitive) => Some((*primitive, 1)),
        Ty::Shape(at) => shapes[*at].uniform,
        Ty::Array(of, length) => {
            uniform_type(of, shapes).map(|(primitive, count)| (primitive, count.saturating_mul(*length)))
        }
        Ty::String | Ty::WString | Ty::Sequence(..) => None,
    }
}

/// The fewest bytes of a value, as [`Shape::least`].
fn least(ty: &Ty, shapes: &[Shape]) -> usize {
    match ty {
        Ty::Primitive(primitive) => primitive.size(),
        Ty::String | Ty::WString | Ty::Sequence(..) => size_of::<u32>(),
        Ty::Shape(at) => shapes[*at].least,
        Ty::Array(of, length) => least(of, shapes).saturating_mul(*length),
    }
}
