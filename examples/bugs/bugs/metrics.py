"""Metrics of a run, computed from the messages that the simulator publishes, as docs/language/metrics.md says.

What a plan's formulas may contain: `last`, `min`, `max`, `mean`, `count`, `duration`, `when`, all arithmetic, points,
regions, texts, groups (`each of`, `each pair of`, `max of`, `sum of`). What is missing raises `Unsupported`: hooks,
`robustness`, `every`, `per`, `outbound`, and `time` where it changes a value without a message.
"""

import math
import operator
from collections.abc import Callable, Iterable, Mapping
from functools import reduce
from itertools import combinations

from bugs.protocol import Value
from bugs.space import Metric, Space, Unsupported

# The value of an input: a point, or a number (true is 1) followed by zeros.
Held = tuple[float, float, float]
# A number computed from the inputs and the time in seconds.
Number = Callable[[list[Held], float], float]

_MEMBERS = {"each", "first", "second"}
_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "at_most": lambda left, right: left <= right,
    "below": lambda left, right: left < right,
    "at_least": lambda left, right: left >= right,
    "above": lambda left, right: left > right,
    "equal": lambda left, right: left == right,
    "not_equal": lambda left, right: left != right and not math.isnan(left) and not math.isnan(right),
}
_UNARY: dict[str, Callable[[float], float]] = {
    "sqrt": math.sqrt, "sin": math.sin, "cos": math.cos, "tan": math.tan, "asin": math.asin, "acos": math.acos,
    "atan": math.atan, "exp": math.exp, "ln": math.log,
}  # fmt: skip
# From left to right; unlike `sum` and `math.prod`, they begin with the first number.
_JOINS: dict[str, Callable[[float, float], float]] = {
    "sum": operator.add, "product": operator.mul, "min": min, "max": max,
}  # fmt: skip
_BINARY: dict[str, Callable[[float, float], float]] = {"atan2": math.atan2, "hypot": math.hypot, "pow": math.pow}


class Formula:
    """A metric's formula in one run."""

    def __init__(self, metric: Metric, space: Space) -> None:
        formula = metric.formula
        _check(metric.name, formula)
        self.inputs = formula["inputs"]
        self.kind = formula["aggregate"]["kind"]
        of, when = formula["aggregate"]["of"], formula.get("when")
        self.counts = _holds(when) if when is not None else None
        self.condition = _holds(of) if self.kind in {"count", "duration"} else None
        self.number = None if self.condition else _number(of)
        members = [len(space.topics[each["field"]["topic"]].paths) for each in self.inputs]
        self.held: list[list[Held | None]] = [[None] * count for count in members]
        # A formula that combines several topics or members is evaluated once per instant, any other at each message.
        topics = {each["field"]["topic"] for each in self.inputs}
        joined = any(each["members"] not in {"each"} and n > 1 for each, n in zip(self.inputs, members))
        self.once_per_instant = joined or len(topics) > 1
        self.grouping = next((each["members"] for each in self.inputs if each["members"] in _MEMBERS), None)
        self.size = max(members)
        self.spoke: set[int] | None = None  # members with a message in this instant; `None` without any
        self.all_concerned = False
        self.tallies: dict[object, _Tally] = {}
        self.not_finite = False

    def hear(self, now: int, topic: int, member: int, value: Value) -> None:
        """A message on a path of a topic."""
        for at, each in enumerate(self.inputs):
            if each["field"]["topic"] != topic:
                continue
            held = _read(value, each)
            if not all(map(math.isfinite, held)):
                self.not_finite, held = True, (math.nan, math.nan, math.nan)
            self.held[at][member] = held
            self.spoke = self.spoke or set()
            if each["members"] in _MEMBERS:
                self.spoke.add(member)
            else:
                self.all_concerned = True
        if not self.once_per_instant:
            self.settle(now)

    def settle(self, now: int) -> None:
        """All messages of the instant are known."""
        if self.spoke is None:
            return
        for key, members in self._concerned():
            inputs = [self._input(at, members) for at in range(len(self.inputs))]
            if None not in inputs:
                tally = self.tallies.setdefault(key, _Tally())
                if any(math.isnan(held[0]) for held in inputs):
                    tally.stop(now)
                else:
                    self._take(tally, inputs, now)
        self.spoke, self.all_concerned = None, False

    def value(self, end: int) -> float | None:
        """The metric's value if the run ends at this time; `None` if it was never set."""
        tallies = [tally for tally in self.tallies.values() if tally.value is not None]
        if not tallies:
            return None
        match self.kind:
            case "duration":
                return sum(tally.held_until(end) for tally in tallies) / 1e9
            case "count":
                return sum(tally.value for tally in tallies)
            case "max":
                return max(tally.value for tally in tallies)
            case "mean":
                return min(tally.sum / tally.count for tally in tallies)
            case _:
                return min(tally.value for tally in tallies)

    def _concerned(self) -> Iterable[tuple[object, tuple[int, ...]]]:
        """What is to be evaluated: the key of its tally, and the members that stand for the group."""
        if self.grouping is None:
            return [(None, ())]
        concerned = set(range(self.size)) if self.all_concerned else self.spoke
        if self.grouping == "each":
            # Means and last values are those of all messages, of whatever member.
            return [(member if self.kind == "duration" else None, (member, member)) for member in sorted(concerned)]
        return [(pair, pair) for pair in combinations(range(self.size), 2) if concerned & set(pair)]

    def _input(self, at: int, members: tuple[int, ...]) -> Held | None:
        how, held = self.inputs[at]["members"], self.held[at]
        if how in _MEMBERS:
            return held[members[1 if how == "second" else 0]]
        known = [each for each in held if each is not None]
        if len(held) == 1 or not known:
            return known[0] if known else None
        join = {"min": min, "max": max, "sum": sum}[how]
        numbers = [number for number, _, _ in known]
        return (math.nan if any(map(math.isnan, numbers)) else join(numbers), 0.0, 0.0)

    def _take(self, tally: "_Tally", inputs: list[Held], now: int) -> None:
        time = now / 1e9
        counts = self.counts is None or self.counts(inputs, time)
        if self.kind == "duration":
            tally.hold(now, counts and self.condition(inputs, time))
        elif self.kind == "count":
            tally.value = (tally.value or 0.0) + (counts and self.condition(inputs, time))
        elif counts:
            number = self.number(inputs, time)
            if math.isfinite(number):
                tally.add(number, self.kind)


class _Tally:
    """What has been aggregated. Times are in nanoseconds."""

    def __init__(self) -> None:
        self.value: float | None = None
        self.sum, self.count = 0.0, 0
        self.held, self.since = 0, None

    def add(self, number: float, kind: str) -> None:
        self.sum, self.count = self.sum + number, self.count + 1
        if self.value is None or kind in {"last", "mean"}:
            self.value = number
        else:
            self.value = min(self.value, number) if kind == "min" else max(self.value, number)

    def hold(self, now: int, holds: bool) -> None:
        self.value = 0.0
        if not holds:
            self.stop(now)
        elif self.since is None:
            self.since = now

    def stop(self, now: int) -> None:
        self.held, self.since = self.held_until(now), None

    def held_until(self, now: int) -> int:
        return self.held if self.since is None else self.held + now - self.since


def _number(of: Mapping | str) -> Number:
    """An expression as a function of the inputs and the time in seconds. It is NaN where a function has no value."""
    if of == "time":
        return lambda _inputs, time: time
    ((kind, operand),) = of.items()
    match kind:
        case "constant":
            return lambda _inputs, _time: operand
        case "input":
            return lambda inputs, _time: inputs[operand][0]
        case "negate":
            part = _number(operand)
            return lambda inputs, time: -part(inputs, time)
        case "absolute":
            part = _number(operand)
            return lambda inputs, time: abs(part(inputs, time))
        case "sum" | "product" | "min" | "max":
            parts, join = [_number(each) for each in operand], _JOINS[kind]
            return lambda inputs, time: reduce(join, (part(inputs, time) for part in parts))
        case "divide":
            return _function(lambda a, b: a / b, operand["value"], operand["by"])
        case "unary":
            return _function(_UNARY[operand["function"]], operand["of"])
        case "binary":
            return _function(_BINARY[operand["function"]], operand["left"], operand["right"])
        case "distance":
            start, end, scale = _point(operand["from"]), _point(operand["to"]), operand["scale"]
            return lambda inputs, _time: math.dist(start(inputs), [scale * number for number in end(inputs)])
        case "signed_distance":
            point, region = _point(operand["from"]), operand["to"]
            return lambda inputs, _time: _signed_distance(point(inputs), region)
        case _:
            raise Unsupported(f"an expression of kind {kind}")


def _holds(of: Mapping) -> Callable[[list[Held], float], bool]:
    """A condition, likewise."""
    ((kind, operand),) = of.items()
    match kind:
        case "constant":
            return lambda _inputs, _time: operand
        case "input":
            return lambda inputs, _time: inputs[operand][0] != 0.0
        case "compare":
            left, right, by = _number(operand["left"]), _number(operand["right"]), _COMPARISONS[operand["by"]]
            return lambda inputs, time: by(left(inputs, time), right(inputs, time))
        case "same":
            one, other = _holds(operand["left"]), _holds(operand["right"])
            return lambda inputs, time: one(inputs, time) == other(inputs, time)
        case "all" | "any":
            parts, join = [_holds(each) for each in operand], {"all": all, "any": any}[kind]
            return lambda inputs, time: join(part(inputs, time) for part in parts)
        case "not":
            part = _holds(operand)
            return lambda inputs, time: not part(inputs, time)
        case _:
            raise Unsupported(f"a condition of kind {kind}")


def _point(of: int | list[float]) -> Callable[[list[Held]], Iterable[float]]:
    return (lambda inputs: inputs[of]) if isinstance(of, int) else (lambda _inputs: of)


def _function(function: Callable[..., float], *arguments: Mapping | str) -> Number:
    parts = [_number(argument) for argument in arguments]
    return lambda inputs, time: _defined(function, *(part(inputs, time) for part in parts))


def _defined(function: Callable[..., float], *arguments: float) -> float:
    try:
        return function(*arguments)
    except (ValueError, ZeroDivisionError, OverflowError):
        return math.nan


def _read(value: Value, of: Mapping) -> Held:
    """The value of an input in a message."""
    for name in of["field"]["path"]:
        value = value["xyz".index(name)] if isinstance(value, (list, tuple)) else value[name]
    text = of.get("text")
    if text is not None:
        value = value == text["is"] if "is" in text else value != text["is_not"]
    return tuple(map(float, value)) if isinstance(value, (list, tuple)) else (float(value), 0.0, 0.0)


def _signed_distance(point: Iterable[float], region: Mapping) -> float:
    """How far a point is from a region's boundary: positive outside, negative inside."""
    x, y, z = point
    ((kind, shape),) = region.items()
    if kind == "box":
        beyond = [max(low - at, at - high) for at, low, high in zip((x, y, z), shape["low"], shape["high"])]
        return math.hypot(*(max(0.0, out) for out in beyond)) if max(beyond) > 0.0 else max(beyond)
    nearest, inside = math.inf, False
    corners = shape["corners"]
    for (from_x, from_y), (to_x, to_y) in zip(corners[-1:] + corners[:-1], corners):
        along_x, along_y = to_x - from_x, to_y - from_y
        share = ((x - from_x) * along_x + (y - from_y) * along_y) / (along_x**2 + along_y**2)
        share = max(0.0, min(1.0, share))
        nearest = min(nearest, math.hypot(x - from_x - share * along_x, y - from_y - share * along_y))
        if (from_y > y) != (to_y > y) and x - from_x < along_x * (y - from_y) / along_y:
            inside = not inside
    return -nearest if inside else nearest


def _check(name: str, formula: Mapping) -> None:
    """Refuses what is not implemented."""
    lacking = [clause for clause in ("every", "per") if formula.get(clause) is not None]
    if formula.get("side", "inbound") != "inbound":
        lacking.append("outbound")
    aggregate = formula["aggregate"]
    if aggregate["kind"] in {"min", "max", "duration"} and _mentions_time([aggregate["of"], formula.get("when")]):
        lacking.append("time")
    if lacking:
        raise Unsupported(f"metric `{name}` uses {', '.join(lacking)}")


def _mentions_time(part: object) -> bool:
    if isinstance(part, Mapping):
        return any(map(_mentions_time, part.values()))
    return part == "time" or (isinstance(part, list) and any(map(_mentions_time, part)))
