"""Sesame: under which disturbances does a multi-robot system become dangerous?

`run` runs a campaign of a `.sesame` file, with a class of this process as its simulator, and returns its results;
`open_run` opens results that are there. `serve` makes a program of the same class, for `sesamec run` without Python
around it. `metric`, `operation`, `before_start` and `after_end` register hooks. `Search` asks for the tests of a campaign
one by one, for those who run tests themselves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._hooks import after_end, before_start, message, metric, operation, parameters
from ._results import Metric, NotResults, Operation, Run, Test
from ._run import open_run, run
from ._search import PlannedOperation, PlannedTest, Search
from ._serve import serve
from ._supervise import Failed, Stopped
from ._world import Message, Order, Setup

if TYPE_CHECKING:
    from ._native import Bus, MetricContext, OperationContext, RunContext

__all__ = [
    "Bus",
    "Failed",
    "Message",
    "Metric",
    "MetricContext",
    "NotResults",
    "Operation",
    "OperationContext",
    "Order",
    "PlannedOperation",
    "PlannedTest",
    "Run",
    "RunContext",
    "Search",
    "Setup",
    "Stopped",
    "Test",
    "after_end",
    "before_start",
    "message",
    "metric",
    "open_run",
    "operation",
    "parameters",
    "run",
    "serve",
]

_OF_NATIVE = frozenset({"Bus", "MetricContext", "OperationContext", "RunContext"})


def __getattr__(name: str) -> Any:
    # A simulator that is a program does not need the native module.
    if name not in _OF_NATIVE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from . import _native

    return getattr(_native, name)
