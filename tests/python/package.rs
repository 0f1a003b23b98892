//! The package as its users have it, and programs that use it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use sesame_base::observation::Outcome;
use sesame_record::{Repository, TestRecord};
use sesame_tests::{Done, command, copy, done, fresh_folder, sesamec, workspace};

/// A folder with the package, a space, and programs in Python.
pub(crate) struct Place {
    pub(crate) folder: PathBuf,
}

/// A cart between two walls, as a class.
pub(crate) const CART: &str = r#"
import sesamec

POSITION, COMMAND, CLEARANCE = "cart/position", "cart/command", "cart/clearance"


class World:
    publishes = [POSITION, COMMAND, CLEARANCE]
    subscribes = [POSITION, COMMAND]

    def __init__(self, setup):
        self.position, self.speed, self.heading, self.commanded = 5.0, 0.0, 1.0, 0.0

    def step(self, bus):
        bus.publish(POSITION, self.position)
        bus.publish(CLEARANCE, 10.0 - self.position)
        for topic, value, _ in bus.messages():
            if topic == COMMAND:
                self.commanded = value
            elif topic == POSITION:
                self.heading = 1.0 if value < 1.0 else -1.0 if value > 9.0 else self.heading
                bus.publish(COMMAND, 2.0 * self.heading)
        self.speed += (self.commanded - self.speed) * bus.step / 0.2
        self.position = min(max(self.position + self.speed * bus.step, 0.0), 10.0)


if __name__ == "__main__":
    sesamec.serve(World)
"#;

impl Place {
    /// The space of a new project, with this class as its simulator.
    pub(crate) fn new(name: &str, simulator: &str) -> Option<Self> {
        if !sesame_peers::has_python3() {
            return None;
        }
        let folder = fresh_folder(name);
        copy(&workspace().join("python/sesamec"), &folder.join("sesamec"));
        let test = std::env::current_exe().expect("a test has a program");
        let module = test.with_file_name("lib_native.so");
        fs::copy(module, folder.join("sesamec/_native.abi3.so")).expect("cargo builds the module before its tests");
        done(command(sesamec()).args(["new", "--python", "cart"]).current_dir(&folder)).expect(0);
        let place = Place { folder };
        place.write("cart/sim.py", simulator);
        Some(place)
    }

    pub(crate) fn write(&self, file: &str, text: &str) {
        fs::write(self.folder.join(file), text).expect("a file can be written");
    }

    /// Replaces a part of the space.
    pub(crate) fn change_space(&self, part: &str, by: &str) {
        let space = self.folder.join("cart/cart.sesame");
        let text = fs::read_to_string(&space).expect("a project has a space");
        assert!(text.contains(part), "{text}");
        fs::write(&space, text.replace(part, by)).expect("a space can be written");
    }

    /// A program in Python that can import the package and the simulator.
    pub(crate) fn python(&self, program: &str) -> Command {
        self.script("python3", program)
    }

    /// A program for this Python.
    pub(crate) fn script(&self, python: impl AsRef<Path>, program: &str) -> Command {
        self.write("program.py", program);
        let mut python = self.with_package(python);
        python.arg("program.py");
        python
    }

    /// A Python, such as that of the peers, that can import the package and the simulator.
    pub(crate) fn with_package(&self, python: impl AsRef<Path>) -> Command {
        let mut python = command(python);
        python.current_dir(&self.folder).env("SESAMEC", sesamec());
        python.env(
            "PYTHONPATH",
            std::env::join_paths([self.folder.clone(), self.folder.join("cart")]).expect("no colon"),
        );
        python
    }

    /// Runs the campaign with the class in this process; arguments for `sesamec.run` follow.
    pub(crate) fn run(&self, before: &str, arguments: &str) -> Done {
        let program = format!(
            "{before}\nimport sesamec\nfrom sim import World\n\
             print('Digest', sesamec.run('cart/cart.sesame', simulator=World, {arguments}).digest)\n"
        );
        done(&mut self.python(&program))
    }

    /// What broke off tests of the first run in this folder of results.
    pub(crate) fn broken_off(&self, results: &str) -> Vec<Outcome> {
        let results = Repository::open(&self.folder.join(results).join("1")).expect("a run has results");
        let last = results.numbers().expect("they can be read").last().copied().expect("it has tests");
        let records = results.records(0..=last, false).expect("they can be read");
        records
            .into_iter()
            .map(|record| record.observation.outcome)
            .filter(|it| matches!(it, Outcome::Crash { .. } | Outcome::Timeout { .. }))
            .collect()
    }

    /// Runs it with the class as a program.
    pub(crate) fn run_as_program(&self, arguments: &[&str]) -> Done {
        let mut run = command(sesamec());
        run.args(["run", "cart/cart.sesame", "--"]).args(arguments).current_dir(&self.folder);
        done(run.env("PYTHONPATH", &self.folder))
    }

    /// `sesamec` in the folder of the space, where Python can import the package.
    pub(crate) fn sesamec(&self, arguments: &[&str]) -> Command {
        let mut run = command(sesamec());
        run.args(arguments).current_dir(self.folder.join("cart")).env("PYTHONPATH", &self.folder);
        run
    }

    /// Runs the campaign of a space without a program of Python around it.
    pub(crate) fn command_on(&self, space: &str, arguments: &[&str]) -> Done {
        let mut run = self.sesamec(&["run", space, "--"]);
        done(run.args(arguments))
    }
}

/// What a run recorded.
pub(crate) struct Results {
    /// The causes of crashes and timeouts.
    pub(crate) crashes: Vec<String>,
    pub(crate) repository: Repository,
    pub(crate) records: Vec<TestRecord>,
}

/// What the run in this folder recorded.
pub(crate) fn results(place: &Place, folder: &str) -> Results {
    let repository = Repository::open(&place.folder.join(folder)).expect("there are results");
    let last = repository.numbers().expect("it can be read").last().copied().expect("there is a test");
    let records = repository.records(0..=last, false).expect("they can be read");
    let message = |record: &TestRecord| record.observation.outcome.message().map(str::to_owned);
    Results { crashes: records.iter().filter_map(message).collect(), repository, records }
}
