//! Decisions, for people and for programs.

use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::path::Path;

use serde::Serialize;

use sesame_base::observation::ChangeCause;
use sesame_base::visible::{visible, visible_json};
use sesame_plan::CampaignPlan;
use sesame_relay::monitor::{Cause, Decided};

use crate::output::{Failure, Format, print};

/// Where decisions are shown.
pub(super) struct Shown<'p> {
    plan: &'p CampaignPlan,
    /// How on standard output.
    format: Format,
    file: Option<(File, &'p Path)>,
}

/// A decision as an object of JSON.
#[derive(Serialize)]
struct Line<'a> {
    /// The test, counted from 1; only between a runner and a simulator.
    #[serde(skip_serializing_if = "Option::is_none")]
    run: Option<u32>,
    time_s: f64,
    monitor: &'a str,
    state: &'a str,
    causes: Vec<Changed<'a>>,
}

/// A change of evidence.
#[derive(Serialize)]
struct Changed<'a> {
    monitor: &'a str,
    evidence: &'a str,
    /// `None` while it is unknown.
    holds: Option<bool>,
    #[serde(flatten)]
    by: &'a ChangeCause,
}

impl<'p> Shown<'p> {
    pub(super) fn new(plan: &'p CampaignPlan, format: Format, file: Option<&'p Path>) -> Result<Self, Failure> {
        let file = file.map(|path| match File::create(path) {
            Ok(file) => Ok((file, path)),
            Err(error) => Err(Failure(format!("cannot write {}: {error}", path.display()))),
        });
        Ok(Shown { plan, format, file: file.transpose()? })
    }

    /// Shows a decision everywhere.
    pub(super) fn decided(&mut self, run: Option<u32>, decided: &Decided) -> Result<(), Failure> {
        let text = match self.format {
            Format::Text => self.text(decided),
            Format::Json => self.json(run, decided)?,
        };
        print(&text)?;
        self.record(run, decided)
    }

    /// Writes a decision into the file only: standard output is for something else.
    pub(super) fn record(&mut self, run: Option<u32>, decided: &Decided) -> Result<(), Failure> {
        if self.file.is_none() {
            return Ok(());
        }
        let line = self.json(run, decided)?;
        let Some((file, path)) = &mut self.file else { return Ok(()) };
        let written = file.write_all(line.as_bytes());
        written.map_err(|error| Failure(format!("cannot write {}: {error}", path.display())))
    }

    fn json(&self, run: Option<u32>, decided: &Decided) -> Result<String, Failure> {
        let monitor = self.plan.monitor(decided.monitor);
        let causes = decided.causes.iter().map(|Cause { monitor, evidence, holds, by }| {
            let monitor = self.plan.monitor(*monitor);
            let evidence = &monitor.evidence[*evidence as usize].name;
            Changed { monitor: &monitor.name, evidence, holds: *holds, by }
        });
        let line = Line {
            run,
            time_s: decided.at.seconds(),
            monitor: &monitor.name,
            state: monitor.state_name(decided.state),
            causes: causes.collect(),
        };
        Ok(visible_json(&serde_json::to_string(&line)?).into_owned() + "\n")
    }

    fn text(&self, decided: &Decided) -> String {
        let monitor = self.plan.monitor(decided.monitor);
        let state = monitor.state_name(decided.state);
        let mut text = format!("{} s  {}  {state}", decided.at.seconds(), monitor.name);
        for (at, cause) in decided.causes.iter().enumerate() {
            let monitor = self.plan.monitor(cause.monitor);
            let evidence = &monitor.evidence[cause.evidence as usize].name;
            let is = match cause.holds {
                Some(true) => "is true",
                Some(false) => "is false",
                None => "is unknown",
            };
            let by = match &cause.by {
                ChangeCause::Message { topic, index } => format!("message {index} on {topic}"),
                ChangeCause::Held => "held long enough".to_owned(),
                ChangeCause::Stale => "stale".to_owned(),
            };
            let before = if at == 0 { "  " } else { "; " };
            write!(text, "{before}{}.{evidence} {is} ({by})", monitor.name).expect("text grows as needed");
        }
        visible(&text) + "\n"
    }
}
