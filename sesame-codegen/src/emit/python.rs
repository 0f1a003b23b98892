//! Python: a module with classes for messages, parameters and hooks, and the user's first version of the hooks.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use serde::Serialize;
use sesame_plan::python::{attribute, method};
use sesame_plan::{Direction, Domain, MessageId, MessageType, NamedNumber, Parameter, Topic, TopicId, Type};

use super::handlers::{handler, paths};
use super::messages::{named_message, unit};
use super::problem::{self, Problem};
use super::rust::one_line;
use super::text::Templates;
use super::{by, metrics, operations, plan_json, sha256};
use crate::files::{Hook, Owner, Tree};
use crate::names::{self, Scope};
use crate::plan::{Called, HookPlan, Offline, OperationPlan, RunnerPlan};

/// Whole numbers below this are exact.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// What a space is in Python.
#[derive(Debug, Clone, PartialEq)]
pub struct Python {
    /// Its files, for the folder of the `.sesame` file.
    pub tree: Tree,
    /// The file with the user's hooks.
    pub hooks: String,
    /// The metrics and operations that need hooks.
    pub needed: Vec<String>,
}

/// The modules of a space. All plans are of one space, and there is at least one; `file` is the `.sesame` file.
pub fn python(plans: &[RunnerPlan], file: &Path, templates: &Templates) -> Result<Python, Vec<Problem>> {
    let problems = problem::problems(plans, &BTreeMap::new());
    if !problems.is_empty() {
        return Err(problems);
    }
    let runner = plans.first().expect("a space without campaigns has nothing to generate");
    let space = Space::new(runner, file);
    let note = format!("# {}\n", by(&runner.plan, &format!("sesamec generate --python {}", runner.plan.source)));
    let (types, hooks) = (names::python_types(file), names::python_hooks(file));
    let mut tree = Tree {
        folder: String::new(),
        manifest: format!(".sesame/{}.json", space.module),
        files: BTreeMap::new(),
        generator: runner.plan.generator.clone(),
        source: runner.plan.source.clone(),
        options: BTreeMap::from([("python".to_owned(), String::new())]),
        model: sha256(plans.iter().map(plan_json)),
        hooks: BTreeMap::new(),
        runners: Vec::new(),
    };
    tree.add(&types, Owner::Machine, note + &space.types());
    let needed: Vec<String> = space.hooks().iter().map(|hook| hook.name.clone()).collect();
    if !needed.is_empty() {
        let text = space.stubs(templates, &needed).map_err(|problem| vec![problem])?;
        tree.add(&hooks, Owner::User, text);
        tree.hooks.insert(
            hooks.clone(),
            Hook { of: format!("the hooks of `{}`", runner.plan.space), inputs: space.inputs() },
        );
    }
    Ok(Python { tree, hooks, needed })
}

/// The stubs of some hooks of a space, as a module.
pub fn python_stubs(runner: &RunnerPlan, file: &Path, templates: &Templates, of: &[String]) -> Result<String, Problem> {
    Space::new(runner, file).stubs(templates, of)
}

/// A space with its names in Python.
struct Space<'a> {
    runner: &'a RunnerPlan,
    /// The module with its types.
    module: String,
    /// The class of each message.
    messages: Vec<String>,
}

/// A hook as its class is written.
#[derive(Debug, Serialize)]
struct Stub {
    /// The decorator.
    kind: &'static str,
    name: String,
    class: String,
    base: String,
    doc: Vec<String>,
    methods: Vec<Method>,
}

#[derive(Debug, Serialize)]
struct Method {
    name: String,
    parameters: Vec<Argument>,
    returns: String,
    doc: String,
    example: String,
    /// The message that it returns, if it returns one.
    message: Option<String>,
}

#[derive(Debug, Serialize)]
struct Argument {
    name: String,
    #[serde(rename = "type")]
    ty: String,
}

#[derive(Serialize)]
struct Stubs<'a> {
    space: &'a str,
    types: &'a str,
    hooks: Vec<Stub>,
}

impl<'a> Space<'a> {
    fn new(runner: &'a RunnerPlan, file: &Path) -> Self {
        let plan = &runner.plan;
        // In the body of a class, its fields hide classes of their names.
        let fields = plan.messages.iter().flat_map(|message| &message.fields).map(|field| field.name.as_str());
        let parameters = runner.operations.iter().flat_map(|operation| &operation.parameters);
        let taken = fields.chain(parameters.map(|(parameter, _)| parameter.name.as_str())).map(attribute);
        let taken: Vec<String> = taken.map(Cow::into_owned).collect();
        let mut scope = Scope::reserving(&["ABC", "ClassVar", "Literal"]);
        for name in taken {
            scope.take(name, "_");
        }
        for hook in &runner.hooks {
            scope.take(base(&hook.metric), "_");
        }
        for operation in &runner.operations {
            scope.take(base(&operation.operation), "_");
            scope.take(parameters_class(operation), "_");
        }
        let messages = plan.messages.iter();
        let messages =
            messages.map(|message| scope.take(attribute(&names::camel(&message.name)).into_owned(), "Message"));
        let module = names::python_types(file);
        Space { runner, module: module.trim_end_matches(".py").to_owned(), messages: messages.collect() }
    }

    fn class(&self, id: MessageId) -> &str {
        &self.messages[id.index()]
    }

    /// A type as annotations have it; `module` stands before classes.
    fn annotation(&self, ty: &Type, module: &str) -> String {
        match ty {
            Type::Bool => "bool".to_owned(),
            Type::Int { .. } => "int".to_owned(),
            Type::Real { .. } => "float".to_owned(),
            Type::Text => "str".to_owned(),
            Type::Point { .. } => "list[float]".to_owned(),
            Type::List { of } => format!("list[{}]", self.annotation(of, module)),
            Type::Message { id } => format!("{module}{}", self.class(*id)),
        }
    }

    fn topic(&self, id: TopicId) -> &'a Topic {
        self.runner.plan.topic(id)
    }

    /// The module with classes for messages, parameters and hooks.
    fn types(&self) -> String {
        let plan = &self.runner.plan;
        let hooks = self.hooks();
        let texts = self.runner.operations.iter().flat_map(|operation| &operation.parameters);
        let literal = texts.into_iter().any(|(parameter, _)| matches!(parameter.domain, Domain::Texts { .. }));
        let mut text = docstring(
            "",
            &[format!("The messages of the space `{}`, and what its hooks are called with.", plan.space)],
        );
        text.push_str("\nfrom __future__ import annotations\n\n");
        if !hooks.is_empty() {
            text.push_str("from abc import ABC, abstractmethod\n");
        }
        text.push_str("from dataclasses import dataclass\n");
        let has_constants = plan.messages.iter().any(|message| !message.constants.is_empty());
        let typing = [("ClassVar", has_constants), ("Literal", literal)].into_iter().filter(|(_, used)| *used);
        let typing: Vec<&str> = typing.map(|(name, _)| name).collect();
        if !typing.is_empty() {
            writeln!(text, "from typing import {}", typing.join(", ")).expect("text grows as needed");
        }
        text.push_str("\nimport sesamec\n");
        for (id, message) in (0..).map(MessageId).zip(&plan.messages) {
            let decorator = format!(
                "@sesamec.message(\"{}\", \"{}\")\n@dataclass(slots=True, kw_only=True)",
                plan.space, message.name
            );
            let mut doc = lines(&message.doc);
            if doc.is_empty() {
                doc.push(format!("Message `{}`.", message.name));
            }
            let fields = message.fields.iter().map(|field| {
                let ty = self.annotation(&field.ty, "");
                let ty = if field.optional { format!("{ty} | None = None") } else { ty };
                let of_unit = unit(&field.ty).map(|unit| format!("In {unit}."));
                let renamed = (attribute(&field.name) != field.name).then(|| format!("`{}` on the wire.", field.name));
                let optional = field.optional.then(|| "Messages may lack it.".to_owned());
                (attribute(&field.name).into_owned(), ty, described(&field.doc, [of_unit, renamed, optional]))
            });
            text.push_str(&dataclass(&decorator, self.class(id), &doc, fields));
            text.push_str(&constants(message));
        }
        for operation in &self.runner.operations {
            let decorator = format!(
                "@sesamec.parameters(\"{}\", \"{}\")\n@dataclass(frozen=True, slots=True, kw_only=True)",
                plan.space, operation.operation
            );
            let doc = [format!("What a test chose for `{}`.", operation.operation)];
            let fields = operation.parameters.iter().map(|(parameter, doc)| {
                let permitted = Some(operations::permitted(parameter));
                (
                    attribute(&parameter.name).into_owned(),
                    parameter_type(parameter),
                    described(doc, [permitted, None, None]),
                )
            });
            text.push_str(&dataclass(&decorator, &parameters_class(operation), &doc, fields));
        }
        for hook in hooks {
            self.base_class(&mut text, &hook);
        }
        text
    }

    fn base_class(&self, text: &mut String, hook: &Stub) {
        let own = format!("{}.", self.module);
        write!(text, "\n\nclass {}(ABC):\n", hook.base).expect("text grows as needed");
        text.push_str(&docstring("    ", &hook.doc));
        let around = |name: &str, doc: &str| {
            format!("\n    def {name}(self, ctx: sesamec.MetricContext, /) -> None:\n        \"\"\"{doc}\"\"\"\n")
        };
        if hook.kind == "metric" {
            text.push_str(&around("on_start", "Before the first message of a run."));
        }
        for method in &hook.methods {
            let parameters: Vec<String> = method
                .parameters
                .iter()
                .map(|Argument { name, ty }| format!("{name}: {}", ty.replace(&own, "")))
                .collect();
            let returns = method.returns.replace(&own, "");
            write!(
                text,
                "\n    @abstractmethod\n    def {}(self, {}, /) -> {returns}:\n",
                method.name,
                parameters.join(", ")
            )
            .expect("text grows as needed");
            text.push_str(&docstring("        ", std::slice::from_ref(&method.doc)));
        }
        if hook.kind == "metric" {
            text.push_str(&around("on_end", "After the last message of a run."));
        }
    }

    /// All hooks of the space, metrics first.
    fn hooks(&self) -> Vec<Stub> {
        let metrics = self.runner.hooks.iter().map(|hook| self.metric(hook));
        metrics.chain(self.runner.operations.iter().map(|operation| self.operation(operation))).collect()
    }

    fn metric(&self, hook: &HookPlan) -> Stub {
        let mut doc = lines(&hook.doc);
        paragraph(&mut doc, &format!("The hook of {}.", metrics::declared(hook)));
        let meaning = metrics::meaning(hook).map(|meaning| format!(" {meaning}")).unwrap_or_default();
        doc.push(one_line(&format!("An object is created for each run.{meaning}")));
        let methods = hook.inputs.iter().map(|&input| {
            let topic = self.topic(input);
            let name = self.argument(input);
            Method {
                name: method(&topic.name),
                parameters: vec![
                    self.message_argument(&name, topic),
                    Argument { name: "ctx".to_owned(), ty: "sesamec.MetricContext".to_owned() },
                ],
                returns: "None".to_owned(),
                doc: on(topic, "."),
                example: self.metric_example(hook, topic, &name),
                message: None,
            }
        });
        Stub {
            kind: "metric",
            name: hook.metric.clone(),
            class: class_of(&hook.metric),
            base: base(&hook.metric),
            doc: doc.iter().map(|line| literal(line)).collect(),
            methods: methods.collect(),
        }
    }

    fn operation(&self, operation: &OperationPlan) -> Stub {
        let mut doc = lines(&operation.doc);
        paragraph(&mut doc, &format!("The hook of {}.", operations::declared(operation)));
        doc.push("An object is created for each use in a test, and for each run.".to_owned());
        let parameters =
            Argument { name: "parameters".to_owned(), ty: format!("{}.{}", self.module, parameters_class(operation)) };
        let method = match operation.called {
            Called::OnMessage(id) => {
                let topic = self.topic(id);
                let name = self.argument(id);
                let ty = self.annotation(&topic.ty, &format!("{}.", self.module));
                Method {
                    name: method(&topic.name),
                    parameters: vec![
                        self.message_argument(&name, topic),
                        parameters,
                        Argument { name: "ctx".to_owned(), ty: format!("sesamec.OperationContext[{ty}]") },
                    ],
                    returns: ty,
                    doc: on(topic, ", to be changed and returned."),
                    example: match &topic.ty {
                        Type::Real { .. } => format!("return {name} + ctx.draw(-0.1, 0.1)"),
                        _ => "if ctx.draw() < 0.1: ctx.drop()".to_owned(),
                    },
                    message: Some(name),
                }
            }
            Called::Offline(moment) => {
                let (name, doc) = match moment {
                    Offline::BeforeStart => (
                        "before_start",
                        "Before the simulator starts afresh for the run. Changed files are put back after it.",
                    ),
                    Offline::AfterEnd => ("after_end", "After the last message of a run that came to its end."),
                };
                Method {
                    name: name.to_owned(),
                    parameters: vec![
                        parameters,
                        Argument { name: "ctx".to_owned(), ty: "sesamec.RunContext".to_owned() },
                    ],
                    returns: "None".to_owned(),
                    doc: doc.to_owned(),
                    example: "ctx.edit_file(\"config.yaml\", lambda text: text.replace(\"gain: 1\", \"gain: 2\"))"
                        .to_owned(),
                    message: None,
                }
            }
        };
        Stub {
            kind: "operation",
            name: operation.operation.clone(),
            class: class_of(&operation.operation),
            base: base(&operation.operation),
            doc: doc.iter().map(|line| literal(line)).collect(),
            methods: vec![method],
        }
    }

    /// What a method calls its message.
    fn argument(&self, topic: TopicId) -> String {
        let name = handler(&self.runner.plan, topic).parameter;
        if attribute(&name) == name && name != self.module { name } else { "message".to_owned() }
    }

    fn message_argument(&self, name: &str, topic: &Topic) -> Argument {
        Argument { name: name.to_owned(), ty: self.annotation(&topic.ty, &format!("{}.", self.module)) }
    }

    /// A line that would make a metric of this input.
    fn metric_example(&self, hook: &HookPlan, topic: &Topic, name: &str) -> String {
        let (value, ty) = self.number(&topic.ty, name.to_owned());
        let same_unit = hook.unit.is_some() && unit(ty) == hook.unit.as_deref();
        let extreme =
            |function: &str| format!("ctx.set({value} if ctx.value is None else {function}(ctx.value, {value}))");
        let counted = |condition: &str| format!("if {condition} and ctx.every_seconds(0.2): ctx.add()");
        match (ty, hook.direction) {
            (Type::Int { .. } | Type::Real { .. }, Some(Direction::Maximise)) if same_unit => extreme("max"),
            (Type::Int { .. } | Type::Real { .. }, Some(Direction::Minimise)) if same_unit => extreme("min"),
            (Type::Int { .. } | Type::Real { .. }, None) if same_unit => format!("ctx.set({value})"),
            (Type::Int { .. } | Type::Real { .. }, _) => counted(&format!("{value} < 0")),
            (Type::Bool | Type::List { .. }, _) => counted(&value),
            (Type::Text, _) => counted(&format!("{value} == \"…\"")),
            (Type::Point { .. }, _) => counted(&format!("{value}[2] < 0")),
            (Type::Message { .. }, _) => "ctx.add()".to_owned(),
        }
    }

    /// The part of an input that an example speaks of: its first number, or else its first field.
    fn number<'t>(&'t self, ty: &'t Type, value: String) -> (String, &'t Type) {
        let Type::Message { id } = ty else { return (value, ty) };
        let fields = || self.runner.plan.message(*id).fields.iter().filter(|field| !field.optional);
        let is_number = |ty: &Type| matches!(ty, Type::Real { .. } | Type::Int { .. });
        match fields().find(|field| is_number(&field.ty)).or_else(|| fields().next()) {
            Some(field) => self.number(&field.ty, format!("{value}.{}", attribute(&field.name))),
            None => (value, ty),
        }
    }

    /// What hooks are given, a line for each method, parameter, and field of a message. When these lines change, a
    /// hook may have to.
    fn inputs(&self) -> Vec<String> {
        let mut given = Vec::new();
        let mut reached: Vec<MessageId> = Vec::new();
        let with_unit = |ty: &Type| {
            let of_unit = unit(ty).map(|unit| format!(" in {unit}")).unwrap_or_default();
            self.annotation(ty, "") + &of_unit
        };
        for hook in &self.runner.hooks {
            for &input in &hook.inputs {
                let topic = self.topic(input);
                let name = self.argument(input);
                given.push(format!(
                    "{}.{}({name}: {})",
                    class_of(&hook.metric),
                    method(&topic.name),
                    with_unit(&topic.ty)
                ));
                reached.extend(named_message(&topic.ty));
            }
        }
        for operation in &self.runner.operations {
            let class = class_of(&operation.operation);
            match operation.called {
                Called::OnMessage(id) => {
                    let topic = self.topic(id);
                    given.push(format!(
                        "{class}.{}({}: {})",
                        method(&topic.name),
                        self.argument(id),
                        with_unit(&topic.ty)
                    ));
                    reached.extend(named_message(&topic.ty));
                }
                Called::Offline(Offline::BeforeStart) => given.push(format!("{class}.before_start()")),
                Called::Offline(Offline::AfterEnd) => given.push(format!("{class}.after_end()")),
            }
            for (parameter, _) in &operation.parameters {
                let of_unit = parameter.unit.as_ref().map(|unit| format!(" in {unit}")).unwrap_or_default();
                let ty = parameter_type(parameter);
                given.push(format!("{}.{}: {ty}{of_unit}", parameters_class(operation), attribute(&parameter.name)));
            }
        }
        let mut next = 0;
        while let Some(&id) = reached.get(next) {
            next += 1;
            if reached[..next - 1].contains(&id) {
                continue;
            }
            for field in &self.runner.plan.message(id).fields {
                given.push(format!("{}.{}: {}", self.class(id), attribute(&field.name), with_unit(&field.ty)));
                reached.extend(named_message(&field.ty));
            }
        }
        given
    }

    fn stubs(&self, templates: &Templates, of: &[String]) -> Result<String, Problem> {
        let hooks = self.hooks().into_iter().filter(|hook| of.contains(&hook.name)).collect();
        let stubs = Stubs { space: &self.runner.plan.space, types: &self.module, hooks };
        templates.render("runner/hooks.py.tera", &stubs)
    }
}

/// The class of a hook that the user writes.
fn class_of(name: &str) -> String {
    attribute(&names::hook_type(name)).into_owned()
}

/// The class that it is derived from.
fn base(name: &str) -> String {
    names::hook_trait(name)
}

fn parameters_class(operation: &OperationPlan) -> String {
    names::parameters_type(&operation.operation)
}

fn parameter_type(parameter: &Parameter) -> String {
    match &parameter.domain {
        Domain::Number { integer: true, .. } => "int".to_owned(),
        Domain::Number { integer: false, .. } => "float".to_owned(),
        Domain::Point { .. } => "list[float]".to_owned(),
        Domain::Files { .. } => "str".to_owned(),
        Domain::Texts { texts } => {
            let texts: Vec<String> = texts.iter().map(|text| quoted(text)).collect();
            format!("Literal[{}]", texts.join(", "))
        }
    }
}

/// A text as Python writes it.
fn quoted(text: &str) -> String {
    serde_json::to_string(text).expect("a text is JSON")
}

/// What is said of the method for messages of a topic.
fn on(topic: &Topic, what: &str) -> String {
    let of_unit = unit(&topic.ty).map(|unit| format!(" In {unit}.")).unwrap_or_default();
    literal(&one_line(&format!("A message on `{}` (\"{}\"){what}{of_unit}", topic.name, paths(topic))))
}

/// The lines of a doc comment.
fn lines(doc: &str) -> Vec<String> {
    doc.lines().map(one_line).collect()
}

/// Adds a paragraph.
fn paragraph(doc: &mut Vec<String>, text: &str) {
    if !doc.is_empty() {
        doc.push(String::new());
    }
    doc.push(one_line(text));
}

fn described(doc: &str, more: [Option<String>; 3]) -> Vec<String> {
    lines(doc).into_iter().chain(more.into_iter().flatten().map(|line| one_line(&line))).collect()
}

/// A line of a docstring.
fn literal(line: &str) -> String {
    line.replace('\\', "\\\\").replace("\"\"\"", "\\\"\\\"\\\"")
}

/// A docstring of lines that are escaped already.
fn docstring(indent: &str, lines: &[String]) -> String {
    let [first, rest @ ..] = lines else { return String::new() };
    if rest.is_empty() {
        // A quotation mark before the last three would be one of them.
        let space = if first.ends_with('"') { " " } else { "" };
        return format!("{indent}\"\"\"{first}{space}\"\"\"\n");
    }
    let rest = rest.iter().map(|line| if line.is_empty() { "\n".to_owned() } else { format!("{indent}{line}\n") });
    format!("{indent}\"\"\"{first}\n{}{indent}\"\"\"\n", rest.collect::<String>())
}

/// The constants of a message, as those of its class.
fn constants(message: &MessageType) -> String {
    let mut scope = Scope::default();
    for field in &message.fields {
        scope.take(attribute(&field.name).into_owned(), "_");
    }
    let mut text = String::new();
    for NamedNumber { name, number } in &message.constants {
        let name = scope.take(attribute(name).into_owned(), "_");
        let (ty, number) = match number {
            whole if whole.fract() == 0.0 && whole.abs() < EXACT => ("int", format!("{whole:.0}")),
            real => ("float", format!("{real:?}")),
        };
        writeln!(text, "    {name}: ClassVar[{ty}] = {number}").expect("text grows as needed");
    }
    if text.is_empty() { text } else { format!("\n{text}") }
}

fn dataclass(
    decorator: &str,
    name: &str,
    doc: &[String],
    fields: impl Iterator<Item = (String, String, Vec<String>)>,
) -> String {
    let doc: Vec<String> = doc.iter().map(|line| literal(line)).collect();
    let mut text = format!("\n\n{decorator}\nclass {name}:\n{}", docstring("    ", &doc));
    for (at, (name, ty, doc)) in fields.enumerate() {
        let gap = if at == 0 { "\n" } else { "" };
        let doc: Vec<String> = doc.iter().map(|line| literal(line)).collect();
        write!(text, "{gap}    {name}: {ty}\n{}", docstring("    ", &doc)).expect("text grows as needed");
    }
    text
}
