"""How a case's simulator talks: to its own parts over a bus, and to Sesame in lines of JSON (docs/process.md).

A simulator is a class named `Simulator` in a file `sim.py`:

    class Simulator:
        subscribes = ("cart/target",)                      # topics that its parts receive

        def __init__(self, seed: int, step: float): ...    # time zero
        def step(self, time: float, bus: Bus): ...         # advances the world to `time`

Its parts exchange messages only by `bus.publish` and `bus.take`: what does not pass the bus, no test can disturb.
"""

import importlib.util
import json
import math
import sys
from abc import ABC, abstractmethod
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Protocol, TextIO

# What a message carries, by its declared type: a number, text, truth value, point (three numbers), list, or fields.
Value = Any

_NOT_FINITE = {"NaN": math.nan, "Infinity": math.inf, "-Infinity": -math.inf}


class Bus(ABC):
    """What connects the parts of a simulator. Messages on subscribed topics wait until their subscriber takes them."""

    def __init__(self, subscribes: Iterable[str]) -> None:
        self.inbox: dict[str, list[Value]] = {topic: [] for topic in subscribes}

    @abstractmethod
    def publish(self, topic: str, value: Value) -> None:
        """Sends a message. The publisher must not change the value afterwards."""

    def take(self, topic: str) -> list[Value]:
        """The messages that have arrived since the last call, the oldest first."""
        messages = self.inbox[topic]
        if messages:
            self.inbox[topic] = []
        return messages

    def latest(self, topic: str, otherwise: Value) -> Value:
        """The newest message that has arrived since the last call; older ones are lost. If none has, `otherwise`."""
        messages = self.take(topic)
        return messages[-1] if messages else otherwise


class Simulator(Protocol):
    """One run of a simulated system."""

    subscribes: tuple[str, ...]

    def __init__(self, seed: int, step: float) -> None:
        """The system at time zero. All randomness comes from `seed`; `step` is in seconds."""

    def step(self, time: float, bus: Bus) -> None:
        """Advances the system to `time`, in seconds."""


def load_simulator(file: Path) -> type[Simulator]:
    """The class `Simulator` of a file."""
    name = f"simulator_{file.resolve().parent.name}"
    specification = importlib.util.spec_from_file_location(name, file)
    if specification is None or specification.loader is None:
        raise ImportError(f"{file} is not a Python file")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module.Simulator


def serve(simulator: type[Simulator], requests: TextIO, answers: TextIO) -> None:
    """Answers a runner's requests until its input ends. An exception in the simulator makes its test a crash."""
    line = _Line(requests, answers)
    try:
        order = line.read()
        while True:
            if "reset" in order:
                reset = order["reset"]
                running = simulator(reset["seed"], reset["step"])
                bus = _LineBus(simulator.subscribes, line)
                ready = {"publishes": reset["topics"], "subscribes": list(simulator.subscribes), "resets": True}
                order = line.ask({"ready": ready})
            else:
                order = line.ask(_advanced(running, bus, order["step"]))
    except EOFError:
        return


def _advanced(running: Simulator, bus: "_LineBus", step: dict) -> dict:
    """Makes a step, and returns the answer that ends it."""
    bus.receive(step["messages"])
    try:
        running.step(step["time"], bus)
    except EOFError:
        raise
    except Exception as error:
        return {"failed": f"{type(error).__name__}: {error}"}
    return {"done": {"messages": bus.unsent()}}


class _Line:
    """Lines of JSON in both directions."""

    def __init__(self, requests: TextIO, answers: TextIO) -> None:
        self.requests, self.answers = requests, answers

    def read(self) -> dict:
        line = self.requests.readline()
        if not line:
            raise EOFError
        return json.loads(line)

    def ask(self, answer: dict) -> dict:
        """Sends an answer, and waits for the next request."""
        self.answers.write(json.dumps(answer, allow_nan=False) + "\n")
        self.answers.flush()
        return self.read()


class _LineBus(Bus):
    """Collects what is published until somebody takes messages: that saves lines, and changes nothing, since all
    messages of a step have the same time."""

    def __init__(self, subscribes: Iterable[str], line: _Line) -> None:
        super().__init__(subscribes)
        self.line = line
        self.outbox: list[dict] = []

    def publish(self, topic: str, value: Value) -> None:
        self.outbox.append({"topic": topic, "value": _encoded(value)})

    def take(self, topic: str) -> list[Value]:
        if self.outbox:
            self.receive(self.line.ask({"publish": self.unsent()})["deliver"])
        return super().take(topic)

    def receive(self, messages: list[dict]) -> None:
        for message in messages:
            self.inbox[message["topic"]].append(_decoded(message["value"]))

    def unsent(self) -> list[dict]:
        unsent, self.outbox = self.outbox, []
        return unsent


def _encoded(value: Value) -> Value:
    """A value as JSON, which has no NaN and no infinity."""
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if isinstance(value, dict):
        return {name: _encoded(field) for name, field in value.items()}
    if isinstance(value, (list, tuple)):
        return [_encoded(element) for element in value]
    return value


def _decoded(value: Value) -> Value:
    if isinstance(value, str):
        return _NOT_FINITE.get(value, value)
    if isinstance(value, dict):
        return {name: _decoded(field) for name, field in value.items()}
    if isinstance(value, list):
        return [_decoded(element) for element in value]
    return value


def main(arguments: list[str]) -> None:
    """Serves the simulator in the file that the only argument names, relative to the current folder."""
    (file,) = arguments
    serve(load_simulator(Path(file)), sys.stdin, sys.stdout)
