//! What a filled-in form says, whatever it is written in: texts and values with their places, and how names, units and
//! numbers are read.

use std::collections::BTreeMap;

use sesame_dsl::similar::most_similar;
use sesame_dsl::units::{self, Unit, UnitError, convert};
use sesame_plan::{CampaignPlan, Metric};

/// The columns before those of the metrics.
pub(super) const FIRST_COLUMNS: [&str; 3] = ["test", "run", "outcome"];

/// What a form says once for all its runs, in this order: of which tests they are
/// ([`tests_digest`](sesame_record::Repository::tests_digest)), of which campaign, in which lab, and their
/// [`Provenance`](sesame_record::Provenance).
pub(super) const HEAD: [&str; 7] = ["tests", "campaign", "lab", "operator", "hardware", "software", "date"];

/// What stands in place of a value that could not be measured.
pub(super) const UNMEASURED: &str = "unmeasured";

/// Something, and its offset in the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct At<T> {
    pub(super) at: usize,
    pub(super) value: T,
}

/// What a file says.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Sheet {
    /// What is said of all runs, by its name of [`HEAD`]; never empty.
    pub(super) head: BTreeMap<&'static str, At<String>>,
    /// The runs.
    pub(super) rows: Vec<Row>,
}

/// A run.
#[derive(Debug, PartialEq)]
pub(super) struct Row {
    pub(super) test: At<String>,
    pub(super) run: At<String>,
    pub(super) outcome: At<String>,
    /// Per metric of the plan, in its order; `None` if a mistake in them was told as a whole.
    pub(super) values: Option<Vec<At<Given>>>,
}

impl Row {
    /// Whether nothing is filled in: the run was not made.
    pub(super) fn is_blank(&self) -> bool {
        let values = self.values.as_ref();
        self.outcome.value.is_empty()
            && values.is_some_and(|values| values.iter().all(|value| value.value == Given::Empty))
    }
}

/// What is given for a metric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Given {
    /// Nothing.
    Empty,
    /// That it was not measured.
    Unmeasured,
    /// A number in the metric's unit.
    Value(f64),
    /// Something that was told to be a mistake.
    Mistaken,
}

/// A text of a file as messages quote it: not all of a long one, and without line breaks and control characters.
pub(super) fn quoted(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut shown: String =
        text.chars().take(LONGEST).map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect();
    if text.chars().nth(LONGEST).is_some() {
        shown.push('…');
    }
    format!("`{shown}`")
}

/// The head of a metric's column.
pub(super) fn column(metric: &Metric) -> String {
    match &metric.unit {
        Some(unit) => format!("{} [{unit}]", metric.name),
        None => metric.name.clone(),
    }
}

/// The position of a metric in the plan, or what is wrong with its name.
pub(super) fn metric(plan: &CampaignPlan, name: &str) -> Result<usize, String> {
    let names = || plan.metrics.iter().map(|metric| metric.name.as_str());
    names().position(|known| known == name).ok_or_else(|| {
        let what = format!("there is no metric {}", quoted(name));
        if let Some(meant) = most_similar(name, names()) {
            return format!("{what}; did you mean `{meant}`?");
        }
        let known: Vec<String> = names().map(|name| format!("`{name}`")).collect();
        format!("{what}; the metrics are {}", known.join(", "))
    })
}

/// How numbers become values in the unit of a metric.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Conversion(Option<(Option<Unit>, Option<Unit>)>);

/// How values of a metric in this unit are read, or what is wrong with the unit. `write` is how the metric is to be
/// written with its own unit.
pub(super) fn conversion(metric: &Metric, unit: Option<&str>, write: &str) -> Result<Conversion, String> {
    let name = &metric.name;
    let unit = match (&metric.unit, unit) {
        (None, None) => return Ok(Conversion(None)),
        (Some(own), Some(unit)) if own == unit => return Ok(Conversion(None)),
        (Some(own), None) => return Err(format!("`{name}` is in {own}, and no unit is given; write {write}")),
        (_, Some(unit)) => unit,
    };
    let shown = quoted(unit);
    let given = Unit::parse(unit).map_err(|error| match error {
        UnitError::Unknown { similar, .. } if !similar.is_empty() => {
            format!("there is no unit {shown}; did you mean `{}`?", similar[0])
        }
        UnitError::Unknown { .. } => format!("there is no unit {shown}; write {write}"),
        UnitError::TooLarge => format!("{shown} is not a unit; write {write}"),
    })?;
    // A unit that only its space knows is not converted.
    let own = metric.unit.as_deref().map(Unit::parse).transpose();
    let own = own.map_err(|_| format!("{shown} cannot be converted to the unit of `{name}`; write {write}"))?;
    let (needed, found) = (units::dimension(own.as_ref()), given.dimension());
    if needed != found {
        return Err(format!("`{name}` is {}, and {shown} is {}; write {write}", needed.name(), found.name()));
    }
    Ok(Conversion(Some((Some(given), own))))
}

/// What a text gives for a metric, or what is wrong with it.
pub(super) fn given(text: &str, conversion: &Conversion) -> Result<Given, String> {
    if text.is_empty() {
        return Ok(Given::Empty);
    }
    if text == UNMEASURED {
        return Ok(Given::Unmeasured);
    }
    let shown = quoted(text);
    let Ok(number) = text.parse::<f64>() else {
        let point = text.replace(',', ".");
        return Err(if point != text && point.parse::<f64>().is_ok_and(f64::is_finite) {
            format!("{shown} is not a number; write {}, with a point", quoted(&point))
        } else if most_similar(text, [UNMEASURED]).is_some() {
            format!("{shown} is not a number; did you mean `{UNMEASURED}`?")
        } else {
            format!("{shown} is not a number; write one such as `12.5`, without a unit, or `{UNMEASURED}`")
        });
    };
    let value = match &conversion.0 {
        Some((from, to)) => convert(number, from.as_ref(), to.as_ref()),
        None => number,
    };
    if value.is_finite() {
        Ok(Given::Value(value))
    } else {
        Err(format!("{shown} is not a finite number; write `{UNMEASURED}` if there is no value"))
    }
}
