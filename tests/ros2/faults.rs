//! What other nodes do wrong is reported with their names, and the next run of the same campaign completes.

use std::thread;
use std::time::{Duration, Instant};

use sesame_plan::Test;

use crate::environment::{Domain, Vendor};
use crate::peer::Peer;
use crate::relaying::{System, plan, space};

/// A system with something wrong in it.
struct Fault {
    name: &'static str,
    /// Declarations of the space.
    nodes: &'static str,
    /// When a run ends.
    end: &'static str,
    kind: &'static str,
    /// The programs with their arguments.
    peers: &'static [(&'static str, &'static str)],
    /// The outcome of a run, and what is noted: one of these, where a busy machine decides.
    expected: &'static [&'static str],
}

const POINT: &str = "geometry_msgs/msg/PointStamped";
const TEXT: &str = "std_msgs/msg/String";
const LISTENER: &str = "node listener { subscribes peer }";
/// How many texts came.
const HEARD: &str = r#"metric heard initial 0 = count(peer.data != "")"#;

/// Runs a test without operations in the system, then another one in which nothing is wrong. What the first one comes
/// to, and how long it takes.
fn observed(fault: &Fault) -> Option<(String, Duration)> {
    let python = Vendor::Kilted.python()?;
    let domain = Domain::free();
    let start = |&(program, arguments): &(&str, &str)| {
        let mut arguments: Vec<&str> = arguments.split(' ').collect();
        if !arguments.contains(&"--type") && !arguments[0].starts_with("clock") {
            arguments.extend(["--type", fault.kind]);
        }
        Peer::start(&python, &domain, program, &arguments)
    };
    let peers: Vec<Peer> = fault.peers.iter().map(start).collect();
    // How long programs take to start does not count in how long a system takes to become complete.
    peers.iter().for_each(Peer::await_up);
    let metrics = if fault.kind == TEXT { HEARD } else { "" };
    let mut system = System::new(plan(&space(&domain, fault.kind, fault.nodes, metrics, fault.end)));
    let begin = Instant::now();
    let (observation, notes) = system.run(&Test::default());
    let taken = begin.elapsed();
    let mut said = vec![match observation.outcome.detail() {
        Some(detail) => format!("{}: {detail}", observation.outcome.word()),
        None => observation.outcome.word().to_owned(),
    }];
    said.extend(notes);
    drop(peers);

    let mut healthy = vec![
        ("publisher.py", "--topic /peer/undisturbed --rate 50 --count 100000"),
        ("subscriber.py", "--count 100000"),
    ];
    healthy.extend(fault.nodes.contains("second").then_some(("subscriber.py", "--count 100000")));
    healthy.extend(fault.nodes.contains("clock").then_some(("faulty.py", "clock-stops --after 1000")));
    let peers: Vec<Peer> = healthy.iter().map(start).collect();
    peers.iter().for_each(Peer::await_up);
    let (observation, notes) = system.run(&Test::default());
    assert_eq!((observation.outcome.word(), notes), ("completed", Vec::new()), "after: {}", fault.name);
    assert!(observation.messages > 0, "after: {}", fault.name);
    Some((said.join("\n"), taken))
}

/// Whether a text is the expected one, in which `…` stands for what differs from run to run.
fn is_like(seen: &str, expected: &str) -> bool {
    let mut parts = expected.split('…');
    let Some(mut rest) = parts.next().and_then(|first| seen.strip_prefix(first)) else { return false };
    for part in parts {
        // Up to the end of the line, where nothing follows.
        let line = rest.find('\n').unwrap_or(rest.len());
        let Some(at) = (if part.is_empty() { Some(line) } else { rest.find(part) }) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.is_empty()
}

/// How long the longest of the runs took, without those after them in which nothing is wrong.
fn check(faults: &[Fault]) -> Duration {
    let mut longest = Duration::ZERO;
    let seen: Vec<_> = thread::scope(|scope| {
        let running: Vec<_> = faults.iter().map(|fault| scope.spawn(move || observed(fault))).collect();
        running.into_iter().map(|thread| thread.join().expect("no run panics")).collect()
    });
    for (fault, seen) in faults.iter().zip(seen) {
        let Some((seen, taken)) = seen else { return longest };
        let is_expected = fault.expected.iter().any(|expected| is_like(&seen, expected));
        assert!(is_expected, "{}:\n{seen}\nis none of:\n{}", fault.name, fault.expected.join("\nor:\n"));
        longest = longest.max(taken);
    }
    longest
}

#[test]
fn a_system_that_never_becomes_complete_says_what_is_missing() {
    let nobody = Fault {
        name: "nobody is there",
        nodes: LISTENER,
        end: "2s",
        kind: POINT,
        peers: &[],
        expected: &["launch_failed: the launch failed: the system is not complete after 30 s: nobody \
                   publishes on `/peer/undisturbed`; 0 of 1 subscribe to `/peer`: `listener`"],
    };
    let twice = Fault {
        name: "a node that subscribes twice",
        nodes: "node listener { subscribes peer }\nnode second { subscribes peer }",
        end: "2s",
        kind: POINT,
        peers: &[
            ("publisher.py", "--topic /peer/undisturbed --rate 50 --count 100000"),
            ("subscriber.py", "--count 100000 --subscriptions 2"),
        ],
        expected: &["launch_failed: the launch failed: the system is not complete after 30 s: 1 of 2 subscribe to \
                   `/peer`: `listener`, `second`"],
    };
    check(&[nobody, twice]);
}

/// Systems that will never become complete, or be cut: how long the longest of the runs took.
fn hopeless() -> Duration {
    check(&[
        Fault {
            name: "another type",
            nodes: "",
            end: "2s",
            kind: POINT,
            peers: &[("faulty.py", "wrong-type --topic /peer/undisturbed --count 100000")],
            expected: &["launch_failed: the launch failed: the system cannot become complete: `/peer_faulty` \
                       publishes `std_msgs/msg/String` on `/peer/undisturbed`; expected \
                       `geometry_msgs/msg/PointStamped`"],
        },
        Fault {
            name: "a publisher that is not remapped",
            nodes: LISTENER,
            end: "2s",
            kind: POINT,
            peers: &[("publisher.py", "--rate 50 --count 100000"), ("subscriber.py", "--count 100000")],
            expected: &["crash: topic `/peer` is not cut: `/peer_publisher` publishes on it directly, heard \
                       by `/peer_subscriber`; start the publisher with `--ros-args -r \
                       /peer:=/peer/undisturbed` (`sesamec explain wiring` lists all remappings)"],
        },
    ])
}

/// Had it been awaited until systems must be complete, what is said would be that they are not.
#[test]
fn a_node_that_is_wrong_is_named_as_soon_as_it_is_clear_that_nothing_will_mend_it() {
    hopeless();
}

#[test]
#[ignore = "long: how soon that is, with nothing beside it"]
fn a_node_that_is_wrong_is_named_within_twenty_seconds() {
    let longest = hopeless();
    assert!(longest < Duration::from_secs(20), "{longest:?}");
}

#[test]
fn samples_that_cannot_be_read_are_passed_on_and_noted_once() {
    check(&[
        Fault {
            name: "truncated samples",
            nodes: "",
            end: "2s",
            kind: POINT,
            peers: &[("faulty.py", "truncated --topic /peer/undisturbed --count 100000")],
            expected: &["completed\na message on `/peer` cannot be decoded and is passed on as it came: …"],
        },
        Fault {
            name: "garbage",
            nodes: "",
            end: "2s",
            kind: "sensor_msgs/msg/JointState",
            peers: &[("faulty.py", "garbage --topic /peer/undisturbed --count 100000")],
            expected: &["completed\na message on `/peer` cannot be decoded and is passed on as it came: field \
                       `header.frame_id`: it ends after 76 bytes, where 2147483583 more are needed"],
        },
        Fault {
            name: "samples of 60 MB",
            nodes: "",
            // How long one of them takes depends on what else the machine does.
            end: "120s or when heard > 0",
            kind: TEXT,
            peers: &[("faulty.py", "gigantic --topic /peer/undisturbed --count 1000 --rate 1")],
            expected: &["completed"],
        },
    ]);
}

#[test]
fn publishers_and_subscribers_that_do_not_fit_do_not_end_a_run() {
    check(&[
        Fault {
            name: "unmatched qualities of service",
            nodes: LISTENER,
            end: "2s",
            kind: POINT,
            peers: &[
                ("publisher.py", "--topic /peer/undisturbed --best-effort --rate 50 --count 100000"),
                ("subscriber.py", "--count 100000"),
            ],
            expected: &["completed\n`/peer_subscriber` hears nothing on `/peer`: it asks for another \
                       Reliability than the publishers offer"],
        },
        Fault {
            name: "a node that dies",
            nodes: "",
            end: "3s",
            kind: POINT,
            peers: &[("faulty.py", "dies --topic /peer/undisturbed --count 100000")],
            expected: &["completed"],
        },
        Fault {
            name: "two publishers on one topic",
            nodes: "",
            end: "2s",
            kind: POINT,
            peers: &[("faulty.py", "two --topic /peer/undisturbed --count 100000")],
            // The names of their nodes may come too late, and so may the second of them.
            expected: &[
                "completed\n2 publish on `/peer/undisturbed`: …",
                "completed\n`/peer_faulty…` publishes on `/peer/undisturbed` since the run began: 2 publish there, and 1 \
                 is declared",
            ],
        },
        Fault {
            name: "a slow subscriber",
            nodes: LISTENER,
            end: "5s",
            kind: POINT,
            peers: &[
                ("publisher.py", "--topic /peer/undisturbed --rate 2000 --count 1000000"),
                ("subscriber.py", "--count 1000000 --slow 0.1 --depth 10"),
            ],
            // Its middleware takes what it does not; that may be late too.
            expected: &[
                "completed",
                "completed\na subscriber of `/peer` does not keep up: messages to it were given up",
            ],
        },
    ]);
}

/// Systems whose clock goes wrong: how long the longest of the runs took.
fn wrong_clocks() -> Duration {
    const CLOCKED: &str = "node clock { publishes peer }";
    const GOOD: (&str, &str) = ("publisher.py", "--topic /peer/undisturbed --rate 50 --count 100000");
    check(&[
        Fault {
            name: "a clock that stands still",
            nodes: CLOCKED,
            end: "5s",
            kind: POINT,
            peers: &[GOOD, ("faulty.py", "clock-stops --after 3 --linger 1000")],
            expected: &[
                "timeout: stopped after 10 s of wall time\na tick of the clock of the simulator, on `/clock`, was \
                       awaited for 10 s of wall time",
            ],
        },
        Fault {
            name: "a clock that jumps back",
            nodes: CLOCKED,
            end: "5s",
            kind: POINT,
            peers: &[GOOD, ("faulty.py", "clock-back --after 3 --linger 1000")],
            expected: &["wrong_clock: the clock of the simulator went back, from … s to … s"],
        },
    ])
}

#[test]
fn a_clock_that_goes_wrong_ends_a_run() {
    wrong_clocks();
}

#[test]
#[ignore = "long: how soon that is, with nothing beside it"]
fn a_clock_that_goes_wrong_ends_a_run_within_half_a_minute() {
    let longest = wrong_clocks();
    assert!(longest < Duration::from_secs(28), "{longest:?}");
}
