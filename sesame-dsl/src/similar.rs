//! "Did you mean": the nearest of some names.

/// The most bytes of a word that is compared.
const LONGEST: usize = 200;

/// The candidate most similar to a word, if any is near enough; the first of several equally near ones.
///
/// Near enough is an edit distance (insertions, deletions, replacements, swaps; case is ignored) of at most a third of
/// the longer word's letters, and at least one, at most three. One word must keep a letter of the other: between names
/// of one letter nothing tells a slip from another name.
pub fn most_similar<'c>(word: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<&'c str> {
    // The time grows with the product of both lengths, and a name of this length is not a typing mistake.
    if word.len() > LONGEST {
        return None;
    }
    let lower = word.to_lowercase();
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates {
        if candidate == word || candidate.len() > LONGEST {
            continue;
        }
        let distance = strsim::osa_distance(&lower, &candidate.to_lowercase());
        let [length, other] = [word, candidate].map(|word| word.chars().count());
        let allowed = (length.max(other) / 3).clamp(1, 3).min(length.min(other).saturating_sub(1));
        if distance <= allowed && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::most_similar;

    #[test]
    fn nearness_grows_with_length_and_ignores_case() {
        let names = ["link0", "link1", "zones", "collision_occurrence"];
        assert_eq!(most_similar("lnk0", names), Some("link0"));
        assert_eq!(most_similar("Zones", names), Some("zones"));
        assert_eq!(most_similar("colision_ocurrence", names), Some("collision_occurrence"));
        assert_eq!(most_similar("speed", names), None);
        assert_eq!(most_similar("ab", ["cd", "ac"]), Some("ac"));
        assert_eq!(most_similar("link0", ["link0"]), None);
    }

    #[test]
    fn names_of_one_letter_are_similar_in_nothing_but_case() {
        assert_eq!(most_similar("c", ["b", "ab", "ac"]), None);
        assert_eq!(most_similar("ab", ["b", "c"]), None);
        assert_eq!(most_similar("c", ["b", "C"]), Some("C"));
    }

    #[test]
    fn names_of_megabytes_are_not_compared() {
        let long = "a".repeat(4 << 20);
        assert_eq!(most_similar(&long, [&long[1..], "a"]), None);
        assert_eq!(most_similar("ab", [long.as_str(), "ac"]), Some("ac"));
    }
}
