//! Requirements that are written as more than a bound on one metric.

use sesame_grammar::Rule;

use super::foreign::{Rewrite, following};
use super::token::{Token, TokenKind, token_at};

/// If a requirement begins with a formula in the place of a metric's name: what to declare and to require instead, as
/// an example.
pub(super) fn formula(text: &str, requirement: usize, at: usize) -> Option<String> {
    let mut equals = token_at(text, requirement);
    while equals.text != "=" {
        if equals.kind == TokenKind::End || equals.lo >= at {
            return None;
        }
        equals = token_at(text, equals.hi());
    }
    let name = token_at(text, token_at(text, requirement).hi()).text;
    let temporal = matches!(token_at(text, equals.hi()).text, "always" | "eventually" | "not");
    if temporal {
        let formula = &text[following(text, equals.hi(), Rule::expression)?];
        return Some(format!(
            "such as `metric margin_of_{name} = robustness({formula})`, and require that it is `>= 0`"
        ));
    }
    let formula = following(text, equals.hi(), Rule::sum)?;
    let is_name = following(text, equals.hi(), Rule::identifier).is_some_and(|word| word == formula);
    let bounded = following(text, formula.end, Rule::bound);
    let bound = &text[bounded.filter(|_| !is_name && at < formula.end)?];
    let formula = &text[formula];
    Some(format!("such as `metric value_of_{name} = {formula}`, and require `value_of_{name} {bound}`"))
}

/// Two bounds on one metric: `= gap >= 5m and gap <= 6m`.
pub(super) fn both(text: &str, requirement: usize, and: Token<'_>) -> Option<Rewrite> {
    let before = text.get(requirement..and.lo)?;
    let equals = requirement + before.find('"').and_then(|open| Some(open + before[open..].find('=')?))?;
    let bounded = |at: usize| {
        let name = following(text, at, Rule::name)?;
        let sign = token_at(text, name.end);
        let number = following(text, sign.hi(), Rule::signed)?;
        Some((name, sign.text, number))
    };
    let (name, sign, number) = bounded(equals + 1)?;
    let (other, other_sign, other_number) = bounded(and.hi())?;
    let (low, high) = match (sign, other_sign) {
        (">=" | ">", "<=" | "<") => (&number, &other_number),
        ("<=" | "<", ">=" | ">") => (&other_number, &number),
        _ => return None,
    };
    let range = format!("in [{}, {}]", &text[low.clone()], &text[high.clone()]);
    (text[name.clone()] == text[other]).then(|| Rewrite {
        message: format!("use `{range}`"),
        edits: vec![(name.end..other_number.end, format!(" {range}"))],
        same: false,
    })
}
