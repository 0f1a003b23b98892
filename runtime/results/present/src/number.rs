//! Numbers as people read them: as many digits as tell them apart, no more.

use sesame_plan::{Bound, Choice, OperationKind, Parameter};

/// Decimals that show every value of a column to four significant digits of the largest, and the smallest not as zero;
/// three at most, and no more than make a difference.
pub fn decimals(values: impl IntoIterator<Item = f64>) -> usize {
    let values: Vec<f64> = values.into_iter().map(f64::abs).filter(|value| value.is_finite()).collect();
    let largest = values.iter().copied().fold(0.0, f64::max);
    let smallest = values.iter().copied().filter(|&value| value > 0.0).fold(f64::INFINITY, f64::min);
    let magnitude = |x: f64| libm::floor(libm::log10(x));
    let wanted = (3.0 - magnitude(largest)).max(-magnitude(smallest));
    let told = |scale: f64| values.iter().all(|value| (libm::rint(value * scale) - value * scale).abs() < 1e-6);
    [(0.0, 1.0), (1.0, 10.0), (2.0, 100.0)]
        .iter()
        .position(|&(decimals, scale)| wanted <= decimals || told(scale))
        .unwrap_or(3)
}

/// A number with so many decimals. What is too large or small to be read that way gets an exponent; a zero has no sign.
pub fn fixed(x: f64, decimals: usize) -> String {
    let magnitude = x.abs();
    if x != 0.0 && x.is_finite() && !(5e-4..1e9).contains(&magnitude) {
        return format!("{x:.2e}");
    }
    let text = format!("{x:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().all(|byte| matches!(byte, b'0' | b'.')) => digits.to_owned(),
        _ => text,
    }
}

/// A number on its own.
pub fn number(x: f64) -> String {
    fixed(x, decimals([x]))
}

/// A time in seconds: to the millisecond, or to the nanosecond where that makes a difference. Times of a run are whole
/// nanoseconds, and differences of them are not further from that than arithmetic makes them.
pub fn time(seconds: f64) -> String {
    let nanoseconds = libm::rint(seconds * 1e9);
    if !nanoseconds.is_finite() || nanoseconds.abs() >= 1e18 || nanoseconds % 1e6 == 0.0 {
        return with_unit(fixed(seconds, 3), Some("s"));
    }
    let text = format!("{:.9}", nanoseconds / 1e9);
    with_unit(text.trim_end_matches('0').to_owned(), Some("s"))
}

/// A number next to bounds: with as many more digits as show on which side of each it is.
pub fn beside(x: f64, bounds: &[Bound], unit: Option<&str>) -> String {
    let tells = |text: &str| {
        text.parse::<f64>().is_ok_and(|read| bounds.iter().all(|bound| bound.holds(read) == bound.holds(x)))
    };
    let usual = number(x);
    let text = if tells(&usual) {
        usual
    } else {
        let longer = (decimals([x]) + 1..=17).map(|decimals| format!("{x:.decimals$}"));
        longer.into_iter().find(|text| tells(text)).unwrap_or_else(|| exact(x))
    };
    with_unit(text, unit)
}

/// A number as people read it, with its unit: at most four significant digits or three decimals, `-7.393 m`.
pub fn quantity(x: f64, unit: Option<&str>) -> String {
    with_unit(number(x), unit)
}

/// A written number and its unit, apart by a space.
pub fn with_unit(number: String, unit: Option<&str>) -> String {
    match unit {
        Some(unit) => format!("{number} {unit}"),
        None => number,
    }
}

/// A name with its unit in brackets, as in `fuzzing_time [s]`.
pub fn titled(name: &str, unit: Option<&str>) -> String {
    match unit {
        Some(unit) => format!("{name} [{unit}]"),
        None => name.to_owned(),
    }
}

/// A bound as in `≤ 70 s`.
pub fn bound(bound: Bound, unit: Option<&str>) -> String {
    match bound {
        Bound::AtMost { value } => format!("≤ {}", quantity(value, unit)),
        Bound::Below { value } => format!("< {}", quantity(value, unit)),
        Bound::AtLeast { value } => format!("≥ {}", quantity(value, unit)),
        Bound::Above { value } => format!("> {}", quantity(value, unit)),
        Bound::Equal { value } => format!("= {}", quantity(value, unit)),
        Bound::Within { low, high } => {
            let decimals = decimals([low, high]);
            with_unit(format!("{}…{}", fixed(low, decimals), fixed(high, decimals)), unit)
        }
    }
}

/// A bound with all its digits, for comparison with a value: an expectation may be exact to the last bit.
pub fn exact_bound(bound: Bound, unit: Option<&str>) -> String {
    let (sign, number) = match bound {
        Bound::AtMost { value } => ("≤ ", exact(value)),
        Bound::Below { value } => ("< ", exact(value)),
        Bound::AtLeast { value } => ("≥ ", exact(value)),
        Bound::Above { value } => ("> ", exact(value)),
        Bound::Equal { value } => ("= ", exact(value)),
        Bound::Within { low, high } => ("", format!("{}…{}", exact(low), exact(high))),
    };
    with_unit(format!("{sign}{number}"), unit)
}

/// A number with all the digits that tell it from every other; a zero has no sign.
pub fn exact(x: f64) -> String {
    let magnitude = x.abs();
    if x == 0.0 || (1e-6..1e15).contains(&magnitude) { format!("{}", x + 0.0) } else { format!("{x:e}") }
}

/// The unit in which a parameter's values up to this one are written, and by what they are multiplied for that.
pub fn scale<'p>(kind: &OperationKind, parameter: &'p Parameter, highest: f64) -> (f64, Option<&'p str>) {
    match kind {
        kind if parameter.is_probability(kind) => (100.0, Some("%")),
        OperationKind::Latency { .. } | OperationKind::Reorder { .. } | OperationKind::Stale if highest < 1.0 => {
            (1000.0, Some("ms"))
        }
        _ => (1.0, parameter.unit.as_deref()),
    }
}

/// What a test chose, as in `offset 0.27…0.29 rad`, `loss 40 %`, `delay 20…100 ms`. A range whose ends are written
/// alike is written as one number.
pub fn choice(kind: &OperationKind, parameter: &Parameter, choice: &Choice) -> String {
    let (low, high) = match choice {
        Choice::Value { value } => (*value, *value),
        Choice::Range { low, high } => (*low, *high),
        Choice::Point { point } => {
            let decimals = decimals(*point);
            let point = point.map(|coordinate| fixed(coordinate, decimals)).join(", ");
            return format!("{} {}", parameter.name, with_unit(format!("({point})"), parameter.unit.as_deref()));
        }
        Choice::Text { text } => return format!("{} {text}", parameter.name),
    };
    let (factor, unit) = scale(kind, parameter, high);
    let ends = [low * factor, high * factor];
    let decimals = decimals(ends);
    let [low, high] = ends.map(|end| fixed(end, decimals));
    let text = if low == high { low } else { format!("{low}…{high}") };
    format!("{} {}", parameter.name, with_unit(text, unit))
}

/// `1 test`, `2 tests`.
pub fn plural(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// `a`, `a and b`, `a, b and c`.
pub fn join_words(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
    }
}

/// For counts that are left out of JSON where they count nothing; serde passes a reference.
pub fn is_zero(count: &usize) -> bool {
    *count == 0
}

#[cfg(test)]
mod tests {
    use sesame_plan::{ChoiceKind, Domain, ValueMode};

    use super::*;

    #[test]
    fn times_have_the_digits_that_tell_two_instants_apart() {
        assert_eq!([0.9, 0.9 + 1e-9, 1.270_000_000_999_999_9].map(time), ["0.900 s", "0.900000001 s", "1.270000001 s"]);
        // As differences come out.
        assert_eq!(time(-0.300_000_000_000_000_04), "-0.300 s");
        assert_eq!(time(2.5 - 10.1), "-7.600 s");
        assert_eq!([0.0, -0.0, 70.0, 1e12].map(time), ["0.000 s", "0.000 s", "70.000 s", "1.00e12 s"]);
    }

    #[test]
    fn a_column_shows_four_digits_of_its_largest_value() {
        assert_eq!(decimals([49.238, 12.0]), 2);
        assert_eq!(decimals([18.0, 0.0, -3.0]), 0);
        assert_eq!(decimals([0.27, 0.3]), 2);
        assert_eq!(decimals([0.2713, 0.3]), 3);
        assert_eq!(decimals([49.238, 0.003]), 3);
        assert_eq!(decimals([12345.5]), 0);
        assert_eq!(decimals([]), 0);
    }

    #[test]
    fn numbers_read_as_people_write_them() {
        assert_eq!(number(18.0), "18");
        assert_eq!(number(-0.0), "0");
        assert_eq!(fixed(-0.0004, 2), "-4.00e-4");
        assert_eq!(fixed(-0.001, 2), "0.00");
        assert_eq!(number(1.5e12), "1.50e12");
        assert_eq!(quantity(49.238, Some("s")), "49.24 s");
        let at_most = |value| [Bound::AtMost { value }];
        assert_eq!(beside(1.0, &at_most(1.0), Some("m")), "1 m");
        assert_eq!(beside(1.000_000_000_000_000_2, &at_most(1.0), Some("m")), "1.0000000000000002 m");
        assert_eq!(beside(0.999_999_999, &[Bound::AtLeast { value: 1.0 }], None), "0.999999999");
        assert_eq!(beside(0.999_5, &[Bound::AtLeast { value: 1.0 }], None), "0.9995");
        assert_eq!(beside(6.4e-14, &at_most(0.0), None), "6.40e-14");
        assert_eq!(bound(Bound::Within { low: 1.0, high: 40.0 }, None), "1…40");
    }

    #[test]
    fn exact_numbers_are_told_from_all_others() {
        assert_eq!(
            [18.0, -0.0, 0.1 + 0.2, 1e-7, 1e300].map(exact),
            ["18", "0", "0.30000000000000004", "1e-7", "1e300"]
        );
        assert_eq!(exact_bound(Bound::Equal { value: 49.238_12f64.next_up() }, Some("s")), "= 49.23812000000001 s");
        assert_eq!(exact_bound(Bound::Within { low: 1.0, high: 40.0 }, None), "1…40");
    }

    #[test]
    fn a_range_that_is_written_with_one_number_is_one_number() {
        let offset = Parameter {
            name: "offset".to_owned(),
            unit: Some("rad".to_owned()),
            domain: Domain::Number { low: -1.0, high: 1.0, shape: ChoiceKind::Range, integer: false },
        };
        let kind = OperationKind::RandomValue { mode: ValueMode::Offset, integer: false };
        let written = |low, high| choice(&kind, &offset, &Choice::Range { low, high });
        assert_eq!(written(-0.25, 0.3), "offset -0.25…0.30 rad");
        assert_eq!(written(0.3, 0.3), "offset 0.3 rad");
        assert_eq!(written(0.249_99, 0.250_01), "offset 0.250 rad");
        assert_eq!(written(-0.0, 0.0), "offset 0 rad");
    }

    #[test]
    fn words_are_joined_as_in_a_sentence() {
        let words = ["a", "b", "c"].map(str::to_owned);
        assert_eq!(join_words(&words[..0]), "");
        assert_eq!(join_words(&words[..1]), "a");
        assert_eq!(join_words(&words), "a, b and c");
        assert_eq!(
            (plural(1, "crash", "crashes"), plural(0, "crash", "crashes")),
            ("1 crash".into(), "0 crashes".into())
        );
    }
}
