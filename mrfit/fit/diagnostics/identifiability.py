"""What the data determine, in plain words: which parameters trade against which, what to fix, which test to add.

Directions of the parameter space come from the singular values of the Jacobian in cube coordinates, where every
parameter is scaled by its bounds. Open ones are of two kinds. Along a redundant direction the output does not move
whatever the test (its singular value is rounding): only fixing parameters helps. Along one covered by the error of the
fit it moves, but the error that the fit leaves, noise and what the model lacks, is too large and too much correlated
to say how far: a better test helps. Amounts are those of the linearised model, for a small step.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core import registry
from mrfit.core.channels import unit_of
from mrfit.core.counting import number_of
from mrfit.core.recording import Segment
from mrfit.core.specs import Array, EffectSpec, Index, Param
from mrfit.fit.diagnostics.uncertainty import Uncertainty
from mrfit.search.cube import Cube
from mrfit.simulate.current_dependence import base_name

# Weights below this share of a direction's largest are left out of its sentence
NEGLIGIBLE_SHARE = 0.02
# Steps over which the model is taken as linear: of a parameter searched over decades the factor, of another the share
# of its bounds
LINEAR_FACTOR, LINEAR_STEP = 1.1, 0.02
# Distance from a bound, as a share of both, within which a parameter counts as at it
AT_BOUND = 1e-4
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
    cube: Cube,
    point: Array,
    uncertainty: Uncertainty,
    segments: Sequence[Segment],
    readable: Sequence[str] = (),
    *,
    error: float,
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
    error
        RMS of the weighted residuals.
    """
    params = [cube.params[int(k)] for k in cube.free]
    axes = np.eye(len(params))
    widths = np.array([uncertainty.half_width(axis) for axis in axes])
    open_names = [p.name for p, w in zip(params, widths, strict=True) if not np.isfinite(w)]
    wide = [p.name for p, w in zip(params, widths, strict=True) if np.isfinite(w) and 2 * w > 1.0]
    loose = [p for p, w in zip(params, widths, strict=True) if np.isfinite(w) and 2 * w > LOOSE]
    fix = [params[int(k)].name for k in _pivots(uncertainty.null)]
    redundant = uncertainty.directions[:, uncertainty.redundant]
    covered = uncertainty.directions[:, uncertainty.open & ~uncertainty.redundant]
    trades, hidden = ([_step(params, d) for d in sparse_directions(v)] for v in (redundant, covered))
    ends = _bounds_reached(params, point)
    # what is at a bound may act little there and much elsewhere
    alone = [params[int(np.argmax(s != 0.0))].name for s in (*trades, *hidden) if np.sum(s != 0.0) == 1]
    resting = [name for name in alone if name in ends]
    sentences = [_summary(params, open_names, uncertainty, resting)] if open_names or not wide else []
    if wide:
        sentences.append(f"The interval{'s' * (len(wide) > 1)} of {_and(wide)} alone would be wider than the bounds.")
    sentences += [_redundancy(params, s) for s in trades if not _only(params, s, resting)]
    sentences += [_covered(params, s, uncertainty, error) for s in hidden if not _only(params, s, resting)]
    sentences += _remedies(readable, [n for n in fix if n not in resting], params, covered, loose, segments)
    sentences += _bounds(ends, resting)
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


def _summary(
    params: Sequence[Param], open_names: Sequence[str], uncertainty: Uncertainty, resting: Sequence[str]
) -> str:
    if not open_names:
        return f"The data bound all {len(params)} parameters; the intervals say how closely."
    trading = [n for n in open_names if n not in resting]
    left = len(trading) - (uncertainty.null.shape[1] - len(resting))
    known = [p.name for p in params if p.name not in open_names]
    parts = [f"{_and(known)} one by one"] * bool(known)
    if trading:
        combinations = f"of {_and(trading)} only {number_of('combination', left)}"
        parts.append(combinations if left > 0 else f"nothing of {_and(trading)}")
    what = f": {', and '.join(parts)}" if parts else ""
    return f"The data determine {uncertainty.rank} of {len(params)} parameters{what}."


def _only(params: Sequence[Param], step: Array, names: Sequence[str]) -> bool:
    """Return whether a step moves one parameter, which is among these names."""
    return int(np.sum(step != 0.0)) == 1 and params[int(np.argmax(step != 0.0))].name in names


def _redundancy(params: Sequence[Param], step: Array) -> str:
    moves = _moves(params, step)
    if len(moves) == 1:
        return f"{moves[0].split()[0]} has no effect on the output in this test."
    return f"{_and(moves)} together leave the output as it is, in any test of this kind."


def _covered(params: Sequence[Param], step: Array, uncertainty: Uncertainty, error: float) -> str:
    moves = _moves(params, step)
    change = float(np.linalg.norm(uncertainty.singular_values * (uncertainty.directions.T @ step)))
    verb, what = ("changes", "it") if len(moves) == 1 else ("together change", "how far they move")
    share = f"{100.0 * change / error:.2g} %" if error > 0.0 else "a share"
    return (
        f"{_and(moves)} {verb} the output by {share} of the error that the fit leaves (RMS): "
        f"beside errors like these the data do not determine {what}."
    )


def _step(params: Sequence[Param], direction: Array) -> Array:
    """Return a step (F,) along a direction over which the model is taken as linear, 0 where it is negligible."""
    step = np.where(np.abs(direction) > NEGLIGIBLE_SHARE, direction, 0.0)
    most = [np.log(LINEAR_FACTOR) / _decades(p) if p.scale == "log" else LINEAR_STEP for p in params]
    # none moves farther
    return step / float(np.max(np.abs(step) / most))


def _moves(params: Sequence[Param], step: Array) -> list[str]:
    """Return how parameters move together: as factors where they are searched over decades, else as sums."""
    words = []
    for k in np.argsort(-np.abs(step), kind="stable")[: np.count_nonzero(step)]:
        param = params[k]
        if param.scale == "log":
            words.append(f"{param.name} ×{np.exp(step[k] * _decades(param)):.3g}")
        else:
            change = step[k] * (param.high - param.low)
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
    asked = {p.role or _effect_of(p): p for p in [*loose, *leaning]}
    said += [f"For {base_name(p.name)}: {advice}." for p in asked.values() if (advice := _advice(p, segments))]
    return said


def _effect_of(param: Param) -> str:
    """Return the effect that has a parameter, empty for one of the base model."""
    return effect if (effect := param.name.partition(".")[0]) in registry.names("effect") else ""


def _advice(param: Param, segments: Sequence[Segment]) -> str:
    """Return the test that tells a parameter, by its role or as its effect states it; empty where none is known."""
    if "@" in param.name:
        return f"add tests at currents near {param.name.partition('@')[2]}"
    if param.role == "hysteresis":
        return _small_loops(segments)
    if effect := "" if param.role else _effect_of(param):
        spec: EffectSpec = registry.load("effect", effect).SPEC
        return spec.experiment
    return ADVISED_TESTS.get(param.role, "")


def _small_loops(segments: Sequence[Segment]) -> str:
    """Return the advice that sharpens a hysteresis: amplitudes far below those tested, about the turn-over."""
    amplitudes = sorted({s.amplitude for s in segments if s.cycles})
    if not amplitudes:
        return "add cycles of small amplitude"
    unit = unit_of(segments[0].drive)
    low, high = 0.02 * amplitudes[0], 0.2 * amplitudes[0]
    return f"add cycles of small amplitude ({low:.2g} to {high:.2g} {unit}), where the loop's knee shows"


def _bounds_reached(params: Sequence[Param], point: Array) -> dict[str, tuple[str, float, str]]:
    """Return the bounds that parameters have reached: name -> side, value and unit."""
    ends: dict[str, tuple[str, float, str]] = {}
    for p, place in zip(params, point, strict=True):
        if min(place, 1 - place) < AT_BOUND:
            side, value = ("lower", p.low) if place < 0.5 else ("upper", p.high)
            ends[p.name] = side, value, "" if p.unit == "1" else f" {p.unit}"
    return ends


def _bounds(ends: Mapping[str, tuple[str, float, str]], resting: Sequence[str]) -> list[str]:
    said = []
    for name in resting:
        side, value, unit = ends[name]
        asked = "no more" if side == "lower" else "no less"
        said.append(
            f"{name} ended at its {side} bound, {value:.4g}{unit}: the data ask for {asked} of it, and near this bound "
            "it hardly moves the output. Widen --bounds, or hold it there."
        )
    at = [name for name in ends if name not in resting]
    if at:
        said.append(f"{_and(at)} ended at a bound, where an interval says little: widen --bounds, or hold it there.")
    return said


def _and(words: Sequence[str]) -> str:
    return " and ".join(([", ".join(words[:-1])] if len(words) > 1 else []) + list(words[-1:]))
