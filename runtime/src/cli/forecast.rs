//! `sesamec agents forecast`: how long a campaign would take with other numbers of agents.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use serde::Serialize;

use sesame_queue::simulation::{Agents, Campaign, simulate};
use sesame_record::Repository;

use crate::cli::execution::{seconds, shown};
use crate::cli::failure::Failure;
use crate::cli::progress_line::wait;
use crate::cli::terminal::{Format, print, print_json};

/// How often each number of agents is simulated; averages are shown.
const REPETITIONS: u32 = 5;

/// The most agents, and the most tests, that are simulated.
const MOST: u32 = 1_000_000;

/// Simulate how long a campaign takes with other numbers of agents, and what that costs.
#[derive(Debug, Args)]
pub(super) struct ForecastArgs {
    /// The folder of a run like it, for example `results/42`: its tests say how long tests take, how many there are,
    /// and how large generations are
    #[arg(value_name = "RUN", required_unless_present_all = ["test", "tests"])]
    run: Option<PathBuf>,
    /// How long a test takes, in seconds, in place of the times of a run; needs `--tests`
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    test: Option<Duration>,
    /// How many tests the campaign has; by default as many as the run
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST)))]
    tests: Option<u32>,
    /// How many tests the search asks for at a time: its population. By default as in the run, or all
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    generation: Option<u32>,
    /// Numbers of agents
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_values_t = [1, 2, 5, 10, 20, 50, 100, 1000],
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST)))]
    agents: Vec<u32>,
    /// How many tests each agent runs at once
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    workers: u32,
    /// How long a message takes from an agent to the supervisor through the queue, or back, in seconds
    #[arg(long, value_name = "SECONDS", value_parser = not_negative, default_value_t = 0.005)]
    latency: f64,
    /// How long the supervisor is busy with each result, in seconds
    #[arg(long, value_name = "SECONDS", value_parser = not_negative, default_value_t = 0.002)]
    supervisor: f64,
    /// How many hours an agent is there on average until it is lost; by default none is
    #[arg(long, value_name = "HOURS", value_parser = positive)]
    lifetime: Option<f64>,
    /// How long a lost agent takes to come back, in seconds
    #[arg(long, value_name = "SECONDS", value_parser = not_negative, default_value_t = 60.0)]
    absence: f64,
    /// The share of machines that are slower than others, from 0 to 1
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.0)]
    slow: f64,
    /// How many times as long a test takes on those
    #[arg(long, value_name = "FACTOR", value_parser = positive, default_value_t = 3.0)]
    slower: f64,
    /// The chance that the environment of a machine breaks off a test, from 0 to 1
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = 0.0)]
    broken_off: f64,
    /// What an hour of an agent costs, in any currency
    #[arg(long, value_name = "PRICE", value_parser = not_negative)]
    price: Option<f64>,
    /// The seed of the simulation
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// The format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

fn number(text: &str, fits: fn(f64) -> bool, wanted: &str) -> Result<f64, String> {
    text.parse().ok().filter(|&number: &f64| number.is_finite() && fits(number)).ok_or_else(|| wanted.to_owned())
}

fn not_negative(text: &str) -> Result<f64, String> {
    number(text, |number| number >= 0.0, "not a number of 0 or more")
}

fn positive(text: &str) -> Result<f64, String> {
    number(text, |number| number > 0.0, "not a number above 0")
}

fn share(text: &str) -> Result<f64, String> {
    number(text, |number| (0.0..=1.0).contains(&number), "not a number from 0 to 1")
}

/// The averages of some simulations.
#[derive(Debug, Serialize)]
struct ForecastRow {
    /// How many agents.
    agents: u32,
    /// Seconds from the first test to the last result.
    wall_s: f64,
    /// The time of all tests, one after the other, in relation to that.
    speed_up: f64,
    /// The speed-up in relation to the number of tests that could run at once.
    efficiency: f64,
    /// How many hours all agents were there, together.
    agent_hours: f64,
    /// What that costs, if a price is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    cost: Option<f64>,
    /// How many agents were lost.
    lost: f64,
    /// How many tests have no result, since each machine that took them was lost or put aside.
    without_result: f64,
}

/// What a run says of campaigns like it.
fn like(run: &Path) -> Result<Campaign, Failure> {
    let results = Repository::open(run)?;
    let (mut durations, mut generations) = (Vec::new(), std::collections::BTreeMap::<u32, u32>::new());
    let last = results.numbers()?.last().copied().unwrap_or(0);
    for record in results.records(0..=last, false)? {
        // A duplicate was not run.
        let duration = Some(record.observation.wall.run).filter(|_| record.duplicate_of.is_none());
        durations.extend(duration.filter(|seconds| *seconds > 0.0));
        if let Some(generation) = record.generation {
            *generations.entry(generation).or_default() += 1;
        }
    }
    if durations.is_empty() {
        return Err(Failure(format!("no test has ended in {}", shown(run))));
    }
    let tests = generations.values().sum::<u32>().max(1);
    let plan = results.plan();
    // Such a search begins with its next tests before the last ones of a generation end.
    let asks_ahead = sesame_search::strategy(plan, 0).is_ok_and(|strategy| strategy.asks_ahead());
    let waits = !asks_ahead || plan.campaign.confirm.is_some() || !plan.campaign.stop.is_empty();
    let generation = generations.into_values().max().filter(|_| waits).unwrap_or(tests);
    Ok(Campaign { tests, generation, durations })
}

/// Carries out `sesamec agents forecast`.
pub(super) fn forecast(args: &ForecastArgs) -> Result<ExitCode, Failure> {
    let mut campaign = match &args.run {
        Some(run) => like(run)?,
        None => Campaign { tests: MOST, generation: MOST, durations: Vec::new() },
    };
    if let Some(test) = args.test {
        campaign.durations = vec![test.as_secs_f64()];
    }
    campaign.tests = args.tests.unwrap_or(campaign.tests);
    campaign.generation = args.generation.unwrap_or(campaign.generation).min(campaign.tests);
    let rows: Vec<ForecastRow> = args.agents.iter().map(|&agents| row(args, &campaign, agents)).collect();
    match args.format {
        Format::Json => print_json(&rows),
        Format::Text => print(&text(&campaign, &rows)),
    }
}

fn row(args: &ForecastArgs, campaign: &Campaign, agents: u32) -> ForecastRow {
    let imagined = Agents {
        agents,
        workers: args.workers,
        latency: args.latency,
        lifetime: args.lifetime.map(|hours| 3600.0 * hours),
        absence: args.absence,
        redelivery: 2.0,
        slow: args.slow,
        slower: args.slower,
        broken_off: args.broken_off,
        supervisor: args.supervisor,
    };
    let all: Vec<_> =
        (0..REPETITIONS).map(|time| simulate(&imagined, campaign, args.seed.wrapping_add(u64::from(time)))).collect();
    let mean = |value: &dyn Fn(&sesame_queue::simulation::Forecast) -> f64| {
        all.iter().map(value).sum::<f64>() / f64::from(REPETITIONS)
    };
    let wall = mean(&|forecast| forecast.wall);
    let speed_up = mean(&|forecast| forecast.alone) / wall;
    let agent_hours = f64::from(agents) * wall / 3600.0;
    #[expect(clippy::cast_precision_loss, reason = "there are no more than 2^52")]
    let lost = mean(&|forecast| forecast.lost as f64);
    ForecastRow {
        agents,
        wall_s: wall,
        speed_up,
        efficiency: speed_up / f64::from(agents) / f64::from(args.workers),
        agent_hours,
        cost: args.price.map(|price| price * agent_hours),
        lost,
        without_result: mean(&|forecast| f64::from(forecast.without_result)),
    }
}

fn text(campaign: &Campaign, rows: &[ForecastRow]) -> String {
    let mean = campaign.durations.iter().sum::<f64>() / campaign.durations.len() as f64;
    let with_cost = rows.iter().any(|row| row.cost.is_some());
    let with_losses = rows.iter().any(|row| row.lost + row.without_result > 0.0);
    let line = |cells: [String; 8]| {
        let [agents, time, speed_up, efficiency, hours, cost, lost, without] = cells;
        let cost = if with_cost { format!("  {cost:>10}") } else { String::new() };
        let losses = if with_losses { format!("  {lost:>6}  {without:>14}") } else { String::new() };
        format!("{agents:>8}  {time:>10}  {speed_up:>8}  {efficiency:>10}  {hours:>11}{cost}{losses}")
    };
    let mut lines = vec![
        format!(
            "{} tests of {mean:.3} s on average, in generations of {}; averages of {REPETITIONS} simulations",
            campaign.tests, campaign.generation
        ),
        line(
            ["agents", "time", "speed-up", "efficiency", "agent-hours", "cost", "lost", "without result"]
                .map(str::to_owned),
        ),
    ];
    lines.extend(rows.iter().map(|row| {
        line([
            row.agents.to_string(),
            wait(row.wall_s),
            format!("{:.1}", row.speed_up),
            format!("{:.0} %", 100.0 * row.efficiency),
            format!("{:.2}", row.agent_hours),
            row.cost.map_or(String::new(), |cost| format!("{cost:.2}")),
            format!("{:.1}", row.lost),
            format!("{:.1}", row.without_result),
        ])
    }));
    lines.push(String::new());
    lines.join("\n")
}
