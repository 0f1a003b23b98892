//! Conditions that a search grows and varies (paper §3.9.2 and Table 1).
//!
//! Every condition made here is one of Table 1 over the campaign's variables and whole numbers, or the numbers that a
//! variable has of its own, in the table's order
//! (`expr binComp var`), has at most the campaign's levels, has no part that is constant, and, where it starts an
//! operation, contains what that operation demands. Whatever would break one of these is tried again, so often at most;
//! then what was there before stays, or a fresh condition takes its place.

use sesame_base::condition::constant::{constant, has_constant_part};
use sesame_base::condition::{depth, mentions};
use sesame_plan::MetricId;
use sesame_plan::condition::{Comparison, Condition, ConditionSpace, Constraint, Integers, Operand, Variable};
use sesame_rng::Stream;

use crate::space::range::{Range, StepSizes};

/// How often a condition or a change of one is tried before something else is done.
const TRIES: u32 = 50;

/// Whether a search may use a condition: one that must contain something, or an end condition, which need not.
pub(crate) fn is_allowed(condition: &Condition, space: &ConditionSpace, constraints: &[Constraint]) -> bool {
    depth(condition) <= space.depth
        && constraints.iter().all(|constraint| contains(condition, constraint))
        && of_one_unit(condition, space)
        && !has_constant_part(condition, &space.variables)
}

/// Whether every comparison of two variables is of variables of one unit.
fn of_one_unit(condition: &Condition, space: &ConditionSpace) -> bool {
    let unit =
        |metric| space.variables.iter().find(|variable| variable.metric == metric).map(|variable| &variable.unit);
    match condition {
        Condition::Compare { left: Operand::Variable(left), right: Operand::Variable(right), .. } => {
            unit(*left) == unit(*right)
        }
        Condition::Compare { .. } => true,
        Condition::And(a, b) | Condition::Or(a, b) => of_one_unit(a, space) && of_one_unit(b, space),
    }
}

/// Whether a condition contains what a constraint demands.
pub(crate) fn contains(condition: &Condition, constraint: &Constraint) -> bool {
    mentions(condition, &|operand| match (constraint, operand) {
        (Constraint::Variable { metric }, Operand::Variable(variable)) => variable == *metric,
        (Constraint::Integer { bounds }, Operand::Number(number)) => {
            bounds.lowest as f64 <= number && number <= bounds.highest as f64
        }
        _ => false,
    })
}

/// A fresh condition; `None` when so many tries give none that is allowed. Its number of levels is uniform over what
/// the campaign allows, as far as conditions of these levels are allowed (ramped growth): every inner part has one
/// branch as deep as it can be, and one of any depth below that.
pub(crate) fn grown(space: &ConditionSpace, constraints: &[Constraint], stream: &mut Stream) -> Option<Condition> {
    if space.variables.is_empty() || space.depth == 0 {
        return None;
    }
    for _ in 0..TRIES {
        let mut condition = tree(levels(space.depth, stream), space, stream);
        for constraint in constraints {
            if !contains(&condition, constraint) {
                plant(&mut condition, constraint, space, stream);
            }
        }
        if is_allowed(&condition, space, constraints) {
            return Some(condition);
        }
    }
    None
}

/// A condition that differs from another in one place and is allowed like it; perhaps it differs in nothing. With the
/// probability `fresh`, a part of it is grown anew; else a comparison changes its sign, its number by a step, or a
/// variable.
pub(crate) fn changed(
    condition: &Condition,
    space: &ConditionSpace,
    constraints: &[Constraint],
    (fresh, steps): (f64, StepSizes),
    stream: &mut Stream,
) -> Condition {
    for _ in 0..TRIES {
        let mut changed = condition.clone();
        if stream.chance(fresh) {
            let (at, level) = place(&changed, stream);
            *part(&mut changed, at) = tree(levels(space.depth - level, stream), space, stream);
        } else {
            change_comparison(&mut changed, space, steps, stream);
        }
        if changed != *condition && is_allowed(&changed, space, constraints) {
            return changed;
        }
    }
    condition.clone()
}

/// Exchanges a part of one condition for a part of another (subtree crossover), so that both are allowed still. Says
/// whether anything changed.
pub(crate) fn exchange(
    [(a, of_a), (b, of_b)]: [(&mut Condition, &[Constraint]); 2],
    space: &ConditionSpace,
    stream: &mut Stream,
) -> bool {
    for _ in 0..TRIES {
        let (mut c, mut d) = (a.clone(), b.clone());
        let (at_c, at_d) = (place(&c, stream).0, place(&d, stream).0);
        std::mem::swap(part(&mut c, at_c), part(&mut d, at_d));
        let new = c != *a || d != *b;
        if new && is_allowed(&c, space, of_a) && is_allowed(&d, space, of_b) {
            (*a, *b) = (c, d);
            return true;
        }
    }
    false
}

/// A number of levels up to the greatest, each alike.
fn levels(greatest: u32, stream: &mut Stream) -> u32 {
    let below = u32::try_from(stream.below(greatest.max(1) as usize)).expect("a depth is 32 bits long");
    below + 1
}

/// A tree of exactly these levels.
fn tree(height: u32, space: &ConditionSpace, stream: &mut Stream) -> Condition {
    if height <= 1 {
        return comparison(space, stream);
    }
    let deep = tree(height - 1, space, stream);
    let other = tree(levels(height - 1, stream), space, stream);
    let (a, b) = if stream.chance(0.5) { (deep, other) } else { (other, deep) };
    if stream.chance(0.5) { Condition::And(a.into(), b.into()) } else { Condition::Or(a.into(), b.into()) }
}

/// A comparison of one unit that is not constant, if so many tries find one.
fn comparison(space: &ConditionSpace, stream: &mut Stream) -> Condition {
    let draw = |stream: &mut Stream| {
        let left = if stream.chance(0.5) { variable(space, stream) } else { integer(space.integers, stream) };
        Condition::Compare { left, by: sign(stream), right: variable(space, stream) }
    };
    let mut drawn = draw(stream);
    for _ in 0..TRIES {
        number_of_its_variable(&mut drawn, space, stream);
        if of_one_unit(&drawn, space) && constant(&drawn, &space.variables).is_none() {
            break;
        }
        drawn = draw(stream);
    }
    drawn
}

/// The numbers that a variable with steps of its own is compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Steps {
    low: f64,
    step: f64,
    /// How many steps there are from the least number.
    last: f64,
    /// All numbers are whole multiples of its reciprocal, a power of ten, if such a one is known.
    scale: Option<f64>,
}

impl Steps {
    fn of(variable: &Variable) -> Option<Steps> {
        let (step, low, high) = (variable.step?, variable.low?, variable.high?);
        let whole = |number: f64| (number - libm::round(number)).abs() < 1e-6 && number.abs() < 1e15;
        let scale = (0..13).map(|decimals| libm::pow(10.0, f64::from(decimals)));
        let scale = scale.into_iter().find(|scale| whole(low * scale) && whole(step * scale));
        Some(Steps { low, step, last: libm::floor((high - low) / step + 1e-9), scale })
    }

    fn of_metric(metric: MetricId, space: &ConditionSpace) -> Option<Steps> {
        Steps::of(space.variables.iter().find(|variable| variable.metric == metric)?)
    }

    /// The number after so many steps, without the noise of floating point: `0.3`, not `0.30000000000000004`.
    fn at(&self, steps: f64) -> f64 {
        let number = self.low + steps * self.step;
        self.scale.map_or(number, |scale| libm::round(number * scale) / scale)
    }

    /// After how many steps a number comes, or the nearest one that does.
    fn nearest(&self, number: f64) -> f64 {
        libm::round((number - self.low) / self.step).clamp(0.0, self.last)
    }

    /// Those within bounds, by their steps.
    fn within(&self, low: f64, high: f64) -> Option<Range> {
        let first = libm::ceil((low - self.low) / self.step - 1e-9).max(0.0);
        let last = libm::floor((high - self.low) / self.step + 1e-9).min(self.last);
        Range::numbers(first, last, true)
    }

    fn all(&self) -> Range {
        Range { low: 0.0, high: self.last, shortest: 0.0, longest: f64::INFINITY, integer: true }
    }
}

/// Makes the number in a comparison one that its variable is compared with, if that has steps of its own. Where a
/// variable has none, its number may be left from one that has: then it is drawn anew.
fn number_of_its_variable(comparison: &mut Condition, space: &ConditionSpace, stream: &mut Stream) {
    let Condition::Compare { left: Operand::Number(number), right: Operand::Variable(metric), .. } = comparison else {
        return;
    };
    match Steps::of_metric(*metric, space) {
        Some(steps) if steps.at(steps.nearest(*number)) == *number => {}
        Some(steps) => *number = steps.at(steps.all().number(stream)),
        None => {
            let whole = range(space.integers);
            if libm::trunc(*number) != *number || !(whole.low..=whole.high).contains(number) {
                *number = whole.number(stream);
            }
        }
    }
}

fn sign(stream: &mut Stream) -> Comparison {
    [Comparison::Below, Comparison::Above, Comparison::Equal][stream.below(3)]
}

fn variable(space: &ConditionSpace, stream: &mut Stream) -> Operand {
    Operand::Variable(space.variables[stream.below(space.variables.len())].metric)
}

fn integer(bounds: Integers, stream: &mut Stream) -> Operand {
    Operand::Number(range(bounds).number(stream))
}

fn range(integers: Integers) -> Range {
    Range {
        low: integers.lowest as f64,
        high: integers.highest as f64,
        shortest: 0.0,
        longest: f64::INFINITY,
        integer: true,
    }
}

/// Puts what a constraint demands into a random comparison: a variable on the right, a number on the left.
fn plant(condition: &mut Condition, constraint: &Constraint, space: &ConditionSpace, stream: &mut Stream) {
    let comparison = random_comparison(condition, stream);
    let Condition::Compare { left, right, .. } = comparison else { return };
    match *constraint {
        Constraint::Variable { metric } => {
            *right = Operand::Variable(metric);
            number_of_its_variable(comparison, space, stream);
        }
        Constraint::Integer { bounds } => {
            if let Operand::Variable(metric) = *right
                && let Some(steps) = Steps::of_metric(metric, space)
            {
                if let Some(within) = steps.within(bounds.lowest as f64, bounds.highest as f64) {
                    *left = Operand::Number(steps.at(within.number(stream)));
                }
                return;
            }
            let lowest = bounds.lowest.max(space.integers.lowest);
            let highest = bounds.highest.min(space.integers.highest);
            if lowest <= highest {
                *left = integer(Integers { lowest, highest }, stream);
            }
        }
    }
}

fn change_comparison(condition: &mut Condition, space: &ConditionSpace, steps: StepSizes, stream: &mut Stream) {
    let comparison = random_comparison(condition, stream);
    let Condition::Compare { left, by, right } = comparison else { return };
    let own = match *right {
        Operand::Variable(metric) => Steps::of_metric(metric, space),
        Operand::Number(_) => None,
    };
    let side = match stream.below(3) {
        0 => {
            *by = sign(stream);
            return;
        }
        1 => left,
        _ => right,
    };
    *side = match (*side, own) {
        (Operand::Variable(_), _) => variable(space, stream),
        (Operand::Number(number), Some(own)) => {
            Operand::Number(own.at(own.all().number_near(own.nearest(number), steps, stream)))
        }
        (Operand::Number(number), None) => Operand::Number(range(space.integers).number_near(number, steps, stream)),
    };
    number_of_its_variable(comparison, space, stream);
}

/// The number of parts of a condition, itself included.
fn parts(condition: &Condition) -> usize {
    match condition {
        Condition::Compare { .. } => 1,
        Condition::And(a, b) | Condition::Or(a, b) => 1 + parts(a) + parts(b),
    }
}

/// A part of a condition, each alike: its place in the order of reading, and how many levels lie above it.
fn place(condition: &Condition, stream: &mut Stream) -> (usize, u32) {
    let at = stream.below(parts(condition));
    (at, level(condition, at))
}

fn level(condition: &Condition, at: usize) -> u32 {
    match condition {
        Condition::And(a, b) | Condition::Or(a, b) if at > 0 => {
            let in_a = parts(a);
            1 + if at <= in_a { level(a, at - 1) } else { level(b, at - 1 - in_a) }
        }
        _ => 0,
    }
}

/// The part of a condition at a place.
fn part(condition: &mut Condition, at: usize) -> &mut Condition {
    if at == 0 {
        return condition;
    }
    match condition {
        Condition::Compare { .. } => condition,
        Condition::And(a, b) | Condition::Or(a, b) => {
            let in_a = parts(a);
            if at <= in_a { part(a, at - 1) } else { part(b, at - 1 - in_a) }
        }
    }
}

/// One of a condition's comparisons, each alike.
fn random_comparison<'a>(condition: &'a mut Condition, stream: &mut Stream) -> &'a mut Condition {
    // A binary tree has one leaf more than it has inner nodes.
    let chosen = stream.below(parts(condition).div_ceil(2));
    nth_comparison(condition, chosen)
}

fn nth_comparison(condition: &mut Condition, at: usize) -> &mut Condition {
    match condition {
        Condition::Compare { .. } => condition,
        Condition::And(a, b) | Condition::Or(a, b) => {
            let in_a = parts(a).div_ceil(2);
            if at < in_a { nth_comparison(a, at) } else { nth_comparison(b, at - in_a) }
        }
    }
}

/// What tells conditions apart, as numbers: the order of operands of `and` and `or` and their grouping do not, and
/// neither does the way round in which a comparison is written.
pub(crate) fn identity(condition: &Condition) -> Vec<u64> {
    let side = |operand: Operand| match operand {
        Operand::Variable(metric) => [0, u64::from(metric.0)],
        Operand::Number(number) => [1, (number + 0.0).to_bits()],
    };
    match condition {
        &Condition::Compare { left, by, right } => {
            let (left, right) = (side(left), side(right));
            let (kind, first, second) = match by {
                Comparison::Below => (0, left, right),
                Comparison::Above => (0, right, left),
                Comparison::Equal => (1, left.min(right), left.max(right)),
            };
            vec![kind, first[0], first[1], second[0], second[1]]
        }
        Condition::And(..) | Condition::Or(..) => {
            let mut joined = Vec::new();
            let both = matches!(condition, Condition::And(..));
            join(condition, both, &mut joined);
            joined.sort_unstable();
            joined.dedup();
            let mut numbers = vec![if both { 2 } else { 3 }, joined.len() as u64];
            numbers.extend(joined.into_iter().flatten());
            numbers
        }
    }
}

/// What a chain of `and`, or of `or`, joins.
fn join(condition: &Condition, both: bool, joined: &mut Vec<Vec<u64>>) {
    match condition {
        Condition::And(a, b) if both => [a, b].into_iter().for_each(|part| join(part, both, joined)),
        Condition::Or(a, b) if !both => [a, b].into_iter().for_each(|part| join(part, both, joined)),
        _ => joined.push(identity(condition)),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;

    use sesame_base::condition::testing::{above, and, any_condition, below, compare, or, variable as of};
    use sesame_plan::MetricId;
    use sesame_plan::condition::{ConditionEnd, Variable};

    use super::*;

    const STEPS: StepSizes = StepSizes { finest: 0.01, boldest: 0.3 };

    /// Spaces of one to four variables with and without known ranges, shallow and deep, that have something to grow.
    pub(crate) fn any_space() -> impl Strategy<Value = ConditionSpace> {
        // Some have steps of their own, of a tenth or of three quarters.
        let step = prop_oneof![2 => Just(None), 1 => Just(Some(0.1)), 1 => Just(Some(0.75))];
        let variable = (prop::option::of(-3i32..4), prop::option::of(2i32..9), step);
        let end = prop_oneof![
            Just(ConditionEnd::Condition),
            (0.5..5.0f64, 0.0..9.0f64).prop_map(|(low, more)| ConditionEnd::Length { low, high: low + more }),
        ];
        (prop::collection::vec(variable, 1..5), 1u32..6, -3i64..3, 4i64..20, end, 1u32..4).prop_map(
            |(variables, depth, lowest, highest, end, times)| ConditionSpace {
                variables: (0u32..)
                    .zip(variables)
                    .map(|(n, (low, more, step))| Variable {
                        metric: MetricId(n),
                        // The last of four is of a unit of its own.
                        unit: (n == 3).then(|| "mm".to_owned()),
                        low: low.map(f64::from),
                        high: more.map(|more| f64::from(low.unwrap_or(0) + more)),
                        step: step.filter(|_| low.is_some() && more.is_some()),
                    })
                    .collect(),
                depth,
                integers: Integers { lowest, highest },
                end,
                times,
            },
        )
    }

    /// What constraints a start condition may have in any of these spaces.
    pub(crate) fn any_constraints() -> impl Strategy<Value = Vec<Constraint>> {
        prop_oneof![
            3 => Just(vec![]),
            1 => Just(vec![Constraint::Variable { metric: MetricId(0) }]),
            1 => Just(vec![Constraint::Integer { bounds: Integers { lowest: 3, highest: 5 } }]),
            1 => Just(vec![
                Constraint::Variable { metric: MetricId(0) },
                Constraint::Integer { bounds: Integers { lowest: 2, highest: 4 } },
            ]),
        ]
    }

    /// What is wrong with a condition of a space: read off Table 1, without the functions that grow it.
    pub(crate) fn wrong(condition: &Condition, space: &ConditionSpace, levels: u32) -> Option<String> {
        if levels == 0 {
            return Some("too deep".to_owned());
        }
        match condition {
            Condition::And(a, b) | Condition::Or(a, b) => {
                wrong(a, space, levels - 1).or_else(|| wrong(b, space, levels - 1))
            }
            Condition::Compare { left, right, .. } => {
                let offered = |metric: MetricId| space.variables.iter().any(|variable| variable.metric == metric);
                let compared =
                    |variable: &Variable| matches!(*right, Operand::Variable(metric) if metric == variable.metric);
                let own = space.variables.iter().find(|variable| variable.step.is_some() && compared(variable));
                let expression = match *left {
                    Operand::Variable(metric) => offered(metric),
                    Operand::Number(number) => match own {
                        Some(&Variable { low: Some(low), high: Some(high), step: Some(step), .. }) => {
                            let steps = (number - low) / step;
                            (steps - libm::round(steps)).abs() < 1e-9
                                && (low..=high).contains(&number)
                                && format!("{number}").len() < 8
                        }
                        _ => {
                            libm::trunc(number) == number
                                && (space.integers.lowest as f64..=space.integers.highest as f64).contains(&number)
                        }
                    },
                };
                let variable = matches!(*right, Operand::Variable(metric) if offered(metric));
                let mixed = matches!((*left, *right), (Operand::Variable(a), Operand::Variable(b))
                    if (a == MetricId(3)) != (b == MetricId(3)));
                (!expression || !variable || left == right || mixed).then(|| format!("{condition:?}"))
            }
        }
    }

    proptest! {
        #[test]
        fn grown_and_varied_conditions_are_of_the_grammar_and_keep_their_constraints(
            space in any_space(), constraints in any_constraints(), seed: u64,
        ) {
            let mut stream = Stream::derive(seed, "test", &[]);
            let Some(mut a) = grown(&space, &constraints, &mut stream) else { return Ok(()) };
            let Some(mut b) = grown(&space, &[], &mut stream) else { return Ok(()) };
            for _ in 0..10 {
                a = changed(&a, &space, &constraints, (0.5, STEPS), &mut stream);
                b = changed(&b, &space, &[], (0.5, STEPS), &mut stream);
                exchange([(&mut a, &constraints), (&mut b, &[])], &space, &mut stream);
                for condition in [&a, &b] {
                    prop_assert_eq!(wrong(condition, &space, space.depth), None);
                    prop_assert!(!has_constant_part(condition, &space.variables));
                }
                prop_assert!(constraints.iter().all(|constraint| contains(&a, constraint)));
            }
        }

        #[test]
        fn an_exchange_loses_no_comparison(seed: u64) {
            let space = wide_space(8);
            let mut stream = Stream::derive(seed, "test", &[]);
            let (mut a, mut b) = (grown(&space, &[], &mut stream).unwrap(), grown(&space, &[], &mut stream).unwrap());
            let comparisons = |a: &Condition, b: &Condition| {
                let mut found: Vec<Vec<u64>> = [a, b].into_iter().flat_map(leaves).collect();
                found.sort();
                found
            };
            let before = comparisons(&a, &b);
            exchange([(&mut a, &[]), (&mut b, &[])], &space, &mut stream);
            prop_assert_eq!(comparisons(&a, &b), before);
        }

        #[test]
        fn equal_identities_hold_alike(a in any_condition(2), b in any_condition(2)) {
            if identity(&a) == identity(&b) {
                for x in 0..12 {
                    for y in 0..12 {
                        let value = |metric: MetricId| Some(f64::from([x, y][metric.index()]) * 0.5);
                        prop_assert_eq!(sesame_base::condition::holds(&a, &value), sesame_base::condition::holds(&b, &value));
                    }
                }
            }
        }
    }

    fn leaves(condition: &Condition) -> Vec<Vec<u64>> {
        match condition {
            Condition::Compare { .. } => vec![identity(condition)],
            Condition::And(a, b) | Condition::Or(a, b) => [leaves(a), leaves(b)].concat(),
        }
    }

    fn wide_space(depth: u32) -> ConditionSpace {
        let variables =
            (0..4).map(|n| Variable { metric: MetricId(n), unit: None, low: None, high: None, step: None }).collect();
        let integers = Integers { lowest: 1, highest: 20 };
        ConditionSpace { variables, depth, integers, end: ConditionEnd::Condition, times: 1 }
    }

    #[test]
    fn levels_of_fresh_conditions_are_spread_over_what_is_allowed() {
        let space = wide_space(4);
        let mut counts = [0u32; 4];
        for seed in 0..2_000 {
            let condition = grown(&space, &[], &mut Stream::derive(seed, "test", &[])).unwrap();
            counts[depth(&condition) as usize - 1] += 1;
        }
        // Deeper ones are constant in part more often and so are drawn again.
        assert!(counts.iter().all(|n| (300..800).contains(n)), "{counts:?}");
    }

    #[test]
    fn where_nothing_can_be_grown_nothing_is() {
        let mut space = wide_space(1);
        space.variables.truncate(1);
        (space.variables[0].low, space.variables[0].high) = (Some(30.0), Some(40.0));
        assert_eq!(grown(&space, &[], &mut Stream::derive(1, "test", &[])), None);
        space.variables[0].high = Some(20.0);
        space.variables[0].low = Some(20.0);
        assert_eq!(grown(&space, &[], &mut Stream::derive(1, "test", &[])), None);
        space.variables[0].low = None;
        assert!(grown(&space, &[], &mut Stream::derive(1, "test", &[])).is_some());
    }

    #[test]
    fn order_and_grouping_make_no_other_condition() {
        let (a, b, c) = (|| above(0, 1.0), || below(1, 2.0), || above(1, 3.0));
        let same = |x: &Condition, y: &Condition| identity(x) == identity(y);
        assert!(same(&and(a(), and(b(), c())), &and(and(c(), a()), b())));
        assert!(same(&a(), &compare(Operand::Number(1.0), Comparison::Below, of(0))));
        assert!(!same(&and(a(), or(b(), c())), &or(and(a(), b()), c())));
        assert!(!same(&and(a(), b()), &or(a(), b())));
    }
}
