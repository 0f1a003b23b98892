//! Construction of tests: the reduction of tests to points, inverted.
//!
//! Given a test and a cell, [`CellPlacer::place_in_cell`] changes the test as little as possible so that its point lies
//! in the cell. The reduction discards almost everything, so almost everything can stay: the number of operations,
//! unless the cell counts them; the order of their windows; and the middle of a sub-range, since only its width counts.
//!
//! 1. *Numbers of operations* (O0 to O3): operations are added, removed or replaced until all numbers are in the cell.
//! 2. *Timing* (T1 to T3): midpoints come first, since they limit how long windows can be. All are shifted by the same
//!    amount until T1 is in the cell, and moved towards the middles of their permitted windows until there is room for
//!    the lengths that the cell requires (T2); then they are moved apart or together until T3 is in the cell. Then the
//!    lengths are changed by the same amount until their mean is in the cell, each within the shortest length and the
//!    longest that its midpoint permits. The permitted midpoints form a convex set, and they are farthest apart at one
//!    of its vertices, as in the computation of feasible cells; so every spread up to that one is found.
//! 3. *Intensity* (P1, P2): likewise with the normalised parameters.
//!
//! Where copies of one operation must not be active at the same time, its window is first divided among them, in their
//! order: each has a part to itself, and may be placed anywhere in it.
//!
//! The first attempts begin with the test itself, the next ones with the numbers of operations of each kind that
//! reach the cell according to the computation of feasible cells, and the last ones with fresh tests. The result is
//! reduced again and kept only if it lies in the cell, so integers and rounding can make an attempt fail but never
//! put a test into another cell.

mod spread;

use spread::{Member, Wanted};

use sesame_base::observation::Observation;
use sesame_plan::{Activation, CampaignPlan, Choice, Copies, Dimension, Domain, OperationId, Test, TestOperation};
use sesame_rng::Stream;

use crate::coverage::{Feasible, Grid};
use crate::space::initial::{fresh_operation, fresh_test};
use crate::space::parameter_space::ParameterSpace;
use crate::space::test_space::TestSpace;
use crate::space::test_space::{ActivationSpace, OperationSpace};
use crate::sspr::{Class, Convention, Point, planned};

/// Attempts from the test itself, each with different random choices.
const FROM_THE_TEST: u32 = 4;
/// Attempts from each way to compose a test that is known to reach the cell.
const FROM_A_WAY: u32 = 2;
/// How much room midpoints leave for lengths above the least mean length that the cell requires, as a share of the
/// range that the cell permits: in first attempts, and in later ones, which look for tests that are hard to reach.
const SHARES_FOR_LENGTHS: [f64; 2] = [0.02, 1e-4];
/// Attempts from fresh tests after those.
const FROM_FRESH: u32 = 4;

/// Puts tests of one campaign by time into cells of one grid.
#[derive(Debug, Clone)]
pub(crate) struct CellPlacer {
    test_space: TestSpace,
    grid: Grid,
    feasible: Feasible,
    copies: Copies,
}

/// What a cell requires: per dimension of the grid, the lower bound (inclusive) and the upper bound (exclusive).
struct Demands(Vec<(Dimension, (f64, f64))>);

impl Demands {
    fn of(&self, dimension: Dimension) -> Option<(f64, f64)> {
        self.0.iter().find(|(demanded, _)| *demanded == dimension).map(|(_, ends)| *ends)
    }

    fn any_of(&self, dimensions: &[Dimension]) -> bool {
        dimensions.iter().any(|&dimension| self.of(dimension).is_some())
    }
}

/// The permitted window of an operation and its chosen window inside it, both as shares of `within`.
struct Window {
    at: usize,
    low: f64,
    high: f64,
    shortest: f64,
    longest: f64,
    start: f64,
    end: f64,
}

/// A number of an operation's parameters that counts in P1 and P2.
struct Number {
    operation: usize,
    parameter: usize,
    axis: usize,
    member: Member,
}

impl CellPlacer {
    pub(crate) fn new(test_space: TestSpace, grid: Grid, feasible: Feasible, copies: Copies) -> Self {
        CellPlacer { test_space, grid, feasible, copies }
    }

    /// Learns from the reference run when there are messages to disturb, for the fresh operations of its tests.
    pub(super) fn take_reference(&mut self, reference: &Observation) {
        self.test_space.take_reference(reference);
    }

    /// A permitted test in a cell, similar to the given one; `None` if none was found.
    pub(crate) fn place_in_cell(
        &self,
        test: &Test,
        cell: usize,
        plan: &CampaignPlan,
        stream: &mut Stream,
    ) -> Option<Test> {
        let places = self.grid.axes().iter().zip(self.grid.place(cell));
        let demands = Demands(places.map(|(axis, at)| (axis.dimension, Grid::bounds(axis, at))).collect());
        let from_the_test = (0..FROM_THE_TEST).find_map(|attempt| {
            let begun = self.numbered(test.clone(), &demands, plan, stream)?;
            self.finished(begun, test, cell, &demands, plan, attempt, stream)
        });
        if from_the_test.is_some() {
            return from_the_test;
        }
        for way in self.feasible.ways(cell) {
            let built = (0..FROM_A_WAY).find_map(|attempt| {
                let begun = self.made_of(test, &way, stream)?;
                self.finished(begun, test, cell, &demands, plan, attempt, stream)
            });
            if built.is_some() {
                return built;
            }
        }
        (0..FROM_FRESH).find_map(|attempt| {
            let begun = self.numbered(self.fresh(stream), &demands, plan, stream)?;
            self.finished(begun, test, cell, &demands, plan, attempt, stream)
        })
    }

    /// The test with windows and parameters moved into the cell; `None` if this attempt failed.
    #[expect(clippy::too_many_arguments, reason = "everything that an attempt depends on")]
    fn finished(
        &self,
        mut built: Test,
        origin: &Test,
        cell: usize,
        demands: &Demands,
        plan: &CampaignPlan,
        attempt: u32,
        stream: &mut Stream,
    ) -> Option<Test> {
        if !self.time(&mut built, demands, plan, attempt, stream) || !self.grade(&mut built, demands, plan, stream) {
            return None;
        }
        for (at, operation) in built.operations.iter_mut().enumerate() {
            let changed = origin.operations.get(at).is_none_or(|before| before != operation);
            if changed {
                operation.operation_seed = stream.bits();
            }
        }
        self.test_space.settle(&mut built, stream);
        let point = Point::from_disturbances(&planned(plan, &built)?, Convention::Ours)?;
        (self.grid.cell_of(&point) == Some(cell)).then_some(built)
    }

    /// A test with this number of operations of each kind: those that the given test has, and fresh ones. It has copies
    /// of an operation only where the kind has no other operations. If the test then has too few operations, offline
    /// ones are added; `None` where that is impossible.
    fn made_of(&self, test: &Test, way: &[(&[OperationId], usize)], stream: &mut Stream) -> Option<Test> {
        let mut operations = Vec::new();
        for &(kind, count) in way {
            let mut taken: Vec<OperationId> = Vec::new();
            for operation in &test.operations {
                let id = operation.operation;
                if taken.len() < count && kind.contains(&id) && !taken.contains(&id) {
                    operations.push(operation.clone());
                    taken.push(id);
                }
            }
            while taken.len() < count {
                // Every operation gets its next copy before any gets a second one.
                let times = |id: OperationId| taken.iter().filter(|&&other| other == id).count();
                let fewest = kind.iter().map(|&id| times(id)).min().unwrap_or_default();
                let open: Vec<OperationId> = kind.iter().copied().filter(|&id| times(id) == fewest).collect();
                let id = open[stream.below(open.len())];
                let operation_space = self.test_space.find(id).expect("operations that reach a cell are permitted");
                operations.push(fresh_operation(operation_space, stream));
                taken.push(id);
            }
        }
        let kinds = self.test_space.operations().iter();
        let beside: Vec<&OperationSpace> = kinds.filter(|kind| kind.activation == ActivationSpace::Offline).collect();
        let mut built = Test { operations };
        while built.operations.len() < self.test_space.fewest() {
            let one = self.another(&beside, &built, stream)?;
            built.operations.push(one);
        }
        let order = stream.permutation(built.operations.len());
        Some(Test { operations: order.into_iter().map(|at| built.operations[at].clone()).collect() })
    }

    /// The test with the numbers of operations that the cell requires.
    fn numbered(&self, mut test: Test, demands: &Demands, plan: &CampaignPlan, stream: &mut Stream) -> Option<Test> {
        self.number(&mut test, demands, plan, stream).then_some(test)
    }

    /// A fresh instance of one of these operations: if copies cannot overlap, of one that the test does not contain,
    /// where there is one.
    fn another(&self, of: &[&OperationSpace], test: &Test, stream: &mut Stream) -> Option<TestOperation> {
        let held =
            |kind: &OperationSpace| test.operations.iter().any(|operation| operation.operation == kind.operation);
        let new: Vec<&OperationSpace> = of.iter().copied().filter(|kind| !held(kind)).collect();
        let open = match self.copies {
            Copies::MayOverlap => of,
            Copies::Apart if new.is_empty() => of,
            Copies::Apart | Copies::Once => &new,
        };
        (!open.is_empty()).then(|| fresh_operation(open[stream.below(open.len())], stream))
    }

    /// A fresh test in which about half of the operations are replaced by uniformly drawn ones: a cell may require
    /// operations that fresh tests rarely contain.
    fn fresh(&self, stream: &mut Stream) -> Test {
        let kinds: Vec<&OperationSpace> = self.test_space.operations().iter().collect();
        let mut test = fresh_test(&self.test_space, stream);
        for at in 0..test.operations.len() {
            if stream.chance(0.5)
                && let Some(other) = self.another(&kinds, &test, stream)
            {
                test.operations[at] = other;
            }
        }
        test
    }

    fn kind_of(&self, operation: &TestOperation) -> &OperationSpace {
        self.test_space.find(operation.operation).expect("a test of a campaign holds operations of that campaign")
    }

    /// Adds, removes and replaces operations until their numbers are in the cell: a random walk, of which each step
    /// corrects a number that is too small or too large.
    fn number(&self, test: &mut Test, demands: &Demands, plan: &CampaignPlan, stream: &mut Stream) -> bool {
        let class = |kind: &OperationSpace| plan.operation(kind.operation).kind.class();
        let active = |kind: &OperationSpace| kind.activation != ActivationSpace::Offline;
        let is = |kind: &OperationSpace, dimension: Dimension| {
            active(kind)
                && match dimension {
                    Dimension::O1 => class(kind) == Class::Value,
                    Dimension::O2 => class(kind) == Class::Loss,
                    Dimension::O3 => class(kind) == Class::Delay,
                    // Every operation with a parameter that counts.
                    Dimension::P1 | Dimension::P2 => graded(plan, kind),
                    Dimension::O0 | Dimension::T1 | Dimension::T2 | Dimension::T3 => true,
                }
        };
        // A test with a point has an active operation; P1 and P2 need one with a parameter that counts, and a positive
        // spread needs two.
        let least = |dimension: Dimension| match (dimension, demands.of(dimension)) {
            (Dimension::T3 | Dimension::P2, Some((low, _))) if low > 0.0 => Some(2.0),
            (Dimension::T1 | Dimension::T2 | Dimension::T3 | Dimension::P1 | Dimension::P2, Some(_)) => Some(1.0),
            _ => None,
        };
        for _ in 0..4 * self.test_space.most() + 8 {
            let wrong = demands.0.iter().find_map(|&(dimension, (low, high))| {
                let these =
                    test.operations.iter().filter(|operation| is(self.kind_of(operation), dimension)).count() as f64;
                let (low, high) = match dimension {
                    Dimension::O0 | Dimension::O1 | Dimension::O2 | Dimension::O3 => (low, high),
                    _ => (least(dimension)?, f64::INFINITY),
                };
                (these < low || these >= high).then_some((dimension, these < low))
            });
            let Some((dimension, too_few)) = wrong else { return true };
            let operations = &test.operations;
            // Those that may be removed: of the kind of which there are too many, or not of the kind of which there are
            // too few.
            let leaving: Vec<usize> =
                (0..operations.len()).filter(|&at| is(self.kind_of(&operations[at]), dimension) != too_few).collect();
            let coming: Vec<&OperationSpace> =
                self.test_space.operations().iter().filter(|kind| is(kind, dimension) == too_few).collect();
            let replaces = !leaving.is_empty() && !coming.is_empty();
            let resizes = if too_few {
                !coming.is_empty() && operations.len() < self.test_space.most()
            } else {
                !leaving.is_empty() && operations.len() > self.test_space.fewest()
            };
            if !replaces && !resizes {
                return false;
            }
            if replaces && (!resizes || stream.chance(0.5)) {
                let at = leaving[stream.below(leaving.len())];
                let Some(other) = self.another(&coming, test, stream) else { return false };
                test.operations[at] = other;
            } else if too_few {
                let Some(other) = self.another(&coming, test, stream) else { return false };
                test.operations.insert(stream.below(test.operations.len() + 1), other);
            } else {
                test.operations.remove(leaving[stream.below(leaving.len())]);
            }
        }
        false
    }

    /// The windows of the operations that are active by time.
    fn windows(&self, test: &Test, plan: &CampaignPlan) -> Vec<Window> {
        let windows = test.operations.iter().enumerate().filter_map(|(at, operation)| {
            let ActivationSpace::Time(range) = &self.kind_of(operation).activation else { return None };
            let Activation::Time { start, end } = operation.activation else { return None };
            let within = plan.operation(operation.operation).within;
            let share = |time: f64| (time - within.start) / within.length();
            Some(Window {
                at,
                low: share(range.low),
                high: share(range.high),
                shortest: range.shortest / within.length(),
                longest: range.longest / within.length(),
                start: share(start),
                end: share(end),
            })
        });
        windows.collect()
    }

    /// Divides the window of an operation among its copies, in the order of their starts. The first attempt divides
    /// between copies that are already disjoint; the second gives all but one the length that the cell requires,
    /// towards the cell's side of the window; the third divides evenly, and later ones at random. False where there are
    /// too many copies.
    fn divide(
        &self,
        windows: &mut [Window],
        test: &Test,
        demands: &Demands,
        attempt: u32,
        stream: &mut Stream,
    ) -> bool {
        if self.copies == Copies::MayOverlap {
            return true;
        }
        let kind = |window: &Window| test.operations[window.at].operation;
        let mut kinds: Vec<OperationId> = windows.iter().map(kind).collect();
        kinds.sort_unstable_by_key(|id| id.0);
        kinds.dedup();
        for id in kinds {
            let mut copies: Vec<usize> = (0..windows.len()).filter(|&at| kind(&windows[at]) == id).collect();
            if copies.len() < 2 {
                continue;
            }
            if self.copies == Copies::Once {
                return false;
            }
            copies.sort_by(|&a, &b| windows[a].start.total_cmp(&windows[b].start));
            let Window { low, high, shortest, .. } = windows[copies[0]];
            // Each gets slightly more than the shortest length, so that rounding does not make it shorter.
            let least = 1.001 * shortest;
            let spare = (high - low) - copies.len() as f64 * least;
            if spare < 0.0 {
                return false;
            }
            let pairs = || copies.windows(2).map(|pair| (windows[pair[0]].end, windows[pair[1]].start));
            let apart = pairs().all(|(end, start)| end <= start);
            let even = (high - low) / copies.len() as f64;
            let widths: Vec<f64> = match attempt + u32::from(!apart) {
                0 => {
                    let ends = pairs().map(|(end, start)| f64::midpoint(end, start)).chain([high]);
                    let begins = std::iter::once(low).chain(pairs().map(|(end, start)| f64::midpoint(end, start)));
                    ends.zip(begins).map(|(end, begin)| end - begin).collect()
                }
                1 => {
                    let (t1, t2) = (demands.of(Dimension::T1), demands.of(Dimension::T2));
                    let length = t2.map_or(least, |(from, to)| f64::midpoint(from.max(0.0), to.min(high - low)));
                    let wide = t1.is_some_and(|(from, to)| {
                        f64::midpoint(from.max(low), to.min(high)) > f64::midpoint(low, high)
                    });
                    let wide = if wide { 0 } else { copies.len() - 1 };
                    let narrow = length.max(least).min(even);
                    let rest = (high - low) - narrow * (copies.len() - 1) as f64;
                    (0..copies.len()).map(|at| if at == wide { rest } else { narrow }).collect()
                }
                2 => vec![even; copies.len()],
                _ => {
                    let shares: Vec<f64> =
                        copies.iter().map(|_| libm::pow(stream.unit(), 1.0 + 5.0 * stream.unit()) + 1e-9).collect();
                    let all: f64 = shares.iter().sum();
                    shares.iter().map(|share| least + spare * share / all).collect()
                }
            };
            let mut from = low;
            for (&at, width) in copies.iter().zip(widths) {
                (windows[at].low, windows[at].high) = (from, (from + width).min(high));
                from = windows[at].high;
            }
        }
        true
    }

    /// Moves the windows of operations until T1 to T3 are in the cell; false if that is impossible.
    fn time(&self, test: &mut Test, demands: &Demands, plan: &CampaignPlan, attempt: u32, stream: &mut Stream) -> bool {
        let mut windows = self.windows(test, plan);
        let timed = demands.any_of(&[Dimension::T1, Dimension::T2, Dimension::T3]);
        // If the grid has no dimension of time, windows stay, except those of copies that were added here.
        if !timed && (self.copies != Copies::Apart || !crowds(test)) {
            return true;
        }
        if windows.is_empty() || !self.divide(&mut windows, test, demands, attempt, stream) {
            return false;
        }
        let n = windows.len() as f64;
        let anything = (f64::NEG_INFINITY, f64::INFINITY);
        let [t1, t2] = [Dimension::T1, Dimension::T2].map(|dimension| demands.of(dimension).unwrap_or(anything));
        // The longer the intervals, the less room there is for their midpoints: the required lengths fit if the
        // midpoints' distances from the middles of their windows add up to at most this budget.
        let shortest = windows.iter().map(|window| window.shortest).sum::<f64>() / n;
        let width = windows.iter().map(|window| window.high - window.low).sum::<f64>() / n;
        let greatest = windows.iter().map(|window| window.longest.min(window.high - window.low)).sum::<f64>() / n;
        let longest = t2.1.min(greatest);
        let share = SHARES_FOR_LENGTHS[usize::from(attempt > 0)];
        let length = if t2.0 > shortest { t2.0 + share * (longest - t2.0) } else { shortest };
        if length > longest {
            return false;
        }
        let midpoints: Vec<Member> = windows
            .iter()
            .map(|window| Member {
                now: f64::midpoint(window.start, window.end),
                low: window.low + window.shortest / 2.0,
                high: window.high - window.shortest / 2.0,
                step: None,
            })
            .collect();
        let budget = n * (width - length) / 2.0;
        let wanted = Wanted { mean: t1, spread: demands.of(Dimension::T3), budget };
        let Some(midpoints) = spread::place(&midpoints, &wanted, stream) else { return false };
        let lengths: Vec<Member> = windows
            .iter()
            .zip(&midpoints)
            .map(|(window, midpoint)| {
                let room = 2.0 * (midpoint - window.low).min(window.high - midpoint);
                let Window { start, end, shortest, longest, .. } = *window;
                Member { now: end - start, low: shortest, high: room.min(longest).max(shortest), step: None }
            })
            .collect();
        let wanted = Wanted { mean: t2, spread: None, budget: f64::INFINITY };
        let Some(lengths) = spread::place(&lengths, &wanted, stream) else { return false };
        for ((window, length), midpoint) in windows.iter().zip(&lengths).zip(&midpoints) {
            let operation = &mut test.operations[window.at];
            let ActivationSpace::Time(range) = &self.kind_of(operation).activation else { continue };
            let within = plan.operation(operation.operation).within;
            let time = |share: f64| within.start + share * within.length();
            // Inside its part of the window: the end of one copy's part is exactly the start of the next one's.
            let part = (time(window.low).max(range.low), time(window.high).min(range.high));
            let inside = |share: f64| time(share).max(part.0).min(part.1);
            let (start, end) = (inside(midpoint - length / 2.0), inside(midpoint + length / 2.0));
            let end = end.min(start + range.longest);
            if start >= end {
                return false;
            }
            operation.activation = Activation::Time { start, end };
        }
        true
    }

    /// The numbers of a test's parameters that count in P1 and P2.
    fn numbers(&self, test: &Test, plan: &CampaignPlan) -> Vec<Number> {
        let mut numbers = Vec::new();
        for (at, operation) in test.operations.iter().enumerate() {
            let kind = self.kind_of(operation);
            if kind.activation == ActivationSpace::Offline {
                continue;
            }
            let declared = plan.operation(operation.operation).parameters.iter();
            let choices = operation.parameters.iter().zip(&kind.parameters);
            for (parameter, (declared, (choice, parameter_space))) in declared.zip(choices).enumerate() {
                let members = members(&declared.domain, parameter_space, choice).into_iter();
                numbers.extend(members.map(|(axis, member)| Number { operation: at, parameter, axis, member }));
            }
        }
        numbers
    }

    /// Changes parameters until P1 and P2 are in the cell; false if that is impossible.
    fn grade(&self, test: &mut Test, demands: &Demands, plan: &CampaignPlan, stream: &mut Stream) -> bool {
        if !demands.any_of(&[Dimension::P1, Dimension::P2]) {
            return true;
        }
        let numbers = self.numbers(test, plan);
        let members: Vec<Member> = numbers.iter().map(|number| number.member).collect();
        let anything = (f64::NEG_INFINITY, f64::INFINITY);
        let wanted = Wanted {
            mean: demands.of(Dimension::P1).unwrap_or(anything),
            spread: demands.of(Dimension::P2),
            budget: f64::INFINITY,
        };
        let Some(placed) = spread::place(&members, &wanted, stream) else { return false };
        for (number, share) in numbers.iter().zip(placed) {
            let operation = &mut test.operations[number.operation];
            let kind = self.test_space.find(operation.operation).expect("it was found before");
            let domain = &plan.operation(operation.operation).parameters[number.parameter].domain;
            let choice = &mut operation.parameters[number.parameter];
            set(choice, domain, &kind.parameters[number.parameter], number.axis, share);
        }
        true
    }
}

/// Whether a test contains several copies of an operation.
fn crowds(test: &Test) -> bool {
    let ids = test.operations.iter().map(|operation| operation.operation);
    ids.clone().enumerate().any(|(at, id)| ids.clone().take(at).any(|other| other == id))
}

/// Whether a kind of operation has a parameter that counts in P1 and P2.
fn graded(plan: &CampaignPlan, kind: &OperationSpace) -> bool {
    let declared = plan.operation(kind.operation).parameters.iter();
    declared.zip(&kind.parameters).any(|(declared, parameter_space)| match (&declared.domain, parameter_space) {
        (Domain::Number { low, high, .. }, ParameterSpace::Number(..)) => low < high,
        (Domain::Point { low, high }, _) => (0..3).any(|axis| low[axis] < high[axis]),
        _ => false,
    })
}

/// The numbers of one parameter, as shares of the permitted range, each with its axis.
fn members(domain: &Domain, parameter_space: &ParameterSpace, choice: &Choice) -> Vec<(usize, Member)> {
    match (domain, parameter_space, choice) {
        (&Domain::Number { low, high, .. }, ParameterSpace::Number(range, _), choice) if low < high => {
            let width = high - low;
            let step = range.integer.then_some(1.0 / width);
            let member = match choice {
                Choice::Value { value } => Member {
                    now: (value - low) / width,
                    low: (range.low - low) / width,
                    high: (range.high - low) / width,
                    step,
                },
                Choice::Range { low: from, high: to } => {
                    Member { now: (to - from) / width, low: 0.0, high: (range.high - range.low) / width, step }
                }
                _ => return Vec::new(),
            };
            vec![(0, member)]
        }
        (Domain::Point { low, high }, _, Choice::Point { point }) => (0..3)
            .filter(|&axis| low[axis] < high[axis])
            .map(|axis| {
                let now = (point[axis] - low[axis]) / (high[axis] - low[axis]);
                (axis, Member { now, low: 0.0, high: 1.0, step: None })
            })
            .collect(),
        _ => Vec::new(),
    }
}

/// Sets one number of a parameter to a share of the permitted range. A sub-range keeps its middle as far as possible.
fn set(choice: &mut Choice, domain: &Domain, parameter_space: &ParameterSpace, axis: usize, share: f64) {
    match (choice, domain, parameter_space) {
        (Choice::Value { value }, Domain::Number { low, high, .. }, ParameterSpace::Number(range, _)) => {
            let set = low + share * (high - low);
            *value = if range.integer { libm::rint(set) } else { set }.clamp(range.low, range.high);
        }
        (Choice::Range { low: from, high: to }, Domain::Number { low, high, .. }, ParameterSpace::Number(range, _)) => {
            let whole = |x: f64| if range.integer { libm::rint(x) } else { x };
            let width = whole(share * (high - low)).min(range.high - range.low);
            let start = whole(f64::midpoint(*from, *to) - width / 2.0).min(range.high - width).max(range.low);
            (*from, *to) = (start, (start + width).min(range.high));
        }
        (Choice::Point { point }, Domain::Point { low, high }, _) => {
            point[axis] = (low[axis] + share * (high[axis] - low[axis])).clamp(low[axis], high[axis]);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests;
