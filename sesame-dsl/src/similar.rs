//! "Did you mean": the nearest of some names.

/// The candidate that looks most like a word, if any is near enough to be meant; the first of equally near ones.
///
/// Near enough is a third of the longer one's letters (at least one, at most three) by insertions, deletions,
/// replacements and swaps, letters of different case counting as equal.
pub(crate) fn most_similar<'c>(word: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<&'c str> {
    let lower = word.to_lowercase();
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates {
        if candidate == word {
            continue;
        }
        let distance = strsim::osa_distance(&lower, &candidate.to_lowercase());
        let allowed = (word.chars().count().max(candidate.chars().count()) / 3).clamp(1, 3);
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
        assert_eq!(most_similar("x", ["y", "ab"]), Some("y"));
        assert_eq!(most_similar("link0", ["link0"]), None);
    }
}
