//! Operations towards one subscriber leave the others alone, and operations on one publisher the others.

use std::cell::RefCell;

use sesame_plan::Test;

use crate::environment::{Domain, Vendor};
use crate::peer::Peer;
use crate::relaying::{System, plan, space};

const KIND: &str = "geometry_msgs/msg/PointStamped";
const COUNT: &str = "200";

/// The test of a space that an operation cuts off for the whole run.
fn cut_off(system: &System) -> Test {
    let [known] = &system.plan().tests[..] else { panic!("there is one test") };
    known.test.clone()
}

const HOLE: &str = "test cut_off { lost from 0s to 100s }";

#[test]
fn of_two_subscribers_one_can_be_cut_off_while_the_other_hears_everything() {
    let Some(python) = Vendor::Kilted.python() else { return };
    let domain = Domain::free();
    let subscriber = |topic| {
        let arguments = ["--topic", topic, "--type", KIND, "--count", COUNT, "--content", "--timeout", "9"];
        Peer::start(&python, &domain, "subscriber.py", &arguments)
    };
    let (deaf, mut hearing) = (subscriber("/peer/to/deaf"), subscriber("/peer"));
    let arguments = ["--topic", "/peer/undisturbed", "--type", KIND, "--count", COUNT, "--rate", "100", "--hold"];
    let mut publisher = Peer::start(&python, &domain, "publisher.py", &arguments);
    let nodes = "node deaf { subscribes peer }  node hearing { subscribes peer }  node speaker { publishes peer }";
    let lost = format!("operation lost on peer to deaf = blackhole\n{HOLE}");
    let mut system = System::new(plan(&space(&domain, KIND, nodes, &lost, 100)));
    let test = cut_off(&system);
    let finished = system.relay_until(&test, || publisher.go(), || hearing.has_ended());
    let sent = publisher.expect();
    assert_eq!((finished.operations[0].counters.dropped, system.notes()), (200, Vec::new()));
    let (_, nothing) = deaf.end();
    assert_eq!(nothing["count"], 0);
    let all = hearing.expect();
    assert_eq!((&all["count"], &all["content"]), (&sent["count"], &sent["content"]));
}

#[test]
fn of_two_publishers_one_can_be_cut_off_while_the_other_is_heard() {
    let Some(python) = Vendor::Kilted.python() else { return };
    let domain = Domain::free();
    let arguments = ["--type", KIND, "--count", COUNT, "--content", "--timeout", "14"];
    let mut hearing = Peer::start(&python, &domain, "subscriber.py", &arguments);
    let publisher = |topic, seed| {
        let arguments = ["--type", KIND, "--count", COUNT, "--rate", "100", "--hold", "--topic", topic, "--seed", seed];
        Peer::start(&python, &domain, "publisher.py", &arguments)
    };
    let (mut mute, mut loud) = (publisher("/peer/from/mute", "1"), publisher("/peer/undisturbed", "2"));
    let nodes = "node hearing { subscribes peer }  node mute { publishes peer }  node loud { publishes peer }";
    let lost = format!("operation lost on peer from mute = blackhole\n{HOLE}");
    let mut system = System::new(plan(&space(&domain, KIND, nodes, &lost, 100)));
    let test = cut_off(&system);
    let speakers = RefCell::new((&mut mute, &mut loud));
    let begin = || {
        let mut both = speakers.borrow_mut();
        both.0.go();
        both.1.go();
    };
    let finished = system.relay_until(&test, begin, || hearing.has_ended() && speakers.borrow_mut().0.has_ended());
    mute.expect();
    let sent = loud.expect();
    assert_eq!((finished.operations[0].counters.dropped, system.notes()), (200, Vec::new()));
    let all = hearing.expect();
    assert_eq!((&all["count"], &all["content"]), (&sent["count"], &sent["content"]));
}
