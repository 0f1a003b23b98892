//! Constants of messages are known by their names wherever a person reads them.

use crate::interpreted::{in_python, without_cargo};

const SPACE: &str = "charger.sesame";

/// The battery is charged until its plug is pulled, when the command says so.
const SIMULATOR: &str = r#"
order = json.loads(sys.stdin.readline())
while order:
    if "reset" in order:
        status = 1
        topics = {"publishes": ["plug", "cart/battery", "cart/spare"], "subscribes": ["plug"]}
        order = answer({"ready": {**topics, "resets": True}})
    else:
        for message in answer({"publish": [{"topic": "plug", "value": 1.0}]})["deliver"]:
            status = 1 if message["value"] > 0.5 else 2
        order = answer({"done": {"messages": [{"topic": "cart/battery", "value": {"status": status}}]}})
"#;

const TEXT: &str = r#"
space charger
system {
  simulator yard = process "python3" "sim.py" { step 100ms }
  message Battery {
    constant STATUS_CHARGING    = 1
    constant STATUS_DISCHARGING = 2
    status: int
  }
  topic battery = "cart/battery" : Battery
  topic spare   = "cart/spare" : Battery
  topic plug    = "plug" : real
}

metric status maximise default 0 = max(battery.status)
/// Nobody says anything of it.
metric spare_status    default 1 = last(spare.status)
requirement R1 "The battery is charged" = status == STATUS_CHARGING

operation pulled on plug = stuck at [0, 0]

test out { pulled value 0 from 1s to 2s  expect status == STATUS_DISCHARGING }

campaign pulling {
  objectives status
  observes   spare_status
  operations pulled 1 per test
  search     random { evaluations 2 }
  end        after 3s
}
"#;

#[test]
fn values_and_bounds_that_are_constants_have_their_names_in_the_terminal_and_on_the_page() {
    if !sesame_peers::has_python3() {
        return;
    }
    let project = in_python("constants", SPACE, TEXT, SIMULATOR);
    let sesamec = |arguments: &[&str]| without_cargo(&project, arguments).expect(0).out;
    sesamec(&["known", SPACE, "out"]);
    let shown = sesamec(&["show", SPACE, "out", "--results", "known"]);
    assert!(shown.contains("2 (STATUS_DISCHARGING)") && shown.contains("= 1 (STATUS_CHARGING)"), "{shown}");
    assert!(shown.contains("1 (never set)"), "a default was never observed: {shown}");
    let json = sesamec(&["show", SPACE, "out", "--results", "known", "--format", "json"]);
    assert!(json.contains(r#""constant": "STATUS_DISCHARGING""#), "{json}");
    sesamec(&["report", SPACE, "--results", "known", "--output", "page.html"]);
    let page = std::fs::read_to_string(project.folder.join("page.html")).expect("the page is written");
    assert!(page.contains("2 (STATUS_DISCHARGING)"), "the page names the value");
}
