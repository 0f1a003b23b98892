//! Repetition: one known test again and again, to see what of its result is chance.

use sesame_plan::Test;

use crate::search::{Candidate, Evaluated, Strategy};

/// The same test so many times, draw seeds included, in one generation.
#[derive(Debug, Clone)]
pub struct Repeat {
    test: Test,
    times: u32,
    awaited: Option<usize>,
}

impl Repeat {
    /// So many repetitions of a test.
    pub fn new(test: Test, times: u32) -> Self {
        Repeat { test, times, awaited: None }
    }
}

impl Strategy for Repeat {
    fn ask(&mut self) -> Vec<Candidate> {
        if let Some(awaited) = self.awaited {
            assert!(awaited == 0, "a generation is told before the next is asked");
            return Vec::new();
        }
        self.awaited = Some(self.times as usize);
        let repetition = || Candidate { test: self.test.clone(), parents: Vec::new(), generation: 0, known: None };
        std::iter::repeat_with(repetition).take(self.times as usize).collect()
    }

    fn tell(&mut self, results: &[Evaluated]) {
        assert!(self.awaited == Some(results.len()), "exactly the generation asked last is told");
        self.awaited = Some(0);
    }
}
