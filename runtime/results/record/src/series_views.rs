//! The views that decode packed series in SQL.

use std::fmt::Write as _;

/// The views that show series point by point, in any SQLite client: doubles are computed from their digits.
pub(super) fn views() -> String {
    let points =
        "-- Time series as change points, one row each: a value holds until the next one. Ask for a test at a time.";
    let named = "-- Time series with the names of their metrics.";
    of_pieces("series_pieces", ("change_points", points), ("series", named))
}

/// The same of robustness signals.
pub(super) fn robustness_views() -> String {
    let points =
        "-- Robustness over time, one row per change: a value holds until the next one. Ask for a test at a time.";
    let named = "-- Robustness over time with the names of its metrics.";
    of_pieces("robustness_pieces", ("robustness_points", points), ("robustness", named))
}

/// A view of the points of a table of pieces, and one with names of metrics, each after a comment.
fn of_pieces(pieces: &str, (points, about_points): (&str, &str), (named, about_named): (&str, &str)) -> String {
    let zeros = "'[0' || replace(hex(zeroblob(p.points - 1)), '00', ',0') || ']'";
    let digits = |column: &str, bytes: &str| {
        format!("substr('00000000000000' || hex(substr(p.{column}, k.key * {bytes} + 1, {bytes})), -16)")
    };
    let power = |exponent: &str| {
        let bit = |bit: u32| {
            let factor = if bit < 5 {
                format!("{}.0", 1 << (1 << bit))
            } else {
                vec!["4294967296.0"; 1 << (bit - 5)].join(" * ")
            };
            format!("CASE WHEN {exponent} & {} THEN {factor} ELSE 1.0 END", 1 << bit)
        };
        (0..10).map(bit).collect::<Vec<_>>().join(" * ")
    };
    // Each step is exact on every machine: a power of two times a number of 53 bits.
    let to_double = format!(
        "CASE WHEN digits >= '8' THEN -1.0 ELSE 1.0 END * CASE \
         WHEN exponent >= 1023 THEN (1.0 + mantissa / 4503599627370496.0) * ({}) \
         WHEN exponent > 0 THEN (1.0 + mantissa / 4503599627370496.0) / ({}) \
         ELSE mantissa / 4503599627370496.0 / ({}) END",
        power("(exponent - 1023)"),
        power("(1023 - exponent)"),
        power("1022"),
    );
    // A query within a query with a limit is carried out as it stands, so that digits are taken from the piece once.
    let double = |column: &str| {
        format!(
            "(SELECT {to_double} FROM (SELECT digits, {exponent} & 2047 AS exponent, {mantissa} AS mantissa FROM (SELECT {} AS \
             digits LIMIT 1) LIMIT 1))",
            digits(column, "8"),
            exponent = number_of("digits", 1..4),
            mantissa = number_of("digits", 4..17),
        )
    };
    let width = "(length(p.times) / p.points)";
    format!(
        "{about_points}\n\
         CREATE VIEW {points} AS\n    \
         SELECT p.test AS test, p.metric AS metric, p.position + k.key AS position,\n           \
         CASE WHEN p.tick_ns IS NULL THEN {time}\n                \
         WHEN length(p.times) = 0 THEN (p.start_ns + p.tick_ns * k.key) / 1e9\n                \
         ELSE (p.start_ns + p.tick_ns * (SELECT {ticks} FROM (SELECT {tick_digits} AS digits LIMIT 1))) / 1e9\n           \
         END AS time_s,\n           \
         {value} AS value\n      \
         FROM {pieces} p, json_each({zeros}) k;\n\
         {about_named}\n\
         CREATE VIEW {named} AS\n    \
         SELECT t.number AS test, t.name AS test_name, m.name AS metric, m.unit AS unit, c.position AS position,\n           \
         c.time_s AS time_s, c.value AS value\n      \
         FROM tests t JOIN {points} c ON c.test = coalesce(t.duplicate_of, t.number) \
         JOIN metrics m ON m.id = c.metric;\n",
        time = double("times"),
        value = double("numbers"),
        ticks = number_of("digits", 1..17),
        tick_digits = digits("times", width),
    )
}

/// The whole number that the hexadecimal digits at these places are, counted from 1 and up to the 16th.
fn number_of(digits: &str, places: std::ops::Range<u32>) -> String {
    let mut sum = String::new();
    let last = places.end - 1;
    for place in places {
        let plus = if sum.is_empty() { "" } else { " + " };
        let _ = write!(sum, "{plus}(instr('123456789ABCDEF', substr({digits}, {place}, 1)) << {})", 4 * (last - place));
    }
    format!("({sum})")
}
