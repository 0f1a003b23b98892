//! A violated requirement in sentences.

use std::fmt::{self, Write as _};

use sesame_base::test_number::TestNumber;
use sesame_present::number::plural;
use sesame_record::Verdict;

use crate::facts::disturbances::disturbances_text;
use crate::facts::show::OperationReport;
use crate::facts::summary::RequirementSummary;
use crate::facts::wording::counted;

/// What a violated requirement asks for, and how far tests are from that: sentences, in which a test is named.
pub(crate) struct Violated {
    /// `R1: No load falls over people (drops ≤ 0). 11 of 84 tests violate it; the run without disturbance does not. 2
    /// causes: lag, loss. The worst value is 1, in `
    pub before: String,
    /// The test with that value.
    pub worst: Option<TestNumber>,
    /// What is done in it: `: lag (latency 310 ms, at 4.00–9.00 s).`
    pub after: String,
}

impl fmt::Display for Violated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.before)?;
        if let Some(worst) = self.worst {
            write!(f, "{worst}")?;
        }
        f.write_str(&self.after)
    }
}

/// How many causes of a requirement its sentence names.
const NAMED: usize = 4;

/// What is to be said of a violated requirement with causes of these names.
pub(crate) fn violated_requirement(of: &RequirementSummary, causes: &[String]) -> Violated {
    let RequirementSummary { requirement, text, metric, bound, violated, satisfied, inconclusive, .. } = of;
    let [one, several] = if *inconclusive == 0 { ["test", "tests"] } else { ["conclusive test", "conclusive tests"] };
    let tests = plural(violated + satisfied, one, several);
    let violate = if *violated == 1 { "violates" } else { "violate" };
    let holds_undisturbed = of.reference == Some(Verdict::Satisfied);
    let undisturbed = if holds_undisturbed { "; the run without disturbance does not" } else { "" };
    let mut names = causes[..causes.len().min(NAMED)].join(", ");
    if causes.len() > NAMED {
        let _ = write!(names, " and {} more", causes.len() - NAMED);
    }
    let causes = match causes.len() {
        0 => String::new(),
        several => format!(" {}: {names}.", plural(several, "cause", "causes")),
    };
    let before =
        format!("{requirement}: {text} ({metric} {bound}). {violated} of {tests} {violate} it{undisturbed}.{causes}");
    let Some(worst) = &of.worst else { return Violated { before, worst: None, after: String::new() } };
    let after = match worst.acting.as_slice() {
        [] => ".".to_owned(),
        acting => format!(": {}.", worst_text(acting)),
    };
    Violated { before: format!("{before} The worst value is {}, in ", worst.text), worst: Some(worst.test), after }
}

/// How many operations a sentence describes.
const DESCRIBED: usize = 2;

/// What the operations of a worst test do. If there are many, they are only named, since a page begins with such a
/// sentence for each requirement: `jitter_link0 ×4 + jitter_link1`.
fn worst_text(acting: &[OperationReport]) -> String {
    if acting.len() <= DESCRIBED {
        return disturbances_text(acting);
    }
    counted(acting.iter().map(|used| used.operation.as_str())).join(" + ")
}

#[cfg(test)]
mod tests {
    use sesame_plan::Span;

    use super::*;

    fn lost(operation: &str, start: f64) -> OperationReport {
        OperationReport {
            operation: operation.to_owned(),
            kind: "blackhole".to_owned(),
            topic: Some("order".to_owned()),
            further_topics: Vec::new(),
            resource: None,
            planned: Some(Span { start, end: start + 1.0 }),
            conditions: None,
            messages: None,
            observed: None,
            choices: Vec::new(),
            operation_seed: 1,
            counters: None,
            first_touch: None,
            last_touch: None,
        }
    }

    #[test]
    fn a_worst_test_of_many_operations_is_described_by_their_names() {
        let acting = [("a", 1.0), ("b", 2.0), ("a", 4.0), ("a", 5.0)].map(|(name, start)| lost(name, start));
        assert_eq!(worst_text(&acting), "a ×3 + b");
        assert_eq!(worst_text(&acting[..2]), "a (at 1.00–2.00 s) + b (at 2.00–3.00 s)");
    }
}
