//! An agent: takes tests of campaigns out of a queue, runs them in workers of this machine, and puts in what came of
//! them. A worker that crashes, hangs or is killed is dealt with as anywhere else, by a [`Pool`] of one.

mod slot;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use sesame_queue::announcement::{Announcement, Compiled, Files, Program};
use sesame_queue::bundle::{self, Manifest};
use sesame_queue::intake::Experience;
use sesame_queue::message::{AgentName, Presence, Supervision};
use sesame_queue::queue::{HERE, PAUSE, Queue, QueueError};
use sesame_queue::token::{Kind, SealError, Token};

use self::slot::Slot;
use crate::campaign::worker_program::WorkerProgram;
use crate::interpreted::Interpreted;

/// How an agent works.
pub struct AgentSettings {
    /// The queue.
    pub queue: Arc<dyn Queue>,
    /// The secret that it shares with supervisors.
    pub token: Token,
    /// Who it is.
    pub name: AgentName,
    /// How many tests it runs at once.
    pub workers: u32,
    /// A folder of its own, in which it keeps files of campaigns and lets workers work.
    pub folder: PathBuf,
    /// A folder of this machine alone, in which its agents say which workers they have.
    pub shared: PathBuf,
    /// Folders of spaces that this machine has already, by their names.
    pub prepared: BTreeMap<String, PathBuf>,
    /// The version of this program.
    pub version: String,
    /// The architecture and system of this machine, as a [compiled runner](Compiled) names its own.
    pub target: String,
    /// It ends after this long without a test; by default never.
    pub leave_after: Option<Duration>,
}

/// How long an agent without tests stays with a campaign while others wait for agents.
const LOYAL: Duration = Duration::from_secs(5);

/// What all threads of an agent share.
struct Agent<'a> {
    settings: &'a AgentSettings,
    stop: &'a AtomicBool,
    say: &'a (dyn Fn(&str) + Sync),
    /// How many tests it runs at once for the campaign that it works for.
    workers: AtomicU32,
    busy: AtomicU32,
    finished: AtomicU64,
    /// The campaign that it works for, or worked for last.
    campaign: Mutex<Option<String>>,
    works: AtomicBool,
    refused: Mutex<BTreeMap<String, String>>,
    /// Editions of campaigns that this machine could not prepare, each with the reason.
    unprepared: Mutex<BTreeMap<String, String>>,
    /// When it last had a test.
    worked: Mutex<Instant>,
}

/// Works until `stop` is set, or until there was nothing to do for long; `say` gets sentences for people.
pub fn work(settings: &AgentSettings, stop: &AtomicBool, say: &(dyn Fn(&str) + Sync)) {
    let agent = Agent {
        settings,
        stop,
        say,
        workers: AtomicU32::new(settings.workers),
        busy: AtomicU32::new(0),
        finished: AtomicU64::new(0),
        campaign: Mutex::default(),
        works: AtomicBool::new(false),
        refused: Mutex::default(),
        unprepared: Mutex::default(),
        worked: Mutex::new(Instant::now()),
    };
    let ended = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| agent.say_here(&ended));
        while !agent.is_over() {
            match agent.candidates() {
                Ok(candidates) => match agent.next_of(&candidates) {
                    Some(announcement) => agent.work_for(announcement),
                    None => thread::sleep(PAUSE),
                },
                Err(_) => thread::sleep(PAUSE),
            }
        }
        ended.store(true, Ordering::Relaxed);
    });
    // Without this, it counts as present for some seconds more.
    settings.queue.absent(&settings.name.id).ok();
}

impl Agent<'_> {
    fn stops(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Waits for this long, or until the agent is to end.
    fn await_stop(&self, limit: Duration) {
        let begun = Instant::now();
        while begun.elapsed() < limit && !self.stops() {
            thread::sleep(Duration::from_millis(10));
        }
    }

    /// How long it has had no test.
    fn idle(&self) -> Duration {
        if self.busy.load(Ordering::Relaxed) > 0 { Duration::ZERO } else { lock(&self.worked).elapsed() }
    }

    fn is_over(&self) -> bool {
        self.stops() || self.settings.leave_after.is_some_and(|limit| self.idle() > limit)
    }

    /// Says again and again that the agent is there.
    fn say_here(&self, ended: &AtomicBool) {
        let AgentSettings { queue, token, name, version, .. } = self.settings;
        while !ended.load(Ordering::Relaxed) {
            let works = self.works.load(Ordering::Relaxed);
            let presence = Presence {
                agent: name.clone(),
                workers: self.workers.load(Ordering::Relaxed),
                busy: self.busy.load(Ordering::Relaxed),
                finished: self.finished.load(Ordering::Relaxed),
                version: version.clone(),
                campaign: lock(&self.campaign).clone().filter(|_| works),
                refused: lock(&self.refused).clone().into_iter().collect(),
            };
            // Who cannot be heard now is heard later.
            queue.present(&name.id, &token.seal(Kind::Presence, "", &presence)).ok();
            let begun = Instant::now();
            while begun.elapsed() < HERE && !ended.load(Ordering::Relaxed) {
                thread::sleep(Duration::from_millis(50));
            }
        }
    }

    /// The campaigns that this agent can work for, and whose supervisors are there.
    fn candidates(&self) -> Result<Vec<Announcement>, QueueError> {
        let AgentSettings { queue, token, .. } = self.settings;
        let supervisions = queue.presences()?.into_iter().filter_map(|sealed| Supervision::read(token, &sealed));
        let supervised: BTreeSet<String> = supervisions.map(|said| said.campaign).collect();
        let (mut refused, mut found) = (BTreeMap::new(), Vec::new());
        for (campaign, sealed) in queue.announcements()? {
            match token.open::<Announcement>(Kind::Announcement, &campaign, &sealed) {
                Ok(announcement) => match self.refusal(&announcement) {
                    Some(reason) => _ = refused.insert(campaign, reason),
                    None if supervised.contains(&campaign) => found.push(announcement),
                    None => {}
                },
                Err(error @ SealError::OtherToken) => {
                    let remedy = "copy the file of the token from the machine that runs the campaign, see `sesamec agent --help`";
                    refused.insert(campaign, format!("{error}: {remedy}"));
                }
                Err(error @ SealError::Unreadable(_)) => {
                    refused.insert(campaign, format!("{error}: its sesamec is another version"));
                }
            }
        }
        let mut known = lock(&self.refused);
        for (campaign, reason) in refused.iter().filter(|(campaign, reason)| known.get(*campaign) != Some(*reason)) {
            (self.say)(&format!("campaign {campaign} is refused: {reason}"));
        }
        *known = refused;
        Ok(found)
    }

    /// The campaign whose turn it is: the one after that for which it worked last.
    fn next_of<'c>(&self, candidates: &'c [Announcement]) -> Option<&'c Announcement> {
        let last = lock(&self.campaign).clone();
        let after = candidates.iter().find(|candidate| last.as_ref().is_some_and(|last| candidate.campaign > *last));
        after.or_else(|| candidates.first())
    }

    /// Why this agent cannot run the tests of a campaign.
    fn refusal(&self, announcement: &Announcement) -> Option<String> {
        let AgentSettings { name, version, target, prepared, .. } = self.settings;
        if announcement.version != *version {
            return Some(format!(
                "it runs with version {} of sesamec, and this agent is version {version}: results could differ",
                announcement.version
            ));
        }
        if let Some((_, why)) = announcement.put_aside.iter().find(|(machine, _)| *machine == name.machine) {
            return Some(format!("this machine was put aside after {why}"));
        }
        match &announcement.program.compiled {
            Some(compiled) if compiled.target != *target => {
                return Some(format!("its runner was compiled for {}, and this machine is {target}", compiled.target));
            }
            _ => {}
        }
        match &announcement.program.space {
            Files::Prepared { name, .. } if !prepared.contains_key(name) => {
                return Some(format!(
                    "it needs a prepared folder `{name}`: start the agent with `--prepared {name}=FOLDER`"
                ));
            }
            _ => {}
        }
        lock(&self.unprepared).get(&announcement.edition()).cloned()
    }

    /// Runs tests of a campaign as long as it is announced in this edition, and nobody else needs this agent more.
    fn work_for(&self, announcement: &Announcement) {
        let program = match self.program(announcement) {
            Ok(program) => program,
            Err(Preparation::Gone) => return thread::sleep(PAUSE),
            Err(Preparation::Failed(reason)) => {
                lock(&self.unprepared)
                    .insert(announcement.edition(), format!("this machine cannot prepare it: {reason}"));
                return;
            }
        };
        *lock(&self.campaign) = Some(announcement.campaign.clone());
        *lock(&self.worked) = Instant::now();
        let workers = if announcement.program.one_at_a_time { 1 } else { self.settings.workers };
        self.workers.store(workers, Ordering::Relaxed);
        self.works.store(true, Ordering::Relaxed);
        (self.say)(&format!("works for {}", announcement.title));
        let before = self.finished.load(Ordering::Relaxed);
        let leaves = AtomicBool::new(false);
        let experience = Mutex::new(Experience::default());
        let edition = announcement.edition();
        thread::scope(|scope| {
            for worker in 1..=workers {
                let mut slot = Slot {
                    agent: self,
                    announcement,
                    edition: &edition,
                    program: &program,
                    worker,
                    pool: None,
                    experience: &experience,
                    leaves: &leaves,
                };
                scope.spawn(move || slot.work());
            }
            while !self.is_over() {
                thread::sleep(PAUSE);
                // While the queue cannot be reached, what was taken is run.
                let Ok(candidates) = self.candidates() else { continue };
                let is_this = |candidate: &Announcement| {
                    candidate.campaign == announcement.campaign && candidate.edition() == edition
                };
                if !candidates.iter().any(is_this) || candidates.len() > 1 && self.idle() > LOYAL {
                    break;
                }
            }
            leaves.store(true, Ordering::Relaxed);
        });
        self.works.store(false, Ordering::Relaxed);
        self.workers.store(self.settings.workers, Ordering::Relaxed);
        let ran = self.finished.load(Ordering::Relaxed) - before;
        (self.say)(&format!("has left {} after {ran} {}", announcement.title, if ran == 1 { "test" } else { "tests" }));
        // What it unpacked is of no use to another campaign.
        fs::remove_dir_all(self.settings.folder.join(&announcement.campaign)).ok();
    }

    /// What the workers of a campaign are started with. Its files are unpacked first.
    fn program(&self, announcement: &Announcement) -> Result<WorkerProgram, Preparation> {
        let Program { plan, space, simulator, hooks, compiled, one_at_a_time: _ } = &announcement.program;
        let own = self.settings.folder.join(&announcement.campaign);
        // What an earlier edition of the campaign left here may have other files.
        match fs::remove_dir_all(&own) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(Preparation::Failed(format!("{}: {error}", own.display())));
            }
            _ => {}
        }
        let folder = match space {
            Files::Prepared { name, files } => {
                let folder = self.settings.prepared[name].clone();
                bundle::compare(files, &folder).map_err(|error| Preparation::Failed(error.to_string()))?;
                folder
            }
            Files::Bundle(manifest) => {
                let folder = own.join("space");
                self.unpack(announcement, manifest, &folder)?;
                folder
            }
        };
        let failed = |error: std::io::Error| Preparation::Failed(error.to_string());
        let space = fs::canonicalize(&folder).map_err(failed)?;
        // The runner's folder is one below that of the space, whatever its name was.
        let directory = own.join("runner");
        fs::create_dir_all(&directory).map_err(failed)?;
        let simulator = if simulator.is_empty() {
            space.clone()
        } else {
            space.join(bundle::inside(simulator).map_err(|error| Preparation::Failed(error.to_string()))?)
        };
        let hooks = hooks.as_deref().map(serde_json::from_str).transpose();
        let hooks = hooks.map_err(|error| Preparation::Failed(format!("its hooks cannot be read: {error}")))?;
        let runner = Interpreted { plan: plan.clone(), directory, space, simulator, hooks };
        match compiled {
            None => WorkerProgram::interpreted(&runner).map_err(failed),
            Some(Compiled { program, .. }) => {
                let folder = own.join("program");
                let file = bundle::inside(&program.path).map_err(|error| Preparation::Failed(error.to_string()))?;
                self.unpack(announcement, &Manifest { files: vec![program.clone()] }, &folder)?;
                WorkerProgram::compiled_at(&folder.join(file), &runner).map_err(failed)
            }
        }
    }

    /// Writes files of a campaign into a folder.
    fn unpack(&self, announcement: &Announcement, manifest: &Manifest, folder: &Path) -> Result<(), Preparation> {
        let mut gone = false;
        let unpacked = bundle::unpack(manifest, folder, &mut |entry| {
            let content = self.settings.queue.file(&announcement.campaign, &entry.hash);
            gone |= !matches!(content, Ok(Some(_)));
            Ok(content.ok().flatten().unwrap_or_default())
        });
        match unpacked {
            Err(_) if gone => Err(Preparation::Gone),
            unpacked => unpacked.map_err(|error| Preparation::Failed(error.to_string())),
        }
    }
}

/// Why a campaign cannot be prepared.
enum Preparation {
    /// Its files are not there, or not yet.
    Gone,
    /// This machine cannot.
    Failed(String),
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
