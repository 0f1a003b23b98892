//! Scores compared with what the definitions say, taken literally.

use proptest::prelude::*;
use sesame_base::time::SimTime;
use sesame_monitor::State;
use sesame_monitor::compare::Step;
use sesame_monitor::score::{Hazard, Score, Scorer, score};

const T: fn(i64) -> SimTime = SimTime::from_nanos;
const G: State = State::Guarantee(0);

fn steps(of: &[(i64, State)]) -> Vec<Step<State>> {
    of.iter().map(|&(at, state)| Step { at: T(at), state }).collect()
}

/// Stays: the state, from when, until when, and whether the run began with it.
fn stays(steps: &[(i64, State)], end: i64) -> Vec<(State, i64, i64, bool)> {
    let mut all = vec![(0, State::Safe)];
    for &step in steps {
        if all.last().unwrap().1 != step.1 {
            all.push(step);
        }
    }
    let until = |at: usize| all.get(at + 1).map_or(end, |next| next.0);
    (0..all.len()).map(|at| (all[at].1, all[at].0, until(at), at == 0)).collect()
}

fn naive(guarantees: u32, horizon: Option<i64>, steps: &[(i64, State)], hazards: &[(u32, i64)], end: i64) -> Score {
    let stays = stays(steps, end);
    let state_at = |at: i64| stays.iter().rev().find(|stay| stay.1 <= at).unwrap();
    let mut judged: Vec<Hazard> = hazards
        .iter()
        .map(|&(requirement, at)| {
            let &(state, from, ..) = state_at(at);
            Hazard { requirement, at: T(at), lead: (state == State::Safe).then_some(T(at - from)) }
        })
        .collect();
    judged.sort_by_key(|hazard| (hazard.at, hazard.requirement));
    let last = stays.len() - 1;
    let is_false = |(at, &(state, from, to, first)): (usize, &(State, i64, i64, bool))| {
        let inside = |hazard: i64| from <= hazard && (hazard < to || at == last);
        let near = |hazard: i64| from <= hazard && horizon.is_some_and(|horizon| hazard <= from + horizon);
        let counts = !first || stays.len() == 1;
        state == State::Safe && counts && !hazards.iter().any(|&(_, hazard)| inside(hazard) || near(hazard))
    };
    let mut time_in = vec![0; guarantees as usize + 1];
    for &(state, from, to, _) in &stays {
        let place = match state {
            State::Guarantee(at) => at,
            State::Safe => guarantees,
        };
        time_in[place as usize] += to - from;
    }
    Score {
        hazards: judged,
        false_alarms: stays.iter().enumerate().filter(|&stay| is_false(stay)).count() as u32,
        open_alarms: 0,
        mitigations: stays.iter().filter(|stay| stay.0 == State::Safe && !stay.3).count() as u32,
        changes: stays.len() as u32 - 1,
        shortest_stay: stays[1..].iter().rev().skip(1).map(|stay| T(stay.2 - stay.1)).min(),
        time_in: time_in.into_iter().map(T).collect(),
    }
}

fn any_state() -> impl Strategy<Value = State> {
    prop_oneof![Just(State::Safe), (0..2_u32).prop_map(State::Guarantee)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn scores_are_what_the_definitions_say(
        mut decisions in prop::collection::vec((0..20_i64, any_state()), 0..8),
        mut hazards in prop::collection::vec((0..20_i64, any::<bool>()), 0..4),
        horizon in prop::option::of(0..6_i64),
    ) {
        decisions.sort_by_key(|(at, _)| *at);
        hazards.sort_by_key(|(at, _)| *at);
        let hazards: Vec<(u32, i64, bool)> = (0..).zip(hazards).map(|(id, (at, first))| (id, at, first)).collect();
        let plain: Vec<(u32, i64)> = hazards.iter().map(|&(id, at, _)| (id, at)).collect();
        let told: Vec<(u32, SimTime)> = plain.iter().map(|&(id, at)| (id, T(at))).collect();
        let whole = score(2, horizon.map(T), &steps(&decisions), &told, T(20));
        prop_assert_eq!(&whole, &naive(2, horizon, &decisions, &plain, 20));

        // As the run goes on: at each instant some hazards are told before and some after the decisions.
        let mut scorer = Scorer::new(2, horizon.map(T));
        for now in 0..=20 {
            let tell = |scorer: &mut Scorer, early: bool| {
                for &(id, at, _) in hazards.iter().filter(|&&(_, at, first)| at == now && first == early) {
                    scorer.hazard(T(at), id);
                }
            };
            tell(&mut scorer, true);
            decisions.iter().filter(|(at, _)| *at == now).for_each(|&(at, state)| scorer.decide(T(at), state));
            tell(&mut scorer, false);
            let until: Vec<_> = decisions.iter().copied().filter(|(at, _)| *at <= now).collect();
            let heard: Vec<_> = plain.iter().copied().filter(|(_, at)| *at <= now).collect();
            prop_assert_eq!(scorer.end(T(now)), naive(2, horizon, &until, &heard, now));
            // What is counted as false so far is false in the end.
            prop_assert!(scorer.so_far(T(now)).false_alarms <= whole.false_alarms);
        }
        prop_assert_eq!(scorer.end(T(20)), whole);
    }
}

#[test]
fn a_hazard_is_foreseen_in_the_safe_state_and_missed_outside() {
    let decisions = steps(&[(0, State::Safe), (10, G), (50, State::Safe), (80, G)]);
    let found = score(1, None, &decisions, &[(7, T(20)), (8, T(57)), (9, T(80))], T(100));
    assert_eq!((found.foreseen(), found.missed(), found.least_lead()), (1, 2, Some(T(7))));
    assert_eq!((found.false_alarms, found.mitigations, found.changes), (0, 1, 3));
    assert_eq!(found.time_in, [T(60), T(40)]);
    assert_eq!(found.shortest_stay, Some(T(30)));
}

#[test]
fn an_alarm_is_false_once_its_horizon_has_passed() {
    let mut scorer = Scorer::new(1, Some(T(20)));
    scorer.decide(T(10), G);
    scorer.decide(T(50), State::Safe);
    scorer.decide(T(55), G);
    let alarms = |scorer: &Scorer, now| {
        let score = scorer.so_far(T(now));
        (score.open_alarms, score.false_alarms)
    };
    assert_eq!(alarms(&scorer, 70), (1, 0));
    assert_eq!(alarms(&scorer, 71), (0, 1));
    assert_eq!(scorer.end(T(60)).false_alarms, 1);
    scorer.hazard(T(70), 0);
    assert_eq!(alarms(&scorer, 71), (0, 0));
    assert_eq!(scorer.end(T(71)).missed(), 1);
}
