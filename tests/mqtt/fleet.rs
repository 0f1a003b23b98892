//! Vehicles that speak VDA 5050 and their control, each at a broker of their own: orders are finished undisturbed, and
//! late or never under disturbances.

use std::fs;

use serde_json::Value;
use sesame_tests::{Done, command, done, fresh_folder, sesamec, workspace};

use crate::peers::{Broker, packages};

/// Prepares a campaign of the fleet; the relay may add so much to the way of a message. How long the slowest order took
/// when orders were late, and when nothing was heard of vehicles; 60 s stand for one that was never finished.
fn prepared(name: &str, budget: &str) -> Option<[f64; 2]> {
    let packages = packages()?;
    let folder = fresh_folder(name);
    let [vehicles, control] = [Broker::start(&folder), Broker::start(&folder)].map(|broker| (broker.port, broker));
    let program = workspace().join("tests/mqtt/fleet.js").display().to_string();
    let text = format!(
        "space fleet\n\
         system {{\n\
           simulator fleet = mqtt \"mqtt://127.0.0.1:{vehicles}\" {{ quality at_least_once }}\n\
           relay budget {{ latency {budget} }}\n\
           message Order    {{ orderId: text }}\n\
           message State    {{ orderId: text  lastNodeSequenceId: int }}\n\
           message Presence {{ connectionState: text }}\n\
           message Finished {{ order: int  seconds: real[s] }}\n\
           topic order      = \"uagv/v2/acme/{{agv0,agv1,agv2}}/order\"      : Order\n\
           topic state      = \"uagv/v2/acme/{{agv0,agv1,agv2}}/state\"      : State\n\
           topic connection = \"uagv/v2/acme/{{agv0,agv1,agv2}}/connection\" : Presence\n\
           topic finished   = \"fleet/finished\"                           : Finished\n\
           node vehicles {{\n\
             publishes state, connection  subscribes order\n\
             launch \"node\" \"{program}\" \"vehicles\" \"{vehicles}\" {{ ready when line \"ready\" within 120s }}\n\
           }}\n\
           node control {{\n\
             publishes order, finished  subscribes state, connection  broker \"mqtt://127.0.0.1:{control}\"\n\
             launch \"node\" \"{program}\" \"control\" \"{control}\" {{ ready when line \"ready\" within 120s }}\n\
           }}\n\
           node report {{ subscribes finished  broker \"mqtt://127.0.0.1:{control}\" }}\n\
         }}\n\
         metric slowest  maximise default 60s = max(finished.seconds)\n\
         requirement R1 \"Orders are finished soon\" = slowest <= 5s\n\
         operation late on order = latency [0s, 10s]\n\
         operation lost on state = blackhole\n\
         test late_orders {{ late delay 4s from 0s to 10s  expect slowest >= 5s }}\n\
         test lost_states {{ lost from 0s to 10s  expect slowest >= 60s }}\n\
         campaign first {{\n\
           objectives slowest\n\
           operations late, lost 1 per test\n\
           search     random {{ evaluations 2 }}\n\
           end        after 10s\n\
         }}\n",
        vehicles = vehicles.0,
        control = control.0,
    );
    fs::write(folder.join("fleet.sesame"), text).expect("a space can be written");
    let sesamec = |arguments: &[&str]| -> Done {
        let mut sesamec = command(sesamec());
        sesamec.env("NODE_PATH", packages.join("node_modules"));
        done(sesamec.args(arguments).current_dir(&folder))
    };
    let found = sesamec(&["prepare", "fleet.sesame", "--runs", "1", "--format", "json"]).expect(0).json();
    println!("{found:#}");
    assert_eq!(found["passed"], true, "{found:#}");
    let tests = found["known"]["tests"].as_array().expect("both are run");
    let slowest = |test: &Value| {
        let metrics = test["metrics"].as_array().expect("metrics are measured");
        let metric = metrics.iter().find(|metric| metric["metric"] == "slowest").expect("it is among them");
        metric["simulation"]["mean"].as_f64().unwrap_or_else(|| panic!("no mean in {found:#}"))
    };
    let page = fs::read_to_string(folder.join("runners/first/results/prepare/report.html"));
    assert!(page.expect("it ends in a page").contains("id=\"known\""));
    drop((vehicles.1, control.1));
    Some([&tests[0], &tests[1]].map(slowest))
}

/// Nobody steps vehicles and control: on a busy machine an order that is late may not be finished within the run.
#[test]
fn orders_that_are_late_take_longer_and_those_of_which_nothing_is_heard_are_never_finished() {
    let Some([late, never]) = prepared("mqtt_fleet", "10s") else { return };
    assert!(late >= 5.0, "{late}");
    assert_eq!(never, 60.0);
}

/// Undisturbed, an order takes between one and two seconds; late by four seconds, it takes between five and six, of
/// eight and a half that are left.
#[test]
#[ignore = "long: how long an order takes depends on the load of the machine"]
fn orders_that_are_late_are_finished_late() {
    let Some([late, never]) = prepared("mqtt_fleet_alone", "500ms") else { return };
    assert!((5.0..10.0).contains(&late), "{late}");
    assert_eq!(never, 60.0);
}
