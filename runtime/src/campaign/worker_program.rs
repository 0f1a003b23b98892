//! The program that a supervisor starts as its worker: its own, which is called again, a compiled runner, or a Python
//! that imports the hooks.

use std::io::{self, Write as _};
#[cfg(target_os = "linux")]
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;
#[cfg(target_os = "linux")]
use std::sync::Arc;

#[cfg(target_os = "linux")]
use crate::campaign::fork_server::ForkServer;
#[cfg(feature = "process")]
use crate::campaign::python::Examined;

/// A program as it becomes a worker.
#[derive(Debug, Clone)]
pub struct WorkerProgram {
    executable: PathBuf,
    kind: Kind,
    /// What a worker has to know of the runner, as JSON; `None` if it contains that.
    runner: Option<String>,
    /// The lab in which it runs tests, instead of the simulator.
    lab: Option<String>,
    /// Whether it may be asked for traces, also if the campaign records none.
    records: bool,
    /// How many of the topics that operations can act on pass through the relay; `None` for all.
    relayed: Option<u32>,
    /// What forks it, in place of starting the program.
    #[cfg(target_os = "linux")]
    forks: Option<Arc<ForkServer>>,
}

/// What a program is.
#[derive(Debug, Clone)]
enum Kind {
    /// That of this process.
    Own,
    /// A compiled runner.
    #[cfg(feature = "agents")]
    Compiled,
    /// One that imports hooks in Python.
    #[cfg(feature = "process")]
    Python(Box<Examined>),
}

impl WorkerProgram {
    /// A compiled runner contains all that its workers have to know.
    pub fn compiled() -> io::Result<Self> {
        Ok(WorkerProgram {
            executable: std::env::current_exe()?,
            kind: Kind::Own,
            runner: None,
            lab: None,
            records: false,
            relayed: None,
            #[cfg(target_os = "linux")]
            forks: ForkServer::of_this_process(),
        })
    }

    /// A program that interprets a runner reads it from a file. If the runner has hooks in Python, they are imported
    /// once now, and the error says what is wrong with them.
    #[cfg(feature = "process")]
    pub fn interpreted(runner: &crate::interpreted::Interpreted) -> io::Result<Self> {
        let program = WorkerProgram::sending(runner)?;
        if runner.hooks.is_none() {
            return Ok(program);
        }
        let examined = crate::campaign::python::examine(runner)?;
        let executable =
            if examined.python.as_os_str().is_empty() { program.executable } else { examined.python.clone() };
        Ok(WorkerProgram { executable, kind: Kind::Python(Box::new(examined)), ..program })
    }

    /// The program of this process, as a worker that is sent this runner.
    #[cfg(feature = "process")]
    fn sending(runner: &crate::interpreted::Interpreted) -> io::Result<Self> {
        let text = serde_json::to_string(runner)?;
        Ok(WorkerProgram { runner: Some(text), ..WorkerProgram::compiled()? })
    }

    /// The hooks in Python that its workers import.
    #[cfg(feature = "process")]
    pub(crate) fn python(&self) -> Option<&Examined> {
        match &self.kind {
            Kind::Python(examined) => Some(examined),
            _ => None,
        }
    }

    /// A compiled runner, as a program of its own, with this plan and these folders in place of those that it was
    /// compiled with.
    #[cfg(feature = "agents")]
    pub(crate) fn compiled_at(executable: &Path, runner: &crate::interpreted::Interpreted) -> io::Result<Self> {
        let executable = executable.canonicalize()?;
        Ok(WorkerProgram { executable, kind: Kind::Compiled, ..WorkerProgram::sending(runner)? })
    }

    /// The compiled runner that it is, if that is not the program of this process.
    #[cfg(feature = "agents")]
    pub(crate) fn of_another_process(&self) -> Option<&Path> {
        matches!(self.kind, Kind::Compiled).then_some(self.executable.as_path())
    }

    /// The runner as other machines can run it; `None` if only its program knows it, and for one in a lab or with a
    /// part of the relay.
    #[cfg(feature = "agents")]
    pub(crate) fn sent(&self) -> Option<crate::interpreted::Interpreted> {
        let text = self.runner.as_ref().filter(|_| self.lab.is_none() && self.relayed.is_none())?;
        serde_json::from_str(text).ok()
    }

    /// The same program as a worker that runs tests in this lab.
    #[cfg(feature = "process")]
    pub(crate) fn in_lab(self, name: &str) -> Self {
        WorkerProgram { lab: Some(name.to_owned()), ..self }
    }

    /// The same program as a worker that may be asked for traces: it reads messages whole, not only what metrics and
    /// operations need.
    pub(crate) fn recording(self, records: bool) -> Self {
        WorkerProgram { records, ..self }
    }

    /// The same program as a worker in which only the first so many of the topics that operations can act on pass
    /// through the relay.
    pub(crate) fn relaying(self, first: u32) -> Self {
        WorkerProgram { relayed: Some(first), ..self }
    }

    /// The command that starts a worker with this folder of its own.
    pub(super) fn command(&self, directory: &Path) -> io::Result<Command> {
        let mut command = match &self.kind {
            Kind::Own => self.this_program(),
            #[cfg(feature = "agents")]
            Kind::Compiled => Command::new(&self.executable),
            #[cfg(feature = "process")]
            // Only the arguments of a fork count.
            Kind::Python(_) if self.is_forked() => Command::new(&self.executable),
            #[cfg(feature = "process")]
            Kind::Python(_) => crate::campaign::python::command(&self.executable),
        };
        command.arg("worker");
        // A worker of Python is not a keeper of its simulator's program.
        #[cfg(all(feature = "process", target_os = "linux"))]
        if self.is_forked() || matches!(self.kind, Kind::Python(_)) {
            command.arg("--keeper").arg(format!("/proc/{}/exe", std::process::id()));
        }
        if let Some(text) = &self.runner {
            let file = directory.join("runner.json");
            // A file of an earlier worker goes, and nothing is written through a link.
            match std::fs::remove_file(&file) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => std::fs::File::create_new(&file)?.write_all(text.as_bytes())?,
            }
            command.arg("--runner").arg(file.canonicalize()?);
        }
        if let Some(lab) = &self.lab {
            command.arg("--lab").arg(lab);
        }
        if self.records {
            command.arg("--record");
        }
        if let Some(relayed) = self.relayed {
            command.arg("--relay").arg(relayed.to_string());
        }
        Ok(command)
    }

    /// The running program, even if another version has been installed in its place since.
    #[cfg(target_os = "linux")]
    fn this_program(&self) -> Command {
        let mut command = Command::new("/proc/self/exe");
        command.arg0(&self.executable);
        command
    }

    #[cfg(not(target_os = "linux"))]
    fn this_program(&self) -> Command {
        Command::new(&self.executable)
    }

    #[cfg(feature = "process")]
    fn is_forked(&self) -> bool {
        #[cfg(target_os = "linux")]
        return self.forks.is_some();
        #[cfg(not(target_os = "linux"))]
        false
    }

    /// What forks workers, if they are not started as programs.
    #[cfg(target_os = "linux")]
    pub(super) fn forks(&self) -> Option<&Arc<ForkServer>> {
        self.forks.as_ref()
    }

    /// The program, as messages name it.
    pub(super) fn executable(&self) -> &Path {
        &self.executable
    }
}
