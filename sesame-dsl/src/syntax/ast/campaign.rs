//! Campaigns: how tests are found and run.

use std::sync::Arc;

use sesame_plan::{Copies, Setting, StrategyKind};

use super::exploration::{Confirm, Coverage, Exploration, Stop};
use super::formula::Expression;
use super::words::{Count, Head, Name, Quantity, Range};
use crate::span::Span;

#[derive(Debug)]
pub(crate) struct Campaign {
    pub(crate) head: Head,
    /// The campaign it inherits from.
    pub(crate) from: Option<Name>,
    /// Clauses that stand in that one.
    pub(crate) inherited: Inherited,
    pub(crate) objectives: Vec<(Span, Vec<Name>)>,
    pub(crate) observes: Vec<(Span, Vec<Name>)>,
    pub(crate) operations: Vec<Operations>,
    pub(crate) activates: Vec<(Span, ActivationMode)>,
    pub(crate) searches: Vec<Search>,
    pub(crate) coverages: Vec<Coverage>,
    pub(crate) explorations: Vec<Exploration>,
    pub(crate) confirms: Vec<Confirm>,
    pub(crate) stops: Vec<Stop>,
    pub(crate) repeats: Vec<Repeat>,
    pub(crate) passives: Vec<Passive>,
    pub(crate) ends: Vec<(Span, EndOfTest)>,
    pub(crate) records: Vec<(Span, Record)>,
    /// Something of it could not be read or is not supported: what is missing may be there. So too with a `from`, since
    /// what the other campaign lacks is said of that one.
    pub(crate) has_errors: bool,
    /// Something of it, or of what it inherits from, could not be read: nothing is known of what it has not.
    pub(crate) inherited_errors: bool,
}

/// When tests end.
#[derive(Debug, Clone)]
pub(crate) struct EndOfTest {
    pub(crate) after: Quantity,
    /// What ends one before; shared with the campaigns that inherit it.
    pub(crate) when: Option<Arc<Expression>>,
}

/// Which clauses a campaign has from another, as far as it matters for what is said of them.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Inherited {
    pub(crate) operations: bool,
    pub(crate) activate: bool,
    pub(crate) end: bool,
}

/// How the tests of a search switch operations on and off.
#[derive(Debug, Clone)]
pub(crate) enum ActivationMode {
    Time,
    Condition(ByCondition),
}

/// `condition over …`, with its settings as written.
#[derive(Debug, Clone)]
pub(crate) struct ByCondition {
    /// The variables, their known ranges and their steps, as long as each other.
    pub(crate) variables: Vec<Name>,
    pub(crate) ranges: Vec<Option<Range>>,
    /// How far apart the numbers are that they are compared with, where that is written.
    pub(crate) steps: Vec<Option<Quantity>>,
    pub(crate) depth: Vec<(Span, Count)>,
    pub(crate) integers: Vec<(Span, Range)>,
    pub(crate) lengths: Vec<(Span, Range)>,
    pub(crate) times: Vec<(Span, Count)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Record {
    Failing,
    All,
}

#[derive(Debug, Clone)]
pub(crate) struct Operations {
    pub(crate) span: Span,
    pub(crate) names: Vec<Name>,
    pub(crate) min: Count,
    pub(crate) max: Count,
    /// What is written of several copies of one operation, and where; `None` where nothing is.
    pub(crate) copies: Option<(Span, Copies)>,
}

#[derive(Debug, Clone)]
pub(crate) struct Search {
    pub(crate) span: Span,
    /// `None` for a strategy that is not supported yet.
    pub(crate) strategy: Option<StrategyKind>,
    /// Settings that only some strategies have.
    pub(crate) own: Vec<(Span, (Setting, Count))>,
    pub(crate) evaluations: Vec<(Span, Count)>,
    pub(crate) seed: Vec<(Span, Count)>,
    pub(crate) neighbours: Vec<(Span, Count)>,
    pub(crate) keep_causes: Vec<(Span, ())>,
    pub(crate) has_errors: bool,
}

#[derive(Debug, Clone)]
pub(crate) struct Repeat {
    pub(crate) span: Span,
    pub(crate) test: Name,
    pub(crate) times: Count,
    pub(crate) seed: Vec<(Span, Count)>,
}

/// Runs that disturb nothing.
#[derive(Debug, Clone)]
pub(crate) struct Passive {
    pub(crate) span: Span,
    pub(crate) times: Count,
    pub(crate) seed: Vec<(Span, Count)>,
}
