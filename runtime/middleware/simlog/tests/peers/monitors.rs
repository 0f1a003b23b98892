//! What monitors publish, where nobody else does.

use sesame_plan::testing::{evidence_above, guarantee, metric, monitor, test_of};
use sesame_plan::{FieldRef, Gate, MetricSource, SimlogVersion, TopicId, Transport, Type};
use sesame_relay::evaluate::{Custom, evaluate};
use sesame_relay::metric::MetricTable;
use sesame_relay::wire::WireTable;

use crate::peer::Peer;
use crate::recorder::{plan, settles, transport};

const INT: Type = Type::Int { unit: None };

#[test]
fn a_state_reaches_a_simulator_although_no_message_says_how_it_is_written() {
    let topics = [("seldom", Type::Real { unit: None }), ("ordered", INT), ("order", INT)];
    let mut plan = plan("", SimlogVersion::V2, &topics);
    plan.nodes[0].every_step = vec![TopicId(1)];
    settles(&mut plan, 200);
    let late = evidence_above("late", 0, 15.0);
    plan.monitors = vec![monitor("cart", 2, vec![late], vec![guarantee("late", 2, Gate::Evidence(0))])];
    let ordered = FieldRef { topic: TopicId(1), path: Vec::new() };
    plan.metrics = vec![metric("ordered", MetricSource::Last { input: ordered })];
    // The state at time zero is there before the first step; the message of the twentieth step makes another one.
    for (steps, expected) in [(1, 0.0), (20, 0.0), (21, 2.0)] {
        let Some(peer) = Peer::start("simulator2.py", &[]) else { return };
        let Transport::Simlog(simlog) = &mut plan.simulator.transport else { panic!("it speaks SimlogAPI") };
        (simlog.url, simlog.cut) = (peer.url(), vec![TopicId(2)]);
        plan.campaign.end_after = f64::from(steps) * 0.02;
        let (wires, mut transport) = (WireTable::new(&plan), transport(&plan));
        let metrics = MetricTable::new(&plan, &wires, &[]).expect("they are sound");
        let (test, custom) = (test_of(Vec::new()), &mut Custom::none());
        let run = evaluate(&plan, &wires, &metrics, transport.as_mut(), &test, 1, custom).expect("it fits the plan");
        assert_eq!(run.metrics[0].value, Some(expected), "after {steps} steps: {run:?}");
        assert_eq!(transport.incidents().notes, [""; 0]);
    }
}
