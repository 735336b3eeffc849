"""Which parameters of a fit depend on coil current: as asked for, or by default as many as the tested levels carry."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from mrfit.assembly import Assembly, assemble
from mrfit.dependence import CurrentDependence, orders_of
from mrfit.errors import ConfigError, DataError
from mrfit.recording import Recording, Segment
from mrfit.specs import ModelSpec, Param

# Current levels closer than this, in A and as a share, are one
SAME_LEVEL, SAME_SHARE = 0.02, 0.03
# Highest order of each role where the user names none: what predicted held-out conditions of a real damper at five
# currents best. Parameters that may be negative stay constant: they couple to stroke or offset, and extrapolate badly.
DEFAULT_ORDERS = {"yield": 2, "viscous": 1, "stiffness": 1, "hysteresis": 1}
# Coefficients without a role, as those of a polynomial in velocity, are forces
COEFFICIENT_ORDER = 2
OUTPUTS = ("force", "torque")


def base_of(model: str) -> Assembly:
    """Return the base model of a written name, without effects and without dependence on current."""
    return assemble(model.partition("+")[0])


def checked_order(model: str, text: str, per: str) -> None:
    """Refuse an order of dependence on current that no data could make right.

    Raises
    ------
    ConfigError
        If it is malformed, names no parameter, the model is of a coil, or parameters are fitted per condition.
    """
    if text in ("auto", "0"):
        return
    spec = base_of(model).spec
    orders = orders_of(spec, text)
    if orders and spec.output not in OUTPUTS:
        raise ConfigError(f"--current-order is for models of force or torque; '{spec.name}' predicts {spec.output}")
    if orders and per != "all":
        raise ConfigError("--current-order needs one set of parameters for all currents: add --per all")


def level_of(segment: Segment, levels: Sequence[float]) -> float:
    """Return the level, of those given, at which a segment was tested; nan if its current is not held or unknown."""
    if not np.isfinite(segment.current) or not levels:
        return float("nan")
    return min(levels, key=lambda level: abs(level - segment.current))


def levels_of(segments: Iterable[Segment]) -> list[float]:
    """Return the distinct current levels in A of training segments that hold one, rising."""
    held = sorted(s.current for s in segments if s.role == "train" and np.isfinite(s.current))
    levels: list[list[float]] = []
    for current in held:
        if levels and current - levels[-1][0] <= max(SAME_LEVEL, SAME_SHARE * abs(current)):
            levels[-1].append(current)
        else:
            levels.append([current])
    return [float(np.mean(level)) for level in levels]


def default_orders(spec: ModelSpec, levels: int, fixed: Iterable[str] = ()) -> tuple[tuple[str, int], ...]:
    """Return the order of every parameter that varies with current by default, lower where levels are few.

    Parameters
    ----------
    spec
        The base model's SPEC.
    levels
        Number of current levels tested.
    fixed
        Parameters the user holds, which stay constant.
    """
    held = {name.partition("@")[0] for name in fixed}
    wanted = {p.name: _most(spec, p) for p in spec.params if p.name not in held}
    return tuple((name, order) for name, most in wanted.items() if (order := min(most, levels - 1)) > 0)


def _most(spec: ModelSpec, param: Param) -> int:
    if not param.role:
        return COEFFICIENT_ORDER if param.name in spec.linear else 0
    return DEFAULT_ORDERS.get(param.role, 0) if param.low >= 0 else 0


def dependence_on_current(
    model: str, text: str, segments: Sequence[Segment], recordings: Mapping[str, Recording], fixed: Iterable[str]
) -> CurrentDependence | None:
    """Return how a joint fit's parameters depend on current, None if they do not.

    Parameters
    ----------
    model
        Model as written.
    text
        ``auto``, an order, or ``NAME=ORDER,…``. ``auto`` applies to models of force or torque without a current of
        their own, where training conditions were held at two levels of current or more.
    segments, recordings
        What is fitted; training segments give the range of current.
    fixed
        Parameters the user holds.

    Raises
    ------
    DataError
        If an order asked for needs more levels of current than were tested.
    """
    spec, levels = base_of(model).spec, levels_of(segments)
    varying = [
        recordings[s.recording].channels["current"][s.start : s.stop]
        for s in segments
        if s.role == "train" and "current" in recordings[s.recording].channels and not np.isfinite(s.current)
    ]
    if text == "auto":
        if spec.output not in OUTPUTS or "current" in spec.inputs or len(levels) < 2:
            return None
        orders = default_orders(spec, len(levels), fixed)
    else:
        orders = () if text == "0" else orders_of(spec, text)
        most = max((order for _, order in orders), default=0)
        if most and not varying and most >= len(levels):
            raise DataError(
                f"--current-order {text}: order {most} needs training tests at {most + 1} currents, there are "
                f"{len(levels)} ({', '.join(f'{i:.4g} A' for i in levels) or 'none stated'}); lower the order, or name "
                "each log's current in the channel map ([condition] current, or a pattern on file names)"
            )
    ends = [*levels, *(float(end) for values in varying for end in (values.min(), values.max()))]
    return CurrentDependence(orders, min(ends), max(ends)) if orders else None


def as_json(dependence: CurrentDependence | None) -> dict[str, Any] | None:
    """Return a dependence as fit.json keeps it."""
    return None if dependence is None else {**asdict(dependence), "orders": dict(dependence.orders)}


def assembly_of(fit: Mapping[str, Any]) -> Assembly:
    """Return the assembly a fit.json was made with, its dependence on current included."""
    stored = fit.get("current_dependence")
    if not stored:
        return assemble(str(fit["model"]))
    orders = tuple((str(name), int(order)) for name, order in stored["orders"].items())
    return assemble(str(fit["model"]), CurrentDependence(orders, float(stored["low"]), float(stored["high"])))
