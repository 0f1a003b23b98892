//! A managed node by rclpy: operations set its parameters of every type and take it through transitions of its
//! lifecycle, and everything is as before when they end.

use sesame_tests::workspace;

use crate::environment::{Domain, Space, Vendor};

/// The parameters of the node: what an operation may set each to, the `value` that a test chooses, and a formula that
/// holds while the parameter has it.
const PARAMETERS: [(&str, &str, &str, &str); 7] = [
    ("enabled", "false", "false", "not enabled.bool_value"),
    ("mode", r#"one of "manual", "off""#, "manual", r#"mode.string_value == "manual""#),
    ("gains", "list [-0.5, 1e3]", "list [-0.5, 1000]", "gains.double_array_value[1] == 1000"),
    ("ids", "one of list [7], list []", "list [7]", "ids.integer_array_value[0] == 7"),
    ("words", r#"list ["", "c, d"]"#, r#"list [\"\", \"c, d\"]"#, r#"words.string_array_value[1] == "c, d""#),
    ("flags", "list [true, false, true]", "list [true, false, true]", "not flags.bool_array_value[1]"),
    ("raw", "list [255]", "list [255]", "raw.byte_array_value[0] == 255"),
];

/// The lidar with operations on it, and what a test chooses for each of its parameters.
fn managed(name: &str, vendor: Vendor) -> Option<Space> {
    let python = vendor.python()?;
    let domain = Domain::free();
    let types = Vendor::share(&python).display().to_string();
    let python = python.display().to_string();
    let program = workspace().join("tests/ros2/peers/managed.py").display().to_string();
    let text = format!(
        "space lidars\n\
         system {{\n\
           simulator cell = ros2 {{ domain {domain}  types {types:?} }}\n\
           message Number  = \"std_msgs/msg/Float64\" {{ data: real }}\n\
           message Setting = \"rcl_interfaces/msg/ParameterValue\" {{\n\
             bool_value: bool  string_value: text  byte_array_value: list of int  bool_array_value: list of bool\n\
             integer_array_value: list of int  double_array_value: list of real  string_array_value: list of text\n\
           }}\n\
           topic state = \"/state\" : Number\n\
           topic scan  = \"/scan\" : Number\n\
           {topics}\
           node lidar \"/lidar\" {{\n\
             launch {python:?} {program:?} \"{{ros-args}}\" {{ ready when line \"up\" within 120s }}\n\
             publishes state, scan{names}\n\
           }}\n\
         }}\n\
         metric lowest   minimise default 9  = min(state.data)\n\
         metric at_last  default 0           = last(state.data)\n\
         metric scans    default 0           = count(scan.data > 0)\n\
         metric inactive default 0s          = duration(state.data == 2)\n\
         {metrics}\
         {operations}\
         operation stubborn on parameter \"stubborn\" of lidar = set true\n\
         operation other    on parameter \"enabled\" of lidar = set \"yes\"\n\
         operation numbers  on parameter \"enabled\" of lidar = set [0, 1]\n\
         operation off      on node lidar = transition deactivate\n\
         operation down     on node lidar = transition cleanup\n\
         operation on_again on node lidar = transition activate\n\
         test settings {{ {uses} }}\n\
         test wrong    {{ other value \"yes\" from 1s to 2s  numbers value 1 from 1s to 2s }}\n\
         test stops    {{ off from 1s to 2s }}\n\
         test cleans   {{ down from 1s to 2s }}\n\
         test is_on    {{ on_again from 1s to 2s }}\n\
         test refuses  {{ stubborn value \"true\" from 0.5s to 3s  off from 1s to 2s }}\n\
         campaign c {{\n\
           objectives lowest\n\
           observes   at_last, scans, inactive{observed}\n\
           operations off, down, on_again, stubborn, other, numbers{operated} 1 per test\n\
           search     random {{ evaluations 1 }}\n\
           end        after 4s\n\
         }}\n",
        domain = domain.number,
        topics = PARAMETERS.map(|(name, ..)| format!("topic {name} = \"/{name}\" : Setting\n")).concat(),
        names = PARAMETERS.map(|(name, ..)| format!(", {name}")).concat(),
        metrics =
            PARAMETERS.map(|(name, .., holds)| format!("metric m_{name} default 0s = duration({holds})\n")).concat(),
        operations = PARAMETERS
            .map(|(name, values, ..)| format!("operation set_{name} on parameter \"{name}\" of lidar = set {values}\n"))
            .concat(),
        uses = PARAMETERS.map(|(name, _, chosen, _)| format!("set_{name} value \"{chosen}\" from 1s to 2s\n")).concat(),
        observed = PARAMETERS.map(|(name, ..)| format!(", m_{name}")).concat(),
        operated = PARAMETERS.map(|(name, ..)| format!(", set_{name}")).concat(),
    );
    Some(Space::write(name, domain, "lidars.sesame", &text))
}

#[test]
fn parameters_of_every_type_are_set_and_have_their_old_values_again() {
    let Some(lidar) = managed("parameters_of_every_type", Vendor::Jazzy) else { return };
    lidar.sesamec(&["check", "lidars.sesame"]).expect(0);
    lidar.sesamec(&["known", "lidars.sesame", "settings", "wrong", "--workers", "1"]).expect(0);
    let listed = lidar.listed("known");
    for (name, ..) in PARAMETERS {
        let metric = format!("m_{name}");
        let durations = ["T0", "T1", "T2"].map(|test| listed.value(test, &metric));
        let [before, set, wrong] = durations;
        // The window is of one second, in a run of four.
        assert!(before == 0.0 && wrong == 0.0 && (0.2..2.5).contains(&set), "{name}: {durations:?}");
    }
    let shown = lidar.sesamec(&["show", "lidars.sesame", "T2", "--results", "known"]).expect(0).out;
    for note in [
        "parameter `enabled` of node `lidar` cannot be set: it is a `bool`, not a text",
        "parameter `enabled` of node `lidar` cannot be set: it is a `bool`, not a number",
    ] {
        assert!(shown.contains(note), "{shown}");
    }
}

#[test]
fn a_node_is_taken_through_a_transition_and_back() {
    for (name, vendor) in [("transitions_kilted", Vendor::Kilted), ("transitions_jazzy", Vendor::Jazzy)] {
        let Some(lidar) = managed(name, vendor) else { continue };
        lidar.sesamec(&["known", "lidars.sesame", "stops", "cleans", "is_on", "refuses", "--workers", "1"]).expect(0);
        let listed = lidar.listed("known");
        let [lowest, at_last, scans, inactive] = ["lowest", "at_last", "scans", "inactive"]
            .map(|metric| ["T0", "T1", "T2", "T3", "T4"].map(|test| listed.value(test, metric)));
        assert_eq!(lowest, [3.0, 2.0, 1.0, 3.0, 3.0], "the states are numbers of ROS: {listed:#}");
        assert_eq!(at_last, [3.0; 5], "all are active again: {listed:#}");
        assert!((0.2..2.5).contains(&inactive[1]), "{listed:#}");
        assert!(scans[1] > 0.0 && scans[1] < 0.9 * scans[3], "it does not scan meanwhile: {listed:#}");
        let shown = |test: &str| lidar.sesamec(&["show", "lidars.sesame", test, "--results", "known"]).expect(0).out;
        let said = "node `lidar` cannot `activate`: it is active";
        assert!(shown("T3").contains(said), "{}", shown("T3"));
        let said = "node `lidar` cannot `deactivate`: it refuses to `deactivate`";
        assert!(shown("T4").contains(said), "{}", shown("T4"));
    }
}
