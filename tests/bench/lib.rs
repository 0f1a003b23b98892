//! What the benchmarks share: the plan of a small space with one topic of each kind, and ways through middleware.

pub mod ways;

use sesame_codegen::lower::lower;
use sesame_dsl::source::SourceMap;
use sesame_plan::CampaignPlan;

/// A space with a scalar topic, a message topic, and operations of every kind on the scalar one.
const SPACE: &str = r#"
space bench

system {
  simulator sim = in_process "sim::Sim" { crate "simulator"  step 1ms }
  message Zone { zone: text  level: real[mm]  object1: text  object2: text }
  topic command = "arm/command" : real[rad]
  topic zone    = "zones/Z1"    : Zone
}

metric fuzzing_time minimise = fuzzing_time()
metric level minimise default 0mm = last(zone.level)

operation jitter on command    = random offset [-0.3rad, 0.3rad]
operation shift  on zone.level = random offset [-5mm, 5mm]
operation lose   on command    = packet loss [0%, 100%]
operation lag    on command    = latency [0ms, 500ms] uniform
operation offset on command    = bias [-0.3rad, 0.3rad]
operation wander on command    = drift [-0.1rad/s, 0.2rad/s]
operation blur   on command    = noise [0rad, 0.1rad]
operation slip   on command    = random walk [0rad, 0.1rad]
operation gain   on command    = scale [50%, 160%]
operation hold   on command    = freeze
operation behind on command    = stale [0ms, 100ms]
operation bursts on command    = burst loss { enter [0%, 10%]  leave [20%, 80%] }
operation thin   on command    = rate limit [100Hz, 900Hz]
operation mix    on command    = reorder [0ms, 100ms]
operation twice  on command    = duplicate [1, 1]

campaign all {
  objectives fuzzing_time, level
  operations jitter, shift, lose, lag, offset, wander, blur, slip, gain, hold, behind, bursts, thin, mix, twice   1..5 per test
  search     nsga2 { population 10  evaluations 210  seed 42 }
  end        after 1000s
}
"#;

/// The plan of the space above.
pub fn plan() -> CampaignPlan {
    plan_of(SPACE)
}

/// The plan of the campaign `all` of a space.
pub fn plan_of(space: &str) -> CampaignPlan {
    let mut sources = SourceMap::new();
    let root = sources.add("bench.sesame", space);
    let analysis = sesame_dsl::analyse(&sources, root);
    let space = analysis.model.unwrap_or_else(|| panic!("the space is sound: {:?}", analysis.diagnostics));
    let campaign = space.campaign("all").expect("the space has the campaign");
    lower(&space, campaign, "bench.sesame", "bench").plan
}
