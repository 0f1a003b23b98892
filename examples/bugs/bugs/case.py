"""Cases: what their folders hold, and the true causes that they know."""

import hashlib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from bugs.protocol import load_simulator
from bugs.space import Choice, Parameter, Space, Test, Use, check_permitted, read_space
from bugs.world import World

# Causes of more operations are not listed: to find all of them would take more tests than anybody runs.
MOST_OPERATIONS = 2

CASES = Path(__file__).resolve().parent.parent / "cases"
# Problems of falsification: folders like those of cases, which need not list causes.
PROBLEMS = CASES.parent / "problems"


class BadCase(Exception):
    """A case's folder lacks something, or contradicts itself."""


@dataclass(frozen=True, order=True)
class Cause:
    """A requirement, and operations that together violate it while none can be left out."""

    requirement: str
    operations: tuple[str, ...]  # sorted

    def contains(self, other: "Cause") -> bool:
        """Whether the other cause is of the same requirement and has no operation that this one lacks."""
        return self.requirement == other.requirement and set(other.operations) <= set(self.operations)

    def __str__(self) -> str:
        return f"{self.requirement}: {' + '.join(self.operations)}"


def cause(requirement: str, operations: set[str] | frozenset[str] | tuple[str, ...]) -> Cause:
    """A cause, whatever the order of its operations."""
    return Cause(requirement, tuple(sorted(operations)))


@dataclass(frozen=True)
class Threshold:
    """From where on a cause's witness violates the requirement: a value of one parameter, or a length of a window."""

    operation: str
    parameter: str  # or "length", of the window from its start, in seconds
    value: float
    unit: str | None
    tolerance: float
    above: bool  # it violates above the value; otherwise below

    def applied_to(self, witness: Test, space: Space, violating: bool) -> Test:
        """The witness with the parameter beyond the threshold by the tolerance, on the side that violates or not."""
        value = self.value + (self.tolerance if self.above == violating else -self.tolerance)
        return tuple(self._changed(use, space, value) if use.operation == self.operation else use for use in witness)

    def _changed(self, use: Use, space: Space, value: float) -> Use:
        if self.parameter == "length":
            return replace(use, end=use.start + value)
        parameters = space.operations[use.operation].parameters
        choices = [
            value if parameter.name == self.parameter else choice
            for parameter, choice in zip(parameters, use.choices, strict=True)
        ]
        return replace(use, choices=tuple(choices))


@dataclass(frozen=True)
class TrueCause:
    """A cause that the case knows, with a test that shows it."""

    cause: Cause
    when: str  # when it matters, in a phrase
    witness: Test
    threshold: Threshold | None


@dataclass(frozen=True)
class Case:
    """A folder of `cases`: a simulator with a bug, the space of its tests, and its true causes."""

    folder: Path
    title: str
    field: str
    reports: tuple[str, ...]
    mechanism: str
    causes: tuple[TrueCause, ...]
    space: Space

    @property
    def name(self) -> str:
        return self.folder.name

    @property
    def space_file(self) -> Path:
        """The space in the language of Sesame."""
        return self.folder / f"{self.name}.sesame"

    @property
    def true_causes(self) -> set[Cause]:
        return {known.cause for known in self.causes}

    @cached_property
    def fingerprint(self) -> str:
        """Changes whenever tests of the case may come out differently."""
        shared = sorted(self.folder.parent.glob("*.py"))  # models that simulators have in common
        return file_hash(self.folder / "sim.py", self.folder / "plan.json", *shared)

    def world(self, simulator_seed: int = 1) -> World:
        """What runs its tests. Nothing of one world is in another."""
        return World(self.space, load_simulator(self.folder / "sim.py"), simulator_seed)


def load_cases(names: list[str] | None = None, folder: Path = CASES) -> list[Case]:
    """These cases, or all, in the order of their names."""
    return [load_case(path) for path in case_folders(names, folder)]


def case_folders(names: list[str] | None = None, folder: Path = CASES) -> list[Path]:
    """The folders of these cases, or of all: those with a space. Other files may still be missing."""
    known = sorted(path.name for path in folder.iterdir() if (path / f"{path.name}.sesame").is_file())
    unknown = sorted(set(names or ()) - set(known))
    if unknown:
        raise BadCase(f"there is no case `{unknown[0]}`; there are {', '.join(known)}")
    return [folder / name for name in known if names is None or name in names]


def load_case(folder: Path) -> Case:
    """The case of a folder. Raises `BadCase` with what is wrong."""
    try:
        facts = tomllib.loads((folder / "case.toml").read_text(encoding="utf-8"))
        space = read_space(folder / "plan.json")
        return Case(
            folder=folder,
            title=facts["title"],
            field=facts["field"],
            reports=tuple(facts["reports"]),
            mechanism=facts["mechanism"],
            causes=tuple(_true_cause(each, space) for each in facts.get("cause", ())),
            space=space,
        )
    except (OSError, tomllib.TOMLDecodeError, ValueError) as error:
        raise BadCase(f"{folder.name}: {error}") from error
    except KeyError as error:
        raise BadCase(f"{folder.name}: {error} is missing in case.toml, or not in the space") from error


def _true_cause(facts: Mapping, space: Space) -> TrueCause:
    if facts["requirement"] not in space.requirements:
        raise ValueError(f"there is no requirement `{facts['requirement']}` in the space")
    witness = tuple(_use(use, space) for use in facts["test"])
    known = cause(facts["requirement"], tuple(facts["operations"]))
    if len(known.operations) > MOST_OPERATIONS:
        raise ValueError(f"`{known}` has more than {MOST_OPERATIONS} operations")
    if set(known.operations) != {use.operation for use in witness}:
        raise ValueError(f"the test of `{known}` has other operations")
    threshold = facts.get("threshold")
    return TrueCause(known, facts["when"], witness, _threshold(threshold) if threshold else None)


def _use(facts: Mapping, space: Space) -> Use:
    """An operation of a witness: `{ operation = "order_late", from = 0.5, to = 2.0, delay = 8.0 }`."""
    operation = space.operations[facts["operation"]]
    choices = tuple(_choice(facts[parameter.name], parameter) for parameter in operation.parameters)
    use = Use(operation.name, float(facts["from"]), float(facts["to"]), choices, facts.get("seed", 1))
    check_permitted(use, operation)
    return use


def _choice(value: float | list[float] | str, parameter: Parameter) -> Choice:
    if parameter.shape in {"range", "point"}:
        return tuple(float(number) for number in value)
    return value if isinstance(value, str) else float(value)


def _threshold(facts: Mapping) -> Threshold:
    if facts["violates"] not in {"above", "below"}:
        raise ValueError('a threshold `violates` "above" or "below" its value')
    return Threshold(
        operation=facts["operation"],
        parameter=facts["parameter"],
        value=float(facts["value"]),
        unit=facts.get("unit"),
        tolerance=float(facts["tolerance"]),
        above=facts["violates"] == "above",
    )


def file_hash(*files: Path) -> str:
    """A hash of the content of files."""
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
