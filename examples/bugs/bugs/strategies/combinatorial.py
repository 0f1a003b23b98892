"""Combinatorial testing as in the textbook: each operation, then each two, at full strength.

First over the whole run, then each two in each half, quarter and eighth of it. It learns nothing; the seed decides the
order within a level, the corners of points, and where windows lie whose length is limited.
"""

from collections.abc import Iterator
from itertools import combinations
from random import Random

from bugs.space import Choice, Operation, Space, Test, Use
from bugs.strategies import Problem
from bugs.strategies.sampling import fresh_test, strongest
from bugs.world import Outcome


class Strategy:
    """Goes through the levels, then draws random tests."""

    def __init__(self, problem: Problem, seed: int) -> None:
        self.tests = _tests(problem.space, Random(seed))

    def ask(self) -> Test:
        return next(self.tests)

    def tell(self, test: Test, outcome: Outcome) -> None:
        pass


def _tests(space: Space, luck: Random) -> Iterator[Test]:
    operations = list(space.operations.values())
    if space.fewest == 1:
        singles = [(each, choices) for each in operations for choices in strongest(each, luck)]
        luck.shuffle(singles)
        for operation, choices in singles:
            yield (_use(operation, choices, (0.0, space.end), luck),)
    for parts in (1, 2, 4, 8):
        pairs = [(pair, part) for pair in combinations(operations, 2) for part in range(parts)]
        luck.shuffle(pairs)
        for pair, part in pairs if space.most >= 2 else ():
            span = space.end * part / parts, space.end * (part + 1) / parts
            yield tuple(_use(each, luck.choice(strongest(each, luck)), span, luck) for each in pair)
    while True:
        yield fresh_test(space, luck)


def _use(operation: Operation, choices: tuple[Choice, ...], span: tuple[float, float], luck: Random) -> Use:
    """An operation for as long as it may be active in this part of the run, or in all of it if never in the part."""
    start, end = max(span[0], operation.start), min(span[1], operation.end)
    if end - start < max(operation.shortest, 1e-9):
        start, end = operation.start, operation.end
    length = min(operation.longest, end - start)
    start += luck.random() * (end - start - length)
    return Use(operation.name, start, start + length, choices, luck.getrandbits(64))
