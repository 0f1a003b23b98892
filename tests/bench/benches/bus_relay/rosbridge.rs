//! Through a server of rosbridge: publisher, subscriber and forwarders are its clients.

use std::io::ErrorKind;
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use sesame_bench::ways::{at_200_hz, beside, exchange, named, plan, print, rounds};
use sesame_tests::workspace;
use tungstenite::{Error, Message, WebSocket, client};

use crate::processes::{Program, free_port};
use crate::{JOINT, JOINTS, Size, space};

/// A client of the server, without a library of ROS.
struct Client(WebSocket<TcpStream>);

impl Client {
    fn connect(port: u16) -> Client {
        let stream = TcpStream::connect(("127.0.0.1", port)).expect("the server listens");
        stream.set_nodelay(true).expect("a socket can be set up");
        stream.set_read_timeout(Some(Duration::from_millis(50))).expect("a socket can be set up");
        Client(client(format!("ws://127.0.0.1:{port}/"), stream).expect("it is let in").0)
    }

    fn say(&mut self, text: String) {
        self.0.send(Message::text(text)).expect("the server listens");
    }

    fn advertise(&mut self, topic: &str) {
        self.say(format!(r#"{{"op":"advertise","topic":"{topic}","type":"sensor_msgs/msg/JointState"}}"#));
    }

    fn subscribe(&mut self, topic: &str) {
        self.say(format!(
            r#"{{"op":"subscribe","topic":"{topic}","type":"sensor_msgs/msg/JointState","queue_length":0}}"#
        ));
    }

    /// The next text, if one comes within 50 ms.
    fn hear(&mut self) -> Option<String> {
        match self.0.read() {
            Ok(Message::Text(text)) => Some(text.to_string()),
            Ok(_) => None,
            Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => None,
            Err(error) => panic!("the server has gone: {error}"),
        }
    }
}

struct Way {
    name: &'static str,
    from: &'static str,
    writer: Client,
    reader: Client,
    sent: u64,
}

impl Way {
    fn new(port: u16, name: &'static str, from: &'static str, to: &str) -> Way {
        let (mut writer, mut reader) = (Client::connect(port), Client::connect(port));
        writer.advertise(from);
        reader.subscribe(to);
        Way { name, from, writer, reader, sent: 0 }
    }

    fn measure(&mut self, count: u64) -> sesame_bench::ways::Measured {
        let Way { name, from, writer, reader, sent } = self;
        let first = *sent;
        *sent += count;
        let begin = Instant::now();
        let measured = exchange(
            name,
            count,
            |at, _| at_200_hz(begin, at),
            |at| writer.say(message(from, first + at)),
            |take| {
                if let Some(number) = reader.hear().as_deref().and_then(number) {
                    take(number - first);
                }
            },
        );
        // Who never listens does not answer the server's pings, and is thrown out.
        writer.hear();
        measured
    }
}

/// Seven joints, and a number by which the message is known.
fn message(topic: &str, number: u64) -> String {
    let stamp = r#"{"sec":1,"nanosec":500000000}"#;
    format!(
        r#"{{"op":"publish","topic":"{topic}","msg":{{"header":{{"stamp":{stamp},"frame_id":"@{number};"}},"name":["a1","a2","a3","a4","a5","a6","a7"],"position":[0.125,0.25,0.375,0.5,0.625,0.75,0.875],"velocity":[0.5,0.5,0.5,0.5,0.5,0.5,0.5],"effort":[]}}}}"#
    )
}

fn number(text: &str) -> Option<u64> {
    let (_, rest) = text.split_once("\"@")?;
    rest.split_once(';')?.0.parse().ok()
}

/// Replaces one text by another until it is told to stop: what a relay costs at least.
fn bare(port: u16, stop: &AtomicBool) {
    let mut client = Client::connect(port);
    client.advertise("/bare");
    client.subscribe("/bare/undisturbed");
    while !stop.load(Ordering::Relaxed) {
        if let Some(text) = client.hear() {
            client.say(text.replacen("/bare/undisturbed", "/bare", 1));
        }
    }
}

pub(crate) fn run(size: Size) {
    let (Some(bridge), Some(jazzy)) = (named("SESAME_ROSBRIDGE"), named("SESAME_ROS2_JAZZY")) else { return };
    let port = free_port();
    let peers = workspace().join("tests/ros2/peers");
    let environment = jazzy.ancestors().nth(2).expect("a Python lies in `bin` of its environment");
    let mut command = Command::new(&bridge);
    command.arg(peers.join("bridge.py")).arg("--ros").arg(environment).args(["--port", &port.to_string()]);
    let mut server =
        Program::start(command.env("ROS_DOMAIN_ID", "198").env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"));
    server.says("listening");
    let mut python = Command::new(&bridge);
    let _python = Program::start(python.arg(peers.join("roslib_relay.py")).args([
        &port.to_string(),
        "/python/undisturbed",
        "/python",
        "sensor_msgs/JointState",
    ]));
    let plan = plan(&space(&format!("rosbridge \"ws://127.0.0.1:{port}\""), JOINTS, JOINT));
    beside(
        &plan,
        &sesame_rosbridge::rosbridge(PathBuf::from(".")),
        |stop| bare(port, stop),
        || {
            let mut ways = [
                Way::new(port, "direct", "/direct", "/direct"),
                Way::new(port, "a forwarder of texts", "/bare/undisturbed", "/bare"),
                Way::new(port, "thirty lines of roslibpy", "/python/undisturbed", "/python"),
                Way::new(port, "Sesame", "/peer/undisturbed", "/peer"),
            ];
            // Until all have found each other.
            thread::sleep(Duration::from_secs(5));
            let names = ways.each_ref().map(|way| way.name);
            rounds(&mut ways, 1, |way| way.measure(20));
            let results = rounds(&mut ways, size.rounds, |way| way.measure(size.messages));
            print("rosbridge, 200 Hz", &names, &results);
        },
    );
}
