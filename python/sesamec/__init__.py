"""Sesame: under which disturbances does a multi-robot system become dangerous?

`run` runs a campaign of a `.sesame` file, with a class of this process as its simulator, and returns its results;
`open_run` opens results that are there. `serve` makes a program of the same class, for `sesamec run` without Python
around it. `Search` asks for the tests of a campaign one by one, for those who run tests themselves.
"""

from ._hooks import metric, operation
from ._results import Metric, NotResults, Operation, Run, Test
from ._run import open_run, run
from ._search import PlannedOperation, PlannedTest, Search
from ._serve import serve
from ._supervise import Failed, Stopped
from ._world import Message, Order, Setup

__all__ = [
    "Failed",
    "Message",
    "Metric",
    "NotResults",
    "Operation",
    "Order",
    "PlannedOperation",
    "PlannedTest",
    "Run",
    "Search",
    "Setup",
    "Stopped",
    "Test",
    "metric",
    "open_run",
    "operation",
    "run",
    "serve",
]
