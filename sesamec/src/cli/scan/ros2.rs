//! `sesamec scan ros2`: listens, looks types up, writes a space, and checks what it wrote.

use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context as _;
use sesame_plan::Dialect;
use sesame_ros2::scan::Scanner;

use super::arguments::Ros2;
use super::common::{print, tell};
use super::definitions::{Definitions, paths};
use crate::cli::shell::Shell;
use crate::frontend::Language;
use crate::scan::{Origin, Types};

/// How long nodes have to describe types.
const DESCRIBING: Duration = Duration::from_secs(5);

/// `sesamec scan ros2`
pub(super) fn scan(shell: Shell, language: &Language, arguments: &Ros2) -> anyhow::Result<ExitCode> {
    let definitions =
        Definitions::new(&arguments.types, paths("AMENT_PREFIX_PATH").map(|prefix| prefix.join("share")))?;
    let (domain, seconds) = (domain(arguments.domain)?, arguments.seconds);
    let mut scanner = Scanner::join(domain, arguments.network)?;
    let reach = if arguments.network { "the network" } else { "this machine" };
    shell.doing("Listening", format!("to domain {domain} on {reach} for {seconds} s"));
    scanner.listen(Duration::from_secs_f64(seconds))?;
    let facts = scanner.facts();
    let mut types = Types::of_topics(&facts, &definitions.files, definitions.folders(Dialect::Ros2));
    let missing = types.missing();
    if !missing.is_empty() {
        let asked = if missing.len() == 1 { "a type".to_owned() } else { format!("{} types", missing.len()) };
        shell.doing("Asking", format!("nodes for the layout of {asked} that no folder has"));
        let described = scanner.describe(&facts, &missing, DESCRIBING)?;
        types.add_described(&described, &definitions.files, definitions.folders(Dialect::Ros2));
    }
    drop(scanner);
    let network = if arguments.network {
        ""
    } else {
        ", and only `--network` hears nodes on other machines, or of Cyclone DDS on a network interface"
    };
    let nothing = format!("nothing runs in domain {domain}; the domain of a node is its ROS_DOMAIN_ID{network}");
    tell(shell, &facts, &nothing);
    let services = definitions.services(&facts);
    let origin = Origin { folders: &definitions.written, services: &services, settings: &[] };
    print(language, facts, types, origin, arguments.format)
}

/// The domain that is named, or that of the environment.
fn domain(named: Option<u16>) -> anyhow::Result<u16> {
    let of_environment = || match std::env::var("ROS_DOMAIN_ID") {
        Ok(text) if !text.trim().is_empty() => {
            let domain = text.trim().parse().ok().filter(|domain| *domain <= 232);
            domain
                .with_context(|| format!("ROS_DOMAIN_ID is `{}`; expected a number from 0 to 232", text.escape_debug()))
        }
        _ => Ok(0),
    };
    named.map_or_else(of_environment, Ok)
}
