//! Metrics and requirements.

use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{self, Bound, Id as _, MetricId, MetricSource, Range, TopicId, Type};
use crate::syntax::ast::{self, Comparison, Name};
use crate::units::Unit;

impl<'a> Resolver<'a> {
    pub(super) fn metrics(&mut self) {
        for metric in &self.file.metrics {
            let resolved = self.metric(metric);
            self.metrics.push(resolved);
        }
    }

    fn metric(&mut self, metric: &'a ast::Metric) -> Option<model::Metric> {
        let name = &metric.head.name;
        let direction = self.single(&metric.directions, "maximise` or `minimise").map(|direction| match direction {
            ast::Direction::Maximise => model::Direction::Maximise,
            ast::Direction::Minimise => model::Direction::Minimise,
        });
        let default = self.single(&metric.defaults, "default");
        let initial = self.single(&metric.initials, "initial");
        let trend = self.single(&metric.trends, "rising` or `falling").map(|trend| match trend {
            ast::Trend::Rising => model::Trend::Rising,
            ast::Trend::Falling => model::Trend::Falling,
        });
        self.at_most_one(&metric.accepts, "accepts non_finite");
        if !matches!(metric.source, ast::MetricSource::Hook { .. }) {
            self.only_of_hooks(metric);
        }
        // Both are resolved, so that a mistake in one does not hide one in the other or in the default.
        let (source, ty): (Option<MetricSource>, Option<Type>) = match &metric.source {
            ast::MetricSource::Hook { hooks, has_errors } => {
                (self.hook(name, hooks, *has_errors), self.hook_type(metric.ty.as_ref()))
            }
            ast::MetricSource::FuzzingTime => {
                self.no_type(metric.ty.as_ref(), "`fuzzing_time()` is in seconds");
                self.no_initial(metric, &MetricSource::FuzzingTime);
                (Some(MetricSource::FuzzingTime), Some(Type::Real(Some(Unit::seconds()))))
            }
            ast::MetricSource::Formula(formula) => {
                self.no_type(
                    metric.ty.as_ref(),
                    "its unit follows from the units of the topics and numbers in the formula",
                );
                match self.formula(formula) {
                    Some((source, unit)) => {
                        self.no_initial(metric, &source);
                        (Some(source), Some(Type::Real(unit)))
                    }
                    None => (None, None),
                }
            }
        };
        let Type::Real(unit) = ty? else { return None };
        let what = format!("metric `{}`", name.text);
        let mut value = |quantity: Option<&ast::Quantity>| match quantity {
            Some(quantity) => self.value(quantity, unit.as_ref(), &what).map(Some),
            None => Some(None),
        };
        let [default, initial] = [value(default), value(initial)];
        Some(model::Metric {
            declaration: self.declaration(&metric.head),
            unit,
            direction,
            default: default?,
            initial: initial?,
            trend,
            accepts_not_finite: !metric.accepts.is_empty(),
            source: source?,
        })
    }

    /// Reports an initial value of what has a value from the beginning.
    fn no_initial(&mut self, metric: &ast::Metric, source: &MetricSource) {
        let Some((word, initial)) = metric.initials.first() else { return };
        let starts = match source {
            MetricSource::FuzzingTime => "`fuzzing_time()` starts at 0s".to_owned(),
            MetricSource::Monitor(_, score) if score.always_has_a_value() => {
                format!("`{}(…)` starts at 0{}", score.name(), score.unit().unwrap_or_default())
            }
            _ => return,
        };
        let title = format!("`initial` has no effect, because {starts}");
        let span = word.to(initial.span);
        self.report(Diagnostic::new(Code::IDLE_CLAUSE, span, title).label("remove this"));
    }

    /// Reports clauses that only a hook needs; for a formula they follow from the formula.
    fn only_of_hooks(&mut self, metric: &ast::Metric) {
        let trends = metric.trends.iter().map(|(span, trend)| {
            let word = match trend {
                ast::Trend::Rising => "rising",
                ast::Trend::Falling => "falling",
            };
            (*span, word, "for a formula this is known: `max` rises, `min` falls")
        });
        let note = "a formula cannot compute with numbers that are not finite, but a hook can handle them";
        let accepts = metric.accepts.iter().map(|span| (*span, "accepts non_finite", note));
        for (span, word, note) in trends.chain(accepts).collect::<Vec<_>>() {
            let title = format!("`{word}` is only allowed for a metric with a hook");
            self.report(Diagnostic::new(Code::IDLE_CLAUSE, span, title).label("remove this").note(note));
        }
    }

    fn hook(
        &mut self,
        name: &Name,
        hooks: &'a [(crate::span::Span, Vec<Name>)],
        has_errors: bool,
    ) -> Option<MetricSource> {
        let Some(topics) = self.single(hooks, "hook on") else {
            if !has_errors {
                let example = format!("hook on {}", self.declared_or(Kind::Topic, "zones"));
                self.missing(name.span, &name.text, "the topics that its hook reads", &example);
            }
            return None;
        };
        let topics = self.find_all(topics, Kind::Topic)?;
        Some(MetricSource::Hook(topics.into_iter().map(TopicId::from_index).collect()))
    }

    /// The type of a hook's metric, always `Type::Real`.
    fn hook_type(&mut self, ty: Option<&'a ast::Type>) -> Option<Type> {
        let Some(ty) = ty else { return Some(Type::Real(None)) };
        match self.type_of(ty)? {
            real @ Type::Real(_) => Some(real),
            other => {
                let title = format!("a metric must be a real number, not {}", super::words::type_in_words(&other));
                let diagnostic = Diagnostic::new(Code::WRONG_TYPE, ty.span, title)
                    .label("expected `real` or, with a unit, for example `real[m]`")
                    .fix("use `real`", ty.span, "real");
                self.report(diagnostic);
                None
            }
        }
    }

    fn no_type(&mut self, ty: Option<&'a ast::Type>, why: &str) {
        if let Some(ty) = ty {
            let title = "the type of this metric follows from its formula";
            self.report(Diagnostic::new(Code::WRONG_TYPE, ty.span, title).label("remove this").note(why));
        }
    }

    pub(super) fn requirements(&mut self) -> Vec<Option<model::Requirement>> {
        let file = self.file;
        let requirements = file.requirements.iter().map(|requirement| {
            let (metric, bound) = self.bound(&requirement.metric, &requirement.bound)?;
            let text = requirement.text.text.clone();
            Some(model::Requirement { declaration: self.declaration(&requirement.head), text, metric, bound })
        });
        requirements.collect()
    }

    /// A bound on a metric, in the metric's unit.
    pub(super) fn bound(&mut self, name: &'a Name, bound: &'a ast::Bound) -> Option<(MetricId, Bound)> {
        let index = self.find(name, Kind::Metric)?;
        let unit = self.metrics[index].as_ref()?.unit.clone();
        let what = format!("metric `{}`", name.text);
        let bound = match bound {
            ast::Bound::Within(range) => {
                let Range { low, high } = self.range(range, unit.as_ref(), &what)?;
                Bound::Within { low, high }
            }
            ast::Bound::Compare(comparison, quantity) => {
                compared(*comparison, self.value(quantity, unit.as_ref(), &what)?)
            }
            ast::Bound::Constant(comparison, constant) => {
                let value = self.number_of_constant(constant, "a number")?;
                self.is_plain(MetricId::from_index(index), name.span, constant.span)?;
                compared(*comparison, value)
            }
        };
        Some((MetricId::from_index(index), bound))
    }
}

fn compared(by: Comparison, value: f64) -> Bound {
    match by {
        Comparison::AtMost => Bound::AtMost { value },
        Comparison::Below => Bound::Below { value },
        Comparison::AtLeast => Bound::AtLeast { value },
        Comparison::Above => Bound::Above { value },
        Comparison::Equal => Bound::Equal { value },
    }
}
