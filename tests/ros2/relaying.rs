//! A runner between peers, in this process: a space as text, and its system driven by hand or by whole runs.

use std::path::PathBuf;

use sesame_base::observation::Observation;
use sesame_base::time::SimTime;
use sesame_codegen::frontend::{Look, SESAME};
use sesame_plan::{CampaignPlan, Test};
use sesame_relay::evaluate::{Custom, Run, evaluate_tapped};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::{Finished, Listener, Relay};
use sesame_relay::transport::Transport;
use sesame_relay::transport::added::AddedOnWire;
use sesame_relay::wire::WireTable;
use sesame_tests::workspace;

use crate::environment::Domain;

/// The plan of the only campaign in this text.
pub(crate) fn plan(text: &str) -> CampaignPlan {
    let [plan] = &plans("peers.sesame", text)[..] else { panic!("there is one campaign") };
    plan.clone()
}

/// The plans of all campaigns in the text of a file.
pub(crate) fn plans(file: &str, text: &str) -> Vec<CampaignPlan> {
    let checked = (SESAME.check)(file, text, Look::Short);
    assert_eq!(checked.errors, 0, "{text}\n{}", checked.diagnostics);
    checked.plans.into_iter().map(|runner| runner.plan).collect()
}

/// A space in which one topic, `/peer`, is cut, with declarations of nodes and operations, of which one may be named
/// `lost`. A run ends after `seconds`. A node named `clock` makes it one with a clock.
pub(crate) fn space(domain: &Domain, kind: &str, nodes: &str, operations: &str, seconds: u32) -> String {
    format!(
        "space peers\n\
         system {{\n\
           simulator peers = ros2 {{ domain {domain}  {clock} }}\n\
           message Peer = \"{kind}\" {fields}\n\
           topic peer = \"/peer\" : Peer\n\
           {nodes}\n\
         }}\n\
         metric disturbed minimise = fuzzing_time()\n\
         operation hole on peer = blackhole\n\
         {operations}\n\
         campaign look {{\n\
           objectives disturbed\n\
           operations hole{more}   1 per test\n\
           search     random {{ evaluations 1 }}\n\
           end        after {seconds}s\n\
         }}\n",
        domain = domain.number,
        clock = if nodes.contains("clock") { "clock \"/clock\"" } else { "" },
        more = if operations.contains("lost") { ", lost" } else { "" },
        fields = fields(kind),
    )
}

/// The layout of a message of the peers, in the language.
fn fields(kind: &str) -> &'static str {
    match kind {
        "std_msgs/msg/String" => "{ data: text }",
        "std_msgs/msg/Float64" => "{ data: real }",
        "geometry_msgs/msg/PointStamped" => {
            "{ header: Header  point: point }\n\
             message Header = \"std_msgs/msg/Header\" { stamp: real[s]  frame_id: text }"
        }
        "sensor_msgs/msg/JointState" => {
            "{ header: Header  name: list of text  position: list of real  velocity: list of real  effort: list of real }\n\
             message Header = \"std_msgs/msg/Header\" { stamp: real[s]  frame_id: text }"
        }
        _ => "",
    }
}

/// A system of peers with the runner between them.
pub(crate) struct System {
    plan: CampaignPlan,
    transport: Box<dyn Transport>,
}

impl System {
    pub(crate) fn new(plan: CampaignPlan) -> Self {
        System::in_folder(plan, workspace().join("tests/ros2"))
    }

    /// One whose plan names files in a folder.
    pub(crate) fn in_folder(plan: CampaignPlan, folder: PathBuf) -> Self {
        let connect = match &plan.simulator.transport {
            sesame_plan::Transport::Rosbridge(_) => sesame_rosbridge::rosbridge(folder),
            _ => sesame_ros2::ros2(folder),
        };
        let transport = connect.transport(&plan);
        System { plan, transport }
    }

    /// A whole run of a test, as campaigns make them, and what the transport noted.
    pub(crate) fn run(&mut self, test: &Test) -> (Observation, Vec<String>) {
        self.run_tapped(test, None)
    }

    /// How long messages were kept since it was asked last.
    pub(crate) fn added(&mut self) -> Vec<AddedOnWire> {
        self.transport.added()
    }

    /// The same, with somebody who listens.
    pub(crate) fn run_tapped(&mut self, test: &Test, tap: Option<&mut dyn Listener>) -> (Observation, Vec<String>) {
        let wires = WireTable::new(&self.plan);
        let metrics = MetricTable::new(&self.plan, &wires, &[]).expect("the metrics need no hooks");
        let (transport, custom) = (&mut *self.transport, &mut Custom::none());
        let run = Run { test, simulator_seed: 1, withheld: &[] };
        let run = evaluate_tapped(&self.plan, &wires, &metrics, transport, &run, custom, tap);
        (run.expect("the test fits the plan"), self.transport.incidents().notes)
    }

    /// A run that lasts until something holds, which is asked every 50 ms. `ready` is called when the
    /// system is complete.
    pub(crate) fn relay_until(
        &mut self,
        test: &Test,
        mut ready: impl FnMut(),
        mut done: impl FnMut() -> bool,
    ) -> Finished {
        let wires = WireTable::new(&self.plan);
        let metrics = MetricTable::new(&self.plan, &wires, &[]).expect("the metrics need no hooks");
        let mut relay = Relay::new(&self.plan, &wires, test, metrics.start(), &[]).expect("the test fits the plan");
        relay.begin();
        self.transport.reset(1, &mut relay).unwrap_or_else(|error| panic!("{error}"));
        ready();
        while !done() {
            let until = self.transport.now() + SimTime::from_nanos(50_000_000);
            while self.transport.now() < until {
                self.transport.advance(until, &mut relay).unwrap_or_else(|error| panic!("{error}"));
            }
        }
        relay.finish(self.transport.now())
    }

    /// Begins a run, which is to fail: how.
    pub(crate) fn reset(&mut self) -> String {
        let wires = WireTable::new(&self.plan);
        let metrics = MetricTable::new(&self.plan, &wires, &[]).expect("the metrics need no hooks");
        let test = Test::default();
        let mut relay = Relay::new(&self.plan, &wires, &test, metrics.start(), &[]).expect("the test fits the plan");
        relay.begin();
        self.transport.reset(1, &mut relay).expect_err("the system is not complete").to_string()
    }

    pub(crate) fn plan(&self) -> &CampaignPlan {
        &self.plan
    }

    /// What the transport noted since the last call, without who has left: peers leave when they have done their part.
    pub(crate) fn notes(&mut self) -> Vec<String> {
        let mut notes = self.all_notes();
        notes.retain(|note| !note.contains("` no longer "));
        notes
    }

    /// What the transport noted since the last call.
    pub(crate) fn all_notes(&mut self) -> Vec<String> {
        self.transport.incidents().notes
    }
}
