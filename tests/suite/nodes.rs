//! Nodes that a simulator in Python does itself, paused, slowed and killed by a search. Only a robot that loses what it
//! was told is dangerous: one that is late or slow is not.

use serde_json::Value;

use crate::interpreted::{in_python, without_cargo};

const SPACE: &str = "carts.sesame";

/// Two carts drive towards a wall. They are told once to stop; what its pilot said last holds while it says nothing.
const SIMULATOR: &str = r#"
class Pilot:
    def __init__(self):
        self.restart()

    def restart(self):
        self.waiting, self.stopped, self.share, self.owed, self.dead = [], False, 1.0, 0.0, False

    def obey(self, order):
        if order["order"] == "kill":
            self.dead = True
        elif order["order"] == "restart":
            self.restart()
        else:
            self.share = {"pause": 0.0, "resume": 1.0}.get(order["order"], order.get("share"))

    def step(self, speed):
        """What it says in a step, if it has time for one."""
        self.owed += 0.0 if self.dead else self.share
        if self.owed < 1.0:
            return speed
        self.owed -= 1.0
        self.stopped = self.stopped or bool(self.waiting)
        return 0.0 if self.stopped else 1.0

CARTS = ["r1", "r2"]
ORDERS = [f"carts/{cart}/order" for cart in CARTS]
PLACES = [f"carts/{cart}/place" for cart in CARTS]
CAN = ["pause", "slow", "kill"]
order = json.loads(sys.stdin.readline())
while order:
    if "reset" in order:
        step = order["reset"]["step"]
        pilots = {f"pilot[{cart}]": Pilot() for cart in CARTS}
        speeds, places, told = [0.0, 0.0], [0.0, 0.0], False
        ready = {"publishes": ORDERS + PLACES, "subscribes": ORDERS, "resets": True}
        order = answer({"ready": {**ready, "nodes": {name: CAN for name in pilots}}})
    else:
        for given in order["step"].get("orders", []):
            pilots[given["node"]].obey(given)
        messages = order["step"]["messages"]
        if order["step"]["time"] >= 5.0 and not told:
            told = True
            messages += answer({"publish": [{"topic": topic, "value": True} for topic in ORDERS]})["deliver"]
        for message in messages:
            pilot = pilots[f"pilot[{message['topic'].split('/')[1]}]"]
            if not pilot.dead:
                pilot.waiting.append(message["value"])
        for at, pilot in enumerate(pilots.values()):
            speeds[at] = pilot.step(speeds[at])
            places[at] += speeds[at] * step
        order = answer({"done": {"messages": [{"topic": t, "value": p} for t, p in zip(PLACES, places)]}})
"#;

const TEXT: &str = r#"
space carts
system {
  simulator hall = process "python3" "sim.py" { step 100ms }
  topic orders = "carts/{r1,r2}/order" : bool
  topic places = "carts/{r1,r2}/place" : real[m]
  node pilot "{r1,r2}" { subscribes orders  publishes places }
  node manager         { publishes orders }
}
metric furthest maximise default 0m = max(each of places)
metric r1       maximise default 0m = max(places[r1])
metric r2       maximise default 0m = max(places[r2])
requirement R1 "The carts stop before the wall" = furthest <= 8m

operation halt  on node one of pilot = pause           within [0s, 12s]  for [100ms, 2s]
operation stall on node pilot        = slow [20%, 80%] within [0s, 12s]  for [100ms, 2s]
operation crash on node one of pilot = kill            within [0s, 12s]  for [100ms, 2s]

test paused           { halt member "r1" from 4s to 6s      expect r1 in [5.85m, 5.95m]   expect r2 in [4.85m, 4.95m] }
test slowed           { stall share 50% from 4.95s to 6s    expect furthest in [4.95m, 5.05m] }
test killed_early     { crash member "r2" from 2s to 3s     expect furthest in [4.85m, 4.95m] }
test killed_as_told   { crash member "r2" from 4.5s to 5.5s expect r1 in [4.85m, 4.95m]   expect r2 in [11.95m, 12.05m] }
test killed_and_slow  { crash member "r1" from 6s to 8s  stall share 50% from 7s to 9s  expect r1 in [8.85m, 8.95m] }

campaign find {
  objectives furthest
  operations halt, stall, crash 1..2 per test
  search     { evaluations 60 }
  end        after 12s
}
"#;

#[test]
fn a_pilot_that_forgets_what_it_was_told_is_found_among_late_and_slow_ones() {
    let project = in_python("nodes", SPACE, TEXT, SIMULATOR);
    let known = without_cargo(&project, &["run", SPACE, "--", "known", "--results", "known"]);
    known.expect(0);

    let run = |into: &str, workers: &str| {
        without_cargo(&project, &["run", SPACE, "--", "--workers", workers, "--results", into]).expect(0)
    };
    let first = run("one", "1");
    assert_eq!(first.digest(), run("three", "3").digest(), "the same for any number of workers");

    let causes = without_cargo(&project, &["causes", SPACE, "--results", "one/1", "--format", "json"]).expect(0).json();
    let found: Vec<Vec<&str>> = causes["causes"].as_array().unwrap().iter().map(operations).collect();
    assert!(!found.is_empty(), "{causes}");
    for operations in &found {
        assert!(matches!(operations[..], ["crash[r1]" | "crash[r2]"]), "{found:?}");
    }

    let smallest = causes["causes"][0]["test"].as_str().unwrap();
    let shrunk = ["shrink", SPACE, smallest, "--results", "one/1", "--into", "small", "--format", "json"];
    let shrunk = without_cargo(&project, &shrunk).expect(0).json();
    assert_eq!(shrunk["shrinking"]["minimal"], true, "{shrunk}");

    let shown = without_cargo(&project, &["show", SPACE, smallest, "--results", "one/1"]).expect(0).out;
    assert!(shown.contains("crash") && shown.contains("kill"), "{shown}");
}

fn operations(cause: &Value) -> Vec<&str> {
    cause["operations"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect()
}

#[test]
fn what_a_simulator_does_not_offer_is_said_before_any_test() {
    let project = in_python("nodes_not_offered", SPACE, TEXT, &SIMULATOR.replace(r#", "kill"]"#, "]"));
    let refused = without_cargo(&project, &["run", SPACE]).expect(1);
    let said = "the simulator does not offer to kill node `pilot[r1]`, as operation `crash` needs; \
                it offers `pilot[r1]` (pause, slow), `pilot[r2]` (pause, slow): name the node";
    assert!(refused.err.contains(said), "{}", refused.err);
}
