//! Coverage boosting of the original in the words of the language, and in notes what differs.

use sesame_notation::{self as notation, Clause};
use sesame_plan::{BoostedChildren, Exploration};

use crate::notes::Kind;
use crate::original::Boosting;
use crate::writer::Writer;
use crate::xml::printable;

/// How often the original mutates a child again at most.
const TRIES: u32 = 10;
/// What the original does where a file states no number: it boosts in every second generation, from every second
/// parent.
const EVERY: u32 = 2;

/// Boosting needs windows of time that it can move.
pub(crate) const NEEDS_TIME: &str = "`boost` works with `activate by time` only";
/// Boosting needs cells to aim at.
pub(crate) const NEEDS_CELLS: &str = "`boost` needs the cells of a `coverage`";

/// The clause of a campaign, if it can have one: one that activates by time and counts cells.
pub(crate) fn clause(
    writer: &mut Writer<'_>,
    boosting: &Boosting,
    shown: &str,
    by_time: bool,
    has_cells: bool,
) -> Option<Clause> {
    let mut say = |kind, text: String| writer.notes.say(kind, format!("campaign `{shown}`{text}"));
    if !by_time {
        say(Kind::LeftOut, format!(", its boosting: {NEEDS_TIME}; `predict {{ }}` is for campaigns by condition"));
        return None;
    }
    if !has_cells {
        let add = "add `coverage { … }` and `boost fixed { }`";
        say(Kind::LeftOut, format!(", its boosting: {NEEDS_CELLS}, which the file does not give; {add}"));
        return None;
    }
    let (every_generations, children) = match *boosting {
        Boosting::Unstated => {
            let numbers = format!("every {EVERY} generations, every {EVERY} iterations, {TRIES} tries");
            say(Kind::Changed, format!(" boosts coverage, and the file does not say how: {numbers} now"));
            (EVERY, BoostedChildren::Every { iterations: EVERY })
        }
        Boosting::Fixed { generations, parents } => {
            let boosted = match both_children_of_every(parents.max(1)) {
                1 => "all children".to_owned(),
                2 => "both children of every second pair of parents".to_owned(),
                nth => format!("both children of one pair of parents in {nth}"),
            };
            // From every parent on is from every child on.
            if parents != 1 {
                let counts = "`boost fixed` counts children where the original counted parents";
                say(Kind::Changed, format!(": {counts}, so that its {parents} boosted {boosted}"));
            }
            (generations, BoostedChildren::Every { iterations: parents.max(1) })
        }
        Boosting::Linear { generations, first, last, drop } => {
            if first < last {
                let text = format!(": boosting from {first} to {last} children is from {last} to {last} now");
                say(Kind::Changed, text);
            }
            (generations, BoostedChildren::Falling { first: first.max(last), last, drop })
        }
        Boosting::Other(ref kind) => {
            let kind = printable(kind);
            say(Kind::LeftOut, format!(", its boosting: the original has no strategy `{kind}`"));
            return None;
        }
    };
    if every_generations == 0 {
        say(
            Kind::Changed,
            ": boosting every 0 generations, which the original cannot do, is every generation now".into(),
        );
    }
    let every_generations = every_generations.max(1);
    Some(notation::exploration_clause(&Exploration::Boost { every_generations, children, tries: TRIES }))
}

/// The original numbers parents from 0, takes them in pairs, and boosts both children of a pair if the number of its
/// first parent is a multiple of `parents`: those of every so many pairs.
fn both_children_of_every(parents: u32) -> u32 {
    if parents.is_multiple_of(2) { parents / 2 } else { parents }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_boosted_as_often_as_their_first_parent_is_a_multiple() {
        for parents in 1..=12_u32 {
            let pairs: Vec<u32> = (0..240_u32).filter(|pair| (2 * pair).is_multiple_of(parents)).collect();
            let nth = both_children_of_every(parents);
            assert_eq!(pairs, (0..240).step_by(nth as usize).collect::<Vec<_>>(), "{parents}");
        }
    }
}
