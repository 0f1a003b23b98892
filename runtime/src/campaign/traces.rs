//! Tests with their traces: which are kept, and where.
//!
//! A worker writes a trace into its own folder while the test runs. When the test has ended, and before its result is
//! recorded, the trace gets its name or is discarded: so a recorded test has its trace, and a trace whose test was not
//! recorded any more is replaced when `resume` runs that test again.

use std::path::Path;

use sesame_base::observation::{Observation, Outcome};
use sesame_plan::CampaignPlan;
#[cfg(feature = "mcap")]
use sesame_plan::Recorded;
use sesame_relay::evaluate::{Custom, Run, evaluate_tapped};
use sesame_relay::metric::MetricTable;
use sesame_relay::transport::Transport;
use sesame_relay::wire::WireTable;

use crate::campaign::executor::{Job, TraceRequest};

/// Name of a trace on its way, in its worker's folder.
#[cfg(feature = "mcap")]
const UNFINISHED: &str = "trace.unfinished";

/// Runs a test, and writes its trace if it is asked for. The second is why the trace could not be written.
pub(super) fn run(
    plan: &CampaignPlan,
    wires: &WireTable,
    metrics: &MetricTable<'_>,
    transport: &mut dyn Transport,
    job: &Job,
    directory: &Path,
    custom: &mut Custom<'_>,
) -> (Observation, Option<String>) {
    let Job { test, simulator_seed, withheld, lists_altered, .. } = job;
    let what = Run { test, simulator_seed: *simulator_seed, withheld, lists_altered: *lists_altered };
    let Some(request) = &job.trace else {
        let observed = evaluate_tapped(plan, wires, metrics, transport, &what, custom, None);
        return (observed.unwrap_or_else(|mismatch| Observation::crashed(mismatch.to_string())), None);
    };
    #[cfg(feature = "mcap")]
    {
        use sesame_recording::{Subject, TraceWriter};

        let subject = Subject { plan, number: job.number, test, simulator_seed: *simulator_seed };
        let mut writer = match TraceWriter::create(&directory.join(UNFINISHED), subject, wires) {
            Ok(writer) => writer,
            Err(error) => {
                return (Observation::crashed("there was no trace to write to".to_owned()), Some(error.to_string()));
            }
        };
        let observed = evaluate_tapped(plan, wires, metrics, transport, &what, custom, Some(&mut writer));
        let observation = observed.unwrap_or_else(|mismatch| Observation::crashed(mismatch.to_string()));
        let settled = if is_kept(plan, request.keep, &observation) {
            writer.keep(&observation, &request.file).map_err(|error| error.to_string())
        } else {
            drop(writer);
            discard(&request.file)
        };
        (observation, settled.err())
    }
    #[cfg(not(feature = "mcap"))]
    {
        let _ = (request, directory);
        (Observation::crashed("there was no trace to write to".to_owned()), Some(NOT_BUILT_IN.to_owned()))
    }
}

/// Saves what a worker that died wrote of a trace. The error says why that is not possible.
pub(super) fn save(request: &TraceRequest, directory: &Path, outcome: &Outcome) -> Result<(), String> {
    #[cfg(feature = "mcap")]
    {
        sesame_recording::recover(&directory.join(UNFINISHED), outcome, &request.file)
            .map_err(|error| error.to_string())
    }
    #[cfg(not(feature = "mcap"))]
    {
        let _ = (request, directory, outcome);
        Err(NOT_BUILT_IN.to_owned())
    }
}

#[cfg(not(feature = "mcap"))]
const NOT_BUILT_IN: &str = "this runner was built without traces: run `sesamec generate` again";

#[cfg(feature = "mcap")]
fn is_kept(plan: &CampaignPlan, keep: Recorded, observation: &Observation) -> bool {
    use sesame_record::{Verdict, verdict};

    let failed = !observation.outcome.is_whole();
    let violated = || {
        plan.requirements.iter().any(|requirement| {
            verdict(requirement.bound, &observation.outcome, observation.value(requirement.metric)) == Verdict::Violated
        })
    };
    keep == Recorded::All || failed || violated()
}

/// Removes what an interrupted session left of a test that comes out another way now.
#[cfg(feature = "mcap")]
fn discard(file: &Path) -> Result<(), String> {
    match std::fs::remove_file(file) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(format!("cannot remove an old trace: {error}: {}", file.display()))
        }
        _ => Ok(()),
    }
}
