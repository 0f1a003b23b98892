//! Calls of services through the runner.

use sesame_plan::Channel::{Reply, Request};
use sesame_plan::testing::test_of;
use sesame_plan::{Node, testing};

use crate::core::Core;
use crate::system::{System, plan, remapped, ros};

#[test]
fn clients_call_servers_through_the_runner() {
    let Some(core) = Core::start() else { return };
    let mut plan = plan(
        &core.uri(),
        &[
            ("on", "/switch", "std_srvs/srv/SetBool_Request", Request),
            ("done", "/switch", "std_srvs/srv/SetBool_Response", Reply),
            // The space has only the requests of this one.
            ("question", "/ask", "std_srvs/srv/Trigger_Request", Request),
        ],
    );
    plan.nodes = vec![Node {
        publishes: testing::topics(&[1]),
        subscribes: testing::topics(&[0, 2]),
        ..testing::node("server")
    }];
    ros(&mut plan).reset = Some("/reset".to_owned());
    let remapped = remapped(&plan, 0);
    assert_eq!(remapped, ["/switch:=/switch/undisturbed", "/ask:=/ask/undisturbed"]);
    let mut server = core.ready_peer("server.py", &[&remapped[0], &remapped[1]]);
    let mut client = core.ready_peer("client.py", &[]);
    let mut system = System::new(plan);
    let (mut said, mut begun) = (None, false);
    let finished = system.run(
        &test_of(Vec::new()),
        || {},
        || {
            if !std::mem::replace(&mut begun, true) {
                client.go();
            }
            said = said.take().or_else(|| client.said_already());
            said.is_some()
        },
    );
    let (said, finished) = (said.unwrap(), finished.unwrap());
    assert_eq!(said["answers"], serde_json::json!([[true, "on"], [false, "off"], [true, "on"]]));
    assert!(said["failed"].as_str().unwrap().contains("not today"), "{said}");
    assert!(said["mistaken"].as_str().unwrap().contains("MD5"), "{said}");
    assert_eq!(finished.messages, 3 + 3 + 1);
    let asked: Vec<_> = (0..5).map(|_| server.said()).collect();
    assert_eq!(asked[0]["reset"], true, "before the run: {asked:?}");
    assert_eq!(asked[4]["ask"], true, "{asked:?}");
    let notes = system.notes();
    assert!(notes.len() == 1 && notes[0].contains("the server of `/ask/undisturbed` says:"), "{notes:?}");
}
