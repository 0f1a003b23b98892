//! `sesamec scan mavlink`: what two drones send, and the space of it.

use std::fs;
use std::path::Path;

use serde_json::Value;
use sesame_tests::{Done, Port, command, done, fresh_folder, sesamec};

use crate::peers::{Peer, common, python};

fn in_folder(folder: &Path, arguments: &[&str]) -> Done {
    done(command(sesamec()).args(arguments).current_dir(folder))
}

/// What was found, listened to longer and longer until the slow messages of both drones have come.
fn found(folder: &Path, url: &str, format: &str) -> String {
    for seconds in ["2", "4", "8", "16", "32", "64"] {
        let arguments = ["scan", "mavlink", url, "--types", "common.xml", "--seconds", seconds, "--format", format];
        let found = in_folder(folder, &arguments).expect(0).out;
        if ["1/STATUSTEXT", "2/STATUSTEXT", "154", "2/SYS_STATUS"].iter().all(|text| found.contains(text)) {
            return found;
        }
    }
    panic!("the drones are not heard");
}

/// A text without the spaces that align its comments.
fn in_words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn what_two_drones_send_is_a_space_and_its_numbers_are_those_that_were_sent() {
    let Some(python) = python() else { return };
    let folder = fresh_folder("mavlink_scan");
    let dialects = common(&python).parent().expect("a file lies in a folder").to_owned();
    for file in ["common.xml", "standard.xml", "minimal.xml"] {
        fs::copy(dialects.join(file), folder.join(file)).expect("pymavlink brings it");
    }
    // It is built before anything is sent.
    sesamec();
    let port = Port::free_of_udp();
    let address = format!("127.0.0.1:{}", port.number());
    let url = format!("udp://{address}");
    let [mut first, _second] = ["1", "2"].map(|system| Peer::start(&python, &["drone", &address, system]));

    let space = found(&folder, &url, "human");
    for line in [
        format!("  simulator robots = mavlink \"{url}\" {{"),
        "    types \"common.xml\"".to_owned(),
        format!("    proxy vehicle_1 \"udp://127.0.0.1:{}\"", port.number() + 1),
        format!("    proxy vehicle_2 \"udp://127.0.0.1:{}\"", port.number() + 2),
        "  message GlobalPositionInt {".to_owned(),
        "    lat: int  // degE7: 473977418".to_owned(),
        "    vy: int[cm/s]  // -2".to_owned(),
        "    text: text  // \"all is // well\"".to_owned(),
        "  topic global_position_int_1 = \"1/GLOBAL_POSITION_INT\" : GlobalPositionInt  // ".to_owned(),
        "  topic heartbeat_1 = \"1/HEARTBEAT\" : Heartbeat  // ".to_owned(),
        "  topic heartbeat_2 = \"2/{1,154}/HEARTBEAT\" : Heartbeat  // ".to_owned(),
        "topic \"2/#1040960\" cannot be used: the files define no message with this number".to_owned(),
        "topic \"2/SYS_STATUS\" cannot be used: of ".to_owned(),
        "    subscribes global_position_int_1, global_position_int_2, ".to_owned(),
    ] {
        assert!(in_words(&space).contains(&in_words(&line)), "{line}\n{space}");
    }
    fs::write(folder.join("flight.sesame"), &space).expect("a space can be written");
    for arguments in [&["check", "flight.sesame"][..], &["fmt", "--check", "flight.sesame"]] {
        in_folder(&folder, arguments).expect(0);
    }
    // A campaign below it passes the check, and a misspelt message does not.
    let campaign = "operation lift on global_position_int_1.alt from vehicle_1 = bias [-5m, 5m]\n\
                    metric highest maximise default 0m = max(global_position_int_2.alt)\n\
                    campaign c { objectives highest  operations lift 1 per test  search random { evaluations 2 }  \
                    end after 5s }\n";
    fs::write(folder.join("flight.sesame"), format!("{space}\n{campaign}")).expect("a space can be written");
    in_folder(&folder, &["check", "flight.sesame"]).expect(0);
    let misspelt = space.replace("1/GLOBAL_POSITION_INT", "1/GLOBAL_POSITON_INT");
    fs::write(folder.join("flight.sesame"), format!("{misspelt}\n{campaign}")).expect("a space can be written");
    let said = in_folder(&folder, &["check", "flight.sesame"]).expect(1).err;
    assert!(said.contains("the definitions have no message `GLOBAL_POSITON_INT`"), "{said}");
    assert!(said.contains("did you mean `GLOBAL_POSITION_INT`?"), "{said}");

    let facts: Value = serde_json::from_str(&found(&folder, &url, "json")).expect("it is JSON");
    assert_eq!(facts["system"]["kind"], "mavlink");
    let of = |list: &str, key: &str, name: &str| {
        let all = facts[list].as_array().expect("it is a list");
        all.iter().find(|item| item[key] == name).unwrap_or_else(|| panic!("{name} in {facts:#}")).clone()
    };
    // The number of the first position that came, from whichever drone, and how many the first drone sent since then.
    let position = of("topics", "path", "1/GLOBAL_POSITION_INT");
    let (count, rate) = (position["messages"].as_u64().unwrap(), position["rate"].as_f64().unwrap());
    let ty = of("types", "name", "GLOBAL_POSITION_INT");
    let sample = |name: &str| {
        let field = ty["fields"].as_array().unwrap().iter().find(|field| field["name"] == name).expect("it is there");
        field["sample"].as_str().unwrap().parse::<i64>().unwrap()
    };
    assert_eq!((sample("lat"), sample("lon"), sample("vy")), (473_977_418, 85_455_939, -2));
    assert_eq!(sample("alt"), 1000 * sample("time_boot_ms"));
    assert_eq!(sample("vx"), 1, "the sample is of the first topic");
    let begin = usize::try_from(sample("time_boot_ms")).expect("it is counted from zero");
    let sent = first.numbers();
    let end = begin + usize::try_from(count).unwrap() - 1;
    assert!(end < sent.len(), "{count} came of {} from {begin}", sent.len());
    let expected = (count - 1) as f64 / (sent[end] - sent[begin]);
    assert!((0.75..1.25).contains(&(rate / expected)), "{rate} per second came, {expected} were sent");
}
