//! A class in the processes of workers, and the same class as a program of its own.

use sesame_base::observation::Outcome;

use crate::package::{CART, Place};

#[test]
fn a_class_in_the_workers_comes_to_the_results_of_the_same_class_as_a_program_on_any_number_of_workers() {
    let Some(place) = Place::new("python_both_ways", CART) else { return };
    let program = place.run_as_program(&["--results", "program"]).expect(0).digest();
    for workers in [1, 4] {
        let run = place.run("", &format!("results='class-{workers}', workers={workers}"));
        assert_eq!(run.expect(0).digest(), program, "{workers} workers");
    }
}

#[test]
fn what_a_class_raises_is_the_crash_of_its_test_in_both_ways() {
    let raising = CART
        .replace("        self.speed +=", "        assert self.position < 9.8, \"the wall\"\n        self.speed +=");
    let Some(place) = Place::new("python_raises", &raising) else { return };
    let program = place.run_as_program(&["--results", "program"]).expect(0);
    let run = place.run("", "results='class'").expect(0);
    assert_eq!(run.digest(), program.digest());
    let crashes = place.broken_off("class");
    let place_of_it = "AssertionError: the wall in step (sim.py, line";
    let is_the_wall = |outcome: &Outcome| outcome.message().is_some_and(|crash| crash.contains(place_of_it));
    assert!(!crashes.is_empty() && crashes.iter().all(is_the_wall), "{crashes:?}");
}

#[test]
fn a_class_that_ends_its_process_or_hangs_takes_its_worker_with_it_and_nothing_else() {
    let ending = CART.replace(
        "        self.speed +=",
        "        if self.position > 9.8:\n            __import__(\"os\")._exit(7)\n        self.speed +=",
    );
    let Some(place) = Place::new("python_ends", &ending) else { return };
    place.run("", "results='ends', evaluations=12, workers=2").expect(0);
    let broken_off = place.broken_off("ends");
    let ended = |outcome: &Outcome| outcome.message().is_some_and(|crash| crash.contains("exit status: 7"));
    assert!(!broken_off.is_empty() && broken_off.iter().all(ended), "{broken_off:?}");
    let hanging = CART.replace(
        "        self.speed +=",
        "        if self.position > 9.8:\n            __import__(\"time\").sleep(1000)\n        self.speed +=",
    );
    place.write("cart/sim.py", &hanging);
    place.run("", "results='hangs', evaluations=12, workers=2, options=['--timeout', '1']").expect(0);
    let broken_off = place.broken_off("hangs");
    let hung = |outcome: &Outcome| matches!(outcome, Outcome::Timeout { .. });
    assert!(!broken_off.is_empty() && broken_off.iter().all(hung), "{broken_off:?}");
}
