//! `replay-recording`: metrics fed from a recording, so that hooks are developed without a simulator.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

#[cfg(feature = "mcap")]
use sesame_plan::CampaignPlan;

use crate::cli::failure::Failure;
use crate::cli::session::Session;
use crate::cli::terminal::Format;

/// Which recording is fed.
#[derive(Debug, Args)]
pub struct ReplayRecordingArgs {
    /// The recording, for example `results/42/traces/T17.mcap`: MCAP, `.db3` or a folder of rosbag2, or a `.bag` of
    /// ROS 1
    #[arg(value_name = "FILE")]
    recording: PathBuf,
    /// The format of the results
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

#[cfg(not(feature = "mcap"))]
pub(super) fn replay_recording(session: &Session, args: &ReplayRecordingArgs) -> Result<ExitCode, Failure> {
    let ReplayRecordingArgs { recording, format: _ } = args;
    Err(Failure(format!(
        "the runner of `{}` was built without the feature `mcap` of sesame-runtime, so it cannot read {}",
        session.plan.campaign.name,
        recording.display()
    )))
}

#[cfg(feature = "mcap")]
pub(super) fn replay_recording(session: &Session, args: &ReplayRecordingArgs) -> Result<ExitCode, Failure> {
    use std::panic::{self, AssertUnwindSafe};

    use sesame_base::gathered::gathered;
    use sesame_recording as trace;
    use sesame_relay::metric::MetricTable;
    use sesame_relay::panic_capture;
    use sesame_relay::wire::WireTable;
    use sesame_report::recording_text;

    use super::execution::refuse_unfilled;
    use super::failure::NOT_AS_REQUIRED;
    use super::terminal::{print, print_json, say, text_options};

    let Session { runner, plan, .. } = session;
    #[cfg(feature = "process")]
    if let Some(python) = session.program.python() {
        return Err(Failure(format!(
            "`replay-recording` feeds metrics in this process, and {} is Python, which runs in workers: run a campaign that \
             measures them, or use formulas",
            python.file.as_deref().unwrap_or("their code")
        )));
    }
    refuse_unfilled(session, plan, true)?;
    let wires = WireTable::new(plan);
    let table = MetricTable::new(plan, &wires, runner.hooks)?;
    panic_capture::install();
    let fed = AssertUnwindSafe(|| trace::feed(&args.recording, plan, &wires, &table));
    let fed = panic::catch_unwind(fed)
        .map_err(|_| Failure(format!("a hook cannot take this recording: {}", panic_capture::take())))??;
    let replay = compared(plan, args, fed);
    for warning in gathered(&replay.warnings) {
        say(format_args!("warning: {warning}"));
    }
    match args.format {
        Format::Text => print(&recording_text(&replay, text_options()))?,
        Format::Json => print_json(&replay)?,
    };
    Ok(ExitCode::from(if replay.same { 0 } else { NOT_AS_REQUIRED }))
}

/// What metrics are now, compared with what was recorded.
#[cfg(feature = "mcap")]
fn compared(
    plan: &CampaignPlan,
    args: &ReplayRecordingArgs,
    fed: sesame_recording::Fed,
) -> sesame_report::RecordingReplay {
    use sesame_base::visible::visible;
    use sesame_record::MetricValue;
    use sesame_report::{FedMetric, RecordingReplay, Sameness};

    let recorded = fed.run.as_ref().map_or(&[][..], |run| &run.metrics);
    let metrics: Vec<FedMetric> = plan
        .metrics
        .iter()
        .zip(&fed.metrics)
        .map(|(metric, now)| {
            let before = recorded.iter().find(|recorded| recorded.name == metric.name);
            let sameness = match before {
                None => Sameness::NotRecorded,
                Some(before) if before.value.map(f64::to_bits) == now.value.map(f64::to_bits) => Sameness::Equal,
                Some(_) => Sameness::Differs,
            };
            FedMetric {
                metric: metric.name.clone(),
                unit: metric.unit.clone(),
                now: MetricValue::from(now),
                recorded: before.and_then(|before| before.value),
                sameness,
            }
        })
        .collect();
    RecordingReplay {
        recording: args.recording.clone(),
        run: fed.run.as_ref().map(|run| visible(&format!("{} of {} ({})", run.test, run.campaign, run.outcome))),
        messages: fed.messages,
        same: metrics.iter().all(|metric| metric.sameness != Sameness::Differs),
        metrics,
        warnings: fed.warnings,
    }
}
