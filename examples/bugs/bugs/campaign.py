"""One search on one case: which tests it ran, what the judge found in them, and the record of that."""

import math
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path

from bugs.case import Case, Cause, cause, file_hash, load_case
from bugs.judge import VERSION, Judge
from bugs.named import Named
from bugs.sesamec import Recorded, search
from bugs.space import Test
from bugs.strategies import Problem, Unavailable, strategy_class
from bugs.world import Outcome


@dataclass(frozen=True)
class Job:
    """A search that is to be run."""

    strategy: str
    case: str
    seed: int
    tests: int


@dataclass(frozen=True)
class Record:
    """What came out of a job. Tests have numbers from 1."""

    strategy: str
    case: str
    seed: int
    tests: int
    fingerprint: str  # of case and judge: a record with another one says nothing about this case
    origin: str  # of a strategy of yours or the real program: the hash of its file
    violating: list[int]  # tests that violate a requirement
    without_effect: list[int]  # tests in which no operation had an effect
    found: list[tuple[str, tuple[str, ...], int]]  # causes by the judge, each with the first test that has it
    # Causes that the tests bear out, each with the test from which on, and the test before which: later tests may show
    # that fewer operations suffice.
    named: list[tuple[str, tuple[str, ...], int, int]]
    differing: list[int]  # tests whose recorded values differ from the judge's; only of the real program
    named_otherwise: list[tuple[str, tuple[str, ...]]]  # causes that only the real program names, or does not name
    seconds: float  # of wall time

    @property
    def job(self) -> Job:
        return Job(self.strategy, self.case, self.seed, self.tests)

    def found_by(self, test: int) -> set[Cause]:
        """Causes that the judge found in the tests up to this one."""
        return {cause(requirement, operations) for requirement, operations, first in self.found if first <= test}

    def named_by(self, test: int) -> set[Cause]:
        """The causes that the tests up to this one bear out."""
        named = [(requirement, names) for requirement, names, since, until in self.named if since <= test < until]
        return {cause(requirement, names) for requirement, names in named}

    def as_json(self) -> dict:
        return asdict(self)


def record_from(facts: dict) -> Record:
    """A record as `as_json` made it. Raises `TypeError` or `KeyError` if it is of another version."""
    return Record(
        **{
            **facts,
            "found": [(requirement, tuple(names), first) for requirement, names, first in facts["found"]],
            "named": [(requirement, tuple(names), since, until) for requirement, names, since, until in facts["named"]],
            "named_otherwise": [(requirement, tuple(names)) for requirement, names in facts["named_otherwise"]],
        }
    )


def fingerprint(case: Case) -> str:
    """Changes whenever a record of the case is worth nothing any more."""
    return f"{case.fingerprint}-{VERSION}"


def origin(strategy: str, sesamec: Path | None) -> str:
    """Changes whenever a strategy that comes from a file may choose other tests."""
    if strategy.partition(":")[0] == "sesamec":
        return file_hash(sesamec) if sesamec is not None else ""
    file, colon, _ = strategy.rpartition(":")
    return file_hash(Path(file)) if colon else ""


def run(job: Job, folder: Path, sesamec: Path | None) -> Record:
    """Runs a job on the case in a folder. Equal jobs have equal records, except for the time they took."""
    began = time.monotonic()
    case, judge = _case(folder), _judge(folder)
    violating, without_effect, differing = [], [], []
    found: dict[Cause, int] = {}
    named, spans = Named(case.space), _Spans()
    tests = _tests(job, case, judge, sesamec)
    for number, (test, outcome, agrees) in enumerate(tests.each, start=1):
        if outcome.violated:
            violating.append(number)
        if outcome.no_effect:
            without_effect.append(number)
        if not agrees:
            differing.append(number)
        for each in judge.causes(test):
            found.setdefault(each, number)
        named.add(test, outcome)
        spans.add(named.causes(), number)
    return Record(
        strategy=job.strategy,
        case=job.case,
        seed=job.seed,
        tests=job.tests,
        fingerprint=fingerprint(case),
        origin=origin(job.strategy, sesamec),
        violating=violating,
        without_effect=without_effect,
        found=[(each.requirement, each.operations, first) for each, first in sorted(found.items())],
        named=spans.up_to(job.tests),
        differing=differing,
        named_otherwise=[(each.requirement, each.operations) for each in sorted(tests.named_otherwise)],
        seconds=round(time.monotonic() - began, 3),
    )


class _Spans:
    """From which test to which causes are named."""

    def __init__(self) -> None:
        self._since: dict[Cause, int] = {}
        self._ended: list[tuple[Cause, int, int]] = []

    def add(self, named: set[Cause], number: int) -> None:
        for each in [each for each in self._since if each not in named]:
            self._ended.append((each, self._since.pop(each), number))
        for each in named:
            self._since.setdefault(each, number)

    def up_to(self, tests: int) -> list[tuple[str, tuple[str, ...], int, int]]:
        spans = self._ended + [(each, since, tests + 1) for each, since in self._since.items()]
        return [(each.requirement, each.operations, since, until) for each, since, until in sorted(spans)]


# A worker process runs many jobs; their cases are read, and parts of tests kept, once.
_case = cache(load_case)


@cache
def _judge(folder: Path) -> Judge:
    return Judge(_case(folder).world())


@dataclass(frozen=True)
class _Tests:
    """The tests of a job, each with its outcome and whether values that were recorded agree with it."""

    each: Iterable[tuple[Test, Outcome, bool]]
    named_otherwise: set[Cause]  # causes that only the real program names, or does not name


def _tests(job: Job, case: Case, judge: Judge, sesamec: Path | None) -> _Tests:
    name, _, of_sesame = job.strategy.partition(":")
    if name != "sesamec":
        return _Tests(_asked(job, case, judge), set())
    if sesamec is None:
        raise Unavailable("`sesamec` needs the program: name it with --sesamec, or in the variable SESAMEC")
    searched = search(sesamec, case.space_file, case.space, job.seed, job.tests, of_sesame or None)
    outcomes = [judge.outcome(recorded.test) for recorded in searched.tests]
    named = Named(case.space)
    for recorded, outcome in zip(searched.tests, outcomes, strict=True):
        # With its own verdicts: a value that misses a bound by rounding violates it for Sesame.
        violated = frozenset(name for name, verdict in recorded.verdicts.items() if verdict == "violated")
        named.add(recorded.test, replace(outcome, violated=violated))
    each = [
        (recorded.test, outcome, agrees(recorded, outcome))
        for recorded, outcome in zip(searched.tests, outcomes, strict=True)
    ]
    return _Tests(each, searched.causes ^ named.causes())


def _asked(job: Job, case: Case, judge: Judge) -> Iterator[tuple[Test, Outcome, bool]]:
    problem = Problem(case.space, judge.world.run((), keep_messages=True), job.tests)
    strategy = strategy_class(job.strategy)(problem, job.seed)
    for _ in range(job.tests):
        test = strategy.ask()
        outcome = judge.outcome(test)
        strategy.tell(test, outcome)
        yield test, outcome, True


def agrees(recorded: Recorded, outcome: Outcome) -> bool:
    """Whether Sesame recorded the values that the judge's world has, up to rounding in the last digits."""
    return all(_close(value, outcome.values[name]) for name, value in recorded.values.items())


def _close(one: float | None, other: float | None) -> bool:
    if one is None or other is None:
        return one is other
    return math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-9)
