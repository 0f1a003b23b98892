//! What the relay adds to a message at 200 Hz, or to a step, over each transport but ROS 2 (`ros2_relay`): the latency
//! compared with that of the direct way, and of the barest forwarders over the same transport. The ways take turns.
//!
//! Over rosbridge (`SESAME_ROSBRIDGE` and `SESAME_ROS2_JAZZY`) all go through one server: a forwarder in Rust that
//! replaces one text by another, and one in thirty lines of Python on roslibpy. Over MQTT they go through one broker:
//! a forwarder of bytes in Rust on the library that the transport uses. Over ROS 1 (`SESAME_ROS1`) publisher and
//! subscriber are of rospy, and the forwarder is `relay` of ROS itself, in C++. Over SimlogAPI the latency is that of a
//! step, with one message that is cut; the simulator is one of ours. What is not there is skipped.

mod mqtt;
mod processes;
mod ros1;
mod rosbridge;
mod simlog;

/// How much is measured.
#[derive(Debug, Clone, Copy)]
struct Size {
    rounds: usize,
    messages: u64,
}

fn main() {
    // Cargo tells whether it measures or only tries that this works.
    let measured = std::env::args().any(|word| word == "--bench");
    let size = if measured { Size { rounds: 10, messages: 400 } } else { Size { rounds: 1, messages: 20 } };
    rosbridge::run(size);
    mqtt::run(size);
    ros1::run(size);
    simlog::run(size);
}

/// A space with these declarations of a topic, and an operation that may act on a value of it.
fn space(simulator: &str, declarations: &str, value: &str) -> String {
    format!(
        r"
space bench
system {{
  simulator peers = {simulator}
  {declarations}
}}
metric disturbed minimise = fuzzing_time()
operation off on {value} = bias [-1, 1]
campaign look {{
  objectives disturbed
  operations off   1 per test
  search     random {{ evaluations 1 }}
  end        after 100000s
}}
"
    )
}

/// Joints of an arm, as ROS has them.
const JOINTS: &str = r#"message Header = "std_msgs/msg/Header" { stamp: real[s]  frame_id: text }
  message Joints = "sensor_msgs/msg/JointState" {
    header: Header  name: list of text  position: list of real  velocity: list of real  effort: list of real
  }
  topic peer = "/peer" : Joints"#;

/// The value of it that may be disturbed.
const JOINT: &str = "peer.position[0]";
