//! The examples with ROS 2 as their users run them: `sesamec` launches the nodes, disturbs them, and leaves nothing
//! behind.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use serde_json::Value;
use sesame_plan::NodeId;
use sesame_record::Repository;
use sesame_tests::optimisers::{Sort, Sorted, ask};
use sesame_tests::{Done, command, done, fresh_folder, sesamec, workspace};

use crate::environment::{Domain, Vendor};
use crate::peer::{LIMIT, Peer};
use crate::relaying::plans;

/// A copy of an example in a folder and in domains of its own.
pub(crate) struct Example {
    pub(crate) space: PathBuf,
    /// Held for as long as they are used: one for each of two workers.
    _domains: Domain,
}

impl Example {
    /// Its copy, with some of its text replaced.
    pub(crate) fn new(name: &str, vendor: Vendor, folder: &str, changes: &[(&str, &str)]) -> Option<Example> {
        let python = vendor.python()?;
        let folder = fresh_folder(folder);
        let example = workspace().join("examples").join(name);
        for file in
            fs::read_dir(&example).expect("the example is there").map(|entry| entry.expect("it is listed").path())
        {
            if file.extension().is_some_and(|extension| extension == "py") {
                let name = file.file_name().expect("a file has a name");
                fs::copy(&file, folder.join(name)).expect("a program can be copied");
            }
        }
        symlink(Vendor::environment(&python), folder.join("venv")).expect("an environment can be linked");
        let domain = Domain::first_of(2);
        let file = format!("{name}.sesame");
        let mut text = fs::read_to_string(example.join(&file)).expect("the space can be read");
        let number =
            text.lines().find_map(|line| line.trim().strip_prefix("domain ")).expect("it has a domain").to_owned();
        let own = format!("domain {}", domain.number);
        for (from, to) in changes.iter().copied().chain([(format!("domain {number}").as_str(), own.as_str())]) {
            assert!(text.contains(from), "{name} has no `{from}`");
            text = text.replace(from, to);
        }
        let space = folder.join(file);
        fs::write(&space, text).expect("a space can be written");
        Some(Example { space, _domains: domain })
    }

    pub(crate) fn folder(&self) -> &Path {
        self.space.parent().expect("a file lies in a folder")
    }

    /// `sesamec` with a subcommand on the space, and afterwards no process of the system is left.
    pub(crate) fn sesamec(&self, subcommand: &str, campaign: &str, arguments: &[&str]) -> Done {
        let mut sesamec = command(sesamec());
        sesamec.arg(subcommand).arg(&self.space).args(["--campaign", campaign]).args(arguments);
        let done = done(sesamec.current_dir(self.folder()));
        assert_eq!(self.processes(), Vec::<String>::new(), "processes are left: {}", done.err);
        done
    }

    /// Tests of the latest run with what was measured in them, by number.
    pub(crate) fn tests(&self, campaign: &str) -> Vec<Value> {
        let listed = self.sesamec("list", campaign, &["--format", "json"]).expect(0).json();
        listed["tests"].as_array().expect("tests are listed").clone()
    }

    /// The programs that run in this folder: what was launched, and what these programs launched in turn.
    fn processes(&self) -> Vec<String> {
        let folder = fs::canonicalize(self.folder()).expect("the folder is there");
        let all = fs::read_dir("/proc").expect("this is Linux").flatten().map(|entry| entry.path());
        let here = all.filter(|process| fs::read_link(process.join("cwd")).is_ok_and(|cwd| cwd.starts_with(&folder)));
        // One that has just ended has no command line any more.
        let commands = here.filter_map(|process| fs::read_to_string(process.join("cmdline")).ok());
        commands.map(|words| words.replace('\0', " ")).filter(|words| words.contains(".py")).collect()
    }
}

fn iiwa_cell(folder: &str, changes: &[(&str, &str)]) -> Option<Example> {
    Example::new("iiwa_cell", Vendor::Kilted, folder, changes)
}

/// What was measured in a test, as text in which each bit shows.
fn measured(test: &Value) -> String {
    assert_eq!(test["outcome"], "completed", "{test}");
    test["measured"].to_string()
}

const WORKERS: [&str; 3] = ["--", "--workers", "2"];

/// Two tests instead of eighteen, one for each worker, of five seconds: both arms are on their way, and disturbed.
const SHORT: [(&str, &str); 1] = [(
    "nsga2 { population 6  evaluations 18  seed 42 }",
    "nsga2 { population 2  evaluations 2  seed 42 }\n  end after 5s",
)];

#[test]
fn a_campaign_has_one_digest_interpreted_compiled_and_after_an_interruption_and_leaves_no_process() {
    let Some(cell) = iiwa_cell("iiwa_digest", &SHORT) else { return };
    let whole = cell.sesamec("run", "first_look", &WORKERS).expect(0);

    // The runner as a crate: it has ROS 2 without being told.
    let built = cell.sesamec("run", "first_look", &[&["--build"], &WORKERS[..]].concat()).expect(0);
    assert_eq!(whole.digest(), built.digest());

    let mut stopped = command(sesamec());
    stopped.arg("run").arg(&cell.space).args(["-c", "first_look"]).args(WORKERS).current_dir(cell.folder());
    let stopped = stopped.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let limit = Instant::now() + LIMIT;
    // Two workers with three nodes each.
    while cell.processes().len() < 6 {
        assert!(Instant::now() < limit, "the nodes do not start: {:?}", cell.processes());
        std::thread::sleep(Duration::from_millis(50));
    }
    let interrupt = nix::unistd::Pid::from_raw(stopped.id().try_into().unwrap());
    nix::sys::signal::kill(interrupt, nix::sys::signal::Signal::SIGINT).unwrap();
    assert_eq!(stopped.wait_with_output().unwrap().status.code(), Some(130));
    assert_eq!(cell.processes(), Vec::<String>::new(), "an interrupted run leaves no process");
    let resumed = cell.sesamec("resume", "first_look", &WORKERS[1..]).expect(0);
    assert_eq!(whole.digest(), resumed.digest());
}

#[test]
fn a_parameter_a_service_and_nodes_change_the_motion_and_afterwards_everything_is_as_before() {
    let changes = [("state_and_resources 3 times", "state_and_resources 2 times")];
    let Some(cell) = iiwa_cell("iiwa_resources", &changes) else { return };
    for campaign in ["resources", "restarts"] {
        cell.sesamec("run", campaign, &["--", "--workers", "1"]).expect(0);
        let tests = cell.tests(campaign);
        let [before, first, second, after] = &tests[..] else { panic!("{tests:?}") };
        assert_eq!([before, after].map(|test| &test["origin"]), ["reference", "reference"]);
        assert_eq!(measured(before), measured(after), "{campaign}");
        assert_eq!(measured(first), measured(second), "{campaign}");
        let cycle = |test: &Value| test["measured"]["right_cycle"].as_f64();
        let distance = |test: &Value| test["measured"]["arm_distance"].as_f64();
        assert_ne!((distance(before), cycle(before)), (distance(first), cycle(first)), "{campaign}");
    }

    let shown = cell.sesamec("show", "resources", &["T1", "--format", "json"]).expect(0).json();
    let counted = |operation: &str, counter: &str| {
        let of = shown["operations"].as_array().unwrap().iter().find(|of| of["operation"] == operation).unwrap();
        of["counters"][counter].as_u64().unwrap()
    };
    assert_eq!(counted("heavy_parts", "side_effects"), 1);
    assert_eq!(counted("halted", "side_effects"), 1);
    assert_eq!(counted("denied", "changed"), 1);
    assert!(counted("denied", "seen") > 1, "the service is called outside of the window, too");
}

/// What is said of the spread of three runs of a test of a system that runs freely, with its deviation and its largest
/// value.
fn spread_of_free_runs(folder: &str) -> Option<(Value, f64, f64)> {
    let freely = [
        ("step   20ms by service \"/cell/step\"\n", "\n"),
        ("\"--lock-step\"", "\"--speed\" \"3\""),
        ("    answers    zone_grant_request with zone_grant_reply\n", ""),
        ("    answers    left_states with left_commands\n", ""),
        ("    answers    right_states with right_commands\n", ""),
        ("    every      step left_states, right_states, between, workers, left_tool, right_tool\n", ""),
        ("right_bias 5 times", "right_bias 3 times"),
    ];
    let cell = iiwa_cell(folder, &freely)?;
    let done = cell.sesamec("run", "repeated", &["--", "--workers", "1", "--format", "json"]);
    let ran: Value = serde_json::from_str(&done.out).unwrap_or_else(|_| panic!("no JSON: {}", done.err));
    let done = done.ended_freely();
    assert_eq!(ran["closing_run"].is_null(), done.code == Some(0), "{ran}");
    let spreads = ran["spreads"].as_array().expect("there are spreads");
    let spread = spreads.iter().find(|spread| spread["metric"] == "arm_distance").expect("one is of the arms");
    let number = |field: &str| spread[field].as_f64().unwrap_or_else(|| panic!("no `{field}` in {spread}"));
    assert_eq!(spread["count"], 3, "{spread}");
    assert!(number("min") <= number("mean") && number("mean") <= number("max"), "{spread}");
    // It may be zero: where a biased arm comes to rest does not depend on when its messages came.
    let (deviation, max) = (number("deviation"), number("max"));
    assert!(deviation >= 0.0 && deviation <= max - number("min"), "{spread}");
    Some((spread.clone(), deviation, max))
}

#[test]
fn repeating_a_test_of_a_system_that_runs_freely_states_its_spread() {
    spread_of_free_runs("iiwa_freely");
}

/// A controller that is not asked in time moves its arm in another way, so this is with nothing beside it.
#[test]
#[ignore = "long: how alike runs are that nobody steps depends on what else the machine does"]
fn the_spread_of_a_system_that_runs_freely_is_small() {
    let Some((spread, deviation, max)) = spread_of_free_runs("iiwa_freely_alone") else { return };
    assert!(deviation < 0.02, "{spread}");
    // With 14.7 cm if undisturbed.
    assert!(max < 0.1, "{spread}");
}

/// What a known test comes to in the hall, compared with the simulation. The hall runs freely, so its numbers depend on
/// what else the machine does.
struct InTheHall {
    /// The distance between the arms in simulation, and in the hall.
    arm_distance: [f64; 2],
    /// By how much a worker is closer to a tool in the hall.
    closer: f64,
    /// The difference in the height of a tool: its root mean square over the run.
    apart: f64,
}

fn in_the_hall(folder: &str) -> Option<InTheHall> {
    let hall = Domain::free();
    let (domain, argument) = (format!("domain {}", hall.number), format!("\"--hall\" \"{}\"", hall.number));
    let short = "right_bias 2 times\n  observes arm_distance, worker_distance\n  end      after 5s";
    let changes = [
        ("domain 100", domain.as_str()),
        ("\"--hall\" \"100\"", argument.as_str()),
        ("right_bias 5 times\n  observes arm_distance, worker_distance\n  end      after 14s", short),
    ];
    let cell = iiwa_cell(folder, &changes)?;
    cell.sesamec("run", "repeated", &WORKERS).expect(0);
    cell.sesamec("physical", "repeated", &["T1", "--times", "1"]).ended_freely();

    let results = cell.folder().join("runners/repeated/results");
    let [simulated, in_hall] = ["1", "1-hall"].map(|folder| results.join(folder));
    for results in [&simulated, &in_hall] {
        let repository = Repository::open(results).expect("there are results");
        let effects = repository.test(1).expect("the test was run").observation.operations;
        assert!(effects[0].counters.any_effect(), "the disturbance acts on either side: {effects:?}");
    }
    let mut gap = command(sesamec());
    gap.arg("gap").args([simulated, in_hall]);
    let json = done(gap.args(["--format", "json"])).expect(0).out;
    let rows: Vec<Value> = serde_json::from_str(&json).expect("it is JSON");
    let row = |metric: &str| rows.iter().find(|row| row["metric"] == metric).unwrap_or_else(|| panic!("{rows:?}"));
    let number = |metric: &str, field: &str| row(metric)[field].as_f64().unwrap_or_else(|| panic!("{}", row(metric)));
    assert_eq!(["simulation_runs", "lab_runs"].map(|field| number("arm_distance", field)), [1.0, 1.0]);

    // With a trace of the simulation, too, signals are compared: those of the service, whose two topics have one name,
    // and those that neither metrics nor operations read.
    cell.sesamec("replay", "repeated", &["T1", "--record", "--results", "1"]).expect(0);
    let mut traces = command(sesamec());
    traces.arg("gap").args([results.join("1"), results.join("1-hall")]);
    let json = done(traces.args(["--traces", "--format", "json"])).expect(0).out;
    let signals: Vec<Value> = serde_json::from_str(&json).expect("it is JSON");
    let signal = |name: &str| signals.iter().find(|row| row["signal"] == name).unwrap_or_else(|| panic!("{signals:?}"));
    Some(InTheHall {
        arm_distance: ["simulation_mean", "lab_mean"].map(|field| number("arm_distance", field)),
        closer: -number("worker_distance", "difference"),
        apart: signal("/left/tool.point.z")["rms"].as_f64().expect("it is a number"),
    })
}

#[test]
fn a_known_test_is_run_in_the_hall_on_another_engine_and_the_gap_is_reported() {
    let Some(InTheHall { arm_distance: [simulated, in_hall], closer, apart }) = in_the_hall("iiwa_hall") else {
        return;
    };
    // Undisturbed, it is more than twice as much.
    assert!(simulated < 0.06, "the simulation is stepped: {simulated}");
    assert!(in_hall > 0.0 && closer.is_finite() && apart > 0.0, "{in_hall}, {closer}, {apart}");
}

#[test]
#[ignore = "long: what a hall that nobody steps comes to depends on what else the machine does"]
fn the_gap_of_the_hall_is_that_of_its_arms_and_tools() {
    let Some(InTheHall { arm_distance, closer, apart }) = in_the_hall("iiwa_hall_alone") else { return };
    assert!(arm_distance.iter().all(|&mean| mean < 0.06), "undisturbed it is twice as much: {arm_distance:?}");
    // The arm of the hall is longer, so a tool that rests above its box is 5 mm closer to a worker.
    assert!((0.003..0.02).contains(&closer), "{closer}");
    assert!((0.02..0.1).contains(&apart), "the hall's tools are 3.5 cm higher: {apart}");
}

#[test]
fn robots_that_believe_old_poses_collide_in_the_fleet() {
    let Some(fleet) = Example::new("fleet", Vendor::Fleet, "fleet_repeated", &[("5 times", "2 times")]) else { return };
    fleet.sesamec("run", "repeated", &WORKERS).expect(0);
    let tests = fleet.tests("repeated");
    let [reference, first, second, _] = &tests[..] else { panic!("{tests:?}") };
    assert_eq!(measured(first), measured(second));
    let gap = |test: &Value| test["measured"]["smallest_gap"].as_f64().unwrap();
    assert!(gap(reference) >= 0.1, "{reference}");
    assert!(gap(first) <= 0.0, "{first}");
}

/// The warehouse, with what is compiled for it.
fn warehouse(folder: &str, changes: &[(&str, &str)]) -> Option<Example> {
    let built = sesame_peers::named("SESAME_ROS2_NAV2")?;
    let changes: Vec<_> = changes.iter().copied().chain([("../fleet/venv", "venv")]).collect();
    let example = Example::new("warehouse", Vendor::Fleet, folder, &changes)?;
    let interfaces = workspace().join("examples/warehouse/interfaces");
    for (folder, name) in [(built, "built"), (interfaces, "interfaces")] {
        symlink(folder, example.folder().join(name)).expect("a folder can be linked");
    }
    Some(example)
}

#[test]
fn a_robot_that_is_located_late_meets_another_one_in_the_warehouse_and_always_alike() {
    let Some(warehouse) = warehouse("warehouse_repeated", &[("5 times", "2 times")]) else { return };
    warehouse.sesamec("run", "repeated", &WORKERS).expect(0);
    let tests = warehouse.tests("repeated");
    let [reference, first, second, _] = &tests[..] else { panic!("{tests:?}") };
    assert_eq!(measured(first), measured(second));
    let value = |test: &Value, metric: &str| test["measured"][metric].as_f64().unwrap_or_else(|| panic!("{test}"));
    // Undisturbed, two that meet at a crossing keep as far apart as the stop is before it, less what they slip.
    assert!(value(reference, "closest") > 1.3, "{reference}");
    assert_eq!(["reached", "aborted"].map(|metric| value(reference, metric)), [12.0, 0.0], "{reference}");
    // Both touch, since their radius is 35 cm; nobody else comes close.
    assert!(value(first, "r2_r5") <= 0.7, "{first}");
    for others in ["r1_r4", "r1_r5", "r1_r6", "r2_r4", "r2_r6", "r3_r4", "r3_r5", "r3_r6"] {
        assert!(value(first, others) > 0.8, "{others}: {first}");
    }
}

/// The campaign that the example's page begins with.
#[test]
#[ignore = "long: a campaign of 80 tests"]
fn a_search_finds_whose_localisation_has_to_be_late_for_which_collision_in_the_warehouse() {
    let Some(warehouse) = warehouse("warehouse_collisions", &[]) else { return };
    warehouse.sesamec("run", "collisions", &WORKERS).expect(0);
    let said = warehouse.sesamec("causes", "collisions", &["--format", "json"]).expect(0).json();
    let text = |value: &Value| value.as_str().unwrap_or_else(|| panic!("{said:#}")).to_owned();
    let of = |cause: &Value| -> (String, Vec<String>) {
        let operations = cause["operations"].as_array().unwrap_or_else(|| panic!("{said:#}"));
        (text(&cause["requirement"]), operations.iter().map(text).collect())
    };
    let causes: Vec<(String, Vec<String>)> =
        said["causes"].as_array().expect("causes are listed").iter().map(of).collect();
    let collisions: Vec<_> = causes.iter().filter(|(requirement, _)| requirement != "R7").collect();
    assert!(collisions.len() >= 4, "{causes:?}");
    // Who is late is one of the two that collide: `R26` is about `r2` and `r6`.
    for (requirement, operations) in collisions {
        let [late] = &operations[..] else { panic!("one operation suffices: {causes:?}") };
        let robot = late.strip_prefix("late[r").and_then(|late| late.strip_suffix(']'));
        let robot = robot.unwrap_or_else(|| panic!("only what is late lets robots collide: {causes:?}"));
        assert!(requirement[1..].contains(robot), "{causes:?}");
    }
}

#[test]
fn what_a_scan_of_the_running_cell_writes_is_run_with_a_campaign_below_it() {
    let Some(python) = Vendor::Kilted.python() else { return };
    let folder = fresh_folder("iiwa_scanned");
    let (domain, example) = (Domain::free(), workspace().join("examples/iiwa_cell"));
    let programs: [&[&str]; 3] =
        [&["cell.py"], &["controller.py", "--arm", "left"], &["controller.py", "--arm", "right"]];
    let running = programs.map(|words| Peer::start_in(&example, &python, &domain, words[0], &words[1..]));
    let number = domain.number.to_string();
    let share = Vendor::share(&python);
    // Nodes may take long to start, and on a busy machine to answer, so it is looked longer and longer until all are
    // there.
    let mut scanned = String::new();
    let is_there = |scanned: &str| {
        ["/cell\"", "/left_controller\"", "/right_controller\"", " Hz"].iter().all(|part| scanned.contains(part))
    };
    for seconds in ["3", "5", "8", "13", "21", "34"] {
        let mut scan = command(sesamec());
        scan.args(["scan", "ros2", "--domain", &number, "--seconds", seconds, "--types"]).arg(&share);
        scanned = done(scan.current_dir(&folder)).expect(0).out;
        if is_there(&scanned) {
            break;
        }
    }
    assert!(is_there(&scanned), "nodes are missing:\n{scanned}");
    drop(running);

    let space = folder.join("cell.sesame");
    let campaign = "metric arm_distance minimise default 2 = min(cell_distance.data)\n\
                    operation lost on left_joint_states = packet loss [50%, 100%] within [0s, 3s]\n\
                    campaign look {\n  objectives arm_distance\n  operations lost 1 per test\n\
                    search random { evaluations 2  seed 1 }\n  end after 3s\n}\n";
    let text = format!("{scanned}\n{campaign}");
    fs::write(&space, &text).unwrap();
    done(command(sesamec()).arg("check").arg(&space)).expect(0);

    // The nodes again, now with the remappings that `explain wiring` prints.
    let [plan] = &plans(&space.display().to_string(), &text)[..] else { panic!("one campaign") };
    let _running = programs.map(|words| {
        let name =
            words.last().filter(|_| words.len() > 1).map_or("/cell".to_owned(), |arm| format!("/{arm}_controller"));
        let ids = (0u32..).map(NodeId).zip(&plan.nodes);
        let (id, _) =
            ids.into_iter().find(|(_, node)| node.named.as_deref() == Some(name.as_str())).expect("it is known");
        let remapped = plan.ros_args(Some(id));
        let words: Vec<String> = words.iter().map(ToString::to_string).chain(remapped).collect();
        Peer::start_in(&example, &python, &domain, &words[0], &words[1..])
    });
    let mut run = command(sesamec());
    let ran = done(run.arg("run").arg(&space).args(["--", "--workers", "1"]).current_dir(&folder)).ended_freely();
    assert!(ran.out.contains("2 evaluations"), "{}", ran.out);
    assert!(ran.out.contains("arm_distance"), "{}", ran.out);
}

/// The campaign that the example's page begins with, twice, with pymoo's non-dominated sort as the oracle.
#[test]
#[ignore = "long: two campaigns of 18 tests"]
fn the_front_of_the_first_look_is_what_pymoo_finds_and_a_second_look_has_its_digest() {
    let Some(cell) = iiwa_cell("iiwa_first_look", &[]) else { return };
    let [first, second] = [(); 2].map(|()| cell.sesamec("run", "first_look", &WORKERS).expect(0));
    assert_eq!(first.digest(), second.digest());
    eprintln!("{}", first.out.lines().last().unwrap_or_default());

    let tests = cell.tests("first_look");
    // Duplicates stand for an equal test, and the front has that one only.
    let searched: Vec<&Value> =
        tests.iter().filter(|test| test["origin"] == "search" && test["duplicate_of"].is_null()).collect();
    let objectives = ["fuzzing_time", "arm_distance", "worker_distance"];
    let point = |test: &Value| objectives.map(|objective| test["measured"][objective].as_f64().unwrap()).to_vec();
    let points: Vec<Vec<f64>> = searched.iter().map(|test| point(test)).collect();
    let Some(sorted) = ask::<Sort, Sorted>(&[Sort { points }]) else { return };
    let on_front: Vec<usize> = (0..searched.len()).filter(|&at| searched[at]["front"] == true).collect();
    assert!(on_front.len() > 1, "{tests:?}");
    assert_eq!(sorted[0].fronts[0], on_front);
}
