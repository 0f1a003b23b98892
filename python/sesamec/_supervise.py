"""Commands with a simulator in this process: `sesamec` supervises, and workers are forks of this process.

The program asks over a pair of sockets for each worker that it needs, and for the end of each, so this process reaps
only what it started, and a worker that hangs or crashes takes nothing with it.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import IO, Any, Callable, NamedTuple

from ._hooks import METRICS, OPERATIONS
from ._world import Setup

#: The longest request.
REQUEST_LIMIT = 1 << 16


class Failed(Exception):
    """A command of `sesamec` failed, with its message; `code` is its exit code."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


class Stopped(KeyboardInterrupt):
    """The user stopped a campaign; `resume=True` continues it."""


def program() -> str:
    """The program `sesamec`: what `SESAMEC` names, else the one beside this Python, else the one on `PATH`."""
    named = os.environ.get("SESAMEC")
    if named:
        return named
    beside = Path(sys.executable).parent / "sesamec"
    found = str(beside) if beside.is_file() else shutil.which("sesamec")
    if found is None:
        raise Failed("the program `sesamec` is neither beside this Python nor on PATH", 1)
    return found


def answer(command: list[str], simulator: Callable[[Setup], Any] | None = None, *, debug: bool = False) -> Any:
    """What `sesamec` prints as JSON. With a simulator, workers are forks of this process.

    What it says to people goes to standard error, also in a notebook, and is the message of the exception if it fails.
    """
    return json.loads(call(command, simulator, debug=debug).output)


class Done(NamedTuple):
    """What a command of `sesamec` came to: its exit code, what it printed, and what it told people, if that was kept."""

    code: int
    output: bytes
    messages: str


def call(command: list[str], simulator: Callable[[Setup], Any] | None = None, *, debug: bool = False) -> Done:
    """Runs a command of `sesamec`. One that prints nothing has failed."""
    # A terminal shows progress. Elsewhere, such as in a notebook, descriptor 2 is not what `sys.stderr` writes to.
    in_terminal = os.isatty(2)
    with tempfile.TemporaryFile() as kept:
        messages = None if in_terminal else kept
        if simulator is None and not METRICS and not OPERATIONS:
            done = subprocess.run(
                command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=messages, check=False
            )
            code, output = done.returncode, done.stdout
        else:
            code, output = _Forks(simulator, debug).supervise(command, messages)
        kept.seek(0)
        said = kept.read().decode(errors="replace")
    return concluded(command, code, output, said)


def concluded(command: list[str], code: int, output: bytes, said: str = "") -> Done:
    """What a command that has ended came to. `said` are its messages, if they were kept."""
    if code == 130:
        sys.stderr.write(said)
        raise Stopped
    if not output.strip():
        told = said.strip() or f"{' '.join(command)} ended with exit code {code}: see its message above"
        raise Failed(told, code)
    sys.stderr.write(said)
    return Done(code, output, said)


class _Forks:
    """Forks workers for a supervisor until it has ended."""

    def __init__(self, simulator: Callable[[Setup], Any] | None, debug: bool) -> None:
        self.simulator, self.debug = simulator, debug
        self.workers: set[int] = set()

    def supervise(self, command: list[str], messages: IO[bytes] | None = None) -> tuple[int, bytes]:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        environment = {**os.environ, "SESAME_FORK_SERVER": "1"}
        with ours:
            with theirs:
                supervisor = subprocess.Popen(
                    command, stdin=theirs.fileno(), stdout=subprocess.PIPE, stderr=messages, env=environment
                )
            # The supervisor stops the campaign in order. What a terminal sends reaches it anyway, and what is sent to
            # this process alone is passed on.
            before = signal.getsignal(signal.SIGINT)
            stops = threading.current_thread() is threading.main_thread()
            if stops:
                signal.signal(signal.SIGINT, lambda *_: supervisor.send_signal(signal.SIGINT))
            try:
                self.answer(ours, supervisor)
                assert supervisor.stdout is not None
                output = supervisor.stdout.read()
                return supervisor.wait(), output
            finally:
                if stops:
                    signal.signal(signal.SIGINT, before)
                for worker in list(self.workers):
                    self.end(worker)
                if supervisor.poll() is None:
                    supervisor.kill()
                    supervisor.wait()

    def answer(self, connection: socket.socket, supervisor: subprocess.Popen[bytes]) -> None:
        """Answers requests until the supervisor closes the connection."""
        while True:
            packet, descriptors, _, _ = socket.recv_fds(connection, REQUEST_LIMIT, 2)
            if not packet:
                return
            request = json.loads(packet)
            if "end" in request:
                answer: dict[str, Any] = {"status": self.end(request["end"])}
            else:
                answer = self.fork(request["fork"], descriptors, connection)
            for descriptor in descriptors:
                os.close(descriptor)
            connection.send(json.dumps(answer).encode())

    def fork(self, worker: dict[str, Any], descriptors: list[int], connection: socket.socket) -> dict[str, Any]:
        sys.stdout.flush()
        sys.stderr.flush()
        try:
            process = os.fork()
        except OSError as error:
            return {"failed": str(error)}
        if process == 0:
            code = 1
            try:
                connection.close()
                code = _work(worker, descriptors, self.simulator, self.debug)
            finally:
                os._exit(code)
        if not self.debug:
            try:
                os.setpgid(process, process)
            except OSError:
                pass  # It has done so itself.
        self.workers.add(process)
        return {"id": process}

    def end(self, process: int) -> int:
        """Kills a worker with its group, and reaps it."""
        if process not in self.workers:
            return 0
        for kill in (os.kill,) if self.debug else (os.killpg, os.kill):
            try:
                kill(process, signal.SIGKILL)
            except (ProcessLookupError, PermissionError):
                pass  # It has ended.
        self.workers.discard(process)
        return os.waitpid(process, 0)[1]


def _work(
    worker: dict[str, Any], descriptors: list[int], simulator: Callable[[Setup], Any] | None, debug: bool
) -> int:
    """What a fork does: it becomes a worker, or says which hooks it has."""
    from ._work import examine_on, work

    os.environ.pop("SESAME_FORK_SERVER", None)
    sys.dont_write_bytecode = True
    if worker["arguments"][0] == "examine":
        # What hooks print while they are imported is not the caller's output.
        os.dup2(2, 1)
        examine_on(descriptors[0])
        return 0
    # In the foreground, Ctrl-C is for the supervisor, which ends its workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN if debug else signal.SIG_DFL)
    terminal = os.dup(0)
    os.dup2(descriptors[0], 0)
    if not debug:
        os.setpgid(0, 0)
        os.dup2(descriptors[1], 1)
        os.dup2(descriptors[1], 2)
    for descriptor in descriptors:
        os.close(descriptor)
    os.chdir(worker["folder"])
    os.environ["SESAME_WORKER"] = str(worker["worker"])
    if not debug or simulator is None:
        os.close(terminal)
        return work(worker["arguments"], simulator)

    def in_foreground(setup: Setup) -> Any:
        # The worker has taken the connection from standard input by now, so a debugger may read there.
        os.dup2(terminal, 0)
        return simulator(setup)

    return work(worker["arguments"], in_foreground)
