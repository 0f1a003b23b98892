"""Which causes the tests of a search bear out, by the rule of Sesame's reports, written anew.

A smallest set of operations that was seen to violate a requirement is named if it is a single operation, or if one of
the tests that show it was run again without each of its operations, and no longer violated the requirement. Other sets
may hold passengers, so nobody should believe them.
"""

from collections.abc import Hashable, Iterable

from bugs.case import Cause, cause
from bugs.judge import minimal
from bugs.space import Operation, Space, Test, Use
from bugs.world import Outcome

# Kinds of operations that draw numbers, so that the seed of their use makes a difference.
_DRAWING = {"noise", "random_walk", "random_value", "random_text", "packet_loss", "burst_loss", "reorder"}


class Named:
    """The causes that the tests so far bear out."""

    def __init__(self, space: Space) -> None:
        self.space = space
        self._shown: dict[Cause, list[tuple[Use, ...]]] = {}  # acting uses of the tests that show a set
        self._harmless: dict[str, set[Hashable]] = {name: set() for name in space.requirements}

    def add(self, test: Test, outcome: Outcome) -> None:
        """Takes a test that was run."""
        acting = tuple(use for use, effects in zip(test, outcome.effects, strict=True) if effects)
        for requirement, harmless in self._harmless.items():
            if requirement not in outcome.violated:
                harmless |= {self._key(test), self._key(acting)}
            elif acting:
                self._shown.setdefault(cause(requirement, {use.operation for use in acting}), []).append(acting)

    def causes(self) -> set[Cause]:
        """The causes that are named."""
        return {each for each in minimal(set(self._shown)) if len(each.operations) == 1 or self._is_tried(each)}

    def _is_tried(self, each: Cause) -> bool:
        def without(acting: tuple[Use, ...], operation: str) -> Hashable:
            return self._key(use for use in acting if use.operation != operation)

        harmless = self._harmless[each.requirement]
        return any(
            all(without(acting, operation) in harmless for operation in each.operations)
            for acting in self._shown[each]
        )

    def _key(self, uses: Iterable[Use]) -> Hashable:
        """Equal for tests that disturb the same."""
        return tuple(sorted(repr(self._as_it_disturbs(use)) for use in uses))

    def _as_it_disturbs(self, use: Use) -> tuple:
        seed = use.seed if _draws(self.space.operations[use.operation]) else None
        return use.operation, use.start, use.end, use.choices, seed


def _draws(operation: Operation) -> bool:
    kind = operation.kind
    return kind["kind"] in _DRAWING or (kind["kind"] == "latency" and kind["distribution"] != "fixed")
