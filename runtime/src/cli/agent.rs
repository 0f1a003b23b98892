//! `sesamec agent` and `sesamec agents`: this machine as one of many, and all of them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use clap::{Args, Subcommand};
use serde::Serialize;

use sesame_base::visible::visible_lines;
use sesame_queue::announcement::Announcement;
use sesame_queue::message::{AgentName, Presence, Supervision};
use sesame_queue::queue::{HERE, Queue, QueueError};
use sesame_queue::token::{Kind, Token};

use crate::campaign::{self, AgentSettings};
use crate::cli::execution::{interruptible, seconds};
use crate::cli::failure::Failure;
use crate::cli::fleet::{QueueArgs, VERSION, machine, target};
use crate::cli::forecast::{self, ForecastArgs};
use crate::cli::slurm::{self, SlurmArgs};
use crate::cli::terminal::{Format, print, print_json, say};

/// The most agents that share a folder.
const MOST_AGENTS: u32 = 1000;

/// Run tests of campaigns that other machines announce.
#[derive(Debug, Args)]
pub struct AgentArgs {
    /// The queue: the URL of a broker of NATS, for example `nats://127.0.0.1:4222`, or a folder that all machines share
    #[arg(value_name = "URL")]
    queue: String,
    /// How many tests run at once; by default one per processor
    #[arg(long, value_name = "N")]
    workers: Option<NonZeroU32>,
    /// What this machine is called; by default its host name
    #[arg(long, value_name = "NAME")]
    machine: Option<String>,
    /// Folder for files of campaigns and of workers; by default `sesame/agents` in the user's folder of caches
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// A folder of a space that is on this machine already, as `--prepared NAME` of a campaign names it
    #[arg(long, value_name = "NAME=DIR", value_parser = prepared)]
    prepared: Vec<(String, PathBuf)>,
    /// End after this many seconds without a test
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    leave_after: Option<Duration>,
    #[command(flatten)]
    access: QueueArgs,
}

/// List the agents and campaigns of a queue.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct AgentsArgs {
    #[command(subcommand)]
    task: Option<Task>,
    /// The queue: the URL of a broker of NATS, or a folder that all machines share
    #[arg(value_name = "URL", required = true)]
    queue: Option<String>,
    /// Remove a campaign that nobody will go on with, by its id
    #[arg(long, value_name = "ID")]
    remove: Option<String>,
    /// The format
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    #[command(flatten)]
    access: QueueArgs,
}

/// What else there is to do with agents.
#[derive(Debug, Subcommand)]
pub(super) enum Task {
    /// Simulate how long a campaign takes with other numbers of agents, and what that costs
    Forecast(ForecastArgs),
    /// Start agents on the nodes of a cluster that Slurm manages, as one array of jobs
    Slurm(SlurmArgs),
}

fn prepared(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, folder)) if !name.is_empty() && !folder.is_empty() => Ok((name.to_owned(), folder.into())),
        _ => Err("expected a name and a folder, for example `cell=/opt/cell`".to_owned()),
    }
}

/// The file in a folder that says that an agent made it.
const MARK: &str = "of-an-agent";

/// A folder that all agents of this user on this machine share, and no other machine.
fn of_this_machine() -> std::io::Result<PathBuf> {
    #[cfg(unix)]
    let user = rustix::process::getuid().as_raw().to_string();
    #[cfg(not(unix))]
    let user = std::env::var("USERNAME").unwrap_or_default();
    let folder = std::env::temp_dir().join(format!("sesame-agents-{user}"));
    fs::create_dir_all(&folder)?;
    folder.canonicalize()
}

/// A folder of this agent alone, which is locked as long as the file lives.
fn own_folder(parent: &std::path::Path) -> Result<(PathBuf, File), Failure> {
    fs::create_dir_all(parent)?;
    for number in 1..=MOST_AGENTS {
        let lock = File::options()
            .create(true)
            .truncate(false)
            .write(true)
            .open(parent.join(format!("agent-{number}.lock")))?;
        match lock.try_lock() {
            Ok(()) => {
                let folder = parent.join(format!("agent-{number}"));
                if folder.exists() {
                    // What an agent that was killed left behind, and nothing else.
                    if !folder.join(MARK).is_file() {
                        return Err(Failure(format!(
                            "{} was not made by an agent: name another folder with `--folder DIR`",
                            folder.display()
                        )));
                    }
                    fs::remove_dir_all(&folder)?;
                }
                fs::create_dir_all(&folder)?;
                fs::write(folder.join(MARK), "")?;
                return Ok((folder.canonicalize()?, lock));
            }
            Err(fs::TryLockError::WouldBlock) => {}
            Err(fs::TryLockError::Error(error)) => return Err(error.into()),
        }
    }
    Err(Failure(format!("{MOST_AGENTS} agents work in {} already", parent.display())))
}

fn default_folder() -> Option<PathBuf> {
    let caches = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from).filter(|folder| folder.is_absolute());
    let home = || std::env::home_dir().map(|home| home.join(".cache"));
    Some(caches.or_else(home)?.join("sesame").join("agents"))
}

/// The queue, as soon as it can be reached: machines may be started in any order. `None` if the user ends the agent
/// before.
fn awaited(args: &AgentArgs, stop: &AtomicBool) -> Result<Option<Arc<dyn Queue>>, Failure> {
    let mut told = false;
    while !stop.load(Ordering::Relaxed) {
        match args.access.connect(&args.queue) {
            Ok(queue) => return Ok(Some(queue)),
            Err(error @ QueueError::Unreachable { .. }) => {
                if !told {
                    say(format_args!(
                        "{}; the agent waits for it, and Ctrl-C ends it",
                        visible_lines(&error.to_string())
                    ));
                }
                told = true;
                thread::sleep(HERE);
            }
            Err(error) => return Err(Failure(error.to_string())),
        }
    }
    Ok(None)
}

/// Carries out `sesamec agent`.
pub(super) fn agent(args: &AgentArgs) -> Result<ExitCode, Failure> {
    let mut folders = BTreeMap::new();
    for (name, folder) in &args.prepared {
        let found = folder.canonicalize().ok().filter(|folder| folder.is_dir());
        let found = found.ok_or_else(|| Failure(format!("{} is not a folder", folder.display())))?;
        folders.insert(name.clone(), found);
    }
    let parent = args.folder.clone().or_else(default_folder);
    let parent = parent
        .ok_or_else(|| Failure("the user's folder of caches is unknown: name one with `--folder DIR`".to_owned()))?;
    let (folder, _lock) = own_folder(&parent)?;
    let stop = interruptible()?;
    let Some(queue) = awaited(args, &stop)? else { return Ok(ExitCode::SUCCESS) };
    let token = args.access.token()?;
    let processors = || thread::available_parallelism().ok().and_then(|count| u32::try_from(count.get()).ok());
    // A token of its own is a fresh random number.
    let id = Token::random().map_err(Failure)?.text()[..16].to_owned();
    let name = AgentName { machine: args.machine.clone().unwrap_or_else(machine), id };
    let settings = AgentSettings {
        queue,
        token,
        name,
        workers: args.workers.map(NonZeroU32::get).or_else(processors).unwrap_or(1),
        folder,
        shared: of_this_machine()?,
        prepared: folders,
        version: VERSION.to_owned(),
        target: target(),
        leave_after: args.leave_after,
    };
    say(format_args!(
        "`{}` waits for campaigns on {} and runs {}; Ctrl-C ends it",
        settings.name.machine,
        settings.queue.place(),
        if settings.workers == 1 {
            "one test at a time".to_owned()
        } else {
            format!("up to {} tests at once", settings.workers)
        }
    ));
    campaign::work(&settings, &stop, &|text| say(format_args!("{}", visible_lines(text))));
    fs::remove_dir_all(&settings.folder)?;
    Ok(ExitCode::SUCCESS)
}

/// What a queue holds, for people and programs.
#[derive(Debug, Serialize)]
struct QueueContents {
    /// The agents that are there, by machine.
    agents: Vec<ListedAgent>,
    /// The campaigns whose tests agents may take.
    campaigns: Vec<ListedCampaign>,
    /// How many agents and campaigns have another token, so that nothing is known of them.
    others: usize,
}

/// An agent.
#[derive(Debug, Serialize)]
struct ListedAgent {
    /// The name of its machine.
    machine: String,
    /// What tells it from other agents of its machine.
    id: String,
    /// How many tests it runs at once.
    workers: u32,
    /// How many it runs now.
    busy: u32,
    /// How many tests it has finished since it was started.
    finished: u64,
    /// The version of its program.
    version: String,
    /// The campaign it works for; `null` while it waits for one.
    campaign: Option<String>,
    /// The campaigns that it cannot work for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    refused: Vec<RefusedCampaign>,
}

/// A campaign that an agent cannot work for.
#[derive(Debug, Serialize)]
struct RefusedCampaign {
    /// The campaign's id.
    campaign: String,
    /// Why not, in a sentence.
    reason: String,
}

/// A campaign in a queue.
#[derive(Debug, Serialize)]
struct ListedCampaign {
    /// What names it in the queue.
    id: String,
    /// What people call it.
    title: String,
    /// The version of the program that it runs with.
    version: String,
    /// Whether its supervisor is there. Without it, no test is run: `resume` goes on with the campaign.
    supervised: bool,
    /// Machines that get no more of its tests.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    put_aside: Vec<MachinePutAside>,
}

/// A machine that gets no more tests of a campaign.
#[derive(Debug, Serialize)]
struct MachinePutAside {
    /// The machine's name.
    machine: String,
    /// Why, in a sentence.
    reason: String,
}

impl From<Presence> for ListedAgent {
    fn from(presence: Presence) -> Self {
        let Presence { agent: AgentName { machine, id }, workers, busy, finished, version, campaign, refused } =
            presence;
        let refused = refused.into_iter().map(|(campaign, reason)| RefusedCampaign { campaign, reason }).collect();
        ListedAgent { machine, id, workers, busy, finished, version, campaign, refused }
    }
}

impl ListedCampaign {
    fn new(announcement: Announcement, supervised: bool) -> Self {
        let Announcement { campaign: id, title, version, put_aside, program: _ } = announcement;
        let put_aside = put_aside.into_iter().map(|(machine, reason)| MachinePutAside { machine, reason }).collect();
        ListedCampaign { id, title, version, supervised, put_aside }
    }
}

/// Carries out `sesamec agents`.
pub(super) fn agents(args: &AgentsArgs) -> Result<ExitCode, Failure> {
    match &args.task {
        Some(Task::Forecast(wanted)) => return forecast::forecast(wanted),
        Some(Task::Slurm(wanted)) => return slurm::submit(wanted),
        None => {}
    }
    let queue = args.access.open(args.queue.as_ref().expect("it is required"))?;
    let place = queue.place();
    // A token that was made only now opens nothing, so all that is there is of others.
    let token = args.access.known_token()?.map_or_else(Token::random, Ok).map_err(Failure)?;
    let failed = |error: sesame_queue::queue::QueueError| Failure(error.to_string());
    if let Some(campaign) = &args.remove {
        if !queue.announcements().map_err(failed)?.iter().any(|(known, _)| known == campaign) {
            return Err(Failure(format!("there is no campaign `{campaign}` on {place}")));
        }
        queue.remove(campaign).map_err(failed)?;
        return Ok(ExitCode::SUCCESS);
    }
    // Each agent says once within this time that it is there.
    thread::sleep(HERE + HERE / 2);
    let mut contents = QueueContents { agents: Vec::new(), campaigns: Vec::new(), others: 0 };
    let announced = queue.announcements().map_err(failed)?;
    let mut supervised = BTreeSet::new();
    for sealed in queue.presences().map_err(failed)? {
        if let Some(said) = Supervision::read(&token, &sealed) {
            supervised.insert(said.campaign);
        } else if let Ok(presence) = token.open::<Presence>(Kind::Presence, "", &sealed) {
            contents.agents.push(presence.into());
        } else {
            contents.others += 1;
        }
    }
    contents.agents.sort_by(|a, b| (&a.machine, &a.id).cmp(&(&b.machine, &b.id)));
    for (campaign, sealed) in announced {
        match token.open::<Announcement>(Kind::Announcement, &campaign, &sealed) {
            Ok(announcement) => {
                let is_supervised = supervised.contains(&campaign);
                contents.campaigns.push(ListedCampaign::new(announcement, is_supervised));
            }
            Err(_) => contents.others += 1,
        }
    }
    match args.format {
        Format::Json => print_json(&contents),
        Format::Text => print(&text(&contents, &place)),
    }
}

fn text(contents: &QueueContents, place: &str) -> String {
    let mut lines = Vec::new();
    for ListedAgent { machine, workers, busy, finished, campaign, refused, .. } in &contents.agents {
        let title = |id: &String| {
            let known = contents.campaigns.iter().find(|campaign| campaign.id == *id);
            known.map_or_else(|| id.clone(), |campaign| campaign.title.clone())
        };
        let works = campaign.as_ref().map_or_else(|| "waits".to_owned(), |id| format!("works for {}", title(id)));
        let tests = if *finished == 1 { "test" } else { "tests" };
        lines.push(format!("agent `{machine}` {works}: {busy} of {workers} workers busy, {finished} {tests} run"));
        lines.extend(refused.iter().map(|each| format!("    refuses {}: {}", each.campaign, each.reason)));
    }
    for ListedCampaign { id, title, supervised, put_aside, .. } in &contents.campaigns {
        lines.push(format!("campaign {id}: {title}"));
        if !supervised {
            lines.push(format!(
                "    its supervisor has gone: continue with `sesamec resume`, or delete it with `--remove {id}`"
            ));
        }
        lines.extend(put_aside.iter().map(|each| format!("    `{}` was put aside: {}", each.machine, each.reason)));
    }
    if contents.others > 0 {
        lines.push(campaign::strangers(contents.others, place));
    }
    if lines.is_empty() {
        lines.push("no agents and no campaigns".to_owned());
    }
    lines.push(String::new());
    visible_lines(&lines.join("\n")).into_owned()
}
