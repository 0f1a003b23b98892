//! What metrics say of runtime monitors: the functions of a formula that are of a monitor, and the parts of monitors
//! that are named where a metric is expected.
//!
//! A part that is named so is a metric of the space that nobody declared: `transport.brakes_ok` is
//! `holds(transport.brakes_ok)`. All of them are metrics of the model, behind those that are declared.

use sesame_plan::{MonitorPart, MonitorState, RequirementId, Score};

use super::words::list;
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{self, EddiId, Id as _, Metric, MetricSource};
use crate::similar::most_similar;
use crate::span::Span;
use crate::syntax::ast::{self, ExpressionKind, Name, Path};
use crate::units::Unit;

/// What a function is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Takes {
    Monitor,
    MonitorAndRequirement,
    State,
    Part,
}

/// The functions of a monitor.
const SCORES: [(&str, Takes); 10] = [
    ("missed_hazards", Takes::MonitorAndRequirement),
    ("foreseen_hazards", Takes::MonitorAndRequirement),
    ("false_alarms", Takes::MonitorAndRequirement),
    ("lead_time", Takes::MonitorAndRequirement),
    ("time_in", Takes::State),
    ("changes_of", Takes::Monitor),
    ("shortest_stay", Takes::Monitor),
    ("mitigations", Takes::Monitor),
    ("integrity", Takes::Monitor),
    ("holds", Takes::Part),
];

/// The names of the functions of a monitor.
pub(super) fn scores() -> impl Iterator<Item = &'static str> {
    SCORES.iter().map(|(name, _)| *name)
}

impl<'a> Resolver<'a> {
    /// A formula that is a function of a monitor, with its unit; the outer `None` if it is not one.
    #[expect(clippy::option_option, reason = "the outer `None` is another formula, the inner a mistake")]
    pub(super) fn score(&mut self, formula: &'a ast::Formula) -> Option<Option<(MetricSource, Option<Unit>)>> {
        let ast::FormulaKind::Plain(whole) = &formula.kind else { return None };
        let ExpressionKind::Call(name, arguments) = &whole.kind else { return None };
        let (_, takes) = SCORES.iter().find(|(known, _)| *known == name.text)?;
        Some(self.score_of(formula, whole, name, *takes, arguments))
    }

    fn score_of(
        &mut self,
        formula: &'a ast::Formula,
        whole: &'a ast::Expression,
        name: &'a Name,
        takes: Takes,
        arguments: &'a [ast::Expression],
    ) -> Option<(MetricSource, Option<Unit>)> {
        self.only_messages_have_clauses(formula, name);
        let within = match self.single(&formula.within, "within") {
            Some(_) if name.text != "false_alarms" => {
                self.no_horizon(formula);
                None
            }
            Some(within) => Some(self.positive(within, &Unit::seconds(), "the horizon of an alarm")),
            None => None,
        };
        let expected = match takes {
            Takes::Monitor => "a monitor",
            Takes::MonitorAndRequirement => "a monitor and a requirement",
            Takes::State => "a state of a monitor, such as `transport.safe`",
            Takes::Part => "a part of a monitor, such as `transport.brakes_ok`",
        };
        let (eddi, score) = match (takes, arguments) {
            (Takes::Monitor, [of]) => {
                let eddi = self.monitor_named(of, expected)?;
                let score = match name.text.as_str() {
                    "changes_of" => Score::Changes,
                    "shortest_stay" => Score::ShortestStay,
                    "mitigations" => self.sends_mitigations(eddi, of.span)?,
                    _ => Score::Integrity,
                };
                (eddi, score)
            }
            (Takes::MonitorAndRequirement, [of, requirement]) => {
                // Both are resolved, so that a mistake in one does not hide one in the other.
                let eddi = self.monitor_named(of, "a monitor");
                let requirement = self.requirement_named(requirement)?;
                let score = match name.text.as_str() {
                    "missed_hazards" => Score::MissedHazards { requirement },
                    "foreseen_hazards" => Score::ForeseenHazards { requirement },
                    "lead_time" => Score::LeadTime { requirement },
                    _ => Score::FalseAlarms {
                        requirement,
                        within: match within {
                            Some(within) => Some(within?),
                            None => None,
                        },
                    },
                };
                (eddi?, score)
            }
            (Takes::State, [of]) => {
                let (eddi, part, span) = self.part_named(of, expected)?;
                let state = match part {
                    MonitorPart::Guarantee(at) => MonitorState::Guarantee(at),
                    MonitorPart::Otherwise => MonitorState::Otherwise,
                    MonitorPart::Evidence(_) | MonitorPart::Demand(_) => {
                        self.not_a_state(eddi, span);
                        return None;
                    }
                };
                (eddi, Score::TimeIn { state })
            }
            (Takes::Part, [of]) => {
                let (eddi, part, _) = self.part_named(of, expected)?;
                (eddi, Score::Holds { part })
            }
            _ => {
                self.wrong_count(whole.span, &name.text, expected, arguments.len());
                return None;
            }
        };
        let unit = score.unit().map(|_| Unit::seconds());
        Some((MetricSource::Monitor(EddiId::from_index(eddi), score), unit))
    }

    /// Reports clauses about messages: a monitor is scored by its state over time.
    fn only_messages_have_clauses(&mut self, formula: &ast::Formula, name: &Name) {
        let clauses = [
            ("when", formula.when.first().map(|(word, when)| word.to(when.span))),
            ("every", formula.every.first().map(|(word, every)| word.to(every.span))),
            ("per", formula.per.first().map(|(word, per)| word.to(per.span))),
            ("outbound", formula.outbound.first().copied()),
            ("whole windows", formula.whole.first().copied()),
        ];
        for (word, span) in clauses {
            let Some(span) = span else { continue };
            let title = format!("`{word}` cannot be combined with `{}(…)`", name.text);
            let diagnostic = Diagnostic::new(Code::IDLE_CLAUSE, span, title).label("remove this");
            self.report(diagnostic.note("this is computed from the states of a monitor, not from messages"));
        }
    }

    /// Reports `within` behind another formula than that of false alarms.
    pub(super) fn no_horizon(&mut self, formula: &ast::Formula) {
        for (word, within) in &formula.within {
            let title = "`within` is only allowed with `false_alarms(…)`";
            let diagnostic = Diagnostic::new(Code::IDLE_CLAUSE, word.to(within.span), title).label("remove this");
            self.report(
                diagnostic.note("it says how long after an alarm began a hazard still counts as foreseen by it"),
            );
        }
    }

    /// The position of a monitor.
    fn monitor_named(&mut self, of: &'a ast::Expression, expected: &str) -> Option<usize> {
        match &of.kind {
            ExpressionKind::Field(path) if path.is_name() => self.find(&path.topic, Kind::Monitor),
            _ => {
                self.not_named(of.span, expected);
                None
            }
        }
    }

    fn requirement_named(&mut self, of: &'a ast::Expression) -> Option<RequirementId> {
        match &of.kind {
            ExpressionKind::Field(path) if path.is_name() => {
                let index = self.find(&path.topic, Kind::Requirement)?;
                Some(RequirementId(u32::try_from(index).expect("a file has fewer than 2^32 declarations")))
            }
            _ => {
                self.not_named(of.span, "a requirement");
                None
            }
        }
    }

    fn part_named(&mut self, of: &'a ast::Expression, expected: &str) -> Option<(usize, MonitorPart, Span)> {
        let named = match &of.kind {
            ExpressionKind::Field(path) => path.part().map(|part| (&path.topic, part)),
            _ => None,
        };
        let Some((topic, part)) = named else {
            self.not_named(of.span, expected);
            return None;
        };
        let (eddi, found) = self.part((&topic.text, topic.span), (&part.text, part.span))?;
        Some((eddi, found, part.span))
    }

    fn not_named(&mut self, span: Span, expected: &str) {
        let title = format!("`{}` is not {}", self.text(span), expected.split(',').next().unwrap_or(expected));
        self.report(Diagnostic::new(Code::NOT_A_FORMULA, span, title).label(format!("expected {expected}")));
    }

    fn sends_mitigations(&mut self, eddi: usize, span: Span) -> Option<Score> {
        let monitor = self.eddis[eddi].as_ref()?;
        if monitor.otherwise.mitigation.is_some() {
            return Some(Score::Mitigations);
        }
        let title = format!("monitor `{}` has no mitigation", monitor.declaration.name);
        let diagnostic = Diagnostic::new(Code::BAD_MONITOR, span, title)
            .label("nothing is ever sent")
            .secondary(monitor.otherwise.declaration.span, "add `mitigate with …` here");
        self.report(diagnostic);
        None
    }

    fn not_a_state(&mut self, eddi: usize, span: Span) {
        let Some(monitor) = &self.eddis[eddi] else { return };
        let mut states: Vec<&str> =
            monitor.guarantees.iter().map(|guarantee| guarantee.declaration.name.as_str()).collect();
        states.push(&monitor.otherwise.declaration.name);
        let note = format!("the states of `{}` are {}", monitor.declaration.name, list(&states));
        let title = format!("`{}` is not a state of the monitor", self.text(span));
        let diagnostic = Diagnostic::new(Code::OTHER_KIND, span, title).label("expected a guarantee or the safe state");
        self.report(diagnostic.note(note));
    }

    // ----- parts of monitors

    /// Adds a metric for each part of each monitor.
    pub(super) fn metrics_of_parts(&mut self) {
        for (at, eddi) in self.eddis.iter().enumerate() {
            let Some(eddi) = eddi else { continue };
            for (part, declaration) in eddi.parts() {
                let name = format!("{}.{}", eddi.declaration.name, declaration.name);
                self.parts.insert((at, part), self.metrics.len());
                self.metrics.push(Some(Metric {
                    declaration: model::Declaration { name, ..declaration.clone() },
                    unit: None,
                    direction: None,
                    default: None,
                    initial: None,
                    trend: None,
                    accepts_not_finite: false,
                    source: MetricSource::Monitor(EddiId::from_index(at), Score::Holds { part }),
                }));
            }
        }
    }

    /// Whether a path means a part of a monitor. Reports nothing.
    pub(super) fn is_part(&self, path: &Path) -> bool {
        if path.part().is_none() {
            return false;
        }
        match self.names.get(path.topic.text.as_str()) {
            Some(definition) => definition.kind == Kind::Monitor,
            None => most_similar(&path.topic.text, self.names_of(Kind::Monitor)).is_some(),
        }
    }

    /// The metric of a part of a monitor, of which a path [is](Self::is_part) one.
    pub(super) fn metric_of_path(&mut self, path: &'a Path) -> Option<usize> {
        let part = path.part()?;
        let part = self.part((&path.topic.text, path.topic.span), (&part.text, part.span))?;
        self.parts.get(&part).copied()
    }

    /// The metric of a part of a monitor, of which a name with a dot is one.
    pub(super) fn metric_of_part(&mut self, name: &'a Name) -> Option<usize> {
        let (monitor, part) = name.text.split_once('.')?;
        let dot = name.span.lo + u32::try_from(monitor.len()).expect("files are small");
        let [before, behind] = [Span { hi: dot, ..name.span }, Span { lo: dot + 1, ..name.span }];
        let part = self.part((monitor, before), (part, behind))?;
        self.parts.get(&part).copied()
    }

    /// A part of a monitor by the two names, with the position of the monitor.
    fn part(
        &mut self,
        (monitor, monitor_span): (&'a str, Span),
        (part, part_span): (&'a str, Span),
    ) -> Option<(usize, MonitorPart)> {
        let index = self.find_text(monitor, monitor_span, Kind::Monitor)?;
        let eddi = self.eddis[index].as_ref()?;
        if let Some((found, _)) = eddi.parts().find(|(_, declaration)| declaration.name == part) {
            return Some((index, found));
        }
        let known: Vec<&str> = eddi.parts().map(|(_, declaration)| declaration.name.as_str()).collect();
        let title = format!("monitor `{monitor}` has no evidence, demand or guarantee named `{part}`");
        let diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, part_span, title)
            .label("not found in this monitor")
            .secondary(eddi.declaration.span, "the monitor is declared here");
        let diagnostic = match most_similar(part, known.iter().copied()) {
            Some(similar) => diagnostic.did_you_mean(part_span, similar),
            None => diagnostic.note(format!("its parts are {}", list(&known))),
        };
        self.report(diagnostic);
        None
    }

    /// Whether a metric is 1 or 0 by being true or false.
    pub(super) fn is_truth(metric: &Metric) -> bool {
        matches!(metric.source, MetricSource::Monitor(_, Score::Holds { .. }))
    }

    // ----- scores of scores

    /// A hazard is what happens to the system: a requirement on a score of hazards has none. So no score depends on
    /// itself.
    pub(super) fn hazards_of_scores(&mut self, requirements: &[Option<model::Requirement>]) {
        for (at, written) in self.file.metrics.iter().enumerate() {
            let Some(requirement) = self.scored_requirement(at) else { continue };
            let Some(Some(bounded)) = requirements.get(requirement) else { continue };
            if self.scored_requirement(bounded.metric.index()).is_none() {
                continue;
            }
            let name = &written.head.name;
            let mut span = name.span;
            if let ast::MetricSource::Formula(formula) = &written.source
                && let ast::FormulaKind::Plain(whole) = &formula.kind
                && let ExpressionKind::Call(_, arguments) = &whole.kind
                && let Some(argument) = arguments.get(1)
            {
                span = argument.span;
            }
            let of = self.text(span);
            let title = if self.leads_back(at, requirements) {
                format!("metric `{}` depends on itself through requirement `{of}`", name.text)
            } else {
                format!("requirement `{of}` has no hazards: it bounds a score of hazards")
            };
            let diagnostic = Diagnostic::new(Code::CIRCLE, span, title)
                .label("expected a requirement on what happens to the system")
                .secondary(bounded.declaration.span, "this requirement bounds how well a monitor foresees hazards");
            self.report(diagnostic);
        }
    }

    /// Whether the requirements of scores lead from a metric back to it.
    fn leads_back(&self, metric: usize, requirements: &[Option<model::Requirement>]) -> bool {
        let mut at = metric;
        for _ in 0..self.metrics.len() {
            let next = self.scored_requirement(at).and_then(|requirement| requirements.get(requirement)?.as_ref());
            let Some(next) = next else { return false };
            at = next.metric.index();
            if at == metric {
                return true;
            }
        }
        false
    }

    /// The position of the requirement whose hazards a metric counts.
    fn scored_requirement(&self, metric: usize) -> Option<usize> {
        match self.metrics[metric].as_ref()?.source {
            MetricSource::Monitor(_, score) => score.requirement().map(RequirementId::index),
            _ => None,
        }
    }
}
