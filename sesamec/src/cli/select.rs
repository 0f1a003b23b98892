//! `sesamec select`: which tests of a campaign are run in a lab.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{bail, ensure};
use clap::Args;

use sesame_analysis::choice::{Choice, Choosing};
use sesame_analysis::{Selection, Terms, TestNumber, candidates, first_of};
use sesame_plan::{CampaignPlan, Dimension, Lab, LabBudget, LabCost, MetricId, RankKey, RankOrder};
use sesame_record::Repository;

use super::results::{Compat, Format, Output, dimension, print};
use super::shell::{self, Shell};

/// What is chosen from, and by what.
#[derive(Debug, Args)]
pub(super) struct Selected {
    /// A results file, or the folder of a run.
    file: PathBuf,
    /// The lab whose `physical` block provides defaults for the options below; the only one of the space if omitted.
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    /// Choose from this result set; from the latest front if omitted. `sesamec results campaigns` lists them.
    #[arg(long, value_name = "NAME", conflicts_with = "all")]
    set: Option<String>,
    /// Choose from all tests instead of the front.
    #[arg(long)]
    all: bool,
    /// The most that the tests together may cost.
    #[arg(long, value_name = "COST")]
    budget: Option<f64>,
    /// The weight of difference against interest, from 0 (the most interesting tests) to 1 (the most different ones).
    #[arg(long, value_name = "WEIGHT")]
    lambda: Option<f64>,
    /// The dimensions in which tests differ, for example `T1,T2,P1`.
    #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = dimension)]
    dims: Vec<Dimension>,
    /// What makes a test interesting, the most important metric first: `collisions:descending,time:ascending`; with a
    /// number, tests close to it come first: `clearance:0.5`.
    #[arg(long, value_delimiter = ',', value_name = "METRIC:ORDER")]
    rank: Vec<String>,
    /// The cost of a test, for example `1`, or `1+0.5` to add 0.5 for each of its operations; `T5=3` for one test. May
    /// be repeated.
    #[arg(long, value_delimiter = ',', value_name = "COST", value_parser = cost)]
    cost: Vec<Cost>,
    /// Tests that must not be run, for example `T5,T9`, in addition to those that the lab excludes.
    #[arg(long, value_delimiter = ',', value_name = "TESTS")]
    exclude: Vec<String>,
    /// Tests that were already run: the choice contains them, and the budget is for others.
    #[arg(long, value_delimiter = ',', value_name = "TESTS")]
    run: Vec<String>,
    /// Only tests with a finding that fresh runs confirmed.
    #[arg(long)]
    confirmed: bool,
    /// Show all weights at which the choice changes instead, and which tests enter and leave.
    #[arg(long)]
    sweep: bool,
    /// Wall time after which the best choice so far is taken, with a bound for any better one.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    limit: f64,
    /// The formulas to use: `original` for those of the original platform, `paper` for those of the paper.
    #[arg(long, value_enum, default_value_t)]
    compat: Compat,
    #[command(flatten)]
    output: Output,
}

/// What tests cost.
#[derive(Debug, Clone)]
enum Cost {
    /// All that are not named.
    Any(LabCost),
    /// The test of this name.
    Of(String, f64),
}

/// `1`, `1+0.5`, or `T5=3`.
fn cost(text: &str) -> Result<Cost, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite() && *number >= 0.0);
    if let Some((name, one)) = text.split_once('=') {
        let one =
            number(one).ok_or_else(|| format!("`{one}` is not a valid cost of {name}; expected a number such as 3"))?;
        return Ok(Cost::Of(name.trim().to_owned(), one));
    }
    let (base, each) = text.split_once('+').unwrap_or((text, "0"));
    match number(base).zip(number(each)) {
        Some((base, per_operation)) if base + per_operation > 0.0 => Ok(Cost::Any(LabCost { base, per_operation })),
        _ => Err("expected a cost such as 1, 1+0.5, or T5=3".to_owned()),
    }
}

/// What a test costs, if it was said for all, and what single tests cost, by number.
fn costs(repository: &Repository, asked: &[Cost]) -> anyhow::Result<(Option<LabCost>, BTreeMap<u32, f64>)> {
    let (mut any, mut single) = (None, BTreeMap::new());
    for cost in asked {
        let twice = match cost {
            Cost::Any(cost) => any.replace(*cost).is_some().then_some("of all tests"),
            Cost::Of(name, cost) => single.insert(repository.find(name)?, *cost).is_some().then_some(name.as_str()),
        };
        if let Some(what) = twice {
            bail!("the cost {what} is given twice with `--cost`")
        }
    }
    Ok((any, single))
}

/// Chooses, and says what was chosen.
pub(super) fn selected(shell: Shell, asked: &Selected) -> anyhow::Result<ExitCode> {
    let repository = Repository::open(&asked.file)?;
    let plan = repository.plan();
    let lab = named_lab(plan, asked.lab.as_deref())?;
    let declared = lab.and_then(|lab| lab.budget.as_ref());
    let Some(budget) = asked.budget.or(declared.map(|budget| budget.limit)) else {
        bail!("how much may the tests cost? give `--budget`, or a `budget` in the lab's `physical` block")
    };
    let lambda = asked.lambda.or(declared.map(|budget| budget.lambda)).unwrap_or(0.5);
    ensure!(asked.limit > 0.0, "`--limit` must be above 0");
    let numbers_of = |names: &[String]| -> anyhow::Result<BTreeSet<u32>> {
        names.iter().map(|name| Ok(repository.find(name)?)).collect()
    };
    let (excluded, run) = (numbers_of(&asked.exclude)?, numbers_of(&asked.run)?);
    let (cost, costs) = costs(&repository, &asked.cost)?;
    let terms = Terms {
        over: dimensions(&asked.dims, declared),
        rank: rank(plan, &asked.rank, lab)?,
        cost: cost.or(lab.map(|lab| lab.cost)).unwrap_or_default(),
        costs,
        exclude: lab.map_or_else(Vec::new, |lab| lab.exclude.clone()),
        budget,
        confirmed: asked.confirmed,
        convention: asked.compat.convention(),
    };
    let latest = repository.latest_result_set()?.map(|set| set.name).filter(|_| !asked.all);
    let set = asked.set.clone().or(latest);
    let mut found = candidates(&repository, &Selection::of(&repository, set.as_deref())?, &terms)?;
    found.tests.retain(|candidate| !excluded.contains(&candidate.number));
    let choosing = Choosing::new(&found, &terms, lambda, &run)?;
    let until = Instant::now() + Duration::from_secs_f64(asked.limit.min(1e6));
    let mut stop = || Instant::now() >= until;
    if asked.sweep {
        let sweep = choosing.sweep(&mut stop);
        print(&choosing.sweep_table(&sweep), &asked.output)?;
        if !sweep.proved {
            shell.note(
                "not all of it is proved within `--limit`: there may be better choices, and more changes".to_owned(),
            );
        }
        return Ok(ExitCode::SUCCESS);
    }
    let choice = choosing.best(&mut stop);
    print(&choosing.table(plan, &terms, &choice, &run), &asked.output)?;
    let Choice { tests, value, cost, .. } = &choice;
    let said = format!(
        "{} of {} candidates for {cost} of {budget}, λ {lambda}: value {value}, {}",
        tests.len(),
        found.tests.len(),
        choice.proof()
    );
    if asked.output.format() == Format::Table {
        shell::asked_for(&format!("\n{said}\n"))?;
    } else {
        shell.note(said);
    }
    let mut reasons: Vec<(String, Vec<TestNumber>)> = Vec::new();
    for (number, reason) in &found.left_out {
        let words = reason.words(plan);
        match reasons.iter_mut().find(|(known, _)| *known == words) {
            Some((_, tests)) => tests.push(TestNumber(*number)),
            None => reasons.push((words, vec![TestNumber(*number)])),
        }
    }
    for (words, tests) in &reasons {
        let are = if tests.len() == 1 { "is not a candidate" } else { "are not candidates" };
        shell.note(format!("{} {are}: {words}", first_of(tests)));
    }
    if let Some(more) = choosing.next_budget(&choice, &mut stop) {
        let names: Vec<String> = more.tests.iter().map(|number| format!("T{number}")).collect();
        shell.note(format!("a budget of {} would buy a value of {}: {}", more.budget, more.value, names.join(" ")));
    }
    Ok(ExitCode::SUCCESS)
}

/// The lab of this name, or the only one; `None` for results whose space has none.
pub(super) fn named_lab<'a>(plan: &'a CampaignPlan, name: Option<&str>) -> anyhow::Result<Option<&'a Lab>> {
    let known = || plan.labs.iter().map(|lab| format!("`{}`", lab.name)).collect::<Vec<_>>().join(", ");
    match (name, &plan.labs[..]) {
        (None, []) => Ok(None),
        (None, [lab]) => Ok(Some(lab)),
        (None, _) => bail!("the space has several labs; name one with `--lab`: {}", known()),
        (Some(name), []) => bail!("there is no lab `{name}`: the space had none when this was recorded"),
        (Some(name), labs) => match labs.iter().find(|lab| lab.name == name) {
            Some(lab) => Ok(Some(lab)),
            None => bail!("there is no lab `{name}`, there is {}", known()),
        },
    }
}

fn dimensions(asked: &[Dimension], declared: Option<&LabBudget>) -> Vec<Dimension> {
    match (asked, declared) {
        ([], Some(budget)) => budget.over.clone(),
        ([], None) => vec![Dimension::T1, Dimension::T2, Dimension::P1],
        (asked, _) => asked.to_vec(),
    }
}

/// What tests are ranked by: as asked, else as the lab says, else by the objectives.
fn rank(plan: &CampaignPlan, asked: &[String], lab: Option<&Lab>) -> anyhow::Result<Vec<RankKey>> {
    let mut keys: Vec<RankKey> = Vec::new();
    for key in asked {
        let Some((name, order)) = key.split_once(':') else {
            bail!("`{key}` does not say which values come first; write `{key}:descending`, `:ascending`, or a number")
        };
        let Some(metric) = (0u32..).map(MetricId).zip(&plan.metrics).find(|(_, metric)| metric.name == name) else {
            let known: Vec<&str> = plan.metrics.iter().map(|metric| metric.name.as_str()).collect();
            bail!("there is no metric `{name}`; there are {}", known.join(", "))
        };
        let order = match order {
            "ascending" => RankOrder::Ascending,
            "descending" => RankOrder::Descending,
            number => match number.parse::<f64>() {
                Ok(value) if value.is_finite() => RankOrder::ClosestTo { value },
                _ => bail!("`{order}` is neither `ascending` nor `descending` nor a number"),
            },
        };
        ensure!(keys.iter().all(|known| known.metric != metric.0), "`{name}` is listed twice");
        keys.push(RankKey { metric: metric.0, order });
    }
    if !keys.is_empty() {
        return Ok(keys);
    }
    let declared = lab.map_or(&[][..], |lab| &lab.rank);
    Ok(if declared.is_empty() { Terms::rank_by_objectives(plan) } else { declared.to_vec() })
}
