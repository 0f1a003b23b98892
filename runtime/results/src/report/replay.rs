//! Whether a test that was run once more came out the same.

use serde::Serialize;

use crate::record::Difference;
use crate::report::number::plural;
use crate::report::table::{Align, Table, TextOptions};

/// What became of a recorded test that was run once more.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Replay {
    /// The test.
    pub test: String,
    /// The simulator's seed, then and now.
    pub simulator_seed: u64,
    /// Whether everything observed is the same, bit for bit.
    pub same: bool,
    /// What differs, if anything: `before` as recorded, `after` as replayed.
    pub differences: Vec<Difference>,
}

/// A replay in words.
pub fn replay_text(replay: &Replay, options: TextOptions) -> String {
    let Replay { test, simulator_seed, differences, .. } = replay;
    if replay.same {
        return format!("{test} came out the same, bit for bit (simulator seed {simulator_seed})\n");
    }
    let count = plural(differences.len(), "difference", "differences");
    let mut table = Table::new(["", "recorded", "replayed"].map(|title| (title.to_owned(), Align::Left)));
    for Difference { what, before, after } in differences {
        table.row([what.clone(), before.clone(), after.clone()]);
    }
    format!("{test} came out different (simulator seed {simulator_seed}): {count}\n{}", table.render(options))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_replay_says_what_differs() {
        let options = TextOptions { width: None, colour: false };
        let same = Replay { test: "T5".to_owned(), simulator_seed: 7, same: true, differences: vec![] };
        assert_eq!(replay_text(&same, options), "T5 came out the same, bit for bit (simulator seed 7)\n");
        let words = |what: &str, before: &str, after: &str| Difference {
            what: what.to_owned(),
            before: before.to_owned(),
            after: after.to_owned(),
        };
        let differences = vec![
            words("the outcome", "completed", "crash: gone"),
            words("metric `cycle_time`", "68.20000000000001", "68.2"),
        ];
        insta::assert_snapshot!(replay_text(&Replay { same: false, differences, ..same }, options));
    }
}
