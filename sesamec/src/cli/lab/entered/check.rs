//! Runs from filled-in forms, checked against the campaign, against each other, and against those recorded before. All
//! mistakes of all files are found before anything is recorded.

use std::collections::BTreeMap;
use std::path::Path;

use sesame_dsl::similar::most_similar;
use sesame_record::{ENTERED_OUTCOMES, Entered, EnteredRun, Outcome, Provenance, entered_outcome};

use super::campaign::Campaign;
use super::mistakes::Mistakes;
use super::sheet::{At, Given, HEAD, Row, Sheet, UNMEASURED, column, quoted};
use super::{read_csv, read_json};

/// What was taken from files so far.
pub(super) struct Taken<'c> {
    campaign: &'c Campaign,
    lab: &'c str,
    /// What the command line says of all files.
    provenance: &'c Provenance,
    /// Where each run of a test is, by the numbers of both.
    places: BTreeMap<(u32, u32), String>,
    runs: Vec<Entered>,
    blank: usize,
    mistakes: Vec<String>,
}

impl<'c> Taken<'c> {
    /// Begins to take runs in a lab, beside those that are recorded in a folder already.
    pub(super) fn new(
        campaign: &'c Campaign,
        lab: &'c str,
        provenance: &'c Provenance,
        folder: &Path,
        recorded: &[EnteredRun],
    ) -> Self {
        let place = |test: u32| format!("in {}, as T{test}", folder.display());
        let places = recorded.iter().map(|run| ((run.of, run.run), place(run.test))).collect();
        Taken { campaign, lab, provenance, places, runs: Vec::new(), blank: 0, mistakes: Vec::new() }
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
        let Some(sheet) = sheet else { return self.mistakes.extend(mistakes.listed()) };
        self.of_these_tests(&sheet, &mut mistakes);
        let provenance = self.provenance(&sheet, &mut mistakes);
        let (blank, rows): (Vec<Row>, Vec<Row>) = sheet.rows.into_iter().partition(Row::is_blank);
        self.blank += blank.len();
        if rows.is_empty() && mistakes.are_none() {
            mistakes.say(text.len(), || "no run is filled in; write an outcome and the values of each".to_owned());
        }
        for row in rows {
            let run = self.run(row, &mut mistakes);
            self.runs.extend(run.map(|run| Entered { provenance: provenance.clone(), ..run }));
        }
        self.mistakes.extend(mistakes.listed());
    }

    /// All runs and the number of rows that nobody filled in, or all that is wrong.
    pub(super) fn finish(self) -> Result<(Vec<Entered>, usize), Vec<String>> {
        if self.mistakes.is_empty() { Ok((self.runs, self.blank)) } else { Err(self.mistakes) }
    }

    /// Tells if the file is a form for other tests, or for another lab.
    fn of_these_tests(&self, sheet: &Sheet, mistakes: &mut Mistakes<'_>) {
        let digest = self.campaign.tests_digest();
        let [tests, campaign, lab, ..] = HEAD;
        match sheet.head.get(tests) {
            None => mistakes.say(0, || {
                format!(
                    "it does not name the campaign of the tests; begin with `# {tests}: {digest}` in CSV, or \
                     `\"{tests}\": \"{digest}\"` in JSON"
                )
            }),
            Some(At { value, .. }) if value == digest => {}
            Some(At { at, .. }) => mistakes.say(*at, || {
                let of =
                    sheet.head.get(campaign).map_or_else(String::new, |named| format!(" ({})", quoted(&named.value)));
                format!(
                    "the form is for tests of another run{of}, not for those of {}; give the results that it was \
                     printed for",
                    self.campaign.folder().display()
                )
            }),
        }
        if let Some(At { at, value }) = sheet.head.get(lab).filter(|named| named.value != self.lab) {
            mistakes.say(*at, || {
                format!("the form is for lab {}, not for `{}`; give the lab with `--lab`", quoted(value), self.lab)
            });
        }
    }

    /// Where the runs of a file come from: what it says and what the command line says.
    fn provenance(&self, sheet: &Sheet, mistakes: &mut Mistakes<'_>) -> Provenance {
        let mut texts = self.provenance.texts().map(|text| text.map(str::to_owned));
        for (name, text) in Provenance::NAMES.into_iter().zip(&mut texts) {
            let Some(At { at, value }) = sheet.head.get(name) else { continue };
            if value.chars().any(char::is_control) {
                mistakes.say(*at, || format!("`{name}` contains control characters; write one line of text"));
            }
            match text {
                Some(text) if text != value => mistakes.say(*at, || {
                    format!("`{name}` is {} here, and `--{name}` says {}; leave out one", quoted(value), quoted(text))
                }),
                _ => *text = Some(value.clone()),
            }
        }
        Provenance::from(texts)
    }

    fn run(&mut self, row: Row, mistakes: &mut Mistakes<'_>) -> Option<Entered> {
        let Row { test, run, outcome, values } = row;
        let of = self.test(&test, mistakes);
        let number = number_of(&run, mistakes);
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
        let provenance = Provenance::default();
        Some(Entered { of, run: number, outcome: outcome?, values: values?, provenance })
    }

    fn test(&self, test: &At<String>, mistakes: &mut Mistakes<'_>) -> Option<u32> {
        let number = match self.campaign.named(&test.value) {
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

    fn outcome(&self, word: &At<String>, mistakes: &mut Mistakes<'_>) -> Option<Outcome> {
        let outcome = entered_outcome(&word.value, self.campaign.plan());
        if outcome.is_none() {
            mistakes.say(word.at, || {
                let words = ENTERED_OUTCOMES.map(|word| format!("`{word}`")).join(", ");
                match (word.value.as_str(), most_similar(&word.value, ENTERED_OUTCOMES)) {
                    ("", _) => format!("the outcome is missing; write one of {words}"),
                    (unknown, Some(meant)) => format!("{} is not an outcome; did you mean `{meant}`?", quoted(unknown)),
                    (unknown, None) => format!("{} is not an outcome; write one of {words}", quoted(unknown)),
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
        for (At { at, value: given }, metric) in values.into_iter().zip(&self.campaign.plan().metrics) {
            let value = match given {
                Given::Value(value) => Some(Some(value)),
                Given::Unmeasured => Some(None),
                Given::Empty if !whole => Some(None),
                Given::Empty => {
                    mistakes.say(at, || {
                        format!(
                            "there is no value of `{}`, and the run was not broken off; write it, or `{UNMEASURED}`",
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
    match file.extension().and_then(|extension| extension.to_str()) {
        Some(ending) if ending.eq_ignore_ascii_case("json") => true,
        Some(ending) if ending.eq_ignore_ascii_case("csv") => false,
        _ => text.trim_start().starts_with(['{', '[']),
    }
}

/// Which run of its test a run is.
fn number_of(run: &At<String>, mistakes: &mut Mistakes<'_>) -> Option<u32> {
    let number = run.value.parse::<u32>().ok().filter(|&number| number > 0);
    if number.is_none() {
        let what = || format!("{} is not the number of a run; number the runs of a test 1, 2, …", quoted(&run.value));
        mistakes.say(run.at, what);
    }
    number
}
