//! Messages that repeat, gathered by cause: the first few are shown, and the others counted.

use std::fmt::{Display, Write};

/// How many of those that have something in common are shown.
const SHOWN: usize = 3;

/// The first of these by name, and how many more there are: `T3, T7, T9 and 18 more`.
pub fn first_of<T: Display>(named: &[T]) -> String {
    let names: Vec<String> = named.iter().take(SHOWN).map(T::to_string).collect();
    let more = named.len().saturating_sub(SHOWN);
    if more == 0 { names.join(", ") } else { format!("{} and {more} more", names.join(", ")) }
}

/// Messages in the order in which their causes first appear. Two messages have the same cause if they differ only in
/// numbers and in names, which stand in backticks. The first three messages of a cause are kept, and the last of them
/// ends with how many more there are.
pub fn gathered<M: AsRef<str>>(messages: impl IntoIterator<Item = M>) -> Vec<String> {
    struct Cause {
        form: String,
        shown: Vec<String>,
        more: usize,
    }
    let mut causes: Vec<Cause> = Vec::new();
    for message in messages {
        let message = message.as_ref();
        let form = form(message);
        match causes.iter_mut().find(|cause| cause.form == form) {
            Some(cause) if cause.shown.len() == SHOWN => cause.more += 1,
            Some(cause) => cause.shown.push(message.to_owned()),
            None => causes.push(Cause { form, shown: vec![message.to_owned()], more: 0 }),
        }
    }
    let mut all = Vec::new();
    for Cause { mut shown, more, .. } in causes {
        if let Some(last) = shown.last_mut().filter(|_| more > 0) {
            let _ = write!(last, " (and {more} more like this)");
        }
        all.append(&mut shown);
    }
    all
}

/// A message without its names and numbers.
fn form(message: &str) -> String {
    let mut form = String::with_capacity(message.len());
    // Between backticks are names; without a second one, a backtick is a character like any other.
    let mut parts = message.split('`').peekable();
    let mut named = false;
    while let Some(part) = parts.next() {
        if named && parts.peek().is_some() {
            form.push('`');
        } else {
            part.split(' ').for_each(|word| {
                form.push_str(if is_number(word) { "0" } else { word });
                form.push(' ');
            });
        }
        named = !named;
    }
    form
}

/// Whether a word is a number or the name of a test, such as `T12`. Other words with digits are names.
fn is_number(word: &str) -> bool {
    let word = word.trim_end_matches([',', ';', ':', '.', ')']).trim_start_matches('(');
    let digits = word.strip_prefix(['T', '-', '+']).unwrap_or(word);
    digits.starts_with(|first: char| first.is_ascii_digit()) && digits.parse::<f64>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_that_differ_in_names_and_numbers_are_gathered() {
        let lost = |at: usize| format!("{at} of 4 hear `/robot{at}/odom` after {at}.25 s");
        let messages: Vec<String> = (0..5).map(lost).chain(["nobody serves `/reset`".to_owned()]).collect();
        assert_eq!(
            gathered(&messages),
            [
                "0 of 4 hear `/robot0/odom` after 0.25 s",
                "1 of 4 hear `/robot1/odom` after 1.25 s",
                "2 of 4 hear `/robot2/odom` after 2.25 s (and 2 more like this)",
                "nobody serves `/reset`",
            ]
        );
    }

    #[test]
    fn messages_that_say_different_things_are_all_kept() {
        let messages = ["R1 is violated", "R2 is violated", "a ` alone", "a ` alone and more", "it ends. 3 follow", ""];
        assert_eq!(gathered(messages), messages);
    }

    #[test]
    fn up_to_three_are_named_and_the_others_counted() {
        let many = ["a", "b", "c", "d", "e"];
        assert_eq!([first_of(&many[..3]), first_of(&many)], ["a, b, c", "a, b, c and 2 more"]);
    }
}
