//! What a scan finds of simulators that others wrote.

use std::time::Duration;

use sesame_plan::{SimlogVersion, WireNames};
use sesame_scan::{FoundTopic, Guess, System};
use sesame_simlog::client::ClientOptions;
use sesame_simlog::scan::{Found, Wanted, scan};

use crate::peer::Peer;

fn found(peer: &Peer, version: SimlogVersion, names: WireNames, topics: &[&str], steps: u64) -> Found {
    let wanted = Wanted {
        topics: topics.iter().map(|&topic| topic.to_owned()).collect(),
        names,
        steps,
        step_ms: 20,
        // After steps it ends as soon as nothing more comes; without them it hears nothing.
        listening: Duration::from_millis(if steps > 0 { 60_000 } else { 500 }),
    };
    scan(&ClientOptions::new(&peer.url(), version), &wanted).expect("the peer runs")
}

/// Topics with their messages, and what these have in common or why nothing.
fn said(found: &Found) -> Vec<String> {
    let of = |topic: &FoundTopic| {
        let guess = found.payloads.get(&topic.path).map(|samples| samples.guess(found.conventions));
        let guess = match (guess, &topic.problem) {
            (Some(Ok(guess)), _) => words(&guess),
            (Some(Err(why)), _) => why,
            (None, problem) => problem.clone().unwrap_or_default(),
        };
        format!("{} {}: {guess}", topic.path, topic.messages)
    };
    found.facts.topics.iter().map(of).collect()
}

fn words(guess: &Guess) -> String {
    match guess {
        Guess::List(of) => format!("list of {}", words(of)),
        Guess::Message { fields, .. } => {
            let fields: Vec<String> =
                fields.iter().map(|field| format!("{} {}", field.name, words(&field.guess))).collect();
            format!("{{{}}}", fields.join(", "))
        }
        plain => format!("{plain:?}").to_lowercase(),
    }
}

#[test]
fn version_2_has_what_comes_in_steps_and_nothing_without_them() {
    let Some(peer) = Peer::start("simulator2.py", &["--eager"]) else { return };
    let topics = ["joint", "cart", "point", "turn", "safetyzones/Z1", "state", "seldom", "nowhere"];
    let none = found(&peer, SimlogVersion::V2, WireNames::default(), &topics, 0);
    let System::Simlog { protocol: 2, steps: 0, .. } = none.facts.system else { panic!("{:?}", none.facts.system) };
    assert_eq!(said(&none)[0], "joint 0: nothing came on it; is there such a topic? Else take steps with `--steps N`");
    let steps = found(&peer, SimlogVersion::V2, WireNames::default(), &topics, 12);
    assert_eq!(
        said(&steps),
        [
            "joint 12: real",
            // `none` before the first step, then numbers.
            "cart 12: text",
            "point 12: point",
            "turn 12: {w real, x real, y real, z real}",
            "safetyzones/Z1 12: {header {frame_id text, seq int, stamp {nsec int, sec int}}, level real, object1 text, \
             object2 text, zone text}",
            "state 12: {t real, tags list of text}",
            "seldom 1: int",
            "nowhere 0: nothing came on it; is there such a topic? Else take more steps with `--steps N`",
        ]
    );
}

#[test]
fn version_3_says_which_topics_there_are_and_what_they_are_now() {
    let Some(peer) = Peer::start("simulator3.py", &[]) else { return };
    let names = WireNames::of_version_3();
    let topics = ["joint", "cart", "zone", "nowhere"];
    let steps = found(&peer, SimlogVersion::V3, names.clone(), &topics, 5);
    let expected = ["joint 5: real", "cart 5: real", "zone 5: {at list of real, level real, near bool, zone text}"];
    assert_eq!(said(&steps)[..3], expected);
    assert_eq!(said(&steps)[3], "nowhere 0: the simulator has neither `SIM://nowhere/out` nor `SIM://nowhere/in`");
    let can_be_cut: Vec<_> = steps.facts.topics.iter().map(|topic| topic.can_be_cut).collect();
    assert_eq!(can_be_cut, [Some(true), Some(false), Some(false), Some(false)]);
    // Without a step it says what was last.
    let none = found(&peer, SimlogVersion::V3, names, &topics, 0);
    assert_eq!(said(&none)[0], "joint 0: real");
}
