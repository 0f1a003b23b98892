//! While a run goes on, who comes and goes is noted by name.

use std::cell::RefCell;
use std::time::{Duration, Instant};

use sesame_plan::Test;

use crate::environment::{Domain, Vendor};
use crate::peer::Peer;
use crate::relaying::{System, plan, space};

const KIND: &str = "geometry_msgs/msg/PointStamped";

/// What happens one after another, each after the one before has ended.
enum Act {
    /// The publisher and the subscriber go away by themselves.
    Leaving,
    /// Nobody is there.
    Gone(Instant),
    /// The publisher has been started again.
    Back(Peer),
}

#[test]
fn who_comes_and_goes_during_a_run_is_noted_by_node_and_topic() {
    let Some(python) = Vendor::Kilted.python() else { return };
    let domain = Domain::free();
    let start = |program, arguments: &str| {
        let mut arguments: Vec<&str> = arguments.split(' ').collect();
        arguments.extend(["--type", KIND]);
        Peer::start(&python, &domain, program, &arguments)
    };
    let publisher = || start("publisher.py", "--topic /peer/undisturbed --rate 50 --count 400 --linger 0");
    let mut first = publisher();
    let mut subscriber = start("subscriber.py", "--count 200");
    let nodes = "node speaker \"/peer_publisher\" { publishes peer }  node listener { subscribes peer }";
    let mut system = System::new(plan(&space(&domain, KIND, nodes, "", 100)));
    let stray = RefCell::new(None);
    let mut act = Act::Leaving;
    let begin = Instant::now();
    let done = || {
        assert!(begin.elapsed() < Duration::from_secs(60), "the peers come and go");
        match &mut act {
            Act::Leaving if first.has_ended() && subscriber.has_ended() => act = Act::Gone(Instant::now()),
            Act::Gone(since) if since.elapsed() > Duration::from_secs(1) => act = Act::Back(publisher()),
            Act::Back(peer) => return peer.has_ended(),
            Act::Leaving | Act::Gone(_) => {}
        }
        false
    };
    let appear = || {
        let arguments = "dies --topic /peer/undisturbed --count 3000 --rate 10 --after 100 --timeout 60";
        *stray.borrow_mut() = Some(start("faulty.py", arguments));
    };
    system.relay_until(&Test::default(), appear, done);
    let mut notes = system.all_notes();
    notes.sort_unstable();
    assert_eq!(
        notes,
        [
            "`/peer_faulty` publishes on `/peer/undisturbed` since the run began: 2 publish there, and 1 is declared",
            "`/peer_publisher` no longer publishes on `/peer`",
            "`/peer_publisher` publishes on `/peer` again",
            "`/peer_subscriber` no longer subscribes to `/peer`",
        ]
    );
}
