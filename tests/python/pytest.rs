//! Regression tests and requirements of spaces in pytest.

use std::fs;
use std::path::PathBuf;

use sesame_peers::named;
use sesame_tests::{Done, command, done, sesamec, workspace};

use crate::package::{CART, Place};
use crate::results::examples;

/// A place with pytest in a folder of its own beside the space, where `conftest.py` names the class.
struct Tested {
    place: Place,
    python: PathBuf,
}

/// A test that violates R1, and expects what it measures.
const KEPT: &str = "
test hits_wall {
  shift_position offset [-1m, -1m] from 0s to 20s seed 715914100568602699
  simulator seed 14585738166641528246
  expect closest == 0m
  expect too_close in [15s, 20s]  // about
}
";

const CONFTEST: &str = "
import sys, pathlib
sys.path.insert(0, str(pathlib.Path(__file__).parent))
from sim import World

def pytest_sesame_simulator(path):
    return World if path.name == 'cart.sesame' else None
";

impl Tested {
    fn new(name: &str) -> Option<Self> {
        let python = named("SESAME_PYTHON_PEERS")?;
        let place = Place::new(name, CART)?;
        place.write("cart/conftest.py", CONFTEST);
        Some(Tested { place, python })
    }

    fn keep(&self, test: &str) {
        let space = self.space();
        self.place.write("cart/cart.sesame", &format!("{space}{test}"));
    }

    fn space(&self) -> String {
        fs::read_to_string(self.place.folder.join("cart/cart.sesame")).expect("a project has a space")
    }

    /// Runs pytest in the project's folder.
    fn pytest(&self, arguments: &[&str]) -> Done {
        let mut pytest = self.place.with_package(&self.python);
        pytest.args(["-m", "pytest", "-p", "sesamec._pytest", "-rA", "--color=no"]).args(arguments);
        done(pytest.env("COLUMNS", "300").current_dir(self.place.folder.join("cart")))
    }
}

#[test]
fn a_space_is_collected_where_it_is_named_and_nowhere_else() {
    let Some(tested) = Tested::new("pytest_collects") else { return };
    tested.keep(KEPT);
    let items = "cart.sesame::known::hits_wall\ncart.sesame::first::R1\n";
    let collected = |arguments: &[&str]| tested.pytest(&[&["--collect-only", "-q"], arguments].concat());
    assert!(collected(&["cart.sesame"]).expect(0).out.starts_with(items));
    assert!(collected(&["--sesame", "*.sesame"]).expect(0).out.starts_with(items));
    assert!(collected(&["--sesame", "cart.sesame", "."]).expect(0).out.starts_with(items));
    assert!(collected(&["."]).expect(5).out.contains("no tests collected"));
    assert!(collected(&["--sesame", "other/*.sesame"]).expect(5).out.contains("no tests collected"));
    assert!(
        collected(&["cart.sesame", "--sesame-campaign", "second"]).expect(0).out.starts_with("cart.sesame::known::")
    );
    let seeded = collected(&["cart.sesame", "--sesame-seeds", "1,22"]).expect(0).out;
    assert!(seeded.contains("cart.sesame::first::R1[22]\n") && seeded.contains("4 tests collected"), "{seeded}");
    assert!(collected(&["cart.sesame", "-m", "not sesame_campaign"]).expect(0).out.contains("1/2 tests collected"));
    tested.place.write("cart/pytest.ini", "[pytest]\nsesame_files = *.sesame\n");
    assert!(collected(&[]).expect(0).out.starts_with(items));
}

#[test]
fn what_a_campaign_finds_fails_with_the_sentence_of_the_report_and_becomes_a_test_by_the_command_it_names() {
    let Some(tested) = Tested::new("pytest_finds") else { return };
    let found = tested.pytest(&["cart.sesame", "--junitxml", "junit.xml"]).expect(1);
    let cache = tested.place.folder.join("cart/.pytest_cache/d/sesame/cart/first/1");
    let page = fs::read_to_string(cache.join("report.html")).unwrap();
    let sentence = found.out.lines().find(|line| line.starts_with("R1: ")).expect("a sentence");
    let (before, _) = sentence.split_once(" in T").expect("the worst test");
    assert!(page.contains(before) && before.contains("of 80 tests violate it"), "{sentence}");
    let command = |begins: &str| {
        let line = found.out.lines().map(str::trim).find(|line| line.starts_with(begins));
        line.unwrap_or_else(|| panic!("no {begins}: {}", found.out)).to_owned()
    };
    let run = |line: String| {
        let line = line.replacen("sesamec", &sesamec().display().to_string(), 1);
        done(command_of_shell(&line).current_dir(tested.place.folder.join("cart"))).expect(0)
    };
    assert!(run(command("sesamec show")).out.contains("R1"));
    run(command("sesamec export"));
    assert!(tested.space().contains("\ntest first_T"), "{}", tested.space());
    let kept = tested.pytest(&["cart.sesame", "-k", "known", "--junitxml", "known.xml"]).expect(1);
    assert!(kept.out.contains("closest is 0 m, expected is ≥ 0.5 m"), "{}", kept.out);
    for (file, case) in [("junit.xml", "first::R1"), ("known.xml", "known::first_T")] {
        let text = fs::read_to_string(tested.place.folder.join("cart").join(file)).unwrap();
        let junit = roxmltree::Document::parse(&text).unwrap();
        let cases: Vec<_> = junit.descendants().filter(|node| node.has_tag_name("testcase")).collect();
        let named = |node: &roxmltree::Node<'_, '_>| {
            format!("{}::{}", node.attribute("classname").unwrap(), node.attribute("name").unwrap()).contains(case)
        };
        assert!(cases.len() == 1 && named(&cases[0]), "{text}");
        assert!(cases[0].children().any(|node| node.has_tag_name("failure")), "{text}");
    }
}

fn command_of_shell(line: &str) -> std::process::Command {
    let mut shell = command("sh");
    shell.args(["-c", line]);
    shell
}

#[test]
fn expectations_hold_with_the_class_are_updated_on_demand_and_those_of_requirements_never() {
    let Some(tested) = Tested::new("pytest_updates") else { return };
    tested.keep(KEPT);
    tested.pytest(&["cart.sesame", "-k", "known"]).expect(0);
    let right = tested.space();
    let wrong = right.replace("expect closest == 0m", "expect closest >= 3m").replace("[15s, 20s]", "[1s, 2s]");
    tested.place.write("cart/cart.sesame", &wrong.replace("[1s, 2s]", "[15s, 20s]"));
    let unmet = tested.pytest(&["cart.sesame", "-k", "known"]).expect(1);
    assert!(unmet.out.contains("hits_wall: closest is 0 m, expected is ≥ 3 m"), "{}", unmet.out);
    assert!(unmet.out.contains("FAILED cart.sesame::known::hits_wall"), "{}", unmet.out);
    tested.place.write("cart/cart.sesame", &wrong.replace("[1s, 2s]", "[15s, 20s]"));
    let updated = tested.pytest(&["cart.sesame", "-k", "known", "--sesame-update"]).expect(0);
    assert!(updated.out.contains("sesame: updated hits_wall in "), "{}", updated.out);
    assert_eq!(tested.space(), right, "one line has changed, and nothing else");
    let demands = right.replace("expect closest == 0m", "expect R1");
    tested.place.write("cart/cart.sesame", &demands);
    let unmet = tested.pytest(&["cart.sesame", "-k", "known", "--sesame-update"]).expect(1);
    assert!(unmet.out.contains("expected is ≥ 0.5 m"), "{}", unmet.out);
    assert_eq!(tested.space(), demands);
    let both = tested.pytest(&["cart.sesame", "--sesame-update", "--sesame-seeds", "1"]).expect(4);
    assert!(both.err.contains("--sesame-seeds cannot be given"), "{both:?}");
    let words = tested.pytest(&["cart.sesame", "--sesame-seeds", "1,x"]).expect(4);
    assert!(words.err.contains("--sesame-seeds takes whole numbers"), "{words:?}");
}

#[test]
fn a_regression_test_runs_in_the_first_campaign_that_can_run_it() {
    let Some(tested) = Tested::new("pytest_campaigns") else { return };
    let shorter = "campaign shorter {\n  objectives closest\n  operations lose_commands 1 per test\n  activate by time\n  \
                   search random { evaluations 4 }\n  end after 20s\n}\n/// Searches for";
    tested.place.change_space("/// Searches for", shorter);
    tested.keep(KEPT);
    let run = tested.pytest(&["cart.sesame", "-k", "known"]).expect(0);
    assert!(run.out.contains("PASSED cart.sesame::known::hits_wall"), "{}", run.out);
    let requirements = tested.pytest(&["cart.sesame", "--collect-only", "-q", "-m", "sesame_campaign"]).expect(0).out;
    assert!(requirements.starts_with("cart.sesame::shorter::R1\ncart.sesame::first::R1\n"), "{requirements}");
}

#[test]
fn each_seed_is_an_item_of_its_own_and_runs_the_campaign_with_it() {
    let Some(tested) = Tested::new("pytest_seeds") else { return };
    tested.keep(KEPT);
    let arguments = ["cart.sesame", "--sesame-seeds", "1,2", "--sesame-evaluations", "8", "--sesame-results", "kept"];
    let run = tested.pytest(&arguments);
    for item in ["known::hits_wall[1]", "known::hits_wall[2]"] {
        assert!(run.out.contains(&format!("PASSED cart.sesame::{item}")), "{}", run.out);
    }
    for seed in ["1", "2"] {
        assert!(run.out.contains(&format!(" cart.sesame::first::R1[{seed}]")), "{}", run.out);
        let kept = tested.place.folder.join(format!("cart/kept/cart/first-{seed}/{seed}"));
        assert!(kept.join("report.html").is_file(), "{}", kept.display());
    }
}

#[test]
fn a_space_with_errors_shows_the_message_of_the_compiler() {
    let Some(tested) = Tested::new("pytest_errors") else { return };
    tested.place.change_space("packet loss", "paket loss");
    let broken = tested.pytest(&["cart.sesame"]).expect(2);
    let message = done(command(sesamec()).args(["check", "cart.sesame"]).current_dir(tested.place.folder.join("cart")));
    let message = message.expect(1).err;
    assert!(message.contains("help: did you mean `packet`?"));
    for line in message.lines().filter(|line| !line.contains("cart.sesame")) {
        assert!(broken.out.contains(line), "{line}: {}", broken.out);
    }
    assert!(!broken.out.contains("Traceback"), "{}", broken.out);
}

#[test]
fn a_simulator_that_fails_is_a_message_and_not_a_traceback_of_the_plugin() {
    let Some(tested) = Tested::new("pytest_fails") else { return };
    tested.place.write(
        "cart/sim.py",
        &CART.replace("    def step(self, bus):\n", "    def step(self, bus):\n        boom()\n"),
    );
    let failed = tested.pytest(&["cart.sesame"]).expect(1);
    assert!(failed.out.contains("NameError: name 'boom' is not defined in step (sim.py, line"), "{}", failed.out);
    assert!(!failed.out.contains("_pytest.py"), "{}", failed.out);
}

#[test]
fn ordinary_tests_run_campaigns_with_a_class() {
    let Some(tested) = Tested::new("pytest_ordinary") else { return };
    let test = "
import sesamec, pytest
from sim import World

class Careful(World):
    def step(self, bus):
        super().step(bus)
        self.position = min(self.position, 8.0)

@pytest.mark.parametrize('seed', [1, 2])
@pytest.mark.parametrize('simulator, violated', [(World, True), (Careful, False)])
def test_keeps_away_from_the_wall(simulator, violated, seed, tmp_path):
    run = sesamec.run('cart.sesame', simulator=simulator, seed=seed, evaluations=20, results=tmp_path)
    assert bool(run.requirements('records')[0]['violated']) == violated
";
    tested.place.write("cart/test_cart.py", test);
    let run = tested.pytest(&[]).expect(0);
    assert!(run.out.contains("4 passed"), "{}", run.out);
}

#[test]
fn the_examples_of_the_page_on_pytest_run() {
    let Some(tested) = Tested::new("pytest_examples") else { return };
    let [conftest, test] = <[String; 2]>::try_from(examples("pytest.md", "python")).unwrap();
    let settings = examples("pytest.md", "toml").concat();
    tested.place.write("cart/conftest.py", &conftest);
    tested.place.write("cart/test_cart.py", &test);
    tested.place.write("cart/pyproject.toml", &settings);
    let run = tested.pytest(&["-p", "no:cacheprovider"]).expect(1);
    assert!(run.out.contains("2 passed") && run.out.contains("1 failed"), "{}", run.out);
    let all = tested.pytest(&["cart.sesame"]).expect(1);
    let page = fs::read_to_string(workspace().join("docs/pytest.md")).unwrap();
    let (_, shown) = page.split_once("```text\n").unwrap();
    for line in shown.split("```").next().unwrap().lines() {
        let line = line.split(" …").next().unwrap();
        assert!(all.out.contains(line), "the page shows {line}\n{}", all.out);
    }
}
