//! Recordings of ROS are read without a runner, and without its middleware.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::Path;
use std::process::Command;

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};

const SPACE: &str = r#"space hall
system {
  simulator robot = ros2
  message Level = "std_msgs/msg/Float64"
  topic level = "/level" : Level
}
metric loud maximise default 0 = count(level.data > 0.55)
operation cut on level = blackhole
campaign c {
  objectives loud
  operations cut 1 per test
  search     random { evaluations 1 }
  end        after 5s
}
"#;

/// Ten levels from 0 to 0.9, as `ros2 bag record` writes them.
fn recorded(file: &Path) {
    let mut writer: Writer<File> =
        WriteOptions::new().compression(None).profile("ros2").create(File::create(file).unwrap()).unwrap();
    let schema = writer.add_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data").unwrap();
    let channel_id = writer.add_channel(schema, "/level", "cdr", &BTreeMap::new()).unwrap();
    for at in 0..10u32 {
        let log_time = 1_700_000_000_123_456_789 + u64::from(at) * 100_000_000;
        let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
        let payload = [&[0, 1, 0, 0][..], &(f64::from(at) / 10.0).to_le_bytes()].concat();
        writer.write_to_known_channel(&header, &payload).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn a_recording_of_rosbag2_is_fed_to_metrics_without_a_runner() {
    let folder = tempfile::tempdir().unwrap();
    let space = folder.path().join("hall.sesame");
    fs::write(&space, SPACE).unwrap();
    let bag = folder.path().join("bag");
    fs::create_dir(&bag).unwrap();
    recorded(&bag.join("bag_0.mcap"));
    for recording in [bag.clone(), bag.join("bag_0.mcap")] {
        let said = Command::new(env!("CARGO_BIN_EXE_sesamec"))
            .args(["replay-recording", "--format", "json"])
            .args([&space, &recording])
            .output()
            .unwrap();
        assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
        let found: serde_json::Value = serde_json::from_slice(&said.stdout).unwrap();
        assert_eq!((&found["messages"], &found["metrics"][0]["now"]["value"]), (&10.into(), &4.0.into()), "{found}");
    }
    assert!(!folder.path().join("runners").exists(), "nothing is built");
}
