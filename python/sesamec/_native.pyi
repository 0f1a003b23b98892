"""The native part of the package: what simulators and hooks are called with, and what workers do."""

from os import PathLike
from typing import Any, Callable, Generic, Sequence, TypedDict, TypeVar

from ._world import Message, Order

__version__: str

M = TypeVar("M")

class Bus:
    """The way of a simulator's messages through the relay, while it takes a step."""

    @property
    def step(self) -> float:
        """The length of a step in seconds."""

    @property
    def time(self) -> float:
        """Simulation time at the end of this step, in seconds."""

    def publish(self, topic: str, value: Any) -> None:
        """Sends a message through the relay. What reaches subscribers is in `messages()`."""

    def messages(self) -> list[Message]:
        """The messages that have reached subscribers since the last call."""

    def orders(self) -> list[Order]:
        """What operations want done to the simulator's nodes from this step on."""

    def end(self) -> None:
        """The scenario ends with this step."""

class MetricContext:
    """In which a metric's hook sets its value, during the call that it is given to."""

    @property
    def now(self) -> float:
        """Simulation time in seconds."""

    @property
    def topic(self) -> str:
        """Name on the wire of the message's topic; if the input is a group, of its member."""

    @property
    def value(self) -> float | None:
        """The metric's value so far in this run."""

    def set(self, value: float) -> None:
        """Sets the metric's value. A value that is not finite is refused, with a warning of the run."""

    def add(self, amount: float = 1.0) -> None:
        """Adds to the metric's value, which starts at zero."""

    def every_seconds(self, period: float, key: str = "") -> bool:
        """True the first time, and then whenever at least this many seconds of simulation time have passed since it was
        last true, for each key by itself."""

    def unimplemented(self) -> None:
        """Marks this hook as not filled in yet."""

class OperationContext(Generic[M]):
    """What the hook of an operation can do besides changing its message of type `M`, during the call that it is given
    to."""

    @property
    def now(self) -> float:
        """Simulation time in seconds."""

    @property
    def topic(self) -> str:
        """Name on the wire of the message's topic; if the operation is on a group, of its member."""

    def draw(self, low: float = 0.0, high: float = 1.0) -> float:
        """The next random number for this message, uniform in `[low, high)`. A repeated test draws the same numbers."""

    def drop(self) -> None:
        """Drops the message. Injected messages are still delivered."""

    def inject(self, message: M) -> None:
        """Publishes a further message on the same topic, directly after this one. Later operations act on it too."""

    def unimplemented(self) -> None:
        """Marks this hook as not filled in yet."""

class RunContext:
    """What a hook can do before the start or after the end of a run, during the call that it is given to."""

    @property
    def folder(self) -> str:
        """The folder of the `.sesame` file."""

    def draw(self, low: float = 0.0, high: float = 1.0) -> float:
        """The next random number, uniform in `[low, high)`. A repeated test draws the same numbers."""

    def replace_file(self, path: str, contents: str | bytes) -> None:
        """Replaces the contents of a file until the run is over. Paths are relative to the folder of the space."""

    def edit_file(self, path: str, edit: Callable[[str], str]) -> None:
        """Changes the text of a file until the run is over: `edit` returns the new text for the old one."""

    def count_side_effect(self) -> None:
        """Counts another side effect, so that the test has an effect. The hook must undo it itself."""

    def unimplemented(self) -> None:
        """Marks this hook as not filled in yet."""

class Evolution:
    """NSGA-II, or NSGA-III, on vectors in `0..=1` with the usual variation of real numbers. All is minimised."""

    def __init__(self, variables: int, population: int, seed: int, reference_points: bool) -> None: ...
    def ask(self) -> list[list[float]]:
        """The next generation."""

    def tell(self, objectives: Sequence[Sequence[float] | None]) -> None:
        """Takes the objectives of that generation, in its order; `None` for what could not be evaluated."""

    def survivors(self) -> list[int]:
        """The vectors that survived, by how many were told before them."""

class Falsification:
    """A search for a violation, by a Gaussian process, on vectors in `0..=1`."""

    def __init__(self, variables: int, requirements: int, seed: int) -> None: ...
    def ask(self) -> list[list[float]]:
        """The next vectors: several at first, then one."""

    def tell(self, margins: Sequence[Sequence[float] | None]) -> None:
        """Takes the margins of those vectors, in their order: negative where a requirement is violated."""

class Needs(TypedDict):
    """What a plan needs of hooks, and says of their types."""

    space: str
    name: str
    metrics: dict[str, list[str]]
    operations: dict[str, str]
    messages: dict[str, list[str]]
    parameters: dict[str, list[str]]

def worker(arguments: Sequence[str | PathLike[str]], simulator: Callable[..., Any] | None) -> int:
    """Serves the supervisor that started this process as a worker, and returns the exit code."""

def needs(plan: str) -> Needs:
    """What a plan needs of hooks, and says of their types."""
