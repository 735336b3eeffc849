"""Costs of causality: a fit is driven by smoothed inputs, a controller by those it measures or derives late."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from mrfit.core.channels import unit_of
from mrfit.core.specs import Array
from mrfit.export.motion import derived_of
from mrfit.export.source import ExportSource, LogStretch
from mrfit.kernels.filters import lag

# Time constants in s of the differentiator that are tried
_TRIED = (0.0005, 0.001, 0.002, 0.005, 0.01)
DEFAULT = 0.002
# Most samples of a segment, and most segments, that are simulated for it
_SAMPLES, _SEGMENTS = 20_000, 20

Changed = Callable[[LogStretch], Mapping[str, Array]]


@dataclass(frozen=True)
class Cost:
    """Costs of the drive in the output, and the time constant in s of the differentiator that costs least."""

    lines: tuple[str, ...]
    tau: float
    raw: float | None = None
    derived: Mapping[float, float] | None = None


def differentiated(x: Array, dt: float, tau: float) -> tuple[Array, Array]:
    """Return rate and second derivative (N,) of a signal as the exported differentiator gives them, 2*tau late."""
    ratio = np.array([tau / dt])
    one = lag(np.ascontiguousarray(x)[None], ratio)[0]
    two = lag(one[None], ratio)[0]
    return (one - two) / tau, ((x - one) - (one - two)) / tau**2


def costs(source: ExportSource) -> Cost:
    """Return the costs of raw inputs and of derived ones, RMS over the fit's logs as a share of the output's range."""
    if source.is_driven:
        # its excitation is not smoothed
        return Cost((), DEFAULT)
    channel, orders = derived_of(source)
    chosen = [s for s in source.stretches if s.raw][:_SEGMENTS] or list(source.stretches)[:_SEGMENTS]
    if not chosen:
        return Cost(("What that costs is not known: the fit's logs are not at hand.",), DEFAULT)
    lines = list[str]()
    raw = _mean(source, chosen, lambda s: dict(s.raw)) if any(s.raw for s in chosen) else None
    unit, extent = unit_of(source.spec.output), source.output_range
    if raw is not None:
        lines.append(
            f"On {len(chosen)} segments of the fit's logs, inputs as recorded instead of smoothed change the output by "
            f"{raw * extent:.3g} {unit} RMS, {100.0 * raw:.2g} % of its range."
        )
    own = [s for s in chosen if _stroke(s, channel) is not None]
    wanted = " and ".join(orders.values())
    if orders and not own:
        lines.append(f"What a derived {wanted} costs is not known: no {channel} in the logs.")
    if not orders or not own:
        return Cost(tuple(lines), DEFAULT, raw)
    found = {tau: _mean(source, own, _differentiator(channel, orders, tau)) for tau in _TRIED}
    best = min(found, key=lambda tau: found[tau])
    each = [
        f"tau {1e3 * t:g} ms, {2e3 * t:g} ms late: {c * extent:.3g} {unit} ({100.0 * c:.2g} %)"
        for t, c in found.items()
    ]
    lines.append(
        f"{wanted} by the differentiator below from the {channel}{'' if raw is not None else ' (smoothed)'} instead: "
        f"{'; '.join(each)}. tau is {1e3 * best:g} ms."
    )
    return Cost(tuple(lines), best, raw, found)


def _stroke(stretch: LogStretch, channel: str) -> Array | None:
    return stretch.raw.get(channel, stretch.inputs.get(channel))


def _differentiator(channel: str, orders: Mapping[int, str], tau: float) -> Changed:
    def changed(stretch: LogStretch) -> dict[str, Array]:
        stroke = _stroke(stretch, channel)
        assert stroke is not None
        rate, second = differentiated(stroke[:_SAMPLES], stretch.dt, tau)
        given = {orders[k]: values for k, values in ((1, rate), (2, second)) if k in orders}
        return {**stretch.raw, **given}

    return changed


def _mean(source: ExportSource, chosen: list[LogStretch], inputs_of: Changed) -> float:
    """Return the RMS change of the output as a share of its range."""
    squares, samples = 0.0, 0
    for s in chosen:
        drive = source.drive(s)[:, :_SAMPLES]
        changed = drive.copy()
        for name, values in inputs_of(s).items():
            if name in source.channels:
                changed[source.spec.inputs.index(name)] = values[:_SAMPLES]
        off = source.simulate(changed, s.dt) - source.simulate(drive, s.dt)
        squares, samples = squares + float(np.sum(off**2)), samples + len(off)
    return float(np.sqrt(squares / samples)) / source.output_range
