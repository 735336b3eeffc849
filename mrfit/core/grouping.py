"""Values that have something in common, together."""

from collections.abc import Iterable
from typing import TypeVar

Shared = TypeVar("Shared")
Value = TypeVar("Value")


def grouped(pairs: Iterable[tuple[Shared, Value]]) -> dict[Shared, list[Value]]:
    """Return values, each given behind what it has in common with others, as lists by that; both in their order."""
    found: dict[Shared, list[Value]] = {}
    for shared, value in pairs:
        found.setdefault(shared, []).append(value)
    return found
