//! `sesamec scan mqtt`: listens at a broker, writes a space, and checks what it wrote.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{anyhow, bail};
use sesame_mqtt::scan::{Found, ScanOptions};
use sesame_notation::quoted;
use sesame_scan::{Conventions, System};

use super::arguments::Mqtt;
use super::common::{print, tell};
use super::secrets::{secret, secret_line};
use crate::cli::shell::Shell;
use crate::frontend::Language;
use crate::scan::{Origin, by_payloads, check_settings};

/// `sesamec scan mqtt`
pub(super) fn scan(shell: Shell, language: &Language, arguments: &Mqtt) -> anyhow::Result<ExitCode> {
    if arguments.topics.iter().any(String::is_empty) {
        bail!("`--topics` is empty; `#` stands for all topics, `uagv/v2/#` for those below `uagv/v2`");
    }
    let password = secret(arguments.password_env.as_ref(), arguments.password_file.as_ref());
    let mut settings = Vec::new();
    settings.extend(arguments.user.as_ref().map(|user| format!("user {}", quoted(user))));
    settings.extend(password.as_ref().map(|password| secret_line("password", password)));
    settings.extend(arguments.trust.as_ref().map(|file| format!("trust {}", quoted(file))));
    let (url, seconds) = (&arguments.url, arguments.seconds);
    check_settings(language, System::Mqtt { url: url.clone() }, &settings).map_err(|problem| anyhow!(problem))?;
    shell.doing("Listening", format!("to {} at {url} for {seconds} s", arguments.topics.join(", ")));
    let Found { mut facts, payloads } = sesame_mqtt::scan::scan(&ScanOptions {
        url: url.clone(),
        filters: arguments.topics.clone(),
        listening: Duration::from_secs_f64(seconds),
        user: arguments.user.clone(),
        password,
        trust: arguments.trust.clone(),
        folder: PathBuf::new(),
    })?;
    let types = by_payloads(&mut facts, &payloads, Conventions::Json);
    tell(shell, &facts, "nothing was published meanwhile, and nothing is retained; listen longer with `--seconds`");
    let origin = Origin { folders: &[], services: &BTreeSet::new(), settings: &settings };
    print(language, facts, types, origin, arguments.format)
}
