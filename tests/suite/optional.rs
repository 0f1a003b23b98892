//! States of vehicles as two vendors fill them in, in the shape of VDA 5050: what one leaves out, or writes as `null`,
//! the other has.

use serde_json::Value;

use crate::interpreted::{in_python, without_cargo};

const SPACE: &str = "vendors.sesame";

/// `acme` always knows its position; `bolt` loses it every other time, and says so in one of two ways. The simulator
/// counts the states that a control would get.
const SIMULATOR: &str = r#"
PATHS = ["uagv/v2/acme/1/state", "uagv/v2/bolt/7/state"]

def state(vendor, number):
    said = {"headerId": number, "orderId": "", "nodeStates": [],
            "batteryState": {"batteryCharge": 80.0, "charging": False},
            "safetyState": {"eStop": "NONE", "fieldViolation": False}, "operatingMode": "AUTOMATIC"}
    position = {"x": float(number), "y": 0.0, "theta": 0.5, "mapId": "hall", "positionInitialized": True}
    if vendor == "acme":
        return {**said, "agvPosition": position, "driving": True, "errors": []}
    if number % 4 == 1:
        return {**said, "agvPosition": None, "driving": False, "velocity": {"vx": 1.0}}
    return {**said, "driving": False} if number % 2 else {**said, "agvPosition": position, "driving": False}

order = json.loads(sys.stdin.readline())
while order:
    if "reset" in order:
        number, heard = 0, 0
        order = answer({"ready": {"publishes": PATHS + ["heard"], "subscribes": PATHS, "resets": True}})
    else:
        heard += len(order["step"]["messages"])
        messages = [{"topic": path, "value": state(vendor, number)} for path, vendor in zip(PATHS, ["acme", "bolt"])]
        messages.append({"topic": "heard", "value": heard})
        number += 1
        order = answer({"done": {"messages": messages}})
"#;

const TEXT: &str = r#"
space vendors
system {
  simulator yard = process "python3" "sim.py" { step 100ms }
  message Position { x: real[m]  y: real[m]  theta: real[rad] }
  message Velocity { optional vx: real[m/s]  optional vy: real[m/s] }
  message State {
    headerId: int
    driving:  bool
    optional agvPosition: Position
    optional velocity:    Velocity
    optional errors:      list of text
  }
  topic state = "uagv/v2/{acme/1,bolt/7}/state" : State
  topic heard = "heard" : int
}
metric places_of_bolt maximise default 0 = count(state["bolt/7"].agvPosition.x >= 0m)
metric places_of_acme maximise default 0 = count(state["acme/1"].agvPosition.x >= 0m)
metric speeds_of_bolt maximise default 0 = count(state["bolt/7"].velocity.vx > 0m/s)
metric sideways       maximise default 0 = count(state["bolt/7"].velocity.vy > 0m/s)
metric states_of_bolt maximise default 0 = count(state["bolt/7"].headerId >= 0)
metric far            maximise default 0m = max(state["bolt/7"].agvPosition.x) outbound
metric got            maximise default 0 = last(heard)
requirement R1 "Bolt stays near" = far <= 1000m

operation drift on state["bolt/7"].agvPosition.x = bias [-5000m, 5000m]
operation late  on state["bolt/7"]               = latency [0s, 9s]
operation lose  on state["bolt/7"]               = blackhole

test far_away { drift bias 5000m from 0s to 7950ms }
test silent   { lose             from 0s to 7950ms }

campaign c {
  objectives far
  observes   places_of_bolt, places_of_acme, speeds_of_bolt, sideways, states_of_bolt, got
  operations drift, late, lose 1 per test
  search     random { evaluations 4 }
  end        after 7950ms
}
"#;

#[test]
fn what_a_message_lacks_is_as_if_it_had_not_come_and_operations_on_messages_act_on_all() {
    let project = in_python("optional", SPACE, TEXT, SIMULATOR);
    let known = without_cargo(&project, &["known", SPACE, "--format", "json"]);
    assert!(known.json().is_object(), "{}", known.err);
    let show = |test: &str| -> Value {
        let shown = without_cargo(&project, &["show", SPACE, test, "--results", "known", "--format", "json"]).expect(0);
        shown.json()
    };
    let metric = |test: &Value, name: &str| -> f64 {
        let metrics = test["metrics"].as_array().unwrap_or_else(|| panic!("{test:#}"));
        let metric = metrics.iter().find(|metric| metric["metric"] == name).unwrap_or_else(|| panic!("{test:#}"));
        metric["value"].as_f64().unwrap_or_else(|| panic!("{test:#}"))
    };
    let reference = show("T0");
    let states = metric(&reference, "states_of_bolt");
    // States are numbered from 0. The even ones have a position, and every fourth from 1 on has a speed.
    let (places, speeds) = ((states / 2.0).ceil(), ((states - 1.0) / 4.0).ceil());
    assert!(states >= 78.0, "{states}");
    assert_eq!(metric(&reference, "places_of_acme"), states);
    assert_eq!(metric(&reference, "places_of_bolt"), places, "every other one has no position");
    assert_eq!(metric(&reference, "speeds_of_bolt"), speeds);
    assert!(metric(&reference, "far") < 100.0);
    assert_eq!(reference["notes"].as_array().map_or(0, Vec::len), 0, "nothing is missing: {reference:#}");

    let [drifted, silent] = ["T1", "T2"].map(show);
    assert!(metric(&drifted, "far") > 5000.0);
    let changed = |test: &Value, counter: &str| test["operations"][0]["counters"][counter].as_f64().unwrap();
    assert_eq!(changed(&drifted, "changed"), places, "only what is there is changed: {drifted:#}");
    assert_eq!(changed(&drifted, "seen"), states);
    assert_eq!(changed(&silent, "dropped"), states, "and all of them can be lost");
    assert_eq!(metric(&silent, "got"), metric(&reference, "got") - states + 1.0);
}
