"""Tests of the benchmark: its cases and problems, the judge's world, strategies and the table.

    python3 examples/bugs/test_bugs.py

With the variable SESAMEC, the path of the program, they also compare the judge's world with Sesame.
"""

import contextlib
import importlib.util
import io
import json
import os
import shutil
import sys
import tempfile
import unittest
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from random import Random
from unittest import mock

sys.path.insert(0, str(Path(__file__).resolve().parent))

import run as command
import when
from bugs.campaign import Job, Record, agrees, record_from, run
from bugs.case import PROBLEMS as PROBLEMS_FOLDER
from bugs.case import Case, TrueCause, cause, load_cases
from bugs.judge import Judge, minimal
from bugs.named import Named
from bugs.protocol import Bus, serve
from bugs.sesamec import CAMPAIGN, Trigger, plan_of, search
from bugs.space import Metric, Operation, Parameter, Requirement, Space, Test, Topic, Use, check_permitted, space_of
from bugs.strategies import MODULES, Problem, strategy_class
from bugs.table import as_csv, as_json, as_text, as_text_of_problems, rows
from bugs.world import Outcome, World

CASES = load_cases()
PROBLEMS = load_cases(folder=PROBLEMS_FOLDER)
ALL = CASES + PROBLEMS
SESAMEC = os.environ.get("SESAMEC")


class Cases(unittest.TestCase):
    """Every folder of `cases` and of `problems` is complete, and the causes that it lists are true."""

    def test_a_case_says_what_it_is(self):
        for case in CASES:
            with self.subTest(case.name):
                self.assertEqual(case.space.name, case.name)
                self.assertTrue(case.space_file.is_file())
                self.assertTrue(case.title and case.field and case.mechanism)
                self.assertTrue(case.reports and all(report.startswith("https://") for report in case.reports))
                self.assertIn(len(case.space.operations), range(6, 9))
                self.assertTrue(all(known.when for known in case.causes))

    def test_a_problem_says_what_it_is(self):
        for problem in PROBLEMS:
            with self.subTest(problem.name):
                self.assertEqual(problem.space.name, problem.name)
                self.assertTrue(problem.space_file.is_file())
                self.assertTrue(problem.title and problem.field and problem.mechanism)
                self.assertTrue(all(report.startswith("https://") for report in problem.reports))

    def test_a_change_of_a_model_that_problems_share_makes_their_results_old(self):
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(PROBLEMS_FOLDER, folder, dirs_exist_ok=True)
            before, shared = load_cases(folder=Path(folder))[0].fingerprint, Path(folder) / "transmission.py"
            self.assertEqual(before, PROBLEMS[0].fingerprint)
            shared.write_text(shared.read_text() + "# Another one.\n")
            self.assertNotEqual(before, load_cases(folder=Path(folder))[0].fingerprint)

    def test_the_campaign_is_a_search_of_120_tests(self):
        for case in ALL:
            with self.subTest(case.name):
                campaign = json.loads((case.folder / "plan.json").read_text())["campaign"]
                self.assertEqual((campaign["name"], campaign["search"]["evaluations"]), (CAMPAIGN, 120))

    def test_nothing_is_violated_without_a_disturbance(self):
        for case in ALL:
            with self.subTest(case.name):
                outcome = case.world().run(())
                self.assertEqual((outcome.violated, outcome.crash), (frozenset(), None))

    def test_what_requirements_read_is_published_in_every_step(self):
        for case in ALL:
            with self.subTest(case.name):
                reference = case.world().run((), keep_messages=True)
                steps = round(case.space.end * 1e9) // case.space.step
                for requirement in case.space.requirements.values():
                    formula = case.space.metrics[requirement.metric].formula
                    for number in {each["field"]["topic"] for each in formula["inputs"]}:
                        for path in case.space.topics[number].paths:
                            published = [each for each in reference.messages if each.topic == path]
                            self.assertEqual(len(published), steps, path)

    def test_a_case_has_causes(self):
        for case in CASES:
            with self.subTest(case.name):
                self.assertTrue(case.causes)

    def test_no_true_cause_contains_another(self):
        for case in ALL:
            with self.subTest(case.name):
                self.assertEqual(len(case.causes), len(case.true_causes))
                self.assertEqual(minimal(case.true_causes), case.true_causes)

    def test_the_operations_of_a_true_cause_violate_its_requirement_together_and_no_part_of_them_does(self):
        for case in ALL:
            with self.subTest(case.name):
                judge = Judge(case.world())
                for known in case.causes:
                    requirement, witness = known.cause.requirement, known.witness
                    self.assertIn(requirement, judge.outcome(witness).violated, known.cause)
                    for size in range(len(known.cause.operations)):
                        for part in combinations(known.cause.operations, size):
                            outcome = judge.outcome(tuple(use for use in witness if use.operation in part))
                            self.assertNotIn(requirement, outcome.violated, f"{known.cause}, {part}")
                    self.assertIn(known.cause, judge.causes(witness))

    def test_a_threshold_is_where_the_witness_begins_to_violate(self):
        for case in ALL:
            with self.subTest(case.name):
                world = case.world()
                for known in (known for known in case.causes if known.threshold is not None):
                    for violating in (True, False):
                        test = known.threshold.applied_to(known.witness, case.space, violating)
                        self.assertNotEqual(test, known.witness)
                        violated = known.cause.requirement in world.run(test).violated
                        self.assertEqual(violated, violating, f"{known.cause}, {test}")


class Protocol(unittest.TestCase):
    def test_a_simulator_says_the_same_over_the_line_and_in_the_world(self):
        for case in ALL:
            with self.subTest(case.name):
                world = case.world()
                expected = [[each.topic, _plain(each.value)] for each in world.run((), keep_messages=True).messages]
                runner = _Runner(case.space, world.simulator.subscribes)
                serve(world.simulator, runner, runner)
                self.assertEqual(runner.heard, expected)

    def test_an_exception_of_a_simulator_makes_its_test_a_crash(self):
        class Failing:
            subscribes = ()

            def __init__(self, seed: int, step: float) -> None:
                pass

            def step(self, time: float, bus: Bus) -> None:
                raise ValueError("no map")

        requests = io.StringIO(
            '{"reset": {"seed": 1, "step": 0.1, "topics": []}}\n{"step": {"time": 0.1, "messages": []}}\n'
        )
        answers = io.StringIO()
        serve(Failing, requests, answers)
        self.assertEqual(json.loads(answers.getvalue().splitlines()[1]), {"failed": "ValueError: no map"})


class _Runner:
    """The other side of the line: steps a simulator to the end, and delivers everything at once."""

    def __init__(self, space: Space, subscribes: tuple[str, ...]) -> None:
        self.space, self.subscribes = space, subscribes
        self.heard: list[list] = []
        self.late: list[dict] = []
        self.time = 0
        topics = [path for topic in space.topics for path in topic.paths]
        self.request: dict | None = {"reset": {"seed": 1, "step": space.step / 1e9, "topics": topics}}

    def readline(self) -> str:
        return "" if self.request is None else json.dumps(self.request)

    def write(self, line: str) -> None:
        ((kind, content),) = json.loads(line).items()
        if kind == "publish":
            self.request = {"deliver": self.passed(content)}
            return
        if kind == "done":
            self.late = self.passed(content["messages"])
        self.time += self.space.step
        over = self.time > round(self.space.end * 1e9)
        self.request = None if over else {"step": {"time": self.time / 1e9, "messages": self.late}}

    def flush(self) -> None:
        pass

    def passed(self, messages: list[dict]) -> list[dict]:
        self.heard += [[message["topic"], message["value"]] for message in messages]
        return [message for message in messages if message["topic"] in self.subscribes]


def _plain(value: object) -> object:
    """A value as it comes out of JSON."""
    return json.loads(json.dumps(value))


class Operations(unittest.TestCase):
    """What docs/language/operations.md says, of a publisher that counts every 0.1 s, and a subscriber that echoes."""

    def echoed(self, kind: dict, start: float, end: float, *choices: object, type_: str = "real") -> list:
        outcome = self.run_of(kind, start, end, *choices, type_=type_)
        return [message.value for message in outcome.messages if message.topic == "echo"]

    def run_of(
        self, kind: dict, start: float, end: float, *choices: object, type_: str = "real", trend: str | None = "rising"
    ) -> Outcome:
        space = _counting_space(kind, type_, trend)
        world = World(space, _Counter if type_ == "real" else _PointCounter)
        return world.run((Use("disturb", start, end, choices, 1),), keep_messages=True)

    def test_a_window_holds_from_its_beginning_until_before_its_end(self):
        self.assertEqual(self.echoed({"kind": "bias"}, 0.2, 0.4, 10.0)[:5], [0, 11, 12, 3, 4])

    def test_values_change_as_the_table_says(self):
        self.assertEqual(self.echoed({"kind": "scale"}, 0.0, 1.0, 3.0)[:3], [0, 3, 6])
        self.assertEqual(self.echoed({"kind": "stuck_at", "truth": None}, 0.0, 0.25, 7.0)[:3], [7, 7, 2])
        drifted = self.echoed({"kind": "drift"}, 0.15, 0.45, 10.0)[:5]
        self.assertEqual([round(value, 9) for value in drifted], [0, 1.5, 3.5, 5.5, 4])
        moved = self.echoed({"kind": "bias"}, 0.0, 0.15, (1.0, 2.0, 3.0), type_="point")
        self.assertEqual(moved[:2], [[1, 2, 3], [1, 0, 0]])

    def test_freeze_repeats_the_last_value_before_it_or_else_the_first(self):
        self.assertEqual(self.echoed({"kind": "freeze"}, 0.35, 0.55)[:6], [0, 1, 2, 2, 2, 5])
        self.assertEqual(self.echoed({"kind": "freeze"}, 0.0, 0.25)[:3], [0, 0, 2])

    def test_stale_takes_the_latest_value_of_that_age_or_else_the_first(self):
        self.assertEqual(self.echoed({"kind": "stale"}, 0.0, 0.75, 0.5)[:8], [0, 0, 0, 0, 0, 0, 1, 7])

    def test_losses_drop_messages(self):
        self.assertEqual(self.echoed({"kind": "blackhole"}, 0.15, 0.35)[:3], [0, 3, 4])
        kept = len(self.echoed({"kind": "packet_loss"}, 0.0, 10.0, 0.3))
        self.assertTrue(60 <= kept <= 80, kept)
        self.assertEqual(self.echoed({"kind": "rate_limit"}, 0.0, 10.0, 5.0)[:3], [0, 2, 4])

    def test_a_latency_keeps_the_order_and_its_tail_counts_by_its_drain(self):
        latency = {"kind": "latency", "distribution": "fixed"}
        finished = self.run_of({**latency, "drain": "finish"}, 1.0, 1.1, 5.0)
        self.assertEqual((finished.fuzzing_time, finished.effects), (5.0, (50,)))
        flushed = self.run_of({**latency, "drain": "flush"}, 1.0, 1.1, 5.0)
        self.assertAlmostEqual(flushed.fuzzing_time, 0.1)
        self.assertEqual(flushed.effects, (1,))
        self.assertEqual(self.echoed({**latency, "drain": "drop"}, 0.15, 0.35, 5.0)[:3], [0, 3, 4])
        self.assertEqual(self.echoed({**latency, "drain": "finish"}, 0.0, 10.0, 0.25)[:3], [0, 1, 2])

    def test_copies_follow_their_message(self):
        self.assertEqual(self.echoed({"kind": "duplicate"}, 0.0, 0.25, 2.0)[:7], [0, 0, 0, 1, 1, 1, 2])

    def test_later_messages_overtake_when_reordered(self):
        echoed = self.echoed({"kind": "reorder", "drain": "finish"}, 0.0, 8.0, 1.0)
        self.assertNotEqual(echoed, sorted(echoed))
        self.assertEqual(sorted(echoed), [float(number) for number in range(100)])

    def test_after_a_number_that_is_not_finite_only_what_cannot_improve_is_violated(self):
        for trend, violated in (("rising", {"R1"}), (None, set())):
            outcome = self.run_of({"kind": "not_finite", "number": "nan"}, 0.0, 1.0, trend=trend)
            self.assertEqual(outcome.violated, violated)


_PARAMETERS = {
    "bias": ("bias",), "scale": ("factor",), "stuck_at": ("value",), "drift": ("rate",), "stale": ("age",),
    "packet_loss": ("loss",), "rate_limit": ("rate",), "latency": ("delay",), "duplicate": ("copies",),
    "reorder": ("window",),
}  # fmt: skip


def _counting_space(kind: dict, type_: str, trend: str | None) -> Space:
    names = _PARAMETERS.get(kind["kind"], ())
    parameters = tuple(Parameter(name, None, "value", (0.0,), (100.0,), False, ()) for name in names)
    operation = Operation("disturb", kind, 0, ((),), parameters, 0.0, 10.0, 0.0, 10.0, 0, 0, True)
    highest = {
        "inputs": [{"field": {"topic": 1, "path": ["x"] if type_ == "point" else []}, "members": "min"}],
        "aggregate": {"kind": "max", "of": {"input": 0}},
    }
    return Space(
        name="counting", step=100_000_000, end=10.0, fewest=1, most=3,
        topics=(Topic("count", ("count",), {"kind": type_}), Topic("echo", ("echo",), {"kind": type_})),
        messages=(),
        operations={"disturb": operation},
        metrics={"highest": Metric("highest", highest, None, trend)},
        requirements={"R1": Requirement("R1", "It stays below 50", "highest", float("-inf"), False, 50.0, False)},
    )  # fmt: skip


class _Counter:
    subscribes = ("count",)

    def __init__(self, seed: int, step: float) -> None:
        self.count = 0.0

    def step(self, time: float, bus: Bus) -> None:
        bus.publish("count", self.number())
        self.count += 1.0
        for value in bus.take("count"):
            bus.publish("echo", value)

    def number(self) -> object:
        return self.count


class _PointCounter(_Counter):
    def number(self) -> object:
        return [self.count, 0.0, 0.0]


class Strategies(unittest.TestCase):
    def test_each_asks_for_tests_that_the_space_permits(self):
        for name in self.each():
            for case in CASES:
                for test in self.asked(name, case, seed=1):
                    self.assertIn(len(test), range(case.space.fewest, case.space.most + 1))
                    for use in test:
                        check_permitted(use, case.space.operations[use.operation])

    def test_the_seed_decides_what_a_strategy_asks_for(self):
        for name in self.each():
            one, again, other = (self.asked(name, CASES[0], seed) for seed in (1, 1, 2))
            self.assertEqual(one, again)
            self.assertNotEqual(one, other)

    def each(self) -> Iterator[str]:
        """The strategies whose packages are installed."""
        for name in [*MODULES, OWN]:
            with self.subTest(name):
                package = {"nsga2": "pymoo", "tpe": "optuna"}.get(name)
                if package is not None and importlib.util.find_spec(package) is None:
                    self.skipTest(f"{package} is not installed")
                yield name

    def asked(self, name: str, case: Case, seed: int) -> list[Test]:
        """The first tests of a strategy that is told made-up outcomes: more than one generation."""
        luck = Random(seed)
        margins = dict.fromkeys(case.space.requirements, 1.0)
        reference = Outcome({}, margins, frozenset(), (), 0.0)
        strategy = strategy_class(name)(Problem(case.space, reference, 30), seed)
        asked = []
        for _ in range(30):
            asked.append(strategy.ask())
            told = {requirement: luck.uniform(-1.0, 1.0) for requirement in margins}
            strategy.tell(asked[-1], replace(reference, margins=told, fuzzing_time=luck.random()))
        return asked

    def test_a_strategy_of_your_own_runs_and_comes_out_the_same_each_time(self):
        folder = CASES[0].folder
        records = [run(Job(OWN, folder.name, 3, 30), folder, None) for _ in range(2)]
        self.assertEqual(*(replace(record, seconds=0.0) for record in records))
        self.assertEqual(record_from(json.loads(json.dumps(records[0].as_json()))), records[0])


OWN = f"{Path(__file__).resolve().parent / 'own_strategy.py'}:StrongestFirst"


class WhatIsNamed(unittest.TestCase):
    def test_each_cause_that_is_named_is_one_by_the_judge_of_a_test_that_ran(self):
        several = 0
        for case in CASES[::4]:
            with self.subTest(case.name):
                judge, named, judged = Judge(case.world()), Named(case.space), set()
                reference = judge.world.run((), keep_messages=True)
                strategy = strategy_class("combinatorial")(Problem(case.space, reference, 40), 1)
                for _ in range(40):
                    # What attributes a violation: the test without each of its operations.
                    test = strategy.ask()
                    names = {use.operation for use in test}
                    parts = [tuple(use for use in test if use.operation != left_out) for left_out in names]
                    for each in [test, *(part for part in parts if part)]:
                        named.add(each, judge.outcome(each))
                        judged |= judge.causes(each)
                    self.assertLessEqual(named.causes(), judged)
                several += sum(len(each.operations) > 1 for each in named.causes())
        self.assertGreater(several, 0)

    def test_a_set_of_which_fewer_were_not_tried_is_not_named(self):
        case, _ = _case_with("a", {"b", "c"})
        operations = list(case.space.operations)[:2]
        both = tuple(Use(name, 0.0, 1.0, (), 1) for name in operations)
        requirement = next(iter(case.space.requirements))
        named, whole = Named(case.space), cause(requirement, set(operations))

        def outcome(test: Test, violated: set[str]) -> Outcome:
            return Outcome({}, {}, frozenset(violated), tuple(1 for _ in test), 1.0)

        named.add(both, outcome(both, {requirement}))
        self.assertEqual(named.causes(), set())
        named.add(both[:1], outcome(both[:1], set()))
        self.assertEqual(named.causes(), set())
        elsewhere = (replace(both[1], start=0.5),)
        named.add(elsewhere, outcome(elsewhere, set()))
        self.assertEqual(named.causes(), set(), "in another window it says nothing about this one")
        named.add(both[1:], outcome(both[1:], set()))
        self.assertEqual(named.causes(), {whole})


class WhenOperationsHaveToAct(unittest.TestCase):
    def test_a_description_decides_by_the_times_of_the_run(self):
        def deciding(rule: str, *spans: tuple[float, float], least: float = 0.0) -> list[bool]:
            decides = {"rule": rule, "least": least, "spans": [{"start": a, "end": b} for a, b in spans]}
            trigger = Trigger("late", 0, "has to act", decides)
            return [trigger.violates(*window) for window in [(1.0, 2.0), (1.5, 3.0), (2.0, 6.0)]]

        self.assertEqual(deciding("always"), [True, True, True])
        self.assertEqual(deciding("contains", (2.0, 2.0)), [False, True, True], "a window ends before its end")
        self.assertEqual(deciding("contains", (1.0, 2.0), (4.0, 5.0)), [True, False, True])
        self.assertEqual(deciding("overlaps", (0.0, 1.75)), [True, True, False])
        self.assertEqual(deciding("overlaps", (0.0, 1.75), least=0.5), [True, False, False])
        self.assertEqual(deciding("begins", (1.5, 2.0)), [False, True, False])
        self.assertEqual(deciding("ends", (2.5, 6.0)), [False, True, True])

    def test_the_windows_of_the_judge_are_permitted(self):
        for case in CASES:
            with self.subTest(case.name):
                for use in {use.operation: use for true in case.causes for use in true.witness}.values():
                    tried = when.windows(case, (use,), use, Random(1))
                    self.assertEqual(len(tried), when.WINDOWS)
                    for start, end in tried:
                        check_permitted(replace(use, start=start, end=end), case.space.operations[use.operation])


class Table(unittest.TestCase):
    def test_it_counts_true_causes_and_those_that_tests_bear_out(self):
        case, known = _case_with("a", {"b", "c"})
        record = Record(
            "mine", case.name, 1, 120, "", "", violating=[30, 50, 90], without_effect=[1, 2, 3],
            found=[("R1", ("a",), 30), ("R1", ("b", "c"), 90), ("R1", ("b", "d"), 95)],
            named=[("R1", ("a", "d"), 30, 50), ("R1", ("a",), 50, 121), ("R1", ("b", "c", "d"), 90, 121)],
            differing=[], named_otherwise=[], seconds=1.0,
        )  # fmt: skip
        (row,) = rows([record], [case], early=40)
        self.assertEqual((row.true_causes, row.causes_early, row.causes, row.unlisted), (2, 1.0, 2.0, 1.0))
        self.assertEqual((row.any_early, row.any, row.first, row.without_effect), (1.0, 1.0, 30.0, 3 / 120))
        self.assertEqual((row.named_early, row.named), (0.0, 1.0))
        self.assertEqual(row.precision, 0.5, "`a` alone is true, and with `b` and `c` a third one is named")
        self.assertEqual(row.causes_interval, (2.0, 2.0))
        self.assertIn("mine", as_text([row], [case]))
        self.assertEqual(json.loads(as_json([row]))[0]["causes"], 2.0)
        self.assertIn("causes_early_low", as_csv([row]).splitlines()[0])

    def test_of_problems_it_shows_the_first_violation_in_the_median(self):
        problem = PROBLEMS[0]
        records = [
            Record("mine", problem.name, seed, 120, "", "", violating, [], [], [], [], [], 1.0)
            for seed, violating in enumerate([[7, 9], [30], [50], []])
        ]
        table = rows(records, [problem], early=40)
        self.assertEqual((table[0].any_early, table[0].any, table[0].first_median), (0.5, 0.75, 40.0))
        line = as_text_of_problems(table, [problem]).splitlines()[-1]
        self.assertEqual(line.split(), [problem.name, "mine", "50%", "75%", "40", "0%"])
        missed = rows(records[3:], [problem], early=40)
        self.assertIn("none", as_text_of_problems(missed, [problem]))

    def test_what_is_finished_is_not_run_again(self):
        with tempfile.TemporaryDirectory() as folder:
            arguments = ["random", "--cases", CASES[0].name, "--seeds", "1-2", "--tests", "5", "--early", "5"]
            arguments += ["--workers", "1", "--out", folder]
            outputs = []
            for _ in range(2):
                output = io.StringIO()
                with contextlib.redirect_stdout(output), contextlib.redirect_stderr(io.StringIO()):
                    self.assertEqual(command.main(arguments), 0)
                outputs.append(output.getvalue())
            self.assertEqual(*outputs)
            self.assertEqual(len((Path(folder) / "random.jsonl").read_text().splitlines()), 2)

    def test_published_results_stand_in_the_table_and_are_not_run_again(self):
        case, silent = CASES[0].name, contextlib.redirect_stdout(io.StringIO())
        with tempfile.TemporaryDirectory() as folder, silent, contextlib.redirect_stderr(io.StringIO()):
            published = mock.patch.multiple(command, PUBLISHED=Path(folder) / "published", PUBLISHED_SEEDS=range(1, 2))
            with published, mock.patch.object(command, "load_cases", return_value=[CASES[0]]):
                few = ["--tests", "5", "--early", "5"]
                first = ["--out", str(Path(folder) / "first"), "--workers", "1", "--seeds", "1", *few]
                self.assertEqual(command.main(["random", OWN, *first]), 0)
                self.assertEqual(command.main(["--publish", *first]), 0)
                self.assertEqual([file.name for file in (Path(folder) / "published").iterdir()], ["random.jsonl.gz"])
                with mock.patch.object(command, "run", side_effect=AssertionError("nothing is to be run")):
                    command.main(["random", "--published", "--out", str(Path(folder) / "second"), *few])
                records = json.loads((Path(folder) / "second" / "table.json").read_text())
                self.assertEqual([(row["strategy"], row["case"], row["seeds"]) for row in records], [("random", case, 1)])

    def test_published_results_are_of_these_cases(self):
        for file in command.PUBLISHED.iterdir():
            with self.subTest(file=file.name):
                store = command.Store(command.PUBLISHED, CASES)
                name = file.name.removesuffix(".jsonl.gz")
                found = {job for job in store.records if command.file_name(job.strategy) == name}
                self.assertEqual(len(found), len(CASES) * len(command.PUBLISHED_SEEDS), "run it again, and publish it")

    def test_seeds_are_numbers_and_ranges(self):
        self.assertEqual(command.seeds("1-3,9,2"), [1, 2, 3, 9])


def _case_with(*causes: str | set[str]) -> tuple[Case, list[TrueCause]]:
    """A case that knows these causes of R1."""
    known = [TrueCause(cause("R1", {each} if isinstance(each, str) else each), "always", (), None) for each in causes]
    return replace(CASES[0], causes=tuple(known)), known


@unittest.skipUnless(SESAMEC, "the variable SESAMEC does not name the program, so nothing is compared with Sesame")
class WithSesame(unittest.TestCase):
    """The judge's world and the real program."""

    def test_the_plan_of_a_case_is_that_of_its_space(self):
        for case in ALL:
            with self.subTest(case.name):
                plan = json.loads((case.folder / "plan.json").read_text())
                now = plan_of(Path(SESAMEC), case.space_file)
                self.assertEqual(space_of(plan), space_of(now), "run `run.py --update-plans`")

    def test_recorded_values_and_verdicts_are_those_of_the_world(self):
        for case in ALL:
            with self.subTest(case.name):
                for recorded in search(Path(SESAMEC), case.space_file, case.space, 1, 40, "random").tests:
                    outcome = case.world(recorded.simulator_seed).run(recorded.test)
                    self.assertTrue(agrees(recorded, outcome), f"T{recorded.number} {recorded}, {outcome.values}")
                    violated = {name for name, verdict in recorded.verdicts.items() if verdict == "violated"}
                    self.assertEqual(outcome.violated, violated, f"T{recorded.number} {recorded}")


if __name__ == "__main__":
    unittest.main()
