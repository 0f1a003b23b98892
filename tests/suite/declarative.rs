//! A space whose metrics are all declarative: its runner needs no line of Rust.

use std::collections::BTreeMap;

use sesame_record::Repository;
use sesame_tests::Project;

const SPACE: &str = r#"
space declared
system {
  simulator faulty = in_process "faulty_sim::Faulty" { crate "simulator"  step 10ms }
  topic level  = "faulty/level"         : real[m]
  topic faults = "faulty/{panic,error}" : real[m]
}

metric sent                    = count(level > 500mm)
metric received                = count(level > 500mm) outbound
metric limited                 = count(level > 500mm) every 0.1s
metric lasting                 = duration(level == 1m)
metric both                    = mean(level * 2 + sum of faults)
metric never default 7m        = when faults > 1mm then level
metric steepest maximise       = max(level / 2s) outbound

requirement R1 "Messages arrive" = received >= 100

operation cut on level = blackhole within [0s, 1s]
operation lift on level = random offset [1m, 3m] within [0s, 1s]

test calm { lift offset [2m, 2m] from 0.5s to 0.6s  cut from 0.2s to 0.4s }
campaign again { repeat calm 2 times  observes sent, limited, lasting, both, never, steepest  end after 1s }
"#;

#[test]
fn declarative_metrics_need_no_hooks_and_hear_both_sides_of_the_relay() {
    let project = Project::new("declared", SPACE, "faulty");
    let runner = project.build("again");
    assert!(!project.runners.join("hooks").exists(), "there is nothing to fill in");
    let said = runner.run(&["--results", "results"]).expect(0);
    assert!(!said.err.contains("not filled in"), "{}", said.err);
    let only = std::fs::read_dir(runner.folder.join("results")).unwrap().next().unwrap().unwrap().path();
    let repository = Repository::open(&only).unwrap();
    let plan = repository.plan().clone();
    let values = |number: usize| -> BTreeMap<String, (f64, bool)> {
        let row = &repository.tests().unwrap()[number];
        let named = plan.metrics.iter().zip(&row.values);
        named.map(|(metric, value)| (metric.name.clone(), (value.value.unwrap(), value.set))).collect()
    };
    let expected = |received: f64, steepest: f64| {
        let known = [("sent", 100.0), ("limited", 10.0), ("lasting", 0.99), ("both", 2.0)];
        let mut all: BTreeMap<String, (f64, bool)> =
            known.into_iter().map(|(name, value)| (name.to_owned(), (value, true))).collect();
        all.insert("received".to_owned(), (received, true));
        all.insert("steepest".to_owned(), (steepest, true));
        all.insert("never".to_owned(), (7.0, false));
        all
    };
    assert_eq!(values(0), expected(100.0, 0.5), "without disturbance");
    assert_eq!(values(1), expected(80.0, 1.5), "a fifth is cut, and a tenth lifted by 2 m");
    assert_eq!(values(2), values(1), "and again");
}
