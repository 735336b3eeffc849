"""Choose form and order of every parameter's dependence on current by what predicts currents left out, and say so.

See ``law_search``.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.errors import DataError
from mrfit.fit.laws.by_level import CurrentLaw, LevelProblem, Tests, drawn_together, tests_about
from mrfit.fit.laws.law_search import FEWEST_LEVELS, LawSearch, State
from mrfit.io.schemas.fit import Caution, CurrentChoice, LawChosen, LawTried, LevelError
from mrfit.search.cube import Cube
from mrfit.search.problem import LeastSquaresProblem, SegmentBlock
from mrfit.search.starts import LevelFit, level_fits, node_names
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.at_current import through
from mrfit.simulate.current_dependence import (
    HIGHEST_ORDER,
    LOG,
    PLAIN,
    SAT,
    CurrentDependence,
    Order,
    count,
    form_of,
)
from mrfit.simulate.current_levels import default_orders, level_of, levels_of, usual_form, written

# Error that the fits at single currents leave, as a multiple of the noise floor, above which it is the model's own
OWN_ERROR = 1.5
# Error at a level left out, as a multiple of what its own fit leaves, from which on the data ask for more than their
# currents can tell
NOT_MET = 1.5
# Laws rejected that are told in words, the nearest first
TOLD = 4


@dataclass(frozen=True)
class ChoiceLimits:
    """Ends in A of the range tested, randomness, and ``time.monotonic`` after which nothing is chosen any more."""

    low: float
    high: float
    rng: np.random.Generator
    deadline: float | None = None


@dataclass(frozen=True)
class Data:
    """Search blocks, the factor on the error of each, and the noise floor of each in the output's unit."""

    blocks: list[SegmentBlock]
    weights: Array
    floors: Array


@dataclass(frozen=True)
class LawChoice:
    """What was chosen, and why.

    Attributes
    ----------
    dependence
        The choice, None where every parameter is constant.
    about
        For fit.json: how it was judged, levels with errors, parameters with what was rejected, and all in words.
    warnings
        What the number of currents cannot support.
    fits
        The base model's fit at each level, rising.
    theta
        Parameters of the laws that fit all levels best, (L, K) at the levels' currents.
    by_role
        Whether all orders are those of the parameters' roles.
    usual
        These orders by name.
    met
        Whether the laws reach the currents left out about as well as fits to these alone.
    excess
        Error that these leave, as a multiple of the noise floor.
    """

    dependence: CurrentDependence | None
    about: CurrentChoice
    warnings: list[Caution]
    fits: list[LevelFit]
    theta: Array
    by_role: bool
    usual: dict[str, Order]
    met: bool
    excess: float

    @property
    def errs(self) -> bool:
        """Whether fits to single currents leave more than noise, the model's own error."""
        return _is_own_error(self.excess)

    def start(self, base: Assembly, dependence: CurrentDependence) -> dict[str, float]:
        """Return the parameters at the nodes of a dependence, by name, of the laws that fit all levels best."""
        currents = np.array([f.current for f in self.fits])
        nodes = through(base.spec, dependence, currents, self.theta)
        return dict(zip(node_names(base, dependence), nodes.tolist(), strict=True))

    def as_base(self) -> CurrentDependence | None:
        """Return the dependence of a model that may lack an effect.

        Where no polynomial reaches the currents left out, one of an order above that of its parameter's role only
        bends after what an effect of current may explain; and so does a law of a current that saturates.
        """
        if self.dependence is None:
            return None
        lower = {n: count(self.usual[n]) - 1 if n in self.usual else HIGHEST_ORDER for n, _ in self.dependence.orders}
        orders = [(n, o if self.met and form_of(o) != SAT else _capped(o, lower[n])) for n, o in self.dependence.orders]
        return replace(self.dependence, orders=tuple(orders))


def chosen_by_levels(
    base: Assembly, cube: Cube, data: Data, kept: dict[str, Order], limits: ChoiceLimits
) -> LawChoice | None:
    """Return the dependence on current that the base model's fits at single levels call for; None out of time.

    Parameters
    ----------
    base, cube
        The base model and its free parameters.
    data
        What is fitted, of two levels or more.
    kept
        Orders of parameters that are not chosen, by name.
    limits
        Range of current, randomness and deadline.
    """
    blocks, weights = data.blocks, data.weights
    fits = level_fits(blocks, base, cube, weights, limits.rng, limits.deadline)
    levels, posed = levels_of(b.segment for b in blocks), []
    for fit in (fits := [f for f in fits if np.isfinite(f.cost)]):
        members = [k for k, b in enumerate(blocks) if level_of(b.segment, levels) == fit.current]
        own = LeastSquaresProblem([blocks[k] for k in members], weights[members], base, cube)
        posed.append(LevelProblem(own, data.floors[members]))
    if len(fits) < 2:
        raise DataError(
            f"every simulation of '{base.name}' diverged at all currents but one: narrow --bounds, or give "
            "--current-order"
        )
    if limits.deadline is not None and time.monotonic() > limits.deadline:
        return None
    together = drawn_together(cube, fits, posed, limits.rng)
    return choose(tests_about(base.spec, cube, together, posed), fits, kept, (limits.low, limits.high))


def choose(tests: Tests, fits: list[LevelFit], kept: dict[str, Order], ends: tuple[float, float]) -> LawChoice:
    """Return the dependence on current that predicts levels left out best, with no more coefficients than that takes.

    Parameters
    ----------
    tests
        The base model about its optimum at two currents or more.
    fits
        The base model's fit at each level, as it ended.
    kept
        Orders of parameters that are not chosen, by name.
    ends
        Ends in A of the range tested.
    """
    params = [tests.cube.params[k] for k in tests.free]
    groups = _groups(params, [k for k, p in enumerate(params) if p.name not in kept])
    forms = [usual_form(tests.spec, p) for p in params]
    others = {k: CurrentLaw(forms[k], count(kept[p.name]) - 1) for k, p in enumerate(params) if p.name in kept}
    search = LawSearch(tests, groups, tuple(CurrentLaw(forms[g[0]], 0) for g in groups), others)
    by_role = dict(default_orders(tests.spec, search.highest + 1))
    usual = {p.name: by_role[p.name] for p in params if p.name in by_role}
    constant = search.reference
    most = [count(usual.get(params[g[0]].name, 0)) - 1 for g in groups]
    roles = search.determined(tuple(CurrentLaw(search.own_form(k, order), order) for k, order in enumerate(most)))
    search.reference = roles if _is_own_error(tests.excess) else constant
    state = search.nearest(search.best([roles, constant]))
    orders: dict[str, Order] = dict(kept)
    for members, law in zip(search.groups, state, strict=True):
        for param in (params[m] for m in members):
            orders |= {param.name: written(tests.spec, param, law.form, law.order)} if law.order else {}
    named = tuple((p.name, orders[p.name]) for p in tests.spec.params if orders.get(p.name))
    theta = search.fitted(state).parameters(tests.currents)[0]
    about, warnings = _about(search, state, params)
    dependence, met = CurrentDependence(named, *ends) if named else None, _unmet(search, search.errors(state)) is None
    return LawChoice(dependence, about, warnings, fits, theta, dict(named) == usual, usual, met, tests.excess)


def _is_own_error(excess: float) -> bool:
    """Return whether what fits to single currents leave, as a multiple of the noise floor, is the model's own error."""
    return excess > OWN_ERROR


def _capped(order: Order, highest: int) -> Order:
    """Return an order that is no higher, of the same form but for one that saturates, a polynomial."""
    form, lower = form_of(order), min(count(order) - 1, highest)
    form = PLAIN if form == SAT else form
    return f"{form}{lower}" if form else lower


def _groups(params: Sequence[Param], chosen: Sequence[int]) -> list[list[int]]:
    """Return the parameters that vary alike: the coefficients of one expansion, which have no role; others alone."""
    together = [k for k in chosen if not params[k].role]
    alone = [[k] for k in chosen if params[k].role]
    return [*alone, together] if together else alone


def _about(search: LawSearch, state: State, params: Sequence[Param]) -> tuple[CurrentChoice, list[Caution]]:
    """Return what fit.json and the page say of a choice, and the warnings."""
    search.score([s for g in range(len(state)) for s in search.neighbours(state, g)])
    errors, rows, currents = search.errors(state), [], search.tests.currents
    how = "held out" if search.held_out else "fitted: too few to hold one out"
    text = [
        f"law of current{_beside(search.tests.spec)} by the error at currents {how}, as a multiple of what a fit to "
        "one current alone leaves"
    ]
    if _is_own_error(search.tests.excess):
        text[0] += (
            f"; these leave {search.tests.excess:.3g} times the noise, the model's own error: parameters keep the laws "
            "of their roles where no other is clearly nearer"
        )
    error = _mean(errors)
    for group, law in enumerate(state):
        others = sorted(search.neighbours(state, group), key=lambda s: _mean(search.errors(s)))
        tried = [
            LawTried(form=_form(s[group]), order=s[group].order, error=own, why=why)
            for s in others
            for own in [_mean(search.errors(s))]
            for why in [search.objection(s, state) if own < error else ""]
        ]
        names = [params[m].name for m in search.groups[group]]
        rows.append(LawChosen(names=names, form=_form(law), order=law.order, error=error, rejected=tried))
        text.append(f"{_span(names)}: {_words(law.form, law.order)}, {_shown(error)}{_rejected(tried, error)}")
    about = CurrentChoice(
        judged_by="held-out currents" if search.held_out else "fitted currents",
        currents=currents.tolist(),
        errors=[
            LevelError(current=float(i), error=float(e))
            for i, e in zip(currents, errors, strict=True)
            if np.isfinite(e)
        ],
        parameters=rows,
        text=text,
    )
    return about, _warnings(search, state, errors)


def laws_of_roles(dependence: CurrentDependence) -> CurrentChoice:
    """Return the words of fit.json and the page on laws that no held-out current chose."""
    orders = ",".join(f"{name}={order}" for name, order in dependence.orders)
    said = f"laws of current by the roles of the parameters ({orders}): no currents could be held out to choose them"
    return CurrentChoice(judged_by="roles", text=[said])


def _beside(spec: ModelSpec) -> str:
    """Return the effects of a model in words."""
    effects = dict.fromkeys(effect for effect, dot, _ in (n.partition(".") for n in spec.names) if dot)
    return f" beside {' and '.join(effects)}" if effects else ""


def _form(law: CurrentLaw) -> str:
    return law.form if law.order else "constant"


def _rejected(tried: Sequence[LawTried], error: float) -> str:
    """Return the nearest laws that were not taken, in words, and why where they look nearer than the one that was."""
    near = [t for t in tried if _shown(t.error) != _shown(error)]
    told = [f"{_words(t.form, t.order)} {_shown(t.error)}{f' ({t.why})' if t.why else ''}" for t in near[:TOLD]]
    if not told:
        return "; other laws come as near" if tried else ""
    return f"; not taken: {', '.join(told)}"


def _warnings(search: LawSearch, state: State, errors: Array) -> list[Caution]:
    currents, found = search.tests.currents, []
    at = ", ".join(f"{i:.4g} A" for i in currents)
    if not search.held_out and any(law.order for law in state):
        found.append(
            f"tests at {len(currents)} currents ({at}) leave none to hold out: between them the laws of current are "
            f"not checked; test at {FEWEST_LEVELS} currents or more"
        )
    worst = _unmet(search, errors)
    if worst is not None:
        place = currents[worst]
        found.append(
            f"at {place:.4g} A, held out, the error is {errors[worst]:.3g} times what a fit to this current alone "
            f"leaves: a polynomial through {len(currents) - 1} other currents does not reach it; test at currents "
            "near it, or try pieces (--current-order NAME=1:BREAK:2)"
        )
    return [Caution(kind="current-levels", text=text) for text in found]


def _unmet(search: LawSearch, errors: Array) -> int | None:
    """Return the level left out whose error is the largest, where it is too large for a polynomial to be the law."""
    worst = int(np.nanargmax(errors))
    # where the model itself errs, a fit to one current alone is no truth to be reached
    large = search.held_out and not _is_own_error(search.tests.excess) and errors[worst] > NOT_MET
    return worst if large else None


def _mean(errors: Array) -> float:
    """Return the mean of errors on a logarithmic scale."""
    with np.errstate(over="ignore"):
        return float(np.exp(np.nanmean(np.log(errors))))


def _shown(error: float | None) -> str:
    if error is None or not np.isfinite(error):
        return "diverges"
    return f"{error:.2f}" if error < 9.995 else f"{error:.3g}"


def _words(form: str, order: int) -> str:
    if not order:
        return "constant"
    line = {1: "straight line", 2: "parabola", 3: "cubic", 4: "quartic"}[order]
    return {PLAIN: line, LOG: f"exponential of a {line}", SAT: f"{line} of a saturating current"}[form]


def _span(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"
