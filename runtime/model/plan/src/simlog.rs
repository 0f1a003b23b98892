//! A simulator that speaks SimlogAPI: where it is, and how its topics are named.

use serde::{Deserialize, Serialize};

use crate::TopicId;

/// A simulator that is reached over SimlogAPI, the gRPC protocol of the simulator that the original platform used. It
/// is stepped in lock-step.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Simlog {
    /// Its URL, `http://HOST:PORT` or `https://HOST:PORT`; of version 3 that of the server that takes steps. `{port}`
    /// stands for the port that the runner gives to what it launches.
    pub url: String,
    /// The URL of the topics in version 3; `None` for the port after that of `url`. Version 2 has one server.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub topics_url: Option<String>,
    /// Simulation time of one step, in nanoseconds: whole milliseconds, at least one.
    pub step_ns: u64,
    /// The version of the protocol.
    pub protocol: SimlogVersion,
    /// How names on the wire follow from those of topics.
    #[serde(default)]
    pub names: WireNames,
    /// The topic on which the simulator publishes a message at the end of each step, by its name on the wire, in
    /// version 3. All messages of a step come before it. The original platform used `SIMLOG://step`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marker: Option<String>,
    /// The topics that are cut besides those on which operations of this plan act: those on which any operation of the
    /// space acts. So all campaigns disturb the same system, in which messages of these topics arrive a step later.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cut: Vec<TopicId>,
    /// For how long nothing may come in until the messages of a step are complete, in nanoseconds of wall time. It
    /// counts only without a marker, and only if a topic is heard of which no node declares how many messages a step
    /// has: version 2 does not mark the end of a step.
    #[serde(default = "settle")]
    pub settle_ns: u64,
    /// A file with the certificates (PEM) of whoever vouches for an `https://` simulator, as seen from the folder of
    /// the `.sesame` file; `None` for a simulator without TLS.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ca: Option<String>,
}

/// A version of SimlogAPI.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SimlogVersion {
    /// `simulation.server.SimlogAPI`: messages of ROS, or text.
    V2,
    /// `simlog.server.SimlogAPI` with `SimServerAPI`: any JSON.
    V3,
}

/// What is written around the name of a topic on the wire.
///
/// The default is what the original platform did in version 2: it listened to `PATH/in`, published on `PATH/shadow`,
/// and left names that contain `safetyzone` as they are when it listened.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct WireNames {
    /// Before every name.
    #[serde(default)]
    pub prefix: String,
    /// Behind the name of a topic that is cut.
    pub cut: String,
    /// Behind the name of a topic that is only listened to.
    pub heard: String,
    /// Behind the name under which messages are published in place of those of a topic that is cut. In version 3 the
    /// simulator makes up that name and is told what it begins with: this.
    pub injected: String,
    /// Names that contain one of these have nothing behind them where they are cut or heard.
    #[serde(default)]
    pub bare: Vec<String>,
}

impl Default for WireNames {
    fn default() -> Self {
        WireNames {
            prefix: String::new(),
            cut: "/in".to_owned(),
            heard: "/in".to_owned(),
            injected: "/shadow".to_owned(),
            bare: vec!["safetyzone".to_owned()],
        }
    }
}

impl WireNames {
    /// What the original platform did in version 3: it cut `SIM://PATH/in` and listened to `SIM://PATH/out`.
    pub fn of_version_3() -> Self {
        WireNames {
            prefix: "SIM://".to_owned(),
            cut: "/in".to_owned(),
            heard: "/out".to_owned(),
            injected: "testingShadows".to_owned(),
            bare: Vec::new(),
        }
    }

    /// The name of a topic that is cut.
    pub fn cut(&self, path: &str) -> String {
        self.written(path, &self.cut)
    }

    /// The name of a topic that is only listened to.
    pub fn heard(&self, path: &str) -> String {
        self.written(path, &self.heard)
    }

    /// The name under which messages are published in place of those of a topic that is cut, in version 2.
    pub fn injected(&self, path: &str) -> String {
        format!("{}{path}{}", self.prefix, self.injected)
    }

    fn written(&self, path: &str, suffix: &str) -> String {
        let bare = self.bare.iter().any(|part| path.contains(part.as_str()));
        format!("{}{path}{}", self.prefix, if bare { "" } else { suffix })
    }
}

/// Long enough for messages that were sent before the answer to a step and are on this machine.
fn settle() -> u64 {
    5_000_000
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_on_the_wire_are_those_of_the_original_platform() {
        let (names, joint) = (WireNames::default(), "joints/R270073/Link0/R/position");
        assert_eq!(names.cut(joint), "joints/R270073/Link0/R/position/in");
        assert_eq!(names.heard(joint), "joints/R270073/Link0/R/position/in");
        assert_eq!(names.injected(joint), "joints/R270073/Link0/R/position/shadow");
        assert_eq!(names.heard("safetyzones/Z1"), "safetyzones/Z1");
        assert_eq!(names.injected("safetyzones/Z1"), "safetyzones/Z1/shadow");
        let names = WireNames::of_version_3();
        assert_eq!(names.cut("joints/KR22_825.Link1/R"), "SIM://joints/KR22_825.Link1/R/in");
        assert_eq!(names.heard("joints/KR22_825.Link1/R"), "SIM://joints/KR22_825.Link1/R/out");
    }
}
