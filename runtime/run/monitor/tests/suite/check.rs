//! Checks compared with all values of inputs, and with runs.

use std::collections::BTreeSet;
use std::sync::Arc;

use proptest::prelude::*;
use sesame_base::time::SimTime;
use sesame_monitor::check::{self, Finding, Question, Report, Value, Values, When, check};
use sesame_monitor::why::Moment;
use sesame_monitor::{Changes, EvidenceId, Network, Reading, Run, State, Truth};
use sesame_plan::{
    Comparison, Condition, Evidence, Expression, FieldRef, Input, Members, Monitor, MonitorId, Side, Stale, StaleIs,
    TextTest, TopicId,
};

use crate::random;

/// Inputs of all evidence: two numbers, a flag, and a text that is compared with two others.
const X: u32 = 0;
const Y: u32 = 1;
const FLAG: u32 = 2;

fn inputs() -> Vec<Input> {
    let input = |topic, text: Option<TextTest>| Input {
        field: FieldRef { topic: TopicId(topic), path: Vec::new() },
        members: Members::Min,
        list: None,
        text,
        memory: Vec::new(),
    };
    let is = |text: &str| Some(TextTest::Is(text.into()));
    let is_not = Some(TextTest::IsNot("b".into()));
    vec![input(0, None), input(1, None), input(2, None), input(3, is("a")), input(3, is("b")), input(3, is_not)]
}

/// Values of the topics.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sample {
    x: f64,
    y: f64,
    flag: bool,
    text: &'static str,
}

const TEXTS: [&str; 3] = ["a", "b", "c"];

fn number(of: &Expression, at: &Sample) -> f64 {
    let all = |parts: &[Expression]| parts.iter().map(|part| number(part, at)).collect::<Vec<f64>>();
    match of {
        Expression::Constant(value) => *value,
        Expression::Input(X) => at.x,
        Expression::Input(_) => at.y,
        Expression::Negate(of) => -number(of, at),
        Expression::Sum(parts) => all(parts).into_iter().reduce(|a, b| a + b).unwrap(),
        Expression::Product(parts) => all(parts).into_iter().reduce(|a, b| a * b).unwrap(),
        Expression::Divide { value, by } => number(value, at) / number(by, at),
        Expression::Absolute(of) => number(of, at).abs(),
        Expression::Min(parts) => all(parts).into_iter().fold(f64::INFINITY, f64::min),
        Expression::Max(parts) => all(parts).into_iter().fold(f64::NEG_INFINITY, f64::max),
        Expression::Unary { of, .. } => number(of, at).sqrt(),
        _ => unreachable!(),
    }
}

fn holds(of: &Condition, at: &Sample) -> bool {
    match of {
        Condition::Constant(holds) => *holds,
        Condition::Input(FLAG) => at.flag,
        Condition::Input(input) => match &inputs()[*input as usize].text {
            Some(TextTest::Is(text)) => at.text == text,
            Some(TextTest::IsNot(text)) => at.text != text,
            None => unreachable!(),
        },
        Condition::Compare { left, by, right } => by.holds(number(left, at), number(right, at)),
        Condition::Same { left, right } => holds(left, at) == holds(right, at),
        Condition::All(parts) => parts.iter().all(|part| holds(part, at)),
        Condition::Any(parts) => parts.iter().any(|part| holds(part, at)),
        Condition::Not(of) => !holds(of, at),
    }
}

/// The topics that a condition reads, as bits.
fn topics(of: &Condition) -> u32 {
    fn numbers(of: &Expression) -> u32 {
        let own = if let Expression::Input(at) = of { 1 << at } else { 0 };
        of.parts().into_iter().map(numbers).fold(own, |a, b| a | b)
    }
    match of {
        Condition::Constant(_) => 0,
        Condition::Input(at) => 1 << (*at).min(3),
        Condition::Compare { left, right, .. } => numbers(left) | numbers(right),
        Condition::Same { left, right } => topics(left) | topics(right),
        Condition::All(parts) | Condition::Any(parts) => parts.iter().map(topics).fold(0, |a, b| a | b),
        Condition::Not(of) => topics(of),
    }
}

fn input(at: u32) -> Expression {
    Expression::Input(at)
}

fn c(value: f64) -> Expression {
    Expression::Constant(value)
}

fn negate(of: Expression) -> Expression {
    Expression::Negate(Box::new(of))
}

fn difference() -> Expression {
    Expression::Sum(vec![input(X), negate(input(Y))])
}

fn any_constant() -> impl Strategy<Value = Expression> {
    (0..4_i8).prop_map(|value| c(f64::from(value)))
}

fn any_input() -> impl Strategy<Value = Expression> {
    prop_oneof![Just(input(X)), Just(input(Y))]
}

/// Numbers of which all orders are among the samples.
fn simple_number() -> impl Strategy<Value = Expression> {
    prop_oneof![
        3 => any_input(),
        1 => any_input().prop_map(negate),
        1 => Just(Expression::Min(vec![input(X), input(Y)])),
        1 => Just(Expression::Max(vec![input(X), input(Y), c(1.0)])),
        1 => any_input().prop_map(|of| Expression::Absolute(Box::new(of))),
        1 => any_input().prop_map(|of| Expression::Product(vec![c(-2.0), of])),
    ]
}

/// Other numbers, some of which the check does not look into, and some of which are not always numbers.
fn difficult_number() -> impl Strategy<Value = Expression> {
    prop_oneof![
        1 => simple_number(),
        1 => Just(difference()),
        1 => Just(negate(difference())),
        1 => Just(Expression::Sum(vec![negate(input(X)), input(Y)])),
        1 => Just(Expression::Absolute(Box::new(difference()))),
        1 => (any_input(), any_constant()).prop_map(|(of, by)| Expression::Sum(vec![of, by])),
        1 => Just(Expression::Product(vec![input(X), input(Y)])),
        1 => any_input().prop_map(|of| Expression::Divide { value: Box::new(c(1.0)), by: Box::new(of) }),
        1 => any_input().prop_map(|of| Expression::Unary {
            function: sesame_plan::UnaryFunction::Sqrt,
            of: Box::new(of)
        }),
    ]
}

fn any_condition(number: BoxedStrategy<Expression>, difficult: bool) -> impl Strategy<Value = Condition> {
    let by = prop::sample::select(vec![
        Comparison::AtMost,
        Comparison::Below,
        Comparison::AtLeast,
        Comparison::Above,
        Comparison::Equal,
        Comparison::NotEqual,
    ]);
    let plain = || prop_oneof![any_input(), any_input(), Just(Expression::Max(vec![input(X), input(Y), c(1.0)]))];
    let sides = prop_oneof![
        4 => (number.clone(), any_constant()),
        1 => (plain(), plain()),
        u32::from(difficult) => (number.clone(), number),
    ];
    let compare = (sides, by, any::<bool>()).prop_map(|((left, right), by, turned)| (left, by, right, turned));
    let compare = compare.prop_map(|(left, by, right, turned)| {
        let (left, right) = if turned { (right, left) } else { (left, right) };
        Condition::Compare { left, by, right }
    });
    let leaf = prop_oneof![5 => compare, 1 => (FLAG..6).prop_map(Condition::Input)];
    leaf.prop_recursive(2, 5, 3, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 2..=3).prop_map(Condition::All),
            prop::collection::vec(inner.clone(), 2..=3).prop_map(Condition::Any),
            inner.clone().prop_map(|of| Condition::Not(Box::new(of))),
            (inner.clone(), inner).prop_map(|(a, b)| Condition::Same { left: Box::new(a), right: Box::new(b) }),
        ]
    })
}

/// Monitors with such conditions; with what must be held and what becomes stale as it was drawn, or without.
fn any_certificates(difficult: bool, timed: bool) -> impl Strategy<Value = Vec<Monitor>> {
    let number = if difficult { difficult_number().boxed() } else { simple_number().boxed() };
    (random::any_monitors(), prop::collection::vec(any_condition(number, difficult), 16)).prop_map(
        move |(mut monitors, conditions)| {
            let evidence = monitors.iter_mut().flat_map(|monitor| &mut monitor.evidence);
            for (evidence, condition) in evidence.zip(conditions) {
                (evidence.inputs, evidence.condition) = (inputs(), condition);
                // Only what the condition reads; so the inputs of all are at the same positions.
                if !timed {
                    (evidence.held, evidence.stale) = (0.0, None);
                }
            }
            monitors
        },
    )
}

/// Evidence with the inputs that its condition reads only, as plans have it.
fn narrowed(monitors: &[Monitor]) -> Vec<Monitor> {
    fn rename(of: &mut Condition, to: &dyn Fn(u32) -> u32) {
        match of {
            Condition::Constant(_) => {}
            Condition::Input(at) => *at = to(*at),
            Condition::Compare { left, right, .. } => {
                for side in [left, right] {
                    rename_number(side, to);
                }
            }
            Condition::Same { left, right } => [left, right].into_iter().for_each(|part| rename(part, to)),
            Condition::All(parts) | Condition::Any(parts) => parts.iter_mut().for_each(|part| rename(part, to)),
            Condition::Not(of) => rename(of, to),
        }
    }
    fn rename_number(of: &mut Expression, to: &dyn Fn(u32) -> u32) {
        match of {
            Expression::Input(at) => *at = to(*at),
            Expression::Negate(of) | Expression::Absolute(of) | Expression::Unary { of, .. } => rename_number(of, to),
            Expression::Sum(of) | Expression::Product(of) | Expression::Min(of) | Expression::Max(of) => {
                for part in of {
                    rename_number(part, to);
                }
            }
            Expression::Divide { value, by } => [value, by].into_iter().for_each(|part| rename_number(part, to)),
            _ => {}
        }
    }
    let mut monitors = monitors.to_vec();
    for evidence in monitors.iter_mut().flat_map(|monitor| &mut monitor.evidence) {
        let mut used: Vec<u32> = Vec::new();
        let collected = std::cell::RefCell::new(&mut used);
        rename(&mut evidence.condition, &|at| {
            let mut used = collected.borrow_mut();
            if !used.contains(&at) {
                used.push(at);
            }
            at
        });
        rename(&mut evidence.condition, &|at| used.iter().position(|&other| other == at).unwrap() as u32);
        evidence.inputs = used.iter().map(|&at| inputs()[at as usize].clone()).collect();
    }
    monitors
}

/// Values that distinguish all that conditions on two numbers can.
fn samples() -> Vec<Sample> {
    // Conditions compare with halves, and two numbers may be in one gap between two of these.
    let numbers: Vec<f64> =
        (-7..=7).flat_map(|half| [0.0, 0.125, 0.25].map(|more| f64::from(half) / 2.0 + more)).collect();
    let mut samples = Vec::new();
    for &x in &numbers {
        for &y in &numbers {
            for flag in [false, true] {
                samples.extend(TEXTS.map(|text| Sample { x, y, flag, text }));
            }
        }
    }
    samples
}

/// Vectors of what is true of all evidence, at all moments of these samples: settled ones, and with topics unknown.
fn vectors(monitors: &[Monitor], samples: &[Sample]) -> [BTreeSet<Vec<bool>>; 2] {
    let evidence: Vec<&Evidence> = monitors.iter().flat_map(|monitor| &monitor.evidence).collect();
    let settled = |sample| evidence.iter().map(|evidence| holds(&evidence.condition, sample)).collect();
    let settled: BTreeSet<Vec<bool>> = samples.iter().map(settled).collect();
    let reads: Vec<u32> = evidence.iter().map(|evidence| topics(&evidence.condition)).collect();
    let known = |known: u32, vector: &Vec<bool>| {
        vector.iter().zip(&reads).map(|(&holds, reads)| holds && reads & !known == 0).collect::<Vec<bool>>()
    };
    let possible = (0..16).flat_map(|topics| settled.iter().map(move |vector| known(topics, vector))).collect();
    [settled, possible]
}

struct Naive<'a> {
    network: &'a Network,
    settled: Vec<Vec<bool>>,
    possible: Vec<Vec<bool>>,
}

impl Naive<'_> {
    fn at(&self, vector: &[bool]) -> Moment<'_> {
        Moment::new(self.network, |evidence| Truth::from(vector[evidence.index()]))
    }

    fn findings(&self, monitors: &[Monitor]) -> Vec<Finding> {
        let mut findings = Vec::new();
        for (monitor, declared) in (0..).map(MonitorId).zip(monitors) {
            let settled: Vec<Moment<'_>> = self.settled.iter().map(|vector| self.at(vector)).collect();
            let possible: Vec<Moment<'_>> = self.possible.iter().map(|vector| self.at(vector)).collect();
            let count = self.network.guarantees(monitor);
            let can = |at: u32| settled.iter().any(|moment| moment.guarantee(monitor, at).holds());
            for guarantee in 0..count {
                let holds = |moment: &Moment<'_>, at| moment.guarantee(monitor, at).holds();
                if !can(guarantee) {
                    findings.push(Finding::Never { monitor, guarantee });
                    continue;
                }
                if settled.iter().all(|moment| holds(moment, guarantee)) {
                    findings.push(Finding::Always { monitor, guarantee });
                }
                let stronger: Vec<u32> = (0..guarantee).filter(|&at| can(at)).collect();
                let covered = |by: &[u32]| {
                    possible.iter().all(|moment| !holds(moment, guarantee) || by.iter().any(|&at| holds(moment, at)))
                };
                if covered(&stronger) {
                    let by = stronger.iter().copied().find(|&one| covered(&[one])).map_or(stronger, |one| vec![one]);
                    findings.push(Finding::NeverState { monitor, guarantee, by });
                }
            }
            for weaker in 1..count {
                let contradicts = |&stronger: &u32| {
                    settled.iter().any(|moment| {
                        moment.guarantee(monitor, stronger).holds() && !moment.guarantee(monitor, weaker).holds()
                    })
                };
                if let Some(stronger) = (0..weaker).rev().find(contradicts) {
                    let witness = sesame_monitor::check::Witness {
                        when: When::Settled,
                        inputs: Vec::new(),
                        evidence: Vec::new(),
                    };
                    findings.push(Finding::Order { monitor, stronger, weaker, witness });
                }
            }
            for evidence in 0..declared.evidence.len() as u32 {
                let id = self.network.evidence(monitor, evidence).index();
                let replaced = [true, false].into_iter().find(|&as_if| {
                    self.possible.iter().all(|vector| {
                        let mut other = vector.clone();
                        other[id] = as_if;
                        self.at(vector).state(monitor) == self.at(&other).state(monitor)
                    })
                });
                findings.extend(replaced.map(|as_if| Finding::Redundant { monitor, evidence, as_if }));
            }
        }
        findings
    }
}

/// Findings without their witnesses, which are checked: the values make the moment, and at the moment it happens.
fn without_witnesses(monitors: &[Monitor], report: &Report) -> Vec<Finding> {
    let network = Network::new(monitors).unwrap();
    let all: Vec<&Evidence> = monitors.iter().flat_map(|monitor| &monitor.evidence).collect();
    let mut findings = report.findings.clone();
    for finding in &mut findings {
        let Finding::Order { monitor, stronger, weaker, witness } = finding else { continue };
        let mut sample = Sample { x: f64::NAN, y: f64::NAN, flag: false, text: "c" };
        for (_, input, value) in &witness.inputs {
            match (input.field.topic.0, value) {
                (X, Value::Number(x)) => sample.x = *x,
                (Y, Value::Number(y)) => sample.y = *y,
                (FLAG, Value::Flag(flag)) => sample.flag = *flag,
                (3, Value::Text(text)) => sample.text = TEXTS.into_iter().find(|known| known == text).unwrap_or("c"),
                other => panic!("{other:?}"),
            }
        }
        for (evidence, truth) in all.iter().zip(&witness.evidence) {
            let raw = holds(&evidence.condition, &sample);
            let fell = match witness.when {
                When::Settled => false,
                When::Started(after) => SimTime::from_seconds(evidence.held) > after,
                When::Silent => evidence.stale.is_some(),
            };
            assert!(*truth == Truth::Unknown || truth.holds() == (raw && !fell), "{evidence:?} {sample:?}");
        }
        let moment = Moment::new(&network, |evidence| witness.evidence[evidence.index()]);
        assert!(moment.guarantee(*monitor, *stronger).holds());
        assert!(!moment.guarantee(*monitor, *weaker).holds());
        witness.when = When::Settled;
        (witness.inputs, witness.evidence) = (Vec::new(), Vec::new());
    }
    findings
}

/// Whether what can happen contradicts a finding.
fn is_contradicted(finding: &Finding, naive: &Naive<'_>) -> bool {
    match finding {
        Finding::Never { monitor, guarantee } => {
            naive.possible.iter().any(|vector| naive.at(vector).guarantee(*monitor, *guarantee).holds())
        }
        Finding::Always { monitor, guarantee } => {
            naive.settled.iter().any(|vector| !naive.at(vector).guarantee(*monitor, *guarantee).holds())
        }
        Finding::NeverState { monitor, guarantee, .. } => {
            naive.possible.iter().any(|vector| naive.at(vector).state(*monitor) == State::Guarantee(*guarantee))
        }
        Finding::Redundant { monitor, evidence, as_if } => naive.possible.iter().any(|vector| {
            let mut other = vector.clone();
            other[naive.network.evidence(*monitor, *evidence).index()] = *as_if;
            naive.at(vector).state(*monitor) != naive.at(&other).state(*monitor)
        }),
        Finding::Order { .. } => false,
    }
}

fn any_value() -> impl Strategy<Value = Sample> {
    let number = prop_oneof![(-4..6_i8).prop_map(|x| f64::from(x) / 2.0), Just(f64::NAN)];
    (number.clone(), number, any::<bool>(), prop::sample::select(TEXTS.to_vec()))
        .prop_map(|(x, y, flag, text)| Sample { x, y, flag, text })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn findings_are_those_of_all_values(monitors in any_certificates(false, false)) {
        let network = Network::new(&monitors).unwrap();
        let [settled, possible] = vectors(&monitors, &samples()).map(|vectors| vectors.into_iter().collect());
        let naive = Naive { network: &network, settled, possible };
        let monitors_as_planned = narrowed(&monitors);
        let report = check(&monitors_as_planned, &|_| Values::ANY).unwrap();
        prop_assert_eq!(&report.undecided, &Vec::<Question>::new());
        prop_assert_eq!(without_witnesses(&monitors, &report), naive.findings(&monitors));
    }

    #[test]
    fn no_finding_is_false_for_difficult_conditions(
        monitors in any_certificates(true, false),
    ) {
        let network = Network::new(&monitors).unwrap();
        let [settled, possible] = vectors(&monitors, &samples()).map(|vectors| vectors.into_iter().collect());
        let naive = Naive { network: &network, settled, possible };
        let report = check(&narrowed(&monitors), &|_| Values::ANY).unwrap();
        for finding in without_witnesses(&monitors, &report) {
            prop_assert!(!is_contradicted(&finding, &naive), "{finding:?}");
        }
    }

    #[test]
    fn no_run_contradicts_a_finding(
        monitors in any_certificates(true, true),
        messages in prop::collection::vec((0..4_i64, 0..4_u32, any_value()), 1..60),
    ) {
        let network = Arc::new(Network::new(&monitors).unwrap());
        let report = check(&narrowed(&monitors), &|_| Values::ANY).unwrap();
        let findings = without_witnesses(&monitors, &report);
        let all: Vec<&Evidence> = monitors.iter().flat_map(|monitor| &monitor.evidence).collect();
        let reads: Vec<u32> = all.iter().map(|evidence| topics(&evidence.condition)).collect();
        let mut changes = Changes::default();
        let mut run = Run::start(Arc::clone(&network), &mut changes);
        let mut now = 0;
        let mut latest = Sample { x: 0.0, y: 0.0, flag: false, text: "c" };
        let mut known = 0_u32;
        let look = |run: &Run| {
            let vector: Vec<bool> = (0..all.len() as u32).map(|at| run.evidence(EvidenceId(at)).holds()).collect();
            let naive = Naive { network: &network, settled: Vec::new(), possible: vec![vector.clone()] };
            let broken = findings.iter().find(|finding| is_contradicted(finding, &naive));
            assert!(broken.is_none(), "{broken:?} {vector:?}");
        };
        for (later, topic, value) in messages {
            for _ in 0..later {
                now += 1;
                run.advance(SimTime::from_nanos(now), &mut changes);
                look(&run);
            }
            let finite = match topic {
                X => { latest.x = value.x; value.x.is_finite() }
                Y => { latest.y = value.y; value.y.is_finite() }
                FLAG => { latest.flag = value.flag; true }
                _ => { latest.text = value.text; true }
            };
            known = if finite { known | 1 << topic } else { known & !(1 << topic) };
            let heard: Vec<Reading> = (0..).map(EvidenceId).zip(&all).zip(&reads)
                .filter(|(_, reads)| *reads >> topic & 1 == 1)
                .map(|((id, evidence), &reads)| {
                    let known = reads & !known == 0;
                    let truth = if known { holds(&evidence.condition, &latest).into() } else { Truth::Unknown };
                    Reading::now(SimTime::from_nanos(now), id, truth)
                })
                .collect();
            run.observe(SimTime::from_nanos(now), &heard, &mut changes);
            look(&run);
        }
    }
}

fn compare(left: Expression, by: Comparison, right: f64) -> Condition {
    Condition::Compare { left, by, right: c(right) }
}

/// A monitor over these conditions.
fn monitor(conditions: Vec<Condition>, gates: Vec<sesame_plan::Gate>) -> Monitor {
    let mut evidence = random::plain(conditions.len());
    for (evidence, condition) in evidence.iter_mut().zip(conditions) {
        (evidence.inputs, evidence.condition) = (inputs(), condition);
    }
    random::monitor(evidence, gates)
}

#[test]
fn conditions_that_exclude_each_other_are_not_true_together() {
    let x = || Expression::Input(X);
    let of = |by, bound| compare(x(), by, bound);
    let one = monitor(
        vec![of(Comparison::Above, 5.0), of(Comparison::Below, 3.0), of(Comparison::Above, 1.0)],
        vec![All(vec![E(0), E(1), E(2)])],
    );
    let monitors = narrowed(&[one]);
    let all: Vec<&Evidence> = monitors[0].evidence.iter().collect();
    let together = |which: &[usize]| {
        check::together(&which.iter().map(|&at| all[at]).collect::<Vec<_>>(), &|_| Values::ANY, &mut 100_000)
    };
    assert_eq!(together(&[0, 1]), Some(false));
    assert_eq!(together(&[0, 2]), Some(true));
    assert_eq!(together(&[1, 2]), Some(true));
    assert_eq!(together(&[1]), Some(true));
    assert_eq!(together(&[]), Some(true));
}

fn findings(monitor: Monitor) -> Vec<Finding> {
    let report = check(&narrowed(&[monitor]), &|_| Values::ANY).unwrap();
    assert!(report.undecided.is_empty());
    report.findings
}

use sesame_plan::Gate::{All, Any, Evidence as E};

const M: MonitorId = MonitorId(0);

#[test]
fn pressures_that_exclude_each_other_are_found() {
    let high = compare(input(X), Comparison::Above, 5.0);
    let low = compare(input(X), Comparison::Below, 3.0);
    let both = monitor(vec![high.clone(), low.clone()], vec![All(vec![E(0), E(1)])]);
    assert_eq!(findings(both)[0], Finding::Never { monitor: M, guarantee: 0 });
    let not_low = compare(input(X), Comparison::AtLeast, 3.0);
    let either = monitor(vec![low, not_low], vec![Any(vec![E(0), E(1)])]);
    assert_eq!(findings(either)[0], Finding::Always { monitor: M, guarantee: 0 });
}

#[test]
fn differences_of_inputs_are_related_to_the_inputs() {
    let far = compare(difference(), Comparison::Above, 3.0);
    let small = compare(input(X), Comparison::Below, 2.0);
    let positive = compare(input(Y), Comparison::AtLeast, 0.0);
    let all = All(vec![E(0), E(1), E(2)]);
    let found = findings(monitor(vec![far, small, positive], vec![all]));
    assert_eq!(found[0], Finding::Never { monitor: M, guarantee: 0 });
    let above =
        Condition::Compare { left: input(X), by: Comparison::Above, right: Expression::Sum(vec![input(Y), c(0.5)]) };
    let not_above = Condition::Compare { left: input(X), by: Comparison::AtMost, right: input(Y) };
    let found = findings(monitor(vec![above, not_above], vec![All(vec![E(0), E(1)])]));
    assert_eq!(found[0], Finding::Never { monitor: M, guarantee: 0 });
}

#[test]
fn a_stronger_guarantee_that_needs_less_is_found_with_values() {
    let near = compare(input(X), Comparison::Above, 1.0);
    let flag = Condition::Input(FLAG);
    let found = findings(monitor(vec![near, flag], vec![E(0), All(vec![E(0), E(1)])]));
    let Finding::Order { stronger: 0, weaker: 1, witness, .. } = &found[1] else { panic!("{found:?}") };
    assert_eq!(witness.evidence, [Truth::True, Truth::False]);
    assert_eq!(found[0], Finding::NeverState { monitor: M, guarantee: 1, by: vec![0] });
    assert_eq!(found[2], Finding::Redundant { monitor: M, evidence: 1, as_if: true });
}

#[test]
fn what_must_be_held_may_come_later_than_what_need_not() {
    let high = compare(input(X), Comparison::Above, 1.0);
    let mut certificate = monitor(vec![high.clone(), high], vec![E(0), E(1)]);
    certificate.evidence[0].held = 1.0;
    // The weaker one holds first, so it is the state for a while.
    assert_eq!(findings(certificate.clone()), []);
    // And if the weaker one must be held, the stronger one holds without it at the start.
    certificate.evidence.swap(0, 1);
    let found = findings(certificate.clone());
    assert_eq!(found[0], Finding::NeverState { monitor: M, guarantee: 1, by: vec![0] });
    let Finding::Order { witness, .. } = &found[1] else { panic!("{found:?}") };
    assert_eq!(witness.when, When::Started(SimTime::ZERO));
    // What is held for longer was held for shorter.
    certificate.evidence[0].held = 0.5;
    assert_eq!(findings(certificate.clone())[0], Finding::NeverState { monitor: M, guarantee: 1, by: vec![0] });
    certificate.evidence[0].held = 2.0;
    assert_eq!(findings(certificate), []);
}

#[test]
fn silence_may_take_the_weaker_guarantee_only() {
    let high = compare(input(X), Comparison::Above, 1.0);
    let mut certificate = monitor(vec![high.clone(), high], vec![E(0), E(1)]);
    certificate.evidence[1].stale = Some(Stale { after: 1.0, is: StaleIs::False, all: false });
    let found = findings(certificate);
    let Finding::Order { witness, .. } = &found[1] else { panic!("{found:?}") };
    assert_eq!((witness.when, &witness.evidence[..]), (When::Silent, &[Truth::True, Truth::False][..]));
}

#[test]
fn whole_numbers_have_nothing_between_them() {
    let between =
        Condition::All(vec![compare(input(X), Comparison::Above, 2.0), compare(input(X), Comparison::Below, 3.0)]);
    let certificate = narrowed(&[monitor(vec![between], vec![E(0)])]);
    let whole = Values { least: 0.0, greatest: 255.0, whole: true, group: false };
    assert_eq!(check(&certificate, &|_| whole).unwrap().findings[0], Finding::Never { monitor: M, guarantee: 0 });
    assert_eq!(check(&certificate, &|_| Values::ANY).unwrap().findings, []);
    let negative = narrowed(&[monitor(vec![compare(input(X), Comparison::Below, 0.0)], vec![E(0)])]);
    assert_eq!(check(&negative, &|_| whole).unwrap().findings[0], Finding::Never { monitor: M, guarantee: 0 });
}

#[test]
fn messages_before_and_after_operations_are_not_the_same() {
    let high = compare(input(X), Comparison::Above, 5.0);
    let low = compare(input(X), Comparison::Below, 3.0);
    let mut certificate = monitor(vec![high, low], vec![All(vec![E(0), E(1)])]);
    certificate.evidence[0].side = Side::Inbound;
    assert_eq!(findings(certificate), []);
}

#[test]
fn a_contradiction_undoes_all_that_led_to_it() {
    let order = Condition::Compare { left: input(Y), by: Comparison::AtLeast, right: input(X) };
    let one = compare(difference(), Comparison::Equal, 1.0);
    let two = sesame_plan::Gate::AtLeast { count: 2, of: vec![E(1), E(1), E(0), E(1)] };
    let found = findings(monitor(vec![order, one], vec![two]));
    assert_eq!(found, [Finding::Redundant { monitor: M, evidence: 0, as_if: true }]);
}
