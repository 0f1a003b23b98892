//! `sesamec scan mqtt`: listens at a broker, writes a space, and checks what it wrote.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::bail;
use sesame_mqtt::scan::{Found, Options};
use sesame_notation::quoted;
use sesame_scan::{Conventions, System};

use super::arguments::Mqtt;
use super::common::{Definitions, print, refuse_wrong_address, secret, secret_line, tell};
use crate::cli::shell::Shell;
use crate::frontend::Language;
use crate::scan::by_payloads;

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
    refuse_wrong_address(language, System::Mqtt { url: url.clone() }, &settings)?;
    shell.doing("Listening", format!("to {} at {url} for {seconds} s", arguments.topics.join(", ")));
    let Found { mut facts, payloads } = sesame_mqtt::scan::scan(&Options {
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
    print(language, facts, types, &Definitions::none(), &settings, arguments.format)
}
