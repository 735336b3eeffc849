"""The damper that is applied: a model, its parameters, how they depend on current, and the range it was tested in."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mrfit.core import registry
from mrfit.core.arguments import check_arguments
from mrfit.core.channels import MOTION
from mrfit.errors import ConfigError, DataError
from mrfit.settings.forms import of_python
from mrfit.simulate.assembly import Assembly, assemble
from mrfit.simulate.current_dependence import CurrentDependence, Order, node_of

if TYPE_CHECKING:
    from mrfit.api.fitting import FitResult
    from mrfit.io.schemas.fit import Fit


@dataclass(frozen=True)
class Damper:
    """A damper that can be controlled.

    Attributes
    ----------
    name
        What it is called in tables: the fit's name.
    model
        Model as written, effects included.
    parameters
        (name, value) of all its parameters, in the order of the SPEC, SI.
    orders
        (parameter, order) of those that depend on current.
    low, high
        Least and greatest current in A at which it was tested.
    tested
        (channel, least, greatest) of the tests that its parameters come from, SI; empty where they are not known.
    """

    name: str
    model: str
    parameters: tuple[tuple[str, float], ...]
    orders: tuple[tuple[str, Order], ...]
    low: float
    high: float
    tested: tuple[tuple[str, float, float], ...] = ()

    @cached_property
    def dependence(self) -> CurrentDependence | None:
        """Dependence of its parameters on current."""
        return CurrentDependence(self.orders, self.low, self.high) if self.orders else None

    @cached_property
    def assembly(self) -> Assembly:
        """The model to simulate as a whole."""
        return assemble(self.model, self.dependence)

    @property
    def theta(self) -> "np.ndarray[Any, np.dtype[np.float64]]":
        """Parameters, shape (1, K)."""
        return np.array([[value for _, value in self.parameters]])

    @property
    def output(self) -> str:
        """Channel it gives: force or torque."""
        return self.assembly.spec.output

    @property
    def motion(self) -> tuple[str, str, str]:
        """Names of its displacement, velocity and acceleration."""
        return MOTION[self.output]

    def without(self, *effects: str) -> "Damper":
        """Return it without some of its effects."""
        base, *written = self.model.split("+")
        kept = [e for e in written if e not in effects]
        parameters = tuple((n, v) for n, v in self.parameters if n.partition(".")[0] not in effects)
        return replace(self, model="+".join([base, *kept]), parameters=parameters)

    def lagless(self) -> "Damper":
        """Return it without lags of its field."""
        return self.without("current-lag", "current-filter", "residual-magnetism", "slow-release")


@check_arguments
def damper(
    model: str,
    parameters: Mapping[str, float],
    orders: Mapping[str, Order] | None = None,
    current: tuple[float, float] | None = None,
    name: str = "",
) -> Damper:
    """Return a damper of parameters that are known, as those of a paper.

    Parameters
    ----------
    model
        Model as written.
    parameters
        Values by name; those that depend on current at their nodes, as ``fy@0A``, in short or as parameters.csv has
        them. Effects' that are not named are neutral, any other is an error.
    orders
        Order in current of parameters that depend on it, as ``--current-order`` has them.
    current
        Least and greatest current in A; default: those of the nodes, 0 and 1 A where there are none.
    name
        What it is called; default: the model.

    Raises
    ------
    ConfigError
        If a parameter is unknown, missing or not finite.
    """
    pairs = tuple((orders or {}).items())
    nodes = [node.current for node in map(node_of, parameters) if node]
    low, high = current or ((min(nodes), max(nodes)) if nodes else (0.0, 1.0))
    dependence = CurrentDependence(pairs, low, high) if pairs else None
    spec = assemble(model, dependence).spec
    short = {exact: name for name, exact in dependence.exact_names.items()} if dependence else {}
    parameters = {short.get(name, name): value for name, value in parameters.items()}
    if unknown := sorted(set(parameters) - set(spec.names)):
        raise ConfigError(f"'{model}' has no parameter '{unknown[0]}'; it has {', '.join(spec.names)}")
    neutral = {
        f"{e}.{p.name}": value
        for e in registry.elements(model)[1]
        for effect in [registry.load("effect", e).SPEC]
        for p, value in zip(effect.params, effect.neutral, strict=True)
    }
    given = {**neutral, **{name: of_python(name, value) for name, value in parameters.items()}}
    if missing := [n for n in spec.names if n not in given]:
        raise ConfigError(f"'{model}' needs a value of {', '.join(missing)}")
    return controllable(Damper(name or model, model, tuple((n, float(given[n])) for n in spec.names), pairs, low, high))


def damper_of(
    fit: "FitResult",
    current: tuple[float, float] | None = None,
    tested: Mapping[str, tuple[float, float]] | None = None,
) -> Damper:
    """Return the damper that a fit describes.

    Parameters
    ----------
    fit
        One set of parameters for all conditions.
    current
        Least and greatest current in A, where the model has the current as an input of its own and the fit says of no
        range; default: 0 A to the greatest current of its conditions.
    tested
        Least and greatest value of every channel in the fit's tests; default: those of a fit in memory.

    Raises
    ------
    DataError
        If the fit has several sets of parameters, or its force does not depend on a current.
    """
    content, parameters = fit.content, parameters_for_all(fit)
    stored = content.current_dependence
    orders: tuple[tuple[str, Order], ...] = ()
    if stored:
        orders, (low, high) = tuple(stored.orders.items()), (stored.low, stored.high)
    else:
        low, high = current or (0.0, _greatest(content))
    ranges = tuple((n, *ends) for n, ends in (fit.extents if tested is None else tested).items())
    return controllable(Damper(fit.name, fit.model, parameters, orders, low, high, ranges))


def parameters_for_all(fit: "FitResult") -> tuple[tuple[str, float], ...]:
    """Return (name, value) of a fit's parameters in the order of the SPEC, SI.

    Raises
    ------
    DataError
        If the fit has several sets of parameters.
    """
    results = fit.content.results
    if len(results) != 1:
        raise DataError(
            f"fit '{fit.name}' has {len(results)} sets of parameters, one for each condition: apply needs one for all; "
            f"run `mrfit fit --model {fit.model} --per all`"
        )
    values, spec = {p.name: p.value for p in results[0].parameters}, fit.assembly.spec
    return tuple(zip(spec.names, spec.theta(values).tolist(), strict=True))


def _greatest(content: "Fit") -> float:
    """Return the greatest current of a fit's conditions as their names have it, 1 A where they have none."""
    import re

    found = [float(a) for m in content.metrics for a in re.findall(r"(\d+(?:\.\d+)?)\s*A\b", m.condition)]
    return max(found, default=1.0) or 1.0


def controllable(damper: Damper) -> Damper:
    """Return a damper if a current changes what it does.

    Raises
    ------
    DataError
        If none does, or it is a coil.
    """
    spec = damper.assembly.spec
    if spec.output not in MOTION:
        raise DataError(f"'{damper.name}' predicts {spec.output}: apply takes models of force or torque")
    if "current" not in registry.load("model", damper.model.partition("+")[0]).SPEC.inputs and not damper.orders:
        raise DataError(
            f"'{damper.name}' does not depend on current: fit tests at several currents together, "
            f"`mrfit fit --model {damper.model} --per all`"
        )
    if not damper.low < damper.high:
        raise DataError(f"'{damper.name}' was tested at one current, {damper.low:g} A: there is none to choose")
    return damper
