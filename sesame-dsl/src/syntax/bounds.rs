//! Requirements that are written as more than a bound on one metric.

use sesame_grammar::Rule;

use super::foreign::{Rewrite, following};
use super::token::{Token, token_at, tokens};

const COMPUTE_IT: &str = "declare a metric whose formula computes this from topics, and require a bound on that metric";

/// If a requirement begins with a formula in the place of a metric's name: what to declare and to require instead, as
/// an example.
pub(super) fn formula(text: &str, requirement: usize, at: usize) -> Option<String> {
    let equals = equals_of(text, requirement, at)?;
    let name = token_at(text, token_at(text, requirement).hi()).text;
    let first = token_at(text, equals.hi()).text;
    if first == "not" {
        return Some(COMPUTE_IT.to_owned());
    }
    if matches!(first, "always" | "eventually") {
        let formula = &text[following(text, equals.hi(), Rule::expression)?];
        return Some(format!(
            "declare a metric with the formula, such as `metric margin_of_{name} = robustness({formula})`, and require \
             that it is `>= 0`"
        ));
    }
    let formula = following(text, equals.hi(), Rule::sum)?;
    let is_name = following(text, equals.hi(), Rule::identifier).is_some_and(|word| word == formula);
    let bounded = following(text, formula.end, Rule::bound);
    let bound = &text[bounded.filter(|_| !is_name && at < formula.end)?];
    // Only an aggregate is a formula as a whole.
    let is_call = following(text, formula.start, Rule::call).is_some_and(|call| call == formula);
    let formula = &text[formula];
    if !is_call {
        return Some(COMPUTE_IT.to_owned());
    }
    Some(format!(
        "declare a metric with the formula, such as `metric value_of_{name} = {formula}`, and require \
         `value_of_{name} {bound}`"
    ))
}

/// The `=` of a requirement, before a place.
fn equals_of(text: &str, requirement: usize, at: usize) -> Option<Token<'_>> {
    tokens(text, requirement, at).find(|token| token.text == "=")
}

/// Two bounds on one metric: `= gap >= 5m and gap <= 6m`.
pub(super) fn both(text: &str, requirement: usize, and: Token<'_>) -> Option<Rewrite> {
    let equals = equals_of(text, requirement, and.lo)?;
    let bounded = |at: usize| {
        let name = following(text, at, Rule::name)?;
        let sign = token_at(text, name.end);
        let number = following(text, sign.hi(), Rule::signed)?;
        Some((name, sign.text, number))
    };
    let (name, sign, number) = bounded(equals.hi())?;
    let (other, other_sign, other_number) = bounded(and.hi())?;
    let (low, high) = match (sign, other_sign) {
        (">=" | ">", "<=" | "<") => (&number, &other_number),
        ("<=" | "<", ">=" | ">") => (&other_number, &number),
        _ => return None,
    };
    let range = format!("in [{}, {}]", &text[low.clone()], &text[high.clone()]);
    let strict = [sign, other_sign].iter().any(|sign| matches!(*sign, "<" | ">"));
    (text[name.clone()] == text[other]).then(|| Rewrite {
        message: if strict { format!("use `{range}`, which includes both ends") } else { format!("use `{range}`") },
        edits: vec![(name.end..other_number.end, format!(" {range}"))],
        same: false,
    })
}
