use proptest::prelude::*;

use sesame_base::observation::{Entered, Signal, SignalEvent, States};

use super::*;

const END: f64 = 60.0;

/// Three orders, a mode, and an axis that moves twice, of a run of a minute.
fn course() -> Course {
    let event = |at, what| SignalEvent { at, what };
    let signal = |wire, field: &str, events| Signal { wire, field: field.to_owned(), events };
    let entered = |at, value: &str| Entered { at, value: value.to_owned() };
    Course {
        heard: Vec::new(),
        signals: vec![
            signal(0, "", [5.0, 20.0, 42.0].map(|at| event(at, Happening::Message)).to_vec()),
            signal(1, "mode", vec![event(10.0, Happening::Changes), event(30.0, Happening::Changes)]),
            signal(
                2,
                "x",
                vec![
                    event(12.0, Happening::SetsOut),
                    event(18.0, Happening::Rests),
                    event(33.0, Happening::SetsOut),
                    event(39.0, Happening::Rests),
                ],
            ),
        ],
        states: vec![States {
            wire: 1,
            field: "mode".to_owned(),
            entered: vec![entered(0.0, "IDLE"), entered(10.0, "CHARGE"), entered(30.0, "IDLE")],
        }],
    }
}

/// Windows of many lengths all over the run, and whether a test fails with them.
fn tried(seed: usize, count: usize, fails: impl Fn(Span) -> bool) -> Vec<TriedWindow> {
    let place = |at: usize, by: f64| (at as f64 * by + seed as f64 * 0.377).fract();
    let window = |at: usize| {
        let length = 0.5 * libm::pow(60.0, place(at, 0.618_034));
        let start = (END - length) * place(at, 0.754_878);
        Span { start, end: start + length }
    };
    let windows = (0..count).map(window);
    windows.map(|window| TriedWindow { window, fails: fails(window) }).collect()
}

fn described(smallest: (f64, f64), fails: impl Fn(Span) -> bool + Copy) -> Description {
    let smallest = Span { start: smallest.0, end: smallest.1 };
    assert!(fails(smallest), "it is one that fails");
    describe(&course(), END, &[0], smallest, &tried(1, 48, fails), &tried(2, 24, fails)).unwrap()
}

fn contains(window: Span, at: f64) -> bool {
    window.start <= at && at < window.end
}

fn moment(wire: u32, field: &str, what: Event, which: Which) -> Trigger {
    Trigger::Around { moment: Moment { wire, field: field.to_owned(), what, which }, from: 0.0, to: 0.0 }
}

#[test]
fn what_matters_is_described_in_few_words() {
    assert_eq!(described((3.0, 4.0), |_| true).trigger, Trigger::Always);

    let any_order = |window| [5.0, 20.0, 42.0].iter().any(|&at| contains(window, at));
    let message = Event::Happens(Happening::Message);
    assert_eq!(described((19.9, 20.3), any_order).trigger, moment(0, "", message.clone(), Which::Any));
    let second = |window| contains(window, 20.0);
    assert_eq!(described((19.9, 20.3), second).trigger, moment(0, "", message.clone(), Which::Nth(2)));
    let last = |window| contains(window, 42.0);
    assert_eq!(described((41.9, 42.3), last).trigger, moment(0, "", message, Which::Last));

    let becomes = |window| contains(window, 10.0);
    let charge = Event::Becomes("CHARGE".to_owned());
    assert_eq!(described((9.8, 10.1), becomes).trigger, moment(1, "mode", charge, Which::Any));
    let charging = |window: Span| window.start < 30.0 && window.end > 10.0;
    let state = State { wire: 1, field: "mode".to_owned(), holds: Holds::Value("CHARGE".to_owned()) };
    assert_eq!(described((15.0, 15.5), charging).trigger, Trigger::While { state, least: 0.0 });

    let moving = State { wire: 2, field: "x".to_owned(), holds: Holds::Moves };
    let moves = |window: Span| [(12.0, 18.0), (33.0, 39.0)].iter().any(|(a, b)| window.start < *b && window.end > *a);
    assert_eq!(described((14.0, 14.5), moves).trigger, Trigger::While { state: moving.clone(), least: 0.0 });
    let begins = |window: Span| [(12.0, 18.0), (33.0, 39.0)].iter().any(|(a, b)| (*a..*b).contains(&window.start));
    let edge = |edge| Trigger::Edge { edge, within: Within::State(moving.clone()) };
    assert_eq!(described((14.0, 14.5), begins).trigger, edge(Edge::Begins));
    let ends = |window: Span| [(12.0, 18.0), (33.0, 39.0)].iter().any(|(a, b)| *a < window.end && window.end <= *b);
    assert_eq!(described((14.0, 14.5), ends).trigger, edge(Edge::Ends));
}

#[test]
fn from_when_to_when_around_a_moment_is_said_in_seconds() {
    let long = |window: Span| window.start <= 20.0 && window.end >= 23.0;
    let found = described((20.0, 23.0), long);
    let Trigger::Around { moment, from, to } = &found.trigger else { panic!("{found:?}") };
    assert_eq!((moment.wire, moment.which, *from), (0, Which::Nth(2), 0.0));
    assert!((to - 3.0).abs() < 1e-9);
    assert_eq!(found.made_of, Agreement { right: 49, of: 49 });
    assert!(found.fresh.right + 1 >= found.fresh.of, "{:?}", found.fresh);
}

#[test]
fn when_it_has_to_begin_is_said_around_a_moment_or_as_a_time() {
    let near_charge = |window: Span| (8.0..14.0).contains(&window.start);
    let found = described((9.0, 9.5), near_charge);
    let Trigger::Edge { edge: Edge::Begins, within: Within::Around { moment, from, to } } = &found.trigger else {
        panic!("{found:?}")
    };
    // It is from 2 s before to 4 s after that; windows that were tried say it about so.
    assert_eq!((moment.wire, &moment.what), (1, &Event::Becomes("CHARGE".to_owned())), "{found:?}");
    assert!((from + 2.0).abs() < 1.0 && (to - 4.0).abs() < 1.5, "{found:?}");
    assert!(found.fresh.right + 2 >= found.fresh.of, "{:?}", found.fresh);
}

#[test]
fn what_nothing_explains_is_a_time_of_the_run() {
    let odd = |window: Span| window.start <= 50.0 && window.end >= 52.0;
    assert_eq!(described((50.0, 52.0), odd).trigger, Trigger::Between { span: Span { start: 50.0, end: 52.0 } });
}

#[test]
fn chance_is_not_described_as_if_it_were_a_rule() {
    // Whether a window fails has nothing to do with the run.
    let odd = |window: Span| (window.start * 1000.0).fract() < 0.5;
    let smallest = Span { start: 20.0, end: 20.5 };
    let found = describe(&course(), END, &[0], smallest, &tried(1, 24, odd), &tried(2, 12, odd)).unwrap();
    assert!(found.fresh.right * 10 < found.fresh.of * 9, "fresh windows show it: {found:?}");
}

#[test]
fn of_few_windows_nothing_is_said() {
    let smallest = Span { start: 20.0, end: 20.5 };
    let always = |_| true;
    assert_eq!(describe(&course(), END, &[0], smallest, &tried(1, 11, always), &tried(2, 12, always)), None);
    assert_eq!(describe(&course(), END, &[0], smallest, &tried(1, 24, always), &tried(2, 5, always)), None);
}

proptest! {
    /// Whatever decides, what is chosen is not longer, with what it gets wrong, than what does decide.
    #[test]
    fn nothing_shorter_is_overlooked(start in 0.0..50.0f64, length in 0.1..10.0f64, at: prop::sample::Index, seed in 0..1000usize) {
        let smallest = Span { start, end: start + length };
        let all = candidates(&course(), END, smallest, &[]);
        let planted = all[at.index(all.len())].clone();
        prop_assume!(planted.decides.fails(smallest));
        let fails = |window| planted.decides.fails(window);
        let found = describe(&course(), END, &[0], smallest, &tried(seed, 24, fails), &tried(seed + 1, 12, fails)).unwrap();
        let cost = WORDS_PER_WINDOW * (found.made_of.of - found.made_of.right) + found.trigger.length();
        prop_assert!(cost <= planted.trigger.length(), "{:?} in place of {:?}", found, planted.trigger);
    }
}
