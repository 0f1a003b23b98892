//! Campaigns on three machines while agents and the broker are killed, a network is cut, and the supervisor is killed:
//! each has the digest of one machine, and no process is left.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use sesame_patience::until;
use sesame_peers::Ended;
use sesame_record::Repository;
use sesame_rng::Stream;
use sesame_tests::{command, done, fresh_folder, sesamec, workspace};

use crate::fleet::{Run, finished, started, token_in};
use crate::network::Network;

/// The machine with the broker and the supervisor, and those with agents.
const HEAD: &str = "head";
const MACHINES: [&str; 3] = ["one", "two", "three"];

/// How long a network is cut.
const CUT: Duration = Duration::from_secs(10);

/// The longest that a campaign may take, with all that happens to it.
const LIMIT: Duration = Duration::from_secs(600);

/// A campaign of a space in a folder of its own.
struct Campaign {
    folder: PathBuf,
    space: PathBuf,
    name: &'static str,
    evaluations: u32,
}

impl Campaign {
    /// The gearbox cell, whose runner is compiled.
    fn of_a_compiled_runner() -> Self {
        let folder = fresh_folder("chaos_compiled");
        let example = workspace().join("examples/kuka_cell");
        sesame_tests::copy(&example.join("runners/hooks"), &folder.join("runners/hooks"));
        let space = example.join("kuka_cell.sesame");
        Campaign { folder, space, name: "coverage_experiment", evaluations: 2100 }
    }

    /// Two robots in Python, each test of which takes a second.
    fn of_a_slow_simulator() -> Self {
        let folder = fresh_folder("chaos_python");
        sesame_tests::copy(&workspace().join("examples/two_robots"), &folder.join("space"));
        fs::remove_dir_all(folder.join("space/runners")).ok();
        let simulator = folder.join("space/sim.py");
        let text = fs::read_to_string(&simulator).expect("the example has a simulator");
        let slow = text.replace(
            "    print(json.dumps(what), flush=True)\n",
            "    __import__(\"time\").sleep(1 / 4000)\n    print(json.dumps(what), flush=True)\n",
        );
        assert_ne!(slow, text);
        fs::write(&simulator, slow).expect("a simulator can be written");
        let space = folder.join("space/two_robots.sesame");
        Campaign { folder, space, name: "crossing", evaluations: 180 }
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut sesamec = command(sesamec());
        sesamec.args(arguments).current_dir(&self.folder);
        sesamec
    }

    /// A command on the campaign, with its runners in this folder.
    fn with_space(&self, subcommand: &str, more: &[&str]) -> Command {
        let (space, runners) = (self.space.display().to_string(), self.folder.join("runners").display().to_string());
        self.command(&[&[subcommand, &space, "--campaign", self.name, "--out", &runners], more].concat())
    }

    fn run(&self, seed: u64, results: &str, more: &[&str]) -> Command {
        let (seed, evaluations) = (seed.to_string(), self.evaluations.to_string());
        let settings = ["--", "--seed", &seed, "--evaluations", &evaluations, "--results", results];
        self.with_space("run", &[&settings[..], more].concat())
    }

    fn token(&self) -> String {
        token_in(&self.folder)
    }

    fn agent(&self, network: &Network, machine: &str, on: &str) -> Ended {
        let log = fs::File::options().create(true).append(true).open(self.folder.join(format!("{machine}.log")));
        let (token, folder) = (self.token(), self.folder.join(format!("agent-{machine}")).display().to_string());
        let agent = self.command(&[
            "agent",
            on,
            "--machine",
            machine,
            "--workers",
            "1",
            "--token",
            &token,
            "--folder",
            &folder,
        ]);
        let mut agent = network.on(machine, &agent);
        Ended(agent.stdout(Stdio::null()).stderr(log.expect("a log can be written")).spawn().expect("an agent starts"))
    }

    /// How many tests a run has recorded.
    fn recorded(&self, results: &str, seed: u64) -> usize {
        let run = self.folder.join(results).join(seed.to_string());
        Repository::open(&run).ok().and_then(|results| results.numbers().ok()).map_or(0, |all| all.len())
    }
}

/// A broker on the head, which keeps its streams in a folder.
struct Broker<'a> {
    network: &'a Network,
    folder: PathBuf,
    process: Option<Ended>,
}

impl Broker<'_> {
    fn start(&mut self) {
        let program = sesame_peers::named("SESAME_NATS").expect("it was looked for").with_file_name("nats-server");
        let mut broker = command(program);
        broker.args(["--jetstream", "--addr", &self.network.address(HEAD), "--port", "4222", "--store_dir"]);
        let mut broker = self.network.on(HEAD, broker.arg(&self.folder));
        let child = broker.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        self.process = Some(Ended(child.expect("nats-server starts")));
    }
}

/// The processes that work in a folder, or are named by it.
fn processes_of(folder: &Path) -> Vec<String> {
    let named = folder.display().to_string();
    let mut found = Vec::new();
    for entry in fs::read_dir("/proc").expect("Linux has /proc").flatten() {
        let process = entry.path();
        let words = fs::read(process.join("cmdline")).unwrap_or_default();
        let words = String::from_utf8_lossy(&words).replace('\0', " ");
        let works_there = fs::read_link(process.join("cwd")).is_ok_and(|place| place.starts_with(folder));
        if works_there || words.contains(&named) {
            found.push(format!("{}: {words}", process.display()));
        }
    }
    found
}

/// What happens to the machines, by the clock.
struct Chaos<'a> {
    campaign: &'a Campaign,
    network: &'a Network,
    on: String,
    luck: Stream,
    agents: [Option<Ended>; MACHINES.len()],
    kills: u32,
}

impl Chaos<'_> {
    /// A moment of some seconds.
    fn moment(&mut self, from: f64, to: f64) {
        thread::sleep(Duration::from_secs_f64(self.luck.uniform(from, to)));
    }

    /// Kills an agent, and starts it again a while later.
    fn kill_an_agent(&mut self) {
        let at = self.luck.below(MACHINES.len());
        self.agents[at] = None;
        self.kills += 1;
        self.moment(0.0, 2.0);
        self.agents[at] = Some(self.campaign.agent(self.network, MACHINES[at], &self.on));
    }

    /// Kills agents until the run has recorded a part of its tests, or has ended.
    fn kill_agents_until(&mut self, run: &mut Run, recorded: &dyn Fn() -> usize, wanted: usize) {
        let begun = Instant::now();
        while recorded() < wanted && !run.has_ended() {
            assert!(begun.elapsed() < LIMIT, "{} tests after {LIMIT:?}", recorded());
            self.moment(0.5, 3.5);
            self.kill_an_agent();
        }
    }
}

/// One campaign, with one seed, and everything that may happen.
fn survives(campaign: &Campaign, network: &Network, seed: u64) {
    let digest = done(&mut campaign.run(seed, "local", &[])).expect(0).digest();
    let mut broker = Broker { network, folder: campaign.folder.join(format!("broker-{seed}")), process: None };
    broker.start();
    let (on, token) = (format!("nats://{}:4222", network.address(HEAD)), campaign.token());
    let listed = campaign.command(&["agents", &on, "--token", &token]);
    until("the broker answers", || done(&mut network.on(HEAD, &listed)).code == Some(0));
    let luck = Stream::derive(seed, "chaos", &[]);
    let agents = MACHINES.map(|machine| Some(campaign.agent(network, machine, &on)));
    let mut chaos = Chaos { campaign, network, on: on.clone(), luck, agents, kills: 0 };

    let remote = [&["--on", &on][..], &["--token", &token]].concat();
    let start = |command: &Command| started(&mut network.on(HEAD, command));
    let recorded = || campaign.recorded("remote", seed);
    let tests = usize::try_from(campaign.evaluations).expect("it is small");
    let mut run = start(&campaign.run(seed, "remote", &remote));
    chaos.kill_agents_until(&mut run, &recorded, tests / 6);

    let cut = chaos.luck.below(MACHINES.len());
    network.set_connected(MACHINES[cut], false);
    thread::sleep(CUT);
    network.set_connected(MACHINES[cut], true);

    chaos.kill_agents_until(&mut run, &recorded, tests / 3);
    broker.process = None;
    chaos.moment(0.0, 3.0);
    broker.start();

    chaos.kill_agents_until(&mut run, &recorded, tests / 2);
    run.kill();
    let run = format!("remote/{seed}");
    let mut run = start(&campaign.with_space("resume", &[&[run.as_str()][..], &remote].concat()));

    chaos.kill_agents_until(&mut run, &recorded, tests * 5 / 6);
    let ended = finished(run).expect(0);
    assert_eq!(ended.digest(), digest, "seed {seed}");
    assert_eq!(recorded(), tests + 2, "seed {seed}");
    println!("{} seed {seed}: equal after {} agents were killed", campaign.name, chaos.kills);
    drop(chaos);
    drop(broker);
    until("no process is left", || processes_of(&campaign.folder).is_empty());
    let left = processes_of(&campaign.folder);
    assert!(left.is_empty(), "{left:?}");
}

fn all_seeds(campaign: &Campaign) {
    if sesame_peers::named("SESAME_NATS").is_none() {
        return;
    }
    let Some(network) = Network::of(&[&[HEAD], &MACHINES[..]].concat()) else { return };
    let seeds = std::env::var("SESAME_CHAOS_SEEDS").ok().map_or(10, |seeds| seeds.parse().expect("a number of seeds"));
    for seed in 1..=seeds {
        survives(campaign, &network, seed);
    }
}

#[test]
#[ignore = "long: ten seeds with networks that are cut, as root"]
fn a_compiled_runner_on_three_machines_comes_to_the_results_of_one_whatever_happens() {
    all_seeds(&Campaign::of_a_compiled_runner());
}

#[test]
#[ignore = "long: ten seeds with networks that are cut, as root"]
fn a_simulator_in_python_on_three_machines_comes_to_the_results_of_one_whatever_happens() {
    all_seeds(&Campaign::of_a_slow_simulator());
}
