use sesame_plan::Type;
use sesame_plan::testing::{minimal, topic};

use super::*;

/// A topic of one path, and one of two.
fn plan() -> CampaignPlan {
    let mut plan = minimal();
    plan.topics = vec![topic("mode", &["/mode"], Type::Bool), topic("odom", &["/a/odom", "/b/odom"], Type::Bool)];
    plan
}

fn moment(what: Event, which: Which) -> Moment {
    Moment { wire: 0, field: String::new(), what, which }
}

fn around(moment: Moment, from: f64, to: f64) -> Trigger {
    Trigger::Around { moment, from, to }
}

#[test]
fn each_description_reads_as_a_clause_after_the_name_of_an_operation() {
    let message = |which| moment(Event::Happens(Happening::Message), which);
    let charges = || moment(Event::Becomes("CHARGE".to_owned()), Which::Any);
    let state = |holds| State { wire: 2, field: "speed".to_owned(), holds };
    let while_ = |holds, least| Trigger::While { state: state(holds), least };
    let edge = |edge, within| Trigger::Edge { edge, within };
    let span = |start, end| Span { start, end };
    let descriptions = [
        Trigger::Always,
        around(message(Which::Any), 0.0, 0.0),
        around(message(Which::Nth(2)), 0.0, 0.25),
        around(message(Which::Last), -0.5, 0.0),
        around(message(Which::Nth(21)), -0.5, 0.25),
        around(charges(), 0.0, 0.0),
        around(charges(), 0.0, 1.5),
        around(charges(), 0.5, 1.5),
        around(charges(), -1.5, -0.5),
        around(Moment { which: Which::Nth(3), ..charges() }, -1.5, 0.0),
        while_(Holds::Value("CHARGE".to_owned()), 0.0),
        while_(Holds::Moves, 0.25),
        while_(Holds::Rests, 0.0),
        while_(Holds::Speaks, 0.0),
        while_(Holds::FallsSilent, 0.0),
        edge(Edge::Begins, Within::State(state(Holds::Moves))),
        edge(Edge::Ends, Within::Around { moment: charges(), from: 0.0, to: 2.0 }),
        edge(Edge::Begins, Within::Times { span: span(1.0, 2.5) }),
        Trigger::Between { span: span(1.0, 1.05) },
    ];
    let plan = plan();
    let texts: Vec<String> = descriptions.iter().map(|trigger| words(&plan, trigger)).collect();
    insta::assert_snapshot!(texts.join("\n"), @r"
    may act at any time
    has to act at a message of `mode`
    has to act from the second message of `mode` until 0.25 s later
    has to act from 0.50 s before the last message of `mode` until then
    has to act from 0.50 s before to 0.25 s after the 21st message of `mode`
    has to act when `mode` becomes CHARGE
    has to act from when `mode` becomes CHARGE until 1.50 s later
    has to act from 0.50 s to 1.50 s after `mode` becomes CHARGE
    has to act from 1.50 s to 0.50 s before `mode` becomes CHARGE
    has to act from 1.50 s before `mode` becomes CHARGE for the third time until then
    has to act while `/b/odom.speed` is CHARGE
    has to act for at least 0.25 s while `/b/odom.speed` moves
    has to act while `/b/odom.speed` rests
    has to act while messages of `/b/odom.speed` come
    has to act while `/b/odom.speed` is silent
    has to begin while `/b/odom.speed` moves
    has to end from when `mode` becomes CHARGE until 2.00 s later
    has to begin from 1.00 s to 2.50 s
    has to act from 1.000 s to 1.050 s
    ");
}

#[test]
fn each_thing_that_happens_reads_as_a_clause() {
    let plan = plan();
    let texts = Happening::ALL.map(|what| {
        let moment = moment(Event::Happens(what), Which::Last);
        words(&plan, &around(Moment { field: "[3]".to_owned(), ..moment }, 0.0, 0.0))
    });
    insta::assert_snapshot!(texts.join("\n"), @r"
    has to act at the last message of `mode[3]`
    has to act when messages of `mode[3]` begin to come for the last time
    has to act when `mode[3]` falls silent for the last time
    has to act when `mode[3]` changes for the last time
    has to act when `mode[3]` jumps for the last time
    has to act when `mode[3]` begins to move for the last time
    has to act when `mode[3]` comes to rest for the last time
    has to act when `mode[3]` changes its sign for the last time
    has to act when `mode[3]` turns for the last time
    ");
}

#[test]
fn numbers_are_counted_as_in_english() {
    let texts = [1, 2, 3, 4, 10, 11, 12, 13, 21, 22, 23, 24, 101, 111, 112].map(ordinal);
    assert_eq!(texts.join(" "), "first second third 4th 10th 11th 12th 13th 21st 22nd 23rd 24th 101st 111th 112th");
}
