//! Names of a space as names of Rust, files and packages.
//!
//! A name of the language is an ASCII identifier; `check` refuses anything else, so that no name can become code, a
//! path or the structure of a file. What remains is the style (snake and camel case), keywords, and names that would
//! hide something the generated code or a stub speaks of.

use std::collections::BTreeSet;
use std::path::Path;

use heck::{ToSnakeCase, ToUpperCamelCase};
use proc_macro2::{Ident, Span};

/// Whether a name is an ASCII identifier, and short enough to be a file name.
pub(crate) fn check(name: &str) -> bool {
    let mut bytes = name.bytes();
    let starts = bytes.next().is_some_and(|first| first.is_ascii_alphabetic() || first == b'_');
    starts && name.len() <= 200 && bytes.all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}

/// A name in snake case, for modules, files, fields and functions. Never empty, never a name that Rust cannot escape.
pub(crate) fn snake(name: &str) -> String {
    settled(name.to_snake_case())
}

/// A name in camel case, for types.
pub(crate) fn camel(name: &str) -> String {
    settled(name.to_upper_camel_case())
}

/// `r#self`, `r#Self`, `r#super` and `r#crate` do not exist; a name of underscores has no letters to keep.
fn settled(name: String) -> String {
    match name.as_str() {
        "self" | "Self" | "super" | "crate" => name + "_",
        "" => "unnamed".to_owned(),
        // `_1` has lost its underscore.
        digit if digit.starts_with(|first: char| first.is_ascii_digit()) => format!("n{digit}"),
        _ => name,
    }
}

/// An identifier, raw if it is a keyword. Edition 2024 reserves `gen`, which syn does not know of.
pub(crate) fn ident(name: &str) -> Ident {
    match syn::parse_str::<Ident>(name) {
        Ok(plain) if name != "gen" => plain,
        _ => Ident::new_raw(name, Span::call_site()),
    }
}

/// What a user would write for a name: with `r#` if it is a keyword.
pub(crate) fn written(name: &str) -> String {
    ident(name).to_string()
}

/// Gives out names that differ from each other and from reserved ones.
#[derive(Debug, Default)]
pub(crate) struct Scope(BTreeSet<String>);

impl Scope {
    /// A scope in which these names are taken.
    pub(crate) fn reserving(names: &[&str]) -> Self {
        Scope(names.iter().map(|&name| name.to_owned()).collect())
    }

    /// The wanted name, with `suffix` added until it is free.
    pub(crate) fn take(&mut self, wanted: String, suffix: &str) -> String {
        let mut name = wanted;
        while !self.0.insert(name.clone()) {
            name += suffix;
        }
        name
    }
}

/// The struct of a metric's hook, for example `CollisionOccurrence`.
///
/// It depends on the metric's name alone: a hook file is the user's, so nothing added to the space may rename it.
pub(crate) fn hook_type(metric: &str) -> String {
    // What a stub, or code a user is likely to write in it, speaks of.
    const SPOKEN_OF: [&str; 16] = [
        "Box",
        "Context",
        "Default",
        "Drop",
        "Err",
        "Hook",
        "None",
        "Ok",
        "OperationContext",
        "Option",
        "Result",
        "RunContext",
        "Some",
        "String",
        "Text",
        "Vec",
    ];
    let name = metric.to_upper_camel_case();
    if name == "Self" {
        return "SelfMetric".to_owned();
    }
    let name = settled(name);
    if SPOKEN_OF.contains(&name.as_str()) { name + "Metric" } else { name }
}

/// The trait that a metric's hook implements, for example `CollisionOccurrenceHook`.
pub(crate) fn hook_trait(metric: &str) -> String {
    hook_type(metric) + "Hook"
}

/// The struct of a custom operation's parameters, for example `BendPathParameters`.
pub(crate) fn parameters_type(operation: &str) -> String {
    hook_type(operation) + "Parameters"
}

/// The file beside a `.sesame` file with its hooks in Python.
pub fn python_hooks(space: &Path) -> String {
    format!("{}_hooks.py", python_stem(space))
}

/// The file beside a `.sesame` file with its types in Python.
pub(crate) fn python_types(space: &Path) -> String {
    format!("{}_types.py", python_stem(space))
}

/// What the modules of a space begin with: the name of its file, where Python can import it.
fn python_stem(space: &Path) -> String {
    let stem = space.file_stem().unwrap_or_default().to_string_lossy();
    let stem: String = stem.chars().map(|it| if it.is_ascii_alphanumeric() { it } else { '_' }).collect();
    if stem.starts_with(|first: char| first.is_ascii_digit()) { format!("_{stem}") } else { stem }
}

/// The folder of a monitor that is a program of its own, inside the output folder.
pub fn monitor_folder(monitor: &str) -> String {
    format!("{monitor}_monitor")
}

/// The folder of a campaign inside the output folder; never that of the hooks or of what cargo builds.
pub fn campaign_folder(campaign: &str) -> String {
    match campaign.to_ascii_lowercase().as_str() {
        "hooks" | "target" => format!("{campaign}_campaign"),
        _ => campaign.to_owned(),
    }
}

/// The package of a campaign's runner. The hyphen keeps it apart from every crate that a simulator or hook may bring.
pub(crate) fn package(space: &str, campaign: &str) -> String {
    let start = if space.starts_with(|first: char| first.is_ascii_alphabetic()) { "" } else { "space" };
    format!("{start}{space}-{campaign}")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn keywords_become_raw_or_change() {
        assert_eq!(written(&snake("type")), "r#type");
        assert_eq!(written(&snake("self")), "self_");
        assert_eq!(written(&camel("self")), "Self_");
        assert_eq!(written(&snake("gen")), "r#gen");
    }

    #[test]
    fn names_that_stubs_speak_of_are_kept_free() {
        assert_eq!(hook_type("context"), "ContextMetric");
        assert_eq!(hook_trait("collision_occurrence"), "CollisionOccurrenceHook");
    }

    #[test]
    fn a_campaign_never_takes_the_hooks_folder() {
        assert_eq!(campaign_folder("hooks"), "hooks_campaign");
        assert_eq!(campaign_folder("Target"), "Target_campaign");
        assert_eq!(campaign_folder("coverage"), "coverage");
    }

    proptest! {
        #[test]
        fn what_is_checked_is_harmless_in_every_style(name in "[ -~]{0,12}") {
            if check(&name) {
                for styled in [snake(&name), camel(&name), hook_type(&name), hook_trait(&name)] {
                    prop_assert!(check(&styled), "{styled}");
                    prop_assert!(syn::parse_str::<Ident>(&written(&styled)).is_ok() || written(&styled).starts_with("r#"));
                }
            } else {
                prop_assert!(name.is_empty() || name.contains(|c: char| !c.is_ascii_alphanumeric() && c != '_')
                    || name.starts_with(|c: char| c.is_ascii_digit()));
            }
        }
    }
}
