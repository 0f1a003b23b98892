//! Finds operation hooks that are not implemented yet, before anything is simulated.

use std::panic::{self, AssertUnwindSafe};

use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Choice, Domain, Moment, OperationId};

use crate::fuzz::{KeyedRng, MessageCall, OperationEntry, RunContext, custom_operations};
use crate::metric::sample;

/// The custom operations of the plan whose hook, called with an artificial message, says that it is not implemented. A
/// hook that panics counts as implemented.
///
/// A hook before the start or after the end is called too, with a context that changes nothing: if it uses the context,
/// it is implemented, and the call ends there.
pub fn unimplemented_operations(plan: &CampaignPlan, hooks: &[OperationEntry]) -> Vec<OperationId> {
    let quiet = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let found = custom_operations(plan)
        .filter(|(_, moment, operation)| {
            let Some(entry) = hooks.iter().find(|entry| entry.operation == operation.name) else { return false };
            let choices: Vec<Choice> = operation.parameters.iter().map(|parameter| first(&parameter.domain)).collect();
            let topic = operation.topic.map(|topic| plan.topic(topic));
            let path = topic.and_then(|topic| topic.paths.first()).map_or("", String::as_str);
            let mut call = MessageCall::new(SimTime::ZERO, path, KeyedRng::new(0, 0, 0));
            let mut ctx = RunContext::probing();
            let called = panic::catch_unwind(AssertUnwindSafe(|| {
                let mut hook = (entry.build)(entry.operation, &choices);
                match (moment, topic) {
                    (Moment::OnMessage, Some(topic)) => hook.on_message(&mut sample(plan, &topic.ty), &mut call),
                    _ => hook.before_or_after_run(&mut ctx),
                }
            }));
            // A hook may say it before a panic.
            drop(called);
            call.unimplemented || ctx.unimplemented
        })
        .map(|(id, _, _)| id)
        .collect();
    panic::set_hook(quiet);
    found
}

/// The first choice that a domain permits.
fn first(domain: &Domain) -> Choice {
    match domain {
        Domain::Number { low, .. } => Choice::Value { value: *low },
        Domain::Point { low, .. } => Choice::Point { point: *low },
        Domain::Texts { texts: items } | Domain::Files { files: items } => {
            Choice::Text { text: items.first().cloned().unwrap_or_default() }
        }
    }
}
