"""Work of a fit by its size, not by the clock: what a discovery leaves out is the same on every machine."""

from mrfit.core import registry
from mrfit.core.protocols import HasStep
from mrfit.simulate.assembly import Assembly


def work_of(assembly: Assembly, samples: int) -> int:
    """Return samples times the numbers of a search, of a law that is stepped from sample to sample; 0 of others.

    Linear parameters are none of these numbers.
    """
    spec = assembly.spec
    stepped = isinstance(registry.load("model", spec.name.partition("+")[0]), HasStep)
    return samples * (len(spec.params) - len(spec.linear)) if stepped else 0
