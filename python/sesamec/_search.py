"""The search of a campaign for those who run tests themselves: it asks for tests, and is told what came of them.

The program `sesamec` searches and records, as for every other campaign. It sends tests over a pair of sockets, so what
is told is kept at once, and a search that was broken off goes on with `resume`.
"""

from __future__ import annotations

import difflib
import json
import math
import os
import socket
import subprocess
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Any, Iterable, Iterator, Mapping, Sequence

from ._results import Run
from ._run import command_of
from ._supervise import concluded

OUTCOMES = ("unknown", "completed", "no_effect", "crash", "timeout")


@dataclass(frozen=True)
class PlannedOperation:
    """An operation of a test that is to be carried out. Times are seconds of simulation time.

    `topics` and `resource` are what it acts on, by their names in the space. `start_s` and `end_s` are `None` of an
    operation that conditions activate, and of one that is not bound to time; `conditions` has them in the words of the
    language. A choice is a value, the two ends of a sub-range, a point or a text, in the units of `units`.
    """

    operation: str
    kind: str
    topics: tuple[str, ...]
    resource: str | None
    start_s: float | None
    end_s: float | None
    conditions: str | None
    choices: Mapping[str, Any]
    units: Mapping[str, str]
    seed: int


@dataclass(frozen=True)
class PlannedTest:
    """A test to carry out. One without operations is a reference run: the system without disturbance."""

    number: int
    operations: tuple[PlannedOperation, ...]
    #: The seed of the simulator's own randomness.
    seed: int

    def __str__(self) -> str:
        return f"T{self.number}"


class Search:
    """A search for tests of a campaign.

        with sesamec.Search("cart.sesame", "attack", seed=1) as search:
            for test in search:
                search.tell(test, {"closest": my_system(test)})
            print(search.run.digest)

    `deterministic` says that equal tests give equal results; without it, equal tests are asked again.
    """

    def __init__(
        self,
        space: str | os.PathLike[str],
        campaign: str | None = None,
        *,
        seed: int | None = None,
        evaluations: int | None = None,
        results: str | os.PathLike[str] | None = None,
        resume: bool | str | os.PathLike[str] = False,
        deterministic: bool = False,
        options: Sequence[str] = (),
    ) -> None:
        values = {"seed": seed, "evaluations": evaluations, "results": results}
        self._command = command_of(space, campaign, values, resume, options)
        self._space = Path(space)
        ours, theirs = socket.socketpair()
        environment = {**os.environ, "SESAME_ASKED": "deterministic" if deterministic else "free"}
        with theirs:
            # Ctrl-C is for the loop: the end of this process, or of the search, stops the program.
            self._supervisor = subprocess.Popen(
                self._command, stdin=theirs.fileno(), stdout=subprocess.PIPE, env=environment, start_new_session=True
            )
        self._connection = ours
        self._lines = ours.makefile("r", encoding="utf-8")
        self._open: dict[int, PlannedTest] = {}
        self._told: set[int] = set()
        self._waits = False
        self._run: Run | None = None
        campaign_line = self._read()
        if campaign_line is None:
            self._end()
            raise AssertionError("a search that has ended has a summary or an error")
        self._metrics: list[dict[str, Any]] = campaign_line["campaign"]["metrics"]
        #: Simulation time at which each test ends, in seconds.
        self.end_after: float = campaign_line["campaign"]["end"]
        #: The metrics that the search optimises.
        self.objectives: tuple[str, ...] = tuple(campaign_line["campaign"]["objectives"])

    @property
    def metrics(self) -> tuple[str, ...]:
        """The metrics that a result has to name; it may name others of the space, too."""
        return tuple(m["name"] for m in self._metrics if m["default"] is None and not m["follows"])

    @property
    def finished(self) -> bool:
        """Whether the search has ended, so that there is no further test."""
        return self._run is not None

    @property
    def run(self) -> Run:
        """The results, once the search has ended."""
        if self._run is None:
            raise RuntimeError("the search has not ended: there are tests to ask for, or to tell")
        return self._run

    def ask(self) -> PlannedTest | None:
        """The next test; `None` if the search has ended, or if none can come before a result of the tests that were
        asked for."""
        while self._run is None and not self._waits:
            line = self._read()
            if line is None:
                self._end()
            elif "waits" in line:
                # It may have been written before the latest result was read.
                self._waits = all(number in self._open for number in line["waits"])
            else:
                test = _asked(line["test"])
                self._open[test.number] = test
                return test
        return None

    def tell(
        self,
        test: PlannedTest,
        metrics: Mapping[str, float | None] | None = None,
        *,
        outcome: str = "unknown",
        message: str | None = None,
        end: float | None = None,
    ) -> None:
        """Says what came of a test: the values of metrics by their names, in the units of the space, and how it ended.

        `outcome` is "completed" if an operation had an effect, "no_effect" if none had, "unknown" if nobody knows;
        "crash" and "timeout" if the system failed, with a `message`. `end` is when the test ended, in seconds of
        simulation time. `fuzzing_time()` follows from the test, unless conditions switch its operations.
        """
        if test.number not in self._open:
            raise ValueError(f"{test} was told already" if test.number in self._told else f"{test} was not asked for")
        if outcome not in OUTCOMES:
            raise ValueError(f"`{outcome}` is not an outcome{_like(outcome, OUTCOMES)}; there are {', '.join(OUTCOMES)}")
        values = {name: None if value is None else float(value) for name, value in (metrics or {}).items()}
        known = [metric["name"] for metric in self._metrics]
        for name, value in values.items():
            if name not in known:
                raise ValueError(f"the space has no metric `{name}`{_like(name, known)}; it has {', '.join(known)}")
            if value is not None and not math.isfinite(value):
                raise ValueError(f"metric `{name}` of {test} is {value}; leave it out, or tell a crash")
        if outcome not in ("crash", "timeout"):
            missing = [name for name in self.metrics if values.get(name) is None]
            if missing:
                raise ValueError(f"the result of {test} lacks {', '.join(f'`{name}`' for name in missing)}")
        told = {"number": test.number, "outcome": outcome, "message": message, "end": end, "metrics": values}
        del self._open[test.number]
        self._told.add(test.number)
        self._waits = False
        try:
            self._connection.sendall(json.dumps({"result": told}).encode() + b"\n")
        except BrokenPipeError:
            self._end()

    def __iter__(self) -> Iterator[PlannedTest]:
        """All tests, each of which has to be told before the next one."""
        while (test := self.ask()) is not None:
            yield test
            if test.number in self._open:
                raise RuntimeError(f"{test} has to be told before the next test is asked for")

    def close(self) -> None:
        """Ends the search. What was told stays recorded, and `resume` goes on with it."""
        if self._supervisor.returncode is None:
            # It records what it was told, and stops.
            self._connection.shutdown(socket.SHUT_WR)
            for _ in self._lines:
                pass
            self._supervisor.communicate()
        self._lines.close()
        self._connection.close()

    def __enter__(self) -> Search:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def _read(self) -> Any:
        line = self._lines.readline()
        return json.loads(line) if line else None

    def _end(self) -> None:
        output, _ = self._supervisor.communicate()
        summary = json.loads(concluded(self._command, self._supervisor.returncode, output).output)
        self._run = Run(Path(summary["results"]), space=self._space, summary=summary)


def _asked(test: dict[str, Any]) -> PlannedTest:
    return PlannedTest(test["number"], tuple(map(_operation, test["operations"])), test["simulator_seed"])


def _operation(used: dict[str, Any]) -> PlannedOperation:
    planned = used["planned"]
    topics = [used["topic"], *used.get("further_topics", ())]
    return PlannedOperation(
        operation=used["operation"],
        kind=used["kind"],
        topics=tuple(topic for topic in topics if topic is not None),
        resource=used["resource"],
        start_s=planned and planned["start"],
        end_s=planned and planned["end"],
        conditions=used["conditions"],
        choices=MappingProxyType({choice["parameter"]: _chosen(choice["choice"]) for choice in used["choices"]}),
        units=MappingProxyType({it["parameter"]: it["unit"] for it in used["choices"] if it["unit"] is not None}),
        seed=used["operation_seed"],
    )


def _chosen(choice: dict[str, Any]) -> Any:
    match choice["kind"]:
        case "range":
            return (choice["low"], choice["high"])
        case "point":
            return tuple(choice["point"])
        case kind:
            return choice[kind]


def _like(name: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, known, 1)
    return f" (did you mean `{near[0]}`?)" if near else ""
