//! Through a broker of MQTT, each message at least once.

use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use rumqttc::{Client, Connection, Event, MqttOptions, NetworkOptions, Packet, QoS};
use sesame_bench::ways::{Measured, at_200_hz, beside, exchange, plan, print, rounds};

use crate::processes::{Program, free_port, listens};
use crate::{JOINT, Size, space};

/// Connects; the connection makes progress only while it is asked for events.
fn connect(port: u16, name: &str) -> (Client, Connection) {
    let mut options = MqttOptions::new(name, "127.0.0.1", port);
    options.set_inflight(1000);
    let (client, mut connection) = Client::new(options, 10_000);
    let mut network = NetworkOptions::new();
    network.set_tcp_nodelay(true);
    connection.eventloop.set_network_options(network);
    (client, connection)
}

/// The next payload, if one comes within 50 ms.
fn hear(connection: &mut Connection) -> Option<Vec<u8>> {
    match connection.recv_timeout(Duration::from_millis(50)) {
        Ok(Ok(Event::Incoming(Packet::Publish(publish)))) => Some(publish.payload.to_vec()),
        Ok(Ok(_)) | Err(_) => None,
        Ok(Err(error)) => panic!("the broker has gone: {error}"),
    }
}

struct Way {
    name: &'static str,
    from: &'static str,
    writer: Client,
    reader: Connection,
    sent: u64,
}

impl Way {
    fn new(port: u16, name: &'static str, from: &'static str, to: &str) -> Way {
        let (writer, mut writing) = connect(port, &format!("{name} writer"));
        // It ends with the process.
        thread::spawn(move || while writing.recv().is_ok_and(|event| event.is_ok()) {});
        let (subscriber, mut reader) = connect(port, &format!("{name} reader"));
        subscriber.subscribe(to, QoS::AtLeastOnce).expect("there is room");
        // It makes progress only while it is asked for events.
        let acknowledged = |event| matches!(event, Ok(Event::Incoming(Packet::SubAck(_))));
        while !acknowledged(reader.recv().expect("it is open")) {}
        Way { name, from, writer, reader, sent: 0 }
    }

    fn measure(&mut self, count: u64) -> Measured {
        let Way { name, from, writer, reader, sent } = self;
        let first = *sent;
        *sent += count;
        let begin = Instant::now();
        let send = |at| {
            let payload = payload(first + at);
            writer.publish(*from, QoS::AtLeastOnce, false, payload).expect("there is room");
        };
        exchange(
            name,
            count,
            |at, _| at_200_hz(begin, at),
            send,
            |take| {
                if let Some(number) = hear(reader).as_deref().and_then(number) {
                    take(number - first);
                }
            },
        )
    }
}

/// Seven joints, and a number by which the message is known.
fn payload(number: u64) -> String {
    let position = "[0.125,0.25,0.375,0.5,0.625,0.75,0.875]";
    format!(r#"{{"frame":"n{number};","position":{position},"velocity":[0.5,0.5,0.5,0.5,0.5,0.5,0.5]}}"#)
}

fn number(payload: &[u8]) -> Option<u64> {
    let (_, rest) = std::str::from_utf8(payload).ok()?.split_once("\"n")?;
    rest.split_once(';')?.0.parse().ok()
}

/// Hands bytes on until it is told to stop: what a relay costs at least.
fn bare(port: u16, stop: &AtomicBool) {
    let (client, mut connection) = connect(port, "bare");
    client.subscribe("bare/undisturbed", QoS::AtLeastOnce).expect("there is room");
    while !stop.load(Ordering::Relaxed) {
        if let Some(payload) = hear(&mut connection) {
            client.publish("bare", QoS::AtLeastOnce, false, payload).expect("there is room");
        }
    }
}

pub(crate) fn run(size: Size) {
    if Command::new("mosquitto").arg("-h").stdout(std::process::Stdio::null()).status().is_err() {
        println!("skipped: there is no mosquitto");
        return;
    }
    // By default it waits for acknowledgements of TCP before it sends the next message to the same client.
    through(size, "MQTT, 200 Hz", "set_tcp_nodelay true");
    through(size, "MQTT, 200 Hz, a broker with its defaults", "");
}

/// Through a broker with this line in its configuration.
fn through(size: Size, title: &str, configured: &str) {
    let port = free_port();
    let folder = tempfile::tempdir().expect("there is room");
    let configuration = folder.path().join("broker.conf");
    let lines = format!("listener {port} 127.0.0.1\nallow_anonymous true\n{configured}\n");
    std::fs::write(&configuration, lines).expect("a file can be written");
    let _broker = Program::start(Command::new("mosquitto").arg("-c").arg(&configuration));
    listens(port);
    let joints = "message Joints { frame: text  position: list of real  velocity: list of real }\n\
                  topic peer = \"peer\" : Joints";
    let plan = plan(&space(&format!("mqtt \"mqtt://127.0.0.1:{port}\""), joints, JOINT));
    beside(
        &plan,
        &sesame_mqtt::mqtt(PathBuf::from(".")),
        |stop| bare(port, stop),
        || {
            let mut ways = [
                Way::new(port, "direct", "direct", "direct"),
                Way::new(port, "a forwarder of bytes", "bare/undisturbed", "bare"),
                Way::new(port, "Sesame", "peer/undisturbed", "peer"),
            ];
            thread::sleep(Duration::from_secs(3));
            let names = ways.each_ref().map(|way| way.name);
            rounds(&mut ways, 1, |way| way.measure(20));
            let results = rounds(&mut ways, size.rounds, |way| way.measure(size.messages));
            print(title, &names, &results);
        },
    );
}
