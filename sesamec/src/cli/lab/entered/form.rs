//! The text of a form: what people fill in.

use serde::ser::{Serialize, SerializeMap as _, Serializer};
use sesame_plan::Metric;

use super::campaign::Campaign;
use super::sheet::{FIRST_COLUMNS, HEAD, column};

/// What a form is printed for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted<'f> {
    pub(super) lab: &'f str,
    /// Numbers of tests.
    pub(super) tests: &'f [u32],
    /// How often each is run. All tests are run once before any is run again.
    pub(super) times: u32,
}

impl Wanted<'_> {
    /// The test and the number of each run, in the order in which they are to be made.
    fn runs(&self) -> impl Iterator<Item = (u32, u32)> {
        (1..=self.times).flat_map(|run| self.tests.iter().map(move |&test| (test, run)))
    }

    /// What is said of all runs; empty where people fill it in.
    fn head<'f>(&'f self, campaign: &'f Campaign) -> [(&'static str, &'f str); HEAD.len()] {
        let said = [campaign.tests_digest(), &campaign.plan().campaign.name, self.lab, "", "", "", ""];
        std::array::from_fn(|at| (HEAD[at], said[at]))
    }
}

/// As CSV: comments that say whose tests these are, a header, and rows without values.
pub(super) fn csv(campaign: &Campaign, wanted: &Wanted<'_>) -> String {
    let head = wanted.head(campaign).map(|(name, text)| format!("# {name}: {text}").trim_end().to_owned());
    // Names of metrics, and units, need no quotes.
    let metrics: Vec<String> = campaign.plan().metrics.iter().map(column).collect();
    let header = FIRST_COLUMNS.into_iter().chain(metrics.iter().map(String::as_str)).collect::<Vec<_>>().join(",");
    let blank = ",".repeat(metrics.len());
    let rows = wanted.runs().map(|(test, run)| format!("T{test},{run},{blank}"));
    let lines: Vec<String> = head.into_iter().chain([header]).chain(rows).collect();
    format!("{}\n", lines.join("\n"))
}

/// As JSON: the same, with the unit of each value.
pub(super) fn json(campaign: &Campaign, wanted: &Wanted<'_>) -> String {
    let form = Form { campaign, wanted };
    let text = serde_json::to_string_pretty(&form).expect("a form is plain data with text keys");
    format!("{text}\n")
}

struct Form<'f> {
    campaign: &'f Campaign,
    wanted: &'f Wanted<'f>,
}

impl Serialize for Form<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Form { campaign, wanted } = self;
        let mut members = serializer.serialize_map(None)?;
        for (name, text) in wanted.head(campaign) {
            members.serialize_entry(name, text)?;
        }
        let values = Values(&campaign.plan().metrics);
        let row = |(test, run)| Row { test: format!("T{test}"), run, outcome: "", values: &values };
        members.serialize_entry("runs", &wanted.runs().map(row).collect::<Vec<_>>())?;
        members.end()
    }
}

#[derive(serde::Serialize)]
struct Row<'f> {
    test: String,
    run: u32,
    outcome: &'f str,
    values: &'f Values<'f>,
}

/// No value of any metric, in the order of the plan.
struct Values<'f>(&'f [Metric]);

impl Serialize for Values<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let empty = |metric: &'_ Metric| metric.unit.as_ref().map(|unit| Quantity { value: (), unit: unit.clone() });
        serializer.collect_map(self.0.iter().map(|metric| (&metric.name, empty(metric))))
    }
}

/// A value to be filled in. A plain number needs no object.
#[derive(serde::Serialize)]
struct Quantity {
    value: (),
    unit: String,
}
