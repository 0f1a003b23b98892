"""A simulator as a program of its own: lines of JSON on standard input and output, as docs/process.md describes them."""

from __future__ import annotations

import json
import os
import sys
from typing import Any, Callable, TextIO

from ._world import Message, Order, Setup, description, told

NUMBERS = {float("inf"): "Infinity", float("-inf"): "-Infinity"}


def _plain(value: Any) -> Any:
    """A payload as JSON has it: no NaN and no infinity, no tuples, no arrays, no dataclasses."""
    kind = type(value)
    if kind is float:
        return value if value - value == 0.0 else NUMBERS.get(value, "NaN")
    if kind in (int, str, bool) or value is None:
        return value
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    if hasattr(value, "__dataclass_fields__"):
        return _plain(vars(value))
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    return value


class _Ended(Exception):
    """The runner has closed the connection."""


class _Bus:
    """The way of a simulator's messages through the relay of the runner, while it takes a step."""

    def __init__(self, send: Callable[[Any], None], receive: Callable[[], Any], step: float) -> None:
        self.step, self.time = step, 0.0
        self.ended = False
        self.published: list[dict[str, Any]] = []
        self._inbox: list[Message] = []
        self._orders: list[Order] = []
        self._send, self._receive = send, receive

    def begin(self, step: dict[str, Any]) -> None:
        self.time = step["time"]
        self._orders = [Order(order["node"], order["order"], order.get("share")) for order in step.get("orders", [])]
        self._deliver(step.get("messages", []))

    def _deliver(self, messages: list[dict[str, Any]]) -> None:
        self._inbox += [Message(message["topic"], message["value"], message["time"]) for message in messages]

    def publish(self, topic: str, value: Any) -> None:
        """Sends a message through the relay. What reaches subscribers is in `messages()`."""
        self.published.append({"topic": topic, "value": _plain(value)})

    def flush(self) -> None:
        """Sends what was published, so that the relay has it before anything else happens."""
        if self.published and self.time > 0.0:
            self._send({"publish": self.published})
            self.published = []
            self._deliver(self._receive()["deliver"])

    def messages(self) -> list[Message]:
        """The messages that have reached subscribers since the last call."""
        self.flush()
        messages, self._inbox = self._inbox, []
        return messages

    def orders(self) -> list[Order]:
        """What operations want done to the simulator's nodes from this step on."""
        orders, self._orders = self._orders, []
        return orders

    def end(self) -> None:
        """The scenario ends with this step."""
        self.ended = True


def serve(simulator: Callable[[Setup], Any]) -> None:
    """Lets the runner that started this program step the simulator, a class or what creates an object of it.

    Standard output belongs to the protocol, so what the simulator prints goes to standard error.
    """
    output, requests = os.fdopen(os.dup(1), "w"), sys.stdin
    os.dup2(2, 1)
    try:
        _serve(simulator, requests, output)
    except (_Ended, BrokenPipeError):
        pass


def _serve(simulator: Callable[[Setup], Any], requests: TextIO, output: TextIO) -> None:
    def send(answer: Any) -> None:
        output.write(json.dumps(answer, separators=(",", ":")) + "\n")
        output.flush()

    def receive() -> Any:
        line = requests.readline()
        if not line:
            raise _Ended
        return json.loads(line)

    world = bus = None
    while True:
        request = receive()
        try:
            if "reset" in request:
                _close(world)
                reset = request["reset"]
                setup = Setup(reset["seed"], reset["step"], reset.get("parameters", {}))
                world, bus = None, _Bus(send, receive, reset["step"])
                world = simulator(setup)
                publishes, subscribes, nodes = description(world)
                if hasattr(world, "start"):
                    world.start(bus)
                answer = {
                    "ready": {
                        "publishes": publishes,
                        "subscribes": subscribes,
                        "nodes": nodes,
                        "parameters": setup.asked,
                        "resets": True,
                        "times": True,
                        "messages": bus.published,
                    }
                }
            else:
                assert world is not None and bus is not None
                bus.begin(request["step"])
                world.step(bus)
                answer = {"done": {"messages": bus.published, "ended": bus.ended}}
            bus.published = []
        except _Ended:
            raise
        except BaseException as error:
            message, trace = told(error, error.__traceback__)
            print(trace, file=sys.stderr, flush=True)
            if bus is not None:
                bus.flush()
            answer = {"failed": message}
        send(answer)


def _close(world: Any) -> None:
    if hasattr(world, "close"):
        world.close()
