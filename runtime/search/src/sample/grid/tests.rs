use std::collections::BTreeSet;

use proptest::prelude::*;

use sesame_plan::{Count, Domain, Search, Strategy};

use super::*;
use crate::space::OperationSpace;
use crate::space::test_space::tests::{any_timed_plan, broken_rule};
use crate::test_key::identity;
use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

/// An operation in a test: which, its window and its parameters as numbers, so rounded that the oracle may compute them
/// in another way.
type Operation = (u32, Vec<i64>);

fn rounded(number: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "far below 2^53")]
    let number = libm::rint(number * 1e6) as i64;
    number
}

fn numbers(choice: &Choice) -> Vec<i64> {
    match choice {
        Choice::Value { value } => vec![rounded(*value)],
        Choice::Range { low, high } => vec![rounded(*low), rounded(*high)],
        Choice::Point { point } => point.map(rounded).to_vec(),
        Choice::Text { text } => text.bytes().map(i64::from).collect(),
    }
}

fn shown(test: &Test) -> Vec<Operation> {
    let operation = |operation: &TestOperation| {
        let window = match operation.activation {
            Activation::Time { start, end } => vec![rounded(start), rounded(end)],
            _ => Vec::new(),
        };
        (operation.operation.0, window.into_iter().chain(operation.parameters.iter().flat_map(numbers)).collect())
    };
    let mut operations: Vec<Operation> = test.operations.iter().map(operation).collect();
    operations.sort();
    operations
}

/// The levels of a range, naively: walking from one end to the other.
fn levels_of(range: &Range, levels: u32) -> Vec<f64> {
    let mut found = Vec::new();
    for at in 0..levels {
        let number = range.low + (range.high - range.low) / f64::from(levels - 1) * f64::from(at);
        found.push(number);
    }
    if range.integer {
        if range.high - range.low < f64::from(levels) {
            found = (0..=levels).map(|at| range.low + f64::from(at)).filter(|&number| number <= range.high).collect();
        }
        // If two whole numbers are as near, it is the one whose distance from the least is even.
        for number in &mut found {
            *number = range.low + libm::rint(*number - range.low);
        }
    }
    found.dedup_by_key(|number| rounded(*number));
    found
}

/// All that one operation may be in a test of the grid.
fn instances(kind: &OperationSpace, levels: u32) -> Vec<(Option<[i64; 2]>, Vec<i64>)> {
    let mut windows = Vec::new();
    match kind.activation {
        ActivationSpace::Time(range) if range.longest.is_finite() => {
            let between = |low, high| levels_of(&Range::between(low, high), levels);
            let last = range.high - range.longest;
            for start in between(range.low, if rounded(last) > rounded(range.low) { last } else { range.low }) {
                let lengths = between(range.shortest, range.longest).into_iter();
                windows.extend(lengths.map(|length| Some([rounded(start), rounded(start + length)])));
            }
        }
        ActivationSpace::Time(range) => {
            let times = levels_of(&range, levels);
            for end in 0..times.len() {
                (0..end).for_each(|start| windows.push(Some([rounded(times[start]), rounded(times[end])])));
            }
        }
        _ => windows.push(None),
    }
    let mut found: Vec<(Option<[i64; 2]>, Vec<i64>)> = windows.into_iter().map(|window| (window, vec![])).collect();
    for parameter in &kind.parameters {
        let choices: Vec<Vec<i64>> = match parameter {
            ParameterSpace::Number(range, shape) => {
                let levels = levels_of(range, levels);
                let from = |low: f64| -> Vec<Vec<i64>> {
                    match shape {
                        ChoiceKind::Value => vec![vec![rounded(low)]],
                        ChoiceKind::Range => levels
                            .iter()
                            .filter(|&&high| high >= low)
                            .map(|&high| vec![rounded(low), rounded(high)])
                            .collect(),
                    }
                };
                levels.iter().flat_map(|&low| from(low)).collect()
            }
            ParameterSpace::Point([x, y, z]) => {
                let [x, y, z] = [x, y, z].map(|axis| levels_of(axis, levels));
                let mut points = Vec::new();
                for &x in &x {
                    for &y in &y {
                        points.extend(z.iter().map(|&z| [x, y, z].map(rounded).to_vec()));
                    }
                }
                points
            }
            ParameterSpace::Items(items) => items.iter().map(|item| item.bytes().map(i64::from).collect()).collect(),
        };
        found = found
            .iter()
            .flat_map(|(window, numbers)| {
                choices.iter().map(|choice| (*window, [numbers.clone(), choice.clone()].concat()))
            })
            .collect();
    }
    found
}

/// The full factorial, naively: all sets of operations, without those that are not permitted.
fn full_factorial(plan: &CampaignPlan, levels: u32) -> BTreeSet<Vec<Operation>> {
    let space = TestSpace::from_plan(plan).unwrap();
    let mut all: Vec<(u32, Option<[i64; 2]>, Vec<i64>)> = Vec::new();
    for kind in space.operations() {
        all.extend(instances(kind, levels).into_iter().map(|(window, numbers)| (kind.operation.0, window, numbers)));
    }
    let mut found = BTreeSet::new();
    let mut open: Vec<(usize, Vec<usize>)> = vec![(0, Vec::new())];
    while let Some((from, held)) = open.pop() {
        if held.len() >= plan.campaign.count.min as usize {
            let mut test: Vec<Operation> = held
                .iter()
                .map(|&at| (all[at].0, all[at].1.into_iter().flatten().chain(all[at].2.iter().copied()).collect()))
                .collect();
            test.sort();
            assert!(found.insert(test), "the oracle finds each once");
        }
        if held.len() == plan.campaign.count.max as usize {
            continue;
        }
        for next in from..all.len() {
            let fits = held.iter().filter(|&&at| all[at].0 == all[next].0).all(|&at| {
                let (Some([a, b]), Some([c, d])) = (all[at].1, all[next].1) else { return false };
                match plan.campaign.copies {
                    Copies::Once => false,
                    Copies::Apart => b <= c || d <= a,
                    Copies::MayOverlap => [a, b] != [c, d],
                }
            });
            if fits {
                open.push((next + 1, [held.clone(), vec![next]].concat()));
            }
        }
    }
    found
}

fn grid(plan: &CampaignPlan, levels: u32, seed: u64) -> Result<FullFactorial, SearchError> {
    FullFactorial::new(plan, &TestSpace::from_plan(plan)?, levels, seed)
}

fn all_of(mut grid: FullFactorial) -> Vec<Test> {
    (0..).map_while(|index| grid.test(index)).collect()
}

/// One operation, once in each test, with these parameters.
fn one_operation(domains: &[Domain], copies: Copies, count: Count) -> CampaignPlan {
    let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
    let parameter =
        |domain: &Domain| sesame_plan::Parameter { name: "p".to_owned(), unit: None, domain: domain.clone() };
    plan.operations[0].parameters = domains.iter().map(parameter).collect();
    plan.campaign.operations.truncate(1);
    plan.campaign.copies = copies;
    plan.campaign.count = count;
    plan
}

fn number(low: f64, high: f64, shape: ChoiceKind, integer: bool) -> Domain {
    Domain::Number { low, high, shape, integer }
}

const ONCE: Count = Count { min: 1, max: 1 };

proptest! {
    #[test]
    fn the_tests_are_exactly_the_naive_full_factorial_and_each_comes_once(
        mut plan in any_timed_plan(), levels in 2u32..5, seed: u64, kinds in 1usize..4, parameters in 0usize..3,
    ) {
        plan.campaign.operations.truncate(kinds);
        plan.operations.iter_mut().for_each(|operation| operation.parameters.truncate(parameters));
        let Ok(grid) = TestSpace::from_plan(&plan).and_then(|space| FullFactorial::new(&plan, &space, levels, seed)) else {
            return Ok(());
        };
        let count = grid.tests;
        if count > 2_000 {
            return Ok(());
        }
        let mut asked = grid.clone();
        let tests = all_of(grid);
        prop_assert_eq!(tests.len() as u128, count);
        prop_assert_eq!(asked.ended(u32::try_from(count).unwrap()), Some(format!("all {count} tests of the grid were evaluated")));
        let found: BTreeSet<_> = tests.iter().map(shown).collect();
        prop_assert_eq!(found.len(), tests.len(), "none comes twice");
        prop_assert_eq!(found, full_factorial(&plan, levels));
        // Stopped and begun anew, it goes the same way.
        prop_assert_eq!((0..20).map_while(|index| asked.test(index)).collect::<Vec<_>>(), tests[..tests.len().min(20)].to_vec());
    }

    #[test]
    fn as_many_copies_of_bounded_windows_fit_as_the_plan_says(
        levels in 2u32..20, room in 1u32..100, low in 0u32..20, more in 0u32..20, copies in 0..2,
    ) {
        let copies = if copies == 0 { Copies::Apart } else { Copies::MayOverlap };
        let [room, low, more] = [room, low, more].map(|eighths| f64::from(eighths) / 8.0);
        // Beginnings that rounding cannot put before the end of another window.
        let lengths = sesame_plan::Lengths { low: low + 0.001, high: low + more + 0.01 };
        prop_assume!(lengths.high < room);
        let range = Range { shortest: lengths.low, longest: lengths.high, ..Range::window(0.0, room) };
        let placed = WindowLevels::new(range, levels).most_copies(copies);
        let times = sesame_plan::Times::Windows { room, lengths: Some(lengths) };
        prop_assert_eq!(placed, Strategy::Grid { levels }.most_copies(copies, times) as usize);
    }

    #[test]
    fn tests_of_every_grid_are_permitted_and_differ(plan in any_timed_plan(), levels in 2u32..=64, seed: u64) {
        let space = TestSpace::from_plan(&plan).unwrap();
        let Ok(mut grid) = grid(&plan, levels, seed) else { return Ok(()) };
        let mut seen = BTreeSet::new();
        for test in (0..60).map_while(|index| grid.test(index)) {
            prop_assert_eq!(broken_rule(&plan, &test), None);
            prop_assert!(space.permits_copies(&test), "{:?}", test);
            prop_assert!(seen.insert(identity(&test)));
        }
    }

    #[test]
    fn each_value_of_each_choice_comes_about_equally_often_in_every_beginning(
        sizes in prop::collection::vec(1u128..9, 1..6), key: u64,
    ) {
        let product: u128 = sizes.iter().product();
        let mut seen = BTreeSet::new();
        let mut counts: Vec<Vec<u128>> = sizes.iter().map(|&size| vec![0; place(size)]).collect();
        for index in 0..product.min(3_000) {
            let ranks = spread(key, index, &sizes);
            for (counts, &rank) in counts.iter_mut().zip(&ranks) {
                counts[place(rank)] += 1;
                let (least, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
                // Unless one size is a multiple of the other, each change of the digit cuts a group of values off.
                prop_assert!(most - least <= 1 + counts.len() as u128 / 2, "{:?} after {} of {:?}", counts, index + 1, sizes);
            }
            prop_assert!(seen.insert(ranks), "{} of {:?}", index, sizes);
        }
    }

    #[test]
    fn orders_are_permutations(size in 1u128..600, key: u64) {
        let found: BTreeSet<u128> = (0..size).map(|rank| permuted(key, size, rank)).collect();
        prop_assert_eq!(found, (0..size).collect());
    }

    #[test]
    fn subsets_of_all_ranks_are_all_subsets(of in 0usize..9, members in 0usize..9) {
        let count = subsets(of, members);
        let found: BTreeSet<Vec<usize>> = (0..count).map(|rank| subset(of, members, count, rank)).collect();
        let naive = (0u32..1 << of)
            .filter(|bits| bits.count_ones() as usize == members)
            .map(|bits| (0..of).filter(|thing| bits >> thing & 1 == 1).collect());
        prop_assert_eq!(found, naive.collect::<BTreeSet<Vec<usize>>>());
    }
}

#[test]
fn numbers_take_both_ends_and_whole_numbers_are_not_repeated() {
    let range = |low, high| Range { low, high, shortest: 0.0, longest: f64::INFINITY, integer: false };
    let whole = |low, high| Range { low, high, shortest: 0.0, longest: f64::INFINITY, integer: true };
    assert_eq!(equally_spaced(range(-1.0, 1.0), 2), [-1.0, 1.0]);
    assert_eq!(equally_spaced(range(0.0, 8.0), 5), [0.0, 2.0, 4.0, 6.0, 8.0]);
    assert_eq!(equally_spaced(range(0.3, 0.3), 5), [0.3]);
    assert_eq!(equally_spaced(range(1.0, 1.0 + f64::EPSILON), 5), [1.0, 1.0 + f64::EPSILON]);
    assert_eq!(equally_spaced(whole(3.0, 5.0), 9), [3.0, 4.0, 5.0]);
    assert_eq!(equally_spaced(whole(1.0, 100.0), 4), [1.0, 34.0, 67.0, 100.0]);
    assert_eq!(equally_spaced(whole(0.0, 4.0), 4), [0.0, 1.0, 3.0, 4.0]);
    let far = (1u64 << 53) as f64;
    assert_eq!(equally_spaced(whole(-far, far), 3), [-far, 0.0, far]);
}

#[test]
fn windows_and_sub_ranges_begin_and_end_at_levels() {
    let plan = one_operation(&[number(-1.0, 1.0, ChoiceKind::Range, false)], Copies::Once, ONCE);
    let ActivationSpace::Time(within) = TestSpace::from_plan(&plan).unwrap().operations()[0].activation else {
        panic!()
    };
    let [start, middle, end] = equally_spaced(within, 3)[..] else { panic!() };
    let mut windows = BTreeSet::new();
    let mut ranges = BTreeSet::new();
    for test in all_of(grid(&plan, 3, 1).unwrap()) {
        let [used] = &test.operations[..] else { panic!("{test:?}") };
        let (Activation::Time { start, end }, Choice::Range { low, high }) = (&used.activation, &used.parameters[0])
        else {
            panic!("{used:?}")
        };
        windows.insert([*start, *end].map(rounded));
        ranges.insert([*low, *high].map(rounded));
    }
    assert_eq!(windows, [[start, middle], [start, end], [middle, end]].map(|window| window.map(rounded)).into());
    // The example of the reference.
    let domains = [number(-0.3, 0.3, ChoiceKind::Range, false)];
    let counts =
        [1, 3].map(|max| grid(&one_operation(&domains, Copies::Apart, Count { min: 1, max }), 4, 1).unwrap().tests);
    assert_eq!(counts, [60, 1_560]);
    let pairs = [[-1.0, -1.0], [-1.0, 0.0], [-1.0, 1.0], [0.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    assert_eq!(ranges, pairs.map(|range| range.map(rounded)).into());
}

#[test]
fn every_beginning_has_each_level_about_equally_often() {
    let domains = [number(0.0, 1.0, ChoiceKind::Value, false), number(5.0, 6.0, ChoiceKind::Value, false)];
    let plan = one_operation(&domains, Copies::Once, ONCE);
    for seed in 0..20 {
        let mut grid = grid(&plan, 5, seed).unwrap();
        assert_eq!(grid.tests, 10 * 5 * 5);
        let mut counts = [[0u32; 5]; 2];
        let mut both = [[0u32; 5]; 5];
        for index in 0..250u32 {
            let test = grid.test(index).unwrap();
            let level = |at: usize| {
                let Choice::Value { value } = test.operations[0].parameters[at] else { panic!("{test:?}") };
                (0..5usize).find(|&level| rounded(value) == rounded(at as f64 * 5.0 + level as f64 / 4.0)).unwrap()
            };
            let levels = [level(0), level(1)];
            levels.iter().zip(&mut counts).for_each(|(&level, counts)| counts[level] += 1);
            both[levels[0]][levels[1]] += 1;
            for counts in &counts {
                assert!(counts.iter().max().unwrap() - counts.iter().min().unwrap() <= 3, "{counts:?} after {index}");
            }
        }
        assert_eq!(both, [[10; 5]; 5]);
    }
}

#[test]
fn numbers_of_operations_take_turns_until_they_are_used_up() {
    let plan = one_operation(&[], Copies::Apart, Count { min: 1, max: 4 });
    let mut grid = grid(&plan, 4, 1).unwrap();
    // Three parts of the time give six windows and five disjoint pairs, and all three parts together.
    let lengths: Vec<usize> = (0..).map_while(|index| grid.test(index)).map(|test| test.operations.len()).collect();
    assert_eq!(lengths, [1, 2, 3, 1, 2, 1, 2, 1, 2, 1, 2, 1]);
    assert_eq!(grid.ended(5).unwrap(), "5 of the 12 tests of the grid were evaluated");
}

#[test]
fn a_grid_too_large_to_count_is_searched_all_the_same() {
    let domains = [number(0.0, 1.0, ChoiceKind::Range, false), number(0.0, 1.0, ChoiceKind::Range, false)];
    for copies in [Copies::Apart, Copies::MayOverlap] {
        let plan = one_operation(&domains, copies, Count { min: 40, max: 60 });
        let space = TestSpace::from_plan(&plan).unwrap();
        let mut grid = grid(&plan, 64, 1).unwrap();
        assert_eq!(grid.tests, u128::MAX);
        let mut seen = BTreeSet::new();
        for index in 0..300 {
            let test = grid.test(index).unwrap();
            assert_eq!(broken_rule(&plan, &test), None);
            assert!(space.permits_copies(&test) && seen.insert(identity(&test)));
        }
        assert_eq!(grid.ended(300).unwrap(), "300 of the more than 10^38 tests of the grid were evaluated");
    }
    // Members that are reached are spread over the whole set.
    let (of, chosen) = (2016, 30);
    assert_eq!(subsets(of, chosen), COUNTED);
    let first = subset(of, chosen, REACHED, 0);
    let last = subset(of, chosen, REACHED, REACHED - 1);
    assert!(first[0] == 0 && last.iter().all(|&thing| thing >= of / 2), "{first:?} {last:?}");
}

#[test]
fn seeds_change_the_order_and_not_the_tests() {
    let plan = one_operation(&[number(0.0, 1.0, ChoiceKind::Value, false)], Copies::Apart, Count { min: 1, max: 2 });
    let [one, other] = [1, 2].map(|seed| all_of(grid(&plan, 3, seed).unwrap()).iter().map(shown).collect::<Vec<_>>());
    assert_ne!(one, other);
    assert_eq!(one.into_iter().collect::<BTreeSet<_>>(), other.into_iter().collect());
}

#[test]
fn more_copies_than_levels_have_room_for_are_refused() {
    let plan = one_operation(&[], Copies::Apart, Count { min: 4, max: 5 });
    let refusal = grid(&plan, 4, 1).unwrap_err().to_string();
    assert!(refusal.contains("requires 4 operations per test, but a test can contain at most 3"), "{refusal}");
}

#[test]
fn a_search_ends_when_the_grid_does_and_is_brought_back_by_its_results() {
    let mut plan = one_operation(&[number(0.0, 1.0, ChoiceKind::Range, false)], Copies::Once, ONCE);
    let tests = |plan: &CampaignPlan| {
        let mut search = crate::strategy(plan, 3).unwrap();
        let tests = SYNTHETIC_ROBOTS[0].campaign_of(plan, search.as_mut()).tests;
        (tests.into_iter().map(|candidate| candidate.test).collect::<Vec<_>>(), search.ended())
    };
    plan.campaign.search = Search::new(Strategy::Grid { levels: 6 }, 1_000);
    let (all, ended) = tests(&plan);
    assert_eq!((all.len(), ended.as_deref()), (15 * 21, Some("all 315 tests of the grid were evaluated")));
    plan.campaign.search.set_evaluations(70);
    let (some, ended) = tests(&plan);
    assert_eq!((&some[..], ended.as_deref()), (&all[..70], Some("70 of the 315 tests of the grid were evaluated")));
}
