//! A monitor as a program of its own, which a generated `main` is nothing but a call of: beside a system on a bus,
//! between a runner and its simulator, or on a recording.
//!
//! What it decides is what the runner's own monitor decides on the same messages: both run the same code.

mod beside;
mod guest;
mod show;

use std::borrow::Cow;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{CommandFactory as _, FromArgMatches as _, Parser};

use sesame_base::gathered::gathered;
use sesame_base::visible::{visible, visible_lines};
use sesame_plan::{CampaignPlan, Endpoint, Monitor, is_shared};
use sesame_recording::feed_telling;
use sesame_relay::metric::MetricTable;
use sesame_relay::monitor::Decided;
use sesame_relay::transport::Connect;
use sesame_relay::wire::WireTable;

use crate::output::{Failure, Format, say};
use crate::standalone::show::Shown;

/// A monitor: what a generated crate hands to the runtime.
#[derive(Debug, Clone)]
pub struct Standalone {
    /// The plan, as `monitor.plan.json` holds it.
    pub plan: Cow<'static, str>,
    /// How the system is reached; `None` for a simulator that is a program or a part of its runner.
    pub connect: Option<Connect>,
}

const ABOUT: &str = "Exit codes: 0 done: the recording or the input has ended, or Ctrl-C or SIGTERM has stopped the \
                     monitor; 1 failed; 2 wrong usage.";

#[derive(Debug, Parser)]
#[command(version, after_help = ABOUT)]
struct StandaloneArgs {
    /// Run on a recording instead of a system: MCAP, as campaigns record with `record mcap`, a folder of rosbag2 with
    /// MCAP, or a `.bag` of ROS 1
    #[arg(long, value_name = "FILE", conflicts_with_all = ["program", "domain", "url"])]
    recording: Option<PathBuf>,
    /// The format of decisions on standard output; JSON has one object per line
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// Also write decisions into this file, as `--format json` shows them; an existing file is replaced
    #[arg(long, value_name = "FILE")]
    decisions: Option<PathBuf>,
    /// The domain of ROS 2; by default that of the space
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=232))]
    domain: Option<u16>,
    /// The address of the bridge, broker or master; by default that of the space
    #[arg(long, value_name = "URL")]
    url: Option<String>,
    /// Another name for a topic on a bus, such as `/eddi/state:=/eddi/state/undisturbed`: a runner asks for it if
    /// operations act on what the monitor publishes. May be repeated, with or without `-r`
    #[arg(short = 'r', long = "remap", value_name = "FROM:=TO", conflicts_with_all = ["recording", "program"])]
    remap: Vec<String>,
    #[arg(value_name = "FROM:=TO", hide = true, conflicts_with_all = ["recording", "program"])]
    remap_too: Vec<String>,
    /// What stands before rules of ROS 2
    #[arg(long, hide = true)]
    ros_args: bool,
    /// The simulator with its arguments. A runner that starts this program instead, as its `process`, reaches the
    /// simulator through the monitor
    #[arg(last = true, value_name = "PROGRAM")]
    program: Vec<OsString>,
}

/// The command line of a monitor. A generated `main` is nothing but this call.
pub fn main(standalone: &Standalone) -> ExitCode {
    carried_out(standalone).unwrap_or_else(|Failure(words)| {
        say(format_args!("error: {}", visible_lines(&words)));
        ExitCode::FAILURE
    })
}

fn carried_out(standalone: &Standalone) -> Result<ExitCode, Failure> {
    let plan: CampaignPlan = serde_json::from_str(&standalone.plan)
        .map_err(|error| Failure(format!("this monitor's plan cannot be read: {error}")))?;
    let published = plan.monitors.iter().find(|monitor| monitor.publishes.is_some());
    let Some(monitor) = published.cloned() else {
        return Err(Failure("this monitor's plan has no monitor that publishes".to_owned()));
    };
    let args = args(&plan, &monitor);
    let on_a_bus = args.recording.is_none() && args.program.is_empty();
    let plan = if on_a_bus { at(plan, &args)? } else { plan };
    let mut shown = Shown::new(&plan, args.format, args.decisions.as_deref())?;
    if let Some(recording) = &args.recording {
        return on_recording(&plan, recording, shown);
    }
    if let Some((program, arguments)) = args.program.split_first() {
        refuse_address(&args, "a simulator behind `--`")?;
        return beside::run(&plan, program, arguments, &mut shown);
    }
    let Some(connect) = &standalone.connect else {
        let how = match plan.simulator.program() {
            Some(_) => "is a program, which the monitor starts: give it behind `--`, with its arguments",
            None => "is a part of its runner, and no other program reaches it",
        };
        let problem = format!("the simulator `{}` {how}; or give a recording with `--recording`", plan.simulator.name);
        return Err(Failure(problem));
    };
    guest::run(&plan, connect, &mut shown)
}

fn args(plan: &CampaignPlan, monitor: &Monitor) -> StandaloneArgs {
    let mut about = format!("Monitor `{}` of the space `{}`.", monitor.name, plan.space);
    if !monitor.doc.is_empty() {
        about = format!("{about}\n\n{}", monitor.doc);
    }
    let relied_on: Vec<String> = plan
        .monitors
        .iter()
        .filter(|other| other.name != monitor.name)
        .map(|other| format!("`{}`", other.name))
        .collect();
    if !relied_on.is_empty() {
        about = format!("{about}\n\nIt relies on {}, which it evaluates, too.", relied_on.join(", "));
    }
    let command = StandaloneArgs::command().name(monitor.name.clone()).about(visible_lines(&about).into_owned());
    let matches = command.try_get_matches().unwrap_or_else(|error| error.exit());
    StandaloneArgs::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
}

/// The plan with the address and the names that were asked for.
fn at(mut plan: CampaignPlan, args: &StandaloneArgs) -> Result<CampaignPlan, Failure> {
    for rule in args.remap.iter().chain(&args.remap_too) {
        remap(&mut plan, rule)?;
    }
    let url = match plan.simulator.endpoint() {
        Some(Endpoint::Domain(domain)) => {
            if args.url.is_some() {
                return Err(Failure("a system of ROS 2 has no address: choose its domain with `--domain`".to_owned()));
            }
            *domain = args.domain.unwrap_or(*domain);
            return Ok(plan);
        }
        Some(Endpoint::Address(url)) => url,
        None => return Ok(plan),
    };
    if args.domain.is_some() {
        return Err(Failure("only a system of ROS 2 has a domain: choose an address with `--url`".to_owned()));
    }
    if let Some(asked) = &args.url {
        url.clone_from(asked);
    }
    if !is_shared(url) {
        let problem = format!("the address `{url}` differs for each worker of a runner: choose one with `--url`");
        return Err(Failure(visible(&problem)));
    }
    Ok(plan)
}

/// Gives a topic another name. As in ROS, names may begin with a slash or not.
fn remap(plan: &mut CampaignPlan, rule: &str) -> Result<(), Failure> {
    let Some((from, to)) = rule.split_once(":=").filter(|(from, to)| !from.is_empty() && !to.is_empty()) else {
        return Err(Failure(format!("`{}` is not a rule: write `FROM:=TO`, with names of topics", visible(rule))));
    };
    let is_it = |path: &&mut String| path.trim_start_matches('/') == from.trim_start_matches('/');
    // A runner gives rules for all that a node publishes or hears; the others are not of this monitor.
    for path in plan.topics.iter_mut().flat_map(|topic| &mut topic.paths).filter(is_it) {
        to.clone_into(path);
    }
    Ok(())
}

fn refuse_address(args: &StandaloneArgs, what: &str) -> Result<(), Failure> {
    match (&args.domain, &args.url) {
        (None, None) => Ok(()),
        _ => Err(Failure(format!("`--domain` and `--url` are for a system on a bus, not for {what}"))),
    }
}

fn on_recording(plan: &CampaignPlan, recording: &std::path::Path, mut shown: Shown<'_>) -> Result<ExitCode, Failure> {
    let wires = WireTable::new(plan);
    let table = MetricTable::new(plan, &wires, &[])?;
    let mut failure = None;
    let mut tell = |decided: &Decided| {
        if failure.is_none() {
            failure = shown.decided(None, decided).err();
        }
    };
    let fed = feed_telling(recording, plan, &wires, &table, Some(&mut tell))?;
    for warning in gathered(&fed.warnings) {
        say(format_args!("warning: {}", visible(&warning)));
    }
    failure.map_or(Ok(ExitCode::SUCCESS), Err)
}
