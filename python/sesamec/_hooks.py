"""Metrics and operations in Python: classes that are registered by the names that the space declares."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any, Callable, TypeVar, overload

#: The registered classes, by the names of metrics and operations.
METRICS: dict[str, type] = {}
OPERATIONS: dict[str, type] = {}

C = TypeVar("C", bound=type)


def _registers(classes: dict[str, type], what: str) -> Callable[..., Any]:
    @overload
    def register(named: C) -> C: ...

    @overload
    def register(named: str) -> Callable[[C], C]: ...

    def register(named: Any) -> Any:
        if isinstance(named, str):
            return lambda hook: _enter(classes, what, named, hook)
        return _enter(classes, what, snake(named.__name__), named)

    return register


def _enter(classes: dict[str, type], what: str, name: str, hook: C) -> C:
    # A module that is loaded again, as in a notebook, brings its class once more.
    other = classes.get(name)
    if other is not None and (other.__module__, other.__qualname__) != (hook.__module__, hook.__qualname__):
        raise ValueError(f"{what} `{name}` has a hook already: {other.__module__}.{other.__qualname__}")
    classes[name] = hook
    return hook


metric = _registers(METRICS, "metric")
operation = _registers(OPERATIONS, "operation")


def snake(name: str) -> str:
    """A name as spaces write it: `SafetyZone` as `safety_zone`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def _method(kind: str, hook: Any, name: str) -> Any:
    method = getattr(hook, name, None)
    if not callable(method):
        raise TypeError(f"the hook `{type(hook).__name__}` of {kind} needs a method `{name}`")
    return method


def metric_methods(name: str, hook: type, topics: list[str]) -> tuple[Any, list[Any], Any]:
    """The methods of a fresh hook of a metric: at the start of a run, for messages of each topic, and at its end."""
    made = hook()
    handlers = [_method(f"metric `{name}`", made, f"on_{snake(topic)}") for topic in topics]
    return getattr(made, "on_start", None), handlers, getattr(made, "on_end", None)


def operation_method(
    name: str, hook: type, moment: str, topic: str | None, names: list[str], choices: list[Any]
) -> tuple[Any, Any]:
    """The method of a fresh hook of an operation, and the choices of the test for its parameters."""
    method = f"on_{snake(topic)}" if moment == "message" and topic is not None else moment
    return _method(f"operation `{name}`", hook(), method), SimpleNamespace(**dict(zip(names, choices)))
