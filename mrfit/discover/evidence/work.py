"""Work by its size, not by the clock: what a discovery leaves out is the same on every machine."""

from dataclasses import dataclass, field
from typing import Any

from mrfit.core import registry
from mrfit.core.protocols import HasCurve, HasStep
from mrfit.core.specs import ModelSpec
from mrfit.discover.policy import STANDARD, Policy
from mrfit.search.auto import Auto
from mrfit.search.limits import Limits
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.current_dependence import base_name


@dataclass
class Effort:
    """Work of a discovery so far, and what was left out so as not to take long.

    Attributes
    ----------
    spent
        Training samples, counted once for each set of effects that a fitter judged.
    left_out
        In words.
    """

    spent: int = 0
    left_out: list[str] = field(default_factory=list)

    def allows(self, most: float, what: str) -> bool:
        """Return whether no more than so much was spent; otherwise keep in words what is left out."""
        if self.spent <= most:
            return True
        self.leave_out(what)
        return False

    def leave_out(self, what: str) -> None:
        """Keep in words what is left out, once."""
        if what not in self.left_out:
            self.left_out.append(what)


def is_stepped(model: str) -> bool:
    """Return whether the law of a written model is stepped from sample to sample."""
    return isinstance(_law(model), HasStep)


def shape_of_loop(model: str) -> tuple[str, ...]:
    """Return the parameters of a loop that remembers, which would be stepped with the current.

    A discovery then takes 50 times as long, and what bends a loop with the current may be what is missing.
    """
    spec: ModelSpec = _law(model).SPEC
    return tuple(p.name for p in spec.params if p.role == "hysteresis") if is_stepped(model) else ()


def _law(model: str) -> Any:
    return registry.load("model", model.partition("+")[0])


def work_of(assembly: Assembly, samples: int) -> int:
    """Return samples times the numbers of a search, of a law that is stepped from sample to sample; 0 of others.

    Linear parameters are none of these numbers. A loop that is stepped along its curve is not where its shape depends
    on current: then it is as slow as a law with a rough response.
    """
    spec = assembly.spec
    if not is_stepped(spec.name):
        return 0
    numbers = len(spec.params) - len(spec.linear)
    return int(samples * numbers * (STANDARD.rough_weight if _is_bent(assembly) else 1.0))


def limits_of_base(assembly: Assembly, samples: int, dimension: int, policy: Policy) -> Limits:
    """Return the limits of a base's first fit to training samples, over so many free parameters.

    They are its own but where a law is stepped along no curve: then its evaluations are counted by the samples. How
    long it goes on without progress stays the same.
    """
    limits = Limits()
    slow = is_stepped(assembly.spec.name) and (_is_bent(assembly) or not isinstance(_law(assembly.spec.name), HasCurve))
    usual, most = Auto().budget(dimension), int(policy.most_base_work / samples)
    return Limits(most, stall=min(limits.stall * usual / most, 1.0)) if slow and most < usual else limits


def _is_bent(assembly: Assembly) -> bool:
    """Return whether the shape of a loop along a curve depends on current, so that there is no such curve."""
    law = _law(assembly.spec.name)
    curve = law.SHAPE if isinstance(law, HasCurve) else ()
    return any("@" in n and base_name(n) in curve for n in assembly.spec.names)
