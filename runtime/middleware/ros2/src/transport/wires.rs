//! The wires of a run, as ROS knows them.

use sesame_plan::CampaignPlan;
use sesame_relay::wire::{Line, WireTable, lines};

/// The lines of a plan's topics by absolute names, in the order of the wires, each with the interface of its messages.
pub(super) fn lines_in_ros(plan: &CampaignPlan, wires: &WireTable) -> Vec<(Line, String)> {
    let with_interface = |line: Line| {
        let interface = plan.topic(line.topic).interface.clone()?;
        Some((in_ros(line), interface))
    };
    lines(plan, wires).into_iter().filter_map(with_interface).collect()
}

fn in_ros(mut line: Line) -> Line {
    let sources = line.sources.iter_mut().map(|source| &mut source.path);
    let sinks = line.sinks.iter_mut().map(|sink| &mut sink.path);
    for path in sources.chain(sinks).chain([&mut line.path]) {
        *path = absolute(path);
    }
    line
}

/// A name of ROS with the slash that it has in the middleware.
pub(super) fn absolute(path: &str) -> String {
    if path.starts_with('/') { path.to_owned() } else { format!("/{path}") }
}
