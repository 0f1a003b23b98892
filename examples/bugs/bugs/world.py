"""A case in one process: runs a test on its simulator, with operations and metrics that share no code with Sesame."""

import heapq
import math
from collections import deque
from dataclasses import dataclass, field, replace

from bugs.draws import Draws, derived_seed
from bugs.metrics import Formula
from bugs.operations import Disturbance, Fate, Moment, disturbance
from bugs.protocol import Bus, Simulator, Value
from bugs.space import SECOND, Operation, Requirement, Space, Test, Use, nanoseconds


@dataclass(frozen=True)
class Message:
    """A message as it was published, before operations."""

    time: float  # seconds
    topic: str  # its path
    value: Value


@dataclass(frozen=True)
class Outcome:
    """What came out of a test."""

    values: dict[str, float | None]  # of metrics; `None` if one was never set and has no default
    margins: dict[str, float]  # of requirements: how far the metric may still move; negative if violated
    violated: frozenset[str]  # names of requirements
    effects: tuple[int, ...]  # per use of an operation: the messages that it changed, dropped, delayed or added
    fuzzing_time: float  # seconds in which operations were active or still held messages back
    crash: str | None = None  # what the simulator raised
    messages: tuple[Message, ...] = ()  # only if they were asked for

    @property
    def no_effect(self) -> bool:
        """Whether no operation had any effect."""
        return not any(self.effects)


class World:
    """Runs tests. Equal tests have equal outcomes."""

    def __init__(self, space: Space, simulator: type[Simulator], seed: int = 1) -> None:
        self.space, self.simulator, self.seed = space, simulator, seed

    def run(self, test: Test, keep_messages: bool = False) -> Outcome:
        """Runs a test from time zero to the end of the campaign."""
        space = self.space
        measured = _Measured(space, keep_messages)
        relay = _Relay(space, test, self.simulator.subscribes)
        bus = _LocalBus(relay, measured)
        end, now, crash = nanoseconds(space.end), 0, None
        try:
            simulator = self.simulator(self.seed, space.step / SECOND)
            while now + space.step <= end:
                now += space.step
                relay.advance(now, bus)
                simulator.step(now / SECOND, bus)
                measured.settle(now)
        except Exception as error:  # of the simulator: its test is a crash, as in Sesame
            crash, end = f"{type(error).__name__}: {error}", now
        return measured.outcome(relay, end, crash)


class _LocalBus(Bus):
    def __init__(self, relay: "_Relay", measured: "_Measured") -> None:
        super().__init__(relay.subscribed)
        self.relay, self.measured = relay, measured

    def publish(self, topic: str, value: Value) -> None:
        self.measured.hear(self.relay.now, topic, value)
        self.relay.publish(topic, value, self)


class _Measured:
    """The metrics of a run."""

    def __init__(self, space: Space, keep_messages: bool) -> None:
        self.space = space
        self.where = {
            path: (at, member) for at, topic in enumerate(space.topics) for member, path in enumerate(topic.paths)
        }
        self.formulas = {name: Formula(metric, space) for name, metric in space.metrics.items() if metric.formula}
        self.readers: dict[int, list[Formula]] = {}
        for formula in self.formulas.values():
            for topic in {each["field"]["topic"] for each in formula.inputs}:
                self.readers.setdefault(topic, []).append(formula)
        self.messages: list[Message] | None = [] if keep_messages else None

    def hear(self, now: int, path: str, value: Value) -> None:
        topic, member = self.where[path]
        for formula in self.readers.get(topic, ()):
            formula.hear(now, topic, member, value)
        if self.messages is not None:
            self.messages.append(Message(now / SECOND, path, value))

    def settle(self, now: int) -> None:
        for formula in self.formulas.values():
            if formula.once_per_instant:
                formula.settle(now)

    def outcome(self, relay: "_Relay", end: int, crash: str | None) -> Outcome:
        fuzzing_time = relay.fuzzing_time(end)
        values: dict[str, float | None] = {}
        for name, metric in self.space.metrics.items():
            value = self.formulas[name].value(end) if name in self.formulas else fuzzing_time
            values[name] = metric.default if value is None else value
        margins, violated = {}, set()
        for requirement in self.space.requirements.values():
            value = values[requirement.metric]
            margins[requirement.name] = math.inf if value is None else requirement.margin(value)
            if value is not None and self._is_violated(requirement, value, crash is None):
                violated.add(requirement.name)
        effects = tuple(stage.effects for stage in relay.stages)
        return Outcome(
            values, margins, frozenset(violated), effects, fuzzing_time, crash, tuple(self.messages or ())
        )

    def _is_violated(self, requirement: Requirement, value: float, complete: bool) -> bool:
        """After a crash, or a number that is not finite, only a metric that could not have improved counts."""
        metric, formula = self.space.metrics[requirement.metric], self.formulas.get(requirement.metric)
        if not requirement.violated_by(value):
            return False
        if complete and (formula is None or not formula.not_finite):
            return True
        measured = formula is None or bool(formula.tallies)
        return measured and metric.trend == ("rising" if value >= requirement.high else "falling")


@dataclass
class _Stage:
    """An operation of the test that runs. Times are in nanoseconds."""

    operation: Operation
    disturbance: Disturbance
    start: int
    end: int
    seed: int
    active: bool = False
    effects: int = 0
    active_time: int = 0
    held: dict[str, int] = field(default_factory=dict)  # per path: how many messages it holds
    last_release: dict[str, int] = field(default_factory=dict)
    tail_since: int | None = None

    @property
    def holds(self) -> bool:
        return any(self.held.values())

    def end_tail(self, now: int) -> None:
        if self.tail_since is not None:
            self.active_time += now - self.tail_since
            self.tail_since = None


@dataclass(frozen=True)
class _Passing:
    """A message on its way through the operations on its topic."""

    path: str
    key: int  # of its random draws: its number on its path, or a number of its own for a copy
    value: Value
    next_stage: int = 0


class _Relay:
    """Passes messages from publishers to subscribers through the operations of a test."""

    def __init__(self, space: Space, test: Test, subscribes: tuple[str, ...]) -> None:
        self.now = 0
        self.subscribed = subscribes
        self.stages = [_stage(use, space) for use in test]
        order = sorted(range(len(test)), key=lambda at: _precedence(self.stages[at].operation, at))
        # Per path: the stages that a message passes, each with the path's place in its topic.
        self.pipelines: dict[str, list[tuple[int, int]]] = {}
        for at in order:
            for member, path in enumerate(space.topics[self.stages[at].operation.topic].paths):
                self.pipelines.setdefault(path, []).append((at, member))
        starts = [(stage.start, at, True) for at, stage in enumerate(self.stages) if stage.start < stage.end]
        ends = [(stage.end, at, False) for at, stage in enumerate(self.stages) if stage.start < stage.end]
        self.edges = deque(sorted(starts + ends))
        self.published: dict[str, int] = {}
        self.queue: list[tuple[int, int, int, _Passing]] = []  # release, order of arrival, stage, message
        self.arrivals = 0
        self._carry_out_edges()

    def advance(self, now: int, bus: Bus) -> None:
        """Carries out, in order of time, edges of windows and releases up to `now`; at one instant edges come first."""
        while True:
            due = [self.edges[0][0]] if self.edges else []
            due += [self.queue[0][0]] if self.queue else []
            if not due or min(due) > now:
                break
            self.now = max(self.now, min(due))
            self._carry_out_edges()
            while self.queue and self.queue[0][0] <= self.now:
                _, _, at, message = heapq.heappop(self.queue)
                stage = self.stages[at]
                stage.held[message.path] -= 1
                if not stage.holds:
                    stage.end_tail(self.now)
                self._pass(message, bus)
        self.now = now

    def publish(self, path: str, value: Value, bus: Bus) -> None:
        """A part of the simulator publishes a message now."""
        if path in self.pipelines:
            number = self.published.get(path, 0)
            self.published[path] = number + 1
            self._pass(_Passing(path, number, value), bus)
        elif path in self.subscribed:
            bus.inbox[path].append(value)

    def fuzzing_time(self, end: int) -> float:
        """Seconds in which operations were active or held messages back, in a run that ends at this time."""
        total = 0
        for stage in self.stages:
            if stage.operation.timed:
                total += stage.active_time
                total += max(0, end - stage.start) if stage.active else 0
                total += max(0, end - stage.tail_since) if stage.tail_since is not None else 0
        return total / SECOND

    def _carry_out_edges(self) -> None:
        while self.edges and self.edges[0][0] <= self.now:
            _, at, starts = self.edges.popleft()
            stage = self.stages[at]
            stage.active = starts
            if starts:
                stage.disturbance.begin()
            else:
                stage.active_time += stage.end - stage.start
                self._drain(at, stage)

    def _drain(self, at: int, stage: _Stage) -> None:
        """The window of an operation has ended: what happens to the messages that it holds."""
        if stage.disturbance.drain in {"flush", "drop"}:
            held = sorted(entry for entry in self.queue if entry[2] == at)
            self.queue = [entry for entry in self.queue if entry[2] != at]
            heapq.heapify(self.queue)
            stage.held, stage.last_release = {}, {}
            if stage.disturbance.drain == "flush":
                for _, _, _, message in held:
                    self._hold(at, self.now, message)
        if stage.holds:
            stage.tail_since = self.now

    def _hold(self, at: int, release: int, message: _Passing) -> None:
        stage = self.stages[at]
        stage.held[message.path] = stage.held.get(message.path, 0) + 1
        stage.last_release[message.path] = release
        self.arrivals += 1
        heapq.heappush(self.queue, (release, self.arrivals, at, message))

    def _pass(self, message: _Passing, bus: Bus) -> None:
        """Takes a message through the rest of the operations on its topic, and delivers it."""
        pipeline = self.pipelines.get(message.path, ())
        while message.next_stage < len(pipeline):
            at, member = pipeline[message.next_stage]
            stage = self.stages[at]
            message = replace(message, next_stage=message.next_stage + 1)
            fate = self._meet(stage, member, message)
            release = self.now + (fate.delay or 0)
            if stage.disturbance.holds_order and stage.held.get(message.path):
                release = max(release, stage.last_release[message.path])
            changed = _differs(message.value, fate.value)
            if message.path in self.subscribed:
                stage.effects += fate.copies + (fate.dropped or changed or release > self.now)
            message = replace(message, value=fate.value)
            if fate.dropped:
                return
            if release > self.now:
                self._hold(at, release, message)
                return
            if fate.copies:
                self._pass(message, bus)
                for number in range(fate.copies):
                    key = derived_seed(message.key, "injected", stage.seed, number)
                    self._pass(replace(message, key=key), bus)
                return
        if message.path in self.subscribed:
            bus.inbox[message.path].append(message.value)

    def _meet(self, stage: _Stage, member: int, message: _Passing) -> Fate:
        if not stage.active:
            stage.disturbance.observe(self.now, member, message.value)
            return Fate(message.value)
        draws = Draws(stage.seed, member, message.key)
        return stage.disturbance.meet(Moment(self.now, self.now - stage.start, member, draws), message.value)


def _stage(use: Use, space: Space) -> _Stage:
    operation = space.operations[use.operation]
    start, end = max(use.start, operation.start), min(use.end, operation.end)
    made = disturbance(operation, use.choices, space)
    return _Stage(operation, made, nanoseconds(start), nanoseconds(end), use.seed)


def _precedence(operation: Operation, at: int) -> tuple[int, int, int]:
    return -operation.priority, operation.position, at


def _differs(before: Value, after: Value) -> bool:
    """Whether two values differ; two NaNs do not."""
    if before is after:
        return False
    if isinstance(before, dict):
        return any(_differs(before[name], after[name]) for name in before)
    if isinstance(before, (list, tuple)):
        return any(map(_differs, before, after))
    return before != after and not (before != before and after != after)
