"""A base model in an examination: terms of its own for the nuisance, and its response."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.channels import CONTROL
from mrfit.core.specs import Array
from mrfit.discover.invariance.records import Record
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.current_dependence import base_name


@dataclass(frozen=True)
class Base:
    """A base at the parameters of its fit, on some records.

    Attributes
    ----------
    terms
        Its linear terms, per record (L + N, K): what the motion makes of the parameters that enter linearly, each
        divided by its parameter, all others as they are at the middle current.
    response
        Its response, per record (N,); empty where it is not known.
    offset
        Whether one of its parameters is a constant force, or makes one.
    """

    terms: tuple[Array, ...]
    response: tuple[Array, ...] = ()
    offset: bool = False


def none(records: Sequence[Record]) -> Base:
    """Return a base that gives nothing."""
    return Base(tuple(np.empty((len(r.speed), 0)) for r in records))


def base_of(assembly: Assembly, theta: Array, records: Sequence[Record]) -> Base:
    """Return terms and response of a base model at the parameters (K,) of its fit.

    A base that takes the current itself, not through its parameters, gives no terms: they could not follow an effect
    that moves the current.
    """
    spec = assembly.spec
    linear: dict[str, list[int]] = {}
    for k, p in enumerate(spec.params):
        if p.name in spec.linear:
            linear.setdefault(base_name(p.name), []).append(k)
    expanded = len(set(map(base_name, spec.names))) < len(spec.names)
    if CONTROL in spec.inputs and not expanded:
        linear = {}
    middle = 0.5 * (min(float(r.control.min()) for r in records) + max(float(r.control.max()) for r in records))
    points, steps = np.repeat(theta[None], 1 + len(linear), axis=0), np.empty(len(linear))
    for row, places in enumerate(linear.values()):
        steps[row] = max(float(np.max(np.abs(theta[places]))), 1.0)
        points[row + 1, places] += steps[row]
    terms, responses = [], []
    for record in records:
        drive = np.ascontiguousarray(np.stack([record.channels[n] for n in spec.inputs]))
        responses.append(record.measured(assembly.simulate(drive, theta[None], record.dt)[0]))
        if CONTROL in spec.inputs:
            drive[spec.inputs.index(CONTROL)] = middle
        found = assembly.simulate(drive, points, record.dt) if linear else np.empty((1, len(record.speed)))
        terms.append(((found[1:] - found[:1]) / steps[:, None]).T)
    return Base(tuple(_scaled(terms)), tuple(responses), any(p.role == "offset" for p in spec.params))


def _scaled(terms: Sequence[Array]) -> list[Array]:
    """Return terms of unit RMS over all records; those that are not finite, zero or constant are left out."""
    whole = np.concatenate(list(terms))
    size = np.sqrt(np.mean(whole**2, axis=0))
    with np.errstate(invalid="ignore"):
        good = np.isfinite(size) & (size > 0.0)
    return [t[:, good] / size[good] for t in terms]
