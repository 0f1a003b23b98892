//! Construction of tests: the reduction of tests to points, inverted.
//!
//! Given a test and a cell, [`Constructor::place_in_cell`] changes the test as little as may be so that its point lies in the
//! cell. The reduction throws away almost everything, so almost everything can stay: how many operations there are unless
//! the cell counts them, the order of their windows, and of a sub-range its middle, as only its width is counted.
//!
//! 1. *Numbers of operations* (O0 to O3): operations are added, removed or replaced until all are as the cell wants them.
//! 2. *Timing* (T1 to T3): all lengths are moved by one amount until their mean (T2) is in the cell, each kept between the
//!    shortest and its window; that is the nearest point of the set of lengths with such a mean. Then all midpoints are,
//!    until T1 is, and their distances from their mean are scaled until T3 is.
//! 3. *Intensity* (P1, P2): likewise with the normalised parameters.
//!
//! What comes out is reduced again and kept only if it lies in the cell, so whole numbers and rounding can cost an attempt
//! but never put a test into another cell. The attempts after the first begin at random changes of the test, the last ones
//! at fresh tests.

mod spread;

use sesame_plan::{Activation, CampaignPlan, Choice, Dimension, Domain, Test, TestOperation};

use crate::coverage::Grid;
use crate::rng::Stream;
use crate::search::Permitted;
use crate::search::choice::PermittedChoice;
use crate::search::initial::{fresh_operation, fresh_test};
use crate::search::permitted::{PermittedActivation, PermittedOperation};
use crate::sspr::{Class, Convention, Point, class_of, planned};
use spread::{Member, Wanted};

/// Attempts from the test itself, with other random choices each.
const FROM_THE_TEST: u32 = 8;
/// Attempts from fresh tests after those.
const FROM_FRESH: u32 = 8;

/// Puts tests of one campaign by time into cells of one grid.
#[derive(Debug, Clone)]
pub(crate) struct Constructor {
    permitted: Permitted,
    grid: Grid,
}

/// What a cell demands: per dimension of the grid the values from the first up to, not including, the second.
struct Demands(Vec<(Dimension, (f64, f64))>);

impl Demands {
    fn of(&self, dimension: Dimension) -> Option<(f64, f64)> {
        self.0.iter().find(|(it, _)| *it == dimension).map(|(_, ends)| *ends)
    }

    fn any_of(&self, dimensions: &[Dimension]) -> bool {
        dimensions.iter().any(|&dimension| self.of(dimension).is_some())
    }
}

/// Where a permitted window lies, and an operation's in it, in shares of `within`.
struct Window {
    at: usize,
    low: f64,
    high: f64,
    shortest: f64,
    start: f64,
    end: f64,
}

/// A number that an operation's parameters count with.
struct Number {
    operation: usize,
    parameter: usize,
    axis: usize,
    member: Member,
}

impl Constructor {
    pub(crate) fn new(permitted: Permitted, grid: Grid) -> Self {
        Constructor { permitted, grid }
    }

    /// A permitted test in a cell, like the given one; `None` where none was found.
    pub(crate) fn place_in_cell(
        &self,
        test: &Test,
        cell: usize,
        plan: &CampaignPlan,
        stream: &mut Stream,
    ) -> Option<Test> {
        let places = self.grid.axes().iter().zip(self.grid.place(cell));
        let demands = Demands(places.map(|(axis, at)| (axis.dimension, Grid::bounds(axis, at))).collect());
        (0..FROM_THE_TEST + FROM_FRESH).find_map(|attempt| {
            let mut built = if attempt < FROM_THE_TEST { test.clone() } else { self.fresh(stream) };
            let done = self.number(&mut built, &demands, plan, stream)
                && self.time(&mut built, &demands, plan, attempt, stream)
                && self.grade(&mut built, &demands, plan, stream);
            if !done {
                return None;
            }
            for (at, operation) in built.operations.iter_mut().enumerate() {
                let changed = test.operations.get(at).is_none_or(|before| before != operation);
                if changed {
                    operation.draw_seed = stream.bits();
                }
            }
            self.permitted.settle(&mut built, stream);
            let point = Point::of(&planned(plan, &built)?, Convention::Ours)?;
            (self.grid.cell_of(&point) == Some(cell)).then_some(built)
        })
    }

    /// A fresh test, half of it of any operations alike: a cell may ask for some that fresh tests rarely hold.
    fn fresh(&self, stream: &mut Stream) -> Test {
        let kinds = self.permitted.operations();
        let mut test = fresh_test(&self.permitted, stream);
        for operation in &mut test.operations {
            if stream.chance(0.5) {
                *operation = fresh_operation(&kinds[stream.below(kinds.len())], stream);
            }
        }
        test
    }

    fn kind_of(&self, operation: &TestOperation) -> &PermittedOperation {
        self.permitted.find(operation.operation).expect("a test of a campaign holds operations of that campaign")
    }

    /// Adds, removes and replaces operations until their numbers are those of the cell. A walk of random steps, each
    /// towards what lacks or is too much.
    fn number(&self, test: &mut Test, demands: &Demands, plan: &CampaignPlan, stream: &mut Stream) -> bool {
        let class = |kind: &PermittedOperation| class_of(&plan.operation(kind.operation).kind);
        let active = |kind: &PermittedOperation| kind.activation != PermittedActivation::Offline;
        let is = |kind: &PermittedOperation, dimension: Dimension| {
            active(kind)
                && match dimension {
                    Dimension::O1 => class(kind) == Class::Value,
                    Dimension::O2 => class(kind) == Class::Loss,
                    Dimension::O3 => class(kind) == Class::Delay,
                    // Whatever can be counted.
                    Dimension::P1 | Dimension::P2 => graded(plan, kind),
                    Dimension::O0 | Dimension::T1 | Dimension::T2 | Dimension::T3 => true,
                }
        };
        // Every test in a cell is active, graded where parameters count, and a spread takes two.
        let least = |dimension: Dimension| match (dimension, demands.of(dimension)) {
            (Dimension::T3 | Dimension::P2, Some((low, _))) if low > 0.0 => Some(2.0),
            (Dimension::T1 | Dimension::T2 | Dimension::T3 | Dimension::P1 | Dimension::P2, Some(_)) => Some(1.0),
            _ => None,
        };
        for _ in 0..4 * self.permitted.most() + 8 {
            let wrong = demands.0.iter().find_map(|&(dimension, (low, high))| {
                let these = test.operations.iter().filter(|it| is(self.kind_of(it), dimension)).count() as f64;
                let (low, high) = match dimension {
                    Dimension::O0 | Dimension::O1 | Dimension::O2 | Dimension::O3 => (low, high),
                    _ => (least(dimension)?, f64::INFINITY),
                };
                (these < low || these >= high).then_some((dimension, these < low))
            });
            let Some((dimension, too_few)) = wrong else { return true };
            let operations = &mut test.operations;
            // Those that may leave: of what is too much, or anything else than what lacks.
            let leaving: Vec<usize> =
                (0..operations.len()).filter(|&at| is(self.kind_of(&operations[at]), dimension) != too_few).collect();
            let coming: Vec<&PermittedOperation> =
                self.permitted.operations().iter().filter(|kind| is(kind, dimension) == too_few).collect();
            let replaces = !leaving.is_empty() && !coming.is_empty();
            let resizes = if too_few {
                !coming.is_empty() && operations.len() < self.permitted.most()
            } else {
                !leaving.is_empty() && operations.len() > self.permitted.fewest()
            };
            if !replaces && !resizes {
                return false;
            }
            if replaces && (!resizes || stream.chance(0.5)) {
                let at = leaving[stream.below(leaving.len())];
                operations[at] = fresh_operation(coming[stream.below(coming.len())], stream);
            } else if too_few {
                let fresh = fresh_operation(coming[stream.below(coming.len())], stream);
                operations.insert(stream.below(operations.len() + 1), fresh);
            } else {
                operations.remove(leaving[stream.below(leaving.len())]);
            }
        }
        false
    }

    /// The windows of the operations that are active by time.
    fn windows(&self, test: &Test, plan: &CampaignPlan) -> Vec<Window> {
        let windows = test.operations.iter().enumerate().filter_map(|(at, operation)| {
            let PermittedActivation::Time(range) = &self.kind_of(operation).activation else { return None };
            let Activation::Time { start, end } = operation.activation else { return None };
            let within = plan.operation(operation.operation).within;
            let share = |time: f64| (time - within.start) / within.length();
            Some(Window {
                at,
                low: share(range.low),
                high: share(range.high),
                shortest: range.shortest / within.length(),
                start: share(start),
                end: share(end),
            })
        });
        windows.collect()
    }

    /// Moves the windows. Attempts after the first try shorter intervals where a spread of midpoints is wanted: the shorter
    /// they are, the farther apart their midpoints can be.
    fn time(&self, test: &mut Test, demands: &Demands, plan: &CampaignPlan, attempt: u32, stream: &mut Stream) -> bool {
        if !demands.any_of(&[Dimension::T1, Dimension::T2, Dimension::T3]) {
            return true;
        }
        let windows = self.windows(test, plan);
        let mean = |of: &dyn Fn(&Window) -> f64| windows.iter().map(of).sum::<f64>() / windows.len() as f64;
        let (width, centre) = (mean(&|it| it.high - it.low), mean(&|it| f64::midpoint(it.low, it.high)));
        let anything = (f64::NEG_INFINITY, f64::INFINITY);
        let [t1, t2] = [Dimension::T1, Dimension::T2].map(|dimension| demands.of(dimension).unwrap_or(anything));
        // The longer the intervals, the less room for their midpoints: see the feasible cells.
        let mut longest = t2.1.min(width - 2.0 * (t1.0 - centre)).min(width - 2.0 * (centre - t1.1));
        if attempt > 0 && demands.of(Dimension::T3).is_some() {
            let shortest = t2.0.max(mean(&|it| it.shortest));
            longest = shortest + (longest.min(width) - shortest) * stream.unit();
        }
        let lengths: Vec<Member> = windows
            .iter()
            .map(|it| Member { now: it.end - it.start, low: it.shortest, high: it.high - it.low, step: None })
            .collect();
        let Some(lengths) = spread::place(&lengths, &Wanted { mean: (t2.0, longest), spread: None }, stream) else {
            return false;
        };
        let midpoints: Vec<Member> = windows
            .iter()
            .zip(&lengths)
            .map(|(it, length)| Member {
                now: f64::midpoint(it.start, it.end),
                low: it.low + length / 2.0,
                high: it.high - length / 2.0,
                step: None,
            })
            .collect();
        let wanted = Wanted { mean: t1, spread: demands.of(Dimension::T3) };
        let Some(midpoints) = spread::place(&midpoints, &wanted, stream) else { return false };
        for ((window, length), midpoint) in windows.iter().zip(&lengths).zip(&midpoints) {
            let operation = &mut test.operations[window.at];
            let PermittedActivation::Time(range) = &self.kind_of(operation).activation else { continue };
            let within = plan.operation(operation.operation).within;
            let time = |share: f64| (within.start + share * within.length()).clamp(range.low, range.high);
            let (start, end) = (time(midpoint - length / 2.0), time(midpoint + length / 2.0));
            if start >= end {
                return false;
            }
            operation.activation = Activation::Time { start, end };
        }
        true
    }

    /// The numbers that the parameters of a test count with.
    fn numbers(&self, test: &Test, plan: &CampaignPlan) -> Vec<Number> {
        let mut numbers = Vec::new();
        for (at, operation) in test.operations.iter().enumerate() {
            let kind = self.kind_of(operation);
            if kind.activation == PermittedActivation::Offline {
                continue;
            }
            let declared = plan.operation(operation.operation).parameters.iter();
            let choices = operation.parameters.iter().zip(&kind.parameters);
            for (parameter, (declared, (choice, permitted))) in declared.zip(choices).enumerate() {
                let members = members(&declared.domain, permitted, choice).into_iter();
                numbers.extend(members.map(|(axis, member)| Number { operation: at, parameter, axis, member }));
            }
        }
        numbers
    }

    fn grade(&self, test: &mut Test, demands: &Demands, plan: &CampaignPlan, stream: &mut Stream) -> bool {
        if !demands.any_of(&[Dimension::P1, Dimension::P2]) {
            return true;
        }
        let numbers = self.numbers(test, plan);
        let members: Vec<Member> = numbers.iter().map(|it| it.member).collect();
        let anything = (f64::NEG_INFINITY, f64::INFINITY);
        let wanted = Wanted { mean: demands.of(Dimension::P1).unwrap_or(anything), spread: demands.of(Dimension::P2) };
        let Some(placed) = spread::place(&members, &wanted, stream) else { return false };
        for (number, share) in numbers.iter().zip(placed) {
            let operation = &mut test.operations[number.operation];
            let kind = self.permitted.find(operation.operation).expect("it was found before");
            let domain = &plan.operation(operation.operation).parameters[number.parameter].domain;
            let choice = &mut operation.parameters[number.parameter];
            set(choice, domain, &kind.parameters[number.parameter], number.axis, share);
        }
        true
    }
}

/// Whether a kind of operation has a parameter that counts.
fn graded(plan: &CampaignPlan, kind: &PermittedOperation) -> bool {
    let declared = plan.operation(kind.operation).parameters.iter();
    declared.zip(&kind.parameters).any(|(declared, permitted)| match (&declared.domain, permitted) {
        (Domain::Number { low, high, .. }, PermittedChoice::Number(..)) => low < high,
        (Domain::Point { low, high }, _) => (0..3).any(|axis| low[axis] < high[axis]),
        _ => false,
    })
}

/// The numbers of one parameter, in shares of what the space permits, each with its axis.
fn members(domain: &Domain, permitted: &PermittedChoice, choice: &Choice) -> Vec<(usize, Member)> {
    match (domain, permitted, choice) {
        (&Domain::Number { low, high, .. }, PermittedChoice::Number(range, _), choice) if low < high => {
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

/// Sets one number of a parameter to a share of what the space permits. A sub-range keeps its middle as far as it can.
fn set(choice: &mut Choice, domain: &Domain, permitted: &PermittedChoice, axis: usize, share: f64) {
    match (choice, domain, permitted) {
        (Choice::Value { value }, Domain::Number { low, high, .. }, PermittedChoice::Number(range, _)) => {
            let set = low + share * (high - low);
            *value = if range.integer { libm::rint(set) } else { set }.clamp(range.low, range.high);
        }
        (
            Choice::Range { low: from, high: to },
            Domain::Number { low, high, .. },
            PermittedChoice::Number(range, _),
        ) => {
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
