//! `sesamec scan`: a space of what is running.

use std::path::PathBuf;
use std::process::ExitCode;

use super::arguments::ExplainFormat;
use super::shell::Shell;
use crate::frontend::Language;

/// What is looked at.
#[derive(Debug, clap::Subcommand)]
pub(super) enum Scan {
    /// Listen to nodes of ROS 2, and print a space with their topics, services and messages.
    #[command(after_help = EXAMPLE)]
    Ros2(Ros2),
}

const EXAMPLE: &str = "For example: sesamec scan ros2 --domain 40 --types /opt/ros/jazzy/share > cell.sesame\n\n\
                       Nothing is published beyond what discovery needs; nodes are asked only for the layouts of types \
                       that no folder has.";

/// How nodes of ROS 2 are listened to.
#[derive(Debug, clap::Args)]
pub(super) struct Ros2 {
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
    /// Listen to other machines as well, not to this one only.
    #[arg(long)]
    pub(super) network: bool,
    /// A space, or what was found as one JSON object.
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: ExplainFormat,
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().map_err(|_| "expected a number of seconds".to_owned())?;
    if (2.0..=3600.0).contains(&seconds) { Ok(seconds) } else { Err("expected 2 to 3600 seconds".to_owned()) }
}

/// `sesamec scan`
#[cfg(not(feature = "ros2"))]
pub(super) fn scan(_: Shell, _: &Language, scan: &Scan) -> anyhow::Result<ExitCode> {
    let Scan::Ros2(_) = scan;
    anyhow::bail!(
        "this sesamec was built without ROS 2; in a checkout of Sesame, `cargo install --path sesame-codegen --features \
         ros2` installs one with it, and `cargo run --features ros2 -p sesame-codegen -- scan ros2` runs one"
    )
}

/// `sesamec scan`
#[cfg(feature = "ros2")]
pub(super) fn scan(shell: Shell, language: &Language, scan: &Scan) -> anyhow::Result<ExitCode> {
    let Scan::Ros2(arguments) = scan;
    super::scan_ros2::scan(shell, language, arguments)
}
