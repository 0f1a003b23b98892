//! The course of reference runs: a resumed search has to read what an unbroken one saw.

use sesame_base::observation::{Course, Entered, Happening, Heard, Signal, SignalEvent, States};
use sesame_plan::Span;

use super::{commit_all, folder};
use crate::{Origin, Repository, sample};

#[test]
fn a_course_is_read_as_it_was_observed() {
    let event = |at, what| SignalEvent { at, what };
    let entered = |at, value: &str| Entered { at, value: value.to_owned() };
    let states = |wire, field: &str, entered| States { wire, field: field.to_owned(), entered };
    let signal = |wire, field: &str, events| Signal { wire, field: field.to_owned(), events };
    let course = Course {
        heard: vec![
            Heard { wire: 0, stretches: vec![Span { start: 2.0, end: 2.0 }, Span { start: 7.0, end: 7.0 }] },
            Heard { wire: 1, stretches: vec![Span { start: 0.0, end: 90.0 }] },
        ],
        signals: vec![
            // Few messages, each a single value: something happens to the messages, and in their nameless field.
            signal(0, "", vec![event(2.0, Happening::Message), event(7.0, Happening::Message)]),
            signal(0, "", vec![event(7.0, Happening::Changes)]),
            signal(1, "", vec![event(90.0, Happening::Ends)]),
            signal(1, "mode", vec![event(5.0, Happening::Changes)]),
            signal(1, "pose.x", vec![event(5.0, Happening::SetsOut), event(6.0, Happening::Turns)]),
        ],
        states: vec![
            states(0, "", vec![entered(2.0, "1"), entered(7.0, "2")]),
            states(1, "mode", vec![entered(0.0, "IDLE"), entered(5.0, "CHARGE"), entered(9.0, "")]),
        ],
    };
    let folder = folder();
    let mut records = sample::records(&sample::plan(), 10);
    let reference = records.iter_mut().find(|record| record.origin == Origin::Reference).unwrap();
    reference.observation.course = Some(course.clone());
    let number = reference.number;
    commit_all(folder.path(), &records).finish("all evaluations done").unwrap();
    let repository = Repository::open(folder.path()).unwrap();
    assert_eq!(repository.test(number).unwrap().observation.course, Some(course));
}
