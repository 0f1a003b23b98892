"""Sesame's searches as a sampler of Optuna."""

from __future__ import annotations

import math
import threading
from typing import Any, Mapping, Sequence

import optuna
from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution, IntDistribution
from optuna.trial import FrozenTrial, TrialState

from ._native import Evolution, Falsification

STRATEGIES = ("nsga2", "nsga3", "falsification")


class Sampler(optuna.samplers.BaseSampler):
    """Samples trials by `strategy`: "nsga2" or "nsga3" for any number of objectives, in generations of `population`;
    "falsification" for expensive functions, each of whose values is a margin that is negative where a requirement is
    violated.

    Parameters of the first complete trial are searched; others, and the first trial, are random. While trials of a
    generation are still running, further ones are random, too.
    """

    def __init__(self, strategy: str = "nsga2", *, population: int = 20, seed: int = 0) -> None:
        if strategy not in STRATEGIES:
            raise ValueError(f"`{strategy}` is not a strategy; there are {', '.join(STRATEGIES)}")
        self._strategy, self._population, self._seed = strategy, population, seed
        self._random = optuna.samplers.RandomSampler(seed=seed)
        self._common = optuna.search_space.IntersectionSearchSpace()
        self._space: dict[str, BaseDistribution] = {}
        self._search: Evolution | Falsification | None = None
        self._waiting: list[tuple[int, list[float]]] = []
        #: The place of each running trial in its generation.
        self._running: dict[int, int] = {}
        self._results: list[Sequence[float] | None] = []
        self._awaited = 0
        # Optuna may run trials in threads.
        self._lock = threading.RLock()

    def reseed_rng(self) -> None:
        self._random.reseed_rng()

    def infer_relative_search_space(self, study: optuna.Study, trial: FrozenTrial) -> dict[str, BaseDistribution]:
        with self._lock:
            if not self._space:
                common = self._common.calculate(study)
                self._space = {name: domain for name, domain in common.items() if not domain.single()}
            return self._space

    def sample_relative(
        self, study: optuna.Study, trial: FrozenTrial, search_space: dict[str, BaseDistribution]
    ) -> dict[str, Any]:
        with self._lock:
            if not search_space:
                return {}
            if self._search is None:
                self._search = self._begin(len(search_space), len(study.directions))
            if not self._waiting and self._awaited == 0:
                points = self._search.ask()
                self._waiting = list(enumerate(points))
                self._results = [None for _ in points]
                self._awaited = len(points)
            if not self._waiting:
                return {}
            place, point = self._waiting.pop(0)
            self._running[trial.number] = place
            return {name: _value(domain, x) for (name, domain), x in zip(search_space.items(), point)}

    def sample_independent(
        self, study: optuna.Study, trial: FrozenTrial, param_name: str, param_distribution: BaseDistribution
    ) -> Any:
        return self._random.sample_independent(study, trial, param_name, param_distribution)

    def after_trial(
        self, study: optuna.Study, trial: FrozenTrial, state: TrialState, values: Sequence[float] | None
    ) -> None:
        with self._lock:
            place = self._running.pop(trial.number, None)
            if place is None or self._search is None:
                return
            if state == TrialState.COMPLETE and values is not None and all(map(math.isfinite, values)):
                maximised = [direction == optuna.study.StudyDirection.MAXIMIZE for direction in study.directions]
                self._results[place] = [-value if up else value for value, up in zip(values, maximised)]
            self._awaited -= 1
            if self._awaited == 0:
                self._search.tell(self._results)

    def _begin(self, variables: int, objectives: int) -> Evolution | Falsification:
        if self._strategy == "falsification":
            return Falsification(variables, objectives, self._seed)
        return Evolution(variables, self._population, self._seed, self._strategy == "nsga3")


def _value(domain: BaseDistribution, x: float) -> Any:
    """The value of a parameter at this place of its domain, from 0 to 1."""
    if isinstance(domain, CategoricalDistribution):
        return domain.choices[min(int(x * len(domain.choices)), len(domain.choices) - 1)]
    assert isinstance(domain, (FloatDistribution, IntDistribution))
    low, high, step = domain.low, domain.high, domain.step
    if domain.log:
        # Whole numbers have equal shares of the logarithm's range, up to its ends.
        whole = isinstance(domain, IntDistribution)
        ends = (low - 0.5, high + 0.5) if whole else (low, high)
        value = math.exp(math.log(ends[0]) + x * (math.log(ends[1]) - math.log(ends[0])))
        value = round(value) if whole else value
    elif step is None:
        value = low + x * (high - low)
    else:
        steps = round((high - low) / step)
        value = low + step * min(int(x * (steps + 1)), steps)
    return min(max(value, low), high)
