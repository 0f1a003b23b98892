//! How long a campaign takes with any number of agents, simulated: machines, network and queue are imagined, and what
//! supervisor and agents decide is decided by [`dispatch`](crate::dispatch) and [`intake`](crate::intake) themselves.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, VecDeque};

use serde_json::value::RawValue;
use sesame_rng::Stream;

use crate::dispatch::{Answer, Dispatch};
use crate::intake::{Decision, decide};
use crate::message::{AgentName, Ended, EndedAs, Limit, Presence, Work};

/// Imagined agents, and what is between them and the supervisor. All times are in seconds.
#[derive(Debug, Clone, PartialEq)]
pub struct Agents {
    /// How many there are, each on a machine of its own.
    pub agents: u32,
    /// How many tests each of them runs at once.
    pub workers: u32,
    /// How long a message takes on average, in each direction.
    pub latency: f64,
    /// How long an agent is there on average until it is lost; `None` for agents that stay.
    pub lifetime: Option<f64>,
    /// How long a lost one takes to come back.
    pub absence: f64,
    /// How long the queue takes to notice that an agent was lost, and to deliver its tests to others.
    pub redelivery: f64,
    /// The share of machines that are slower than others, from 0 to 1.
    pub slow: f64,
    /// How many times as long a test takes on those.
    pub slower: f64,
    /// The chance that the environment breaks off a test, from 0 to 1.
    pub broken_off: f64,
    /// How long the supervisor is busy with one result.
    pub supervisor: f64,
}

/// An imagined campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// How many tests it has.
    pub tests: u32,
    /// How many of them are known at the same time; those of the next generation follow from their results.
    pub generation: u32,
    /// How long tests take, in seconds: each takes one of these, by chance. Not empty.
    pub durations: Vec<f64>,
}

/// How an imagined campaign went.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Forecast {
    /// How long it took, in seconds.
    pub wall: f64,
    /// How long one machine that is never lost and never slow takes for the tests alone, in seconds.
    pub alone: f64,
    /// How often a test was delivered.
    pub deliveries: u64,
    /// How many agents were lost.
    pub lost: u64,
    /// How many tests have no result: their agents were lost again and again, or no machine was left.
    pub without_result: u32,
}

#[derive(Debug, Clone, Copy)]
enum Event {
    /// A worker gets a test.
    Delivered { worker: Worker, number: u32, deliveries: u64 },
    /// A worker has run a test.
    Ended { worker: Worker, number: u32, attempt: u32, broken_off: bool },
    /// What a worker says of a test reaches the supervisor.
    Said { agent: u32, number: u32, attempt: u32, said: Said },
    /// A test is delivered to others.
    Again { number: u32, deliveries: u64 },
    /// A worker puts a test back for others.
    PutBack { worker: Worker, number: u32 },
    /// An agent is lost.
    Lost { agent: u32 },
    /// It is there again.
    Back { agent: u32 },
}

#[derive(Debug, Clone, Copy)]
enum Said {
    Ran,
    BrokenOff,
    Poison,
}

/// A worker of an agent, as long as that agent is not lost.
#[derive(Debug, Clone, Copy)]
struct Worker {
    agent: u32,
    /// How often the agent was lost before.
    life: u32,
}

/// An event at its time; the earliest is the greatest, as a heap wants it.
struct At {
    time: f64,
    order: u64,
    event: Event,
}

impl PartialEq for At {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for At {}

impl PartialOrd for At {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for At {
    fn cmp(&self, other: &Self) -> Ordering {
        other.time.total_cmp(&self.time).then(other.order.cmp(&self.order))
    }
}

struct Machine {
    name: AgentName,
    life: u32,
    present: bool,
    slower: f64,
    put_aside: bool,
    /// The tests that its workers run, each with how often it was delivered.
    runs: Vec<(u32, u64)>,
}

struct Simulation<'a> {
    agents: &'a Agents,
    campaign: &'a Campaign,
    luck: Stream,
    now: f64,
    order: u64,
    events: BinaryHeap<At>,
    dispatch: Dispatch,
    machines: Vec<Machine>,
    /// Each test as it was last put into the queue.
    work: Vec<Work>,
    durations: Vec<f64>,
    queue: VecDeque<(u32, u64)>,
    idle: VecDeque<Worker>,
    submitted: u32,
    done: u32,
    /// Until when the supervisor is busy with results.
    busy: f64,
    forecast: Forecast,
}

/// Simulates a campaign; the same seed gives the same.
pub fn simulate(agents: &Agents, campaign: &Campaign, seed: u64) -> Forecast {
    let mut luck = Stream::derive(seed, "machines", &[u64::from(agents.agents)]);
    let machine = |number: u32| Machine {
        name: AgentName { machine: format!("machine {number}"), id: number.to_string() },
        life: 0,
        present: true,
        slower: if luck.chance(agents.slow) { agents.slower } else { 1.0 },
        put_aside: false,
        runs: Vec::new(),
    };
    let machines: Vec<Machine> = (0..agents.agents).map(machine).collect();
    // The same tests take the same time whatever the machines.
    let mut tests = Stream::derive(seed, "tests", &[]);
    let durations: Vec<f64> =
        (0..campaign.tests).map(|_| campaign.durations[tests.below(campaign.durations.len())]).collect();
    let forecast = Forecast { alone: durations.iter().sum(), ..Forecast::default() };
    let idle = (0..agents.workers).flat_map(|_| (0..agents.agents).map(|agent| Worker { agent, life: 0 }));
    let mut simulation = Simulation {
        agents,
        campaign,
        luck,
        now: 0.0,
        order: 0,
        events: BinaryHeap::new(),
        dispatch: Dispatch::new(String::new(), String::new()),
        machines,
        work: Vec::new(),
        durations,
        queue: VecDeque::new(),
        idle: idle.collect(),
        submitted: 0,
        done: 0,
        busy: 0.0,
        forecast,
    };
    simulation.run();
    simulation.forecast
}

impl Simulation<'_> {
    fn at(&mut self, time: f64, event: Event) {
        self.order += 1;
        self.events.push(At { time, order: self.order, event });
    }

    /// A time around a mean, as waiting times without a memory are spread.
    fn around(&mut self, mean: f64) -> f64 {
        -mean * libm::log((1.0 - self.luck.unit()).max(f64::MIN_POSITIVE))
    }

    fn run(&mut self) {
        for agent in 0..self.agents.agents {
            self.await_loss(agent);
        }
        self.look_who_is_there();
        self.submit_generation();
        while self.done < self.campaign.tests {
            let Some(At { time, event, .. }) = self.events.pop() else { break };
            self.now = time;
            self.happens(event);
            if self.dispatch.stuck().is_some() {
                break;
            }
        }
        self.forecast.wall = self.now.max(self.busy);
        self.forecast.without_result += self.campaign.tests - self.done;
    }

    fn await_loss(&mut self, agent: u32) {
        if let Some(lifetime) = self.agents.lifetime {
            let time = self.now + self.around(lifetime);
            self.at(time, Event::Lost { agent });
        }
    }

    /// The supervisor hears who is there.
    fn look_who_is_there(&mut self) {
        let presence = |machine: &Machine| Presence {
            agent: machine.name.clone(),
            workers: self.agents.workers,
            busy: 0,
            finished: 0,
            version: String::new(),
            campaign: None,
            refused: Vec::new(),
        };
        let present: Vec<Presence> = self.machines.iter().filter(|machine| machine.present).map(presence).collect();
        self.dispatch.present(&present, |_| true);
    }

    fn submit_generation(&mut self) {
        let end = self.campaign.tests.min(self.submitted.saturating_add(self.campaign.generation));
        for number in self.submitted..end {
            let limit = Limit { timeout: std::time::Duration::MAX, reference: None };
            self.work.push(self.dispatch.submit(number, RawValue::NULL.to_owned(), limit, false));
            self.queue.push_back((number, 1));
        }
        self.submitted = end;
        self.deliver();
    }

    /// Gives tests of the queue to workers that wait.
    fn deliver(&mut self) {
        while let (Some(&(number, deliveries)), Some(&worker)) = (self.queue.front(), self.idle.front()) {
            self.idle.pop_front();
            let machine = &self.machines[worker.agent as usize];
            if machine.life != worker.life || !machine.present || machine.put_aside {
                continue;
            }
            self.queue.pop_front();
            self.forecast.deliveries += 1;
            self.machines[worker.agent as usize].runs.push((number, deliveries));
            let time = self.now + self.around(self.agents.latency);
            self.at(time, Event::Delivered { worker, number, deliveries });
        }
    }

    /// Whether a worker still has a test; if so, it has it no longer.
    fn gives_up(&mut self, worker: Worker, number: u32) -> bool {
        let machine = &mut self.machines[worker.agent as usize];
        if machine.life != worker.life {
            return false;
        }
        machine.runs.retain(|(run, _)| *run != number);
        true
    }

    fn say(&mut self, agent: u32, number: u32, attempt: u32, said: Said) {
        let time = self.now + self.around(self.agents.latency);
        self.at(time, Event::Said { agent, number, attempt, said });
    }

    fn happens(&mut self, event: Event) {
        match event {
            Event::Delivered { worker, number, deliveries } => {
                let machine = &self.machines[worker.agent as usize];
                if machine.life != worker.life {
                    return;
                }
                let work = &self.work[number as usize];
                let attempt = work.attempt;
                match decide(&machine.name, work, deliveries) {
                    Decision::Run => {
                        let broken_off = self.luck.chance(self.agents.broken_off);
                        let takes = self.durations[number as usize] * self.machines[worker.agent as usize].slower;
                        self.at(self.now + takes, Event::Ended { worker, number, attempt, broken_off });
                    }
                    Decision::LeaveToOthers(rest) => {
                        self.at(self.now + rest.as_secs_f64(), Event::PutBack { worker, number });
                    }
                    Decision::Poison { .. } => {
                        self.gives_up(worker, number);
                        self.say(worker.agent, number, attempt, Said::Poison);
                        self.idle.push_back(worker);
                    }
                }
            }
            Event::Ended { worker, number, attempt, broken_off } => {
                if self.gives_up(worker, number) {
                    self.say(worker.agent, number, attempt, if broken_off { Said::BrokenOff } else { Said::Ran });
                    self.idle.push_back(worker);
                }
            }
            Event::Said { agent, number, attempt, said } => self.conclude(agent, number, attempt, said),
            Event::PutBack { worker, number } => {
                if self.gives_up(worker, number) {
                    self.work[number as usize].put_back += 1;
                    self.queue.push_back((number, 1));
                    self.idle.push_back(worker);
                }
            }
            Event::Again { number, deliveries } => self.queue.push_back((number, deliveries)),
            Event::Lost { agent } => {
                self.forecast.lost += 1;
                let machine = &mut self.machines[agent as usize];
                machine.present = false;
                machine.life += 1;
                let runs = std::mem::take(&mut machine.runs);
                for (number, deliveries) in runs {
                    let time = self.now + self.agents.redelivery;
                    self.at(time, Event::Again { number, deliveries: deliveries + 1 });
                }
                self.at(self.now + self.agents.absence, Event::Back { agent });
                self.look_who_is_there();
            }
            Event::Back { agent } => {
                let machine = &mut self.machines[agent as usize];
                machine.present = true;
                let worker = Worker { agent, life: machine.life };
                self.idle.extend((0..self.agents.workers).map(|_| worker));
                self.await_loss(agent);
                self.look_who_is_there();
            }
        }
        self.deliver();
    }

    fn conclude(&mut self, agent: u32, number: u32, attempt: u32, said: Said) {
        self.busy = self.busy.max(self.now) + self.agents.supervisor;
        let result = || RawValue::NULL.to_owned();
        let outcome = match said {
            Said::Ran => EndedAs::Ran { result: result(), fault: None, recorded: None },
            Said::BrokenOff => EndedAs::Ran { result: result(), fault: Some("broken off".to_owned()), recorded: None },
            Said::Poison => EndedAs::Poison { lost: 0 },
        };
        let agent = self.machines[agent as usize].name.clone();
        let ended = Ended { number, attempt, job: self.work[number as usize].digest(), agent, outcome };
        match self.dispatch.ended(ended) {
            Answer::Result(_) => self.done += 1,
            Answer::Poison { .. } => {
                self.done += 1;
                self.forecast.without_result += 1;
            }
            Answer::Again(work) => {
                self.work[number as usize] = *work;
                self.queue.push_back((number, 1));
            }
            Answer::Nothing => {}
        }
        let aside = self.dispatch.put_aside();
        if !aside.is_empty() {
            for machine in &mut self.machines {
                machine.put_aside = aside.iter().any(|(name, _)| *name == machine.name.machine);
            }
        }
        if self.done == self.submitted && self.done < self.campaign.tests {
            // The search goes on when the last result of a generation is recorded.
            self.now = self.now.max(self.busy);
            self.submit_generation();
        }
    }
}

#[cfg(test)]
mod tests;
