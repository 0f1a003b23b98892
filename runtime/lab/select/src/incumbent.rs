//! The best choices so far, and what a part of the search must promise to be looked at.

/// Values that differ by less than this share are equal: sums of many distances cannot be told apart more finely.
pub(crate) const TOLERANCE: f64 = 1e-9;

/// The most equally good choices that are kept while the best value is looked for. With more, the value is proved
/// first, and the choice with the smallest numbers is looked for afterwards.
const KEPT: usize = 32;

/// The best choices so far: ascending positions in the problem.
#[derive(Debug, Clone, Default)]
pub(crate) struct Incumbent {
    /// The greatest value found.
    pub(crate) value: f64,
    /// Choices that were found with about this value.
    found: Vec<(f64, Vec<usize>)>,
    /// Whether choices of equal value were left out.
    pub(crate) crowded: bool,
}

impl Incumbent {
    /// What the bound of a part must reach.
    pub(crate) fn threshold(&self) -> f64 {
        if self.crowded { self.value * (1.0 + TOLERANCE) } else { self.equal() }
    }

    /// From here on values are equal to the best.
    pub(crate) fn equal(&self) -> f64 {
        self.value * (1.0 - TOLERANCE)
    }

    /// Takes note of a choice.
    pub(crate) fn offer(&mut self, value: f64, choice: Vec<usize>) {
        if value < self.equal() || self.found.iter().any(|(_, found)| *found == choice) {
            return;
        }
        if value > self.value {
            self.value = value;
            let equal = self.equal();
            self.found.retain(|(value, _)| *value >= equal);
        }
        if self.found.len() == KEPT {
            self.crowded = true;
            let (worst, _) =
                self.found.iter().enumerate().min_by(|a, b| a.1.0.total_cmp(&b.1.0)).expect("some are kept");
            // The best is never the one to go, since another is kept and worse or as good.
            if choice < self.found[worst].1 || value > self.found[worst].0 {
                self.found[worst] = (value, choice);
            }
            return;
        }
        self.found.push((value, choice));
    }

    /// The choice with the smallest numbers among those found with the best value.
    pub(crate) fn choice(&self) -> Option<&Vec<usize>> {
        let equal = self.equal();
        self.found.iter().filter(|(value, _)| *value >= equal).map(|(_, choice)| choice).min()
    }
}
