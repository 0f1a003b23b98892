//! Which operations of a campaign acted together.

use serde::Serialize;

use sesame_analysis::Selection;
use sesame_analysis::pairs::{Acted, PairCounts, Pairs, pairs};
use sesame_record::{RecordError, Repository};

/// Which operations of a campaign acted together, and in the same quarter of the run. The lists of lists have a list
/// for each operation: a number for each operation before it, of tests in which both acted, then one for the operation
/// itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairsSummary {
    /// The operations of the campaign, in the order of the space.
    pub operations: Vec<String>,
    /// Pairs of operations.
    pub pairs: usize,
    /// Those of which both acted in one test.
    pub together: usize,
    /// Pairs in quarters of the run, where both may be active then or acted.
    pub in_quarters: usize,
    /// Those of which both acted in that quarter of one test.
    pub together_in_quarters: usize,
    /// For each operation: in how many tests it acted together with each one before it, then in how many it acted.
    pub tests: Vec<Vec<u32>>,
    /// Likewise: in how many quarters of the run.
    pub quarters: Vec<Vec<usize>>,
    /// Likewise: how many of these tests violate a requirement that no reference run violates.
    pub violating: Vec<Vec<u32>>,
    #[serde(skip)]
    pub(crate) found: Pairs,
}

/// Which operations acted together in the tests of a campaign, if it searches and has pairs. Other campaigns run
/// variations of one test, so `None`.
pub(crate) fn pairs_of_search(repository: &Repository) -> Result<Option<PairsSummary>, RecordError> {
    let plan = repository.plan();
    let may_have_pairs = plan.campaign.count.max > 1 && plan.campaign.operations.len() > 1;
    if !may_have_pairs || !repository.task().searches(plan) {
        return Ok(None);
    }
    let found = pairs(repository, &Selection::default())?;
    let PairCounts { pairs, together, in_parts, together_in_parts } = found.counts();
    Ok((pairs > 0).then(|| PairsSummary {
        operations: found.operations.iter().map(|&id| plan.operation(id).name.clone()).collect(),
        pairs,
        together,
        in_quarters: in_parts,
        together_in_quarters: together_in_parts,
        tests: triangle(&found, |acted| acted.tests),
        quarters: triangle(&found, |acted| acted.parts.iter().filter(|&&tests| tests > 0).count()),
        violating: triangle(&found, |acted| acted.violating),
        found,
    }))
}

/// A number for each operation with each one before it, and for itself.
fn triangle<T>(found: &Pairs, number: impl Fn(&Acted) -> T) -> Vec<Vec<T>> {
    let rows = 0..found.operations.len();
    rows.map(|second| (0..=second).map(|first| number(found.of(first, second))).collect()).collect()
}
