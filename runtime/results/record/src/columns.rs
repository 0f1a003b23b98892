//! Columns of rows as values, and values as columns.

use rusqlite::Row;
use rusqlite::types::FromSql;

use sesame_base::observation::{MetricValue, Reach};
use sesame_plan::{Choice, Span};

/// A position in a list as SQLite's integer.
pub(super) fn index(position: usize) -> i64 {
    i64::try_from(position).expect("no list has 2^63 members")
}

/// A count; a negative one is an error of conversion, not a huge number.
pub(super) fn unsigned(row: &Row<'_>, column: usize) -> rusqlite::Result<u64> {
    let value = row.get_ref(column)?;
    let count = i64::column_result(value)
        .map_err(|e| rusqlite::Error::FromSqlConversionFailure(column, value.data_type(), Box::new(e)))?;
    u64::try_from(count).map_err(|_| rusqlite::Error::IntegralValueOutOfRange(column, count))
}

/// The five columns of a metric's value from `first` on: value, whether it was set, both ends of its reach, and when it
/// read what was not finite.
pub(super) fn metric_value(row: &Row<'_>, first: usize) -> rusqlite::Result<MetricValue> {
    Ok(MetricValue {
        value: perhaps_finite(row, first)?,
        set: row.get(first + 1)?,
        reach: Reach { low: perhaps_finite(row, first + 2)?, high: perhaps_finite(row, first + 3)? },
        not_finite: perhaps_finite(row, first + 4)?,
    })
}

/// A number; infinity, which is never recorded, is an error of conversion.
pub(super) fn finite(row: &Row<'_>, column: usize) -> rusqlite::Result<f64> {
    let number: f64 = row.get(column)?;
    if number.is_finite() {
        return Ok(number);
    }
    let words = format!("{number} is recorded where only finite numbers are");
    Err(rusqlite::Error::FromSqlConversionFailure(column, rusqlite::types::Type::Real, words.into()))
}

/// A number, if there is one.
pub(super) fn perhaps_finite(row: &Row<'_>, column: usize) -> rusqlite::Result<Option<f64>> {
    match row.get_ref(column)? {
        rusqlite::types::ValueRef::Null => Ok(None),
        _ => finite(row, column).map(Some),
    }
}

/// A stretch of time, from the columns of its ends.
pub(super) fn span(row: &Row<'_>, first: usize) -> rusqlite::Result<Span> {
    Ok(Span { start: finite(row, first)?, end: finite(row, first + 1)? })
}

/// A position in a list.
pub(super) fn position(row: &Row<'_>, column: usize) -> rusqlite::Result<usize> {
    let count = unsigned(row, column)?;
    usize::try_from(count).map_err(|_| rusqlite::Error::IntegralValueOutOfRange(column, i64::MAX))
}

/// What was chosen for a parameter, from the columns value, low, high, x, y, z and text that begin here; `None` where
/// it is neither value, range, point nor text.
pub(super) fn choice(row: &Row<'_>, first: usize) -> rusqlite::Result<Option<Choice>> {
    let number = |column: usize| perhaps_finite(row, first + column);
    let point = [number(3)?, number(4)?, number(5)?];
    Ok(match (number(0)?, number(1)?, number(2)?, point, row.get(first + 6)?) {
        (Some(value), None, None, [None, None, None], None) => Some(Choice::Value { value }),
        (None, Some(low), Some(high), [None, None, None], None) => Some(Choice::Range { low, high }),
        (None, None, None, [Some(x), Some(y), Some(z)], None) => Some(Choice::Point { point: [x, y, z] }),
        (None, None, None, [None, None, None], Some(text)) => Some(Choice::Text { text }),
        _ => None,
    })
}
