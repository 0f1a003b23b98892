//! The client alone, also with peers that are none.

use std::io::{Read as _, Write as _};
use std::net::TcpListener;
use std::time::Duration;

use sesame_plan::SimlogVersion;
use sesame_simlog::client::{Bounds, Client, ClientError, ClientOptions};

use crate::peer::Peer;

fn patient(url: &str, patience: u64) -> ClientOptions {
    ClientOptions { patience: Duration::from_millis(patience), ..ClientOptions::new(url, SimlogVersion::V2) }
}

#[test]
fn what_is_not_taken_overflows() {
    let Some(peer) = Peer::start("simulator2.py", &["--eager"]) else { return };
    let bounds = Bounds { messages: 5, bytes: 1 << 20 };
    let mut client = Client::connect(&ClientOptions { bounds, ..patient(&peer.url(), 120_000) }).expect("it listens");
    client.set_step(20).expect("it takes any");
    client.listen("point/in", "").expect("there is such a topic");
    assert_eq!(client.await_streams(Duration::from_secs(120)), Ok(true));
    for _ in 0..10 {
        client.step().expect("it takes steps");
    }
    let overflow = loop {
        match client.take(Duration::from_millis(10)) {
            Ok(taken) => assert!(taken.is_empty(), "nothing is taken beside an overflow: {taken:?}"),
            Err(error) => break error,
        }
    };
    assert!(matches!(overflow, ClientError::Overflow { messages: 6, .. }), "{overflow}");
    assert!(overflow.to_string().contains(&peer.url()) && overflow.to_string().contains("`point/in`"), "{overflow}");
}

#[test]
fn nobody_is_named() {
    // No program is given this port if it asks for any.
    let url = "http://127.0.0.1:1";
    let nobody = Client::connect(&patient(url, 300)).unwrap_err();
    assert!(matches!(nobody, ClientError::Unreachable { .. }), "{nobody}");
    assert!(nobody.to_string().contains(url), "{nobody}");
}

#[test]
fn what_is_no_grpc_is_an_error() {
    let answers: [&[u8]; 4] = [
        b"",
        b"HTTP/1.1 200 OK\r\n\r\n",
        // A frame of settings, then one of a kind and a length that make no sense.
        b"\x00\x00\x00\x04\x00\x00\x00\x00\x00\xff\xff\xff\xff\xff\xff\xff\xff\xff",
        &[0x5a; 4096],
    ];
    for answer in answers {
        let listener = TcpListener::bind("127.0.0.1:0").expect("there are ports");
        let url = format!("http://{}", listener.local_addr().expect("it has one"));
        let answering = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("somebody connects");
            let mut greeting = [0; 24];
            stream.read_exact(&mut greeting).expect("it greets");
            // The other side may have gone already.
            stream.write_all(answer).ok();
            drop(stream);
            drop(listener);
        });
        let asked = Client::connect(&patient(&url, 2000)).and_then(|mut client| client.set_step(20));
        let said = asked.expect_err("that is not an answer").to_string();
        assert!(said.contains(&url), "{said}");
        answering.join().expect("it answers");
    }
}
