//! The system under test: simulator, messages, topics, nodes.

use sesame_grammar::Rule;

use super::reader::{Pair, Reader, child, children, expect_child, first_of};
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::ast::{
    Answer, Bus, BusKind, Clock, Field, Head, InProcess, Message, Name, Node, Process, Proxy, Ros2, Secret, Service,
    Simulator, StepBy, StepChannel, Stepping, System, Text, Topic, Transport, Type, TypeKind,
};
use sesame_plan::{Compression, Dialect, Quality};

impl Reader<'_> {
    pub(super) fn system(&mut self, pair: &Pair<'_>) -> System {
        let span = self.span(&expect_child(pair, Rule::k_system));
        let mut system = System {
            span,
            simulators: vec![],
            messages: vec![],
            topics: vec![],
            services: vec![],
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
        let kinds =
            [Rule::in_process, Rule::process, Rule::ros2, Rule::rosbridge, Rule::ros1, Rule::mqtt, Rule::simlog];
        let kind = first_of(pair, &kinds).expect("a simulator has a kind");
        let transport = match kind.as_rule() {
            Rule::process => Transport::Process(self.process(&kind)),
            Rule::ros2 => Transport::Ros2(self.ros2(&kind)),
            Rule::rosbridge => Transport::Bus(Box::new(self.bus(&kind, BusKind::Rosbridge, Rule::rosbridge_settings))),
            Rule::ros1 => Transport::Bus(Box::new(self.bus(&kind, BusKind::Ros1, Rule::ros1_settings))),
            Rule::simlog => Transport::Bus(Box::new(self.bus(&kind, BusKind::Simlog, Rule::simlog_settings))),
            Rule::mqtt => Transport::Bus(Box::new(self.bus(&kind, BusKind::Mqtt, Rule::mqtt_settings))),
            _ => Transport::InProcess(self.in_process(&kind)),
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
        let mut transport =
            Process { program, arguments: texts.collect(), steps: vec![], free_running: vec![], has_errors: false };
        let settings = expect_child(pair, Rule::process_settings);
        transport.has_errors = self.members(&settings, |reader, setting| {
            let span = reader.keyword_span(&setting);
            match setting.as_rule() {
                Rule::free_running => transport.free_running.push((reader.span(&setting), ())),
                _ => transport.steps.push((span, reader.signed(&expect_child(&setting, Rule::signed)))),
            }
        });
        transport
    }

    fn ros2(&mut self, pair: &Pair<'_>) -> Ros2 {
        let mut ros2 = Ros2::default();
        let Some(settings) = child(pair, Rule::ros2_settings) else { return ros2 };
        ros2.has_errors = self.members(&settings, |reader, setting| {
            let span = reader.keyword_span(&setting);
            let text = |reader: &mut Self| reader.text_of(&expect_child(&setting, Rule::text));
            match setting.as_rule() {
                Rule::setting_domain => ros2.domains.push((span, reader.count(&expect_child(&setting, Rule::number)))),
                Rule::setting_types => ros2.types.push((span, reader.folders(&setting))),
                Rule::setting_clock => ros2.clocks.push((span, reader.clock(&setting))),
                Rule::step_by => {
                    let time = reader.signed(&expect_child(&setting, Rule::signed));
                    let by = first_of(&setting, &[Rule::k_service, Rule::k_topic]).map(|channel| {
                        let topic = channel.as_rule() == Rule::k_topic;
                        StepBy {
                            channel: if topic { StepChannel::Topic } else { StepChannel::Service },
                            path: text(reader),
                            span: reader.span(&channel),
                        }
                    });
                    ros2.steps.push((span, Stepping { time, by }));
                }
                _ => ros2.resets.push((span, text(reader))),
            }
        });
        ros2
    }

    fn bus(&mut self, pair: &Pair<'_>, kind: BusKind, settings: Rule) -> Bus {
        let address = self.text_of(&expect_child(pair, Rule::text));
        let mut bus = Bus {
            kind,
            address,
            domains: vec![],
            types: vec![],
            clocks: vec![],
            resets: vec![],
            dialects: vec![],
            compressions: vec![],
            qualities: vec![],
            users: vec![],
            secrets: vec![],
            trusts: vec![],
            proxies: vec![],
            steps: vec![],
            protocols: vec![],
            topics: vec![],
            markers: vec![],
            settles: vec![],
            prefixes: vec![],
            cuts: vec![],
            heards: vec![],
            injecteds: vec![],
            bares: vec![],
            has_errors: false,
        };
        let Some(settings) = child(pair, settings) else { return bus };
        bus.has_errors = self.members(&settings, |reader, setting| {
            let span = reader.keyword_span(&setting);
            let text = |reader: &mut Self| reader.text_of(&expect_child(&setting, Rule::text));
            let quantity = |reader: &mut Self| reader.signed(&expect_child(&setting, Rule::signed));
            let has = |rule| child(&setting, rule).is_some();
            match setting.as_rule() {
                Rule::setting_domain => bus.domains.push((span, reader.count(&expect_child(&setting, Rule::number)))),
                Rule::setting_types => bus.types.push((span, reader.folders(&setting))),
                Rule::setting_clock => bus.clocks.push((span, reader.clock(&setting))),
                Rule::setting_reset => bus.resets.push((span, text(reader))),
                Rule::setting_dialect => {
                    bus.dialects.push((span, if has(Rule::k_ros1) { Dialect::Ros1 } else { Dialect::Ros2 }));
                }
                Rule::setting_compression => {
                    bus.compressions.push((span, if has(Rule::k_cbor) { Compression::Cbor } else { Compression::Png }));
                }
                Rule::setting_quality => {
                    let quality = if has(Rule::k_at_most_once) {
                        Quality::AtMostOnce
                    } else if has(Rule::k_at_least_once) {
                        Quality::AtLeastOnce
                    } else {
                        Quality::ExactlyOnce
                    };
                    bus.qualities.push((span, quality));
                }
                Rule::setting_user => bus.users.push((span, text(reader))),
                Rule::setting_trust => bus.trusts.push((span, text(reader))),
                Rule::proxy => bus.proxies.push(reader.proxy(&setting)),
                Rule::setting_step => bus.steps.push((span, quantity(reader))),
                Rule::setting_protocol => {
                    bus.protocols.push((span, reader.count(&expect_child(&setting, Rule::number))));
                }
                Rule::setting_topics => bus.topics.push((span, text(reader))),
                Rule::setting_marker => bus.markers.push((span, text(reader))),
                Rule::setting_settle => bus.settles.push((span, quantity(reader))),
                Rule::setting_prefix => bus.prefixes.push((span, text(reader))),
                Rule::setting_cut => bus.cuts.push((span, text(reader))),
                Rule::setting_heard => bus.heards.push((span, text(reader))),
                Rule::setting_injected => bus.injecteds.push((span, text(reader))),
                Rule::setting_bare => bus.bares.push((span, reader.folders(&setting))),
                _ => bus.secrets.push((span, reader.secret(&expect_child(&setting, Rule::secret)))),
            }
        });
        bus
    }

    fn proxy(&mut self, pair: &Pair<'_>) -> Proxy {
        let mut proxy = Proxy {
            node: self.name(&expect_child(pair, Rule::name)),
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
        let mut texts = children(pair, Rule::text).map(|text| self.text_of(&text)).collect::<Vec<_>>().into_iter();
        let direction = |suffix: &str| Head {
            name: Name { text: format!("{}_{suffix}", head.name.text), span: head.name.span },
            ..head.clone()
        };
        let [request, reply] = ["request", "reply"].map(direction);
        let mut next = || texts.next().expect("a service has a path and a type");
        Service { path: next(), ros_type: next(), head, request, reply }
    }

    fn message(&mut self, pair: &Pair<'_>) -> Message {
        let head = self.head(pair);
        let ros_type = child(pair, Rule::ros_type).map(|ty| self.text_of(&expect_child(&ty, Rule::text)));
        let block = child(pair, Rule::open).is_some();
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
                wire: child(&field, Rule::wire_type).map(|wire| reader.text_of(&expect_child(&wire, Rule::text))),
            });
        });
        Message { head, ros_type, block, fields, has_errors }
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
            launches: vec![],
            answers: vec![],
            every_step: vec![],
            brokers: vec![],
        };
        self.members(pair, |reader, member| {
            let span = reader.keyword_span(&member);
            match member.as_rule() {
                Rule::publishes => node.publishes.push((span, reader.names(&member))),
                Rule::subscribes => node.subscribes.push((span, reader.names(&member))),
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
