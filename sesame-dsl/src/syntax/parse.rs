//! From the grammar's pairs to the syntax tree.

use pest::iterators::Pair as PestPair;
use sesame_grammar::Rule;

use super::ast::{
    ActivationMode, Bound, Campaign, Comparison, Count, Coverage, CoverageAxis, Custom, CustomParameter, Direction,
    Domain, Expectation, Field, File, Head, InProcess, Inherited, Message, Metric, MetricSource, Moment, Name, Node,
    Operation, OperationBody, Operations, Passive, Process, Record, Repeat, Requirement, Search, Simulator, Strategy,
    System, Test, Topic, Transport, Trend, Type, TypeKind,
};
use super::explain::{Place, explain};
use super::limits::{MAX_BYTES, parse_bounded, too_deep};
use super::token::{TokenKind, token_at};
use crate::diagnostic::{Code, Diagnostic};
use crate::span::{FileId, Span};
use sesame_plan::Copies;

pub(super) type Pair<'i> = PestPair<'i, Rule>;

/// Reads one file. Never fails: what could not be read is in the diagnostics, and the rest is in the tree.
pub(crate) fn parse(file: FileId, text: &str, diagnostics: &mut Vec<Diagnostic>) -> File {
    let mut reader = Reader { file, text, diagnostics, out: File::default(), mistake: None };
    if text.len() > MAX_BYTES {
        let span = Span { file, lo: 0, hi: 0 };
        let title = format!("the file has {} bytes, more than the {MAX_BYTES} that are read", text.len());
        reader.diagnostics.push(Diagnostic::new(Code::TOO_LARGE, span, title));
    } else if let Some((at, title)) = too_deep(text) {
        let span = reader.span_of(at, at + 1);
        reader.diagnostics.push(Diagnostic::new(Code::TOO_LARGE, span, title).label("this one is too deep"));
    } else {
        match parse_bounded(Rule::file, text) {
            Ok(mut pairs) => {
                let root = pairs.next().expect("a parse that succeeds has its rule's pair");
                reader.file(&root);
                return reader.out;
            }
            // The entry rule accepts every text, so only the limit on calls is left.
            Err(error) => {
                let span = Span { file, lo: 0, hi: 0 };
                let title = format!("the file takes too long to read: {}", error.variant.message());
                reader.diagnostics.push(Diagnostic::new(Code::TOO_LARGE, span, title));
            }
        }
    }
    reader.out.damaged = true;
    reader.out
}

pub(super) struct Reader<'s> {
    file: FileId,
    text: &'s str,
    diagnostics: &'s mut Vec<Diagnostic>,
    out: File,
    /// Where the last syntax error is.
    mistake: Option<usize>,
}

pub(super) fn child<'i>(pair: &Pair<'i>, rule: Rule) -> Option<Pair<'i>> {
    pair.clone().into_inner().find(|inner| inner.as_rule() == rule)
}

pub(super) fn expect_child<'i>(pair: &Pair<'i>, rule: Rule) -> Pair<'i> {
    child(pair, rule).unwrap_or_else(|| panic!("the grammar puts a {rule:?} into every {:?}", pair.as_rule()))
}

pub(super) fn children<'i>(pair: &Pair<'i>, rule: Rule) -> impl Iterator<Item = Pair<'i>> {
    pair.clone().into_inner().filter(move |inner| inner.as_rule() == rule)
}

pub(super) fn first_of<'i>(pair: &Pair<'i>, rules: &[Rule]) -> Option<Pair<'i>> {
    pair.clone().into_inner().find(|inner| rules.contains(&inner.as_rule()))
}

/// The sign by which a bound or a relation compares, if it does.
pub(super) fn comparison(pair: &Pair<'_>) -> Option<Comparison> {
    pair.clone().into_inner().find_map(|inner| match inner.as_rule() {
        Rule::at_most => Some(Comparison::AtMost),
        Rule::at_least => Some(Comparison::AtLeast),
        Rule::equal_to => Some(Comparison::Equal),
        Rule::below => Some(Comparison::Below),
        Rule::above => Some(Comparison::Above),
        _ => None,
    })
}

/// Where a construct's last word ends. pest's own span goes on over the blanks before an optional part that is not there.
fn end_of(pair: &Pair<'_>) -> usize {
    let last = pair.clone().into_inner().rfind(|inner| inner.as_rule() != Rule::COMMENT);
    match last {
        // The closing quote is no pair.
        Some(_) if pair.as_rule() == Rule::text => pair.as_span().end(),
        Some(last) => end_of(&last),
        None => pair.as_span().end(),
    }
}

impl Reader<'_> {
    pub(super) fn span_of(&self, lo: usize, hi: usize) -> Span {
        let offset = |at: usize| u32::try_from(at).expect("files are at most MAX_BYTES long");
        Span { file: self.file, lo: offset(lo), hi: offset(hi) }
    }

    pub(super) fn span(&self, pair: &Pair<'_>) -> Span {
        self.span_of(pair.as_span().start(), end_of(pair))
    }

    /// The span of a clause's first word.
    pub(super) fn keyword_span(&self, pair: &Pair<'_>) -> Span {
        let first = pair.clone().into_inner().find(|inner| !matches!(inner.as_rule(), Rule::docs | Rule::COMMENT));
        self.span(&first.unwrap_or_else(|| pair.clone()))
    }

    pub(super) fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Visits the members of a block. What could not be read is explained; returns whether there was such a thing.
    pub(super) fn members<'i>(
        &mut self,
        block: &Pair<'i>,
        place: Place,
        mut visit: impl FnMut(&mut Self, Pair<'i>),
    ) -> bool {
        let mut damaged = false;
        let mut previous = None;
        let mut opened = None;
        for pair in block.clone().into_inner() {
            match pair.as_rule() {
                Rule::COMMENT => {}
                Rule::open => opened = Some(self.span(&pair)),
                Rule::not_closed | Rule::fields_not_closed => {
                    damaged = true;
                    self.not_closed(block, &pair, opened);
                }
                rule if rule == place.error_rule() => {
                    damaged = true;
                    let span = self.span(&pair);
                    self.broken_names(&pair);
                    // A stretch that begins at the mistake before it is the rest of the same mistake.
                    let start = token_at(self.text, pair.as_span().start()).lo;
                    let reported = self.mistake == Some(start);
                    if !reported {
                        let diagnostic = explain(self.file, self.text, span, place, previous);
                        self.mistake = Some(diagnostic.span.lo as usize);
                        self.report(diagnostic);
                    }
                    previous = None;
                }
                rule if place.member_rules().contains(&rule) => {
                    previous = Some(self.span(&pair));
                    visit(self, pair);
                }
                _ => {}
            }
        }
        damaged
    }

    fn not_closed(&mut self, block: &Pair<'_>, end: &Pair<'_>, opened: Option<Span>) {
        let opened = opened.expect("a block begins with its brace");
        let at = token_at(self.text, end.as_span().start());
        let span = self.span_of(at.lo, at.hi());
        let what = match block.as_rule() {
            Rule::hook_block => "metric".to_owned(),
            Rule::custom_parameters => "operation".to_owned(),
            rule => format!("{rule:?}").replace("_settings", ""),
        };
        let label = if at.text.is_empty() {
            "the file ends here".to_owned()
        } else {
            format!("`{}` begins a new declaration", at.text)
        };
        let diagnostic = Diagnostic::new(Code::NOT_CLOSED, span, format!("the block of this `{what}` is not closed"))
            .label(label)
            .also(opened, "opened here");
        self.report(diagnostic);
    }

    /// Keeps the name that a broken or unsupported construct was about to declare.
    fn broken_names(&mut self, pair: &Pair<'_>) {
        let lo = pair.as_span().start();
        let mut at = lo;
        // A misspelt first word may have been about to declare the second.
        let first = token_at(self.text, lo);
        let second = token_at(self.text, first.hi());
        let both_words = [first, second].iter().all(|token| token.kind == TokenKind::Word);
        if both_words && second.lo < pair.as_span().end() {
            let span = self.span_of(second.lo, second.hi());
            self.out.broken.push(Name { text: second.text.to_owned(), span });
        }
        loop {
            let token = token_at(self.text, at);
            if token.lo >= pair.as_span().end() || token.text.is_empty() {
                return;
            }
            at = token.hi();
            let declares = matches!(
                token.text,
                "simulator"
                    | "message"
                    | "topic"
                    | "node"
                    | "metric"
                    | "requirement"
                    | "operation"
                    | "test"
                    | "campaign"
                    | "eddi"
                    | "physical"
            );
            if declares {
                let name = token_at(self.text, at);
                if name.kind == TokenKind::Word && name.lo < pair.as_span().end() {
                    let span = self.span_of(name.lo, name.hi());
                    self.out.broken.push(Name { text: name.text.to_owned(), span });
                    at = name.hi();
                }
            }
        }
    }

    /// Says that a construct belongs to a later version. Its first word decides where; its rule decides what it is called.
    fn unsupported(&mut self, pair: &Pair<'_>) {
        let words = [Rule::k_node, Rule::k_parameter, Rule::kind_name];
        let span = first_of(pair, &words).map_or_else(|| self.keyword_span(pair), |word| self.span(&word));
        let word = &self.text[span.range()];
        let what = match pair.as_rule() {
            Rule::unsupported_transport => format!("simulator kind `{word}`"),
            Rule::unsupported_operation => format!("an operation on a `{word}`"),
            Rule::unsupported_kind => format!("operation kind `{word}`"),
            Rule::unsupported_strategy => format!("search strategy `{word}`"),
            _ => format!("`{word}`"),
        };
        self.broken_names(pair);
        self.report(
            Diagnostic::new(
                Code::NOT_SUPPORTED,
                span,
                format!("{what} is not supported yet by this version of sesamec"),
            )
            .label("part of the language, but not of this version"),
        );
    }

    fn file(&mut self, root: &Pair<'_>) {
        let damaged = self.members(root, Place::File, |reader, item| match item.as_rule() {
            Rule::space => {
                let head = reader.head(&item);
                reader.out.spaces.push(head);
            }
            Rule::system => {
                let system = reader.system(&item);
                reader.out.systems.push(system);
            }
            Rule::metric => {
                let metric = reader.metric(&item);
                reader.out.metrics.push(metric);
            }
            Rule::requirement => {
                let requirement = Requirement {
                    head: reader.head(&item),
                    text: reader.text_of(&expect_child(&item, Rule::text)),
                    metric: {
                        let name = children(&item, Rule::name).nth(1).expect("a requirement names its metric");
                        reader.name(&name)
                    },
                    bound: reader.bound(&expect_child(&item, Rule::bound)),
                };
                reader.out.requirements.push(requirement);
            }
            Rule::operation => {
                let operation = reader.operation(&item);
                reader.out.operations.push(operation);
            }
            Rule::test => {
                let test = reader.test(&item);
                reader.out.tests.push(test);
            }
            Rule::campaign => {
                let campaign = reader.campaign(&item);
                reader.out.campaigns.push(campaign);
            }
            Rule::import => {
                let import = reader.text_of(&expect_child(&item, Rule::text));
                reader.out.imports.push(import);
            }
            Rule::eddi => {
                let eddi = reader.eddi(&item);
                reader.out.eddis.push(eddi);
            }
            Rule::physical => {
                let physical = reader.physical(&item);
                reader.out.physicals.push(physical);
            }
            other => unreachable!("{other:?} is no declaration"),
        });
        self.out.damaged |= damaged;
    }

    // ----- the system

    fn system(&mut self, pair: &Pair<'_>) -> System {
        let span = self.span(&expect_child(pair, Rule::k_system));
        let mut system = System {
            span,
            simulators: vec![],
            messages: vec![],
            topics: vec![],
            nodes: vec![],
            launches: vec![],
            terminates: vec![],
            relay_budgets: vec![],
            damaged: false,
        };
        system.damaged = self.members(pair, Place::System, |reader, member| match member.as_rule() {
            Rule::simulator => system.simulators.push(reader.simulator(&member)),
            Rule::message => system.messages.push(reader.message(&member)),
            Rule::topic => system.topics.push(Topic {
                head: reader.head(&member),
                path: reader.text_of(&expect_child(&member, Rule::text)),
                ty: reader.type_of(&expect_child(&member, Rule::type_of)),
            }),
            Rule::node => system.nodes.push(reader.node(&member)),
            Rule::launch => system.launches.push((reader.keyword_span(&member), reader.launch(&member))),
            Rule::terminate => system.terminates.push((reader.keyword_span(&member), reader.command(&member))),
            _ => system.relay_budgets.push((reader.keyword_span(&member), reader.relay_budget(&member))),
        });
        system
    }

    fn simulator(&mut self, pair: &Pair<'_>) -> Simulator {
        let head = self.head(pair);
        if let Some(unsupported) = child(pair, Rule::unsupported_transport) {
            self.unsupported(&unsupported);
            return Simulator { head, transport: None };
        }
        let transport = match child(pair, Rule::process) {
            Some(process) => Transport::Process(self.process(&process)),
            None => Transport::InProcess(self.in_process(&expect_child(pair, Rule::in_process))),
        };
        Simulator { head, transport: Some(transport) }
    }

    fn in_process(&mut self, pair: &Pair<'_>) -> InProcess {
        let path = self.text_of(&expect_child(pair, Rule::text));
        let mut transport = InProcess { path, crates: vec![], steps: vec![], damaged: false };
        let settings = expect_child(pair, Rule::simulator_settings);
        transport.damaged = self.members(&settings, Place::Simulator, |reader, setting| {
            let span = reader.keyword_span(&setting);
            match setting.as_rule() {
                Rule::setting_crate => {
                    transport.crates.push((span, reader.text_of(&expect_child(&setting, Rule::text))));
                }
                _ => transport.steps.push((span, reader.signed(&expect_child(&setting, Rule::signed)))),
            }
        });
        transport
    }

    fn process(&mut self, pair: &Pair<'_>) -> Process {
        let mut texts = children(pair, Rule::text).map(|text| self.text_of(&text)).collect::<Vec<_>>().into_iter();
        let program = texts.next().expect("a process has a program");
        let mut transport =
            Process { program, arguments: texts.collect(), steps: vec![], free_running: vec![], damaged: false };
        let settings = expect_child(pair, Rule::process_settings);
        transport.damaged = self.members(&settings, Place::Process, |reader, setting| {
            let span = reader.keyword_span(&setting);
            match setting.as_rule() {
                Rule::free_running => transport.free_running.push((reader.span(&setting), ())),
                _ => transport.steps.push((span, reader.signed(&expect_child(&setting, Rule::signed)))),
            }
        });
        transport
    }

    fn message(&mut self, pair: &Pair<'_>) -> Message {
        let head = self.head(pair);
        let mut fields = Vec::new();
        let damaged = self.members(pair, Place::Message, |reader, field| {
            let name = expect_child(&field, Rule::field_name);
            fields.push(Field {
                head: Head { name: reader.field_name(&name), doc: Self::doc(&field) },
                ty: reader.type_of(&expect_child(&field, Rule::type_of)),
            });
        });
        Message { head, fields, damaged }
    }

    fn type_of(&mut self, pair: &Pair<'_>) -> Type {
        const MAX_LISTS: usize = 8;
        let inner = first_of(pair, &[Rule::scalar_type, Rule::message_type]).expect("a type is one of two");
        let kind = match inner.as_rule() {
            Rule::scalar_type => {
                let word = inner.clone().into_inner().next().expect("a scalar type has a word");
                match word.as_rule() {
                    Rule::k_bool => TypeKind::Bool,
                    Rule::k_int => TypeKind::Int,
                    Rule::k_real => TypeKind::Real,
                    Rule::k_text => TypeKind::Text,
                    _ => TypeKind::Point,
                }
            }
            _ => TypeKind::Message(self.name(&expect_child(&inner, Rule::name))),
        };
        let unit = child(&inner, Rule::unit_in_brackets).map(|unit| self.unit(&expect_child(&unit, Rule::unit)));
        let span = self.span(pair);
        let lists = children(pair, Rule::list_of).count();
        if lists > MAX_LISTS {
            let title = format!("lists are nested {lists} deep, more than the {MAX_LISTS} that are supported");
            self.report(Diagnostic::new(Code::TOO_LARGE, span, title));
        }
        (0..lists.min(MAX_LISTS)).fold(Type { kind, unit, span }, |of, _| Type {
            kind: TypeKind::List(Box::new(of)),
            unit: None,
            span,
        })
    }

    fn node(&mut self, pair: &Pair<'_>) -> Node {
        let mut node = Node { head: self.head(pair), publishes: vec![], subscribes: vec![] };
        self.members(pair, Place::Node, |reader, member| {
            let list = (reader.keyword_span(&member), reader.names(&member));
            match member.as_rule() {
                Rule::publishes => node.publishes.push(list),
                _ => node.subscribes.push(list),
            }
        });
        node
    }

    // ----- metrics

    fn metric(&mut self, pair: &Pair<'_>) -> Metric {
        let head = self.head(pair);
        let ty = child(pair, Rule::metric_type).map(|ty| self.type_of(&expect_child(&ty, Rule::type_of)));
        let directions = children(pair, Rule::direction).map(|direction| {
            let value =
                if child(&direction, Rule::k_maximise).is_some() { Direction::Maximise } else { Direction::Minimise };
            (self.span(&direction), value)
        });
        let directions = directions.collect();
        let mut values = |rule| {
            let clauses = children(pair, rule);
            clauses.map(|it| (self.keyword_span(&it), self.signed(&expect_child(&it, Rule::signed)))).collect()
        };
        let defaults = values(Rule::default_value);
        let initials = values(Rule::initial_value);
        let trends = children(pair, Rule::trend).map(|trend| {
            let value = if child(&trend, Rule::k_rising).is_some() { Trend::Rising } else { Trend::Falling };
            (self.span(&trend), value)
        });
        let trends = trends.collect();
        let accepts = children(pair, Rule::accepts).map(|accepts| self.span(&accepts)).collect();
        let sources = [Rule::hook_block, Rule::formula, Rule::fuzzing_time];
        let source = first_of(pair, &sources).expect("a metric has a source");
        let source = match source.as_rule() {
            Rule::hook_block => {
                let mut hooks = Vec::new();
                let damaged = self.members(&source, Place::Hook, |reader, hook| {
                    hooks.push((reader.keyword_span(&hook), reader.names(&hook)));
                });
                MetricSource::Hook { hooks, damaged }
            }
            Rule::formula => MetricSource::Formula(Box::new(self.formula(&source))),
            _ => MetricSource::FuzzingTime,
        };
        Metric { head, ty, directions, defaults, initials, trends, accepts, source }
    }

    pub(super) fn bound(&mut self, pair: &Pair<'_>) -> Bound {
        if let Some(within) = child(pair, Rule::bound_within) {
            return Bound::Within(self.range(&expect_child(&within, Rule::range)));
        }
        let comparison = comparison(pair).expect("a bound compares or encloses");
        Bound::Compare(comparison, self.signed(&expect_child(pair, Rule::signed)))
    }

    // ----- operations and tests

    fn operation(&mut self, pair: &Pair<'_>) -> Operation {
        let head = self.head(pair);
        let unsupported = first_of(pair, &[Rule::unsupported_operation, Rule::unsupported_kind]);
        if let Some(unsupported) = unsupported {
            self.unsupported(&unsupported);
            return Operation { head, body: None };
        }
        let kind = self.operation_kind(pair);
        let mut signed = |rule| {
            let clauses = children(pair, rule);
            clauses.map(|it| (self.keyword_span(&it), self.signed(&expect_child(&it, Rule::signed)))).collect()
        };
        let priority = signed(Rule::priority);
        let inclusion = signed(Rule::inclusion);
        let within = children(pair, Rule::within)
            .map(|within| (self.keyword_span(&within), self.range(&expect_child(&within, Rule::range))))
            .collect();
        let contains = children(pair, Rule::start_contains)
            .map(|clause| (self.keyword_span(&clause), self.contained(&clause)))
            .collect();
        let untimed = children(pair, Rule::untimed).map(|untimed| self.span(&untimed)).collect();
        let mut nodes = |rule| child(pair, rule).map(|nodes| (self.keyword_span(&nodes), self.names(&nodes)));
        let from = nodes(Rule::from_nodes);
        let to = nodes(Rule::to_nodes);
        let target = child(pair, Rule::targets).map(|targets| self.target(&targets));
        Operation {
            head,
            body: Some(OperationBody { target, from, to, kind, within, priority, inclusion, untimed, contains }),
        }
    }

    pub(super) fn custom(&mut self, pair: &Pair<'_>) -> Custom {
        let span = self.keyword_span(pair);
        let moment = child(pair, Rule::moment).map(|moment| self.moment(&moment));
        let mut custom = Custom { span, moment, parameters: vec![], damaged: false };
        let block = expect_child(pair, Rule::custom_parameters);
        custom.damaged = self.members(&block, Place::Custom, |reader, member| {
            let word = expect_child(&member, Rule::parameter_name);
            let domains = [Rule::number_domain, Rule::point_domain, Rule::text_domain, Rule::file_domain];
            let domain = first_of(&member, &domains).expect("a parameter has a domain");
            custom.parameters.push(CustomParameter {
                name: reader.name(&word),
                doc: Self::doc(&member),
                span: reader.span(&domain),
                domain: reader.domain(&domain),
            });
        });
        custom
    }

    pub(super) fn moment(&mut self, pair: &Pair<'_>) -> (Span, Moment) {
        let moment = if child(pair, Rule::k_before).is_some() { Moment::BeforeStart } else { Moment::AfterEnd };
        (self.span(pair), moment)
    }

    fn domain(&mut self, pair: &Pair<'_>) -> Domain {
        let unit = child(pair, Rule::unit_in_brackets).map(|unit| self.unit(&expect_child(&unit, Rule::unit)));
        match pair.as_rule() {
            Rule::number_domain => Domain::Number {
                integer: child(pair, Rule::k_int).is_some(),
                unit,
                range: self.range(&expect_child(pair, Rule::range)),
            },
            Rule::point_domain => {
                let mut corners = children(pair, Rule::point).map(|point| self.point(&point)).collect::<Vec<_>>();
                let high = corners.pop().expect("a box has two corners");
                let low = corners.pop().expect("a box has two corners");
                Domain::Point { unit, corners: Box::new([low, high]) }
            }
            rule => {
                let texts = expect_child(pair, Rule::texts);
                let texts = children(&texts, Rule::text).map(|text| self.text_of(&text)).collect();
                if rule == Rule::file_domain { Domain::Files(texts) } else { Domain::Texts(texts) }
            }
        }
    }

    fn test(&mut self, pair: &Pair<'_>) -> Test {
        let mut test = Test { head: self.head(pair), operations: vec![], expectations: vec![], damaged: false };
        test.damaged = self.members(pair, Place::Test, |reader, member| match member.as_rule() {
            Rule::expectation => test.expectations.push(Expectation {
                metric: reader.name(&expect_child(&member, Rule::name)),
                bound: reader.bound(&expect_child(&member, Rule::bound)),
            }),
            _ => test.operations.push(reader.test_operation(&member)),
        });
        test
    }

    // ----- campaigns

    fn campaign(&mut self, pair: &Pair<'_>) -> Campaign {
        let mut campaign = Campaign {
            head: self.head(pair),
            from: child(pair, Rule::campaign_from).map(|from| self.name(&expect_child(&from, Rule::name))),
            inherited: Inherited::default(),
            objectives: vec![],
            observes: vec![],
            operations: vec![],
            activates: vec![],
            searches: vec![],
            coverages: vec![],
            explorations: vec![],
            confirms: vec![],
            stops: vec![],
            repeats: vec![],
            passives: vec![],
            ends: vec![],
            records: vec![],
            damaged: false,
            unread: false,
        };
        campaign.damaged = self.members(pair, Place::Campaign, |reader, member| {
            let span = reader.keyword_span(&member);
            match member.as_rule() {
                Rule::objectives => campaign.objectives.push((span, reader.names(&member))),
                Rule::observes => campaign.observes.push((span, reader.names(&member))),
                Rule::operations => {
                    let count = expect_child(&member, Rule::count);
                    let counts: Vec<Count> = children(&count, Rule::number).map(|it| reader.count(&it)).collect();
                    let min = *counts.first().expect("a count has a number");
                    let max = *counts.last().expect("a count has a number");
                    let copies = [(Rule::may_overlap, Copies::MayOverlap), (Rule::at_most_once, Copies::Once)];
                    let copies = copies
                        .into_iter()
                        .find_map(|(rule, copies)| Some((reader.span(&child(&member, rule)?), copies)));
                    campaign.operations.push(Operations { span, names: reader.names(&member), min, max, copies });
                }
                Rule::activate => {
                    let mode = match child(&member, Rule::by_condition) {
                        Some(condition) => ActivationMode::Condition(reader.by_condition(&condition)),
                        None => ActivationMode::Time,
                    };
                    campaign.activates.push((span, mode));
                }
                Rule::search => campaign.searches.push(reader.search(&member, span)),
                Rule::coverage => campaign.coverages.push(reader.coverage(&member, span)),
                Rule::boost => campaign.explorations.push(reader.boost(&member, span)),
                Rule::predict => campaign.explorations.push(reader.predict(&member, span)),
                Rule::novelty => campaign.explorations.push(reader.novelty(&member, span)),
                Rule::confirm => campaign.confirms.push(reader.confirm(&member, span)),
                Rule::stop => campaign.stops.push(reader.stop(&member, span)),
                Rule::construct => campaign.explorations.push(reader.construct(&member, span)),
                Rule::end => campaign.ends.push((span, reader.signed(&expect_child(&member, Rule::signed)))),
                Rule::record => {
                    let all = child(&member, Rule::k_all).is_some();
                    campaign.records.push((span, if all { Record::All } else { Record::Failing }));
                }
                Rule::repeat => {
                    let seed = reader.seeds(&member);
                    campaign.repeats.push(Repeat {
                        span,
                        test: reader.name(&expect_child(&member, Rule::name)),
                        times: reader.count(&expect_child(&member, Rule::number)),
                        seed,
                    });
                }
                Rule::passive => {
                    let seed = reader.seeds(&member);
                    let times = reader.count(&expect_child(&member, Rule::number));
                    campaign.passives.push(Passive { span, times, seed });
                }
                other => unreachable!("{other:?} is no member of a campaign"),
            }
        });
        campaign.unread = campaign.damaged;
        campaign
    }

    fn coverage(&mut self, pair: &Pair<'_>, span: Span) -> Coverage {
        let mut coverage =
            Coverage { span, axes: vec![], hits: vec![], stops: vec![], failsafes: vec![], damaged: false };
        coverage.damaged = self.members(pair, Place::Coverage, |reader, member| {
            let span = reader.keyword_span(&member);
            match member.as_rule() {
                Rule::coverage_axis => {
                    let dimension = expect_child(&member, Rule::dimension);
                    coverage.axes.push(CoverageAxis {
                        dimension: Name { text: dimension.as_str().to_owned(), span: reader.span(&dimension) },
                        range: reader.range(&expect_child(&member, Rule::range)),
                        cells: reader.count(&expect_child(&member, Rule::number)),
                    });
                }
                Rule::coverage_stop => {
                    coverage.stops.push((span, reader.signed(&expect_child(&member, Rule::signed))));
                }
                rule => {
                    let count = (span, reader.count(&expect_child(&member, Rule::number)));
                    if rule == Rule::coverage_hits { &mut coverage.hits } else { &mut coverage.failsafes }.push(count);
                }
            }
        });
        coverage
    }

    /// The seeds in the settings of a repetition.
    fn seeds(&mut self, pair: &Pair<'_>) -> Vec<(Span, Count)> {
        let mut seeds = Vec::new();
        if let Some(settings) = child(pair, Rule::repeat_settings) {
            self.members(&settings, Place::Repeat, |reader, setting| {
                let span = reader.keyword_span(&setting);
                seeds.push((span, reader.count(&expect_child(&setting, Rule::number))));
            });
        }
        seeds
    }

    fn search(&mut self, pair: &Pair<'_>, span: Span) -> Search {
        let mut search = Search {
            span,
            strategy: None,
            population: vec![],
            evaluations: vec![],
            seed: vec![],
            neighbours: vec![],
            damaged: false,
        };
        if let Some(strategy) = child(pair, Rule::unsupported_strategy) {
            self.unsupported(&strategy);
            return search;
        }
        let strategies = [
            (Rule::k_nsga2, Strategy::Nsga2),
            (Rule::k_map_elites, Strategy::MapElites),
            (Rule::k_latin_hypercube, Strategy::LatinHypercube),
            (Rule::k_sobol, Strategy::Sobol),
            (Rule::k_falsification, Strategy::Falsification),
            (Rule::k_random, Strategy::Random),
        ];
        search.strategy = strategies.into_iter().find(|(rule, _)| child(pair, *rule).is_some()).map(|(_, it)| it);
        let settings = expect_child(pair, Rule::search_settings);
        search.damaged = self.members(&settings, Place::Search, |reader, setting| {
            let value = (reader.keyword_span(&setting), reader.count(&expect_child(&setting, Rule::number)));
            match setting.as_rule() {
                Rule::setting_population => search.population.push(value),
                Rule::setting_evaluations => search.evaluations.push(value),
                Rule::setting_neighbours => search.neighbours.push(value),
                _ => search.seed.push(value),
            }
        });
        search
    }
}
