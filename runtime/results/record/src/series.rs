//! Time series as they are stored: in pieces of up to 64 points, 8 bytes a value, from which SQL can still read each
//! point.
//!
//! Series are most of what a campaign records: a row per point took three times the space, and ten times as long to
//! read. The view `change_points` has such a row per point, computed from the pieces.

use rusqlite::{Transaction, params};

use sesame_base::test_number::TestNumber;

use crate::columns::{index, position};
use crate::{RecordError, Repository};

/// A series: times in seconds, and the value from then on.
pub(super) type Series = Vec<(f64, f64)>;

/// How many points a piece has at most. The row is then small enough to lie on a page with others.
const PIECE: usize = 64;

/// Nanoseconds in a second, exactly.
const SECOND: f64 = 1e9;

/// Numbers up to here are exact as doubles.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// Some consecutive points of a series, as the columns of a row.
#[derive(Debug, Clone, PartialEq)]
struct Piece {
    points: usize,
    /// When the first point is, and the length of a tick, in nanoseconds; `None` where times are doubles.
    clock: Option<(i64, i64)>,
    /// Per point its ticks since the first one, big-endian, all of one width; nothing where they are 0, 1, 2, and so
    /// on. Where there is no clock, its time as a double, big-endian.
    times: Vec<u8>,
    /// Per point its value as a double, big-endian.
    numbers: Vec<u8>,
}

impl Piece {
    /// The piece of some points, which is the same whenever the points are.
    fn of(points: &[(f64, f64)]) -> Piece {
        let nanos: Option<Vec<i64>> = points.iter().map(|point| whole_nanos(point.0)).collect();
        let (clock, times) = match nanos.filter(|nanos| nanos.is_sorted()) {
            Some(nanos) => {
                let first = nanos[0];
                let tick = nanos.iter().fold(0, |tick, nanos| divisor(tick, nanos - first)).max(1);
                let ticks: Vec<i64> = nanos.iter().map(|nanos| (nanos - first) / tick).collect();
                (Some((first, tick)), in_bytes(&ticks))
            }
            None => (None, doubles(points.iter().map(|point| point.0))),
        };
        Piece { points: points.len(), clock, times, numbers: doubles(points.iter().map(|point| point.1)) }
    }

    /// The points; `None` of a piece that nothing is written as.
    fn points(&self) -> Option<Series> {
        let numbers = of_doubles(&self.numbers, self.points).filter(|numbers| !numbers.is_empty())?;
        let times = match self.clock {
            None => of_doubles(&self.times, self.points)?,
            Some((first, tick)) => {
                let second = |ticks: i64| Some(tick.checked_mul(ticks)?.checked_add(first)? as f64 / SECOND);
                if self.times.is_empty() {
                    (0..index(self.points)).map(second).collect::<Option<Vec<f64>>>()?
                } else {
                    let width = self.times.len() / self.points;
                    if !(1..8).contains(&width) || width * self.points != self.times.len() {
                        return None;
                    }
                    let ticks = self.times.chunks_exact(width);
                    let ticks = ticks.map(|bytes| bytes.iter().fold(0, |sum, &byte| sum << 8 | i64::from(byte)));
                    ticks.map(second).collect::<Option<Vec<f64>>>()?
                }
            }
        };
        Some(times.into_iter().zip(numbers).collect())
    }
}

/// The time as whole nanoseconds, if that is what it is.
#[expect(clippy::cast_possible_truncation, reason = "what is out of range is refused before")]
fn whole_nanos(seconds: f64) -> Option<i64> {
    let nanos = libm::round(seconds * SECOND);
    (nanos.abs() <= EXACT && nanos / SECOND == seconds).then_some(nanos as i64)
}

/// The greatest common divisor; of zero and another number that number.
fn divisor(a: i64, b: i64) -> i64 {
    if b == 0 { a } else { divisor(b, a % b) }
}

/// Ascending ticks from zero on, in as few bytes as the last one needs.
fn in_bytes(ticks: &[i64]) -> Vec<u8> {
    if (0..).zip(ticks).all(|(at, &ticks)| at == ticks) {
        return Vec::new();
    }
    let last = ticks.iter().fold(0, |all, ticks| all | ticks);
    let width = (64 - last.leading_zeros()).div_ceil(8).max(1) as usize;
    ticks.iter().flat_map(|ticks| ticks.to_be_bytes()[8 - width..].to_vec()).collect()
}

/// Zero has no sign here: that of equal values is equal.
fn doubles(numbers: impl Iterator<Item = f64>) -> Vec<u8> {
    numbers.flat_map(|x| (x + 0.0).to_be_bytes()).collect()
}

fn of_doubles(bytes: &[u8], count: usize) -> Option<Vec<f64>> {
    let (numbers, rest) = bytes.as_chunks();
    let numbers: Vec<f64> = numbers.iter().map(|&bytes| f64::from_be_bytes(bytes)).collect();
    (rest.is_empty() && numbers.len() == count && numbers.iter().all(|x| x.is_finite())).then_some(numbers)
}

/// A table of pieces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pieces {
    /// The series of metrics.
    Series,
    /// Robustness signals.
    Robustness,
}

impl Pieces {
    fn table(self) -> &'static str {
        match self {
            Pieces::Series => "series_pieces",
            Pieces::Robustness => "robustness_pieces",
        }
    }
}

/// Writes the series of one metric in a test into a table of pieces.
pub(super) fn write(
    transaction: &Transaction<'_>,
    pieces: Pieces,
    test: u32,
    metric: usize,
    series: &[(f64, f64)],
) -> rusqlite::Result<()> {
    let table = pieces.table();
    for (at, points) in series.chunks(PIECE).enumerate() {
        let Piece { points, clock, times, numbers } = Piece::of(points);
        let (start, tick) = clock.unzip();
        transaction
            .prepare_cached(&format!(
                "INSERT INTO {table} (test, metric, position, points, start_ns, tick_ns, times, numbers) \
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
            ))?
            .execute(params![test, index(metric), index(at * PIECE), index(points), start, tick, times, numbers])?;
    }
    Ok(())
}

impl Repository {
    /// The series of a test, each with the position of its metric; none of a metric that never changed.
    pub(super) fn series(&self, test: u32) -> Result<Vec<(usize, Series)>, RecordError> {
        self.pieces(Pieces::Series, test)
    }

    /// The robustness signals of a test, each with the position of its metric; none in results that were recorded
    /// without them.
    pub(super) fn robustness(&self, test: u32) -> Result<Vec<(usize, Series)>, RecordError> {
        if self.has_robustness { self.pieces(Pieces::Robustness, test) } else { Ok(Vec::new()) }
    }

    fn pieces(&self, pieces: Pieces, test: u32) -> Result<Vec<(usize, Series)>, RecordError> {
        let table = pieces.table();
        let mut found = Vec::new();
        let pieces = self.read(
            &format!(
                "SELECT metric, points, start_ns, tick_ns, times, numbers FROM {table} WHERE test = ?1 \
                 ORDER BY metric, position"
            ),
            [test],
            |row| {
                let clock = Option::zip(row.get(2)?, row.get(3)?);
                let points = position(row, 1)?;
                let piece = Piece { points, clock, times: row.get(4)?, numbers: row.get(5)? };
                Ok((position(row, 0)?, piece.points()))
            },
        )?;
        for (metric, points) in pieces {
            let problem = || format!("{} has a series that cannot be read", TestNumber(test));
            add(&mut found, metric, points.ok_or_else(|| RecordError::damaged(&self.path, problem()))?);
        }
        Ok(found)
    }
}

/// Adds points to the last series, or begins that of the next metric.
fn add(found: &mut Vec<(usize, Series)>, metric: usize, points: Series) {
    match found.last_mut() {
        Some((last, series)) if *last == metric => series.extend(points),
        _ => found.push((metric, points)),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rusqlite::Connection;

    use super::*;
    use crate::{Origin, Recorder, sample};

    fn finite() -> impl Strategy<Value = f64> {
        prop_oneof![
            4 => any::<f64>().prop_filter("finite", |x| x.is_finite()),
            1 => prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, 5e-324, f64::MIN_POSITIVE, f64::MAX, f64::MIN]),
            1 => (1..1u64 << 52).prop_map(f64::from_bits),
        ]
    }

    /// Times as a run has them: ascending whole steps, mostly of one length, here and there a gap; and times of any
    /// kind.
    fn series() -> impl Strategy<Value = Vec<(f64, f64)>> {
        let steps = (0..3_000_000_000_i64, 1..40_000_000_i64, prop::collection::vec((0..20_i64, finite()), 0..200))
            .prop_map(|(start, step, points)| {
                let mut at = start;
                let timed = points.into_iter().map(|(gap, value)| {
                    at += step * if gap < 16 { 1 } else { gap * gap * gap };
                    (at as f64 / SECOND, value)
                });
                timed.collect()
            });
        let any_times = prop::collection::vec((finite(), finite()), 0..150);
        let nanos = prop::collection::vec((0..i64::MAX >> 10, finite()), 0..150).prop_map(|mut points| {
            points.sort_by_key(|point| point.0);
            points.into_iter().map(|(nanos, value)| (nanos as f64 / SECOND, value)).collect()
        });
        prop_oneof![4 => steps, 1 => any_times, 1 => nanos]
    }

    /// Zero has no sign in results.
    fn bits(series: &[(f64, f64)]) -> Vec<(u64, u64)> {
        series.iter().map(|point| ((point.0 + 0.0).to_bits(), (point.1 + 0.0).to_bits())).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn a_series_comes_back_bit_for_bit_and_sql_reads_each_point_of_it(points in series()) {
            let packed: Vec<Piece> = points.chunks(PIECE).map(Piece::of).collect();
            let read: Option<Vec<Series>> = packed.iter().map(Piece::points).collect();
            prop_assert_eq!(bits(&read.unwrap().concat()), bits(&points));

            let folder = tempfile::tempdir().unwrap();
            let plan = sample::plan();
            let mut record = sample::record(&plan, 3, Origin::Search, sesame_plan::Test::default());
            record.observation.metrics[1].series.clone_from(&points);
            let mut recorder = Recorder::create(folder.path(), &plan, 1, 1).unwrap();
            recorder.commit(&record).unwrap();
            prop_assert_eq!(bits(&recorder.repository().test(3).unwrap().observation.metrics[1].series), bits(&points));
            prop_assert!(recorder.repository().records(3..=3, false).unwrap()[0].observation.metrics[1].series.is_empty());
            let open = Connection::open(folder.path().join(crate::DATABASE)).unwrap();
            let mut statement =
                open.prepare("SELECT position, time_s, value FROM series WHERE test = 3 AND metric = 'fuzzing_time'").unwrap();
            let rows: Vec<(i64, f64, f64)> = statement
                .query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))
                .unwrap()
                .collect::<Result<_, _>>()
                .unwrap();
            prop_assert!(rows.iter().map(|row| row.0).eq(0..index(points.len())));
            prop_assert_eq!(bits(&rows.iter().map(|row| (row.1, row.2)).collect::<Vec<_>>()), bits(&points));
        }

        #[test]
        fn a_changed_piece_is_read_or_refused(
            points in 0..4_usize,
            clock in prop::option::of((any::<i64>(), any::<i64>())),
            times in prop::collection::vec(any::<u8>(), 0..33),
            mut numbers in prop::collection::vec(any::<u8>(), 0..33),
            whole in any::<bool>(),
        ) {
            numbers.resize(if whole { 8 * points } else { numbers.len() }, 64);
            let piece = Piece { points, clock, times, numbers };
            if let Some(series) = piece.points() {
                prop_assert_eq!(series.len(), points);
                prop_assert!(series.iter().all(|point| point.0.is_finite() && point.1.is_finite()));
            }
        }
    }

    #[test]
    fn a_value_at_each_step_takes_eight_bytes_and_with_gaps_nine() {
        let each: Series = (5..69).map(|step| (f64::from(step) * 20.0 / 1000.0, f64::from(step).sqrt())).collect();
        let piece = Piece::of(&each);
        assert_eq!((piece.clock, piece.times.len(), piece.numbers.len()), (Some((100_000_000, 20_000_000)), 0, 512));
        let mut gap = each.clone();
        gap[63].0 = 3.38;
        assert_eq!(Piece::of(&gap).times.len(), 64);
    }
}
