//! Searches for those who run tests themselves. The judge is `sesamec run`: told the same of the same tests, a search
//! asks for the same tests.

use sesame_tests::done;

use crate::package::{CART, Place};
use crate::results::examples;

/// A campaign whose operations always find messages: what a search learns of messages it cannot be told.
fn place(name: &str) -> Option<Place> {
    let place = Place::new(name, CART)?;
    place.change_space("within [0s, 20s]\n/// Some", "within [0s, 20s] for [1s, 8s]\n/// Some");
    place.change_space("packet loss [0%, 100%]     within [0s, 20s]", "packet loss [0%, 100%] for [1s, 8s]");
    Some(place)
}

/// What a recorded run had of each test.
const RECORDED: &str = r#"
import sqlite3, sesamec
from sim import World

class Recorded:
    def __init__(self, **options):
        self.run = sesamec.run("cart/cart.sesame", simulator=World, results="recorded", **options)
        self.results = sqlite3.connect(self.run.path)

    def rows(self, query, test):
        return self.results.execute(query, (test.number,)).fetchall()

    def metrics(self, test):
        return dict(self.rows("SELECT name, value FROM metric_values JOIN metrics ON id = metric WHERE test = ?", test))

    def outcome(self, test):
        return self.rows("SELECT outcome FROM tests WHERE number = ?", test)[0][0]

    def windows(self, test):
        return self.rows("SELECT operation, start_s, end_s FROM operations WHERE test = ? ORDER BY position", test)

def windows(test):
    return [(used.operation, used.start_s, used.end_s) for used in test.operations]
"#;

#[test]
fn a_search_that_is_told_what_a_run_has_seen_asks_for_the_tests_of_that_run() {
    for search in ["random {", "nsga2 { population 10 ", "nsga3 { population 10 ", "falsification {"] {
        let Some(place) = place("python_search") else { return };
        place.change_space("interleaved {", search);
        let program = RECORDED.to_owned()
            + r#"
recorded = Recorded(evaluations=30)
with sesamec.Search("cart/cart.sesame", results="asked", evaluations=30, deterministic=True) as search:
    for test in search:
        assert windows(test) == recorded.windows(test), test
        search.tell(test, recorded.metrics(test), outcome=recorded.outcome(test))
    assert search.finished and search.run.front("records") == recorded.run.front("records")
    assert len(search.run.tests("records")) == len(recorded.run.tests("records")) >= 30
"#;
        done(&mut place.python(&program)).expect(0);
    }
}

#[test]
fn results_may_come_in_any_order_and_a_search_that_was_broken_off_goes_on() {
    let Some(place) = place("python_search_order") else { return };
    place.change_space("interleaved {", "nsga2 { population 10 ");
    let program = RECORDED.to_owned()
        + r#"
recorded = Recorded(evaluations=30)
settings = dict(deterministic=True, results="asked", evaluations=30)
counts = []
while True:
    with sesamec.Search("cart/cart.sesame", **settings) as search:
        for generation in range(2):
            together = []
            while (test := search.ask()) is not None:
                together.append(test)
            counts.append(len(together))
            for test in reversed(together):
                assert windows(test) == recorded.windows(test), test
                search.tell(test, recorded.metrics(test), outcome=recorded.outcome(test))
        if search.finished or search.ask() is None:
            break
    settings = dict(deterministic=True, resume="asked/1")
assert search.run.front("records") == recorded.run.front("records")
# The reference run, three generations, and the last reference run: each generation was asked for at once.
assert counts[0] == 1 and counts[1] == 10 and sum(counts) == 32, counts
"#;
    done(&mut place.python(&program)).expect(0);
}

#[test]
fn what_cannot_be_a_result_is_refused_with_what_it_lacks() {
    let Some(place) = place("python_search_refused") else { return };
    let program = r#"
import sesamec
search = sesamec.Search("cart/cart.sesame", results="refused")
test = search.ask()
for words, tell in [
    ("lacks `too_close`", lambda: search.tell(test, {"closest": 1.0})),
    ("no metric `closst` (did you mean `closest`?)", lambda: search.tell(test, {"closst": 1.0})),
    ("metric `closest` of T0 is nan", lambda: search.tell(test, {"closest": float("nan"), "too_close": 0.0})),
    ("`crashed` is not an outcome (did you mean `crash`?)", lambda: search.tell(test, outcome="crashed")),
]:
    try:
        tell()
    except ValueError as error:
        assert words in str(error), error
    else:
        raise AssertionError(words)
assert search.ask() is None and not search.finished, "nothing comes before T0 is told"
search.tell(test, {"closest": 9.0, "too_close": 0.0})
try:
    search.tell(test, {"closest": 9.0, "too_close": 0.0})
except ValueError as error:
    assert "T0 was told already" in str(error), error
test = search.ask()
search.tell(test, outcome="crash", message="the arm stopped")
search.close()
run = sesamec.open_run("refused/1")
assert run["T1"].outcome == "crash", run["T1"].outcome
"#;
    done(&mut place.python(program)).expect(0);
}

#[test]
fn the_examples_of_the_page_on_searches_run() {
    let Some(place) = place("python_search_examples") else { return };
    let before = "import os\nos.chdir('cart')\ndef carried_out(test):\n    return {'closest': 1.0, 'too_close': 0.0}\n";
    let program = before.to_owned() + &examples("python-search.md", "python").concat();
    done(&mut place.python(&program)).expect(0);
}
