//! How far a campaign's front is from a given one: IGD and IGD⁺.

use serde_json::Value;

use sesame_optimise::dominance::Fitness;
use sesame_optimise::front::Front;
use sesame_optimise::igd::{Scaling, igd, igd_plus};
use sesame_plan::{CampaignPlan, Objective};
use sesame_record::{Origin, RecordError, Repository};

use crate::{Datum, Table};

/// A front that others are measured against: known from elsewhere, or that of other results.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenFront {
    /// Per point a value per objective of the campaign, in its order and unit, as tables show it.
    points: Vec<Vec<f64>>,
}

impl GivenFront {
    /// Reads points from a text, for the objectives of a plan. The error says what is wrong with it.
    ///
    /// The text is CSV or JSON, as `sesamec results front` writes them, with a column or key for each objective; or
    /// rows of numbers in the order of the objectives, apart by commas or blanks, as `numpy.savetxt` writes them, or
    /// as JSON lists. Values are those of the metrics: none is negated because more is sought.
    pub fn read(text: &str, plan: &CampaignPlan) -> Result<GivenFront, String> {
        let points = if text.trim_start().starts_with('[') { from_json(text, plan) } else { from_rows(text, plan) }?;
        GivenFront::of_points(points)
    }

    /// The front of all tests of other results, whose campaign must have the objectives of this plan in the same units.
    pub fn of_results(other: &Repository, plan: &CampaignPlan) -> Result<GivenFront, GivenFrontError> {
        let theirs: Vec<Objective> = other.plan().objectives().collect();
        let mut columns = Vec::new();
        for &metric in &plan.campaign.objectives {
            let metric = plan.metric(metric);
            let same = |objective: &Objective| {
                let other = other.plan().metric(objective.metric);
                other.name == metric.name && other.unit == metric.unit
            };
            columns.push(theirs.iter().position(same).ok_or_else(|| {
                let unit = metric.unit.as_deref().unwrap_or("without a unit");
                GivenFrontError::Unfit(format!("its campaign has no objective `{}` ({unit})", metric.name))
            })?);
        }
        let mut front = Front::default();
        let judge = other.judge().map_err(GivenFrontError::Record)?;
        let judged = &mut |test: sesame_record::ScannedTest| {
            if test.origin != Origin::Reference {
                front.add(test.number, &judge.fitness(&test));
            }
        };
        other.scan(judged).map_err(GivenFrontError::Record)?;
        let point = |values: &[f64]| columns.iter().map(|&at| theirs[at].in_unit(values[at])).collect();
        let points = front.members().iter().map(|member| point(&member.objectives)).collect();
        GivenFront::of_points(points).map_err(GivenFrontError::Unfit)
    }

    fn of_points(points: Vec<Vec<f64>>) -> Result<GivenFront, String> {
        if points.is_empty() {
            return Err("it has no points".to_owned());
        }
        Ok(GivenFront { points })
    }
}

/// Why a front cannot be taken from results.
#[derive(Debug, thiserror::Error)]
pub enum GivenFrontError {
    /// They cannot be read.
    #[error(transparent)]
    Record(RecordError),
    /// They do not fit the campaign.
    #[error("{0}")]
    Unfit(String),
}

fn names(plan: &CampaignPlan) -> Vec<&str> {
    plan.campaign.objectives.iter().map(|&metric| plan.metric(metric).name.as_str()).collect()
}

fn finite(number: f64, row: usize) -> Result<f64, String> {
    if number.is_finite() { Ok(number) } else { Err(format!("row {row} holds {number}, which is not a finite number")) }
}

fn from_json(text: &str, plan: &CampaignPlan) -> Result<Vec<Vec<f64>>, String> {
    let rows: Vec<Value> = serde_json::from_str(text).map_err(|error| format!("it is not a list in JSON: {error}"))?;
    let names = names(plan);
    let number = |value: &Value, row: usize| {
        value.as_f64().ok_or_else(|| format!("row {row} holds {value}, which is not a number"))
    };
    let mut points = Vec::new();
    for (row, value) in (1..).zip(&rows) {
        let point: Vec<f64> = match value {
            Value::Array(values) if values.len() == names.len() => {
                values.iter().map(|value| number(value, row)).collect::<Result<_, _>>()?
            }
            Value::Array(_) => {
                let (count, names) = (names.len(), names.join(", "));
                return Err(format!("row {row} does not hold {count} numbers, one for each objective ({names})"));
            }
            Value::Object(object) => {
                let of = |name: &&str| match object.get(*name) {
                    Some(value) => number(value, row),
                    None => Err(format!("row {row} has no `{name}`")),
                };
                names.iter().map(of).collect::<Result<_, _>>()?
            }
            _ => return Err(format!("row {row} is neither a list nor an object")),
        };
        points.push(point);
    }
    Ok(points)
}

fn from_rows(text: &str, plan: &CampaignPlan) -> Result<Vec<Vec<f64>>, String> {
    let names = names(plan);
    let rows = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let rows: Vec<(usize, Vec<String>)> = rows.map(|(row, line)| (row, cells(line))).collect();
    let Some((_, head)) = rows.first() else { return Ok(Vec::new()) };
    let headless = head.iter().all(|cell| cell.parse::<f64>().is_ok());
    let columns: Vec<usize> = if headless {
        if head.len() != names.len() {
            return Err(format!("it has {} columns for {} objectives ({})", head.len(), names.len(), names.join(", ")));
        }
        (0..names.len()).collect()
    } else {
        let column = |name: &&str| {
            let at = head.iter().position(|cell| cell == name);
            at.ok_or_else(|| format!("it has no column `{name}`; its columns are {}", head.join(", ")))
        };
        names.iter().map(column).collect::<Result<_, _>>()?
    };
    let mut points = Vec::new();
    for (row, cells) in &rows[usize::from(!headless)..] {
        let number = |&at: &usize| {
            let cell = cells.get(at).ok_or_else(|| format!("row {row} ends before column {}", at + 1))?;
            let number = cell.parse().map_err(|_| format!("row {row} holds `{cell}`, which is not a number"))?;
            finite(number, *row)
        };
        points.push(columns.iter().map(number).collect::<Result<_, _>>()?);
    }
    Ok(points)
}

/// The cells of a row: apart by commas, then perhaps quoted, or else by blanks.
fn cells(line: &str) -> Vec<String> {
    if !line.contains(',') {
        return line.split_whitespace().map(str::to_owned).collect();
    }
    let mut cells = vec![String::new()];
    let mut quoted = false;
    let mut characters = line.chars().peekable();
    while let Some(character) = characters.next() {
        let last = cells.last_mut().expect("there is a cell from the beginning");
        match character {
            '"' if quoted && characters.peek() == Some(&'"') => {
                last.push('"');
                characters.next();
            }
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            other => last.push(other),
        }
    }
    cells.iter().map(|cell| cell.trim().to_owned()).collect()
}

/// How far the front was from a given one after a generation, or at a result set of an imported campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct FrontDistance {
    /// The result set, of an imported campaign.
    pub set: Option<String>,
    /// The generation.
    pub generation: Option<u32>,
    /// Tests that were evaluated by then; for a result set, its members.
    pub evaluations: usize,
    /// Points on the front.
    pub front: usize,
    /// IGD: the mean, over the points of the given front, of the distance to the nearest point of the front; `None` for
    /// an empty front.
    pub igd: Option<f64>,
    /// IGD⁺: the same, of distances that count only in the objectives in which the front's point is worse.
    pub igd_plus: Option<f64>,
}

/// The distances to a given front after each generation; of an imported campaign at each of its result sets; and of all
/// tests, where the last of these holds fewer.
pub fn distances(
    repository: &Repository,
    given: &GivenFront,
    scaling: Scaling,
) -> Result<Vec<FrontDistance>, RecordError> {
    let plan = repository.plan();
    let oriented = |point: &Vec<f64>| -> Vec<f64> {
        plan.objectives().zip(point).map(|(objective, &value)| objective.oriented(value)).collect()
    };
    let given: Vec<Vec<f64>> = given.points.iter().map(oriented).collect();
    let given: Vec<&[f64]> = given.iter().map(Vec::as_slice).collect();
    let judge = repository.judge()?;
    let mut tests: Vec<(u32, Fitness)> = Vec::new();
    repository.scan(&mut |test| {
        if test.origin != Origin::Reference {
            tests.push((test.number, judge.fitness(&test)));
        }
    })?;
    let of = |front: &Front, set: Option<String>, generation: Option<u32>, evaluations: usize| {
        let points: Vec<&[f64]> = front.members().iter().map(|member| member.objectives.as_slice()).collect();
        FrontDistance {
            set,
            generation,
            evaluations,
            front: points.len(),
            igd: igd(&points, &given, scaling),
            igd_plus: igd_plus(&points, &given, scaling),
        }
    };
    let mut found = Vec::new();
    let mut front = Front::default();
    let mut done = 0;
    for indicator in repository.indicators()? {
        let upto = (indicator.evaluations as usize).clamp(done, tests.len());
        for (number, fitness) in &tests[done..upto] {
            front.add(*number, fitness);
        }
        done = upto;
        found.push(of(&front, None, Some(indicator.generation), upto));
    }
    if found.is_empty() {
        for (set, _) in repository.result_set_sizes()? {
            let members = repository.members(&set.name)?;
            let member = |number: &u32| tests.binary_search_by_key(number, |(number, _)| *number).ok();
            let members: Vec<usize> = members.iter().filter_map(member).collect();
            let front = Front::from_tests(members.iter().map(|&at| (tests[at].0, &tests[at].1)));
            found.push(of(&front, Some(set.name), set.generation, members.len()));
        }
    }
    if done < tests.len() {
        let whole = Front::from_tests(tests.iter().map(|(number, fitness)| (*number, fitness)));
        found.push(of(&whole, None, None, tests.len()));
    }
    Ok(found)
}

/// A row for each distance.
pub fn distance_table(distances: &[FrontDistance]) -> Table {
    let imported = distances.iter().any(|distance| distance.set.is_some());
    let head = imported.then(|| "set".to_owned());
    let columns = ["generation", "evaluations", "front", "igd", "igd_plus"].map(str::to_owned);
    let mut table = Table::new(head.into_iter().chain(columns));
    for distance in distances {
        let set = imported.then(|| distance.set.clone().map_or(Datum::Missing, Datum::Text));
        let generation = distance.generation.map_or(Datum::Missing, |number| Datum::Whole(i64::from(number)));
        let counts = [generation, Datum::count(distance.evaluations), Datum::count(distance.front)];
        table.row(set.into_iter().chain(counts).chain([Datum::real(distance.igd), Datum::real(distance.igd_plus)]));
    }
    table
}
