//! Which messages an operation counts out, beside a naive oracle that looks at the whole stream at once.

use proptest::prelude::*;

use sesame_base::time::SimTime;
use sesame_plan::testing::{operation, parameter, plan, test_of, use_of};
use sesame_plan::{Choice, ChoiceKind, Counted, Domain, Operation, OperationKind};

use crate::metric::MetricTable;
use crate::relay::{Exchange, Relay};
use crate::value::{Fields, Record, Value};
use crate::wire::WireTable;

/// A message each tenth of a second, on one of two wires.
const ZONES: [&str; 2] = ["zones/Z1", "zones/Z2"];

/// A blackhole that counts out messages, and the choices of a test for it.
fn counting(next: Option<u32>, every: Option<u32>) -> (Operation, Vec<Choice>) {
    let mut cut = operation(1, OperationKind::Blackhole);
    let mut choices = Vec::new();
    for (counted, count) in [(Counted::Next, next), (Counted::Every, every)] {
        let Some(count) = count else { continue };
        let domain = Domain::Number { low: 1.0, high: 50.0, shape: ChoiceKind::Value, integer: true };
        cut.parameters.push(parameter(counted.name(), domain));
        cut.counted.push(counted);
        choices.push(Choice::Value { value: f64::from(count) });
    }
    (cut, choices)
}

/// The numbers of the messages that are delivered, of as many as there are wires for.
fn delivered(cut: Operation, choices: Vec<Choice>, (start, end): (u32, u32), sent: &[usize]) -> Vec<usize> {
    let plan = plan(vec![cut]);
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let test = test_of(vec![use_of(0, f64::from(start) / 10.0, f64::from(end) / 10.0, choices, 1)]);
    let mut relay = Relay::new(&plan, &wires, &test, metrics.start(), &[]).unwrap().received_everywhere();
    let fields = Fields::new(["level", "count"]);
    let mut delivered = Vec::new();
    for (number, &wire) in sent.iter().enumerate() {
        let now = SimTime::from_nanos(i64::try_from(number).unwrap() * 100_000_000);
        let mut out = Vec::new();
        relay.advance(now, &mut out);
        let message = Record::new(&fields, vec![Value::Real(0.0), Value::Int(0)]).into();
        relay.message(now, wires.find(ZONES[wire]).unwrap(), message, &mut out);
        delivered.extend(out.iter().map(|_| number));
    }
    delivered
}

proptest! {
    #[test]
    fn each_wire_counts_the_messages_of_an_activation(
        sent in prop::collection::vec(0..2_usize, 1..60), next in prop::option::of(1..6_u32),
        every in prop::option::of(1..6_u32), start in 0..40_u32, length in 1..40_u32,
    ) {
        let window = (start, start + length);
        let (cut, choices) = counting(next, every);
        let found = delivered(cut, choices, window, &sent);
        let dropped = |number: usize| {
            let inside = |number: usize| (window.0 as usize..window.1 as usize).contains(&number);
            let before = (0..=number).filter(|&other| sent[other] == sent[number] && inside(other)).count();
            let every = every.unwrap_or(1) as usize;
            inside(number) && before % every == 0 && next.is_none_or(|next| before / every <= next as usize)
        };
        let expected: Vec<usize> = (0..sent.len()).filter(|&number| !dropped(number)).collect();
        prop_assert_eq!(found, expected);
    }
}
