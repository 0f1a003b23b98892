//! Campaigns on a simulator in addition to which programs are launched, by a runner with real workers: this program is
//! the runner, and starts itself as its worker and keeper, so it has no test harness.

#![cfg_attr(
    unix,
    expect(
        clippy::disallowed_methods,
        clippy::disallowed_types,
        clippy::unwrap_used,
        reason = "a test of a runner and its processes"
    )
)]

#[cfg(unix)]
mod runner {
    use std::borrow::Cow;
    use std::path::{Path, PathBuf};
    use std::process::{Command, ExitCode, Output};
    use std::{env, fs};

    use sesame_runtime::plan::testing::{operation, plan};
    use sesame_runtime::plan::{
        CampaignPlan, Count, Launch, OperationKind, Ready, ReadyWhen, Search, Strategy, Transport,
    };
    use sesame_runtime::record::{EventKind, Repository, latest_folder};
    use sesame_runtime::{Runner, transport};

    /// Where a runner finds its plan.
    const FOLDER: &str = "SESAME_TEST_FOLDER";

    /// The tests by name.
    const TESTS: [(&str, fn()); 2] = [
        ("a_launch_that_fails_is_tried_again_twice_and_then_recorded_as_such", failed_launches),
        ("a_test_that_keeps_crashing_its_simulator_is_quarantined_and_named", quarantine),
    ];

    pub(super) fn main() -> ExitCode {
        if let Some(folder) = env::var_os(FOLDER).map(PathBuf::from) {
            return sesame_runtime::main(Runner {
                plan: Cow::Owned(fs::read_to_string(folder.join("plan.json")).unwrap()),
                directory: folder.clone(),
                space: folder.clone(),
                hooks: &[],
                operations: &[],
                connect: transport::process(folder),
            });
        }
        let words: Vec<String> = env::args().skip(1).collect();
        if words.iter().any(|word| word == "--list") {
            for (name, _) in TESTS.iter().filter(|_| !words.iter().any(|word| word == "--ignored")) {
                println!("{name}: test");
            }
            return ExitCode::SUCCESS;
        }
        if !sesame_peers::has_python3() {
            return ExitCode::SUCCESS;
        }
        let named = |name: &str| words.iter().all(|word| word.starts_with('-') || name.contains(word.as_str()));
        for (name, test) in TESTS.iter().filter(|(name, _)| named(name)) {
            println!("test {name}");
            test();
        }
        ExitCode::SUCCESS
    }

    /// A simulator that is started for each test, and counts.
    const SIMULATOR: &str = r#"
import json, os, sys
def say(what): print(json.dumps(what), flush=True)
TOPICS = ["arm/command", "zones/Z1", "zones/Z2"]
for line in sys.stdin:
    order = json.loads(line)
    if "reset" in order: say({"ready": {"publishes": TOPICS, "subscribes": TOPICS}})
    else:
        say({"publish": [{"topic": "arm/command", "value": order["step"]["time"]}]})
        delivered = json.loads(sys.stdin.readline())["deliver"]
        DISTURBED
        say({"done": {}})
"#;

    /// A random campaign of so many tests with a blackhole, on a simulator that does this when it is disturbed.
    fn campaign(tests: u32, disturbed: &str) -> (tempfile::TempDir, CampaignPlan) {
        let folder = tempfile::tempdir().unwrap();
        let program = SIMULATOR.replace("DISTURBED", disturbed);
        fs::write(folder.path().join("sim.py"), program).unwrap();
        let mut plan = plan(vec![operation(0, OperationKind::Blackhole)]);
        plan.campaign.search = Search::new(Strategy::Random, tests);
        plan.campaign.count = Count { min: 1, max: 1 };
        plan.simulator.transport = Transport::Process {
            program: "python3".to_owned(),
            arguments: vec!["sim.py".to_owned()],
            step_ns: Some(100_000_000),
        };
        (folder, plan)
    }

    /// A program in Python that is launched, and ready at its line `up`.
    fn launch(program: &str) -> Launch {
        let arguments = ["-u", "-c", program].map(str::to_owned).to_vec();
        let command = sesame_runtime::plan::Command { program: "python3".to_owned(), arguments };
        Launch { command, ready: Some(Ready { when: ReadyWhen::Line { text: "up".to_owned() }, within: 60.0 }) }
    }

    fn run(folder: &Path, plan: &CampaignPlan, arguments: &[&str]) -> (Output, Repository) {
        fs::write(folder.join("plan.json"), serde_json::to_string(plan).unwrap()).unwrap();
        let mut command = Command::new(env::current_exe().unwrap());
        let output = command.args(arguments).env(FOLDER, folder).output().unwrap();
        let latest = latest_folder(&folder.join("results")).unwrap();
        let Some(latest) = latest else { panic!("{}", String::from_utf8_lossy(&output.stderr)) };
        (output, Repository::open(&latest).unwrap())
    }

    fn quarantine() {
        let disturbed = "if not delivered:\n            \
                         open('runs', 'a').write('x')\n            \
                         sys.exit('the arm is broken')";
        let (folder, plan) = campaign(1, disturbed);
        let (output, repository) = run(folder.path(), &plan, &["run", "--workers", "1"]);
        let outcomes: Vec<&str> = repository.tests().unwrap().iter().map(|row| row.outcome.word()).collect();
        assert_eq!(outcomes, ["completed", "crash", "completed"], "{}", String::from_utf8_lossy(&output.stderr));
        // Two of ten fresh runs are enough, with any number of workers; and none more the next time.
        for workers in ["4", "1"] {
            let confirm = ["confirm", "T1", "-n", "10", "--workers", workers];
            let (output, repository) = run(folder.path(), &plan, &confirm);
            let said = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
            assert_eq!(repository.repetitions().unwrap().get(&1).map(Vec::len), Some(2), "{said}");
            let summary = sesame_runtime::report::summary(&repository).unwrap();
            assert_eq!(summary.quarantined.len(), 1, "{said}");
            assert!(summary.quarantined[0].detail.contains("the arm is broken"), "{said}");
            let page = sesame_runtime::report::page(&repository).unwrap();
            assert!(page.contains("Quarantined: crashed in three runs, and not run again"));
        }
        assert_eq!(fs::read_to_string(folder.path().join("runs")).unwrap().len(), 3);
    }

    fn failed_launches() {
        let (folder, mut plan) = campaign(3, "pass");
        // The reference run is tried twice; T1 three times, in vain.
        plan.simulator.lifecycle.launch = Some(launch(
            "import os, time\n\
             file = open('tries', 'a')\n\
             file.write('x'); file.flush()\n\
             if os.path.getsize('tries') in (1, 3, 4, 5): raise SystemExit('the port is taken')\n\
             print('up'); time.sleep(1000)",
        ));
        let (output, repository) = run(folder.path(), &plan, &["run", "--workers", "1"]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
        let outcomes: Vec<&str> = repository.tests().unwrap().iter().map(|row| row.outcome.word()).collect();
        assert_eq!(outcomes, ["completed", "launch_failed", "completed", "completed", "completed"], "{said}");
        let cause = repository.test(1).unwrap().observation.outcome.detail().unwrap();
        assert!(cause.contains("ended (exit status: 1) while a line with `up` was awaited"), "{cause}");
        assert!(cause.ends_with("the last lines that it wrote:\nthe port is taken"), "{cause}");
        let notes = repository.events().unwrap();
        let again = |test: u32| {
            let of = |event: &&sesame_runtime::record::Event| {
                event.test == Some(test) && event.kind == EventKind::Session && event.text.contains("was run again")
            };
            notes.iter().filter(of).count()
        };
        assert_eq!([again(0), again(1), again(2)], [1, 2, 0], "{notes:?}");
        assert!(said.contains("1 failed launch"), "{said}");
        assert_eq!(fs::read_to_string(folder.path().join("tries")).unwrap().len(), 8);
    }
}

#[cfg(unix)]
fn main() -> std::process::ExitCode {
    runner::main()
}

#[cfg(not(unix))]
fn main() {}
