"""Work by its size, not by the clock: what a discovery leaves out is the same on every machine."""

from dataclasses import dataclass, field

from mrfit.core import registry
from mrfit.core.protocols import HasStep
from mrfit.discover.policy import STANDARD
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.current_dependence import base_name


@dataclass
class Effort:
    """Work of a discovery so far, and what was left out so as not to take long.

    Attributes
    ----------
    spent
        Samples of all fits that were judged.
    left_out
        In words.
    """

    spent: int = 0
    left_out: list[str] = field(default_factory=list)

    def allows(self, most: float, what: str) -> bool:
        """Return whether no more than so much was spent; otherwise keep in words what is left out."""
        if self.spent <= most:
            return True
        if what not in self.left_out:
            self.left_out.append(what)
        return False


def work_of(assembly: Assembly, samples: int) -> int:
    """Return samples times the numbers of a search, of a law that is stepped from sample to sample; 0 of others.

    Linear parameters are none of these numbers. A loop of which the shape depends on current has no curve along which
    it could be stepped: it is as slow as a law with a rough response.
    """
    spec = assembly.spec
    module = registry.load("model", spec.name.partition("+")[0])
    if not isinstance(module, HasStep):
        return 0
    shape = {p.name for p in module.SPEC.params if p.role == "hysteresis"}
    bent = any("@" in n and base_name(n) in shape for n in spec.names)
    return int(samples * (len(spec.params) - len(spec.linear)) * (STANDARD.rough_weight if bent else 1.0))
