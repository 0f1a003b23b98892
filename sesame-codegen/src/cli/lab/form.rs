//! The text of a form: what people fill in.

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::campaign::Campaign;
use super::sheet::{FIRST_COLUMNS, RESULTS, column};

/// As CSV: comments that say whose tests these are, a header, and rows without values.
pub(super) fn csv(campaign: &Campaign, tests: &[u32], repeats: u32) -> String {
    let plan = campaign.plan();
    let metrics = plan.metrics.iter().map(column);
    let header: Vec<String> = FIRST_COLUMNS.iter().map(|&name| name.to_owned()).chain(metrics).collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut write = |row: &[String]| writer.write_record(row).expect("rows of equal lengths are written into memory");
    write(&header);
    for run in 1..=repeats {
        for number in tests {
            let mut row = vec![String::new(); header.len()];
            row[0] = format!("T{number}");
            row[1] = run.to_string();
            write(&row);
        }
    }
    let rows = writer.into_inner().expect("memory takes all that is written");
    let rows = String::from_utf8(rows).expect("names of a plan are text");
    format!("# {RESULTS} {}\n# campaign: {}\n{rows}", campaign.digest(), plan.campaign.name)
}

/// As JSON: the same, with the unit of each value.
pub(super) fn json(campaign: &Campaign, tests: &[u32], repeats: u32) -> String {
    let plan = campaign.plan();
    let values: Map<String, Value> = plan
        .metrics
        .iter()
        .map(|metric| {
            let empty = metric.unit.as_ref().map_or(Value::Null, |unit| json!({ "value": null, "unit": unit }));
            (metric.name.clone(), empty)
        })
        .collect();
    let row = |run: u32, number: u32| Row { test: format!("T{number}"), run, outcome: "", values: &values };
    let row = &row;
    let runs = (1..=repeats).flat_map(|run| tests.iter().map(move |&number| row(run, number))).collect();
    let form = Form { results: campaign.digest(), campaign: &plan.campaign.name, runs };
    let text = serde_json::to_string_pretty(&form).expect("a form is plain data with text keys");
    format!("{text}\n")
}

#[derive(Serialize)]
struct Form<'f> {
    results: &'f str,
    campaign: &'f str,
    runs: Vec<Row<'f>>,
}

#[derive(Serialize)]
struct Row<'f> {
    test: String,
    run: u32,
    outcome: &'f str,
    values: &'f Map<String, Value>,
}
