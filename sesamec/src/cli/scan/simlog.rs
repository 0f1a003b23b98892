//! `sesamec scan simlog`: listens to topics of a simulator, writes a space, and checks what it wrote.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{anyhow, bail};
use sesame_codegen::input;
use sesame_notation::quoted;
use sesame_plan::{SimlogVersion, WireNames};
use sesame_scan::System;
use sesame_simlog::client::ClientOptions;
use sesame_simlog::scan::{Found, MOST_TOPICS, Wanted};

use super::arguments::Simlog;
use super::common::{print, tell};
use crate::cli::shell::Shell;
use crate::frontend::Language;
use crate::scan::{Origin, by_payloads, check_settings};

/// The variable with the token that is sent with each call, if there is one.
const TOKEN: &str = "SESAME_SIMLOG_TOKEN";

/// The most bytes of a file with certificates.
const MOST_CERTIFICATES: u64 = 1 << 20;

/// `sesamec scan simlog`
pub(super) fn scan(shell: Shell, language: &Language, arguments: &Simlog) -> anyhow::Result<ExitCode> {
    let topics = topics(arguments)?;
    let (version, mut names) = match arguments.protocol {
        3 => (SimlogVersion::V3, WireNames::of_version_3()),
        _ => (SimlogVersion::V2, WireNames::default()),
    };
    let mut settings = Vec::new();
    settings.extend(arguments.topics_at.as_ref().map(|url| format!("topics at {}", quoted(url))));
    settings.extend(arguments.trust.as_ref().map(|file| format!("trust {}", quoted(file))));
    for (word, text, name) in [
        ("prefix", &arguments.prefix, &mut names.prefix),
        ("cut", &arguments.cut, &mut names.cut),
        ("heard", &arguments.heard, &mut names.heard),
    ] {
        if let Some(text) = text {
            name.clone_from(text);
            settings.push(format!("{word} {}", quoted(text)));
        }
    }
    let (url, seconds) = (&arguments.url, arguments.seconds);
    let (steps, step_ms) = (arguments.steps.unwrap_or(0), arguments.step);
    let system = System::Simlog { url: url.clone(), protocol: arguments.protocol, step_ms, steps };
    check_settings(language, system, &settings).map_err(|problem| anyhow!(problem))?;
    let ca = arguments.trust.as_ref().map(|file| certificates(file)).transpose()?;
    let token = std::env::var(TOKEN).ok().filter(|token| !token.is_empty());
    let options =
        ClientOptions { topics_url: arguments.topics_at.clone(), ca, token, ..ClientOptions::new(url, version) };
    let listening = Duration::from_secs_f64(seconds);
    shell.doing(
        "Listening",
        match steps {
            0 => format!("to {} topics of {url} for {seconds} s, without a step", topics.len()),
            steps => format!("to {} topics of {url} for {steps} steps of {step_ms} ms", topics.len()),
        },
    );
    let wanted = Wanted { topics, names, steps, step_ms, listening };
    let Found { mut facts, payloads, conventions } = sesame_simlog::scan::scan(&options, &wanted)?;
    let types = by_payloads(&mut facts, &payloads, conventions);
    tell(shell, &facts, "nothing was looked at");
    let origin = Origin { folders: &[], services: &BTreeSet::new(), settings: &settings };
    print(language, facts, types, origin, arguments.format)
}

/// The topics that are named, each once.
fn topics(arguments: &Simlog) -> anyhow::Result<Vec<String>> {
    let mut named = arguments.topics.clone();
    if let Some(file) = &arguments.topics_from {
        let text =
            input::text(file).map_err(|why| anyhow!("the topics in {} cannot be read: {why}", file.display()))?;
        named.extend(text.lines().map(|line| line.trim().to_owned()));
    }
    let mut topics: Vec<String> = Vec::new();
    for topic in named.into_iter().filter(|topic| !topic.trim().is_empty()) {
        if !topics.contains(&topic) {
            topics.push(topic);
        }
    }
    if topics.is_empty() {
        bail!(
            "no topic is named, and the protocol lists none; name each with `--topic NAME`, such as `--topic \
             joints/R1/Link0/position`, or a file that has one per line with `--topics-from FILE`"
        );
    }
    if topics.len() > MOST_TOPICS {
        bail!("{} topics are named; name at most {MOST_TOPICS} for one scan", topics.len());
    }
    Ok(topics)
}

fn certificates(file: &str) -> anyhow::Result<Vec<u8>> {
    input::bytes(Path::new(file), MOST_CERTIFICATES)
        .map_err(|why| anyhow!("the trusted certificates in `{file}` cannot be read: {why}"))
}
