//! `sesamec lab brief`: sheets for those who run tests in a lab, from the results of the simulation.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use clap::{Args, ValueEnum};

use sesame_analysis::{TestNumber, first_of, gathered};
use sesame_plan::{CampaignPlan, Lab, ShapePlace};
use sesame_record::Repository;
use sesame_report::show;
use sesame_safety::briefing::{Briefing, Person, html, text};
use sesame_safety::expansion::{Approach, Reaction, Stop, WALKING_SPEED, separation_distance};
use sesame_safety::speed::greatest_speed;

use super::briefing::{Facts, RobotSpeed, Traced, briefing};
use super::contacts::signals;
use super::replay::{Recorded, ReplayError, meetings, recorded};
use crate::cli::select::named_lab;
use crate::cli::shell::{self, Shell};

/// The shortest time over which a speed is measured in a recorded pose, in seconds: noise of a millimetre is then less
/// than 2 cm/s.
const SPEED_WINDOW: f64 = 0.1;

/// Which sheets, and what the results do not say.
#[derive(Debug, Args)]
pub(in crate::cli) struct Brief {
    /// The results of the campaign: a results file, or the folder of a run.
    results: PathBuf,
    /// The tests, for example `T158 T17`.
    #[arg(required = true, value_name = "TEST")]
    tests: Vec<String>,
    /// The lab; the only one of the space if omitted.
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    #[command(flatten)]
    conditions: Conditions,
    /// As text, or as a page to print, each test on a sheet of its own.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// Write into this file, which must not exist; if omitted, the sheets are printed.
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// What a sheet says that results do not.
#[derive(Debug, Args)]
pub(in crate::cli) struct Conditions {
    /// A person who must be present, with role and task, for example `safety pilot: holds the enabling switch`. May be
    /// repeated.
    #[arg(long, value_name = "ROLE: TASK", value_parser = person)]
    present: Vec<Person>,
    /// A further condition that people can see, and on which they stop the test. May be repeated.
    #[arg(long, value_name = "CONDITION")]
    stop: Vec<String>,
    /// The time until a robot begins to stop, in seconds: detection, response and communication together.
    #[arg(long, value_name = "SECONDS", requires = "deceleration")]
    reaction: Option<f64>,
    /// The deceleration of a braking robot, in metres per second squared.
    #[arg(long, value_name = "M/S2", requires = "reaction")]
    deceleration: Option<f64>,
    /// How fast people approach, in metres per second: 1.6 for walking, 2 for reaching, 0 for things that do not move.
    #[arg(long, value_name = "M/S", default_value_t = WALKING_SPEED)]
    approach: f64,
    /// How far a body part enters a zone before it is detected, in metres.
    #[arg(long, value_name = "METRES", default_value_t = 0.0)]
    intrusion: f64,
    /// The error of positions, of robots and people together, in metres.
    #[arg(long, value_name = "METRES", default_value_t = 0.0)]
    uncertainty: f64,
}

/// How sheets are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum Format {
    #[default]
    Text,
    Html,
}

/// `safety pilot: holds the enabling switch`.
fn person(text: &str) -> Result<Person, String> {
    match text.split_once(':').map(|(role, task)| (role.trim(), task.trim())) {
        Some((role, task)) if !role.is_empty() && !task.is_empty() => {
            Ok(Person { role: role.to_owned(), task: task.to_owned() })
        }
        _ => Err("expected a role and a task, such as `safety pilot: holds the enabling switch`".to_owned()),
    }
}

/// Prints the sheets, or writes them into a file.
pub(super) fn brief(shell: Shell, asked: &Brief) -> anyhow::Result<()> {
    let repository = Repository::open(&asked.results)?;
    let plan = repository.plan();
    let lab = named_lab(plan, asked.lab.as_deref())?;
    // Wrong numbers are refused even if no speed is known.
    if let Some(approach) = asked.conditions.approach(0.0) {
        separation_distance(&approach)?;
    }
    let sheets = sheets(shell, &asked.conditions, &repository, lab, &asked.tests)?;
    let written = match asked.format {
        Format::Text => sheets.iter().map(text::text).collect::<Vec<_>>().join("\n\n"),
        Format::Html => {
            let title = format!("Briefing: {} of {}", asked.tests.join(", "), plan.campaign.name);
            html::page(&title, &sheets)
        }
    };
    if asked.conditions.reaction.is_none() {
        shell.note("with `--reaction` and `--deceleration`, the sheet shows how much wider safety zones must be");
    }
    match &asked.out {
        None => shell::asked_for(&written),
        Some(file) => {
            write_new(file, &written)?;
            shell.did("Wrote", file.display());
            Ok(())
        }
    }
}

/// Writes a file that must not exist.
fn write_new(file: &Path, text: &str) -> anyhow::Result<()> {
    let opened = OpenOptions::new().write(true).create_new(true).open(file);
    let written = opened.and_then(|mut file| file.write_all(text.as_bytes()));
    written.with_context(|| format!("cannot write {}; choose a file that does not exist", file.display()))
}

impl Conditions {
    /// The approach of a robot of this speed, if it is said how it stops.
    fn approach(&self, robot_speed: f64) -> Option<Approach> {
        Some(Approach {
            robot_speed,
            other_speed: self.approach,
            reaction: Reaction { detection: self.reaction?, response: 0.0, communication: 0.0 },
            stop: Stop::Deceleration(self.deceleration?),
            intrusion: self.intrusion,
            other_uncertainty: 0.0,
            robot_uncertainty: self.uncertainty,
        })
    }
}

/// The sheets of tests. What lacks for several of them is gathered.
pub(in crate::cli) fn sheets(
    shell: Shell,
    asked: &Conditions,
    repository: &Repository,
    lab: Option<&Lab>,
    names: &[String],
) -> anyhow::Result<Vec<Briefing>> {
    let mut lacking = Lacking::default();
    let sheets = names.iter().map(|name| sheet(asked, repository, lab, name, &mut lacking)).collect();
    lacking.say(shell);
    sheets
}

/// What traces would show, and do not.
#[derive(Debug, Default)]
struct Lacking {
    /// Tests without a trace.
    traces: Vec<TestNumber>,
    /// Shapes that are in no trace, a sentence for each test.
    shapes: Vec<String>,
}

impl Lacking {
    fn say(&self, shell: Shell) {
        for shape in gathered(&self.shapes) {
            shell.warning(shape);
        }
        if !self.traces.is_empty() {
            shell.note(format!(
                "{}, so contacts are not computed; {}",
                no_trace(&self.traces),
                how_to_record(self.traces[0])
            ));
        }
    }
}

/// Which tests have no trace.
pub(super) fn no_trace(tests: &[TestNumber]) -> String {
    format!("{} {} no trace", first_of(tests), if tests.len() == 1 { "has" } else { "have" })
}

/// How the trace of a test is recorded afterwards.
pub(super) fn how_to_record(test: TestNumber) -> String {
    format!("`{} replay FILE {test} --record`, with the `.sesame` file, records one", shell::command())
}

/// The sheet of a test.
fn sheet(
    asked: &Conditions,
    repository: &Repository,
    lab: Option<&Lab>,
    name: &str,
    lacking: &mut Lacking,
) -> anyhow::Result<Briefing> {
    let plan = repository.plan();
    let report = show(repository, name)?;
    ensure!(!report.operations.is_empty(), "{} disturbs nothing: name a test that does", report.test);
    let ran = report.duplicate_of.unwrap_or(report.test);
    let judge = repository.judge()?;
    let traced = match (&report.trace, lab) {
        (Some(file), Some(lab)) => traced(plan, lab, file, lacking)?,
        (None, Some(lab)) if !lab.shapes.is_empty() => {
            lacking.traces.push(report.test);
            Traced::default()
        }
        _ => Traced::default(),
    };
    let facts = Facts { plan, lab, report: &report, repeated: judge.runs(ran.0), traced: &traced };
    let mut sheet = briefing(&facts, |speed| {
        let approach = asked.approach(speed)?;
        Some((approach, separation_distance(&approach).ok()?))
    });
    sheet.stop_when.extend(asked.stop.iter().cloned());
    sheet.present.extend(asked.present.iter().cloned());
    Ok(sheet)
}

/// What the trace of a test shows of the lab's shapes.
fn traced(plan: &CampaignPlan, lab: &Lab, file: &Path, lacking: &mut Lacking) -> anyhow::Result<Traced> {
    if lab.shapes.is_empty() {
        return Ok(Traced::default());
    }
    let signals = signals(plan, file)?;
    let mut shapes = Vec::new();
    for shape in &lab.shapes {
        match recorded(plan, shape, (0, &signals, 0.0)) {
            Ok(shape) => shapes.push(shape),
            Err(error @ ReplayError::Shape { .. }) if matches!(shape.place, ShapePlace::Pose { .. }) => {
                lacking.shapes.push(format!("{error}: `{}`", file.display()));
            }
            Err(error) => return Err(error.into()),
        }
    }
    let speed = |shape: &Recorded| {
        let speed = greatest_speed(shape.trace()?, SPEED_WINDOW).ok()?;
        let of = format!("the recorded pose of {}, from {:.2} s to {:.2} s", shape.name, speed.from, speed.to);
        Some(RobotSpeed { of, metres_per_second: speed.value })
    };
    Ok(Traced { speeds: shapes.iter().filter_map(speed).collect(), meetings: meetings(&shapes)? })
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use sesame_plan::testing;
    use sesame_plan::{Bound, LabExclusion, LabShape, MetricId, ShapeForm};
    use sesame_record::sample;

    use super::*;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        brief: Brief,
    }

    fn asked(arguments: &[&str]) -> Brief {
        Line::parse_from(["brief", "results"].iter().chain(arguments)).brief
    }

    /// The sample campaign with a lab, whose shapes are in no trace.
    fn plan(excluded_above: f64) -> CampaignPlan {
        let shape = |name: &str, place| LabShape {
            name: name.to_owned(),
            doc: String::new(),
            form: ShapeForm::Sphere { radius: 0.3 },
            place,
            expand: 0.5,
        };
        let gripper = ShapePlace::Pose { pose: "gripper".to_owned() };
        let exclusion = LabExclusion { metric: MetricId(0), bound: Bound::Above { value: excluded_above } };
        let lab = Lab {
            exclude: vec![exclusion],
            interlock: vec![MetricId(0), MetricId(1)],
            shapes: vec![shape("gripper", gripper), shape("Z1", ShapePlace::Fixed { centre: [1.0, 0.0, 0.0] })],
            ..testing::lab("hall")
        };
        CampaignPlan { labs: vec![lab], ..sample::plan() }
    }

    fn sheets(plan: &CampaignPlan, arguments: &[&str]) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        let repository = sample::campaign_with_fronts(folder.path(), plan, 45);
        let asked = asked(arguments);
        let lab = plan.labs.first();
        let sheets = super::sheets(Shell::silent(), &asked.conditions, &repository, lab, &asked.tests).unwrap();
        sheets.iter().map(text::text).collect()
    }

    #[test]
    fn a_sheet_says_what_is_disturbed_what_was_seen_and_when_to_stop() {
        let arguments = [
            "T17",
            "--present",
            "safety pilot: holds the enabling switch",
            "--stop",
            "the gripper is lower than the belt",
            "--reaction",
            "0.35",
            "--deceleration",
            "2",
        ];
        insta::assert_snapshot!(sheets(&plan(1000.0), &arguments)[0]);
    }

    #[test]
    fn a_test_that_the_lab_excludes_begins_with_a_warning() {
        let sheet = &sheets(&plan(-1.0), &["T17"])[0];
        let solid = sheet.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(solid.contains("WARNING: The lab excludes this test: it has collision_occurrence"), "{sheet}");
        assert!(solid.contains("was not computed: it is not known how robots stop."), "{sheet}");
    }

    #[test]
    fn tests_without_a_trace_are_said_once() {
        let tests: Vec<TestNumber> = [3, 7, 9, 12, 13].map(TestNumber).to_vec();
        assert_eq!(no_trace(&tests[..1]), "T3 has no trace");
        assert_eq!(no_trace(&tests), "T3, T7, T9 and 2 more have no trace");
        assert_eq!(
            how_to_record(tests[0]),
            format!("`{} replay FILE T3 --record`, with the `.sesame` file, records one", shell::command())
        );
    }

    #[test]
    fn how_a_robot_stops_is_said_completely_or_not_at_all() {
        assert!(Line::try_parse_from(["brief", "results", "T1", "--reaction", "0.3"]).is_err());
        assert!(Line::try_parse_from(["brief", "results", "T1", "--present", "pilot"]).is_err());
        assert!(Line::try_parse_from(["brief", "results"]).is_err());
    }

    #[test]
    fn a_file_of_the_user_is_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("brief.txt");
        write_new(&file, "one").unwrap();
        let refused = write_new(&file, "two").unwrap_err().to_string();
        assert!(refused.ends_with("brief.txt; choose a file that does not exist"), "{refused}");
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "one");
    }
}
