"""What simulators in Python are given, and how they are read; the same in a process of their own and in a worker."""

from __future__ import annotations

import os
import traceback
from types import TracebackType
from typing import Any, NamedTuple


#: How many calls the outcome of a test names.
MOST_CALLS = 5


class Setup:
    """The settings with which a simulator is created for a test.

    `seed` is for the simulator's own randomness, `step` the length of a step in seconds.
    """

    __slots__ = ("asked", "seed", "step", "_parameters")

    def __init__(self, seed: int, step: float, parameters: dict[str, float]) -> None:
        self.seed = seed
        self.step = step
        self.asked: list[str] = []
        self._parameters = parameters

    def parameter(self, name: str, usual: float) -> float:
        """The value of a parameter in this test: `usual`, unless a scene or a compensation sets it.

        A simulator asks for each of its parameters when it is created; setting another one is an error.
        """
        if name not in self.asked:
            self.asked.append(name)
        return self._parameters.get(name, usual)


class Message(NamedTuple):
    """A message that has reached the subscribers of its topic."""

    topic: str
    value: Any
    #: When it was delivered, in seconds of simulation time.
    time: float


class Order(NamedTuple):
    """What a node of the simulator does from this step on."""

    node: str
    #: "pause", "slow", "resume", "kill" or "restart".
    order: str
    #: For "slow": the share of its time that the node has, above 0 and below 1.
    share: float | None


def description(simulator: Any) -> tuple[list[str], list[str], dict[str, list[str]]]:
    """What a simulator publishes, to what it subscribes, and what it can do to its nodes."""
    kind = type(simulator).__name__
    lists = []
    for name in ("publishes", "subscribes"):
        topics = getattr(simulator, name, None)
        if topics is None or isinstance(topics, str) or not all(isinstance(topic, str) for topic in topics):
            raise TypeError(f"`{kind}.{name}` has to be a list of topics")
        lists.append(list(topics))
    nodes = {node: list(faults) for node, faults in getattr(simulator, "nodes", {}).items()}
    return lists[0], lists[1], nodes


def told(error: BaseException, raised: TracebackType | None) -> tuple[str, str]:
    """An exception as the outcome of a test, which is the same wherever the files are, and its traceback."""
    own = os.path.dirname(os.path.abspath(__file__))
    others = (own, "<frozen")
    frames = [frame for frame in traceback.extract_tb(raised) if not frame.filename.startswith(others)]
    words = "".join(traceback.format_exception_only(type(error), error)).strip()
    # The user's calls, the innermost one first.
    places = [f"{frame.name} ({os.path.basename(frame.filename)}, line {frame.lineno})" for frame in reversed(frames)]
    if places:
        words += " in " + ", called by ".join(places[:MOST_CALLS])
    whole = "".join(traceback.format_exception(type(error), error, raised))
    return words, whole.rstrip()
