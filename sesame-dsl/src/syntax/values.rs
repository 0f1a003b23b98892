//! Values that are not written in the way of their place: one value in the place of a range, brackets where none stand.

use std::ops::Range;

use sesame_grammar::Rule;

use super::foreign::Rewrite;
use super::limits::parse_bounded;
use super::token::{Token, TokenKind, token_at, tokens};

/// Words before a range that may well contain one value only.
const CONSTANTS: [&str; 6] = ["at", "set", "for", "in", "integer", "integers"];

/// Words before a range that cannot begin at zero.
const POSITIVE: [&str; 3] = ["limit", "duplicate", "slow"];

/// One value where a range is expected: `packet loss 50%`. Nothing before `from` belongs to it.
pub(super) fn one_value(text: &str, from: usize, found: Token<'_>) -> Option<Rewrite> {
    let number = if found.text == "-" { token_at(text, found.hi()) } else { found };
    if number.kind != TokenKind::Number {
        return None;
    }
    let place = found.lo..number.hi();
    let written = &text[place.clone()];
    if let Some((place, range)) = two_values(text, found.lo, number) {
        let message = format!("write `{range}`");
        return Some(Rewrite { message, edits: vec![(place, range)], same: false });
    }
    let before = tokens(text, from, found.lo).last().map_or("", |word| word.text);
    if CONSTANTS.contains(&before) {
        let range = format!("[{written}, {written}]");
        let message = format!("use the range `{range}`, which has one value");
        return Some(Rewrite { message, edits: vec![(place, range)], same: false });
    }
    let digits = parse_bounded(Rule::number, number.text).ok()?.as_str();
    let value: f64 = digits.parse().ok()?;
    let value = if found.text == "-" { -value } else { value };
    let least = if POSITIVE.contains(&before) { 1.0 } else { 0.0 };
    // The other end is where there is hardly a disturbance, or a little further if that is the value.
    let other = if value == least { least + 1.0 } else { least };
    let other_written = format!("{other}{}", &number.text[digits.len()..]);
    let range =
        if value < other { format!("[{written}, {other_written}]") } else { format!("[{other_written}, {written}]") };
    let message = format!("use a range, for example `{range}`");
    Some(Rewrite { message, edits: vec![(place, range)], same: false })
}

/// Two values that are not written as a range: `1 to 20`, `1s..5s`, `0.1-0.3`. Where they stand, and the range.
fn two_values(text: &str, lo: usize, first: Token<'_>) -> Option<(Range<usize>, String)> {
    let joined = token_at(text, first.hi());
    let number = token_at(text, joined.hi());
    let sign = number.text == "-" && joined.text != "-";
    let last = if sign { token_at(text, number.hi()) } else { number };
    let both = matches!(joined.text, "to" | "-" | ".." | ":" | ",") && last.kind == TokenKind::Number;
    let close = token_at(text, last.hi()).text;
    let [low, high] = [&text[lo..first.hi()], &text[number.lo..last.hi()]];
    // In `1 to 20ms`, the unit is that of both.
    let unit_of = |number: Token<'_>| {
        let digits = parse_bounded(Rule::number, number.text).map_or(0, |digits| digits.as_str().len());
        text[number.lo + digits..number.hi()].to_owned()
    };
    let unit = if both && unit_of(first).is_empty() { unit_of(last) } else { String::new() };
    (both && close != "]").then(|| (lo..last.hi(), format!("[{low}{unit}, {high}]")))
}

/// Words or texts in brackets, where they stand without: `stuck at [true]`, `one of ["a", "b"]`.
pub(super) fn without_brackets(text: &str, from: usize, found: Token<'_>) -> Option<Rewrite> {
    let open = if matches!(found.text, "true" | "false") { tokens(text, from, found.lo).last()? } else { found };
    let first = token_at(text, open.hi());
    let closing = match open.text {
        "[" => "]",
        "(" => ")",
        "{" => "}",
        _ => return None,
    };
    let mut last = first;
    while last.kind == TokenKind::Text && token_at(text, last.hi()).text == "," {
        last = token_at(text, token_at(text, last.hi()).hi());
    }
    let close = token_at(text, last.hi());
    let listed = first.kind == TokenKind::Text && last.kind == TokenKind::Text;
    let one = first == last && matches!(first.text, "true" | "false");
    (close.text == closing && (listed || one)).then(|| {
        let inside = &text[first.lo..last.hi()];
        let message = format!("write `{inside}` without brackets");
        Rewrite { message, edits: vec![(open.lo..close.hi(), inside.to_owned())], same: false }
    })
}

/// What to say about numbers after `one of`, which lists texts.
pub(super) fn numbers_are_not_listed(text: &str, from: usize, found: Token<'_>) -> Option<&'static str> {
    let number = if matches!(found.text, "[" | "(" | "{" | "-") { token_at(text, found.hi()) } else { found };
    let before = tokens(text, from, found.lo).last().map_or("", |word| word.text);
    (before == "of" && number.kind == TokenKind::Number).then_some(
        "`one of` lists texts; numbers lie in a range, such as `stuck at [0, 1]` or `random absolute [0, 1]`",
    )
}
