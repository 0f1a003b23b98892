//! Names and types in the sentences of diagnostics.

use crate::model::Type;
use crate::units::{Dimension, Unit, dimension};

/// Names as they are shown.
pub(super) fn quoted(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| format!("`{name}`")).collect()
}

/// Names in backquotes, joined for a sentence.
pub(crate) fn list(names: &[&str]) -> String {
    let quoted = quoted(names);
    match quoted.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
        None => String::new(),
    }
}

/// A type with its article.
pub(super) fn type_in_words(ty: &Type) -> String {
    let unit = |unit: &Option<Unit>| match unit {
        Some(unit) if dimension(Some(unit)) != Dimension::NONE => format!(" in `{}`", unit.text()),
        _ => String::new(),
    };
    match ty {
        Type::Bool => "a `bool`".to_owned(),
        Type::Int(of) => format!("an integer{}", unit(of)),
        Type::Real(of) => format!("a number{}", unit(of)),
        Type::Text => "a `text`".to_owned(),
        Type::Point(of) => format!("a point{}", unit(of)),
        Type::List(_) => "a list".to_owned(),
        Type::Message(_) => "a message".to_owned(),
    }
}

/// A word with its article.
pub(super) fn article(word: &str) -> String {
    let article = if word.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {word}")
}
