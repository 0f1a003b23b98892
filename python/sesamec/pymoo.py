"""Sesame's NSGA-II and NSGA-III as an algorithm of pymoo."""

from __future__ import annotations

from typing import Any

import numpy

# pymoo has no types.
from pymoo.core.algorithm import Algorithm  # type: ignore[import-untyped]
from pymoo.core.population import Population  # type: ignore[import-untyped]

from ._native import Evolution


class NSGA(Algorithm):  # type: ignore[misc]  # as above
    """NSGA-II, or NSGA-III with `reference_points`, for real variables; infeasible solutions are worse than all others."""

    def __init__(self, pop_size: int = 100, *, reference_points: bool = False, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.pop_size, self.reference_points = pop_size, reference_points

    def _setup(self, problem: Any, **kwargs: Any) -> None:
        seed = 0 if self.seed is None else int(self.seed)
        self._evolution = Evolution(problem.n_var, self.pop_size, seed, self.reference_points)
        self._alive: dict[int, Any] = {}
        self._told = 0

    def _initialize_infill(self) -> Any:
        return self._infill()

    def _initialize_advance(self, infills: Any = None, **kwargs: Any) -> None:
        self._advance(infills)

    def _infill(self) -> Any:
        problem: Any = self.problem
        low, high = problem.bounds()
        return Population.new("X", low + (high - low) * numpy.array(self._evolution.ask()))

    def _advance(self, infills: Any = None, **kwargs: Any) -> None:
        self._evolution.tell([one.F.tolist() if one.feas else None for one in infills])
        self._alive.update(enumerate(infills, self._told))
        self._told += len(infills)
        self._alive = {number: self._alive[number] for number in self._evolution.survivors()}
        self.pop = Population.create(*self._alive.values())
