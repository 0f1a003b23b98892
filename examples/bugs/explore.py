#!/usr/bin/env python3
"""Looks for the true causes of a case or a problem, for its author: many tests, each violation reduced by the judge.

    python3 explore.py CASE [--tests 3000] [--seed 1]

prints each cause of at most two operations that contains no other one, as a block for `case.toml` with a simple test
that shows it. For each parameter and window, it says from where on this test violates the requirement. How often a
cause was seen says how hard it is to find; if it was once or twice, run more tests: there may be smaller causes.
"""

import argparse
import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from random import Random

from bugs.case import CASES, MOST_OPERATIONS, PROBLEMS, BadCase, Case, Cause, load_cases
from bugs.judge import Judge, minimal
from bugs.space import Choice, Operation, Space, Test, Use, check_permitted
from bugs.strategies.sampling import NEUTRAL, fresh_choice, fresh_test, fresh_window, overlap, strongest
from bugs.world import Outcome

RARE = 12  # a topic with at most so many messages: windows are drawn around them


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case")
    parser.add_argument("--tests", type=int, default=3000, help="how many tests to draw (default: 3000)")
    parser.add_argument("--seed", type=int, default=1, help="determines the tests (default: 1)")
    arguments = parser.parse_args()
    try:
        (case,) = load_cases([arguments.case], PROBLEMS if (PROBLEMS / arguments.case).is_dir() else CASES)
    except BadCase as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    judge = Judge(case.world())
    seen = seen_causes(case, judge, arguments.tests, Random(arguments.seed))
    for cause in sorted(each for each in minimal(set(seen)) if len(each.operations) <= MOST_OPERATIONS):
        count, witness = seen[cause]
        witness = simplified(cause, witness, case.space, judge)
        print(f"# Seen in {count} of {arguments.tests} tests.")
        print(block(cause, witness, case.space))
        for line in limits(cause, witness, case.space, judge):
            print(f"# {line}")
        print()
    return 0


def seen_causes(case: Case, judge: Judge, tests: int, luck: Random) -> dict[Cause, tuple[int, Test]]:
    """All causes of the violations of so many tests: how many tests had each, and the smallest test that shows it."""
    draw = draws(case.space, judge.world.run((), keep_messages=True), luck)
    seen: dict[Cause, tuple[int, Test]] = {}
    for _ in range(tests):
        test = next(draw)
        for cause in judge.causes(test):
            part = tuple(use for use in test if use.operation in cause.operations)
            count, smallest = seen.get(cause, (0, part))
            seen[cause] = count + 1, min(smallest, part, key=size)
    return seen


def size(test: Test) -> tuple[int, float]:
    return len(test), sum(use.end - use.start for use in test)


def draws(space: Space, reference: Outcome, luck: Random) -> Iterator[Test]:
    """Every third test is uniform. In the others operations are strong half of the time, and their windows long, or
    around a message of a rare topic, or around a common moment; in one of four, one acts twice in a row."""
    rare = rare_messages(space, reference)
    operations = list(space.operations.values())
    while True:
        if luck.random() < 1 / 3:
            yield fresh_test(space, luck)
            continue
        chosen = luck.sample(operations, luck.randint(space.fewest, min(space.most, len(operations))))
        moment = luck.uniform(0.0, space.end)
        test = [_use(each, rare.get(each.topic, []), moment, luck) for each in chosen]
        if len(test) < space.most and luck.random() < 0.25:
            test += _again(luck.choice(test), space, luck)
        yield tuple(test)


def rare_messages(space: Space, reference: Outcome) -> dict[int, list[float]]:
    """Per topic with few messages in the reference run: their times."""
    times: dict[int, list[float]] = {}
    topic_of = {path: at for at, topic in enumerate(space.topics) for path in topic.paths}
    for message in reference.messages:
        times.setdefault(topic_of[message.topic], []).append(message.time)
    return {topic: all_ for topic, all_ in times.items() if len(all_) <= RARE}


def _use(operation: Operation, rare: list[float], moment: float, luck: Random) -> Use:
    if luck.random() < 0.5:
        choices = luck.choice(strongest(operation, luck))
    else:
        choices = tuple(fresh_choice(parameter, luck) for parameter in operation.parameters)
    kind = luck.random()
    if kind < 0.25:
        start, end = fresh_window(operation, luck)
    elif kind < 0.5:
        start = operation.start + luck.random() * (operation.end - operation.start - operation.longest)
        end = start + operation.longest
    else:
        around = luck.choice(rare) if rare and luck.random() < 0.7 else moment
        length = operation.longest * 0.01 ** luck.random()
        start = max(operation.start, min(operation.end - length, around - luck.random() * length))
        end = start + length
    return Use(operation.name, start, end, choices, luck.getrandbits(64))


def _again(use: Use, space: Space, luck: Random) -> list[Use]:
    """The same operation right after itself, if there is time left."""
    end = min(use.end + (use.end - use.start), space.operations[use.operation].end)
    return [replace(use, start=use.end, end=end, seed=luck.getrandbits(64))] if end > use.end else []


def simplified(cause: Cause, witness: Test, space: Space, judge: Judge) -> Test:
    """The same operations with rounder times and choices, and the first seed, as far as the cause remains."""
    for at in range(len(witness)):
        operation = space.operations[witness[at].operation]
        changes: list[Callable[[Use], Use]] = [lambda use: replace(use, seed=1)]
        for digits in (2, 1, 0):
            changes.append(lambda use, digits=digits: replace(use, start=_down(use.start, digits)))
            changes.append(lambda use, digits=digits: replace(use, end=_up(use.end, digits)))
            for number in range(len(operation.parameters)):
                changes.append(lambda use, digits=digits, number=number: _rounded(use, number, digits + 1))
        for change in changes:
            use = change(witness[at])
            candidate = (*witness[:at], use, *witness[at + 1 :])
            if is_permitted(use, operation) and not overlap(candidate) and shows(cause, candidate, judge):
                witness = candidate
    return witness


def is_permitted(use: Use, operation: Operation) -> bool:
    try:
        check_permitted(use, operation)
    except ValueError:
        return False
    return use.start < use.end


def shows(cause: Cause, test: Test, judge: Judge) -> bool:
    return cause in judge.causes(test)


def _down(number: float, digits: int) -> float:
    return math.floor(number * 10**digits + 1e-9) / 10**digits


def _up(number: float, digits: int) -> float:
    return math.ceil(number * 10**digits - 1e-9) / 10**digits


def _rounded(use: Use, number: int, digits: int) -> Use:
    choice = use.choices[number]
    if isinstance(choice, str):
        return use
    new = tuple(round(each, digits) for each in choice) if isinstance(choice, tuple) else round(choice, digits)
    return replace(use, choices=(*use.choices[:number], new, *use.choices[number + 1 :]))


def limits(cause: Cause, witness: Test, space: Space, judge: Judge) -> Iterator[str]:
    """From where on a witness violates the requirement, for each parameter that is a number and for each window."""
    for at, use in enumerate(witness):
        operation = space.operations[use.operation]

        def violates(changed: Use, at: int = at) -> bool:
            return shows(cause, (*witness[:at], changed, *witness[at + 1 :]), judge)

        for number, parameter in enumerate(operation.parameters):
            choice = use.choices[number]
            if parameter.shape != "value" or isinstance(choice, tuple):
                continue
            mild = max(parameter.low[0], min(parameter.high[0], NEUTRAL.get(operation.kind["kind"], 0.0)))
            limit = bisected(
                choice, mild, lambda value, number=number: violates(_with_choice(use, number, value)), parameter.whole
            )
            if limit is not None:
                yield f"{use.operation}: {parameter.name} beyond {limit:.6g} {parameter.unit or ''}".rstrip()
        limit = bisected(use.end - use.start, 0.0, lambda length: violates(replace(use, end=use.start + length)))
        if limit is not None:
            yield f"{use.operation}: length above {limit:.6g} s from {use.start:g} s"


def _with_choice(use: Use, number: int, value: Choice) -> Use:
    return replace(use, choices=(*use.choices[:number], value, *use.choices[number + 1 :]))


def bisected(strong: float, mild: float, violates: Callable[[float], bool], whole: bool = False) -> float | None:
    """The value between `strong`, which violates, and `mild` at which that changes; `None` if `mild` violates too."""
    if whole or strong == mild or violates(mild):
        return None
    for _ in range(30):
        middle = (strong + mild) / 2
        if middle in (strong, mild):
            break
        if violates(middle):
            strong = middle
        else:
            mild = middle
    return strong


def block(cause: Cause, witness: Test, space: Space) -> str:
    """A cause as `case.toml` has it."""
    lines = ["[[cause]]", f'requirement = "{cause.requirement}"']
    names = ", ".join(f'"{name}"' for name in cause.operations)
    lines += [f"operations = [{names}]", 'when = ""']
    lines.append("test = [")
    for use in witness:
        fields = [f'operation = "{use.operation}"', f"from = {use.start!r}", f"to = {use.end!r}"]
        for parameter, choice in zip(space.operations[use.operation].parameters, use.choices):
            fields.append(f"{parameter.name} = {_toml(choice)}")
        if use.seed != 1:
            fields.append(f"seed = {use.seed}")
        lines.append(f"  {{ {', '.join(fields)} }},")
    return "\n".join([*lines, "]"])


def _toml(choice: Choice) -> str:
    if isinstance(choice, tuple):
        return f"[{', '.join(repr(number) for number in choice)}]"
    return f'"{choice}"' if isinstance(choice, str) else repr(choice)


if __name__ == "__main__":
    sys.exit(main())
