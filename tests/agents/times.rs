//! What agents cost and bring: the time that a queue adds to a test, the speed-up by a second agent, and how long it
//! takes until others go on with what a killed machine had taken; beside what `sesamec agents forecast` says.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use sesame_patience::until;
use sesame_peers::Ended;
use sesame_queue::nats::{Access, Nats};
use sesame_queue::queue::Queue;
use sesame_record::TestRecord;
use sesame_tests::done;

use crate::fleet::{Broker, Cell, finished, started};

const CAMPAIGN: &str = "0123456789abcdef";

/// The environment variable with the queue out of which [`a_machine_takes_a_test_and_keeps_it`] takes a test.
const HOLD: &str = "SESAME_TESTS_HOLD";

/// How many tests the campaigns have, of about a second each.
const TESTS: u32 = 60;

fn connected(broker: &Broker) -> Nats {
    let begun = Instant::now();
    loop {
        match Nats::connect(&broker.url(), &Access::default()) {
            Ok(queue) => return queue,
            Err(error) => assert!(begun.elapsed() < Duration::from_secs(60), "{error}"),
        }
    }
}

/// The value below which this share of all lies.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is a position among the values")]
    let at = ((values.len() as f64 * share).ceil() as usize).clamp(1, values.len());
    values[at - 1]
}

#[test]
#[ignore = "long: measures time"]
fn a_queue_adds_ten_milliseconds_to_a_test_at_most() {
    let Some(broker) = Broker::start() else { return };
    let [supervisor, agent] = [connected(&broker), connected(&broker)];
    supervisor.make_room(CAMPAIGN).unwrap();
    let mut took = Vec::new();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for _ in 0..300 {
                let test = agent.take_test(CAMPAIGN, Duration::from_secs(60)).unwrap().expect("there is a test");
                agent.put_result(CAMPAIGN, test.test()).unwrap();
                test.finish().unwrap();
            }
        });
        for number in 0..300 {
            let begun = Instant::now();
            supervisor.put_test(CAMPAIGN, format!("{number:2000}").as_bytes()).unwrap();
            supervisor.take_result(CAMPAIGN, Duration::from_secs(60)).unwrap().expect("there is a result");
            took.push(1000.0 * begun.elapsed().as_secs_f64());
        }
    });
    let [median, late] = [0.5, 0.95].map(|share| quantile(&mut took, share));
    println!("from test to result: {median:.1} ms in the median, {late:.1} ms at the 95th percentile");
    assert!(median <= 10.0, "{median} ms");
}

/// Not a test of its own: another process runs it, and is killed while it holds a test.
#[test]
#[ignore = "long: a part of another test"]
fn a_machine_takes_a_test_and_keeps_it() {
    let Ok(url) = std::env::var(HOLD) else { return };
    let queue = Nats::connect(&url, &Access::default()).unwrap();
    let _held = queue.take_test(CAMPAIGN, Duration::from_secs(60)).unwrap().expect("there is a test");
    println!("held");
    std::thread::sleep(Duration::from_secs(600));
}

#[test]
#[ignore = "long: measures time"]
fn what_a_killed_machine_had_taken_is_delivered_to_others_within_three_seconds() {
    let Some(broker) = Broker::start() else { return };
    let queue = connected(&broker);
    queue.make_room(CAMPAIGN).unwrap();
    let mut took = Vec::new();
    for number in 0..20u64 {
        queue.put_test(CAMPAIGN, format!("test {number}").as_bytes()).unwrap();
        let program = std::env::current_exe().unwrap();
        let mut machine = Command::new(program);
        machine.args(["--ignored", "--exact", "--nocapture", "times::a_machine_takes_a_test_and_keeps_it"]);
        let mut machine = Ended(machine.env(HOLD, broker.url()).stdout(Stdio::piped()).spawn().unwrap());
        let lines = sesame_peers::lines(machine.0.stdout.take().expect("it is piped"));
        until("the machine has the test", || lines.try_iter().any(|line| line.contains("held")));
        // At any moment between two signs of life.
        std::thread::sleep(Duration::from_millis(97 * number));
        let killed = Instant::now();
        drop(machine);
        queue.take_test(CAMPAIGN, Duration::from_secs(60)).unwrap().expect("it is delivered again").finish().unwrap();
        took.push(killed.elapsed().as_secs_f64());
    }
    let [median, late] = [0.5, 0.95].map(|share| quantile(&mut took, share));
    println!("from the kill to the next delivery: {median:.2} s in the median, {late:.2} s at the 95th percentile");
    assert!(late <= 3.0, "{late} s");
}

#[test]
#[ignore = "long: measures time"]
fn two_agents_are_almost_twice_as_fast_as_one_and_as_fast_as_forecast() {
    let Some(broker) = Broker::start() else { return };
    let cell = Cell::new("agents_times");
    cell.change_simulator(
        "        luck = random.Random(seed)\n",
        "        __import__(\"time\").sleep(0.9)\n        luck = random.Random(seed)\n",
    );
    cell.add_to_space(
        "campaign random {\n  objectives fuzzing_time, clearance\n  operations lose_east, lag_east  1..2 per test\n  \
         activate by time\n  search random { evaluations 60 }\n  end after 70s\n}\n",
    );
    let on = broker.url();
    let evaluations = TESTS.to_string();
    let mut walls = Vec::new();
    for agents in 1..=3usize {
        let results = format!("agents-{agents}");
        let _agents: Vec<Ended> =
            (0..agents).map(|number| cell.agent(&on, &format!("machine-{agents}-{number}"))).collect();
        let mut run = cell.command(&["run", "space/two_robots.sesame", "--campaign", "random", "--on", &on]);
        run.args(["--", "--seed", "5", "--evaluations", &evaluations, "--results", &results]);
        finished(started(&mut run)).expect(0);
        let recorded = cell.results(&results);
        let records = recorded.records(0..=TESTS + 1, false).unwrap();
        let (references, tests): (Vec<_>, Vec<_>) = records.iter().partition(|record| record.generation.is_none());
        let sum = |records: &[&TestRecord]| -> f64 { records.iter().map(|record| record.observation.wall.run).sum() };
        let alone = sum(&tests);
        let session = &recorded.sessions().unwrap()[0];
        // Before and after the tests, one machine runs the campaign without disturbance.
        let wall = session.ended_at.expect("it has ended") - session.started_at - sum(&references);
        let forecast = done(&mut cell.command(&[
            "agents",
            "forecast",
            &format!("{results}/5"),
            "--agents",
            &agents.to_string(),
            "--format",
            "json",
        ]));
        let forecast = forecast.expect(0).json()[0]["wall_s"].as_f64().expect("it is a number");
        println!("{agents} agents: {wall:.1} s, forecast {forecast:.1} s, the tests alone {alone:.1} s");
        walls.push(wall);
    }
    let speed_up = walls[0] / walls[1];
    println!("two agents are {speed_up:.2} times as fast as one");
    assert!(speed_up >= 1.9, "{speed_up}");
}
