//! What was said once, before anybody listened, and is kept for those who subscribe later.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Stdio};
use std::time::Instant;

use sesame_tests::{command, done, fresh_folder, sesamec, workspace};

use crate::environment::{Domain, Vendor};
use crate::peer::LIMIT;

/// A program that is ended with the test.
struct Mapper(Child);

impl Drop for Mapper {
    fn drop(&mut self) {
        _ = self.0.kill();
        _ = self.0.wait();
    }
}

#[test]
fn a_scan_asks_for_what_publishers_keep() {
    let Some(python) = Vendor::Jazzy.python() else { return };
    let (folder, domain) = (fresh_folder("scanned_latched"), Domain::free());
    let number = domain.number.to_string();
    let mut program = command(&python);
    program.arg(workspace().join("tests/ros2/peers/latched.py"));
    program.env("ROS_DOMAIN_ID", &number).env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST");
    let mut mapper = Mapper(program.stdout(Stdio::piped()).spawn().expect("a peer can be started"));
    let mut said = String::new();
    BufReader::new(mapper.0.stdout.take().expect("it is piped")).read_line(&mut said).expect("it says something");
    assert_eq!(said, "up\n");
    let begun = Instant::now();
    loop {
        let scan = ["scan", "ros2", "--domain", &number, "--seconds", "4"];
        let found = done(command(sesamec()).args(scan).current_dir(&folder)).expect(0).out;
        let is_kept = |line: &str| line.contains("\"/map\"") && line.contains("transient local, 1 message");
        if found.lines().any(is_kept) {
            break;
        }
        assert!(begun.elapsed() < LIMIT, "the message is awaited:\n{found}");
    }
}
