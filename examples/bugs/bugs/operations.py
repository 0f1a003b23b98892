"""What an active operation does to one message: an implementation of docs/language/operations.md of its own."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from bugs.draws import Draws
from bugs.protocol import Value
from bugs.space import Choice, Operation, Space, Unsupported, nanoseconds

_DRAWS_PER_VALUE = 8
_WHOLE = (-(1 << 63), (1 << 63) - 1)


@dataclass(frozen=True)
class Moment:
    """The circumstances in which an active operation meets a message. Times are in nanoseconds."""

    now: int
    active: int  # for how long the operation has been active
    member: int  # which path of the operation's topic
    draws: Draws


class Fate(NamedTuple):
    """What becomes of a message."""

    value: Value
    dropped: bool = False
    delay: int | None = None  # nanoseconds
    copies: int = 0


class Places:
    """The values in a topic's messages that an operation acts on."""

    def __init__(self, operation: Operation, space: Space) -> None:
        self.paths = operation.places
        self.type = space.topics[operation.topic].type
        self.messages = space.messages

    def change(self, value: Value, change: Callable[[Value, str, int], Value]) -> Value:
        """The message with `change(value, kind of its type, number of its first draw)` at each place. Parts that a
        message lacks are skipped. The number depends on the place and the position in its list alone."""
        for at, path in enumerate(self.paths):
            value, _ = self._visit(value, self.type, path, (at << 32) * _DRAWS_PER_VALUE, change)
        return value

    def read(self, value: Value) -> dict[int, Value]:
        """The values at these places, by the numbers of their first draws."""
        found: dict[int, Value] = {}

        def note(value: Value, _kind: str, number: int) -> Value:
            found[number] = value
            return value

        self.change(value, note)
        return found

    def write(self, value: Value, found: dict[int, Value]) -> Value:
        """The message with values that `read` found in another one; where that one had none, its own."""
        return self.change(value, lambda value, _kind, number: found.get(number, value))

    def _visit(
        self, value: Value, type_: dict, path: tuple, number: int, change: Callable[[Value, str, int], Value]
    ) -> tuple[Value, int]:
        if not path:
            return change(value, type_["kind"], number), number + _DRAWS_PER_VALUE
        step, rest = path[0], path[1:]
        if isinstance(step, str):
            new, number = self._visit(value[step], self.messages[type_["id"]][step], rest, number, change)
            return {**value, step: new}, number
        elements = list(value)
        for at in range(len(elements)) if step is None else [step]:
            if at < len(elements):
                elements[at], number = self._visit(elements[at], type_["of"], rest, number, change)
        return elements, number


def _nearest(number: float) -> int:
    """The nearest whole number of 64 bits; halves are rounded away from zero."""
    whole = math.floor(abs(number) + 0.5)
    return max(_WHOLE[0], min(_WHOLE[1], whole if number > 0 else -whole))


def _added(value: Value, kind: str, by: Callable[[int], float]) -> Value:
    """A number plus `by(0)`, or a point plus `by(axis)`; other values as they are."""
    match kind:
        case "real":
            return value + by(0)
        case "int":
            return max(_WHOLE[0], min(_WHOLE[1], int(value) + _nearest(by(0))))
        case "point":
            return [coordinate + by(axis) for axis, coordinate in enumerate(value)]
        case _:
            return value


def _replaced(value: Value, kind: str, by: Callable[[int, float], float]) -> Value:
    """`by(0, number)` of a number, `by(axis, coordinate)` of a point; other values as they are."""
    match kind:
        case "real":
            return by(0, value)
        case "int":
            return _nearest(by(0, value))
        case "point":
            return [by(axis, coordinate) for axis, coordinate in enumerate(value)]
        case _:
            return value


class Disturbance:
    """An operation with the choices of one test, and its state in one run. This one passes messages on."""

    holds_order = False  # messages wait behind those that it holds
    drain: str | None = None  # what happens to held messages at the end: "finish", "flush" or "drop"

    def begin(self) -> None:
        """It becomes active."""

    def observe(self, now: int, member: int, value: Value) -> None:
        """A message passes while it is not active."""

    def meet(self, at: Moment, value: Value) -> Fate:
        """A message passes while it is active."""
        return Fate(value)


class Change(Disturbance):
    """Changes values by a function of the value, the kind of its type, its first draw's number, and the moment."""

    def __init__(self, places: Places, new: Callable[[Value, str, int, Moment], Value]) -> None:
        self.places, self.new = places, new

    def meet(self, at: Moment, value: Value) -> Fate:
        return Fate(self.places.change(value, lambda value, kind, number: self.new(value, kind, number, at)))


class RandomWalk(Disturbance):
    """Adds a Brownian motion that begins at 0 with each activation."""

    def __init__(self, places: Places, sigma: float) -> None:
        self.places, self.sigma = places, sigma
        self.walks: dict[tuple[int, int], tuple[int, list[float]]] = {}

    def begin(self) -> None:
        self.walks = {}

    def meet(self, at: Moment, value: Value) -> Fate:
        def step(value: Value, kind: str, number: int) -> Value:
            before, offset = self.walks.get((at.member, number), (0, [0.0, 0.0, 0.0]))
            deviation = self.sigma * math.sqrt((at.active - before) / 1e9)
            offset = [x + deviation * at.draws.normal(number + 2 * axis) for axis, x in enumerate(offset)]
            self.walks[at.member, number] = at.active, offset
            return _added(value, kind, lambda axis: offset[axis])

        return Fate(self.places.change(value, step))


class Freeze(Disturbance):
    """Repeats the last values from before it became active, or else the first ones."""

    def __init__(self, places: Places) -> None:
        self.places = places
        self.last: dict[int, dict[int, Value]] = {}

    def observe(self, now: int, member: int, value: Value) -> None:
        self.last[member] = self.places.read(value)

    def meet(self, at: Moment, value: Value) -> Fate:
        if at.member not in self.last:
            self.observe(at.now, at.member, value)
        return Fate(self.places.write(value, self.last[at.member]))


class Stale(Disturbance):
    """Repeats the latest values that are at least so old, or else the first ones."""

    def __init__(self, places: Places, age: int) -> None:
        self.places, self.age = places, age
        self.past: dict[int, deque[tuple[int, dict[int, Value]]]] = {}

    def observe(self, now: int, member: int, value: Value) -> None:
        past = self.past.setdefault(member, deque())
        past.append((now, self.places.read(value)))
        while len(past) > 1 and past[1][0] + self.age <= now:
            past.popleft()

    def meet(self, at: Moment, value: Value) -> Fate:
        self.observe(at.now, at.member, value)
        return Fate(self.places.write(value, self.past[at.member][0][1]))


class Loss(Disturbance):
    """Drops each message with a probability, independently."""

    def __init__(self, loss: float) -> None:
        self.loss = loss

    def meet(self, at: Moment, value: Value) -> Fate:
        return Fate(value, dropped=at.draws.unit(0) < self.loss)


class BurstLoss(Disturbance):
    """Drops messages in bursts: a Markov chain with a transition before each message (Gilbert and Elliott)."""

    def __init__(self, enter: float, leave: float, loss: float) -> None:
        self.enter, self.leave, self.loss = enter, leave, loss
        self.bursting: set[int] = set()

    def begin(self) -> None:
        self.bursting = set()

    def meet(self, at: Moment, value: Value) -> Fate:
        if at.draws.unit(0) < (self.leave if at.member in self.bursting else self.enter):
            self.bursting ^= {at.member}
        return Fate(value, dropped=at.member in self.bursting and at.draws.unit(1) < self.loss)


class RateLimit(Disturbance):
    """Drops messages that follow the last one that passed within the period."""

    def __init__(self, period: int) -> None:
        self.period = period
        self.passed: dict[int, int] = {}

    def begin(self) -> None:
        self.passed = {}

    def meet(self, at: Moment, value: Value) -> Fate:
        if at.member in self.passed and at.now < self.passed[at.member] + self.period:
            return Fate(value, dropped=True)
        self.passed[at.member] = at.now
        return Fate(value)


class Latency(Disturbance):
    """Delays messages, which keep their order."""

    holds_order = True

    def __init__(self, low: float, high: float, distribution: str, drain: str) -> None:
        self.low, self.high, self.distribution, self.drain = low, high, distribution, drain

    def meet(self, at: Moment, value: Value) -> Fate:
        return Fate(value, delay=nanoseconds(self._delay(at.draws)))

    def _delay(self, draws: Draws) -> float:
        if self.low == self.high:
            return self.low
        if self.distribution == "normal":
            normals = (draws.normal(2 * attempt) for attempt in range(16))
            drawn = next((normal for normal in normals if abs(normal) <= 2.0), 0.0)
            return max(self.low, min(self.high, (self.low + self.high) / 2 + (self.high - self.low) / 4 * drawn))
        return self.low + draws.unit(0) * (self.high - self.low)


class Reorder(Disturbance):
    """Delays each message by a draw of its own, so later ones overtake it."""

    def __init__(self, window: float, drain: str) -> None:
        self.window, self.drain = window, drain

    def meet(self, at: Moment, value: Value) -> Fate:
        return Fate(value, delay=nanoseconds(at.draws.unit(0) * self.window))


class Duplicate(Disturbance):
    """Sends copies right after each message."""

    def __init__(self, copies: int) -> None:
        self.copies = copies

    def meet(self, at: Moment, value: Value) -> Fate:
        return Fate(value, copies=self.copies)


def disturbance(operation: Operation, choices: tuple[Choice, ...], space: Space) -> Disturbance:
    """An operation with the choices of a test. Raises `Unsupported` for kinds that act outside of messages."""
    chosen = {parameter.name: choice for parameter, choice in zip(operation.parameters, choices, strict=True)}
    places, kind = Places(operation, space), operation.kind
    match kind["kind"]:
        case "bias":
            return _shift(places, chosen["bias"])
        case "clock_skew":
            return _shift(places, chosen["skew"])
        case "drift":
            rate = _per_axis(chosen["rate"])
            return Change(
                places,
                lambda value, type_, _number, at: _added(value, type_, lambda axis: rate[axis] * (at.active / 1e9)),
            )
        case "noise":
            sigma = chosen["sigma"]
            return Change(
                places,
                lambda value, type_, number, at: _added(
                    value, type_, lambda axis: sigma * at.draws.normal(number + 2 * axis)
                ),
            )
        case "random_walk":
            return RandomWalk(places, chosen["sigma"])
        case "random_value":
            return _random_value(places, kind, chosen)
        case "random_text":
            texts = kind["texts"]
            return Change(places, lambda _value, _type, number, at: texts[int(at.draws.unit(number) * len(texts))])
        case "scale":
            factor = chosen["factor"]
            return Change(places, lambda value, type_, _number, _at: _replaced(value, type_, lambda _, x: x * factor))
        case "stuck_at":
            return _stuck_at(places, kind["truth"], chosen.get("value"))
        case "not_finite":
            number = {"nan": math.nan, "infinity": math.inf, "minus_infinity": -math.inf}[kind["number"]]
            return Change(
                places,
                lambda value, type_, _number, _at: (
                    value if type_ == "int" else _replaced(value, type_, lambda _axis, _x: number)
                ),
            )
        case "freeze":
            return Freeze(places)
        case "stale":
            return Stale(places, nanoseconds(chosen["age"]))
        case "packet_loss":
            return Loss(chosen["loss"])
        case "burst_loss":
            return BurstLoss(chosen["enter"], chosen["leave"], chosen.get("loss", 1.0))
        case "blackhole":
            return Loss(1.0)
        case "rate_limit":
            return RateLimit(nanoseconds(1.0 / chosen["rate"]))
        case "latency":
            return Latency(*_range(chosen["delay"]), kind["distribution"], kind["drain"])
        case "reorder":
            return Reorder(chosen["window"], kind["drain"])
        case "duplicate":
            return Duplicate(int(chosen["copies"]))
        case other:
            raise Unsupported(f"operation `{operation.name}` is of kind {other}")


def _per_axis(choice: Choice) -> tuple[float, ...]:
    return choice if isinstance(choice, tuple) else (choice, choice, choice)


def _range(choice: Choice) -> tuple[float, float]:
    return choice if isinstance(choice, tuple) else (choice, choice)


def _shift(places: Places, by: Choice) -> Disturbance:
    axes = _per_axis(by)
    return Change(places, lambda value, type_, _number, _at: _added(value, type_, lambda axis: axes[axis]))


def _stuck_at(places: Places, truth: bool | None, constant: Choice | None) -> Disturbance:
    if truth is not None:
        return Change(places, lambda _value, _type, _number, _at: truth)
    if isinstance(constant, str):
        return Change(places, lambda _value, _type, _number, _at: constant)
    axes = _per_axis(constant)
    return Change(places, lambda value, type_, _number, _at: _replaced(value, type_, lambda axis, _x: axes[axis]))


def _random_value(places: Places, kind: dict, chosen: dict[str, Choice]) -> Disturbance:
    names = ("x", "y", "z") if "x" in chosen else 3 * (("offset",) if kind["mode"] == "offset" else ("value",))
    ranges = [_range(chosen[name]) for name in names]

    def draw(axis: int, unit: float) -> float:
        low, high = ranges[axis]
        if kind["integer"]:
            return min(high, math.floor(low + unit * (high - low + 1.0)))
        return low + unit * (high - low)

    def new(value: Value, type_: str, number: int, at: Moment) -> Value:
        if kind["mode"] == "offset":
            return _added(value, type_, lambda axis: draw(axis, at.draws.unit(number + axis)))
        return _replaced(value, type_, lambda axis, _x: draw(axis, at.draws.unit(number + axis)))

    return Change(places, new)
