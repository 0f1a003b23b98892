//! Preparatory testing over each middleware whose nodes run freely, as a user does it: `sesamec prepare` launches real
//! nodes, relays one topic more in each stage, and ends in a page.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;
use sesame_tests::workspace;

use crate::environment::{Domain, Space, Vendor};

/// What differs between middlewares.
struct Middleware {
    /// The simulator, after its name.
    simulator: String,
    /// What launches the system besides the talker.
    launch: String,
    python: PathBuf,
    talker: &'static str,
}

/// A program as a launch declares it.
fn quoted(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().map(|word| format!("{word:?}")).collect();
    quoted.join(" ")
}

impl Middleware {
    fn ros2(domain: &Domain) -> Option<Self> {
        Some(Middleware {
            simulator: format!("ros2 {{ domain {} }}", domain.number),
            launch: String::new(),
            python: Vendor::Jazzy.python()?,
            talker: "tests/ros2/peers/talker.py",
        })
    }

    /// Behind a bridge that holds everything back by so many seconds.
    fn rosbridge(domain: &Domain, late: Option<&str>) -> Option<Self> {
        let (python, bridge) = (Vendor::Jazzy.python()?, Vendor::Rosbridge.python()?);
        let program = workspace().join("tests/ros2/peers/bridge.py");
        let ros = Vendor::environment(&python).display().to_string();
        let mut words = vec![bridge.to_str()?, program.to_str()?, "--ros", &ros, "--port", "{port}", "--stay"];
        words.extend(late.iter().flat_map(|&late| ["--late", late]));
        let launch = format!("launch {} {{ ready when line \"listening\" within 120s }}", quoted(&words));
        let simulator = format!("rosbridge \"ws://127.0.0.1:{{port}}\" {{ domain {} }}", domain.number);
        Some(Middleware { simulator, launch, python, talker: "tests/ros2/peers/talker.py" })
    }

    fn ros1() -> Option<Self> {
        let launch = "launch \"roscore\" \"-p\" \"{port}\" { ready when port \"{port}\" within 120s }";
        Some(Middleware {
            simulator: "ros1 \"http://127.0.0.1:{port}\"".to_owned(),
            launch: launch.to_owned(),
            python: Vendor::Ros1.python()?,
            talker: "tests/ros1/peers/talker.py",
        })
    }
}

/// A node that publishes an angle, in a world of one middleware, whose relay may add so much.
fn world(name: &str, domain: Domain, middleware: &Middleware, budget: &str) -> Space {
    let Middleware { simulator, launch, python, talker } = middleware;
    let talker = workspace().join(talker);
    let talker = quoted(&[&python.display().to_string(), &talker.display().to_string(), "{ros-args}"]);
    let text = format!(
        "space angles\n\
             system {{\n\
               simulator robot = {simulator}\n\
               {launch}\n\
               relay budget {{ latency {budget} }}\n\
               message Angle = \"std_msgs/msg/Float64\" {{ data: real[rad] }}\n\
               topic angle = \"/angle\" : Angle\n\
               node talker {{ publishes angle  launch {talker} {{ ready when topic angle within 120s }} }}\n\
             }}\n\
             metric furthest maximise default 0rad = max(angle.data) outbound\n\
             metric swing = max(abs(angle.data))\n\
             requirement R1 \"It stays near\" = furthest <= 2rad\n\
             requirement R2 \"It swings\" = swing >= 0.1rad\n\
             operation lean on angle.data = bias [0rad, 5rad]\n\
             test leaning {{ lean bias 3rad from 0s to 2s  expect furthest >= 2.5rad }}\n\
             campaign first {{\n\
               objectives furthest\n\
               operations lean 1 per test\n\
               search     random {{ evaluations 2 }}\n\
               end        after 2s\n\
             }}\n"
    );
    Space::write(name, domain, "angles.sesame", &text)
}

/// `sesamec prepare` with its page: what was found.
fn prepare(world: &Space, code: i32) -> Value {
    let said = world.sesamec(&["prepare", "angles.sesame", "--runs", "1", "--format", "json"]).expect(code);
    let page = fs::read_to_string(world.folder().join("runners/first/results/prepare/report.html"));
    let page = page.expect("it ends in a page");
    assert!(page.contains("id=\"null\"") && page.contains("id=\"mitm\""), "{page}");
    said.json()
}

/// It is ready, and what was added to the topic was measured: to how many messages, which this returns, and how long to
/// every second one.
#[track_caller]
fn is_ready(found: &Value) -> u64 {
    assert_eq!(found["passed"], true, "{found:#}");
    let stages = found["mitm"]["stages"].as_array().expect("there are stages");
    assert_eq!(stages.len(), 2, "nothing is relayed, then the angle is: {found:#}");
    let topics = stages[1]["added"].as_array().expect("topics are relayed");
    assert_eq!(topics[0]["topic"], "angle", "{found:#}");
    let messages = topics[0]["messages"].as_u64().expect("they are counted");
    assert!(messages > 0, "{found:#}");
    println!("added to one message in two: {} s", topics[0]["p50"]);
    assert_eq!(found["known"]["tests"][0]["expectations"][0]["simulation"], "satisfied", "{found:#}");
    messages
}

/// A budget that every relay keeps, on a machine that is busy too.
const KEPT: &str = "60s";

#[test]
fn nodes_of_ros_2_are_prepared() {
    let domain = Domain::free();
    let Some(middleware) = Middleware::ros2(&domain) else { return };
    is_ready(&prepare(&world("prepared_ros2", domain, &middleware, KEPT), 0));
}

#[test]
fn nodes_of_ros_1_are_prepared() {
    let Some(middleware) = Middleware::ros1() else { return };
    is_ready(&prepare(&world("prepared_ros1", Domain::free(), &middleware, KEPT), 0));
}

#[test]
fn nodes_behind_a_bridge_are_prepared() {
    let domain = Domain::free();
    let Some(middleware) = Middleware::rosbridge(&domain, None) else { return };
    is_ready(&prepare(&world("prepared_rosbridge", domain, &middleware, KEPT), 0));
}

/// Two seconds with two hundred messages each, of which some are lost while systems start and end.
#[test]
#[ignore = "long: rates and what is added are wall time, with nothing beside them"]
fn what_is_added_over_each_middleware_stays_within_half_a_second_at_200_hz() {
    let [domain, bridged] = [(), ()].map(|()| Domain::free());
    let behind = Middleware::rosbridge(&bridged, None);
    let (Some(ros2), Some(ros1), Some(behind)) = (Middleware::ros2(&domain), Middleware::ros1(), behind) else {
        return;
    };
    let worlds = [
        world("prepared_ros2_quick", domain, &ros2, "500ms"),
        world("prepared_ros1_quick", Domain::free(), &ros1, "500ms"),
        world("prepared_rosbridge_quick", bridged, &behind, "500ms"),
    ];
    for world in worlds {
        let messages = is_ready(&prepare(&world, 0));
        assert!(messages > 200, "{messages} in {}", world.folder().display());
    }
}

#[test]
fn a_bridge_that_takes_20_ms_more_exceeds_a_budget_of_5_ms_and_no_campaign_runs_then() {
    let domain = Domain::free();
    let Some(middleware) = Middleware::rosbridge(&domain, Some("0.02")) else { return };
    let world = world("prepared_late", domain, &middleware, "5ms");
    let found = prepare(&world, 3);
    let stage = &found["mitm"]["stages"][1];
    let objection = stage["objections"][0].as_str().expect("it has an objection");
    assert!(objection.contains("the budget is 5 ms latency"), "{found:#}");
    assert!(stage["added"][0]["p50"].as_f64().is_some_and(|added| added >= 0.02), "{found:#}");
    assert_eq!(found["known"], Value::Null, "what follows makes no sense");
    let refused = world.sesamec(&["run", "angles.sesame"]).expect(1);
    assert!(refused.err.contains("exceeded the relay budget"), "{}", refused.err);
    assert!(refused.err.contains("--over-budget"), "{}", refused.err);
}
