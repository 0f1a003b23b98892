//! The bill of materials says what is linked, as the lock file has it.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;
use sesame_tests::{command, done, fresh_folder, workspace};
use toml::Table;

use crate::steps::read;

/// Name and version, and the checksum of all but the workspace's own.
fn locked() -> BTreeMap<(String, String), Option<String>> {
    let lock: Table = read(&workspace().join("Cargo.lock")).parse().expect("it is TOML");
    let text = |value: &toml::Value| value.as_str().expect("it is text").to_owned();
    let packages = lock["package"].as_array().expect("a lock file has packages");
    packages
        .iter()
        .map(|package| ((text(&package["name"]), text(&package["version"])), package.get("checksum").map(text)))
        .collect()
}

/// Insists that a bill holds packages of the lock file alone, and the transports among them.
#[track_caller]
pub(crate) fn agrees_with_the_lock(bill: &Path) {
    let bill: Value = serde_json::from_str(&read(bill)).expect("a bill is JSON");
    assert_eq!((&bill["bomFormat"], &bill["specVersion"]), (&"CycloneDX".into(), &"1.5".into()));
    let locked = locked();
    let text = |value: &Value| value.as_str().expect("it is text").to_owned();
    let components = bill["components"].as_array().expect("there are components");
    let mut names = Vec::new();
    for component in components.iter().filter(|it| text(&it["purl"]).starts_with("pkg:cargo/")) {
        let package = (text(&component["name"]), text(&component["version"]));
        let checksum = locked.get(&package).unwrap_or_else(|| panic!("{package:?} is not locked"));
        assert_eq!(component["hashes"][0]["content"].as_str(), checksum.as_deref(), "{package:?}");
        assert!(!text(&component["licenses"][0]["expression"]).is_empty(), "{package:?}");
        names.push(package.0);
    }
    for needed in ["async-nats", "rumqttc", "rustdds", "sesame-mavlink", "sesame-runtime", "tonic", "tungstenite"] {
        assert!(names.iter().any(|name| name == needed), "{needed} is linked");
    }
    for of_tests in ["proptest", "criterion", "sesame-tests", "clap_derive", "cc"] {
        assert!(names.iter().all(|name| name != of_tests), "{of_tests} is not linked");
    }
    let sqlite = components.iter().find(|it| it["name"] == "sqlite").expect("SQLite is linked");
    assert!(text(&sqlite["cpe"]).contains(":sqlite:sqlite:3."), "{sqlite}");
    // Every part that another one needs is listed.
    let listed: Vec<&Value> = components.iter().map(|it| &it["bom-ref"]).collect();
    for entry in bill["dependencies"].as_array().expect("there are dependencies") {
        for needed in entry["dependsOn"].as_array().expect("it is a list") {
            assert!(listed.contains(&needed), "{needed}");
        }
    }
}

#[test]
fn the_bill_has_what_is_linked_and_the_licences_come_along() {
    let programs = ["python3", "python3.13", "python3.12", "python3.11"];
    let Some(python) = sesame_peers::installed(&programs, &["-c", "import tomllib"]) else { return };
    let folder = fresh_folder("bill");
    let mut write = command(python);
    write.arg("packaging/bill_of_materials.py").arg("x86_64-unknown-linux-gnu");
    write.arg(folder.join("bill.json")).arg(folder.join("licences.txt"));
    done(write.current_dir(workspace())).expect(0);
    agrees_with_the_lock(&folder.join("bill.json"));
    let licences = read(&folder.join("licences.txt"));
    assert!(licences.contains("\nring ") && licences.contains("Permission is hereby granted"));
    assert!(!licences.contains("\nsesame-runtime "), "only what others wrote");
}
