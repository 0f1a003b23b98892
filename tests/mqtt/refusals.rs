//! Brokers that do not let the runner in.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use sesame_plan::Test;
use sesame_tests::fresh_folder;

use crate::peers::{Broker, packages};
use crate::relaying::{System, space};

pub(crate) const SECRET: &str = "s3cret-of-the-fleet";

/// A password file of mosquitto with a user `relay`.
pub(crate) fn passwords(folder: &Path) -> String {
    let file = folder.join("passwords");
    let made = Command::new("mosquitto_passwd").args(["-b", "-c"]).arg(&file).args(["relay", SECRET]).status();
    assert!(made.expect("mosquitto_passwd starts").success());
    format!("allow_anonymous false\npassword_file {}\n", file.display())
}

/// A certificate that only itself vouches for, of `localhost`, and its key.
fn certificate(folder: &Path) -> String {
    let [certificate, key] = ["fleet.pem", "fleet.key"].map(|name| folder.join(name));
    let made = Command::new("openssl")
        .args(["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost"])
        .args(["-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-addext", "basicConstraints=critical,CA:FALSE"])
        .arg("-out")
        .arg(&certificate)
        .arg("-keyout")
        .arg(&key)
        .stderr(Stdio::null())
        .status();
    assert!(made.expect("openssl starts").success());
    format!("certfile {}\nkeyfile {}\n", certificate.display(), key.display())
}

/// What is said about a broker with these settings, without a secret in it; nothing if it lets the runner in.
fn said(folder: &Path, broker: &str, settings: &str) -> Result<(), String> {
    let mut system = System::new(&space(broker, settings, ""), folder);
    let said = system.relay_until(&Test::default(), || {}, || true);
    let notes = system.notes();
    for words in said.as_ref().err().into_iter().chain(&notes) {
        assert!(!words.contains(SECRET) && !words.contains("wrong-secret"), "{words}");
    }
    said
}

#[test]
fn a_wrong_password_and_none_are_refused_and_the_right_one_is_not() {
    if packages().is_none() {
        return;
    }
    let folder = fresh_folder("mqtt_passwords");
    let broker = Broker::with(&folder, &passwords(&folder));
    let at = format!("mqtt://127.0.0.1:{}", broker.port);
    fs::write(folder.join("right"), SECRET).expect("a file can be written");
    fs::write(folder.join("wrong"), "wrong-secret").expect("a file can be written");
    let refused = |why: &str| Err(format!("the broker at `{at}` refused the connection: {why}"));
    let wrong = said(&folder, &at, "user \"relay\"  password from file \"wrong\"");
    assert_eq!(wrong, refused("it does not accept the user or the password"));
    let none = said(&folder, &at, "");
    assert_eq!(
        none,
        refused(
            "it wants a user; add `user` and `password` to the simulator, or `--user` and `--password-env` to a scan"
        )
    );
    assert_eq!(said(&folder, &at, "user \"relay\"  password from file \"right\""), Ok(()));
}

#[test]
fn plain_text_to_a_port_of_tls_is_refused_and_so_is_a_certificate_that_nobody_vouches_for() {
    if packages().is_none() {
        return;
    }
    let folder = fresh_folder("mqtt_tls");
    let broker = Broker::with(&folder, &format!("{}{}", passwords(&folder), certificate(&folder)));
    fs::write(folder.join("right"), SECRET).expect("a file can be written");
    let login = "user \"relay\"  password from file \"right\"";
    let plain = said(&folder, &format!("mqtt://127.0.0.1:{}", broker.port), login).expect_err("it is plain text");
    assert!(plain.contains("refused the connection") && plain.contains("does it speak TLS"), "{plain}");
    let tls = format!("mqtts://localhost:{}", broker.port);
    let unknown = said(&folder, &tls, login).expect_err("nobody vouches for it");
    assert!(unknown.contains("certificate"), "{unknown}");
    assert_eq!(said(&folder, &tls, &format!("{login}  trust \"fleet.pem\"")), Ok(()));
}
