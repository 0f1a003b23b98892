//! Agents, supervisors and a broker that tests start, kill and start again.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use sesame_patience::until;
use sesame_peers::Ended;
use sesame_record::Repository;
use sesame_tests::{Done, Port, command, copy, done, fresh_folder, sesamec, workspace};
use tempfile::TempDir;

/// How many tests the campaign has.
pub(crate) const TESTS: usize = 30;

/// A space, with a token and folders of caches of its own.
pub(crate) struct Cell {
    pub(crate) folder: PathBuf,
}

impl Cell {
    /// The example with two robots in Python, with fewer tests.
    pub(crate) fn new(name: &str) -> Self {
        let folder = fresh_folder(name);
        copy(&workspace().join("examples/two_robots"), &folder.join("space"));
        fs::remove_dir_all(folder.join("space/runners")).ok();
        Cell { folder }
    }

    /// A command of sesamec for this user.
    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut sesamec = command(sesamec());
        sesamec.env("XDG_CONFIG_HOME", self.folder.join("settings")).env("XDG_CACHE_HOME", self.folder.join("caches"));
        sesamec.args(arguments).current_dir(&self.folder);
        sesamec
    }

    /// Runs the campaign, with these arguments for the runner, into this folder of results.
    pub(crate) fn run(&self, results: &str, on: Option<&str>) -> Command {
        let mut command = self.command(&["run", "space/two_robots.sesame", "--campaign", "crossing"]);
        if let Some(on) = on {
            command.args(["--on", on]);
        }
        let evaluations = TESTS.to_string();
        command.args(["--", "--seed", "5", "--evaluations", &evaluations, "--results", results]);
        command
    }

    /// Goes on with a run that was killed.
    pub(crate) fn resume(&self, results: &str, on: &str) -> Command {
        let run = format!("{results}/5");
        self.command(&["resume", "space/two_robots.sesame", &run, "--campaign", "crossing", "--on", on])
    }

    /// The digest of a run on this machine alone.
    pub(crate) fn local_digest(&self) -> String {
        done(&mut self.run("local", None)).expect(0).digest()
    }

    /// Replaces a part of the simulator.
    pub(crate) fn change_simulator(&self, part: &str, by: &str) {
        let simulator = self.folder.join("space/sim.py");
        let text = fs::read_to_string(&simulator).expect("the example has a simulator");
        assert!(text.contains(part), "{text}");
        fs::write(&simulator, text.replace(part, by)).expect("a simulator can be written");
    }

    /// Writes something at the end of the space.
    pub(crate) fn add_to_space(&self, text: &str) {
        let space = self.folder.join("space/two_robots.sesame");
        let before = fs::read_to_string(&space).expect("the example has a space");
        fs::write(&space, format!("{before}\n{text}")).expect("a space can be written");
    }

    /// An agent of this name.
    pub(crate) fn agent(&self, on: &str, machine: &str) -> Ended {
        self.agent_with(on, machine, &[])
    }

    /// The same with these variables in its environment.
    pub(crate) fn agent_with(&self, on: &str, machine: &str, variables: &[(&str, &str)]) -> Ended {
        let log = fs::File::options().create(true).append(true).open(self.folder.join(format!("{machine}.log")));
        let agent = self
            .command(&["agent", on, "--machine", machine, "--workers", "1"])
            .envs(variables.iter().copied())
            .stdout(Stdio::null())
            .stderr(log.expect("a log can be written"))
            .spawn();
        Ended(agent.expect("an agent starts"))
    }

    /// Waits until so many tests of a run are recorded.
    pub(crate) fn await_tests(&self, results: &str, count: usize) {
        let run = self.folder.join(results).join("5");
        let recorded =
            || Repository::open(&run).ok().and_then(|results| results.numbers().ok()).map_or(0, |all| all.len());
        until(format!("{count} tests are recorded in {}", run.display()), || recorded() >= count);
    }

    /// The results of a run.
    pub(crate) fn results(&self, results: &str) -> Repository {
        Repository::open(&self.folder.join(results).join("5")).expect("a run has results")
    }
}

/// The file of a token in a folder, written with the first call.
pub(crate) fn token_in(folder: &Path) -> String {
    let file = folder.join("token");
    if !file.exists() {
        fs::write(&file, format!("{}\n", "0123456789abcdef".repeat(4))).expect("a token can be written");
    }
    file.display().to_string()
}

/// A run that goes on until it ends, is killed, or this is dropped.
pub(crate) struct Run(Option<Child>);

/// Starts a run.
pub(crate) fn started(command: &mut Command) -> Run {
    Run(Some(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("sesamec starts")))
}

/// Starts a run that writes what it says into a file.
pub(crate) fn started_with_log(command: &mut Command, log: &Path) -> Run {
    let log = fs::File::create(log).expect("a log can be written");
    Run(Some(command.stdout(Stdio::piped()).stderr(log).spawn().expect("sesamec starts")))
}

/// How a run that was started has ended.
pub(crate) fn finished(mut run: Run) -> Done {
    let run = run.0.take().expect("it is there until it is dropped");
    Done::of(&run.wait_with_output().expect("a run ends"))
}

impl Run {
    /// Kills it, as a machine that loses its power does.
    pub(crate) fn kill(self) {
        drop(self);
    }

    /// Whether it has ended by itself.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.0.as_mut().is_none_or(|run| run.try_wait().expect("a run can be asked").is_some())
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        if let Some(mut run) = self.0.take() {
            // It may have ended by itself.
            run.kill().ok();
            run.wait().ok();
        }
    }
}

/// A broker with streams in a folder of its own.
pub(crate) struct Broker {
    program: PathBuf,
    folder: TempDir,
    port: Port,
    /// Arguments in addition to those that each has.
    more: Vec<String>,
    process: Option<Ended>,
}

impl Broker {
    /// Starts one; `None` where there is no program.
    pub(crate) fn start() -> Option<Self> {
        Broker::start_with(Vec::new())
    }

    /// The same with further arguments.
    pub(crate) fn start_with(more: Vec<String>) -> Option<Self> {
        let program = sesame_peers::named("SESAME_NATS")?.with_file_name("nats-server");
        let folder = tempfile::tempdir().expect("a folder can be made");
        let mut broker = Broker { program, folder, port: Port::free(), more, process: None };
        broker.start_again();
        Some(broker)
    }

    /// Kills it, as a machine that loses its power does.
    pub(crate) fn kill(&mut self) {
        self.process = None;
    }

    /// Starts it on what it kept.
    pub(crate) fn start_again(&mut self) {
        let port = self.port.number();
        let child = command(&self.program)
            .args(["--jetstream", "--addr", "127.0.0.1", "--port", &port.to_string(), "--store_dir"])
            .arg(self.folder.path())
            .args(&self.more)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        self.process = Some(Ended(child.expect("nats-server starts")));
        until("the broker listens", || std::net::TcpStream::connect(("127.0.0.1", port)).is_ok());
    }

    /// The port at which it listens.
    pub(crate) fn port(&self) -> u16 {
        self.port.number()
    }

    /// Where it listens.
    pub(crate) fn url(&self) -> String {
        format!("nats://127.0.0.1:{}", self.port.number())
    }
}
