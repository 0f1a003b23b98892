//! Recorded sentences as people read them: numbers with as many digits as matter, values with their units.
//!
//! Results record exact words, since they are compared and hashed; only reports shorten them.

use sesame_plan::{Bound, CampaignPlan, MetricId};
use sesame_present::number;

/// Digits beyond which a number with a fraction is shortened.
const DIGITS: usize = 6;

/// A recorded sentence with short numbers, and with units where it says what a metric is: ``` `reserve` is -2.24471```
/// becomes ``` `reserve` is -2.245 m```. Such a value keeps as many more digits as show on which side of the metric's
/// bounds it is.
pub fn sentence(plan: &CampaignPlan, text: &str) -> String {
    let mut said = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((begin, length, metric)) = first_value(plan, rest) {
        let bounds = plan
            .requirements
            .iter()
            .filter(|requirement| requirement.metric == metric)
            .map(|requirement| requirement.bound);
        let bounds: Vec<Bound> = bounds.collect();
        let value: f64 = rest[begin..begin + length].parse().expect("its length is that of a number");
        said.push_str(&short_numbers(&rest[..begin]));
        said.push_str(&number::beside(value, &bounds, plan.metric(metric).unit.as_deref()));
        rest = &rest[begin + length..];
    }
    said.push_str(&short_numbers(rest));
    said
}

/// Where a sentence first says what a metric is: the number's place, its length, and the metric.
fn first_value(plan: &CampaignPlan, text: &str) -> Option<(usize, usize, MetricId)> {
    let values = (0..).map(MetricId).zip(&plan.metrics).filter_map(|(id, metric)| {
        let lead = format!("`{}` is ", metric.name);
        let begin = text.find(&lead)? + lead.len();
        let length = number_length(&text[begin..]);
        let ends = text[begin + length..].chars().next().is_none_or(|next| matches!(next, ',' | ';' | '.'));
        (length > 0 && ends).then_some((begin, length, id))
    });
    values.min_by_key(|&(begin, ..)| begin)
}

/// The same words with numbers of many digits as numbers are shown everywhere: `18.927509254124797s` is `18.93s`.
pub(crate) fn short_numbers(text: &str) -> String {
    let mut said = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(next) = rest.chars().next() {
        // Digits within a name, such as `zone1.5`, are not a number.
        let in_name = said.chars().next_back().is_some_and(|before| before.is_alphanumeric() || before == '_');
        let length = if in_name { 0 } else { number_length(rest) };
        let (word, after) = rest.split_at(if length == 0 { next.len_utf8() } else { length });
        let digits = word.chars().filter(char::is_ascii_digit).count();
        match word.parse::<f64>() {
            Ok(x) if digits > DIGITS && word.contains('.') => said.push_str(&number::number(x)),
            _ => said.push_str(word),
        }
        rest = after;
    }
    said
}

/// The length of the number at the start of a text; 0 if there is none.
fn number_length(text: &str) -> usize {
    let unsigned = text.strip_prefix('-').unwrap_or(text);
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let whole = digits(unsigned);
    if whole == 0 {
        return 0;
    }
    let mut length = whole;
    if let Some(fraction) = unsigned[length..].strip_prefix('.').map(digits).filter(|&fraction| fraction > 0) {
        length += 1 + fraction;
    }
    if let Some(exponent) = unsigned[length..].strip_prefix('e') {
        let sign = usize::from(exponent.starts_with('-'));
        let exponent = digits(&exponent[sign..]);
        length += if exponent > 0 { 1 + sign + exponent } else { 0 };
    }
    text.len() - unsigned.len() + length
}

#[cfg(test)]
mod tests {
    use sesame_record::sample;

    use super::*;

    #[test]
    fn values_have_their_unit_and_no_more_digits_than_matter() {
        let plan = sample::plan();
        let said = |text: &str| sentence(&plan, text);
        let warning = "requirement R3 is violated before anything is fuzzed: `arm_distance` is -2.244690363500318";
        assert_eq!(said(warning), "requirement R3 is violated before anything is fuzzed: `arm_distance` is -2.245 mm");
        assert_eq!(said("`collision_occurrence` is 3"), "`collision_occurrence` is 3", "a plain number");
        assert_eq!(said("`arm_distance` has no value"), "`arm_distance` has no value");
        assert_eq!(said("`arm_distance` is 5 of a kind"), "`arm_distance` is 5 of a kind");
        assert_eq!(
            said("`arm_distance` is 1.23456789, `collision_occurrence` is 2; end"),
            "`arm_distance` is 1.235 mm, `collision_occurrence` is 2; end"
        );
    }

    #[test]
    fn a_value_that_breaks_a_bound_by_rounding_does_not_read_as_one_that_keeps_it() {
        let mut plan = sample::plan();
        let metric = plan.metrics.iter().position(|metric| metric.name == "arm_distance").unwrap();
        plan.requirements[0].metric = MetricId(u32::try_from(metric).unwrap());
        plan.requirements[0].bound = Bound::AtMost { value: 1.0 };
        let warning = "requirement R1 is violated before anything is fuzzed: `arm_distance` is 1.0000000000000002";
        assert!(sentence(&plan, warning).ends_with("`arm_distance` is 1.0000000000000002 mm"));
    }

    #[test]
    fn only_numbers_of_many_digits_are_shortened() {
        assert_eq!(
            short_numbers("when 1.5m/s < top_speed for 18.927509254124797s at most 3 times"),
            "when 1.5m/s < top_speed for 18.93s at most 3 times"
        );
        assert_eq!(
            short_numbers("x1.2345678 of seed 18446744073709551615, T12345678"),
            "x1.2345678 of seed 18446744073709551615, T12345678"
        );
        assert_eq!(short_numbers("-0.30000000000000004"), "-0.3");
        assert_eq!(short_numbers("ä 1. 2.5e-3x 1.23456789e-7"), "ä 1. 2.5e-3x 1.23e-7");
    }
}
