//! Interfaces as they are walked: every name is looked up once.

use std::sync::Arc;

use sesame_interfaces::ros1::{NOTHING, type_name};
use sesame_plan::{Interface, Primitive, WireType};
use sesame_relay::value::Fields;
use sesame_relay::wire::Wanted;

use super::error::{LARGEST, LayoutError};

/// The number of a message, which headers have in ROS 1 only.
const SEQ: Primitive = Primitive::Uint32;

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
    /// How many bytes are before its fields that the layout does not have.
    pub(super) before: usize,
    size: Size,
}

/// What a nested message is in the language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meaning {
    Message,
    /// `x`, `y`, `z`.
    Point,
    /// Seconds and nanoseconds; the seconds have this type.
    Time(Primitive),
}

/// A type on the wire.
#[derive(Debug)]
pub(super) enum Ty {
    Primitive(Primitive),
    String,
    /// Position in [`Layout::shapes`].
    Shape(usize),
    Array(Box<Ty>, usize),
    Sequence(Box<Ty>, Option<u32>),
}

/// How many bytes a value has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Size {
    /// At least so many.
    pub(super) least: usize,
    /// Whether it is never more.
    pub(super) fixed: bool,
}

impl Size {
    fn fixed(least: usize) -> Self {
        Size { least, fixed: true }
    }

    fn and(self, other: Size) -> Self {
        Size { least: self.least.saturating_add(other.least), fixed: self.fixed && other.fixed }
    }
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
        let names: Vec<String> = interfaces.iter().map(|interface| type_name(&interface.name)).collect();
        let position = |name: &str, before: usize| {
            let wanted = type_name(name);
            let found = names[..before].iter().position(|name| *name == wanted);
            found.ok_or_else(|| LayoutError::Missing { name: name.to_owned() })
        };
        let last = position(name, interfaces.len())?;
        let mut shapes: Vec<Shape> = Vec::with_capacity(last + 1);
        for (at, interface) in interfaces[..=last].iter().enumerate() {
            shapes.push(shape(interface, &names[at], &|name| position(name, at), &shapes)?);
        }
        Ok(Layout { shapes })
    }

    /// The message itself.
    pub(super) fn message(&self) -> &Shape {
        &self.shapes[self.shapes.len() - 1]
    }

    /// What is read, as this layout walks it.
    pub(super) fn select(&self, wanted: &Wanted) -> Selection {
        self.select_shape(self.message(), wanted)
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

    /// Where another layout differs from this one, in a phrase.
    pub(super) fn difference(&self, other: &Layout) -> Option<String> {
        self.shape_difference(self.message(), other, other.message())
    }

    fn shape_difference(&self, ours: &Shape, other: &Layout, theirs: &Shape) -> Option<String> {
        if ours.meaning == theirs.meaning && matches!(ours.meaning, Meaning::Time(_)) {
            return None;
        }
        let ([our_names, our_types], [their_names, their_types]) = (ours.shown(), theirs.shown());
        if our_names != their_names {
            return Some(format!("fields `{our_names}`, not `{their_names}`"));
        }
        if our_types != their_types {
            return Some(format!("types `{our_types}` of `{our_names}`, not `{their_types}`"));
        }
        // Of headers, the number may be in one layout only.
        let skip = |shape: &Shape, other: &Shape| usize::from(shape.before == 0 && other.before > 0);
        let ours_then = ours.types.iter().zip(ours.fields.names()).skip(skip(ours, theirs));
        let theirs_then = theirs.types.iter().skip(skip(theirs, ours));
        ours_then.zip(theirs_then).find_map(|((our, name), their)| {
            let (our, their) = (innermost(our)?, innermost(their)?);
            let inside = self.shape_difference(&self.shapes[our], other, &other.shapes[their])?;
            Some(format!("in `{name}`: {inside}"))
        })
    }

    /// How many bytes a value of a type has.
    pub(super) fn size(&self, ty: &Ty) -> Size {
        size(ty, &self.shapes)
    }

    /// How many bytes a message has.
    pub(super) fn size_of(shape: &Shape) -> Size {
        shape.size
    }
}

impl Shape {
    /// The names of its fields, and their types without those of messages, as they are on the wire.
    fn shown(&self) -> [String; 2] {
        let number = (self.before > 0).then_some("seq");
        let names: Vec<&str> =
            number.into_iter().chain(self.fields.names().iter().map(sesame_relay::value::Text::as_str)).collect();
        let number = (self.before > 0).then(|| written(&Ty::Primitive(SEQ)));
        let types: Vec<String> = number.into_iter().chain(self.types.iter().map(written)).collect();
        [names.join(", "), types.join(", ")]
    }
}

/// A type as `.msg` files write it.
fn written(ty: &Ty) -> String {
    match ty {
        // A `byte` has a sign in ROS 1, and none in ROS 2.
        Ty::Primitive(Primitive::Int8 | Primitive::Uint8) => "int8".to_owned(),
        Ty::Primitive(primitive) => primitive.name().to_owned(),
        Ty::String => "string".to_owned(),
        Ty::Shape(_) => "message".to_owned(),
        Ty::Array(of, length) => format!("{}[{length}]", written(of)),
        // At most how many elements there are makes no difference on the wire.
        Ty::Sequence(of, _) => format!("{}[]", written(of)),
    }
}

/// The message in a type.
fn innermost(ty: &Ty) -> Option<usize> {
    match ty {
        Ty::Shape(at) => Some(*at),
        Ty::Array(of, _) | Ty::Sequence(of, _) => innermost(of),
        Ty::Primitive(_) | Ty::String => None,
    }
}

fn shape(
    interface: &Interface,
    name: &str,
    position: &dyn Fn(&str) -> Result<usize, LayoutError>,
    shapes: &[Shape],
) -> Result<Shape, LayoutError> {
    let fields = interface.fields.iter().filter(|field| field.name != NOTHING);
    let (mut names, mut types) = (Vec::new(), Vec::new());
    for field in fields {
        let wide = || LayoutError::Wide { name: interface.name.clone(), field: field.name.clone() };
        names.push(field.name.as_str());
        types.push(ty(&field.ty, position, &wide)?);
    }
    let all = |primitive| types.iter().all(|ty| matches!(ty, Ty::Primitive(other) if *other == primitive));
    let meaning = match (name, names.as_slice()) {
        ("builtin_interfaces/Time", ["sec", "nanosec"]) => Meaning::Time(Primitive::Uint32),
        ("builtin_interfaces/Duration", ["sec", "nanosec"]) => Meaning::Time(Primitive::Int32),
        (_, ["x", "y", "z"]) if all(Primitive::Float64) || all(Primitive::Float32) => Meaning::Point,
        _ => Meaning::Message,
    };
    let before = if name == "std_msgs/Header" && !names.contains(&"seq") { SEQ.size() } else { 0 };
    let size = types.iter().map(|ty| size(ty, shapes)).fold(Size::fixed(before), Size::and);
    if size.least > LARGEST {
        return Err(LayoutError::TooLarge { name: interface.name.clone() });
    }
    Ok(Shape { fields: Fields::new(names), types, meaning, before, size })
}

fn ty(
    of: &WireType,
    position: &dyn Fn(&str) -> Result<usize, LayoutError>,
    wide: &dyn Fn() -> LayoutError,
) -> Result<Ty, LayoutError> {
    Ok(match of {
        WireType::Primitive { primitive } => Ty::Primitive(*primitive),
        WireType::String => Ty::String,
        WireType::WString => return Err(wide()),
        WireType::Interface { name } => Ty::Shape(position(name)?),
        WireType::Array { of, length } => Ty::Array(Box::new(ty(of, position, wide)?), *length as usize),
        WireType::Sequence { of, bound } => Ty::Sequence(Box::new(ty(of, position, wide)?), *bound),
    })
}

fn size(ty: &Ty, shapes: &[Shape]) -> Size {
    match ty {
        Ty::Primitive(primitive) => Size::fixed(primitive.size()),
        Ty::String | Ty::Sequence(..) => Size { least: size_of::<u32>(), fixed: false },
        Ty::Shape(at) => shapes[*at].size,
        Ty::Array(of, length) => {
            let of = size(of, shapes);
            Size { least: of.least.saturating_mul(*length), ..of }
        }
    }
}
