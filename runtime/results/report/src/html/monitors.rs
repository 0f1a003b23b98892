//! What the monitors of a campaign were worth, missed hazards first.

use sesame_present::markup::Markup;

use crate::facts::summary::Summary;
use crate::sentences::{MONITORS_CAPTION, monitors_run_again, monitors_sentence};
use crate::tables::monitors as tables;

/// Rows of missed hazards shown at most.
const MISSED: usize = 50;

/// The section on monitors; nothing in results without any.
pub(super) fn monitors(body: &mut Markup, summary: &Summary, drawn: &[u32]) {
    let Some(found) = &summary.monitors else { return };
    body.open("section", &[("id", "monitors")]);
    body.heading("Monitors");
    let sentences = [monitors_sentence(found)].into_iter().chain(monitors_run_again(found));
    body.element("p", &[], &sentences.map(|sentence| format!("{sentence}.")).collect::<Vec<_>>().join(" "));
    let mut missed = tables::missed_hazards(found);
    let more = missed.truncate(MISSED);
    if !missed.is_empty() {
        body.element("h3", &[("class", "bad")], "✗ Missed hazards");
        missed.html(body, drawn);
    }
    if more > 0 {
        body.element("p", &[("class", "quiet")], &format!("And {more} more; the report in JSON has all."));
    }
    tables::hazards(found).html(body, drawn);
    body.element("p", &[("class", "quiet")], MONITORS_CAPTION);
    tables::monitors(found).html(body, drawn);
    body.open("p", &[("class", "quiet")]);
    body.element("a", &[("href", "#certificates")], "The certificates as trees");
    body.close();
    body.close();
}
