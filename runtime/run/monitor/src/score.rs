//! What a monitor was worth in a run: hazards foreseen, detected and missed, lead times, false alarms, time in each
//! state.
//!
//! A *hazard* is the first moment from which nothing could satisfy a requirement any more. The state *at* an instant
//! is the last one decided at it, so it does not matter which of two things of one instant is told first.
//!
//! An *alarm* is a stay in the safe state that began because a guarantee was lost. The stay with which a run begins is
//! none: nothing was lost, no mitigation is sent, and every run begins with one. Only if the monitor never leaves it,
//! so that it promised nothing in the whole run, it is a false alarm unless there was a hazard. A hazard in it counts
//! as foreseen all the same, because the monitor had promised nothing.
//!
//! [`Scorer`] takes decisions and hazards as they come, so that scores are metrics while a run goes on; [`score`] is
//! the same over a whole run.

use std::collections::VecDeque;

use sesame_base::time::SimTime;

use crate::compare::Step;
use crate::network::State;

/// The score of one monitor, until some time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Score {
    /// What the monitor made of each hazard, in the order of time; within one instant, in the order of requirements.
    pub hazards: Vec<Hazard>,
    /// Alarms that were false: with no hazard in the stay, nor within the horizon after it began. Without a horizon
    /// they are alarms without a hazard, for which mitigation may be the reason.
    pub false_alarms: u32,
    /// Alarms without a hazard so far, for which one may still come. At the end of a run there are none: they are
    /// false.
    pub open_alarms: u32,
    /// How often a guarantee was lost and none was left: so often mitigation was sent, if there is one.
    pub mitigations: u32,
    /// How often the state changed.
    pub changes: u32,
    /// The shortest time between two changes, if there are two.
    pub shortest_stay: Option<SimTime>,
    /// The time in each guarantee, by position, and then the time in the safe state. Their sum is the time of the run.
    pub time_in: Vec<SimTime>,
}

/// A hazard, and what a monitor made of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hazard {
    /// Which requirement was violated: whatever number the caller has for it.
    pub requirement: u32,
    /// When it was lost.
    pub at: SimTime,
    /// For how long the monitor had been in the safe state at that time, zero if the hazard was only detected; `None`
    /// if it was not, so that the hazard was missed.
    pub lead: Option<SimTime>,
}

impl Score {
    /// How many hazards were foreseen: the monitor was in its safe state before them.
    pub fn foreseen(&self) -> usize {
        self.hazards.iter().filter(|hazard| hazard.lead.is_some_and(|lead| lead > SimTime::ZERO)).count()
    }

    /// How many hazards were detected: the monitor went into its safe state in the very instant.
    pub fn detected(&self) -> usize {
        self.hazards.iter().filter(|hazard| hazard.lead == Some(SimTime::ZERO)).count()
    }

    /// How many hazards were missed.
    pub fn missed(&self) -> usize {
        self.hazards.iter().filter(|hazard| hazard.lead.is_none()).count()
    }

    /// The shortest lead time of a hazard that was foreseen.
    pub fn least_lead(&self) -> Option<SimTime> {
        self.hazards.iter().filter_map(|hazard| hazard.lead).filter(|lead| *lead > SimTime::ZERO).min()
    }
}

/// An alarm without a hazard so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Alarm {
    began: SimTime,
    /// When the stay ended.
    ended: Option<SimTime>,
}

/// The score of one monitor as a run goes on. What it is told is in the order of time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scorer {
    horizon: Option<SimTime>,
    state: State,
    since: SimTime,
    /// The instant that was told of last.
    now: SimTime,
    /// Hazards of that instant, by requirement.
    pending: Vec<u32>,
    hazards: Vec<Hazard>,
    false_alarms: u32,
    /// In the order of their beginning; only the last one may not have ended.
    alarms: VecDeque<Alarm>,
    mitigations: u32,
    changes: u32,
    shortest_stay: Option<SimTime>,
    time_in: Vec<SimTime>,
}

impl Scorer {
    /// At time zero, in the safe state, of a monitor with so many guarantees. With a horizon, an alarm is also
    /// justified by a hazard at most so long after it began.
    pub fn new(guarantees: u32, horizon: Option<SimTime>) -> Self {
        Scorer {
            horizon,
            state: State::Safe,
            since: SimTime::ZERO,
            now: SimTime::ZERO,
            pending: Vec::new(),
            hazards: Vec::new(),
            false_alarms: 0,
            alarms: VecDeque::new(),
            mitigations: 0,
            changes: 0,
            shortest_stay: None,
            time_in: vec![SimTime::ZERO; guarantees as usize + 1],
        }
    }

    /// The monitor decided; for the state that it has already, nothing happens.
    pub fn decide(&mut self, at: SimTime, state: State) {
        self.pass(at);
        if state == self.state {
            return;
        }
        let stay = at - self.since;
        let place = self.place(self.state);
        self.time_in[place] = self.time_in[place] + stay;
        if self.changes > 0 {
            self.shortest_stay = Some(self.shortest_stay.map_or(stay, |shortest| shortest.min(stay)));
        }
        if let Some(alarm) = self.alarms.back_mut().filter(|alarm| alarm.ended.is_none()) {
            alarm.ended = Some(at);
        }
        (self.state, self.since) = (state, at);
        self.changes += 1;
        if state == State::Safe {
            self.mitigations += 1;
            self.alarms.push_back(Alarm { began: at, ended: None });
        }
    }

    /// A requirement was lost: from now on, nothing can satisfy it.
    pub fn hazard(&mut self, at: SimTime, requirement: u32) {
        self.pass(at);
        self.pending.push(requirement);
    }

    /// The score so far. Alarms without a hazard are false when none can come any more that would justify them.
    pub fn so_far(&self, now: SimTime) -> Score {
        let mut scorer = self.clone();
        scorer.pass(now);
        scorer.judge();
        let mut time_in = scorer.time_in;
        let place = self.place(self.state);
        time_in[place] = time_in[place] + (now - scorer.since);
        Score {
            hazards: scorer.hazards,
            false_alarms: scorer.false_alarms,
            open_alarms: u32::try_from(scorer.alarms.len()).unwrap_or(u32::MAX),
            mitigations: scorer.mitigations,
            changes: scorer.changes,
            shortest_stay: scorer.shortest_stay,
            time_in,
        }
    }

    /// The score of a run that ends now.
    pub fn end(&self, now: SimTime) -> Score {
        let mut score = self.so_far(now);
        score.false_alarms += std::mem::take(&mut score.open_alarms);
        score.false_alarms += u32::from(score.changes == 0 && score.hazards.is_empty());
        score
    }

    fn place(&self, state: State) -> usize {
        match state {
            State::Guarantee(at) => at as usize,
            State::Safe => self.time_in.len() - 1,
        }
    }

    /// Goes on to another instant, if it is one: what was told of the present one is complete then.
    fn pass(&mut self, to: SimTime) {
        if to <= self.now {
            return;
        }
        self.judge();
        self.now = to;
        let horizon = self.horizon;
        // A hazard of the instant at which a stay ended was not in it.
        let over = |alarm: &Alarm| {
            alarm.ended.is_some_and(|ended| ended <= to) && horizon.is_none_or(|horizon| alarm.began + horizon < to)
        };
        while self.alarms.front().is_some_and(over) {
            self.alarms.pop_front();
            self.false_alarms += 1;
        }
    }

    /// Judges the hazards of the present instant by the state at its end.
    fn judge(&mut self) {
        let (at, horizon) = (self.now, self.horizon);
        if self.pending.is_empty() {
            return;
        }
        self.pending.sort_unstable();
        let lead = (self.state == State::Safe).then(|| at - self.since);
        self.hazards.extend(self.pending.drain(..).map(|requirement| Hazard { requirement, at, lead }));
        self.alarms.retain(|alarm| {
            let inside = alarm.ended.is_none_or(|ended| at < ended);
            let near = horizon.is_some_and(|horizon| at <= alarm.began + horizon);
            !inside && !near
        });
    }
}

/// The score of a whole run of a monitor with so many guarantees: its decisions, and hazards as requirement and time,
/// each in the order of time, until the end of the run.
pub fn score(
    guarantees: u32,
    horizon: Option<SimTime>,
    decisions: &[Step<State>],
    hazards: &[(u32, SimTime)],
    end: SimTime,
) -> Score {
    scorer(guarantees, horizon, decisions, hazards).end(end)
}

/// A [`Scorer`] that was told of these decisions and hazards.
pub fn scorer(
    guarantees: u32,
    horizon: Option<SimTime>,
    decisions: &[Step<State>],
    hazards: &[(u32, SimTime)],
) -> Scorer {
    let mut scorer = Scorer::new(guarantees, horizon);
    let mut hazards = hazards.iter().peekable();
    for step in decisions {
        while let Some(&&(requirement, at)) = hazards.peek().filter(|(_, at)| *at < step.at) {
            scorer.hazard(at, requirement);
            hazards.next();
        }
        scorer.decide(step.at, step.state);
    }
    hazards.for_each(|&(requirement, at)| scorer.hazard(at, requirement));
    scorer
}
