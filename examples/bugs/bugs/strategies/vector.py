"""Tests as vectors of fixed length, for optimisers that know nothing else."""

from bugs.draws import derived_seed
from bugs.space import Choice, Operation, Parameter, Space, Test, Use
from bugs.strategies.sampling import SHORTEST


class Encoding:
    """Vectors in the unit cube, and the tests that they stand for. Such a test has each operation at most once.

    The first coordinate is the number of operations. Each operation has a place of so many coordinates: which one of
    those that are left, length and beginning of its window, then its parameters.
    """

    def __init__(self, space: Space) -> None:
        self.space = space
        operations = space.operations.values()
        self.most = min(space.most, len(space.operations))
        self.place = 3 + max(sum(map(_width, operation.parameters)) for operation in operations)
        self.size = 1 + self.most * self.place

    def test(self, vector: list[float], seed: int) -> Test:
        """The test of a vector; `seed` is that of its random draws."""
        left = list(self.space.operations.values())
        uses = []
        for at in range(_whole(vector[0], self.space.fewest, self.most)):
            place = vector[1 + at * self.place : 1 + (at + 1) * self.place]
            operation = left.pop(_whole(place[0], 0, len(left) - 1))
            choices, place_of_parameter = [], 3
            for parameter in operation.parameters:
                numbers = place[place_of_parameter : place_of_parameter + _width(parameter)]
                choices.append(_choice(parameter, numbers))
                place_of_parameter += _width(parameter)
            start, end = _window(operation, place[1], place[2])
            uses.append(Use(operation.name, start, end, tuple(choices), derived_seed(seed, "use", at)))
        return tuple(uses)


def _width(parameter: Parameter) -> int:
    return {"range": 2, "point": 3}.get(parameter.shape, 1)


def _whole(unit: float, low: int, high: int) -> int:
    """A whole number from low to high, each as likely."""
    return min(high, low + int(unit * (high - low + 1)))


def _window(operation: Operation, length: float, beginning: float) -> tuple[float, float]:
    shortest = max(operation.shortest, SHORTEST * operation.longest)
    seconds = shortest + length * (operation.longest - shortest)
    start = operation.start + beginning * (operation.end - operation.start - seconds)
    return start, min(start + seconds, operation.end)


def _choice(parameter: Parameter, numbers: list[float]) -> Choice:
    if parameter.shape == "text":
        return parameter.texts[_whole(numbers[0], 0, len(parameter.texts) - 1)]
    if parameter.whole and parameter.shape == "value":
        return float(_whole(numbers[0], round(parameter.low[0]), round(parameter.high[0])))
    axes = 2 if parameter.shape == "range" else 1
    low, high = axes * parameter.low, axes * parameter.high
    scaled = [least + unit * (most - least) for least, unit, most in zip(low, numbers, high)]
    if parameter.shape == "value":
        return scaled[0]
    return tuple(sorted(scaled)) if parameter.shape == "range" else tuple(scaled)
