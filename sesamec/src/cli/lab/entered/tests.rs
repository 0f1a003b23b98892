//! Forms are printed, filled in, and taken or refused.

use std::fs;
use std::path::PathBuf;

use clap::Parser;
use proptest::prelude::*;
use sesame_analysis::gap::{gap, lab_runs};
use sesame_analysis::{Selection, tests as tests_table};
use sesame_plan::testing;
use sesame_record::{EnteredRun, Origin, Repetition, Repository, sample};

use super::*;

#[derive(Parser)]
struct Line {
    #[command(subcommand)]
    asked: Asked,
}

#[derive(clap::Subcommand)]
enum Asked {
    Form(Form),
    Add(Add),
}

/// A campaign that has ended, in a lab's space, and files beside it.
struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Bench {
        let mut plan = sample::plan();
        plan.labs = vec![sesame_plan::Lab { repeats: 2, ..testing::lab("hall") }];
        Bench::of(&plan)
    }

    fn of(plan: &CampaignPlan) -> Bench {
        let folder = tempfile::tempdir().unwrap();
        sample::campaign(&folder.path().join("42"), plan, 30);
        Bench { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `sesamec lab` with words of which those that begin with `@` are names of files; or what it says, without the
    /// folder.
    fn lab(&self, words: &[&str]) -> Result<(), String> {
        let words = words.iter().map(|word| match word.strip_prefix('@') {
            Some(name) => self.path(name).display().to_string(),
            None => (*word).to_owned(),
        });
        let line = Line::try_parse_from(std::iter::once("lab".to_owned()).chain(words)).unwrap();
        let done = match &line.asked {
            Asked::Form(asked) => print_form(Shell::silent(), asked),
            Asked::Add(asked) => add(Shell::silent(), asked),
        };
        done.map_err(|error| self.said(&error))
    }

    fn said(&self, error: &anyhow::Error) -> String {
        let folder = format!("{}/", self.folder.path().display());
        format!("{error:#}").replace('\u{1e}', "\n").replace(&folder, "")
    }

    /// The text of a form.
    fn form(&self, words: &[&str]) -> String {
        let _ = fs::remove_file(self.path("form"));
        self.lab(&[&["form", "@42", "-o", "@form"], words].concat()).unwrap();
        fs::read_to_string(self.path("form")).unwrap()
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        fs::write(self.path(name), text).unwrap();
    }

    /// What is said of a file.
    fn refused(&self, name: &str, text: impl AsRef<[u8]>) -> String {
        self.write(name, text);
        let said = self.lab(&["add", "@42", &format!("@{name}")]).unwrap_err();
        assert!(!self.path("42-hall").exists(), "nothing is taken of a file with mistakes: {said}");
        said
    }

    fn recorded(&self) -> Vec<EnteredRun> {
        Repository::open(&self.path("42-hall")).unwrap().entered_runs().unwrap()
    }
}

/// Two tests of the sample that disturb something.
fn two_tests(bench: &Bench) -> [String; 2] {
    let repository = Repository::open(&bench.path("42")).unwrap();
    let rows = repository.tests().unwrap();
    let mut numbers = rows.iter().filter(|row| row.origin == Origin::Search && row.duplicate_of.is_none());
    std::array::from_fn(|_| format!("T{}", numbers.next().unwrap().number))
}

/// The CSV of a form with these lines after its header.
fn filled(form: &str, rows: &[&str]) -> String {
    let head: Vec<&str> = form.lines().take_while(|line| line.starts_with('#')).collect();
    let header = form.lines().find(|line| line.starts_with("test,")).unwrap();
    [&head[..], &[header], rows].concat().join("\n") + "\n"
}

#[test]
fn a_form_has_a_row_for_each_run_and_a_column_for_each_metric() {
    let bench = Bench::new();
    let [first, second] = two_tests(&bench);
    let csv = bench.form(&[&first, &second, &first]);
    let digest = Repository::open(&bench.path("42")).unwrap().tests_digest().unwrap();
    insta::assert_snapshot!("form_csv", csv.replace(&digest, "DIGEST"));
    let json = bench.form(&[&first, "-n", "1", "--format", "json"]);
    insta::assert_snapshot!("form_json", json.replace(&digest, "DIGEST"));
    assert_eq!(bench.form(&[&first, "-n", "7"]).lines().filter(|line| line.starts_with('T')).count(), 7);
    let front = Repository::open(&bench.path("42")).unwrap().latest_result_set().unwrap().unwrap().members;
    let rows = bench.form(&["-n", "1"]);
    assert!(front.iter().any(|number| rows.contains(&format!("\nT{number},1,"))), "without tests it is the front");
}

#[test]
fn what_a_form_cannot_be_printed_for_is_refused() {
    let bench = Bench::new();
    bench.write("form", "filled in");
    let [first, _] = two_tests(&bench);
    let refused = |words: &[&str]| bench.lab(&[&["form", "@42"], words].concat()).unwrap_err();
    insta::assert_snapshot!(
        "form_refused",
        [
            refused(&[&first, "-o", "@form"]),
            refused(&["T999"]),
            refused(&["known_jiter"]),
            refused(&["reference"]),
            refused(&[&first, "--lab", "hal"]),
            bench.lab(&["form", "@43", &first]).unwrap_err(),
        ]
        .join("\n")
    );
    assert_eq!(fs::read_to_string(bench.path("form")).unwrap(), "filled in");
}

#[test]
fn runs_are_recorded_appended_and_compared_with_the_campaign() {
    let bench = Bench::new();
    let [first, second] = two_tests(&bench);
    let form = bench.form(&[&first, &second]).replace("# operator:", "# operator: Ada, Ben");
    let run = |test: &str, run: u32, collisions: &str| format!("{test},{run},completed,{collisions},5,1,60,200");
    let text = filled(&form, &[&run(&first, 1, "3"), &run(&second, 1, "0"), &format!("{first},2,,,,,,")]);
    bench.write("monday.csv", text);
    bench.lab(&["add", "@42", "@monday.csv", "--hardware", "cell 2"]).unwrap();
    let recorded = bench.recorded();
    assert_eq!(recorded.iter().map(|run| run.run).collect::<Vec<_>>(), [1, 1], "a blank row is not a run");
    assert_eq!(recorded[0].provenance.texts(), [Some("Ada, Ben"), Some("cell 2"), None, None]);

    // Tests that are run again in simulation leave forms and the folder valid.
    let number: u32 = first[1..].parse().unwrap();
    let digest_of = |name: &str| Repository::open(&bench.path(name)).unwrap().digest().unwrap();
    let unconfirmed = digest_of("42");
    let mut recorder = Recorder::reopen(&bench.path("42"), 1).unwrap();
    let observation = recorder.repository().test(number).unwrap().observation;
    recorder.put_repetition(&Repetition::of(number, 1, 7, &observation), &[]).unwrap();
    drop(recorder.finish("confirmed").unwrap());
    assert_ne!(digest_of("42"), unconfirmed);

    // The same again is refused; the next runs go into the same folder.
    let again = bench.lab(&["add", "@42", "@monday.csv"]).unwrap_err();
    insta::assert_snapshot!("added_again", again);
    let before = digest_of("42-hall");
    let crash = format!("{second},2,crash,,,,,");
    bench.write("tuesday.csv", filled(&form, &[&run(&first, 2, "4"), &crash]));
    bench.lab(&["add", "@42", "@tuesday.csv"]).unwrap();
    assert_eq!(bench.recorded().len(), 4);
    assert_ne!(digest_of("42-hall"), before);

    let (campaign, lab) =
        (Repository::open(&bench.path("42")).unwrap(), Repository::open(&bench.path("42-hall")).unwrap());
    let runs = lab_runs(&campaign, &lab).unwrap();
    let of: Vec<String> = runs.iter().map(|run| format!("T{}", run.of)).collect();
    assert_eq!(of, [&first, &second, &first, &second].map(Clone::clone));
    let found = gap(&campaign, &runs, lab.plan().labs.first()).unwrap();
    let compared = found.metrics.iter().find(|gap| gap.metric == sesame_plan::MetricId(0)).unwrap();
    assert_eq!(compared.tests[0].lab, [3.0, 4.0]);
    let table = tests_table(&lab, &Selection::default()).unwrap().csv();
    insta::assert_snapshot!("tests_of_the_lab", table);

    // Results that are not of these tests, or not of a lab, are refused.
    let mut other = sample::plan();
    other.campaign.seed = 7;
    sample::campaign(&bench.path("other"), &other, 30);
    let wrong = bench.lab(&["add", "@42", "@tuesday.csv", "--output", "@other"]).unwrap_err();
    assert!(wrong.contains("other holds results that were not entered by hand; choose another folder"), "{wrong}");
    let wrong = bench.lab(&["form", "@42-hall"]).unwrap_err();
    assert!(wrong.contains("has results of a lab; give the results of the campaign"), "{wrong}");
}

#[test]
fn all_mistakes_of_all_files_are_told_at_once_and_nothing_is_recorded() {
    let bench = Bench::new();
    let [first, second] = two_tests(&bench);
    let form = bench.form(&[&first]);
    let good = format!("{first},1,completed,3,5,1,60,200");
    bench.write("good.csv", filled(&form, &[&good]));
    let rows = [
        format!("{first},1,completed,3,5,1,60,200"),
        "T99,1,completed,3,5,1,60,200".to_owned(),
        "known_jiter,1,completed,3,5,1,60,200".to_owned(),
        format!("{second},0,completed,3,5,1,60,200"),
        format!("{second},1,complete,3,5,1,60,200"),
        format!("{second},2,well,3,5,1,60,200"),
        format!("{second},3,,3,5,1,60,200"),
        format!("{second},4,completed,3,,1,60,200"),
        format!("{second},5,completed,3,inf,1,60,200"),
        format!("{second},6,completed,3,NaN,1,60,1e999"),
        format!("{second},7,completed,3,\"5,5\",1,60,unmeasurd"),
        format!("{second},8,completed,3,5 s,1,60,200"),
        format!("{second},9,completed,3,5,1,60"),
        format!("{second},10,completed,3,5,5,1,60,200"),
        format!("{second},10,crash,,,,,"),
        format!("{second},11,\"completed,3,5,1,60,200"),
    ];
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    bench.write("bad.csv", filled(&form, &rows));
    bench.write("bytes.csv", b"test,run\xff");
    let said = bench.lab(&["add", "@42", "@good.csv", "@bad.csv", "@bytes.csv", "@none.csv"]).unwrap_err();
    assert!(!bench.path("42-hall").exists());
    insta::assert_snapshot!("mistakes_in_rows", said);
}

#[test]
fn mistakes_in_the_head_and_the_header_are_told() {
    let bench = Bench::new();
    let [first, _] = two_tests(&bench);
    let form = bench.form(&[&first]);
    let row = format!("{first},1,completed,3,5,1,60,200");
    let good = filled(&form, &[&row]);
    let swap = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        good.replace(from, to)
    };
    let digest = Repository::open(&bench.path("42")).unwrap().tests_digest().unwrap();
    let files = [
        swap(&format!("# tests: {digest}\n"), ""),
        swap(&digest, &"0".repeat(64)),
        swap("# lab: hall", "# lab: attic"),
        swap("# operator:", "# operater: Ada"),
        swap("# operator:", "# operator: Ada\n# operator: Ben"),
        swap("test,run", "tests,runs"),
        good.replace(',', ";"),
        swap("[s]", "[m]"),
        swap("fuzzing_time [s]", "fuzzing_time"),
        swap("fuzzing_time [s]", "fuzzing_time [sec]"),
        swap("collision_occurrence", "collision_occurrence [s]"),
        swap("fuzzing_time", "fuzing_time"),
        swap("fuzzing_time [s]", "weather"),
        swap("fuzzing_time [s]", "top_speed [m/s]"),
        good.lines().filter(|line| line.starts_with('#')).collect::<Vec<_>>().join("\n"),
        swap(&row, ""),
        swap(&row, &format!("{first},1,,,,,,")),
        String::new(),
    ];
    let said: Vec<String> = files.iter().map(|text| bench.refused("form.csv", text)).collect();
    let said = said.join("\n\n").replace("\nnothing was recorded; correct this and add the files again", "");
    insta::assert_snapshot!("mistakes_in_the_head", said.replace(&digest, "DIGEST"));
}

#[test]
fn mistakes_in_json_are_told_with_their_places() {
    let bench = Bench::new();
    let [first, _] = two_tests(&bench);
    let form = bench.form(&[&first, "-n", "1", "--format", "json"]);
    let digest = Repository::open(&bench.path("42")).unwrap().tests_digest().unwrap();
    let row = |text: &str| {
        let head = format!("{{\"tests\": \"{digest}\",\n\"runs\": [\n");
        let values = "\"collision_occurrence\": 3, \"fuzzing_time\": {\"value\": 5, \"unit\": \"s\"}, \"top_speed\": \
                      {\"value\": 1, \"unit\": \"m/s\"}, \"cycle_time\": {\"value\": 60, \"unit\": \"s\"}, \
                      \"arm_distance\": \"unmeasured\"";
        format!("{head}{}]}}", text.replace("VALUES", values).replace("FIRST", &first))
    };
    let run = "{\"test\": \"FIRST\", \"run\": 1, \"outcome\": \"completed\", \"values\": {VALUES}}";
    let with = |from: &str, to: &str| {
        assert!(row(run).contains(from), "{from}");
        row(run).replace(from, to)
    };
    let files = [
        form.clone(),
        "{".to_owned(),
        "[]".to_owned(),
        "{\"runs\": {}, \"operater\": 1, \"operator\": 5}".to_owned(),
        row("5"),
        row("{\"test\": \"FIRST\", \"test\": \"FIRST\", \"values\": 7}"),
        with("\"run\": 1", "\"run\": \"one\""),
        with("\"run\": 1", "\"run\": 1.5"),
        with("\"collision_occurrence\": 3", "\"collision_occurrence\": true, \"weather\": 1"),
        with("\"collision_occurrence\": 3", "\"collision_occurrence\": \"three\""),
        with("\"value\": 5, \"unit\": \"s\"", "\"value\": 5"),
        with("\"value\": 5, \"unit\": \"s\"", "\"value\": 5, \"unit\": \"mm\""),
        with("\"value\": 5, \"unit\": \"s\"", "\"value\": 1e999, \"unit\": \"s\""),
        with("\"value\": 5, \"unit\": \"s\"", "\"unit\": \"s\", \"vlue\": 5"),
        with("\"collision_occurrence\": 3, ", ""),
        row(&[run, run].join(",\n")),
    ];
    let said: Vec<String> = files.iter().map(|text| bench.refused("form.json", text)).collect();
    let said = said.join("\n\n").replace("\nnothing was recorded; correct this and add the files again", "");
    insta::assert_snapshot!("mistakes_in_json", said.replace(&digest, "DIGEST"));
    bench.write("form.json", row(run));
    bench.lab(&["add", "@42", "@form.json"]).unwrap();
    assert_eq!(bench.recorded().len(), 1);
}

#[test]
fn values_in_other_units_are_converted_and_what_spreadsheets_do_is_understood() {
    let bench = Bench::new();
    let [first, _] = two_tests(&bench);
    let form = bench.form(&[&first, "-n", "1"]);
    let row = format!("{first},1,completed,3,5000,36,unmeasured,0.2");
    let text = filled(&form, &[&row])
        .replace("fuzzing_time [s]", "fuzzing_time [ms]")
        .replace("top_speed [m/s]", "top_speed [km/h]")
        .replace("arm_distance [mm]", "arm_distance [m]")
        .replace("# operator:", "\"# operator: Ada, Ben\",,,")
        .replace("# lab: hall", "# lab: hall,,,,,,,")
        .replace('\n', "\r\n");
    bench.write("form.csv", format!("\u{feff}{text}"));
    bench.lab(&["add", "@42", "@form.csv"]).unwrap();
    let lab = Repository::open(&bench.path("42-hall")).unwrap();
    let values: Vec<Option<f64>> = lab.test(1).unwrap().observation.metrics.iter().map(|metric| metric.value).collect();
    assert_eq!(values, [Some(3.0), Some(5.0), Some(10.0), None, Some(200.0)]);
    assert_eq!(bench.recorded()[0].provenance.operator.as_deref(), Some("Ada, Ben"));
}

#[test]
fn a_lab_is_named_if_there_are_several_and_may_be_made_up_if_there_is_none() {
    let mut plan = sample::plan();
    let bench = Bench::of(&plan);
    let [first, _] = two_tests(&bench);
    assert!(bench.form(&[&first]).contains("\n# lab: lab\n"));
    assert!(bench.form(&[&first, "--lab", "attic"]).contains("\n# lab: attic\n"));
    let wrong = bench.lab(&["form", "@42", &first, "--lab", "../x"]).unwrap_err();
    assert!(wrong.contains("`--lab` names a lab as a space would"), "{wrong}");
    plan.labs = vec![testing::lab("hall"), testing::lab("attic")];
    let bench = Bench::of(&plan);
    let wrong = bench.lab(&["form", "@42", &first]).unwrap_err();
    assert_eq!(wrong, "the space has several labs; name one with `--lab`: `hall`, `attic`");
}

/// A value as somebody might enter it.
fn value() -> impl Strategy<Value = Option<f64>> {
    prop_oneof![4 => any::<f64>().prop_filter("finite", |number| number.is_finite()).prop_map(Some), 1 => Just(None)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn a_form_that_is_filled_in_reads_back_with_the_same_values(
        json in any::<bool>(),
        runs in proptest::collection::vec((proptest::collection::vec(value(), 5), 0..ENTERED.len()), 1..8),
        operator in "[a-z,\" ]{0,8}",
    ) {
        let bench = Bench::new();
        let tests = two_tests(&bench);
        let times = runs.len().div_ceil(2).to_string();
        let operator = operator.trim().trim_end_matches([',', ' ']);
        let name = if json { "form.json" } else { "form.csv" };
        let word = |at: usize| ENTERED[at];
        if json {
            let form = bench.form(&[&tests[0], &tests[1], "-n", &times, "--format", "json"]);
            let mut form: serde_json::Value = serde_json::from_str(&form).unwrap();
            form["operator"] = operator.into();
            for (at, (values, outcome)) in runs.iter().enumerate() {
                let row = &mut form["runs"][at];
                row["outcome"] = word(*outcome).into();
                for (metric, value) in sample::plan().metrics.iter().zip(values) {
                    let value = value.map_or_else(|| "unmeasured".into(), serde_json::Value::from);
                    let place = &mut row["values"][&metric.name];
                    if metric.unit.is_some() { place["value"] = value } else { *place = value }
                }
            }
            bench.write(name, form.to_string());
        } else {
            let form = bench.form(&[&tests[0], &tests[1], "-n", &times]);
            let form = form.replace("# operator:", &format!("# operator: {operator}"));
            let mut rows = runs.iter().map(|(values, outcome)| {
                let values = values.iter().map(|value| value.map_or("unmeasured".to_owned(), |number| number.to_string()));
                format!("{},{}", word(*outcome), values.collect::<Vec<_>>().join(","))
            });
            let fill = |line: &str| match line.strip_suffix(",,,,,,") {
                Some(run) => rows.next().map_or_else(|| line.to_owned(), |row| format!("{run},{row}")),
                None => line.to_owned(),
            };
            bench.write(name, form.lines().map(fill).collect::<Vec<_>>().join("\n"));
        }
        bench.lab(&["add", "@42", &format!("@{name}")]).unwrap();
        let repository = Repository::open(&bench.path("42-hall")).unwrap();
        let recorded = repository.entered_runs().unwrap();
        prop_assert_eq!(recorded.len(), runs.len());
        for (at, ((values, outcome), entered)) in runs.iter().zip(&recorded).enumerate() {
            prop_assert_eq!(&format!("T{}", entered.of), &tests[at % 2]);
            prop_assert_eq!(entered.run as usize, at / 2 + 1);
            prop_assert_eq!(entered.provenance.operator.as_deref().unwrap_or(""), operator);
            let observation = repository.test(entered.test).unwrap().observation;
            prop_assert_eq!(observation.outcome.word(), word(*outcome));
            let read: Vec<Option<f64>> = observation.metrics.iter().map(|metric| metric.value).collect();
            prop_assert_eq!(&read, values);
        }
    }

    #[test]
    fn a_form_that_is_damaged_is_taken_whole_or_not_at_all(
        json in any::<bool>(),
        damage in proptest::collection::vec((any::<proptest::sample::Index>(), 0..6u8, any::<u8>()), 1..4),
    ) {
        let bench = Bench::new();
        let tests = two_tests(&bench);
        let (name, mut bytes) = if json {
            let form = bench.form(&[&tests[0], &tests[1], "-n", "1", "--format", "json"]);
            let form = form.replace("\"outcome\": \"\"", "\"outcome\": \"completed\"").replace("null", "2.5");
            ("form.json", form.into_bytes())
        } else {
            let form = bench.form(&[&tests[0], &tests[1], "-n", "1"]);
            ("form.csv", form.replace(",,,,,,", ",completed,1,2,3,4,5").into_bytes())
        };
        for (at, what, byte) in damage {
            if bytes.is_empty() {
                break;
            }
            let at = at.index(bytes.len());
            let rest = |of: &[u8]| of[at..].iter().position(|byte| b",\n".contains(byte)).map_or(of.len(), |n| at + n);
            let end = rest(&bytes);
            match what {
                0 => drop(bytes.drain(at..end)),
                1 => drop(bytes.drain(at..)),
                2 => bytes[at] = byte,
                3 => bytes.insert(at, byte),
                4 => {
                    let other = usize::from(byte) % bytes.len();
                    bytes.swap(at, other);
                }
                _ => {
                    let copy = bytes[at..end].to_vec();
                    bytes.splice(at..at, copy);
                }
            }
        }
        bench.write(name, &bytes);
        match bench.lab(&["add", "@42", &format!("@{name}")]) {
            Ok(()) => {
                // Each row that is not empty is a run.
                let recorded = bench.recorded();
                prop_assert!((1..=2).contains(&recorded.len()));
                let repository = Repository::open(&bench.path("42-hall")).unwrap();
                prop_assert_eq!(repository.evaluated().unwrap(), recorded.len());
                prop_assert!(repository.digest().is_ok());
            }
            Err(said) => {
                prop_assert!(said.ends_with("nothing was recorded; correct this and add the files again"), "{}", said);
                prop_assert!(said.lines().next().unwrap().starts_with(&format!("{name}:")), "{}", said);
                let left = fs::read_dir(bench.folder.path()).unwrap().count();
                prop_assert_eq!(left, 3, "the campaign, the form, and the file");
            }
        }
    }
}

const ENTERED: [&str; 8] = sesame_record::ENTERED_OUTCOMES;
