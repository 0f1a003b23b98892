//! Files of interfaces: what they mean, what is wrong with them, and all that real distributions have.

#![expect(clippy::disallowed_methods, reason = "the files of real distributions are read")]
#![expect(clippy::unwrap_used, reason = "a test ends where something is missing")]

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use sesame_interfaces::{Catalogue, Definition, Field, action, idl, msg, srv};
use sesame_plan::WireType;

const POSE: &str = "\
# A pose, with all that a file may hold.
uint8 KIND_ARM=1          # one kind
string GREETING=hello  # a comment
string ROOM=\"room 1\" # a comment
string CUT=\"room #1\"
float64 PI = 3.14159
Header header
geometry_msgs/Point[] way
Inner[<=3] inner
string<=10 name \"a # in it\"
wstring<=5[2] wide
float64[36] covariance
byte raw 7
bool[] flags [true, false]
";

fn words(ty: &WireType) -> String {
    match ty {
        WireType::Primitive { primitive } => format!("{primitive:?}").to_lowercase(),
        WireType::String { bound: None } => "string".into(),
        WireType::String { bound: Some(bound) } => format!("string<={bound}"),
        WireType::WString { bound: None } => "wstring".into(),
        WireType::WString { bound: Some(bound) } => format!("wstring<={bound}"),
        WireType::Interface { name } => name.clone(),
        WireType::Array { of, length } => format!("{}[{length}]", words(of)),
        WireType::Sequence { of, bound: None } => format!("{}[]", words(of)),
        WireType::Sequence { of, bound: Some(bound) } => format!("{}[<={bound}]", words(of)),
    }
}

fn shown(definition: &Definition) -> String {
    let constants = definition.constants.iter().map(|constant| format!("  {} = {}\n", constant.name, constant.value));
    let fields = definition.fields.iter().map(|field| format!("  {}: {}\n", field.name, words(&field.ty)));
    std::iter::once(format!("{}\n", definition.name)).chain(constants).chain(fields).collect()
}

#[test]
fn a_message_is_its_fields_and_constants() {
    insta::assert_snapshot!(shown(&msg("cell", "Pose", POSE).unwrap()));
}

#[test]
fn a_service_is_two_messages_and_nothing_is_a_byte() {
    let [request, reply] = srv("std_srvs", "Trigger", "---\nbool success # whether\nstring message\n").unwrap();
    insta::assert_snapshot!(shown(&request) + &shown(&reply));
}

#[test]
fn an_action_is_three_messages_and_five_that_follow() {
    let parts = action("cell", "Move", "Pose to\n---\nbool done\n---\nfloat64 left\n").unwrap();
    let following = action::messages("cell", "Move");
    insta::assert_snapshot!(parts.iter().chain(&following).map(shown).collect::<String>());
    let wrong = |text: &str| action("p", "A", text).unwrap_err().to_string();
    assert_eq!(wrong("int8 a\n---"), "line 2: a line `---` between goal, result and feedback is missing");
    assert_eq!(wrong("---\n---\n---"), "line 3: `---` separates parts of services and actions only");
}

#[test]
fn an_idl_file_is_the_same_messages() {
    let text = r#"
// generated
#include "std_msgs/msg/Header.idl"
module cell { module msg {
  typedef double double__36[36];
  module Pose_Constants { const uint8 KIND_ARM = 1; @verbatim (language="comment", text= "a ) \" b") const string GREETING = "hello"; };
  /* a comment */
  @verbatim (language="comment", text="of a pose" "\n")
  struct Pose {
    std_msgs::msg::Header header;
    sequence<geometry_msgs::msg::Point> way;
    sequence<cell::msg::Inner, 3> inner;
    @default (value="a # in it") string<10> name;
    @unit(value="rad") wstring<5> wide[2];
    double__36 covariance;
    octet raw;
    sequence<boolean> flags;
    unsigned long long long_one;
  };
}; };
"#;
    let found = idl(text).unwrap();
    insta::assert_snapshot!(found.iter().map(shown).collect::<String>());
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let of_msg = |text: &str| msg("p", "M", text).unwrap_err().to_string();
    let mut shown: Vec<String> = [
        "int32",
        "\nint33 x",
        "time stamp",
        "int32 1x",
        "int32 x-y",
        "int32[0] x",
        "int32[<=x] y",
        "int32[3 x",
        "int32<=3 x",
        "string<=many x",
        "int32 x\nint32 x",
        "a/b/c/D x",
        "int32 x\n---\nint32 y",
    ]
    .iter()
    .map(|text| format!("{text:?}: {}", of_msg(text)))
    .collect();
    shown.push(srv("p", "S", "int32 x").unwrap_err().to_string());
    for text in [
        "module a {",
        "module a { struct S { long double x; }; };",
        "module a { struct S { int32 x }; };",
        "module a { union U { }; };",
        "module a { struct S { int32 x[0]; }; };",
        "/* never",
        "const string X = \"never",
        "struct S { int32 x; int32 x; };",
        "struct S { int32 x, x; };",
        "struct S { int32 x[NONE]; };",
        "@bit_bound(64) enum E { A };",
        "enum E { A, };",
    ] {
        shown.push(format!("{text:?}: {}", idl(text).unwrap_err()));
    }
    insta::assert_snapshot!(shown.join("\n"));
}

#[test]
fn a_layout_has_what_it_contains_before_it_and_says_what_is_missing() {
    let mut catalogue = Catalogue::default();
    catalogue.add(msg("a", "Outer", "Inner one\nInner[2] two\nb/Other other").unwrap());
    catalogue.add(msg("a", "Inner", "int32 x").unwrap());
    assert_eq!(catalogue.missing(), ["b/msg/Other"]);
    assert_eq!(
        catalogue.layout("a/msg/Outer").unwrap_err().to_string(),
        "in `a/msg/Outer`: there is no interface `b/msg/Other`"
    );
    catalogue.add(msg("b", "Other", "a/Inner inner").unwrap());
    let names: Vec<String> = catalogue.layout("a/msg/Outer").unwrap().into_iter().map(|field| field.name).collect();
    assert_eq!(names, ["a/msg/Inner", "b/msg/Other", "a/msg/Outer"]);
    catalogue.add(msg("c", "Snake", "Tail tail").unwrap());
    catalogue.add(msg("c", "Tail", "Snake snake").unwrap());
    let circle = catalogue.layout("c/msg/Snake").unwrap_err().to_string();
    assert_eq!(circle, "interface `c/msg/Snake` contains itself");
}

proptest! {
    #[test]
    fn no_text_is_too_strange(
        text in "[ -~\n]{0,80}", at in any::<prop::sample::Index>(), insert in "[\\[\\]<>{}();:=#/\"@a-z0-9 \n]{0,6}",
    ) {
        let mut pose = POSE.to_owned();
        pose.insert_str(at.index(pose.len()), &insert);
        for text in [&text, &pose] {
            let _ = msg("p", "M", text);
            let _ = srv("p", "S", text);
            let _ = idl(text);
        }
        let nested = format!("module a {{ struct S {{ {} int32 {} x; }}; }};", "sequence<".repeat(300), ">".repeat(300));
        prop_assert!(idl(&nested).is_err());
    }
}

#[test]
fn an_idl_file_may_say_what_no_tool_of_ros_generates() {
    let text = "
const long WIDTH = 2;
module cell {
  const unsigned short DEPTH = 3;
  @bit_bound(8) enum Grip { OPEN, @value(5) CLOSED };
  module msg {
    enum Mode { IDLE, MOVING };
    @bit_bound(8) struct Other { @bit_bound(16) short one; };
    enum Wide { ON, OFF };
    typedef double pair[WIDTH], single;
    struct Arm {
      short one, two[cell::DEPTH], three;
      sequence<pair, DEPTH> pairs;
      string<WIDTH> text;
      single value;
      wchar letter;
      @key @bit_bound(16) Mode mode;
      ::cell::Grip grip[2];
      Wide wide;
    };
  };
};
";
    insta::assert_snapshot!(idl(text).unwrap().iter().map(shown).collect::<String>());
}

/// The folder of interfaces of an installed distribution, which an environment variable names by its Python.
fn share(variable: &str) -> Option<PathBuf> {
    let python = sesame_peers::named(variable)?;
    Some(python.parent().unwrap().parent().unwrap().join("share"))
}

/// All interfaces of a folder, from files with this ending.
fn all(share: &Path, ending: &str) -> Catalogue {
    let mut catalogue = Catalogue::default();
    for package in std::fs::read_dir(share).unwrap() {
        let package = package.unwrap();
        let package_name = package.file_name().into_string().unwrap();
        for kind in ["msg", "srv"] {
            let Ok(files) = std::fs::read_dir(package.path().join(kind)) else { continue };
            for file in files {
                let path = file.unwrap().path();
                let name = path.file_stem().unwrap().to_str().unwrap();
                let is = |wanted: &str| {
                    path.extension().is_some_and(|extension| extension == wanted)
                        && (ending == "idl") == (wanted == "idl")
                };
                let text = || std::fs::read_to_string(&path).unwrap();
                if is("idl") {
                    idl(&text())
                        .unwrap_or_else(|error| panic!("{}: {error}", path.display()))
                        .into_iter()
                        .for_each(|definition| catalogue.add(definition));
                } else if is("msg") {
                    catalogue.add(
                        msg(&package_name, name, &text()).unwrap_or_else(|error| panic!("{}: {error}", path.display())),
                    );
                } else if is("srv") {
                    let both = srv(&package_name, name, &text());
                    both.unwrap_or_else(|error| panic!("{}: {error}", path.display()))
                        .into_iter()
                        .for_each(|definition| catalogue.add(definition));
                }
            }
        }
    }
    catalogue
}

/// Constants with their values in one spelling.
fn constants(definition: &Definition) -> Vec<(String, String)> {
    let constants = definition.constants.iter().map(|constant| {
        let value = match constant.value.to_lowercase().as_str() {
            "true" => "1".to_owned(),
            "false" => "0".to_owned(),
            number => number.parse().map_or(constant.value.clone(), |number: f64| number.to_string()),
        };
        (constant.name.clone(), value)
    });
    constants.collect()
}

/// What an installed distribution has.
mod real {
    use serde_json::Value;
    use sesame_peers::oracle::each_line;

    use super::*;

    #[test]
    fn all_interfaces_of_real_distributions_have_a_layout_and_both_files_give_the_same() {
        for variable in ["SESAME_ROS2_KILTED", "SESAME_ROS2_JAZZY"] {
            let Some(share) = share(variable) else { continue };
            let (from_msg, from_idl) = (all(&share, "msg"), all(&share, "idl"));
            let names: Vec<&str> = from_msg.names().collect();
            assert!(names.len() > 100, "{variable}: {}", names.len());
            for name in names {
                let layout = from_msg.layout(name).unwrap_or_else(|error| panic!("{variable}: {name}: {error}"));
                if from_idl.contains(name) {
                    assert_eq!(from_idl.layout(name).unwrap(), layout, "{variable}: {name}");
                    let constants = [&from_msg, &from_idl].map(|catalogue| constants(catalogue.get(name).unwrap()));
                    assert_eq!(constants[0], constants[1], "{variable}: {name}");
                }
            }
            assert!(from_idl.contains("sensor_msgs/msg/JointState"), "{variable}");
        }
    }

    /// Compares what ROS reads in the definitions below a folder with what we read; how many it reads.
    fn compared(python: &Path, folder: &Path) -> usize {
        let text = |value: &Value| value.as_str().unwrap().to_owned();
        let mut compared = 0;
        each_line(python, "ros2/rosidl_oracle.py", &[folder.to_str().unwrap()], |said: &Value| {
            let Some(parts) = said["parts"].as_array() else { return };
            let [file, package, name, kind] = ["file", "package", "name", "kind"].map(|key| text(&said[key]));
            let written = std::fs::read_to_string(&file).unwrap();
            let read = match kind.as_str() {
                "msg" => msg(&package, &name, &written).map(|one| vec![one]),
                "srv" => srv(&package, &name, &written).map(Vec::from),
                _ => action(&package, &name, &written).map(Vec::from),
            };
            let read = read.unwrap_or_else(|error| panic!("{file}: ROS reads it, and we do not: {error}"));
            assert_eq!(read.len(), parts.len(), "{file}");
            for (ours, theirs) in read.iter().zip(parts) {
                let fields = theirs["fields"].as_array().unwrap();
                let fields: Vec<_> = fields.iter().map(|field| (text(&field[0]), text(&field[1]))).collect();
                let nothing = |field: &&Field| field.name != "structure_needs_at_least_one_member";
                let own = ours.fields.iter().filter(nothing).map(|field| (field.name.clone(), words(&field.ty)));
                assert_eq!(own.collect::<Vec<_>>(), fields, "{file}");
                let constants = theirs["constants"].as_array().unwrap();
                assert_eq!(ours.constants.len(), constants.len(), "{file}");
                for (own, constant) in ours.constants.iter().zip(constants) {
                    assert_eq!(own.name, text(&constant[0]), "{file}");
                    assert!(
                        is_value(&own.value, &constant[1]),
                        "{file}: {} is {}, and {}",
                        own.name,
                        own.value,
                        constant[1]
                    );
                }
            }
            compared += 1;
        });
        compared
    }

    /// Whether a constant's value, as it is written, is what ROS reads.
    fn is_value(written: &str, value: &Value) -> bool {
        match value {
            Value::Bool(value) => ["1", "true"].contains(&written.to_lowercase().as_str()) == *value,
            Value::Number(value) => {
                let (written, base) = match written.to_lowercase().trim_start_matches('+') {
                    hexadecimal if hexadecimal.starts_with("0x") => (hexadecimal[2..].to_owned(), 16),
                    binary if binary.starts_with("0b") => (binary[2..].to_owned(), 2),
                    other => (other.replace('_', ""), 10),
                };
                let whole = i128::from_str_radix(&written, base).map(|whole| whole.to_string());
                whole.is_ok_and(|whole| whole == value.to_string())
                    || written.parse().is_ok_and(|written: f64| Some(written) == value.as_f64())
            }
            Value::String(value) => {
                let quoted = ['"', '\''].iter().find_map(|&quote| {
                    let inner = written.strip_prefix(quote)?.strip_suffix(quote)?;
                    Some(inner.replace(&format!("\\{quote}"), &quote.to_string()))
                });
                quoted.unwrap_or_else(|| written.to_owned()) == *value
            }
            _ => false,
        }
    }

    #[test]
    fn ros_itself_reads_the_same_in_each_definition() {
        for (variable, least) in [("SESAME_ROS2_KILTED", 130), ("SESAME_ROS2_JAZZY", 130)] {
            let (Some(python), Some(share)) = (sesame_peers::named(variable), share(variable)) else { continue };
            let compared = compared(&python, &share);
            assert!(compared >= least, "{variable}: {compared}");
        }
    }

    /// As the test above, with definitions of one's own, of which there can be thousands.
    #[test]
    fn ros_itself_reads_the_same_in_each_definition_of_a_folder() {
        let Some(folder) = std::env::var_os("SESAME_DEFINITIONS") else {
            eprintln!("skipped: SESAME_DEFINITIONS names no folder with definitions");
            return;
        };
        let Some(python) = sesame_peers::named("SESAME_ROS2_KILTED") else { return };
        let compared = compared(&python, Path::new(&folder));
        eprintln!("{compared} definitions compared");
        assert!(compared > 0, "ROS reads no definition in {}", folder.display());
    }
}
