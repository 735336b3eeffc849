"""What every strategy of a search says of itself."""

from typing import Protocol

from mrfit.core.specs import Array
from mrfit.search.limits import SearchContext
from mrfit.search.problem import Problem
from mrfit.search.result import SearchResult


class Strategy(Protocol):
    """A way of looking for the least cost of a problem over the unit cube."""

    @property
    def many_starts(self) -> bool:
        """Whether it makes more of several starts than to begin at the best of them."""

    @property
    def from_points(self) -> bool:
        """Whether it begins where the characteristic points of the data are, and nowhere else."""

    @property
    def from_means(self) -> bool:
        """Whether it begins at the means over conditions of each current, and nowhere else."""
        return False

    @property
    def begins_with(self) -> str:
        """What it begins with instead of the start that it is given, in words; empty where it begins there."""
        return ""

    @property
    def searches(self) -> bool:
        """Whether it looks for a lower cost than that of its starts."""
        return True

    def check(self, model: str, per: str) -> None:
        """Refuse a written model, or sets of parameters ``per`` condition or for all, that it cannot be used for.

        Raises
        ------
        ConfigError
            If it cannot; here it can.
        """
        return

    def budget(self, dimension: int) -> int:
        """Return the evaluations that it asks for where nobody limits them."""

    def search(self, problem: Problem, starts: Array, how: SearchContext) -> SearchResult:
        """Return where it ends from start points (S, F)."""
