"""What the data determine, in plain words: which parameters trade against which, what to fix, which test to add.

Directions of the parameter space come from the singular values of the Jacobian in cube coordinates, where every
parameter is scaled by its bounds. Open ones are of two kinds. Along a redundant direction the output does not move
whatever the test (its singular value is rounding): only fixing parameters helps. Along one covered by noise it moves
by less than the noise: a better test helps.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.channels import unit_of
from mrfit.core.counting import number_of
from mrfit.core.recording import Segment
from mrfit.core.specs import Array, Index, Param
from mrfit.fit.diagnostics.uncertainty import Uncertainty
from mrfit.search.cube import Cube
from mrfit.simulate.current_dependence import base_name

# Weights below this share of a direction's largest are left out of its sentence
NEGLIGIBLE_SHARE = 0.02
# Step over which the model is taken as linear where a parameter is not searched over decades, as a share of its bounds
LINEAR_STEP = 0.02
# A parameter whose interval spans more than this share of its bounds is poorly determined
LOOSE = 0.25

# What a test has to do to tell parameters of a role from the others
ADVISED_TESTS: Mapping[str, str] = {
    "yield": "add a slower test (lower frequency or amplitude), where the yield force stands alone",
    "knee": "add a slower test (lower frequency or amplitude), where the force turns",
    "viscous": "add a second amplitude or frequency, so that the range of speed differs",
    "stiffness": "add a slow test with a longer stroke, where force follows displacement",
    "offset": "add a test about another mean position, or fix the offset measured at rest",
    "inductance": "add a second amplitude or frequency of current",
    "shape": "add a test in which only this quantity changes, or fix it",
    "inertia": "add a test at a higher frequency, where acceleration is large",
}


@dataclass(frozen=True)
class Verdict:
    """What a fit's data determine.

    Attributes
    ----------
    open
        Parameters the data do not determine one by one.
    loose
        Parameters they determine, within more than a quarter of the bounds.
    fix
        Parameters to hold, as many as there are open directions, that make the others determined.
    sentences
        The same for people.
    """

    open: tuple[str, ...]
    loose: tuple[str, ...]
    fix: tuple[str, ...]
    sentences: tuple[str, ...]


def judge(
    cube: Cube, point: Array, uncertainty: Uncertainty, segments: Sequence[Segment], readable: Sequence[str] = ()
) -> Verdict:
    """Return what the data determine, which parameters trade, what to fix and which test to add.

    Parameters
    ----------
    cube
        Free parameters.
    point
        Optimum in the cube, shape (F,).
    uncertainty
        At this optimum.
    segments
        What was fitted: names the channel and the amplitudes of the test.
    readable
        Derived quantities that the data determine.
    """
    params = [cube.params[int(k)] for k in cube.free]
    axes = np.eye(len(params))
    widths = np.array([uncertainty.half_width(axis) for axis in axes])
    open_names = [p.name for p, w in zip(params, widths, strict=True) if not np.isfinite(w)]
    wide = [p.name for p, w in zip(params, widths, strict=True) if np.isfinite(w) and 2 * w > 1.0]
    loose = [p for p, w in zip(params, widths, strict=True) if np.isfinite(w) and 2 * w > LOOSE]
    fix = [params[int(k)].name for k in _pivots(uncertainty.null)]
    sentences = [_summary(params, open_names, uncertainty)] if open_names or not wide else []
    if wide:
        sentences.append(f"The interval{'s' * (len(wide) > 1)} of {_and(wide)} alone would be wider than the bounds.")
    redundant = uncertainty.directions[:, uncertainty.redundant]
    covered = uncertainty.directions[:, uncertainty.open & ~uncertainty.redundant]
    sentences += [_redundancy(params, d) for d in sparse_directions(redundant)]
    sentences += [_covered_by_noise(params, d) for d in sparse_directions(covered)]
    sentences += _remedies(readable, fix, params, covered, loose, segments)
    sentences += _bounds(params, point)
    return Verdict((*open_names, *wide), tuple(p.name for p in loose), tuple(fix), tuple(sentences))


def sparse_directions(null: Array) -> list[Array]:
    """Return directions (F,) that span the same space as the columns of (F, U), each in as few parameters as possible.

    Row reduction with pivoting: each direction is 1 at a pivot of its own, 0 at those of the others.
    """
    pivots = _pivots(null)
    if not len(pivots):
        return []
    reduced = np.linalg.solve(null[pivots].T, null.T)
    return [d / d[int(np.argmax(np.abs(d)))] for d in reduced]


def _pivots(null: Array) -> Index:
    """Return the parameters that together move most along the open directions (F, U), U of them."""
    from scipy.linalg import qr

    if not null.shape[1]:
        return np.empty(0, dtype=np.int64)
    return qr(null.T, mode="r", pivoting=True)[1][: null.shape[1]].astype(np.int64)


def _summary(params: Sequence[Param], open_names: Sequence[str], uncertainty: Uncertainty) -> str:
    if not open_names:
        return f"The data tell all {len(params)} parameters apart."
    left = len(open_names) - uncertainty.null.shape[1]
    known = [p.name for p in params if p.name not in open_names]
    alone = f"{_and(known)} one by one, and " if known else ""
    combinations = f"of {_and(open_names)} only {number_of('combination', left)}"
    if left <= 0:
        combinations = f"nothing of {_and(open_names)}"
    return f"The data determine {uncertainty.rank} of {len(params)} parameters: {alone}{combinations}."


def _redundancy(params: Sequence[Param], direction: Array) -> str:
    moves = _moves(params, direction)
    if len(moves) == 1:
        return f"{moves[0].split()[0]} has no effect on the output in this test."
    return f"{_and(moves)} together leave the output as it is, in any test of this kind."


def _covered_by_noise(params: Sequence[Param], direction: Array) -> str:
    moves = _moves(params, direction)
    if len(moves) == 1:
        return f"{moves[0].split()[0]} has no effect above the noise: over its whole range the output moves by less."
    return f"{_and(moves)} together change the output by less than the noise."


def _moves(params: Sequence[Param], direction: Array) -> list[str]:
    """Return how parameters move together: as factors where they are searched over decades, else as sums."""
    keep = [k for k in np.argsort(-np.abs(direction), kind="stable") if abs(direction[k]) > NEGLIGIBLE_SHARE]
    logs = [k for k in keep if params[k].scale == "log"]
    # the first factor is 2, unless a parameter on a linear scale would move far: then all is a small step
    unit = np.log(2.0) / (direction[logs[0]] * _decades(params[logs[0]])) if logs else LINEAR_STEP
    widest = max((abs(unit * direction[k]) for k in keep if k not in logs), default=0.0)
    unit *= min(1.0, LINEAR_STEP / widest) if widest else 1.0
    words = []
    for k in keep:
        step = unit * direction[k]
        param = params[k]
        if param.scale == "log":
            words.append(f"{param.name} ×{np.exp(step * _decades(param)):.3g}")
        else:
            change = step * (param.high - param.low)
            words.append(f"{param.name} {'+' if change > 0 else '−'}{abs(change):.3g}")
    return words


def _decades(param: Param) -> float:
    return float(np.log(param.high / param.low))


def _remedies(
    readable: Sequence[str],
    fix: Sequence[str],
    params: Sequence[Param],
    covered: Array,
    loose: Sequence[Param],
    segments: Sequence[Segment],
) -> list[str]:
    said = []
    if fix:
        held = " ".join(f"--fix {name}=VALUE" for name in fix)
        instead = f", or read {_and(readable)} instead" if readable else ""
        said.append(f"To get the rest one by one, hold {_and(fix)} ({held}){instead}.")
    leaning = [p for p, row in zip(params, covered, strict=True) if np.sum(row**2) > 0.1] if covered.size else []
    asked = {p.role: p.name for p in [*loose, *leaning]}
    for role, name in asked.items():
        advice = _small_loops(segments) if role == "hysteresis" or not role else ADVISED_TESTS.get(role, "")
        if "@" in name:
            advice = f"add tests at currents near {name.partition('@')[2]}"
        if advice:
            said.append(f"For {base_name(name)}: {advice}.")
    return said


def _small_loops(segments: Sequence[Segment]) -> str:
    """Return the advice that sharpens a hysteresis: amplitudes far below those tested, about the turn-over."""
    amplitudes = sorted({s.amplitude for s in segments if s.cycles})
    if not amplitudes:
        return "add cycles of small amplitude"
    unit = unit_of(segments[0].drive)
    low, high = 0.02 * amplitudes[0], 0.2 * amplitudes[0]
    return f"add cycles of small amplitude ({low:.2g} to {high:.2g} {unit}), where the loop's knee shows"


def _bounds(params: Sequence[Param], point: Array) -> list[str]:
    at = [p.name for p, place in zip(params, point, strict=True) if min(place, 1 - place) < 1e-4]
    if not at:
        return []
    return [f"{_and(at)} ended at a bound, where an interval says little: widen --bounds, or hold it there."]


def _and(words: Sequence[str]) -> str:
    return " and ".join(([", ".join(words[:-1])] if len(words) > 1 else []) + list(words[-1:]))
