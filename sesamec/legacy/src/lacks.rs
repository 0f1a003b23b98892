//! What imports say that the language cannot do, each beside a text of the language that tries it. A test checks that
//! each of these texts is refused: a sentence here cannot become untrue without being noticed.

use crate::boosting::{NEEDS_CELLS, NEEDS_TIME};
use crate::known_tests::NO_SECONDS;

/// A sentence about what the language cannot do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lack {
    /// The sentence, or the part of it that is about the language.
    pub says: &'static str,
    /// What would do it, behind the declarations of a space that has a topic `joint`, which is a number, an operation
    /// `push` on it with a window, and metrics `near` and `time_active`, of which the latter is in seconds.
    pub attempt: &'static str,
}

/// No condition compares a time with a plain number.
const SECONDS: Lack =
    Lack { says: NO_SECONDS, attempt: "test t { push offset [0, 0] when time_active > near for 5s }" };

/// No latency is negative.
pub(crate) const NO_NEGATIVE_DELAY: Lack =
    Lack { says: "no delay is negative", attempt: "operation late on joint = latency [-1s, 1s]" };

/// A campaign that only observes holds no operations and seeks nothing.
pub(crate) const PASSIVE: Lack =
    Lack { says: "so it only observes now", attempt: "campaign c { objectives near  passive 1 times  end after 9s }" };

/// All of them.
pub const LACKS: [Lack; 5] = [
    SECONDS,
    NO_NEGATIVE_DELAY,
    PASSIVE,
    Lack {
        says: NEEDS_TIME,
        attempt: "campaign c { objectives near  operations push 1 per test  activate by condition over near \
                  search nsga2 { population 4  evaluations 8 }  coverage { T1 [0, 1] cells 4 }  boost fixed { } \
                  end after 9s }",
    },
    Lack {
        says: NEEDS_CELLS,
        attempt: "campaign c { objectives near  operations push 1 per test  activate by time \
                  search nsga2 { population 4  evaluations 8 }  boost fixed { }  end after 9s }",
    },
];
