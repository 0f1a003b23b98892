//! Preparatory testing by a runner with real workers, on a simulator and a lab that run freely: this program is the
//! runner, and starts itself as its worker and keeper, so it has no test harness.

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
    use std::process::{Command, ExitCode};
    use std::time::Duration;
    use std::{env, fs};

    use serde_json::Value as Json;

    use sesame_runtime::metric::{Context, Hook, HookEntry};
    use sesame_runtime::plan::testing::{known_test, lab, operation, plan, requirement, test_of, use_of};
    use sesame_runtime::plan::{
        Bound, CampaignPlan, Count, Expectation, KnownTest, Lab, LabTolerance, MetricId, MetricSource, OperationKind,
        RelayBudget, Search, Simulator, Strategy, TopicId, Transport,
    };
    use sesame_runtime::record::Repository;
    use sesame_runtime::value::Value;
    use sesame_runtime::{Runner, transport};

    /// Where a runner finds its plan.
    const FOLDER: &str = "SESAME_TEST_FOLDER";

    /// The tests by name.
    const TESTS: [(&str, fn()); 8] = [
        ("a_scenario_that_is_the_same_in_the_lab_passes_and_one_that_is_not_fails", null_on_both_sides),
        ("a_requirement_that_is_violated_without_disturbance_fails_on_either_side", violated_without_disturbance),
        ("a_peer_that_adds_20_ms_exceeds_a_budget_of_5_ms_and_no_campaign_runs_then", slow_relay),
        ("a_relay_within_its_budget_passes_and_each_stage_relays_one_topic_more", fast_relay),
        ("a_stepped_simulator_is_not_judged_by_latency", stepped),
        ("regression_tests_are_compared_with_the_lab", known_on_both_sides),
        ("a_preparation_stops_at_the_first_step_that_fails_unless_it_keeps_going", preparation),
        ("what_is_complete_is_not_run_again_when_a_command_goes_on", going_on),
    ];

    /// A metric whose hook takes 20 ms for each message, as a slow peer in the way of the messages does.
    struct Slow;

    impl Hook for Slow {
        fn on_start(&mut self, _: &mut Context) {}
        fn on_message(&mut self, _: usize, _: &Value, ctx: &mut Context) {
            std::thread::sleep(Duration::from_millis(20));
            ctx.add(1.0);
        }
        fn on_end(&mut self, _: &mut Context) {}
    }

    pub(super) fn main() -> ExitCode {
        if let Some(folder) = env::var_os(FOLDER).map(PathBuf::from) {
            return sesame_runtime::main(Runner {
                plan: Cow::Owned(fs::read_to_string(folder.join("plan.json")).unwrap()),
                directory: folder.clone(),
                space: folder.clone(),
                hooks: &[HookEntry { metric: "slow", build: |_| Box::new(Slow) }],
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

    /// Publishes 40 commands in 4 s of its own time, from its argument on, and says how many it has received: as the
    /// level of a zone. It steps if it is asked for steps.
    const SIMULATOR: &str = r#"
import json, sys
def say(what): print(json.dumps(what), flush=True)
first = float(sys.argv[1])
open("starts-" + sys.argv[1], "a").write("x")
TOPICS = ["arm/command", "zones/Z1", "zones/Z2"]
def hear(): return len(json.loads(sys.stdin.readline())["deliver"])
for line in sys.stdin:
    order = json.loads(line)
    if "reset" in order:
        stepped = order["reset"].get("step") is not None
        at = 0
        say({"ready": {"publishes": TOPICS, "subscribes": ["arm/command"], "resets": True, **({} if stepped else {"clock": True})}})
        if not stepped:
            for at in range(40):
                say({"time": at / 10})
                say({"publish": [{"topic": "arm/command", "value": first + at / 10}]})
            say({"done": {"ended": True}})
    elif "step" in order:
        say({"publish": [{"topic": "arm/command", "value": first + at / 10}]})
        hear()
        at += 1
        say({"done": {"ended": at == 40}})
"#;

    /// The simulator with commands from this number on, that nobody steps.
    fn simulator(first: &str) -> Transport {
        let arguments = vec!["sim.py".to_owned(), first.to_owned()];
        Transport::Process { program: "python3".to_owned(), arguments, step_ns: None }
    }

    /// A lab whose commands begin with this number, and that tolerates a difference of 0.5 in the last command.
    fn hall(first: &str) -> Lab {
        Lab {
            simulator: Some(Simulator::new("hall", simulator(first))),
            tolerances: vec![LabTolerance { metric: MetricId(1), value: 0.5 }],
            ..lab("hall")
        }
    }

    /// A space of which a blackhole acts on the commands. R1 requires the last of them to be at most 5; it is 3.9.
    fn space(labs: Vec<Lab>) -> (tempfile::TempDir, CampaignPlan) {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("sim.py"), SIMULATOR).unwrap();
        let mut plan = plan(vec![operation(0, OperationKind::Blackhole)]);
        plan.campaign.search = Search::new(Strategy::Random, 2);
        plan.campaign.count = Count { min: 1, max: 1 };
        plan.simulator.transport = simulator("0");
        plan.requirements = vec![requirement("R1", 1, Bound::AtMost { value: 5.0 })];
        plan.labs = labs;
        (folder, plan)
    }

    struct Said {
        code: Option<i32>,
        out: String,
        err: String,
    }

    impl Said {
        fn expect(self, code: i32) -> Self {
            assert_eq!(self.code, Some(code), "{}\n{}", self.err, self.out);
            self
        }

        fn json(&self) -> Json {
            serde_json::from_str(&self.out).unwrap()
        }
    }

    fn run(folder: &Path, plan: &CampaignPlan, arguments: &[&str]) -> Said {
        fs::write(folder.join("plan.json"), serde_json::to_string(plan).unwrap()).unwrap();
        let mut command = Command::new(env::current_exe().unwrap());
        let output = command.args(arguments).env(FOLDER, folder).current_dir(folder).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Said { code: output.status.code(), out: text(&output.stdout), err: text(&output.stderr) }
    }

    fn null_on_both_sides() {
        let (folder, plan) = space(vec![hall("0.25")]);
        let said = run(folder.path(), &plan, &["null", "--format", "json"]).expect(0).json();
        assert_eq!(
            (&said["passed"], &said["null"]["lab"], &said["null"]["runs"]),
            (&true.into(), &"hall".into(), &3.into())
        );
        let metric = &said["null"]["metrics"][1];
        assert_eq!(metric["simulation"]["mean"], 3.9);
        assert_eq!((&metric["simulation"]["runs"], &metric["lab"]["runs"]), (&3.into(), &3.into()));
        assert!((metric["difference"].as_f64().unwrap() - 0.25).abs() < 1e-9, "{metric}");
        assert_eq!((&metric["tolerance"], &metric["beyond"]), (&0.5.into(), &false.into()));
        assert_eq!(said["null"]["requirements"][0]["lab"]["satisfied"], 3);
        // Each side is a run like any other, of as many runs as were asked for.
        let lab = Repository::open(&folder.path().join("results/null/lab")).unwrap();
        assert_eq!(lab.numbers().unwrap(), [0, 1, 2]);
        assert_eq!(lab.task().lab(), Some("hall"));
        let page = fs::read_to_string(folder.path().join("results/null/report.html")).unwrap();
        assert!(
            page.contains("Everything is as required.") && page.contains("Without disturbance, lab hall"),
            "{page}"
        );
        assert!(page.contains("last_command in the course of the runs"), "the series are drawn");

        let (folder, plan) = space(vec![hall("0.75")]);
        let said = run(folder.path(), &plan, &["null", "--runs", "2"]).expect(3);
        let why = "`last_command` differs by 0.75 between the simulation and lab `hall`; the lab tolerates 0.5";
        assert!(said.err.contains(&format!("not as required: {why}")), "{}", said.err);
        assert!(said.out.contains("null failed"), "{}", said.out);
        let page = fs::read_to_string(folder.path().join("results/null/report.html")).unwrap();
        assert!(page.contains("1 thing is not as required.") && page.contains("the lab tolerates 0.5"));
        // Without a tolerance it is shown, and fails nothing.
        let (folder, mut plan) = space(vec![hall("0.75")]);
        plan.labs[0].tolerances.clear();
        let said = run(folder.path(), &plan, &["null", "--runs", "1", "--format", "json"]).expect(0).json();
        let difference = said["null"]["metrics"][1]["difference"].as_f64().unwrap();
        assert!((difference - 0.75).abs() < 1e-9, "{difference}");
    }

    fn violated_without_disturbance() {
        let (folder, plan) = space(vec![hall("2")]);
        let said = run(folder.path(), &plan, &["null", "--runs", "2"]).expect(3).err;
        assert!(said.contains("not as required: R1 is violated in 2 of 2 runs in lab `hall`"), "{said}");
        assert!(!said.contains("in the simulation"), "{said}");
        let (folder, mut plan) = space(Vec::new());
        plan.requirements[0].bound = Bound::AtMost { value: 1.0 };
        let said = run(folder.path(), &plan, &["null", "--runs", "1"]).expect(3).err;
        assert!(
            said.contains("the space has no lab that a runner reaches, so there are runs in simulation only"),
            "{said}"
        );
        assert!(said.contains("not as required: R1 is violated in 1 of 1 run in the simulation"), "{said}");
        let said = run(folder.path(), &plan, &["null", "--lab", "attic"]).expect(1).err;
        assert!(said.contains("the space has no lab"), "{said}");
        // What cannot be run at all has failed.
        fs::write(folder.path().join("sim.py"), "raise SystemExit('the arm is broken')").unwrap();
        let said = run(folder.path(), &plan, &["null", "--runs", "1"]).expect(1).err;
        assert!(said.contains("the arm is broken"), "{said}");
    }

    fn slow_relay() {
        let (folder, mut plan) = space(Vec::new());
        plan.campaign.search = Search::new(Strategy::Random, 1);
        plan.simulator.lifecycle.relay_budget = Some(RelayBudget { latency: Some(0.005), jitter: None });
        let mut slow = plan.metrics[1].clone();
        "slow".clone_into(&mut slow.name);
        slow.source = MetricSource::Hook { topics: vec![TopicId(0)] };
        plan.metrics.push(slow);
        // Nothing was measured yet, so nothing is refused.
        run(folder.path(), &plan, &["run"]).expect(0);
        let said = run(folder.path(), &plan, &["mitm", "--format", "json"]).expect(3);
        let why = "with 1 topic relayed, the relay added ";
        assert!(said.err.contains(why) && said.err.contains("`command`; the budget is 5 ms latency"), "{}", said.err);
        let said = said.json();
        let added = &said["mitm"]["stages"][1]["added"][0];
        assert_eq!((&added["topic"], &added["messages"]), (&"command".into(), &120.into()));
        for percentile in ["p50", "p99", "max"] {
            assert!(added[percentile].as_f64().unwrap() > 0.019, "{added}");
        }
        assert_eq!((&said["mitm"]["over_budget"], &said["passed"]), (&true.into(), &false.into()));
        assert_eq!(said["mitm"]["stages"][0]["added"], Json::Array(Vec::new()), "nothing is relayed");

        let said = run(folder.path(), &plan, &["run"]).expect(1).err;
        assert!(
            said.contains("the latest `mitm` of this plan, results/mitm, exceeded the relay budget: with 1 topic"),
            "{said}"
        );
        assert!(said.contains("run --over-budget"), "{said}");
        let runs = || fs::read_dir(folder.path().join("results")).unwrap().count();
        let before = runs();
        run(folder.path(), &plan, &["run"]).expect(1);
        assert_eq!(runs(), before, "nothing was begun");
        run(folder.path(), &plan, &["run", "--over-budget"]).expect(0);
        // Another budget is another plan, of which nothing was measured.
        plan.simulator.lifecycle.relay_budget = Some(RelayBudget { latency: Some(60.0), jitter: None });
        run(folder.path(), &plan, &["run", "--workers", "3"]).expect(0);
    }

    fn fast_relay() {
        let (folder, mut plan) = space(Vec::new());
        plan.operations.push(operation(1, OperationKind::Freeze));
        plan.simulator.lifecycle.relay_budget = Some(RelayBudget { latency: Some(60.0), jitter: Some(60.0) });
        let said = run(folder.path(), &plan, &["mitm", "--runs", "2", "--format", "json"]).expect(0).json();
        let stages = said["mitm"]["stages"].as_array().unwrap();
        let topics: Vec<&Json> = stages.iter().map(|stage| &stage["topic"]).collect();
        assert_eq!(topics, [&Json::Null, &"command".into(), &"zones".into()]);
        assert_eq!(stages[2]["added"].as_array().unwrap().len(), 2);
        assert_eq!((&stages[2]["added"][0]["messages"], &stages[2]["added"][1]["messages"]), (&80.into(), &0.into()));
        assert_eq!(stages[2]["added"][0]["p99"], Json::Null, "too few messages to tell");
        assert_eq!((&stages[1]["deterministic"], &stages[1]["metrics"][1]["drift"]), (&true.into(), &0.0.into()));
        assert_eq!(said["mitm"]["lock_stepped"], false);
        let page = fs::read_to_string(folder.path().join("results/mitm/report.html")).unwrap();
        assert!(page.contains("Topics through the relay") && page.contains("2 relayed"));
        let (folder, mut plan) = space(Vec::new());
        plan.operations.clear();
        plan.campaign.operations.clear();
        let said = run(folder.path(), &plan, &["mitm"]).expect(1).err;
        assert!(said.contains("no operation of campaign `campaign` acts on a topic, so nothing is relayed"), "{said}");
    }

    fn stepped() {
        let (folder, mut plan) = space(Vec::new());
        let Transport::Process { step_ns, .. } = &mut plan.simulator.transport else { unreachable!() };
        *step_ns = Some(100_000_000);
        plan.simulator.lifecycle.relay_budget = Some(RelayBudget { latency: Some(1e-9), jitter: None });
        let said = run(folder.path(), &plan, &["mitm", "--runs", "2"]).expect(0);
        assert!(said.out.contains("its time stands still while the relay works"), "{}", said.out);
        assert!(said.out.contains("mitm passed") && said.out.contains("equal"), "{}", said.out);
        run(folder.path(), &plan, &["run", "--workers", "1"]).expect(0);
    }

    /// A regression test that cuts the commands off at 2 s, and expects the last one to be about this.
    fn cut(last: f64) -> KnownTest {
        let bound = Bound::Within { low: last - 0.1, high: last + 0.1 };
        let test = test_of(vec![use_of(0, 2.0, 9.0, Vec::new(), 1)]);
        KnownTest { expectations: vec![Expectation { metric: MetricId(1), bound }], ..known_test("cut", test) }
    }

    fn known_on_both_sides() {
        let (folder, mut plan) = space(vec![hall("0.05")]);
        plan.tests = vec![cut(3.9)];
        let said = run(folder.path(), &plan, &["known", "--lab", "hall", "--format", "json"]).expect(0).json();
        let test = &said["known"]["tests"][0];
        let expectation = &test["expectations"][0];
        assert_eq!((&expectation["simulation"], &expectation["lab"]), (&"satisfied".into(), &"satisfied".into()));
        assert_eq!(test["requirements"][0]["lab"]["satisfied"], 1);
        assert!((test["metrics"][1]["difference"].as_f64().unwrap() - 0.05).abs() < 1e-9, "{test}");
        assert!(folder.path().join("results/known-hall/report.html").exists());

        plan.labs = vec![hall("2")];
        let said = run(folder.path(), &plan, &["known", "--lab", "hall"]).expect(3).err;
        assert!(
            said.contains("not as required: the expectation of `cut` about last_command is violated in lab `hall`"),
            "{said}"
        );
        assert!(
            said.contains("not as required: R1 in `cut` is satisfied in simulation and violated in lab `hall`"),
            "{said}"
        );
        // As before, without a lab.
        run(folder.path(), &plan, &["known"]).expect(0);
        assert!(folder.path().join("results/known/report.html").exists());
    }

    fn preparation() {
        let (folder, mut plan) = space(vec![hall("0.05")]);
        plan.tests = vec![cut(3.9)];
        let said = run(folder.path(), &plan, &["prepare", "--runs", "2"]).expect(0).out;
        for step in ["null passed", "mitm passed", "known passed", "results/prepare/report.html"] {
            assert!(said.contains(step), "{said}");
        }
        let page = fs::read_to_string(folder.path().join("results/prepare/report.html")).unwrap();
        for section in ["id=\"null\"", "id=\"mitm\"", "id=\"known\""] {
            assert!(page.contains(section), "{section}");
        }

        plan.labs = vec![hall("2")];
        let said = run(folder.path(), &plan, &["prepare", "--runs", "1", "--format", "json"]).expect(3).json();
        assert_eq!((said.get("mitm"), said.get("known")), (None, None));
        let left_out = said["left_out"][0].as_str().unwrap();
        assert!(left_out.starts_with("`mitm` and `known` left out, since `null` failed"), "{left_out}");
        let arguments = ["prepare", "--runs", "1", "--keep-going", "--format", "json"];
        let said = run(folder.path(), &plan, &arguments).expect(3).json();
        assert_eq!(said["mitm"]["objections"], Json::Array(Vec::new()));
        assert!(!said["known"]["objections"].as_array().unwrap().is_empty());
        assert_eq!(said["passed"], false);
        // Without regression tests that step is left out.
        plan.labs.clear();
        plan.tests.clear();
        let said = run(folder.path(), &plan, &["prepare", "--runs", "1"]).expect(0).out;
        assert!(said.contains("`known` is left out"), "{said}");
    }

    fn going_on() {
        let (folder, plan) = space(vec![hall("0.05")]);
        run(folder.path(), &plan, &["null", "--runs", "2"]).expect(0);
        let starts = |first: &str| fs::read(folder.path().join(format!("starts-{first}"))).unwrap().len();
        let before = (starts("0"), starts("0.05"));
        fs::remove_dir_all(folder.path().join("results/null/lab")).unwrap();
        run(folder.path(), &plan, &["null", "--runs", "2", "--resume", "null"]).expect(0);
        assert_eq!((starts("0"), starts("0.05")), (before.0, before.1 * 2), "the simulation is read");
        run(folder.path(), &plan, &["null", "--runs", "2", "--resume", "results/null"]).expect(0);
        assert_eq!((starts("0"), starts("0.05")), (before.0, before.1 * 2), "everything is complete");
        let said = run(folder.path(), &plan, &["null", "--runs", "3", "--resume", "results/null"]).expect(1).err;
        assert!(said.contains("results/null/simulation was begun with other options"), "{said}");
        // One side is a run like any other.
        run(folder.path(), &plan, &["list", "--results", "results/null/lab"]).expect(0);
        run(folder.path(), &plan, &["report", "--results", "results/null/lab"]).expect(0);
    }
}

#[cfg(unix)]
fn main() -> std::process::ExitCode {
    runner::main()
}

#[cfg(not(unix))]
fn main() {}
