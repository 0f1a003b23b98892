//! What monitors hear in a recording.

use std::path::Path;
use std::sync::Arc;

use sesame_base::time::SimTime;
use sesame_monitor::Network;
use sesame_plan::{CampaignPlan, Side};
use sesame_relay::feed::End;
use sesame_relay::monitor::recorded::RecordedMonitors;
use sesame_relay::wire::WireTable;

use crate::error::RecordingError;
use crate::pass::{Ending, Read, RecordedRun, pass};
use crate::payload::Reads;

#[cfg(test)]
mod tests;

/// The most messages that monitors may hear in a recording; with more, memory could run out.
const MOST_HEARD: usize = 20_000_000;

/// Reads what the monitors of a plan hear in a recording, which [may be](crate::feed()) one that no runner made. With
/// it come the recorded run, if a runner recorded it, and warnings for the user. The network is that of the plan's
/// monitors.
///
/// What monitors publish has no effect here: it is in the recording.
pub fn monitors<'p>(
    path: &Path,
    plan: &'p CampaignPlan,
    wires: &'p WireTable,
    network: &Arc<Network>,
) -> Result<(RecordedMonitors<'p>, Option<RecordedRun>, Vec<String>), RecordingError> {
    let mut heard = RecordedMonitors::new(plan, wires, Arc::clone(network));
    let mut last = SimTime::ZERO;
    let Ending { run, end, mut warnings, .. } = pass(path, plan, wires, Reads::Used, &mut |read| {
        let Read::Message(message) = read else { return Ok(()) };
        last = message.time;
        for (side, is_so) in [(Side::Inbound, message.published), (Side::Outbound, message.delivered)] {
            if is_so {
                heard.add(message.time, side, message.wire, message.index, message.value);
            }
        }
        if heard.messages() > MOST_HEARD {
            let problem = format!("monitors hear more than {MOST_HEARD} messages in it");
            return Err(RecordingError::TooLong { problem, path: path.to_owned() });
        }
        Ok(())
    })?;
    heard.end(match end {
        End::Whole(end) => end,
        End::BrokenOff(at) => at.map_or(last, |at| at.max(last)),
    });
    warnings.extend(heard.warnings().iter().cloned());
    Ok((heard, run, warnings))
}
