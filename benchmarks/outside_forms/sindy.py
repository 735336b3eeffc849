"""The baseline: sequentially thresholded least squares of pysindy on columns of the same grammar."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.signal import savgol_filter

from .forms import Array, Factor, Term
from .lawful import lawful_columns, outside, plain_columns
from .score import Proposal
from .specimen import Specimen

THRESHOLDS = (0.002, 0.004, 0.008, 0.016, 0.03)  # root mean square of a term over the range of the force
NEARLY = 1.1  # of the least squared error
EVERY = 4  # samples


def available() -> bool:
    """Return whether pysindy is installed: ``pip install mrfit[sindy]``."""
    return importlib.util.find_spec("pysindy") is not None


def measured(specimen: Specimen) -> list[dict[str, Array]]:
    """Return the variables of each log as its sensors have them; speeds and accelerations are derived."""
    runs = []
    for frame in specimen.frames:
        x, dt = frame["displacement"].to_numpy(), 1 / specimen.sensors.rate
        v, a = (savgol_filter(x, 15, 3, deriv=k, delta=dt) for k in (1, 2))
        heat = frame["temperature"].to_numpy() if "temperature" in frame else np.full(x.size, 25.0)
        values = {"x": x, "v": v, "a": a, "i": frame["current"].to_numpy(), "T": heat, "t": frame["time"].to_numpy()}
        runs.append({**values, "F": frame["force"].to_numpy()})
    plain = plain_columns(runs, specimen.damper)
    law = plain @ (plain.T @ np.concatenate([r["F"] for r in runs]))
    ends = np.cumsum([r["t"].size for r in runs])[:-1]
    return [{**run, "L": part} for run, part in zip(runs, np.split(law, ends), strict=True)]


def candidates(top: dict[str, float]) -> list[Term]:
    """Return the terms that may be proposed: a factor of place, time or temperature times one of the motion."""
    x, v, t = top["x"], top["v"], top["t"]
    power = [Factor(k, "even" if n % 2 == 0 else "odd", {"n": n}) for k, n in (("x", 1.0), ("x", 2.0), ("x", 3.0))]
    hinges = [Factor("x", "side", {"side": s, "n": 1.0, "place": p * x}) for s in (1.0, -1.0) for p in (0.0, 0.3)]
    bumps = [Factor("x", "bump", {"place": p * x, "width": 0.3 * x}) for p in (-0.4, -0.2, 0.0, 0.2, 0.4)]
    columns = [Factor("x", "column", {"length": p * x, "n": 1.3}) for p in (1.6, 2.2)]
    decays = [Factor("t", "decay", {"tau": p * t}) for p in (0.2, 0.5)]
    arrhenius = Factor("T", "arrhenius", {"heat": 3000.0})
    places = [
        *power,
        Factor("x", "even", {"n": 1.0}),
        *hinges,
        *bumps,
        *columns,
        Factor("x", "dead-zone", {"place": x / 2}),
    ]
    slow = [
        *decays,
        Factor("t", "odd", {"n": 1.0}),
        arrhenius,
        Factor("i", "odd", {"n": 1.0}),
        Factor("i", "even", {"n": 2.0}),
    ]
    sides = [Factor("v", "side", {"side": s, "n": n, "place": 0.0}) for s in (1.0, -1.0) for n in (0.5, 2.0)]
    sides += [Factor("v", "side", {"side": s, "n": 1.0, "place": p * v}) for s in (1.0, -1.0) for p in (0.0, 0.35)]
    masses = [Factor("a", "odd", {"n": 1.0}), Factor("a", "side", {"side": 1.0, "n": 1.0, "place": 0.0})]
    motions = [Factor("v", "odd", {"n": 1.0}), Factor("v", "sign", {"width": 0.03 * v}), Factor("L", "odd", {"n": 1.0})]
    linear = Factor("x", "odd", {"n": 1.0})
    alone = [(f,) for f in (*places, *sides, *masses, *slow)]
    pairs = [*product((*places, *slow), motions), *product(slow, (linear,)), (motions[2], motions[1])]
    return [Term(factors) for factors in (*alone, *pairs)]


def propose(specimen: Specimen, beside_any_law: bool) -> list[Proposal]:
    """Return the terms that pysindy keeps of the force beside the plain base, or beside any law.

    Every fourth test is predicted from the others; the largest threshold that does so nearly best is taken.
    """
    from pysindy.optimizers import STLSQ

    runs = measured(specimen)
    damper = specimen.damper
    nuisance = lawful_columns(runs, damper) if beside_any_law else plain_columns(runs, damper)
    top = {k: max(float(np.max(np.abs(r[k]))) for r in runs) for k in ("x", "v", "t")}
    terms = candidates(top)
    columns = np.stack([np.concatenate([t.at(r) for r in runs]) for t in terms], axis=1)
    force = np.concatenate([r["F"] for r in runs])
    test = np.concatenate([np.full(r["t"].size, k) for k, r in enumerate(runs)])[::EVERY]
    size = np.sqrt(np.mean(columns**2, axis=0))
    known = size > 0
    terms, size = [t for t, k in zip(terms, known, strict=True) if k], size[known]
    own = outside(nuisance, columns[:, known] / size)
    seen = np.sqrt(np.mean(own**2, axis=0)) > 0.05  # the law may have the others
    rows, left = own[::EVERY, seen], outside(nuisance, force)[::EVERY] / np.ptp(force)
    train = test % 4 != 3

    def fitted(threshold: float, chosen: Array) -> Array:
        optimizer = STLSQ(threshold=threshold, alpha=1e-4 * chosen.sum(), max_iter=30)
        return optimizer.fit(rows[chosen], left[chosen, None]).coef_.ravel()

    errors = [float(np.sum((left - rows @ fitted(h, train))[~train] ** 2)) for h in THRESHOLDS]
    threshold = max(h for h, e in zip(THRESHOLDS, errors, strict=True) if e <= NEARLY * min(errors))
    kept = fitted(threshold, np.ones(test.size, bool))
    value = kept * np.ptp(force) / size[seen]
    shown = [t for t, s in zip(terms, seen, strict=True) if s]
    found = [replace(t, coefficient=float(c)) for t, c in zip(shown, value, strict=True) if c != 0]
    return [Proposal(t.at, t.name) for t in found]
