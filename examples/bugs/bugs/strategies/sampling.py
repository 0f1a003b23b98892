"""Parts from which strategies make tests."""

from random import Random

from bugs.space import Choice, Operation, Parameter, Space, Test, Use

SHORTEST = 1e-3  # of the longest window: shorter ones are not drawn

# Where a parameter disturbs nothing, by the kind of operation; others disturb at every value.
NEUTRAL = {
    "scale": 1.0,
    "duplicate": 1.0,
    **dict.fromkeys(
        ["bias", "clock_skew", "drift", "noise", "random_walk", "packet_loss", "latency", "reorder", "stale"], 0.0
    ),
}


def fresh_test(space: Space, luck: Random) -> Test:
    """A test with uniform windows and choices: three of four have different operations, as far as there are enough.

    Sesame's `random` draws the same, but for a share of windows and choices that it takes from the ends.
    """
    count = luck.randint(space.fewest, space.most)
    operations = list(space.operations.values())
    if luck.random() < 0.25:
        chosen = luck.choices(operations, k=count)
    else:
        chosen = luck.sample(operations, min(count, len(operations)))
        chosen += luck.choices(operations, k=count - len(chosen))
    while True:
        test = tuple(fresh_use(operation, luck) for operation in chosen)
        if not overlap(test):
            return test


def fresh_use(operation: Operation, luck: Random) -> Use:
    """An operation with a uniform window and uniform choices."""
    choices = tuple(fresh_choice(parameter, luck) for parameter in operation.parameters)
    return Use(operation.name, *fresh_window(operation, luck), choices, luck.getrandbits(64))


def fresh_window(operation: Operation, luck: Random) -> tuple[float, float]:
    """A window, uniform over all that fit."""
    room = operation.end - operation.start
    shortest = max(operation.shortest, SHORTEST * operation.longest)
    while True:
        length = luck.uniform(shortest, operation.longest)
        if luck.random() * (room - shortest) <= room - length:  # the longer, the fewer places there are
            start = operation.start + luck.random() * (room - length)
            return start, min(start + length, operation.end)


def fresh_choice(parameter: Parameter, luck: Random) -> Choice:
    """A uniform choice; a sub-range has two uniform ends."""
    match parameter.shape:
        case "text":
            return luck.choice(parameter.texts)
        case "point":
            return tuple(luck.uniform(low, high) for low, high in zip(parameter.low, parameter.high))
        case "range":
            low, high = sorted(luck.uniform(parameter.low[0], parameter.high[0]) for _ in range(2))
            return low, high
        case _ if parameter.whole:
            return float(luck.randint(round(parameter.low[0]), round(parameter.high[0])))
        case _:
            return luck.uniform(parameter.low[0], parameter.high[0])


def strongest(operation: Operation, luck: Random) -> list[tuple[Choice, ...]]:
    """The choices with which an operation disturbs most: two for a parameter that can be off in both directions."""
    ends = [_ends(parameter, NEUTRAL.get(operation.kind["kind"]), luck) for parameter in operation.parameters]
    sides = max((len(each) for each in ends), default=1)
    return [tuple(each[min(side, len(each) - 1)] for each in ends) for side in range(sides)]


def _ends(parameter: Parameter, neutral: float | None, luck: Random) -> list[Choice]:
    match parameter.shape:
        case "text":
            return [luck.choice(parameter.texts)]
        case "point":
            return [tuple(luck.choice(ends) for ends in zip(parameter.low, parameter.high))]
        case "range":
            return [2 * parameter.high]
    low, high = parameter.low[0], parameter.high[0]
    if neutral is None or low < neutral < high:
        return [high, low]
    return [max(low, high, key=lambda end: abs(end - neutral))]


def overlap(test: Test) -> bool:
    """Whether two uses of one operation act at the same time."""
    uses = sorted(test, key=lambda use: (use.operation, use.start))
    return any(one.operation == other.operation and other.start < one.end for one, other in zip(uses, uses[1:]))
