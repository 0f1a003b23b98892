//! What is read of a message, as its layout is walked.

use std::sync::Arc;

use sesame_relay::value::{Fields, Text};
use sesame_relay::wire::Wanted;

use crate::layout::{Layout, Meaning, Structure, Ty};

/// What is read of a type.
#[derive(Debug, Clone)]
pub(crate) enum Selection {
    Nothing,
    All,
    /// Some fields of a message, with their names.
    Fields(Arc<Fields>, Vec<Selection>),
}

impl Selection {
    /// What is wanted of the messages of a layout.
    pub(crate) fn new(layout: &Layout, wanted: &Wanted) -> Self {
        of_structure(layout, layout.message(), wanted)
    }
}

fn of_structure(layout: &Layout, structure: &Structure, wanted: &Wanted) -> Selection {
    let Wanted::Fields(wanted) = wanted else { return Selection::All };
    let names = structure.fields.names();
    let chosen = names.iter().filter(|name| wanted.contains_key(name.as_str()));
    let fields = Fields::new(chosen.map(Text::as_str));
    let selections = names.iter().zip(&structure.types).map(|(name, ty)| match (wanted.get(name.as_str()), ty) {
        (None, _) => Selection::Nothing,
        (Some(wanted), Ty::Structure(at)) if layout.structures[*at].meaning == Meaning::Message => {
            of_structure(layout, &layout.structures[*at], wanted)
        }
        // Coordinates, elements.
        (Some(_), _) => Selection::All,
    });
    Selection::Fields(fields, selections.collect())
}
