//! A monitor as a node of its own beside real nodes: what it publishes is what the runner's own monitor decides on the
//! same recording.

use std::fs;
use std::path::PathBuf;

use sesame_record::Repository;
use sesame_recording::feed_telling;
use sesame_relay::metric::MetricTable;
use sesame_relay::monitor::Decided;
use sesame_relay::wire::WireTable;
use sesame_tests::{Project, fresh_folder, workspace};

use crate::environment::{Domain, Vendor};
use crate::relaying::plan;

/// What a message needs on its way from the monitor to the runner at most, in seconds, on a machine that has nothing
/// else to do.
const ON_ITS_WAY: f64 = 0.5;

const BUILT_IN: &str = "eddi upright publishes state {
  evidence  there = angle.data > -2 stale after 2s is unknown
  evidence  high  = angle.data > 0.3 held 50ms stale after 2s is false
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
metric level     initial 0 = last(state.data)
metric moved     initial 0 = count(state.data == 1)
operation silence on angle = blackhole
operation lie     on state = packet loss [0%, 100%]
/// How long nodes need to find each other, and the monitor to miss something, depends on what else the machine does.
test silent {{ silence when level > 0 until level == 0 }}
campaign watch {{
  objectives disturbed
  operations silence, lie 1..2 per test
  search     random {{ evaluations 1 }}
  end        after 120s or when moved > 3
  record     mcap all
}}
"#,
        domain.number
    )
}

/// The program of the monitor, generated from a space in which the runner would run it, and built.
fn built(name: &str, domain: &Domain) -> PathBuf {
    let folder = fresh_folder(&format!("{name}_inside"));
    let project = Project { space: folder.join("swing.sesame"), runners: folder.join("runners"), folder };
    fs::write(&project.space, space(domain, "", BUILT_IN)).expect("a space can be written");
    project.monitor("upright")
}

/// The simulation time in seconds at which a monitor changed its state, and the new state.
type Moment = (f64, String);

/// What a monitor came to in a test: what the runner's own decides on the recording of it, and what the runner heard of
/// the one beside the nodes.
struct Watched {
    number: u32,
    decided: Vec<Moment>,
    heard: Vec<Moment>,
}

/// Runs the reference run and a test with a monitor beside real nodes.
fn watched(name: &str) -> Option<Vec<Watched>> {
    let python = Vendor::Kilted.python()?;
    let domain = Domain::free();
    let (program, talker) = (built(name, &domain), workspace().join("tests/ros2/peers/talker.py"));
    let nodes = format!(
        r#"node talker {{ publishes angle  launch "{}" "{}" "{{ros-args}}" }}
  node guard  {{ publishes state  subscribes angle  launch "{}" "--domain" "{{domain}}" "{{ros-args}}" }}"#,
        python.display(),
        talker.display(),
        program.display()
    );
    let folder = fresh_folder(&format!("{name}_outside"));
    let project = Project { space: folder.join("swing.sesame"), runners: folder.join("runners"), folder };
    fs::write(&project.space, space(&domain, &nodes, EXTERNAL)).expect("a space can be written");
    project.sesamec("known", &["-c", "watch", "--workers", "1"]).expect(0);
    let results = project.runners.join("watch/results/known");
    let repository = Repository::open(&results).expect("there are results");
    let inside = plan(&space(&domain, "", BUILT_IN));
    let wires = WireTable::new(&inside);
    let table = MetricTable::new(&inside, &wires, &[]).expect("the metrics need no hooks");
    let numbers = repository.numbers().expect("tests are listed");
    assert!(numbers.len() >= 2, "the reference run and the test");
    let watched = numbers.into_iter().map(|number| {
        let record = repository.test(number).expect("a test can be read");
        let external = &repository.plan().monitors[0];
        // The state at time zero is nobody's: the runner has not heard of any yet.
        let decisions = record.observation.monitors[0].decisions.iter().skip(1);
        let heard = decisions.map(|decision| (decision.time, external.state_name(decision.state).to_owned())).collect();
        let mut decided = Vec::new();
        let mut tell = |told: &Decided| {
            decided.push((told.at.seconds(), inside.monitors[0].state_name(told.state).to_owned()));
        };
        let trace = results.join(format!("traces/T{number}.mcap"));
        feed_telling(&trace, &inside, &wires, &table, Some(&mut tell)).expect("a trace can be read");
        Watched { number, decided, heard }
    });
    Some(watched.collect())
}

impl Watched {
    /// How often it was heard to be lost after it had heard something.
    fn lost(&self) -> usize {
        let since = self.heard.iter().skip_while(|(_, state)| state == "lost");
        since.filter(|(_, state)| state == "lost").count()
    }

    /// Insists that all is heard that is decided, and gives how long each was on its way, in seconds.
    fn ways(&self) -> Vec<f64> {
        let Watched { number, decided, heard } = self;
        // Monitor and runner meet the nodes at different moments: what is heard first is what holds then, or what the
        // runner decides next. From there on all is the same, but for a last decision whose message comes after the
        // end, or which the runner would have made then.
        let from = heard.first().expect("the monitor is heard").0;
        let known = decided.iter().take_while(|(time, _)| *time <= from).count();
        let is_same = |rest: &[Moment]| {
            rest.iter().zip(heard).all(|(decided, heard)| decided.1 == heard.1) && rest.len().abs_diff(heard.len()) <= 1
        };
        let rest = decided.get(known - 1..).filter(|rest| is_same(rest)).or_else(|| decided.get(known..));
        let rest = rest.filter(|rest| is_same(rest));
        let rest = rest.unwrap_or_else(|| panic!("T{number}: decided {decided:#?}\nheard {heard:#?}"));
        // The first one was maybe decided long before it was heard.
        rest.iter().zip(heard).skip(1).map(|(decided, heard)| heard.0 - decided.0).collect()
    }
}

/// Nobody steps the nodes, and monitor and runner each hear the angle themselves. If the publisher rests for two
/// seconds on a busy machine, or one of them hears late of it, only one may take that for silence.
#[test]
fn a_monitor_beside_real_nodes_is_heard_and_notices_the_silence() {
    let Some(watched) = watched("ros2_monitor") else { return };
    for test in &watched {
        for (who, moments) in [("decided", &test.decided), ("heard", &test.heard)] {
            let moves = moments.iter().any(|(_, state)| state == "moves");
            assert!(moves, "T{}: the angle swings, {who}: {moments:?}", test.number);
        }
        assert!(test.number != 1 || test.lost() >= 1, "the monitor does not notice the silence: {:?}", test.heard);
    }
}

#[test]
#[ignore = "long: what a monitor hears, and when, depends on the load of the machine"]
fn what_a_monitor_beside_real_nodes_publishes_is_what_the_runner_decides_and_heard_within_half_a_second() {
    for test in watched("ros2_monitor_alone").into_iter().flatten() {
        let Watched { number, heard, .. } = &test;
        for way in test.ways() {
            assert!((0.0..ON_ITS_WAY).contains(&way), "T{number}: {way} s");
        }
        assert!(heard.len() >= 5, "T{number}: it swings three times: {heard:?}");
        assert_eq!(test.lost(), usize::from(*number == 1), "T{number}: only the test silences the angle: {heard:?}");
    }
}
