//! How far apart midpoints of intervals can lie, and how unequal parameters can be, given their means.

/// One interval of a test: where its window lies and how far its midpoint may be from the window's middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Member {
    /// The middle of the window.
    pub(super) centre: f64,
    /// Farthest that the midpoint can be from there: half of the window less half of the shortest interval.
    pub(super) reach: f64,
    /// So far it can be from there with the longest interval: this much of a distance costs nothing.
    pub(super) free: f64,
}

impl Member {
    /// How much of the budget a distance from the middle costs.
    fn cost(self, distance: f64) -> f64 {
        (distance.abs() - self.free).max(0.0)
    }
}

/// The least and the greatest standard deviation that midpoints can have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spread {
    pub(super) least: f64,
    pub(super) greatest: f64,
    /// Whether both are reached; otherwise they are bounds.
    pub(super) exact: bool,
}

/// Vertices tried at most for one greatest spread; beyond, a bound stands in.
const MOST_VERTICES: usize = 3_000;

/// The extreme standard deviations of midpoints `m` with `|m - centre| <= reach` for each, the sum of those distances
/// beyond `free` at most `budget`, and the mean of all in `low..=high`.
///
/// The variance is convex, so it is greatest at a vertex of the permitted set. Where the signs of the distances are
/// given, that set is cut out of a box by the budget and one end of the mean: so at a vertex all midpoints but two at
/// most are as far from the middle of their window as costs nothing or as they may be. All such places are tried, equal
/// members together. The least is zero where all midpoints can meet; else zero is a bound.
pub(super) fn midpoints(groups: &[(Member, usize)], budget: f64, low: f64, high: f64) -> Spread {
    let count: usize = groups.iter().map(|(_, count)| count).sum();
    let n = count as f64;
    let meeting = groups.iter().fold((low, high), |(low, high), (member, _)| {
        (low.max(member.centre - member.reach), high.min(member.centre + member.reach))
    });
    let distance =
        |t: f64| groups.iter().map(|(member, count)| *count as f64 * member.cost(t - member.centre)).sum::<f64>();
    // The sum of costs is convex, and least where a distance begins to cost, or at an end of what is left.
    let kinks = groups.iter().flat_map(|(member, _)| [member.centre - member.free, member.centre + member.free]);
    let places = kinks.map(|kink| kink.clamp(meeting.0, meeting.1.max(meeting.0)));
    let nearest = places.map(distance).fold(f64::INFINITY, f64::min);
    let meet = meeting.0 <= meeting.1 + 1e-12 && nearest <= budget + 1e-9;
    // A group of n in one of three places has (n + 1)(n + 2) / 2 ways, in one of four (n + 3) / 3 times as many.
    let mut ways =
        groups.iter().map(|(member, n)| (n + 1) * (n + 2) / 2 * if member.free > 0.0 { n + 3 } else { 3 } / 3);
    let ways = ways.try_fold(1usize, usize::checked_mul);
    let pairs = groups.len() * groups.len() + groups.len() + 1;
    if ways.and_then(|ways| ways.checked_mul(pairs)).is_none_or(|all| all > MOST_VERTICES) {
        let ends = groups.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (member, _)| {
            (low.min(member.centre - member.reach), high.max(member.centre + member.reach))
        });
        return Spread { least: 0.0, greatest: (ends.1 - ends.0) / 2.0, exact: false };
    }
    let mut search = Vertices { groups, budget, sums: [low * n, high * n], n, greatest: 0.0 };
    search.place(0, Placed::default(), [None, None]);
    Spread { least: 0.0, greatest: libm::sqrt(search.greatest.max(0.0)), exact: meet }
}

/// Midpoints placed so far.
#[derive(Debug, Clone, Copy, Default)]
struct Placed {
    sum: f64,
    squares: f64,
    distance: f64,
}

impl Placed {
    fn with(self, midpoint: f64, member: Member, times: usize) -> Placed {
        let times = times as f64;
        Placed {
            sum: self.sum + times * midpoint,
            squares: self.squares + times * midpoint * midpoint,
            distance: self.distance + times * member.cost(midpoint - member.centre),
        }
    }
}

struct Vertices<'a> {
    groups: &'a [(Member, usize)],
    budget: f64,
    sums: [f64; 2],
    n: f64,
    /// The greatest variance found.
    greatest: f64,
}

impl Vertices<'_> {
    /// Places the groups from this one on; `free` are members that the budget and the mean will place.
    fn place(&mut self, at: usize, placed: Placed, free: [Option<Member>; 2]) {
        let Some(&(member, count)) = self.groups.get(at) else { return self.finish(placed, free) };
        let Member { centre, reach, free: costless } = member;
        let open = free.iter().filter(|slot| slot.is_none()).count();
        for left_open in 0..=open.min(count) {
            let mut free = free;
            for slot in free.iter_mut().filter(|slot| slot.is_none()).take(left_open) {
                *slot = Some(member);
            }
            let fixed = count - left_open;
            for above in 0..=fixed {
                for below in 0..=fixed - above {
                    let middle = fixed - above - below;
                    // Without anything that costs nothing, both places are the middle itself.
                    for right in if costless > 0.0 { 0..=middle } else { 0..=0 } {
                        let placed = placed
                            .with(centre + reach, member, above)
                            .with(centre - reach, member, below)
                            .with(centre + costless, member, right)
                            .with(centre - costless, member, middle - right);
                        self.place(at + 1, placed, free);
                    }
                }
            }
        }
    }

    fn finish(&mut self, placed: Placed, free: [Option<Member>; 2]) {
        let left = self.budget - placed.distance;
        match free {
            [None, None] => self.try_vertex(placed, &[]),
            [Some(one), None] | [None, Some(one)] => {
                self.try_vertex(placed, &[(one, one.centre + one.free + left)]);
                self.try_vertex(placed, &[(one, one.centre - one.free - left)]);
                for sum in self.sums {
                    self.try_vertex(placed, &[(one, sum - placed.sum)]);
                }
            }
            [Some(first), Some(second)] => {
                for sum in self.sums {
                    // Distances to opposite sides add up to the budget, and midpoints to the sum; on one side both
                    // would say the same.
                    let shift = sum - placed.sum - first.centre - second.centre;
                    // One takes the whole budget, and the other is where the sum has it, at no cost.
                    for (one, other) in [(first, second), (second, first)] {
                        for far in [one.free + left, -one.free - left] {
                            let rest = [(one, one.centre + far), (other, other.centre + shift - far)];
                            self.try_vertex(placed, &rest);
                        }
                    }
                    let left = left + first.free + second.free;
                    let (up, down) = (f64::midpoint(left, shift), f64::midpoint(-left, shift));
                    self.try_vertex(placed, &[(first, first.centre + up), (second, second.centre + down)]);
                    self.try_vertex(placed, &[(first, first.centre + down), (second, second.centre + up)]);
                }
            }
        }
    }

    fn try_vertex(&mut self, placed: Placed, rest: &[(Member, f64)]) {
        const SLACK: f64 = 1e-9;
        let mut all = placed;
        for &(member, midpoint) in rest {
            if (midpoint - member.centre).abs() > member.reach + SLACK {
                return;
            }
            all = all.with(midpoint, member, 1);
        }
        let [low, high] = self.sums;
        if all.distance <= self.budget + SLACK && low - SLACK <= all.sum && all.sum <= high + SLACK {
            let mean = all.sum / self.n;
            self.greatest = self.greatest.max(all.squares / self.n - mean * mean);
        }
    }
}

/// The greatest standard deviation of `count` numbers in `0..=1` whose mean is in `low..=high`, both in `0..=1`.
///
/// With a given mean it is greatest when all numbers but one are 0 or 1. Between means at which that one is 0 or 1 too,
/// the greatest variance is a convex function of the mean, so only those means and the ends have to be tried.
pub(super) fn shares(count: usize, low: f64, high: f64) -> f64 {
    let n = count as f64;
    let greatest = |mean: f64| {
        let ones = libm::floor(mean * n).min(n - 1.0);
        let rest = (mean * n - ones).clamp(0.0, 1.0);
        (ones + rest * rest) / n - mean * mean
    };
    let even = (0..=count).map(|ones| ones as f64 / n).filter(|mean| (low..=high).contains(mean));
    libm::sqrt(even.chain([low, high]).map(greatest).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_rng::Stream;

    use super::*;

    /// Random climbing over midpoints that keep to the rules: what the greatest spread is at least.
    fn climbed(groups: &[(Member, usize)], budget: f64, low: f64, high: f64, seed: u64) -> f64 {
        let members: Vec<Member> = groups.iter().flat_map(|&(member, count)| vec![member; count]).collect();
        let n = members.len() as f64;
        let spread = |x: &[f64]| {
            let midpoints: Vec<f64> = members.iter().zip(x).map(|(member, x)| member.centre + x).collect();
            let mean = midpoints.iter().sum::<f64>() / n;
            let kept = members.iter().zip(x).all(|(member, x)| x.abs() <= member.reach)
                && members.iter().zip(x).map(|(member, x)| member.cost(*x)).sum::<f64>() <= budget
                && (low..=high).contains(&mean);
            kept.then(|| (midpoints.iter().map(|m| (m - mean) * (m - mean)).sum::<f64>() / n).sqrt())
        };
        let mut stream = Stream::derive(seed, "climb", &[]);
        let mut best: f64 = 0.0;
        for _ in 0..12 {
            let mut x: Vec<f64> = members.iter().map(|member| stream.uniform(-member.reach, member.reach)).collect();
            let used: f64 = members.iter().zip(&x).map(|(member, x)| member.cost(*x)).sum();
            for (x, member) in x.iter_mut().zip(&members) {
                let within = x.abs().min(member.free) + member.cost(*x) * (budget / used).min(1.0);
                *x = x.signum() * within;
            }
            let mut now = spread(&x);
            for round in 0..4_000 {
                let mut other = x.clone();
                let size = 0.3 * (1.0 - f64::from(round) / 4_000.0) + 1e-4;
                let (i, j) = (stream.below(x.len()), stream.below(x.len()));
                let step = size * stream.normal();
                other[i] += step;
                // Often against another one, so that the mean and the budget can be kept.
                match stream.below(3) {
                    0 => other[j] -= step,
                    1 => other[j] -= step * other[i].signum() * other[j].signum(),
                    _ => {}
                }
                let then = spread(&other);
                if then > now || (then.is_some() && now.is_none()) {
                    (x, now) = (other, then);
                }
            }
            best = best.max(now.unwrap_or(0.0));
        }
        best
    }

    fn groups() -> impl Strategy<Value = Vec<(Member, usize)>> {
        let free = prop_oneof![Just(0.0), 0.0..1.0f64];
        let member = (0.2..0.8f64, 0.05..0.2f64, free).prop_map(|(centre, reach, free)| Member {
            centre,
            reach,
            free: free * reach,
        });
        prop::collection::vec((member, 1usize..4), 1..3)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn no_climber_gets_beyond_the_greatest_spread_and_the_best_come_near(
            groups in groups(), share in 0.05..1.0f64, ends in (0.1..1.0f64, 0.1..1.0f64), seed: u64,
        ) {
            let count: usize = groups.iter().map(|(_, count)| count).sum();
            prop_assume!(count > 1);
            let budget = share * groups.iter().map(|(member, n)| member.cost(member.reach) * *n as f64).sum::<f64>();
            let mean = groups.iter().map(|(member, n)| member.centre * *n as f64).sum::<f64>() / count as f64;
            // Means that can be reached, somewhere around the mean of the centres; enough for a climber to find some.
            let costless = groups.iter().map(|(member, n)| member.free * *n as f64).sum::<f64>();
            let half = (budget + costless) / count as f64;
            let (low, high) = (mean - half * ends.0, mean + half * ends.1);
            let spread = midpoints(&groups, budget, low, high);
            let found = climbed(&groups, budget, low, high, seed);
            prop_assert!(found <= spread.greatest + 1e-6, "{} beyond {:?}", found, spread);
            prop_assert!(found >= spread.greatest - 0.02, "{} far from {:?}", found, spread);
        }

        #[test]
        fn numbers_are_most_unequal_as_computed(count in 1usize..6, ends in (0.0..1.0f64, 0.0..1.0f64), seed: u64) {
            let (low, high) = (ends.0.min(ends.1), ends.0.max(ends.1));
            let greatest = shares(count, low, high);
            let mut stream = Stream::derive(seed, "test", &[]);
            for _ in 0..300 {
                // Mostly zeros and ones, which spread most.
                let x: Vec<f64> = (0..count).map(|_| (3.0 * stream.unit() - 1.0).clamp(0.0, 1.0)).collect();
                let mean = x.iter().sum::<f64>() / count as f64;
                let variance = x.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / count as f64;
                prop_assert!(!(low..=high).contains(&mean) || variance.sqrt() <= greatest + 1e-12);
            }
        }
    }

    #[test]
    fn the_greatest_spreads_are_those_of_textbooks() {
        assert_eq!(shares(1, 0.0, 1.0), 0.0);
        assert_eq!(shares(2, 0.0, 1.0), 0.5);
        assert!((shares(3, 0.0, 1.0) - (2.0f64 / 9.0).sqrt()).abs() < 1e-12);
        assert!((shares(2, 0.1, 0.2) - 0.2).abs() < 1e-12);
        // Two points at the ends of a window, and no further with less to spend.
        let window = Member { centre: 0.5, reach: 0.5, free: 0.0 };
        assert_eq!(midpoints(&[(window, 2)], 1.0, 0.0, 1.0).greatest, 0.5);
        assert_eq!(midpoints(&[(window, 2)], 0.5, 0.0, 1.0).greatest, 0.25);
    }
}
