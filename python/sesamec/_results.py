"""What a campaign left behind: a run, its tests, and tables of them.

Everything here reads `results.sqlite` by its public tables and views, which docs/format.md describes, or asks the
program `sesamec`. Nothing is written into results, and a run may still be going on.
"""

from __future__ import annotations

import json
import os
import re
import sqlite3
import struct
import subprocess
import tempfile
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Iterable, Iterator, Sequence

from ._frames import Frame, Kind, Table
from ._supervise import Failed, answer, program
from ._world import Setup

DATABASE = "results.sqlite"

#: What marks a database of Sesame, and the versions of its format that are read here.
APPLICATION = 0x5345534D
FORMATS = (7, 8)

#: Folders of runs are called after their seeds; runs on the side, such as those in a lab, have a word behind it.
RUN = re.compile(r"\d+(-\d+)?")


class NotResults(ValueError):
    """A file or folder that has no results which this version reads."""


def latest(space: Path, campaign: str | None) -> Path:
    """The database of the latest run of a space, or of one of its campaigns: by when it was last written."""
    if not space.is_file():
        raise FileNotFoundError(f"there is no file {space}")
    runners = space.parent / "runners"
    found = []
    for database in [*runners.glob(f"*/results/*/{DATABASE}"), *runners.glob(f"*/*/results/*/{DATABASE}")]:
        source, name = _campaign(database)
        if source == space.name and campaign in (None, name):
            log = database.with_name(f"{DATABASE}-wal")
            written = max(file.stat().st_mtime_ns for file in (database, log) if file.exists())
            found.append((RUN.fullmatch(database.parent.name) is not None, written, database))
    if not found:
        of = f"campaign `{campaign}` of {space}" if campaign else f"{space}"
        raise NotResults(f"{of} has no results yet; `sesamec run {space}` makes some")
    return max(found)[2]


def _campaign(database: Path) -> tuple[str | None, str | None]:
    """The file of the space, and the campaign, of results that can be read."""
    try:
        with closing(_connect(database)) as connection:
            row = connection.execute("SELECT source, name FROM campaign").fetchone()
    except NotResults:
        return None, None
    return (None, None) if row is None else (str(row[0]), str(row[1]))


def _connect(database: Path) -> sqlite3.Connection:
    if not database.is_file():
        raise NotResults(f"there are no results in {database.parent}: it has no {DATABASE}")
    connection = sqlite3.connect(f"{database.absolute().as_uri()}?mode=ro", uri=True)
    try:
        connection.execute("PRAGMA busy_timeout = 5000")
        (application,) = connection.execute("PRAGMA application_id").fetchone()
        (version,) = connection.execute("PRAGMA user_version").fetchone()
    except sqlite3.DatabaseError as error:
        connection.close()
        raise NotResults(f"{database} is not a readable results file: {error}") from None
    if application == APPLICATION and version in FORMATS:
        return connection
    connection.close()
    if application != APPLICATION:
        raise NotResults(f"{database} is not a results file of Sesame")
    known = " and ".join(map(str, FORMATS))
    newer = "a newer sesamec has written it: update this package" if version > max(FORMATS) else "it is too old"
    raise NotResults(f"{database} has version {version} of the format, and {known} are read here; {newer}")


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


@dataclass(frozen=True)
class Metric:
    """A metric of a campaign; `direction` is `minimise` or `maximise`, or `None` if neither is of interest."""

    name: str
    unit: str | None
    direction: str | None


@dataclass(frozen=True)
class Operation:
    """What a test planned to do, and what it did. Times are seconds of simulation time.

    `start_s` and `end_s` are `None` of an operation that a condition activates, and of one that is not bound to time.
    `active` has the intervals in which it acted. A choice is a value, the two ends of a sub-range, a point or a text,
    in the units of `units`.
    """

    operation: str
    start_s: float | None
    end_s: float | None
    start_condition: str | None
    end_condition: str | None
    active: tuple[tuple[float, float], ...]
    choices: dict[str, Any]
    units: dict[str, str]
    seed: int
    effects: dict[str, int]


#: What an operation may have done to messages, each a column of the table `operations`.
EFFECTS = ("seen", "changed", "dropped", "delayed", "queued", "injected", "side_effects", "unheard")

#: Columns of analyses that are no metrics.
ANALYSES: dict[str, Kind] = {
    "test": "text",
    "same_as": "text",
    "finding": "text",
    "confirmed": "whole",
    "conclusive": "whole",
    "repetitions": "whole",
    "confirmed_low": "real",
    "confirmed_high": "real",
    "standing": "text",
    "requirement": "text",
    "operations": "text",
    "violating": "whole",
    "of": "whole",
    "first": "text",
    "smallest": "text",
    "fewer": "text",
    "generation": "whole",
    "evaluations": "whole",
    "unique": "whole",
    "no_effect": "whole",
    "crashes": "whole",
    "timeouts": "whole",
    "front": "whole",
    "covered": "whole",
    "cells": "whole",
    "feasible": "whole",
}


class Run:
    """The results of one run of a campaign.

    `run["T62"]` is a test; `run.tests()` and its like are tables, by default as frames of pandas if that is installed,
    else of polars, else as lists of dictionaries. In frames of pandas, tests are the index, and units are in
    `attrs["units"]`; `run.units` has those of metrics.
    """

    def __init__(
        self,
        path: Path,
        *,
        space: Path | None = None,
        simulator: Callable[[Setup], Any] | None = None,
        summary: dict[str, Any] | None = None,
    ) -> None:
        path = path.absolute()
        #: The database of the run.
        self.path = path / DATABASE if path.is_dir() else path
        #: The class or function with which tests are run again; `None` for the space's own simulator.
        self.simulator = simulator
        self._summary = summary
        (row,) = self._query("SELECT space, name, source, seed FROM campaign") or [None]
        if row is None:
            raise NotResults(f"{self.path} has no campaign: the run has just begun, or it is damaged")
        source: str
        #: The name of the space, and of the campaign.
        self.space_name, self.campaign, source, seed = row
        #: The seed that determined everything.
        self.seed = int(seed)
        #: The metrics of the campaign, by name.
        self.metrics = {
            name: Metric(name, unit, direction)
            for name, unit, direction in self._query("SELECT name, unit, direction FROM metrics ORDER BY id")
        }
        named = "SELECT name FROM metrics WHERE objective IS NOT NULL ORDER BY objective"
        #: The metrics that the campaign optimises, in its order.
        self.objectives = [self.metrics[name] for (name,) in self._query(named)]
        self._space = space.absolute() if space is not None else _beside(self.path, source)

    @property
    def folder(self) -> Path:
        """The folder of the run."""
        return self.path.parent

    @property
    def space(self) -> Path:
        """The file of the space, which is needed to run tests again."""
        if self._space is None:
            raise FileNotFoundError(
                f"the space of {self.folder} is not where runs usually are; name it: "
                "sesamec.open_run(..., space=\"….sesame\")"
            )
        return self._space

    @property
    def stop(self) -> str | None:
        """Why the run ended; `None` while it is unfinished."""
        ((stop,),) = self._query("SELECT stop FROM campaign")
        return None if stop is None else str(stop)

    @property
    def units(self) -> dict[str, str]:
        """The units of metrics; plain numbers are left out."""
        return {metric.name: metric.unit for metric in self.metrics.values() if metric.unit is not None}

    @property
    def digest(self) -> str:
        """The hash of the run's content: equal runs have equal digests."""
        if self._summary is not None:
            return str(self._summary["digest"])
        return str(self._ask("digest")["digest"])

    @property
    def summary(self) -> dict[str, Any]:
        """What `sesamec run … --format json` prints; docs/json.md lists its fields."""
        if self._summary is None:
            # The page would be written anew into the folder of the run.
            with tempfile.TemporaryDirectory() as folder:
                report = self._ask("report", "--output", os.path.join(folder, "report.html"))
            self._summary = {**report, "report": str(self.folder / "report.html")}
        return self._summary

    # Tables.

    def tests(self, frame: Frame = None) -> Any:
        """All tests but reference runs: how each ended, its operations, its metrics, and what it violates."""
        columns: dict[str, Kind] = {
            "test": "text",
            "origin": "text",
            "generation": "whole",
            "outcome": "text",
            "duplicate_of": "text",
            "operations": "text",
            "violates": "text",
        }
        # A space may call a metric like one of these columns.
        named = {name: f"metric_{name}" if name in columns else name for name in self.metrics}
        columns.update({column: "real" for column in named.values()})
        values = {name: dict[int, Any]() for name in self.metrics}
        sql = "SELECT v.test, m.name, v.value FROM metric_values v JOIN metrics m ON m.id = v.metric"
        with closing(self._open()) as connection:
            for test, name, value in connection.execute(sql):
                values[name][test] = value
            operations = _gathered(
                connection.execute("SELECT test, operation FROM operations ORDER BY test, position")
            )
            violates = _gathered(
                connection.execute("SELECT test, requirement FROM verdicts WHERE verdict = 'violated'")
            )
            sql = (
                "SELECT number, name, origin, generation, outcome, 'T' || duplicate_of FROM tests "
                "WHERE origin <> 'reference' ORDER BY number"
            )
            rows = [
                (*row, " ".join(operations.get(number, [])), " ".join(violates.get(number, [])))
                + tuple(values[name].get(number) for name in self.metrics)
                for number, *row in connection.execute(sql)
            ]
        units = {named[name]: unit for name, unit in self.units.items()}
        return Table(columns, rows, "test", units).frame(frame)

    def front(self, frame: Frame = None) -> Any:
        """The tests that no other dominates, with their objectives: what `sesamec results front` shows.

        `same_as` names the test of equal values that stands for a test. If tests were run again, further columns say
        how often they show their finding.
        """
        names = [objective.name for objective in self.objectives]
        return self._analysis("front", ["test", *names, "same_as"], index="test").frame(frame)

    def causes(self, frame: Frame = None) -> Any:
        """The smallest sets of operations with which tests violate a requirement: what `sesamec results causes` shows."""
        columns = ["requirement", "operations", "violating", "of", "first", "smallest", "fewer"]
        return self._analysis("causes", columns).frame(frame)

    def indicators(self, frame: Frame = None) -> Any:
        """How good the front was after each generation: what `sesamec results indicators` shows."""
        columns = ["generation", "evaluations", "unique", "no_effect", "crashes", "timeouts", "front", "hypervolume"]
        return self._analysis("indicators", columns, index="generation").frame(frame)

    def requirements(self, frame: Frame = None) -> Any:
        """The requirements with their bounds, and how many tests violate and satisfy each, reference runs left out."""
        columns: dict[str, Kind] = {
            "requirement": "text",
            "text": "text",
            "metric": "text",
            "low": "real",
            "low_excluded": "flag",
            "high": "real",
            "high_excluded": "flag",
            "violated": "whole",
            "satisfied": "whole",
            "inconclusive": "whole",
        }
        counts = ", ".join(
            "(SELECT count(*) FROM verdicts v JOIN tests t ON t.number = v.test WHERE v.requirement = r.name "
            f"AND v.verdict = '{verdict}' AND t.origin <> 'reference' AND t.duplicate_of IS NULL)"
            for verdict in ("violated", "satisfied", "inconclusive")
        )
        sql = (
            f"SELECT r.name, r.text, m.name, r.low, r.low_excluded, r.high, r.high_excluded, {counts} "
            "FROM requirements r JOIN metrics m ON m.id = r.metric ORDER BY r.id"
        )
        rows = [
            (*row[:4], bool(row[4]), row[5], bool(row[6]), *row[7:])
            for row in self._query(sql)
        ]
        return Table(columns, rows, "requirement").frame(frame)

    def series(self, metric: str, tests: Iterable[str] | None = None, frame: Frame = None) -> Any:
        """How a metric changed in these tests, or in all: a row for each change, and a value holds until the next one.

        A test that was not simulated, since an earlier one is equal, has the series of that one.
        """
        unit = self._metric(metric).unit
        names = None if tests is None else list(tests)
        with closing(self._open()) as connection:
            numbers = connection.execute("SELECT number, name, coalesce(duplicate_of, number) FROM tests").fetchall()
            ran = {name: number for _, name, number in numbers}
            missing = [name for name in names or () if name not in ran]
            if missing:
                raise KeyError(f"{self.folder} has no test {', '.join(missing)}")
            rows = [
                (name, time, value)
                for name in (names if names is not None else ran)
                for time, value in _points(connection, "series_pieces", ran[name], metric)
            ]
        columns: dict[str, Kind] = {"test": "text", "time_s": "real", "value": "real"}
        units = {"time_s": "s", **({} if unit is None else {"value": unit})}
        return Table(columns, rows, "test", units).frame(frame)

    # Tests.

    def __getitem__(self, test: str) -> Test:
        row = self._query("SELECT number FROM tests WHERE name = ? OR known_test = ? ORDER BY number", test, test)
        if not row:
            raise KeyError(f"{self.folder} has no test {test}")
        return Test(self, int(row[0][0]))

    def __contains__(self, test: object) -> bool:
        return bool(self._query("SELECT 1 FROM tests WHERE name = ? OR known_test = ?", test, test))

    def __len__(self) -> int:
        """The number of tests, without reference runs."""
        return int(self._query("SELECT count(*) FROM tests WHERE origin <> 'reference'")[0][0])

    def __iter__(self) -> Iterator[Test]:
        for (number,) in self._query("SELECT number FROM tests WHERE origin <> 'reference' ORDER BY number"):
            yield Test(self, number)

    # Looks.

    def __repr__(self) -> str:
        tests = len(self)
        front = self._query("SELECT count(*) FROM front")[0][0]
        violated = self._query(
            "SELECT r.name, count(*) FROM verdicts v JOIN requirements r ON r.name = v.requirement JOIN tests t "
            "ON t.number = v.test WHERE v.verdict = 'violated' AND t.origin <> 'reference' AND t.duplicate_of IS NULL "
            "GROUP BY r.id ORDER BY r.id"
        )
        words = [f"{name} violated by {count}" for name, count in violated] or ["no requirement violated"]
        going = "" if self.stop else ", unfinished"
        return (
            f"<Run {self.campaign} of {self.space_name}, seed {self.seed}: {tests} tests, front of {front}, "
            f"{', '.join(words)}{going}; {self.folder}>"
        )

    def _repr_html_(self) -> str:
        return _figures(self.path)

    # How results are read.

    def _open(self) -> sqlite3.Connection:
        return _connect(self.path)

    def _query(self, sql: str, *values: object) -> list[Any]:
        with closing(self._open()) as connection:
            return connection.execute(sql, values).fetchall()

    def _metric(self, name: str) -> Metric:
        if name not in self.metrics:
            raise KeyError(f"campaign `{self.campaign}` has no metric `{name}`, but {', '.join(self.metrics)}")
        return self.metrics[name]

    def _analysis(self, name: str, first: Sequence[str], index: str | None = None) -> Table:
        found: list[dict[str, Any]] = json.loads(_results(name, self.path, "--format", "json"))
        names = [*first, *(column for column in (found[0] if found else {}) if column not in first)]
        columns: dict[str, Kind] = {
            column: "real" if column in self.metrics else ANALYSES.get(column, "real") for column in names
        }
        rows = [tuple(row.get(column) for column in names) for row in found]
        units = {column: unit for column, unit in self.units.items() if column in columns}
        return Table(columns, rows, index, units)

    def _ask(self, command: str, *arguments: str) -> Any:
        """What a command of the campaign prints as JSON, with the run's own simulator."""
        command_line = [program(), command, str(self.space), *arguments, "--format", "json"]
        command_line += ["--campaign", self.campaign, "--results", str(self.folder)]
        return answer(command_line, self.simulator)


class Test:
    """A test of a run, as it was recorded."""

    #: Not a class of tests for pytest.
    __test__ = False

    def __init__(self, run: Run, number: int) -> None:
        self.run = run
        self.number = number
        sql = (
            "SELECT t.name, t.origin, t.known_test, t.generation, t.simulator_seed, t.outcome, t.outcome_detail, t.end_s, "
            "t.messages, 'T' || t.duplicate_of FROM tests t WHERE t.number = ?"
        )
        ((name, origin, known, generation, seed, outcome, detail, end, messages, duplicate_of),) = run._query(sql, number)
        #: Its name in the run, such as `T62`; and that of a regression test in the space.
        self.name: str = name
        self.known_test: str | None = known
        #: `reference`, `known` (a regression test) or `search`.
        self.origin: str = origin
        self.generation: int | None = generation
        self.simulator_seed = int(seed)
        #: How it ended, such as `completed`, `no_effect`, `crash` or `timeout`, and what is known of the cause.
        self.outcome: str = outcome
        self.detail: str | None = detail
        #: When it ended, in seconds of simulation time.
        self.end_s: float = end
        #: How many messages the relay handled.
        self.messages: int = messages
        #: The equal test whose result stands for this one, which was not simulated.
        self.duplicate_of: str | None = duplicate_of

    @property
    def metrics(self) -> dict[str, float | None]:
        """The values of all metrics, in the units of `run.units`; `None` if a metric was never set."""
        sql = (
            "SELECT m.name, v.value FROM metrics m LEFT JOIN metric_values v ON v.metric = m.id AND v.test = ? "
            "ORDER BY m.id"
        )
        return dict(self.run._query(sql, self.number))

    @property
    def objectives(self) -> dict[str, float | None]:
        """The values of the campaign's objectives, in its order."""
        metrics = self.metrics
        return {objective.name: metrics[objective.name] for objective in self.run.objectives}

    @property
    def verdicts(self) -> dict[str, str]:
        """`violated`, `satisfied` or `inconclusive` for each requirement."""
        return dict(self.run._query("SELECT requirement, verdict FROM verdicts WHERE test = ?", self.number))

    @property
    def violates(self) -> list[str]:
        """The requirements that it violates."""
        return [name for name, verdict in self.verdicts.items() if verdict == "violated"]

    @property
    def operations(self) -> list[Operation]:
        """Its operations, in its order."""
        with closing(self.run._open()) as connection:
            effects = ", ".join(EFFECTS)
            sql = (
                f"SELECT position, operation, start_s, end_s, start_condition, end_condition, operation_seed, {effects} "
                "FROM operations WHERE test = ? ORDER BY position"
            )
            found = []
            for position, name, start, end, starts, ends, seed, *counts in connection.execute(sql, (self.number,)):
                key = (self.number, position)
                sql = "SELECT start_s, end_s FROM intervals WHERE test = ? AND operation = ? ORDER BY position"
                active = tuple((start, end) for start, end in connection.execute(sql, key))
                sql = (
                    "SELECT parameter, unit, value, low, high, x, y, z, text FROM choices "
                    "WHERE test = ? AND operation = ? ORDER BY position"
                )
                choices, units = {}, {}
                for parameter, unit, value, low, high, x, y, z, text in connection.execute(sql, key):
                    if unit is not None:
                        units[parameter] = unit
                    given = (value, (low, high) if low is not None else None, (x, y, z) if x is not None else None, text)
                    choices[parameter] = next((choice for choice in given if choice is not None), None)
                counted = {effect: count for effect, count in zip(EFFECTS, counts) if count is not None}
                found.append(Operation(name, start, end, starts, ends, active, choices, units, int(seed), counted))
        return found

    def series(self, metric: str, frame: Frame = None) -> Any:
        """How a metric changed: its times, and values that hold until the next one."""
        return self._changes("series_pieces", metric, frame)

    def robustness(self, metric: str, frame: Frame = None) -> Any:
        """The robustness of the formula of a metric over time, in the same way; empty if the metric has none."""
        return self._changes("robustness_pieces", metric, frame)

    def _changes(self, pieces: str, metric: str, frame: Frame) -> Any:
        unit = self.run._metric(metric).unit
        ran = self.number if self.duplicate_of is None else int(self.duplicate_of[1:])
        with closing(self.run._open()) as connection:
            rows = list(_points(connection, pieces, ran, metric))
        units = {"time_s": "s", **({} if unit is None else {metric: unit})}
        return Table({"time_s": "real", metric: "real"}, rows, None, units).frame(frame)

    def shrink(self, *options: str) -> Test:
        """The smallest test that was found to fail in the same way, in results of its own; options are those of
        `sesamec shrink`. `test.run.summary["shrinking"]` says how it was found.
        """
        summary = self.run._ask("shrink", self.name, *options)
        run = Run(Path(summary["results"]), space=self.run._space, simulator=self.run.simulator, summary=summary)
        return run[summary["shrinking"]["after"]["test"]]

    def replay(self) -> dict[str, Any]:
        """Runs it again unchanged: `same`, and the `differences` if it did not come out the same."""
        replay: dict[str, Any] = self.run._ask("replay", self.name)
        return replay

    def export(self, name: str | None = None, *, pin: bool = False, into: str | os.PathLike[str] | None = None) -> str:
        """It as a `test` block for the space, which expects requirements, or with `pin` the measured values.

        With `into`, the block is also added at the end of this file; `pytest` then runs it with the others.
        """
        options = [*(() if name is None else ("--name", name)), *(("--pin",) if pin else ())]
        block = str(self.run._ask("export", self.name, *options)["block"])
        if into is not None:
            with open(into, "a", encoding="utf-8") as file:
                file.write(f"\n{block}")
        return block

    def __repr__(self) -> str:
        units = self.run.units
        values = ", ".join(
            f"{name} {'never set' if value is None else f'{value:g}'} {units.get(name, '')}".rstrip()
            for name, value in (self.objectives or self.metrics).items()
        )
        violates = f", violates {' and '.join(self.violates)}" if self.violates else ""
        return f"<Test {self.name}: {self.outcome} at {self.end_s:g} s, {values}{violates}>"

    def _repr_html_(self) -> str:
        return _figures(self.run.path, self.name)


def _beside(database: Path, source: str) -> Path | None:
    """The space of a run that is where `sesamec` puts it: in `runners/CAMPAIGN/results/SEED` beside the space, or, if
    spaces have campaigns of one name, in `runners/SPACE/CAMPAIGN/results/SEED`.
    """
    places = (folder.parent / source for folder in list(database.parents)[3:5] if folder.name == "runners")
    return next((space for space in places if space.is_file()), None)


def _gathered(rows: Iterable[tuple[int, str]]) -> dict[int, list[str]]:
    gathered: dict[int, list[str]] = {}
    for test, name in rows:
        gathered.setdefault(test, []).append(name)
    return gathered


def _points(
    connection: sqlite3.Connection, pieces: str, test: int, metric: str
) -> Iterable[tuple[float, float]]:
    """The changes of a metric, from pieces of up to 64 points: the same values as those of the view `series`.

    The view computes doubles from their digits, in any client of SQLite, and takes ten times as long.
    """
    sql = (
        f"SELECT p.points, p.start_ns, p.tick_ns, p.times, p.numbers FROM {pieces} p JOIN metrics m ON m.id = p.metric "
        "WHERE p.test = ? AND m.name = ? ORDER BY p.position"
    )
    has = connection.execute("SELECT 1 FROM sqlite_master WHERE name = ?", (pieces,)).fetchone()
    for points, start, tick, times, numbers in connection.execute(sql, (test, metric)) if has else ():
        values = struct.unpack(f">{points}d", numbers)
        if tick is None:
            at: Iterable[float] = struct.unpack(f">{points}d", times)
        else:
            width = len(times) // points
            ticks = (
                (int.from_bytes(times[place : place + width], "big") for place in range(0, len(times), width))
                if width
                else range(points)
            )
            at = [(start + tick * count) / 1e9 for count in ticks]
        yield from zip(at, values)


def _results(command: str, *arguments: str | Path) -> str:
    """What an analysis of `sesamec results` prints."""
    command_line = [program(), "results", command, *map(str, arguments)]
    done = subprocess.run(command_line, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise Failed(done.stderr.strip(), done.returncode)
    return done.stdout


def _figures(database: Path, *test: str) -> str:
    return _results("figures", database, *test)
