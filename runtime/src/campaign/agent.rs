//! An agent: takes tests of campaigns out of a queue, runs them in workers of this machine, and puts in what came of
//! them. A worker that crashes, hangs or is killed is dealt with as anywhere else, by a [`Pool`] of one.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use sesame_base::observation::Outcome;
use sesame_plan::Test;
use sesame_queue::announcement::{Announcement, Compiled, Files, Program};
use sesame_queue::bundle::{self, Manifest};
use sesame_queue::intake::{Decision, Experience, decide};
use sesame_queue::message::{AgentName, Ended, EndedAs, Presence, Supervision, Work, digest_of};
use sesame_queue::queue::{HERE, Held, Queue, QueueError};
use sesame_queue::token::{Kind, SealError, Token};

use crate::campaign::executor::{Executor as _, Job, JobResult};
use crate::campaign::pool::{Pool, PoolSettings, Retries};
use crate::campaign::worker_program::WorkerProgram;
use crate::interpreted::Interpreted;

/// How long a test is awaited before it is looked whether the agent is to end.
const WAIT: Duration = Duration::from_millis(500);

/// How long it is waited before a queue that cannot be reached is tried again.
const PAUSE: Duration = Duration::from_millis(200);

/// How much later than its worker an agent may get a signal that is meant for both.
const TOGETHER: Duration = Duration::from_millis(300);

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
        let present = queue.presences()?;
        let is_supervised = |campaign: &str| {
            present.iter().any(|sealed| {
                let said = token.open::<Supervision>(Kind::Supervision, campaign, sealed);
                said.is_ok_and(|said| said.campaign == campaign)
            })
        };
        let (mut refused, mut found) = (BTreeMap::new(), Vec::new());
        for (campaign, sealed) in queue.announcements()? {
            match token.open::<Announcement>(Kind::Announcement, &campaign, &sealed) {
                Ok(announcement) => match self.refusal(&announcement) {
                    Some(reason) => _ = refused.insert(campaign, reason),
                    None if is_supervised(&campaign) => found.push(announcement),
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
        let Program { plan, space, simulator, compiled, one_at_a_time: _ } = &announcement.program;
        let own = self.settings.folder.join(&announcement.campaign);
        // Of an earlier time, with other files.
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
        let runner = Interpreted { plan: plan.clone(), directory, space, simulator };
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

/// The most workers that the agents of a machine have together.
const MOST_WORKERS: usize = 10_000;

/// A lock on this machine, as long as the file lives; `None` if another process has it.
fn claim(path: &Path) -> std::io::Result<Option<File>> {
    let lock = File::options().create(true).truncate(false).write(true).open(path)?;
    match lock.try_lock() {
        Ok(()) => Ok(Some(lock)),
        Err(fs::TryLockError::WouldBlock) => Ok(None),
        Err(fs::TryLockError::Error(error)) => Err(error),
    }
}

/// A number that no worker of another agent of this machine has as long as the file lives: what tells the ports and
/// domains of workers apart follows from it.
fn claim_number(shared: &Path) -> std::io::Result<(usize, File)> {
    for number in 1..=MOST_WORKERS {
        if let Some(lock) = claim(&shared.join(format!("worker-{number}.lock")))? {
            return Ok((number, lock));
        }
    }
    Err(std::io::Error::other(format!("{MOST_WORKERS} workers of agents work on this machine already")))
}

/// One test after another, in one worker.
struct Slot<'a> {
    agent: &'a Agent<'a>,
    announcement: &'a Announcement,
    edition: &'a str,
    program: &'a WorkerProgram,
    worker: u32,
    /// The worker, and what holds its number.
    pool: Option<(Pool, File)>,
    experience: &'a Mutex<Experience>,
    leaves: &'a AtomicBool,
}

impl Slot<'_> {
    fn leaves(&self) -> bool {
        self.leaves.load(Ordering::Relaxed) || self.agent.stops()
    }

    fn work(&mut self) {
        // Of all agents of this machine, one at a time may run tests that would disturb each other.
        let mut alone = None;
        let queue = &self.agent.settings.queue;
        while !self.leaves() {
            if self.announcement.program.one_at_a_time && alone.is_none() {
                alone = claim(&self.agent.settings.shared.join("alone.lock")).ok().flatten();
                if alone.is_none() {
                    thread::sleep(PAUSE);
                    continue;
                }
            }
            match queue.take_test(&self.announcement.campaign, WAIT) {
                Ok(Some(held)) => {
                    self.agent.busy.fetch_add(1, Ordering::Relaxed);
                    self.deal_with(held);
                    *lock(&self.agent.worked) = Instant::now();
                    self.agent.busy.fetch_sub(1, Ordering::Relaxed);
                }
                Ok(None) => {}
                Err(_) => thread::sleep(PAUSE),
            }
        }
    }

    fn deal_with(&mut self, held: Box<dyn Held>) {
        let AgentSettings { token, name, .. } = self.agent.settings;
        let work = match token.open::<Work>(Kind::Work, &self.announcement.campaign, held.test()) {
            Ok(work) => work,
            Err(SealError::OtherToken) => {
                // Nobody who has the token put it in.
                held.finish().ok();
                return;
            }
            // Of another version: somebody else reads it.
            Err(SealError::Unreadable(_)) => return,
        };
        let outcome = if work.edition == self.edition {
            match decide(name, &work, held.deliveries()) {
                Decision::LeaveToOthers(rest) => {
                    self.rest(rest);
                    None
                }
                Decision::Poison { lost } => Some(EndedAs::Poison { lost }),
                Decision::Run => self.run(&work),
            }
        } else {
            // The campaign has other files by now; this agent will hear of it soon.
            self.rest(HERE);
            None
        };
        match outcome {
            Some(outcome) => self.conclude(held, &work, outcome),
            None => self.put_back(held, work),
        }
    }

    /// Waits for this long, or until the agent is to end.
    fn rest(&self, rest: Duration) {
        let begun = Instant::now();
        while begun.elapsed() < rest && !self.leaves() {
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Puts what came of a test into the queue, and holds the test until that is done.
    fn conclude(&self, held: Box<dyn Held>, work: &Work, outcome: EndedAs) {
        let AgentSettings { token, name, .. } = self.agent.settings;
        let Work { number, attempt, .. } = *work;
        let ended = Ended { number, attempt, job: work.digest(), agent: name.clone(), outcome };
        let ran = matches!(ended.outcome, EndedAs::Ran { .. });
        let sealed = token.seal(Kind::Ended, &self.announcement.campaign, &ended);
        if self.insist(|queue| queue.put_result(&self.announcement.campaign, &sealed)).is_some() {
            self.agent.finished.fetch_add(u64::from(ran), Ordering::Relaxed);
            held.finish().ok();
        }
    }

    /// Puts a test back for others. If that cannot be done now, it is lost with this agent, and delivered to others
    /// too.
    fn put_back(&self, held: Box<dyn Held>, work: Work) {
        let AgentSettings { token, queue, .. } = self.agent.settings;
        let campaign = &self.announcement.campaign;
        let work = Work { put_back: work.put_back + 1, ..work };
        if queue.put_test(campaign, &token.seal(Kind::Work, campaign, &work)).is_ok() {
            held.finish().ok();
        }
    }

    /// Does what is asked of the queue as soon as it can be reached; `None` if the agent ends before.
    fn insist<T>(&self, mut call: impl FnMut(&dyn Queue) -> Result<T, QueueError>) -> Option<T> {
        loop {
            match call(&*self.agent.settings.queue) {
                Ok(done) => return Some(done),
                Err(QueueError::Unreachable { .. }) if !self.leaves() => thread::sleep(PAUSE),
                Err(_) => return None,
            }
        }
    }

    /// Runs a test; `None` if the agent is to end before.
    fn run(&mut self, work: &Work) -> Option<EndedAs> {
        let job: Job = match serde_json::from_str(work.job.get()) {
            Ok(job) => job,
            Err(error) => return Some(EndedAs::NotRun { reason: format!("the job cannot be read: {error}") }),
        };
        match self.try_run(work, job) {
            Ok(outcome) => outcome,
            Err(reason) => {
                self.pool = None;
                Some(EndedAs::NotRun { reason })
            }
        }
    }

    fn try_run(&mut self, work: &Work, mut job: Job) -> Result<Option<EndedAs>, String> {
        let trace = self.folder().join("trace.mcap");
        if let Some(request) = &mut job.trace {
            fs::create_dir_all(self.folder()).map_err(|error| error.to_string())?;
            request.file.clone_from(&trace);
        }
        let timeout = lock(self.experience).timeout(work.limit);
        let Some(mut result) = self.perform(job.clone(), timeout)? else { return Ok(None) };
        if result.observation.outcome.is_whole() {
            lock(self.experience).succeeded();
        } else {
            let timed_out = matches!(result.observation.outcome, Outcome::Timeout { .. });
            if lock(self.experience).doubts(timed_out, work.limit) {
                if !self.can_run(&job, 2 * timeout)? {
                    return Ok(None);
                }
                let longer = lock(self.experience).timeout(work.limit);
                if timed_out && longer > timeout {
                    let Some(again) = self.perform(job, longer)? else { return Ok(None) };
                    result = again;
                }
            }
        }
        let outcome = &result.observation.outcome;
        let fault = outcome.is_of_environment().then(|| outcome.message().unwrap_or_default().to_owned());
        let recorded = if work.records { self.recorded(&trace)? } else { None };
        let result = serde_json::value::to_raw_value(&result).map_err(|error| error.to_string())?;
        Ok(Some(EndedAs::Ran { result, fault, recorded }))
    }

    /// Whether this machine runs the campaign without disturbance, as far as it is to end before; how long that takes
    /// is remembered. The error says why it does not.
    fn can_run(&mut self, job: &Job, timeout: Duration) -> Result<bool, String> {
        // Nothing that is undisturbed should take longer, however slow the machine is.
        let undisturbed = Job { test: Test::default(), trace: None, ..job.clone() };
        let Some(own) = self.perform(undisturbed, timeout)? else { return Ok(false) };
        let outcome = &own.observation.outcome;
        if !outcome.is_whole() {
            let why = outcome.detail().unwrap_or_default();
            return Err(format!("without disturbance the campaign does not run here: {why}"));
        }
        lock(self.experience).measured(Duration::from_secs_f64(own.observation.wall.run));
        Ok(true)
    }

    /// Puts the trace of a test into the queue, if it was kept.
    fn recorded(&self, trace: &Path) -> Result<Option<String>, String> {
        let content = match fs::read(trace) {
            Ok(content) => content,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(format!("{}: {error}", trace.display())),
        };
        fs::remove_file(trace).map_err(|error| format!("{}: {error}", trace.display()))?;
        let hash = digest_of(&content);
        let put = self.insist(|queue| queue.put_file(&self.announcement.campaign, &hash, &content));
        put.map(|()| Some(hash)).ok_or_else(|| "the campaign has ended".to_owned())
    }

    fn folder(&self) -> PathBuf {
        self.agent.settings.folder.join(&self.announcement.campaign).join("workers").join(self.worker.to_string())
    }

    /// Runs a job in this slot's worker. The error says why there is no worker.
    fn perform(&mut self, job: Job, timeout: Duration) -> Result<Option<JobResult>, String> {
        if self.pool.is_none() {
            let (number, lock) = claim_number(&self.agent.settings.shared).map_err(|error| error.to_string())?;
            let settings = PoolSettings {
                workers: 1,
                first: number,
                program: self.program.clone(),
                directory: self.agent.settings.folder.join(&self.announcement.campaign).join("workers"),
                timeout,
                retries: Retries::Elsewhere,
            };
            self.pool = Some((Pool::start(&settings).map_err(|error| error.to_string())?, lock));
        }
        let (pool, _) = self.pool.as_mut().expect("it was started");
        pool.set_timeout(timeout, timeout);
        pool.submit(job);
        while !self.agent.stops() {
            if let Some(result) = pool.next(Duration::from_millis(20)).map_err(|error| error.to_string())? {
                if !result.observation.outcome.is_whole() {
                    // Who ends this agent may have ended its worker first.
                    self.agent.await_stop(TOGETHER);
                }
                return Ok(Some(result).filter(|_| !self.agent.stops()));
            }
        }
        Ok(None)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
