#!/usr/bin/env python3
"""Runs strategies on the benchmark's cases, judges what they find, and prints the table.

strategies:
  random            independent uniform tests
  combinatorial     each operation, then each two, at full strength: over the run, its halves, quarters, eighths
  nsga2             NSGA-II of pymoo (python3 -m pip install pymoo)
  tpe               the Parzen estimator of Optuna (python3 -m pip install optuna)
  sesamec           the real program, with the strategy of the cases; `sesamec:nsga2` and others with another one
  FILE.py:CLASS     your own; own_strategy.py is an example

The table has all results of the folder for these cases, seeds and numbers of tests, those of earlier calls included.
What is finished is not run again.

The folder `published` holds results of other strategies with the seeds 501 to 520. `--published` puts them in the table.

exit codes:
  0    done
  1    failed: the last line says why
  2    wrong usage
  3    done, but values that Sesame recorded differ from those of the judge, or causes that it names from what its
       tests bear out
  130  stopped by Ctrl-C; the same command continues
"""

import argparse
import gzip
import json
import os
import shutil
import sys
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from itertools import islice
from pathlib import Path

from bugs.campaign import Job, Record, fingerprint, origin, record_from, run
from bugs.case import CASES, PROBLEMS, BadCase, Case, case_folders, load_cases
from bugs.sesamec import SesamecFailed, plan_of
from bugs.strategies import Unavailable, strategy_class
from bugs.table import as_csv, as_json, as_text, as_text_of_problems, rows

HERE = Path(__file__).resolve().parent
PUBLISHED = HERE / "published"
PUBLISHED_SEEDS = range(501, 521)


def main(arguments: list[str]) -> int:
    options = parsed(arguments)
    try:
        if options.update_plans:
            return update_plans(case_folders(options.cases, options.folder), options.sesamec)
        cases = load_cases(options.cases, options.folder)
        if options.list:
            return show_cases(cases)
        for strategy in options.strategies:
            check(strategy, options.sesamec)
        store = Store(options.out, cases)
        if options.publish:
            return publish(store, options.tests)
        if options.published:
            store.read(PUBLISHED)
        jobs = [
            Job(strategy, case.name, seed, options.tests)
            for strategy in options.strategies
            for seed in options.seeds
            for case in cases
        ]
        origins = {strategy: origin(strategy, options.sesamec) for strategy in options.strategies}
        run_all([job for job in jobs if not store.has(job, origins[job.strategy])], store, cases, options)
    except (BadCase, Unavailable, SesamecFailed) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("stopped; the same command continues", file=sys.stderr)
        return 130
    return show(store.of(options.seeds, options.tests), cases, options)


def parsed(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("strategies", nargs="*", metavar="STRATEGY", help="strategies to run, see above")
    parser.add_argument("--cases", type=lambda text: text.split(","), metavar="A,B", help="these cases (default: all)")
    parser.add_argument("--problems", action="store_true", help="the problems of falsification in place of the cases")
    parser.add_argument(
        "--seeds", type=seeds, metavar="1-20",
        help="seeds, such as 1-5,9 (default: 1-20, and 501-520 with --published)",
    )  # fmt: skip
    parser.add_argument("--published", action="store_true", help="with the published results in the table")
    parser.add_argument("--tests", type=positive, default=120, help="tests per search (default: 120)")
    parser.add_argument("--early", type=positive, default=40, help="the early budget in the table (default: 40)")
    parser.add_argument(
        "--sesamec", type=program, default=os.environ.get("SESAMEC") or None, metavar="PATH",
        help="the program of Sesame (default: the variable SESAMEC)",
    )  # fmt: skip
    parser.add_argument(
        "--workers", type=positive, default=os.cpu_count() or 1, metavar="N",
        help="processes (default: one per processor); they do not affect results",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for results (default: results, for problems results/problems)"
    )
    parser.add_argument("--format", choices=["text", "csv", "json"], default="text", help="of what is printed")
    parser.add_argument("--list", action="store_true", help="print the cases with their causes, and run nothing")
    parser.add_argument(
        "--update-plans", action="store_true", help="write plan.json of the cases by sesamec, and run nothing"
    )
    parser.add_argument(
        "--publish", action="store_true",
        help="write the results of the seeds 501 to 520 into the folder `published`, and run nothing",
    )  # fmt: skip
    options = parser.parse_args(arguments)
    options.folder = PROBLEMS if options.problems else CASES
    options.seeds = options.seeds or list(PUBLISHED_SEEDS if options.published else range(1, 21))
    options.out = options.out or HERE / ("results/problems" if options.problems else "results")
    if options.update_plans and options.sesamec is None:
        parser.error("--update-plans needs --sesamec")
    if options.problems and (options.published or options.publish):
        parser.error("there are no published results of the problems")
    if options.publish and options.cases:
        parser.error("--publish writes the results of all cases, so it does not go with --cases")
    if options.early > options.tests:
        parser.error("--early exceeds --tests")
    return options


def seeds(text: str) -> list[int]:
    """Seeds such as 1-5,9, each once."""
    found: dict[int, None] = {}
    for part in text.split(","):
        first, dash, last = part.partition("-")
        for seed in range(int(first), int(last if dash else first) + 1):
            found[seed] = None
    if not found:
        raise argparse.ArgumentTypeError(f"{text} are no seeds")
    return list(found)


def program(text: str) -> Path:
    """A program by its path, or by its name on PATH."""
    found = shutil.which(text)
    if found is None:
        raise argparse.ArgumentTypeError(f"there is no program {text}")
    return Path(found)


def positive(text: str) -> int:
    if int(text) < 1:
        raise argparse.ArgumentTypeError("at least 1")
    return int(text)


def check(strategy: str, sesamec: Path | None) -> None:
    """Raises `Unavailable` before anything is run."""
    if strategy.partition(":")[0] != "sesamec":
        strategy_class(strategy)
    elif sesamec is None:
        raise Unavailable("`sesamec` needs the program: name it with --sesamec, or in the variable SESAMEC")


def show_cases(cases: list[Case]) -> int:
    for case in cases:
        print(f"{case.name} ({case.field}): {case.title}")
        for report in case.reports:
            print(f"  {report}")
        for known in case.causes:
            print(f"  {known.cause}: {known.when}")
    return 0


def update_plans(folders: list[Path], sesamec: Path) -> int:
    for folder in folders:
        plan = json.dumps(plan_of(sesamec, folder / f"{folder.name}.sesame"), indent=1) + "\n"
        (folder / "plan.json").write_text(plan, encoding="utf-8")
    return 0


def publish(store: "Store", tests: int) -> int:
    """Writes the records of the published seeds, a file for each strategy of the list that has all of them for all
    cases."""
    jobs = [(case, seed) for case in store.current for seed in PUBLISHED_SEEDS]
    PUBLISHED.mkdir(exist_ok=True)
    for strategy in sorted({record.strategy for record in store.records.values() if ".py:" not in record.strategy}):
        records = [store.records.get(Job(strategy, case, seed, tests)) for case, seed in jobs]
        missing = records.count(None)
        if missing:
            print(f"{strategy}: not published, {missing} of {len(jobs)} searches are missing")
            continue
        lines = "".join(json.dumps(record.as_json()) + "\n" for record in records)
        # Without a time in the header, equal records have equal files.
        (PUBLISHED / f"{file_name(strategy)}.jsonl.gz").write_bytes(gzip.compress(lines.encode(), mtime=0))
        print(f"{strategy}: published")
    return 0


class Store:
    """The records of a folder: a file of JSON lines per strategy, to which finished jobs are added."""

    def __init__(self, folder: Path, cases: list[Case]) -> None:
        self.folder = folder
        self.records: dict[Job, Record] = {}
        self.current = {case.name: fingerprint(case) for case in cases}
        self.read(folder)

    def read(self, folder: Path) -> None:
        """Adds the records of a folder for which there is no other one."""
        found: dict[Job, Record] = {}
        for file in sorted(folder.glob("*.jsonl*")):
            for line in text_of(file).splitlines():
                try:
                    record = record_from(json.loads(line))
                except (ValueError, TypeError, KeyError):
                    continue  # a line that a kill cut off, or one of an older version: its job is run again
                if self.current.get(record.case) == record.fingerprint:
                    found[record.job] = record
        self.records = found | self.records

    def has(self, job: Job, origin: str) -> bool:
        """Whether there is a record of a job, made by the same version of its strategy."""
        return job in self.records and self.records[job].origin == origin

    def add(self, record: Record) -> None:
        self.records[record.job] = record
        self.folder.mkdir(parents=True, exist_ok=True)
        with (self.folder / f"{file_name(record.strategy)}.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(record.as_json()) + "\n")

    def of(self, seeds: list[int], tests: int) -> list[Record]:
        """All records of these seeds with so many tests, by strategy."""
        records = [record for record in self.records.values() if record.seed in seeds and record.tests == tests]
        return sorted(records, key=lambda record: record.strategy)


def file_name(strategy: str) -> str:
    return "".join(letter if letter.isalnum() else "_" for letter in strategy)


def text_of(file: Path) -> str:
    """What a file of records holds, packed or not."""
    packed = file.suffix == ".gz"
    return gzip.decompress(file.read_bytes()).decode() if packed else file.read_text(encoding="utf-8")


def run_all(jobs: list[Job], store: Store, cases: list[Case], options: argparse.Namespace) -> None:
    """Runs jobs in processes of their own and keeps each record as soon as it is there."""
    folders = {case.name: case.folder for case in cases}
    progress = Progress(len(jobs))
    if not jobs:
        return
    waiting: Iterator[Job] = iter(jobs)
    with ProcessPoolExecutor(max_workers=min(options.workers, len(jobs))) as pool:
        running: set[Future[Record]] = set()
        try:
            while True:
                for job in islice(waiting, 2 * options.workers - len(running)):
                    running.add(pool.submit(run, job, folders[job.case], options.sesamec))
                if not running:
                    break
                done, running = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    store.add(future.result())
                    progress.advance()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        finally:
            progress.end()


class Progress:
    """Tells on standard error how far it is and how long it will take: on a terminal in one line that changes,
    elsewhere in a line every half minute."""

    def __init__(self, total: int) -> None:
        self.total, self.done = total, 0
        self.began = self.told = time.monotonic()
        self.on_terminal = sys.stderr.isatty()

    def advance(self) -> None:
        self.done += 1
        now = time.monotonic()
        if self.on_terminal:
            print(f"\r{self._line(now)}\x1b[K", end="", file=sys.stderr, flush=True)
        elif now - self.told >= 30.0 or self.done == self.total:
            self.told = now
            print(self._line(now), file=sys.stderr, flush=True)

    def end(self) -> None:
        if self.on_terminal and self.done:
            print(file=sys.stderr)

    def _line(self, now: float) -> str:
        left = (now - self.began) / self.done * (self.total - self.done)
        return f"{self.done} of {self.total} searches, {_duration(now - self.began)}, about {_duration(left)} left"


def _duration(seconds: float) -> str:
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {seconds} s" if minutes else f"{seconds} s"


def show(records: list[Record], cases: list[Case], options: argparse.Namespace) -> int:
    """Prints the table and writes it into the folder of the results, in all formats."""
    table = rows(records, cases, options.early)
    text = as_text_of_problems(table, cases) if options.problems else as_text(table, cases)
    texts = {"text": text + "\n", "csv": as_csv(table), "json": as_json(table)}
    if table:
        options.out.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            ending = {"text": "txt"}.get(name, name)
            (options.out / f"table.{ending}").write_text(text, encoding="utf-8")
    print(texts[options.format], end="")
    return 3 if any(row.differing or row.named_otherwise for row in table) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
