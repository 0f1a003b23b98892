//! `sesamec lab interlocks`: whether an interlock on a wider zone stands for the violation that it prevents.
//!
//! In the lab the robot is stopped where it enters the expanded zone. Recordings in which nothing stopped it show
//! whether that happens in exactly the tests in which it would have touched, and early enough [SESAME 2023, Section
//! 4.3].

use std::path::PathBuf;

use anyhow::{bail, ensure};
use clap::Args;

use sesame_analysis::{Datum, Table, TestNumber};
use sesame_record::{Repository, recording};
use sesame_safety::interlock::{Equivalence, Judgement, Response};

use super::brief::{how_to_record, no_trace};
use super::contacts::{moving_shapes, signals};
use super::replay::{Meeting, meetings, recorded};
use crate::cli::results::{Format, Output, print};
use crate::cli::select::named_lab;
use crate::cli::shell::{self, Shell};

/// Which recordings, and how early is early enough.
#[derive(Debug, Args)]
pub(in crate::cli) struct Asked {
    /// The results of the campaign: a results file, or the folder of a run.
    results: PathBuf,
    /// The tests, for example `T158 T17`; all that have a trace if omitted.
    #[arg(value_name = "TEST")]
    tests: Vec<String>,
    /// The lab; the only one of the space if omitted.
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    /// How long before the contact the interlock must act: the time a robot needs to stop.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    lead: f64,
    #[command(flatten)]
    output: Output,
}

/// Judges the interlock of each pair of shapes, one of which is expanded.
pub(super) fn print_interlocks(shell: Shell, asked: &Asked) -> anyhow::Result<()> {
    ensure!(asked.lead >= 0.0 && asked.lead.is_finite(), "`--lead` must be 0 s or more");
    let repository = Repository::open(&asked.results)?;
    let plan = repository.plan();
    let Some(lab) = named_lab(plan, asked.lab.as_deref())? else {
        bail!("the space has no lab; describe the shapes in a `physical` block")
    };
    let shapes = moving_shapes(lab)?;
    let expanded = |name: &str| shapes.iter().any(|shape| shape.name == name && shape.expand > 0.0);
    ensure!(
        shapes.iter().any(|shape| shape.expand > 0.0),
        "no shape of lab `{}` is expanded, so nothing would trip before a contact; add `expand` to one",
        lab.name
    );
    let tests = if asked.tests.is_empty() {
        repository.numbers()?
    } else {
        asked.tests.iter().map(|name| repository.find(name)).collect::<Result<Vec<_>, _>>()?
    };
    let mut found: Vec<(String, Meeting)> = Vec::new();
    let mut untraced = Vec::new();
    for test in tests {
        let name = format!("T{test}");
        let Some(file) = recording(repository.folder(), test) else {
            untraced.push(TestNumber(test));
            continue;
        };
        let signals = signals(plan, &file)?;
        let shapes = shapes.iter().map(|shape| recorded(plan, shape, (0, &signals, 0.0)));
        let meetings = meetings(&shapes.collect::<Result<Vec<_>, _>>()?)?.into_iter();
        let guarded = meetings.filter(|meeting| expanded(&meeting.one) || expanded(&meeting.other));
        found.extend(guarded.map(|meeting| (name.clone(), meeting)));
    }
    if !asked.tests.is_empty()
        && let Some(&first) = untraced.first()
    {
        shell.warning(format!("{}; {}", no_trace(&untraced), how_to_record(first)));
    }
    ensure!(
        !found.is_empty(),
        "none of these tests has a trace; `{} replay FILE TEST --record` records one",
        shell::command()
    );
    let pairs = judged(&found, asked.lead);
    print(&table(&pairs), &asked.output)?;
    if asked.output.format() == Format::Table {
        let sentences: Vec<String> = pairs.iter().map(sentence).collect();
        shell::asked_for(&format!("\n{}\n", sentences.join("\n")))?;
    }
    Ok(())
}

/// Two shapes, and what their interlock does in all tests.
type Pair = (String, String, Equivalence);

fn judged(found: &[(String, Meeting)], lead: f64) -> Vec<Pair> {
    let mut names: Vec<(&str, &str)> = Vec::new();
    for (_, meeting) in found {
        let pair = (meeting.one.as_str(), meeting.other.as_str());
        if !names.contains(&pair) {
            names.push(pair);
        }
    }
    let of = |(one, other): (&str, &str)| {
        let pair = found.iter().filter(|(_, meeting)| meeting.one == one && meeting.other == other);
        let responses = pair.map(|(test, meeting)| {
            (test.clone(), Response { trip: meeting.margins_touch, entry: meeting.contacts.first() })
        });
        (one.to_owned(), other.to_owned(), Equivalence::of(responses, lead))
    };
    names.into_iter().map(of).collect()
}

fn table(pairs: &[Pair]) -> Table {
    let columns = ["one", "other", "test", "trip_s", "contact_s", "lead_s", "interlock"];
    let real = |value: Option<f64>| value.map_or(Datum::Missing, Datum::Real);
    let rows = pairs.iter().flat_map(|(one, other, equivalence)| {
        equivalence.motions.iter().map(move |motion| {
            let (lead, word) = match motion.judgement {
                Judgement::Nothing => (None, "idle"),
                Judgement::Prevented { lead } => (Some(lead), "prevents"),
                Judgement::Late { lead } => (Some(lead), "late"),
                Judgement::FalseAlarm => (None, "false alarm"),
                Judgement::Missed => (None, "misses"),
            };
            vec![
                Datum::Text(one.clone()),
                Datum::Text(other.clone()),
                Datum::Text(motion.name.clone()),
                real(motion.response.trip),
                real(motion.response.entry),
                real(lead),
                Datum::Text(word.to_owned()),
            ]
        })
    });
    Table::of(columns.map(str::to_owned), rows)
}

/// What follows for a pair.
fn sentence((one, other, equivalence): &Pair) -> String {
    let tests = equivalence.motions.len();
    let names = |motions: Vec<&str>| motions.join(", ");
    let unsafe_tests: Vec<&str> = equivalence.unsafe_motions().map(|motion| motion.name.as_str()).collect();
    let differing: Vec<&str> = equivalence.differing().map(|motion| motion.name.as_str()).collect();
    let lead = equivalence.shortest_lead().map_or_else(String::new, |lead| format!(", {lead:.3} s before it or more"));
    let contacts = equivalence.motions.iter().filter(|motion| motion.response.entry.is_some()).count();
    let trips = equivalence.motions.iter().filter(|motion| motion.response.trip.is_some()).count();
    let early = if contacts == 0 {
        "no test has a contact, so nothing is known of whether an interlock would act in time".to_owned()
    } else if unsafe_tests.is_empty() {
        format!("an interlock acts before each contact{lead}")
    } else {
        format!("an interlock acts too late or not at all in {}", names(unsafe_tests))
    };
    let stands = if contacts == 0 && trips == 0 {
        "No interlock acts in any of them either.".to_owned()
    } else if contacts == 0 {
        format!("It acts without a contact in {}.", names(differing))
    } else if differing.is_empty() {
        "It stands for the contact: it acts in exactly the tests that have one.".to_owned()
    } else {
        format!("It does not stand for the contact: only one of the two happens in {}.", names(differing))
    };
    format!("`{one}` and `{other}`, {tests} {}: {early}. {stands}", if tests == 1 { "test" } else { "tests" })
}

#[cfg(test)]
mod tests {
    use sesame_safety::Vector;
    use sesame_safety::body::{Body, Shape};
    use sesame_safety::trace::Trace;

    use super::super::replay::Recorded;
    use super::*;

    /// A sphere that flies along x at 1 m/s, at this distance from a sphere that is expanded by 0.5 m.
    fn flown(test: &str, beside: f64) -> (String, Meeting) {
        let ball = || Shape::sphere(0.5).unwrap();
        let places = vec![Vector::new(-5.0, beside, 0.0), Vector::new(5.0, beside, 0.0)];
        let trace = Trace::new(vec![0.0, 10.0], places, None).unwrap();
        let moves = Recorded {
            name: "gripper".to_owned(),
            body: Body::moving(ball(), trace).unwrap(),
            margin: 0.0,
            moves: Some(("gripper".to_owned(), 0)),
        };
        let stands = Recorded {
            name: "Z1".to_owned(),
            body: Body::fixed_at(ball(), Vector::ZERO).unwrap(),
            margin: 0.5,
            moves: None,
        };
        let meeting = meetings(&[moves, stands]).unwrap().remove(0);
        (test.to_owned(), meeting)
    }

    fn said(found: &[(String, Meeting)], lead: f64) -> (Vec<String>, String) {
        let pairs = judged(found, lead);
        let words = table(&pairs).rows().into_iter().map(|row| match row.last() {
            Some(Datum::Text(word)) => word.clone(),
            other => panic!("{other:?}"),
        });
        (words.collect(), sentence(&pairs[0]))
    }

    #[test]
    fn of_tests_without_a_contact_nothing_is_concluded() {
        let (words, sentence) = said(&[flown("T1", 9.0), flown("T2", 9.0)], 0.4);
        assert_eq!(words, ["idle", "idle"]);
        assert_eq!(
            sentence,
            "`gripper` and `Z1`, 2 tests: no test has a contact, so nothing is known of whether an interlock would act in \
             time. No interlock acts in any of them either."
        );
    }

    #[test]
    fn an_interlock_that_acts_in_time_and_only_then_stands_for_the_contact() {
        let found = [flown("T1", 0.0), flown("T2", 9.0)];
        let (words, sentence) = said(&found, 0.4);
        assert_eq!(words, ["prevents", "idle"]);
        assert_eq!(
            sentence,
            "`gripper` and `Z1`, 2 tests: an interlock acts before each contact, 0.500 s before it or more. It stands \
             for the contact: it acts in exactly the tests that have one."
        );
    }

    #[test]
    fn tests_in_which_it_is_late_or_alone_are_named() {
        let found = [flown("T1", 0.0), flown("T3", 1.2)];
        let (words, sentence) = said(&found, 0.6);
        assert_eq!(words, ["late", "false alarm"]);
        assert_eq!(
            sentence,
            "`gripper` and `Z1`, 2 tests: an interlock acts too late or not at all in T1. It does not stand for the \
             contact: only one of the two happens in T3."
        );
    }
}
