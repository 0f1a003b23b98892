//! One test, one run: relay, metrics and transport put together.

use std::time::Instant;

use sesame_plan::{CampaignPlan, Test};

use crate::fuzz::ChoiceError;
use crate::metric::MetricTable;
use crate::observation::{Observation, Outcome, WallTime};
use crate::relay::Relay;
use crate::simulator::Progress;
use crate::time::SimTime;
use crate::transport::{Transport, TransportError};
use crate::wire::WireTable;

/// Runs a test and reports what was observed. A failing simulator is an observation too, with what was seen until then;
/// only a test that does not fit the plan is an error.
pub fn evaluate(
    plan: &CampaignPlan,
    wires: &WireTable,
    metrics: &MetricTable<'_>,
    transport: &mut dyn Transport,
    test: &Test,
    simulator_seed: u64,
) -> Result<Observation, ChoiceError> {
    let started = Instant::now();
    let mut relay = Relay::new(plan, wires, test, metrics.start())?;
    let failure = drive(transport, &mut relay, simulator_seed, SimTime::from_seconds(plan.campaign.end_after)).err();
    let end = transport.now();
    let finished = relay.finish(end);
    let effect = finished.operations.iter().any(|operation| operation.counters.any_effect());
    let outcome = match failure {
        Some(error) => Outcome::Crash { message: error.to_string() },
        None if test.operations.is_empty() || effect => Outcome::Completed,
        None => Outcome::Void,
    };
    Ok(Observation {
        outcome,
        end: end.seconds(),
        operations: finished.operations,
        metrics: finished.metrics,
        messages: finished.messages,
        warnings: finished.warnings,
        wall: WallTime { run: started.elapsed().as_secs_f64() },
    })
}

fn drive(transport: &mut dyn Transport, relay: &mut Relay<'_>, seed: u64, end: SimTime) -> Result<(), TransportError> {
    transport.reset(seed, relay)?;
    while transport.advance(end, relay)? == Progress::Running {}
    Ok(())
}
