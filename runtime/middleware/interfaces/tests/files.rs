//! Files of interfaces: what they mean, what is wrong with them, and all that real distributions have.

#![expect(clippy::disallowed_methods, reason = "the files of real distributions are read")]
#![expect(clippy::unwrap_used, reason = "a test ends where something is missing")]

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use sesame_interfaces::{Catalogue, Definition, idl, msg, srv};
use sesame_plan::WireType;

const POSE: &str = "\
# A pose, with all that a file may hold.
uint8 KIND_ARM=1          # one kind
string GREETING=hello  # a comment
string ROOM=\"room #1\" # a comment
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
        WireType::String => "string".into(),
        WireType::WString => "wstring".into(),
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
}
