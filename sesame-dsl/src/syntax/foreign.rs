//! Operators and notations of other languages in expressions, and what to write for them.

use std::ops::Range;

use sesame_grammar::Rule;

use super::limits::parse_bounded;
use super::token::{Token, TokenKind, token_at};
use crate::synonyms;

/// What to write in place of something foreign.
pub(super) struct Rewrite {
    pub(super) message: String,
    /// What to replace with what, from left to right.
    pub(super) edits: Vec<(Range<usize>, String)>,
    /// Whether it can mean nothing else.
    pub(super) same: bool,
}

/// The foreign operators with what they mean, longer ones before those that they contain.
const OPERATORS: &[(&str, &[&str])] = &[
    ("<=>", &["=="]),
    ("<->", &["=="]),
    ("==>", &["implies"]),
    ("-->", &["implies"]),
    ("===", &["=="]),
    ("=>", &["implies", ">="]),
    ("->", &["implies"]),
    ("=<", &["<="]),
    ("<>", &["!="]),
    ("&&", &["and"]),
    ("||", &["or"]),
    ("→", &["implies"]),
    ("⇒", &["implies"]),
    ("∧", &["and"]),
    ("∨", &["or"]),
    ("≤", &["<="]),
    ("≥", &[">="]),
    ("≠", &["!="]),
    ("¬", &["not"]),
    ("&", &["and"]),
    ("|", &["or"]),
    ("!", &["not"]),
];

/// The most bytes before a mistake that are read again to find an operand.
const FARTHEST: usize = 400;

/// The foreign operator around a place, and what to write for it, the likeliest first.
pub(super) fn operator(text: &str, at: usize) -> Option<(Range<usize>, Vec<Rewrite>)> {
    let around = |operator: &str| {
        let first = at.saturating_sub(operator.len() - 1);
        (first..=at).find(|&lo| text.get(lo..).is_some_and(|rest| rest.starts_with(operator)))
    };
    let found = OPERATORS.iter().find_map(|(operator, meant)| Some((around(operator)?, *operator, *meant)));
    let (lo, operator, meant) = found?;
    let hi = lo + operator.len();
    if operator == "!" && text[hi..].starts_with('=') {
        return None;
    }
    // Words need a blank around them, which signs do not.
    let joined = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    let written = |word: &str| {
        let sign = !word.starts_with(char::is_alphabetic);
        let before = if sign || !joined(text[..lo].chars().next_back()) { "" } else { " " };
        let after = if sign || text[hi..].starts_with(char::is_whitespace) { "" } else { " " };
        format!("{before}{word}{after}")
    };
    let rewrites = meant.iter().map(|word| Rewrite {
        message: format!("use `{word}`"),
        edits: vec![(lo..hi, written(word))],
        same: matches!(operator, "&&" | "||" | "≤" | "≥" | "≠" | "∧" | "∨"),
    });
    let mut rewrites: Vec<Rewrite> = rewrites.collect();
    // A number is not a condition.
    if token_at(text, hi).kind == TokenKind::Number {
        rewrites.reverse();
    }
    Some((lo..hi, rewrites))
}

/// Which part of an expression is expected at a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Expected {
    Operand,
    Operator,
}

/// What to write for a notation of other languages that ends or begins at a place, the likeliest first. Nothing before
/// `from` belongs to it.
pub(super) fn notation(text: &str, from: usize, at: usize, expected: Expected) -> Vec<Rewrite> {
    let found = token_at(text, at);
    let mut rewrites = Vec::new();
    if expected == Expected::Operand {
        match found.text {
            "'" => rewrites.extend(quoted(text, found)),
            "+" => rewrites.extend(signed(text, found)),
            "*" => rewrites.extend(power(text, from, found)),
            _ => {}
        }
        return rewrites;
    }
    match found.text {
        "^" => rewrites.extend(power(text, from, found)),
        "<" | "<=" | ">" | ">=" => rewrites.extend(chained(text, from, found)),
        "in" | "between" => rewrites.extend(between(text, from, found)),
        _ => {}
    }
    let before = word_before(text, from, at);
    for synonym in synonyms::meanings(&text[before.clone()], |word| word == "always" || word == "eventually") {
        rewrites.push(Rewrite {
            message: format!("did you mean `{}`?", synonym.meant),
            edits: vec![(before.clone(), synonym.meant.to_owned())],
            same: synonym.same,
        });
    }
    rewrites
}

/// The word that ends before a place; empty if there is none.
fn word_before(text: &str, from: usize, at: usize) -> Range<usize> {
    let before = text.get(from..at).unwrap_or_default().trim_end();
    let hi = from.min(at) + before.len();
    let word = before.trim_end_matches(|c: char| c.is_alphanumeric() || c == '_');
    hi - (before.len() - word.len())..hi
}

/// A number with a `+` before it.
fn signed(text: &str, plus: Token<'_>) -> Option<Rewrite> {
    let next = token_at(text, plus.hi());
    let edits = vec![(plus.lo..next.lo, String::new())];
    (next.kind == TokenKind::Number).then(|| Rewrite { message: "remove the `+`".to_owned(), edits, same: true })
}

/// A text in single quotes.
fn quoted(text: &str, open: Token<'_>) -> Option<Rewrite> {
    let rest = &text[open.hi()..];
    let inner = &rest[..rest.find(['\'', '"', '\\', '\n', '\r'])?];
    let hi = open.hi() + inner.len() + 1;
    (rest[inner.len()..].starts_with('\'')).then(|| Rewrite {
        message: format!("use `\"{inner}\"`"),
        edits: vec![(open.lo..hi, format!("\"{inner}\""))],
        same: true,
    })
}

/// A power with an operator: `x^2`, `x**2`.
fn power(text: &str, from: usize, found: Token<'_>) -> Vec<Rewrite> {
    let lo = if found.text == "*" { found.lo.saturating_sub(1) } else { found.lo };
    if found.text == "*" && !text[..found.lo].ends_with('*') {
        return Vec::new();
    }
    let sign = token_at(text, found.hi());
    let exponent = if sign.text == "-" { token_at(text, sign.hi()) } else { sign };
    let Some(base) = operand(text, from, lo, Rule::factor).filter(|_| exponent.kind == TokenKind::Number) else {
        return Vec::new();
    };
    let (whole, base, exponent) = (base.start..exponent.hi(), &text[base], &text[sign.lo..exponent.hi()]);
    let mut written = vec![format!("pow({base}, {exponent})")];
    if exponent == "2" {
        // `pow` takes plain numbers only.
        written.insert(0, format!("({base} * {base})"));
    }
    let rewrite = |written: String| Rewrite {
        message: format!("use `{written}`"),
        edits: vec![(whole.clone(), written)],
        same: false,
    };
    written.into_iter().map(rewrite).collect()
}

/// Two comparisons written as one: `1m < x < 2m`.
fn chained(text: &str, from: usize, second: Token<'_>) -> Option<Rewrite> {
    let middle = operand(text, from, second.lo, Rule::sum)?;
    let before = text[..middle.start].trim_end();
    let sign = ["<=", ">=", "<", ">"].into_iter().find(|sign| before.ends_with(sign))?;
    let left = operand(text, from, before.len() - sign.len(), Rule::sum)?;
    let right = following(text, second.hi(), Rule::sum)?;
    if matches!(token_at(text, right.end).text, "<" | "<=" | ">" | ">=" | "==" | "!=") {
        return None;
    }
    let first = &text[left.start..middle.end];
    let written = format!("{first} and {} {} {}", &text[middle], second.text, &text[right.clone()]);
    Some(Rewrite {
        message: format!("use `{written}`"),
        edits: vec![(left.start..right.end, in_parentheses(text, left.start..right.end, &written))],
        same: false,
    })
}

/// A condition that a value lies in a range: `x in [1m, 2m]`, `x between 1m and 2m`.
fn between(text: &str, from: usize, word: Token<'_>) -> Option<Rewrite> {
    let value = operand(text, from, word.lo, Rule::sum)?;
    let range = match following(text, word.hi(), Rule::range) {
        Some(range) => {
            let low = following(text, range.start + 1, Rule::signed)?;
            let high = following(text, token_at(text, low.end).hi(), Rule::signed)?;
            Some((low, high, range.end))
        }
        None if word.text == "between" => {
            let low = following(text, word.hi(), Rule::signed)?;
            let and = Some(token_at(text, low.end)).filter(|and| and.text == "and")?;
            let high = following(text, and.hi(), Rule::signed)?;
            Some((low, high.clone(), high.end))
        }
        None => None,
    };
    let (low, high, end) = range?;
    let compared = &text[value.clone()];
    let written = format!("{compared} >= {} and {compared} <= {}", &text[low], &text[high]);
    Some(Rewrite {
        message: format!("use `{written}`"),
        edits: vec![(value.start..end, in_parentheses(text, value.start..end, &written))],
        same: false,
    })
}

/// A conjunction in parentheses, unless it stands in some already.
fn in_parentheses(text: &str, place: Range<usize>, conjunction: &str) -> String {
    if text[..place.start].trim_end().ends_with('(') && text[place.end..].trim_start().starts_with(')') {
        conjunction.to_owned()
    } else {
        format!("({conjunction})")
    }
}

/// The longest operand that ends before a place, read by a rule.
fn operand(text: &str, from: usize, end: usize, rule: Rule) -> Option<Range<usize>> {
    let end = text.get(from..end)?.trim_end().len() + from;
    let mut start = from.max(end.saturating_sub(FARTHEST));
    while !text.is_char_boundary(start) {
        start += 1;
    }
    let mut at = token_at(text, start);
    while at.lo < end && at.kind != TokenKind::End {
        // `-x^2` is minus the power of `x`, but `-x < y` compares `-x`.
        let fits = (rule == Rule::sum || at.text != "-")
            && parse_bounded(rule, &text[at.lo..end]).is_ok_and(|read| read.as_str().len() == end - at.lo);
        if fits {
            return Some(at.lo..end);
        }
        at = token_at(text, at.hi());
    }
    None
}

/// What a rule reads at a place.
pub(super) fn following(text: &str, at: usize, rule: Rule) -> Option<Range<usize>> {
    let lo = token_at(text, at).lo;
    let read = parse_bounded(rule, &text[lo..]).ok()?;
    Some(lo..lo + read.as_str().trim_end().len())
}
