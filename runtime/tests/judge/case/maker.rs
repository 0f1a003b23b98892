//! Random cases, from the draws they are made of to the robot.

mod metrics;
mod monitors;
mod operations;

use sesame_plan::testing;
use sesame_plan::{Metric, Test, TestOperation, Topic};
use sesame_rng::Stream;

pub(super) use self::monitors::Watching;
use super::{Case, topics_of, variables};
use crate::adapter;
use crate::robot::{Blank, Carries, Line, Script};

/// The time between two ticks, in seconds; a step is two of them.
const TICK: f64 = 0.05;

pub(super) struct Maker {
    pub(super) stream: Stream,
    pub(super) carries: Vec<Carries>,
    pub(super) topics: Vec<Topic>,
}

impl Maker {
    pub(super) fn chance(&mut self, probability: f64) -> bool {
        self.stream.chance(probability)
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.stream.below(of.len())]
    }

    /// A whole number between two, both included.
    pub(super) fn between(&mut self, low: i32, high: i32) -> i32 {
        low + i32::try_from(self.stream.below(usize::try_from(high - low + 1).unwrap())).unwrap()
    }

    /// A number in quarters.
    fn quarters(&mut self, low: i32, high: i32) -> f64 {
        f64::from(self.between(low * 4, high * 4)) / 4.0
    }

    fn ticks(&mut self, low: i32, high: i32) -> f64 {
        f64::from(self.between(low, high)) / 20.0
    }

    /// Places for so many old things, in their order, and so many new ones among them.
    pub(super) fn places(&mut self, old: usize, new: usize) -> (Vec<usize>, Vec<usize>) {
        let mut all: Vec<usize> = self.stream.permutation(old + new);
        let mut news = all.split_off(old);
        all.sort_unstable();
        news.sort_unstable();
        (all, news)
    }

    pub(super) fn case(&mut self, number: u64) -> Case {
        let steps = self.between(6, 22);
        let beyond = if self.chance(0.3) { TICK } else { 0.0 };
        let end_after = f64::from(steps) / 10.0 + beyond;
        let mut lines = self.topics();
        if self.chance(0.5) {
            // A topic that the space does not name.
            let line = self.line("elsewhere".to_owned(), Carries::Real);
            lines.push(line);
        }
        let (metrics, hooked) = self.metrics();
        let by_condition = self.chance(0.5);
        let (operations, mut instances, copies) = self.operations(end_after, by_condition, &metrics);
        if instances.len() > 1 && self.chance(0.1) {
            instances.truncate(1);
        }
        let requirements = self.requirements(&metrics);
        let mut script =
            Script { lines, crash: None, over: None, blanks: Vec::new(), doubled: Vec::new(), parameters: Vec::new() };
        if self.chance(0.15) {
            script.over = Some(self.between(3, steps).unsigned_abs());
        }
        match self.between(0, 9) {
            0..=2 => {}
            3..=6 => {
                let after = self.stream.below(6);
                script.crash = Some((self.between(0, steps - 1).unsigned_abs(), after));
            }
            7..=8 => self.blanks(&mut script, steps, &metrics, &instances),
            _ => {
                let after = self.stream.below(6);
                script.crash = Some((self.between(1, steps - 1).unsigned_abs(), after));
                self.blanks(&mut script, steps, &metrics, &instances);
            }
        }
        let _ = hooked;
        let plan = adapter::plan(self.topics.clone(), metrics, requirements, &operations, copies, end_after);
        Case { number, plan, test: Test { operations: instances }, script, carries: self.carries.clone() }
    }

    pub(super) fn line(&mut self, path: String, carries: Carries) -> Line {
        let subscribed = self.chance(0.6);
        Line {
            path,
            carries,
            subscribed,
            moves: subscribed && self.chance(0.6),
            most: self.between(1, 3).unsigned_abs(),
            holds: self.between(1, 4).unsigned_abs(),
            gain: self.one(&[0.0, 0.0, 0.5, 1.0]),
            seed: self.stream.bits(),
        }
    }

    pub(super) fn topics(&mut self) -> Vec<Line> {
        let mut lines = Vec::new();
        for at in 0..self.between(2, 4) {
            let carries =
                self.one(&[Carries::Real, Carries::Real, Carries::Int, Carries::Bool, Carries::Zone, Carries::Zone]);
            let members = if self.chance(0.3) { self.between(2, 3) } else { 1 };
            let paths: Vec<String> = (0..members).map(|member| format!("robot/{at}/{member}")).collect();
            for path in &paths {
                let line = self.line(path.clone(), carries);
                lines.push(line);
            }
            self.carries.push(carries);
            self.topics.push(Topic { paths, ..testing::topic(&format!("t{at}"), &[], adapter::ty(carries)) });
        }
        lines
    }

    /// Numbers that the robot does not know, on topics that it does not hear and no condition reads: what is published
    /// there changes nothing else, so the rest of the run is the true one.
    fn blanks(&mut self, script: &mut Script, steps: i32, metrics: &[Metric], test: &[TestOperation]) {
        let mut read = vec![false; self.topics.len()];
        for metric in test.iter().flat_map(|operation| variables(&operation.activation)) {
            for topic in topics_of(&metrics[metric.index()]) {
                read[topic.index()] = true;
            }
        }
        let member = |topic: &Topic, path: &str| topic.paths.iter().any(|of| of == path);
        let free: Vec<usize> = (0..script.lines.len())
            .filter(|&at| {
                let line = &script.lines[at];
                let topic = self.topics.iter().position(|topic| member(topic, &line.path));
                matches!(line.carries, Carries::Real | Carries::Zone)
                    && !line.moves
                    && topic.is_none_or(|topic| !read[topic])
            })
            .collect();
        if free.is_empty() {
            return;
        }
        for _ in 0..self.between(1, 2) {
            let from = self.between(0, steps - 1);
            let to = self.between(from + 1, steps + 1);
            script.blanks.push(Blank {
                line: self.one(&free),
                from: from.unsigned_abs(),
                to: to.unsigned_abs(),
                share: self.one(&[0.3, 1.0]),
                number: self.one(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
            });
        }
    }
}
