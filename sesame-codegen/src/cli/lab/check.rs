//! Runs from filled-in forms, checked against the campaign, against each other, and against those recorded before. All
//! mistakes of all files are found before anything is recorded.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use sesame_dsl::similar::most_similar;
use sesame_results::record::{ENTERED_OUTCOMES, Entered, EnteredRun, Outcome, entered_outcome};

use super::campaign::Campaign;
use super::mistakes::Mistakes;
use super::sheet::{At, Given, RESULTS, Row, Sheet, UNMEASURED, column};
use super::{read_csv, read_json};

/// Runs that are recorded already, and where.
pub(super) struct Recorded<'r> {
    pub(super) folder: PathBuf,
    pub(super) runs: &'r [EnteredRun],
}

/// What was taken from files so far.
pub(super) struct Taken<'c> {
    campaign: &'c Campaign,
    /// Where each run of a test is, by the numbers of both.
    places: BTreeMap<(u32, u32), String>,
    runs: Vec<Entered>,
    mistakes: Vec<String>,
}

impl<'c> Taken<'c> {
    pub(super) fn new(campaign: &'c Campaign, recorded: Option<Recorded<'_>>) -> Self {
        let mut places = BTreeMap::new();
        if let Some(Recorded { folder, runs }) = recorded {
            let place = |test: u32| format!("in {}, as T{test}", folder.display());
            places.extend(runs.iter().map(|run| ((run.of, run.run), place(run.test))));
        }
        Taken { campaign, places, runs: Vec::new(), mistakes: Vec::new() }
    }

    /// Takes note that a file cannot be read.
    pub(super) fn refuse(&mut self, why: String) {
        self.mistakes.push(why);
    }

    /// Takes the runs of a file, or notes all that is wrong with it.
    pub(super) fn take(&mut self, file: &Path, bytes: &[u8]) {
        let text = match std::str::from_utf8(bytes) {
            Ok(text) => text.strip_prefix('\u{feff}').unwrap_or(text),
            Err(error) => {
                let before = String::from_utf8_lossy(&bytes[..error.valid_up_to()]);
                let mut mistakes = Mistakes::new(file, &before);
                mistakes.say(before.len(), || "this is not text in UTF-8; save the file in that encoding".to_owned());
                return self.mistakes.extend(mistakes.listed());
            }
        };
        let mut mistakes = Mistakes::new(file, text);
        let plan = self.campaign.plan();
        let sheet = if is_json(file, text) {
            read_json::read(text, plan, &mut mistakes)
        } else {
            read_csv::read(text, plan, &mut mistakes)
        };
        self.of_these_results(&sheet, &mut mistakes);
        if sheet.rows.is_empty() && mistakes.are_none() {
            mistakes.say(text.len(), || "there are no runs; fill in a row for each".to_owned());
        }
        for row in sheet.rows {
            let run = self.run(row, &mut mistakes);
            self.runs.extend(run);
        }
        self.mistakes.extend(mistakes.listed());
    }

    /// All runs, or all that is wrong.
    pub(super) fn finish(self) -> Result<Vec<Entered>, Vec<String>> {
        if self.mistakes.is_empty() { Ok(self.runs) } else { Err(self.mistakes) }
    }

    /// Tells if the file is a form of other results.
    fn of_these_results(&self, sheet: &Sheet, mistakes: &mut Mistakes<'_>) {
        let digest = self.campaign.digest();
        match &sheet.results {
            None => mistakes.say(0, || {
                format!(
                    "it does not say whose tests were run; begin with `# {RESULTS} {digest}`, or `\"results\"` in JSON"
                )
            }),
            Some(At { it, .. }) if it == digest => {}
            Some(At { at, it }) => mistakes.say(*at, || {
                format!(
                    "the form is of other results ({}…), not of {} ({}…); if only tests were run again there since it \
                     was printed, as `confirm` does, write `{digest}`",
                    short(it),
                    self.campaign.folder().display(),
                    short(digest)
                )
            }),
        }
    }

    fn run(&mut self, row: Row, mistakes: &mut Mistakes<'_>) -> Option<Entered> {
        let Row { test, run, outcome, values } = row;
        let of = self.test(&test, mistakes);
        let number = self.number(&run, mistakes);
        let outcome = self.outcome(&outcome, mistakes);
        let values = values.and_then(|values| self.values(values, outcome.as_ref(), mistakes));
        let (of, number) = (of?, number?);
        if let Some(other) = self.places.get(&(of, number)) {
            let next = self
                .places
                .range((of, 0)..=(of, u32::MAX))
                .next_back()
                .map_or(1, |((_, run), _)| run.saturating_add(1));
            mistakes.say(run.at, || {
                format!(
                    "run {number} of T{of} is also {other}; each run has a number of its own, the next one is {next}"
                )
            });
            return None;
        }
        self.places.insert((of, number), format!("in {}", mistakes.line(run.at)));
        Some(Entered { of, run: number, outcome: outcome?, values: values? })
    }

    fn test(&self, test: &At<String>, mistakes: &mut Mistakes<'_>) -> Option<u32> {
        let number = match self.campaign.named(&test.it) {
            Ok(number) => number,
            Err(wrong) => {
                mistakes.say(test.at, || wrong);
                return None;
            }
        };
        let first = self.campaign.first(number);
        if first != number {
            mistakes.say(test.at, || {
                format!("T{number} disturbs just as T{first} does; enter its runs as those of T{first}")
            });
            return None;
        }
        Some(number)
    }

    fn number(&self, run: &At<String>, mistakes: &mut Mistakes<'_>) -> Option<u32> {
        let number = run.it.parse::<u32>().ok().filter(|&number| number > 0);
        if number.is_none() {
            mistakes
                .say(run.at, || format!("`{}` is not the number of a run; number the runs of a test 1, 2, …", run.it));
        }
        number
    }

    fn outcome(&self, word: &At<String>, mistakes: &mut Mistakes<'_>) -> Option<Outcome> {
        let outcome = entered_outcome(&word.it, self.campaign.plan());
        if outcome.is_none() {
            mistakes.say(word.at, || {
                let words = ENTERED_OUTCOMES.map(|word| format!("`{word}`")).join(", ");
                match (word.it.as_str(), most_similar(&word.it, ENTERED_OUTCOMES)) {
                    ("", _) => format!(
                        "it is not said how this run ended; write one of {words}, or remove the row if the run was not made"
                    ),
                    (it, Some(meant)) => format!("`{it}` is not how a run ends; did you mean `{meant}`?"),
                    (it, None) => format!("`{it}` is not how a run ends; write one of {words}"),
                }
            });
        }
        outcome
    }

    /// The values of a run by metric, if none is missing or mistaken.
    fn values(
        &self,
        values: Vec<At<Given>>,
        outcome: Option<&Outcome>,
        mistakes: &mut Mistakes<'_>,
    ) -> Option<Vec<Option<f64>>> {
        let whole = outcome.is_some_and(Outcome::is_whole);
        let mut taken = Some(Vec::with_capacity(values.len()));
        for (At { at, it }, metric) in values.into_iter().zip(&self.campaign.plan().metrics) {
            let value = match it {
                Given::Value(value) => Some(Some(value)),
                Given::Unmeasured => Some(None),
                Given::Empty if !whole => Some(None),
                Given::Empty => {
                    mistakes.say(at, || {
                        format!(
                            "there is no value of `{}`, and the run came to its end; write it, or `{UNMEASURED}`",
                            column(metric)
                        )
                    });
                    None
                }
                Given::Mistaken => None,
            };
            match (value, &mut taken) {
                (Some(value), Some(taken)) => taken.push(value),
                _ => taken = None,
            }
        }
        taken
    }
}

/// Whether a file is one of JSON: by its name, or else by its first sign.
fn is_json(file: &Path, text: &str) -> bool {
    match file.extension().and_then(|it| it.to_str()) {
        Some(ending) if ending.eq_ignore_ascii_case("json") => true,
        Some(ending) if ending.eq_ignore_ascii_case("csv") => false,
        _ => text.trim_start().starts_with(['{', '[']),
    }
}

/// The beginning of a digest.
fn short(digest: &str) -> String {
    digest.chars().take(12).collect()
}
