//! What a run showed after a topic had fallen silent is not known.

use sesame_base::observation::Observation;
use sesame_base::silence::{Silence, distrust, silences, wires};
use sesame_plan::CampaignPlan;

/// How many silences of one run are named.
const NAMED: usize = 3;

/// Compares what was heard in a run with the reference run: the silences are noted, and what metrics read after the
/// last message of a topic decides no verdict.
pub(crate) fn judge(plan: &CampaignPlan, reference: &Observation, run: &mut Observation) {
    let silences = silences(reference, run);
    distrust(plan, &silences, &mut run.metrics);
    run.warnings.extend(note(plan, reference, &silences));
}

fn note(plan: &CampaignPlan, reference: &Observation, silences: &[Silence]) -> Option<String> {
    let wires = wires(plan);
    let one = |silence: &Silence| {
        let path = wires.get(silence.wire).map_or("", |wire| wire.path);
        let to = silence.to.map_or_else(|| "the end of the run".to_owned(), |to| format!("{to:.3} s"));
        let usual = reference.traffic.iter().find(|usual| usual.wire as usize == silence.wire);
        let longest = usual.map_or(0.0, |usual| usual.gap.length());
        format!(
            "`{path}` was silent from {:.3} s to {to} (in the reference run never longer than {longest:.3} s)",
            silence.from
        )
    };
    let mut words: Vec<String> = silences.iter().take(NAMED).map(one).collect();
    if words.is_empty() {
        return None;
    }
    let more = silences.len().saturating_sub(NAMED);
    if more > 0 {
        words.push(format!("and {more} more such times"));
    }
    let mut text = words.join("; ");
    if silences.iter().any(|silence| silence.to.is_none()) {
        text += "; what metrics read from a topic that fell silent is not known from then on";
    }
    Some(text)
}
