//! `sesamec lab contacts`: virtual objects, and robots that were recorded one at a time.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};
use clap::Args;

use sesame_analysis::{Datum, Table};
use sesame_plan::{CampaignPlan, Lab, LabShape, ShapePlace};
use sesame_runtime::trace;
use sesame_runtime::wire::WireTable;
use sesame_safety::contact::Interval;
use sesame_safety::coupling::Coupling;

use super::poses::{Signals, long_pause};
use super::replay::{Alike, Meeting, Recorded, judged, meetings, recorded};
use crate::cli::commands::check;
use crate::cli::results::{Format, Output, print};
use crate::cli::select::named_lab;
use crate::cli::shell::{self, Format as Diagnostics, Shell};
use crate::frontend::Language;

/// Which recordings, and how they belong together.
#[derive(Debug, Args)]
pub(in crate::cli) struct Asked {
    /// The `.sesame` file with the lab.
    file: PathBuf,
    /// A recording (MCAP, rosbag2, or a bag of ROS 1): of a run without the object, or with the other robot parked.
    recording: PathBuf,
    /// A second recording of the same test, in which the other robot moved and the first one was parked.
    #[arg(requires = "second")]
    other: Option<PathBuf>,
    /// The lab with the shapes; the only one of the space if omitted.
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    /// The shapes whose motion is taken from the second recording.
    #[arg(long, value_delimiter = ',', value_name = "SHAPES", requires = "other")]
    second: Vec<String>,
    /// The time in the first recording at which the second one has its 0 s.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true)]
    offset: f64,
    /// A recording of the same test, perhaps in simulation, in which nothing was missing. Comparing motions with it
    /// shows whether they depend on what was missing.
    #[arg(long, value_name = "RECORDING")]
    together: Option<PathBuf>,
    /// Tolerated difference of positions in two recordings of one motion.
    #[arg(long, value_name = "METRES", default_value_t = 0.01)]
    position_tolerance: f64,
    /// Tolerated difference of orientations in two recordings of one motion.
    #[arg(long, value_name = "RADIANS", default_value_t = 0.02)]
    angle_tolerance: f64,
    #[command(flatten)]
    output: Output,
}

/// Finds the contacts, and says whether they may be concluded.
pub(super) fn print_contacts(shell: Shell, language: &Language, asked: &Asked) -> anyhow::Result<()> {
    ensure!(asked.offset.is_finite(), "`--offset` must be a finite number of seconds");
    for (option, value) in
        [("--position-tolerance", asked.position_tolerance), ("--angle-tolerance", asked.angle_tolerance)]
    {
        ensure!(value >= 0.0, "`{option}` must be 0 or more");
    }
    let checked = check(shell, language, &asked.file, Diagnostics::Human)?;
    let Some(plan) = checked.plans.first().map(|runner| &runner.plan) else {
        bail!("{} has no campaign; topics and labs are those of a campaign", asked.file.display())
    };
    let Some(lab) = named_lab(plan, asked.lab.as_deref())? else {
        bail!("{} has no lab; describe the shapes in a `physical` block", asked.file.display())
    };
    let shapes = moving_shapes(lab)?;
    for name in &asked.second {
        ensure!(
            shapes.iter().any(|shape| shape.name == *name),
            "lab `{}` has no shape `{name}`; it has {}",
            lab.name,
            names(shapes)
        );
    }
    let first = signals(plan, &asked.recording)?;
    let second = asked.other.as_deref().map(|file| signals(plan, file)).transpose()?;
    let of = |shape: &LabShape| match &second {
        Some(signals) if asked.second.contains(&shape.name) => recorded(plan, shape, (1, signals, asked.offset)),
        _ => recorded(plan, shape, (0, &first, 0.0)),
    };
    let alone = shapes.iter().map(of).collect::<Result<Vec<_>, _>>().with_context(|| in_files(asked))?;
    warn_of_pauses(shell, &alone);
    let together = match &asked.together {
        None => None,
        Some(file) => {
            let signals = signals(plan, file)?;
            let shapes = shapes.iter().map(|shape| recorded(plan, shape, (0, &signals, 0.0)));
            Some(shapes.collect::<Result<Vec<_>, _>>().with_context(|| file.display().to_string())?)
        }
    };
    let alike = Alike { position: asked.position_tolerance, angle: asked.angle_tolerance };
    let found = found(plan, &alone, together.as_deref(), alike)?;
    print(&table(&found), &asked.output)?;
    if asked.output.format() == Format::Table {
        shell::asked_for(&format!("\n{}\n", sentences(&found).join("\n")))?;
    }
    Ok(())
}

/// The shapes of a lab, if there are contacts to look for.
pub(super) fn moving_shapes(lab: &Lab) -> anyhow::Result<&[LabShape]> {
    let moves = |shape: &LabShape| matches!(shape.place, ShapePlace::Pose { .. });
    ensure!(
        lab.shapes.len() >= 2 && lab.shapes.iter().any(moves),
        "lab `{}` needs two shapes at least, of which one is `on pose \"…\"`",
        lab.name
    );
    Ok(&lab.shapes)
}

/// Contacts of all pairs of shapes, each with the judgement whether it may be concluded.
pub(super) fn found(
    plan: &CampaignPlan,
    alone: &[Recorded],
    together: Option<&[Recorded]>,
    alike: Alike,
) -> anyhow::Result<Vec<Meeting>> {
    let pairs = meetings(alone)?.into_iter();
    Ok(pairs.map(|pair| judged(plan, pair, alone, together, alike)).collect::<Result<_, _>>()?)
}

/// The signals of a recording, on the topics of a plan.
pub(super) fn signals(plan: &CampaignPlan, file: &Path) -> anyhow::Result<Signals> {
    Ok(trace::signals(file, plan, &WireTable::new(plan))?)
}

fn names(shapes: &[LabShape]) -> String {
    let names: Vec<String> = shapes.iter().map(|shape| format!("`{}`", shape.name)).collect();
    names.join(", ")
}

fn in_files(asked: &Asked) -> String {
    match &asked.other {
        None => asked.recording.display().to_string(),
        Some(other) => format!("{} and {}", asked.recording.display(), other.display()),
    }
}

fn warn_of_pauses(shell: Shell, shapes: &[Recorded]) {
    for shape in shapes {
        if let Some((pause, from)) = shape.trace().and_then(long_pause) {
            shell.warning(format!(
                "the pose of `{}` was not recorded for {pause:.3} s from {from:.3} s: the motion in between is taken to \
                 be straight",
                shape.name
            ));
        }
    }
}

/// A row for each pair of shapes.
fn table(found: &[Meeting]) -> Table {
    let columns = [
        "one",
        "other",
        "first_contact_s",
        "contact_s",
        "margins_touch_s",
        "least_distance_m",
        "at_s",
        "known_from_s",
        "known_to_s",
        "motion",
    ];
    let real = |value: Option<f64>| value.map_or(Datum::Missing, Datum::Real);
    let rows = found.iter().map(|Meeting { one, other, contacts, margins_touch, coupling }| {
        vec![
            Datum::Text(one.clone()),
            Datum::Text(other.clone()),
            real(contacts.first()),
            Datum::Real(contacts.duration()),
            real(*margins_touch),
            Datum::Real(contacts.nearest.clearance),
            Datum::Real(contacts.nearest.time),
            Datum::Real(contacts.known.from),
            Datum::Real(contacts.known.to),
            Datum::Text(coupling.as_ref().map_or("together", word).to_owned()),
        ]
    });
    Table::of(columns.map(str::to_owned), rows)
}

/// One word for tables.
fn word(coupling: &Coupling) -> &'static str {
    match coupling {
        Coupling::Independent(_) => "independent",
        Coupling::Coupled(_) => "coupled",
        Coupling::Unknown(_) => "unknown",
    }
}

/// What follows from each pair, for people.
pub(super) fn sentences(found: &[Meeting]) -> Vec<String> {
    let said = found.iter().map(|Meeting { one, other, contacts, margins_touch, coupling }| {
        let Interval { from, to } = contacts.known;
        let (least, at) = (contacts.nearest.clearance, contacts.nearest.time);
        let touch = match contacts.first() {
            Some(time) if contacts.from_the_start() => {
                format!("`{one}` and `{other}` already touch at {time:.3} s, where the recording begins.")
            }
            Some(time) => format!("`{one}` and `{other}` touch first at {time:.3} s."),
            None => format!(
                "`{one}` and `{other}` do not touch from {from:.3} s to {to:.3} s; they are {least:.4} m apart at \
                 {at:.3} s."
            ),
        };
        let margins = match (margins_touch, contacts.first()) {
            (Some(margins), Some(first)) if *margins < first => {
                Some(format!("With their margins they do {:.3} s earlier.", first - margins))
            }
            (Some(margins), None) => Some(format!("With their margins they touch at {margins:.3} s.")),
            _ => None,
        };
        let judged = coupling.as_ref().map(Coupling::sentence);
        [Some(touch), margins, judged].into_iter().flatten().collect::<Vec<_>>().join(" ")
    });
    said.collect()
}
