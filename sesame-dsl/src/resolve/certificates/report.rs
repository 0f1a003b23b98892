//! Findings as diagnostics.

use std::collections::BTreeSet;

use sesame_monitor::check::{Finding, Question, Witness, check_within, together};
use sesame_monitor::gate::Leaf;
use sesame_monitor::truth::Truth;
use sesame_plan::MonitorId;

use super::group::{Group, leaves};
use super::witness;
use crate::diagnostic::{Code, Diagnostic, Suggestion};
use crate::model::Declaration;
use crate::model::eddi::{Evidence, Gate, Guarantee};
use crate::resolve::words::{list, quoted};
use crate::span::Span;
use crate::syntax::ast;

/// Larger groups are not checked: see [`Group::size`].
const LARGEST: usize = 200_000;

/// If there is more evidence, nobody looks for what excludes each other.
const MOST_EVIDENCE: usize = 40;

/// How many names a note lists.
const MOST_SHOWN: usize = 3;

/// Why something was not decided.
const GIVEN_UP: &str = "the search reached its limit";

/// What is wrong with the monitors of a group, and what was not decided.
pub(super) fn of(group: &Group<'_>, file: &ast::File, work: &mut u64) -> (Vec<Diagnostic>, Vec<(Span, String)>) {
    if group.size() > LARGEST {
        let first = &group.eddis[0].declaration;
        let text = format!("the guarantees of `{}` are not checked: they and what they need are too many", first.name);
        return (Vec::new(), vec![(first.span, text)]);
    }
    // A plan that is not in order has been reported.
    let Ok(found) = check_within(&group.monitors, &|input| group.values(input), work) else {
        return (Vec::new(), Vec::new());
    };
    let reporter = Reporter::new(group, file, &found.findings);
    let diagnostics = found.findings.iter().filter_map(|finding| reporter.diagnostic(finding, work)).collect();
    (diagnostics, reporter.undecided(&found.undecided))
}

struct Reporter<'a> {
    group: &'a Group<'a>,
    file: &'a ast::File,
    never: BTreeSet<(MonitorId, u32)>,
    always: BTreeSet<(MonitorId, u32)>,
    /// Guarantees of which something was found.
    found: BTreeSet<(MonitorId, u32)>,
}

impl<'a> Reporter<'a> {
    fn new(group: &'a Group<'a>, file: &'a ast::File, findings: &[Finding]) -> Self {
        let (mut never, mut always, mut found) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
        for finding in findings {
            match *finding {
                Finding::Never { monitor, guarantee } => _ = never.insert((monitor, guarantee)),
                Finding::Always { monitor, guarantee } => _ = always.insert((monitor, guarantee)),
                Finding::NeverState { monitor, guarantee, .. } => _ = found.insert((monitor, guarantee)),
                Finding::Redundant { .. } | Finding::Order { .. } => {}
            }
        }
        found.extend(never.iter().chain(&always));
        Reporter { group, file, never, always, found }
    }

    fn guarantee(&self, monitor: MonitorId, at: u32) -> &'a Guarantee {
        &self.group.eddis[monitor.index()].guarantees[at as usize]
    }

    fn name(&self, monitor: MonitorId) -> &'a str {
        &self.group.eddis[monitor.index()].declaration.name
    }

    fn evidence(&self, monitor: MonitorId, at: u32) -> &'a Evidence {
        &self.group.eddis[monitor.index()].evidence[at as usize]
    }

    /// The diagnostic of a finding, unless it follows from another one.
    fn diagnostic(&self, finding: &Finding, work: &mut u64) -> Option<Diagnostic> {
        match *finding {
            Finding::Never { monitor, guarantee } => {
                let follows = self.group.follows((monitor, guarantee), &self.never, Truth::False);
                (!follows).then(|| self.never(monitor, guarantee, work))
            }
            Finding::Always { monitor, guarantee } => {
                let follows = self.group.follows((monitor, guarantee), &self.always, Truth::True);
                (!follows && !self.may_be_stale(monitor, guarantee)).then(|| self.always(monitor, guarantee))
            }
            Finding::NeverState { monitor, guarantee, ref by } => {
                let follows = by.iter().any(|&by| self.always.contains(&(monitor, by)));
                (!follows).then(|| self.never_state(monitor, guarantee, by))
            }
            Finding::Redundant { monitor, evidence, as_if } => {
                let guarantees = (0..).zip(&self.group.monitors[monitor.index()].guarantees);
                let mut reading =
                    guarantees.filter(|(_, guarantee)| leaves(&guarantee.gate).contains(&Leaf::Evidence(evidence)));
                // If nothing was found of a guarantee that needs it; that none does is W0015.
                let own = reading.any(|(at, _)| !self.found.contains(&(monitor, at)));
                own.then(|| self.redundant(monitor, evidence, as_if))
            }
            Finding::Order { monitor, stronger, weaker, ref witness } => {
                // The system decides what an external monitor says.
                let decides = self.group.eddis[monitor.index()].publishes.is_some();
                let follows = [stronger, weaker].iter().any(|&at| self.found.contains(&(monitor, at)));
                (decides && !follows).then(|| self.order(monitor, stronger, weaker, witness))
            }
        }
    }

    fn never(&self, monitor: MonitorId, at: u32, work: &mut u64) -> Diagnostic {
        let declaration = &self.guarantee(monitor, at).declaration;
        let title = format!("guarantee `{}` of monitor `{}` can never hold", declaration.name, self.name(monitor));
        let mut diagnostic =
            Diagnostic::new(Code::NEVER_HOLDS, declaration.span, title).label("whatever the messages say");
        let excluding = self.excluding(monitor, at, work);
        for &(of, at) in &excluding {
            let span = self.evidence(of, at).declaration.span;
            if span == declaration.span {
                continue;
            }
            let others: Vec<&str> =
                excluding.iter().filter(|&&other| other != (of, at)).map(|&other| self.named(other)).collect();
            diagnostic = diagnostic.secondary(
                span,
                match others.as_slice() {
                    [] => "this can never be true".to_owned(),
                    [other] => format!("this is never true while `{other}` is"),
                    others => format!("this is never true while {} are", list(others)),
                },
            );
        }
        diagnostic
    }

    fn named(&self, (monitor, at): (MonitorId, u32)) -> &'a str {
        &self.evidence(monitor, at).declaration.name
    }

    /// Evidence that is never true at once, so that a guarantee can never hold: none of it can be left out, unless the
    /// work was too much.
    fn excluding(&self, monitor: MonitorId, guarantee: u32, work: &mut u64) -> Vec<(MonitorId, u32)> {
        let mut set: Vec<_> = self.group.evidence_of(monitor, guarantee).into_iter().collect();
        if set.len() > MOST_EVIDENCE {
            return Vec::new();
        }
        let mut excludes = |set: &[(MonitorId, u32)]| {
            let evidence: Vec<_> =
                set.iter().map(|&(of, at)| &self.group.monitors[of.index()].evidence[at as usize]).collect();
            together(&evidence, &|input| self.group.values(input), work) == Some(false)
        };
        if !excludes(&set) {
            return Vec::new();
        }
        for at in (0..set.len()).rev() {
            let mut without = set.clone();
            without.remove(at);
            if excludes(&without) {
                set = without;
            }
        }
        set
    }

    /// Whether silence can end a guarantee, which may be all that it is for.
    fn may_be_stale(&self, monitor: MonitorId, guarantee: u32) -> bool {
        let evidence = self.group.evidence_of(monitor, guarantee);
        evidence.iter().any(|&(of, at)| self.group.monitors[of.index()].evidence[at as usize].stale.is_some())
    }

    fn always(&self, monitor: MonitorId, at: u32) -> Diagnostic {
        let declaration = &self.guarantee(monitor, at).declaration;
        let title = format!("guarantee `{}` of monitor `{}` always holds", declaration.name, self.name(monitor));
        let mut diagnostic = Diagnostic::new(Code::ALWAYS_HOLDS, declaration.span, title)
            .label("whatever the messages say, once each topic has had one");
        if self.group.eddis[monitor.index()].guarantees.len() > at as usize + 1 {
            diagnostic = diagnostic.note("so none of the weaker guarantees is the state then");
        }
        diagnostic
    }

    fn never_state(&self, monitor: MonitorId, at: u32, by: &[u32]) -> Diagnostic {
        let declaration = &self.guarantee(monitor, at).declaration;
        let title = format!("guarantee `{}` is never the state of monitor `{}`", declaration.name, self.name(monitor));
        let stronger: Vec<&str> = by.iter().map(|&by| self.guarantee(monitor, by).declaration.name.as_str()).collect();
        let mut diagnostic = Diagnostic::new(Code::NEVER_THE_STATE, declaration.span, title).label(match by {
            [_] => format!("whenever it holds, the stronger {} holds as well", list(&stronger)),
            _ => format!("whenever it holds, one of the stronger {} holds as well", list(&stronger)),
        });
        for &by in by {
            diagnostic = diagnostic.secondary(self.guarantee(monitor, by).declaration.span, "stronger");
        }
        diagnostic
    }

    fn redundant(&self, monitor: MonitorId, at: u32, as_if: bool) -> Diagnostic {
        let declaration = &self.evidence(monitor, at).declaration;
        let title = format!("evidence `{}` of monitor `{}` decides nothing", declaration.name, self.name(monitor));
        Diagnostic::new(Code::IDLE_EVIDENCE, declaration.span, title)
            .label(format!("the state would be the same if this were always {as_if}"))
    }

    fn order(&self, monitor: MonitorId, strong: u32, weak: u32, moment: &Witness) -> Diagnostic {
        let (stronger, weaker) = (self.guarantee(monitor, strong), self.guarantee(monitor, weak));
        let (above, below) = (&stronger.declaration, &weaker.declaration);
        let title = format!("guarantee `{}` may hold while the weaker `{}` does not", above.name, below.name);
        let example = witness::in_words(self.group, monitor, [strong, weak], moment);
        let mut diagnostic = Diagnostic::new(Code::WEAKER_FAILS, above.span, title)
            .label(format!("stronger, with integrity {}", stronger.integrity))
            .secondary(below.span, format!("whoever demands this is content with `{}`", above.name))
            .note(example);
        if let Some(suggestion) = self.weaker_as_well(monitor, &above.name, &below.name) {
            diagnostic.suggestions.push(suggestion);
        }
        diagnostic
    }

    /// The suggestion to let the weaker guarantee hold whenever the stronger one does.
    fn weaker_as_well(&self, monitor: MonitorId, stronger: &str, weaker: &str) -> Option<Suggestion> {
        let written = &self.file.eddis[self.group.members[monitor.index()]];
        let below = written.guarantees.iter().find(|guarantee| guarantee.head.name.text == weaker)?.gate.as_ref()?;
        let declared = &self.group.eddis[monitor.index()].guarantees;
        let position = |name: &str| declared.iter().find(|guarantee| guarantee.declaration.name == name);
        let (above, own) = (position(stronger)?, position(weaker)?);
        // A plan limits how deeply gates are nested.
        if above.gate.depth().max(own.gate.depth()) >= Gate::MOST_DEPTH {
            return None;
        }
        let parts = [&own.gate, &above.gate].map(|gate| match gate {
            Gate::All(_) => format!("({})", self.text(monitor, gate)),
            _ => self.text(monitor, gate),
        });
        let text = parts.join(" or ");
        Some(Suggestion::possible(
            format!("write `{text}` if `{weaker}` is to hold whenever `{stronger}` does"),
            vec![(below.span, text)],
        ))
    }

    /// A gate as it is written.
    fn text(&self, monitor: MonitorId, gate: &Gate) -> String {
        let eddi = self.group.eddis[monitor.index()];
        let parts = |parts: &[Gate]| -> Vec<String> {
            let part = |gate: &Gate| match gate {
                Gate::All(_) | Gate::Any(_) => format!("({})", self.text(monitor, gate)),
                _ => self.text(monitor, gate),
            };
            parts.iter().map(part).collect()
        };
        match gate {
            Gate::Evidence(at) => eddi.evidence[*at as usize].declaration.name.clone(),
            Gate::Demand(at) => eddi.demands[*at as usize].declaration.name.clone(),
            Gate::All(of) => parts(of).join(" and "),
            Gate::Any(of) => parts(of).join(" or "),
            Gate::AtLeast { count, of } => {
                let parts: Vec<String> = of.iter().map(|gate| self.text(monitor, gate)).collect();
                format!("{count} of ({})", parts.join(", "))
            }
        }
    }

    /// What was not decided: questions of one kind about one monitor together, at the first declaration that they are
    /// about.
    fn undecided(&self, questions: &[Question]) -> Vec<(Span, String)> {
        let mut notes: Vec<(MonitorId, [&str; 2], Vec<&Declaration>)> = Vec::new();
        // What may never hold need not be reported again as what may never be the state.
        let follows = |question: &&Question| match **question {
            Question::NeverState(monitor, at) => questions.contains(&Question::Never(monitor, at)),
            _ => false,
        };
        for &question in questions.iter().filter(|question| !follows(question)) {
            let (monitor, what, declaration) = self.asked(question);
            match notes.iter_mut().find(|(of, asked, _)| (*of, *asked) == (monitor, what)) {
                Some((_, _, declarations)) => declarations.push(declaration),
                None => notes.push((monitor, what, vec![declaration])),
            }
        }
        let note = |(monitor, [of_one, of_many], declarations): (MonitorId, [&str; 2], Vec<&Declaration>)| {
            let (shown, others) = declarations.split_at(declarations.len().min(MOST_SHOWN));
            let names: Vec<&str> = shown.iter().map(|declaration| declaration.name.as_str()).collect();
            let more = if others.is_empty() { String::new() } else { format!(" and {} others", others.len()) };
            let names = if more.is_empty() { list(&names) } else { quoted(&names).join(", ") };
            let what = if declarations.len() == 1 { of_one } else { of_many };
            let monitor = self.name(monitor);
            let text = format!("whether {names}{more} of monitor `{monitor}` {what} was not decided: {GIVEN_UP}");
            (declarations[0].span, text)
        };
        notes.into_iter().map(note).collect()
    }

    /// The monitor that a question is about, what it asks of one part and of several, and the part.
    fn asked(&self, question: Question) -> (MonitorId, [&'static str; 2], &'a Declaration) {
        let guarantee = |monitor, at| &self.guarantee(monitor, at).declaration;
        match question {
            Question::Never(monitor, at) => (monitor, ["can hold"; 2], guarantee(monitor, at)),
            Question::Always(monitor, at) => (monitor, ["always holds", "always hold"], guarantee(monitor, at)),
            Question::NeverState(monitor, at) => (monitor, ["can be the state"; 2], guarantee(monitor, at)),
            Question::Order(monitor, at) => {
                let what = ["holds whenever a stronger guarantee does", "hold whenever a stronger guarantee does"];
                (monitor, what, guarantee(monitor, at))
            }
            Question::Redundant(monitor, at) => {
                (monitor, ["decides anything", "decide anything"], &self.evidence(monitor, at).declaration)
            }
        }
    }
}
