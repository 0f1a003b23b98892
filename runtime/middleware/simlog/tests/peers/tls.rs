//! A simulator over TLS, with certificates that `openssl` makes for the test.

use std::path::Path;
use std::process::Command;

use sesame_plan::{SimlogVersion, Transport, Type};

use crate::peer::Peer;
use crate::recorder::{Recorder, plan, run, transport_in};

/// Makes a certificate for this machine, and those who vouch for it. Whether there is an `openssl` for it.
fn certify(folder: &Path) -> bool {
    std::fs::write(folder.join("names"), "subjectAltName=IP:127.0.0.1").expect("the folder takes files");
    let key = "-newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes";
    let commands = [
        format!("req -x509 {key} -keyout ca.key -out ca.pem -days 2 -subj /CN=tests"),
        format!("req {key} -keyout key.pem -out request.pem -subj /CN=simulator"),
        "x509 -req -in request.pem -CA ca.pem -CAkey ca.key -CAcreateserial -out cert.pem -days 2 -extfile names"
            .to_owned(),
    ];
    for command in commands {
        let made = Command::new("openssl").args(command.split(' ')).current_dir(folder).output();
        let Ok(made) = made else {
            assert!(std::env::var("CI").map_or(true, |ci| ci != "true"), "there is no `openssl` here: install it");
            eprintln!("skipped: there is no `openssl` here");
            return false;
        };
        assert!(made.status.success(), "openssl {command}: {}", String::from_utf8_lossy(&made.stderr));
    }
    true
}

#[test]
fn a_simulator_is_reached_over_tls() {
    let folder = tempfile::tempdir().expect("there is room");
    if !certify(folder.path()) {
        return;
    }
    let file = |name: &str| folder.path().join(name).display().to_string();
    let Some(peer) = Peer::start("simulator2.py", &["--tls", &file("key.pem"), &file("cert.pem")]) else { return };
    let with = |ca: Option<&str>| {
        let url = peer.url().replace("http://", "https://");
        let mut plan = plan(&url, SimlogVersion::V2, &[("joint", Type::Real { unit: None })]);
        let Transport::Simlog(simlog) = &mut plan.simulator.transport else { panic!("it speaks SimlogAPI") };
        simlog.ca = ca.map(str::to_owned);
        let mut relay = Recorder::new(&plan, |_, value| Some(value));
        let ran = run(transport_in(&plan, folder.path()).as_mut(), 20, &mut relay);
        (ran, relay.of("joint").len())
    };
    assert_eq!(with(Some("ca.pem")), (Ok(20), 20));
    let said = |ca: Option<&str>| with(ca).0.unwrap_err().to_string();
    assert!(said(None).contains("file with the certificates"), "{}", said(None));
    assert!(said(Some("nowhere.pem")).contains("`nowhere.pem` cannot be read"), "{}", said(Some("nowhere.pem")));
}

#[test]
fn whoever_is_not_vouched_for_is_refused() {
    let folders = [(), ()].map(|()| tempfile::tempdir().expect("there is room"));
    if !folders.iter().all(|folder| certify(folder.path())) {
        return;
    }
    let [ours, theirs] = folders;
    let file = |name: &str| theirs.path().join(name).display().to_string();
    let Some(peer) = Peer::start("simulator2.py", &["--tls", &file("key.pem"), &file("cert.pem")]) else { return };
    let ca = std::fs::read(ours.path().join("ca.pem")).expect("it was made");
    let options = sesame_simlog::client::ClientOptions {
        ca: Some(ca),
        patience: std::time::Duration::from_secs(5),
        ..sesame_simlog::client::ClientOptions::new(&peer.url().replace("http://", "https://"), SimlogVersion::V2)
    };
    let refused = sesame_simlog::client::Client::connect(&options).unwrap_err().to_string();
    assert!(refused.contains("certificate"), "{refused}");
}
