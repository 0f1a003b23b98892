//! Down to single messages: none of those that a shrunk test alters can be left out.

use super::*;

/// How many messages each operation of a test alters unless it lists others.
const EACH: u64 = 5;

/// A message by the seed of the operation that alters it, and its number.
type Altered = (u64, u64);

/// The messages that a test's operations alter: each operation alters those that it lists, or else messages 0 to
/// [`EACH`] - 1 on the first wire.
fn altered_by(test: &Test) -> BTreeSet<Altered> {
    let of = |used: &TestOperation| {
        let listed = |number: &u64| used.messages.as_ref().is_none_or(|messages| messages.hold(0, *number));
        (0..EACH).filter(listed).map(|number| (used.operation_seed, number)).collect::<Vec<_>>()
    };
    test.operations.iter().flat_map(of).collect()
}

/// The same as a run lists it.
fn listed(test: &Test) -> AlteredMessages {
    let place = |seed| test.operations.iter().position(|used| used.operation_seed == seed).unwrap();
    let message = |&(seed, number): &Altered| AlteredMessage {
        operation: u32::try_from(place(seed)).unwrap(),
        wire: 0,
        number,
        time: f64::from(u32::try_from(number).unwrap()),
    };
    let mut all: Vec<AlteredMessage> = altered_by(test).iter().map(message).collect();
    all.sort_by_key(|message| (message.operation, message.number));
    AlteredMessages::Listed(all)
}

fn plan() -> CampaignPlan {
    SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1))
}

/// A test of so many operations.
fn original(operations: u32) -> Test {
    let used: Vec<_> = (0..operations).map(|_| (0, (2.0, 50.0), range(0.0, 0.25))).collect();
    offsets(&used)
}

fn to_messages(test: Test, runs: u32, evaluations: u32) -> Shrink {
    Shrink::new(&plan(), Shrinking { messages: true, ..shrinking(test, runs, evaluations) })
}

/// The messages that a test alters with one of them left out; `None` where the campaign permits no such test, since
/// it would have no operation.
fn without_one(messages: &BTreeSet<Altered>) -> Vec<BTreeSet<Altered>> {
    let without = |out: &Altered| messages.iter().filter(|message| *message != out).copied().collect();
    if messages.len() == 1 { Vec::new() } else { messages.iter().map(without).collect() }
}

proptest! {
    // Each case shrinks a test all the way, and tries up to a thousand subsets.
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Compared with every subset of the messages. Where more messages never make a failing test pass, what is left is
    /// a smallest set that fails. Elsewhere, what is left fails, and does not if any one of its messages is left out.
    #[test]
    fn what_is_left_is_smallest(
        operations in 1u32..3,
        causes in proptest::collection::vec(proptest::collection::btree_set((0u64..2, 0..EACH), 1..4), 1..4),
        share in 0.0..0.6f64,
        monotone: bool,
        seed: u64,
    ) {
        let original = original(operations);
        let all = altered_by(&original);
        let fails = |messages: &BTreeSet<Altered>| {
            *messages == all
                || if monotone {
                    causes.iter().any(|cause| cause.is_subset(messages))
                } else {
                    let words = messages.iter().flat_map(|(of, number)| [*of, *number]);
                    let sum = words.fold(seed, |sum, word| derive_seed(sum, "scattered", &[word]));
                    !messages.is_empty() && Stream::derive(sum, "scattered", &[]).unit() < share
                }
        };
        let mut asked = BTreeSet::new();
        let mut repeated = false;
        let shrink = shrunk_to_messages(
            to_messages(original.clone(), 1, 100_000),
            |test, _| fails(&altered_by(test)),
            |test, _| listed(test),
        );
        for tried in shrink.tried().iter().filter(|tried| tried.phase != Phase::Listing) {
            repeated |= !asked.insert(content(&tried.test));
        }
        prop_assert!(!repeated, "no test is run twice");
        let found = altered_by(smallest(&shrink).unwrap());
        prop_assert!(fails(&found) && shrink.is_minimal());
        prop_assert_eq!(shrink.messages(), Some(MessagesEnd::Reduced));
        for fewer in without_one(&found) {
            prop_assert!(!fails(&fewer), "{:?} can be reduced to {:?}", &found, fewer);
        }
        if monotone {
            let all: Vec<Altered> = all.iter().copied().collect();
            let subset = |chosen: u32| -> BTreeSet<Altered> {
                all.iter().enumerate().filter(|(at, _)| chosen >> at & 1 == 1).map(|(_, message)| *message).collect()
            };
            let failing: Vec<_> = (1..1u32 << all.len()).map(subset).filter(&fails).collect();
            let mut smallest = failing.iter().filter(|set| {
                !failing.iter().any(|other| other.len() < set.len() && other.is_subset(set))
            });
            prop_assert!(smallest.any(|set| *set == found), "{:?}", found);
        }
        // The last list is that of the smallest test.
        let last = *shrink.accepted().last().unwrap();
        prop_assert_eq!(shrink.altered_by(last), Some(&listed(&shrink.tried()[last].test)));
    }
}

/// Wherever the runs are used up, the smallest test so far fails, and only all of the runs make it minimal.
#[test]
fn when_the_runs_are_used_up_the_smallest_so_far_is_left() {
    let fails = |test: &Test| [1, 3].iter().all(|number| altered_by(test).contains(&(0, *number)));
    let with = |evaluations: u32| {
        let shrink = to_messages(original(1), 1, evaluations);
        shrunk_to_messages(shrink, |test, _| fails(test), |test, _| listed(test))
    };
    let whole = u32::try_from(with(1000).tried().len()).unwrap();
    for evaluations in 1..=whole {
        let shrink = with(evaluations);
        assert!(shrink.tried().len() <= evaluations as usize && fails(smallest(&shrink).unwrap()));
        // The last run only lists the messages of the smallest test.
        assert_eq!(shrink.is_minimal(), evaluations + 1 >= whole, "{evaluations} of {whole}");
    }
}

/// A list of this many messages of the first operation.
fn many(count: usize) -> AlteredMessages {
    let message = |number: usize| AlteredMessage { operation: 0, wire: 0, number: number as u64, time: 0.0 };
    AlteredMessages::Listed((0..count).map(message).collect())
}

#[test]
fn without_a_list_the_test_is_left_as_it_was_and_it_is_said_why() {
    let ended = |altered: AlteredMessages| {
        let shrink = shrunk_to_messages(
            to_messages(original(1), 1, 500),
            |test, _| test.operations.iter().all(|used| used.messages.is_none()),
            |_, _| altered.clone(),
        );
        let test = smallest(&shrink).unwrap();
        assert!(shrink.is_minimal() && test.operations.iter().all(|used| used.messages.is_none()));
        shrink.messages().unwrap()
    };
    assert_eq!(ended(AlteredMessages::TooMany), MessagesEnd::TooMany);
    assert_eq!(ended(AlteredMessages::Listed(Vec::new())), MessagesEnd::NoneAltered);
    assert_eq!(ended(many(3)), MessagesEnd::NotReproduced, "no test with a list fails");
}

#[test]
fn what_several_runs_alter_is_put_together_and_what_alters_nothing_is_left_alone() {
    let needs = |test: &Test| {
        let [first, second] = test.operations.as_slice() else { return false };
        let holds = |number| first.messages.as_ref().is_none_or(|messages| messages.hold(0, number));
        holds(3) && holds(8) && second.messages.is_none()
    };
    let shrink = shrunk_to_messages(
        to_messages(original(2), 2, 500),
        |test, _| needs(test),
        |test, seed| {
            let numbers = if seed == 7 { [1, 3, 4] } else { [4, 6, 8] };
            let held = |number: &u64| test.operations[0].messages.as_ref().is_none_or(|of| of.hold(0, *number));
            let message = |number| AlteredMessage { operation: 0, wire: 0, number, time: 0.0 };
            AlteredMessages::Listed(numbers.into_iter().filter(held).map(message).collect())
        },
    );
    let test = smallest(&shrink).unwrap();
    assert_eq!(test.operations[0].messages, Messages::of([(0, 3), (0, 8)]));
    assert_eq!(test.operations[1].messages, None);
    assert!(shrink.tried().iter().zip(0u32..).all(|(tried, at)| tried.number == 1 + 2 * at));
}

#[test]
fn as_many_messages_as_a_run_lists_are_reduced_in_few_runs() {
    let count = sesame_base::observation::ALTERED_LISTED;
    let needed = [17, 4711, 9876];
    let shrink = shrunk_to_messages(
        to_messages(original(1), 1, 2000),
        |test, _| {
            let messages = test.operations[0].messages.as_ref();
            needed.iter().all(|&number| messages.is_none_or(|messages| messages.hold(0, number)))
        },
        |test, _| match &test.operations[0].messages {
            None => many(count),
            Some(_) => many(0),
        },
    );
    let messages = smallest(&shrink).unwrap().operations[0].messages.clone();
    assert_eq!(messages, Messages::of(needed.map(|number| (0, number))));
    assert!(shrink.is_minimal() && shrink.tried().len() < 400, "{}", shrink.tried().len());
}
