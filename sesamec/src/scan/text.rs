//! The text of a space from what was found.

use std::fmt::Write as _;

use sesame_scan::Facts;

use super::comments::LeftOut;
use super::named::name_all;
use super::nodes::nodes;
use super::origin::Origin;
use super::topics::{action_lines, service_lines, topic_lines};
use super::types::Types;
use super::{blocks, expressible, simulator};

/// A space with its system, in need of formatting.
pub(super) fn space(facts: &Facts, types: &Types, origin: Origin<'_>) -> String {
    let mut left_out = LeftOut::default();
    let system = &facts.system;
    let clock = simulator::clock(facts);
    let topics = expressible::topics(facts, types, origin, clock, &mut left_out);
    let services = expressible::services(facts, origin, &mut left_out);
    let actions = expressible::actions(facts, origin, &mut left_out);
    let needed = types.needed(topics.iter().filter_map(|topic| topic.ty.as_deref()));
    let mut lists = Vec::new();
    let named = name_all(facts, &needed, &topics, (&services, &actions), &mut lists, &mut left_out);
    simulator::unseen(facts, &mut left_out);

    let mut text = simulator::heading(facts);
    if facts.cut {
        text.push_str("// decide: there is more than a scan keeps; the rest is missing here\n");
    }
    _ = writeln!(text, "space {}\n\nsystem {{", simulator::space_name(system));
    text.push_str(&simulator::block(&named.simulator, facts, origin, clock, &named.nodes));
    let sections = [
        blocks::messages(system, types, &named.messages, &needed),
        topic_lines(system, types, &named),
        service_lines(system, &named),
        action_lines(&named),
        left_out.text(),
        nodes(system, &named),
        if simulator::lacks_a_node(facts) { format!("node {} {{ }}\n", simulator::UNHEARD) } else { String::new() },
    ];
    for section in sections.iter().filter(|section| !section.is_empty()) {
        _ = write!(text, "\n{section}");
    }
    text.push_str("}\n");
    text
}
