//! Layouts of ROS messages that come from elsewhere: what their fields are in the language, and in which order.

use std::cell::RefCell;

use sesame_dsl::diagnostic::render;
use sesame_dsl::interfaces::{ConstantValue, Folders, Interfaces};
use sesame_dsl::model::{Bound, OperationKind, Space, Type};
use sesame_dsl::source::SourceMap;
use sesame_dsl::{Analysis, analyse_with};
use sesame_plan::{Interface, InterfaceField, NamedNumber, Primitive, WireType};

use crate::files::analyse_text;

/// A folder in memory: for each name, its fields and what it contains before it.
#[derive(Default)]
struct Memory {
    asked: RefCell<Vec<String>>,
}

fn of(primitive: Primitive) -> WireType {
    WireType::Primitive { primitive }
}

fn inner(name: &str) -> WireType {
    WireType::Interface { name: name.to_owned() }
}

fn interface(name: &str, fields: &[(&str, WireType)]) -> Interface {
    let field = |(name, ty): &(&str, WireType)| InterfaceField { name: (*name).to_owned(), ty: ty.clone() };
    Interface { name: name.to_owned(), fields: fields.iter().map(field).collect() }
}

fn header() -> Vec<Interface> {
    let time = [("sec", of(Primitive::Int32)), ("nanosec", of(Primitive::Uint32))];
    vec![
        interface("builtin_interfaces/msg/Time", &time),
        interface(
            "cell_msgs/msg/Header",
            &[("stamp", inner("builtin_interfaces/msg/Time")), ("frame", WireType::STRING)],
        ),
    ]
}

impl Interfaces for Memory {
    fn find(&self, folders: Folders<'_>, name: &str) -> Result<Option<Vec<Interface>>, String> {
        self.asked.borrow_mut().push(format!("{name} in {} of {}", folders.written.join(" and "), folders.file));
        let mut found = header();
        match name {
            "cell_msgs/msg/Header" => {}
            "cell_msgs/msg/Broken" => return Err("its line 3 is not a field".to_owned()),
            "cell_msgs/msg/Joint" => {
                let axes = ["x", "y", "z"].map(|axis| (axis, of(Primitive::Float32)));
                found.push(interface("other_msgs/msg/Place", &axes));
                found.push(interface("other_msgs/msg/Zone", &[("level", of(Primitive::Float64))]));
                let ranges = WireType::Array { of: Box::new(of(Primitive::Float32)), length: 4 };
                let zones = WireType::Sequence { of: Box::new(inner("other_msgs/msg/Zone")), bound: Some(3) };
                let fields = [
                    ("header", inner("cell_msgs/msg/Header")),
                    ("place", inner("other_msgs/msg/Place")),
                    ("ranges", ranges),
                    ("zones", zones),
                    ("count", of(Primitive::Uint64)),
                    ("ok", of(Primitive::Bool)),
                    ("name", WireType::WSTRING),
                ];
                found.push(interface(name, &fields));
            }
            "cell_msgs/srv/Move_Request" => found.push(interface(name, &[("to", inner("cell_msgs/msg/Header"))])),
            "cell_msgs/srv/Move_Response" => found = vec![interface(name, &[])],
            _ if name.starts_with("cell_msgs/action/Drive_") => {
                let id = WireType::Array { of: Box::new(of(Primitive::Uint8)), length: 16 };
                let id = interface("unique_identifier_msgs/msg/UUID", &[("uuid", id)]);
                let part = |name: &str| interface(name, &[("x", of(Primitive::Float64))]);
                let messages = sesame_plan::action::messages("cell_msgs/action/Drive");
                match messages.into_iter().find(|message| message.name == name) {
                    Some(message) => {
                        found.push(id);
                        for field in &message.fields {
                            match &field.ty {
                                WireType::Interface { name } if name.contains("/Drive_") => found.push(part(name)),
                                _ => {}
                            }
                        }
                        found.push(message);
                    }
                    None => found.push(part(name)),
                }
            }
            _ => return Ok(None),
        }
        Ok(Some(found))
    }
}

fn analysed(system: &str) -> (SourceMap, Analysis, Vec<String>) {
    let mut sources = SourceMap::new();
    let text = format!(
        "space cell system {{ simulator cell = ros2 {{ types \"interfaces\", \"/opt/ros\" }} {system} }}
         metric fuzzed minimise = fuzzing_time()"
    );
    let root = sources.add("spaces/cell.sesame", text);
    let memory = Memory::default();
    let analysis = analyse_with(&sources, root, &memory);
    (sources, analysis, memory.asked.into_inner())
}

fn model(system: &str) -> Space {
    let (sources, analysis, _) = analysed(system);
    analysis.model.unwrap_or_else(|| panic!("{}", render::human(&analysis.diagnostics, &sources, false)))
}

fn message(space: &Space, name: &str) -> String {
    let found = space.messages.values().find(|message| message.declaration.name == name).expect("it is there");
    let written = |ty: &Type| match ty {
        Type::Message(id) => space.messages[*id].declaration.name.clone(),
        Type::List(of) => match &**of {
            Type::Message(id) => format!("list of {}", space.messages[*id].declaration.name),
            of => format!("list of {of:?}"),
        },
        Type::Real(Some(unit)) => format!("Real in {}", unit.text()),
        ty => format!("{ty:?}"),
    };
    let fields = found.fields.iter().map(|field| format!("{}: {}", field.declaration.name, written(&field.ty)));
    fields.collect::<Vec<_>>().join(", ")
}

#[test]
fn a_layout_gives_all_fields_and_the_messages_that_it_contains() {
    let space = model(r#"message Joint = "cell_msgs/Joint"  topic joints = "joints" : Joint"#);
    assert_eq!(
        message(&space, "Joint"),
        "header: Header, place: Point(None), ranges: list of Real(None), zones: list of Zone, count: Int(None), \
         ok: Bool, name: Text"
    );
    assert_eq!(message(&space, "Header"), "stamp: Real in s, frame: Text");
    let names: Vec<&str> = space.interfaces.iter().map(|interface| interface.name.as_str()).collect();
    assert_eq!(names[..2], ["builtin_interfaces/msg/Time", "cell_msgs/msg/Header"]);
    assert_eq!(names.last(), Some(&"cell_msgs/msg/Joint"));
    assert_eq!(space.messages.len(), 3);
}

#[test]
fn a_message_of_the_space_with_the_type_is_the_one_that_is_contained_and_no_name_is_taken_twice() {
    let space = model(
        r#"message Joint = "cell_msgs/msg/Joint" { count: int[mm] }  message Zone = "std_msgs/msg/Bool"
           message Stamped = "cell_msgs/msg/Header" { stamp: real[s] }  topic joints = "joints" : Joint
           topic zones = "zones" : Zone"#,
    );
    assert!(message(&space, "Joint").starts_with("header: Stamped, "), "{}", message(&space, "Joint"));
    assert!(
        message(&space, "Joint").contains("zones: list of Zone2, count: Int(Some("),
        "{}",
        message(&space, "Joint")
    );
    assert_eq!(message(&space, "Zone2"), "level: Real(None)");
}

#[test]
fn a_service_has_two_topics_with_its_messages() {
    let space = model(r#"service moving = "move" : "cell_msgs/srv/Move""#);
    let topics: Vec<&str> = space.topics.values().map(|topic| topic.declaration.name.as_str()).collect();
    assert_eq!(topics, ["moving_request", "moving_reply"]);
    assert_eq!(message(&space, "MoveRequest"), "to: Header");
    assert_eq!(message(&space, "MoveResponse"), "");
}

#[test]
fn an_action_has_eight_topics_with_its_messages_and_fields_have_units_where_one_declares_them() {
    let space = model(
        r#"message Goal = "cell_msgs/action/Drive_Goal" { x: real[m] }
           message Told = "cell_msgs/action/Drive_FeedbackMessage"
           action drive = "drive" : "cell_msgs/Drive"
           topic copy = "copy" : Told"#,
    );
    let topics: Vec<String> =
        space.topics.values().map(|topic| format!("{} {}", topic.declaration.name, topic.paths[0])).collect();
    let of_action = [
        "drive_goal_request /drive/_action/send_goal",
        "drive_goal_reply /drive/_action/send_goal",
        "drive_cancel_request /drive/_action/cancel_goal",
        "drive_cancel_reply /drive/_action/cancel_goal",
        "drive_result_request /drive/_action/get_result",
        "drive_result_reply /drive/_action/get_result",
        "drive_feedback /drive/_action/feedback",
        "drive_status /drive/_action/status",
    ];
    assert_eq!(topics[0], "copy /copy");
    assert_eq!(topics[1..], of_action);
    assert_eq!(message(&space, "Goal"), "x: Real in m");
    assert_eq!(message(&space, "DriveSendGoalRequest"), "goal_id: UUID, goal: Goal");
    assert_eq!(message(&space, "DriveGetResultResponse"), "status: Int(None), result: DriveResult");
    assert_eq!(message(&space, "GoalStatusArray"), "status_list: list of GoalStatus");
    let feedback = space.topics.values().find(|topic| topic.declaration.name == "drive_feedback").unwrap();
    assert_eq!(feedback.ty, space.topics.values().next().unwrap().ty, "the declared message is taken");
}

#[test]
fn folders_are_asked_for_what_the_space_needs_only() {
    let (_, _, asked) = analysed(r#"message Joint = "cell_msgs/msg/Joint"  message B = "std_msgs/msg/Bool""#);
    assert_eq!(asked, ["cell_msgs/msg/Joint in interfaces and /opt/ros of spaces/cell.sesame"]);
}

#[test]
fn why_a_layout_cannot_be_read_is_said_at_the_message() {
    let (sources, analysis, _) = analysed(r#"message Broken = "cell_msgs/msg/Broken"  topic b = "b" : Broken"#);
    let said = render::short(&analysis.diagnostics, &sources);
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("E0216") && said.contains("the layout of `cell_msgs/msg/Broken` cannot be read"), "{said}");
}

#[test]
fn fields_of_a_layout_can_be_disturbed_and_measured() {
    let space = model(
        r#"message Joint = "cell_msgs/msg/Joint"  topic joints = "joints" : Joint }
           metric far = max(joints.place.x) metric late = max(time - joints.header.stamp)
           operation shift on joints.place = bias [(0, 0, 0), (1, 1, 1)]
           operation skew on joints.header.stamp = clock skew [0s, 1s]
           operation wide on joints.zones[*].level = scale [1, 2]
           operation odd on joints.ranges[2] = infinity
           test known { odd from 1s to 2s"#,
    );
    assert_eq!(space.operations.len(), 4);
}

/// Entries of the enumerations of a dialect are constants of the messages with such fields.
const FLIGHT: &str = r#"
space flight
system {
  simulator airspace = mavlink "udp://127.0.0.1:14550" {
    types "../dialects/small.xml"
    proxy drone "udp://127.0.0.1:14551"
  }
  // An own constant with the name of an entry counts.
  message Heartbeat { constant FLAG_SAFE = 64  type: int  custom_mode: int }
  topic heartbeat = "1/HEARTBEAT" : Heartbeat
  node drone { publishes heartbeat }
}
metric turned  maximise default 0s = duration(heartbeat.type == KIND_COAXIAL)
metric armed   maximise default 0s = duration(heartbeat.custom_mode == FLAG_ARMED or heartbeat.custom_mode == FLAG_SAFE)
metric kind                        = last(heartbeat.type)
requirement R1 "it stays what it is" = kind == KIND_QUADROTOR
requirement R2 "it is no aeroplane"  = kind > Heartbeat.KIND_FIXED_WING
operation lie on heartbeat.type = stuck at one of KIND_FIXED_WING, KIND_COAXIAL
operation turn on heartbeat.type = random one of KIND_QUADROTOR, Heartbeat.KIND_COAXIAL
test lies {
  lie value "KIND_COAXIAL" when kind == KIND_QUADROTOR for 1s
  expect kind == KIND_COAXIAL
}
campaign c {
  objectives turned, armed
  observes   kind
  operations lie, turn 1 per test
  search     random { evaluations 10 }
  end        after 5s
}
"#;

#[test]
fn entries_of_enumerations_of_a_dialect_are_constants() {
    let (sources, analysis) = analyse_text("flight", FLIGHT);
    let said = render::human(&analysis.diagnostics, &sources, false);
    let space = analysis.model.unwrap_or_else(|| panic!("{said}"));
    let bounds: Vec<Bound> = space.requirements.values().map(|requirement| requirement.bound).collect();
    assert_eq!(bounds, [Bound::Equal { value: 2.0 }, Bound::Above { value: 0.0 }]);
    let named = |name: &str, number| NamedNumber { name: name.to_owned(), number };
    let kinds: Vec<OperationKind> = space.operations.values().map(|operation| operation.kind.clone()).collect();
    let drawn = vec![named("KIND_QUADROTOR", 2.0), named("Heartbeat.KIND_COAXIAL", 3.0)];
    assert_eq!(
        kinds,
        [
            OperationKind::StuckAtConstant { numbers: vec![0.0, 3.0] },
            OperationKind::RandomConstant { constants: drawn }
        ]
    );
    let heartbeat =
        space.messages.values().find(|message| message.declaration.name == "Heartbeat").expect("it is there");
    let constants: Vec<(&str, &ConstantValue)> =
        heartbeat.constants.iter().map(|constant| (constant.name.as_str(), &constant.value)).collect();
    let expected = [
        ("FLAG_SAFE", 64.0),
        ("KIND_FIXED_WING", 0.0),
        ("KIND_QUADROTOR", 2.0),
        ("KIND_COAXIAL", 3.0),
        ("FLAG_ARMED", 1.0),
    ];
    let expected = expected.map(|(name, number)| (name, ConstantValue::Number(number)));
    assert_eq!(constants, expected.each_ref().map(|(name, value)| (*name, value)), "an own constant counts");
}
