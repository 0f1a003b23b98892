"""Independent random tests: what a search must beat."""

from random import Random

from bugs.space import Test
from bugs.strategies import Problem
from bugs.strategies.sampling import fresh_test
from bugs.world import Outcome


class Strategy:
    """Draws each test anew, and learns nothing."""

    def __init__(self, problem: Problem, seed: int) -> None:
        self.space, self.luck = problem.space, Random(seed)

    def ask(self) -> Test:
        return fresh_test(self.space, self.luck)

    def tell(self, test: Test, outcome: Outcome) -> None:
        pass
