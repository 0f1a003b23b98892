//! Statistics of the reality gap compared with those of SciPy, statsmodels and dtaidistance.

use sesame_gap::bootstrap::{Resampling, intervals};
use sesame_gap::equivalence::compare;
use sesame_gap::holm::adjusted;
use sesame_gap::pooled::{Heterogeneity, Pooled};
use sesame_gap::power::{Design, tost_power};
use sesame_gap::proportion::{fisher, wilson};
use sesame_gap::samples::{Moments, Samples, Welch, cliff_delta, cohen_d, difference, hedges_g};
use sesame_gap::warping::dtw;
use sesame_rng::Stream;
use sesame_tests::gap::{Answer, PYTHON, Question, ask};

/// What ours makes of a question, in the order of the script.
fn ours(question: &Question) -> Vec<f64> {
    match question {
        Question::Samples { simulation, lab, tolerance, alpha } => {
            let samples = Samples::new(simulation, lab);
            let tests = compare(samples, *tolerance, *alpha).tests.unwrap();
            let [low, high] = tests.interval;
            let effects = [cohen_d, hedges_g, cliff_delta].map(|of| of(samples).unwrap());
            let welch = [tests.welch.degrees, tests.p_different, low, high, tests.p_above, tests.p_below];
            [&welch[..], &effects[..]].concat()
        }
        Question::Bootstrap { simulation, lab } => {
            let resampling = Resampling { resamples: 10_000, ..Resampling::default() };
            let found = intervals(Samples::new(simulation, lab), resampling, difference).unwrap();
            [found.bca.unwrap(), found.percentile].concat()
        }
        Question::Power { deviations: [a, b], runs: [m, n], tolerance, alpha } => {
            let design = Design { simulation_deviation: *a, lab_deviation: *b, tolerance: *tolerance, alpha: *alpha };
            vec![tost_power(design, *m, *n)]
        }
        Question::Holm { p } => adjusted(p),
        Question::Shares { a, b } => {
            let [low, high] = wilson(a[0], a[1]).unwrap();
            vec![fisher((a[0], a[1]), (b[0], b[1])), low, high]
        }
        Question::Warping { a, b, band } => vec![dtw(a, b, *band).distance],
        Question::Pooled { differences, errors } => {
            let known = |(&difference, &standard_error)| Welch { difference, standard_error, degrees: 1e15 };
            let differences: Vec<Welch> = differences.iter().zip(errors).map(known).collect();
            let (pooled, of) = (Pooled::of(&differences).unwrap(), Heterogeneity::of(&differences).unwrap());
            vec![pooled.estimate, pooled.standard_error, of.q, of.i_squared]
        }
        Question::Means { samples } => {
            let mean = |sample: &Vec<f64>| {
                let of = Moments::of(sample).unwrap();
                let (n, deviation) = (of.count as f64, of.deviation.unwrap());
                Welch { difference: of.mean, standard_error: deviation / n.sqrt(), degrees: n - 1.0 }
            };
            vec![Heterogeneity::of(&samples.iter().map(mean).collect::<Vec<_>>()).unwrap().p]
        }
    }
}

/// Samples, some with ties, some of very unlike sizes and spreads.
fn sample(stream: &mut Stream, least: usize) -> Vec<f64> {
    let (count, mean, spread) = (least + stream.below(25), stream.uniform(-1.0, 1.0), stream.uniform(0.2, 3.0));
    let coarse = stream.chance(0.3);
    let values = (0..count).map(|_| mean + spread * stream.normal());
    let values: Vec<f64> = values.map(|x| if coarse { x.round() } else { x }).collect();
    // Coarse values may all be equal.
    if values.iter().all(|x| *x == values[0]) { sample(stream, least) } else { values }
}

fn question(kind: usize, stream: &mut Stream) -> Question {
    match kind {
        0 => Question::Samples {
            simulation: sample(stream, 2),
            lab: sample(stream, 2),
            tolerance: stream.uniform(0.01, 3.0),
            alpha: stream.uniform(0.01, 0.2),
        },
        1 => Question::Power {
            deviations: [stream.uniform(0.0, 2.0), stream.uniform(0.1, 2.0)],
            runs: [2 + stream.below(60), 2 + stream.below(30)],
            tolerance: stream.uniform(0.1, 3.0),
            alpha: stream.uniform(0.01, 0.2),
        },
        2 => Question::Holm { p: (0..=stream.below(20)).map(|_| stream.unit() * stream.unit()).collect() },
        3 => {
            let mut share = || {
                let n = 1 + stream.below(60);
                [stream.below(n + 1), n]
            };
            Question::Shares { a: share(), b: share() }
        }
        4 => {
            let count = 2 + stream.below(60);
            let mut walk = || -> Vec<f64> {
                let mut at = 0.0;
                (0..count)
                    .map(|_| {
                        at += stream.normal();
                        at
                    })
                    .collect()
            };
            let (a, b) = (walk(), walk());
            Question::Warping { a, b, band: stream.below(count) }
        }
        5 => {
            let count = 2 + stream.below(15);
            Question::Pooled {
                differences: (0..count).map(|_| stream.normal()).collect(),
                errors: (0..count).map(|_| stream.uniform(0.1, 2.0)).collect(),
            }
        }
        _ => Question::Means { samples: (0..3 + stream.below(6)).map(|_| sample(stream, 3)).collect() },
    }
}

fn answers(questions: &[Question]) -> Option<Vec<Answer>> {
    let answers = ask(questions);
    if answers.is_none() {
        println!("skipped: {PYTHON} names no Python with SciPy, statsmodels and dtaidistance");
        assert!(std::env::var_os("CI").is_none(), "CI has Python, so it has them");
    }
    answers
}

#[test]
#[ignore = "long: needs Python's SciPy, statsmodels and dtaidistance"]
fn statistics_of_the_gap_are_those_of_scipy_statsmodels_and_dtaidistance() {
    let mut stream = Stream::derive(1, "gap", &[]);
    let questions: Vec<Question> = (0..7 * 150).map(|at| question(at % 7, &mut stream)).collect();
    let Some(theirs) = answers(&questions) else { return };
    let mut greatest = [0.0f64; 7];
    for (at, (question, Answer(theirs))) in questions.iter().zip(&theirs).enumerate() {
        let ours = ours(question);
        assert_eq!(ours.len(), theirs.len(), "{question:?}");
        for (ours, theirs) in ours.iter().zip(theirs) {
            let apart = (ours - theirs).abs() / theirs.abs().max(1.0);
            greatest[at % 7] = greatest[at % 7].max(apart);
            assert!(apart <= 1e-8, "{ours} and {theirs}: {question:?}");
        }
    }
    for (kind, apart) in ["samples", "power", "Holm", "shares", "DTW", "pooled", "means"].iter().zip(greatest) {
        println!("{kind}: 150 answers differ by at most {apart:.1e}");
    }
}

#[test]
#[ignore = "long: needs Python's SciPy, statsmodels and dtaidistance"]
fn bootstrap_intervals_are_those_of_scipy_up_to_chance() {
    let mut stream = Stream::derive(2, "gap", &[]);
    let questions: Vec<Question> = (0..40)
        .map(|_| {
            // Skewed, so that the correction of BCa matters.
            let mut side = |spread: f64| -> Vec<f64> {
                let count = 6 + stream.below(25);
                (0..count).map(|_| (spread * stream.normal()).exp()).collect()
            };
            Question::Bootstrap { simulation: side(0.8), lab: side(0.3) }
        })
        .collect();
    let Some(theirs) = answers(&questions) else { return };
    let mut greatest: f64 = 0.0;
    for (question, Answer(theirs)) in questions.iter().zip(&theirs) {
        let ours = ours(question);
        let width = theirs[1] - theirs[0];
        for (ours, theirs) in ours.iter().zip(theirs) {
            greatest = greatest.max((ours - theirs).abs() / width);
            assert!((ours - theirs).abs() < 0.08 * width, "{ours} and {theirs}: {question:?}");
        }
    }
    println!("ends of 40 intervals differ by at most {:.1} % of their width", 100.0 * greatest);
}
