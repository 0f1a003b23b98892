"""`python3 -m sesamec`: the program `sesamec`, and what it starts of this Python."""

from __future__ import annotations

import os
import sys


def main(arguments: list[str]) -> int:
    """Carries out a command of `sesamec` with these arguments."""
    if arguments[:1] not in (["worker"], ["examine"]):
        from ._supervise import program

        os.execv(program(), ["sesamec", *arguments])
    # An edited file may be as long as before and be written within the same second.
    sys.dont_write_bytecode = True
    from . import _work

    if arguments[0] == "worker":
        return _work.work(arguments)
    text, output = sys.stdin.buffer.read(), os.dup(1)
    # What hooks print while they are imported is no part of the answer.
    os.dup2(2, 1)
    with open(output, "wb") as answer:
        answer.write(_work.answered(text))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
