//! Types and stubs of hooks that `sesamec generate --python` writes.

use std::fs;
use std::process::Command;

use sesame_tests::{Done, command, copy, done, fresh_folder, sesamec, workspace};

use crate::package::{CART, Place, results};

/// A carrier with every kind of field, names that Python cannot have, and hooks of every kind.
const SPACE: &str = r#"/// A carrier of pallets.
space carrier

system {
  simulator yard = process "python3" "sim.py" { step 50ms }

  /// Where something is.
  message Pose { place: point[m]  heading: real[rad] }
  /// What a "carrier" does; see C:\hall.
  message State {
    constant PARKED = 2
    constant SLOW   = 0.5
    /// Its class.
    class: text
    from: Pose
    /// The way behind it.
    way: list of Pose
    self: int
    loaded: bool
    optional note: text
  }
  topic state = "hall/{A,B}/state" : State
  topic go    = "hall/go"          : real[m/s]

  node hall { subscribes state, go   publishes state, go }
}

/// How far a carrier went.
metric far: real[m] maximise default 0m { hook on state, go }
metric length minimise = fuzzing_time()

/// Moves a carrier on paper.
operation displace on state = custom { by: real[m] [1m, 2m]   mode: one of "up", "down" } within [0s, 2s]
operation prepare = custom before start { file: file one of "hall.yaml" }
operation tidy    = custom after end { }

campaign first {
  objectives far, length
  operations displace, prepare, tidy   1..3 per test
  activate   by time
  search     random { evaluations 12  seed 1 }
  end        after 2s
}
"#;

const SIMULATOR: &str = r#"
import sesamec


class World:
    publishes = ["hall/A/state", "hall/B/state", "hall/go"]
    subscribes = ["hall/A/state", "hall/go"]

    def __init__(self, setup):
        self.x = 0.0

    def step(self, bus):
        bus.publish("hall/go", 1.0)
        for path in ("hall/A/state", "hall/B/state"):
            pose = {"place": [self.x, 0.0, 0.0], "heading": 0.0, "frame": "map"}
            state = {"class": "agv", "from": pose, "way": [pose, pose], "self": 7, "loaded": True, "more": [1, 2]}
            bus.publish(path, state)
        for topic, value, _ in bus.messages():
            if topic == "hall/A/state":
                assert value["more"] == [1, 2] and value["class"] in ("agv", "displaced"), value
                assert value["from"]["frame"] == "map" and value["way"][0]["frame"] == "map", value
                assert value["class"] == "agv" or value["note"] == "by a test", value
        self.x += bus.step


if __name__ == "__main__":
    sesamec.serve(World)
"#;

const HOOKS: &str = r#"
from __future__ import annotations

import sesamec

import carrier_types


@sesamec.metric("far")
class Far(carrier_types.FarHook):
    def on_state(self, state: carrier_types.State, ctx: sesamec.MetricContext) -> None:
        assert ctx.topic in ("hall/A/state", "hall/B/state")
        assert isinstance(state, carrier_types.State) and isinstance(state.from_, carrier_types.Pose)
        assert state.class_ == "agv" and state.self_ == 7 and state.loaded and state.note is None
        length = state.from_.place[0] + sum(pose.heading for pose in state.way)
        ctx.set(length if ctx.value is None else max(ctx.value, length))

    def on_go(self, go: float, ctx: sesamec.MetricContext) -> None:
        assert go == 1.0


@sesamec.operation
class Displace(carrier_types.DisplaceHook):
    def on_state(
        self,
        state: carrier_types.State,
        parameters: carrier_types.DisplaceParameters,
        ctx: sesamec.OperationContext[carrier_types.State],
    ) -> carrier_types.State:
        assert isinstance(parameters, carrier_types.DisplaceParameters) and parameters.mode in ("up", "down")
        state.from_.place[0] += parameters.by
        state.way.append(carrier_types.Pose(place=[1.0, 2.0, 3.0], heading=0.5))
        state.class_, state.note = "displaced", "by a test"
        return state


@sesamec.before_start
def prepare(parameters: carrier_types.PrepareParameters, ctx: sesamec.RunContext) -> None:
    ctx.edit_file(parameters.file, lambda text: text.replace("1", "2"))


@sesamec.after_end
def tidy(parameters: carrier_types.TidyParameters, ctx: sesamec.RunContext) -> None:
    ctx.count_side_effect()
"#;

fn carrier(name: &str) -> Option<Place> {
    let place = Place::new(name, "")?;
    place.write("cart/carrier.sesame", SPACE);
    place.write("cart/sim.py", SIMULATOR);
    place.write("cart/hall.yaml", "speed: 1\n");
    Some(place)
}

fn generate(place: &Place, arguments: &[&str]) -> Done {
    let mut command = command(sesamec());
    done(
        command.args(["generate", "--python", "carrier.sesame"]).args(arguments).current_dir(place.folder.join("cart")),
    )
}

fn read(place: &Place, file: &str) -> String {
    fs::read_to_string(place.folder.join("cart").join(file)).expect("a file that was generated")
}

#[test]
fn hooks_get_objects_of_the_generated_classes_and_what_they_do_not_know_is_passed_on() {
    let Some(place) = carrier("python_stubs_typed") else { return };
    generate(&place, &[]).expect(0);
    place.write("cart/carrier_hooks.py", HOOKS);
    let typed = place.command_on("carrier.sesame", &["--results", "typed"]).expect(0);
    assert_eq!(results(&place, "cart/typed/1").crashes, [""; 0]);
    // The same hooks on objects without classes.
    let untyped =
        HOOKS.replace("isinstance(state, carrier_types.State) and isinstance(state.from_, carrier_types.Pose)", "True");
    let untyped = untyped.replace("isinstance(parameters, carrier_types.DisplaceParameters) and ", "");
    let untyped = untyped
        .replace("state.note is None", "not hasattr(state, 'note')")
        .replace("import carrier_types\n", "import types as carrier_types\n");
    let untyped = untyped.replace("carrier_types.Pose(", "carrier_types.SimpleNamespace(");
    let untyped = ["FarHook", "DisplaceHook"]
        .iter()
        .fold(untyped, |text, base| text.replace(&format!("(carrier_types.{base})"), ""));
    place.write("cart/carrier_hooks.py", &untyped);
    let untyped = place.command_on("carrier.sesame", &["--results", "untyped"]).expect(0);
    assert_eq!(results(&place, "cart/untyped/1").crashes, [""; 0]);
    assert_eq!(typed.digest(), untyped.digest());
}

#[test]
fn stubs_run_and_say_that_they_are_not_filled_in() {
    let Some(place) = carrier("python_stubs_unfilled") else { return };
    let generated = generate(&place, &[]).expect(0);
    let types = read(&place, "carrier_types.py");
    assert!(types.contains("    PARKED: ClassVar[int] = 2\n    SLOW: ClassVar[float] = 0.5\n"), "{types}");
    assert!(generated.err.contains("Stub carrier_hooks.py: fill this in"), "{generated:?}");
    let refused = place.command_on("carrier.sesame", &["--results", "refused"]).expect(1);
    assert!(
        refused.err.contains("the hook of `far` is not filled in yet, and the campaign is to optimise it"),
        "{refused:?}"
    );
    assert!(refused.err.contains("fill it in: carrier_hooks.py"), "{refused:?}");
    let run = place.command_on("carrier.sesame", &["--results", "unfilled", "--allow-unimplemented"]);
    for name in ["metric `far`", "operation `displace`", "operation `prepare`", "operation `tidy`"] {
        assert!(run.err.contains(&format!("warning: the hook of {name} is not filled in yet")), "{name}: {run:?}");
    }
}

#[test]
fn a_hook_is_never_touched_again_and_what_has_changed_is_said() {
    let Some(place) = carrier("python_stubs_again") else { return };
    generate(&place, &[]).expect(0);
    place.write("cart/carrier_hooks.py", HOOKS);
    let again = generate(&place, &[]).expect(0);
    assert!(
        again.err.contains("Kept carrier_hooks.py") && again.err.contains("carrier_types.py, unchanged"),
        "{again:?}"
    );
    generate(&place, &["--check"]).expect(0);
    let changed = SPACE
        .replace("loaded: bool", "loaded: real[kg]")
        .replace("metric length", "metric fast: real default 0 { hook on go }\nmetric length");
    let changed = changed.replace("objectives far, length", "objectives far, length\n  observes   fast");
    place.write("cart/carrier.sesame", &changed);
    let check = generate(&place, &["--check"]).expect(1);
    assert!(check.err.contains("carrier_types.py is out of date"), "{check:?}");
    assert!(check.err.contains("generate --python carrier.sesame`"), "{check:?}");
    let preview = generate(&place, &["--dry-run"]).expect(0);
    assert!(preview.out.contains("-    loaded: bool") && preview.out.contains("+    loaded: float"), "{preview:?}");
    // Before it is generated again, a run says so.
    let outdated = place.command_on("carrier.sesame", &[]).expect(1);
    assert!(outdated.err.contains("no hook in Python"), "{outdated:?}");
    let told = generate(&place, &[]).expect(0);
    for part in [
        "the inputs of the hooks of `carrier` have changed; adapt carrier_hooks.py:",
        "- State.loaded: bool",
        "+ State.loaded: float in kg",
        "carrier_hooks.py has no hook of `fast`; add:",
        "@sesamec.metric(\"fast\")",
    ] {
        assert!(told.err.contains(part), "{part}: {told:?}");
    }
    assert_eq!(read(&place, "carrier_hooks.py"), HOOKS);
    // A generated file that was edited stops everything.
    let types = read(&place, "carrier_types.py");
    place.write("cart/carrier_types.py", &types.replace("heading: float", "heading: int"));
    let refused = generate(&place, &[]).expect(1);
    assert!(refused.err.contains("generated files were edited by hand, so nothing was written"), "{refused:?}");
    generate(&place, &["--force"]).expect(0);
    assert_eq!(read(&place, "carrier_types.py"), types);
    assert_eq!(read(&place, "carrier_hooks.py"), HOOKS);
}

#[test]
fn a_hook_that_lacks_a_method_of_its_class_is_refused_before_anything_runs() {
    let Some(place) = carrier("python_stubs_lacking") else { return };
    generate(&place, &[]).expect(0);
    place.write("cart/carrier_hooks.py", &HOOKS.replace("def on_go", "def on_stop"));
    let run = place.command_on("carrier.sesame", &[]).expect(1);
    assert!(
        run.err.contains("the hook of `far` cannot be used: TypeError: Can't instantiate abstract class Far"),
        "{run:?}"
    );
    assert!(run.err.contains("on_go"), "{run:?}");
}

#[test]
fn a_message_with_a_field_that_the_space_does_not_declare_is_the_crash_of_its_test() {
    let Some(place) = carrier("python_stubs_misspelt") else { return };
    generate(&place, &[]).expect(0);
    for (returned, said) in [
        (
            "state.loadad = True; return state",
            "AttributeError: 'State' object has no attribute 'loadad' in on_state (carrier_hooks.py",
        ),
        (
            "return {**{'class': 'x', 'from': state.from_, 'way': [], 'self': 1, 'loaded': True}, 'lode': 1}",
            "message `State` has no field `lode`: it has class_, from_, way, self_, loaded, note",
        ),
        (
            "return {'class': 'x'}",
            "`on_state` has to return the message, also if it does not change it: field `from`: expected a value, found nothing",
        ),
    ] {
        place
            .write("cart/carrier_hooks.py", &HOOKS.replace("        return state\n", &format!("        {returned}\n")));
        place.command_on("carrier.sesame", &["--results", "misspelt"]);
        let crashes = results(&place, "cart/misspelt/1").crashes;
        assert!(crashes.iter().any(|crash| crash.contains(said)), "{returned}: {crashes:?}");
        fs::remove_dir_all(place.folder.join("cart/misspelt")).unwrap();
    }
}

#[test]
fn classes_of_another_version_of_the_space_are_refused() {
    let Some(place) = carrier("python_stubs_outdated") else { return };
    generate(&place, &[]).expect(0);
    place.write("cart/carrier_hooks.py", HOOKS);
    place.write("cart/carrier.sesame", &SPACE.replace("loaded: bool", "loaded: bool  weight: real[kg]"));
    let run = place.command_on("carrier.sesame", &[]).expect(1);
    let sentence = "the class `State` of message `State` is of another version of the space: run `sesamec generate \
                    --python carrier.sesame`";
    assert!(run.err.contains(sentence), "{run:?}");
}

/// Programs with the package that check types: mypy and pyright.
fn checkers(place: &Place) -> Option<[Command; 2]> {
    let python = sesame_peers::named("SESAME_PYTHON_PEERS")?;
    let folder = sesame_peers::named("SESAME_PYRIGHT")?;
    let paths = std::env::join_paths([place.folder.clone(), place.folder.join("cart")]).expect("no colon");
    let mut mypy = command(&python);
    mypy.args(["-m", "mypy", "--strict", "--python-version", "3.10", "--cache-dir", ".mypy_cache"])
        .env("MYPYPATH", paths);
    let mut pyright = command(folder.join("node_modules/.bin/pyright"));
    pyright.args(["--pythonversion", "3.10", "--pythonpath"]).arg(&python);
    let settings = r#"{"strict": ["*_types.py", "*_hooks.py"], "reportMissingModuleSource": false}"#;
    fs::write(place.folder.join("cart/pyrightconfig.json"), settings).expect("a file can be written");
    copy(&place.folder.join("sesamec"), &place.folder.join("cart/sesamec"));
    Some([mypy, pyright])
}

#[test]
fn type_checkers_pass_what_is_generated_and_what_fills_it_in() {
    let Some(place) = carrier("python_stubs_checked") else { return };
    let Some([mut mypy, mut pyright]) = checkers(&place) else { return };
    let cart = place.folder.join("cart");
    let mut modules = vec!["carrier_types.py".to_owned(), "carrier_hooks.py".to_owned(), "sesamec".to_owned()];
    generate(&place, &[]).expect(0);
    place.write("cart/carrier_hooks.py", HOOKS);
    // Every space of the language's corpus whose hooks have stubs.
    for entry in fs::read_dir(workspace().join("sesame-dsl/tests/good")).unwrap() {
        let file = entry.unwrap().path();
        let text = fs::read_to_string(&file).unwrap_or_default();
        if file.extension().is_none_or(|it| it != "sesame") || !(text.contains("hook on") || text.contains("= custom"))
        {
            continue;
        }
        let name = file.file_name().unwrap().to_str().unwrap().to_owned();
        let mut generate = command(sesamec());
        let generated = done(generate.args(["generate", "--python", "-o"]).arg(&cart).arg(&file));
        if generated.err.contains("has no campaign") {
            continue;
        }
        generated.expect(0);
        let stem = name.trim_end_matches(".sesame");
        modules.extend([format!("{stem}_types.py"), format!("{stem}_hooks.py")]);
    }
    assert!(modules.len() > 8, "{modules:?}");
    let modules: Vec<&String> = modules.iter().filter(|module| cart.join(module).exists()).collect();
    let checked = done(mypy.args(&modules).current_dir(&cart));
    assert!(checked.out.contains("Success"), "{checked:?}");
    let checked = done(pyright.args(&modules).current_dir(&cart));
    assert!(checked.out.lines().any(|line| line.starts_with("0 errors, 0 warnings")), "{checked:?}");
}

#[test]
fn a_type_checker_refuses_a_hook_that_returns_something_else_and_a_field_that_a_message_lacks() {
    let Some(place) = carrier("python_stubs_refused") else { return };
    let Some([mut mypy, _]) = checkers(&place) else { return };
    generate(&place, &[]).expect(0);
    let wrong = HOOKS
        .replace(") -> carrier_types.State:", ") -> str:")
        .replace("        return state\n", "        return 'state'\n");
    let wrong = wrong.replace("state.loaded and", "state.loadad and");
    place.write("cart/carrier_hooks.py", &wrong);
    let refused = done(mypy.arg("carrier_hooks.py").current_dir(place.folder.join("cart")));
    for part in ["Return type \"str\" of \"on_state\" incompatible with return type \"State\"", "loadad"] {
        assert!(refused.out.contains(part), "{part}: {refused:?}");
    }
}

#[test]
fn what_people_write_in_a_space_cannot_break_out_of_a_docstring() {
    let Some(place) = carrier("python_stubs_hostile") else { return };
    let hostile = SPACE
        .replace("/// Its class.", "/// \"\"\" + __import__('os').abort() + \"\"\" \\")
        .replace("/// A carrier of", "/// \\\" \"");
    place.write("cart/carrier.sesame", &hostile);
    generate(&place, &[]).expect(0);
    let mut python = place.with_package("python3");
    let compiled =
        done(python.args(["-W", "error", "-c", "import carrier_types"]).current_dir(place.folder.join("cart")));
    compiled.expect(0);
    let folder = fresh_folder("python_stubs_elsewhere");
    let mut elsewhere = command(sesamec());
    done(
        elsewhere
            .args(["generate", "--python", "carrier.sesame", "-o"])
            .arg(&folder)
            .current_dir(place.folder.join("cart")),
    )
    .expect(0);
    assert!(folder.join("carrier_types.py").is_file());
}

/// The blocks of Python on the page that register hooks.
fn examples_of_hooks() -> Vec<String> {
    let page = fs::read_to_string(workspace().join("docs/python.md")).expect("a page of the documentation");
    let blocks = page.split("```python\n").skip(1).map(|block| block.split("```").next().expect("its text").to_owned());
    blocks.filter(|block| block.contains("\n@sesamec.") || block.starts_with("@sesamec.")).collect()
}

#[test]
fn the_examples_of_the_page_run_and_those_with_types_are_checked() {
    let Some(place) = Place::new("python_stubs_page", CART) else { return };
    let examples = examples_of_hooks();
    let [metric, functions, class] = &examples[..] else { panic!("{examples:?}") };
    place.change_space(
        "operation lose_commands  on command  = packet loss [0%, 100%]     within [0s, 20s]",
        "operation bend on command = custom { shift: real [-1m/s, 1m/s] }  within [0s, 20s]\n\
         operation bad_calibration = custom before start { }",
    );
    place.change_space("lose_commands", "bend, bad_calibration");
    place.change_space(
        "metric too_close = duration(clearance < 0.5m)",
        "metric close_calls: real default 0 { hook on clearance }",
    );
    place.change_space("too_close", "close_calls");
    place.write("cart/calibration.txt", "1\n");
    done(&mut place.sesamec(&["generate", "--python", "cart.sesame"])).expect(0);
    let (_, offline) = functions.split_once("\n\n\n").unwrap();
    let with_class = format!("{metric}\n\n{class}\n\n{offline}");
    let digests = [format!("{metric}\n\n{functions}"), with_class.clone()].map(|hooks| {
        place.write("cart/cart_hooks.py", &hooks);
        let run = place.command_on("cart.sesame", &["--results", "page", "--evaluations", "12"]).expect(0);
        assert_eq!(results(&place, "cart/page/1").crashes, [""; 0]);
        fs::remove_dir_all(place.folder.join("cart/page")).unwrap();
        run.digest()
    });
    assert_eq!(digests[0], digests[1]);
    let Some([mut mypy, mut pyright]) = checkers(&place) else { return };
    let class = class.trim_start_matches("import sesamec\n");
    place.write("cart/cart_hooks.py", &format!("{metric}\n\n{class}"));
    let checked = done(mypy.arg("cart_hooks.py").current_dir(place.folder.join("cart")));
    assert!(checked.out.contains("Success"), "{checked:?}");
    let checked = done(pyright.arg("cart_hooks.py").current_dir(place.folder.join("cart")));
    assert!(checked.out.lines().any(|line| line.starts_with("0 errors, 0 warnings")), "{checked:?}");
}
