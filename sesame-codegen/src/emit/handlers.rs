//! What a hook is called with: a handler for each input topic of its metric.

use heck::ToSnakeCase;
use sesame_plan::{CampaignPlan, MessageId, Topic, TopicId, Type};

use super::messages::{self, Messages, TypePaths};
use crate::names::{self, Scope};

/// One handler of a hook.
pub(super) struct Handler<'a> {
    /// The topic it takes messages of.
    pub(super) topic: &'a Topic,
    /// The function, for example `on_zones`.
    pub(super) method: String,
    /// Its parameter, for example `zone`.
    pub(super) parameter: String,
}

/// The handlers of a hook, in the order of its inputs.
pub(super) fn handlers<'a>(plan: &'a CampaignPlan, inputs: &[TopicId]) -> Vec<Handler<'a>> {
    let mut scope = free_methods();
    inputs.iter().map(|&input| handler_among(plan, input, &mut scope)).collect()
}

/// The handler of a hook that takes messages of one topic.
pub(super) fn handler(plan: &CampaignPlan, input: TopicId) -> Handler<'_> {
    handler_among(plan, input, &mut free_methods())
}

/// The names that a handler may have.
fn free_methods() -> Scope {
    // A hook is also told when a run starts and ends.
    Scope::reserving(&["on_start", "on_end"])
}

fn handler_among<'a>(plan: &'a CampaignPlan, input: TopicId, scope: &mut Scope) -> Handler<'a> {
    let topic = plan.topic(input);
    let method = scope.take(format!("on_{}", topic.name.to_snake_case()), "_message");
    Handler { topic, method, parameter: parameter(plan, topic) }
}

/// What a handler calls its message: the last word of its type (`SafetyZone` → `zone`), or the topic's name for a
/// plain value (`speed`).
fn parameter(plan: &CampaignPlan, topic: &Topic) -> String {
    let name = match &topic.ty {
        Type::Message { id } => {
            let snake = names::snake(&plan.message(*id).name);
            let last = snake.rsplit('_').find(|word| word.starts_with(|first: char| first.is_ascii_alphabetic()));
            names::snake(last.unwrap_or("message"))
        }
        _ => names::snake(&topic.name),
    };
    // Not the hook itself, nor its context, nor a word that would need escaping in every line the user writes.
    if name == "ctx" || name == "parameters" || names::written(&name) != name || name.starts_with("self") {
        "message".to_owned()
    } else {
        name
    }
}

/// What a hook is given, one line for each handler and for each field of a message it takes, messages inside messages
/// included. When these lines change, a hook may have to.
pub(super) fn inputs(plan: &CampaignPlan, types: &Messages<'_>, inputs: &[TopicId]) -> Vec<String> {
    let mut lines = Vec::new();
    let mut reached: Vec<MessageId> = Vec::new();
    let described = |ty: &Type| {
        let unit = messages::unit(ty).map(|unit| format!(" in {unit}")).unwrap_or_default();
        types.owned(ty, TypePaths::IMPORTED) + &unit
    };
    for handler in handlers(plan, inputs) {
        lines.push(format!("{}({}: {})", handler.method, handler.parameter, described(&handler.topic.ty)));
        reached.extend(messages::named_message(&handler.topic.ty));
    }
    let mut next = 0;
    while let Some(&id) = reached.get(next) {
        next += 1;
        if reached[..next - 1].contains(&id) {
            continue;
        }
        for (field, rust_name) in types.fields(id) {
            lines.push(format!("{}.{rust_name}: {}", types.struct_name(id), described(&field.ty)));
            reached.extend(messages::named_message(&field.ty));
        }
    }
    lines
}

/// The names on the wire of a topic as the `.sesame` file has them: a group in braces if its members differ in one
/// part.
pub(super) fn paths(topic: &Topic) -> String {
    let [first, rest @ ..] = topic.paths.as_slice() else { return String::new() };
    if rest.is_empty() {
        return first.clone();
    }
    let parts: Vec<Vec<&str>> = topic.paths.iter().map(|path| path.split('/').collect()).collect();
    let same_length = parts.iter().all(|other| other.len() == parts[0].len());
    let differing: Vec<usize> =
        (0..parts[0].len()).filter(|&at| same_length && parts.iter().any(|other| other[at] != parts[0][at])).collect();
    let [at] = differing[..] else { return topic.paths.join(", ") };
    let members: Vec<&str> = parts.iter().map(|path| path[at]).collect();
    let group = format!("{{{}}}", members.join(","));
    let mut written = parts[0].clone();
    written[at] = &group;
    written.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic(paths: &[&str]) -> Topic {
        let paths = paths.iter().map(|&path| path.to_owned()).collect();
        Topic { paths, ..sesame_plan::testing::topic("t", &[], Type::Bool) }
    }

    #[test]
    fn a_group_is_written_with_braces_where_its_members_differ() {
        assert_eq!(paths(&topic(&["zones/Z1/level", "zones/Z2/level"])), "zones/{Z1,Z2}/level");
        assert_eq!(paths(&topic(&["a/b", "c/d"])), "a/b, c/d");
        assert_eq!(paths(&topic(&["a/b", "c"])), "a/b, c");
        assert_eq!(paths(&topic(&["a"])), "a");
    }
}
