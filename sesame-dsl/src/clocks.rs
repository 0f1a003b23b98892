//! Words of formulas for the time at which they are computed. What a space declares under such a name hides the word.

use crate::model::Expression;
use crate::syntax::ast::Path;

/// A word for the time.
pub(crate) struct Clock {
    pub(crate) word: &'static str,
    /// What it is in the plan, in seconds.
    pub(crate) expression: Expression,
    /// What it means, for notes.
    pub(crate) means: &'static str,
}

const CLOCKS: [Clock; 2] = [
    Clock { word: "time", expression: Expression::Time, means: "the simulation time" },
    Clock { word: "now", expression: Expression::Now, means: "what the clock of the simulator's stamps shows" },
];

/// The word with which a path begins, whatever the space declares.
pub(crate) fn clock_of(path: &Path) -> Option<&'static Clock> {
    CLOCKS.iter().find(|clock| clock.word == path.topic.text)
}
