//! Clients of a real server of rosbridge that connect to proxies of the runner instead, in Python and in JavaScript.

use std::cell::RefCell;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use sesame_plan::Test;
use sesame_tests::{Port, fresh_folder, workspace};

use crate::environment::{Domain, packages_of_roslib};
use crate::peer::{LIMIT, Peer};
use crate::relaying::{Exchange, System, plan, space};
use crate::rosbridge::{BATCH, JOINTS, Pythons, Server};

const SECRET: &str = "s3cret-of-the-hall";

/// A bridge on the nodes of a domain, with a proxy for the node that publishes and one for the node that subscribes.
struct Hall {
    pythons: Pythons,
    domain: Domain,
    bridge: Port,
    station: Port,
    viewer: Port,
}

impl Hall {
    /// None if a peer is missing, which was said.
    fn find() -> Option<Self> {
        packages_of_roslib()?;
        let pythons = Pythons::find()?;
        let domain = Domain::free();
        Some(Hall { pythons, domain, bridge: Port::free(), station: Port::free(), viewer: Port::free() })
    }

    fn server(&self) -> Server {
        Server::start(&self.pythons, &self.domain, &self.bridge)
    }

    /// A space in which an operation tells the subscriber apart, so that both have names of their own at the bridge.
    fn text(&self) -> String {
        let nodes = "node station { publishes peer }  node viewer { subscribes peer }";
        let text = space(&self.domain, JOINTS, nodes, "operation lost on peer to viewer = blackhole", "60s");
        let Hall { bridge, station, viewer, .. } = self;
        let proxies = format!("proxy station \"ws://127.0.0.1:{station}\"  proxy viewer \"ws://127.0.0.1:{viewer}\"");
        text.replacen("ros2 { domain", &format!("rosbridge \"ws://127.0.0.1:{bridge}\" {{ {proxies}  domain"), 1)
    }

    fn python(&self, arguments: &[&str]) -> Peer {
        Peer::start(&self.pythons.bridge, &self.domain, "roslib_client.py", arguments)
    }

    fn javascript(&self, arguments: &[&str]) -> Peer {
        Peer::start_in(&clients(), Path::new("node"), &self.domain, "client.mjs", arguments)
    }
}

fn clients() -> PathBuf {
    workspace().join("tests/ros2/rosbridge")
}

/// Runs until the subscriber has all that it waits for: what both say.
fn through(hall: &Hall, publisher: Peer, subscriber: Peer, mut meanwhile: impl FnMut()) -> [serde_json::Value; 2] {
    let mut system = System::new(plan(&hall.text()));
    let to = [&subscriber];
    let exchange = Exchange { batch: Some(BATCH), ..Exchange::new(&publisher, &to) };
    system.exchange_until(&Test::default(), &exchange, |_| {
        meanwhile();
        subscriber.is_done()
    });
    [publisher.expect(), subscriber.expect()]
}

#[test]
fn clients_in_python_and_javascript_reach_each_other_through_proxies_and_the_relay() {
    let Some(hall) = Hall::find() else { return };
    let _server = hall.server();
    let (station, viewer, batch) = (hall.station.to_string(), hall.viewer.to_string(), BATCH.to_string());
    let speaks = ["publish", &station, "/peer", "1000", &batch];
    let hears = |compression| ["wait", &viewer, "/peer", "1000", &batch, compression];
    let [said, heard] = through(&hall, hall.python(&speaks), hall.javascript(&hears("cbor")), || ());
    assert_eq!((&said["count"], &said), (&serde_json::json!(1000), &heard), "Python to JavaScript");
    let [said, heard] = through(&hall, hall.javascript(&speaks), hall.python(&hears("none")), || ());
    assert_eq!((&said["count"], &said), (&serde_json::json!(1000), &heard), "JavaScript to Python");
}

#[test]
fn ten_thousand_malformed_frames_of_one_client_change_nothing_for_others() {
    let Some(hall) = Hall::find() else { return };
    let _server = hall.server();
    let (station, viewer, batch) = (hall.station.to_string(), hall.viewer.to_string(), BATCH.to_string());
    let speaks = ["publish", &station, "/peer", "1000", &batch];
    let hears = ["wait", &viewer, "/peer", "1000", &batch, "png"];
    let mut vandal = None;
    let (publisher, subscriber) = (hall.javascript(&speaks), hall.javascript(&hears));
    let [said, heard] = through(&hall, publisher, subscriber, || {
        vandal.get_or_insert_with(|| hall.javascript(&["malformed", &station, "10000"]));
    });
    assert_eq!((&said["count"], &said), (&serde_json::json!(1000), &heard));
    assert_eq!(vandal.expect("it was started").expect()["reports"], 10_000);
}

#[test]
fn after_a_bridge_restarts_clients_of_proxies_go_on() {
    let Some(hall) = Hall::find() else { return };
    let server = RefCell::new(Some(hall.server()));
    let (station, viewer, batch) = (hall.station.to_string(), hall.viewer.to_string(), BATCH.to_string());
    let subscriber = hall.python(&["wait", &viewer, "/peer", "600", &batch]);
    // What it says while there is no bridge is lost, so it says more than is waited for, at a rate.
    let publisher = hall.javascript(&["publish", &station, "/peer", "1000000", "1000000", "100"]);
    let mut system = System::new(plan(&hall.text()));
    let mut heard_before = None;
    system.exchange_until(&Test::default(), &Exchange::new(&publisher, &[&subscriber]), |_| {
        if heard_before.is_none() && subscriber.told("count") >= 50 {
            server.borrow_mut().take();
            *server.borrow_mut() = Some(hall.server());
            heard_before = Some(subscriber.told("count"));
        }
        subscriber.is_done()
    });
    assert!(heard_before.is_some_and(|count| count < 600), "the server was restarted before all had come");
    assert_eq!(subscriber.expect()["count"], 600);
}

/// A certificate that only itself vouches for, and its key.
fn certificate(folder: &Path) {
    let made = Command::new("openssl")
        .args(["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost"])
        .args(["-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"])
        .arg("-out")
        .arg(folder.join("hall.pem"))
        .arg("-keyout")
        .arg(folder.join("hall.key"))
        .stderr(Stdio::null())
        .status();
    assert!(made.expect("openssl starts").success());
}

#[test]
fn a_wrong_token_none_and_plain_text_to_a_port_of_tls_are_refused_and_noted_without_the_secret() {
    let Some(hall) = Hall::find() else { return };
    let _server = hall.server();
    let folder = fresh_folder("ros2_proxies");
    certificate(&folder);
    fs::write(folder.join("token"), SECRET).expect("a file can be written");
    let url = format!("wss://127.0.0.1:{}", hall.station);
    let settings = "{ token from file \"token\"  certificate \"hall.pem\"  key \"hall.key\" }";
    let station = format!("proxy station \"{url}\" {settings}");
    // No client ever connects as `absent`, so the run does not begin even while a client is let in as `station`.
    let nodes = "node station { publishes peer }  node absent { subscribes peer }";
    let text = space(&hall.domain, JOINTS, nodes, "operation lost on peer to absent = blackhole", "60s");
    let proxies = format!("{station}  proxy absent \"wss://127.0.0.1:{}\" {settings}", hall.viewer);
    let bridge = format!("rosbridge \"ws://127.0.0.1:{}\" {{ {proxies}  domain", hall.bridge);
    let mut system = System::in_folder(plan(&text.replacen("ros2 { domain", &bridge, 1)), folder);
    let said = std::thread::scope(|scope| {
        let attempts = scope.spawn(|| {
            let attempt = |url: &str, token: &str, query: &str| {
                let said = Peer::start_in(
                    &clients(),
                    Path::new("node"),
                    &hall.domain,
                    "client.mjs",
                    &["attempt", url, token, query],
                );
                said.expect().as_str().expect("it says a text").to_owned()
            };
            let limit = Instant::now() + LIMIT;
            while std::net::TcpStream::connect(("127.0.0.1", hall.station.number())).is_err() {
                assert!(Instant::now() < limit, "the proxy does not listen");
                std::thread::sleep(Duration::from_millis(20));
            }
            let plain = url.replacen("wss", "ws", 1);
            [
                attempt(&url, "wrong-secret", ""),
                attempt(&url, "", "wrong-secret"),
                attempt(&url, "", ""),
                attempt(&plain, SECRET, ""),
                attempt(&url, "", SECRET),
                attempt(&url, SECRET, ""),
            ]
        });
        let error = system.reset();
        assert!(error.contains("no client of node `absent` is connected to its proxy at `wss://"), "{error}");
        attempts.join().expect("all were tried")
    });
    let [wrong, wrong_in_address, none, plain, in_address, right] = said;
    assert_eq!([&wrong, &wrong_in_address, &none], ["Unexpected server response: 401"; 3]);
    assert_eq!([in_address, right], ["let in"; 2]);
    assert!(plain != "let in", "{plain}");
    let notes = system.all_notes();
    for words in ["it showed a wrong token", "it showed no token", "it does not speak TLS"] {
        assert!(notes.iter().any(|note| note.contains(words)), "{words}: {notes:?}");
    }
    assert!(notes.iter().all(|note| !note.contains(SECRET) && !note.contains("wrong-secret")), "{notes:?}");
}
