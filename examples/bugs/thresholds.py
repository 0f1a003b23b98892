#!/usr/bin/env python3
"""Judges what `sesamec shrink --violations` says of thresholds, by the judge's world.

For each cause that a search finds, Sesame shrinks the smallest test and says from which value of each parameter on the
test violates the requirement. The judge looks for that value itself, by bisection between what Sesame saw violate and
what it saw not violate, and compares. Sesame looks in steps of a hundredth of what is permitted, so it may be off by
such a step, however small the true threshold is.

exit codes:
  0    each threshold is within the tolerance, or a step
  1    failed: the last line says why
  2    wrong usage
  3    some threshold is not
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import run as command
from bugs.case import BadCase, Case, load_cases
from bugs.judge import Judge
from bugs.sesamec import SesamecFailed, Shrunk, ShrunkThreshold, shrunk_causes
from bugs.space import Test

# How often the interval in which the true threshold lies is halved.
HALVINGS = 20
# In which steps Sesame shrinks a parameter, as a share of what is permitted.
STEP = 0.01


def main(arguments: list[str]) -> int:
    options = parsed(arguments)
    far = count = 0
    try:
        for case in load_cases(options.cases):
            judge = Judge(case.world())
            for seed in options.seeds:
                for shrunk in shrunk_causes(options.sesamec, case.space_file, case.space, seed, options.tests):
                    for threshold in shrunk.thresholds:
                        true = true_threshold(judge, case, shrunk, threshold)
                        count += 1
                        if true is None or not is_near(true, case, threshold, options.tolerance):
                            far += 1
                            what = f"{case.name}, seed {seed}, {threshold.operation} {threshold.parameter}"
                            seen = "the judge sees otherwise" if true is None else f"the true one is {true:g}"
                            print(f"{what}: violates at {threshold.fails:g}, not at {threshold.passes:g}: {seen}")
    except (BadCase, SesamecFailed) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"{count - far} of {count} thresholds are within {options.tolerance:.0%} of the true one, or a step")
    return 3 if far else 0


def parsed(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=lambda text: text.split(","), metavar="A,B", help="these cases (default: all)")
    parser.add_argument("--seeds", type=command.seeds, default="1", metavar="1-20", help="seeds (default: 1)")
    parser.add_argument("--tests", type=command.positive, default=120, help="tests per search (default: 120)")
    parser.add_argument(
        "--tolerance", type=float, default=0.1, help="as a share of the true threshold (default: 0.1)"
    )
    parser.add_argument("--sesamec", type=command.program, required=True, metavar="PATH", help="the program of Sesame")
    return parser.parse_args(arguments)


def true_threshold(judge: Judge, case: Case, shrunk: Shrunk, threshold: ShrunkThreshold) -> float | None:
    """The mildest value that violates, between the two that Sesame saw. `None` if one of these does otherwise."""

    def violates(value: float) -> bool:
        return shrunk.requirement in judge.outcome(_with(shrunk.test, case, threshold, value)).violated

    inside, outside = threshold.fails, threshold.passes
    if not violates(inside) or violates(outside):
        return None
    for _ in range(HALVINGS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if violates(middle) else (inside, middle)
    return inside


def is_near(true: float, case: Case, threshold: ShrunkThreshold, tolerance: float) -> bool:
    parameters = case.space.operations[threshold.operation].parameters
    (parameter,) = [each for each in parameters if each.name == threshold.parameter]
    step = STEP * (parameter.high[0] - parameter.low[0])
    return abs(threshold.fails - true) <= max(tolerance * abs(true), step * (1 + 1e-9))


def _with(test: Test, case: Case, threshold: ShrunkThreshold, value: float) -> Test:
    use = test[threshold.position]
    names = [parameter.name for parameter in case.space.operations[use.operation].parameters]
    chosen = zip(names, use.choices, strict=True)
    choices = [value if name == threshold.parameter else choice for name, choice in chosen]
    return (*test[: threshold.position], replace(use, choices=tuple(choices)), *test[threshold.position + 1 :])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
