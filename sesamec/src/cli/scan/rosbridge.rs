//! `sesamec scan rosbridge`: asks rosapi, listens, writes a space, and checks what it wrote.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context as _, anyhow, bail};
use sesame_dsl::interfaces::full_name;
use sesame_notation::quoted;
use sesame_plan::Dialect;
use sesame_rosbridge::scan::{ScanOptions, Scanner, Wanted};
use sesame_scan::System;

use super::arguments::{RosDialect, Rosbridge};
use super::common::{print, tell};
use super::definitions::{Definitions, paths};
use super::secrets::{secret, secret_line};
use crate::cli::shell::Shell;
use crate::frontend::Language;
use crate::scan::{Origin, Types, check_settings, types_by_payloads};

/// `sesamec scan rosbridge`
pub(super) fn scan(shell: Shell, language: &Language, arguments: &Rosbridge) -> anyhow::Result<ExitCode> {
    let definitions =
        Definitions::new(&arguments.types, paths("AMENT_PREFIX_PATH").map(|prefix| prefix.join("share")))?;
    let wanted = arguments.topics.iter().map(|topic| wanted(topic)).collect::<anyhow::Result<Vec<_>>>()?;
    let token = secret(arguments.token_env.as_ref(), arguments.token_file.as_ref());
    let mut settings = Vec::new();
    settings.extend(token.as_ref().map(|token| secret_line("token", token)));
    settings.extend(arguments.trust.as_ref().map(|file| format!("trust {}", quoted(file))));
    let dialect = arguments.dialect.map(|dialect| match dialect {
        RosDialect::Ros1 => Dialect::Ros1,
        RosDialect::Ros2 => Dialect::Ros2,
    });
    let (url, seconds) = (&arguments.url, arguments.seconds);
    let system = System::Rosbridge { url: url.clone(), dialect: dialect.unwrap_or_default(), rosapi: false };
    check_settings(language, system, &settings).map_err(|problem| anyhow!(problem))?;
    let options = ScanOptions { url: url.clone(), token, trust: arguments.trust.clone(), folder: PathBuf::new() };
    let mut scanner =
        Scanner::connect(&options, dialect).context("there is no bridge to look at; start it, or name another one")?;
    shell.doing("Asking", format!("the bridge at {url} who is there"));
    if !scanner.ask(dialect)? && wanted.is_empty() {
        bail!(
            "the bridge at {url} does not have the services of rosapi, which list the system; start `rosapi_node` \
             beside it, or name topics to listen to with `--topic NAME:TYPE`, such as `--topic \
             /aim:std_msgs/msg/Float64`"
        );
    }
    scanner.add(&wanted);
    let mut types =
        Types::of_topics(scanner.facts(), &definitions.files, definitions.folders(scanner.facts().system.dialect()));
    let missing = types.missing();
    if !missing.is_empty() {
        let described = scanner.describe(&missing)?;
        types.add_described(&described, &definitions.files, definitions.folders(scanner.facts().system.dialect()));
    }
    shell.doing("Listening", format!("to {} topics for {seconds} s", scanner.facts().topics.len()));
    scanner.listen(Duration::from_secs_f64(seconds))?;
    let (facts, payloads) = scanner.finish();
    types_by_payloads(&mut types, &facts, &payloads);
    tell(shell, &facts, "nothing is behind this bridge; is it in the domain, or at the master, of the nodes?");
    let services = definitions.services(&facts);
    let origin = Origin { folders: &definitions.written, services: &services, settings: &settings };
    print(language, facts, types, origin, arguments.format)
}

/// A topic that is named, with its type or without.
fn wanted(written: &str) -> anyhow::Result<Wanted> {
    let (path, ty) = match written.split_once(':') {
        Some((path, ty)) => (path, Some(ty)),
        None => (written, None),
    };
    let shown = written.escape_debug();
    // Which ROS it is turns out later; ROS 1 allows all names that ROS 2 does.
    let ty = match ty.map(|ty| full_name(ty, "msg", Dialect::Ros1)) {
        Some(None) => {
            bail!("`{shown}` names no type of ROS; write `--topic NAME:TYPE` with one like `std_msgs/msg/Float64`")
        }
        Some(ty) => ty,
        None => None,
    };
    if path.trim_matches('/').is_empty() {
        bail!("`{shown}` names no topic; write `--topic NAME:TYPE`, such as `--topic /aim:std_msgs/msg/Float64`");
    }
    Ok(Wanted { path: format!("/{}", path.trim_start_matches('/')), ty })
}
