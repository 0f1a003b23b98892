//! Where the layouts of two sides differ, in words for the user.

use sesame_plan::Primitive;
use sesame_relay::value::Text;

use crate::layout::{Layout, Meaning, Structure, Ty};

/// Where their layout differs from ours, in a phrase. What is hidden in one of them only makes no difference.
pub(crate) fn difference(ours: &Layout, theirs: &Layout) -> Option<String> {
    of_structures((ours, ours.message()), (theirs, theirs.message()))
}

fn of_structures(
    (our_layout, ours): (&Layout, &Structure),
    (their_layout, theirs): (&Layout, &Structure),
) -> Option<String> {
    if ours.meaning == theirs.meaning && matches!(ours.meaning, Meaning::Time(_)) {
        return None;
    }
    let ([our_names, our_types], [their_names, their_types]) = (shown(ours), shown(theirs));
    if our_names != their_names {
        return Some(format!("fields `{our_names}`, not `{their_names}`"));
    }
    if our_types != their_types {
        return Some(format!("types `{our_types}` of `{our_names}`, not `{their_types}`"));
    }
    // One of them may have among its fields what the other one hides.
    let skip =
        |structure: &Structure, other: &Structure| usize::from(structure.hidden.is_none() && other.hidden.is_some());
    let our_fields = ours.types.iter().zip(ours.fields.names()).skip(skip(ours, theirs));
    let their_fields = theirs.types.iter().skip(skip(theirs, ours));
    our_fields.zip(their_fields).find_map(|((our, name), their)| {
        let (our, their) = (&our_layout.structures[innermost(our)?], &their_layout.structures[innermost(their)?]);
        let inside = of_structures((our_layout, our), (their_layout, their))?;
        Some(format!("in `{name}`: {inside}"))
    })
}

/// The names of its fields, and their types without those of messages, as they are on the wire.
fn shown(structure: &Structure) -> [String; 2] {
    let hidden = structure.hidden.iter();
    let names = hidden.clone().map(|hidden| hidden.name).chain(structure.fields.names().iter().map(Text::as_str));
    let types =
        hidden.map(|hidden| written(&Ty::Primitive(hidden.primitive))).chain(structure.types.iter().map(written));
    [names.collect::<Vec<_>>().join(", "), types.collect::<Vec<_>>().join(", ")]
}

/// A type as `.msg` files write it.
fn written(ty: &Ty) -> String {
    match ty {
        // A `byte` has a sign in ROS 1, and none in ROS 2.
        Ty::Primitive(Primitive::Int8 | Primitive::Uint8) => "int8".to_owned(),
        Ty::Primitive(primitive) => primitive.name().to_owned(),
        // How long a text may be, or how many elements there may be, makes no difference on the wire.
        Ty::String(_) => "string".to_owned(),
        Ty::WString(_) => "wstring".to_owned(),
        Ty::Structure(_) => "message".to_owned(),
        Ty::Array(of, length) => format!("{}[{length}]", written(of)),
        Ty::Sequence(of, _) => format!("{}[]", written(of)),
    }
}

/// The message in a type.
fn innermost(ty: &Ty) -> Option<usize> {
    match ty {
        Ty::Structure(at) => Some(*at),
        Ty::Array(of, _) | Ty::Sequence(of, _) => innermost(of),
        Ty::Primitive(_) | Ty::String(_) | Ty::WString(_) => None,
    }
}
