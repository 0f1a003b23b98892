//! The cell of two arms in lock-step: equal tests give equal runs, bit for bit, and an undisturbed run is what a driver
//! without Sesame sees.

use std::ffi::OsString;
use std::path::Path;

use sesame_base::observation::Outcome;
use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, NodeId, Test};
use sesame_relay::relay::Listener;
use sesame_relay::value::Value;
use sesame_relay::wire::{Wire, WireTable};
use sesame_tests::workspace;

use crate::environment::{Domain, Vendor};
use crate::peer::Peer;
use crate::relaying::{System, plans};

/// The distances that the cell measures, as bits.
struct Distances {
    wire: Wire,
    bits: Vec<String>,
}

impl Listener for Distances {
    fn published(&mut self, _: SimTime, wire: Wire, _: u64, value: &Value) {
        if wire == self.wire {
            let distance = value.number_at(&["data"]).expect("a distance is a number");
            self.bits.push(format!("{:016x}", distance.to_bits()));
        }
    }

    fn delivered(&mut self, _: SimTime, _: Wire, _: u64, _: &Value) {}
}

/// The plan of a campaign of the example in a domain. The test starts the nodes: only a runner can keep programs.
fn cell(domain: &Domain, campaign: &str) -> CampaignPlan {
    let file = workspace().join("examples/iiwa_cell/iiwa_cell.sesame");
    let text = std::fs::read_to_string(&file).expect("the example is there");
    let text = text.replace("domain 40", &format!("domain {}", domain.number));
    let plans = plans(&file.display().to_string(), &text);
    let found = plans.into_iter().find(|plan| plan.campaign.name == campaign);
    found.unwrap_or_else(|| panic!("there is no campaign `{campaign}`"))
}

/// Starts the nodes of a plan, each remapped as it says, and takes their launches out of it.
fn nodes(plan: &mut CampaignPlan, python: &Path, domain: &Domain) -> Vec<Peer> {
    let folder = workspace().join("examples/iiwa_cell");
    let ids = (0u32..).map(NodeId).take(plan.nodes.len());
    let remapped: Vec<Vec<String>> = ids.map(|id| plan.ros_args(Some(id))).collect();
    let mut started = Vec::new();
    for (node, remapped) in plan.nodes.iter_mut().zip(remapped) {
        let Some(launch) = node.launch.take() else { continue };
        let mut words = launch.command.arguments.iter();
        let program = words.next().expect("a Python is started with a program");
        let words = words.flat_map(|word| if word == "{ros-args}" { remapped.clone() } else { vec![word.clone()] });
        let words: Vec<OsString> = words.map(OsString::from).collect();
        started.push(Peer::start_in(&folder, python, domain, program, &words));
    }
    started
}

fn distances(system: &mut System, plan: &CampaignPlan, test: &Test) -> Vec<String> {
    let wire = WireTable::new(plan).find("/cell/distance").expect("the cell measures it");
    let mut distances = Distances { wire, bits: Vec::new() };
    let (observation, notes) = system.run_tapped(test, Some(&mut distances));
    assert!(matches!(observation.outcome, Outcome::Completed), "{:?} {notes:?}", observation.outcome);
    distances.bits
}

#[test]
fn undisturbed_runs_are_equal_and_what_a_driver_without_sesame_sees() {
    let Some(python) = Vendor::Kilted.python() else { return };
    let domain = Domain::free();
    let mut plan = cell(&domain, "by_time");
    plan.campaign.end_after = 6.0;
    let peers = nodes(&mut plan, &python, &domain);
    let mut system = System::new(plan.clone());
    let [first, second] = [(); 2].map(|()| distances(&mut system, &plan, &Test::default()));
    assert_eq!(first.len(), 300);
    assert_eq!(first, second);
    drop((system, peers));

    let domain = Domain::free();
    let arguments = ["iiwa_cell", "--relay", "--seconds", "6", "--list", "/cell/distance"];
    let driver = Peer::start_in(&workspace().join("tests/ros2"), &python, &domain, "drive.py", &arguments);
    let driven = driver.expect();
    let driven: Vec<&str> =
        driven["values"].as_array().into_iter().flatten().filter_map(|bits| bits.as_str()).collect();
    assert_eq!(first, driven);
}

#[test]
fn an_arm_that_believes_to_be_elsewhere_comes_close_to_the_other_and_always_equally_close() {
    let Some(python) = Vendor::Kilted.python() else { return };
    let domain = Domain::free();
    let mut plan = cell(&domain, "repeated");
    plan.campaign.end_after = 6.0;
    let peers = nodes(&mut plan, &python, &domain);
    let mut system = System::new(plan.clone());
    let [known] = &plan.tests[..] else { panic!("one test is repeated: {:?}", plan.tests) };
    let [first, second] = [(); 2].map(|()| distances(&mut system, &plan, &known.test));
    assert_eq!(first, second);
    let closest = first.iter().map(|bits| f64::from_bits(u64::from_str_radix(bits, 16).expect("they are digits")));
    let closest = closest.fold(f64::INFINITY, f64::min);
    assert!((0.0..=0.04).contains(&closest), "{closest} m");
    drop((system, peers));
}
