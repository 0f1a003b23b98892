//! Text from templates.

use serde::Serialize;
use tera::{Context, Tera};

/// Fills in a template of this project. Templates hold loops and no logic; that they fit what they are given is an
/// invariant of this crate, and each of them is rendered by its tests.
pub(crate) fn render(template: &str, values: &impl Serialize) -> String {
    let mut tera = Tera::default();
    tera.add_raw_template("text", template).expect("our templates are well formed");
    let context = Context::from_serialize(values).expect("a struct serialises");
    tera.render("text", &context).expect("our templates use only what they are given")
}
