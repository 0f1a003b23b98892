use super::*;

/// A dialect that includes another file.
const OWN: &str = r#"<?xml version="1.0"?>
<mavlink>
  <include>small.xml</include>
  <messages>
    <message id="50002" name="OWN"><field type="float" name="level">how much</field></message>
  </messages>
</mavlink>"#;

#[test]
fn fields_are_ordered_by_size_and_extensions_come_last() {
    let definitions = small();
    let everything = definitions.named("EVERYTHING").unwrap();
    let names: Vec<&str> = everything.fields.iter().map(|field| field.name.as_str()).collect();
    let ordered = ["wide", "time", "real", "whole", "row", "small", "name", "letter", "signed", "extra", "more"];
    assert_eq!(names, ordered);
    assert_eq!((everything.base, everything.whole), (43, 52));
    // As pymavlink computes them.
    assert_eq!(definitions.named("HEARTBEAT").unwrap().crc_extra, 50);
    assert_eq!(everything.crc_extra, CRC_EXTRA_OF_EVERYTHING);
}

/// As pymavlink computes it.
const CRC_EXTRA_OF_EVERYTHING: u8 = 192;

pub(crate) fn small() -> Definitions {
    let mut definitions = Definitions::default();
    assert_eq!(definitions.add(include_str!("../../tests/small.xml")), Ok(Vec::new()));
    definitions
}

#[test]
fn files_that_are_included_are_read_once_each() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("small.xml"), include_str!("../../tests/small.xml")).unwrap();
    std::fs::write(folder.path().join("own.xml"), OWN).unwrap();
    // Two that include each other.
    let other = "<mavlink><include>round.xml</include><include> own.xml </include><messages/></mavlink>";
    std::fs::write(folder.path().join("round.xml"), other.replace("round", "other")).unwrap();
    std::fs::write(folder.path().join("other.xml"), other).unwrap();
    let definitions = Definitions::read(&["round.xml".to_owned(), "own.xml".to_owned()], folder.path()).unwrap();
    let names: Vec<&str> = definitions.iter().map(|definition| definition.name.as_str()).collect();
    assert_eq!(names, ["EVERYTHING", "HEARTBEAT", "OWN"]);
}

#[test]
fn what_cannot_be_used_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let said = |text: &str| {
        std::fs::write(folder.path().join("bad.xml"), text).unwrap();
        Definitions::read(&["bad.xml".to_owned()], folder.path()).unwrap_err()
    };
    let message = |inner: &str| said(&format!("<mavlink><messages>{inner}</messages></mavlink>"));
    assert!(said("<mavlink>").contains("bad.xml` cannot be used: it is not XML"));
    assert!(said("<html/>").contains("does not begin with `<mavlink>`"));
    assert!(said("<mavlink><include>none.xml</include></mavlink>").contains("none.xml"));
    assert!(message(r#"<message id="16777216" name="A"/>"#).contains("no number below 16777216"));
    assert!(message(r#"<message id="1"/>"#).contains("no name"));
    let field = |ty: &str| message(&format!(r#"<message id="1" name="A"><field type="{ty}" name="x"/></message>"#));
    assert!(field("half").contains("message `A`: field `x` has the unknown type `half`"));
    assert!(field("float[0]").contains("`float[0]` is not an array"));
    assert!(field("float[64]").contains("more than 255 bytes"));
    let twice = r#"<message id="1" name="A"><field type="float" name="x"/><field type="float" name="x"/></message>"#;
    assert!(message(twice).contains("two fields `x`"));
    let two = r#"<message id="1" name="A"/><message id="1" name="B"/>"#;
    assert!(message(two).contains("message `B` (1) is defined twice"));
    assert!(Definitions::read(&[".".to_owned()], folder.path()).unwrap_err().contains("it is not a file"));
}

#[test]
fn the_checksum_is_that_of_the_standard() {
    let mut crc = Crc::default();
    crc.add(b"123456789");
    // 0x6F91, folded.
    assert_eq!(crc.folded(), 0x6F ^ 0x91);
}

/// With the definitions of pymavlink.
mod real {
    use std::process::Command;

    use super::*;

    /// Prints what pymavlink knows of each message of a dialect: its number, what its checksum adds, its bytes.
    const KNOWN: &str = "
import os, sys
os.environ['MAVLINK20'] = '1'
from importlib import import_module
for message in import_module('pymavlink.dialects.v20.' + sys.argv[1]).mavlink_map.values():
    print(message.msgname, message.id, message.crc_extra, message.unpacker.size)
";

    #[test]
    fn definitions_are_those_of_another_implementation() {
        let Some(python) = sesame_peers::named("SESAME_MAVLINK") else { return };
        let said = |arguments: &[&str]| {
            let output = Command::new(&python).args(arguments).output().unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            String::from_utf8(output.stdout).unwrap()
        };
        let place = "import pymavlink, pathlib; print(pathlib.Path(pymavlink.__file__).parent / 'dialects/v20')";
        let folder = PathBuf::from(said(&["-c", place]).trim());
        for dialect in ["common", "ardupilotmega"] {
            let definitions = Definitions::read(&[format!("{dialect}.xml")], &folder).unwrap();
            let own = definitions.iter().map(|definition| {
                format!("{} {} {} {}", definition.name, definition.id, definition.crc_extra, definition.whole)
            });
            let mut own: Vec<String> = own.collect();
            let mut known: Vec<String> = said(&["-c", KNOWN, dialect]).lines().map(str::to_owned).collect();
            own.sort();
            known.sort();
            assert!(own.len() > 200, "{}", own.len());
            assert_eq!(own, known, "{dialect}");
        }
    }
}
