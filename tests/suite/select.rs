//! The choice of tests for a laboratory, on the data of the paper.

use sesame_select::ranking::{Better, Key, Scale, qualities};
use sesame_select::{Pairs, Problem, State, Test, choose};

use sesame_tests::selecting::{Choice, PYTHON, Points, Request, ask};

use crate::import::{imported, results, rows};

/// λ, the tests chosen, their value.
type Row = (f64, [u32; 5], f64);

/// Table 4 [SESAME 2023] with the paper's ordered pairs and ranks, as computed from the platform's data by brute force.
const PAPER: [Row; 5] = [
    (0.0, [27, 137, 158, 161, 174], 19.036_363_636),
    (0.25, [27, 158, 161, 174, 201], 16.639_976_145),
    (0.5, [158, 161, 174, 201, 209], 14.472_695_899),
    (0.75, [103, 158, 161, 174, 201], 12.934_505_379),
    (1.0, [103, 158, 161, 174, 187], 11.982_399_858),
];

/// The same with unordered pairs and average ranks.
const OURS: [Row; 5] = [
    (0.0, [27, 137, 158, 161, 174], 19.095_890_411),
    (0.25, [27, 137, 158, 161, 174], 15.488_983_908),
    (0.5, [27, 158, 161, 174, 201], 11.933_043_808),
    (0.75, [158, 161, 174, 201, 209], 8.536_869_371),
    (1.0, [103, 158, 161, 174, 187], 5.991_199_929),
];

#[test]
fn table_four_of_the_paper_is_chosen_from_its_data() {
    let Some(out) = imported("kuka-coverage-ga.model", "imported_table_four") else { return };
    let repository = results(&out, "coverageExperiment");
    let points = rows(&["sspr", "--compat", "original"], &out.join("results/coverageExperiment"));
    let column = |name: &str| points[0].iter().position(|head| head == name).unwrap();
    let dimensions = ["T1", "T2", "P1"].map(column);
    let point = |number: u32| -> Vec<f64> {
        let row = points.iter().find(|row| row[0] == format!("T{number}")).unwrap();
        dimensions.iter().map(|&at| row[at].parse().unwrap()).collect()
    };
    let sets = repository.result_sets().unwrap();
    let front = sets.iter().find(|set| set.name == "NONDOM-20_06_2023_18_50_18-intermediate-210").unwrap();
    let mut members = front.members.clone();
    members.sort_unstable();
    // The first of tests with equal points and values stays, as in the paper.
    let mut numbers: Vec<u32> = Vec::new();
    for number in members {
        if !numbers.iter().any(|&earlier| point(earlier) == point(number)) {
            numbers.push(number);
        }
    }
    assert_eq!(numbers, [27, 103, 137, 158, 161, 174, 187, 201, 209]);
    let collisions = repository.plan().metrics.iter().position(|metric| metric.name == "collisionOccurance").unwrap();
    let tests = repository.tests().unwrap();
    let values: Vec<f64> = tests.iter().map(|test| test.values[collisions].value.unwrap()).collect();
    let check = |scale: Scale, pairs: Pairs, table: &[Row]| {
        let ranked = qualities(&[Key { values: &values, better: Better::Higher }], scale).unwrap();
        let candidates: Vec<Test> = numbers
            .iter()
            .map(|&number| Test {
                point: point(number),
                quality: ranked[number as usize - 1],
                cost: 1.0,
                forced: false,
            })
            .collect();
        for (lambda, expected, value) in table {
            let problem = Problem::new(candidates.clone(), *lambda, 5.0, pairs).unwrap();
            let selection = choose(&problem, &mut || false);
            let chosen: Vec<u32> = selection.chosen.iter().map(|&at| numbers[at]).collect();
            assert_eq!((chosen.as_slice(), selection.state), (&expected[..], State::Proved), "λ = {lambda}");
            assert!((selection.value - value).abs() < 1e-9, "λ = {lambda}: {}", selection.value);
        }
    };
    check(Scale::Paper, Pairs::Ordered, &PAPER);
    check(Scale::Average, Pairs::Unordered, &OURS);
}

/// The greatest value of all choices that the budget allows.
fn brute_force(problem: &Problem) -> f64 {
    let count = problem.tests().len();
    let all = (0_u32..1 << count).map(|bits| (0..count).filter(|&at| bits >> at & 1 == 1).collect::<Vec<usize>>());
    let affordable = all.filter(|chosen| problem.cost(chosen) <= problem.budget());
    affordable.map(|chosen| problem.value(&chosen)).fold(0.0, f64::max)
}

#[test]
#[ignore = "long: needs Python's ortools and highspy"]
fn other_solvers_prove_the_same_values_and_find_no_better_ones() {
    let cases = [
        (12, 4, Points::Uniform, false),
        (12, 4, Points::Uniform, true),
        (12, 4, Points::Front, true),
        (30, 5, Points::Clustered, false),
        (30, 5, Points::Clustered, true),
        (30, 5, Points::Front, false),
        (30, 5, Points::Front, true),
        (30, 10, Points::Uniform, false),
        (30, 10, Points::Uniform, true),
        (60, 5, Points::Uniform, false),
        (60, 5, Points::Uniform, true),
        (60, 10, Points::Front, false),
        (60, 10, Points::Front, true),
    ];
    for (tests, budget, points, uneven) in cases {
        for lambda in [0.25, 0.5, 0.75] {
            let choice = Choice { tests, budget, lambda, points, uneven, seed: 1 };
            let problem = choice.problem();
            let ours = choose(&problem, &mut || false);
            assert_eq!(ours.state, State::Proved);
            if tests <= 12 {
                assert!((brute_force(&problem) - ours.value).abs() <= 1e-9 * ours.value, "{choice:?}");
            }
            for solver in ["cp-sat", "highs"] {
                let Some(solved) = ask(&Request::of(choice, solver, 60.0)) else {
                    eprintln!("skipped: {PYTHON} names no Python with ortools and highspy");
                    return;
                };
                let solved = solved.unwrap_or_else(|why| panic!("{solver}: {choice:?}: {why}"));
                println!("{solver}: {choice:?}: {} s, value {}, bound {}", solved.seconds, solved.value, solved.bound);
                let apart = (solved.value - ours.value) / ours.value;
                assert!(apart <= 1e-6 && solved.bound >= ours.value * (1.0 - 1e-6), "{solver}: {choice:?}");
                assert!(!solved.proved || apart.abs() <= 1e-6, "{solver}: {choice:?}");
                // Those that brute force settles are settled by everyone.
                assert!(solved.proved || tests > 12, "{solver}: {choice:?}");
            }
        }
    }
}
