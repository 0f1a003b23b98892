//! From syntax to model, in passes:
//!
//! 1. [`collect`] collects names, and reports duplicates and missing declarations
//! 2. [`system`] resolves message types (ordered so that each follows those it contains), topics, the simulator, and
//!    [`nodes`] nodes, with what they serve and call ([`served`]); [`groups`] says what paths stand for; [`ros2`],
//!    [`ros_types`] and [`services`] resolve those of ROS, [`bus`] addresses, [`mavlink`] what its files define
//! 3. [`eddi`] resolves runtime monitors, with their [`evidence`]
//! 4. [`metrics`] resolves metrics and requirements; [`formula`] resolves formulas, with [`function`], [`geometry`],
//!    [`region`] and [`members`]; [`score`] what is said of monitors
//! 5. [`fuzz`] resolves operations ([`disturbance`] their targets and parameters, [`chosen`] the members of groups on
//!    which they act, [`custom`] those in the user's code, [`scene`] what a scenario is) and tests
//! 6. [`campaign`] resolves campaigns, whose inherited clauses [`inherit`] has copied before all else; [`condition`]
//!    resolves the conditions of tests and the building blocks of campaigns' conditions, by what is [`known`] of
//!    metrics; [`contained`] what operations require of such conditions
//! 7. [`physical`] resolves labs, and [`lifecycle`] the rest of a system's clauses
//! 8. [`certificates`] checks what monitors say
//!
//! Each pass reports all it finds. A declaration with a mistake is `None` from then on, and references to it are not
//! reported again: one mistake is one diagnostic.

mod boolean;
mod bus;
mod campaign;
mod certificates;
mod chosen;
mod collect;
mod condition;
mod confirmation;
mod constants;
mod contained;
mod counted;
mod coverage;
mod custom;
mod depth;
mod disturbance;
mod eddi;
mod elements;
mod evidence;
mod examples;
mod exploration;
mod formula;
mod function;
mod fuzz;
mod geometry;
mod groups;
mod inherit;
mod known;
mod lengths;
mod lifecycle;
mod mavlink;
mod members;
mod memory;
mod message_types;
mod metrics;
mod nodes;
mod parts;
mod physical;
mod placeholders;
mod proxy;
mod quantity;
mod read;
mod region;
mod resource;
mod robustness;
mod ros2;
mod ros_types;
mod scene;
mod score;
mod served;
mod services;
mod simulator;
mod stop;
mod system;
mod words;
mod wrapped;

use std::collections::{BTreeMap, BTreeSet};

use crate::diagnostic::{Code, Diagnostic, Severity, Suggestion};
use crate::import::Merged;
use crate::index::Kind;
use crate::interfaces::Interfaces;
use crate::model::eddi::MonitorPart;
use crate::model::{self, Arena, Declaration, Id, Space};
use crate::similar::most_similar;
use crate::source::SourceMap;
use crate::span::{FileId, Span};
use crate::syntax::ast::{self, Name};

use ros_types::RosTypes;
pub(crate) use words::list;

/// Resolves the files of a space. `None` exactly when there is an error, be it in `diagnostics` before or after. Adds
/// to `undecided` what could not be decided about monitors, whose certificates are checked only if it is there.
pub(crate) fn resolve(
    sources: &SourceMap,
    root: FileId,
    merged: Merged,
    interfaces: &dyn Interfaces,
    diagnostics: &mut Vec<Diagnostic>,
    undecided: Option<&mut Vec<(Span, String)>>,
) -> Option<Space> {
    let Merged { mut file, names, ranks } = merged;
    inherit::inherit(&mut file, diagnostics);
    let mut resolver = Resolver {
        sources,
        root,
        ranks: &ranks,
        file: &file,
        interfaces,
        diagnostics,
        names: BTreeMap::new(),
        silent: BTreeSet::new(),
        system: SystemPart::default(),
        metrics: Vec::new(),
        operations: Vec::new(),
        tests: Vec::new(),
        compared: Compared::default(),
        eddis: Vec::new(),
        parts: BTreeMap::new(),
        in_arguments: BTreeMap::new(),
    };
    resolver.collect();
    let simulator = resolver.system();
    let lifecycle = resolver.lifecycle();
    resolver.eddis = resolver.eddis();
    resolver.metrics();
    resolver.metrics_of_parts();
    let requirements = resolver.requirements();
    resolver.hazards_of_scores(&requirements);
    resolver.operations();
    resolver.tests(&requirements);
    let campaigns = resolver.campaigns();
    let physicals = resolver.physicals();
    if let Some(undecided) = undecided {
        undecided.extend(resolver.certificates());
    }

    let Resolver { system, metrics, operations, tests, eddis, diagnostics, .. } = resolver;
    if diagnostics.iter().any(|diagnostic| diagnostic.severity() == Severity::Error) {
        return None;
    }
    // Without an error every declaration is there.
    Some(Space {
        declaration: declaration(sources, file.spaces.first()?),
        simulator: simulator?,
        lifecycle: lifecycle?,
        messages: arena(system.messages)?,
        interfaces: system.ros.interfaces,
        topics: arena(system.topics)?,
        nodes: arena(system.nodes)?,
        metrics: arena(metrics)?,
        requirements: arena(requirements)?,
        operations: arena(operations)?,
        tests: arena(tests)?,
        campaigns: arena(campaigns)?,
        eddis: arena(eddis)?,
        physicals: arena(physicals)?,
        files: names,
    })
}

fn arena<I: Id, T>(items: Vec<Option<T>>) -> Option<Arena<I, T>> {
    let mut arena = Arena::new();
    for item in items {
        arena.push(item?);
    }
    Some(arena)
}

fn declaration(sources: &SourceMap, head: &ast::Head) -> Declaration {
    Declaration {
        name: head.name.text.clone(),
        span: head.name.span,
        line: sources.position(head.name.span).line,
        doc: head.doc.clone(),
    }
}

/// What a name stands for: the position among the declarations of its kind.
#[derive(Debug, Clone, Copy)]
struct Definition {
    kind: Kind,
    index: usize,
    span: Span,
}

#[derive(Default)]
struct SystemPart {
    /// In the order of ids, which is not that of the file; with those that types of ROS contain.
    messages: Vec<Option<model::Message>>,
    /// The number of values of each message, by its id.
    values: Vec<u64>,
    ros: RosTypes,
    /// Per message in the order of the file: its id.
    message_ids: Vec<model::MessageId>,
    topics: Vec<Option<model::Topic>>,
    /// Each member of a group of nodes is a node.
    nodes: Vec<Option<model::Node>>,
    /// Per declared node: the positions of its members in `nodes`, before these are there.
    node_ids: Vec<std::ops::Range<usize>>,
}

struct Resolver<'a> {
    sources: &'a SourceMap,
    root: FileId,
    /// The places of files in the order of declarations.
    ranks: &'a BTreeMap<FileId, usize>,
    file: &'a ast::File,
    interfaces: &'a dyn Interfaces,
    diagnostics: &'a mut Vec<Diagnostic>,
    names: BTreeMap<&'a str, Definition>,
    /// Names that are not reported again: broken where they are declared, or already reported as unknown.
    silent: BTreeSet<&'a str>,
    system: SystemPart,
    metrics: Vec<Option<model::Metric>>,
    operations: Vec<Option<model::Operation>>,
    tests: Vec<Option<model::Test>>,
    compared: Compared,
    eddis: Vec<Option<model::eddi::Eddi>>,
    /// The metrics of the parts of monitors.
    parts: BTreeMap<(usize, MonitorPart), usize>,
    /// The scenes that launched programs have in their arguments, with the first of these places.
    in_arguments: BTreeMap<String, Span>,
}

/// The most names that are compared with unknown ones in all.
const MOST_COMPARED: usize = 500_000;

/// How many names were compared with unknown ones, to suggest what was meant.
#[derive(Default)]
struct Compared(usize);

impl Compared {
    /// Whether another unknown name may be compared with this many. With many of both, the time would grow with their
    /// product, and after so many suggestions one more does not help.
    fn more(&mut self, with: usize) -> bool {
        self.0 = self.0.saturating_add(with);
        self.0 <= MOST_COMPARED
    }
}

impl<'a> Resolver<'a> {
    fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    fn text(&self, span: Span) -> &'a str {
        self.sources.snippet(span)
    }

    fn declaration(&self, head: &ast::Head) -> Declaration {
        declaration(self.sources, head)
    }

    /// The position of a name among the declarations of its kind.
    fn find(&mut self, name: &'a Name, kind: Kind) -> Option<usize> {
        if kind == Kind::Metric && name.text.contains('.') {
            return self.metric_of_part(name);
        }
        self.find_text(&name.text, name.span, kind)
    }

    fn find_text(&mut self, name: &'a str, span: Span, kind: Kind) -> Option<usize> {
        let word = kind.word();
        match self.names.get(name) {
            Some(definition) if definition.kind == kind => return Some(definition.index),
            Some(_) | None if self.silent.contains(name) => return None,
            Some(definition) => {
                let is = definition.kind.with_article();
                let title = format!("`{name}` is {is}, not {}", kind.with_article());
                let mut diagnostic = Diagnostic::new(Code::OTHER_KIND, span, title)
                    .label(format!("expected {}", kind.with_article()))
                    .secondary(definition.span, format!("declared as {is} here"));
                if (definition.kind, kind) == (Kind::Metric, Kind::Requirement) {
                    diagnostic = diagnostic.note(format!("or a bound on the metric, such as `{name} <= 0`"));
                }
                if kind == Kind::Topic
                    && let Some(topics) = self.topics_of(definition.kind, definition.index)
                {
                    let ast_topics = self.ast_topics().count();
                    let of_services = self.ast_services().flat_map(|service| [&service.request, &service.reply]);
                    let of_actions = self.ast_actions().flat_map(|action| &action.parts);
                    let names = of_services.chain(of_actions).map(|head| head.name.text.as_str());
                    let names: Vec<&str> = names.skip(topics.start - ast_topics).take(topics.len()).collect();
                    diagnostic = diagnostic.note(format!("its topics are {}", list(&names)));
                }
                self.report(diagnostic);
                return None;
            }
            None => {}
        }
        self.silent.insert(name);
        // An import that failed may have declared it.
        if self.file.incomplete {
            return None;
        }
        let mut diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, span, format!("no {word} named `{name}`"))
            .label("not found in this space");
        if !self.compared.more(self.names.len()) {
            self.report(diagnostic);
            return None;
        }
        let known = self.names_of(kind);
        if kind == Kind::Metric
            && name == "fuzzing_time"
            && let Some(declared) = self.declared_fuzzing_time(span)
        {
            diagnostic.suggestions.push(declared);
        } else if let Some(similar) = most_similar(name, known.iter().copied()) {
            diagnostic = diagnostic.did_you_mean(span, similar);
        } else if known.is_empty() {
            diagnostic = diagnostic.note(format!("this space declares no {word}s"));
        } else if known.len() <= 8 {
            let all = if known.len() == 1 { format!("the only {word}") } else { format!("the {word}s") };
            let verb = if known.len() == 1 { "is" } else { "are" };
            diagnostic = diagnostic.note(format!("{all} of this space {verb} {}", list(&known)));
        }
        self.report(diagnostic);
        None
    }

    /// The suggestion to declare the metric that every space can have, after the last metric or operation of
    /// the file that lacks it, or after its `space`.
    fn declared_fuzzing_time(&self, lacking: Span) -> Option<Suggestion> {
        const DECLARATION: &str = "metric fuzzing_time minimise = fuzzing_time()";
        let here = |head: &&ast::Head| head.full_span.file == lacking.file;
        let last = self.file.metrics.iter().map(|metric| &metric.head).rfind(here);
        let last = last.or_else(|| self.file.operations.iter().map(|operation| &operation.head).rfind(here));
        let last = last.or_else(|| self.file.spaces.iter().rfind(here))?.full_span;
        Some(Suggestion::possible(
            format!("add `{DECLARATION}`"),
            vec![(Span { lo: last.hi, ..last }, format!("\n{DECLARATION}"))],
        ))
    }

    fn names_of(&self, kind: Kind) -> Vec<&'a str> {
        let mut known: Vec<_> = self.names.iter().filter(|(_, definition)| definition.kind == kind).collect();
        known.sort_by_key(|(_, definition)| definition.span);
        known.into_iter().map(|(name, _)| *name).collect()
    }

    /// Finds each name of a list, and reports those that are listed twice.
    fn find_all(&mut self, names: &'a [Name], kind: Kind) -> Option<Vec<usize>> {
        let mut found: Vec<usize> = Vec::new();
        let mut first: BTreeMap<&str, Span> = BTreeMap::new();
        let mut complete = true;
        for name in names {
            if let Some(&before) = first.get(name.text.as_str()) {
                self.listed_twice(name.span, before);
                complete = false;
                continue;
            }
            first.insert(&name.text, name.span);
            match self.find(name, kind) {
                Some(index) => found.push(index),
                None => complete = false,
            }
        }
        complete.then_some(found)
    }

    fn listed_twice(&mut self, again: Span, first: Span) {
        let title = format!("`{}` is listed twice", self.text(again));
        let diagnostic = Diagnostic::new(Code::LISTED_TWICE, again, title)
            .label("listed again here")
            .secondary(first, "first listed here");
        self.report(diagnostic);
    }

    fn defined_twice(&mut self, title: String, again: Span, first: Span) {
        let diagnostic = Diagnostic::new(Code::DEFINED_TWICE, again, title)
            .label("redefined here")
            .secondary(first, "first defined here");
        self.report(diagnostic);
    }

    /// The one clause of a list of at most one; further ones are reported.
    fn single<T>(&mut self, clauses: &'a [(Span, T)], what: &str) -> Option<&'a T> {
        let spans: Vec<Span> = clauses.iter().map(|(span, _)| *span).collect();
        self.at_most_one(&spans, what);
        clauses.first().map(|(_, clause)| clause)
    }

    fn at_most_one(&mut self, spans: &[Span], what: &str) {
        for &again in spans.iter().skip(1) {
            let diagnostic = Diagnostic::new(Code::CLAUSE_TWICE, again, format!("duplicate `{what}`"))
                .label("remove one of the two")
                .secondary(spans[0], "first given here");
            self.report(diagnostic);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_names_are_compared_with_known_ones_only_so_often() {
        let count = 3000;
        let topics: Vec<String> = (0..count).map(|n| format!("topic known{n} = \"k{n}\" : int ")).collect();
        let operations: Vec<String> = (0..count).map(|n| format!("operation o{n} on knwn{n} = blackhole ")).collect();
        let (topics, operations) = (topics.concat(), operations.concat());
        let mut sources = SourceMap::new();
        let root = sources.add("a.sesame", format!("space s system {{ {topics} }} {operations}"));
        let analysis = crate::analyse(&sources, root);
        let unknown = analysis.diagnostics.iter().filter(|found| found.code == Code::UNKNOWN_NAME);
        let suggested = unknown.clone().filter(|found| !found.suggestions.is_empty()).count();
        assert_eq!(unknown.count(), count, "all are reported");
        // Among 6000 names.
        assert_eq!(suggested, MOST_COMPARED / (2 * count));
    }
}
