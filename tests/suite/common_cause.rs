//! One operation on several topics, before a robot with two sensors that survives the loss of either.

use serde_json::Value;

use crate::interpreted::{in_python, without_cargo};

const SPACE: &str = "lookout.sesame";

/// A cart drives towards a wall at 1 m/s, and stops half a metre before it as long as a sensor has told it a distance
/// within the last 0.4 s; it is blind only if both are silent for longer.
const SIMULATOR: &str = r#"
PATHS = ["sensors/left/range", "sensors/right/range"]
order = json.loads(sys.stdin.readline())
while order:
    if "reset" in order:
        step, now, left = order["reset"]["step"], 0.0, 5.0
        heard = {path: 0.0 for path in PATHS}
        order = answer({"ready": {"publishes": PATHS + ["cart/left"], "subscribes": PATHS, "resets": True}})
    else:
        now += step
        for message in order["step"]["messages"]:
            heard[message["topic"]] = now
        sees = any(now - time <= 0.4 for time in heard.values())
        if left > 0.5 or not sees:
            left -= step
        messages = [{"topic": path, "value": left} for path in PATHS + ["cart/left"]]
        order = answer({"done": {"messages": messages}})
"#;

const TEXT: &str = r#"
space lookout
system {
  simulator yard = process "python3" "sim.py" { step 50ms }
  topic left  = "sensors/left/range"  : real[m]
  topic right = "sensors/right/range" : real[m]
  topic way   = "cart/left"           : real[m]
}
metric nearest minimise default 9m = min(way)
requirement R1 "The cart stops before the wall" = nearest >= 0.3m

operation dirt  on left        = blackhole   within [0s, 8s]   for [0s, 2s]
operation glare on right       = blackhole   within [0s, 8s]   for [0s, 2s]
operation power on left, right = blackhole   within [0s, 8s]   for [0s, 2s]
operation blur  on left, right = noise [0m, 5cm]

campaign find {
  objectives nearest
  operations dirt, glare, power, blur 1..2 per test
  search     { evaluations 80 }
  end        after 8s
}
"#;

#[test]
fn a_cause_that_two_sensors_share_is_found_as_one_and_shrunk_to_messages_of_both() {
    let project = in_python("common_cause", SPACE, TEXT, SIMULATOR);
    let run = |into: &str, workers: &str| {
        without_cargo(&project, &["run", SPACE, "--", "--workers", workers, "--results", into]).expect(0)
    };
    let first = run("one", "1");
    assert_eq!(first.digest(), run("two", "2").digest(), "the same for any number of workers");

    // Power alone blinds the cart. Each sensor alone does not, and blur does not matter.
    let causes = without_cargo(&project, &["causes", SPACE, "--results", "one/1", "--format", "json"]).expect(0).json();
    let of = |cause: &Value| -> Vec<String> {
        cause["operations"].as_array().unwrap().iter().map(|name| name.as_str().unwrap().to_owned()).collect()
    };
    let found: Vec<Vec<String>> = causes["causes"].as_array().unwrap().iter().map(of).collect();
    assert!(found.contains(&vec!["power".to_owned()]), "{found:?}");
    for operations in &found {
        assert!(operations == &["power"] || operations == &["dirt", "glare"], "{found:?}");
    }

    let cause = causes["causes"].as_array().unwrap().iter().find(|cause| of(cause) == ["power"]).unwrap();
    let test = cause["test"].as_str().unwrap();
    let acting = &cause["acting"][0];
    assert_eq!((acting["topic"].as_str(), &acting["further_topics"]), (Some("left"), &serde_json::json!(["right"])));
    let shrink = ["shrink", SPACE, test, "--results", "one/1", "--messages", "--into", "small", "--format", "json"];
    let shrunk = without_cargo(&project, &shrink).expect(0).json();
    let left = shrunk["shrinking"]["messages"]["left"].as_array().unwrap_or_else(|| panic!("{shrunk:#}"));
    let topics: Vec<&str> = left.iter().map(|message| message["topic"].as_str().unwrap()).collect();
    assert!(topics.contains(&"left") && topics.contains(&"right"), "{topics:?}");
    assert!(
        left.iter().all(|message| message["path"] == format!("sensors/{}/range", message["topic"].as_str().unwrap()))
    );
    // Without a message for more than 0.4 s, of either sensor, and half of what is lost is of each.
    let of_each = |topic: &str| topics.iter().filter(|other| **other == topic).count();
    assert!(of_each("left") >= 8 && of_each("right") >= 8, "{topics:?}");
}
