//! A test and its twin without mitigation, as text for a terminal.

use sesame_present::number::{join_words, plural};
use sesame_present::table::{Column, Datum, Table, TextOptions};

use crate::facts::monitors::seconds;
use crate::facts::twin::Twin;
use crate::text::{paragraph, section};

/// What mitigation was worth in a test, in words.
pub fn twin_text(twin: &Twin, options: TextOptions) -> String {
    let Twin { test, simulator_seed, withheld, mitigations, .. } = twin;
    let monitors = join_words(&withheld.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>());
    let mut text = String::new();
    paragraph(
        &mut text,
        &format!("{test} beside its twin, in which {monitors} sent no mitigation (simulator seed {simulator_seed})"),
        options,
    );
    let sent = match mitigations.as_slice() {
        [] => "In the test no mitigation was sent.".to_owned(),
        [first, rest @ ..] => {
            let more = if rest.is_empty() {
                String::new()
            } else {
                format!(", and {} more", plural(rest.len(), "time", "times"))
            };
            format!("In the test mitigation was sent at {} by `{}`{more}.", seconds(first.at), first.monitor)
        }
    };
    paragraph(&mut text, &sent, options);
    section(&mut text, "Requirements", &requirements(twin), options);
    text
}

/// Requirements in a test and in its twin.
fn requirements(twin: &Twin) -> Table {
    let numbers = ["hazard", "hazard of the twin", "mitigation before it"].map(Column::number);
    let columns = [Column::heading("requirement")].into_iter().chain(numbers);
    let mut table = Table::with(columns.chain([Column::line("verdict")]));
    let time = |at: Option<f64>| at.map_or(Datum::Missing, |at| Datum::text(seconds(at)));
    for requirement in &twin.requirements {
        table.row([
            Datum::text(&requirement.requirement).into(),
            time(requirement.hazard).into(),
            time(requirement.hazard_of_twin).into(),
            time(requirement.lead).into(),
            Datum::text(requirement.verdict.words()).bad_if(!requirement.verdict.is_as_required()),
        ]);
    }
    table
}
