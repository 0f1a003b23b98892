//! What the tests across crates share: the real `sesamec`, projects for it to work on, and the runners that come out.
//!
//! Everything lies below the workspace's target folder: projects in folders of fixed names, since a path is part of
//! what cargo knows a crate by, and all runners in one target folder, so that the runtime is compiled once.

pub mod dds;
pub mod gap;
pub mod models;
pub mod optimisers;
mod port;
mod python;
pub mod python_mcap;
mod relaying;
pub mod rtamt;
pub mod selecting;

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::Value;

pub use port::{Port, from_own_place};
pub use relaying::relay_for_a_moment;

/// The root of the workspace.
pub fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the crate lies in the workspace")
}

/// The folder of everything these tests make. The test program lies in `target/PROFILE/deps`.
fn scratch() -> PathBuf {
    let program = std::env::current_exe().expect("a test has a program");
    let target = program.ancestors().nth(3).expect("cargo puts test programs three folders deep");
    target.join("across")
}

/// The target folder of everything that these tests compile. No project lies in it: cargo knows what lies in its target
/// folder by the path from there, and would look for changes of one project in another.
pub fn target() -> PathBuf {
    scratch().join("target")
}

/// The program `sesamec` of this workspace, with the transports that the rest of these tests has.
pub fn sesamec() -> PathBuf {
    program("tested-sesamec")
}

/// The stand-in for the lab of the gearbox cell.
pub fn kuka_cell_lab() -> PathBuf {
    program("tested-kuka_cell_lab")
}

/// The gearbox cell as a program that speaks SimlogAPI.
pub fn kuka_cell_simlog() -> PathBuf {
    program("tested-kuka_cell_simlog")
}

/// A program of this package. Cargo builds them before its tests, into the folder above theirs.
fn program(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("a test has a program");
    let folder = test.ancestors().nth(2).expect("cargo puts test programs two folders below its target folder");
    folder.join(name).with_extension(std::env::consts::EXE_EXTENSION)
}

/// The same, optimised, built if it is not up to date: for what is to be measured.
pub fn optimised_sesamec() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| built(&["--package", "sesamec", "--release"]))
}

/// The program that cargo builds when it is asked for this.
fn built(arguments: &[&str]) -> PathBuf {
    let output = Command::new(env!("CARGO"))
        .args(["build", "--quiet", "--message-format=json-render-diagnostics"])
        .args(arguments)
        .current_dir(workspace())
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout);
    let mark = "\"executable\":\"";
    let at = said.rfind(mark).expect("cargo names the program it built") + mark.len();
    let rest = &said[at..];
    PathBuf::from(&rest[..rest.find('"').expect("a name ends")])
}

/// A command with the surroundings of these tests: one target folder, no colours, nothing of the cargo around it.
pub fn command(program: impl AsRef<Path>) -> Command {
    let mut command = Command::new(program.as_ref());
    for (name, _) in std::env::vars_os() {
        let text = name.to_string_lossy();
        if text.starts_with("CARGO_PKG_") || text == "CARGO_MANIFEST_DIR" || text == "RUSTFLAGS" || text == "CARGO" {
            command.env_remove(name);
        }
    }
    command
        .env("CARGO_TARGET_DIR", target())
        // The root's test command has fetched what runners need: what the workspace's lock names.
        .env("CARGO_NET_OFFLINE", "true")
        .env("NO_COLOR", "1")
        .env("RUST_BACKTRACE", "0")
        .stdin(Stdio::null());
    prepare();
    command
}

/// The profile with which the suite compiles runners. The suite compiles the runtime several times, so it optimises
/// only crates in which that saves more time than it takes. The zeros overrule what a runner's manifest says of these
/// crates. Third-party crates are compiled as for the tests themselves, so that runners can use what is there.
const SETTINGS: &str = "\
[profile.dev]
opt-level = 0
debug-assertions = false
lto = \"off\"
overflow-checks = true

[profile.dev.package]
kuka_cell_sim = { opt-level = 2 }
libm = { opt-level = 1 }
serde_core = { opt-level = 1 }
serde_json = { opt-level = 1 }
sesame-analysis = { opt-level = 0 }
sesame-base = { opt-level = 1 }
sesame-lifecycle = { opt-level = 0 }
sesame-notation = { opt-level = 0 }
sesame-plan = { opt-level = 0 }
sesame-present = { opt-level = 0 }
sesame-record = { opt-level = 0 }
sesame-relay = { opt-level = 1 }
sesame-report = { opt-level = 0 }
sesame-rng = { opt-level = 1 }
sesame-runtime = { opt-level = 0 }
sesame-search = { opt-level = 1 }
sesame-stl = { opt-level = 1 }
sha2 = { opt-level = 1 }
zmij = { opt-level = 1 }
";

/// What cargo finds when a test first starts it, or starts a program that does: these settings, and what was compiled
/// for the tests.
fn prepare() {
    static PREPARED: OnceLock<()> = OnceLock::new();
    PREPARED.get_or_init(|| {
        write_settings();
        take_over();
    });
}

/// Writes the settings where cargo looks for them. The long suite measures runners as users build them.
fn write_settings() {
    let long = std::env::var("NEXTEST_PROFILE").as_deref() == Ok("long");
    let (wanted, folder) = (if long { "" } else { SETTINGS }, scratch().join(".cargo"));
    let file = folder.join("config.toml");
    if fs::read_to_string(&file).ok().as_deref() != Some(wanted) {
        fs::create_dir_all(&folder).expect("a folder can be made");
        // Other tests may read it meanwhile.
        let new = folder.join(format!("config.{}", std::process::id()));
        fs::write(&new, wanted).expect("settings can be written");
        fs::rename(&new, &file).expect("a file can be renamed");
    }
}

/// What a command did.
#[derive(Debug)]
pub struct Done {
    /// Its exit code; `None` when a signal ended it.
    pub code: Option<i32>,
    /// Its standard output.
    pub out: String,
    /// Its standard error.
    pub err: String,
}

impl Done {
    /// What came of a process.
    pub fn of(output: &Output) -> Done {
        Done {
            code: output.status.code(),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// What it said on standard output, which is JSON alone.
    #[track_caller]
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("not JSON alone ({error}): {}", self.out))
    }

    /// Insists on an exit code, and shows what was said otherwise.
    #[track_caller]
    pub fn expect(self, code: i32) -> Done {
        assert_eq!(self.code, Some(code), "standard output:\n{}\nstandard error:\n{}", self.out, self.err);
        self
    }

    /// Insists that a campaign of a system that runs freely succeeded. On a busy machine its last reference run may
    /// differ from the first one: nobody steps the robots, or not all of them have found the runner in time. Then the
    /// campaign has to report that.
    #[track_caller]
    pub fn ended_freely(self) -> Done {
        let differs = self.err.contains("the reference run after the campaign differs from the one before it");
        self.expect(if differs { 3 } else { 0 })
    }

    /// The digest that a run prints last.
    #[track_caller]
    pub fn digest(&self) -> String {
        let line = self.out.lines().find_map(|line| line.trim().strip_prefix("Digest "));
        let digest = line.unwrap_or_else(|| panic!("no digest in:\n{}\n{}", self.out, self.err));
        assert_eq!(digest.len(), 64, "{digest}");
        digest.to_owned()
    }
}

/// Runs a command to its end.
pub fn done(command: &mut Command) -> Done {
    Done::of(
        &command.output().unwrap_or_else(|error| panic!("{} does not start: {error}", command.get_program().display())),
    )
}

/// The reference run and both tests of a campaign that repeats a delay twice. Insists that all three were completed,
/// and that messages were late in both tests. `run` takes a subcommand and its arguments, for `sesamec` or a runner.
#[track_caller]
pub fn completed_with_delays(run: impl Fn(&str, &[&str]) -> Done) -> [Value; 3] {
    let read = |subcommand: &str, arguments: &[&str]| {
        run(subcommand, &[arguments, &["--format", "json"]].concat()).expect(0).json()
    };
    for test in ["T1", "T2"] {
        let shown = read("show", &[test]);
        let delayed = &shown["operations"][0]["counters"]["delayed"];
        assert!(delayed.as_u64().is_some_and(|count| count > 0), "nothing is late in {test}: {shown}");
    }
    let listed = read("list", &[]);
    let [reference, first, second, ..] = &listed["tests"].as_array().expect("tests are listed")[..] else {
        panic!("{listed}")
    };
    [reference, first, second].map(|test| {
        assert_eq!(test["outcome"], "completed", "{test}");
        test.clone()
    })
}

/// A folder with a space in it, and the runners that come of it.
#[derive(Debug, Clone)]
pub struct Project {
    /// The `.sesame` file.
    pub space: PathBuf,
    /// The folder of the runners.
    pub runners: PathBuf,
    /// A folder for results and the like.
    pub folder: PathBuf,
}

/// A fresh, empty folder of this name.
pub fn fresh_folder(name: &str) -> PathBuf {
    let folder = scratch().join("projects").join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("an old folder can be removed");
    }
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

impl Project {
    /// The example of the gearbox cell where it stands, with copies of its hooks, so that the checkout stays as it is.
    pub fn kuka_cell(name: &str) -> Project {
        let example = workspace().join("examples/kuka_cell");
        let folder = fresh_folder(name);
        let runners = folder.join("runners");
        copy(&example.join("runners/hooks"), &runners.join("hooks"));
        Project { space: example.join("kuka_cell.sesame"), runners, folder }
    }

    /// The example's cell with this written below its space, in a file of the project's own.
    pub fn kuka_cell_with(name: &str, more: &str) -> Project {
        let project = Project::kuka_cell(name);
        let text = fs::read_to_string(&project.space).expect("the example can be read");
        let simulator = format!("crate \"{}\"", workspace().join("examples/kuka_cell/simulator").display());
        let space = project.folder.join("kuka_cell.sesame");
        let text = text.replace("crate \"simulator\"", &simulator);
        fs::write(&space, format!("{text}\n{more}")).expect("a space can be written");
        Project { space, ..project }
    }

    /// A space of these words, with a simulator out of `tests/simulators`.
    pub fn new(name: &str, space: &str, simulator: &str) -> Project {
        let folder = fresh_folder(name);
        let path = folder.join(format!("{name}.sesame"));
        fs::write(&path, space).expect("a space can be written");
        copy(&workspace().join("tests/simulators").join(simulator).join("src"), &folder.join("simulator/src"));
        let manifest = format!(
            "[package]\nname = \"{simulator}_sim\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[dependencies]\n\
             sesame-runtime = {{ path = \"{}\" }}\n\n[workspace]\n",
            workspace().join("runtime").display()
        );
        fs::write(folder.join("simulator/Cargo.toml"), manifest).expect("a manifest can be written");
        Project { space: path, runners: folder.join("runners"), folder }
    }

    /// `sesamec SUBCOMMAND` on this space.
    pub fn sesamec(&self, subcommand: &str, arguments: &[&str]) -> Done {
        let mut sesamec = command(sesamec());
        sesamec.arg(subcommand).arg(&self.space).arg("-o").arg(&self.runners).args(arguments);
        done(sesamec.current_dir(&self.folder))
    }

    /// `sesamec run` of a campaign that has to be compiled.
    pub fn run(&self, campaign: &str, arguments: &[&str]) -> Done {
        // Cargo puts the program where another project's of the same name may be, and it is started from there.
        let _turn = turn();
        let runner = self.runners.join(campaign);
        if runner.join("src").exists() {
            renew(&runner);
        }
        self.sesamec("run", &[&["--campaign", campaign], arguments].concat())
    }

    /// Generates and builds the runner of a campaign, without running it.
    pub fn build(&self, campaign: &str) -> Runner {
        self.built(&turn(), campaign)
    }

    fn built(&self, turn: &Turn, campaign: &str) -> Runner {
        self.sesamec("generate", &["--campaign", campaign]).expect(0);
        let built = self.cargo(turn, campaign, "build");
        assert_eq!(built.code, Some(0), "{}", built.err);
        Runner { program: self.program(campaign), folder: self.folder.clone() }
    }

    /// Generates a monitor as a program, builds it, and insists that rustc has no warnings.
    pub fn monitor(&self, monitor: &str) -> PathBuf {
        let turn = turn();
        self.sesamec("generate", &["--eddi", monitor]).expect(0);
        let package = format!("{monitor}_monitor");
        let built = self.cargo(&turn, &package, "build").expect(0);
        assert!(!built.err.contains("warning"), "{}", built.err);
        self.program(&package)
    }

    /// Links a program that was just built into the project's own folder. `package` is the folder of its package.
    fn program(&self, package: &str) -> PathBuf {
        let manifest = fs::read_to_string(self.runners.join(package).join("Cargo.toml")).expect("there is a manifest");
        let name = manifest.lines().find_map(|line| line.strip_prefix("name = \"")).expect("a package has a name");
        let name = name.trim_end_matches('"');
        let program = self.folder.join(name);
        // In the target folder, another project of the same name overwrites the program, so it gets a second name here;
        // copies would fill the disk. Neither cargo nor a linker writes into a file that exists: each puts a new one in
        // its place.
        let _ = fs::remove_file(&program);
        fs::hard_link(target().join("debug").join(name), &program).expect("what was built can be linked");
        program
    }

    /// `cargo SUBCOMMAND` in one of the project's packages, which are its runners and monitors.
    pub fn cargo(&self, turn: &Turn, package: &str, subcommand: &str) -> Done {
        cargo(turn, &self.runners.join(package), &[subcommand, "--quiet"])
    }
}

/// Runs `cargo` in a package's folder, after marking its sources as new. What it builds may be overwritten by another
/// test as soon as the turn is over.
pub fn cargo(_: &Turn, package: &Path, arguments: &[&str]) -> Done {
    renew(package);
    done(command(env!("CARGO")).args(arguments).args(["--color", "never"]).current_dir(package))
}

/// Makes a package's sources newer than everything that was built before. Cargo cannot tell packages apart that have
/// the same name and lie in different projects: it would not build this one if the other was built after these sources
/// were written.
fn renew(package: &Path) {
    for entry in fs::read_dir(package.join("src")).expect("a package has sources") {
        let file = entry.expect("a folder can be listed").path();
        if file.is_file() {
            let file = File::options().append(true).open(file).expect("a source can be opened");
            file.set_modified(SystemTime::now()).expect("a file has a time");
        }
    }
}

/// The runner of a campaign in a fresh folder of this name, built once for all tests that ask for the same one: those
/// that give the same key. They must leave the project as it is. Each test gets the program under a path of its own, so
/// that it can tell its processes from those of other tests.
pub fn shared(name: &str, key: &str, campaign: &str, project: impl FnOnce(&str) -> Project) -> Runner {
    let home = scratch().join("shared").join(key);
    let (stamp, program) = (home.join("run"), home.join("program"));
    let folder = fresh_folder(name);
    let runner = Runner { program: folder.join("program"), folder };
    let turn = turn();
    if fs::read_to_string(&stamp).ok().as_deref() != Some(this_run()) {
        fs::create_dir_all(&home).expect("a folder can be made");
        let built = project(key).built(&turn, campaign);
        let _ = fs::remove_file(&program);
        fs::hard_link(&built.program, &program).expect("what was built can be linked");
        fs::write(&stamp, this_run()).expect("a stamp can be written");
    }
    fs::hard_link(&program, &runner.program).expect("what was built can be linked");
    runner
}

/// What tells this run of the tests from all others: nextest says it, and cargo runs all tests of a program in one
/// process.
pub fn this_run() -> &'static str {
    static RUN: OnceLock<String> = OnceLock::new();
    RUN.get_or_init(|| {
        std::env::var("NEXTEST_RUN_ID").unwrap_or_else(|_| {
            let began = SystemTime::now().duration_since(UNIX_EPOCH).expect("the clock is set");
            format!("{} {}", std::process::id(), began.as_nanos())
        })
    })
}

/// The turn to compile, which one test at a time has, in whatever process; it is over when this is dropped.
#[derive(Debug)]
#[must_use]
pub struct Turn {
    _locked: File,
}

/// Waits for the turn to compile.
pub fn turn() -> Turn {
    Turn { _locked: locked("build") }
}

/// Waits for a lock of this name, which one test at a time has until the file is dropped.
fn locked(name: &str) -> File {
    fs::create_dir_all(scratch()).expect("a folder can be made");
    let file = File::create(scratch().join(name).with_extension("lock")).expect("a lock can be made");
    file.lock().expect("the file system has locks");
    file
}

/// Begins an empty target folder with the libraries that cargo has compiled for these tests. Where a runner needs one
/// of them with the same features and settings, as it does most third-party crates, it is not compiled again.
fn take_over() {
    let (from, to) = (scratch().with_file_name("debug"), target().join("debug"));
    if !from.exists() || to.exists() {
        return;
    }
    // One test does it, and others wait until it is done.
    let _locked = locked("take_over");
    if !to.exists() {
        let new = target().with_extension("new");
        let _ = fs::remove_dir_all(&new);
        for folder in ["deps", "build", ".fingerprint"] {
            take_over_folder(&from.join(folder), &new.join(folder)).expect("what was built can be taken over");
        }
        fs::create_dir_all(target()).expect("a folder can be made");
        fs::rename(new, to).expect("a folder can be renamed");
    }
}

fn take_over_folder(from: &Path, to: &Path) -> std::io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let (old, new) = (entry.path(), to.join(entry.file_name()));
        if entry.file_type()?.is_dir() {
            take_over_folder(&old, &new)?;
        } else if old.extension().is_some_and(|kind| kind == "rlib" || kind == "rmeta" || kind == "so") {
            // Nothing writes into a library that exists: a new one takes its place.
            fs::hard_link(old, new)?;
        } else if from.file_name() != Some("deps".as_ref()) || old.extension().is_some_and(|kind| kind == "d") {
            // Cargo compares times. What else is in `deps` are the programs of tests.
            fs::copy(&old, &new)?;
            File::options().append(true).open(&new)?.set_modified(entry.metadata()?.modified()?)?;
        }
    }
    Ok(())
}

/// A built runner.
#[derive(Debug, Clone)]
pub struct Runner {
    /// Its program.
    pub program: PathBuf,
    /// Where results go, each run in a folder of its own.
    pub folder: PathBuf,
}

impl Runner {
    /// The runner, told this.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = command(&self.program);
        command.args(arguments).current_dir(&self.folder);
        command
    }

    /// Runs it to its end.
    pub fn run(&self, arguments: &[&str]) -> Done {
        done(&mut self.command(arguments))
    }
}

/// Copies a folder with all that is in it.
pub fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder can be made");
    for entry in fs::read_dir(from).unwrap_or_else(|error| panic!("cannot list {}: {error}", from.display())) {
        let entry = entry.expect("a folder can be listed");
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), &target).expect("a file can be copied");
        }
    }
}
