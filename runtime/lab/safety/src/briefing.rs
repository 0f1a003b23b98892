//! The briefing sheet of a physical test: what those must know who are in the lab and may have to intervene.
//!
//! A safety pilot or operator is *issued with a briefing about the hazards and the fuzzing operations and their
//! anticipated effects* [SESAME 2023, Section 4.3]. A sheet says what is disturbed and when, what happened in
//! simulation, when to stop, and who must be there. [`text`] and [`html`] render it.

use std::fmt::Write as _;

pub mod html;
pub mod text;

/// What a sheet says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Briefing {
    /// Its title, for example the name of the test.
    pub title: String,
    /// What everyone must know first, such as that the method does not hold; each a sentence.
    pub warnings: Vec<String>,
    /// What is disturbed, in the order of time.
    pub disturbances: Vec<Disturbance>,
    /// Values of metrics in simulation.
    pub metrics: Vec<ExpectedMetric>,
    /// Verdicts on requirements in simulation.
    pub verdicts: Vec<ExpectedVerdict>,
    /// First contacts in simulation.
    pub contacts: Vec<ExpectedContact>,
    /// Which interlocks end the test, and which violations they stand for; each a sentence.
    pub interlocks: Vec<String>,
    /// How fast the robots were, and by how much safety zones must be wider; each a sentence.
    pub zones: Vec<String>,
    /// Whether motions depend on each other, so that robots must not be run one at a time; each a sentence.
    pub coupling: Vec<String>,
    /// When to stop the test; each a condition that can be seen, such as "the gripper is lower than the belt".
    pub stop_when: Vec<String>,
    /// Who must be present.
    pub present: Vec<Person>,
}

/// One operation of the test.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    /// What is done, in words.
    pub operation: String,
    /// The topic, node or parameter on which it acts.
    pub target: String,
    /// When.
    pub active: Active,
}

/// When an operation acts.
#[derive(Debug, Clone, PartialEq)]
pub enum Active {
    /// At a time of the test.
    During {
        /// Its begin, in seconds.
        from: f64,
        /// Its end, in seconds.
        to: f64,
    },
    /// While a condition holds, in words.
    While(String),
}

/// The value of a metric in simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedMetric {
    /// The metric.
    pub metric: String,
    /// Its unit; empty if it has none.
    pub unit: String,
    /// The value.
    pub value: f64,
    /// Where values of repeated runs are, if there were any.
    pub interval: Option<[f64; 2]>,
}

/// The verdict on a requirement in simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedVerdict {
    /// The requirement.
    pub requirement: String,
    /// The verdict.
    pub verdict: Verdict,
    /// When it was violated, as begin and end in seconds, in order.
    pub violated: Vec<[f64; 2]>,
    /// How many repeated runs violate it and how many there are, if there were any.
    pub repeated: Option<[usize; 2]>,
}

/// What a run says about a requirement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It did not hold.
    Violated,
    /// It held.
    Satisfied,
    /// The run does not say.
    Inconclusive,
}

impl Verdict {
    fn word(self) -> &'static str {
        match self {
            Verdict::Violated => "violated",
            Verdict::Satisfied => "satisfied",
            Verdict::Inconclusive => "inconclusive",
        }
    }
}

/// A zone or body, and when it is touched first in simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedContact {
    /// What moves.
    pub body: String,
    /// What it touches.
    pub zone: String,
    /// When, in seconds; `None` if it does not.
    pub first: Option<f64>,
    /// The least distance in metres, negative where they overlap, and when that is in seconds; `None` if not known.
    pub nearest: Option<[f64; 2]>,
}

/// Somebody who must be present.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    /// The role, for example "safety pilot".
    pub role: String,
    /// What this person does.
    pub task: String,
}

/// One part of a sheet, as both renderers need it.
struct Section {
    title: &'static str,
    /// What the section says if it has no lines: never just nothing, which could also mean that it was forgotten.
    empty: &'static str,
    lines: Vec<String>,
}

/// The sections of a sheet after its title and warnings, in the order in which they are read.
fn sections(briefing: &Briefing) -> Vec<Section> {
    let metric = |expected: &ExpectedMetric| {
        let unit = if expected.unit.is_empty() { String::new() } else { format!(" {}", expected.unit) };
        let interval = expected.interval.map_or_else(String::new, |[low, high]| {
            format!(" (between {} and {} in repeated runs)", number(low), number(high))
        });
        format!("{}: {}{unit}{interval}", expected.metric, number(expected.value))
    };
    let contact = |expected: &ExpectedContact| {
        let ExpectedContact { body, zone, first, nearest } = expected;
        let said = match first {
            Some(time) => format!("{body} touches {zone} first at {}", seconds(*time)),
            None => format!("{body} does not touch {zone}"),
        };
        match nearest {
            Some([least, time]) if *least < 0.0 => {
                format!("{said}, and is up to {} m inside at {}", number(-least), seconds(*time))
            }
            Some([least, time]) => format!("{said}; nearest are {} m at {}", number(*least), seconds(*time)),
            None => said,
        }
    };
    let disturbance = |one: &Disturbance| match &one.active {
        Active::During { from, to } => {
            format!("from {} to {}: {} on {}", seconds(*from), seconds(*to), one.operation, one.target)
        }
        Active::While(condition) => format!("while {condition}: {} on {}", one.operation, one.target),
    };
    vec![
        Section {
            title: "Must be present",
            empty: "Nobody is named. Do not start before somebody is.",
            lines: briefing.present.iter().map(|person| format!("{}: {}", person.role, person.task)).collect(),
        },
        Section {
            title: "Stop when",
            empty: "No criteria are given. Do not start before there are some.",
            lines: briefing.stop_when.clone(),
        },
        Section {
            title: "What is disturbed",
            empty: "Nothing: this is the reference run.",
            lines: briefing.disturbances.iter().map(disturbance).collect(),
        },
        Section {
            title: "Interlocks",
            empty: "None is named: nobody but the people who are present ends this test.",
            lines: briefing.interlocks.clone(),
        },
        Section { title: "Safety zones", empty: "No speed is known.", lines: briefing.zones.clone() },
        Section {
            title: "Coupled motion",
            empty: "Not judged: fewer than two bodies with a recorded pose are known.",
            lines: briefing.coupling.clone(),
        },
        Section {
            title: "First contacts in simulation",
            empty: "Not computed.",
            lines: briefing.contacts.iter().map(contact).collect(),
        },
        Section {
            title: "Verdicts in simulation",
            empty: "There are no requirements.",
            lines: briefing.verdicts.iter().map(expected_verdict).collect(),
        },
        Section {
            title: "Metrics in simulation",
            empty: "None were measured.",
            lines: briefing.metrics.iter().map(metric).collect(),
        },
    ]
}

/// How many violations of one requirement are listed.
const LISTED: usize = 4;

fn expected_verdict(expected: &ExpectedVerdict) -> String {
    let mut said = format!("{}: {}", expected.requirement, expected.verdict.word());
    let when: Vec<String> = expected
        .violated
        .iter()
        .take(LISTED)
        .map(|[from, to]| format!("from {} to {}", seconds(*from), seconds(*to)))
        .collect();
    if !when.is_empty() {
        said.push_str(", outside its bound ");
        said.push_str(&when.join(", "));
        if expected.violated.len() > LISTED {
            let more = expected.violated.len() - LISTED;
            let _ = write!(said, " and {more} times more");
        }
    }
    if let Some([violated, runs]) = expected.repeated {
        let _ = write!(said, "; violated in {violated} of {runs} repeated runs");
    }
    said
}

/// A number for people: with three decimals at most, five below 0.1, and an exponent where these do not show it.
fn number(x: f64) -> String {
    if x.is_nan() {
        return "not a number".to_owned();
    }
    if x.is_infinite() {
        return if x > 0.0 { "infinite" } else { "minus infinite" }.to_owned();
    }
    let size = x.abs();
    if size != 0.0 && !(1e-3..1e9).contains(&size) {
        return format!("{x:.3e}");
    }
    let decimals = if size < 0.1 { 5 } else { 3 };
    let text = format!("{x:.decimals$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0" } else { text }.to_owned()
}

fn seconds(time: f64) -> String {
    format!("{} s", number(time))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn example() -> Briefing {
        let text = str::to_owned;
        Briefing {
            title: text("T17 of campaign first"),
            warnings: vec![text("The motion is coupled: r3200 waits for the other arm. The method does not hold.")],
            disturbances: vec![
                Disturbance {
                    operation: text("packet loss of 40 %"),
                    target: text("topic /r3200/joint_states"),
                    active: Active::During { from: 2.5, to: 4.0 },
                },
                Disturbance {
                    operation: text("latency of 200 ms"),
                    target: text("topic /plc/commands"),
                    active: Active::While(text("near_zone1 < 5")),
                },
            ],
            metrics: vec![
                ExpectedMetric {
                    metric: text("collision_occurrence"),
                    unit: String::new(),
                    value: 12.0,
                    interval: Some([11.0, 14.0]),
                },
                ExpectedMetric { metric: text("clearance"), unit: text("m"), value: 0.0375, interval: None },
            ],
            verdicts: vec![
                ExpectedVerdict {
                    requirement: text("no_collision"),
                    verdict: Verdict::Violated,
                    violated: vec![[3.875, 4.25]],
                    repeated: Some([4, 5]),
                },
                ExpectedVerdict {
                    requirement: text("in_time"),
                    verdict: Verdict::Satisfied,
                    violated: Vec::new(),
                    repeated: None,
                },
            ],
            contacts: vec![
                ExpectedContact {
                    body: text("gripper"),
                    zone: text("Z1"),
                    first: Some(3.875),
                    nearest: Some([-0.02, 4.0]),
                },
                ExpectedContact { body: text("gripper"), zone: text("Z2"), first: None, nearest: Some([0.4, 4.5]) },
            ],
            interlocks: vec![text("collision_occurrence: its interlock stands for a violation of no_collision.")],
            zones: vec![text("The robots were up to 2.1 m/s fast.")],
            coupling: vec![text("r3200 and r2700: the motion is coupled.")],
            stop_when: vec![text("the gripper is nearer than a hand's breadth to the belt")],
            present: vec![Person { role: text("operator"), task: text("holds the enabling switch") }],
        }
    }

    #[test]
    fn numbers_are_short_and_say_what_they_are() {
        let shown =
            [0.0, -0.0001, 12.0, 0.125, 0.0375, 1e-9, 2.5e12, f64::NAN, f64::INFINITY, -f64::INFINITY].map(number);
        assert_eq!(
            shown,
            [
                "0",
                "-1.000e-4",
                "12",
                "0.125",
                "0.0375",
                "1.000e-9",
                "2.500e12",
                "not a number",
                "infinite",
                "minus infinite"
            ]
        );
    }
}
