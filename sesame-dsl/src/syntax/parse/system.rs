//! The system under test: simulator, messages, topics, nodes.

use sesame_grammar::Rule;

use super::reader::{Pair, Reader, child, children, expect_child, first_of};
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::ast::{
    Field, Head, InProcess, Message, Node, Process, Simulator, System, Topic, Transport, Type, TypeKind,
};

impl Reader<'_> {
    pub(super) fn system(&mut self, pair: &Pair<'_>) -> System {
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
            has_errors: false,
        };
        system.has_errors = self.members(pair, |reader, member| match member.as_rule() {
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
        let mut transport = InProcess { path, crates: vec![], steps: vec![], has_errors: false };
        let settings = expect_child(pair, Rule::simulator_settings);
        transport.has_errors = self.members(&settings, |reader, setting| {
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
        let mut transport = Process { program, arguments: texts.collect(), steps: vec![], has_errors: false };
        let settings = expect_child(pair, Rule::process_settings);
        transport.has_errors = self.members(&settings, |reader, setting| {
            let span = reader.keyword_span(&setting);
            transport.steps.push((span, reader.signed(&expect_child(&setting, Rule::signed))));
        });
        transport
    }

    fn message(&mut self, pair: &Pair<'_>) -> Message {
        let head = self.head(pair);
        let mut fields = Vec::new();
        let has_errors = self.members(pair, |reader, field| {
            let name = expect_child(&field, Rule::field_name);
            fields.push(Field {
                head: Head {
                    name: reader.field_name(&name),
                    doc: Self::doc(&field),
                    full_span: reader.full_span(&field),
                },
                ty: reader.type_of(&expect_child(&field, Rule::type_of)),
            });
        });
        Message { head, fields, has_errors }
    }

    pub(super) fn type_of(&mut self, pair: &Pair<'_>) -> Type {
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
            let title = format!("lists are nested {lists} levels deep, but the limit is {MAX_LISTS}");
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
        self.members(pair, |reader, member| {
            let list = (reader.keyword_span(&member), reader.names(&member));
            match member.as_rule() {
                Rule::publishes => node.publishes.push(list),
                _ => node.subscribes.push(list),
            }
        });
        node
    }
}
