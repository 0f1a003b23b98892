//! The arguments of the commands of `sesamec scan`. They are the same in every build.

use std::path::PathBuf;

use crate::cli::arguments::ExplainFormat;

pub(super) const ROS_2: &str = "For example: sesamec scan ros2 --domain 40 --types /opt/ros/jazzy/share > cell.sesame\n\n\
                                Nothing is published beyond what discovery needs; nodes are asked only for the layouts \
                                of types that no folder has.";

pub(super) const ROS_1: &str = "For example: sesamec scan ros1 --master http://localhost:11311 > cell.sesame\n\n\
                                Nothing is registered at the master and nothing is published. Publishers provide the \
                                layouts of their messages; layouts of services come from folders only.";

pub(super) const ROSBRIDGE: &str = "For example: sesamec scan rosbridge ws://localhost:9090 > hall.sesame\n\n\
     A server with the services of rosapi lists the system. If it has none, name the topics with --topic; if no folder \
     has their layout, it consists of the fields that all of their messages have.";

pub(super) const MQTT: &str = "For example: sesamec scan mqtt mqtt://localhost:1883 --topics 'uagv/v2/#' > fleet.sesame\n\n\
                               Nothing is published. A scan sees topics with retained messages, or with messages \
                               that arrive meanwhile. A broker does not reveal publishers and subscribers.";

pub(super) const SIMLOG: &str = "For example: sesamec scan simlog http://localhost:8089 --topic joints/R1/Link0/position --steps 10 > cell.sesame\n\n\
     The protocol lists no topics in either version, so name them. Without --steps the simulation is not stepped, and \
     the scan sees only what it publishes by itself. The variable SESAME_SIMLOG_TOKEN has the token, if the simulator \
     needs one.";

pub(super) const MAVLINK: &str = "For example: sesamec scan mavlink udp://127.0.0.1:14550 --types common.xml > flight.sesame\n\n\
     The scan listens in the place of the ground station and sends nothing: it sees vehicles that send to this address \
     by themselves, and no orders.";

/// How nodes of ROS 2 are listened to.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Ros2 {
    /// The domain; if omitted, `ROS_DOMAIN_ID`, or 0 if that is not set.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=232))]
    pub(super) domain: Option<u16>,
    /// How long to listen, in seconds of wall time: 2 to 3600. Discovery takes up to two of them.
    #[arg(long, default_value_t = 5.0, value_name = "S", value_parser = seconds)]
    pub(super) seconds: f64,
    /// A folder of packages with the definitions of messages and services; may be repeated. If omitted, `share` in the
    /// folders of `AMENT_PREFIX_PATH`.
    #[arg(long, value_name = "FOLDER")]
    pub(super) types: Vec<PathBuf>,
    /// Also listen to other machines, not only to this one.
    #[arg(long)]
    pub(super) network: bool,
    /// A space, or what was found as one JSON object.
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: ExplainFormat,
}

/// How nodes of ROS 1 are looked at.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Ros1 {
    /// The address of the master; if omitted, `ROS_MASTER_URI`, or `http://localhost:11311` if that is not set.
    #[arg(long, value_name = "URL")]
    pub(super) master: Option<String>,
    /// How long messages are counted, in seconds of wall time: 2 to 3600.
    #[arg(long, default_value_t = 5.0, value_name = "S", value_parser = seconds)]
    pub(super) seconds: f64,
    /// A folder of packages with the definitions of messages and services, such as `/usr/share`; may be repeated. If
    /// omitted, the folders of `ROS_PACKAGE_PATH`.
    #[arg(long, value_name = "FOLDER")]
    pub(super) types: Vec<PathBuf>,
    /// A space, or what was found as one JSON object.
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: ExplainFormat,
}

/// How nodes behind a bridge are looked at.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Rosbridge {
    /// The address of the server, `ws://HOST:PORT` or `wss://HOST:PORT`.
    #[arg(value_name = "URL")]
    pub(super) url: String,
    /// A topic to listen to, with its type if you know it, such as `/aim:std_msgs/msg/Float64`; may be repeated. A
    /// server without rosapi lists none.
    #[arg(long = "topic", value_name = "NAME[:TYPE]")]
    pub(super) topics: Vec<String>,
    /// Which ROS is behind the server; if omitted, the one whose notation its types have, or ROS 2 if it lists none.
    #[arg(long, value_enum, value_name = "ROS")]
    pub(super) dialect: Option<RosDialect>,
    /// How long to listen, in seconds of wall time: 2 to 3600.
    #[arg(long, default_value_t = 5.0, value_name = "S", value_parser = seconds)]
    pub(super) seconds: f64,
    /// A folder of packages with the definitions of messages and services; may be repeated. If omitted, `share` in the
    /// folders of `AMENT_PREFIX_PATH`.
    #[arg(long, value_name = "FOLDER")]
    pub(super) types: Vec<PathBuf>,
    /// The environment variable with the server's token.
    #[arg(long, value_name = "NAME")]
    pub(super) token_env: Option<String>,
    /// The file with the server's token.
    #[arg(long, value_name = "FILE", conflicts_with = "token_env")]
    pub(super) token_file: Option<String>,
    /// A file with certificates of authorities, in PEM, to trust instead of those of the system.
    #[arg(long, value_name = "FILE")]
    pub(super) trust: Option<String>,
    /// A space, or what was found as one JSON object.
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: ExplainFormat,
}

/// A ROS.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub(in crate::cli) enum RosDialect {
    /// ROS 1
    Ros1,
    /// ROS 2
    Ros2,
}

/// How a broker is listened to.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Mqtt {
    /// The address of the broker, `mqtt://HOST:PORT` or `mqtts://HOST:PORT`.
    #[arg(value_name = "URL")]
    pub(super) url: String,
    /// The topics to listen to, as an MQTT filter; may be repeated.
    #[arg(long, value_name = "FILTER", default_value = "#")]
    pub(super) topics: Vec<String>,
    /// How long to listen, in seconds of wall time: 2 to 3600.
    #[arg(long, default_value_t = 5.0, value_name = "S", value_parser = seconds)]
    pub(super) seconds: f64,
    /// The user name for the login.
    #[arg(long, value_name = "NAME")]
    pub(super) user: Option<String>,
    /// The environment variable with the password.
    #[arg(long, value_name = "NAME", requires = "user")]
    pub(super) password_env: Option<String>,
    /// The file with the password.
    #[arg(long, value_name = "FILE", requires = "user", conflicts_with = "password_env")]
    pub(super) password_file: Option<String>,
    /// A file with certificates of authorities, in PEM, to trust instead of those of the system.
    #[arg(long, value_name = "FILE")]
    pub(super) trust: Option<String>,
    /// A space, or what was found as one JSON object.
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: ExplainFormat,
}

/// How a simulator is listened to.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Simlog {
    /// The address of the simulator, `http://HOST:PORT` or `https://HOST:PORT`.
    #[arg(value_name = "ADDRESS")]
    pub(super) url: String,
    /// The version of the protocol: 2 or 3.
    #[arg(long, alias = "version", default_value_t = 2, value_name = "N", value_parser = clap::value_parser!(u8).range(2..=3))]
    pub(super) protocol: u8,
    /// A topic to listen to, by its path in a space, without what `--prefix` and `--heard` add; may be repeated.
    #[arg(long = "topic", value_name = "NAME")]
    pub(super) topics: Vec<String>,
    /// A file with the path of a topic in each line.
    #[arg(long, value_name = "FILE")]
    pub(super) topics_from: Option<PathBuf>,
    /// Take this many steps, 1 to 10000, and listen: the simulation advances, and may restart. If omitted, no step is
    /// taken.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub(super) steps: Option<u64>,
    /// The length of a step in milliseconds of simulation time, 1 to 3600000.
    #[arg(long, value_name = "MS", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=3_600_000))]
    pub(super) step: u64,
    /// How long to listen, in seconds of wall time: 2 to 3600; with `--steps`, at most this long after the last step.
    #[arg(long, default_value_t = 5.0, value_name = "S", value_parser = seconds)]
    pub(super) seconds: f64,
    /// The address of the server of topics in version 3; if omitted, the port after that of the address.
    #[arg(long, value_name = "ADDRESS")]
    pub(super) topics_at: Option<String>,
    /// The prefix of each name on the wire; if omitted, nothing in version 2, `SIM://` in version 3.
    #[arg(long, value_name = "TEXT")]
    pub(super) prefix: Option<String>,
    /// The suffix of the name of a topic that is listened to; if omitted, `/in` in version 2, `/out` in version 3.
    #[arg(long, value_name = "TEXT")]
    pub(super) heard: Option<String>,
    /// The suffix of the name of a topic that is cut; if omitted, `/in`.
    #[arg(long, value_name = "TEXT")]
    pub(super) cut: Option<String>,
    /// A file with certificates of authorities, in PEM, for an `https://` address.
    #[arg(long, value_name = "FILE")]
    pub(super) trust: Option<String>,
    /// A space, or what was found as one JSON object.
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: ExplainFormat,
}

/// How vehicles are listened to.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Mavlink {
    /// The address to which the vehicles send, `udp://HOST:PORT` of this machine; the usual port is 14550.
    #[arg(value_name = "URL")]
    pub(super) url: String,
    /// A file of the dialect, such as `common.xml`, with those that it includes; may be repeated.
    #[arg(long, value_name = "FILE", required = true)]
    pub(super) types: Vec<String>,
    /// How long to listen, in seconds of wall time: 2 to 3600.
    #[arg(long, default_value_t = 5.0, value_name = "S", value_parser = seconds)]
    pub(super) seconds: f64,
    /// A space, or what was found as one JSON object.
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: ExplainFormat,
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().map_err(|_| "expected a number of seconds".to_owned())?;
    if (2.0..=3600.0).contains(&seconds) { Ok(seconds) } else { Err("expected 2 to 3600 seconds".to_owned()) }
}
