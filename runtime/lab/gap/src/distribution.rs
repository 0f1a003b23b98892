//! The normal, Student's t, chi and F distributions.
//!
//! Each tail is computed directly, so a small p value is not what rounding leaves of 1. Below them is libm alone, so
//! the results have the same bits on every machine.

/// The probability that a standard normal number is at most `z`.
pub fn normal_cdf(z: f64) -> f64 {
    0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}

/// The standard normal quantile of a probability in `0..=1`; infinite at its ends.
pub fn normal_quantile(p: f64) -> f64 {
    assert!((0.0..=1.0).contains(&p), "a quantile is that of a probability");
    if p == 0.0 || p == 1.0 {
        return if p == 0.0 { f64::NEG_INFINITY } else { f64::INFINITY };
    }
    // The quantile in the lower half, where the tail keeps its digits.
    let tail = p.min(1.0 - p);
    let z = inverse(|z| normal_cdf(-z), tail);
    if p < 0.5 { -z } else { z }
}

/// The probability that a number of Student's t distribution is greater than `t`, which may be infinite. There are
/// `degrees` of freedom, above 0.
pub fn student_tail(t: f64, degrees: f64) -> f64 {
    assert!(degrees > 0.0 && !t.is_nan(), "Student's t distribution has degrees of freedom");
    // Beyond this the two distributions differ by less than one part in ten million where tails are above 10⁻⁶.
    if degrees > 1e7 {
        return normal_cdf(-t);
    }
    let square = t * t;
    // Near 0 the share of the square keeps its digits, elsewhere the tail does.
    let tail = if square < 1.0 {
        0.5 - 0.5 * incomplete_beta(square / (degrees + square), 0.5, degrees / 2.0)
    } else {
        0.5 * incomplete_beta(degrees / (degrees + square), degrees / 2.0, 0.5)
    };
    if t >= 0.0 { tail } else { 1.0 - tail }
}

/// The quantile of Student's t distribution of a probability in `0.5..1`.
pub fn student_quantile(p: f64, degrees: f64) -> f64 {
    assert!((0.5..1.0).contains(&p), "a quantile of the upper half is asked for");
    inverse(|t| student_tail(t, degrees), 1.0 - p)
}

/// The density at `x` of the square root of a chi-squared number divided by its degrees of freedom: of a standard
/// deviation, as a multiple of the true one.
pub fn deviation_density(x: f64, degrees: f64) -> f64 {
    if x <= 0.0 {
        return if degrees > 1.0 { 0.0 } else { 2.0 * INVERSE_ROOT_OF_TAU };
    }
    let half = degrees / 2.0;
    let log = half * libm::log(half) - libm::lgamma(half) + (degrees - 1.0) * libm::log(x) - half * x * x;
    2.0 * libm::exp(log)
}

const INVERSE_ROOT_OF_TAU: f64 = 0.398_942_280_401_432_7;

/// The probability that a number of the F distribution is greater than `f`, from 0 on.
pub fn f_tail(f: f64, numerator: f64, denominator: f64) -> f64 {
    incomplete_beta(denominator / (denominator + numerator * f), denominator / 2.0, numerator / 2.0)
}

/// The regularised incomplete beta function of `x` in `0..=1`, by the continued fraction 8.17.22 of the Digital Library
/// of Mathematical Functions, with Lentz's method. Its number of terms grows like the root of the parameters.
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    // On the other side of the middle the fraction of the complement has fewer terms.
    let value = if x > (a + 1.0) / (a + b + 2.0) { 1.0 - beta_fraction(1.0 - x, b, a) } else { beta_fraction(x, a, b) };
    value.clamp(0.0, 1.0)
}

/// The same by the fraction itself, for `x` inside `0..1`.
fn beta_fraction(x: f64, a: f64, b: f64) -> f64 {
    let log = libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * libm::log(x) + b * libm::log1p(-x);
    let away_from_0 = |x: f64| if x.abs() < 1e-300 { 1e-300 } else { x };
    let mut numerator = 1.0;
    let mut denominator = 1.0 / away_from_0(1.0 - (a + b) * x / (a + 1.0));
    let mut fraction = denominator;
    for term in 1..MOST_TERMS {
        let m = f64::from(term);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let before = fraction;
        for coefficient in [even, odd] {
            denominator = 1.0 / away_from_0(1.0 + coefficient * denominator);
            numerator = away_from_0(1.0 + coefficient / numerator);
            fraction *= denominator * numerator;
        }
        if (fraction - before).abs() <= 1e-16 * fraction.abs() {
            break;
        }
    }
    libm::exp(log) * fraction / a
}

/// More than are needed with ten million degrees of freedom.
const MOST_TERMS: u32 = 100_000;

/// Where a tail, which falls from 0 on, is `p`, from above 0 to its value at 0.
fn inverse(tail: impl Fn(f64) -> f64, p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while tail(high) > p && high < 1e300 {
        (low, high) = (high, 2.0 * high);
    }
    // Halving needs no derivative and ends at the last bit; a tail costs less than a microsecond.
    loop {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            return middle;
        }
        if tail(middle) > p {
            low = middle;
        } else {
            high = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn close(ours: f64, exact: f64) {
        assert!((ours - exact).abs() <= 1e-11 * exact.abs(), "{ours} and {exact}");
    }

    #[test]
    fn tails_and_quantiles_are_those_of_tables() {
        close(normal_cdf(1.959_963_984_540_054), 0.975);
        close(normal_quantile(0.975), 1.959_963_984_540_054);
        close(normal_quantile(1e-10), -6.361_340_902_404_056);
        // With one degree of freedom it is Cauchy's distribution, with two it is algebraic.
        close(student_tail(1.0, 1.0), 0.25);
        close(student_tail(3.0, 2.0), 0.5 - 3.0 / (2.0 * libm::sqrt(11.0)));
        close(student_quantile(0.975, 10.0), 2.228_138_851_986_274);
        close(student_quantile(0.95, 4.0), 2.131_846_786_326_649);
        close(student_tail(40.0, 30.0), 6.863_022_597_203_209e-28);
        // The square of a t number.
        close(f_tail(4.0, 1.0, 7.0), 2.0 * student_tail(2.0, 7.0));
        assert_eq!(student_tail(f64::INFINITY, 3.0), 0.0);
        assert_eq!(student_tail(0.0, 3.0), 0.5);
    }

    #[test]
    fn the_density_of_a_deviation_is_one_density() {
        for degrees in [1.0, 1.7, 4.0, 30.0, 5000.0] {
            let total: f64 = (0..40_000).map(|i| deviation_density((f64::from(i) + 0.5) * 2e-4, degrees) * 2e-4).sum();
            assert!((total - 1.0).abs() < 1e-4, "{total} of {degrees}");
        }
    }

    #[test]
    fn a_beta_function_with_a_whole_parameter_is_a_sum_of_binomial_terms() {
        // The probability of two or more heads of five: I(2, 4) at one half is 26/32.
        close(incomplete_beta(0.5, 2.0, 4.0), 26.0 / 32.0);
        close(incomplete_beta(0.3, 1.0, 1.0), 0.3);
        close(incomplete_beta(0.999, 400.0, 1.0), libm::pow(0.999, 400.0));
        assert_eq!([0.0, 1.0].map(|x| incomplete_beta(x, 2.0, 3.0)), [0.0, 1.0]);
    }

    #[test]
    fn a_great_many_degrees_of_freedom_are_those_of_a_normal_number() {
        let (before, after) = (student_tail(2.0, 1e7), student_tail(2.0, 1.000_001e7));
        assert!((before - after).abs() < 1e-7 && after == normal_cdf(-2.0), "{before} {after}");
    }

    proptest! {
        #[test]
        fn quantiles_invert_tails(p in 0.5..0.999_999f64, degrees in 1.0..500.0f64) {
            prop_assert!((student_tail(student_quantile(p, degrees), degrees) - (1.0 - p)).abs() < 1e-12);
            prop_assert!((normal_cdf(normal_quantile(p)) - p).abs() < 1e-14);
            prop_assert_eq!(normal_quantile(p), -normal_quantile(1.0 - p));
        }
    }
}
