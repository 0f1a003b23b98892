//! Files of ROS 1: what they mean, and what is wrong with them.

use proptest::prelude::*;
use sesame_interfaces::{Catalogue, ros1};
use sesame_plan::{Primitive, WireType};

const STATUS: &str = "\
# A status.
byte OK=0          # one kind
string ROOM = room #1, \"left\" = right  \n\
float32 PI=3.14
Header header
std_msgs/Header[] others
time at\t
duration[2] spans
byte raw
char[] letters # a comment
Inner inner
";

#[test]
fn types_of_ros_1_are_those_of_the_wire() {
    let status = ros1::msg("cell", "Status", STATUS).unwrap();
    assert_eq!(status.name, "cell/msg/Status");
    let constants: Vec<_> =
        status.constants.iter().map(|constant| (constant.name.as_str(), constant.value.as_str())).collect();
    assert_eq!(constants, [("OK", "0"), ("ROOM", "room #1, \"left\" = right"), ("PI", "3.14")]);
    let message = |name: &str| WireType::Interface { name: name.to_owned() };
    let primitive = |primitive| WireType::Primitive { primitive };
    let many = |of| WireType::Sequence { of: Box::new(of), bound: None };
    let types: Vec<_> = status.fields.iter().map(|field| field.ty.clone()).collect();
    assert_eq!(
        types,
        [
            message("std_msgs/msg/Header"),
            many(message("std_msgs/msg/Header")),
            message("builtin_interfaces/msg/Time"),
            WireType::Array { of: Box::new(message("builtin_interfaces/msg/Duration")), length: 2 },
            primitive(Primitive::Int8),
            many(primitive(Primitive::Uint8)),
            message("cell/msg/Inner"),
        ]
    );
    assert_eq!(ros1::contained("cell", STATUS).unwrap(), ["std_msgs/Header", "std_msgs/Header", "cell/Inner"]);
}

#[test]
fn what_identifies_a_type_has_no_comments_and_the_constants_first() {
    let text = ros1::hashed_text("cell", STATUS, &mut |name| Ok(format!("<{name}>"))).unwrap();
    assert_eq!(
        text,
        "byte OK=0\nstring ROOM=room #1, \"left\" = right\nfloat32 PI=3.14\n<std_msgs/Header> header\n<std_msgs/Header> \
         others\ntime at\nduration[2] spans\nbyte raw\nchar[] letters\n<cell/Inner> inner"
    );
}

#[test]
fn a_service_is_two_messages_and_nothing_is_nothing() {
    let [request, reply] = ros1::srv("std_srvs", "Trigger", "---\nbool success # whether\nstring message\n").unwrap();
    assert_eq!((request.name.as_str(), request.fields.len()), ("std_srvs/srv/Trigger_Request", 0));
    assert_eq!((reply.name.as_str(), reply.fields.len()), ("std_srvs/srv/Trigger_Response", 2));
    let error = ros1::srv("p", "S", "int8 a\n---\nint8 b\nint9 c").unwrap_err();
    assert_eq!(error.to_string(), "line 4: `int9` is not a type of ROS 1");
}

#[test]
fn layouts_have_times_of_ros_1() {
    let mut catalogue = Catalogue::default();
    for definition in ros1::builtin() {
        catalogue.add(definition);
    }
    catalogue.add(ros1::msg("std_msgs", "Header", "uint32 seq\ntime stamp\nstring frame_id\n").unwrap());
    catalogue.add(ros1::msg("p", "M", "Header header").unwrap());
    let layout = catalogue.layout("p/msg/M").unwrap();
    let names: Vec<&str> = layout.iter().map(|interface| interface.name.as_str()).collect();
    assert_eq!(names, ["builtin_interfaces/msg/Time", "std_msgs/msg/Header", "p/msg/M"]);
    assert_eq!(ros1::type_name("std_msgs/msg/Header"), "std_msgs/Header");
    assert_eq!(ros1::type_name("std_srvs/srv/Empty_Request"), "std_srvs/Empty_Request");
    assert_eq!(ros1::interface("std_msgs/Header"), "std_msgs/msg/Header");
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let problem = |text: &str| ros1::msg("p", "M", text).unwrap_err().to_string();
    assert_eq!(problem("\nint8"), "line 2: `int8` has no name");
    assert!(ros1::msg("p", "M", "tf/tfMessage a").is_ok());
    assert_eq!(problem("a/b/C[] a"), "line 1: `a/b/C` is not a type of ROS 1");
    assert_eq!(problem("wstring a"), "line 1: `wstring` is not a type of ROS 1");
    assert_eq!(problem("string<=4 a"), "line 1: `string<=4` is not a type of ROS 1");
    assert_eq!(problem("int8 a b"), "line 1: `a b` is not a field name");
    assert_eq!(problem("int8 a\nint8 a"), "line 2: field `a` is there twice");
    assert_eq!(problem("int8[x] a"), "line 1: `x` is not the length of an array from 1 to 16777216");
    assert_eq!(ros1::srv("p", "S", "int8 a").unwrap_err().problem, "a line `---` between request and reply is missing");
}

proptest! {
    #[test]
    fn any_text_is_an_interface_or_a_problem(text in "[a-z0-9_/\\[\\]=# \n\"-]{0,60}") {
        let _ = (ros1::msg("p", "M", &text), ros1::contained("p", &text));
    }
}
