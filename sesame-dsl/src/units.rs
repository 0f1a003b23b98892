//! Units of measurement: dimensions, exact scales, conversion.
//!
//! A scale is a ratio of whole numbers times a power of π, so `150mm` is exactly `0.15m`. Converting a number to
//! another unit of the same dimension and back changes it by at most the rounding of two divisions. Angle is a
//! dimension of its own: `rad/s` is not `Hz`.

/// The exponents of the base dimensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Dimension {
    /// Exponents of length, time, mass, angle, current, temperature, luminous intensity.
    exponents: [i8; 7],
}

/// The base units' symbols, in the order of [`Dimension`]'s exponents.
const BASE: [&str; 7] = ["m", "s", "kg", "rad", "A", "K", "cd"];

impl Dimension {
    const fn of(exponents: [i8; 7]) -> Self {
        Dimension { exponents }
    }

    /// The dimension of a plain number.
    pub const NONE: Dimension = Dimension::of([0; 7]);
    /// The dimension of time.
    pub const TIME: Dimension = Dimension::of([0, 1, 0, 0, 0, 0, 0]);
    /// The dimension of angles.
    pub const ANGLE: Dimension = ANGLE;

    fn times(self, other: Dimension, power: i8) -> Option<Dimension> {
        let mut exponents = [0; 7];
        for (index, exponent) in exponents.iter_mut().enumerate() {
            *exponent = self.exponents[index].checked_add(other.exponents[index].checked_mul(power)?)?;
        }
        Some(Dimension { exponents })
    }

    /// Its name with an article, such as `a length`; its base units if it has no common name.
    pub fn name(self) -> String {
        if let Some((name, _)) = NAMES.iter().find(|(_, dimension)| *dimension == self) {
            return (*name).to_owned();
        }
        let factors: Vec<String> = BASE
            .iter()
            .zip(self.exponents)
            .filter(|&(_, exponent)| exponent != 0)
            .map(|(base, exponent)| if exponent == 1 { (*base).to_owned() } else { format!("{base}^{exponent}") })
            .collect();
        format!("a quantity of dimension {}", factors.join("*"))
    }
}

//                                         m   s  kg rad   A   K  cd
const LENGTH: Dimension = Dimension::of([1, 0, 0, 0, 0, 0, 0]);
const MASS: Dimension = Dimension::of([0, 0, 1, 0, 0, 0, 0]);
const ANGLE: Dimension = Dimension::of([0, 0, 0, 1, 0, 0, 0]);
const CURRENT: Dimension = Dimension::of([0, 0, 0, 0, 1, 0, 0]);
const TEMPERATURE: Dimension = Dimension::of([0, 0, 0, 0, 0, 1, 0]);
const ILLUMINANCE: Dimension = Dimension::of([-2, 0, 0, 0, 0, 0, 1]);
const FREQUENCY: Dimension = Dimension::of([0, -1, 0, 0, 0, 0, 0]);
const ANGULAR_SPEED: Dimension = Dimension::of([0, -1, 0, 1, 0, 0, 0]);
const FORCE: Dimension = Dimension::of([1, -2, 1, 0, 0, 0, 0]);
const TORQUE: Dimension = Dimension::of([2, -2, 1, 0, 0, 0, 0]);
const POWER: Dimension = Dimension::of([2, -3, 1, 0, 0, 0, 0]);
const PRESSURE: Dimension = Dimension::of([-1, -2, 1, 0, 0, 0, 0]);
const VOLTAGE: Dimension = Dimension::of([2, -3, 1, 0, -1, 0, 0]);

const NAMES: &[(&str, Dimension)] = &[
    ("a plain number", Dimension::NONE),
    ("a time", Dimension::TIME),
    ("a length", LENGTH),
    ("a mass", MASS),
    ("an angle", ANGLE),
    ("a current", CURRENT),
    ("a temperature", TEMPERATURE),
    ("an illuminance", ILLUMINANCE),
    ("a frequency", FREQUENCY),
    ("an angular speed", ANGULAR_SPEED),
    ("an angular acceleration", Dimension::of([0, -2, 0, 1, 0, 0, 0])),
    ("a speed", Dimension::of([1, -1, 0, 0, 0, 0, 0])),
    ("an acceleration", Dimension::of([1, -2, 0, 0, 0, 0, 0])),
    ("an area", Dimension::of([2, 0, 0, 0, 0, 0, 0])),
    ("a volume", Dimension::of([3, 0, 0, 0, 0, 0, 0])),
    ("a force", FORCE),
    ("a torque", TORQUE),
    ("a power", POWER),
    ("a pressure", PRESSURE),
    ("a voltage", VOLTAGE),
];

/// How many base units one unit is: `numerator / denominator * π^pi`, in lowest terms, both positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Scale {
    numerator: u128,
    denominator: u128,
    pi: i8,
}

impl Scale {
    const ONE: Scale = Scale { numerator: 1, denominator: 1, pi: 0 };

    fn times(self, other: Scale) -> Option<Scale> {
        // Crosswise reduction first, so that products of reduced ratios overflow only if the result does.
        let left = gcd(self.numerator, other.denominator);
        let right = gcd(other.numerator, self.denominator);
        Some(Scale {
            numerator: (self.numerator / left).checked_mul(other.numerator / right)?,
            denominator: (self.denominator / right).checked_mul(other.denominator / left)?,
            pi: self.pi.checked_add(other.pi)?,
        })
    }

    fn inverse(self) -> Scale {
        Scale { numerator: self.denominator, denominator: self.numerator, pi: -self.pi }
    }

    fn power(self, exponent: i8) -> Option<Scale> {
        let base = if exponent < 0 { self.inverse() } else { self };
        (0..exponent.unsigned_abs()).try_fold(Scale::ONE, |product, _| product.times(base))
    }

    fn apply(self, value: f64) -> f64 {
        let scaled = value * (self.numerator as f64) / (self.denominator as f64);
        (0..self.pi.unsigned_abs()).fold(scaled, |scaled, _| {
            if self.pi > 0 { scaled * std::f64::consts::PI } else { scaled / std::f64::consts::PI }
        })
    }
}

fn gcd(a: u128, b: u128) -> u128 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// A unit as written, with its dimension and scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    text: String,
    dimension: Dimension,
    scale: Scale,
}

/// Why a text is not a unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UnitError {
    /// No unit has this symbol.
    Unknown {
        /// The symbol.
        symbol: String,
        /// Known symbols that look like it, best first.
        similar: Vec<&'static str>,
    },
    /// The product of its parts cannot be represented.
    TooLarge,
}

impl Unit {
    /// The second, the unit of all times in models.
    pub fn seconds() -> Unit {
        Unit { text: "s".to_owned(), dimension: Dimension::TIME, scale: Scale::ONE }
    }

    /// The radian, the unit of angles that functions compute.
    pub fn radians() -> Unit {
        Unit { text: "rad".to_owned(), dimension: ANGLE, scale: Scale::ONE }
    }

    /// The whole turn.
    pub fn revolutions() -> Unit {
        Unit { text: "rev".to_owned(), dimension: ANGLE, scale: Scale { numerator: 2, denominator: 1, pi: 1 } }
    }

    /// Reads a unit: symbols with optional powers, joined by `*` and `/`, for example `m/s^2`.
    pub fn parse(text: &str) -> Result<Unit, UnitError> {
        let mut dimension = Dimension::NONE;
        let mut scale = Scale::ONE;
        let mut sign = 1;
        let mut rest = text;
        loop {
            let end = rest.find(['*', '/']).unwrap_or(rest.len());
            let (symbol, power) = match rest[..end].split_once('^') {
                Some((symbol, power)) => (symbol, power.parse::<i8>().map_err(|_| UnitError::TooLarge)?),
                None => (&rest[..end], 1),
            };
            let unit = UNITS
                .iter()
                .find(|unit| unit.0 == symbol)
                .ok_or_else(|| UnitError::Unknown { symbol: symbol.to_owned(), similar: similar_symbols(symbol) })?;
            let power: i8 = power * sign;
            let factor = Scale { numerator: unit.2, denominator: unit.3, pi: unit.4 };
            let product = factor.power(power).and_then(|factor| scale.times(factor));
            scale = product.ok_or(UnitError::TooLarge)?;
            dimension = dimension.times(unit.1, power).ok_or(UnitError::TooLarge)?;
            match rest[end..].chars().next() {
                None => return Ok(Unit { text: text.to_owned(), dimension, scale }),
                Some(operator) => sign = if operator == '/' { -1 } else { 1 },
            }
            rest = &rest[end + 1..];
        }
    }

    /// The unit as it was written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Its symbols with their powers.
    fn factors(&self) -> impl Iterator<Item = (&str, i8)> {
        let mut rest = Some((self.text.as_str(), 1));
        std::iter::from_fn(move || {
            let (text, sign) = rest?;
            let end = text.find(['*', '/']).unwrap_or(text.len());
            rest = text.get(end + 1..).map(|after| (after, if text[end..].starts_with('/') { -1 } else { 1 }));
            Some(match text[..end].split_once('^') {
                Some((symbol, power)) => (symbol, power.parse::<i8>().map_or(sign, |power| power * sign)),
                None => (&text[..end], sign),
            })
        })
    }

    /// Its dimension.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// A value in this unit, as a value in another of the same dimension.
    pub fn convert(&self, value: f64, to: &Unit) -> f64 {
        convert(value, Some(self), Some(to))
    }
}

/// Converts a value to another unit of the same dimension; no unit is a plain number. In its own unit a value stays the
/// same, bit for bit.
pub fn convert(value: f64, from: Option<&Unit>, to: Option<&Unit>) -> f64 {
    debug_assert_eq!(dimension(from), dimension(to), "conversion is between units of one dimension");
    let [from, to] = [from, to].map(|unit| unit.map_or(Scale::ONE, |unit| unit.scale));
    match from.times(to.inverse()) {
        _ if from == to => value,
        Some(scale) => scale.apply(value),
        // Beyond 38 digits the two halves are applied one after the other.
        None => to.inverse().apply(from.apply(value)),
    }
}

/// The unit of a product or quotient, and the factor that its value is multiplied by. Symbols that occur on both sides
/// cancel; without a dimension the result is a plain number. `None` if it cannot be represented.
pub fn product(left: Option<&Unit>, right: Option<&Unit>, divide: bool) -> Option<(Option<Unit>, f64)> {
    let mut scale = 1.0;
    let mut powers: Vec<(&str, i8)> = Vec::new();
    for (unit, sign) in [(left, 1), (right, if divide { -1 } else { 1 })] {
        let Some(unit) = unit else { continue };
        if unit.dimension == Dimension::NONE {
            let plain = convert(1.0, Some(unit), None);
            scale = if sign > 0 { scale * plain } else { scale / plain };
            continue;
        }
        for (symbol, power) in unit.factors() {
            let power = power.checked_mul(sign)?;
            match powers.iter_mut().find(|(known, _)| *known == symbol) {
                Some((_, known)) => *known = known.checked_add(power)?,
                None => powers.push((symbol, power)),
            }
        }
    }
    powers.retain(|&(_, power)| power != 0);
    if powers.is_empty() {
        return Some((None, scale));
    }
    let unit = Unit::parse(&joined(powers)?).ok()?;
    if unit.dimension == Dimension::NONE {
        return Some((None, scale * convert(1.0, Some(&unit), None)));
    }
    Some((Some(unit), scale))
}

/// The unit of a square root, and the factor that the number under the root is multiplied by before. `None` if the
/// dimension is not that of a square.
pub fn square_root(unit: Option<&Unit>) -> Option<(Option<Unit>, f64)> {
    let Some(unit) = unit.filter(|unit| unit.dimension != Dimension::NONE) else {
        return Some((None, convert(1.0, unit, None)));
    };
    let mut powers: Vec<(&str, i8)> = Vec::new();
    for (symbol, power) in unit.factors() {
        match powers.iter_mut().find(|(known, _)| *known == symbol) {
            Some((_, known)) => *known = known.checked_add(power)?,
            None => powers.push((symbol, power)),
        }
    }
    // No symbol has a root of `m*mm`, but in base units it is `m^2`.
    if powers.iter().any(|(_, power)| power % 2 != 0) {
        powers = BASE.into_iter().zip(unit.dimension.exponents).collect();
    }
    if powers.iter().any(|(_, power)| power % 2 != 0) {
        return None;
    }
    let halves = powers.into_iter().filter(|&(_, power)| power != 0).map(|(symbol, power)| (symbol, power / 2));
    let root = Unit::parse(&joined(halves.collect())?).ok()?;
    let (square, _) = product(Some(&root), Some(&root), false)?;
    Some((Some(root), convert(1.0, Some(unit), square.as_ref())))
}

/// Symbols with their powers, none of which is 0, as the text of a unit.
fn joined(mut powers: Vec<(&str, i8)>) -> Option<String> {
    // Factors come before divisors: a unit does not begin with `/`.
    powers.sort_by_key(|&(_, power)| power < 0);
    let mut text = String::new();
    for (symbol, power) in powers {
        let (sign, power) = match (text.is_empty(), power < 0) {
            (true, _) => ("", power),
            (false, false) => ("*", power),
            (false, true) => ("/", power.checked_neg()?),
        };
        text.extend([sign, symbol]);
        if power != 1 {
            text.extend(["^", &power.to_string()]);
        }
    }
    Some(text)
}

/// The dimension of a unit; no unit is a plain number.
pub fn dimension(unit: Option<&Unit>) -> Dimension {
    unit.map_or(Dimension::NONE, Unit::dimension)
}

/// All symbols, for completion and for documentation.
pub fn symbols() -> impl Iterator<Item = &'static str> {
    UNITS.iter().map(|unit| unit.0)
}

fn similar_symbols(symbol: &str) -> Vec<&'static str> {
    if let Some((_, meant)) = SPELT_OUT.iter().find(|(words, _)| words.contains(&symbol.to_ascii_lowercase().as_str()))
    {
        return vec![meant];
    }
    let same_but_case: Vec<_> = symbols().filter(|known| known.eq_ignore_ascii_case(symbol)).collect();
    if !same_but_case.is_empty() {
        return same_but_case;
    }
    // Symbols are short: one edit is already a different unit for the shortest.
    symbols().filter(|known| known.len() > 1 && strsim::osa_distance(known, symbol) == 1).take(3).collect()
}

/// Common spellings, and the symbols they stand for.
const SPELT_OUT: &[(&[&str], &str)] = &[
    (&["sec", "secs", "second", "seconds"], "s"),
    (&["msec", "millis", "millisecond", "milliseconds"], "ms"),
    (&["usec", "micros", "microsecond", "microseconds", "µs", "μs"], "us"),
    (&["µm", "μm"], "um"),
    (&["minute", "minutes", "mins"], "min"),
    (&["hour", "hours", "hr"], "h"),
    (&["degree", "degrees", "grad"], "deg"),
    (&["radian", "radians"], "rad"),
    (&["meter", "meters", "metre", "metres"], "m"),
    (&["percent"], "%"),
    (&["newton", "newtons"], "N"),
    (&["volt", "volts"], "V"),
    (&["hertz"], "Hz"),
    (&["kelvin"], "K"),
    (&["mps"], "m/s"),
    (&["kmh", "kph"], "km/h"),
];

/// Symbol, dimension, numerator, denominator, power of π.
type Row = (&'static str, Dimension, u128, u128, i8);

const UNITS: &[Row] = &[
    ("ns", Dimension::TIME, 1, 1_000_000_000, 0),
    ("us", Dimension::TIME, 1, 1_000_000, 0),
    ("ms", Dimension::TIME, 1, 1_000, 0),
    ("s", Dimension::TIME, 1, 1, 0),
    ("min", Dimension::TIME, 60, 1, 0),
    ("h", Dimension::TIME, 3_600, 1, 0),
    ("um", LENGTH, 1, 1_000_000, 0),
    ("mm", LENGTH, 1, 1_000, 0),
    ("cm", LENGTH, 1, 100, 0),
    ("dm", LENGTH, 1, 10, 0),
    ("m", LENGTH, 1, 1, 0),
    ("km", LENGTH, 1_000, 1, 0),
    ("mrad", ANGLE, 1, 1_000, 0),
    ("rad", ANGLE, 1, 1, 0),
    ("deg", ANGLE, 1, 180, 1),
    ("rev", ANGLE, 2, 1, 1),
    ("rpm", ANGULAR_SPEED, 1, 30, 1),
    ("mg", MASS, 1, 1_000_000, 0),
    ("g", MASS, 1, 1_000, 0),
    ("kg", MASS, 1, 1, 0),
    ("t", MASS, 1_000, 1, 0),
    ("mN", FORCE, 1, 1_000, 0),
    ("N", FORCE, 1, 1, 0),
    ("kN", FORCE, 1_000, 1, 0),
    ("mNm", TORQUE, 1, 1_000, 0),
    ("Nm", TORQUE, 1, 1, 0),
    ("kNm", TORQUE, 1_000, 1, 0),
    ("J", TORQUE, 1, 1, 0),
    ("kJ", TORQUE, 1_000, 1, 0),
    ("mW", POWER, 1, 1_000, 0),
    ("W", POWER, 1, 1, 0),
    ("kW", POWER, 1_000, 1, 0),
    ("Pa", PRESSURE, 1, 1, 0),
    ("hPa", PRESSURE, 100, 1, 0),
    ("mbar", PRESSURE, 100, 1, 0),
    ("kPa", PRESSURE, 1_000, 1, 0),
    ("bar", PRESSURE, 100_000, 1, 0),
    ("MPa", PRESSURE, 1_000_000, 1, 0),
    ("mV", VOLTAGE, 1, 1_000, 0),
    ("V", VOLTAGE, 1, 1, 0),
    ("kV", VOLTAGE, 1_000, 1, 0),
    ("mA", CURRENT, 1, 1_000, 0),
    ("A", CURRENT, 1, 1, 0),
    ("Hz", FREQUENCY, 1, 1, 0),
    ("kHz", FREQUENCY, 1_000, 1, 0),
    ("MHz", FREQUENCY, 1_000_000, 1, 0),
    ("K", TEMPERATURE, 1, 1, 0),
    ("lx", ILLUMINANCE, 1, 1, 0),
    ("%", Dimension::NONE, 1, 100, 0),
];

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn unit(text: &str) -> Unit {
        Unit::parse(text).unwrap()
    }

    #[test]
    fn conversion_is_exact_where_decimals_are() {
        assert_eq!(unit("mm").convert(150.0, &unit("m")), 0.15);
        assert_eq!(unit("m").convert(0.3, &unit("mm")), 300.0);
        assert_eq!(unit("min").convert(2.0, &unit("s")), 120.0);
        assert_eq!(unit("km/h").convert(9.0, &unit("m/s")), 2.5);
        assert_eq!(unit("bar").convert(4.0, &unit("kPa")), 400.0);
        assert_eq!(convert(40.0, Some(&unit("%")), None), 0.4);
        assert_eq!(convert(0.4, None, Some(&unit("%"))), 40.0);
    }

    #[test]
    fn degrees_and_radians_are_both_angles() {
        assert_eq!(unit("deg").convert(180.0, &unit("rad")), std::f64::consts::PI);
        assert_eq!(unit("rad").convert(std::f64::consts::PI, &unit("deg")), 180.0);
        assert_eq!(unit("rpm").convert(30.0, &unit("rad/s")), std::f64::consts::PI);
        assert_eq!(unit("rev/min").convert(1.0, &unit("deg/s")), 6.0);
    }

    #[test]
    fn compound_units_have_the_dimension_of_their_product() {
        assert_eq!(unit("kg*m/s^2").dimension(), unit("N").dimension());
        assert_eq!(unit("N*m").dimension(), unit("Nm").dimension());
        assert_eq!(unit("N/m^2").dimension(), unit("Pa").dimension());
        assert_eq!(unit("W/A").dimension(), unit("V").dimension());
        assert_ne!(unit("rad/s").dimension(), unit("Hz").dimension());
        assert_eq!(unit("m/s").dimension().name(), "a speed");
        assert_eq!(unit("kg*m").dimension().name(), "a quantity of dimension m*kg");
    }

    #[test]
    fn a_wrong_symbol_names_the_likely_one() {
        let similar = |text: &str| match Unit::parse(text) {
            Err(UnitError::Unknown { similar, .. }) => similar,
            other => panic!("{text}: {other:?}"),
        };
        assert_eq!(similar("sec"), ["s"]);
        assert_eq!(similar("MM"), ["mm"]);
        assert_eq!(similar("m/sec"), ["s"]);
        assert_eq!(similar("radd"), ["rad"]);
        assert!(similar("parsec").is_empty());
    }

    #[test]
    fn units_beyond_representation_are_refused() {
        assert_eq!(Unit::parse("km^99"), Err(UnitError::TooLarge));
        assert_eq!(Unit::parse("km^1000"), Err(UnitError::TooLarge));
        assert!(Unit::parse("km^9").is_ok());
    }

    fn product_of(left: &str, right: &str, divide: bool) -> (Option<String>, f64) {
        let [left, right] = [left, right].map(|text| (!text.is_empty()).then(|| unit(text)));
        let (unit, scale) = product(left.as_ref(), right.as_ref(), divide).unwrap();
        (unit.map(|unit| unit.text().to_owned()), scale)
    }

    #[test]
    fn units_of_products_cancel_and_what_is_left_is_a_unit_or_a_plain_number() {
        assert_eq!(product_of("rad", "rad", true), (None, 1.0));
        assert_eq!(product_of("mm", "m", true), (None, 0.001));
        assert_eq!(product_of("m", "s", true), (Some("m/s".to_owned()), 1.0));
        assert_eq!(product_of("m/s", "s", false), (Some("m".to_owned()), 1.0));
        assert_eq!(product_of("m/s", "s", true), (Some("m/s^2".to_owned()), 1.0));
        assert_eq!(product_of("m", "m", false), (Some("m^2".to_owned()), 1.0));
        assert_eq!(product_of("", "s", true), (Some("s^-1".to_owned()), 1.0));
        assert_eq!(product_of("m", "", false), (Some("m".to_owned()), 1.0));
        assert_eq!(product_of("m", "%", false), (Some("m".to_owned()), 0.01));
        assert_eq!(product_of("m", "%", true), (Some("m".to_owned()), 100.0));
        assert_eq!(product(Some(&unit("m^127")), Some(&unit("m")), false), None);
    }

    #[test]
    fn roots_are_in_the_unit_whose_square_is_meant() {
        let root_of = |text: &str| {
            let unit = Unit::parse(text).ok();
            square_root(unit.as_ref()).map(|(root, factor)| (root.map(|root| root.text().to_owned()), factor))
        };
        let in_unit = |text: &str, factor| Some((Some(text.to_owned()), factor));
        assert_eq!(root_of("m^2"), in_unit("m", 1.0));
        assert_eq!(root_of("m*m"), in_unit("m", 1.0));
        assert_eq!(root_of("mm^2/s^2"), in_unit("mm/s", 1.0));
        assert_eq!(root_of("m*mm"), in_unit("m", 0.001));
        assert_eq!(root_of("s^-2"), in_unit("s^-1", 1.0));
        assert_eq!(root_of("%"), Some((None, 0.01)));
        assert_eq!(square_root(None), Some((None, 1.0)));
        for text in ["m", "m^3", "m^2/s", "s^-1"] {
            assert_eq!(root_of(text), None, "{text}");
        }
    }

    /// The oracle: scales as plain floats, multiplied up from the table without any reduction.
    fn naive_scale(text: &str) -> f64 {
        let mut scale = 1.0;
        for (position, part) in text.split('/').enumerate() {
            let row = UNITS.iter().find(|row| row.0 == part).unwrap();
            let factor = row.2 as f64 / row.3 as f64 * std::f64::consts::PI.powi(i32::from(row.4));
            scale = if position == 0 { scale * factor } else { scale / factor };
        }
        scale
    }

    proptest! {
        #[test]
        fn a_product_means_what_the_product_of_its_scales_does(
            left in 0..UNITS.len(), right in 0..UNITS.len(), divide: bool,
        ) {
            let [left, right] = [left, right].map(|at| UNITS[at].0);
            let (unit, scale) = product_of(left, right, divide);
            let [left, right] = [left, right].map(naive_scale);
            let naive = if divide { left / right } else { left * right };
            // A unit's own scale is that of the parser, which other tests compare with the table.
            let own = unit.map_or(1.0, |text| Unit::parse(&text).unwrap().scale.apply(1.0));
            prop_assert!((own * scale / naive - 1.0).abs() < 1e-12, "{own} * {scale} is not {naive}");
        }

        #[test]
        fn every_unit_converts_to_its_siblings_and_back(
            from in 0..UNITS.len(), to: prop::sample::Index, per in 0..UNITS.len(), value in -1e9..1e9f64,
        ) {
            let siblings: Vec<&Row> = UNITS.iter().filter(|row| row.1 == UNITS[from].1).collect();
            let per = UNITS[per].0;
            let names = [format!("{}/{per}", UNITS[from].0), format!("{}/{per}", to.get(&siblings).0)];
            let [from, to] = [unit(&names[0]), unit(&names[1])];
            let there = from.convert(value, &to);
            let back = to.convert(there, &from);
            prop_assert!((back - value).abs() <= value.abs() * 1e-14, "{value} -> {there} -> {back}");
            let naive = value * naive_scale(&names[0]) / naive_scale(&names[1]);
            prop_assert!((there - naive).abs() <= naive.abs() * 1e-13, "{there} against {naive}");
        }
    }
}
