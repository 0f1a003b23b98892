//! Runtime monitors.

use std::collections::BTreeMap;

use super::{Kind, Resolver, examples};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::eddi::{Demand, Eddi, Mitigation, MitigationValue, Otherwise};
use crate::model::{EddiId, Id as _, TopicId, Type};
use crate::similar::most_similar;
use crate::span::Span;
use crate::syntax::ast::eddi::{self as written, State};
use crate::syntax::ast::{self, Name};
use sesame_plan::{Channel, Monitor};

/// The names inside a monitor, and what each stands for.
pub(super) type Members<'a> = BTreeMap<&'a str, (Member, Span)>;

#[derive(Clone, Copy)]
pub(super) enum Member {
    Evidence(u32),
    Demand(u32),
    /// A guarantee, or the state when none holds.
    State,
}

impl<'a> Resolver<'a> {
    pub(super) fn eddis(&mut self) -> Vec<Option<Eddi>> {
        let file = self.file;
        self.cycles_of_demands();
        self.not_too_many(&file.eddis, "monitors", |eddi| eddi.head.name.span);
        file.eddis.iter().map(|eddi| self.eddi(eddi)).collect()
    }

    fn eddi(&mut self, eddi: &'a written::Eddi) -> Option<Eddi> {
        let name = &eddi.head.name;
        let members = self.members_of_eddi(eddi);
        let publishes = match &eddi.state {
            State::Published(name) => self.published(name).map(Some),
            State::External(..) => Some(None),
        };
        let said_by = match &eddi.state {
            State::External(_, Some(path)) => Some(path),
            _ => None,
        };
        self.not_too_many(&eddi.demands, "demands", |demand| demand.head.name.span);
        self.not_too_many(&eddi.evidence, "pieces of evidence", |evidence| evidence.head.name.span);
        self.not_too_many(&eddi.guarantees, "guarantees", |guarantee| guarantee.head.name.span);
        let demands: Vec<_> = eddi.demands.iter().map(|demand| self.demand(demand)).collect();
        let evidence = if let Some(path) = said_by {
            self.evidence_of_states(eddi, path)
        } else {
            // All are resolved, so that a mistake in one does not hide one in another.
            let evidence: Vec<_> = eddi.evidence.iter().map(|evidence| self.evidence(evidence)).collect();
            evidence.into_iter().collect()
        };
        let mut guarantees = self.guarantees(eddi, &members, said_by);
        if eddi.otherwise.is_empty() && !eddi.has_errors {
            self.missing(name.span, &name.text, "its state when no guarantee holds", "otherwise not_safe");
        }
        let otherwise = self.single(&eddi.otherwise, "otherwise").and_then(|otherwise| self.otherwise(otherwise));
        self.nothing_is_sent(eddi);
        if eddi.guarantees.is_empty() && !eddi.has_errors {
            match examples::of_guarantee(eddi) {
                Some(example) => self.missing(name.span, &name.text, "a guarantee", &example),
                None => self.report(
                    Diagnostic::new(Code::CLAUSE_MISSING, name.span, format!("`{}` is missing a guarantee", name.text))
                        .label("add a guarantee")
                        .note("declare a condition on messages as `evidence` first, which a guarantee then needs"),
                ),
            }
            return None;
        }
        if let Some(guarantees) = &mut guarantees {
            guarantees.sort_by_key(|guarantee| std::cmp::Reverse(guarantee.integrity));
        }
        Some(Eddi {
            declaration: self.declaration(&eddi.head),
            publishes: publishes?,
            demands: demands.into_iter().collect::<Option<_>>()?,
            evidence: evidence?,
            guarantees: guarantees?,
            otherwise: otherwise?,
        })
    }

    fn published(&mut self, name: &'a Name) -> Option<TopicId> {
        let index = self.find(name, Kind::Topic)?;
        if !self.is_of_no_service(TopicId::from_index(index), name.span, "a monitor cannot publish its state") {
            return None;
        }
        let topic = self.system.topics[index].as_ref()?;
        let carries = |ty: &Type| matches!(ty, Type::Bool | Type::Int(None) | Type::Text);
        let fits = match topic.ty {
            // As most messages of ROS are that carry one value.
            Type::Message(id) => match &self.system.messages[id.index()].as_ref()?.fields[..] {
                [only] => carries(&only.ty),
                _ => false,
            },
            ref ty => carries(ty),
        };
        if fits && topic.paths.len() == 1 {
            return Some(TopicId::from_index(index));
        }
        let is =
            if topic.paths.len() > 1 { "a group of topics".to_owned() } else { super::words::type_in_words(&topic.ty) };
        let title = format!("a monitor cannot publish its state on `{}`", name.text);
        let diagnostic = Diagnostic::new(Code::WRONG_TYPE, name.span, title).label(format!("it is {is}"));
        self.report(diagnostic.note(
            "the topic must be of type `bool` (whether a guarantee holds), `int` (its integrity) or `text` (its name), \
             or a message of one such field",
        ));
        None
    }

    /// Refuses one direction of a service: a runner calls no services, and no client waits for an answer of a monitor.
    fn is_of_no_service(&mut self, topic: TopicId, span: Span, what: &str) -> bool {
        let Some(topic) = &self.system.topics[topic.index()] else { return false };
        let direction = match topic.channel {
            Channel::Topic => return true,
            Channel::Request => "requests",
            Channel::Reply => "replies",
        };
        let (name, path) = (&topic.declaration.name, &topic.written);
        let title = format!("{what} on `{name}`, which is a service's");
        let diagnostic = Diagnostic::new(Code::BAD_MONITOR, span, title)
            .label(format!("these are the {direction} of the service `{path}`"))
            .note(
                "a monitor neither calls a service nor answers for one; name a topic to which a node of the system \
                 subscribes",
            );
        self.report(diagnostic);
        false
    }

    /// An external monitor does what it does; the runner sends nothing in its place.
    fn nothing_is_sent(&mut self, eddi: &'a written::Eddi) {
        let State::External(external, _) = &eddi.state else { return };
        for (path, _) in eddi.otherwise.iter().filter_map(|(_, otherwise)| otherwise.mitigation.as_ref()) {
            let title = format!("external monitor `{}` cannot have a mitigation", eddi.head.name.text);
            let diagnostic = Diagnostic::new(Code::BAD_MONITOR, path.span, title)
                .label("remove `mitigate with`")
                .secondary(*external, "the system decides and acts by itself, the runner only scores it");
            self.report(diagnostic);
        }
    }

    /// Reports more parts than a plan may have.
    fn not_too_many<T>(&mut self, parts: &'a [T], what: &str, span: impl Fn(&T) -> Span) {
        let most = Monitor::MOST_PARTS;
        if let Some(beyond) = parts.get(most) {
            let title = format!("there are {} {what}, but the limit is {most}", parts.len());
            self.report(Diagnostic::new(Code::TOO_LARGE, span(beyond), title).label("too many"));
        }
    }

    fn members_of_eddi(&mut self, eddi: &'a written::Eddi) -> Members<'a> {
        let mut members: Members<'a> = BTreeMap::new();
        let demands = (0..).zip(&eddi.demands).map(|(at, demand)| (&demand.head.name, Member::Demand(at)));
        let evidence = (0..).zip(&eddi.evidence).map(|(at, evidence)| (&evidence.head.name, Member::Evidence(at)));
        let states = eddi.guarantees.iter().map(|guarantee| &guarantee.head.name);
        let states = states.chain(eddi.otherwise.iter().map(|(_, otherwise)| &otherwise.head.name));
        let mut all: Vec<_> = demands.chain(evidence).chain(states.map(|name| (name, Member::State))).collect();
        all.sort_by_key(|(name, _)| name.span);
        for (name, member) in all {
            if let Some(&(_, first)) = members.get(name.text.as_str()) {
                let title = format!("`{}` is defined twice in monitor `{}`", name.text, eddi.head.name.text);
                self.defined_twice(title, name.span, first);
            } else {
                members.insert(&name.text, (member, name.span));
            }
        }
        members
    }

    /// A demand names a guarantee of another monitor.
    fn demand(&mut self, demand: &'a written::Demand) -> Option<Demand> {
        let name = &demand.head.name;
        let index = self.find(&demand.eddi, Kind::Monitor)?;
        let other = &self.file.eddis[index];
        let guarantees: Vec<&str> =
            other.guarantees.iter().map(|guarantee| guarantee.head.name.text.as_str()).collect();
        if !guarantees.contains(&name.text.as_str()) && !other.has_errors {
            let title = format!("monitor `{}` has no guarantee named `{}`", demand.eddi.text, name.text);
            let mut diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, name.span, title)
                .label("unknown guarantee")
                .secondary(other.head.name.span, "the monitor is declared here");
            diagnostic = match most_similar(&name.text, guarantees.iter().copied()) {
                Some(similar) => diagnostic.did_you_mean(name.span, similar),
                None if guarantees.is_empty() => diagnostic.note("it has no guarantees"),
                None => diagnostic.note(format!("its guarantees are {}", super::words::list(&guarantees))),
            };
            self.report(diagnostic);
            return None;
        }
        Some(Demand { declaration: self.declaration(&demand.head), eddi: EddiId::from_index(index) })
    }

    /// Reports monitors whose state depends on itself.
    fn cycles_of_demands(&mut self) {
        let file = self.file;
        let demanded = |index: usize| {
            let names = file.eddis[index].demands.iter().map(|demand| &demand.eddi);
            names.filter_map(|name| {
                let definition = self.names.get(name.text.as_str())?;
                (definition.kind == Kind::Monitor).then_some((definition.index, name.span))
            })
        };
        let edges: Vec<Vec<(usize, Span)>> = (0..file.eddis.len()).map(|index| demanded(index).collect()).collect();
        // Monitors that remain when those without open demands are removed are in a cycle, or depend on one.
        let mut settled = vec![false; edges.len()];
        let mut before = usize::MAX;
        let mut open = edges.len();
        while open < before {
            before = open;
            for index in 0..edges.len() {
                if !settled[index] && edges[index].iter().all(|&(to, _)| settled[to]) {
                    settled[index] = true;
                    open -= 1;
                }
            }
        }
        let mut told = vec![false; edges.len()];
        for start in 0..edges.len() {
            if settled[start] || told[start] {
                continue;
            }
            let mut chain: Vec<(usize, Span)> = Vec::new();
            let mut at = start;
            while !chain.iter().any(|&(member, _)| member == at) && !told[at] {
                let Some(&(to, span)) = edges[at].iter().find(|&&(to, _)| !settled[to]) else { break };
                chain.push((at, span));
                at = to;
            }
            for &(member, _) in &chain {
                told[member] = true;
            }
            let Some(begin) = chain.iter().position(|&(member, _)| member == at) else { continue };
            let name = |index: usize| &file.eddis[index].head.name;
            let cycle = &chain[begin..];
            let through: Vec<&str> = cycle[1..].iter().map(|&(member, _)| name(member).text.as_str()).collect();
            let first = name(cycle[0].0);
            let title = if through.is_empty() {
                format!("monitor `{}` depends on itself", first.text)
            } else {
                format!("monitor `{}` depends on itself through {}", first.text, super::words::list(&through))
            };
            let closing = cycle[cycle.len() - 1].1;
            let mut diagnostic = Diagnostic::new(Code::CIRCLE, closing, title).label("this demand closes the cycle");
            if !through.is_empty() {
                diagnostic = diagnostic.secondary(first.span, "declared here");
            }
            self.report(diagnostic);
        }
    }

    fn otherwise(&mut self, otherwise: &'a written::Otherwise) -> Option<Otherwise> {
        let mitigation = match &otherwise.mitigation {
            Some((path, value)) => Some(self.mitigation(path, value)?),
            None => None,
        };
        Some(Otherwise { declaration: self.declaration(&otherwise.head), mitigation })
    }

    fn mitigation(&mut self, path: &'a ast::Path, value: &'a written::Mitigation) -> Option<Mitigation> {
        let (field, ty) = self.field(path)?;
        if !self.is_of_no_service(field.topic, path.span, "a monitor cannot send its mitigation") {
            return None;
        }
        let what = format!("`{}`", self.text(path.span));
        let value = match (value, ty) {
            (written::Mitigation::Truth(truth, _), Type::Bool) => MitigationValue::Bool(*truth),
            (written::Mitigation::Text(text), Type::Text) => MitigationValue::Text(text.text.clone()),
            (written::Mitigation::Number(number), Type::Real(unit)) => {
                MitigationValue::Real(self.value(number, unit.as_ref(), &what)?)
            }
            (written::Mitigation::Number(number), Type::Int(unit)) => {
                let value = self.value(number, unit.as_ref(), &what)?;
                if !self.whole(value, number.span, &what) {
                    return None;
                }
                #[expect(clippy::cast_possible_truncation, reason = "it is whole and at most 2^53")]
                MitigationValue::Int(value as i64)
            }
            (value, ty) => {
                let span = match value {
                    written::Mitigation::Truth(_, span) => *span,
                    written::Mitigation::Number(number) => number.span,
                    written::Mitigation::Text(text) => text.span,
                };
                let title = format!("`{}` cannot be the value of {what}", self.text(span));
                let label = format!("{what} is {}", super::words::type_in_words(&ty));
                self.report(Diagnostic::new(Code::WRONG_TYPE, span, title).label(label));
                return None;
            }
        };
        Some(Mitigation { field, value })
    }
}
