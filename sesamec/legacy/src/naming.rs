//! Names for a `.sesame` file made of names that anybody may have written: nothing of them can become code, a path, or
//! the structure of a file.

use std::collections::BTreeSet;

/// How long a name is at most.
const LONGEST: usize = 60;

/// Gives out names that are each other's, and no reserved words.
#[derive(Debug, Default)]
pub struct Names {
    taken: BTreeSet<String>,
}

impl Names {
    /// A name like `wanted`, or like `fallback` where nothing of it is left. Names differ in more than case and
    /// underscores, so that they do in generated code too.
    pub fn take(&mut self, wanted: &str, fallback: &str) -> String {
        let mut plain = plain(wanted);
        if plain.is_empty() {
            fallback.clone_into(&mut plain);
        } else if plain.starts_with(|first: char| first.is_ascii_digit()) {
            plain = format!("{fallback}_{plain}");
        }
        if is_reserved(&plain) {
            plain = format!("{plain}_{fallback}");
        }
        let mut name = plain.clone();
        let mut number = 1;
        while !self.taken.insert(key(&name)) {
            number += 1;
            name = format!("{plain}_{number}");
        }
        name
    }
}

/// Words of the language, and those that mean something between the parameters of a test.
fn is_reserved(word: &str) -> bool {
    sesame_dsl::is_reserved(word) || matches!(word, "seed" | "before" | "after")
}

/// Letters, digits and single underscores of a text.
fn plain(text: &str) -> String {
    let mut plain = String::new();
    for character in text.chars().take(4 * LONGEST) {
        if character.is_ascii_alphanumeric() {
            plain.push(character);
        } else if !plain.is_empty() && !plain.ends_with('_') {
            plain.push('_');
        }
        if plain.len() == LONGEST {
            break;
        }
    }
    plain.trim_end_matches('_').to_owned()
}

fn key(name: &str) -> String {
    name.chars().filter(|&c| c != '_').map(|c| c.to_ascii_lowercase()).collect()
}

/// Whether a text can be the name of a field, which is as it is on the wire.
pub(crate) fn is_field(name: &str) -> bool {
    name.len() <= LONGEST
        && name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn is_identifier(name: &str) -> bool {
        !name.starts_with(|first: char| first.is_ascii_digit())
            && !name.is_empty()
            && name.len() <= 200
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    }

    #[test]
    fn names_keep_what_they_can() {
        let mut names = Names::default();
        let mut take = |wanted: &str| names.take(wanted, "thing");
        assert_eq!(take("fuzzingOperationTimes"), "fuzzingOperationTimes");
        assert_eq!(take("coverageExperiment-condbased"), "coverageExperiment_condbased");
        assert_eq!(take("/uav_1/ual/set_velocityIN"), "uav_1_ual_set_velocityIN");
        assert_eq!(take("Fuzzing_operation_times"), "Fuzzing_operation_times_2");
        assert_eq!(take("../../etc/passwd"), "etc_passwd");
        assert_eq!(take("metric"), "metric_thing");
        assert_eq!(take("2nd"), "thing_2nd");
        assert_eq!(take("'; DROP TABLE tests; <script>"), "DROP_TABLE_tests_script");
        assert_eq!(take("ü"), "thing");
    }

    proptest! {
        #[test]
        fn whatever_is_wanted_names_are_names_and_differ(wanted in prop::collection::vec(any::<String>(), 1..8)) {
            let mut names = Names::default();
            let given: Vec<String> = wanted.iter().map(|name| names.take(name, "thing")).collect();
            for (at, name) in given.iter().enumerate() {
                prop_assert!(is_identifier(name) && !is_reserved(name), "{name}");
                prop_assert!(given[..at].iter().all(|other| key(other) != key(name)), "{given:?}");
            }
        }
    }
}
