//! Agents on other machines as an executor: tests go into a queue, and results come out of it.
//!
//! The queue may be unreachable for a while, and agents may come, go and be lost: tests wait meanwhile. What is decided
//! about results and machines is in [`sesame_queue::dispatch`].

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use sesame_base::observation::Observation;
use sesame_queue::announcement::Announcement;
use sesame_queue::bundle::Entry;
use sesame_queue::dispatch::{Answer, Dispatch, Taken};
use sesame_queue::message::{Ended, Limit, Presence, Supervision, Work, digest_of};
use sesame_queue::queue::{HERE, PAUSE, Queue, QueueError};
use sesame_queue::token::{Kind, SealError, Token};

use crate::campaign::executor::{Executor, ExecutorError, Job, JobResult, Machines, TraceRequest};

/// How long a campaign waits for machines when all that there were have been put aside.
const PATIENCE: Duration = Duration::from_secs(10);

/// How long nobody says that no agent is there: one that waits joins within this time.
const JOINING: Duration = Duration::from_secs(3);

/// What an announcement's campaign is run with.
pub struct Fleet {
    /// The queue.
    pub queue: Arc<dyn Queue>,
    /// The secret that the agents share.
    pub token: Token,
    /// What agents have to know.
    pub announcement: Announcement,
    /// The files that agents need, and where they are here.
    pub files: Vec<(Entry, PathBuf)>,
    /// Whether the simulator is stepped, so that equal tests give equal results.
    pub lock_stepped: bool,
}

/// Agents that run the tests of a campaign. Dropping it ends the campaign in the queue.
pub(super) struct Agents {
    queue: Arc<dyn Queue>,
    token: Token,
    announcement: Announcement,
    dispatch: Dispatch,
    limit: Limit,
    lock_stepped: bool,
    /// Where the traces of tests belong.
    traces: BTreeMap<u32, PathBuf>,
    /// What could not be put into the queue yet.
    unsent: VecDeque<Work>,
    /// A result whose trace is not here yet.
    taken: Option<Taken>,
    looked: Option<Instant>,
    /// The machines whose agents work for this campaign, as they last said.
    machines: Machines,
    /// The machines that were said to refuse this campaign, each with the reason.
    refused: BTreeSet<(String, String)>,
    /// How many agents and campaigns have another token.
    strangers: usize,
    /// Since when no agent works for this campaign.
    alone: Option<Instant>,
    /// Since when all machines that are there have been put aside.
    stuck: Option<Instant>,
    /// Why the queue cannot be reached, if so.
    trouble: Option<String>,
    news: Vec<String>,
    supervision: Supervising,
}

/// Says again and again that the supervisor is there, until it is dropped.
struct Supervising {
    stop: Option<mpsc::Sender<()>>,
    thread: Option<thread::JoinHandle<()>>,
}

impl Supervising {
    fn start(queue: Arc<dyn Queue>, token: Token, campaign: String) -> Self {
        let (stop, stopped) = mpsc::channel();
        let thread = thread::spawn(move || {
            let name = Supervision::name(&campaign);
            let sealed = token.seal(Kind::Supervision, &campaign, &Supervision { campaign: campaign.clone() });
            // Who cannot be heard now is heard later.
            queue.present(&name, &sealed).ok();
            while stopped.recv_timeout(HERE) == Err(mpsc::RecvTimeoutError::Timeout) {
                queue.present(&name, &sealed).ok();
            }
            queue.absent(&name).ok();
        });
        Supervising { stop: Some(stop), thread: Some(thread) }
    }

    fn end(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

impl Drop for Supervising {
    fn drop(&mut self) {
        self.end();
    }
}

impl Agents {
    /// Announces a campaign. What an earlier session of it left in the queue is withdrawn.
    pub(super) fn start(fleet: Fleet, timeout: Duration) -> Result<Self, ExecutorError> {
        let Fleet { queue, token, announcement, files, lock_stepped } = fleet;
        let campaign = announcement.campaign.clone();
        let prepare = || -> Result<String, String> {
            let session = Token::random()?.text();
            // Files first, so that every agent that hears of the campaign finds them.
            queue.make_room(&campaign).map_err(|error| error.to_string())?;
            for (entry, path) in &files {
                if queue.has_file(&campaign, &entry.hash).map_err(|error| error.to_string())? {
                    continue;
                }
                let content = fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
                if digest_of(&content) != entry.hash {
                    return Err(format!("{} was changed meanwhile", path.display()));
                }
                queue.put_file(&campaign, &entry.hash, &content).map_err(|error| error.to_string())?;
            }
            queue.withdraw(&campaign).map_err(|error| error.to_string())?;
            Ok(session)
        };
        let session = prepare().map_err(|reason| ExecutorError::Agents { reason })?;
        let agents = Agents {
            supervision: Supervising::start(Arc::clone(&queue), token.clone(), campaign),
            queue,
            token,
            dispatch: Dispatch::new(announcement.edition(), session),
            announcement,
            limit: Limit { timeout, reference: None },
            lock_stepped,
            traces: BTreeMap::new(),
            unsent: VecDeque::new(),
            taken: None,
            looked: None,
            machines: Machines { machines: 0, workers: 0, busy: 0, waiting: 0 },
            refused: BTreeSet::new(),
            strangers: 0,
            alone: Some(Instant::now()),
            stuck: None,
            trouble: None,
            news: Vec::new(),
        };
        agents.announce(&agents.announcement).map_err(|error| ExecutorError::Agents { reason: error.to_string() })?;
        Ok(agents)
    }

    fn announce(&self, announcement: &Announcement) -> Result<(), QueueError> {
        let campaign = &announcement.campaign;
        self.queue.announce(campaign, &self.token.seal(Kind::Announcement, campaign, announcement))
    }

    /// Puts what waits into the queue, as far as it can be reached.
    fn send(&mut self) -> Result<(), QueueError> {
        let campaign = &self.announcement.campaign;
        while let Some(work) = self.unsent.front() {
            self.queue.put_test(campaign, &self.token.seal(Kind::Work, campaign, work))?;
            self.unsent.pop_front();
        }
        Ok(())
    }

    /// Looks who is there, now and then.
    fn look(&mut self) -> Result<(), QueueError> {
        if self.looked.is_some_and(|looked| looked.elapsed() < HERE / 2) {
            return Ok(());
        }
        let said = self.queue.presences()?;
        let campaign = &self.announcement.campaign;
        let mut present = Vec::new();
        self.strangers = 0;
        for sealed in &said {
            match self.token.open::<Presence>(Kind::Presence, "", sealed) {
                Ok(agent) => present.push(agent),
                Err(_) if Supervision::read(&self.token, sealed).is_some() => {}
                Err(_) => self.strangers += 1,
            }
        }
        let aside = |machine: &str| self.announcement.put_aside.iter().any(|(name, _)| name == machine);
        for Presence { agent, refused, .. } in &present {
            // That it was put aside has been said.
            let refused = refused.iter().filter(|(refused, _)| refused == campaign && !aside(&agent.machine));
            for (_, reason) in refused {
                if self.refused.insert((agent.machine.clone(), reason.clone())) {
                    self.news.push(format!("`{}` refuses this campaign: {reason}", agent.machine));
                }
            }
        }
        // One that works for another campaign, or refuses this one, is of no use here.
        let works = |agent: &Presence| agent.campaign.as_ref() == Some(campaign);
        self.news.extend(self.dispatch.present(&present, works));
        present.retain(works);
        let names: BTreeSet<&str> = present.iter().map(|agent| agent.agent.machine.as_str()).collect();
        let sum = |count: fn(&Presence) -> u32| present.iter().map(|agent| count(agent) as usize).sum();
        let busy: usize = sum(|agent| agent.busy);
        let waiting = self.dispatch.waiting().saturating_sub(busy);
        self.machines = Machines { machines: names.len(), workers: sum(|agent| agent.workers), busy, waiting };
        self.alone = if self.machines.workers == 0 { self.alone.or_else(|| Some(Instant::now())) } else { None };
        self.looked = Some(Instant::now());
        Ok(())
    }

    /// Announces which machines get no more tests, if that has changed.
    fn put_aside(&mut self) -> Result<(), QueueError> {
        let put_aside = self.dispatch.put_aside();
        if put_aside != self.announcement.put_aside {
            let announcement = Announcement { put_aside, ..self.announcement.clone() };
            self.announce(&announcement)?;
            let earlier = std::mem::replace(&mut self.announcement, announcement).put_aside;
            let fresh = self.announcement.put_aside.iter().filter(|each| !earlier.contains(each));
            self.news.extend(fresh.map(|(name, why)| format!("`{name}` gets no more tests: {why}")));
        }
        Ok(())
    }

    /// The next result, if one comes within `wait`.
    fn take(&mut self, wait: Duration) -> Result<Option<JobResult>, QueueError> {
        if let Some(taken) = self.taken.take() {
            return self.result(taken).map(Some);
        }
        self.send()?;
        self.look()?;
        self.put_aside()?;
        let campaign = self.announcement.campaign.clone();
        let Some(sealed) = self.queue.take_result(&campaign, wait)? else { return Ok(None) };
        let ended = match self.token.open::<Ended>(Kind::Ended, &campaign, &sealed) {
            Ok(ended) => ended,
            // It is from somebody without the token, and ignored.
            Err(SealError::OtherToken) => return Ok(None),
            Err(error @ SealError::Unreadable(_)) => {
                self.news.push(format!("a result of an agent is dropped: {error}"));
                return Ok(None);
            }
        };
        match self.dispatch.ended(ended) {
            Answer::Nothing => Ok(None),
            Answer::Again(work) => {
                self.unsent.push_back(*work);
                Ok(None)
            }
            Answer::Poison { number, lost } => Ok(Some(self.poison(number, lost))),
            Answer::Result(taken) => self.result(*taken).map(Some),
        }
    }

    /// A result with its trace. While that cannot be fetched, the result is kept.
    fn result(&mut self, taken: Taken) -> Result<JobResult, QueueError> {
        let mut failure = None;
        if let (Some(hash), Some(file)) = (&taken.recorded, self.traces.get(&taken.number)) {
            match self.queue.file(&self.announcement.campaign, hash) {
                Ok(content) => failure = self.write(hash, content, file).err(),
                Err(error @ QueueError::Unreachable { .. }) => {
                    self.taken = Some(taken);
                    return Err(error);
                }
                Err(error) => failure = Some(error.to_string()),
            }
        }
        let Taken { number, agent, result, recorded: _, notes } = taken;
        self.traces.remove(&number);
        let mut read = match serde_json::from_str::<JobResult>(result.get()) {
            Ok(result) => JobResult { number, ..result },
            Err(error) => {
                self.unknown(number, &format!("`{}` sent a result that cannot be read: {error}", agent.machine))
            }
        };
        read.notes.splice(0..0, notes);
        read.machine = Some(agent.machine);
        read.trace_failure = read.trace_failure.or(failure);
        Ok(read)
    }

    /// Writes a trace that an agent has put into the queue.
    fn write(&self, hash: &str, content: Option<Vec<u8>>, file: &Path) -> Result<(), String> {
        let content = content.filter(|content| digest_of(content) == hash);
        let content = content.ok_or_else(|| format!("the trace for {} did not come whole", file.display()))?;
        let written = || {
            let unfinished = file.with_extension("unfinished");
            fs::write(&unfinished, &content)?;
            fs::rename(&unfinished, file)
        };
        written().map_err(|error| format!("{}: {error}", file.display()))?;
        // It stays until the end of the campaign if it cannot be removed now.
        self.queue.remove_file(&self.announcement.campaign, hash).ok();
        Ok(())
    }

    fn poison(&mut self, number: u32, lost: u64) -> JobResult {
        self.traces.remove(&number);
        self.unknown(
            number,
            &format!("killed: {lost} agents in a row were lost, or not heard for long, with this test"),
        )
    }

    /// The result of a test of which nothing is known.
    fn unknown(&self, number: u32, why: &str) -> JobResult {
        JobResult {
            number,
            observation: Observation::crashed(why.to_owned()),
            notes: Vec::new(),
            added: Vec::new(),
            trace_failure: None,
            killed: true,
            lock_stepped: self.lock_stepped,
            machine: None,
        }
    }
}

/// That others are there of whom nothing is known: they may be agents, or campaigns.
pub(crate) fn strangers(count: usize, place: &str) -> String {
    match count {
        1 => format!("1 agent or campaign on {place} has another token"),
        _ => format!("{count} agents or campaigns on {place} have another token"),
    }
}

impl Executor for Agents {
    fn submit(&mut self, job: Job) {
        let records = job.trace.is_some();
        if let Some(request) = &job.trace {
            self.traces.insert(job.number, request.file.clone());
        }
        // Where a trace belongs is known here; an agent has a file of its own.
        let keep = job.trace.as_ref().map(|request| request.keep);
        let trace = keep.map(|keep| TraceRequest { file: PathBuf::new(), keep });
        let number = job.number;
        let text = serde_json::value::to_raw_value(&Job { trace, ..job }).expect("a job is JSON");
        self.unsent.push_back(self.dispatch.submit(number, text, self.limit, records));
    }

    fn next(&mut self, wait: Duration) -> Result<Option<JobResult>, ExecutorError> {
        let taken = match self.take(wait) {
            Ok(taken) => {
                self.trouble = None;
                taken
            }
            Err(error @ QueueError::Unreachable { .. }) => {
                if self.trouble.is_none() {
                    self.news.push(format!("{error}; tests go on as soon as it can be reached again"));
                }
                self.trouble = Some(error.to_string());
                thread::sleep(PAUSE.min(wait));
                None
            }
            Err(error) => return Err(ExecutorError::Agents { reason: error.to_string() }),
        };
        let Some(reasons) = self.dispatch.stuck().filter(|_| taken.is_none()) else {
            self.stuck = None;
            return Ok(taken);
        };
        let stuck = *self.stuck.get_or_insert_with(Instant::now);
        if stuck.elapsed() < PATIENCE {
            return Ok(None);
        }
        Err(ExecutorError::Agents { reason: format!("no machine is left that can run tests: {reasons}") })
    }

    fn set_timeout(&mut self, timeout: Duration, reference: Duration) {
        self.limit = Limit { timeout, reference: Some(reference) };
    }

    fn lock_stepped(&self) -> bool {
        self.lock_stepped
    }

    fn at_once(&self) -> usize {
        self.machines.workers.max(1)
    }

    fn waits(&self) -> Option<String> {
        let place = self.queue.place();
        let nobody = || match self.strangers {
            0 => format!("no agent works for this campaign: start one with `sesamec agent {place}`"),
            count => format!("no agent works for this campaign; {}", strangers(count, &place)),
        };
        let stuck = || format!("each machine was put aside, others are awaited for {} s", PATIENCE.as_secs());
        let is_alone = self.alone.is_some_and(|since| since.elapsed() > JOINING);
        let waits = self.stuck.map(|_| stuck()).or_else(|| is_alone.then(nobody));
        self.trouble.clone().or(waits)
    }

    fn machines(&self) -> Option<Machines> {
        Some(self.machines)
    }

    fn news(&mut self) -> Vec<String> {
        std::mem::take(&mut self.news)
    }
}

impl Drop for Agents {
    fn drop(&mut self) {
        self.supervision.end();
        // What cannot be removed now is withdrawn when the campaign is resumed.
        self.queue.remove(&self.announcement.campaign).ok();
    }
}
