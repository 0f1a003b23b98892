"""An example of a strategy of your own, for `run.py own_strategy.py:StrongestFirst`.

It runs each operation alone over the whole time in which it may be active, then combines at random those that brought
the system closest to a violation.
"""

from random import Random

from bugs.space import Operation, Test, Use
from bugs.strategies import Problem
from bugs.strategies.sampling import fresh_use, strongest
from bugs.world import Outcome


class StrongestFirst:
    def __init__(self, problem: Problem, seed: int) -> None:
        self.space, self.luck = problem.space, Random(seed)
        self.alone = [self.strongest(operation) for operation in self.space.operations.values()]
        self.margins: dict[str, float] = {}  # of operations that were run alone

    def ask(self) -> Test:
        if self.alone:
            return (self.alone.pop(),)
        nearest = sorted(self.margins, key=self.margins.get)[: self.space.most + 1]
        chosen = self.luck.sample(nearest, self.luck.randint(1, min(self.space.most, len(nearest))))
        return tuple(fresh_use(self.space.operations[name], self.luck) for name in chosen)

    def tell(self, test: Test, outcome: Outcome) -> None:
        if len(test) == 1:
            self.margins.setdefault(test[0].operation, min(outcome.margins.values()))

    def strongest(self, operation: Operation) -> Use:
        choices = self.luck.choice(strongest(operation, self.luck))
        return Use(operation.name, operation.start, operation.start + operation.longest, choices, seed=1)
