//! What the relay adds to a message between two nodes of ROS 2: the latency compared with that of the direct way, and
//! of a bare relay over the same DDS library that only hands bytes on. At 200 Hz, and at saturation: as fast as
//! messages pass with a hundred of them under way.
//!
//! The nodes are participants of this process, on the loopback interface. The three ways take turns.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use sesame_bench::ways::{Measured, at_200_hz, beside, exchange, plan, print, rounds};
use sesame_tests::dds::{JOINTS, Reader, Writer, joints, number, participant};

/// One that no example uses.
const DOMAIN: u16 = 199;

/// With joints of an arm as messages, of which an operation may act on one.
const SPACE: &str = r#"
space bench

system {
  simulator peers = ros2 { domain 199 }
  message Header = "std_msgs/msg/Header" { stamp: real[s]  frame_id: text }
  message Joints = "sensor_msgs/msg/JointState" {
    header: Header  name: list of text  position: list of real  velocity: list of real  effort: list of real
  }
  topic peer = "/peer" : Joints
  node hearing { subscribes peer }
}

metric disturbed minimise = fuzzing_time()
operation off on peer.position[0] = bias [-1, 1]

campaign look {
  objectives disturbed
  operations off   1 per test
  search     random { evaluations 1 }
  end        after 100000s
}
"#;

/// How many messages are under way at saturation.
const WINDOW: u64 = 100;

/// Hands bytes on until it is told to stop: what a relay costs at least.
fn bare(stop: &AtomicBool) {
    let participant = participant(DOMAIN);
    let mut reader = Reader::new(&participant, "rt/bare/undisturbed", JOINTS);
    let writer = Writer::new(&participant, "rt/bare", JOINTS);
    while !stop.load(Ordering::Relaxed) {
        reader.take(|message| writer.write(message));
    }
}

/// A way from the publisher to the subscriber.
struct Way {
    name: &'static str,
    writer: Writer,
    reader: Reader,
    sent: u64,
}

impl Way {
    /// Sends so many messages, one each time that `turn` returns, and receives them all.
    fn measure(&mut self, count: u64, turn: impl Fn(u64, &AtomicU64) + Sync) -> Measured {
        let first = self.sent;
        self.sent += count;
        let (writer, reader) = (&self.writer, &mut self.reader);
        let send = |at| writer.write(joints(first + at));
        exchange(self.name, count, turn, send, |take| reader.take(|message| take(number(&message) - first)))
    }

    fn at_200_hz(&mut self, count: u64) -> Measured {
        let begin = Instant::now();
        self.measure(count, |at, _| at_200_hz(begin, at))
    }

    fn at_saturation(&mut self, count: u64) -> Measured {
        self.measure(count, |at, received| {
            while at - received.load(Ordering::Acquire).min(at) >= WINDOW {
                thread::yield_now();
            }
        })
    }
}

fn main() {
    // Cargo tells whether it measures or only tries that this works.
    let measured = std::env::args().any(|word| word == "--bench");
    let plan = plan(SPACE);

    let (publisher, subscriber) = (participant(DOMAIN), participant(DOMAIN));
    let named = [
        ("direct", "rt/direct", "rt/direct"),
        ("a bare relay", "rt/bare/undisturbed", "rt/bare"),
        ("Sesame", "rt/peer/undisturbed", "rt/peer"),
    ];
    let mut ways = named.map(|(name, from, to)| Way {
        name,
        writer: Writer::new(&publisher, from, JOINTS),
        reader: Reader::new(&subscriber, to, JOINTS),
        sent: 0,
    });
    beside(&plan, &sesame_ros2::ros2(PathBuf::from(".")), bare, || {
        // Until all have found each other.
        thread::sleep(Duration::from_secs(5));
        let (times, slow, fast) = if measured { (20, 400, 20_000) } else { (1, 20, 1_000) };
        rounds(&mut ways, 1, |way| way.at_200_hz(20));
        let names = ways.each_ref().map(|way| way.name);
        let results = rounds(&mut ways, times, |way| way.at_200_hz(slow));
        print("200 Hz", &names, &results);
        let results = rounds(&mut ways, times, |way| way.at_saturation(fast));
        print("saturation", &names, &results);
    });
}
