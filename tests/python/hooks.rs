//! Metrics and operations in Python.

use std::fs;
use std::process::Stdio;

use sesame_patience::until;
use sesame_peers::Ended;
use sesame_record::Repository;
use sesame_tests::{command, done, fresh_folder, sesamec};

use crate::package::{CART, Place, results};

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

/// The cart, with a metric and an operation that are hooks.
fn place(name: &str, simulator: &str) -> Option<Place> {
    let place = Place::new(name, simulator)?;
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

fn good() -> String {
    HOOKS.replace("MISDEED", "pass")
}

#[test]
fn hooks_give_one_digest_in_process_and_as_a_file_on_any_number_of_workers() {
    let Some(place) = place("python_hooks", CART) else { return };
    let mut digests = Vec::new();
    for workers in ["1", "4"] {
        let arguments = format!("results='on-{workers}', workers={workers}");
        digests.push(place.run(&good(), &arguments).expect(0).digest());
    }
    place.write("cart/cart_hooks.py", &good());
    for workers in ["1", "4"] {
        // The class with the file's hooks, the program with the file's hooks, and all of it from Python.
        digests.push(place.run("", &format!("results='file-{workers}', workers={workers}")).expect(0).digest());
        let alone = place.command_on("cart.sesame", &["--results", &format!("alone-{workers}"), "--workers", workers]);
        digests.push(alone.expect(0).digest());
    }
    let around = "import sesamec\nprint('Digest', sesamec.run('cart/cart.sesame', results='around').digest)\n";
    digests.push(done(&mut place.python(around)).expect(0).digest());
    assert!(digests.iter().all(|digest| *digest == digests[0]), "{digests:?}");
    let results = results(&place, "on-1/1");
    let metric = results.repository.plan().metrics.iter().position(|metric| metric.name == "too_close").unwrap();
    let values = results.records.iter().filter_map(|record| record.observation.metrics.get(metric)?.value);
    assert!(values.into_iter().any(|value| value > 5.0), "the hook counts");
}

#[test]
fn a_function_is_an_operation_as_a_class_is() {
    let Some(place) = place("python_hooks_function", CART) else { return };
    place.write("cart/cart_hooks.py", &good());
    let class = place.command_on("cart.sesame", &["--results", "class"]).expect(0).digest();
    let function =
        good().replace("@sesamec.operation\nclass Bend:\n    def on_command(self, ", "@sesamec.operation\ndef bend(");
    let function = function.replace("        return command", "    return command");
    assert_ne!(function, good());
    place.write("cart/cart_hooks.py", &function);
    assert_eq!(place.command_on("cart.sesame", &["--results", "function"]).expect(0).digest(), class);
}

#[test]
fn what_a_hook_does_wrong_is_the_outcome_of_its_test() {
    let Some(place) = place("python_hooks_wrong", CART) else { return };
    let class = "    def on_command(self, command, parameters, ctx):\n        return command";
    for (part, by, outcome) in [
        ("MISDEED", "raise ValueError('boom')", "ValueError: boom in on_clearance (cart_hooks.py, line 9)"),
        ("MISDEED", "ctx.set('much')", "TypeError: "),
        ("MISDEED", "os._exit(7)", "the worker process ended: exit status: 7"),
        ("MISDEED", "clearance.metres", "AttributeError: 'float' object has no attribute 'metres'"),
        ("return command", "return None and command", "`on_command` has to return the message, also if it does not"),
        ("return command", "return 'fast' or command", "expected real, found text"),
        ("return command", "return [1.0] or command", "expected real, found a list"),
        (
            class,
            "    def on_command(self, command, parameters, ctx):\n        ctx.inject('x')\n        return command",
            "it cannot be injected: expected real, found text",
        ),
    ] {
        assert!(HOOKS.contains(part), "{part}");
        place.write("cart/cart_hooks.py", &HOOKS.replace(part, by).replace("MISDEED", "pass"));
        place.command_on("cart.sesame", &["--results", "wrong", "--evaluations", "12"]);
        let crashes = results(&place, "cart/wrong/1").crashes;
        assert!(crashes.iter().any(|crash| crash.contains(outcome)), "{by}: {crashes:?}");
        if by.starts_with("raise") {
            let logs = place.folder.join("cart/wrong/1/workers");
            let logs = fs::read_dir(logs).unwrap().map(|worker| worker.unwrap().path().join("output.log"));
            let logs: String = logs.map(|log| fs::read_to_string(log).unwrap_or_default()).collect();
            assert!(logs.contains("Traceback (most recent call last)") && logs.contains("raise ValueError"), "{logs}");
        }
        fs::remove_dir_all(place.folder.join("cart/wrong")).unwrap();
    }
}

#[test]
fn a_hook_that_hangs_is_a_timeout_and_the_campaign_goes_on() {
    let Some(place) = place("python_hooks_hang", CART) else { return };
    place.write("cart/cart_hooks.py", &HOOKS.replace("MISDEED", "time.sleep(1000)"));
    let arguments = ["--results", "hang", "--evaluations", "6", "--timeout", "1", "--workers", "2"];
    let run = place.command_on("cart.sesame", &arguments);
    let results = results(&place, "cart/hang/1");
    assert_eq!(results.records.len(), 8, "{run:?}");
    assert!(run.out.contains("timeout"), "{run:?}");
}

#[test]
fn a_hook_that_reads_not_a_number_is_warned_of() {
    let Some(place) = place("python_hooks_nan", CART) else { return };
    place.write("cart/cart_hooks.py", &HOOKS.replace("MISDEED", "ctx.set(float('nan'))"));
    let run = place.command_on("cart.sesame", &["--results", "nan", "--evaluations", "6"]).expect(0);
    assert!(run.out.contains("metric `too_close`: refused the value NaN at"), "{run:?}");
}

#[test]
fn a_hook_that_prints_or_forks_changes_no_result() {
    let Some(place) = place("python_hooks_quiet", CART) else { return };
    for file in [false, true] {
        let digests = ["pass", "print('hello', flush=True)", "os.fork()"].map(|misdeed| {
            let hooks = HOOKS.replace("MISDEED", misdeed);
            let run = if file {
                place.write("cart/cart_hooks.py", &hooks);
                place.command_on("cart.sesame", &["--results", "../quiet", "--evaluations", "12"]).expect(0)
            } else {
                place.run(&hooks, "results='quiet', evaluations=12").expect(0)
            };
            fs::remove_dir_all(place.folder.join("quiet")).unwrap();
            assert!(!run.out.contains("hello"), "standard output is the caller's: {run:?}");
            run.digest()
        });
        assert_eq!([&digests[1], &digests[2]], [&digests[0]; 2], "{file}");
    }
}

#[test]
fn what_is_wrong_with_the_file_of_hooks_is_said_before_anything_runs() {
    let Some(place) = place("python_hooks_refused", CART) else { return };
    for (part, by, said) in [
        (
            "import os",
            "import nowhere, os",
            "ModuleNotFoundError: No module named 'nowhere' in <module> (cart_hooks.py, line 2)",
        ),
        ("if clearance", "if clearance <", "cart_hooks.py:7: "),
        ("import os", "import sys; sys.exit(3)\nimport os", "SystemExit: 3"),
        (
            "class TooClose",
            "class TooClos",
            "registers metric `too_clos`, but the space has no such metric with a hook: did you mean `too_close`?",
        ),
        (
            "class Bend",
            "class Other",
            "registers operation `other`, but the space has no such custom operation: it declares `bend`",
        ),
        ("on_clearance", "on_clearence", "needs a method `on_clearance(self, message, ctx)`, and has `on_clearence`"),
        ("command, parameters, ctx", "command, ctx", "`Bend.on_command` has to take `message`, `parameters`, `ctx`"),
        ("@sesamec.operation\n", "", "operation `bend` has no hook in Python: register it in cart_hooks.py"),
        ("@sesamec.metric\n", "@sesamec.before_start\n", "`@sesamec.before_start` is for functions"),
    ] {
        assert!(good().contains(part), "{part}");
        place.write("cart/cart_hooks.py", &good().replace(part, by));
        for command in [&["run", "cart.sesame"][..], &["replay", "cart.sesame", "T1"]] {
            let run = done(&mut place.sesamec(command)).expect(1);
            assert!(run.err.contains(said), "{command:?} {by}: {run:?}");
            assert!(!run.err.contains("panicked") && !run.err.contains("Traceback"), "{run:?}");
        }
        assert!(!place.folder.join("cart/runners/first/results").exists(), "{by}");
    }
    // In a program as well.
    let run = place.run("", "evaluations=4");
    assert!(run.err.contains("Failed: ") && run.err.contains("is for functions"), "{run:?}");
}

#[test]
fn without_the_package_it_is_said_which_python_lacks_it() {
    let Some(place) = place("python_hooks_bare", CART) else { return };
    place.write("cart/cart_hooks.py", &good());
    let mut run = place.sesamec(&["run", "cart.sesame"]);
    let run = done(run.env_remove("PYTHONPATH")).expect(1);
    assert!(run.err.contains("`pip install sesamec==") && run.err.contains("No module named"), "{run:?}");
    let mut run = place.sesamec(&["run", "cart.sesame"]);
    let run = done(run.env("SESAMEC_PYTHON", "/nowhere/python")).expect(1);
    assert!(run.err.contains("/nowhere/python: No such file"), "{run:?}");
}

#[test]
fn commands_that_call_hooks_without_workers_say_so() {
    let Some(place) = place("python_hooks_recording", CART) else { return };
    place.write("cart/cart_hooks.py", &good());
    place.write("cart/some.mcap", "");
    let replayed = done(&mut place.sesamec(&["replay-recording", "cart.sesame", "some.mcap"])).expect(1);
    assert!(replayed.err.contains("cart_hooks.py is Python, which runs in workers"), "{replayed:?}");
}

#[test]
fn a_python_beside_files_that_are_called_like_its_modules_imports_its_own() {
    let Some(place) = place("python_hooks_shadowed", CART) else { return };
    place.write("cart/cart_hooks.py", &good());
    for name in ["json.py", "socket.py", "sesamec.py"] {
        place.write(name, "raise SystemExit(9)\n");
    }
    let mut run = place.sesamec(&["run", "cart/cart.sesame", "--", "--evaluations", "4"]);
    let package = fresh_folder("python_hooks_shadowed_package");
    sesame_tests::copy(&place.folder.join("sesamec"), &package.join("sesamec"));
    done(run.current_dir(&place.folder).env("PYTHONPATH", package)).expect(0);
}

#[test]
fn hooks_of_one_campaign_are_not_in_two_languages() {
    let Some(place) = place("python_hooks_mixed", CART) else { return };
    done(&mut place.sesamec(&["generate", "cart.sesame"])).expect(0);
    let filled = "impl Bend { fn on_command(&mut self) { let _ = 1; } }";
    place.write("cart/cart_hooks.py", &good());
    // Stubs do not count.
    place.command_on("cart.sesame", &["--results", "stubs", "--evaluations", "4"]).expect(0);
    place.write("cart/runners/hooks/bend.rs", filled);
    let both = place.command_on("cart.sesame", &[]).expect(1);
    let said =
        "`bend` has a hook in Python, in cart_hooks.py, and another in Rust, in runners/hooks/bend.rs: remove one";
    assert!(both.err.contains(said), "{both:?}");
    let (metric, _) = HOOKS.split_once("@sesamec.operation").unwrap();
    place.write("cart/cart_hooks.py", &metric.replace("MISDEED", "pass"));
    let mixed = place.command_on("cart.sesame", &[]).expect(1);
    let said = "Rust has `bend` in runners/hooks/bend.rs, and cart_hooks.py has `too_close`";
    assert!(mixed.err.contains(said), "{mixed:?}");
}

#[cfg(unix)]
#[test]
fn a_run_with_hooks_that_is_stopped_goes_on_with_resume() {
    let slow =
        CART.replace("        self.speed +=", "        __import__(\"time\").sleep(0.0005)\n        self.speed +=");
    let Some(place) = place("python_hooks_stopped", &slow) else { return };
    place.write("cart/cart_hooks.py", &good());
    let whole = place.command_on("cart.sesame", &["--results", "whole", "--evaluations", "20"]).expect(0).digest();
    let mut run = place.sesamec(&["run", "cart.sesame", "--", "--evaluations", "20"]);
    let mut run = Ended(run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    let folder = place.folder.join("cart/runners/first/results/1");
    until("some tests are recorded", || {
        Repository::open(&folder).is_ok_and(|results| results.numbers().is_ok_and(|all| all.len() > 4))
    });
    done(command("kill").args(["-INT", &run.0.id().to_string()]));
    until("it has ended", || run.0.try_wait().unwrap().is_some());
    let resumed = done(&mut place.sesamec(&["resume", "cart.sesame"])).expect(0);
    assert_eq!(resumed.digest(), whole);
    // Other commands start the same workers.
    let replayed = done(&mut place.sesamec(&["replay", "cart.sesame", "T5"])).expect(0);
    assert!(replayed.out.contains("bit for bit") || replayed.out.contains("same"), "{replayed:?}");
}

#[test]
fn agents_get_the_hooks_with_the_folder_of_the_space() {
    let Some(place) = place("python_hooks_agents", CART) else { return };
    place.write("cart/cart_hooks.py", &good());
    let here = place.command_on("cart.sesame", &["--results", "here", "--evaluations", "12"]).expect(0).digest();
    let queue = fresh_folder("python_hooks_queue");
    let (queue, token) = (queue.join("queue"), queue.join("token"));
    fs::write(&token, "5e".repeat(32)).unwrap();
    fs::create_dir(&queue).unwrap();
    let mut agent = command(sesamec());
    agent.arg("agent").arg(&queue).arg("--token").arg(&token).env("PYTHONPATH", &place.folder);
    let _agent = Ended(agent.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    let mut run = place.sesamec(&["run", "cart.sesame"]);
    run.arg("--on").arg(&queue).arg("--token").arg(&token).args(["--", "--results", "../there", "--evaluations", "12"]);
    assert_eq!(done(&mut run).expect(0).digest(), here);
}
