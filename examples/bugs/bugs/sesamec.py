"""The real program: plans of spaces, and searches of whole campaigns, whose recorded tests are judged like any others.

Only what a test contains is used: operations, windows, choices and seeds. Recorded values serve to compare the judge's
world with Sesame.
"""

import json
import sqlite3
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from bugs.case import Cause, cause
from bugs.space import Choice, Space, Test, Use

CAMPAIGN = "find_causes"

# What follows `search STRATEGY` for strategies other than that of the case, besides the number of tests.
SETTINGS = {"nsga2": "population 20", "nsga3": "population 20", "map_elites": "population 20"}


class SesamecFailed(Exception):
    """The program ended with an error; the message has its last lines."""


@dataclass(frozen=True)
class Recorded:
    """A test that Sesame ran, and what it recorded."""

    number: int
    test: Test
    values: Mapping[str, float | None]  # of metrics
    verdicts: Mapping[str, str]  # of requirements: satisfied, violated or inconclusive
    simulator_seed: int


@dataclass(frozen=True)
class Searched:
    """What Sesame did in a search, and what it concludes from that."""

    tests: list[Recorded]  # in order
    causes: set[Cause]  # those that it names: not those of which it says that fewer operations were not tried


@dataclass(frozen=True)
class ShrunkThreshold:
    """Where a parameter of a shrunk test begins to matter, by what Sesame saw."""

    operation: str
    position: int  # of the operation in the test
    parameter: str
    fails: float  # the mildest value that violates the requirement
    passes: float  # the strongest one that does not


@dataclass(frozen=True)
class Trigger:
    """When an operation of a shrunk test has to act, by what Sesame saw."""

    operation: str
    position: int  # of the operation in the test
    text: str | None  # in words; `None` if Sesame does not describe it
    decides: Mapping | None  # the same without words

    def violates(self, start: float, end: float) -> bool:
        """Whether the test violates the requirement with this window, as the description has it."""
        spans = [(span["start"], span["end"]) for span in self.decides["spans"]]
        match self.decides["rule"]:
            case "always":
                return True
            case "contains":
                return any(start <= a + 1e-9 and (end >= b - 1e-9 if a < b else end > b) for a, b in spans)
            case "overlaps":
                least = self.decides["least"]
                return any(min(end, b) - max(start, a) > max(least - 1e-9, 0) for a, b in spans)
            case "begins":
                return any(a - 1e-9 <= start < b for a, b in spans)
            case "ends":
                return any(a < end <= b + 1e-9 for a, b in spans)
            case other:
                raise SesamecFailed(f"nobody knows what `{other}` means")


@dataclass(frozen=True)
class Shrunk:
    """The smallest test of a cause, shrunk."""

    requirement: str
    test: Test
    thresholds: list[ShrunkThreshold]  # of parameters that are single numbers
    triggers: list[Trigger]  # if they were asked for


def plan_of(sesamec: Path, space_file: Path) -> dict:
    """The plan of a space's campaign `find_causes`."""
    with tempfile.TemporaryDirectory() as folder:
        _run(sesamec, "generate", str(space_file.resolve()), "--campaign", CAMPAIGN, "--out", folder)
        return json.loads((Path(folder) / CAMPAIGN / "campaign.plan.json").read_text(encoding="utf-8"))


def search(
    sesamec: Path, space_file: Path, space: Space, seed: int, tests: int, strategy: str | None = None
) -> Searched:
    """Runs the campaign `find_causes`, or the same campaign with another strategy."""
    with tempfile.TemporaryDirectory() as name:
        folder, file, campaign = Path(name), space_file.resolve(), CAMPAIGN
        if strategy is not None:
            file, campaign = _with_strategy(file, strategy, tests, folder), f"{CAMPAIGN}_by_{strategy}"
        results = _searched(sesamec, file, campaign, seed, tests, folder)
        return Searched(read_results(results, space), causes_of(sesamec, results))


def _searched(sesamec: Path, file: Path, campaign: str, seed: int, tests: int, folder: Path) -> Path:
    """Runs a campaign, with everything that it writes in a folder, and returns its results file."""
    _run(
        sesamec, "run", str(file), "--campaign", campaign, "--out", str(folder / "runners"),
        "--", "--seed", str(seed), "--evaluations", str(tests), "--workers", "1",
        "--results", str(folder / "results"), "--fail-on", "nothing",
    )  # fmt: skip
    return folder / "results" / str(seed) / "results.sqlite"


def shrunk_causes(
    sesamec: Path, space_file: Path, space: Space, seed: int, tests: int, options: Sequence[str] = ()
) -> list[Shrunk]:
    """Runs the campaign `find_causes` and shrinks the smallest test of each cause, with further options of `shrink`."""
    with tempfile.TemporaryDirectory() as name:
        folder, file = Path(name), space_file.resolve()
        results = _searched(sesamec, file, CAMPAIGN, seed, tests, folder)
        if not causes_of(sesamec, results):
            return []
        run = results.parent
        said = _run(
            sesamec, "shrink", str(file), "--campaign", CAMPAIGN, "--out", str(folder / "runners"), "--violations",
            "--results", str(run), "--into", str(run.parent), "--workers", "1", "--format", "json", *options,
        )  # fmt: skip
        shrunk = read_results(run.parent / "shrink-violations" / "results.sqlite", space)
        ran = {test.number: test for test in shrunk}
        shrinkings = [each for each in json.loads(said)["shrinkings"] if each["after"] is not None]
        return [_shrunk(each, ran[each["after"]["number"]].test) for each in shrinkings]


def _shrunk(said: Mapping, test: Test) -> Shrunk:
    thresholds = [
        ShrunkThreshold(
            each["operation"], each["position"], each["parameter"], each["fails"]["value"], each["passes"]["value"]
        )
        for each in said["thresholds"]
        if each["fails"]["kind"] == "value"
    ]
    triggers = [
        Trigger(each["operation"], each["position"], each["text"], each["decides"]) for each in said.get("when", ())
    ]
    return Shrunk(said["fails"].removeprefix("violates "), test, thresholds, triggers)


def causes_of(sesamec: Path, results: Path) -> set[Cause]:
    """The causes that Sesame names for the tests in a results file."""
    rows = json.loads(_run(sesamec, "results", "causes", str(results), "--format", "json"))
    named = [row for row in rows if row["fewer"] != "not tried"]
    return {cause(row["requirement"], tuple(row["operations"].split(" + "))) for row in named}


def read_results(file: Path, space: Space) -> list[Recorded]:
    """The tests of a search in a results file, without reference runs."""
    with closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True)) as results:
        tests = results.execute("SELECT number, simulator_seed FROM tests WHERE origin = 'search' ORDER BY number")
        return [
            Recorded(
                number,
                _recorded_test(results, number, space),
                dict(results.execute(_VALUES, (number,)).fetchall()),
                dict(results.execute("SELECT requirement, verdict FROM verdicts WHERE test = ?", (number,)).fetchall()),
                int(seed),
            )
            for number, seed in tests.fetchall()
        ]


# A test that is equal to an earlier one has the values of that one.
_VALUES = """
SELECT metrics.name, metric_values.value
  FROM tests
  JOIN metric_values ON metric_values.test = coalesce(tests.duplicate_of, tests.number)
  JOIN metrics ON metrics.id = metric_values.metric
 WHERE tests.number = ?
"""


def _recorded_test(results: sqlite3.Connection, number: int, space: Space) -> Test:
    rows = results.execute(
        "SELECT position, operation, start_s, end_s, operation_seed FROM operations WHERE test = ? ORDER BY position",
        (number,),
    )
    uses = []
    for position, operation, start, end, seed in rows.fetchall():
        choices = results.execute(
            "SELECT parameter, value, low, high, x, y, z, text FROM choices WHERE test = ? AND operation = ?",
            (number, position),
        )
        chosen = {name: _choice(*fields) for name, *fields in choices.fetchall()}
        parameters = space.operations[operation].parameters
        uses.append(Use(operation, start, end, tuple(chosen[each.name] for each in parameters), int(seed)))
    return tuple(uses)


def _choice(
    value: float | None, low: float | None, high: float | None,
    x: float | None, y: float | None, z: float | None, text: str | None,
) -> Choice:  # fmt: skip
    if value is not None:
        return value
    if low is not None:
        return low, high
    return (x, y, z) if x is not None else text


def _with_strategy(space_file: Path, strategy: str, tests: int, folder: Path) -> Path:
    """A space that imports a case's space, and whose campaign differs from it only in its strategy."""
    file = folder / f"{space_file.stem}_{strategy}.sesame"
    settings = f"{SETTINGS.get(strategy, '')} evaluations {tests}"
    file.write_text(
        f'space {file.stem}\nimport "{space_file}"\n'
        f"campaign {CAMPAIGN}_by_{strategy} from {CAMPAIGN} {{ search {strategy} {{ {settings} }} }}\n",
        encoding="utf-8",
    )
    return file


def _run(sesamec: Path, *arguments: str) -> str:
    """What the program prints."""
    done = subprocess.run([sesamec, *arguments], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        last = "\n".join(done.stderr.strip().splitlines()[-15:])
        raise SesamecFailed(f"`{sesamec} {' '.join(arguments)}` ended with {done.returncode}:\n{last}")
    return done.stdout
