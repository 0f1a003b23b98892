//! Finds hooks that are not implemented yet, before anything is simulated.

use std::panic::{self, AssertUnwindSafe};

use sesame_plan::{CampaignPlan, MetricId, MetricSource, Type};

use crate::metric::{Context, HookEntry};
use crate::value::{Fields, Record, Text, Value};

/// The metrics of the plan whose hook, called with artificial messages, says that it is not implemented. A hook that
/// panics counts as implemented.
pub fn unimplemented_hooks(plan: &CampaignPlan, hooks: &[HookEntry]) -> Vec<MetricId> {
    let quiet = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let found = (0u32..)
        .map(MetricId)
        .zip(&plan.metrics)
        .filter(|(_, metric)| {
            let MetricSource::Hook { topics } = &metric.source else { return false };
            let Some(entry) = hooks.iter().find(|hook| hook.metric == metric.name) else { return false };
            let mut ctx = Context::default();
            let called = panic::catch_unwind(AssertUnwindSafe(|| {
                let mut hook = (entry.build)(entry.metric);
                hook.on_start(&mut ctx);
                for (input, topic) in topics.iter().enumerate() {
                    let topic = plan.topic(*topic);
                    ctx.topic = Text::from(topic.paths.first().map_or("", String::as_str));
                    hook.on_message(input, &sample(plan, &topic.ty), &mut ctx);
                }
                hook.on_end(&mut ctx);
            }));
            // A hook may say it before a panic.
            drop(called);
            ctx.unimplemented
        })
        .map(|(id, _)| id)
        .collect();
    panic::set_hook(quiet);
    found
}

/// A message of a type: zeros, empty texts and lists.
pub(crate) fn sample(plan: &CampaignPlan, ty: &Type) -> Value {
    match ty {
        Type::Bool => Value::Bool(false),
        Type::Int { .. } => Value::Int(0),
        Type::Real { .. } => Value::Real(0.0),
        Type::Text => Value::Text(Text::default()),
        Type::Point { .. } => Value::Point([0.0; 3]),
        Type::List { .. } => Value::List(Vec::new()),
        Type::Message { id } => {
            let fields = &plan.message(*id).fields;
            let names = Fields::new(fields.iter().map(|field| field.name.as_str()));
            Record::new(&names, fields.iter().map(|field| sample(plan, &field.ty)).collect()).into()
        }
    }
}
