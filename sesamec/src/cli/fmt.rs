//! `sesamec fmt`

use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, anyhow, bail};
use sesame_codegen::{input, output};
use sesame_dsl::diagnostic::visible_lines;

use super::commands;
use super::shell::{self, Format, Shell};
use crate::frontend::Language;

/// Standard input, among files.
const STANDARD_INPUT: &str = "-";

/// Formats files, or shows what would change. A file with syntax errors is left as it is, and the others are formatted.
pub(super) fn fmt(
    shell: Shell,
    language: &Language,
    files: &[PathBuf],
    check: bool,
    format: Format,
) -> anyhow::Result<ExitCode> {
    let files = if files.is_empty() { spaces_in(Path::new("."))? } else { all_of(files)? };
    let mut unformatted = 0;
    let mut failures = Vec::new();
    for file in &files {
        let formatted = read(file).and_then(|text| {
            let formatted = (language.format)(&file.display().to_string(), &text, shell.look(format));
            let formatted = formatted.map_err(|found| {
                shell
                    .diagnostics(&found.diagnostics, format)
                    .err()
                    .unwrap_or_else(|| commands::has_errors(file, found.errors))
            })?;
            Ok((text, formatted))
        });
        match formatted {
            Ok((text, formatted)) if check => {
                if text != formatted {
                    unformatted += 1;
                    shell::asked_for(&visible_lines(&shown(file, &text, &formatted, format)))?;
                }
            }
            Ok((_, formatted)) if file.as_os_str() == STANDARD_INPUT => shell::asked_for(&formatted)?,
            Ok((text, formatted)) if text == formatted => {}
            Ok((_, formatted)) => match output::replace(file, &formatted) {
                Ok(()) => shell.did("Formatted", file.display()),
                Err(error) => failures.push(error.into()),
            },
            Err(failure) => failures.push(failure),
        }
    }
    if unformatted > 0 {
        let what = if unformatted == 1 { "1 file is".to_owned() } else { format!("{unformatted} files are") };
        failures.push(anyhow!("{what} not formatted; run `{} fmt`", shell::command()));
    }
    match failures.pop() {
        None => Ok(ExitCode::SUCCESS),
        Some(last) => {
            for failure in &failures {
                shell.failure(failure);
            }
            Err(last)
        }
    }
}

fn read(file: &Path) -> anyhow::Result<String> {
    if file.as_os_str() == STANDARD_INPUT {
        let mut text = String::new();
        let mut bounded = std::io::stdin().take(input::MOST_OF_A_TEXT + 1);
        bounded.read_to_string(&mut text).context("cannot read standard input")?;
        if text.len() as u64 > input::MOST_OF_A_TEXT {
            bail!("standard input has more than {} MiB, which is the limit", input::MOST_OF_A_TEXT >> 20);
        }
        return Ok(text);
    }
    input::text(file).with_context(|| format!("cannot read {}", file.display()))
}

/// Files as they are, and for each folder the spaces in it.
fn all_of(files: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut all = Vec::new();
    for file in files {
        if file.is_dir() {
            all.extend(spaces_in(file)?);
        } else {
            all.push(file.clone());
        }
    }
    Ok(all)
}

/// The `.sesame` files in a folder, sorted; without links.
fn spaces_in(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let failed = || format!("cannot look into {}", folder.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(failed)? {
        let entry = entry.with_context(failed)?;
        let path = entry.path();
        // Links are left alone: nobody named the file that they lead to, which may lie elsewhere.
        if entry.file_type().with_context(failed)?.is_file()
            && path.extension().is_some_and(|extension| extension == "sesame")
        {
            files.push(path.strip_prefix(".").map(Path::to_owned).unwrap_or(path));
        }
    }
    if files.is_empty() {
        bail!("no .sesame file in {}", folder.display());
    }
    files.sort();
    Ok(files)
}

/// What is to be said of a file that is not formatted: in a line, or with what would change.
fn shown(file: &Path, text: &str, formatted: &str, format: Format) -> String {
    let (name, line) = (file.display().to_string(), 1 + first_difference(text, formatted));
    match format {
        Format::Human => format!("{name}\n{}", output::text_diff(text, formatted)),
        Format::Short => format!("{name}:{line}:1: not formatted\n"),
        Format::Json => serde_json::json!({ "file": name, "line": line, "title": "not formatted" }).to_string() + "\n",
        Format::Github => {
            let escaped = [("%", "%25"), ("\r", "%0D"), ("\n", "%0A"), (":", "%3A"), (",", "%2C")];
            let name = escaped.into_iter().fold(name, |name, (sign, escape)| name.replace(sign, escape));
            format!("::error file={name},line={line}::not formatted\n")
        }
    }
}

/// How many lines two texts have in common at their beginning.
fn first_difference(text: &str, formatted: &str) -> usize {
    let same = |(one, other): &(&str, &str)| one == other;
    text.split('\n').zip(formatted.split('\n')).take_while(same).count()
}
