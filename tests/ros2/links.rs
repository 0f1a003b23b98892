//! Operations towards one subscriber leave the others alone, and operations on one publisher the others.

use sesame_plan::Test;

use crate::environment::{Domain, Vendor};
use crate::peer::Peer;
use crate::relaying::{Exchange, System, plan, space};

const KIND: &str = "geometry_msgs/msg/PointStamped";
const COUNT: &str = "200";

/// The test of a space that an operation cuts off for the whole run.
fn cut_off(system: &System) -> Test {
    let [known] = &system.plan().tests[..] else { panic!("there is one test") };
    known.test.clone()
}

const HOLE: &str = "test cut_off { lost from 0s to 1000s }";

#[test]
fn of_two_subscribers_one_can_be_cut_off_while_the_other_hears_everything() {
    let Some(python) = Vendor::Kilted.python() else { return };
    let domain = Domain::free();
    let subscriber = |topic, more: &[&str]| {
        let arguments = ["--topic", topic, "--type", KIND, "--count", COUNT, "--content"];
        Peer::start(&python, &domain, "subscriber.py", &[&arguments[..], more].concat())
    };
    let (deaf, hearing) = (subscriber("/peer/to/deaf", &["--until-told"]), subscriber("/peer", &[]));
    let arguments = ["--topic", "/peer/undisturbed", "--type", KIND, "--count", COUNT, "--hold"];
    let publisher = Peer::start(&python, &domain, "publisher.py", &arguments);
    let nodes = "node deaf { subscribes peer }  node hearing { subscribes peer }  node speaker { publishes peer }";
    let lost = format!("operation lost on peer to deaf = blackhole\n{HOLE}");
    let mut system = System::new(plan(&space(&domain, KIND, nodes, &lost, "1000s")));
    let test = cut_off(&system);
    let exchanged = system.exchange(&test, &Exchange::new(&publisher, &[&hearing]));
    deaf.await_match();
    deaf.go();
    let (_, nothing) = deaf.end();
    let sent = publisher.expect();
    assert_eq!((exchanged.dropped(), system.notes()), (200, Vec::new()));
    assert_eq!(nothing["count"], 0);
    let all = hearing.expect();
    assert_eq!((&all["count"], &all["content"]), (&sent["count"], &sent["content"]));
}

#[test]
fn of_two_publishers_one_can_be_cut_off_while_the_other_is_heard() {
    let Some(python) = Vendor::Kilted.python() else { return };
    let domain = Domain::free();
    let hearing = Peer::start(&python, &domain, "subscriber.py", &["--type", KIND, "--count", COUNT, "--content"]);
    let publisher = |topic, seed| {
        let arguments = ["--type", KIND, "--count", COUNT, "--hold", "--topic", topic, "--seed", seed];
        Peer::start(&python, &domain, "publisher.py", &arguments)
    };
    let (mute, loud) = (publisher("/peer/from/mute", "1"), publisher("/peer/undisturbed", "2"));
    let nodes = "node hearing { subscribes peer }  node mute { publishes peer }  node loud { publishes peer }";
    let lost = format!("operation lost on peer from mute = blackhole\n{HOLE}");
    let mut system = System::new(plan(&space(&domain, KIND, nodes, &lost, "1000s")));
    let test = cut_off(&system);
    // The mute one has said all when the last of it is acknowledged.
    let (to, beside) = ([&hearing], [&mute]);
    let exchange = Exchange { beside: &beside, ..Exchange::new(&loud, &to) };
    let exchanged = system.exchange_until(&test, &exchange, |_| hearing.is_done() && mute.told("count") == 200);
    mute.expect();
    let sent = loud.expect();
    assert_eq!((exchanged.finished.operations[0].counters.dropped, system.notes()), (200, Vec::new()));
    let all = hearing.expect();
    assert_eq!((&all["count"], &all["content"]), (&sent["count"], &sent["content"]));
}
