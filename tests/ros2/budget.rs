//! What the relay adds to messages is measured and compared with its budget.

use sesame_plan::{RelayBudget, Test};

use crate::environment::{Domain, Vendor};
use crate::peer::Peer;
use crate::relaying::{System, plan, space};

const KIND: &str = "geometry_msgs/msg/PointStamped";

/// What a run of two seconds shows in which so many topics are relayed, and of what was added to how many messages. The
/// publisher is remapped as the plan says.
fn relayed(python: &std::path::Path, first: u32) -> (u64, Vec<(String, u64)>) {
    let domain = Domain::free();
    let arguments = ["--type", KIND, "--count", "1000"];
    let plan = plan(&space(&domain, KIND, "node hearing { subscribes peer }", "", 2)).relaying(first);
    let remapped = plan.unclaimed().into_iter().map(|(_, it)| it.to).next();
    let topic = remapped.unwrap_or_else(|| "/peer".to_owned());
    let speaking = ["--topic", &topic, "--rate", "200"];
    let _publisher = Peer::start(python, &domain, "publisher.py", &[&arguments[..], &speaking].concat());
    let _subscriber = Peer::start(python, &domain, "subscriber.py", &arguments);
    let mut system = System::new(plan);
    let (observation, notes) = system.run(&Test::default());
    assert_eq!(observation.outcome.word(), "completed", "{notes:?}");
    let added = system.added().into_iter().map(|it| (it.path, it.latencies.messages())).collect();
    (observation.messages, added)
}

#[test]
fn a_topic_that_is_not_relayed_is_observed_without_remapping_and_nothing_is_added_to_it() {
    let Some(python) = Vendor::Kilted.python() else { return };
    let (observed, added) = relayed(&python, 0);
    assert!(observed > 200, "{observed}");
    assert_eq!(added, []);
    let (observed, added) = relayed(&python, 1);
    let [(path, messages)] = &added[..] else { panic!("one topic is relayed: {added:?}") };
    assert_eq!(path, "/peer");
    assert!(*messages > 200 && *messages <= observed, "{messages} of {observed}");
}

/// What is noted of a run of two seconds with 200 messages a second.
fn noted(python: &std::path::Path, latency: f64, jitter: f64) -> Vec<String> {
    let domain = Domain::free();
    let arguments = ["--type", KIND, "--count", "1000"];
    let speaking = ["--topic", "/peer/undisturbed", "--rate", "200"];
    let _publisher = Peer::start(python, &domain, "publisher.py", &[&arguments[..], &speaking].concat());
    let _subscriber = Peer::start(python, &domain, "subscriber.py", &arguments);
    let mut plan = plan(&space(&domain, KIND, "node hearing { subscribes peer }", "", 2));
    plan.simulator.lifecycle.relay_budget = Some(RelayBudget { latency: Some(latency), jitter: Some(jitter) });
    let (observation, notes) = System::new(plan).run(&Test::default());
    assert_eq!(observation.outcome.word(), "completed", "{notes:?}");
    assert!(observation.messages > 200, "{}", observation.messages);
    notes
}

#[test]
fn a_run_that_exceeds_the_relay_budget_says_so_with_figures() {
    let Some(python) = Vendor::Kilted.python() else { return };
    let notes = noted(&python, 1e-6, 1e-6);
    println!("{notes:?}");
    let [latency, jitter] = &notes[..] else { panic!("two are exceeded: {notes:?}") };
    let added = latency.strip_prefix("the relay added ");
    let added =
        added.and_then(|rest| rest.strip_suffix(" to one message in a hundred; the budget is 0.001 ms latency"));
    let added: f64 = added.and_then(|text| text.strip_suffix(" ms")?.parse().ok()).expect("it has a figure");
    assert!(added > 0.001 && added < 1000.0, "{added} ms");
    assert!(jitter.starts_with("what the relay added varied by "), "{jitter}");
    assert!(jitter.ends_with(" ms for one in a hundred; the budget is 0.001 ms jitter"), "{jitter}");

    assert_eq!(noted(&python, 10.0, 10.0), [""; 0], "a budget that is kept is nothing to note");
}
