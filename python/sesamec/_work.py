"""What a process does that runs tests, or that is asked which hooks it has."""

from __future__ import annotations

import difflib
import importlib.util
import inspect
import json
import os
import sys
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Sequence

from . import _hooks
from ._world import told

if TYPE_CHECKING:
    from . import _native

#: How similar a name has to be to be suggested.
SIMILAR = 0.7


class Unusable(Exception):
    """What is wrong with hooks, for those who wrote them."""


def work(arguments: Sequence[str], simulator: Any = None) -> int:
    """Becomes a worker with the hooks of its runner, and returns the exit code."""
    from . import _native

    for stream in (sys.stdout, sys.stderr):
        # What is printed is in the log when the process is killed.
        getattr(stream, "reconfigure", lambda **_: None)(line_buffering=True)
    try:
        runner = json.loads(Path(arguments[arguments.index("--runner") + 1]).read_bytes())
        import_hooks(runner)
    except Unusable as wrong:
        # It could be imported before the campaign began.
        print(wrong, file=sys.stderr, flush=True)
        return 1
    return _native.worker(list(arguments), simulator)


def import_hooks(runner: dict[str, Any]) -> set[str]:
    """Imports the file of a runner's hooks, and returns the names that it registers.

    What this process has registered before is used in place of the file's.
    """
    file = (runner.get("hooks") or {}).get("file")
    if file is None:
        return set()
    path = Path(runner["directory"], runner["space"], file).resolve()
    name = path.stem
    if str(path.parent) not in sys.path:
        sys.path.insert(0, str(path.parent))
    loaded = sys.modules.get(name)
    if loaded is None or Path(getattr(loaded, "__file__", None) or "").resolve() != path:
        metrics, operations = dict(_hooks.METRICS), dict(_hooks.OPERATIONS)
        _hooks.METRICS.clear()
        _hooks.OPERATIONS.clear()
        _execute(name, path)
        _hooks.METRICS.update(metrics)
        _hooks.OPERATIONS.update(operations)
    registered = [*_hooks.METRICS.items(), *_hooks.OPERATIONS.items()]
    return {hook for hook, entry in registered if _hooks.place(entry)[0] == name}


def _execute(name: str, path: Path) -> None:
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        raise Unusable(f"{error.filename}:{error.lineno}: {error.msg}") from None
    except BaseException as error:
        words, _ = told(error, error.__traceback__)
        raise Unusable(f"the hooks in {path} cannot be imported: {words}") from None


def answered(text: bytes) -> bytes:
    """The answer to a supervisor that asks for the hooks of a runner."""
    return json.dumps(_examined(json.loads(text))).encode()


def _examined(runner: dict[str, Any]) -> dict[str, Any]:
    from . import _native

    answer: dict[str, Any] = {"version": _native.__version__}
    try:
        of_file = import_hooks(runner)
        needs = _native.needs(runner["plan"])
        _refuse_undeclared(runner["hooks"], of_file)
        _refuse_outdated(needs)
        unfilled_metrics: list[str] = []
        unfilled_operations: list[str] = []
        for name, names in needs["metrics"].items():
            if name in _hooks.METRICS:
                _, methods, _ = _tried(_hooks.metric_methods, name, _hooks.METRICS[name], names)
                if any(map(_is_stub, methods)):
                    unfilled_metrics.append(name)
        for name, word in needs["operations"].items():
            if name in _hooks.OPERATIONS:
                if _is_stub(_tried(_hooks.operation_method, name, _hooks.OPERATIONS[name], word)):
                    unfilled_operations.append(name)
        kinds = (("metric", needs["metrics"], _hooks.METRICS), ("operation", needs["operations"], _hooks.OPERATIONS))
        answer |= {"unfilled_metrics": unfilled_metrics, "unfilled_operations": unfilled_operations}
        answer["registered"] = [name for _, names, hooks in kinds for name in names if name in hooks]
        answer["missing"] = [(name, kind) for kind, names, hooks in kinds for name in names if name not in hooks]
    except Unusable as wrong:
        answer["problem"] = str(wrong)
    return answer


def _is_stub(method: Any) -> bool:
    """Whether the code of a hook says that it is not filled in. It is not called, since it may do anything."""
    code = getattr(inspect.unwrap(method), "__code__", None)
    return code is not None and "unimplemented" in code.co_names


def _tried(methods: Any, name: str, *hook: Any) -> Any:
    try:
        return methods(name, *hook)
    except _hooks.Misfit as misfit:
        raise Unusable(str(misfit)) from None
    except BaseException as error:
        words, _ = told(error, error.__traceback__)
        raise Unusable(f"the hook of `{name}` cannot be used: {words}") from None


def _refuse_undeclared(declared: dict[str, Any], of_file: set[str]) -> None:
    for kind, names, hooks in (
        ("metric", declared["metrics"], _hooks.METRICS),
        ("operation", declared["operations"], _hooks.OPERATIONS),
    ):
        for name in of_file & hooks.keys():
            if name in names:
                continue
            near = difflib.get_close_matches(name, names, 1, SIMILAR)
            hint = f"did you mean `{near[0]}`?" if near else f"it declares {_listed(names)}"
            what = "metric with a hook" if kind == "metric" else "custom operation"
            raise Unusable(f"{declared['file']} registers {kind} `{name}`, but the space has no such {what}: {hint}")


def _listed(names: list[str]) -> str:
    return ", ".join(f"`{name}`" for name in names) if names else "none"


def _refuse_outdated(needs: _native.Needs) -> None:
    """Refuses classes of another version of the space."""
    for what, declared, classes in (
        ("message", needs["messages"], _hooks.of_space(_hooks.MESSAGES, needs["name"])),
        ("operation", needs["parameters"], _hooks.of_space(_hooks.PARAMETERS, needs["name"])),
    ):
        for name, attributes in declared.items():
            kind = classes.get(name)
            if kind is not None and [field.name for field in fields(kind)] != attributes:
                raise Unusable(
                    f"the class `{kind.__name__}` of {what} `{name}` is of another version of the space: run "
                    f"`sesamec generate --python {needs['space']}`"
                )


def examine_on(connection: int) -> None:
    """Answers a supervisor at the other end of a socket."""
    import socket

    with socket.socket(fileno=os.dup(connection)) as supervisor:
        text = b"".join(iter(lambda: supervisor.recv(1 << 16), b""))
        supervisor.sendall(answered(text))
