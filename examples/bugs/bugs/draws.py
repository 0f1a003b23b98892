"""Random numbers of operations: each is a function of the operation's seed and of the message, as in Sesame.

Sesame records the seed of each operation of a test, so a recorded test with losses or noise can be run again with the
same losses and the same noise. The hash is the finaliser of SplitMix64.
"""

import math

_BITS = (1 << 64) - 1
_GOLDEN = 0x9E3779B97F4A7C15


def mix(x: int) -> int:
    """A bijection of 64 bits in which each bit of `x` affects all bits of the result."""
    x = (x + _GOLDEN) & _BITS
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & _BITS
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & _BITS
    return x ^ (x >> 31)


def derived_seed(seed: int, purpose: str, *path: int) -> int:
    """The seed of a purpose under a seed."""
    name = 0xCBF29CE484222325
    for byte in purpose.encode():
        name = ((name ^ byte) * 0x100000001B3) & _BITS
    state = mix(seed ^ mix(name))
    for part in path:
        state = mix(state ^ mix((part + _GOLDEN) & _BITS))
    return state


class Draws:
    """The random numbers of one operation for one message: the `message`th of the `member`th path of its topic."""

    def __init__(self, seed: int, member: int, message: int) -> None:
        seed = seed if member == 0 else derived_seed(seed, "member", member)
        self.key = mix(seed ^ mix(message))

    def unit(self, number: int) -> float:
        """The `number`th of them, uniform in [0, 1)."""
        return (mix(self.key ^ (number * _GOLDEN & _BITS)) >> 11) * 2.0**-53

    def normal(self, number: int) -> float:
        """Standard normal, from the `number`th and the next one (Box and Muller)."""
        radius = math.sqrt(-2.0 * math.log(1.0 - self.unit(number)))
        return radius * math.cos(math.tau * self.unit(number + 1))
