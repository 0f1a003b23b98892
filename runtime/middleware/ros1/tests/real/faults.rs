//! What goes wrong around the runner, and what it makes of it.

use std::time::Instant;

use nix::sys::signal::Signal;
use sesame_plan::testing::test_of;

use crate::core::{Core, LIMIT};
use crate::system::{System, peers, remapped};

const STRING: &str = "std_msgs/msg/String";

#[test]
fn a_publisher_that_is_killed_and_started_again_is_heard_again() {
    let Some(core) = Core::start() else { return };
    let plan = peers(&core.uri(), STRING);
    let remapped = remapped(&plan, 0);
    let arguments = ["/peer", "std_msgs/String", "1000000", "200", "at-once", &remapped[0]];
    let mut publisher = Some(core.ready_peer("publisher.py", &arguments));
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", "std_msgs/String", "600", "120"]);
    let mut system = System::new(plan);
    let (mut again, mut said) = (None, None);
    let finished = system.run_seeing(
        &test_of(Vec::new()),
        || {},
        |seen| {
            if seen.messages > 100
                && let Some(publisher) = publisher.take()
            {
                publisher.end(Signal::SIGKILL);
                again = Some(core.peer("publisher.py", &arguments));
            }
            said = said.take().or_else(|| subscriber.said_already());
            said.is_some()
        },
    );
    finished.unwrap();
    assert!(said.unwrap()["received"].as_u64().unwrap() >= 600);
    let notes = system.notes();
    assert!(
        notes.iter().any(|note| note.starts_with("`/publisher` no longer publishes on `/peer/undisturbed`")),
        "{notes:?}"
    );
    assert!(notes.contains(&"`/publisher` publishes on `/peer/undisturbed` again".to_owned()), "{notes:?}");
}

#[test]
fn a_master_that_comes_back_knows_the_runner_and_messages_went_on_meanwhile() {
    let Some(mut core) = Core::start() else { return };
    let plan = peers(&core.uri(), STRING);
    let remapped = remapped(&plan, 0);
    let mut publisher = core.ready_peer("publisher.py", &["/peer", "std_msgs/String", "1000", "200", &remapped[0]]);
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", "std_msgs/String", "1000", "120"]);
    let mut system = System::new(plan);
    let (mut away, mut back, mut said) = (None, false, None);
    let finished = system.run_seeing(
        &test_of(Vec::new()),
        || publisher.go(),
        |seen| {
            let is_noted = |words: &str| seen.notes.iter().any(|note| note.contains(words));
            if away.is_none() && seen.messages > 100 {
                core.end();
                away = Some(seen.messages);
            }
            if !back && is_noted("does not answer") {
                // Messages have gone on meanwhile.
                assert!(away.is_some_and(|before| before < seen.messages), "{seen:?}");
                core.begin_alone();
                back = true;
            }
            said = said.take().or_else(|| subscriber.said_already());
            said.is_some() && back && is_noted("answers again")
        },
    );
    finished.unwrap();
    assert_eq!(said.unwrap()["received"], 1000, "a master is needed to find each other only");
    // It is registered again soon after it has heard of the master.
    let begun = Instant::now();
    loop {
        let mut info = core.tool("rostopic", &["list", "-v"]);
        let lines = std::iter::from_fn(|| info.line_if_any()).take_while(|line| !line.contains("Subscribed"));
        let listed: Vec<String> = lines.collect();
        if listed.iter().any(|line| line.contains("/peer [std_msgs/String]")) {
            break;
        }
        assert!(begun.elapsed() < LIMIT, "{listed:?}");
    }
    let notes = system.notes();
    assert!(notes.iter().any(|note| note.contains("does not answer")), "{notes:?}");
    assert!(notes.iter().any(|note| note.ends_with("answers again")), "{notes:?}");
}

#[test]
fn a_master_that_stays_away_ends_the_run() {
    let Some(mut core) = Core::start() else { return };
    let mut plan = peers(&core.uri(), STRING);
    plan.nodes.clear();
    let publisher = ["/peer/undisturbed", "std_msgs/String", "1000000", "100", "at-once"];
    let _publisher = core.ready_peer("publisher.py", &publisher);
    let mut system = System::new(plan);
    let error = system.run(&test_of(Vec::new()), || core.end(), || false).err().unwrap();
    let expected = format!("the connection to the master at `127.0.0.1:{}` was lost: ", core.port());
    assert!(error.to_string().starts_with(&expected), "{error}");
}

#[test]
fn a_system_that_is_not_complete_is_said_to_be() {
    let Some(core) = Core::start() else { return };
    let plan = peers(&core.uri(), STRING);
    // It is not remapped.
    let publisher = ["/peer", "std_msgs/String", "1000000", "100", "at-once"];
    let _publisher = core.ready_peer("publisher.py", &publisher);
    let error = System::new(plan).run(&test_of(Vec::new()), || {}, || true).err().unwrap().to_string();
    assert_eq!(
        error,
        "the launch failed: the system is not complete after 30 s: nobody publishes on `/peer/undisturbed`; 0 of 1 subscribe to `/peer`: \
         `subscriber`; topic `/peer` is not cut: `/publisher` publishes on it directly; start it with \
         `/peer:=/peer/undisturbed` (`sesamec explain wiring` lists all remappings)"
    );
}

#[test]
fn whoever_is_hostile_ends_no_run_and_hears_why_he_is_refused() {
    let Some(core) = Core::start() else { return };
    let plan = peers(&core.uri(), STRING);
    let remapped = remapped(&plan, 0);
    let mut publisher = core.ready_peer("publisher.py", &["/peer", "std_msgs/String", "2000", "400", &remapped[0]]);
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", "std_msgs/String", "2001", "120"]);
    let mut system = System::new(plan);
    let (mut hostile, mut outcomes, mut said) = (None, None, None);
    let finished = system.run(
        &test_of(Vec::new()),
        || publisher.go(),
        || {
            let hostile = hostile.get_or_insert_with(|| core.peer("hostile.py", &["/sesame_relay_1", "/peer"]));
            outcomes = outcomes.take().or_else(|| hostile.said_already());
            said = said.take().or_else(|| subscriber.said_already());
            said.is_some() && outcomes.is_some()
        },
    );
    finished.unwrap();
    // One of the hostile publisher's messages is none of its type; it goes on unchanged, as all do that cannot be read.
    assert_eq!(said.unwrap()["received"], 2001);
    insta::assert_snapshot!(serde_json::to_string_pretty(&outcomes.unwrap()).unwrap());
    let mut notes = system.notes();
    notes.sort();
    insta::assert_snapshot!(notes.join("\n"));
}
