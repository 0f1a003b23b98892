use std::time::Duration;

use proptest::prelude::*;

use super::*;

const LIMIT: Limit = Limit { timeout: Duration::from_secs(60), reference: None };

fn dispatch() -> Dispatch {
    Dispatch::new("1".to_owned(), "2".to_owned())
}

fn job(number: u32) -> Box<RawValue> {
    RawValue::from_string(format!("{{\"number\":{number}}}")).unwrap()
}

fn ended(work: &Work, machine: &str, outcome: EndedAs) -> Ended {
    let agent = AgentName { machine: machine.to_owned(), id: format!("{machine}-1") };
    Ended { number: work.number, attempt: work.attempt, job: work.digest(), agent, outcome }
}

/// A result that says for which test it is.
fn ran(number: u32) -> EndedAs {
    EndedAs::Ran { result: job(number), fault: None, recorded: None }
}

fn broken_off(number: u32) -> EndedAs {
    EndedAs::Ran { result: job(number), fault: Some("the port is taken".to_owned()), recorded: None }
}

fn not_run() -> EndedAs {
    EndedAs::NotRun { reason: "there is no simulator".to_owned() }
}

fn again(answer: Answer) -> Work {
    match answer {
        Answer::Again(work) => *work,
        other => panic!("{other:?}"),
    }
}

fn presence(machine: &str) -> Presence {
    let agent = AgentName { machine: machine.to_owned(), id: format!("{machine}-1") };
    let (workers, busy, finished, version) = (1, 0, 0, "1".to_owned());
    Presence { agent, workers, busy, finished, version, campaign: None, refused: Vec::new() }
}

#[test]
fn the_first_result_of_a_test_counts_and_no_later_one() {
    let mut dispatch = self::dispatch();
    let work = dispatch.submit(7, job(7), LIMIT, false);
    let Answer::Result(taken) = dispatch.ended(ended(&work, "a", ran(7))) else { panic!("it counts") };
    assert_eq!((taken.number, taken.agent.machine.as_str(), taken.notes.len()), (7, "a", 0));
    assert!(matches!(dispatch.ended(ended(&work, "b", ran(7))), Answer::Nothing));
    assert_eq!(dispatch.waiting(), 0);
}

#[test]
fn a_result_of_another_job_with_the_same_number_is_none() {
    let mut dispatch = self::dispatch();
    let of_another_session = self::dispatch().submit(7, job(8), LIMIT, false);
    dispatch.submit(7, job(7), LIMIT, false);
    assert!(matches!(dispatch.ended(ended(&of_another_session, "a", ran(7))), Answer::Nothing));
    let with_other_files = Dispatch::new("3".to_owned(), "2".to_owned()).submit(7, job(7), LIMIT, false);
    assert!(matches!(dispatch.ended(ended(&with_other_files, "a", ran(7))), Answer::Nothing));
    assert_eq!(dispatch.waiting(), 1);
}

#[test]
fn a_test_that_the_environment_breaks_off_is_run_elsewhere_and_in_the_end_that_is_its_outcome() {
    let mut dispatch = self::dispatch();
    let first = dispatch.submit(1, job(1), LIMIT, false);
    let second = again(dispatch.ended(ended(&first, "a", broken_off(1))));
    assert_eq!((second.attempt, &second.avoid), (1, &BTreeSet::from(["a".to_owned()])));
    // The same news a second time, of a machine that was cut off meanwhile, is not a second fault of the test.
    assert!(matches!(dispatch.ended(ended(&first, "a", broken_off(1))), Answer::Nothing));
    let third = again(dispatch.ended(ended(&second, "b", broken_off(1))));
    // With faults in a row of other tests, a machine would be put aside; the machine is not to blame for this one.
    for number in [2, 3] {
        let work = dispatch.submit(number, job(number), LIMIT, false);
        again(dispatch.ended(ended(&work, "a", not_run())));
    }
    assert_eq!(dispatch.put_aside().len(), 1);
    let Answer::Result(taken) = dispatch.ended(ended(&third, "c", broken_off(1))) else { panic!("no more attempts") };
    assert_eq!(dispatch.put_aside(), []);
    assert_eq!(
        taken.notes,
        ["a", "b"].map(|name| format!(
            "the environment on `{name}` broke off this test, so the test was run again: the port is taken"
        ))
    );
}

#[test]
fn a_late_result_of_an_earlier_attempt_counts() {
    let mut dispatch = self::dispatch();
    let first = dispatch.submit(1, job(1), LIMIT, false);
    again(dispatch.ended(ended(&first, "a", not_run())));
    assert!(matches!(dispatch.ended(ended(&first, "b", ran(1))), Answer::Result(_)));
}

#[test]
fn a_machine_with_faults_in_a_row_is_put_aside_and_named_and_one_success_begins_the_row_anew() {
    let mut dispatch = self::dispatch();
    dispatch.present(&[presence("a"), presence("b")], |_| true);
    for number in 0..2 {
        let work = dispatch.submit(number, job(number), LIMIT, false);
        again(dispatch.ended(ended(&work, "a", not_run())));
    }
    let work = dispatch.submit(10, job(10), LIMIT, false);
    assert!(matches!(dispatch.ended(ended(&work, "a", ran(10))), Answer::Result(_)));
    assert_eq!(dispatch.put_aside(), []);
    for number in 20..23 {
        let work = dispatch.submit(number, job(number), LIMIT, false);
        again(dispatch.ended(ended(&work, "a", not_run())));
    }
    let reason = "3 faults in a row, the last one: there is no simulator";
    assert_eq!(dispatch.put_aside(), [("a".to_owned(), reason.to_owned())]);
    assert_eq!(dispatch.stuck(), None, "b is there");
    assert_eq!(
        dispatch.present(&[presence("a")], |_| true),
        ["no sign of `b` any more: its tests go to other machines"]
    );
    assert_eq!(dispatch.stuck(), Some(format!("`a`: {reason}")));
    assert_eq!(dispatch.present(&[presence("a")], |_| false), [""; 0], "one that was put aside is not lost");
    assert_eq!(dispatch.present(&[presence("a")], |_| true), ["`a` has joined"]);
    assert_eq!(dispatch.present(&[presence("a"), presence("c")], |_| true), ["`c` has joined"]);
    assert_eq!(dispatch.stuck(), None);
}

#[test]
fn a_test_with_which_agents_are_lost_again_and_again_is_given_up_once() {
    let mut dispatch = self::dispatch();
    let work = dispatch.submit(1, job(1), LIMIT, false);
    let poison = || EndedAs::Poison { lost: 10 };
    assert!(matches!(dispatch.ended(ended(&work, "a", poison())), Answer::Poison { number: 1, lost: 10 }));
    assert!(matches!(dispatch.ended(ended(&work, "b", poison())), Answer::Nothing));
}

/// What an agent may do with a test.
#[derive(Debug, Clone, Copy)]
enum Fate {
    Ran,
    BrokenOff,
    NotRun,
}

proptest! {
    /// Whatever agents do, in whatever order and however often their messages come: each test gets one result, its own,
    /// and nothing waits for ever as long as somebody runs what is in the queue.
    #[test]
    fn each_test_gets_exactly_one_result_in_any_order(
        tests in 1u32..12,
        steps in prop::collection::vec(
            (any::<prop::sample::Index>(), 0usize..4, prop_oneof![4 => Just(Fate::Ran), 1 => Just(Fate::BrokenOff), 1 => Just(Fate::NotRun)], 1usize..3),
            0..120,
        ),
    ) {
        let mut dispatch = self::dispatch();
        let mut queue: Vec<Work> = (0..tests).map(|number| dispatch.submit(number, job(number), LIMIT, false)).collect();
        let mut results = vec![0; tests as usize];
        let mut deliver = |dispatch: &mut Dispatch, queue: &mut Vec<Work>, work: &Work, machine: usize, fate: Fate| {
            let outcome = match fate {
                Fate::Ran => ran(work.number),
                Fate::BrokenOff => broken_off(work.number),
                Fate::NotRun => not_run(),
            };
            match dispatch.ended(ended(work, &format!("m{machine}"), outcome)) {
                Answer::Result(taken) => {
                    assert_eq!(taken.result.get(), job(taken.number).get());
                    results[taken.number as usize] += 1;
                }
                Answer::Again(work) => queue.push(*work),
                Answer::Poison { .. } => panic!("nobody said so"),
                Answer::Nothing => {}
            }
        };
        for (which, machine, fate, times) in steps {
            if queue.is_empty() {
                break;
            }
            let work = queue[which.index(queue.len())].clone();
            for _ in 0..times {
                deliver(&mut dispatch, &mut queue, &work, machine, fate);
            }
        }
        for work in queue.clone() {
            deliver(&mut dispatch, &mut queue, &work, 9, Fate::Ran);
        }
        prop_assert_eq!(dispatch.waiting(), 0);
        prop_assert_eq!(results, vec![1; tests as usize]);
    }
}
