//! What a supervisor concludes from what agents say: which result counts, which test goes into the queue once more, and
//! which machine gets no more tests. It has no clock and no connection.
//!
//! Each test has one result, whatever machines do: the first whole one is taken, and what comes later is dropped. The
//! same test gives the same result on each machine, so it does not matter which one comes first.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::value::RawValue;

use crate::message::{AgentName, Ended, EndedAs, Limit, Presence, Work};

/// How often a test that the environment of a machine broke off is run again, on another one if there is one. What
/// happens after that is its outcome.
pub const RETRIES: u32 = 2;

/// A machine with this many faults in a row gets no more tests of this campaign.
pub const FAULTS_IN_A_ROW: usize = 3;

/// The tests of a campaign that have no result yet, and what is known of the machines.
#[derive(Debug)]
pub struct Dispatch {
    edition: String,
    session: String,
    waiting: BTreeMap<u32, Waiting>,
    machines: BTreeMap<String, Machine>,
    present: BTreeSet<String>,
}

#[derive(Debug)]
struct Waiting {
    work: Work,
    /// [`Work::digest`], which is the same for all attempts.
    digest: String,
    /// How often the environment broke it off.
    broken_off: u32,
    /// What happened to it on its way, for those who read its result.
    notes: Vec<String>,
}

/// A machine, of all its agents.
#[derive(Debug, Default)]
struct Machine {
    /// The tests with which it had faults since it last ran one as a whole, each with the reason.
    faults: Vec<(u32, String)>,
}

/// What follows from a message of an agent.
#[derive(Debug)]
pub enum Answer {
    /// This is the result of a test.
    Result(Box<Taken>),
    /// The test goes into the queue once more.
    Again(Box<Work>),
    /// Agents were lost with this test again and again, so it is not tried any more.
    Poison {
        /// The job's number.
        number: u32,
        /// How many agents were lost with it.
        lost: u64,
    },
    /// Nobody waits for it: the test has a result already, or it is none of this session.
    Nothing,
}

/// The result of a test.
#[derive(Debug)]
pub struct Taken {
    /// The job's number.
    pub number: u32,
    /// Who ran it.
    pub agent: AgentName,
    /// The result of the job, as JSON.
    pub result: Box<RawValue>,
    /// The file of what the run recorded, by its hash.
    pub recorded: Option<String>,
    /// What happened to the test before.
    pub notes: Vec<String>,
}

impl Dispatch {
    /// A session of a supervisor, of this edition of its campaign.
    pub fn new(edition: String, session: String) -> Self {
        let (waiting, machines, present) = Default::default();
        Dispatch { edition, session, waiting, machines, present }
    }

    /// A test that is to be run; what is returned belongs into the queue.
    pub fn submit(&mut self, number: u32, job: Box<RawValue>, limit: Limit, records: bool) -> Work {
        let (edition, session) = (self.edition.clone(), self.session.clone());
        let (attempt, put_back, avoid) = (0, 0, BTreeSet::new());
        let work = Work { number, attempt, job, edition, session, put_back, avoid, limit, records };
        let waiting = Waiting { work: work.clone(), digest: work.digest(), broken_off: 0, notes: Vec::new() };
        self.waiting.insert(number, waiting);
        work
    }

    /// What follows from what came of a test.
    pub fn ended(&mut self, ended: Ended) -> Answer {
        let Ended { number, attempt, job, agent, outcome } = ended;
        let Some(waiting) = self.waiting.get_mut(&number).filter(|waiting| waiting.digest == job) else {
            return Answer::Nothing;
        };
        let is_current = attempt == waiting.work.attempt;
        let machine = self.machines.entry(agent.machine.clone()).or_default();
        let name = &agent.machine;
        match outcome {
            // A run that nothing broke off is the test's result, whichever attempt it was.
            EndedAs::Ran { result, fault: None, recorded } => {
                machine.faults.clear();
                self.take(agent, number, result, recorded)
            }
            EndedAs::Poison { lost } if is_current => {
                self.waiting.remove(&number);
                Answer::Poison { number, lost }
            }
            _ if !is_current => Answer::Nothing,
            EndedAs::Ran { result, fault: Some(_), recorded } if waiting.broken_off == RETRIES => {
                // It ends like this on every machine, so the machines are not to blame.
                for machine in self.machines.values_mut() {
                    machine.faults.retain(|(test, _)| *test != number);
                }
                self.take(agent, number, result, recorded)
            }
            EndedAs::Ran { fault: Some(reason), .. } => {
                let note =
                    format!("the environment on `{name}` broke off this test, so the test was run again: {reason}");
                machine.faults.push((number, reason));
                waiting.broken_off += 1;
                waiting.again(name, note)
            }
            EndedAs::NotRun { reason } => {
                let note = format!("`{name}` could not run this test, so another machine did: {reason}");
                machine.faults.push((number, reason));
                waiting.again(name, note)
            }
            EndedAs::Poison { .. } => Answer::Nothing,
        }
    }

    fn take(&mut self, agent: AgentName, number: u32, result: Box<RawValue>, recorded: Option<String>) -> Answer {
        let notes = self.waiting.remove(&number).map_or_else(Vec::new, |waiting| waiting.notes);
        Answer::Result(Box::new(Taken { number, agent, result, recorded, notes }))
    }

    /// Which of the agents that are there work for this campaign now. Returns in sentences what has changed.
    pub fn present(&mut self, agents: &[Presence], works: impl Fn(&Presence) -> bool) -> Vec<String> {
        let machine = |presence: &Presence| presence.agent.machine.clone();
        let heard: BTreeSet<String> = agents.iter().map(machine).collect();
        let present: BTreeSet<String> = agents.iter().filter(|agent| works(agent)).map(machine).collect();
        let came = present.difference(&self.present).map(|machine| format!("`{machine}` has joined"));
        // One that was put aside, or works for another campaign by now, is not lost.
        let lost = self.present.difference(&heard);
        let lost = lost.map(|machine| format!("no sign of `{machine}` any more: its tests go to other machines"));
        let changes = came.chain(lost).collect();
        self.present = present;
        changes
    }

    /// How many tests have no result yet.
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// The machines that get no more tests, each with the reason.
    pub fn put_aside(&self) -> Vec<(String, String)> {
        let aside = |(name, machine): (&String, &Machine)| Some((name.clone(), machine.put_aside()?));
        self.machines.iter().filter_map(aside).collect()
    }

    /// Why the campaign cannot go on although agents are there: each of them was put aside.
    pub fn stuck(&self) -> Option<String> {
        let is_aside = |name: &String| self.machines.get(name).and_then(Machine::put_aside).is_some();
        if self.waiting.is_empty() || self.present.is_empty() || !self.present.iter().all(is_aside) {
            return None;
        }
        let reasons = self.put_aside().into_iter().map(|(name, reason)| format!("`{name}`: {reason}"));
        Some(reasons.collect::<Vec<_>>().join("; "))
    }
}

impl Waiting {
    fn again(&mut self, machine: &str, note: String) -> Answer {
        self.notes.push(note);
        self.work.attempt += 1;
        self.work.put_back = 0;
        self.work.avoid.insert(machine.to_owned());
        Answer::Again(Box::new(self.work.clone()))
    }
}

impl Machine {
    /// Why it gets no more tests, if so.
    fn put_aside(&self) -> Option<String> {
        let (_, last) = self.faults.last().filter(|_| self.faults.len() >= FAULTS_IN_A_ROW)?;
        Some(format!("{FAULTS_IN_A_ROW} faults in a row, the last one: {last}"))
    }
}

#[cfg(test)]
mod tests;
