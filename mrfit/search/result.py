"""Where a search ended: the point, its cost, and what was done on the way there."""

from dataclasses import dataclass
from typing import Literal

from mrfit.core.specs import Array
from mrfit.io.schemas.fit import SearchStage
from mrfit.optimizers.cost.objective import DescentEnd

Ending = Literal["finished", "budget", "time", "stalled"]


@dataclass(frozen=True, slots=True)
class ChainLink:
    """What one optimizer of a chain did.

    Attributes
    ----------
    name
        As written in the chain.
    kind
        ``global``, ``local`` or ``start``.
    allowed, evaluations
        Evaluations it might use, and used.
    cost
        Best cost when it ended.
    ending
        ``finished`` by its own rule; ``budget``, ``time`` or ``stalled`` if it was stopped.
    reason
        The same in words.
    history
        (evaluations of the whole search, best cost) after every batch, from the link's first to its last.
    ends
        Whether it has a rule of its own that should have ended it before its evaluations were used up.
    preliminary
        Whether these costs are another problem's: that of thinned data, or of bounds wider than the model's.
    """

    name: str
    kind: Literal["global", "local", "start"]
    allowed: int
    evaluations: int
    cost: float
    ending: Ending
    reason: str
    history: tuple[tuple[int, float], ...]
    ends: bool = True
    preliminary: bool = False


@dataclass(frozen=True)
class SearchResult:
    """Where a search ended.

    Attributes
    ----------
    point, cost
        Best point (F,) of the cube and its RMS cost; infinite if nothing could be simulated.
    nfev, nonfinite
        Points simulated, and how many of them gave non-finite values.
    first_nonfinite
        The first of these, shape (F,), or None.
    links
        What each optimizer did.
    descents
        Where each of several starts ended, best first; empty for optimizers without starts.
    agreeing
        How many of these settled at the best cost.
    stages
        What each stage before the joint search did; none but for a staged search.
    """

    point: Array
    cost: float
    nfev: int
    nonfinite: int
    first_nonfinite: Array | None
    links: tuple[ChainLink, ...]
    descents: tuple[DescentEnd, ...] = ()
    agreeing: int = 0
    stages: tuple[SearchStage, ...] = ()

    @property
    def success(self) -> bool:
        """Whether the last optimizer ended by its own rule, not for lack of budget, time or progress."""
        return bool(self.links) and self.links[-1].ending == "finished"

    @property
    def message(self) -> str:
        """Why every optimizer stopped."""
        return "; ".join(f"{link.name}: {link.reason}" for link in self.links)

    @property
    def allowed(self) -> int:
        """Evaluations that all optimizers together might use."""
        return sum(link.allowed for link in self.links)

    @property
    def cut_short(self) -> bool:
        """Whether budget or time ended an optimizer that should have stopped before, as no population search does."""
        return self.links[-1].ends and self.links[-1].ending in ("budget", "time")

    @property
    def out_of_time(self) -> bool:
        """Whether the clock ended the search."""
        return self.links[-1].ending == "time"

    @property
    def history(self) -> tuple[tuple[int, float], ...]:
        """(evaluations, best cost) after every batch of all optimizers."""
        return tuple(step for link in self.links for step in link.history)

    @property
    def preliminary(self) -> int:
        """How many steps at the beginning of the history are costs of another problem, see ``ChainLink``."""
        return sum(len(link.history) for link in self.links if link.preliminary)

    @property
    def starts(self) -> tuple[float, ...]:
        """Costs at which several starts ended, the least first."""
        return tuple(d.cost for d in self.descents)
