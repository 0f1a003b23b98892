//! What is written passes its check.

use std::collections::BTreeSet;

use sesame_scan::{Facts, FoundTopic, System};

use super::origin::Origin;
use super::text::space;
use super::types::Types;
use crate::frontend::{Language, Look};

/// What the space is called while it is checked: a file in the current folder, to which its folders are relative.
pub const FILE: &str = "scan.sesame";

/// The space, formatted, which passes its check: types that do not are left out. An error is a mistake of this program.
pub fn checked_space(
    language: &Language,
    facts: &Facts,
    types: &mut Types,
    origin: Origin<'_>,
) -> Result<String, String> {
    let check = |text: &str| (language.check)(FILE, text, Look::Short);
    let text = space(facts, types, origin);
    if check(&text).errors > 0 {
        // Some layouts are too large for the language, or wrong in a way that only the language knows.
        let of_topics: BTreeSet<&String> = facts.topics.iter().filter_map(|topic| topic.ty.as_ref()).collect();
        for ty in of_topics {
            let topic = FoundTopic { path: "/topic".to_owned(), ty: Some(ty.clone()), ..FoundTopic::default() };
            let alone = Facts { topics: vec![topic], ..Facts::of(facts.system.clone()) };
            let checked = check(&space(&alone, types, origin));
            if checked.errors > 0 {
                types.refuse(ty, first_error(&checked.diagnostics));
            }
        }
    }
    let text = space(facts, types, origin);
    let checked = check(&text);
    let mistake = |diagnostics: &str| {
        format!("what was found could not be written as a space, which is a mistake in sesamec: {diagnostics}")
    };
    if checked.errors > 0 {
        return Err(mistake(&checked.diagnostics));
    }
    (language.format)(FILE, &text, Look::Short).map_err(|found| mistake(&found.diagnostics))
}

/// Whether a space could have this simulator with these settings: an address that is malformed, or to which a secret
/// would go in plain text, is refused before anything is connected.
pub fn check_settings(language: &Language, system: System, settings: &[String]) -> Result<(), String> {
    let origin = Origin { folders: &[], services: &BTreeSet::new(), settings };
    let checked = (language.check)(FILE, &space(&Facts::of(system), &Types::default(), origin), Look::Short);
    if checked.errors == 0 { Ok(()) } else { Err(first_error(&checked.diagnostics)) }
}

/// What the first error says, without its place.
fn first_error(diagnostics: &str) -> String {
    let mut errors = diagnostics.lines().filter_map(|line| line.split_once(": error[").map(|(_, error)| error));
    errors.next().and_then(|error| error.split_once("]: ")).map_or("it has errors", |(_, title)| title).to_owned()
}
