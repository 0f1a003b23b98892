//! Progress while a campaign runs: a bar on a terminal, a line now and then elsewhere.

use std::io::IsTerminal as _;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use sesame_plan::{CampaignPlan, Direction, MetricSource};
use sesame_results::record::TestRecord;

use crate::campaign::{CampaignEvent, Progress};
use crate::cli::terminal::say;

/// How often a line is printed where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Shows how far a campaign is, on standard error.
pub(super) struct Display<'a> {
    plan: &'a CampaignPlan,
    bar: Option<ProgressBar>,
    started: Instant,
    last_line: Instant,
    worst: Vec<Option<f64>>,
}

impl<'a> Display<'a> {
    pub(super) fn new(plan: &'a CampaignPlan, seed: u64) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
            let template = "{prefix} {bar:20} {pos}/{len}  {wide_msg}";
            let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
            bar.set_style(style.progress_chars("██░"));
            bar.set_prefix(format!(" {}  seed {seed} ", plan.campaign.name));
            bar
        });
        let now = Instant::now();
        Display { plan, bar, started: now, last_line: now, worst: vec![None; plan.campaign.objectives.len()] }
    }

    pub(super) fn update(&mut self, event: CampaignEvent<'_>, progress: Progress<'_>) {
        if let CampaignEvent::TestEnded(record) = event {
            self.remember(record);
        }
        let rest = self.rest(progress);
        match &self.bar {
            Some(bar) => {
                bar.set_length(u64::from(progress.total));
                bar.set_position(u64::from(progress.done));
                bar.set_message(rest);
            }
            None if self.last_line.elapsed() >= LINE_EVERY => {
                self.last_line = Instant::now();
                say(format_args!("{} {}/{}  {rest}", self.plan.campaign.name, progress.done, progress.total));
            }
            None => {}
        }
    }

    pub(super) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
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

    fn rest(&self, progress: Progress<'_>) -> String {
        let mut parts = Vec::new();
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
            parts.push(
                format!("{word} {} {worst:.4}", metric.name).trim_end_matches('0').trim_end_matches('.').to_owned(),
            );
        }
        if progress.done > 0 && progress.done < progress.total {
            let each = self.started.elapsed().as_secs_f64() / f64::from(progress.done);
            parts.push(format!("{} left", wait(each * f64::from(progress.total - progress.done))));
        }
        parts.join("  ")
    }
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

/// A length of wall time in words.
pub(super) fn wait(seconds: f64) -> String {
    if seconds < 90.0 {
        format!("{seconds:.0} s")
    } else if seconds < 5400.0 {
        format!("{:.0} min", seconds / 60.0)
    } else {
        format!("{:.1} h", seconds / 3600.0)
    }
}
