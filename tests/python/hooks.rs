//! Metrics and operations in Python.

use sesame_base::observation::Outcome;
use sesame_record::Repository;

use crate::package::{CART, Place};

const HOOKS: &str = r"
import os, time, sesamec

@sesamec.metric
class TooClose:
    def on_clearance(self, clearance, ctx):
        if clearance < 0.5 and ctx.every_seconds(0.2):
            ctx.add()
            MISDEED

@sesamec.operation
class Bend:
    def on_command(self, command, parameters, ctx):
        return command + parameters.shift * ctx.draw(0.5, 1.0)
";

fn place(name: &str) -> Option<Place> {
    let place = Place::new(name, CART)?;
    place.change_space(
        "operation lose_commands  on command  = packet loss [0%, 100%]     within [0s, 20s]",
        "operation bend on command = custom { shift: real [-1m/s, 1m/s] }  within [0s, 20s]",
    );
    place.change_space("lose_commands", "bend");
    place.change_space(
        "metric too_close = duration(clearance < 0.5m)",
        "metric too_close: real default 0 { hook on clearance }",
    );
    Some(place)
}

#[test]
fn a_metric_and_an_operation_in_python_give_one_digest_on_any_number_of_workers() {
    let Some(place) = place("python_hooks") else { return };
    let hooks = HOOKS.replace("MISDEED", "pass");
    let digests = [1, 4]
        .map(|workers| place.run(&hooks, &format!("results='on-{workers}', workers={workers}")).expect(0).digest());
    assert_eq!(digests[0], digests[1]);
    let results = Repository::open(&place.folder.join("on-1/1")).unwrap();
    let last = results.numbers().unwrap().last().copied().unwrap();
    let values = |name: &str| -> Vec<f64> {
        let metric = results.plan().metrics.iter().position(|metric| metric.name == name).unwrap();
        let records = results.records(0..=last, false).unwrap();
        records.iter().filter_map(|record| record.observation.metrics.get(metric)?.value).collect()
    };
    assert!(values("too_close").iter().any(|&value| value > 5.0), "the hook counts");
}

#[test]
fn what_a_hook_does_wrong_is_the_outcome_of_its_test() {
    let Some(place) = place("python_hooks_wrong") else { return };
    for (misdeed, outcome) in [
        ("raise ValueError('boom')", "ValueError: boom in on_clearance (program.py, line"),
        ("ctx.set('much')", "TypeError: "),
        ("os._exit(7)", "the worker process ended: exit status: 7"),
    ] {
        place.run(&HOOKS.replace("MISDEED", misdeed), "results='wrong', evaluations=12").expect(0);
        let crashes = place.broken_off("wrong");
        let expected = |crash: &Outcome| crash.message().is_some_and(|message| message.contains(outcome));
        assert!(crashes.iter().any(expected), "{misdeed}: {crashes:?}");
        std::fs::remove_dir_all(place.folder.join("wrong")).unwrap();
    }
}

#[test]
fn a_hook_that_prints_or_forks_changes_no_result() {
    let Some(place) = place("python_hooks_quiet") else { return };
    let digests = ["pass", "print('hello', flush=True)", "os.fork()"].map(|misdeed| {
        let hooks = HOOKS.replace("MISDEED", misdeed);
        let run = place.run(&hooks, "results='quiet', evaluations=12").expect(0);
        std::fs::remove_dir_all(place.folder.join("quiet")).unwrap();
        assert!(!run.out.contains("hello"), "standard output is the caller's: {run:?}");
        run.digest()
    });
    assert_eq!([&digests[1], &digests[2]], [&digests[0]; 2]);
}
