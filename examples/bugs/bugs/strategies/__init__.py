"""Strategies by name. Each chooses tests one after another and learns from what came out.

A strategy is a class `Strategy` in a module of this package, or any class of yours: `run.py my_search.py:MySearch`.
"""

import importlib
import importlib.util
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from bugs.space import Space, Test
from bugs.world import Outcome

# Name on the command line and module; modules are imported only when they are used.
MODULES = {
    "random": "bugs.strategies.uniform",
    "combinatorial": "bugs.strategies.combinatorial",
    "nsga2": "bugs.strategies.nsga2",
    "tpe": "bugs.strategies.tpe",
}


class Unavailable(Exception):
    """A strategy cannot be used here; the message says what to do."""


@dataclass(frozen=True)
class Problem:
    """What a strategy knows before its first test."""

    space: Space
    reference: Outcome  # the undisturbed run, with all of its messages
    tests: int  # how many tests it may ask for


class Strategy(Protocol):
    """Chooses tests. Everything that it does follows from the problem, the seed and what `tell` got."""

    def __init__(self, problem: Problem, seed: int) -> None: ...

    def ask(self) -> Test:
        """The next test to run."""

    def tell(self, test: Test, outcome: Outcome) -> None:
        """What came out of a test that it asked for. It is called once after each `ask`."""


def strategy_class(name: str) -> type[Strategy]:
    """The strategy of a name, or of a class: `FILE.py:CLASS`. Raises `Unavailable`."""
    file, colon, class_name = name.rpartition(":")
    if colon and file.endswith(".py"):
        return _class_in(Path(file), class_name)
    if name not in MODULES:
        known = ", ".join([*MODULES, "sesamec", "sesamec:STRATEGY", "FILE.py:CLASS"])
        raise Unavailable(f"there is no strategy `{name}`; there are {known}")
    try:
        return importlib.import_module(MODULES[name]).Strategy
    except ModuleNotFoundError as error:
        raise Unavailable(f"`{name}` needs `{error.name}`: python3 -m pip install {error.name}") from error


def _class_in(file: Path, class_name: str) -> type[Strategy]:
    specification = importlib.util.spec_from_file_location(file.stem, file)
    if specification is None or specification.loader is None or not file.is_file():
        raise Unavailable(f"there is no Python file {file}")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    if not hasattr(module, class_name):
        raise Unavailable(f"{file} has no class `{class_name}`")
    return getattr(module, class_name)
