//! `sesamec scan`: a space of what is running.

mod arguments;
#[cfg(any(
    feature = "mavlink",
    feature = "mqtt",
    feature = "ros1",
    feature = "ros2",
    feature = "rosbridge",
    feature = "simlog"
))]
mod common;
#[cfg(any(feature = "ros1", feature = "ros2", feature = "rosbridge"))]
mod definitions;
#[cfg(feature = "mavlink")]
mod mavlink;
#[cfg(feature = "mqtt")]
mod mqtt;
#[cfg(feature = "ros1")]
mod ros1;
#[cfg(feature = "ros2")]
mod ros2;
#[cfg(feature = "rosbridge")]
mod rosbridge;
#[cfg(any(feature = "mqtt", feature = "rosbridge"))]
mod secrets;
#[cfg(feature = "simlog")]
mod simlog;

use std::process::ExitCode;

use self::arguments::{Mavlink, Mqtt, Ros1, Ros2, Rosbridge, Simlog};
use super::shell::Shell;
use crate::frontend::Language;

/// What is looked at.
#[derive(Debug, clap::Subcommand)]
pub(super) enum Scan {
    /// Listen to nodes of ROS 2, and print a space with their topics, services and messages.
    #[command(after_help = arguments::ROS_2)]
    Ros2(Ros2),
    /// Ask a master of ROS 1 and its nodes, and print a space with their topics, services and messages.
    #[command(after_help = arguments::ROS_1)]
    Ros1(Ros1),
    /// Ask a rosbridge server for its system, listen, and print a space with topics, services and messages.
    #[command(after_help = arguments::ROSBRIDGE)]
    Rosbridge(Rosbridge),
    /// Listen to an MQTT broker, and print a space with its topics and the messages of their payloads.
    #[command(after_help = arguments::MQTT)]
    Mqtt(Mqtt),
    /// Listen to topics of a simulator that speaks SimlogAPI, and print a space with them and their messages.
    #[command(after_help = arguments::SIMLOG)]
    Simlog(Simlog),
    /// Listen to vehicles that speak MAVLink, and print a space with them and their messages.
    #[command(after_help = arguments::MAVLINK)]
    Mavlink(Mavlink),
}

/// `sesamec scan`
#[cfg_attr(
    not(any(
        feature = "mavlink",
        feature = "mqtt",
        feature = "ros1",
        feature = "ros2",
        feature = "rosbridge",
        feature = "simlog"
    )),
    expect(unused_variables, reason = "without any middleware there is nothing to scan")
)]
pub(super) fn scan(shell: Shell, language: &Language, scan: &Scan) -> anyhow::Result<ExitCode> {
    match scan {
        #[cfg(feature = "ros2")]
        Scan::Ros2(arguments) => ros2::scan(shell, language, arguments),
        #[cfg(not(feature = "ros2"))]
        Scan::Ros2(_) => without("ROS 2", "ros2"),
        #[cfg(feature = "ros1")]
        Scan::Ros1(arguments) => ros1::scan(shell, language, arguments),
        #[cfg(not(feature = "ros1"))]
        Scan::Ros1(_) => without("ROS 1", "ros1"),
        #[cfg(feature = "rosbridge")]
        Scan::Rosbridge(arguments) => rosbridge::scan(shell, language, arguments),
        #[cfg(not(feature = "rosbridge"))]
        Scan::Rosbridge(_) => without("rosbridge", "rosbridge"),
        #[cfg(feature = "mqtt")]
        Scan::Mqtt(arguments) => mqtt::scan(shell, language, arguments),
        #[cfg(not(feature = "mqtt"))]
        Scan::Mqtt(_) => without("MQTT", "mqtt"),
        #[cfg(feature = "simlog")]
        Scan::Simlog(arguments) => simlog::scan(shell, language, arguments),
        #[cfg(not(feature = "simlog"))]
        Scan::Simlog(_) => without("SimlogAPI", "simlog"),
        #[cfg(feature = "mavlink")]
        Scan::Mavlink(arguments) => mavlink::scan(shell, language, arguments),
        #[cfg(not(feature = "mavlink"))]
        Scan::Mavlink(_) => without("MAVLink", "mavlink"),
    }
}

/// Why a middleware cannot be looked at, and what to do.
#[cfg(not(all(
    feature = "mavlink",
    feature = "mqtt",
    feature = "ros1",
    feature = "ros2",
    feature = "rosbridge",
    feature = "simlog"
)))]
fn without(what: &str, feature: &str) -> anyhow::Result<ExitCode> {
    anyhow::bail!(
        "this sesamec was built without {what}; that of a release has it, and so has one that was installed without \
         `--no-default-features`, or with `--features {feature}`"
    )
}
