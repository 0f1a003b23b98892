//! How the nodes of a ROS 2 system are remapped, so that the topics that operations act on pass through the relay: for
//! people who start these nodes themselves.

use std::fmt::Write as _;

use sesame_plan::{CampaignPlan, Channel, Dialect, NodeId, Remapping};

/// A line to paste for each node, and for each program that the plan does not know.
pub fn text(plan: &CampaignPlan) -> String {
    const STRING: &str = "a string takes all text";
    if plan.simulator.properties().bus.is_none() {
        return format!("`{}` brings all messages itself: nothing is remapped\n", plan.simulator.name);
    }
    if plan.simulator.dialect() != Some(Dialect::Ros2) {
        return names(plan);
    }
    let mut out = proxies(plan);
    for (id, node) in (0..).map(NodeId).zip(&plan.nodes) {
        let arguments = plan.ros_args(Some(id));
        if arguments.is_empty() {
            continue;
        }
        writeln!(out, "# node {}", node.name).expect(STRING);
        writeln!(out, "ros2 run … {}", arguments.join(" ")).expect(STRING);
        out.push_str(&heard_undisturbed(plan, id));
    }
    for (channel, remapping) in plan.unclaimed() {
        let programs = match channel {
            Channel::Topic => "every program that publishes",
            Channel::Request | Channel::Reply => "the program that offers",
        };
        writeln!(out, "# {programs} {}", remapping.from).expect(STRING);
        writeln!(out, "ros2 run … --ros-args -r {}", remapping.rule()).expect(STRING);
    }
    if out.is_empty() {
        out.push_str("# no operation acts on a topic: nothing is remapped\n");
    }
    out
}

/// The names under which publishers and distinguished subscribers are, for middleware without `ros2 run`.
fn names(plan: &CampaignPlan) -> String {
    const STRING: &str = "a string takes all text";
    let mut out = proxies(plan);
    for (id, node) in (0..).map(NodeId).zip(&plan.nodes) {
        let remappings = plan.remappings(id);
        if !remappings.is_empty() {
            writeln!(out, "# node {}", node.name).expect(STRING);
        }
        for Remapping { from, to } in remappings {
            writeln!(out, "{from} → {to}").expect(STRING);
        }
        out.push_str(&heard_undisturbed(plan, id));
    }
    for (_, Remapping { from, to }) in plan.unclaimed() {
        writeln!(out, "# every program that publishes or offers {from}\n{from} → {to}").expect(STRING);
    }
    if out.is_empty() {
        out.push_str("# no operation acts on a topic: nothing is remapped\n");
    }
    out
}

/// That a node hears nothing of what operations do on paths that it both publishes and subscribes to.
fn heard_undisturbed(plan: &CampaignPlan, id: NodeId) -> String {
    let line = |path: String| {
        format!("# it also subscribes to {path}, under the same new name: operations do not reach it there\n")
    };
    plan.heard_undisturbed(id).into_iter().map(line).collect()
}

/// Where clients of a bridge connect that are one node each: the proxies change their names.
fn proxies(plan: &CampaignPlan) -> String {
    const STRING: &str = "a string takes all text";
    let mut out = String::new();
    for (id, node) in (0..).map(NodeId).zip(&plan.nodes) {
        if let Some(proxy) = plan.proxy_of(id) {
            writeln!(out, "# node {}: its clients connect to the proxy, and nothing is remapped", node.name)
                .expect(STRING);
            writeln!(out, "{}", proxy.url).expect(STRING);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use sesame_dsl::source::SourceMap;

    use super::*;

    const ARMS: &str = include_str!("../../sesame-dsl/tests/good/ros2.sesame");

    fn plan(text: &str) -> CampaignPlan {
        let mut sources = SourceMap::new();
        let file = sources.add("arms.sesame", text);
        let analysis = sesame_dsl::analyse(&sources, file);
        let space = analysis.model.unwrap_or_else(|| panic!("{:#?}", analysis.diagnostics));
        let plan = crate::lower::lower(&space, space.campaign("delays").unwrap(), "arms.sesame", "sesamec 0.0.0").plan;
        plan.validate().unwrap();
        plan
    }

    #[test]
    fn each_node_gets_a_line_to_paste() {
        insta::assert_snapshot!(text(&plan(ARMS)));
    }

    #[test]
    fn a_node_that_subscribes_to_what_it_publishes_is_told_that_operations_do_not_reach_it_there() {
        let filter = "space filter\n\
            system {\n\
              simulator robots = ros2\n\
              message Level = \"std_msgs/msg/Float64\"\n\
              topic level = \"/{r1,r2}/level\" : Level\n\
              node filter \"/{r1,r2}/filter\" { publishes level  subscribes level[*] }\n\
            }\n\
            metric highest maximise default 0 = max(level.data)\n\
            operation cut on level = blackhole\n\
            campaign delays {\n\
              objectives highest\n\
              operations cut 1 per test\n\
              search     random { evaluations 10 }\n\
              end        after 5s\n\
            }\n";
        insta::assert_snapshot!(text(&plan(filter)));
    }

    #[test]
    fn the_server_of_an_action_is_remapped_part_by_part() {
        let robots = "space robots\n\
            system {\n\
              simulator robots = ros2\n\
              message Goal     = \"cell_msgs/action/Drive_Goal\" { to: point[m] }\n\
              message Result   = \"cell_msgs/action/Drive_Result\" { }\n\
              message Feedback = \"cell_msgs/action/Drive_Feedback\" { left: real[m] }\n\
              action drive = \"/{r1,r2}/drive\" : \"cell_msgs/action/Drive\"\n\
              node robot \"/{r1,r2}/robot\" { serves drive }\n\
              node fleet { calls drive }\n\
            }\n\
            metric left minimise default 9m = min(each of drive_feedback.feedback.left)\n\
            operation denied on drive_goal_reply.accepted = stuck at false\n\
            campaign delays {\n\
              objectives left\n\
              operations denied 1 per test\n\
              search     random { evaluations 10 }\n\
              end        after 5s\n\
            }\n";
        insta::assert_snapshot!(text(&plan(robots)));
    }

    #[test]
    fn the_plan_of_a_system_of_ros_is_as_blessed() {
        let plan = plan(ARMS);
        insta::assert_snapshot!(crate::lower::tests::base().compact(&crate::lower::tests::tree(&plan)));
        let read: CampaignPlan = serde_json::from_str(&serde_json::to_string(&plan).unwrap()).unwrap();
        assert_eq!(read, plan);
    }
}
