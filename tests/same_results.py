#!/usr/bin/env python3
"""Runs every campaign of the examples with two versions of Sesame and compares what they recorded.

    tests/same_results.py BEFORE [AFTER] [EXAMPLE ...]

BEFORE and AFTER are git revisions; AFTER is the current commit if omitted. Without an EXAMPLE, all run whose system is
stepped, since only these give equal results twice. `coverage_experiment` runs with the seeds 1 to 10, every other
campaign with its own seed; searches over ROS 2 make 20 tests. The exit code is 0 if the results are equal, 1 otherwise.

What is compared: every row of every table, column by column, with the words of an earlier results schema translated
(RENAMED_COLUMNS, RENAMED_VALUES). What is not: columns that hold versions, wall times, hosts, or the plan as JSON
(IGNORED), and the sentences of warnings. Columns that only one version has are listed. Both digests are printed too: they
are equal if the schema and the words are.

Needs Python 3.11, for which there are wheels of ROS 2, git, cargo and a C compiler. Everything it makes lies in
target/same_results.
"""

import hashlib
import os
import pathlib
import re
import sqlite3
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOLDER = ROOT / "target" / "same_results"

# The spaces of each example; an example over ROS 2 needs an environment for its nodes.
SPACES = {
    "kuka_cell": ["kuka_cell.sesame", "study.sesame"],
    "two_robots": ["two_robots.sesame"],
    "a50_cell": ["a50_cell.sesame"],
    "transport": ["transport.sesame", "mended.sesame"],
    "fleet": ["fleet.sesame"],
    "iiwa_cell": ["iiwa_cell.sesame"],
}
ROS2 = ["fleet", "iiwa_cell"]
# How many tests a search of these makes at most: each takes seconds.
ROS2_TESTS = 20
SEEDS = {"coverage_experiment": range(1, 11)}

# Earlier name -> name today.
RENAMED_COLUMNS = {
    ("operations", "draw_seed"): "operation_seed",
    ("indicators", "void"): "no_effect",
}
RENAMED_VALUES = {
    ("tests", "outcome"): {"void": "no_effect"},
    ("repetitions", "outcome"): {"void": "no_effect"},
}
# Tables and columns that differ from run to run or from version to version.
IGNORED_TABLES = {"sessions", "wall_times", "meta"}
IGNORED = {
    ("campaign", "plan"),
    ("campaign", "schema"),
    ("campaign", "generator"),
    ("campaign", "runtime"),
    ("campaign", "task"),
    ("tests", "time_limit_s"),
    ("repetitions", "time_limit_s"),
    ("events", "text"),
    ("events", "id"),
}


def call(*command, folder=ROOT, path=os.environ["PATH"]):
    print("   ", " ".join(str(word) for word in command), flush=True)
    words, environment = [str(word) for word in command], {**os.environ, "PATH": path}
    subprocess.run(words, cwd=folder, check=True, stdin=subprocess.DEVNULL, env=environment)


def campaigns(space):
    """The campaigns of a space, in their order, and whether each searches."""
    blocks = re.findall(r"^campaign +(\w+)(.*?)(?=^campaign |\Z)", space.read_text(), re.MULTILINE | re.DOTALL)
    return [(name, not re.search(r"\b(repeat|passive)\b", block)) for name, block in blocks]


def results_of(revision, examples):
    """Checks a revision out, builds it, and runs everything; returns the results by campaign and seed."""
    commit = subprocess.run(
        ["git", "rev-parse", "--verify", revision + "^{commit}"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.strip()
    folder = FOLDER / commit
    if not folder.exists():
        call("git", "worktree", "add", "--detach", folder, commit)
    over_ros2 = any(example in ROS2 for example in examples)
    # Of `sesamec`, whatever its crate is called in that revision.
    features = ["--features", "ros2"] if over_ros2 else []
    call("cargo", "build", "--quiet", "--locked", "--bin", "sesamec", *features, folder=folder)
    # The simulator of the study, which is found on PATH.
    call("cargo", "build", "--quiet", "--locked", "--package", "kuka_cell_lab", folder=folder)
    path = f"{folder / 'target' / 'debug'}{os.pathsep}{os.environ['PATH']}"
    sesamec = folder / "target" / "debug" / "sesamec"
    results = {}
    for example in examples:
        if example in ROS2:
            call(sys.executable, "examples/set_up.py", f"examples/{example}", folder=folder)
        for name in SPACES[example]:
            space = folder / "examples" / example / name
            for campaign, searches in campaigns(space):
                for seed in SEEDS.get(campaign, [None]):
                    place = FOLDER / "results" / commit / space.stem / campaign / str(seed or "own")
                    if not list(place.rglob("results.sqlite")):
                        options = ["--results", place, "--fail-on", "nothing"]
                        options += [] if seed is None else ["--seed", seed]
                        options += ["--evaluations", ROS2_TESTS] if searches and example in ROS2 else []
                        call(sesamec, "run", space, "--campaign", campaign, "--", *options, folder=folder, path=path)
                    results[example, space.stem, campaign, seed] = place
    return results


def rows(connection, table):
    """The columns of a table by the names of today, and its rows, sorted, with the words of today."""
    cursor = connection.execute(f'SELECT * FROM "{table}"')
    names = [column[0] for column in cursor.description]
    kept = [(at, name) for at, name in enumerate(names) if (table, name) not in IGNORED]
    columns = [RENAMED_COLUMNS.get((table, name), name) for _, name in kept]
    words = [RENAMED_VALUES.get((table, name), {}) for name in columns]
    found = [tuple(word.get(row[at], row[at]) for (at, _), word in zip(kept, words)) for row in cursor]
    return columns, found


def content(folder):
    """Every table of a results file: its columns, and a hash for each column over the rows in their order."""
    files = list(folder.rglob("results.sqlite"))
    if len(files) != 1:
        raise SystemExit(f"error: {folder} holds {len(files)} results files, not one")
    connection = sqlite3.connect(f"file:{files[0]}?mode=ro", uri=True)
    tables = [name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name")]
    made = {}
    for table in tables:
        if table in IGNORED_TABLES or table.startswith("sqlite_"):
            continue
        columns, found = rows(connection, table)
        # By the columns in the order of their names, so that a column that moved changes nothing.
        order = sorted(range(len(columns)), key=lambda at: columns[at])
        found = sorted((tuple(repr(row[at]) for at in order) for row in found))
        made[table] = {
            columns[at]: hashlib.sha256("\n".join(row[place] for row in found).encode()).hexdigest()
            for place, at in enumerate(order)
        }
        made[table]["(number of rows)"] = str(len(found))
    return made


def digest(folder):
    """The digest, as the page of a run shows it."""
    page = next(folder.rglob("report.html")).read_text()
    return re.search(r"<dt>Digest</dt>\s*<dd[^>]*>([0-9a-f]+)", page).group(1)


def main():
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        return 0 if len(sys.argv) == 2 else 2
    revisions = [word for word in sys.argv[1:] if word not in SPACES]
    examples = [word for word in sys.argv[1:] if word in SPACES] or list(SPACES)
    if len(revisions) not in (1, 2):
        raise SystemExit(f"error: expected one or two revisions, found {len(revisions)}: {' '.join(revisions)}")
    before = results_of(revisions[0], examples)
    after = results_of(revisions[1] if len(revisions) == 2 else "HEAD", examples)
    differing = 0
    one_sided = set()
    for key in sorted(before.keys() | after.keys(), key=str):
        named = "/".join(str(part) for part in key if part is not None)
        if key not in before or key not in after:
            print(f"{named}: only {'before' if key in before else 'after'}")
            differing += 1
            continue
        old, new = content(before[key]), content(after[key])
        found = []
        for table in sorted(old.keys() | new.keys()):
            for column in sorted(old.get(table, {}).keys() | new.get(table, {}).keys()):
                sides = old.get(table, {}).get(column), new.get(table, {}).get(column)
                if None in sides:
                    one_sided.add(f"{table}.{column}: only {'before' if sides[1] is None else 'after'}")
                elif sides[0] != sides[1]:
                    found.append(f"{table}.{column}")
        differing += bool(found)
        digests = digest(before[key]), digest(after[key])
        same = "equal digests" if digests[0] == digests[1] else f"digests {digests[0][:12]} and {digests[1][:12]}"
        print(f"{named}: {'DIFFERS in ' + ', '.join(found) if found else 'equal'}, {same}", flush=True)
    for line in sorted(one_sided):
        print(line)
    print(f"{len(before.keys() | after.keys())} campaigns, {differing} of them differ")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
