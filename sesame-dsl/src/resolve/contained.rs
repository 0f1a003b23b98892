//! What operations require of the conditions that a campaign grows.

use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::condition::{ConditionSpace, Constraint, Integers};
use crate::model::{Id as _, MetricId};
use crate::span::Span;
use crate::syntax::ast::{self, Contained};

impl<'a> Resolver<'a> {
    pub(super) fn constraints(&mut self, clauses: &'a [(Span, Vec<Contained>)]) -> Option<Vec<Constraint>> {
        let mut found: Vec<(Constraint, Span)> = Vec::new();
        let mut complete = true;
        for contained in clauses.iter().flat_map(|(_, contained)| contained) {
            let (constraint, span) = match contained {
                Contained::Variable(name) => {
                    let metric = self.find(name, Kind::Metric);
                    (metric.map(|index| Constraint::Variable(MetricId::from_index(index))), name.span)
                }
                Contained::Integer(span, range) => {
                    (self.integers(range, "an integer of a condition").map(Constraint::Integer), *span)
                }
            };
            let Some(constraint) = constraint else {
                complete = false;
                continue;
            };
            if let Some((_, before)) = found.iter().find(|(known, _)| *known == constraint) {
                let title = format!("`{}` is required twice", self.text(span));
                let diagnostic = Diagnostic::new(Code::LISTED_TWICE, span, title)
                    .label("required again here")
                    .secondary(*before, "first required here");
                self.report(diagnostic);
                complete = false;
                continue;
            }
            found.push((constraint, span));
        }
        complete.then(|| found.into_iter().map(|(constraint, _)| constraint).collect())
    }

    /// Checks that conditions of a campaign can contain what one of its operations requires.
    pub(super) fn constraints_and_space(
        &mut self,
        name: &ast::Name,
        index: usize,
        space: &ConditionSpace,
        campaign: &'a ast::Campaign,
    ) {
        let Some(operation) = &self.operations[index] else { return };
        let constraints = operation.constraints.clone();
        let body = &self.file.operations[index].body;
        let written = body.contains.iter().flat_map(|(_, contained)| contained);
        let mut failed = false;
        for (constraint, written) in constraints.iter().zip(written) {
            let (span, wrong) = match (constraint, written) {
                (Constraint::Variable(metric), Contained::Variable(variable)) => {
                    let offered = space.variables.iter().find(|offered| offered.metric == *metric);
                    let wrong = match offered {
                        None => {
                            format!("`{}` is not a variable of campaign `{}`", variable.text, campaign.head.name.text)
                        }
                        Some(offered) if !self.is_comparable(space, offered) => {
                            format!("every comparison with `{}` is constant", variable.text)
                        }
                        Some(_) => continue,
                    };
                    (variable.span, wrong)
                }
                (Constraint::Integer(bounds), Contained::Integer(span, _)) => {
                    let wrong = match bounds.shared(space.integers) {
                        None => format!(
                            "the integers of campaign `{}` range from {} to {}",
                            campaign.head.name.text, space.integers.lowest, space.integers.highest
                        ),
                        Some(shared) if !space.variables.iter().any(|variable| variable.known.meets(shared)) => {
                            "no variable can be both below and above such a number".to_owned()
                        }
                        Some(_) => continue,
                    };
                    (*span, wrong)
                }
                _ => continue,
            };
            failed = true;
            let title = format!("no start condition can contain what `{}` requires", name.text);
            let diagnostic = Diagnostic::new(Code::CANNOT_CONTAIN, name.span, title).label(wrong);
            self.report(diagnostic.secondary(span, "required here"));
        }
        let (needed, most) = (comparisons_needed(&constraints), 1_usize << (space.depth - 1));
        if !failed && needed > most {
            let title =
                format!("a condition of depth {} cannot contain everything that `{}` requires", space.depth, name.text);
            let label = format!("this needs {needed} comparisons, but there is room for only {most}");
            let mut diagnostic = Diagnostic::new(Code::CANNOT_CONTAIN, name.span, title).label(label);
            if let Some((clause, _)) = body.contains.first() {
                diagnostic = diagnostic.secondary(*clause, "required here");
            }
            self.report(diagnostic);
        }
    }
}

/// The fewest comparisons that contain these: a comparison has at most two variables, or a variable and a number.
fn comparisons_needed(constraints: &[Constraint]) -> usize {
    let variables = constraints.iter().filter(|constraint| matches!(constraint, Constraint::Variable(_))).count();
    let mut bounds: Vec<Integers> = constraints
        .iter()
        .filter_map(|constraint| match constraint {
            Constraint::Integer(bounds) => Some(*bounds),
            Constraint::Variable(_) => None,
        })
        .collect();
    // One number may be enough for several bounds: the greatest of those that end first, then of those it is not in.
    bounds.sort_by_key(|bounds| bounds.highest);
    let mut numbers: Vec<i64> = Vec::new();
    for bounds in bounds {
        if numbers.last().is_none_or(|&number| number < bounds.lowest) {
            numbers.push(bounds.highest);
        }
    }
    numbers.len() + variables.saturating_sub(numbers.len()).div_ceil(2)
}
