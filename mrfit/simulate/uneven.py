"""Simulation at uneven times: the same definitions as at equal steps, for steps that each have their own length."""

from collections.abc import Callable
from typing import cast

import numpy as np

from mrfit.core import registry
from mrfit.core.built_in import Kind, own_names
from mrfit.core.protocols import ErrsInRecord, HasLaw, HasStep
from mrfit.core.specs import Array, Steps
from mrfit.errors import DataError
from mrfit.simulate.assembly import Assembly

Stepped = Callable[[Array, Array, Steps], Array]


def simulate_unevenly(assembly: Assembly, drive: Array, theta: Array, steps: Array) -> Array:
    """Return the output (P, N) of samples at uneven times.

    At equal steps it is ``assembly.simulate`` but for rounding. What effects take from the whole record, as a mean
    stroke, is a mean over time.

    Parameters
    ----------
    assembly
        The model; its parts are mrfit's own, or have a ``step`` or a ``law``, and none is an error of the record.
    drive
        Inputs, shape (C, N), N >= 2; a channel of the time has its true values.
    theta
        Parameters, shape (P, K).
    steps
        Time from each sample to that before in s, > 0, shape (N,); the first is not read.

    Raises
    ------
    DataError
        If a step is not positive, or a part of the model is not known at uneven times.
    """
    base, *effects = assembly.name.split("+")
    parts: list[tuple[Kind, str]] = [("model", base), *(("effect", e) for e in effects)]
    for kind, name in parts:
        item = registry.load(kind, name)
        known = name in own_names(kind) or isinstance(item, HasLaw | HasStep)
        if not known or isinstance(item, ErrsInRecord):
            raise DataError(f"the {kind} {name} is not simulated at uneven times: resample the drive to equal steps")
    bad = np.flatnonzero(~(steps[1:] > 0.0))
    if len(bad):
        raise DataError(f"sample {bad[0] + 1} is not later than the one before it: its step is {steps[bad[0] + 1]} s")
    simulate = cast(Stepped, assembly.simulate)
    return simulate(drive, theta, np.ascontiguousarray(steps, dtype=np.float64))
