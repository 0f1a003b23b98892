//! Replays against the truth: robots and an object in a simulator that runs behind the real relay, recorded with all of
//! them there and with one of them missing. The recordings go through the functions of the command.

use std::path::Path;

use sesame_plan::{CampaignPlan, Test};
use sesame_runtime::evaluate::{Custom, Run, evaluate_tapped};
use sesame_runtime::metric::MetricTable;
use sesame_runtime::rng::Stream;
use sesame_runtime::simulator::{Bus, Port, Progress, Setup, Simulator, SimulatorError};
use sesame_runtime::trace::{Subject, TraceWriter};
use sesame_runtime::transport::in_process;
use sesame_runtime::value::{Fields, Record, Value};
use sesame_runtime::wire::WireTable;
use sesame_safety::Vector;
use sesame_safety::coupling::{Coupling, Evidence};

use super::contacts::{found, sentences, signals};
use super::replay::{Alike, Meeting, Recorded, reads_the_other, recorded};
use crate::frontend::{Look, SESAME};

/// A step of the simulator, in seconds.
const STEP: f64 = 0.02;
/// The radius of each robot, in metres.
const RADIUS: f64 = 0.3;
/// How fast robots drive, in metres per second.
const SPEED: f64 = 1.5;
/// Half of the edges of the object, in metres.
const HALF: [f64; 3] = [0.4, 0.25, 0.5];
/// Where a parked robot stands, in metres.
const PARKED: Vector = Vector::new(40.0, 0.0, 0.0);
/// A careful robot waits while the other one is nearer than this, in metres.
const CAREFUL: f64 = 1.2;

/// Who is in a run.
const BOTH: u8 = 0;
const ONE_ALONE: u8 = 1;
const TWO_ALONE: u8 = 2;
const ONE_AND_OBJECT: u8 = 3;

/// Two robots that drive from goal to goal, and an object in the origin. What touches stands for the rest of the run.
struct Field<const PRESENT: u8, const IS_CAREFUL: bool> {
    positions: [Vector; 2],
    goals: [Vec<Vector>; 2],
    /// Where the first robot last heard the second one to be.
    heard: Option<Vector>,
    touched: bool,
    poses: [Port; 2],
    touches: Port,
}

/// Where a robot of this run starts and drives to: the same in every run with this seed.
fn goals(seed: u64, robot: u64) -> Vec<Vector> {
    let mut stream = Stream::derive(seed, "robot", &[robot]);
    let mut between = |most: f64| stream.uniform(-most, most);
    let mut goals: Vec<Vector> = (0..5).map(|_| Vector::new(between(2.0), between(2.0), between(0.2))).collect();
    // Nothing touches in the beginning.
    goals[0] = Vector::new(if robot == 1 { -2.5 } else { 2.5 }, goals[0].y, goals[0].z);
    goals
}

impl<const PRESENT: u8, const IS_CAREFUL: bool> Field<PRESENT, IS_CAREFUL> {
    fn moves(robot: usize) -> bool {
        match PRESENT {
            BOTH => true,
            TWO_ALONE => robot == 1,
            _ => robot == 0,
        }
    }

    fn publish(&self, bus: &mut Bus<'_>) {
        let fields = Fields::new(["position"]);
        for (port, position) in self.poses.iter().zip(self.positions) {
            let millimetres = (position * 1000.0).to_array();
            bus.publish(*port, Value::from(Record::new(&fields, vec![Value::Point(millimetres)])));
        }
    }
}

impl<const PRESENT: u8, const IS_CAREFUL: bool> Simulator for Field<PRESENT, IS_CAREFUL> {
    fn start(setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        let mut all = [1, 2].map(|robot| goals(setup.seed, robot));
        let positions = [0, 1].map(|robot| {
            let start = all[robot].remove(0);
            if Self::moves(robot) { start } else { PARKED }
        });
        let poses = ["robots/one/pose", "robots/two/pose"].map(|path| bus.open(path));
        bus.subscribe(poses[1]);
        let field = Field { positions, goals: all, heard: None, touched: false, poses, touches: bus.open("touches") };
        field.publish(bus);
        Ok(field)
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        while let Some(message) = bus.receive(self.poses[1]) {
            let Value::Record(record) = message else { return Err(SimulatorError("no pose".to_owned())) };
            if let [Value::Point(millimetres)] = record.values() {
                self.heard = Some(Vector::from_array(*millimetres) / 1000.0);
            }
        }
        for robot in 0..2 {
            let near = self.heard.is_some_and(|heard| (heard - self.positions[0]).length() < CAREFUL);
            let waits = IS_CAREFUL && robot == 0 && near;
            let Some(&goal) = self.goals[robot].first() else { continue };
            if self.touched || waits || !Self::moves(robot) {
                continue;
            }
            let way = goal - self.positions[robot];
            if way.length() <= SPEED * STEP {
                self.positions[robot] = goal;
                self.goals[robot].remove(0);
            } else {
                self.positions[robot] += way.normalize() * (SPEED * STEP);
            }
        }
        self.publish(bus);
        let [one, other] = self.positions;
        let half = Vector::from_array(HALF);
        let into_object = (one - one.clamp(-half, half)).length();
        let touches = match PRESENT {
            BOTH => (one - other).length() <= 2.0 * RADIUS,
            ONE_AND_OBJECT => into_object <= RADIUS,
            _ => false,
        };
        if touches && !self.touched {
            self.touched = true;
            bus.publish(self.touches, bus.now().seconds());
        }
        Ok(Progress::Running)
    }
}

/// A space of the two robots; the first one reads the second one's pose if `careful`.
fn plan(careful: bool) -> CampaignPlan {
    let reads = if careful { "subscribes two" } else { "" };
    let text = format!(
        "space field\nsystem {{\n  simulator field = in_process \"field::Field\" {{ crate \"field\"  step 20ms }}\n  \
         message Pose {{ position: point[mm] }}\n  topic one = \"robots/one/pose\" : Pose\n  topic two = \
         \"robots/two/pose\" : Pose\n  topic touches = \"touches\" : real[s]\n  node first {{ publishes one, touches  \
         {reads} }}\n  node second {{ publishes two }}\n}}\nmetric first_touch default 999s = last(touches)\n\
         metric apart maximise default 99m = min(distance(one.position, two.position))\n\
         requirement R1 \"They keep apart\" = first_touch > 100s\n\
         campaign watch {{ passive 1 times  observes apart  end after 5s }}\n\
         physical yard {{\n  shape one = sphere 300mm on pose \"robots/one/pose\"   expand 100mm\n  \
         shape two = sphere 30cm on pose \"robots/two/pose\"\n  \
         shape crate_ = box (0.8, 0.5, 1)m at (0, 0, 0)m\n}}\n"
    );
    let checked = (SESAME.check)("field.sesame", &text, Look::Human { colour: false });
    assert_eq!(checked.errors, 0, "{}", checked.diagnostics);
    checked.plans.into_iter().next().unwrap().plan
}

/// A run behind the relay, recorded into a file; gives when the simulator saw a touch.
fn run<S: Simulator + 'static>(plan: &CampaignPlan, seed: u64, file: &Path) -> Option<f64> {
    let wires = WireTable::new(plan);
    let table = MetricTable::new(plan, &wires, &[]).unwrap();
    let test = Test { operations: Vec::new() };
    let subject = Subject { plan, number: 1, test: &test, simulator_seed: seed };
    let mut writer = TraceWriter::create(&file.with_extension("part"), subject, &wires).unwrap();
    let mut transport = in_process::<S>().transport(plan);
    let run = Run { test: &test, simulator_seed: seed, withheld: &[], lists_altered: false };
    let transport = transport.as_mut();
    let observed =
        evaluate_tapped(plan, &wires, &table, transport, &run, &mut Custom::none(), Some(&mut writer)).unwrap();
    writer.keep(&observed, file).unwrap();
    let touch = plan.metrics.iter().position(|metric| metric.name == "first_touch").unwrap();
    observed.metrics[touch].value.filter(|_| observed.metrics[touch].set)
}

const ALIKE: Alike = Alike { position: 0.001, angle: 0.001 };

/// The shapes of the lab, those of the second recording from there.
fn shapes(plan: &CampaignPlan, recordings: &[&Path], names: &[&str], second: &[&str]) -> Vec<Recorded> {
    let signals: Vec<_> = recordings.iter().map(|file| signals(plan, file).unwrap()).collect();
    let shapes = plan.labs[0].shapes.iter().filter(|shape| names.contains(&shape.name.as_str()));
    let of = |name: &str| usize::from(second.contains(&name));
    shapes.map(|shape| recorded(plan, shape, (of(&shape.name), &signals[of(&shape.name)], 0.0)).unwrap()).collect()
}

/// A replay agrees with what the simulator saw at its steps: it finds each contact, at most a step before the step
/// that shows it, unless the contact was a brush between two steps.
fn agrees(meeting: &Meeting, seen: Option<f64>, seed: u64) {
    let intervals = &meeting.contacts.intervals;
    match (intervals.first(), seen) {
        (Some(first), Some(seen)) => {
            assert!(first.from <= seen + 1e-6, "{seed}: {} {seen}", first.from);
            let brush = first.to < seen - 1e-6;
            assert!(brush || seen - first.from <= STEP + 1e-4, "{seed}: {intervals:?} {seen}");
        }
        // Between two steps, robots come nearer by no more than what both drive in half of one.
        (Some(_), None) => assert!(meeting.contacts.nearest.clearance >= -SPEED * STEP, "{seed}: {meeting:?}"),
        (None, seen) => assert_eq!(seen, None, "{seed}: {meeting:?}"),
    }
}

#[test]
fn robots_recorded_one_at_a_time_touch_when_they_do_together() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let plan = plan(false);
    let mut touched = 0;
    for seed in 0..100 {
        let [one, two, both] = ["one.mcap", "two.mcap", "both.mcap"].map(file);
        assert_eq!(run::<Field<ONE_ALONE, false>>(&plan, seed, &one), None);
        assert_eq!(run::<Field<TWO_ALONE, false>>(&plan, seed, &two), None);
        let seen = run::<Field<BOTH, false>>(&plan, seed, &both);
        touched += usize::from(seen.is_some());

        let alone = shapes(&plan, &[&one, &two], &["one", "two"], &["two"]);
        let apart = found(&plan, &alone, None, ALIKE).unwrap();
        let [meeting] = &apart[..] else { panic!("{apart:?}") };
        assert_eq!(meeting.coupling, Some(Coupling::Independent(Evidence::Messages)), "{seed}");
        agrees(meeting, seen, seed);
        // The margin of 100 mm is touched no later.
        assert!(meeting.contacts.first().is_none_or(|first| meeting.margins_touch.is_some_and(|touch| touch <= first)));

        let together = shapes(&plan, &[&both], &["one", "two"], &[]);
        let compared = found(&plan, &alone, Some(&together), ALIKE).unwrap();
        let coupling = compared[0].coupling.as_ref().unwrap();
        assert!(coupling.method_holds(), "{seed}: {}", coupling.sentence());
        assert!(matches!(coupling, Coupling::Independent(Evidence::Motion(_))));
    }
    assert!((20..=80).contains(&touched), "{touched} of 100 touch: the test shows little");
}

#[test]
fn a_robot_recorded_without_an_object_touches_it_when_it_does_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let plan = plan(false);
    let mut touched = 0;
    for seed in 0..100 {
        let [without, with] = ["without.mcap", "with.mcap"].map(file);
        run::<Field<ONE_ALONE, false>>(&plan, seed, &without);
        let seen = run::<Field<ONE_AND_OBJECT, false>>(&plan, seed, &with);
        touched += usize::from(seen.is_some());
        let [alone, together] = [&without, &with].map(|file| shapes(&plan, &[file], &["one", "crate_"], &[]));
        let compared = found(&plan, &alone, Some(&together), ALIKE).unwrap();
        agrees(&compared[0], seen, seed);
        let coupling = compared[0].coupling.as_ref().unwrap();
        assert!(coupling.method_holds(), "{seed}: {}", coupling.sentence());
        // Without a run in which the object was there, nobody knows.
        let unknown = found(&plan, &alone, None, ALIKE).unwrap();
        assert!(matches!(unknown[0].coupling, Some(Coupling::Unknown(_))));
    }
    assert!((20..=95).contains(&touched), "{touched} of 100 touch: the test shows little");
}

#[test]
fn a_robot_that_waits_for_the_other_is_coupled() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let plan = plan(true);
    let mut coupled = 0;
    for seed in 0..100 {
        let [one, two, both] = ["one.mcap", "two.mcap", "both.mcap"].map(file);
        run::<Field<ONE_ALONE, true>>(&plan, seed, &one);
        run::<Field<TWO_ALONE, true>>(&plan, seed, &two);
        let seen = run::<Field<BOTH, true>>(&plan, seed, &both);
        let alone = shapes(&plan, &[&one, &two], &["one", "two"], &["two"]);
        // By what it reads it is always coupled, and the sentence says so.
        let apart = found(&plan, &alone, None, ALIKE).unwrap();
        assert_eq!(apart[0].coupling, Some(Coupling::Coupled(Evidence::Messages)));
        assert!(sentences(&apart)[0].ends_with("The method does not hold."), "{:?}", sentences(&apart));

        // By how it moves it is coupled exactly if it waited, which is in the recordings.
        let together = shapes(&plan, &[&both], &["one", "two"], &[]);
        let until = seen.unwrap_or(f64::INFINITY) - STEP;
        let [alone_one, together_one] = [&alone, &together].map(|shapes| shapes[0].trace().unwrap());
        let pairs = together_one.times().iter().zip(alone_one.positions().iter().zip(together_one.positions()));
        let waited = pairs.into_iter().any(|(&time, (alone, both))| time < until && (*alone - *both).length() > 0.001);
        let compared = found(&plan, &alone, Some(&together), ALIKE).unwrap();
        let coupling = compared[0].coupling.as_ref().unwrap();
        assert_eq!(coupling.method_holds(), !waited, "{seed}: {}", coupling.sentence());
        if waited {
            assert!(matches!(coupling, Coupling::Coupled(Evidence::Motion(_))), "{seed}: {coupling:?}");
            coupled += 1;
        } else {
            agrees(&compared[0], seen, seed);
        }
    }
    assert!((10..=95).contains(&coupled), "{coupled} of 100 waited: the test shows little");
}

#[test]
fn what_robots_read_through_others_counts_and_a_node_that_publishes_both_says_nothing() {
    let with_nodes = |nodes: &str| {
        let text = format!(
            "space field\nsystem {{\n  simulator field = in_process \"field::Field\" {{ crate \"field\"  step 20ms }}\n  \
             topic one = \"one\" : point[m]\n  topic two = \"two\" : point[m]\n  topic plan = \"plan\" : real\n  \
             {nodes}\n}}\nmetric along minimise default 0m = last(one.x)\ncampaign watch {{ passive 1 times  observes along  end \
             after 5s }}\n"
        );
        let checked = (SESAME.check)("field.sesame", &text, Look::Human { colour: false });
        assert_eq!(checked.errors, 0, "{}", checked.diagnostics);
        reads_the_other(&checked.plans[0].plan, "one", "two")
    };
    let through = "node a { publishes one  subscribes plan }\n  node planner { publishes plan  subscribes two }\n  \
                   node b { publishes two }";
    assert_eq!(with_nodes(through), Some(true));
    assert_eq!(with_nodes("node a { publishes one  subscribes plan }\n  node b { publishes two }"), Some(false));
    assert_eq!(with_nodes("node tracking { publishes one, two }"), None);
    assert_eq!(with_nodes("node a { publishes one }"), None, "nobody says who publishes the other");
}
