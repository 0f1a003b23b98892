//! Grid search: the full factorial of equally spaced levels, in a balanced order.
//!
//! Each number takes its levels: its least value, its greatest, and others equally spaced between them; of whole
//! numbers no more than there are. Texts and files take all their values, each axis of a point takes its levels, and
//! the ends of sub-ranges and of windows are levels too: a sub-range begins and ends at any two, also at the same one,
//! a window at two that differ. Where lengths of windows are bounded, a window begins at a level of the times that
//! leave room for the longest one, and its length is a level of the permitted lengths. The grid holds each test of
//! these that the campaign permits exactly once, where copies of one operation differ in their windows. Probabilities
//! of inclusion do not matter to it.
//!
//! The order goes through the numbers of operations in turn, for each through the combinations of operations, and
//! within a combination through the levels: each is taken once before one is taken again, as far as sizes permit. A
//! number of operations or a combination whose tests are used up leaves its turns to the others. The order depends on
//! the seed alone, the tests of the grid on nothing but the campaign.
//!
//! Nothing of the grid is kept but what was asked for. Counts stop at 2^100: of a larger set of combinations or windows
//! the search can reach 2^60 members, spread over all of it, which no campaign uses up.

use std::collections::VecDeque;

use sesame_plan::{Activation, CampaignPlan, Choice, ChoiceKind, Copies, OperationId, Test, TestOperation};
use sesame_rng::derive_seed;

use crate::SearchError;
use crate::sample::sampled_search::Sampling;
use crate::space::parameter_space::ParameterSpace;
use crate::space::range::Range;
use crate::space::test_space::{ActivationSpace, TestSpace};

/// Counts are exact below this.
const COUNTED: u128 = 1 << 100;
/// So many members of a set that is not counted can be reached.
const REACHED: u128 = 1 << 60;

/// The tests of a grid, in their order.
#[derive(Debug, Clone)]
pub(crate) struct FullFactorial {
    seed: u64,
    kinds: Vec<Kind>,
    /// Per kind and number of operations, how many ways there are to share so many among it and the kinds after it.
    ways: Vec<Vec<u128>>,
    /// The numbers of operations that have tests left, in turn.
    lengths: VecDeque<Length>,
    /// How many tests there are; [`u128::MAX`] if there are more.
    tests: u128,
}

/// An operation with its levels.
#[derive(Debug, Clone)]
struct Kind {
    operation: OperationId,
    /// `None` for an offline operation.
    times: Option<WindowLevels>,
    copies: Copies,
    parameters: Vec<Levels>,
}

/// The levels of an operation's windows.
#[derive(Debug, Clone)]
enum WindowLevels {
    /// The times at which windows begin and end.
    Ends(Vec<f64>),
    /// Windows of bounded lengths.
    Bounded(BoundedWindows),
}

impl WindowLevels {
    fn new(range: Range, levels: u32) -> Self {
        if range.longest.is_finite() {
            WindowLevels::Bounded(BoundedWindows::new(range, levels))
        } else {
            WindowLevels::Ends(equally_spaced(range, levels))
        }
    }

    fn most_copies(&self, copies: Copies) -> usize {
        match (self, copies) {
            (_, Copies::Once) => 1,
            (WindowLevels::Ends(times), Copies::Apart) => times.len().saturating_sub(1),
            (WindowLevels::Ends(times), Copies::MayOverlap) => times.len() * times.len().saturating_sub(1) / 2,
            (WindowLevels::Bounded(bounded), Copies::Apart) => bounded.disjoint.len() - 1,
            (WindowLevels::Bounded(bounded), Copies::MayOverlap) => bounded.windows.len(),
        }
    }

    /// How many ways there are to place so many copies.
    fn count(&self, copies: Copies, count: usize) -> u128 {
        if let (WindowLevels::Bounded(bounded), Copies::Apart) = (self, copies) {
            return bounded.ways(count, bounded.windows.len());
        }
        let (of, chosen) = self.subsets(copies, count);
        subsets(of, chosen)
    }

    /// The windows of so many copies are the subsets of so many things with so many members.
    fn subsets(&self, copies: Copies, count: usize) -> (usize, usize) {
        match (self, copies) {
            // The ends of disjoint windows rise, where one may begin when the one before it ends.
            (WindowLevels::Ends(times), Copies::Apart) => (times.len() + count - 1, 2 * count),
            (WindowLevels::Ends(times), Copies::MayOverlap | Copies::Once) => {
                (times.len() * (times.len() - 1) / 2, count)
            }
            (WindowLevels::Bounded(bounded), _) => (bounded.windows.len(), count),
        }
    }

    /// The windows of so many copies of a rank below their reached [`WindowLevels::count`], in their order.
    fn windows(&self, copies: Copies, count: usize, rank: u128) -> Vec<(f64, f64)> {
        let size = reached(self.count(copies, count));
        if let (WindowLevels::Bounded(bounded), Copies::Apart) = (self, copies) {
            return bounded.disjoint_windows(count, size, rank);
        }
        let (of, chosen) = self.subsets(copies, count);
        let members = subset(of, chosen, size, rank);
        match self {
            WindowLevels::Bounded(bounded) => members.iter().map(|&window| bounded.windows[window]).collect(),
            WindowLevels::Ends(times) if copies == Copies::Apart => {
                members.chunks(2).zip(0..).map(|(ends, at)| (times[ends[0] - at], times[ends[1] - at])).collect()
            }
            WindowLevels::Ends(times) => {
                let ends = members.iter().map(|&window| pair(times.len(), window as u128));
                ends.map(|(start, end)| (times[start], times[end])).collect()
            }
        }
    }
}

/// Windows whose beginning is a level of the times that leave room for the longest one, and whose length is a level of
/// the permitted lengths.
#[derive(Debug, Clone)]
struct BoundedWindows {
    /// In the order of their ends.
    windows: Vec<(f64, f64)>,
    /// Per window, how many windows end before it begins: the first ones.
    before: Vec<usize>,
    /// Per number of copies, in how many ways so many disjoint windows can be chosen of none, the first, the first two,
    /// and so on. The last number of copies is the greatest for which there is a way.
    disjoint: Vec<Vec<u128>>,
}

impl BoundedWindows {
    fn new(range: Range, levels: u32) -> Self {
        // What rounding leaves next to a window that takes all of the time is not a place to begin.
        let spare = range.high - range.low - range.longest;
        let last = if spare > 1e-9 * range.longest { range.high - range.longest } else { range.low };
        let starts = equally_spaced(Range::between(range.low, last), levels);
        let lengths = equally_spaced(Range::between(range.shortest, range.longest), levels);
        let ends = |start: f64| lengths.iter().map(move |length| (start, (start + length).min(range.high)));
        let mut windows: Vec<(f64, f64)> = starts.into_iter().flat_map(ends).collect();
        windows.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.total_cmp(&b.0)));
        let before: Vec<usize> =
            windows.iter().map(|(start, _)| windows.partition_point(|(_, end)| end <= start)).collect();
        let mut disjoint = vec![vec![1; windows.len() + 1]];
        loop {
            let fewer = &disjoint[disjoint.len() - 1];
            let mut ways: Vec<u128> = vec![0];
            for &before in &before {
                // Without this window, or with it and others before it.
                ways.push((ways[ways.len() - 1] + fewer[before]).min(COUNTED));
            }
            if ways[ways.len() - 1] == 0 {
                return BoundedWindows { windows, before, disjoint };
            }
            disjoint.push(ways);
        }
    }

    /// In how many ways so many disjoint windows can be chosen of the first ones.
    fn ways(&self, copies: usize, of: usize) -> u128 {
        self.disjoint.get(copies).map_or(0, |ways| ways[of])
    }

    /// The disjoint windows of a rank below `size`, in their order.
    fn disjoint_windows(&self, copies: usize, mut size: u128, mut rank: u128) -> Vec<(f64, f64)> {
        let (mut left, mut of) = (copies, self.windows.len());
        let mut chosen = Vec::with_capacity(copies);
        while left > 0 {
            let last = of - 1;
            let weights = [self.ways(left, last), self.ways(left - 1, self.before[last])];
            let taken;
            (taken, size, rank) = split(&weights, size, rank);
            if taken == 1 {
                chosen.push(self.windows[last]);
                (left, of) = (left - 1, self.before[last]);
            } else {
                of = last;
            }
        }
        chosen.reverse();
        chosen
    }
}

/// The levels of a parameter.
#[derive(Debug, Clone)]
enum Levels {
    Value(Vec<f64>),
    Range(Vec<f64>),
    Point([Vec<f64>; 3]),
    Items(Vec<String>),
}

/// The tests with one number of operations.
#[derive(Debug, Clone)]
struct Length {
    operations: usize,
    /// How many combinations of operations there are, and of how many a test was taken.
    combinations: u128,
    begun: u128,
    /// Combinations with tests left: their ranks, and how many of their tests were taken.
    rest: VecDeque<(u128, u128)>,
}

/// Which operations a test contains.
struct Combination {
    /// The number of copies of each kind.
    copies: Vec<usize>,
    /// How many values each of its choices has: per kind the windows of all copies, then the parameters of each copy.
    sizes: Vec<u128>,
}

impl FullFactorial {
    /// The grid of a campaign by time, with so many levels of each number.
    pub(crate) fn new(plan: &CampaignPlan, space: &TestSpace, levels: u32, seed: u64) -> Result<Self, SearchError> {
        let kinds: Vec<Kind> = space
            .operations()
            .iter()
            .map(|kind| Kind {
                operation: kind.operation,
                times: match kind.activation {
                    ActivationSpace::Time(range) => Some(WindowLevels::new(range, levels)),
                    _ => None,
                },
                copies: space.copies(),
                parameters: kind.parameters.iter().map(|parameter| Levels::new(parameter, levels)).collect(),
            })
            .collect();
        let fewest = space.fewest();
        let most = kinds.iter().fold(0usize, |sum, kind| sum.saturating_add(kind.most_copies())).min(space.most());
        if most < fewest {
            let (campaign, min) = (plan.campaign.name.clone(), plan.campaign.count.min);
            return Err(SearchError::TooFew { campaign, min, most });
        }
        // Without any kind there is one way to hold nothing.
        let mut tests = vec![0; most + 1];
        tests[0] = 1;
        let mut ways = vec![tests.clone()];
        for kind in kinds.iter().rev() {
            let copies = 0..=kind.most_copies().min(most);
            ways.push(convolved(&ways[ways.len() - 1], &vec![1; copies.clone().count()], COUNTED));
            let products: Vec<u128> = copies.map(|copies| product(&kind.sizes(copies))).collect();
            tests = convolved(&tests, &products, u128::MAX);
        }
        ways.reverse();
        let lengths = (fewest..=most)
            .map(|operations| Length {
                operations,
                combinations: reached(ways[0][operations]),
                begun: 0,
                rest: VecDeque::new(),
            })
            .collect();
        let tests = tests[fewest..].iter().fold(0, |sum: u128, &count| sum.saturating_add(count));
        Ok(FullFactorial { seed, kinds, ways, lengths, tests })
    }

    /// The next test with a number of operations; `None` if all were taken.
    fn next(&self, length: &mut Length, index: u32) -> Option<Test> {
        let key = derive_seed(self.seed, "grid length", &[length.operations as u64]);
        let (rank, taken) = if length.begun < length.combinations {
            length.begun += 1;
            (permuted(key, length.combinations, length.begun - 1), 0)
        } else {
            length.rest.pop_front()?
        };
        let combination = self.combination(length, rank);
        let tests = product(&combination.sizes);
        if taken + 1 < tests {
            length.rest.push_back((rank, taken + 1));
        }
        #[expect(clippy::cast_possible_truncation, reason = "a key is made of both halves")]
        let key = derive_seed(key, "grid combination", &[(rank >> 64) as u64, rank as u64]);
        Some(self.chosen(&combination, &spread(key, taken, &combination.sizes), index))
    }

    /// The combination of a rank below [`Length::combinations`].
    fn combination(&self, length: &Length, rank: u128) -> Combination {
        let (mut size, mut rank, mut left) = (length.combinations, rank, length.operations);
        let mut copies = Vec::with_capacity(self.kinds.len());
        for (at, kind) in self.kinds.iter().enumerate() {
            let weights: Vec<u128> =
                (0..=kind.most_copies().min(left)).map(|copies| self.ways[at + 1][left - copies]).collect();
            let chosen;
            (chosen, size, rank) = split(&weights, size, rank);
            copies.push(chosen);
            left -= chosen;
        }
        let sizes = self.kinds.iter().zip(&copies).flat_map(|(kind, &copies)| kind.sizes(copies)).map(reached);
        let sizes = sizes.collect();
        Combination { copies, sizes }
    }

    /// The test of a combination with the ranks of its choices.
    fn chosen(&self, combination: &Combination, ranks: &[u128], index: u32) -> Test {
        let mut ranks = ranks.iter().copied();
        let mut next = || ranks.next().expect("each choice has its rank");
        let mut operations = Vec::new();
        for (kind, &copies) in self.kinds.iter().zip(&combination.copies) {
            if copies == 0 {
                continue;
            }
            for activation in kind.activations(copies, next()) {
                let parameters = kind.parameters.iter().map(|levels| levels.choice(&mut next)).collect();
                let operation_seed = derive_seed(self.seed, "grid", &[u64::from(index), operations.len() as u64]);
                let operation = kind.operation;
                operations.push(TestOperation { operation, activation, parameters, operation_seed, messages: None });
            }
        }
        Test { operations }
    }
}

impl Sampling for FullFactorial {
    fn test(&mut self, index: u32) -> Option<Test> {
        while let Some(mut length) = self.lengths.pop_front() {
            if let Some(test) = self.next(&mut length, index) {
                self.lengths.push_back(length);
                return Some(test);
            }
        }
        None
    }

    fn tests(&self) -> Option<u128> {
        Some(self.tests)
    }

    fn ended(&self, evaluated: u32) -> Option<String> {
        Some(match self.tests {
            u128::MAX => format!("{evaluated} of the more than 10^38 tests of the grid were evaluated"),
            tests if tests == u128::from(evaluated) => format!("all {tests} tests of the grid were evaluated"),
            tests => format!("{evaluated} of the {tests} tests of the grid were evaluated"),
        })
    }
}

impl Kind {
    fn most_copies(&self) -> usize {
        // A short time may have fewer levels than the campaign asks for.
        self.times.as_ref().map_or(1, |times| times.most_copies(self.copies))
    }

    /// How many values each choice of so many copies has: the windows of all, then the parameters of each.
    fn sizes(&self, copies: usize) -> Vec<u128> {
        if copies == 0 {
            return Vec::new();
        }
        let windows = self.times.as_ref().map_or(1, |times| times.count(self.copies, copies));
        let parameters: Vec<u128> = self.parameters.iter().flat_map(Levels::sizes).collect();
        [windows].into_iter().chain(std::iter::repeat_n(parameters, copies).flatten()).collect()
    }

    /// When so many copies are active, in the order of their windows.
    fn activations(&self, copies: usize, rank: u128) -> Vec<Activation> {
        let Some(times) = &self.times else { return vec![Activation::Offline] };
        let windows = times.windows(self.copies, copies, rank).into_iter();
        windows.map(|(start, end)| Activation::Time { start, end }).collect()
    }
}

impl Levels {
    fn new(parameter: &ParameterSpace, levels: u32) -> Self {
        match parameter {
            ParameterSpace::Number(range, ChoiceKind::Value) => Levels::Value(equally_spaced(*range, levels)),
            ParameterSpace::Number(range, ChoiceKind::Range) => Levels::Range(equally_spaced(*range, levels)),
            ParameterSpace::Point(axes) => Levels::Point(axes.map(|axis| equally_spaced(axis, levels))),
            ParameterSpace::Items(items) => Levels::Items(items.clone()),
        }
    }

    /// How many values each choice has that makes up the parameter.
    fn sizes(&self) -> Vec<u128> {
        match self {
            Levels::Value(levels) => vec![levels.len() as u128],
            Levels::Range(levels) => vec![subsets(levels.len() + 1, 2)],
            Levels::Point(axes) => axes.iter().map(|levels| levels.len() as u128).collect(),
            Levels::Items(items) => vec![items.len() as u128],
        }
    }

    /// The choice of the next ranks.
    fn choice(&self, next: &mut impl FnMut() -> u128) -> Choice {
        match self {
            Levels::Value(levels) => Choice::Value { value: levels[place(next())] },
            Levels::Range(levels) => {
                // A sub-range of one level is a pair whose second member is the next thing after the first.
                let (low, above) = pair(levels.len() + 1, next());
                Choice::Range { low: levels[low], high: levels[above - 1] }
            }
            Levels::Point(axes) => Choice::Point { point: axes.each_ref().map(|levels| levels[place(next())]) },
            Levels::Items(items) => Choice::Text { text: items[place(next())].clone() },
        }
    }
}

/// So many numbers of a range, its ends among them, equally spaced (whole ones as nearly as can be), each once; fewer
/// where the range has fewer.
fn equally_spaced(range: Range, levels: u32) -> Vec<f64> {
    let room = range.high - range.low;
    let steps = if range.integer { f64::from(levels - 1).min(room) } else { f64::from(levels - 1) };
    let number = |at: u32| {
        if range.integer {
            range.low + libm::rint(f64::from(at) * room / steps)
        } else {
            range.at(f64::from(at) / steps)
        }
    };
    if range.is_fixed() {
        return vec![range.low];
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is below the number of levels")]
    let mut numbers: Vec<f64> = (0..=steps as u32).map(number).collect();
    // A range of a few adjacent floating-point numbers does not have so many.
    numbers.dedup();
    numbers
}

/// The ranks of choices with so many values each, in the `index`th of all combinations of them. Along the index each
/// value of each choice is taken once before one is taken again, as far as the numbers of values permit.
///
/// With the larger choices first, the index is a number whose digits are values of the choices. Each digit is shifted
/// by an amount that the digits before it determine, so equal indices, and no others, give equal ranks; and the shift
/// goes through all values of the digit while the digit itself stays.
fn spread(key: u64, index: u128, sizes: &[u128]) -> Vec<u128> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&at| std::cmp::Reverse(sizes[at]));
    let mut ranks = vec![0; sizes.len()];
    // The product of the sizes before.
    let mut before: u128 = 1;
    for at in order {
        let size = sizes[at];
        let (digit, earlier) = ((index / before) % size, index % before);
        #[expect(clippy::cast_possible_truncation, reason = "indices are numbers of tests that were run")]
        let group = derive_seed(key, "grid shift", &[at as u64, (earlier / size) as u64]);
        let digits = derive_seed(key, "grid digit", &[at as u64]);
        ranks[at] = (permuted(digits, size, digit) + permuted(group, size, earlier % size)) % size;
        before = before.saturating_mul(size);
    }
    ranks
}

/// Where a rank is in an order of `0..size` that looks random and is determined by a key: a Feistel network over the
/// next larger power of four, applied until it comes back below the size.
fn permuted(key: u64, size: u128, rank: u128) -> u128 {
    if size <= 1 {
        return 0;
    }
    let half = (128 - (size - 1).leading_zeros()).div_ceil(2);
    let mask = (1u128 << half) - 1;
    let mut found = rank;
    loop {
        let (mut left, mut right) = (found >> half, found & mask);
        for round in 0..4 {
            #[expect(clippy::cast_possible_truncation, reason = "half of a size has at most 50 bits")]
            let hash = derive_seed(key, "grid order", &[round, right as u64]);
            (left, right) = (right, left ^ (u128::from(hash) & mask));
        }
        found = left << half | right;
        if found < size {
            return found;
        }
    }
}

/// The number of subsets of so many things with so many members; [`COUNTED`] if there are as many or more.
fn subsets(of: usize, members: usize) -> u128 {
    let members = if members > of { return 0 } else { members.min(of - members) };
    let mut count: u128 = 1;
    for at in 0..members {
        count = count * (of - at) as u128 / (at + 1) as u128;
        if count >= COUNTED {
            return COUNTED;
        }
    }
    count
}

/// How many members of a set with so many can be reached.
fn reached(count: u128) -> u128 {
    if count < COUNTED { count } else { REACHED }
}

/// The subset of a rank below `size`, rising; `size` is [`reached`] of the number of subsets.
fn subset(of: usize, members: usize, mut size: u128, mut rank: u128) -> Vec<usize> {
    let mut chosen = Vec::with_capacity(members);
    for thing in 0..of {
        let (open, left) = ((members - chosen.len()) as u128, (of - thing) as u128);
        if open == 0 {
            break;
        }
        // This share of the subsets that are left has the thing. If all can be reached, it is a whole number.
        let with = size * open / left;
        if rank < with {
            chosen.push(thing);
            size = with;
        } else {
            rank -= with;
            size -= with;
        }
    }
    chosen
}

/// The pair of a rank, of different things in rising order.
fn pair(of: usize, rank: u128) -> (usize, usize) {
    let pair = subset(of, 2, subsets(of, 2), rank);
    (pair[0], pair[1])
}

/// The branch to which a rank below `size` leads if branches have so many members, with the size of the branch and the
/// rank in it. If not all members can be reached, branches have their shares of `size`.
fn split(members: &[u128], size: u128, rank: u128) -> (usize, u128, u128) {
    let total: u128 = members.iter().sum();
    let last = members.iter().rposition(|&count| count > 0).expect("one branch has members");
    let scale = (128 - total.leading_zeros()).saturating_sub(60);
    let mut rest = (size, rank);
    for (branch, &count) in members.iter().enumerate() {
        let share = match branch {
            _ if branch == last => rest.0,
            _ if total == size => count,
            _ => size * (count >> scale) / (total >> scale),
        };
        if rest.1 < share {
            return (branch, share, rest.1);
        }
        rest = (rest.0 - share, rest.1 - share);
    }
    unreachable!("the last branch takes all that is left")
}

/// How many combinations of values choices with so many values have; [`u128::MAX`] if one is not counted.
fn product(sizes: &[u128]) -> u128 {
    let counted = |size: u128| if size < COUNTED { size } else { u128::MAX };
    sizes.iter().fold(1, |product: u128, &size| product.saturating_mul(counted(size)))
}

/// Counts per number of operations with one kind more, which has so many for each number of copies.
fn convolved(counts: &[u128], kind: &[u128], most: u128) -> Vec<u128> {
    let sum = |length: usize| {
        (0..kind.len().min(length + 1))
            .map(|copies| kind[copies].saturating_mul(counts[length - copies]))
            .fold(0, u128::saturating_add)
    };
    (0..counts.len()).map(|length| sum(length).min(most)).collect()
}

fn place(rank: u128) -> usize {
    usize::try_from(rank).expect("a level is one of those that were listed")
}

#[cfg(test)]
mod tests;
