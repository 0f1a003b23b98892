//! Numbers: their digits read back as exactly the same number.

/// The shortest decimal that reads back as this number, with the point moved right by `shift` digits.
pub(crate) fn decimal(x: f64, shift: i32) -> String {
    // The shortest digits that identify the number, as `d.ddde-x`.
    let scientific = format!("{:e}", x + 0.0);
    let (mantissa, exponent) = scientific.split_once('e').expect("a number in scientific notation has an exponent");
    let exponent = exponent.parse::<i32>().expect("an exponent is a small whole number") + shift;
    let (sign, mantissa) = mantissa.strip_prefix('-').map_or(("", mantissa), |mantissa| ("-", mantissa));
    let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
    if !(-6..=15).contains(&exponent) && x != 0.0 {
        let (first, rest) = digits.split_at(1);
        let point = if rest.is_empty() { "" } else { "." };
        return format!("{sign}{first}{point}{rest}e{exponent}");
    }
    let whole = usize::try_from(exponent + 1).unwrap_or(0);
    if whole == 0 {
        let zeros = "0".repeat(usize::try_from(-exponent - 1).unwrap_or(0));
        return format!("{sign}0.{zeros}{digits}");
    }
    if digits.len() <= whole {
        let zeros = if x == 0.0 { String::new() } else { "0".repeat(whole - digits.len()) };
        let digits = if x == 0.0 { "0" } else { &digits };
        return format!("{sign}{digits}{zeros}");
    }
    let (whole, fraction) = digits.split_at(whole);
    format!("{sign}{whole}.{fraction}")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn numbers_are_written_as_people_write_them() {
        let written = [0.0, -0.0, 18.0, -0.27, 100.0, 1e15, 1e16, 0.1 + 0.2, 1.5e-6, 1.5e-7].map(|x| decimal(x, 0));
        assert_eq!(
            written,
            ["0", "0", "18", "-0.27", "100", "1000000000000000", "1e16", "0.30000000000000004", "0.0000015", "1.5e-7"]
        );
        assert_eq!([0.0, 1.0, 0.4, 0.123, 0.07, 1e-9].map(|x| decimal(x, 2)), ["0", "100", "40", "12.3", "7", "1e-7"]);
    }

    proptest! {
        #[test]
        fn every_number_reads_back_as_it_was(bits in any::<u64>(), unit in 0.0..=1.0f64) {
            for x in [f64::from_bits(bits), unit].into_iter().filter(|x| x.is_finite()) {
                let written = decimal(x, 0);
                prop_assert_eq!(written.parse::<f64>().unwrap(), x);
                let digits = written.strip_prefix('-').unwrap_or(&written);
                prop_assert!(digits.starts_with(|c: char| c.is_ascii_digit()) && !digits.contains(".e"), "{}", written);
            }
            let (digits, exponent) = decimal(unit, 2).split_once('e').map_or_else(
                || (decimal(unit, 2), -2),
                |(digits, exponent)| (digits.to_owned(), exponent.parse::<i32>().unwrap() - 2),
            );
            prop_assert_eq!(format!("{digits}e{exponent}").parse::<f64>().unwrap(), unit);
        }
    }
}
