"""Metrics and operations in Python: classes and functions that are registered by the names that the space declares."""

from __future__ import annotations

import difflib
import inspect
import keyword
import re
from dataclasses import fields
from types import SimpleNamespace
from typing import Any, Callable, NamedTuple, TypeVar, overload


class Misfit(TypeError):
    """A hook that cannot be called as the space declares it."""


class Stateless(NamedTuple):
    """A function in place of a class: it keeps nothing between calls."""

    #: "message", "before_start" or "after_end".
    moment: str
    call: Callable[..., Any]


#: What is registered, by the names of metrics and operations.
METRICS: dict[str, type[Any]] = {}
OPERATIONS: dict[str, type[Any] | Stateless] = {}

#: The classes that stand for messages and for the parameters of operations, by the names of a space and of theirs.
MESSAGES: dict[tuple[str, str], type[Any]] = {}
PARAMETERS: dict[tuple[str, str], type[Any]] = {}

T = TypeVar("T")
F = TypeVar("F", bound=Callable[..., Any])


@overload
def metric(named: type[T], /) -> type[T]: ...


@overload
def metric(named: str, /) -> Callable[[type[T]], type[T]]: ...


def metric(named: Any, /) -> Any:
    """Registers a class as the hook of a metric: the one that is called as the class is in snake case, or the named one."""
    return _registered(METRICS, "metric", named, _class)


@overload
def operation(named: type[T], /) -> type[T]: ...


@overload
def operation(named: F, /) -> F: ...


@overload
def operation(named: str, /) -> Callable[[F], F]: ...


def operation(named: Any, /) -> Any:
    """Registers a class, or a function that is called with each message, as the hook of a custom operation."""
    return _registered(OPERATIONS, "operation", named, lambda hook: _class_or_function(hook, "message"))


@overload
def before_start(named: F, /) -> F: ...


@overload
def before_start(named: str, /) -> Callable[[F], F]: ...


def before_start(named: Any, /) -> Any:
    """Registers a function as the hook of an operation before the start of a run."""
    return _registered(OPERATIONS, "operation", named, lambda hook: _function(hook, "before_start"))


@overload
def after_end(named: F, /) -> F: ...


@overload
def after_end(named: str, /) -> Callable[[F], F]: ...


def after_end(named: Any, /) -> Any:
    """Registers a function as the hook of an operation after the end of a run."""
    return _registered(OPERATIONS, "operation", named, lambda hook: _function(hook, "after_end"))


def message(space: str, name: str, /) -> Callable[[type[T]], type[T]]:
    """Registers a dataclass as the message of a space that hooks get; for modules that `sesamec generate` writes."""

    def register(kind: type[T]) -> type[T]:
        declared: type[Any] = kind
        # Constants of the class are no fields.
        declared.__sesame_fields__ = tuple(field.name for field in fields(declared))
        MESSAGES[space, name] = kind
        return kind

    return register


def parameters(space: str, operation: str, /) -> Callable[[type[T]], type[T]]:
    """Registers a dataclass as the parameters of an operation; for modules that `sesamec generate` writes."""

    def register(kind: type[T]) -> type[T]:
        PARAMETERS[space, operation] = kind
        return kind

    return register


#: What a field cannot be called in Python besides keywords, since annotations of generated classes speak of it.
SPOKEN_OF = frozenset({"bool", "float", "int", "list", "self", "sesamec", "str"})


def wire_name(attribute: str) -> str:
    """The name on the wire of a field: generated classes put `_` behind names that Python cannot have."""
    if attribute.startswith("__") and attribute.endswith("__"):
        return attribute[:-2]
    name = attribute.rstrip("_")
    taken = name != attribute and (keyword.iskeyword(name) or name in SPOKEN_OF)
    return attribute[:-1] if taken else attribute


def _registered(hooks: dict[str, Any], what: str, named: Any, taken: Callable[[Any], Any]) -> Any:
    if isinstance(named, str):
        return lambda hook: _enter(hooks, what, named, hook, taken)
    return _enter(hooks, what, snake(getattr(named, "__name__", "")), named, taken)


def _enter(hooks: dict[str, Any], what: str, name: str, hook: Any, taken: Callable[[Any], Any]) -> Any:
    entry = taken(hook)
    other = hooks.get(name)
    if other is not None and place(other) != place(hook):
        # A module that is loaded again, as in a notebook, brings its hook once more.
        raise ValueError(f"{what} `{name}` has a hook already: {'.'.join(place(other))}")
    hooks[name] = entry
    return hook


def _class(hook: Any) -> Any:
    if not isinstance(hook, type):
        raise TypeError(f"the hook of a metric is a class, and {hook!r} is not: it keeps what it counts during a run")
    return hook


def _function(hook: Any, moment: str) -> Any:
    if isinstance(hook, type) or not callable(hook):
        raise TypeError(f"`@sesamec.{moment}` is for functions: a class has a method `{moment}`, and `@sesamec.operation`")
    return Stateless(moment, hook)


def _class_or_function(hook: Any, moment: str) -> Any:
    return hook if isinstance(hook, type) else _function(hook, moment)


def place(hook: Any) -> tuple[str, str]:
    """Where a hook is defined: its module and its name in there."""
    defined = hook.call if isinstance(hook, Stateless) else hook
    return getattr(defined, "__module__", ""), getattr(defined, "__qualname__", repr(defined))


def snake(name: str) -> str:
    """A name as spaces write it: `SafetyZone` as `safety_zone`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def _method(of: str, hook: Any, name: str, takes: tuple[str, ...]) -> Any:
    kind = type(hook).__name__
    method = getattr(hook, name, None)
    if not callable(method):
        near = difflib.get_close_matches(name, (other for other in dir(hook) if not other.startswith("__")), 1)
        found = f", and has `{near[0]}`" if near else ""
        raise Misfit(f"`{kind}`, the hook of {of}, needs a method `{name}(self, {', '.join(takes)})`{found}")
    return _called_with(f"`{kind}.{name}`", method, takes)


def _called_with(name: str, call: Any, takes: tuple[str, ...]) -> Any:
    try:
        inspect.signature(call).bind(*takes)
    except TypeError:
        raise Misfit(f"{name} has to take {', '.join(f'`{argument}`' for argument in takes)}") from None
    except ValueError:
        pass  # What is written in C may not say what it takes.
    return call


def metric_methods(name: str, hook: type[Any], methods: list[str]) -> tuple[Any, list[Any], Any]:
    """The methods of a fresh hook of a metric: at the start of a run, for messages of each topic, and at its end."""
    made, of = hook(), f"metric `{name}`"
    start, end = (
        _method(of, made, around, ("ctx",)) if hasattr(made, around) else None for around in ("on_start", "on_end")
    )
    return start, [_method(of, made, method, ("message", "ctx")) for method in methods], end


def operation_method(name: str, hook: type[Any] | Stateless, method: str) -> Any:
    """What is called of a hook of an operation, of a fresh object if it is a class."""
    takes = ("parameters", "ctx") if method in ("before_start", "after_end") else ("message", "parameters", "ctx")
    if not isinstance(hook, Stateless):
        return _method(f"operation `{name}`", hook(), method, takes)
    moment = method if len(takes) == 2 else "message"
    if hook.moment != moment:
        decorator = "operation" if moment == "message" else moment
        raise Misfit(f"the hook of operation `{name}` needs `@sesamec.{decorator}`, as the space declares it")
    return _called_with(f"`{place(hook)[1]}`", hook.call, takes)


def parameters_of(space: str, name: str, chosen: dict[str, Any]) -> Any:
    """What a test chose for the parameters of an operation."""
    return PARAMETERS.get((space, name), SimpleNamespace)(**chosen)


def of_space(classes: dict[tuple[str, str], type[Any]], space: str) -> dict[str, type[Any]]:
    """The registered classes of a space, by the names of its messages or operations."""
    return {name: kind for (of, name), kind in classes.items() if of == space}
