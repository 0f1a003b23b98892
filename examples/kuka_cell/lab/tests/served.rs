//! The program as a runner sees it: its runs are those that the cell has inside a runner.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Command, Stdio};

use kuka_cell_sim::NoisyCell;
use sesame_runtime::simulator::Setup;
use sesame_runtime::simulator::bench::Bench;
use sesame_runtime::time::SimTime;
use sesame_runtime::value::Value;

const STEP: SimTime = SimTime::from_nanos(20_000_000);
const STEPS: u32 = 500;

/// All that was published, by topic.
type Published = BTreeMap<String, Vec<serde_json::Value>>;

/// A run of the program between whose parts nothing is disturbed: what is published is delivered at once.
fn served(seed: u64, arguments: &[&str]) -> Published {
    let mut child = Command::new(env!("CARGO_BIN_EXE_kuka_cell_lab"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut input = child.stdin.take().expect("its input is a pipe");
    let mut output = BufReader::new(child.stdout.take().expect("its output is a pipe")).lines();
    let mut ask = |request: serde_json::Value| -> serde_json::Value {
        writeln!(input, "{request}").expect("it listens");
        let answer = output.next().expect("it answers").expect("its answer is text");
        serde_json::from_str(&answer).expect("its answer is JSON")
    };
    let mut published = Published::new();
    let mut keep = |messages: &serde_json::Value| {
        for message in messages.as_array().expect("messages are a list") {
            let topic = message["topic"].as_str().expect("a topic is a text").to_owned();
            published.entry(topic).or_default().push(message["value"].clone());
        }
    };
    let ready = ask(serde_json::json!({"reset": {"seed": seed, "step": STEP.seconds(), "topics": []}}));
    let mut late = ready["ready"]["messages"].clone();
    keep(&late);
    for step in 1..=STEPS {
        let time = f64::from(step) * STEP.seconds();
        let mut answer = ask(serde_json::json!({"step": {"time": time, "messages": late}}));
        while let Some(messages) = answer.get("publish") {
            keep(messages);
            answer = ask(serde_json::json!({"deliver": messages}));
        }
        late = answer["done"]["messages"].clone();
        keep(&late);
    }
    drop(input);
    assert!(child.wait().expect("it can be awaited").success());
    published
}

fn json(value: &Value) -> serde_json::Value {
    match value {
        Value::Real(x) => serde_json::json!(x),
        Value::Text(text) => serde_json::json!(text.as_str()),
        Value::Record(record) => record.iter().map(|(name, value)| (name.as_str().to_owned(), json(value))).collect(),
        other => panic!("the cell publishes no {other:?}"),
    }
}

#[test]
fn as_modelled_it_has_the_runs_of_the_noisy_cell_to_the_last_bit() {
    let mut bench = Bench::<NoisyCell>::start(&Setup::new(7, STEP)).expect("the cell starts");
    bench.run_until(SimTime::from_nanos(STEP.nanos() * i64::from(STEPS))).expect("the cell runs");
    let inside: Published = bench
        .topics()
        .map(|topic| (topic.to_owned(), bench.published(topic).iter().map(|message| json(&message.value)).collect()))
        .filter(|(_, messages): &(String, Vec<_>)| !messages.is_empty())
        .collect();
    let outside = served(7, &["--as-modelled"]);
    assert_eq!(inside.keys().collect::<Vec<_>>(), outside.keys().collect::<Vec<_>>());
    for (topic, messages) in &inside {
        assert!(*messages == outside[topic], "{topic}");
    }
}

#[test]
fn each_difference_shows_where_it_acts() {
    const STATE: &str = "arms/R3200ProductMove/state";
    const TARGET: &str = "joints/R3200ProductMove/Link0/R/position";
    const ZONE: &str = "safetyzones/Z1";
    let model = served(7, &["--as-modelled"]);
    let same = |other: &Published, topic: &str| other[topic] == model[topic];

    let shifted = served(7, &["--as-modelled", "--zone-shift", "30,0,0"]);
    assert!(same(&shifted, STATE) && same(&shifted, TARGET) && !same(&shifted, ZONE));

    let late = served(7, &["--as-modelled", "--latency", "50"]);
    assert!(!same(&late, STATE));

    // What the PLC sends is below the limit.
    let limited = served(7, &["--as-modelled", "--soft-limit", "1.1"]);
    assert!(same(&limited, STATE) && same(&limited, ZONE));

    let quiet = served(7, &["--as-modelled", "--noise", "0"]);
    assert!(!same(&quiet, STATE) && quiet == served(8, &["--as-modelled", "--noise", "0"]));
}
