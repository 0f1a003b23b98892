"""A simulator as a program of its own: lines of JSON on standard input and output, as docs/process.md describes them."""

from __future__ import annotations

import functools
import json
import os
import sys
from dataclasses import fields
from typing import Any, Callable, Iterable, TextIO

from ._hooks import wire_name
from ._world import Message, Order, Setup, description, told

NUMBERS = {float("inf"): "Infinity", float("-inf"): "-Infinity"}
WORDS = {"NaN": float("nan"), "Infinity": float("inf"), "-Infinity": float("-inf")}


#: Encodes a value; `json.dumps` with separators makes an encoder for each call.
_encode = json.JSONEncoder(separators=(",", ":"), check_circular=False, allow_nan=False).encode

#: What follows the value of a message, by whether it was delivered here.
_DELIVERED = {False: "", True: ',"delivered":true'}


@functools.cache
def _beginning(topic: str) -> str:
    """A message in JSON up to its value."""
    return f'{{"topic":{_encode(topic)},"value":'


def _line(topic: str, value: Any, delivered: bool) -> str:
    """A message in JSON. Most carry a number, whose text is known."""
    text = repr(value) if type(value) is float or type(value) is int else _encode(value)
    return f"{_beginning(topic)}{text}{_DELIVERED[delivered]}}}"


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
        return _plain(_fields(value))
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    return value


def _number(value: Any) -> Any:
    """A payload as it was published: NaN and infinities are numbers again. Lists and dictionaries are of its own."""
    kind = type(value)
    if kind is str:
        return WORDS.get(value, value)
    if kind is dict:
        return {name: _number(part) for name, part in value.items()}
    if kind is list:
        return [_number(part) for part in value]
    return value


def _fields(value: Any) -> dict[str, Any]:
    """The fields of a dataclass, as messages name them."""
    names = [field.name for field in fields(value)]
    of_space = hasattr(value, "__sesame_fields__")
    return {wire_name(name) if of_space else name: getattr(value, name) for name in names}


class _Ended(Exception):
    """The runner has closed the connection."""


class _Bus:
    """The way of a simulator's messages through the relay of the runner, while it takes a step.

    What no operation of the test can change is delivered here, and the runner hears of it with the next line: a line
    for each message would cost most of the time of a test.
    """

    def __init__(self, send: Callable[[str], None], receive: Callable[[], Any], reset: dict[str, Any]) -> None:
        self.step, self.time = reset["step"], 0.0
        self.ended = False
        #: What was published and not sent yet: its topic, what it carries, and whether it was delivered here.
        self.published: list[tuple[str, Any, bool]] = []
        self.subscribes: frozenset[str] = frozenset()
        #: The topics that have to come back from the runner; all of them if it does not say which.
        self._intercepted: frozenset[str] | None = None
        if "intercepted" in reset:
            self._intercepted = frozenset(reset["intercepted"])
        #: Where what was published since the last call of `messages` begins.
        self._fresh = 0
        self._inbox: list[Message] = []
        self._orders: list[Order] = []
        self._send, self._receive = send, receive

    def begin(self, step: dict[str, Any]) -> None:
        self.time = step["time"]
        self._orders = [Order(order["node"], order["order"], order.get("share")) for order in step.get("orders", ())]
        self._deliver(step.get("messages", ()))

    def _deliver(self, messages: Iterable[dict[str, Any]]) -> None:
        self._inbox += [Message(message["topic"], _number(message["value"]), message["time"]) for message in messages]

    def publish(self, topic: str, value: Any) -> None:
        """Sends a message through the relay. What reaches subscribers is in `messages()`."""
        self.published.append((topic, _plain(value), False))

    def flush(self) -> None:
        """Sends what was published, so that the relay has it before anything else happens."""
        if self.published and self.time > 0.0:
            self._send(f'{{"publish":{self.sent()}}}')
            self._deliver(self._receive()["deliver"])

    def sent(self) -> str:
        """What was published, as a list in JSON that is sent now."""
        published, self.published, self._fresh = self.published, [], 0
        return f"[{','.join([_line(*message) for message in published])}]"

    def messages(self) -> list[Message]:
        """The messages that have reached subscribers since the last call."""
        if self._fresh < len(self.published) and self.time > 0.0:
            fresh = range(self._fresh, len(self.published))
            heard = [at for at in fresh if self.published[at][0] in self.subscribes]
            intercepted = self._intercepted
            if intercepted is None or any(self.published[at][0] in intercepted for at in heard):
                self.flush()
            else:
                for at in heard:
                    topic, value, _ = self.published[at]
                    self.published[at] = (topic, value, True)
                    self._inbox.append(Message(topic, _number(value), self.time))
                self._fresh = len(self.published)
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
    decode = json.JSONDecoder().raw_decode

    def send(line: str) -> None:
        output.write(line + "\n")
        output.flush()

    def receive() -> Any:
        line = requests.readline()
        if not line:
            raise _Ended
        return decode(line)[0]

    world = bus = None
    answer: str
    while True:
        request = receive()
        try:
            if "reset" in request:
                _close(world)
                reset = request["reset"]
                setup = Setup(reset["seed"], reset["step"], reset.get("parameters", {}))
                world, bus = None, _Bus(send, receive, reset)
                world = simulator(setup)
                publishes, subscribes, nodes = description(world)
                bus.subscribes = frozenset(subscribes)
                if hasattr(world, "start"):
                    world.start(bus)
                ready = {
                    "publishes": publishes,
                    "subscribes": subscribes,
                    "nodes": nodes,
                    "parameters": setup.asked,
                    "resets": True,
                    "times": True,
                }
                answer = f'{{"ready":{{"messages":{bus.sent()},{_encode(ready)[1:]}}}'
            else:
                assert world is not None and bus is not None
                bus.begin(request["step"])
                world.step(bus)
                ended = ',"ended":true' if bus.ended else ""
                answer = f'{{"done":{{"messages":{bus.sent()}{ended}}}}}'
        except _Ended:
            raise
        except BaseException as error:
            message, trace = told(error, error.__traceback__)
            print(trace, file=sys.stderr, flush=True)
            if bus is not None:
                bus.flush()
            answer = _encode({"failed": message})
        send(answer)


def _close(world: Any) -> None:
    if hasattr(world, "close"):
        world.close()
