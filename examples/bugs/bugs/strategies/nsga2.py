"""NSGA-II [Deb et al. 2002] of pymoo, with its default operators. Needs `pip install pymoo`."""

import numpy
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.evaluator import Evaluator
from pymoo.core.problem import Problem as Objectives
from pymoo.core.termination import NoTermination
from pymoo.problems.static import StaticProblem

from bugs.space import Test
from bugs.strategies import Problem
from bugs.strategies.vector import Encoding
from bugs.world import Outcome

POPULATION = 20


class Strategy:
    """Minimises the margin of each requirement, and the time in which a test disturbs."""

    def __init__(self, problem: Problem, seed: int) -> None:
        self.encoding, self.seed = Encoding(problem.space), seed
        self.objectives = Objectives(
            n_var=self.encoding.size, n_obj=len(problem.space.requirements) + 1, xl=0.0, xu=1.0
        )
        self.algorithm = NSGA2(pop_size=POPULATION)
        self.algorithm.setup(self.objectives, termination=NoTermination(), seed=seed, verbose=False)
        self.generation, self.values, self.asked = self.algorithm.ask(), [], 0

    def ask(self) -> Test:
        self.asked += 1
        vector = self.generation[len(self.values)].X
        return self.encoding.test([float(number) for number in vector], self.seed * 1_000_003 + self.asked)

    def tell(self, test: Test, outcome: Outcome) -> None:
        self.values.append([*outcome.margins.values(), outcome.fuzzing_time])
        if len(self.values) == len(self.generation):
            found = StaticProblem(self.objectives, F=numpy.array(self.values))
            Evaluator().eval(found, self.generation)
            self.algorithm.tell(infills=self.generation)
            self.generation, self.values = self.algorithm.ask(), []
