//! `sesamec scan mavlink`: listens to vehicles, writes a space, and checks what it wrote.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::anyhow;
use sesame_mavlink::scan::ScanOptions;
use sesame_scan::System;

use super::arguments::Mavlink;
use super::common::{print, tell};
use crate::cli::shell::Shell;
use crate::frontend::Language;
use crate::scan::{Origin, Types, check_settings};

/// `sesamec scan mavlink`
pub(super) fn scan(shell: Shell, language: &Language, arguments: &Mavlink) -> anyhow::Result<ExitCode> {
    let Mavlink { url, types: definitions, seconds, format } = arguments;
    let system = System::Mavlink { url: url.clone(), definitions: definitions.clone() };
    check_settings(language, system, &[]).map_err(|problem| anyhow!(problem))?;
    shell.doing("Listening", format!("at {url} for {seconds} s"));
    let facts = sesame_mavlink::scan::scan(&ScanOptions {
        url: url.clone(),
        definitions: definitions.clone(),
        folder: PathBuf::new(),
        listening: Duration::from_secs_f64(*seconds),
    })?;
    tell(shell, &facts, "no vehicle sent anything there meanwhile; let them send to this address");
    let types = Types::of_found(&facts.types);
    let origin = Origin { folders: &[], services: &BTreeSet::new(), settings: &[] };
    print(language, facts, types, origin, *format)
}
