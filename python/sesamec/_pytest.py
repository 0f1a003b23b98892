"""The pytest plugin: regression tests and requirements of `.sesame` files as items.

A space that is named on the command line is collected, and so are those that `--sesame` or the setting `sesame_files`
names; no other file of a project is touched. Campaigns run once for all of their requirements.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, Callable, Iterator, Optional

import pytest

from ._results import Run
from ._supervise import Done, Failed, call, program
from ._world import Setup

Simulator = Optional[Callable[[Setup], Any]]

#: Tests whose expectations were updated, with their files.
UPDATED: pytest.StashKey[list[str]] = pytest.StashKey()


class Hooks:
    """What a `conftest.py` may implement."""

    @pytest.hookspec(firstresult=True)
    def pytest_sesame_simulator(self, path: Path) -> Simulator:
        """The class or function with which the space in this file is simulated; `None` for the space's own."""


def pytest_addhooks(pluginmanager: pytest.PytestPluginManager) -> None:
    pluginmanager.add_hookspecs(Hooks)


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("sesame", "regression tests and campaigns of .sesame files")
    group.addoption(
        "--sesame",
        action="append",
        default=[],
        metavar="PATTERN",
        help="collect spaces of this name, such as cell.sesame or *.sesame; may be repeated. Spaces that are named as "
        "files to test are always collected.",
    )
    group.addoption(
        "--sesame-campaign",
        action="append",
        default=[],
        metavar="NAME",
        help="collect the requirements of this campaign only; may be repeated. All campaigns if omitted.",
    )
    group.addoption(
        "--sesame-seeds", metavar="1,2,3", help="run campaigns and regression tests once with each of these seeds"
    )
    group.addoption(
        "--sesame-evaluations", type=int, metavar="N", help="how many tests a campaign runs, instead of its own number"
    )
    group.addoption(
        "--sesame-results", metavar="DIR", help="where results are kept; in the cache of pytest if omitted"
    )
    group.addoption(
        "--sesame-update",
        action="store_true",
        help="write the measured values into regression tests whose expectations about metrics are not met",
    )
    parser.addini("sesame_files", "patterns of spaces to collect, as with --sesame", type="args", default=[])


def pytest_configure(config: pytest.Config) -> None:
    seeds = config.getoption("--sesame-seeds")
    if seeds is not None and not re.fullmatch(r"\d+(,\d+)*", seeds):
        raise pytest.UsageError(f"--sesame-seeds takes whole numbers, as in 1,2,3, and not {seeds}")
    if seeds is not None and config.getoption("--sesame-update"):
        raise pytest.UsageError("--sesame-update measures tests with their own seeds, so --sesame-seeds cannot be given")
    config.stash[UPDATED] = []
    config.addinivalue_line("markers", "sesame_campaign(name): a requirement of a campaign, which runs for it")
    config.addinivalue_line("markers", "sesame_test(name): a regression test of a space")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    if file_path.suffix != ".sesame":
        return None
    patterns: list[str] = parent.config.getoption("--sesame") + parent.config.getini("sesame_files")
    named = any(fnmatch(file_path.name, Path(pattern).name) and _at(file_path, pattern) for pattern in patterns)
    if named or parent.session.isinitpath(file_path):
        space: pytest.Collector = SpaceFile.from_parent(parent, path=file_path)
        return space
    return None


def _at(path: Path, pattern: str) -> bool:
    """Whether a file is in the folder of a pattern, if that has one."""
    folder = Path(pattern).parent
    return folder == Path() or path.parent == folder.absolute()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    for updated in config.stash[UPDATED]:
        terminalreporter.write_line(f"sesame: updated {updated}")


@dataclass(frozen=True)
class Declared:
    """What a space declares."""

    name: str
    file: Path
    line: int
    text: str


class Unmet(Exception):
    """A requirement that is violated, or an expectation that is not met, in words for people."""


class SpaceFile(pytest.File):
    """A space: a `.sesame` file with its regression tests and campaigns."""

    def collect(self) -> Iterator[pytest.Collector]:
        done = self.sesamec("check", str(self.path))
        if done.returncode != 0:
            raise self.CollectError(done.stderr.strip())
        self.declared: dict[str, list[Declared]] = {}
        for found in json.loads(self.sesamec("explain", str(self.path), "--format", "json").stdout):
            at = found["at"]
            declared = Declared(found["name"], Path(at["file"]), at["start"]["line"], found["text"])
            self.declared.setdefault(found["kind"], []).append(declared)
        #: What ran already, for all items that ask for it: results, or why there are none.
        self.ran: dict[tuple[object, ...], tuple[Run, Done] | Failed] = {}
        given = self.config.getoption("--sesame-seeds")
        #: `None` is the seed of the campaign.
        self.seeds: list[int | None] = [int(seed) for seed in given.split(",")] if given else [None]
        if "test" in self.declared:
            yield Known.from_parent(self, name="known")
        asked = self.config.getoption("--sesame-campaign")
        for campaign in self.declared.get("campaign", []):
            if "requirement" in self.declared and (not asked or campaign.name in asked):
                yield Campaign.from_parent(self, name=campaign.name)

    def sesamec(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        command = [program(), *arguments]
        return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)

    def simulator(self) -> Simulator:
        simulator: Simulator = self.session.gethookproxy(self.path).pytest_sesame_simulator(path=self.path)
        return simulator

    def folder(self, name: str) -> Path:
        """An empty folder for results."""
        kept = self.config.getoption("--sesame-results")
        if kept:
            folder = Path(kept).absolute() / self.path.stem / name
        elif hasattr(self.config, "cache") and self.config.cache is not None:
            # Workers of pytest-xdist have folders of their own.
            worker = os.environ.get("PYTEST_XDIST_WORKER", "")
            folder = self.config.cache.mkdir("sesame") / worker / self.path.stem / name
        else:
            return Path(tempfile.mkdtemp(prefix="sesame-"))
        shutil.rmtree(folder, ignore_errors=True)
        return folder

    def run(self, command: str, campaign: str, seed: int | None, *arguments: str) -> tuple[Run, Done]:
        """Runs a command once, and returns what it came to each time."""
        key = (command, campaign, seed)
        if key not in self.ran:
            try:
                self.ran[key] = self._run(command, campaign, seed, arguments)
            except Failed as failed:
                self.ran[key] = failed
        ran = self.ran[key]
        if isinstance(ran, Failed):
            raise Unmet(str(ran))
        return ran

    def _run(self, command: str, campaign: str, seed: int | None, arguments: tuple[str, ...]) -> tuple[Run, Done]:
        seeded = "" if seed is None else f"-{seed}"
        folder = self.folder(f"{campaign}{seeded}" if command == "run" else f"known-{campaign}{seeded}")
        options = ["--format", "json", "--results", str(folder)]
        if seed is not None:
            options += ["--seed", str(seed)]
        command_line = [program(), command, str(self.path), *arguments, "--campaign", campaign]
        if command == "run":
            evaluations = self.config.getoption("--sesame-evaluations")
            if evaluations is not None:
                options += ["--evaluations", str(evaluations)]
            command_line.append("--")
        simulator = self.simulator()
        done = call([*command_line, *options], simulator)
        summary = json.loads(done.output)
        return Run(Path(summary["results"]), space=self.path, simulator=simulator, summary=summary), done


class Campaign(pytest.Collector):
    """A campaign with the requirements of its space."""

    parent: SpaceFile

    def collect(self) -> Iterator[pytest.Item]:
        for requirement in self.parent.declared["requirement"]:
            for seed in self.parent.seeds:
                yield RequirementItem.from_parent(self, declared=requirement, seed=seed)


class Known(pytest.Collector):
    """The regression tests of a space."""

    parent: SpaceFile

    def collect(self) -> Iterator[pytest.Item]:
        for test in self.parent.declared["test"]:
            for seed in self.parent.seeds:
                yield KnownItem.from_parent(self, declared=test, seed=seed)


class SpaceItem(pytest.Item):
    """Something of a space that holds or does not."""

    def __init__(self, *, declared: Declared, seed: int | None, **arguments: Any) -> None:
        name = declared.name if seed is None else f"{declared.name}[{seed}]"
        super().__init__(name=name, **arguments)
        self.declared, self.seed = declared, seed

    @property
    def space(self) -> SpaceFile:
        space = self.parent.parent if self.parent is not None else None
        assert isinstance(space, SpaceFile)
        return space

    def reportinfo(self) -> tuple[os.PathLike[str] | str, int | None, str]:
        return self.declared.file, self.declared.line - 1, self.nodeid.partition("::")[2]

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        if isinstance(excinfo.value, Unmet):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def shows(self, run: Run, test: str) -> str:
        """The command that shows a test in a terminal."""
        return "    " + self.command("show", run, test)

    def command(self, command: str, run: Run, test: str) -> str:
        """A command of a test, as it is written in the folder in which pytest was started."""
        space, results = map(self.place, (self.space.path, run.folder))
        return shlex.join(["sesamec", command, space, test, "--campaign", run.campaign, "--results", results])

    def place(self, path: Path) -> str:
        start = self.config.invocation_params.dir
        return str(path.relative_to(start) if path.is_relative_to(start) else path)


class RequirementItem(SpaceItem):
    """A requirement that no test of a campaign may violate."""

    def __init__(self, *, parent: Campaign, **arguments: Any) -> None:
        super().__init__(parent=parent, **arguments)
        self.campaign = parent.name
        self.add_marker(pytest.mark.sesame_campaign(self.campaign))

    def runtest(self) -> None:
        run, done = self.space.run("run", self.campaign, self.seed)
        found = next(it for it in run.summary["requirements"] if it["requirement"] == self.declared.name)
        if found["violated"]:
            test = found["worst"]["test"] if found["worst"] else "T0"
            keep = f"{self.command('export', run, test)} >> {shlex.quote(self.place(self.space.path))}"
            raise Unmet(
                f"{found['sentence']} The seed is {run.seed}.\n\nTo see it:\n\n{self.shows(run, test)}\n\n"
                f"To keep it as a regression test, which pytest then runs:\n\n    {keep}"
            )
        if done.code == 3 or not found["satisfied"]:
            why = done.messages.strip() or f"no test of {run.campaign} is conclusive about {self.declared.name}"
            raise Unmet(why)


class KnownItem(SpaceItem):
    """A regression test and what it expects."""

    def __init__(self, *, parent: Known, **arguments: Any) -> None:
        super().__init__(parent=parent, **arguments)
        self.add_marker(pytest.mark.sesame_test(self.declared.name))

    def runtest(self) -> None:
        name = self.declared.name
        run = self.known()
        test = run[name]
        if test.outcome not in ("completed", "no_effect"):
            detail = f": {test.detail}" if test.detail else ""
            raise Unmet(f"{name}: {test.outcome} at {test.end_s:g} s{detail}\n\n{self.shows(run, name)}")
        expected = [it for it in run.summary["expectations"] if it["known_test"] == name]
        unmet = [it for it in expected if it["verdict"] != "satisfied"]
        if unmet and self.config.getoption("--sesame-update"):
            unmet = self.update(run, unmet)
        if unmet:
            sentences = "\n".join(self.sentence(run, expectation) for expectation in unmet)
            raise Unmet(f"{sentences}\n\nTo see it:\n\n{self.shows(run, name)}")

    def known(self) -> Run:
        """The results of regression tests of the first campaign that can run this one."""
        campaigns = [campaign.name for campaign in self.space.declared.get("campaign", [])]
        # The only campaign is told which tests it runs; one of several might not be able to run all of them.
        selected = [
            item.declared.name
            for item in self.session.items
            if isinstance(item, KnownItem) and item.parent is self.parent and item.seed == self.seed
        ]
        refused = Unmet(f"no campaign of {self.space.path.name} can run `{self.declared.name}`")
        for campaign in campaigns:
            try:
                run, _ = self.space.run("known", campaign, self.seed, *(selected if len(campaigns) == 1 else ()))
            except Unmet as failed:
                refused = failed
            else:
                if self.declared.name in run:
                    return run
        raise refused

    def sentence(self, run: Run, expectation: dict[str, Any]) -> str:
        metric, value, bound = expectation["metric"], expectation["value"], expectation["bound"]
        unit = run.units.get(metric, "")
        is_now = "has no value" if value is None else f"is {repr(value).removesuffix('.0')} {unit}".rstrip()
        return f"{self.declared.name}: {metric} {is_now}, expected is {bound}"

    def update(self, run: Run, unmet: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """Writes the measured values of metrics into the test, and returns what is still not as expected.

        What a requirement asks for is no measured value, so `expect R1` stays.
        """
        measured = _expectations(run[self.declared.name].export(self.declared.name, pin=True))
        explained = self.space.sesamec("explain", self.declared.name, str(self.space.path), "--format", "json")
        declared = json.loads(explained.stdout)
        file, block = Path(declared["at"]["file"]), declared["text"]
        lines, left = block.split("\n"), []
        for expectation in unmet:
            metric = expectation["metric"]
            of_metric = [at for at, line in enumerate(lines) if _expectations(line).keys() == {metric}]
            if metric in measured and len(of_metric) == 1:
                (at,) = of_metric
                lines[at] = EXPECT.sub(lambda _: measured[metric], lines[at])
            else:
                left.append(expectation)
        if len(left) < len(unmet):
            text = file.read_text(encoding="utf-8")
            file.write_text(text.replace(block, "\n".join(lines), 1), encoding="utf-8")
            self.config.stash[UPDATED].append(f"{self.declared.name} in {file}")
        return left


#: A line that expects something of a metric: requirements have no bound behind their name.
EXPECT = re.compile(r"expect[^\S\n]+(\w+)[^\S\n]+(?:in\b|[<>=]).*?(?=\s*(?://|\}|$))", re.MULTILINE)


def _expectations(block: str) -> dict[str, str]:
    """The clauses of a test that expect something of a metric, by its name."""
    return {found[1]: found[0] for found in EXPECT.finditer(block)}
