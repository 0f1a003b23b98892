//! A plan that is written as text of the language reads back as the same plan, bit for bit.

use std::collections::BTreeSet;
use std::fmt::{self, Write as _};

use proptest::prelude::*;
use proptest::strategy::Union;
use proptest::test_runner::{TestCaseResult, TestRunner};

use sesame_dsl::diagnostic::Severity;
use sesame_dsl::diagnostic::render::human;
use sesame_dsl::source::SourceMap;
use sesame_dsl::units;
use sesame_notation::{doc_comment, expectation, simulator_seed, test_block, test_operation};
use sesame_plan::condition::{
    Comparison, Condition, ConditionEnd, ConditionSpace, Constraint, Integers, Operand, Variable,
};
use sesame_plan::{
    Activation, ActivationMode, Bound, Campaign, CampaignPlan, Choice, ChoiceKind, Confirmation, Copies, Count,
    CoverageGoal, Dimension, Domain, Expectation, GridAxis, KnownTest, Lengths, Metric, MetricId, MetricSource,
    Operation, OperationId, OperationKind, Parameter, Recorded, Score, Search, Span, Statistic, StopRule, Test,
    TestOperation,
};
use sesamec::explain;

/// Units that are made up of several symbols.
const COMPOUND: [&str; 5] = ["km/h", "rad/s^2", "kg*m/s", "N*m", "m^2/s"];

/// Topics and metrics in every unit of the language; messages for what has none.
fn system(units: &[&str]) -> String {
    let mut topics = String::new();
    let mut metrics = String::new();
    for (at, unit) in units.iter().enumerate() {
        let unit = if unit.is_empty() { String::new() } else { format!("[{unit}]") };
        let _ = writeln!(topics, "topic t{at} = \"t{at}\" : real{unit}  topic p{at} = \"p{at}\" : point{unit}");
        let _ = writeln!(metrics, "metric m{at}: real{unit} maximise {{ hook on t{at} }}");
        let _ = writeln!(metrics, "metric n{at}: real{unit} minimise {{ hook on p{at} }}");
    }
    format!(
        r#"space everything
        system {{
          simulator sim = in_process "cell_sim::Cell" {{ crate "simulator"  step 20ms }}
          message Note {{ name: text  known: bool  at: int[ns]  level: real[mm]  spans: list of real[mm] }}
          topic note = "notes/{{A,B}}" : Note
          {topics}
        }}
        {metrics}
        requirement R1 "nothing is hit" = m0 <= 0ns
        "#
    )
}

/// An operation of each kind, on every unit where the kind has numbers of a unit. The numbers are replaced.
fn operations(units: &[&str]) -> String {
    let mut text = String::new();
    for (at, unit) in units.iter().enumerate() {
        let one = format!("[0{unit}, 1{unit}]");
        let corners = format!("[(0, 0, 0){unit}, (1, 1, 1){unit}]");
        let _ = writeln!(text, "operation offset{at} on t{at} = random offset {one}");
        let _ = writeln!(text, "operation moved{at} on p{at} = random absolute {corners}");
        let _ = writeln!(text, "operation stuck{at} on t{at} = stuck at {one}");
        let _ = writeln!(text, "operation biased{at} on p{at} = bias {corners}");
        let _ = writeln!(text, "operation noisy{at} on t{at} = noise {one}");
        if ["mrad", "rad", "deg", "rev"].contains(unit) {
            let _ = writeln!(text, "operation turned{at} on t{at} = drift [0{unit}/s, 1{unit}/s] wrapped");
            let _ = writeln!(text, "operation tilted{at} on t{at} = random offset {one} wrapped [0{unit}, 1rev]");
        }
    }
    text + r#"
        operation drifting on note.level = drift [0m/s, 1m/s]
        operation scaled on note.level, note.spans[2], note.spans[*] = scale [1, 2]
        operation skewed on note.at = clock skew [0ms, 1ms]
        operation old on note.spans = stale [0ms, 700ms]
        operation named on note.name = stuck at one of "a", "b"
        operation guessed on note.name = random one of "a", "b"
        operation denied on note.known = stuck at false
        operation broken on note.level = -infinity
        operation frozen on note = freeze
        operation lost on note = packet loss [0%, 1%]
        operation bursts on note = burst loss { enter [0%, 1%]  leave [1%, 2%]  loss [5%, 9%] }
        operation long_bursts on note = burst loss { enter [0%, 1%]  leave [1%, 2%] }
        operation thinned on note = rate limit [1Hz, 5Hz]
        operation late on note = latency [0s, 1s]
        operation uneven on note = latency [0s, 1s] normal drain flush
        operation mixed on note = reorder [0s, 1s] drain drop
        operation twice on note = duplicate [1, 7]
        operation cut on note = blackhole
        operation cut_some on note = blackhole next [1, 9] messages every [2, 3] messages
        operation lost_some on one of note = packet loss [0%, 1%] every [2, 3] messages
        operation bent on t0 = custom {
          points: int [0, 1]  gain: real [0, 1]  reach: real[mm] [0mm, 1mm]
          shift: point [(0, 0, 0)m, (1, 1, 1)m]  frame: one of "a", "b"
        }
        operation spoilt = custom before start { file: file one of "calibration.yaml", "maps/hall.yaml" }
        operation tidied = custom after end { }
    "#
}

/// The plan of the campaign `look` in this text.
fn plan(text: &str) -> CampaignPlan {
    let mut sources = SourceMap::new();
    let file = sources.add("everything.sesame", text);
    let analysis = sesame_dsl::analyse(&sources, file);
    let Some(space) = analysis.model else {
        let errors =
            analysis.diagnostics.into_iter().filter(|diagnostic| diagnostic.severity() == Severity::Error).take(5);
        panic!("{}", human(&errors.collect::<Vec<_>>(), &sources, false));
    };
    let campaign = space.campaign("look").expect("there is a campaign");
    sesame_codegen::lower::lower(&space, campaign, "everything.sesame", "sesamec 0.0.0").plan
}

/// A plan as the text of a file below this system.
fn written(system: &str, plan: &CampaignPlan) -> String {
    let explained = explain::campaign(plan);
    let mut text = format!("{system}\n{}", explained.split("\n(* ").next().expect("there is a first part"));
    for test in &plan.tests {
        let operations = test.test.operations.iter().map(|used| test_operation(plan, used));
        let expected = test.expectations.iter().map(|expected| expectation(expected, &plan.metrics));
        let seed = test.simulator_seed.map(simulator_seed);
        text.push_str(&test_block(&test.doc, &test.name, operations.chain(seed).chain(expected)));
    }
    text
}

#[test]
fn nodes_of_operations_are_written_and_read_back() {
    let system = r#"space everything
        system {
          simulator sim = ros2
          message Level = "std_msgs/msg/Float64" { data: real[mm] }
          topic level = "level" : Level
          node a { publishes level }  node b { publishes level  subscribes level }  node c { subscribes level }
        }
        metric m0 maximise = max(level.data)
        "#;
    let text = format!(
        "{system} operation lost on level from b, a = packet loss [0%, 1%]
         operation late on level to c = latency [0s, 1s]
         operation biased on level.data from a to b, c = bias [0mm, 1mm]
         campaign look {{ objectives m0  operations lost, late, biased 1 per test  search random {{ evaluations 1 }}
                         end after 5s }}"
    );
    let before = plan(&text);
    assert_eq!(before.operations[0].from.len(), 2);
    let again = written(system, &before);
    assert!(again.contains("on level.data from a to b, c = bias"), "{again}");
    assert_eq!(plan(&again), before);
}

/// Finite numbers of every size, and those that people write.
fn number() -> impl Strategy<Value = f64> + Clone {
    use prop::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    prop_oneof![
        3 => NORMAL | SUBNORMAL | ZERO | POSITIVE | NEGATIVE,
        3 => (-100_000i32..100_000, 0..6).prop_map(|(digits, point)| f64::from(digits) / 10f64.powi(point)),
        1 => Just(0.1 + 0.2),
    ]
}

/// Fractions, of which the language writes percentages.
fn share() -> impl Strategy<Value = f64> + Clone {
    prop_oneof![0.0..=1.0f64, (0..=1000).prop_map(|permille| f64::from(permille) / 1e3)]
}

/// Two numbers in their order.
fn ordered(number: impl Strategy<Value = f64> + Clone) -> impl Strategy<Value = (f64, f64)> {
    (number.clone(), number).prop_map(|(a, b)| if a <= b { (a, b) } else { (b, a) })
}

/// Any text of the language: one line with a visible character.
fn text() -> impl Strategy<Value = String> {
    let characters = prop_oneof![any::<char>(), Just('"'), Just('\\'), Just('\t'), prop::char::range('a', 'z')];
    let texts = prop::collection::vec(characters, 1..12).prop_map(String::from_iter);
    texts.prop_filter("a line with a visible character", |text| !text.contains(['\n', '\r']) && !text.trim().is_empty())
}

fn doc() -> impl Strategy<Value = String> {
    prop::collection::vec("[!-~]([ -~]{0,20}[!-~])?", 0..3).prop_map(|lines| lines.join("\n"))
}

/// Other numbers and texts that are permitted where these are.
fn domain(kind: &OperationKind, parameter: &Parameter) -> BoxedStrategy<Domain> {
    match parameter.domain.clone() {
        Domain::Number { shape, integer, .. } => {
            let whole = || (-1_000_000_000_000i64..1_000_000_000_000).prop_map(|whole| whole as f64);
            let numbers = match kind {
                OperationKind::PacketLoss | OperationKind::BurstLoss => ordered(share()).boxed(),
                OperationKind::Slow { .. } => ordered(share().prop_map(|share| share.clamp(1e-9, 0.999))).boxed(),
                OperationKind::Duplicate => ordered((1..100u32).prop_map(f64::from)).boxed(),
                OperationKind::RateLimit => ordered(1e-3..1e6f64).boxed(),
                OperationKind::Latency { .. } | OperationKind::Reorder { .. } | OperationKind::Stale => {
                    ordered(0.0..60.0f64).boxed()
                }
                OperationKind::Noise => ordered(number().prop_map(f64::abs)).boxed(),
                _ if integer => ordered(whole()).boxed(),
                _ => ordered(number()).boxed(),
            };
            numbers.prop_map(move |(low, high)| Domain::Number { low, high, shape, integer }).boxed()
        }
        Domain::Point { .. } => {
            let axes = [(); 3].map(|()| ordered(number()));
            axes.prop_map(|axes| Domain::Point { low: axes.map(|range| range.0), high: axes.map(|range| range.1) })
                .boxed()
        }
        Domain::Texts { .. } => {
            let texts = prop::collection::btree_set(text(), 1..4);
            texts.prop_map(|texts| Domain::Texts { texts: texts.into_iter().collect() }).boxed()
        }
        files @ Domain::Files { .. } => Just(files).boxed(),
    }
}

/// An operation like this one, with other numbers, texts and clauses.
fn operation(like: &Operation, end: f64, by_condition: bool) -> BoxedStrategy<Operation> {
    let domains: Vec<_> = like.parameters.iter().map(|parameter| domain(&like.kind, parameter)).collect();
    let texts = prop::collection::btree_set(text(), 1..4);
    let constraints = if by_condition { 0..3 } else { 0..1 };
    let constraint = prop_oneof![
        Just(Constraint::Variable { metric: MetricId(0) }),
        (-3..3i64, 3..9i64).prop_map(|(lowest, highest)| Constraint::Integer { bounds: Integers { lowest, highest } }),
    ];
    // Longer than all windows and activations, so that those of tests are permitted.
    let lengths = (any::<bool>(), share(), 1e4..1e6f64);
    let lengths = lengths.prop_map(move |(bounded, low, high)| {
        (bounded && !by_condition).then_some(Lengths { low: low * 1e-12, high: high + end })
    });
    let constraints = prop::collection::vec(constraint, constraints);
    let clauses = (ordered(0.0..end), any::<i32>(), share(), any::<bool>(), constraints, lengths);
    let like = like.clone();
    (domains, texts, clauses)
        .prop_map(move |(domains, texts, ((start, stop), priority, inclusion, timed, constraints, lengths))| {
            let mut operation = like.clone();
            // Counts are from 1.
            let own = operation.own_parameters().len();
            for (parameter, domain) in operation.parameters.iter_mut().zip(domains).take(own) {
                parameter.domain = domain;
            }
            if let OperationKind::RandomText { texts: offered } = &mut operation.kind {
                *offered = texts.into_iter().collect();
            }
            (operation.priority, operation.inclusion) = (priority, inclusion);
            if operation.kind.is_offline() {
                operation.within = Span { start: 0.0, end };
            } else {
                operation.within = Span { start, end: stop.max(start.next_up()) };
                (operation.timed, operation.constraints, operation.lengths) = (timed, constraints, lengths);
                operation.constraints.dedup();
            }
            operation
        })
        .boxed()
}

/// What a test can choose of a domain.
fn choice(domain: &Domain) -> BoxedStrategy<Choice> {
    match domain.clone() {
        Domain::Number { low, high, shape, integer } => {
            let between = move |share: f64| {
                let x = (low + (high / 2.0 - low / 2.0) * share * 2.0).clamp(low, high);
                if integer { x.round().clamp(low, high) } else { x }
            };
            let ends = ordered(share()).prop_map(move |(a, b)| (between(a), between(b)));
            ends.prop_map(move |(a, b)| match shape {
                ChoiceKind::Value => Choice::Value { value: a },
                ChoiceKind::Range => Choice::Range { low: a.min(b), high: a.max(b) },
            })
            .boxed()
        }
        Domain::Point { low, high } => any::<[bool; 3]>()
            .prop_map(move |ends| Choice::Point {
                point: [0, 1, 2].map(|at| if ends[at] { high[at] } else { low[at] }),
            })
            .boxed(),
        Domain::Texts { texts: items } | Domain::Files { files: items } => {
            prop::sample::select(items).prop_map(|text| Choice::Text { text }).boxed()
        }
    }
}

/// Conditions over metrics that come in pairs of one unit: no comparison is constant.
fn condition(metrics: &[Metric]) -> impl Strategy<Value = Condition> + use<> {
    let by = prop::sample::select(vec![Comparison::Below, Comparison::Above, Comparison::Equal]);
    let truths: Vec<bool> = metrics.iter().map(is_truth).collect();
    let pairs = u32::try_from(metrics.len() / 2).expect("there are a few metrics");
    let sides = (0..pairs, number(), 0..4u8).prop_map(move |(pair, number, sides)| {
        // What is 0 or 1 is compared with what is between them.
        let number = if truths[2 * pair as usize] { 0.01 + 0.98 * number.abs().fract() } else { number };
        let [one, other] = [2 * pair, 2 * pair + 1].map(|id| Operand::Variable(MetricId(id)));
        match sides {
            0 => (one, other),
            1 => (other, one),
            2 => (one, Operand::Number(number)),
            _ => (Operand::Number(number), other),
        }
    });
    let comparison = (sides, by).prop_map(|((left, right), by)| Condition::Compare { left, by, right });
    comparison.prop_recursive(4, 12, 2, |inner| {
        (inner.clone(), inner, any::<bool>()).prop_map(|(a, b, and)| {
            let (a, b) = (Box::new(a), Box::new(b));
            if and { Condition::And(a, b) } else { Condition::Or(a, b) }
        })
    })
}

/// Whether a metric is 0 or 1 by being false or true.
fn is_truth(metric: &Metric) -> bool {
    matches!(metric.source, MetricSource::Monitor { score: Score::Holds { .. }, .. })
}

fn bound() -> impl Strategy<Value = Bound> {
    (number(), ordered(number()), 0..6u8).prop_map(|(value, (low, high), kind)| match kind {
        0 => Bound::AtMost { value },
        1 => Bound::Below { value },
        2 => Bound::AtLeast { value },
        3 => Bound::Above { value },
        4 => Bound::Equal { value },
        _ => Bound::Within { low, high },
    })
}

/// An operation of a test.
fn used(id: OperationId, of: &Operation, metrics: &[Metric]) -> BoxedStrategy<TestOperation> {
    let Span { start, end } = of.within;
    let at = move |share: f64| (start + (end - start) * share).clamp(start, end);
    let activation = if of.kind.is_offline() {
        Just(Activation::Offline).boxed()
    } else {
        let times = prop_oneof![Just(1), 1..100u32];
        // A condition may keep an operation active for any time.
        let by_conditions = u32::from(of.lengths.is_none());
        prop_oneof![
            1 => ordered(share()).prop_map(move |(a, b)| Activation::Time { start: at(a), end: at(b) }).prop_filter(
                "a window that is not empty",
                |activation| matches!(activation, Activation::Time { start, end } if start < end)
            ),
            by_conditions => (condition(metrics), condition(metrics), times.clone())
                .prop_map(|(start, end, times)| Activation::Condition { start, end, times }),
            1 => (condition(metrics), 1e-9..1e3f64, times).prop_map(|(start, length, times)| Activation::ConditionFor {
                start,
                length,
                times
            }),
        ]
        .boxed()
    };
    let choices: Vec<_> = of.parameters.iter().map(|parameter| choice(&parameter.domain)).collect();
    (activation, choices, any::<u64>())
        .prop_map(move |(activation, parameters, operation_seed)| TestOperation {
            operation: id,
            activation,
            parameters,
            operation_seed,
            messages: None,
        })
        .boxed()
}

/// Regression tests of these operations.
fn tests(operations: &[Operation], metrics: &[Metric]) -> impl Strategy<Value = Vec<KnownTest>> + use<> {
    let used = (0..).map(OperationId).zip(operations).map(|(id, operation)| used(id, operation, metrics));
    let used = Union::new(used);
    let metrics = u32::try_from(metrics.len()).expect("there are a few metrics");
    let expected = (0..metrics, bound()).prop_map(|(metric, bound)| Expectation { metric: MetricId(metric), bound });
    let seed = prop::option::of(any::<u64>());
    let test = (prop::collection::vec(used, 1..12), prop::collection::vec(expected, 0..4), doc(), seed);
    prop::collection::vec(test, 1..6).prop_map(|tests| {
        let tests = tests.into_iter().enumerate().map(|(at, (operations, expectations, doc, simulator_seed))| {
            KnownTest { name: format!("test{at}"), doc, test: Test { operations }, expectations, simulator_seed }
        });
        tests.collect()
    })
}

/// How conditions grow: over the first metrics, each with a range or without one.
fn condition_space(metrics: &[Metric]) -> impl Strategy<Value = ConditionSpace> + use<> {
    let metrics: Vec<(Option<String>, bool)> =
        metrics.iter().map(|metric| (metric.unit.clone(), is_truth(metric))).collect();
    let range = (-1e9..-1e3f64, 1e3..1e9f64, prop::option::of(1e-5..1.0f64));
    let ranges = prop::collection::vec(prop::option::of(range), 2..4);
    let end = prop_oneof![
        Just(ConditionEnd::Condition),
        ordered(1e-3..60.0f64).prop_map(|(low, high)| ConditionEnd::Length { low, high }),
    ];
    (ranges, 1..=ConditionSpace::MOST_DEPTH, -9..=-3i64, 9..1000i64, end, 1..9u32).prop_map(
        move |(ranges, depth, lowest, highest, end, times)| ConditionSpace {
            variables: (0..)
                .zip(ranges)
                .zip(metrics.clone())
                .map(|((id, range), (unit, truth))| {
                    let range = if truth { Some((0.0, 1.0, None)) } else { range };
                    let step = range.and_then(|(low, high, share)| share.map(|share: f64| (high - low) * share));
                    Variable {
                        metric: MetricId(id),
                        unit,
                        low: range.map(|range| range.0),
                        high: range.map(|range| range.1),
                        step,
                    }
                })
                .collect(),
            depth,
            integers: Integers { lowest, highest },
            end,
            times,
        },
    )
}

/// A campaign like this one, with other settings.
fn campaign(like: &Campaign, metrics: &[Metric], end_after: f64) -> impl Strategy<Value = Campaign> + use<> {
    let activation = prop_oneof![
        Just(ActivationMode::Time),
        condition_space(metrics).prop_map(|space| ActivationMode::Condition { space }),
    ];
    let strategy = prop_oneof![
        Just(sesame_plan::Strategy::Random),
        (1..50u32).prop_map(|half| sesame_plan::Strategy::Nsga2 { population: 2 * half }),
        (1..50u32).prop_map(|half| sesame_plan::Strategy::MapElites { population: 2 * half }),
    ];
    let axis = (ordered(share()), 1..20u32);
    let coverage = (axis, 1..9u32, prop::option::of(share())).prop_map(|(((low, high), cells), hits, stop_at)| {
        let high = if low < high { high } else { high + 1.0 };
        let stop_at = stop_at.filter(|share| *share > 0.0);
        CoverageGoal { axes: vec![GridAxis { dimension: Dimension::T1, low, high, cells }], hits, stop_at }
    });
    let confirmation = (1..50u32, prop::option::of(share()), any::<bool>()).prop_map(|(times, share, violations)| {
        let by = share.filter(|share| (0.01..0.99).contains(share));
        Confirmation { times, by: by.map_or(Statistic::Median, |share| Statistic::Quantile { share }), violations }
    });
    let stop = prop_oneof![
        Just(Vec::new()),
        (1.0..1e5f64).prop_map(|seconds| vec![StopRule::WallTime { seconds }]),
        (0.01..0.99f64).prop_map(|share| vec![StopRule::Completeness { share }]),
        (1..500u32).prop_map(|tests| vec![StopRule::NoNewCause { tests }, StopRule::EveryPair]),
    ];
    let copies = prop::sample::select(vec![Copies::Apart, Copies::MayOverlap, Copies::Once]);
    let recorded = prop::option::of(prop::sample::select(vec![Recorded::Failing, Recorded::All]));
    let (like, seeds) = (like.clone(), (any::<u64>(), 100..10_000u32, 1..5u32));
    (activation, strategy, coverage, confirmation, stop, (copies, recorded), seeds, doc()).prop_map(
        move |(activation, strategy, coverage, confirmation, stop, (copies, record), (seed, evaluations, min), doc)| {
            let learns = strategy != sesame_plan::Strategy::Random;
            Campaign {
                doc,
                count: Count { min, max: min + 3 },
                copies,
                activation,
                search: Search::new(strategy, evaluations),
                coverage: Some(coverage),
                confirm: Some(confirmation),
                neighbours: learns.then_some(min),
                stop,
                seed,
                end_after,
                record,
                ..like.clone()
            }
        },
    )
}

/// A plan like this one with some of its operations, with other numbers, texts, tests and settings.
pub(crate) fn plans(like: &CampaignPlan) -> impl Strategy<Value = Shown> + use<> {
    let (like, metrics) = (like.clone(), like.metrics.clone());
    let settings = like.clone();
    let campaigns = (1.0..1e4f64).prop_flat_map(move |end| campaign(&settings.campaign, &settings.metrics, end));
    let operations = prop::sample::subsequence(like.operations.clone(), 1..=like.operations.len().min(11));
    (campaigns, operations)
        .prop_flat_map(move |(mut campaign, operations)| {
            campaign.operations = (0..).map(OperationId).take(operations.len()).collect();
            if campaign.copies != Copies::MayOverlap {
                campaign.count = Count { min: 1, max: u32::try_from(operations.len()).expect("there are a few") };
            }
            if campaign.count.max < 2 {
                campaign.stop.retain(|rule| *rule != StopRule::EveryPair);
            }
            let by_condition = matches!(campaign.activation, ActivationMode::Condition { .. });
            let operations = operations.iter().map(|drawn| operation(drawn, campaign.end_after, by_condition));
            let like = like.clone();
            operations.collect::<Vec<_>>().prop_map(move |operations| CampaignPlan {
                operations,
                campaign: campaign.clone(),
                ..like.clone()
            })
        })
        .prop_flat_map(move |plan| {
            tests(&plan.operations, &metrics).prop_map(move |tests| Shown(CampaignPlan { tests, ..plan.clone() }))
        })
}

/// A plan that a failure shows as text.
#[derive(Clone)]
pub(crate) struct Shown(pub(crate) CampaignPlan);

impl fmt::Debug for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&written("", &self.0))
    }
}

/// A system in every unit, and the plan of a campaign with each operation.
pub(crate) fn everything() -> (String, CampaignPlan) {
    let units: Vec<&str> = units::symbols().chain(COMPOUND).chain([""]).collect();
    let system = system(&units);
    let operations = operations(&units);
    let names = operations.split("operation ").skip(1).filter_map(|rest| rest.split(' ').next());
    let names = names.collect::<Vec<_>>().join(", ");
    let observed = (0..units.len()).map(|at| format!("m{at}, n{at}")).collect::<Vec<_>>().join(", ");
    let plan = plan(&format!(
        "{system}{operations}\n{}campaign look {{ objectives m0  observes {observed}
           operations {names} 1 per test  search random {{ evaluations 9 }}  end after 10s }}",
        doc_comment("As it is.")
    ));
    (system, plan)
}

/// Whether a plan's text reads back as the plan; the first difference.
fn reads_back(system: &str, original: &CampaignPlan) -> TestCaseResult {
    let again = plan(&written(system, original));
    for (operation, as_written) in again.operations.iter().zip(&original.operations) {
        prop_assert_eq!(operation, as_written);
    }
    for (test, as_written) in again.tests.iter().zip(&original.tests) {
        prop_assert_eq!(test, as_written);
    }
    for (metric, as_written) in again.metrics.iter().zip(&original.metrics) {
        prop_assert_eq!(metric, as_written);
    }
    prop_assert_eq!(&again.campaign, &original.campaign);
    prop_assert!(again == *original, "another part of the plan differs");
    Ok(())
}

/// A campaign with an operation of each kind on nodes and parameters, the system of which is one of ROS 2.
fn nodes() -> (String, CampaignPlan) {
    let system = r#"space everything
        system {
          simulator sim = ros2 { clock "/clock" }
          message Level = "std_msgs/msg/Float64" { data: real[mm] }
          topic level = "level" : Level
          node a { publishes level  launch "./a" "{ros-args}" }  node b { subscribes level }
        }
        metric m0 maximise = max(level.data)
        metric m1 minimise = min(level.data)
        requirement R1 "nothing is hit" = m0 <= 0mm
        "#;
    let text = format!(
        r#"{system} operation wrong on parameter "limits.\"speed\"" of b = set [-1, 3]
           operation wrong_too on parameter "gain" of a = set [0, 1]
           operation halted on node a = pause
           operation slowed on node a = slow [1%, 2%]
           operation killed on node a = kill
           campaign look {{ objectives m0, m1  operations wrong, wrong_too, halted, slowed, killed 1 per test
                           search random {{ evaluations 1 }}  end after 5s }}"#
    );
    (system.to_owned(), plan(&text))
}

/// A campaign of which parts of monitors are condition variables, beside scores.
fn monitors() -> (String, CampaignPlan) {
    let system = r#"space everything
        system {
          simulator sim = in_process "cell_sim::Cell" { step 20ms }
          topic level = "level" : real[mm]  topic other = "other" : real[mm]  topic state = "state" : int
          topic plc = "plc" : text  topic stop = "stop" : bool
        }
        eddi transport publishes state {
          demand    safe from eddi plc_monitor
          evidence  low  = level < 3mm held 100ms stale after 1s is false
          evidence  flat = other < 3mm inbound
          guarantee fast integrity 3 = 2 of (low, flat, safe)
          guarantee slow integrity 1 = low or flat
          otherwise halted mitigate with stop = true
        }
        eddi plc_monitor external on plc { guarantee safe integrity 1  otherwise not_safe }
        metric m0 maximise = max(level)
        metric m1 minimise = min(other)
        metric missed maximise = missed_hazards(transport, R1)
        metric alarms = false_alarms(transport, R1) within 5s
        metric lead default 0s = lead_time(transport, R1)
        metric fast = time_in(transport.fast)
        requirement R1 "nothing is hit" = m0 <= 3mm
        "#;
    let parts = ["low", "flat", "safe", "fast", "slow", "halted"].map(|part| format!("transport.{part}")).join(", ");
    let text = format!(
        r"{system} operation biased on level = bias [-1mm, 3mm]
           operation lied on state = stuck at [0, 3]
           operation cut on plc = blackhole
           campaign look {{ objectives m0, m1  operations biased, lied, cut 1 per test
                           observes {parts}
                           search random {{ evaluations 1 }}  end after 5s }}"
    );
    (system.to_owned(), plan(&text))
}

#[test]
fn parts_of_monitors_are_written_in_conditions_and_read_back() {
    let (system, like) = monitors();
    let names: Vec<&str> = like.metrics.iter().skip(2).map(|metric| metric.name.as_str()).collect();
    let parts = ["low", "flat", "safe", "fast", "slow", "halted"].map(|part| format!("transport.{part}"));
    assert_eq!(names, parts);
    assert_eq!(like.monitors.len(), 2);
    let test = r"test worst { biased bias 1mm when not transport.low until transport.low
                               cut when transport.fast == true and 0 < plc_monitor.safe for 2s
                               expect transport.halted == 1 }";
    let operations = "operation biased on level = bias [-1mm, 3mm]  operation cut on plc = blackhole";
    let campaign = "campaign look { objectives m0  operations biased, cut 1..2 per test
                    activate by condition over transport.low, plc_monitor.not_safe
                    observes missed, alarms, lead, fast
                    search random { evaluations 1 }  end after 5s or when transport.halted }";
    let before = plan(&format!("{system} {operations} {test} {campaign}"));
    let again = written(&system, &before);
    for part in [
        "when transport.low == 0 until transport.low == 1",
        "when transport.fast == 1 and 0 < plc_monitor.safe for 2s",
        "over transport.low in [0, 1], plc_monitor.not_safe in [0, 1]",
        "or when transport.halted == 1",
        "expect transport.halted == 1",
    ] {
        assert!(again.contains(part), "{part}: {again}");
    }
    reads_back(&system, &before).unwrap();
}

#[test]
fn what_operations_on_nodes_do_is_written_and_read_back() {
    let (system, like) = nodes();
    let node = |operation: &Operation| like.node(operation.kind.node().unwrap()).name.as_str();
    let on: Vec<&str> = like.operations.iter().map(node).collect();
    assert_eq!(on, ["b", "a", "a", "a", "a"]);
    assert!(like.operations.iter().all(|operation| operation.topic.is_none() && operation.places.is_empty()));
    let again = written(&system, &like);
    for line in
        [r#"on parameter "limits.\"speed\"" of b = set [-1, 3]"#, "on node a = slow [1%, 2%]", "on node a = kill"]
    {
        assert!(again.contains(line), "{again}");
    }
    reads_back(&system, &like).unwrap();
}

#[test]
fn what_a_node_is_set_to_its_transitions_and_drawn_constants_read_back() {
    let (system, _) = nodes();
    let system = system.replace("{ data: real[mm] }", "{ constant LOW = 1  constant HIGH = 9  data: real }");
    let system = system.replace("<= 0mm", "<= LOW");
    let text = format!(
        r#"{system} operation mode on parameter "mode" of b = set one of "by \"hand\"", "", "true"
           operation blind on parameter "on" of b = set false
           operation gains on parameter "gains" of a = set one of list [0.5, -1e300], list []
           operation words on parameter "words" of a = set list ["a, b", "\\"]
           operation flags on parameter "flags" of a = set one of list [true, false], list [false]
           operation off on node a = transition deactivate
           operation on_again on node b = transition activate
           operation drawn on level.data = random one of LOW, Level.HIGH
           operation held on level.data = stuck at one of LOW, Level.HIGH
           test t {{ mode value "by \"hand\"" from 1s to 2s  words value "list [\"a, b\", \"\\\\\"]" from 1s to 2s }}
           campaign look {{ objectives m0, m1
                           operations mode, blind, gains, words, flags, off, on_again, drawn, held 1 per test
                           search random {{ evaluations 1 }}  end after 5s }}"#
    );
    let like = plan(&text);
    like.validate().unwrap();
    reads_back(&system, &like).unwrap();
}

#[test]
fn each_kind_of_operation_reads_back_in_every_unit() {
    let (system, like) = everything();
    let kinds: BTreeSet<&str> = like.operations.iter().map(|operation| operation.kind.words()).collect();
    assert!(kinds.len() > 20, "{kinds:?}");
    reads_back(&system, &like).unwrap();
}

#[test]
fn what_is_written_reads_back_as_the_same_plan() {
    for (system, like) in [everything(), nodes(), monitors()] {
        let cases = ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(48) };
        let outcome = TestRunner::new(cases).run(&plans(&like), |Shown(original)| reads_back(&system, &original));
        if let Err(failure) = outcome {
            panic!("{failure}");
        }
    }
}
