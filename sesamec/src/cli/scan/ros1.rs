//! `sesamec scan ros1`: asks a master and publishers, writes a space, and checks what it wrote.

use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use sesame_plan::Dialect;
use sesame_scan::System;

use super::arguments::Ros1;
use super::common::{print, tell};
use super::definitions::{Definitions, paths};
use crate::cli::shell::Shell;
use crate::frontend::Language;
use crate::scan::{Origin, Types, check_settings};

/// How long master and nodes may be asked.
const ASKING: Duration = Duration::from_secs(20);

/// Where a master is that nobody named.
const MASTER: &str = "http://localhost:11311";

/// `sesamec scan ros1`
pub(super) fn scan(shell: Shell, language: &Language, arguments: &Ros1) -> anyhow::Result<ExitCode> {
    let definitions = Definitions::new(&arguments.types, paths("ROS_PACKAGE_PATH"))?;
    let of_environment = || std::env::var("ROS_MASTER_URI").ok().filter(|uri| !uri.trim().is_empty());
    let master = arguments.master.clone().or_else(of_environment).unwrap_or_else(|| MASTER.to_owned());
    // Tools of ROS write it with a `/` at its end.
    let master = master.trim().trim_end_matches('/');
    check_settings(language, System::Ros1 { master: master.to_owned() }, &[]).map_err(|problem| anyhow!(problem))?;
    let seconds = arguments.seconds;
    shell.doing("Asking", format!("the master at {master} and its nodes, and counting messages for {seconds} s"));
    let found = sesame_ros1::scan::scan(master, ASKING, Duration::from_secs_f64(seconds)).context(
        "no master of ROS 1 can be asked; start one with `roscore`, or name the one that runs with `--master`",
    )?;
    let mut types = Types::of_topics(&found.facts, &definitions.files, definitions.folders(Dialect::Ros1));
    types.add_described(&found.layouts, &definitions.files, definitions.folders(Dialect::Ros1));
    tell(
        shell,
        &found.facts,
        "no node is registered at this master; is it the one that the nodes have in ROS_MASTER_URI?",
    );
    let services = definitions.services(&found.facts);
    let origin = Origin { folders: &definitions.written, services: &services, settings: &[] };
    print(language, found.facts, types, origin, arguments.format)
}
