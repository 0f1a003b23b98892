//! Names, duplicates, and the declarations that every space needs.

use std::collections::BTreeMap;

use heck::{ToSnakeCase as _, ToUpperCamelCase as _};

use super::{Definition, Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::span::Span;
use crate::syntax::ast::{self, Head, Simulator, System};

impl<'a> Resolver<'a> {
    pub(super) fn collect(&mut self) {
        let mut heads = self.heads();
        // An imported name is there before those of the file that imports it.
        heads.sort_by_key(|(_, _, head)| (self.ranks.get(&head.name.span.file).copied(), head.name.span));
        for &(kind, index, head) in &heads {
            let name = head.name.text.as_str();
            let Some(first) = self.names.get(name).copied() else {
                self.names.insert(name, Definition { kind, index, span: head.name.span });
                continue;
            };
            let mut diagnostic =
                Diagnostic::new(Code::DEFINED_TWICE, head.name.span, format!("`{name}` is defined twice"))
                    .label(format!("redefined here as {}", kind.with_article()))
                    .secondary(first.span, format!("first defined here as {}", first.kind.with_article()));
            if kind != first.kind {
                diagnostic = diagnostic.note("a name can stand for only one thing in a space");
            }
            self.report(diagnostic);
        }
        let undeclared = self.file.undeclared.iter().map(|name| name.text.as_str());
        self.silent.extend(undeclared);
        self.collisions(&heads);
        self.required();
    }

    fn heads(&self) -> Vec<(Kind, usize, &'a Head)> {
        let file = self.file;
        let mut heads: Vec<(Kind, usize, &'a Head)> = Vec::new();
        let mut add = |kind, kind_heads: Vec<&'a Head>| {
            heads.extend(kind_heads.into_iter().enumerate().map(|(index, head)| (kind, index, head)));
        };
        add(Kind::Simulator, self.simulators().map(|simulator| &simulator.head).collect());
        add(Kind::Message, self.ast_messages().map(|message| &message.head).collect());
        let of_services = self.ast_services().flat_map(|service| [&service.request, &service.reply]);
        let of_actions = self.ast_actions().flat_map(|action| &action.parts);
        add(Kind::Topic, self.ast_topics().map(|topic| &topic.head).chain(of_services).chain(of_actions).collect());
        add(Kind::Service, self.ast_services().map(|service| &service.head).collect());
        add(Kind::Action, self.ast_actions().map(|action| &action.head).collect());
        add(Kind::Node, self.ast_nodes().map(|node| &node.head).collect());
        add(Kind::Metric, file.metrics.iter().map(|metric| &metric.head).collect());
        add(Kind::Requirement, file.requirements.iter().map(|requirement| &requirement.head).collect());
        add(Kind::Operation, file.operations.iter().map(|operation| &operation.head).collect());
        add(Kind::Test, file.tests.iter().map(|test| &test.head).collect());
        add(Kind::Campaign, file.campaigns.iter().map(|campaign| &campaign.head).collect());
        add(Kind::Monitor, file.eddis.iter().map(|eddi| &eddi.head).collect());
        add(Kind::Lab, file.physicals.iter().map(|physical| &physical.head).collect());
        heads
    }

    pub(super) fn simulators(&self) -> impl Iterator<Item = &'a Simulator> + use<'a> {
        self.file.systems.iter().flat_map(|system| &system.simulators)
    }

    /// Names that differ in the file but collide in the generated code or on a case-insensitive file system.
    fn collisions(&mut self, heads: &[(Kind, usize, &'a Head)]) {
        let mut taken: BTreeMap<(&str, String), (&str, Span)> = BTreeMap::new();
        for (kind, index, head) in heads {
            let name = head.name.text.as_str();
            let custom = *kind == Kind::Operation
                && matches!(self.file.operations[*index].body.kind, ast::OperationKind::Custom(_));
            let (what, generated) = match kind {
                // A metric is a module and a file as well as a type; equal camel case implies the others' equality but
                // for digits, so both are looked at.
                Kind::Metric => ("file and module", name.to_snake_case()),
                // The hooks of operations lie beside those of metrics.
                Kind::Operation if custom => ("file and module", name.to_snake_case()),
                Kind::Message => ("type", name.to_upper_camel_case()),
                Kind::Topic => ("function suffix", name.to_snake_case()),
                Kind::Campaign => ("folder", name.to_ascii_lowercase()),
                _ => continue,
            };
            let mut keys = vec![(what, generated)];
            if *kind == Kind::Metric || custom {
                keys.push(("hook type", name.to_upper_camel_case()));
            }
            for (what, generated) in keys {
                match taken.get(&(what, generated.clone())) {
                    // The same name twice is reported as that.
                    Some((first, _)) if *first == name => break,
                    Some(&(first, span)) => {
                        let title = format!("`{name}` and `{first}` collide in the generated code");
                        let diagnostic = Diagnostic::new(Code::GENERATED_COLLISION, head.name.span, title)
                            .label(format!("its {what} would be `{generated}`"))
                            .secondary(span, format!("this one's {what} would be `{generated}` too"));
                        self.report(diagnostic);
                        break;
                    }
                    None => {
                        taken.insert((what, generated), (name, head.name.span));
                    }
                }
            }
        }
    }

    fn required(&mut self) {
        let start = Span { file: self.root, lo: 0, hi: 0 };
        let file = self.file;
        let has_errors = file.has_errors || file.incomplete;
        if file.spaces.is_empty() && !has_errors {
            let diagnostic = Diagnostic::new(Code::MISSING_DECLARATION, start, "this file has no `space` declaration")
                .label("expected `space` and a name")
                .note("for example `space kuka_cell`");
            self.report(diagnostic);
        }
        let spaces: Vec<Span> = file.spaces.iter().map(|head| head.name.span).collect();
        self.only_one(&spaces, "space");
        for &id in self.ranks.keys() {
            let systems = file.systems.iter().map(|system| system.span).filter(|span| span.file == id);
            let systems: Vec<Span> = systems.collect();
            self.only_one(&systems, "system");
        }
        let simulators: Vec<Span> = self.simulators().map(|simulator| simulator.head.name.span).collect();
        self.only_one(&simulators, "simulator");
        match file.systems.first() {
            None if !has_errors => {
                let at = spaces.first().copied().unwrap_or(start);
                let diagnostic = Diagnostic::new(Code::MISSING_DECLARATION, at, "this space has no `system`")
                    .label("expected a `system` block")
                    .note("a `system { … }` block declares the simulator, messages, topics and nodes");
                self.report(diagnostic);
            }
            Some(System { span, .. })
                if simulators.is_empty()
                    && !file.incomplete
                    && !file.systems.iter().any(|system| system.has_errors) =>
            {
                let diagnostic = Diagnostic::new(Code::MISSING_DECLARATION, *span, "this system has no simulator")
                    .label("expected a `simulator` inside")
                    .note(
                        "for example `simulator cell = in_process \"my_sim::Cell\" { crate \"simulator\"  step 20ms }`",
                    );
                self.report(diagnostic);
            }
            _ => {}
        }
    }

    fn only_one(&mut self, spans: &[Span], what: &str) {
        for &again in spans.iter().skip(1) {
            let holder = if what == "simulator" { "a space" } else { "a file" };
            let title = format!("{holder} can have only one `{what}`");
            let diagnostic = Diagnostic::new(Code::MISSING_DECLARATION, again, title)
                .label("remove this one, or move it to another file")
                .secondary(spans[0], "first declared here");
            self.report(diagnostic);
        }
    }
}
