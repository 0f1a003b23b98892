"""What a campaign's tests may contain, read from its plan: the JSON that `sesamec generate` writes.

Only `sesamec` reads the language. A case keeps the plan of its campaign in `plan.json`, so that no compiler is needed
to run the benchmark.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

# What a test chooses for a parameter: a value, a sub-range (low, high), a point (x, y, z), or a text.
Choice = float | tuple[float, float] | tuple[float, float, float] | str

SECOND = 1_000_000_000  # in nanoseconds, in which Sesame counts


class Unsupported(Exception):
    """The plan has something that this benchmark does not implement."""


def nanoseconds(seconds: float) -> int:
    """The nearest whole number of nanoseconds; `seconds` is not negative."""
    return math.floor(seconds * 1e9 + 0.5)


@dataclass(frozen=True)
class Parameter:
    """A parameter of an operation, with what is permitted."""

    name: str
    unit: str | None
    shape: str  # "value", "range", "point" or "text"
    low: tuple[float, ...]  # one number, or three of a point
    high: tuple[float, ...]
    whole: bool
    texts: tuple[str, ...]


@dataclass(frozen=True)
class Operation:
    """An operation that tests may contain."""

    name: str
    kind: Mapping  # as in the plan: {"kind": "latency", "distribution": "fixed", "drain": "finish"}
    topic: int
    places: tuple[tuple, ...]  # paths into a message; the empty path is the message itself
    parameters: tuple[Parameter, ...]
    start: float  # it may be active from here, in seconds
    end: float  # to here
    shortest: float  # how long it may be active at a time, in seconds
    longest: float
    priority: int
    position: int  # in the order of declaration
    timed: bool

    @property
    def bounded(self) -> bool:
        """Whether its windows have a greatest length below the time in which it may be active."""
        return self.longest < self.end - self.start


@dataclass(frozen=True)
class Topic:
    """A topic, or a group of topics of one type."""

    name: str
    paths: tuple[str, ...]
    type: Mapping  # as in the plan: {"kind": "real", "unit": "m"}


@dataclass(frozen=True)
class Requirement:
    """A bound of a metric: `low` and `high`, of which one may be infinite."""

    name: str
    text: str
    metric: str
    low: float
    low_excluded: bool
    high: float
    high_excluded: bool

    def margin(self, value: float) -> float:
        """How far a value may still move before it breaks the bound, in the metric's unit; negative outside."""
        return min(value - self.low, self.high - value)

    def violated_by(self, value: float) -> bool:
        """Whether a value breaks the bound by more than rounding, a billionth of the bound."""
        bound = self.low if value < self.low else self.high
        rounding = 1e-9 * max(1.0, abs(bound)) if math.isfinite(bound) else 0.0
        excluded = (self.low_excluded and value == self.low) or (self.high_excluded and value == self.high)
        return self.margin(value) < -rounding or excluded


@dataclass(frozen=True)
class Metric:
    """A metric. Its formula is as in the plan; `fuzzing_time()` has none."""

    name: str
    formula: Mapping | None
    default: float | None
    trend: str | None  # "rising" or "falling" if its value only changes in this direction


@dataclass(frozen=True)
class Space:
    """What a campaign's tests may contain, how a run is measured, and what must hold."""

    name: str
    step: int  # nanoseconds
    end: float  # seconds
    fewest: int  # operations per test
    most: int
    topics: tuple[Topic, ...]
    messages: tuple[Mapping[str, Mapping], ...]  # by their number in types: types of fields, by name
    operations: Mapping[str, Operation]  # in the order of declaration
    metrics: Mapping[str, Metric]
    requirements: Mapping[str, Requirement]


@dataclass(frozen=True)
class Use:
    """An operation in a test: active from `start` until before `end`, in seconds."""

    operation: str
    start: float
    end: float
    choices: tuple[Choice, ...]  # in the order of the operation's parameters
    seed: int  # of its random draws


# A test: what is done to the system. The empty test is the reference run.
Test = tuple[Use, ...]


def check_permitted(use: Use, operation: Operation) -> None:
    """Raises `ValueError` for a use that no search could draw."""
    length = use.end - use.start
    if not (operation.start <= use.start and use.end <= operation.end):
        raise ValueError(f"`{use.operation}` is only permitted from {operation.start} s to {operation.end} s")
    if not operation.shortest - 1e-9 <= length <= operation.longest + 1e-9:
        raise ValueError(f"`{use.operation}` is permitted for at most {operation.longest} s at a time, not {length} s")
    for parameter, choice in zip(operation.parameters, use.choices):
        if parameter.shape == "text":
            permitted = choice in parameter.texts
        else:
            numbers = choice if isinstance(choice, tuple) else (choice,)
            low, high = (3 * end if parameter.shape == "range" else end for end in (parameter.low, parameter.high))
            permitted = all(least <= number <= most for least, number, most in zip(low, numbers, high))
        if not permitted:
            raise ValueError(f"`{parameter.name}` of `{use.operation}` may not be {choice}")


def read_space(plan_file: Path) -> Space:
    """The space of a plan. Raises `Unsupported` for what this benchmark does not implement."""
    return space_of(json.loads(plan_file.read_text(encoding="utf-8")))


def space_of(plan: Mapping) -> Space:
    """The space of a plan that was read."""
    campaign, transport = plan["campaign"], plan["simulator"]["transport"]
    if transport["kind"] != "process" or "step_ns" not in transport:
        raise Unsupported("the simulator is not a stepped program")
    if campaign["activation"]["kind"] != "time":
        raise Unsupported("the campaign activates operations by conditions")
    end = campaign["end_after"]
    metrics = [_metric(metric) for metric in plan["metrics"]]
    operations = [_operation(plan["operations"][number], number, end) for number in campaign["operations"]]
    return Space(
        name=plan["space"],
        step=transport["step_ns"],
        end=end,
        fewest=campaign["count"]["min"],
        most=campaign["count"]["max"],
        topics=tuple(Topic(topic["name"], tuple(topic["paths"]), topic["type"]) for topic in plan["topics"]),
        messages=tuple({field["name"]: field["type"] for field in each["fields"]} for each in plan["messages"]),
        operations={operation.name: operation for operation in operations},
        metrics={metric.name: metric for metric in metrics},
        requirements={
            requirement["name"]: _requirement(requirement, metrics) for requirement in plan["requirements"]
        },
    )


def _operation(plan: Mapping, position: int, end: float) -> Operation:
    if plan.get("topic") is None or "from" in plan or "to" in plan:
        raise Unsupported(f"operation `{plan['name']}` acts on nodes")
    within = plan["within"]
    start, until = within["start"], min(within["end"], end)
    lengths = plan.get("lengths") or {"low": 0.0, "high": until - start}
    return Operation(
        name=plan["name"],
        kind=plan["kind"],
        topic=plan["topic"],
        places=tuple(tuple(map(_step, place)) for place in plan.get("places", ())) or ((),),
        parameters=tuple(_parameter(parameter) for parameter in plan["parameters"]),
        start=start,
        end=until,
        shortest=lengths["low"],
        longest=min(lengths["high"], until - start),
        priority=plan["priority"],
        position=position,
        timed=plan.get("timed", True),
    )


def _step(step: str | Mapping) -> str | int | None:
    """A step into a message: the name of a field, the position of an element, or `None` for each element."""
    return None if step == "each" else step["field"] if "field" in step else step["element"]


def _parameter(plan: Mapping) -> Parameter:
    domain = plan["domain"]
    match domain["kind"]:
        case "number":
            shape, low, high = domain["shape"], (domain["low"],), (domain["high"],)
        case "point":
            shape, low, high = "point", tuple(domain["low"]), tuple(domain["high"])
        case "texts":
            shape, low, high = "text", (), ()
        case other:
            raise Unsupported(f"parameter `{plan['name']}` is of kind {other}")
    return Parameter(
        plan["name"], plan["unit"], shape, low, high, domain.get("integer", False), tuple(domain.get("texts", ()))
    )


def _metric(plan: Mapping) -> Metric:
    source = plan["source"]
    if source["kind"] == "last":
        inputs = [{"field": source["input"], "members": "min"}]
        formula = {"inputs": inputs, "aggregate": {"kind": "last", "of": {"input": 0}}}
    elif source["kind"] == "formula":
        formula = source["formula"]
    elif source["kind"] == "fuzzing_time":
        formula = None
    else:
        raise Unsupported(f"metric `{plan['name']}` is a {source['kind']}")
    return Metric(plan["name"], formula, plan["default"], plan.get("trend"))


def _requirement(plan: Mapping, metrics: list[Metric]) -> Requirement:
    bound = plan["bound"]
    low, high = -math.inf, math.inf
    match bound["kind"]:
        case "at_most" | "below":
            high = bound["value"]
        case "at_least" | "above":
            low = bound["value"]
        case "equal":
            low = high = bound["value"]
        case "within":
            low, high = bound["low"], bound["high"]
    return Requirement(
        name=plan["name"],
        text=plan["text"],
        metric=metrics[plan["metric"]].name,
        low=low,
        low_excluded=bound["kind"] == "above",
        high=high,
        high_excluded=bound["kind"] == "below",
    )
