"""The tree-structured Parzen estimator of Optuna, with its default settings. Needs `pip install optuna`."""

import math

import optuna

from bugs.draws import derived_seed
from bugs.space import Choice, Operation, Parameter, Test, Use
from bugs.strategies import Problem
from bugs.strategies.sampling import SHORTEST
from bugs.world import Outcome


class Strategy:
    """Minimises the smallest margin of any requirement, as a share of its margin in the undisturbed run.

    A trial suggests the number of operations, then which ones, then their windows and parameters: names of suggestions
    belong to an operation, so the estimator learns about each of them in whatever place it stands.
    """

    def __init__(self, problem: Problem, seed: int) -> None:
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self.space, self.seed = problem.space, seed
        self.undisturbed = problem.reference.margins
        self.study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed))
        self.trial: optuna.Trial | None = None

    def ask(self) -> Test:
        self.trial = self.study.ask()
        names = list(self.space.operations)
        most = min(self.space.most, len(names))
        uses: dict[str, Use] = {}
        for place in range(self.trial.suggest_int("operations", self.space.fewest, most)):
            name = self.trial.suggest_categorical(f"operation {place}", names)
            if name not in uses:
                uses[name] = self._use(self.space.operations[name], len(uses))
        return tuple(uses.values())

    def tell(self, test: Test, outcome: Outcome) -> None:
        shares = [
            margin / (self.undisturbed[name] if abs(self.undisturbed[name]) > 1e-9 else 1.0)
            for name, margin in outcome.margins.items()
        ]
        worst = min(shares)
        self.study.tell(self.trial, worst if math.isfinite(worst) else 1.0)

    def _use(self, operation: Operation, place: int) -> Use:
        shortest = max(operation.shortest, SHORTEST * operation.longest)
        length = self.trial.suggest_float(f"{operation.name} length", shortest, operation.longest)
        beginning = self.trial.suggest_float(f"{operation.name} beginning", 0.0, 1.0)
        start = operation.start + beginning * (operation.end - operation.start - length)
        choices = tuple(self._choice(operation.name, parameter) for parameter in operation.parameters)
        seed = derived_seed(self.seed, "use", self.trial.number, place)
        return Use(operation.name, start, min(start + length, operation.end), choices, seed)

    def _choice(self, operation: str, parameter: Parameter) -> Choice:
        name, suggest = f"{operation} {parameter.name}", self.trial.suggest_float
        match parameter.shape:
            case "text":
                return self.trial.suggest_categorical(name, parameter.texts)
            case "point":
                axes = zip("xyz", parameter.low, parameter.high)
                return tuple(suggest(f"{name} {axis}", low, high) for axis, low, high in axes)
            case "range":
                ends = sorted(suggest(f"{name} {end}", parameter.low[0], parameter.high[0]) for end in ("a", "b"))
                return tuple(ends)
            case _ if parameter.whole:
                return float(self.trial.suggest_int(name, round(parameter.low[0]), round(parameter.high[0])))
            case _:
                return suggest(name, parameter.low[0], parameter.high[0])
