"""The judge: which operations of a violating test are to blame, found by running parts of it again.

It uses nothing that a strategy or Sesame says about a test, only what the test contains.
"""

from functools import lru_cache
from itertools import combinations

from bugs.case import Cause, cause
from bugs.space import Test
from bugs.world import Outcome, World

# Changes whenever the judge, the operations or the metrics come to other results: recorded results are then run again.
VERSION = 1


class Judge:
    """Judges tests in a world. Parts of tests that were judged before are not run again, up to a few thousand."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.outcome = lru_cache(maxsize=4096)(self._run)

    def causes(self, test: Test) -> set[Cause]:
        """For each requirement that a test violates, all inclusion-minimal sets of its operations that violate it.

        A part of a test has all uses of some of its operations, with their windows, choices and seeds.
        """
        violated = self.outcome(test).violated
        found: set[Cause] = set()
        names = sorted({use.operation for use in test})
        for size in range(1, len(names) + 1):
            for part in combinations(names, size):
                open_ = [name for name in violated if not _explained(cause(name, part), found)]
                if open_:
                    outcome = self.outcome(tuple(use for use in test if use.operation in part))
                    found |= {cause(name, part) for name in open_ if name in outcome.violated}
        return found

    def _run(self, test: Test) -> Outcome:
        return self.world.run(test)


def _explained(candidate: Cause, found: set[Cause]) -> bool:
    return any(candidate.contains(smaller) for smaller in found)


def minimal(causes: set[Cause]) -> set[Cause]:
    """Those that contain no other one of them."""
    return {each for each in causes if not any(other != each and each.contains(other) for other in causes)}
