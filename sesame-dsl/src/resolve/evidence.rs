//! What the guarantees of runtime monitors rely on: evidence, and the gates that combine it.

use std::collections::BTreeMap;

use super::Resolver;
use super::depth;
use super::eddi::{Member, Members};
use super::examples;
use super::formula::MAX_DEPTH;
use super::parts::first_part;
use super::read::{Remembers, memory_named};
use super::words::{list, type_in_words};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::eddi::{Evidence, Gate, Guarantee, Stale, StaleIs};
use crate::model::{self, Comparison, Condition, Expression, Input, TextTest, Type};
use crate::similar::most_similar;
use crate::span::Span;
use crate::syntax::ast::eddi as written;
use crate::syntax::ast::{self, ExpressionKind, Name, Path};
use crate::units::Unit;
use sesame_plan::Monitor;

impl<'a> Resolver<'a> {
    pub(super) fn evidence(&mut self, evidence: &'a written::Evidence) -> Option<Evidence> {
        let mut inputs = Vec::new();
        let before = self.diagnostics.len();
        let condition = self.condition(&mut inputs, &evidence.condition);
        if condition.is_some() && inputs.is_empty() {
            // That its comparisons are constant is the same mistake as the one below.
            self.diagnostics.truncate(before);
        }
        let seconds = Unit::seconds();
        let held = match self.single(&evidence.held, "held") {
            Some(held) => self.positive(held, &seconds, "the time that evidence must hold"),
            None => Some(0.0),
        };
        let stale = match self.single(&evidence.stale, "stale after") {
            Some(written::Stale { after, unknown, all }) => {
                let is = if *unknown { StaleIs::Unknown } else { StaleIs::False };
                let after = self.positive(after, &seconds, "the age of evidence");
                after.map(|after| Some(Stale { after, is, all: *all }))
            }
            None => Some(None),
        };
        let condition = condition?;
        if inputs.is_empty() {
            let title = "this evidence reads no topic";
            let diagnostic = Diagnostic::new(Code::NOT_A_FORMULA, evidence.condition.span, title);
            self.report(
                diagnostic
                    .label("this condition is constant")
                    .note("evidence is a condition on messages, so it must name a topic"),
            );
            return None;
        }
        self.at_most_one(&evidence.inbound, "inbound");
        self.elements_fit(&inputs, Some("evidence"), evidence.condition.span)?;
        self.one_condition(&evidence.condition, &condition)?;
        Some(Evidence {
            declaration: self.declaration(&evidence.head),
            inputs,
            condition,
            held: held?,
            stale: stale?,
            inbound: !evidence.inbound.is_empty(),
        })
    }

    /// Evidence is a single condition, and changes with messages only.
    fn one_condition(&mut self, written: &'a ast::Expression, condition: &Condition) -> Option<()> {
        let each = first_part(written, &|part| match &part.kind {
            ExpressionKind::Members(ast::Members::Each | ast::Members::EachPair, word, path) => {
                Some((*word, path.span))
            }
            _ => None,
        });
        if let Some((word, path)) = each {
            let title = "evidence is a single condition, but this has one for each member of a group";
            let diagnostic = Diagnostic::new(Code::BAD_MONITOR, word.to(path), title)
                .label("expected one value")
                .note("without `each of` it is the least value of all members, with `max of` the greatest");
            self.report(diagnostic);
            return None;
        }
        if condition.reads_time() {
            let found = first_part(written, &|part| match &part.kind {
                ExpressionKind::Field(path) => self.named_clock(path).map(|clock| (path.span, Some(clock))),
                ExpressionKind::Call(name, _) if memory_named(&name.text) == Some(Remembers::Integral) => {
                    Some((part.span, None))
                }
                _ => None,
            });
            let (span, clock) = found.expect("what reads the time has a word for it or an integral");
            let (what, note) = match clock {
                None => (
                    "an integral, which grows between messages",
                    "a metric can, such as `max(integral(power))`, and a requirement on that",
                ),
                Some(clock) => (clock.means, "`held` says how long it must hold, and `stale after` when it is too old"),
            };
            let diagnostic = Diagnostic::new(Code::BAD_MONITOR, span, format!("evidence cannot read {what}"))
                .label("evidence changes when messages arrive")
                .note(note);
            self.report(diagnostic);
            return None;
        }
        if condition.reads_scene() {
            let scene = first_part(written, &|part| match &part.kind {
                ExpressionKind::Field(path) => self.scene_at(path).map(|_| path.span),
                _ => None,
            });
            let title = "evidence cannot read a parameter of the space";
            let diagnostic = Diagnostic::new(Code::BAD_MONITOR, scene.unwrap_or(written.span), title)
                .label("a monitor hears messages only")
                .note("it also runs where no test chooses a value: let the simulator publish this on a topic");
            self.report(diagnostic);
            return None;
        }
        if depth::of_condition(condition) > MAX_DEPTH {
            self.too_deep("condition", written.span);
            return None;
        }
        Some(())
    }

    /// The evidence of a monitor whose state a field says: for each of its guarantees whether the field says that one.
    pub(super) fn evidence_of_states(&mut self, eddi: &'a written::Eddi, path: &'a Path) -> Option<Vec<Evidence>> {
        let declared =
            eddi.demands.iter().map(|demand| &demand.head).chain(eddi.evidence.iter().map(|evidence| &evidence.head));
        for head in declared {
            let title = format!("the state of `{}` is what `{}` says", eddi.head.name.text, self.text(path.span));
            let diagnostic = Diagnostic::new(Code::BAD_MONITOR, head.full_span, title)
                .label("so this decides nothing")
                .secondary(path.span, "its state is read from here")
                .note("without `on …`, an external monitor has evidence like any other");
            self.report(diagnostic);
        }
        let (field, ty) = self.field(path)?;
        let group = self.members_of(&field) > 1;
        if group || !matches!(ty, Type::Bool | Type::Int(None) | Type::Text) {
            let is = if group { "a group of topics".to_owned() } else { type_in_words(&ty) };
            let title = format!("`{}` cannot say the state of a monitor", self.text(path.span));
            let diagnostic = Diagnostic::new(Code::WRONG_TYPE, path.span, title).label(format!("it is {is}")).note(
                "it must be a `bool` (whether the guarantee holds), an `int` (its integrity) or a `text` (its name)",
            );
            self.report(diagnostic);
            return None;
        }
        if let (Type::Bool, [_, second, ..]) = (&ty, eddi.guarantees.as_slice()) {
            let title = format!("`{}` only says whether one guarantee holds", self.text(path.span));
            let diagnostic = Diagnostic::new(Code::BAD_MONITOR, second.head.name.span, title)
                .label("this is a second one")
                .secondary(path.span, "it is a `bool`")
                .note("where each guarantee has a topic, leave out `on …` and write `evidence` for each of them");
            self.report(diagnostic);
            return None;
        }
        let says = |guarantee: &written::Guarantee| {
            let (text, condition) = match &ty {
                Type::Text => (Some(TextTest::Is(guarantee.head.name.text.clone())), Condition::Input(0)),
                Type::Bool => (None, Condition::Input(0)),
                _ => {
                    let right = Expression::Constant(guarantee.integrity.value? as f64);
                    (None, Condition::Compare { left: Expression::Input(0), by: Comparison::Equal, right })
                }
            };
            Some(Evidence {
                declaration: self.declaration(&guarantee.head),
                inputs: vec![Input {
                    field: field.clone(),
                    members: model::Members::Min,
                    list: None,
                    text,
                    memory: Vec::new(),
                }],
                condition,
                held: 0.0,
                stale: None,
                inbound: false,
            })
        };
        eddi.guarantees.iter().map(says).collect()
    }

    /// A quantity greater than zero.
    pub(super) fn positive(&mut self, quantity: &ast::Quantity, unit: &Unit, what: &str) -> Option<f64> {
        let title = format!("`{}` is out of range for {what}", self.text(quantity.span));
        self.above_zero(quantity, unit, what, &title)
    }

    /// `said_by`: the field that says the state of the monitor, so that its guarantees need nothing else.
    pub(super) fn guarantees(
        &mut self,
        eddi: &'a written::Eddi,
        members: &Members<'a>,
        said_by: Option<&Path>,
    ) -> Option<Vec<Guarantee>> {
        let mut first: BTreeMap<u32, Span> = BTreeMap::new();
        let mut guarantees = Vec::new();
        let mut complete = true;
        for (at, guarantee) in (0..).zip(&eddi.guarantees) {
            let gate = self.gate_of(eddi, members, guarantee, said_by.map(|path| (path, at)));
            let integrity = self.count(guarantee.integrity, 1, "the integrity of a guarantee");
            if let Some(integrity) = integrity {
                if let Some(&before) = first.get(&integrity) {
                    let title = format!("two guarantees have integrity {integrity}");
                    let diagnostic = Diagnostic::new(Code::BAD_MONITOR, guarantee.integrity.span, title)
                        .label("used again here")
                        .secondary(before, "first used here")
                        .note("the state of a monitor is the strongest guarantee that holds, so no two can be equally strong");
                    self.report(diagnostic);
                    complete = false;
                }
                first.entry(integrity).or_insert(guarantee.integrity.span);
            }
            match (gate, integrity) {
                (Some(gate), Some(integrity)) => {
                    let declaration = self.declaration(&guarantee.head);
                    guarantees.push(Guarantee { declaration, integrity, gate });
                }
                _ => complete = false,
            }
        }
        let gates: usize = guarantees.iter().map(|guarantee| guarantee.gate.size()).sum();
        if gates > Monitor::MOST_GATES {
            let title = format!("the guarantees have {gates} parts, but the limit is {}", Monitor::MOST_GATES);
            self.report(Diagnostic::new(Code::TOO_LARGE, eddi.head.name.span, title).label("too many"));
            complete = false;
        }
        complete.then_some(guarantees)
    }

    fn gate_of(
        &mut self,
        eddi: &'a written::Eddi,
        members: &Members<'a>,
        guarantee: &'a written::Guarantee,
        said_by: Option<(&Path, u32)>,
    ) -> Option<Gate> {
        let gate = match (&guarantee.gate, said_by) {
            (None, Some((_, at))) => return Some(Gate::Evidence(at)),
            (Some(gate), Some((path, _))) => {
                let title = format!("`{}` says whether this guarantee holds", self.text(path.span));
                let diagnostic = Diagnostic::new(Code::BAD_MONITOR, gate.span, title)
                    .label("so it needs nothing else")
                    .secondary(path.span, "its state is read from here");
                let from = Span { lo: guarantee.integrity.span.hi, ..gate.span };
                self.report(diagnostic.suggest("remove what it needs", from, ""));
                return None;
            }
            (None, None) => {
                let name = &guarantee.head.name;
                let title = format!("`{}` is missing what it needs", name.text);
                let diagnostic = Diagnostic::new(Code::CLAUSE_MISSING, name.span, title).label("add what it needs");
                self.report(match examples::of_evidence(eddi) {
                    Some(evidence) => {
                        let needs = format!("= {evidence}");
                        let after = guarantee.integrity.span.end();
                        diagnostic.suggest(format!("add `{needs}`"), after, format!(" {needs}"))
                    }
                    None => diagnostic.note("declare a condition on messages as `evidence`, and name it after a `=`"),
                });
                return None;
            }
            (Some(gate), None) => gate,
        };
        let resolved = self.gate(eddi, members, gate)?;
        let depth = resolved.depth();
        if depth > Gate::MOST_DEPTH {
            let title = format!("this guarantee has {depth} levels, but the limit is {}", Gate::MOST_DEPTH);
            self.report(Diagnostic::new(Code::TOO_LARGE, gate.span, title).label("nested too deeply"));
            return None;
        }
        Some(resolved)
    }

    fn gate(
        &mut self,
        eddi: &'a written::Eddi,
        members: &Members<'a>,
        expression: &'a ast::Expression,
    ) -> Option<Gate> {
        let (parts, count) = match &expression.kind {
            ExpressionKind::All(parts) | ExpressionKind::Any(parts) => (parts, None),
            ExpressionKind::AtLeast(count, parts) => (parts, Some(*count)),
            ExpressionKind::Field(path) if path.is_name() => {
                return self.gate_member(eddi, members, &path.topic);
            }
            _ => {
                let title = "a guarantee can only combine evidence and demands, with `and`, `or` and `2 of (…, …, …)`";
                let diagnostic = Diagnostic::new(Code::BAD_MONITOR, expression.span, title);
                self.report(
                    diagnostic
                        .label("expected evidence or a demand")
                        .note("declare a condition on messages as `evidence`, which gives it a name"),
                );
                return None;
            }
        };
        let count = match count {
            Some(count) => self.enough(expression, count, parts.len()).map(Some),
            None => Some(None),
        };
        // All are resolved, so that a mistake in one does not hide one in another.
        let parts: Vec<Option<Gate>> = parts.iter().map(|part| self.gate(eddi, members, part)).collect();
        let parts = parts.into_iter().collect::<Option<Vec<Gate>>>()?;
        Some(match (&expression.kind, count?) {
            (_, Some(count)) => Gate::AtLeast { count, of: parts },
            (ExpressionKind::All(_), None) => Gate::All(parts),
            _ => Gate::Any(parts),
        })
    }

    /// How many of so many parts are to hold.
    fn enough(&mut self, whole: &ast::Expression, count: ast::Count, parts: usize) -> Option<u32> {
        let found = self.count(count, 1, "the number of parts that must hold")?;
        if parts < 2 {
            let title = format!("`{}` has one part only", self.text(whole.span));
            let label = "expected two or more between the parentheses";
            self.report(Diagnostic::new(Code::BAD_MONITOR, whole.span, title).label(label));
            return None;
        }
        if found as usize > parts {
            let title = format!("{found} of {parts} parts can never hold");
            let label = format!("expected {parts} or less");
            self.report(Diagnostic::new(Code::BAD_COUNT, count.span, title).label(label));
            return None;
        }
        Some(found)
    }

    fn gate_member(&mut self, eddi: &'a written::Eddi, members: &Members<'a>, name: &Name) -> Option<Gate> {
        match members.get(name.text.as_str()) {
            Some((Member::Evidence(at), _)) => return Some(Gate::Evidence(*at)),
            Some((Member::Demand(at), _)) => return Some(Gate::Demand(*at)),
            Some((Member::State, declared)) => {
                let title = format!("`{}` is a state of the monitor, not evidence or a demand", name.text);
                let diagnostic = Diagnostic::new(Code::OTHER_KIND, name.span, title)
                    .label("expected evidence or a demand")
                    .secondary(*declared, "declared here");
                self.report(diagnostic);
                return None;
            }
            None => {}
        }
        let known: Vec<&str> = members
            .iter()
            .filter(|(_, (member, _))| !matches!(member, Member::State))
            .map(|(known, _)| *known)
            .collect();
        if eddi.has_errors {
            return None;
        }
        let title = format!("monitor `{}` has no evidence or demand named `{}`", eddi.head.name.text, name.text);
        let mut diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, name.span, title).label("not found in this monitor");
        diagnostic = match most_similar(&name.text, known.iter().copied()) {
            Some(similar) => diagnostic.did_you_mean(name.span, similar),
            None if known.is_empty() => diagnostic.note("it has no evidence and no demands"),
            None => diagnostic.note(format!("its evidence and demands are {}", list(&known))),
        };
        self.report(diagnostic);
        None
    }
}
