//! Whatever happens to agents, broker and supervisor: the results are those of one machine.

use std::collections::BTreeSet;
use std::fs;
use std::process::Stdio;

use serde_json::Value;
use sesame_patience::until;
use sesame_tests::{Project, command, done, sesamec};

use crate::fleet::{Broker, Cell, TESTS, finished, started, started_with_log, token_in};

/// The machines of all tests of a run, and that each test has one.
fn machines(cell: &Cell, results: &str) -> BTreeSet<String> {
    let machines = cell.results(results).machines().expect("they are recorded");
    let tests = cell.results(results).numbers().expect("there are tests");
    assert_eq!(machines.keys().copied().collect::<Vec<_>>(), tests);
    machines.into_values().collect()
}

/// What the queue says of itself.
fn shown(cell: &Cell, on: &str) -> Value {
    done(&mut cell.command(&["agents", on, "--format", "json"])).expect(0).json()
}

/// Two agents run a campaign; one of them is killed in the middle, and another one joins.
fn comes_to_the_same(cell: &Cell, on: &str) {
    let digest = cell.local_digest();
    let (one, two) = (cell.agent(on, "one"), cell.agent(on, "two"));
    let run = started(&mut cell.run("remote", Some(on)));
    cell.await_tests("remote", TESTS / 3);
    drop(one);
    let three = cell.agent(on, "three");
    let done = finished(run).expect(0);
    assert_eq!(done.digest(), digest);
    let machines = machines(cell, "remote");
    assert!(machines.contains("two") && machines.len() >= 2, "{machines:?}");
    // Nothing of the campaign is left, and the agents wait for the next one.
    until("both agents wait", || {
        let shown = shown(cell, on);
        let agents = shown["agents"].as_array().expect("they are listed");
        let waits =
            |name: &str| agents.iter().any(|agent| agent["machine"] == name && agent["campaign"] == Value::Null);
        shown["campaigns"].as_array().is_some_and(Vec::is_empty) && waits("two") && waits("three")
    });
    drop((two, three));
}

#[test]
fn agents_with_a_shared_folder_come_to_the_results_of_one_machine() {
    let cell = Cell::new("agents_folder");
    comes_to_the_same(&cell, &cell.folder.join("queue").display().to_string());
}

#[test]
fn agents_with_a_broker_come_to_the_results_of_one_machine() {
    let Some(broker) = Broker::start() else { return };
    comes_to_the_same(&Cell::new("agents_broker"), &broker.url());
}

#[test]
fn results_are_the_same_after_the_broker_an_agent_and_the_supervisor_were_killed() {
    let cell = Cell::new("agents_killed");
    let Some(mut broker) = Broker::start() else { return };
    let (digest, on) = (cell.local_digest(), broker.url());
    let (one, _two) = (cell.agent(&on, "one"), cell.agent(&on, "two"));
    let run = started(&mut cell.run("remote", Some(&on)));
    cell.await_tests("remote", TESTS / 4);
    broker.kill();
    broker.start_again();
    cell.await_tests("remote", TESTS / 2);
    run.kill();
    drop(one);
    let run = started(&mut cell.resume("remote", &on));
    let done = finished(run).expect(0);
    assert_eq!(done.digest(), digest);
    assert_eq!(cell.results("remote").numbers().expect("there are tests").len(), TESTS + 2);
}

#[test]
fn a_compiled_runner_travels_and_comes_to_the_results_of_one_machine() {
    const CAMPAIGN: &str = "coverage_experiment";
    let project = Project::kuka_cell("agents_compiled");
    let place = |name: &str| project.folder.join(name).display().to_string();
    let (on, token) = (place("queue"), token_in(&project.folder));
    let settings = ["--seed", "7", "--evaluations", "20", "--results"];
    let local = project.run(CAMPAIGN, &[&["--"], &settings[..], &["local"]].concat()).expect(0);
    let agent = |machine: &str| {
        let mut agent = command(sesamec());
        agent.args(["agent", &on, "--machine", machine, "--workers", "1", "--token", &token, "--folder"]);
        sesame_peers::Ended(agent.arg(place(machine)).stderr(Stdio::null()).spawn().expect("an agent starts"))
    };
    let _agents = [agent("one"), agent("two")];
    let remote = [&["--"], &settings[..], &["remote", "--on", &on, "--token", &token]].concat();
    let remote = project.run(CAMPAIGN, &remote).expect(0);
    assert_eq!(remote.digest(), local.digest());
}

#[test]
fn a_slower_machine_has_more_time_and_comes_to_the_same_results() {
    let cell = Cell::new("agents_slow");
    let Some(broker) = Broker::start() else { return };
    cell.change_simulator(
        "        luck = random.Random(seed)\n",
        "        __import__(\"time\").sleep(float(__import__(\"os\").environ.get(\"SLOWNESS\", \"0\")))\n        \
         luck = random.Random(seed)\n",
    );
    let (digest, on) = (cell.local_digest(), broker.url());
    let quick = cell.agent(&on, "quick");
    let run = started(cell.run("remote", Some(&on)).args(["--timeout", "3"]));
    cell.await_tests("remote", TESTS - 2);
    drop(quick);
    // Each of its runs takes longer than a test may take on a machine as fast as the first one.
    let _slow = cell.agent_with(&on, "slow", &[("SLOWNESS", "4")]);
    let done = finished(run).expect(0);
    assert_eq!(done.digest(), digest);
    assert!(machines(&cell, "remote").contains("slow"));
}

#[test]
fn a_machine_without_what_the_simulator_needs_is_put_aside_and_named_and_spoils_nothing() {
    let cell = Cell::new("agents_bare");
    let on = cell.folder.join("queue").display().to_string();
    // Slow enough for the other machine to try.
    cell.change_simulator(
        "        luck = random.Random(seed)\n",
        "        __import__(\"time\").sleep(0.5)\n        luck = random.Random(seed)\n",
    );
    let digest = cell.local_digest();
    let _whole = cell.agent(&on, "whole");
    let run = started(&mut cell.run("remote", Some(&on)));
    cell.await_tests("remote", 1);
    let _bare = cell.agent_with(&on, "bare", &[("PATH", "/nowhere")]);
    let done = finished(run).expect(0);
    assert_eq!(done.digest(), digest);
    assert_eq!(machines(&cell, "remote"), BTreeSet::from(["whole".to_owned()]));
    let said = "`bare` gets no more tests: 3 faults in a row, the last one: without disturbance the campaign does not run here";
    assert!(done.err.contains(said), "{}", done.err);
}

#[test]
fn a_campaign_that_is_begun_anew_with_other_files_is_run_with_those() {
    let cell = Cell::new("agents_edited");
    let on = cell.folder.join("queue").display().to_string();
    let agent = cell.agent(&on, "one");
    let run = started(&mut cell.run("remote", Some(&on)));
    cell.await_tests("remote", 3);
    run.kill();
    std::fs::remove_dir_all(cell.folder.join("remote")).expect("its results can be removed");
    cell.change_simulator("TIMETABLE = 15.0", "TIMETABLE = 14.0");
    let digest = cell.local_digest();
    let done = finished(started(&mut cell.run("remote", Some(&on)))).expect(0);
    assert_eq!(done.digest(), digest);
    drop(agent);
}

#[test]
fn an_agent_leaves_a_campaign_whose_supervisor_is_gone_for_one_that_needs_it() {
    let (gone, here) = (Cell::new("agents_gone"), Cell::new("agents_here"));
    let on = gone.folder.join("queue").display().to_string();
    let token = gone.folder.join("settings/sesame/token");
    let _agent = gone.agent(&on, "one");
    let run = started(&mut gone.run("remote", Some(&on)));
    gone.await_tests("remote", 3);
    run.kill();
    let mut run = here.run("remote", Some(&on));
    let run = started(run.arg("--token").arg(&token));
    assert_eq!(finished(run).expect(0).digest(), here.local_digest());
    until("only the campaign without a supervisor is left", || {
        let left = &shown(&gone, &on)["campaigns"];
        left[0]["supervised"] == false && left.as_array().is_some_and(|left| left.len() == 1)
    });
}

#[cfg(target_os = "linux")]
#[test]
fn an_agent_that_is_ended_together_with_its_workers_says_nothing_of_the_test_that_it_ran() {
    let cell = Cell::new("agents_ended");
    let on = cell.folder.join("queue").display().to_string();
    let digest = cell.local_digest();
    let run = started(&mut cell.run("remote", Some(&on)));
    for number in 1..=3 {
        let mut agent = cell.agent(&on, "ended");
        cell.await_tests("remote", number * TESTS / 5);
        let all = with_descendants(agent.0.id());
        assert!(all.len() >= 3, "an agent, its worker and a simulator: {all:?}");
        done(command("kill").arg("-TERM").args(all.iter().map(u32::to_string))).expect(0);
        until("the agent has ended", || agent.0.try_wait().expect("an agent can be asked").is_some());
    }
    let _last = cell.agent(&on, "last");
    assert_eq!(finished(run).expect(0).digest(), digest);
}

/// A process with all that it started, children first.
#[cfg(target_os = "linux")]
fn with_descendants(id: u32) -> Vec<u32> {
    // Each thread has the children that it started.
    let threads = std::fs::read_dir(format!("/proc/{id}/task")).into_iter().flatten().flatten();
    let children = |thread: std::fs::DirEntry| std::fs::read_to_string(thread.path().join("children"));
    let children: Vec<String> = threads.flat_map(children).collect();
    let ids = children.iter().flat_map(|ids| ids.split_whitespace()).flat_map(str::parse);
    let mut all: Vec<u32> = ids.flat_map(with_descendants).collect();
    all.push(id);
    all
}

#[test]
fn a_prepared_folder_is_compared_with_that_of_the_campaign_and_one_with_other_files_is_refused() {
    let (cell, other) = (Cell::new("agents_prepared"), Cell::new("agents_prepared_there"));
    let on = cell.folder.join("queue").display().to_string();
    let digest = cell.local_digest();
    let there = other.folder.join("space");
    fs::write(there.join("engine.so"), "what only the machines of agents have").unwrap();
    let original = fs::read_to_string(there.join("sim.py")).unwrap();
    fs::write(there.join("sim.py"), format!("{original}\n")).unwrap();
    let start = |name: &str| {
        let prepared = format!("robots={}", there.display());
        let log = fs::File::create(cell.folder.join(format!("{name}.log"))).unwrap();
        let mut agent = cell.command(&["agent", &on, "--machine", name, "--workers", "1", "--prepared", &prepared]);
        sesame_peers::Ended(agent.stderr(log).spawn().unwrap())
    };
    let refusing = start("other");
    let run = started(cell.run("remote", Some(&on)).args(["--prepared", "robots"]));
    until("it refuses", || {
        let said = fs::read_to_string(cell.folder.join("other.log")).unwrap();
        said.contains("sim.py has another content than where the campaign was started")
    });
    drop(refusing);
    fs::write(there.join("sim.py"), original).unwrap();
    let _agent = start("same");
    assert_eq!(finished(run).expect(0).digest(), digest);
}

#[test]
fn a_campaign_waits_for_agents_and_says_which_command_starts_one() {
    let cell = Cell::new("agents_awaited");
    let on = cell.folder.join("queue").display().to_string();
    let log = cell.folder.join("run.log");
    let run = started_with_log(&mut cell.run("remote", Some(&on)), &log);
    let said = |what: &str| fs::read_to_string(&log).unwrap().contains(what);
    let hint = format!("no agent works for this campaign: start one with `sesamec agent {on}`");
    until("it says which command starts one", || said(&hint));
    let _agent = cell.agent(&on, "late");
    finished(run).expect(0);
    assert!(said("`late` has joined"));
    assert_eq!(machines(&cell, "remote"), BTreeSet::from(["late".to_owned()]));
}
