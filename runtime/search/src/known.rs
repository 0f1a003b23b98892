//! Known tests for their own sake: what comes out of each is compared with what was expected.

use sesame_plan::{KnownTestId, Test};

use crate::{Candidate, Evaluated, Strategy};

/// Each of these tests once, in one generation.
#[derive(Debug, Clone)]
pub(crate) struct Known {
    tests: Vec<(KnownTestId, Test)>,
    awaited: Option<usize>,
}

impl Known {
    /// These tests, in this order.
    pub(crate) fn new(tests: Vec<(KnownTestId, Test)>) -> Self {
        Known { tests, awaited: None }
    }
}

impl Strategy for Known {
    fn ask(&mut self) -> Vec<Candidate> {
        if let Some(awaited) = self.awaited {
            assert!(awaited == 0, "a generation is told before the next is asked");
            return Vec::new();
        }
        self.awaited = Some(self.tests.len());
        let candidate =
            |(id, test)| Candidate { test, parents: Vec::new(), generation: 0, known: Some(id), simulator_seed: None };
        std::mem::take(&mut self.tests).into_iter().map(candidate).collect()
    }

    fn tell(&mut self, results: &[Evaluated]) {
        assert!(self.awaited == Some(results.len()), "exactly the generation asked last is told");
        self.awaited = Some(0);
    }
}
