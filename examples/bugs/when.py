#!/usr/bin/env python3
"""Judges what `sesamec shrink --violations --when` says of when operations have to act, by the judge's world.

For each cause that a search finds, Sesame shrinks the smallest test and describes with which windows of its operations
it violates the requirement. The judge draws windows of its own, tries them in its own world, and compares. A
description is right if it says what comes out for at least 90 % of the windows. Windows that violate and windows that
do not count half each, unless there are hardly any of one kind. Operations without a description are
counted separately. What the case states is printed next to each, so that you can read whether it is the reason, too.

exit codes:
  0    at least 80 % of the descriptions are right
  1    failed: the last line says why
  2    wrong usage
  3    fewer are
"""

import argparse
import math
import random
import sys
from dataclasses import replace
from pathlib import Path

import run as command
from bugs.case import BadCase, Case, cause, load_cases
from bugs.judge import Judge
from bugs.sesamec import SesamecFailed, Shrunk, Trigger, shrunk_causes
from bugs.space import Test, Use

# How many windows the judge draws for each operation.
WINDOWS = 90
# The share of windows of which a right description says what comes out.
RIGHT = 0.9
# Where one of both outcomes is rarer than this, windows count alike.
RARE = 0.1
# The share of descriptions that have to be right.
ENOUGH = 0.8


def main(arguments: list[str]) -> int:
    options = parsed(arguments)
    right = count = missing = 0
    try:
        for case in load_cases(options.cases):
            judge = Judge(case.world())
            for seed in options.seeds:
                of = (options.sesamec, case.space_file, case.space, seed, options.tests)
                for shrunk in shrunk_causes(*of, ["--when"]):
                    for trigger in shrunk.triggers:
                        if trigger.text is None:
                            missing += 1
                            continue
                        agreement = agreement_of(judge, case, shrunk, trigger, seed)
                        count += 1
                        right += agreement >= RIGHT
                        print(row(case, seed, shrunk, trigger, agreement), flush=True)
    except (BadCase, SesamecFailed) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"{right} of {count} descriptions are right; {missing} operations have none")
    return 0 if right >= ENOUGH * count else 3


def parsed(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=lambda text: text.split(","), metavar="A,B", help="these cases (default: all)")
    parser.add_argument("--seeds", type=command.seeds, default="1", metavar="1-20", help="seeds (default: 1)")
    parser.add_argument("--tests", type=command.positive, default=120, help="tests per search (default: 120)")
    parser.add_argument("--sesamec", type=command.program, required=True, metavar="PATH", help="the program of Sesame")
    return parser.parse_args(arguments)


def agreement_of(judge: Judge, case: Case, shrunk: Shrunk, trigger: Trigger, seed: int) -> float:
    """The share of windows of which a description says what comes out."""
    use = shrunk.test[trigger.position]
    said: dict[bool, list[bool]] = {True: [], False: []}
    for start, end in windows(case, shrunk.test, use, random.Random(f"{case.name} {seed} {use.operation}")):
        test = list(shrunk.test)
        test[trigger.position] = replace(use, start=start, end=end)
        violates = shrunk.requirement in judge.outcome(tuple(test)).violated
        said[violates].append(trigger.violates(start, end))
    right = {violates: sum(saying == violates for saying in sayings) for violates, sayings in said.items()}
    tried = sum(map(len, said.values()))
    if min(map(len, said.values())) < RARE * tried:
        return sum(right.values()) / tried
    return sum(right[violates] / len(sayings) for violates, sayings in said.items()) / len(said)


def windows(case: Case, test: Test, use: Use, draws: random.Random) -> list[tuple[float, float]]:
    """Windows that are permitted: in turn one around that of the test, one of its length, and one of any length.

    Copies of an operation are never active together, so windows that meet one of a copy are left out.
    """
    operation = case.space.operations[use.operation]
    copies = [other for other in test if other.operation == use.operation and other != use]
    most = min(operation.longest, operation.end - operation.start)
    least = max(operation.shortest, most * 1e-3)
    own = use.end - use.start
    found = []
    for number in range(WINDOWS):
        if number % 3 == 0:
            length = draws.uniform(own, max(own, most))
            first, last = max(operation.start, use.end - length), min(use.start, operation.end - length)
        else:
            length = own if number % 3 == 1 else math.exp(draws.uniform(math.log(least), math.log(most)))
            first, last = operation.start, operation.end - length
        start = draws.uniform(first, max(first, last))
        end = min(start + length, operation.end)
        if not any(start < copy.end and copy.start < end for copy in copies):
            found.append((start, end))
    return found


def row(case: Case, seed: int, shrunk: Shrunk, trigger: Trigger, agreement: float) -> str:
    shrunk_cause = cause(shrunk.requirement, tuple({use.operation for use in shrunk.test}))
    stated = "; ".join(true.when for true in case.causes if true.cause == shrunk_cause)
    said = f"{trigger.operation} {trigger.text}"
    lines = [f"{case.name}, seed {seed}, {shrunk_cause}", said, f"the case: {stated or 'no such cause'}"]
    return f"{agreement:4.0%}  " + "\n      ".join(lines)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
