//! What was said once, before anybody listened, and is kept for those who subscribe later.

use sesame_tests::fresh_folder;

use crate::environment::{Domain, Vendor};
use crate::peer::Peer;
use crate::scans::looked;

#[test]
fn a_scan_asks_for_what_publishers_keep() {
    let Some(python) = Vendor::Jazzy.python() else { return };
    let (folder, domain) = (fresh_folder("scanned_latched"), Domain::free());
    let mapper = Peer::start(&python, &domain, "latched.py", &[]);
    mapper.await_up();
    let scan = ["scan", "ros2", "--domain", &domain.number.to_string(), "--seconds", "4"];
    let is_kept = |line: &str| line.contains("\"/map\"") && line.contains("transient local, 1 message");
    looked(&folder, &scan, |found| found.lines().any(is_kept));
}
