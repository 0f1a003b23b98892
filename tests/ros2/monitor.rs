//! A monitor as a node of its own beside real nodes: what it publishes is what the runner's own monitor decides on the
//! same recording.

use std::fs;
use std::path::PathBuf;

use sesame_relay::metric::MetricTable;
use sesame_relay::monitor::Decided;
use sesame_relay::trace::feed_telling;
use sesame_relay::wire::WireTable;
use sesame_results::record::Repository;
use sesame_tests::{Project, fresh_folder, target, workspace};

use crate::environment::{Domain, Vendor};
use crate::relaying::plan;

/// What a message needs on its way from the monitor to the runner at most, in seconds, on a machine that is busy.
const ON_ITS_WAY: f64 = 0.5;

const BUILT_IN: &str = "eddi upright publishes state {
  evidence  there = angle.data > -2 stale after 1s is unknown
  evidence  high  = angle.data > 0.3 held 50ms stale after 1s is false
  guarantee stands  integrity 2 = there and high
  guarantee moves   integrity 1 = there
  otherwise lost
}";

const EXTERNAL: &str = "eddi upright external on state.data {
  guarantee stands  integrity 2
  guarantee moves   integrity 1
  otherwise lost
}";

fn space(domain: &Domain, nodes: &str, monitor: &str) -> String {
    format!(
        r#"space swing
system {{
  simulator ros = ros2 {{ domain {} }}
  message Angle = "std_msgs/msg/Float64" {{ data: real }}
  message Level = "std_msgs/msg/Int32" {{ data: int }}
  topic angle = "/angle"        : Angle
  topic state = "/eddi/upright" : Level
  {nodes}
}}
{monitor}
metric disturbed minimise = fuzzing_time()
operation silence on angle = blackhole
operation lie     on state = packet loss [0%, 100%]
test silent {{ silence from 5s to 8s }}
campaign watch {{
  objectives disturbed
  operations silence, lie 1..2 per test
  search     random {{ evaluations 1 }}
  end        after 12s
  record     mcap all
}}
"#,
        domain.number
    )
}

/// The program of the monitor, generated from a space in which the runner would run it, and built.
fn built(domain: &Domain) -> PathBuf {
    let folder = fresh_folder("ros2_monitor_inside");
    let project = Project { space: folder.join("swing.sesame"), runners: folder.join("runners"), folder };
    fs::write(&project.space, space(domain, "", BUILT_IN)).expect("a space can be written");
    project.sesamec("generate", &["--eddi", "upright"]).expect(0);
    project.cargo("upright_monitor", "build").expect(0);
    let program = project.folder.join("monitor");
    fs::copy(target().join("debug/swing-upright_monitor"), &program).expect("what was built can be copied");
    program
}

#[test]
fn a_monitor_beside_real_nodes_publishes_what_the_runner_decides_on_the_same_recording() {
    let Some(python) = Vendor::Kilted.python() else { return };
    let domain = Domain::free();
    let (program, talker) = (built(&domain), workspace().join("tests/ros2/peers/talker.py"));
    let nodes = format!(
        r#"node talker {{ publishes angle  launch "{}" "{}" "{{ros-args}}" }}
  node guard  {{ publishes state  subscribes angle  launch "{}" "--domain" "{{domain}}" "{{ros-args}}" }}"#,
        python.display(),
        talker.display(),
        program.display()
    );
    let folder = fresh_folder("ros2_monitor_outside");
    let project = Project { space: folder.join("swing.sesame"), runners: folder.join("runners"), folder };
    fs::write(&project.space, space(&domain, &nodes, EXTERNAL)).expect("a space can be written");
    project.sesamec("known", &["-c", "watch", "--workers", "1"]).expect(0);
    let results = project.runners.join("watch/results/known");
    let repository = Repository::open(&results).expect("there are results");
    let inside = plan(&space(&domain, "", BUILT_IN));
    let (wires, mut tests) = (WireTable::new(&inside), 0);
    let table = MetricTable::new(&inside, &wires, &[]).expect("the metrics need no hooks");
    for number in repository.numbers().expect("tests are listed") {
        let record = repository.test(number).expect("a test can be read");
        let external = &repository.plan().monitors[0];
        // The state at time zero is nobody's: the runner has not heard of any yet.
        let decisions = record.observation.monitors[0].decisions.iter().skip(1);
        let heard: Vec<(f64, &str)> = decisions.map(|it| (it.time, external.state_name(it.state))).collect();
        let mut decided: Vec<(f64, &str)> = Vec::new();
        let mut tell = |it: &Decided| decided.push((it.at.seconds(), inside.monitors[0].state_name(it.state)));
        let trace = results.join(format!("traces/T{number}.mcap"));
        feed_telling(&trace, &inside, &wires, &table, Some(&mut tell)).expect("a trace can be read");
        // Monitor and runner meet the nodes at different moments: what is heard first is what holds then. From there on
        // all is the same, but for a last decision whose message comes after the end.
        let (first, later) = heard.split_first().expect("the monitor is heard");
        let known = decided.iter().take_while(|(time, _)| *time <= first.0).count();
        assert_eq!(decided[known - 1].1, first.1, "T{number}: decided {decided:#?}\nheard {heard:#?}");
        let rest = &decided[known..];
        let same = rest
            .iter()
            .zip(later)
            .all(|(decided, heard)| decided.1 == heard.1 && (0.0..ON_ITS_WAY).contains(&(heard.0 - decided.0)));
        let as_many = rest.len() == later.len() || rest.len() == later.len() + 1;
        assert!(same && as_many, "T{number}: decided {decided:#?}\nheard {heard:#?}");
        assert!(heard.len() >= 5, "T{number}: it swings three times: {heard:?}");
        let lost = heard.iter().filter(|(_, state)| *state == "lost").count();
        assert_eq!(lost, usize::from(number == 1), "T{number}: it is told of the silence of the test: {heard:?}");
        tests += 1;
    }
    assert!(tests >= 2, "the reference run and the test");
}
