//! What the command says on the terminal: one line for each stage, the verb at the right edge of its column.

use std::fmt::Display;
use std::io::{self, IsTerminal as _, Write as _};
use std::path::Path;

use sesame_dsl::diagnostic::{shortened, visible_lines};
use sesame_runtime::cli::Caller;

use crate::frontend::Look;

/// How diagnostics are shown, as the command line names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Format {
    /// With the lines of the source.
    Human,
    /// One line each: `file:line:column: error[E0203]: …`.
    Short,
    /// One JSON object and line each.
    Json,
    /// Annotations for GitHub's workflows.
    Github,
}

/// Where messages go: standard error, so that standard output is free for what is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Shell {
    colour: bool,
    terminal: bool,
    silent: bool,
}

impl Shell {
    /// The shell of this process: colours only on a terminal, and not when `NO_COLOR` is set.
    pub fn of_the_process() -> Self {
        let terminal = io::stderr().is_terminal();
        let colour = terminal && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
        Shell { colour, terminal, silent: false }
    }

    /// A shell without colours and without lines that change.
    pub fn plain() -> Self {
        Shell { colour: false, terminal: false, silent: false }
    }

    /// A shell that says nothing on standard error: the exit code tells all.
    pub fn silent() -> Self {
        Shell { silent: true, ..Shell::plain() }
    }

    /// Whether messages are coloured.
    pub fn colour(self) -> bool {
        self.colour
    }

    /// Something was done.
    pub(super) fn did(self, verb: &str, what: impl Display) {
        self.say("1;32", &format!("{verb:>10}"), what);
    }

    /// Whether a line of [`doing`](Self::doing) is replaced by the next one, as only a terminal can.
    pub(super) fn rewrites(self) -> bool {
        self.terminal
    }

    /// Something is being done. On a terminal the next line replaces this one; elsewhere it stays.
    pub(super) fn doing(self, verb: &str, what: impl Display) {
        if !self.terminal {
            return self.say("1;36", &format!("{verb:>10}"), what);
        }
        let what = what.to_string();
        let text = format!("\r\x1b[K{} {}", self.painted("1;36", &format!("{verb:>10}")), visible_lines(&what));
        // A closed terminal must not end the program.
        let _ = io::stderr().write_all(text.as_bytes());
    }

    /// Something the user should know.
    pub(super) fn warning(self, what: impl Display) {
        self.say("1;33", "warning:", what);
    }

    /// Something that is good to know and needs nothing done.
    pub(super) fn note(self, what: impl Display) {
        self.say("1;36", "note:", what);
    }

    /// What went wrong, with its causes.
    pub(super) fn failure(self, failure: &anyhow::Error) {
        for error in format!("{failure:#}").split('\u{1e}') {
            self.say("1;31", "error:", error);
        }
    }

    /// How diagnostics are to look.
    pub(super) fn look(self, format: Format) -> Look {
        match format {
            Format::Human => Look::Human { colour: self.colour },
            Format::Short => Look::Short,
            Format::Json => Look::Json,
            Format::Github => Look::Github,
        }
    }

    /// Diagnostics: those for programs on standard output.
    pub(super) fn diagnostics(self, text: &str, format: Format) -> anyhow::Result<()> {
        match format {
            _ if text.is_empty() => {}
            Format::Human | Format::Short => self.text(text),
            Format::Json | Format::Github => asked_for(text)?,
        }
        Ok(())
    }

    /// A line that begins with a painted word. What is said may quote anything, so no sign of it reaches a terminal as
    /// a command, and no line of it fills the screen.
    fn say(self, style: &str, word: &str, what: impl Display) {
        let text: Vec<String> = what.to_string().split('\n').map(|line| shortened(line.to_owned())).collect();
        self.line(&format!("{} {}", self.painted(style, word), visible_lines(&text.join("\n"))));
    }

    /// Text as it is: of this program, or of one that cleans what it quotes.
    pub(super) fn text(self, text: &str) {
        self.line(text.trim_end());
    }

    fn line(self, text: &str) {
        if self.silent {
            return;
        }
        let clear = if self.terminal { "\r\x1b[K" } else { "" };
        let _ = writeln!(io::stderr(), "{clear}{text}");
    }

    fn painted(self, style: &str, text: &str) -> String {
        if self.colour { format!("\x1b[{style}m{text}\x1b[0m") } else { text.to_owned() }
    }
}

/// What was asked for, on standard output. A reader that has seen enough, such as `head`, is not a failure; a full disk
/// is.
pub(super) fn asked_for(text: &str) -> anyhow::Result<()> {
    let mut output = io::stdout().lock();
    match output.write_all(text.as_bytes()).and_then(|()| output.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(anyhow::Error::new(error).context("cannot write to standard output"))
        }
        _ => Ok(()),
    }
}

/// A command on a file, for hints that can be copied.
pub(super) fn command_for(name: &str, file: &Path) -> String {
    Caller { program: command().to_owned(), arguments: vec![file.display().to_string()] }.command(name, &[])
}

/// How the user called this command, for hints that can be copied.
pub(super) fn command() -> &'static str {
    let by_cargo = std::env::var_os("CARGO").is_some()
        && std::env::var_os("CARGO_PKG_NAME").is_some_and(|name| name == env!("CARGO_PKG_NAME"));
    // Cargo puts a program into a folder that is called after its profile.
    let is_release =
        || std::env::current_exe().is_ok_and(|program| program.parent().is_some_and(|it| it.ends_with("release")));
    if !by_cargo {
        "sesamec"
    } else if is_release() {
        "cargo run --release --"
    } else {
        "cargo run --"
    }
}
