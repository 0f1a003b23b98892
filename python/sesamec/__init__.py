"""Sesame: under which disturbances does a multi-robot system become dangerous?

`run` runs a campaign of a `.sesame` file, with a class of this process as its simulator; `serve` makes a program of the
same class, for `sesamec run` without Python around it.
"""

from ._hooks import metric, operation
from ._serve import serve
from ._supervise import Failed, Stopped, run
from ._world import Message, Order, Setup

__all__ = ["Failed", "Message", "Order", "Setup", "Stopped", "metric", "operation", "run", "serve"]
