//! The user's first version of a hook, from a text template: it is full of comments, which the formatter of machine
//! files would drop.

use std::collections::BTreeSet;

use serde::Serialize;
use sesame_plan::{Direction, Type};

use super::handlers::{Handler, handlers, paths};
use super::messages::{self, Messages, TypePaths};
use super::metrics;
use super::problem::Problem;
use super::rust::one_line;
use super::text::Templates;
use crate::names;
use crate::plan::{HookPlan, RunnerPlan};

#[derive(Serialize)]
struct Stub {
    doc: Vec<String>,
    metric: String,
    space: String,
    source: String,
    line: u32,
    meaning: Option<String>,
    imports: Vec<String>,
    hook_type: String,
    hook_trait: String,
    handlers: Vec<StubHandler>,
}

#[derive(Serialize)]
struct StubHandler {
    topic: String,
    paths: String,
    unit: Option<String>,
    method: String,
    parameter: String,
    ty: String,
    example: String,
}

/// The stub of a hook.
pub(super) fn stub(
    templates: &Templates,
    runner: &RunnerPlan,
    types: &Messages<'_>,
    hook: &HookPlan,
) -> Result<String, Problem> {
    let hook_type = names::hook_type(&hook.metric);
    let hook_trait = names::hook_trait(&hook.metric);
    let handlers = handlers(&runner.plan, &hook.inputs);
    let inputs: Vec<&Type> = handlers.iter().map(|handler| &handler.topic.ty).collect();
    let structs: BTreeSet<&str> =
        inputs.iter().filter_map(|ty| messages::named_message(ty)).map(|id| types.struct_name(id)).collect();
    // A message called like the hook itself is reached through its module.
    let clash = structs.iter().any(|&name| name == hook_type || name == hook_trait);
    let type_paths = if clash { TypePaths::BY_MODULE } else { TypePaths::IMPORTED };

    let mut imports = vec![format!("crate::generated::metrics::{}", names::written(&hook_trait))];
    match structs.into_iter().map(names::written).collect::<Vec<_>>().as_slice() {
        [] => {}
        _ if clash => imports.push("crate::generated::messages".to_owned()),
        [one] => imports.push(format!("crate::generated::messages::{one}")),
        several => imports.push(format!("crate::generated::messages::{{{}}}", several.join(", "))),
    }
    imports.sort();
    imports.push("sesame_runtime::metric::Context".to_owned());
    if inputs.iter().any(|ty| messages::holds_text(ty)) {
        imports.push("sesame_runtime::value::Text".to_owned());
    }

    let stub = Stub {
        doc: hook.doc.lines().map(one_line).collect(),
        metric: hook.metric.clone(),
        space: runner.plan.space.clone(),
        source: one_line(&hook.source),
        line: hook.line,
        meaning: metrics::meaning(hook).as_deref().map(one_line),
        imports,
        hook_type: names::written(&hook_type),
        hook_trait: names::written(&hook_trait),
        handlers: handlers.iter().map(|handler| stub_handler(types, hook, handler, type_paths)).collect(),
    };
    templates.render("runner/hook.rs.tera", &stub)
}

fn stub_handler(types: &Messages<'_>, hook: &HookPlan, handler: &Handler<'_>, type_paths: TypePaths) -> StubHandler {
    StubHandler {
        topic: handler.topic.name.clone(),
        paths: one_line(&paths(handler.topic)),
        unit: messages::unit(&handler.topic.ty).map(one_line),
        method: names::written(&handler.method),
        parameter: names::written(&handler.parameter),
        ty: types.borrowed(&handler.topic.ty, type_paths),
        example: example(types, hook, handler),
    }
}

/// A line that would make a metric of this input: something to start from, valid Rust on its own.
fn example(types: &Messages<'_>, hook: &HookPlan, handler: &Handler<'_>) -> String {
    let (value, ty) = number(types, &handler.topic.ty, &handler.parameter);
    let same_unit = hook.unit.is_some() && messages::unit(ty) == hook.unit.as_deref();
    let real = match ty {
        Type::Int { .. } => format!("{value} as f64"),
        _ => value.clone(),
    };
    let number = matches!(ty, Type::Int { .. } | Type::Real { .. });
    match (ty, hook.direction) {
        (_, Some(Direction::Maximise)) if number && same_unit => {
            format!("ctx.set(ctx.value().map_or({real}, |highest| highest.max({real})));")
        }
        (_, Some(Direction::Minimise)) if number && same_unit => {
            format!("ctx.set(ctx.value().map_or({real}, |lowest| lowest.min({real})));")
        }
        (_, None) if number && same_unit => format!("ctx.set({real});"),
        (Type::Real { .. }, _) => counted(&format!("{value} < 0.0")),
        (Type::Int { .. }, _) => counted(&format!("{value} < 0")),
        (Type::Bool, _) => counted(&value),
        (Type::Text, _) => counted(&format!("*{value} == *\"…\"")),
        (Type::Point { .. }, _) => counted(&format!("{value}[2] < 0.0")),
        (Type::List { .. }, _) => counted(&format!("!{value}.is_empty()")),
        (Type::Message { .. }, _) => "ctx.add(1.0);".to_owned(),
    }
}

/// An expression that counts time in which a condition holds.
fn counted(condition: &str) -> String {
    format!("if {condition} && ctx.every_seconds(0.2) {{ ctx.add(1.0); }}")
}

/// The part of an input that an example speaks of: its first number, or else its first field.
fn number<'a>(types: &Messages<'a>, ty: &'a Type, value: &str) -> (String, &'a Type) {
    let Type::Message { id } = ty else { return (value.to_owned(), ty) };
    let fields = || types.fields(*id);
    let is_number = |ty: &Type| matches!(ty, Type::Real { .. } | Type::Int { .. });
    match fields().find(|(field, _)| is_number(&field.ty)).or_else(|| fields().next()) {
        Some((field, rust_name)) => number(types, &field.ty, &format!("{value}.{}", names::written(rust_name))),
        None => (value.to_owned(), ty),
    }
}
