//! Numbers that JSON does not have, bare words in the texts of some bridges: the reference server writes `NaN`,
//! `Infinity` and `-Infinity` in lists of numbers, as Python's `json` does, and reads them.
//!
//! Inside of the runner such a word is a marked text, which no message of ROS has by accident.

#[cfg(feature = "client")]
use serde_json::Value as Json;

/// The words, each with its number.
const WORDS: [(&str, f64); 3] = [("NaN", f64::NAN), ("Infinity", f64::INFINITY), ("-Infinity", f64::NEG_INFINITY)];

/// The sign before a marked word, and how it is written in JSON.
const MARK: (char, &str) = ('\u{1}', r"\u0001");

/// A text that may be JSON but for such words, with these marked; `None` without any. What is in quotes is no word.
pub(crate) fn marked(text: &str) -> Option<String> {
    let mut made = String::new();
    let (mut taken, mut at, mut quoted) = (0, 0, false);
    let bytes = text.as_bytes();
    while let Some(&byte) = bytes.get(at) {
        match byte {
            b'\\' if quoted => at += 2,
            b'"' => {
                quoted = !quoted;
                at += 1;
            }
            b'N' | b'I' | b'-' if !quoted => {
                let word = WORDS.iter().find(|(word, _)| bytes[at..].starts_with(word.as_bytes()));
                let Some((word, _)) = word else {
                    at += 1;
                    continue;
                };
                made.push_str(&text[taken..at]);
                made.extend(["\"", MARK.1, word, "\""]);
                at += word.len();
                taken = at;
            }
            _ => at += 1,
        }
    }
    if taken == 0 {
        return None;
    }
    made.push_str(&text[taken..]);
    Some(made)
}

/// A text in which words are marked, with the words as they came.
pub(crate) fn unmarked(mut text: String) -> String {
    if text.contains(MARK.1) {
        for (word, _) in WORDS {
            text = text.replace(&format!("\"{}{word}\"", MARK.1), word);
        }
    }
    text
}

/// The number of a marked word.
#[cfg(feature = "client")]
pub(crate) fn number(json: &Json) -> Option<f64> {
    let word = json.as_str()?.strip_prefix(MARK.0)?;
    WORDS.iter().find(|(known, _)| *known == word).map(|(_, number)| *number)
}

/// The marked word of a number; `None` if JSON has that number.
#[cfg(feature = "client")]
pub(crate) fn word(number: f64) -> Option<Json> {
    let same = |known: &f64| known.is_nan() && number.is_nan() || *known == number;
    WORDS.iter().find(|(_, known)| same(known)).map(|(word, _)| Json::from(format!("{}{word}", MARK.0)))
}

/// Puts a real number in place of each marked word, for those who only ask for types.
#[cfg(feature = "client")]
pub(crate) fn as_reals(json: &mut Json) {
    match json {
        Json::Array(items) => items.iter_mut().for_each(as_reals),
        Json::Object(fields) => fields.values_mut().for_each(as_reals),
        other if number(other).is_some() => *other = Json::from(0.5),
        _ => {}
    }
}

#[cfg(all(test, feature = "client"))]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    #[test]
    fn words_are_numbers_where_a_number_may_stand_and_texts_stay_texts() {
        let text = r#"{"a": [1.5, NaN,Infinity , -Infinity], "b": "NaN, \"Infinity\"", "c": -1, "NaN": null}"#;
        let read: Json = serde_json::from_str(&marked(text).unwrap()).unwrap();
        let numbers: Vec<Option<f64>> = read["a"].as_array().unwrap().iter().map(number).collect();
        assert!(numbers[1].unwrap().is_nan());
        assert_eq!([numbers[0], numbers[2], numbers[3]], [None, Some(f64::INFINITY), Some(f64::NEG_INFINITY)]);
        assert_eq!((&read["b"], number(&read["b"])), (&json!("NaN, \"Infinity\""), None));
        assert_eq!(unmarked(marked(text).unwrap()), text);
        assert_eq!(marked(r#"{"a": "NaN", "b": -1}"#), None);
        assert!(serde_json::from_str::<Json>(&marked("[NaNs]").unwrap()).is_err(), "a longer word is none");
        let mut typed = read;
        as_reals(&mut typed);
        assert_eq!(typed["a"], json!([1.5, 0.5, 0.5, 0.5]));
    }

    proptest! {
        #[test]
        fn what_is_marked_comes_back_as_it_came(text in any::<String>(), parts in prop::collection::vec("[-\"\\\\NaInfty, ]{0,8}", 0..8)) {
            for text in [text, parts.concat()] {
                if let Some(marked) = marked(&text).filter(|_| !text.contains(MARK.1)) {
                    prop_assert_eq!(unmarked(marked), text);
                }
            }
        }

        #[test]
        fn each_number_that_json_lacks_has_its_word(number in any::<f64>()) {
            let found = word(number).map(|word| super::number(&word).unwrap());
            prop_assert_eq!(found.map(f64::to_bits), (!number.is_finite()).then(|| if number.is_nan() { f64::NAN } else { number }).map(f64::to_bits));
        }
    }
}
