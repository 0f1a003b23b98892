//! While a run goes on, who comes and goes is noted by name.

use std::cell::RefCell;
use std::time::Instant;

use sesame_plan::Test;

use crate::environment::{Domain, Vendor};
use crate::peer::{LIMIT, Peer};
use crate::relaying::{System, plan, space};

const KIND: &str = "geometry_msgs/msg/PointStamped";

/// What is noted, in the order of its words.
const NOTED: [&str; 4] = [
    "`/peer_faulty` publishes on `/peer/undisturbed` since the run began: 2 publish there, and 1 is declared",
    "`/peer_publisher` no longer publishes on `/peer`",
    "`/peer_publisher` publishes on `/peer` again",
    "`/peer_subscriber` no longer subscribes to `/peer`",
];

#[test]
fn who_comes_and_goes_during_a_run_is_noted_by_node_and_topic() {
    let Some(python) = Vendor::Kilted.python() else { return };
    let domain = Domain::free();
    let start = |program, arguments: &str| {
        let mut arguments: Vec<&str> = arguments.split(' ').collect();
        arguments.extend(["--type", KIND]);
        Peer::start(&python, &domain, program, &arguments)
    };
    let publisher = || start("publisher.py", "--topic /peer/undisturbed --rate 50 --count 200 --hold");
    // The publisher leaves when it is dropped, and the subscriber when it has heard enough.
    let (first, subscriber) = (publisher(), start("subscriber.py", "--count 100"));
    let nodes =
        "node speaker \"/peer_publisher\" { publishes peer }  node listener \"/peer_subscriber\" { subscribes peer }";
    let mut system = System::new(plan(&space(&domain, KIND, nodes, "", "1000s")));
    let (first, again, stray) = (RefCell::new(Some(first)), RefCell::new(None), RefCell::new(None));
    let begin = Instant::now();
    // Each happens when what happened before it was noted.
    let done = |notes: &[String]| {
        let is_noted = |at: usize| notes.iter().any(|note| note == NOTED[at]);
        assert!(begin.elapsed() < 2 * LIMIT, "not all is noted: {notes:?}");
        let leaves = first.borrow_mut().take_if(|first| first.told("count") == 200 && subscriber.is_done());
        leaves.map(Peer::expect);
        if again.borrow().is_none() && is_noted(1) && is_noted(3) {
            again.replace(Some(publisher()));
        }
        is_noted(0) && is_noted(2)
    };
    let appear = || {
        let arguments = "dies --topic /peer/undisturbed --count 1000000 --rate 10 --after 10000";
        stray.replace(Some(start("faulty.py", arguments)));
        subscriber.await_match();
        first.borrow().iter().for_each(Peer::go);
    };
    system.relay_until(&Test::default(), appear, done);
    let mut notes = system.all_notes();
    notes.sort_unstable();
    assert_eq!(notes, NOTED);
}
