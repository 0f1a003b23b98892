//! Progress while a campaign runs: a bar on a terminal, a line now and then elsewhere.

use std::io::IsTerminal as _;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use sesame_base::visible::visible_lines;
use sesame_plan::{CampaignPlan, Direction, MetricSource};
use sesame_record::TestRecord;
use sesame_report::{quantity, readable_sentence};

use crate::campaign::{CampaignEvent, Machines, Progress};
use crate::cli::progress_line::{Line, awaited, cost, countdown, warning};
use crate::cli::terminal::say;

/// How often a line is printed where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// How long the reference run is awaited before a terminal counts down.
const COUNT_DOWN_AFTER: Duration = Duration::from_secs(2);

/// The columns of a terminal that does not tell them.
const COLUMNS: usize = 80;

/// Shows how far a campaign is, on standard error.
pub(super) struct Display<'a> {
    plan: &'a CampaignPlan,
    seed: u64,
    workers: u32,
    bar: Option<ProgressBar>,
    /// When the first test of this session began.
    began: Instant,
    last_line: Instant,
    /// When it is next said that the reference run is awaited.
    awaited_due: Duration,
    /// What the start of the system was last said to wait for.
    missing: String,
    worst: Vec<Option<f64>>,
    /// The machines whose agents run tests, if they do.
    machines: Option<Machines>,
}

impl<'a> Display<'a> {
    pub(super) fn new(plan: &'a CampaignPlan, seed: u64, workers: u32) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
            bar.set_style(ProgressStyle::with_template("{msg}").unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        });
        let now = Instant::now();
        let worst = vec![None; plan.campaign.objectives.len()];
        Display {
            plan,
            seed,
            workers,
            bar,
            began: now,
            last_line: now,
            awaited_due: Duration::ZERO,
            missing: String::new(),
            worst,
            machines: None,
        }
    }

    pub(super) fn update(&mut self, event: CampaignEvent<'_>, progress: Progress<'_>) {
        let name = &self.plan.campaign.name;
        match event {
            CampaignEvent::ReferenceRunAwaited { waited, limit, missing } => {
                if let Some(missing) = missing.filter(|missing| *missing != self.missing) {
                    missing.clone_into(&mut self.missing);
                    self.say(&format!("{name}: the system is not complete yet: {}", visible_lines(missing)));
                }
                match &self.bar {
                    Some(bar) if waited >= COUNT_DOWN_AFTER => {
                        bar.set_message(countdown(name, waited, limit, columns()));
                    }
                    Some(_) => {}
                    None => {
                        if let Some(line) = awaited(name, waited, limit, &mut self.awaited_due) {
                            say(format_args!("{line}"));
                        }
                    }
                }
                return;
            }
            CampaignEvent::AgentsAwaited { missing } => {
                if let Some(missing) = missing.filter(|missing| *missing != self.missing) {
                    missing.clone_into(&mut self.missing);
                    self.say(&format!("{name}: {}", visible_lines(missing)));
                }
                return;
            }
            CampaignEvent::Told { text } => return self.say(&format!("{name}: {}", visible_lines(text))),
            CampaignEvent::Machines(machines) => self.machines = Some(machines),
            CampaignEvent::Warned { text } => return self.say(&warned(self.plan, text)),
            CampaignEvent::SearchStarted { reference, timeout } => {
                self.began = Instant::now();
                // How long the rest of a campaign takes that was stopped, its tests will show.
                if progress.earlier == 0
                    && self.machines.is_none()
                    && let Some(cost) = cost(reference, timeout, progress.total, self.workers)
                {
                    self.say(&cost);
                }
            }
            CampaignEvent::TestEnded(record) => {
                self.remember(record);
                if progress.done <= progress.earlier {
                    self.began = Instant::now();
                }
            }
            _ => {}
        }
        let line = self.line(progress, self.began.elapsed());
        match &self.bar {
            Some(bar) => bar.set_message(line.fit(columns())),
            None if self.last_line.elapsed() >= LINE_EVERY => {
                self.last_line = Instant::now();
                say(format_args!("{}", line.whole()));
            }
            None => {}
        }
    }

    pub(super) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    /// Says a line that stays, above the bar if there is one.
    fn say(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| say(format_args!("{line}"))),
            None => say(format_args!("{line}")),
        }
    }

    /// The worst value of each objective so far.
    fn remember(&mut self, record: &TestRecord) {
        for (worst, objective) in self.worst.iter_mut().zip(self.plan.objectives()) {
            let value = record.observation.metrics.get(objective.metric.index()).and_then(|metric| metric.value);
            *worst = match (*worst, value, objective.direction) {
                (Some(old), Some(new), Direction::Maximise) => Some(old.max(new)),
                (Some(old), Some(new), Direction::Minimise) => Some(old.min(new)),
                (old, new, _) => old.or(new),
            };
        }
    }

    /// The line after the tests of this session took so long.
    fn line(&self, progress: Progress<'_>, took: Duration) -> Line {
        Line {
            name: self.plan.campaign.name.clone(),
            seed: self.seed,
            done: progress.done,
            total: progress.total,
            left: left(progress, took),
            details: self.details(progress),
        }
    }

    fn details(&self, progress: Progress<'_>) -> Vec<String> {
        let mut parts = Vec::new();
        if let Some(Machines { machines, workers, busy, waiting }) = self.machines {
            let noun = if machines == 1 { "machine" } else { "machines" };
            parts.push(format!("{machines} {noun}, {busy} of {workers} workers busy, {waiting} tests wait"));
        }
        if !self.plan.campaign.objectives.is_empty() {
            parts.push(format!("front of {}", progress.front.numbers().len()));
        }
        if progress.confirmation_runs > 0 {
            parts.push(format!("{} runs to confirm", progress.confirmation_runs));
        }
        if let Some(coverage) = progress.coverage {
            parts.push(format!("coverage {:.0} %", 100.0 * coverage.share()));
        }
        for (worst, objective) in self.worst.iter().zip(self.plan.objectives()) {
            let metric = self.plan.metric(objective.metric);
            // The least fuzzing time is not worth a line.
            if matches!(metric.source, MetricSource::FuzzingTime) {
                continue;
            }
            let Some(worst) = worst else { continue };
            let word = if objective.direction == Direction::Maximise { "most" } else { "least" };
            parts.push(format!("{word} {} {}", metric.name, quantity(*worst, metric.unit.as_deref())));
        }
        parts
    }
}

/// A warning with short numbers and units; it is recorded with all digits.
fn warned(plan: &CampaignPlan, text: &str) -> String {
    warning(&readable_sentence(plan, text))
}

/// How long the remaining tests will take if each takes as long as those of this session.
fn left(progress: Progress<'_>, took: Duration) -> Option<Duration> {
    let here = progress.done.checked_sub(progress.earlier).filter(|&here| here > 0)?;
    let rest = progress.total.checked_sub(progress.done).filter(|&rest| rest > 0)?;
    Some(took.mul_f64(f64::from(rest) / f64::from(here)))
}

/// How wide the terminal is.
fn columns() -> usize {
    console::Term::stderr().size_checked().map_or(COLUMNS, |(_, columns)| usize::from(columns))
}

/// Says on a terminal what takes a while, until it is dropped; elsewhere nothing.
pub(super) struct Waiting(Option<ProgressBar>);

impl Waiting {
    /// For something that looks at so many tests: of few there is nothing to wait for.
    pub(super) fn on(tests: usize, doing: &str) -> Self {
        let long = tests >= 2000 && std::io::stderr().is_terminal();
        Waiting(long.then(|| {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
            let style = ProgressStyle::with_template("{spinner} {msg}, {elapsed}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
            bar.set_message(format!("{doing} of {tests} tests"));
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        }))
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        if let Some(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use sesame_optimise::front::Front;

    use super::*;

    fn progress(done: u32, earlier: u32, front: &Front) -> Progress<'_> {
        Progress { done, total: 200, earlier, confirmation_runs: 0, front, coverage: None }
    }

    #[test]
    fn values_have_their_unit_and_no_more_digits_than_matter() {
        let plan = sesame_record::sample::plan();
        let mut display = Display::new(&plan, 7, 1);
        display.worst.fill(Some(-7.392_612_3));
        let front = Front::default();
        let details = display.details(progress(1, 0, &front));
        let units: Vec<String> = plan
            .objectives()
            .map(|objective| plan.metric(objective.metric))
            .filter(|metric| !matches!(metric.source, MetricSource::FuzzingTime))
            .map(|metric| metric.unit.as_ref().map_or(String::new(), |unit| format!(" {unit}")))
            .collect();
        assert!(!units.is_empty());
        for (detail, unit) in details.iter().skip(1).zip(&units) {
            assert!(detail.ends_with(&format!(" -7.393{unit}")), "{detail}");
        }
        let text = "requirement R3 is violated before anything is fuzzed: `arm_distance` is -2.244690363500318";
        assert!(warned(&plan, text).ends_with("`arm_distance` is -2.245 mm"), "{}", warned(&plan, text));
    }

    #[test]
    fn the_estimate_counts_only_tests_of_this_session() {
        let front = Front::default();
        let seconds =
            |done, earlier| left(progress(done, earlier, &front), Duration::from_secs(20)).map(|left| left.as_secs());
        assert_eq!(seconds(20, 0), Some(180));
        assert_eq!(seconds(120, 100), Some(80), "20 tests took 20 s, and 80 are left");
        for nothing in [(0, 0), (100, 100), (60, 100), (200, 100)] {
            assert_eq!(seconds(nothing.0, nothing.1), None, "{nothing:?}");
        }
    }
}
