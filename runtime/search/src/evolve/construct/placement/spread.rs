//! Moving numbers, each inside its own bounds, until their mean and their spread are in given ranges.
//!
//! The permitted vectors of numbers form a convex set: each number is in its bounds, the mean is in its range, and the
//! sum of the numbers' distances from the middles of their bounds is within a budget. So all vectors between two
//! permitted ones are permitted, and the spread, which is continuous, takes every value between those at the ends. The
//! spread is greatest at a vertex of the set, so a local search climbs to one; it is least where all numbers meet.

use sesame_rng::Stream;

/// A number that can be moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Member {
    /// Its value before it is moved.
    pub(super) now: f64,
    /// Its lower bound.
    pub(super) low: f64,
    /// Its upper bound.
    pub(super) high: f64,
    /// The distance between its possible values, from `low` on; `None` if all values are possible.
    pub(super) step: Option<f64>,
}

impl Member {
    fn middle(&self) -> f64 {
        f64::midpoint(self.low, self.high)
    }

    fn clamp(&self, number: f64) -> f64 {
        number.min(self.high).max(self.low)
    }
}

/// The ranges that the numbers are to be in: lower bounds are inclusive, upper bounds exclusive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wanted {
    /// The range of their mean.
    pub(super) mean: (f64, f64),
    /// The range of their population standard deviation, if it matters.
    pub(super) spread: Option<(f64, f64)>,
    /// The greatest sum of their distances from the middles of their bounds.
    pub(super) budget: f64,
}

impl Wanted {
    /// How far the mean and the spread of these numbers are from their ranges: 0 if both are inside.
    fn missed_by(&self, numbers: &[f64]) -> f64 {
        let outside = |value: f64, (low, high): (f64, f64)| {
            if value < low {
                low - value
            } else if value >= high {
                // The upper bound is outside.
                value - high + 1e-12
            } else {
                0.0
            }
        };
        outside(mean(numbers), self.mean) + self.spread.map_or(0.0, |spread| outside(deviation(numbers), spread))
    }
}

/// Halvings of a bisection: the remaining interval is far smaller than any cell.
const HALVINGS: u32 = 50;
/// How far inside a range the target lies at least and at most, as a share of the width of the range.
const DEEP: (f64, f64) = (0.02, 0.3);
/// Steps of a climb to a vertex, and number of climbs with different starting directions.
const CLIMB: (usize, usize) = (6, 8);
/// Moves of single numbers by a step, per number, to correct the effect of rounding.
const MENDS: usize = 8;

/// The members moved, not far from their values, until their mean and spread are in their ranges; `None` if that was
/// not found. The stream decides how far inside the ranges they end.
pub(super) fn place(members: &[Member], wanted: &Wanted, stream: &mut Stream) -> Option<Vec<f64>> {
    let inside = stream.uniform(DEEP.0, DEEP.1);
    let placed = settle(members, wanted, inside, stream)?;
    let whole = members.iter().any(|member| member.step.is_some());
    Some(if whole { stepped(members, &placed, wanted, inside, stream) } else { placed })
}

/// As [`place`], of members without steps.
fn settle(members: &[Member], wanted: &Wanted, inside: f64, stream: &mut Stream) -> Option<Vec<f64>> {
    if members.is_empty() || wanted.budget < 0.0 {
        return None;
    }
    let set = FeasibleSet::of(members, wanted, inside)?;
    let now: Vec<f64> = members.iter().map(|member| member.clamp(member.now)).collect();
    let moved = set.nearest(&now);
    let Some((least, most)) = wanted.spread else { return Some(moved) };
    let spread = deviation(&moved);
    if (least..most).contains(&spread) {
        return Some(moved);
    }
    let other = if spread < least { set.apart(&moved, least, stream)? } else { set.together(most)? };
    let reached = deviation(&other);
    let (low, high) = if spread < least { (least, most.min(reached)) } else { (least.max(reached), most) };
    let aim = if high.is_finite() && low.max(0.0) < high {
        let width = high - low.max(0.0);
        if spread < least { low + inside * width } else { high - inside * width }
    } else {
        low.max(0.0)
    };
    // The spread is a convex function along this line, so it passes the target exactly once, upwards or downwards.
    let at = |share: f64| between(&moved, &other, share);
    let (mut near, mut far) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(near, far);
        if (deviation(&at(middle)) < aim) == (spread < least) {
            near = middle;
        } else {
            far = middle;
        }
    }
    Some(at(far))
}

/// The permitted vectors of numbers: a convex set that is not empty.
struct FeasibleSet<'a> {
    members: &'a [Member],
    /// The range of the mean, reduced by a margin.
    mean: (f64, f64),
    budget: f64,
    /// The permitted vector nearest to the middles.
    middle: Vec<f64>,
}

impl<'a> FeasibleSet<'a> {
    fn of(members: &'a [Member], wanted: &Wanted, inside: f64) -> Option<FeasibleSet<'a>> {
        let n = members.len() as f64;
        let middles: Vec<f64> = members.iter().map(Member::middle).collect();
        let centre = mean(&middles);
        // The budget limits the distance of the mean from the centre.
        let room =
            (wanted.budget / n).min(members.iter().map(|member| (member.high - member.low) / 2.0).sum::<f64>() / n);
        let (low, high) = (wanted.mean.0.max(centre - room), wanted.mean.1.min(centre + room));
        if low > high {
            return None;
        }
        let margin = if (high - low).is_finite() { (high - low) * inside } else { 0.0 };
        let range = (low + margin, high - margin);
        let middle = with_mean(members, &middles, centre.max(range.0).min(range.1));
        Some(FeasibleSet { members, mean: range, budget: wanted.budget, middle })
    }

    fn spent(&self, numbers: &[f64]) -> f64 {
        self.members.iter().zip(numbers).map(|(member, number)| (number - member.middle()).abs()).sum()
    }

    /// A permitted vector near these numbers: they are shifted by the same amount until their mean is permitted, then
    /// moved towards the middle as far as the budget requires.
    fn nearest(&self, numbers: &[f64]) -> Vec<f64> {
        let moved = with_mean(self.members, numbers, mean(numbers).max(self.mean.0).min(self.mean.1));
        if self.spent(&moved) <= self.budget {
            return moved;
        }
        let (mut near, mut far) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let share = f64::midpoint(near, far);
            if self.spent(&between(&self.middle, &moved, share)) <= self.budget {
                near = share;
            } else {
                far = share;
            }
        }
        between(&self.middle, &moved, near)
    }

    /// A permitted vector whose spread is at least `least`, found by climbing in the direction of these numbers and in
    /// others; `None` if none was found.
    fn apart(&self, from: &[f64], least: f64, stream: &mut Stream) -> Option<Vec<f64>> {
        let mut order: Vec<usize> = (0..self.members.len()).collect();
        order.sort_by(|&a, &b| self.members[a].middle().total_cmp(&self.members[b].middle()));
        (0..CLIMB.1).find_map(|climb| {
            let centre = mean(from);
            // First in the direction of the numbers, then with half of the windows moving to each side, then in random
            // directions.
            let mut ways: Vec<f64> = match climb {
                0 => from.iter().map(|number| number - centre + 1e-6 * (stream.unit() - 0.5)).collect(),
                1 => {
                    let mut ways = vec![0.0; order.len()];
                    order
                        .iter()
                        .enumerate()
                        .for_each(|(at, &member)| ways[member] = at as f64 - order.len() as f64 / 2.0 + 0.5);
                    ways
                }
                _ => order.iter().map(|_| stream.uniform(-1.0, 1.0)).collect(),
            };
            let mut best: Option<Vec<f64>> = None;
            for _ in 0..CLIMB.0 {
                let vertex = self.farthest(&ways);
                if best.as_ref().is_some_and(|best| deviation(&vertex) <= deviation(best) + 1e-12) {
                    break;
                }
                // The spread is convex, so it grows further in the direction in which it grows here.
                let centre = mean(&vertex);
                ways = vertex.iter().map(|number| number - centre).collect();
                best = Some(vertex);
            }
            best.filter(|best| deviation(best) >= least)
        })
    }

    /// The permitted vector farthest in a direction: a linear programme, solved by a Lagrange multiplier (`price`) on
    /// the mean.
    fn farthest(&self, ways: &[f64]) -> Vec<f64> {
        let at = |price: f64| self.farthest_at(ways, price);
        let free = at(0.0);
        let (low, high) = self.mean;
        let (too_low, too_high) = (mean(&free) < low, mean(&free) > high);
        if !too_low && !too_high {
            return free;
        }
        let bound = if too_low { low } else { high };
        // At this price, all numbers move in the same direction.
        let most = 1.0 + 2.0 * ways.iter().fold(0.0, |most: f64, way| most.max(way.abs()));
        let (mut below, mut above) = if too_low { (0.0, -most) } else { (most, 0.0) };
        for _ in 0..HALVINGS {
            let price = f64::midpoint(below, above);
            if mean(&at(price)) < bound {
                below = price;
            } else {
                above = price;
            }
        }
        // At the optimal price there are two solutions, and the bound on the mean is met between them.
        let (below, above) = (at(below), at(above));
        let (from, to) = (mean(&below), mean(&above));
        let share = if to > from { ((bound - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
        self.nearest(&between(&below, &above, share))
    }

    /// The farthest vector if the mean has this price: the budget is spent first on the numbers that gain most by
    /// moving.
    fn farthest_at(&self, ways: &[f64], price: f64) -> Vec<f64> {
        let mut order: Vec<usize> = (0..ways.len()).collect();
        order.sort_by(|&a, &b| (ways[b] - price).abs().total_cmp(&(ways[a] - price).abs()));
        let mut placed: Vec<f64> = self.members.iter().map(Member::middle).collect();
        let mut left = self.budget;
        for at in order {
            let by = ((self.members[at].high - self.members[at].low) / 2.0).min(left);
            left -= by;
            placed[at] += by * (ways[at] - price).signum();
        }
        placed
    }

    /// A permitted vector whose spread is less than `most`; `None` if none was found.
    fn together(&self, most: f64) -> Option<Vec<f64>> {
        let meeting = self.members.iter().map(Member::middle).chain([
            self.mean.0,
            self.mean.1,
            f64::midpoint(self.mean.0, self.mean.1),
        ]);
        let places = meeting.filter(|place| place.is_finite()).map(|place| {
            let met: Vec<f64> = self.members.iter().map(|member| member.clamp(place)).collect();
            self.nearest(&met)
        });
        places.min_by(|a, b| deviation(a).total_cmp(&deviation(b))).filter(|place| deviation(place) < most)
    }
}

/// The vector at this share of the way from one to another.
fn between(from: &[f64], to: &[f64], share: f64) -> Vec<f64> {
    from.iter().zip(to).map(|(from, to)| from * (1.0 - share) + to * share).collect()
}

/// The numbers shifted by one amount, each kept in its bounds, so that their mean is `aim`: the nearest such vector.
pub(super) fn with_mean(members: &[Member], now: &[f64], aim: f64) -> Vec<f64> {
    let moved = |by: f64| -> Vec<f64> { members.iter().zip(now).map(|(member, now)| member.clamp(now + by)).collect() };
    // A greater shift moves nothing further.
    let reach = members.iter().zip(now).map(|(member, now)| (member.high - now).abs().max((member.low - now).abs()));
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

/// Rounds numbers with steps to their possible values. Numbers without steps compensate for it where they can;
/// otherwise numbers are moved by single steps, always by the best ones, as long as one improves the result.
fn stepped(members: &[Member], placed: &[f64], wanted: &Wanted, inside: f64, stream: &mut Stream) -> Vec<f64> {
    let on_step = |member: &Member, step: f64, number: f64| {
        member.clamp(member.low + libm::rint((number - member.low) / step) * step)
    };
    let fixed: Vec<Member> = members
        .iter()
        .zip(placed)
        .map(|(member, &number)| match member.step {
            None => Member { now: number, ..*member },
            Some(step) => {
                let number = on_step(member, step, number);
                Member { now: number, low: number, high: number, step: None }
            }
        })
        .collect();
    // Only windows have a budget, and they have no steps.
    if let Some(mended) = settle(&fixed, wanted, inside, stream).filter(|mended| wanted.missed_by(mended) == 0.0) {
        return mended;
    }
    let mut numbers: Vec<f64> = fixed.iter().map(|member| member.now).collect();
    let moves: Vec<(usize, f64)> = members
        .iter()
        .enumerate()
        .filter_map(|(at, member)| Some((at, member.step?)))
        .flat_map(|(at, step)| [(at, step), (at, -step)])
        .collect();
    let fits = |at: usize, number: f64| {
        let member = &members[at];
        let slack = member.step.unwrap_or_default() / 2.0;
        (member.low - slack..=member.high + slack).contains(&number)
    };
    for _ in 0..MENDS * members.len() {
        let now = wanted.missed_by(&numbers);
        if now == 0.0 {
            break;
        }
        let mut best: Option<(f64, Vec<f64>)> = None;
        for (first, &(a, up)) in moves.iter().enumerate() {
            for second in std::iter::once(None).chain(moves[first + 1..].iter().map(Some)) {
                let mut tried = numbers.clone();
                tried[a] += up;
                if let Some(&(b, by)) = second {
                    tried[b] += by;
                    if !fits(b, tried[b]) {
                        continue;
                    }
                }
                let missed = wanted.missed_by(&tried);
                if fits(a, tried[a]) && best.as_ref().is_none_or(|(least, _)| missed < *least) {
                    best = Some((missed, tried));
                }
            }
        }
        match best {
            Some((missed, tried)) if missed < now => numbers = tried,
            // No step is an improvement here; after a random one, another may be.
            _ => {
                let (at, by) = moves[stream.below(moves.len())];
                if fits(at, numbers[at] + by) {
                    numbers[at] += by;
                }
            }
        }
    }
    numbers
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
        fn shifted_numbers_have_the_given_mean_and_random_ones_are_not_nearer(
            members in members(), share in 0.05..0.95f64, seed: u64,
        ) {
            let n = members.len() as f64;
            let (low, high) = members.iter().fold((0.0, 0.0), |(a, b), member| (a + member.low / n, b + member.high / n));
            let aim = low + share * (high - low);
            let now: Vec<f64> = members.iter().map(|member| member.now).collect();
            let placed = with_mean(&members, &now, aim);
            prop_assert!((mean(&placed) - aim).abs() < 1e-9);
            let distance = |to: &[f64]| now.iter().zip(to).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            let mut stream = Stream::derive(seed, "test", &[]);
            for _ in 0..50 {
                let tried: Vec<f64> = members.iter().map(|member| stream.uniform(member.low, member.high)).collect();
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
            let wanted = Wanted { mean: around(mean(&example)), spread: Some(around(deviation(&example))), budget: f64::INFINITY };
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
    fn numbers_with_steps_are_moved_by_steps_until_the_mean_is_in_its_range() {
        let member = |now| Member { now, low: 0.0, high: 1.0, step: Some(0.25) };
        let wanted = Wanted { mean: (0.6, 0.7), spread: None, budget: f64::INFINITY };
        let mut stream = Stream::derive(1, "test", &[]);
        let placed = place(&[member(0.25), member(0.5), member(0.25)], &wanted, &mut stream).unwrap();
        assert!(placed.iter().all(|number| (number * 4.0).fract() == 0.0), "{placed:?}");
        assert!((0.6..0.7).contains(&mean(&placed)), "{placed:?}");
    }

    #[test]
    fn impossible_means_and_spreads_are_not_found() {
        let member = Member { now: 0.2, low: 0.0, high: 0.5, step: None };
        let mut stream = Stream::derive(1, "test", &[]);
        let mut place =
            |mean, spread| place(&[member, member], &Wanted { mean, spread, budget: f64::INFINITY }, &mut stream);
        assert_eq!(place((0.6, 0.7), None), None);
        assert_eq!(place((0.1, 0.2), Some((0.3, 0.4))), None);
    }
}
