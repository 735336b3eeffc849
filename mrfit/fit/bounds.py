"""Bounds that follow the size of the data: a damper of a bridge, or a force in another unit, is fitted all the same."""

import math
from collections.abc import Sequence

from mrfit.core.channels import unit_of
from mrfit.core.recording import Recording
from mrfit.core.specs import ModelSpec, Param
from mrfit.io.columns import span
from mrfit.settings.forms import Limits

BOUND_SPAN_FACTOR = 4.0
"""Half the span of the output, times this, that the bounds of a model must reach: a yield force is less than the force,
and the damping of a slow test more of it than its usual share."""


def bounds_of_size(spec: ModelSpec, recordings: Sequence[Recording]) -> Limits:
    """Return wider bounds of parameters that grow with the output, by powers of ten; none where it is of usual size.

    Parameters
    ----------
    spec
        The model. Parameters in the unit of its output say which sizes its bounds are meant for.
    recordings
        Those that it is fitted to.
    """
    unit = unit_of(spec.output)
    scaled = [p for p in spec.params if _grows(p, unit)]
    usual = [p for p in scaled if p.unit == unit]
    size = max((span(r.channels[spec.output]) / 2.0 for r in recordings if spec.output in r.channels), default=0.0)
    if not usual or not 0.0 < size < math.inf:
        return ()
    most = max(p.high for p in usual)
    least = min((p.low for p in usual if p.scale == "log"), default=0.0)
    up = 10.0 ** max(math.ceil(math.log10(BOUND_SPAN_FACTOR * size / most)), 0)
    down = 10.0 ** min(math.floor(math.log10(size / (10.0 * least))), 0) if least else 1.0
    if up == down == 1.0:
        return ()
    return tuple((p.name, _low(p, up, down), p.high * up) for p in scaled)


def _grows(param: Param, unit: str) -> bool:
    """Return whether a parameter's unit has that of the output above the line: it grows with the output."""
    return bool(unit) and param.unit.startswith(unit) and param.unit[len(unit) : len(unit) + 1] in ("", "*", "/")


def _low(param: Param, up: float, down: float) -> float:
    return param.low * (down if param.scale == "log" else up)
