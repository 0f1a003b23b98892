//! `monitors`: what monitors decide on two recordings, of a simulation and of a lab, say [SESAME 2023, §3.3.4].

#[cfg(feature = "mcap")]
mod compared;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use crate::cli::failure::Failure;
use crate::cli::session::Session;
use crate::cli::terminal::Format;

#[cfg(feature = "mcap")]
pub(super) use compared::compared;

/// Which recordings are compared.
#[derive(Debug, Args)]
pub struct MonitorsArgs {
    /// The first recording: a file, a folder of rosbag2, a test of the run such as `T17`, or a test of another run such
    /// as `42-hall/T3`
    first: PathBuf,
    /// The second recording, in the same notation
    second: PathBuf,
    /// Compare this monitor only; may be repeated
    #[arg(long = "monitor", value_name = "NAME")]
    monitors: Vec<String>,
    /// Seconds by which the times of a decision may differ; by default any number
    #[arg(long, value_name = "SECONDS", value_parser = not_negative)]
    within: Option<f64>,
    /// Folder of the run with the tests, for example `results/42`; by default the latest
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// The format of the results
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// A length of simulation time from the command line.
fn not_negative(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number of seconds".to_owned())?;
    if seconds.is_finite() && seconds >= 0.0 { Ok(seconds) } else { Err("must be 0 or more".to_owned()) }
}

#[cfg(not(feature = "mcap"))]
pub(super) fn monitors(session: &Session, args: &MonitorsArgs) -> Result<ExitCode, Failure> {
    let MonitorsArgs { first, second, .. } = args;
    Err(Failure(format!(
        "the runner of `{}` was built without the feature `mcap` of sesame-runtime, so it cannot read {} and {}",
        session.plan.campaign.name,
        first.display(),
        second.display()
    )))
}

#[cfg(feature = "mcap")]
pub(super) fn monitors(session: &Session, args: &MonitorsArgs) -> Result<ExitCode, Failure> {
    use sesame_base::gathered::gathered;
    use sesame_report::monitors_text;

    use crate::cli::failure::NOT_AS_REQUIRED;
    use crate::cli::terminal::{print, print_json, say, text_options};

    let plan = &session.plan;
    let chosen = chosen(plan, &args.monitors, |_| true)?;
    let files = [&args.first, &args.second].map(|named| recording(session, args, named));
    let [first, second] = files;
    let found = compared(plan, [&first?, &second?], &chosen, args.within)?;
    for warning in gathered(&found.warnings) {
        say(format_args!("warning: {warning}"));
    }
    match args.format {
        Format::Text => print(&monitors_text(&found, text_options()))?,
        Format::Json => print_json(&found)?,
    };
    for objection in gathered(found.objections()) {
        say(format_args!("not as required: {}", sesame_base::visible::visible_lines(&objection)));
    }
    Ok(ExitCode::from(if found.same { 0 } else { NOT_AS_REQUIRED }))
}

/// Compares what monitors decide in the regression tests that ran in simulation and in a lab, as a step of the
/// preparation.
#[cfg(all(feature = "process", feature = "mcap"))]
pub(super) fn of_both_sides(
    session: &Session,
    lab: Option<&sesame_plan::Lab>,
    found: &mut crate::cli::preparation::Found,
) -> Result<(), Failure> {
    use std::collections::BTreeMap;

    use sesame_plan::KnownTestId;
    use sesame_record::{Origin, Repository};
    use sesame_report::preparation::{self, MonitorTest};

    let (Some([simulation, in_lab]), Some(lab)) = (found.known, lab) else {
        let sentence = "`monitors` is left out: no regression test ran in simulation and in a lab.";
        found.preparation.left_out.push(sentence.to_owned());
        return Ok(());
    };
    let [simulation, in_lab]: [&Repository; 2] = [&found.files[simulation].1, &found.files[in_lab].1];
    let all = chosen(&session.plan, &[], |_| true)?;
    let traces = |repository: &Repository| -> Result<BTreeMap<u32, PathBuf>, Failure> {
        let runs = repository.records(0..=u32::MAX, false)?;
        let known = runs.into_iter().filter_map(|run| match run.origin {
            Origin::Known(KnownTestId(id)) => Some((id, repository.trace(run.number, None)?)),
            Origin::Reference | Origin::Search => None,
        });
        Ok(known.collect())
    };
    let (simulated, there) = (traces(simulation)?, traces(in_lab)?);
    let mut tests = Vec::new();
    for (id, first) in &simulated {
        let Some(second) = there.get(id) else { continue };
        let compared = compared(&session.plan, [first, second], &all, None)?;
        tests.push(MonitorTest { test: session.plan.test(KnownTestId(*id)).name.clone(), compared });
    }
    found.preparation.monitors = Some(preparation::monitors(&lab.name, tests));
    Ok(())
}

/// A runner that reads no recordings leaves that step out.
#[cfg(all(feature = "process", not(feature = "mcap")))]
#[expect(clippy::unnecessary_wraps, reason = "as the one that reads recordings")]
pub(super) fn of_both_sides(
    _: &Session,
    _: Option<&sesame_plan::Lab>,
    found: &mut crate::cli::preparation::Found,
) -> Result<(), Failure> {
    let sentence = "`monitors` is left out: this runner was built without the feature `mcap` of sesame-runtime.";
    found.preparation.left_out.push(sentence.to_owned());
    Ok(())
}

/// The monitors of these names, in the order of the space; all that are wanted if none is named.
pub(super) fn chosen(
    plan: &sesame_plan::CampaignPlan,
    names: &[String],
    is_wanted: impl Fn(&sesame_plan::Monitor) -> bool,
) -> Result<Vec<sesame_plan::MonitorId>, Failure> {
    if plan.monitors.is_empty() {
        return Err(Failure("the space has no monitors; an `eddi` block declares one".to_owned()));
    }
    let known = || plan.monitors.iter().map(|monitor| monitor.name.as_str());
    if let Some(stranger) = names.iter().find(|name| !known().any(|known| known == *name)) {
        let known: Vec<String> = known().map(|name| format!("`{name}`")).collect();
        return Err(Failure(format!("there is no monitor `{stranger}`, there is {}", known.join(", "))));
    }
    let all = (0..).map(sesame_plan::MonitorId).zip(&plan.monitors);
    let named = |monitor: &sesame_plan::Monitor| names.contains(&monitor.name) || names.is_empty();
    Ok(all.filter(|(_, monitor)| named(monitor) && is_wanted(monitor)).map(|(id, _)| id).collect())
}

/// The file that the user means: by its name, or by that of a test that was recorded.
#[cfg(feature = "mcap")]
fn recording(session: &Session, args: &MonitorsArgs, named: &std::path::Path) -> Result<PathBuf, Failure> {
    use sesame_base::test_number::TestNumber;

    use crate::cli::execution::shown;
    use crate::cli::results_folder::open;

    const ENDINGS: [&str; 4] = ["mcap", "db3", "bag", "zstd"];
    // The folder of a run is none of a recording.
    if named.is_file() || named.is_dir() && !named.join(sesame_record::DATABASE).is_file() {
        return Ok(named.to_owned());
    }
    if named.extension().is_some_and(|extension| ENDINGS.iter().any(|ending| extension == *ending)) {
        return Err(Failure(format!("there is no recording {}", shown(named))));
    }
    let folder = named.parent().filter(|folder| !folder.as_os_str().is_empty());
    let test = named.file_name().unwrap_or_default().to_string_lossy();
    let repository = open(&session.results, folder.or(args.results.as_deref()))?;
    let number = repository.find(&test)?;
    let duplicate_of = repository.row(number)?.duplicate_of;
    repository.trace(number, duplicate_of).ok_or_else(|| {
        let original = TestNumber(duplicate_of.unwrap_or(number)).to_string();
        let folder = shown(repository.folder());
        let again = session.caller.command("replay", &[&original, "--record", "--results", &folder]);
        Failure(format!(
            "{} has no recording: `record mcap all` in the campaign records one for each test, and this records one \
             for this test, if its result is the same:\n    {again}",
            TestNumber(number)
        ))
    })
}
