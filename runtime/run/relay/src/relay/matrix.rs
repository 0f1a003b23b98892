//! Every operation, on every kind of payload that it is for, with every kind of activation: what the relay delivers and
//! counts, compared with naive models of what the operations mean.
//!
//! Messages come every tenth of a second from 0 s to 8 s; the operation is active from 2 s to 5 s, be it by time, by
//! conditions, or by a condition for a length.

use sesame_base::observation::AlteredMessages;
use sesame_base::time::SimTime;
use sesame_plan::condition::{Comparison, Condition, Operand};
use sesame_plan::testing::{self, plan, use_of};
use sesame_plan::{
    Activation, CampaignPlan, Choice, Distribution, Domain, Drain, FieldRef, Messages, MetricId, MetricSource,
    NotFinite, Operation, OperationKind, Span, Step, Test, TestOperation, TopicId, Type, ValueMode, ValuePath,
};

use crate::fuzz::KeyedRng;
use crate::metric::MetricTable;
use crate::relay::{AlteredList, Exchange as _, Finished, Relay};
use crate::value::{Fields, Record, Value};
use crate::wire::WireTable;

const MESSAGES: u32 = 81;
const SEED: u64 = 77;
/// Random numbers per value of a message, as `Places` documents.
const PER_VALUE: u64 = 8;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Payload {
    Real,
    Int,
    Bool,
    Text,
    Point,
    /// A real in a message in a message.
    Nested,
    /// The second real of a list.
    Element,
    /// All whole numbers of a list.
    Each,
    /// Two reals of one message.
    TwoFields,
}

const PAYLOADS: [Payload; 9] = [
    Payload::Real,
    Payload::Int,
    Payload::Bool,
    Payload::Text,
    Payload::Point,
    Payload::Nested,
    Payload::Element,
    Payload::Each,
    Payload::TwoFields,
];

fn record(fields: &[(&str, Value)]) -> Value {
    let names = Fields::new(fields.iter().map(|(name, _)| *name));
    Record::new(&names, fields.iter().map(|(_, value)| value.clone()).collect()).into()
}

impl Payload {
    fn message(self, n: u32) -> Value {
        let x = f64::from(n) + 0.25;
        match self {
            Payload::Real => Value::Real(x),
            Payload::Int => Value::Int(i64::from(n)),
            Payload::Bool => Value::Bool(n.is_multiple_of(3)),
            Payload::Text => Value::Text(format!("text {n}").into()),
            Payload::Point => Value::Point([x, -x, x / 2.0]),
            Payload::Nested => {
                let inner = record(&[("level", x.into()), ("more", 7i64.into())]);
                record(&[("number", i64::from(n).into()), ("inner", inner)])
            }
            Payload::Element => Value::List(vec![x.into(), (2.0 * x).into(), (3.0 * x).into()]),
            Payload::Each => Value::List((0..3).map(|more| Value::Int(i64::from(n) + 10 * more)).collect()),
            Payload::TwoFields => record(&[("a", x.into()), ("b", (-x).into()), ("c", 3.0.into())]),
        }
    }

    fn places(self) -> Vec<ValuePath> {
        let field = |name: &str| Step::Field(name.to_owned());
        match self {
            Payload::Nested => vec![vec![field("inner"), field("level")]],
            Payload::Element => vec![vec![Step::Element(1)]],
            Payload::Each => vec![vec![Step::Each]],
            Payload::TwoFields => vec![vec![field("a")], vec![field("b")]],
            _ => vec![vec![]],
        }
    }

    /// The values at its places, each with the number of its first draw.
    fn leaves(self, message: &mut Value) -> Vec<(u64, &mut Value)> {
        match (self, message) {
            (Payload::Nested, Value::Record(outer)) => match outer.get_mut("inner") {
                Some(Value::Record(inner)) => vec![(0, inner.get_mut("level").unwrap())],
                _ => panic!("a nested payload has a message inside"),
            },
            (Payload::Element, Value::List(items)) => vec![(0, &mut items[1])],
            (Payload::Each, Value::List(items)) => (0..).map(|at| at * PER_VALUE).zip(items).collect(),
            (Payload::TwoFields, Value::Record(record)) => {
                // Two of one record at once: by taking them apart.
                let mut found: Vec<(u64, &mut Value)> = Vec::new();
                for (name, value) in record.each_mut() {
                    match name {
                        "a" => found.push((0, value)),
                        "b" => found.push(((1 << 32) * PER_VALUE, value)),
                        _ => {}
                    }
                }
                found
            }
            (_, message) => vec![(0, message)],
        }
    }

    fn is_real(self) -> bool {
        matches!(self, Payload::Real | Payload::Nested | Payload::Element | Payload::TwoFields)
    }
    fn is_int(self) -> bool {
        matches!(self, Payload::Int | Payload::Each)
    }
    fn is_point(self) -> bool {
        self == Payload::Point
    }
    fn has_amounts(self) -> bool {
        self.is_real() || self.is_int() || self.is_point()
    }
}

/// An operation as it is tested: on a payload, with its choices.
struct Case {
    kind: OperationKind,
    /// Whether it changes the values at the payload's places, not whole messages.
    on_values: bool,
    choices: Vec<(&'static str, Choice)>,
}

fn value(name: &'static str, value: f64) -> (&'static str, Choice) {
    (name, Choice::Value { value })
}

fn range(name: &'static str, low: f64, high: f64) -> (&'static str, Choice) {
    (name, Choice::Range { low, high })
}

fn amount(name: &'static str, payload: Payload, number: f64) -> (&'static str, Choice) {
    if payload.is_point() { (name, Choice::Point { point: [number, 0.0, -number] }) } else { value(name, number) }
}

/// The operations that are for a payload.
fn cases(payload: Payload) -> Vec<Case> {
    let mut cases = Vec::new();
    let mut on_values = |kind, choices| cases.push(Case { kind, on_values: true, choices });
    if payload.has_amounts() {
        for mode in [ValueMode::Offset, ValueMode::Absolute] {
            let kind = OperationKind::RandomValue { mode, integer: payload.is_int() };
            let choices = if payload.is_point() {
                vec![range("x", 1.0, 3.0), range("y", -1.0, 0.0), range("z", 5.0, 5.0)]
            } else {
                vec![range(if mode == ValueMode::Offset { "offset" } else { "value" }, 1.0, 3.0)]
            };
            on_values(kind, choices);
        }
        on_values(OperationKind::StuckAt { truth: None }, vec![amount("value", payload, 4.0)]);
        on_values(OperationKind::Bias, vec![amount("bias", payload, -2.0)]);
        on_values(OperationKind::Drift, vec![amount("rate", payload, 1.5)]);
        on_values(OperationKind::Noise, vec![value("sigma", 2.0)]);
        on_values(OperationKind::RandomWalk, vec![value("sigma", 2.0)]);
        on_values(OperationKind::Scale, vec![value("factor", -1.5)]);
    }
    if payload.is_real() || payload.is_point() {
        for number in [NotFinite::Nan, NotFinite::Infinity, NotFinite::MinusInfinity] {
            on_values(OperationKind::NotFinite { number }, vec![]);
        }
    }
    if payload.is_real() || payload.is_int() {
        on_values(OperationKind::ClockSkew, vec![value("skew", 3.0)]);
    }
    if payload == Payload::Text {
        on_values(OperationKind::RandomText { texts: ["a", "b", "c"].map(str::to_owned).to_vec() }, vec![]);
        on_values(OperationKind::StuckAt { truth: None }, vec![("value", Choice::Text { text: "stuck".to_owned() })]);
    }
    if payload == Payload::Bool {
        on_values(OperationKind::StuckAt { truth: Some(true) }, vec![]);
        on_values(OperationKind::StuckAt { truth: Some(false) }, vec![]);
    }
    on_values(OperationKind::Freeze, vec![]);
    on_values(OperationKind::Stale, vec![value("age", 0.35)]);

    let mut on_messages = |kind, choices| cases.push(Case { kind, on_values: false, choices });
    on_messages(OperationKind::Freeze, vec![]);
    on_messages(OperationKind::Stale, vec![value("age", 0.35)]);
    on_messages(OperationKind::PacketLoss, vec![value("loss", 0.4)]);
    on_messages(OperationKind::BurstLoss, vec![value("enter", 0.3), value("leave", 0.4)]);
    on_messages(OperationKind::BurstLoss, vec![value("enter", 0.5), value("leave", 0.2), value("loss", 0.7)]);
    on_messages(OperationKind::RateLimit, vec![value("rate", 4.0)]);
    for drain in [Drain::Finish, Drain::Flush, Drain::Drop] {
        let latency = |distribution| OperationKind::Latency { distribution, drain };
        on_messages(latency(Distribution::Fixed), vec![value("delay", 0.3)]);
        on_messages(latency(Distribution::Uniform), vec![range("delay", 0.1, 0.8)]);
        on_messages(latency(Distribution::Normal), vec![range("delay", 0.1, 0.8)]);
        on_messages(OperationKind::Reorder { drain }, vec![value("window", 0.9)]);
    }
    on_messages(OperationKind::Duplicate, vec![value("copies", 2.0)]);
    on_messages(OperationKind::Blackhole, vec![]);
    cases
}

#[derive(Debug, Clone, Copy)]
enum Switch {
    Time,
    Condition,
    ConditionFor,
}

const SWITCHES: [Switch; 3] = [Switch::Time, Switch::Condition, Switch::ConditionFor];

impl Switch {
    fn activation(self) -> Activation {
        let switch = |by| Condition::Compare { left: Operand::Variable(MetricId(2)), by, right: Operand::Number(0.5) };
        let (start, end) = (switch(Comparison::Above), switch(Comparison::Below));
        match self {
            Switch::Time => Activation::Time { start: 2.0, end: 5.0 },
            Switch::Condition => Activation::Condition { start, end, times: 1 },
            Switch::ConditionFor => Activation::ConditionFor { start, length: 3.0, times: 1 },
        }
    }
}

/// A plan of one topic that carries the payload, and one whose messages switch conditions.
fn plan_of(payload: Payload, case: &Case) -> CampaignPlan {
    let parameter = |(name, choice): &(&str, Choice)| match choice {
        Choice::Value { .. } => testing::value(name, -9.0, 9.0),
        Choice::Range { .. } => testing::range(name, -9.0, 9.0),
        Choice::Point { .. } => testing::parameter(name, Domain::Point { low: [-9.0; 3], high: [9.0; 3] }),
        Choice::Text { text } => testing::parameter(name, Domain::Texts { texts: vec![text.clone()] }),
    };
    let parameters = case.choices.iter().map(parameter).collect();
    let places = if case.on_values { payload.places() } else { Vec::new() };
    let mut plan =
        plan(vec![Operation { places, ..testing::operation_with("operation", 2, case.kind.clone(), parameters) }]);
    let topic = |name: &str| testing::topic(name, &[name], Type::Real { unit: None });
    plan.topics.extend([topic("payload"), topic("switch")]);
    let switch = FieldRef { topic: TopicId(3), path: Vec::new() };
    plan.metrics.push(testing::metric("switch_value", MetricSource::Last { input: switch }));
    plan
}

fn nanos(tenths: u32) -> i64 {
    i64::from(tenths) * 100_000_000
}

/// What the relay delivers of the payload's messages, with the tenth of a second at which it does.
fn relayed(payload: Payload, case: &Case, switch: Switch) -> (Vec<(u32, Value)>, Finished) {
    let (delivered, finished, _) = relayed_listed(payload, case, switch, None);
    (delivered, finished)
}

/// The same of an operation that alters only some messages, with the numbers of those that it altered, in rising order.
fn relayed_listed(
    payload: Payload,
    case: &Case,
    switch: Switch,
    messages: Option<Messages>,
) -> (Vec<(u32, Value)>, Finished, Vec<u64>) {
    let plan = plan_of(payload, case);
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let parameters = case.choices.iter().map(|(_, choice)| choice.clone()).collect();
    let used = TestOperation { activation: switch.activation(), messages, ..use_of(0, 0.0, 0.0, parameters, SEED) };
    let test = Test { operations: vec![used] };
    let mut altered = AlteredList::new(&plan, &wires, &test);
    let relay = Relay::new(&plan, &wires, &test, metrics.start(), &[]).unwrap();
    let mut relay = relay.received_everywhere().tapped(&mut altered);
    let [payload_wire, switch_wire] = ["payload", "switch"].map(|name| wires.find(name).unwrap());
    let mut delivered = Vec::new();
    for tenth in 0..=100 {
        let now = SimTime::from_nanos(nanos(tenth));
        let mut out = Vec::new();
        relay.advance(now, &mut out);
        if tenth == 20 || tenth == 50 {
            let on = Value::Real(if tenth == 20 { 1.0 } else { 0.0 });
            relay.message(now, switch_wire, on, &mut out);
        }
        if tenth < MESSAGES {
            relay.message(now, payload_wire, payload.message(tenth), &mut out);
        }
        delivered.extend(
            out.into_iter().filter(|delivery| delivery.wire == payload_wire).map(|delivery| (tenth, delivery.value)),
        );
    }
    let finished = relay.finish(SimTime::from_seconds(10.0));
    let AlteredMessages::Listed(altered) = altered.listed() else { panic!("they are few") };
    assert!(altered.iter().all(|message| (message.operation, message.wire) == (0, 0) && message.time >= 2.0));
    (delivered, finished, altered.iter().map(|message| message.number).collect())
}

/// What a naive model of an operation delivers and counts: changed, dropped, delayed, injected.
#[derive(Debug, Default, PartialEq)]
struct Expected {
    delivered: Vec<(u32, Value)>,
    counters: [u64; 4],
}

fn active(n: u32) -> bool {
    (20..50).contains(&n)
}

fn draw(n: u32, at: u64) -> f64 {
    KeyedRng::new(SEED, 0, u64::from(n)).unit(at)
}

/// The Box-Muller transform, a second time.
fn normal(n: u32, at: u64) -> f64 {
    libm::sqrt(-2.0 * libm::log(1.0 - draw(n, at))) * libm::cos(std::f64::consts::TAU * draw(n, at + 1))
}

fn chosen(case: &Case, name: &str) -> f64 {
    match case.choices.iter().find(|(known, _)| *known == name) {
        Some((_, Choice::Value { value })) => *value,
        other => panic!("{name} is {other:?}"),
    }
}

/// The number that an operation makes of one, on an axis of a point or on its own.
fn new_number(case: &Case, payload: Payload, n: u32, first_draw: u64, axis: usize, old: f64) -> f64 {
    let of = |name: &str| match case.choices.iter().find(|(known, _)| *known == name) {
        Some((_, Choice::Value { value })) => *value,
        Some((_, Choice::Point { point })) => point[axis],
        other => panic!("{name} is {other:?}"),
    };
    match &case.kind {
        OperationKind::RandomValue { mode, .. } => {
            let u = draw(n, first_draw + axis as u64);
            let drawn = match (payload, axis) {
                (Payload::Point, 0) => 1.0 + 2.0 * u,
                (Payload::Point, 1) => -1.0 + u,
                (Payload::Point, _) => 5.0,
                (payload, _) if payload.is_int() => (1.0 + 3.0 * u).floor(),
                _ => 1.0 + 2.0 * u,
            };
            if *mode == ValueMode::Offset { old + drawn } else { drawn }
        }
        OperationKind::StuckAt { .. } => of("value"),
        OperationKind::Bias => old + of("bias"),
        OperationKind::ClockSkew => old + of("skew"),
        OperationKind::Drift => {
            let grown = of("rate") * (f64::from(n) / 10.0 - 2.0);
            old + if payload.is_int() { grown.round() } else { grown }
        }
        OperationKind::Noise => {
            let noise = 2.0 * normal(n, first_draw + 2 * axis as u64);
            old + if payload.is_int() { noise.round() } else { noise }
        }
        OperationKind::RandomWalk => {
            // A step per message since the one at 2 s, each with the variance of a tenth of a second.
            let step = |m| 2.0 * libm::sqrt(0.1) * normal(m, first_draw + 2 * axis as u64);
            let walked: f64 = (21..=n).map(step).sum();
            old + if payload.is_int() { walked.round() } else { walked }
        }
        OperationKind::Scale => {
            let scaled = old * -1.5;
            if payload.is_int() { scaled.round() } else { scaled }
        }
        OperationKind::NotFinite { number: NotFinite::Nan } => f64::NAN,
        OperationKind::NotFinite { number: NotFinite::Infinity } => f64::INFINITY,
        OperationKind::NotFinite { number: NotFinite::MinusInfinity } => f64::NEG_INFINITY,
        other => panic!("{other:?} makes no numbers"),
    }
}

/// The value that an operation makes of the `number`th value of message `n`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the numbers of these tests are small")]
fn new_value(case: &Case, payload: Payload, n: u32, number: usize, first_draw: u64, old: &Value) -> Value {
    // The value that was at the same place of another message.
    let of_message = |m: u32| {
        let mut message = payload.message(m);
        payload.leaves(&mut message).swap_remove(number).1.clone()
    };
    match (&case.kind, old) {
        (OperationKind::Freeze, _) => of_message(19),
        // 0.35 s before the message, the last one was four tenths before it.
        (OperationKind::Stale, _) => of_message(n - 4),
        (OperationKind::StuckAt { truth: Some(truth) }, _) => Value::Bool(*truth),
        (OperationKind::StuckAt { .. }, Value::Text(_)) => "stuck".into(),
        (OperationKind::RandomText { texts }, _) => texts[(draw(n, first_draw) * 3.0) as usize].as_str().into(),
        (_, Value::Real(x)) => Value::Real(new_number(case, payload, n, first_draw, 0, *x)),
        (_, Value::Int(x)) => Value::Int(new_number(case, payload, n, first_draw, 0, *x as f64) as i64),
        (_, Value::Point(point)) => {
            Value::Point([0, 1, 2].map(|axis| new_number(case, payload, n, first_draw, axis, point[axis])))
        }
        (kind, value) => panic!("{kind:?} is not for {value:?}"),
    }
}

fn expected(payload: Payload, case: &Case, switch: Switch) -> Expected {
    let mut expected = Expected::default();
    // Delivered: when, in nanoseconds, and a number that breaks ties.
    let mut released: Vec<(i64, u32, Value)> = Vec::new();
    let (mut bursting, mut passed, mut tail) = (false, None, 0);
    let [changed, dropped, delayed, injected] = &mut expected.counters;
    for n in 0..MESSAGES {
        let mut message = payload.message(n);
        let now = nanos(n);
        if !active(n) {
            let keeps = matches!(case.kind, OperationKind::Latency { drain: Drain::Finish, .. });
            *delayed += u64::from(keeps && tail > now);
            released.push((if keeps { now.max(tail) } else { now }, n, message));
            continue;
        }
        let mut lost = |loses: bool| *dropped += u64::from(loses);
        match &case.kind {
            OperationKind::Freeze | OperationKind::Stale if !case.on_values => {
                message = payload.message(if case.kind == OperationKind::Freeze { 19 } else { n - 4 });
                *changed += u64::from(message != payload.message(n));
                released.push((now, n, message));
            }
            OperationKind::PacketLoss => {
                let loses = draw(n, 0) < 0.4;
                lost(loses);
                released.extend((!loses).then_some((now, n, message)));
            }
            OperationKind::BurstLoss => {
                let [enter, leave] = ["enter", "leave"].map(|name| chosen(case, name));
                let loss = if case.choices.len() == 3 { chosen(case, "loss") } else { 1.0 };
                bursting = if bursting { draw(n, 0) >= leave } else { draw(n, 0) < enter };
                let loses = bursting && draw(n, 1) < loss;
                lost(loses);
                released.extend((!loses).then_some((now, n, message)));
            }
            OperationKind::RateLimit => {
                let loses = passed.is_some_and(|before| now - before < 250_000_000);
                lost(loses);
                if !loses {
                    passed = Some(now);
                    released.push((now, n, message));
                }
            }
            OperationKind::Blackhole => lost(true),
            OperationKind::Duplicate => {
                *injected += 2;
                released.extend((0..3).map(|_| (now, n, message.clone())));
            }
            OperationKind::Latency { drain, .. } | OperationKind::Reorder { drain } => {
                let own = match &case.kind {
                    OperationKind::Latency { distribution: Distribution::Fixed, .. } => 0.3,
                    OperationKind::Latency { distribution: Distribution::Uniform, .. } => 0.1 + 0.7 * draw(n, 0),
                    OperationKind::Latency { .. } => {
                        let within = (0..16).map(|k| normal(n, 2 * k)).find(|z| (-2.0..=2.0).contains(z)).unwrap();
                        0.45 + 0.7 / 4.0 * within
                    }
                    _ => 0.9 * draw(n, 0),
                };
                let mut release = now + SimTime::from_seconds(own).nanos();
                if matches!(case.kind, OperationKind::Latency { .. }) {
                    release = release.max(tail);
                    tail = release;
                }
                // At the moment of an edge, what is due then is still held; an end condition is weighed in the event of
                // its message, after what is due.
                let late = if matches!(switch, Switch::Condition) { release > nanos(50) } else { release >= nanos(50) };
                if late && *drain == Drain::Drop {
                    *dropped += 1;
                    continue;
                }
                *delayed += 1;
                released.push((release, n, message));
            }
            _ => {
                let before = message.clone();
                for (number, (first_draw, value)) in payload.leaves(&mut message).into_iter().enumerate() {
                    *value = new_value(case, payload, n, number, first_draw, value);
                }
                *changed += u64::from(!message.is_same(&before));
                released.push((now, n, message));
            }
        }
    }
    // Flushed messages go at the end of the window, in the order in which they would have gone, and before what is
    // published then.
    let flushes = |n: u32| {
        let (OperationKind::Latency { drain, .. } | OperationKind::Reorder { drain }) = case.kind else { return false };
        active(n) && drain == Drain::Flush
    };
    released.sort_by_key(|&(release, n, _)| {
        let goes = if flushes(n) { release.min(nanos(50)) } else { release };
        (goes, !flushes(n), release, n)
    });
    for (release, n, message) in released {
        let release = if flushes(n) { release.min(nanos(50)) } else { release };
        let tenth = u32::try_from((release + 99_999_999) / 100_000_000).unwrap();
        expected.delivered.push((tenth, message));
    }
    expected
}

/// As equal as two ways of computing logarithms and cosines are.
fn close(left: &Value, right: &Value) -> bool {
    let near = |a: f64, b: f64| a.to_bits() == b.to_bits() || (a - b).abs() < 1e-9 || (a.is_nan() && b.is_nan());
    match (left, right) {
        (Value::Real(a), Value::Real(b)) => near(*a, *b),
        (Value::Point(a), Value::Point(b)) => (0..3).all(|axis| near(a[axis], b[axis])),
        (Value::List(a), Value::List(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| close(a, b)),
        (Value::Record(a), Value::Record(b)) => a.iter().zip(b.iter()).all(|(a, b)| a.0 == b.0 && close(a.1, b.1)),
        _ => left == right,
    }
}

#[test]
fn every_operation_does_what_it_means_on_every_payload_under_every_activation() {
    let mut combinations = 0;
    for payload in PAYLOADS {
        for case in cases(payload) {
            for switch in SWITCHES {
                let expected = expected(payload, &case, switch);
                let named = format!("{:?} on {payload:?} by {switch:?}", case.kind);
                let (delivered, finished) = relayed(payload, &case, switch);
                let effect = &finished.operations[0];
                assert_eq!(effect.intervals, [Span { start: 2.0, end: 5.0 }], "{named}");
                for (at, (found, wanted)) in delivered.iter().zip(&expected.delivered).enumerate() {
                    assert!(
                        found.0 == wanted.0 && close(&found.1, &wanted.1),
                        "{named}, {at}: {found:?}, not {wanted:?}"
                    );
                }
                assert_eq!(delivered.len(), expected.delivered.len(), "{named}");
                let counters = effect.counters;
                let held = counters.delayed + counters.queued;
                let counted = [counters.changed, counters.dropped, held, counters.injected];
                assert_eq!(counted, expected.counters, "{named}: changed, dropped, delayed or queued, injected");
                assert!(counters.delayed <= counters.seen, "{named}: what came outside of the window is queued");
                assert_eq!(counters.seen, 30, "{named}");
                assert!(counters.any_effect(), "{named} is not void");
                assert!(effect.first_touch >= Some(2.0), "{named}");
                combinations += 1;
            }
        }
    }
    assert_eq!(combinations, 837, "the table is as long as it was");
}

#[test]
fn an_operation_with_a_list_does_the_same_to_the_listed_messages_and_nothing_to_others() {
    let equal = |left: &[(u32, Value)], right: &[(u32, Value)]| {
        left.len() == right.len() && left.iter().zip(right).all(|(a, b)| a.0 == b.0 && close(&a.1, &b.1))
    };
    let list = |numbers: &[u64]| Messages::of(numbers.iter().map(|&number| (0, number)));
    for payload in PAYLOADS {
        for case in cases(payload) {
            for switch in SWITCHES {
                let named = format!("{:?} on {payload:?} by {switch:?}", case.kind);
                let (whole, _, altered) = relayed_listed(payload, &case, switch, None);
                let (listed, ..) = relayed_listed(payload, &case, switch, list(&altered));
                assert!(equal(&whole, &listed), "{named}: all that it altered");
                // A message behind a delayed one waits, so that those of a latency depend on each other.
                if matches!(case.kind, OperationKind::Latency { .. }) {
                    continue;
                }
                let some = altered[altered.len() / 2];
                let (one, finished, again) = relayed_listed(payload, &case, switch, list(&[some]));
                assert_eq!(again, [some], "{named}");
                assert_eq!(finished.operations[0].counters.seen, 30, "{named}: it decides on all");
                // What it delivers without that message is what was published, and the rest is in the whole as well.
                let published = |at: u32| (at, payload.message(at));
                let mut rest = one.clone();
                for at in (0..MESSAGES).filter(|&at| u64::from(at) != some) {
                    let (time, value) = published(at);
                    let place = rest.iter().position(|other| other.0 == time && close(&other.1, &value));
                    rest.remove(place.unwrap_or_else(|| panic!("{named}: message {at} was not left alone")));
                }
                for of_this in &rest {
                    let same = |other: &(u32, Value)| other.0 == of_this.0 && close(&other.1, &of_this.1);
                    assert!(whole.iter().any(same), "{named}: {of_this:?}");
                }
            }
        }
    }
}

#[test]
fn a_copy_is_altered_with_its_message() {
    let operations = vec![testing::operation(0, OperationKind::Duplicate), testing::operation(0, OperationKind::Bias)];
    let plan = plan(operations);
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let chosen = |value| vec![Choice::Value { value }];
    let biased = TestOperation { messages: Messages::of([(0, 1)]), ..use_of(1, 0.0, 9.0, chosen(5.0), 1) };
    let test = Test { operations: vec![use_of(0, 0.0, 9.0, chosen(1.0), 1), biased] };
    let mut relay = Relay::new(&plan, &wires, &test, metrics.start(), &[]).unwrap().received_everywhere();
    let mut out = Vec::new();
    for at in 0..3u32 {
        let now = SimTime::from_nanos(nanos(at));
        relay.message(now, wires.find("arm/command").unwrap(), Value::Real(f64::from(at)), &mut out);
    }
    let delivered: Vec<Value> = out.into_iter().map(|delivery| delivery.value).collect();
    assert_eq!(delivered, [0.0, 0.0, 6.0, 6.0, 2.0, 2.0].map(Value::Real));
}
