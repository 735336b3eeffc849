"""Dependence of a base's parameters on current in a discovery: as asked for, as chosen, by their roles, plainly."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from mrfit.discover.evidence.work import shape_of_loop
from mrfit.discover.policy import STANDARD, Policy
from mrfit.fit import stage as fit_stage
from mrfit.fit.laws.choice import LawChoice
from mrfit.fit.laws.laws_of_current import dependence_of
from mrfit.fit.select import usable
from mrfit.io.dataset import Dataset
from mrfit.settings.discover import Settings
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import HIGHEST_ORDER, CurrentDependence, base_name, orders_of
from mrfit.simulate.current_levels import (
    OUTPUTS,
    base_of,
    default_orders,
    dependence_on_current,
    recorded_range,
    takes_current,
    tested_currents,
    to_choose,
)


@dataclass(frozen=True)
class Currents:
    """Dependence of the base's parameters on current, and its choice, None where no levels were held."""

    dependence: CurrentDependence | None
    choice: LawChoice | None = None


def by_law_of_current(model: str) -> bool:
    """Return whether parameters of a written model reach a current that no test was trained at by a law alone."""
    spec = base_of(model).spec
    return spec.output in OUTPUTS and not takes_current(spec)


def current_dependence(
    settings: Settings, data: Dataset, effects: tuple[str, ...] = (), held: Mapping[str, float] | None = None
) -> Currents:
    """Return the dependence of the base's parameters on current, and its choice, beside effects with held parameters.

    It is the choice that a joint fit makes, but see ``LawChoice.as_base``. A current that changes during tests counts
    as two levels. The shape of a loop, as kappa, beta, gamma and n of Bouc-Wen, then does not depend on it unless the
    user says so: it doubles the search, and Spencer and others (1997) keep it too.
    """
    name = settings.model.partition("+")[0]
    spec = base_of(name).spec
    if to_choose(name, settings.current_order, tested_currents(data.segments, data.recordings)):
        start = tuple((n, v) for n, v in settings.start if base_name(n) in spec.names)
        alike = fit_stage.Settings("+".join((name, *effects)), per="all", start=start, seed=settings.seed)
        able = usable(data.segments, data.recordings, assemble(alike.model))[0]
        found, choice = dependence_of(alike, able, dict(data.recordings), held, shape_of_loop(name))
        return Currents(choice.as_base() if choice and not held else found, choice)
    return Currents(usual_dependence(settings, data))


def bent_more(laws: CurrentDependence, model: str, data: Dataset) -> CurrentDependence:
    """Return laws of current with that of the yield force of one order more, where the tests determine it."""
    yields = {p.name for p in base_of(model).spec.params if p.role == "yield"}
    currents = tested_currents(data.segments, data.recordings)
    most = HIGHEST_ORDER if currents.varying else len(currents.levels) - 1
    orders = tuple((n, o + 1 if n in yields and isinstance(o, int) and o < most else o) for n, o in laws.orders)
    return replace(laws, orders=orders)


def plain_laws(settings: Settings, data: Dataset) -> CurrentDependence | None:
    """Return laws of current with bent forces and constant shapes of the curve, or None if nothing depends on it."""
    laws = usual_dependence(settings, data)
    if laws is None:
        return None
    roles = {p.name: p.role for p in base_of(settings.model).spec.params}
    forces = replace(laws, orders=tuple((n, o) for n, o in laws.orders if roles[n] in ("yield", "viscous")))
    return bent_more(forces, settings.model, data)


def usual_dependence(settings: Settings, data: Dataset, policy: Policy = STANDARD) -> CurrentDependence | None:
    """Return the dependence of the base's parameters on current as asked for, or by their roles; None for none."""
    name = settings.model.partition("+")[0]
    spec = base_of(name).spec
    shape = [p.name for p in spec.params if p.role == "hysteresis"]
    found = dependence_on_current(name, settings.current_order, data.segments, data.recordings, shape)
    if found or settings.current_order != "auto" or takes_current(spec):
        return found
    low, high = recorded_range(data.recordings)
    if not high - low >= policy.least_current_range:
        return None
    orders = default_orders(spec, STANDARD.most_control_order, shape) or orders_of(spec, "2")
    return CurrentDependence(orders, low, high)
