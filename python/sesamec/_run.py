"""Running campaigns, and opening what they left behind."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Callable, Mapping, Sequence

from ._results import Run, latest
from ._supervise import answer, program
from ._world import Setup


def run(
    space: str | os.PathLike[str],
    campaign: str | None = None,
    *,
    simulator: Callable[[Setup], Any] | None = None,
    seed: int | None = None,
    evaluations: int | None = None,
    workers: int | None = None,
    results: str | os.PathLike[str] | None = None,
    resume: bool | str | os.PathLike[str] = False,
    debug: bool = False,
    options: Sequence[str] = (),
) -> Run:
    """Runs a campaign of a space and returns the finished run.

    `simulator` is a class, or a function, that is called with a `Setup` for each test; without it, the space's own
    simulator runs. Workers are forks of this process, so the class may be defined anywhere, also in a notebook.

    `resume` continues a run that was stopped, as it was begun: the folder of that run, or `True` for the latest one
    that is unfinished.

    With `debug`, one worker stays in the terminal's foreground and no test has a time limit, so that `breakpoint()`
    works in the simulator.
    """
    runner = ["--workers", "1", "--timeout", "86400", "--reference-timeout", "86400"] if debug else []
    values = {"seed": seed, "evaluations": evaluations, "workers": workers, "results": results}
    command = command_of(space, campaign, values, resume, [*options, *runner])
    summary = answer(command, simulator, debug=debug)
    return Run(Path(summary["results"]), space=Path(space), simulator=simulator, summary=summary)


def command_of(
    space: str | os.PathLike[str],
    campaign: str | None,
    values: Mapping[str, int | str | os.PathLike[str] | None],
    resume: bool | str | os.PathLike[str],
    options: Sequence[str],
) -> list[str]:
    """The command that runs a campaign, or goes on with it; options without a value are left out."""
    if resume and any(values.get(name) is not None for name in ("seed", "evaluations", "results")):
        raise TypeError("`resume` goes on with the seed, the tests and the results of its run")
    command = [program(), "resume" if resume else "run", os.fspath(space)]
    if resume and resume is not True:
        command.append(os.fspath(resume))
    if campaign is not None:
        command += ["--campaign", campaign]
    runner = ["--format", "json", *options]
    for name, value in values.items():
        if value is not None:
            runner += [f"--{name}", os.fspath(value) if isinstance(value, os.PathLike) else str(value)]
    return command + (runner if resume else ["--", *runner])


def open_run(
    path: str | os.PathLike[str],
    campaign: str | None = None,
    *,
    space: str | os.PathLike[str] | None = None,
    simulator: Callable[[Setup], Any] | None = None,
) -> Run:
    """Opens the results of a campaign, finished or not, to read them: nothing is written.

    `path` is the folder of a run, its `results.sqlite`, or a `.sesame` file, which stands for its latest run, or that
    of `campaign`. What runs tests again needs the space, which is looked for where runs usually are, and the
    `simulator`, if that is a class.
    """
    path = Path(path)
    if path.suffix == ".sesame":
        return Run(latest(path, campaign), space=path, simulator=simulator)
    run = Run(path, space=None if space is None else Path(space), simulator=simulator)
    if campaign not in (None, run.campaign):
        raise ValueError(f"{run.folder} has results of campaign `{run.campaign}`, not of `{campaign}`")
    return run
