"""A model that somebody else's code simulates, one parameter vector at a time."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace

from mrfit.core.responses import one_by_one
from mrfit.core.specs import Array, ModelSpec
from mrfit.errors import ConfigError

Simulate = Callable[[Array, Array, float], Array]


@dataclass(frozen=True)
class ForeignModel:
    """A model as the registry takes it, and the text by which its source is known from another."""

    item: SimpleNamespace
    source: str


def foreign_model(spec: ModelSpec, caution: str, simulate: Simulate, source: str) -> ForeignModel:
    """Return the model of a function of one drive (C, N) and one parameter vector (K,) that returns the output (N,)."""
    response = constant_only(spec.name, one_by_one(simulate))
    cautious = replace(spec, caution=caution.format(spec.name))
    item = SimpleNamespace(SPEC=cautious, response=response, CONSTANT_PARAMETERS=True, __doc__=spec.title)
    return ForeignModel(item, source)


def constant_only(name: str, response: Simulate) -> Simulate:
    """Return a response that says in one line that it takes no parameters that vary along the samples."""

    def checked(drive: Array, theta: Array, dt: float) -> Array:
        if theta.ndim > 2:
            raise ConfigError(
                f"the parameters of {name} cannot vary within a test, as under a current that moves: give it the "
                "current as an input, or --current-order 0"
            )
        return response(drive, theta, dt)

    return checked
