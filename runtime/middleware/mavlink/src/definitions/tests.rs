use super::*;

#[test]
fn only_files_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let said = read(&[".".to_owned()], folder.path()).unwrap_err();
    assert!(said.starts_with("the definitions in `") && said.ends_with("cannot be used: it is not a file"), "{said}");
    let said = read(&["none.xml".to_owned()], folder.path()).unwrap_err();
    assert!(said.contains("none.xml` cannot be used: "), "{said}");
}

/// With the definitions of pymavlink.
mod real {
    use std::path::PathBuf;
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
            let definitions = read(&[format!("{dialect}.xml")], &folder).unwrap();
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
