//! The Pythons of the peers, and domains and ports in which tests do not hear each other.

use std::fmt::{self, Display};
use std::fs;
use std::net::{Ipv4Addr, UdpSocket};
use std::path::{Path, PathBuf};

use serde_json::Value;
use sesame_tests::{Done, command, done, fresh_folder, from_own_place, sesamec};

/// An environment with a middleware.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Vendor {
    /// ROS 2 Kilted with a simulator of physics: `examples/iiwa_cell`.
    Kilted,
    /// ROS 2 Jazzy.
    Jazzy,
    /// Cyclone DDS without ROS, and rosbags.
    Cyclone,
    /// ROS 2 Kilted with a simulator of mobile robots: `examples/fleet`.
    Fleet,
    /// A server and a client of rosbridge.
    Rosbridge,
    /// ROS 1, of the system.
    Ros1,
    /// Servers and clients of SimlogAPI, by grpcio.
    Simlog,
}

impl Vendor {
    fn variable(self) -> &'static str {
        match self {
            Vendor::Kilted => "SESAME_ROS2_KILTED",
            Vendor::Jazzy => "SESAME_ROS2_JAZZY",
            Vendor::Cyclone => "SESAME_ROS2_CYCLONE",
            Vendor::Fleet => "SESAME_ROS2_FLEET",
            Vendor::Rosbridge => "SESAME_ROSBRIDGE",
            Vendor::Ros1 => "SESAME_ROS1",
            Vendor::Simlog => "SESAME_SIMLOG",
        }
    }

    /// Its Python. Without one it prints that the test is skipped; with `CI=true` that is an error.
    pub(crate) fn python(self) -> Option<PathBuf> {
        sesame_peers::named(self.variable())
    }

    /// The definitions of its messages.
    pub(crate) fn share(python: &Path) -> PathBuf {
        Vendor::environment(python).join("share")
    }

    /// The folder of the environment that a Python belongs to.
    pub(crate) fn environment(python: &Path) -> &Path {
        python.ancestors().nth(2).expect("a Python lies in `bin` of its environment")
    }
}

/// The folder of the packages of clients in JavaScript. Without them it prints that the test is skipped; with `CI=true`
/// that is an error.
pub(crate) fn packages_of_roslib() -> Option<PathBuf> {
    sesame_peers::named("SESAME_ROSLIB")
}

/// A space in a folder of its own, whose nodes are in a domain of their own.
pub(crate) struct Space {
    folder: PathBuf,
    file: String,
    /// Held for as long as it is used.
    _domain: Domain,
}

impl Space {
    /// Writes a file with this text.
    pub(crate) fn write(name: &str, domain: Domain, file: &str, text: &str) -> Space {
        let folder = fresh_folder(name);
        fs::write(folder.join(file), text).expect("a space can be written");
        Space { folder, file: file.to_owned(), _domain: domain }
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// `sesamec` in its folder.
    pub(crate) fn sesamec(&self, arguments: &[&str]) -> Done {
        done(command(sesamec()).args(arguments).current_dir(&self.folder))
    }

    /// The tests in a folder of results.
    #[track_caller]
    pub(crate) fn listed(&self, results: &str) -> Listed {
        Listed(self.sesamec(&["list", &self.file, "--results", results, "--format", "json"]).expect(0).json())
    }
}

/// The tests of a run, as `list` gives them.
pub(crate) struct Listed(Value);

impl Listed {
    /// What a metric measured in a test.
    #[track_caller]
    pub(crate) fn value(&self, test: &str, metric: &str) -> f64 {
        let found = self.0["tests"].as_array().expect("it lists tests").iter().find(|row| row["test"] == test);
        let measured = found.and_then(|row| row["measured"][metric].as_f64());
        measured.unwrap_or_else(|| panic!("no {metric} of {test} in {self:#}"))
    }
}

impl Display for Listed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A domain, and maybe the ones after it, that no other test on this machine uses meanwhile.
#[derive(Debug)]
pub(crate) struct Domain {
    pub(crate) number: u16,
    /// Held for as long as the domains are used: a port of each that no participant reaches.
    _held: Vec<UdpSocket>,
}

/// The domains of tests. Their ports lie below the ports that the system assigns by itself, and no example is in
/// one of these domains.
const DOMAINS: std::ops::Range<u16> = 62..100;

impl Domain {
    pub(crate) fn free() -> Self {
        Domain::first_of(1)
    }

    /// The first of as many domains, as a runner with so many workers needs them.
    pub(crate) fn first_of(count: u16) -> Self {
        let all = DOMAINS.start..=DOMAINS.end - count;
        let free = from_own_place(all).into_iter().find_map(|number| {
            let ports = (number..number + count).map(|number| 7400 + 250 * number + 249);
            let held = ports.map(|port| UdpSocket::bind((Ipv4Addr::LOCALHOST, port)));
            Some(Domain { number, _held: held.collect::<Result<_, _>>().ok()? })
        });
        free.expect("so many domains are enough for the tests of one machine")
    }
}
