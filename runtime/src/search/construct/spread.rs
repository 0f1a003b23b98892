//! Moving numbers, each inside its own bounds, until their mean and their spread are as wanted.

use crate::rng::Stream;

/// A number that can be moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Member {
    /// Where it is.
    pub(super) now: f64,
    /// The least it can be.
    pub(super) low: f64,
    /// The greatest it can be.
    pub(super) high: f64,
    /// From `low` on only every such step is possible; `None` where everything is.
    pub(super) step: Option<f64>,
}

/// What is wanted of all together: values from the first up to, not including, the second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wanted {
    /// Of their mean.
    pub(super) mean: (f64, f64),
    /// Of their population standard deviation, if anything.
    pub(super) spread: Option<(f64, f64)>,
}

/// Halvings of a bisection: what is left is far below any cell.
const HALVINGS: u32 = 60;
/// How far inside of what is wanted the aim lies at most, as a share of its width.
const DEEPEST: f64 = 0.3;
/// Moves of single numbers by a step, per number, to mend what rounding did.
const MENDS: usize = 8;

/// The members moved to where their mean and spread are as wanted, as near to where they were as that permits; `None`
/// where it was not found. The stream decides how far inside of what is wanted they end.
pub(super) fn place(members: &[Member], wanted: &Wanted, stream: &mut Stream) -> Option<Vec<f64>> {
    if members.is_empty() {
        return None;
    }
    let n = members.len() as f64;
    let ends = members.iter().fold((0.0, 0.0), |(low, high), it| (low + it.low / n, high + it.high / n));
    let (low, high) = (wanted.mean.0.max(ends.0), wanted.mean.1.min(ends.1));
    let inside = stream.uniform(0.02, DEEPEST);
    if low > high {
        return None;
    }
    let now: Vec<f64> = members.iter().map(|it| it.now).collect();
    let aim = within((low, high), mean(&now), inside);
    let mut placed = with_mean(members, &now, aim);
    if let Some((least, most)) = wanted.spread
        && !(least..most).contains(&deviation(&placed))
    {
        placed = with_spread(members, &placed, aim, (least, most), inside, stream)?;
    }
    round(members, &mut placed, wanted, stream);
    Some(placed)
}

/// The number nearest to this one that is some way inside of the ends; an end without end counts as far away.
fn within((low, high): (f64, f64), number: f64, inside: f64) -> f64 {
    let margin = if (high - low).is_finite() { (high - low) * inside } else { 0.0 };
    number.max(low + margin).min(high - margin)
}

/// All moved by one amount, each kept in its bounds, so that their mean is `aim`: the nearest such numbers.
fn with_mean(members: &[Member], now: &[f64], aim: f64) -> Vec<f64> {
    let moved = |by: f64| -> Vec<f64> {
        members.iter().zip(now).map(|(it, now)| (now + by).clamp(it.low, it.high.max(it.low))).collect()
    };
    // Farther than this nothing moves.
    let reach = members.iter().zip(now).map(|(it, now)| (it.high - now).abs().max((it.low - now).abs()));
    let reach = reach.fold(0.0, f64::max);
    let (mut low, mut high) = (-reach, reach);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if mean(&moved(middle)) < aim {
            low = middle;
        } else {
            high = middle;
        }
    }
    moved(f64::midpoint(low, high))
}

/// Distances from the mean scaled by one factor until the spread is as wanted.
fn with_spread(
    members: &[Member],
    placed: &[f64],
    aim: f64,
    (least, most): (f64, f64),
    inside: f64,
    stream: &mut Stream,
) -> Option<Vec<f64>> {
    let mut from = placed.to_vec();
    let wider = deviation(placed) < least;
    if wider {
        // Those that lie together have no distances to scale, and which is to go where is open.
        for (number, member) in from.iter_mut().zip(members) {
            *number += (member.high - member.low) * 0.2 * (stream.unit() - 0.5);
        }
    }
    let scaled = |by: f64| {
        let centre = mean(&from);
        let apart: Vec<f64> = from.iter().map(|number| aim + (number - centre) * by).collect();
        with_mean(members, &apart, aim)
    };
    let widest = if wider { deviation(&scaled(LARGE)) } else { f64::INFINITY };
    let (low, high) = (least.max(0.0), most.min(widest));
    if low > high {
        return None;
    }
    let wanted = within((low, high), deviation(placed), inside);
    // Factors from none to so large that all are at their bounds; the spread grows with the factor.
    let (mut low, mut high) = (0.0, LARGE);
    for _ in 0..2 * HALVINGS {
        let middle = f64::midpoint(low, high);
        if deviation(&scaled(middle)) < wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(scaled(high))
}

/// A factor that puts every number apart from its mean to a bound.
const LARGE: f64 = 1e6;

/// Puts numbers with steps onto them, then moves them by single steps while the mean is not as wanted.
fn round(members: &[Member], placed: &mut [f64], wanted: &Wanted, stream: &mut Stream) {
    let mut stepped = Vec::new();
    for (at, member) in members.iter().enumerate() {
        let Some(step) = member.step else { continue };
        placed[at] = member.low + libm::rint((placed[at] - member.low) / step) * step;
        stepped.push((at, step));
    }
    if stepped.is_empty() {
        return;
    }
    for _ in 0..MENDS * stepped.len() {
        let mean = mean(placed);
        let up = if mean < wanted.mean.0 {
            true
        } else if mean >= wanted.mean.1 {
            false
        } else {
            break;
        };
        let (at, step) = stepped[stream.below(stepped.len())];
        let moved = if up { placed[at] + step } else { placed[at] - step };
        if (members[at].low - step / 2.0..=members[at].high + step / 2.0).contains(&moved) {
            placed[at] = moved;
        }
    }
}

fn mean(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len() as f64
}

/// The population standard deviation.
fn deviation(numbers: &[f64]) -> f64 {
    let mean = mean(numbers);
    libm::sqrt(numbers.iter().map(|number| (number - mean) * (number - mean)).sum::<f64>() / numbers.len() as f64)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn members() -> impl Strategy<Value = Vec<Member>> {
        let member = (0.0..0.5f64, 0.0..0.5f64, 0.0..=1.0f64).prop_map(|(low, width, at)| Member {
            now: low + at * width,
            low,
            high: low + width,
            step: None,
        });
        prop::collection::vec(member, 1..6)
    }

    proptest! {
        #[test]
        fn what_is_placed_has_the_mean_it_should_and_no_random_try_is_nearer(
            members in members(), share in 0.05..0.95f64, seed: u64,
        ) {
            let n = members.len() as f64;
            let (low, high) = members.iter().fold((0.0, 0.0), |(a, b), it| (a + it.low / n, b + it.high / n));
            let aim = low + share * (high - low);
            let now: Vec<f64> = members.iter().map(|it| it.now).collect();
            let placed = with_mean(&members, &now, aim);
            prop_assert!((mean(&placed) - aim).abs() < 1e-9);
            let distance = |to: &[f64]| now.iter().zip(to).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            let mut stream = Stream::derive(seed, "test", &[]);
            for _ in 0..50 {
                let tried: Vec<f64> = members.iter().map(|it| stream.uniform(it.low, it.high)).collect();
                let tried = with_mean(&members, &tried, aim);
                prop_assert!(distance(&placed) <= distance(&tried) + 1e-9, "{placed:?} and {tried:?}");
            }
        }

        #[test]
        fn a_spread_that_random_numbers_have_is_found(count in 2usize..6, seed: u64) {
            let mut stream = Stream::derive(seed, "test", &[]);
            let members = vec![Member { now: stream.unit(), low: 0.0, high: 1.0, step: None }; count];
            let example: Vec<f64> = (0..count).map(|_| stream.unit()).collect();
            let around = |x: f64| ((x - 0.05).max(0.0), x + 0.05);
            let wanted = Wanted { mean: around(mean(&example)), spread: Some(around(deviation(&example))) };
            let fits = |placed: &[f64]| {
                let (of_mean, of_spread) = (mean(placed), deviation(placed));
                let spread = wanted.spread.unwrap();
                (wanted.mean.0..wanted.mean.1).contains(&of_mean) && (spread.0..spread.1).contains(&of_spread)
            };
            let found = (0..20).find_map(|_| place(&members, &wanted, &mut stream).filter(|placed| fits(placed)));
            prop_assert!(found.is_some(), "{wanted:?}");
        }
    }

    #[test]
    fn whole_steps_are_taken_until_the_mean_is_as_wanted() {
        let member = |now| Member { now, low: 0.0, high: 1.0, step: Some(0.25) };
        let wanted = Wanted { mean: (0.6, 0.7), spread: None };
        let mut stream = Stream::derive(1, "test", &[]);
        let placed = place(&[member(0.25), member(0.5), member(0.25)], &wanted, &mut stream).unwrap();
        assert!(placed.iter().all(|number| (number * 4.0).fract() == 0.0), "{placed:?}");
        assert!((0.6..0.7).contains(&mean(&placed)), "{placed:?}");
    }

    #[test]
    fn what_cannot_be_is_not_found() {
        let member = Member { now: 0.2, low: 0.0, high: 0.5, step: None };
        let mut stream = Stream::derive(1, "test", &[]);
        let mut place = |mean, spread| place(&[member, member], &Wanted { mean, spread }, &mut stream);
        assert_eq!(place((0.6, 0.7), None), None);
        assert_eq!(place((0.1, 0.2), Some((0.3, 0.4))), None);
    }
}
