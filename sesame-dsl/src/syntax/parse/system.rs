//! The system under test: simulator, messages, topics, nodes.

use sesame_grammar::Rule;

use super::reader::{Pair, Reader, child, children, expect_child, first_of};
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::ast::{
    self, Action, Answer, Clock, Field, Head, Message, Name, Node, Proxy, Secret, Service, Settings, Simulator, StepBy,
    StepChannel, Stepping, System, Text, Topic, Transport, Type, TypeKind,
};
use crate::syntax::blocks;
use sesame_plan::{Compression, Dialect, Quality, SimulatorKind};

impl Reader<'_> {
    pub(super) fn system(&mut self, pair: &Pair<'_>) -> System {
        let span = self.span(&expect_child(pair, Rule::k_system));
        let mut system = System {
            span,
            simulators: vec![],
            messages: vec![],
            topics: vec![],
            services: vec![],
            actions: vec![],
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
            Rule::service => system.services.push(reader.service(&member)),
            Rule::action => system.actions.push(reader.action(&member)),
            Rule::node => system.nodes.push(reader.node(&member)),
            Rule::launch => system.launches.push((reader.keyword_span(&member), reader.launch(&member))),
            Rule::terminate => system.terminates.push((reader.keyword_span(&member), reader.command(&member))),
            _ => system.relay_budgets.push((reader.keyword_span(&member), reader.relay_budget(&member))),
        });
        system
    }

    pub(super) fn simulator(&mut self, pair: &Pair<'_>) -> Simulator {
        let head = self.head(pair);
        if let Some(unsupported) = child(pair, Rule::unsupported_transport) {
            self.unsupported(&unsupported);
            return Simulator { head, transport: None };
        }
        Simulator { head, transport: Some(self.transport(pair)) }
    }

    /// How a simulator is reached: after its name stands the word of its kind.
    fn transport(&mut self, simulator: &Pair<'_>) -> Transport {
        let of_kind = simulator.clone().into_inner().find_map(|part| {
            let word = part.clone().into_inner().next()?;
            SimulatorKind::from_keyword(word.as_str()).map(|kind| (kind, part))
        });
        let (kind, written) = of_kind.expect("a simulator has a kind");
        let texts = children(&written, Rule::text).map(|text| self.text_of(&text)).collect();
        let block = written.into_inner().find(|part| blocks::find(part.as_rule()).is_some());
        let settings = block.map(|block| self.settings(&block)).unwrap_or_default();
        Transport { kind, texts, settings }
    }

    fn settings(&mut self, block: &Pair<'_>) -> Settings {
        let mut settings = Settings::default();
        let has_errors = self.members(block, |reader, setting| {
            let span = reader.keyword_span(&setting);
            let text = |reader: &mut Self| reader.text_of(&expect_child(&setting, Rule::text));
            let quantity = |reader: &mut Self| reader.signed(&expect_child(&setting, Rule::signed));
            let has = |rule| child(&setting, rule).is_some();
            match setting.as_rule() {
                Rule::setting_crate => settings.crates.push((span, text(reader))),
                Rule::setting_step => settings.steps.push((span, quantity(reader))),
                Rule::step_by => {
                    let time = quantity(reader);
                    let by = first_of(&setting, &[Rule::k_service, Rule::k_topic]).map(|channel| {
                        let topic = channel.as_rule() == Rule::k_topic;
                        StepBy {
                            channel: if topic { StepChannel::Topic } else { StepChannel::Service },
                            path: text(reader),
                            span: reader.span(&channel),
                        }
                    });
                    settings.steppings.push((span, Stepping { time, by }));
                }
                Rule::free_running => settings.free_running.push((reader.span(&setting), ())),
                Rule::setting_domain => {
                    settings.domains.push((span, reader.count(&expect_child(&setting, Rule::number))));
                }
                Rule::setting_types => settings.types.push((span, reader.folders(&setting))),
                Rule::setting_clock => settings.clocks.push((span, reader.clock(&setting))),
                Rule::setting_reset => settings.resets.push((span, text(reader))),
                Rule::setting_dialect => {
                    settings.dialects.push((span, if has(Rule::k_ros1) { Dialect::Ros1 } else { Dialect::Ros2 }));
                }
                Rule::setting_compression => {
                    let compression = if has(Rule::k_cbor) { Compression::Cbor } else { Compression::Png };
                    settings.compressions.push((span, compression));
                }
                Rule::setting_quality => {
                    let quality = if has(Rule::k_at_most_once) {
                        Quality::AtMostOnce
                    } else if has(Rule::k_at_least_once) {
                        Quality::AtLeastOnce
                    } else {
                        Quality::ExactlyOnce
                    };
                    settings.qualities.push((span, quality));
                }
                Rule::setting_user => settings.users.push((span, text(reader))),
                Rule::setting_trust => settings.trusts.push((span, text(reader))),
                Rule::proxy => settings.proxies.push(reader.proxy(&setting)),
                Rule::setting_protocol => {
                    settings.protocols.push((span, reader.count(&expect_child(&setting, Rule::number))));
                }
                Rule::setting_topics => settings.topics.push((span, text(reader))),
                Rule::setting_marker => settings.markers.push((span, text(reader))),
                Rule::setting_settle => settings.settles.push((span, quantity(reader))),
                Rule::setting_prefix => settings.prefixes.push((span, text(reader))),
                Rule::setting_cut => settings.cuts.push((span, text(reader))),
                Rule::setting_heard => settings.heards.push((span, text(reader))),
                Rule::setting_injected => settings.injecteds.push((span, text(reader))),
                Rule::setting_bare => settings.bares.push((span, reader.folders(&setting))),
                _ => settings.secrets.push((span, reader.secret(&expect_child(&setting, Rule::secret)))),
            }
        });
        Settings { has_errors, ..settings }
    }

    fn proxy(&mut self, pair: &Pair<'_>) -> Proxy {
        let mut proxy = Proxy {
            node: self.with_member(&expect_child(pair, Rule::with_member)),
            address: self.text_of(&expect_child(pair, Rule::text)),
            secrets: vec![],
            certificates: vec![],
            keys: vec![],
            publics: vec![],
        };
        let Some(settings) = child(pair, Rule::proxy_settings) else { return proxy };
        self.members(&settings, |reader, setting| {
            let span = reader.keyword_span(&setting);
            let text = |reader: &mut Self| reader.text_of(&expect_child(&setting, Rule::text));
            match setting.as_rule() {
                Rule::setting_certificate => proxy.certificates.push((span, text(reader))),
                Rule::setting_key => proxy.keys.push((span, text(reader))),
                Rule::setting_public => proxy.publics.push((span, ())),
                _ => proxy.secrets.push((span, reader.secret(&expect_child(&setting, Rule::secret)))),
            }
        });
        proxy
    }

    fn folders(&mut self, setting: &Pair<'_>) -> Vec<Text> {
        let texts = expect_child(setting, Rule::texts);
        children(&texts, Rule::text).map(|folder| self.text_of(&folder)).collect()
    }

    fn clock(&mut self, setting: &Pair<'_>) -> Clock {
        match child(setting, Rule::text) {
            Some(topic) => Clock::Topic(self.text_of(&topic)),
            None => Clock::Wall,
        }
    }

    fn secret(&mut self, pair: &Pair<'_>) -> Secret {
        let text = self.text_of(&expect_child(pair, Rule::text));
        if child(pair, Rule::k_env).is_some() { Secret::Environment(text) } else { Secret::File(text) }
    }

    fn service(&mut self, pair: &Pair<'_>) -> Service {
        let head = self.head(pair);
        let [path, ros_type] = self.path_and_type(pair);
        let [request, reply] = ["request", "reply"].map(|end| part(&head, end));
        Service { head, request, reply, path, ros_type }
    }

    fn action(&mut self, pair: &Pair<'_>) -> Action {
        let head = self.head(pair);
        let [path, ros_type] = self.path_and_type(pair);
        let parts = sesame_plan::action::PARTS.iter().map(|of| part(&head, of.name)).collect();
        Action { head, parts, path, ros_type }
    }

    /// The two texts of a service or an action.
    fn path_and_type(&mut self, pair: &Pair<'_>) -> [Text; 2] {
        let mut texts = children(pair, Rule::text);
        [(); 2].map(|()| self.text_of(&texts.next().expect("a service and an action have a path and a type")))
    }

    fn message(&mut self, pair: &Pair<'_>) -> Message {
        let head = self.head(pair);
        let ros_type = child(pair, Rule::ros_type).map(|ty| self.text_of(&expect_child(&ty, Rule::text)));
        let block = child(pair, Rule::open).is_some();
        let (mut fields, mut constants) = (Vec::new(), Vec::new());
        let has_errors = self.members(pair, |reader, field| {
            let name = expect_child(&field, Rule::field_name);
            if field.as_rule() == Rule::constant {
                let value = match child(&field, Rule::text) {
                    Some(text) => ast::ConstantValue::Text(reader.text_of(&text)),
                    None => ast::ConstantValue::Number(reader.signed(&expect_child(&field, Rule::signed))),
                };
                constants.push(ast::Constant { name: reader.field_name(&name), value });
                return;
            }
            fields.push(Field {
                head: Head {
                    name: reader.field_name(&name),
                    doc: Self::doc(&field),
                    full_span: reader.full_span(&field),
                },
                optional: child(&field, Rule::k_optional).map(|word| reader.span(&word)),
                ty: reader.type_of(&expect_child(&field, Rule::type_of)),
                wire: child(&field, Rule::wire_type).map(|wire| reader.text_of(&expect_child(&wire, Rule::text))),
            });
        });
        Message { head, ros_type, block, fields, constants, has_errors }
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
        let named = child(pair, Rule::text).map(|text| self.text_of(&text));
        let head = self.head(pair);
        let mut node = Node {
            head,
            named,
            publishes: vec![],
            subscribes: vec![],
            serves: vec![],
            calls: vec![],
            launches: vec![],
            answers: vec![],
            every_step: vec![],
            brokers: vec![],
        };
        self.members(pair, |reader, member| {
            let span = reader.keyword_span(&member);
            match member.as_rule() {
                Rule::publishes => node.publishes.push((span, reader.with_members(&member))),
                Rule::subscribes => node.subscribes.push((span, reader.with_members(&member))),
                Rule::serves => node.serves.push((span, reader.with_members(&member))),
                Rule::calls => node.calls.push((span, reader.with_members(&member))),
                Rule::launch => node.launches.push((span, reader.launch(&member))),
                Rule::every_step => node.every_step.push((span, reader.names(&member))),
                Rule::broker => node.brokers.push((span, reader.text_of(&expect_child(&member, Rule::text)))),
                _ => {
                    let answers = children(&member, Rule::answer).map(|answer| {
                        let mut names = children(&answer, Rule::name).map(|name| reader.name(&name));
                        let mut next = || names.next().expect("an answer has two names");
                        Answer { to: next(), with: next() }
                    });
                    node.answers.push((span, answers.collect()));
                }
            }
        });
        node
    }
}

/// A topic of a service or an action, whose name begins with that of the declaration.
fn part(declared: &Head, end: &str) -> Head {
    let name = Name { text: format!("{}_{end}", declared.name.text), span: declared.name.span };
    Head { name, ..declared.clone() }
}
