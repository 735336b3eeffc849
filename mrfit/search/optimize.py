"""Run an optimizer or a chain of them on an Objective: who gets which share of the budget, and why each one stopped."""

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mrfit.core import registry
from mrfit.core.specs import Array, OptimizerSpec, Option
from mrfit.errors import ConfigError
from mrfit.search.objective import BudgetSpent, Descent, InParameters, Objective, Stalled, TimeSpent

# A global search ends when this share of its evaluations has passed without progress, unless told otherwise.
PATIENCE = 0.5

Ending = Literal["finished", "budget", "time", "stalled"]


@dataclass(frozen=True, slots=True)
class Link:
    """What one optimizer of a chain did.

    Attributes
    ----------
    name
        Registry name.
    kind
        ``global``, ``local`` or ``start``.
    allowed, evaluations
        Evaluations it might use, and used.
    cost
        Best cost when it ended.
    ending
        ``finished`` by its own rule; ``budget``, ``time`` or ``stalled`` if it was stopped.
    reason
        The same in words.
    history
        (evaluations of the whole chain, best cost) after every batch, from the link's first to its last.
    preliminary
        Whether these costs are another problem's: that of thinned data, or of bounds wider than the model's.
    """

    name: str
    kind: Literal["global", "local", "start"]
    allowed: int
    evaluations: int
    cost: float
    ending: Ending
    reason: str
    history: tuple[tuple[int, float], ...]
    preliminary: bool = False


# What the user gives for options: name, or OPTIMIZER.NAME, and value
Given = tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class Tuned:
    """An optimizer or a chain as written, with what the user gives for its options."""

    name: str
    given: Given = ()


@dataclass(frozen=True, slots=True)
class Outcome:
    """Where a chain of optimizers ended.

    Attributes
    ----------
    name
        The chain as written.
    point, cost
        Best point (K,) of the cube and its RMS cost; infinite if nothing could be simulated.
    evaluations, nonfinite
        Points simulated, and how many of them gave non-finite values.
    first_nonfinite
        The first of these, shape (K,), or None.
    links
        What each optimizer did.
    descents
        Where each of several starts ended, best first; empty for optimizers without starts.
    agreeing
        How many of these settled at the best cost.
    """

    name: str
    point: Array
    cost: float
    evaluations: int
    nonfinite: int
    first_nonfinite: Array | None
    links: tuple[Link, ...]
    descents: tuple[Descent, ...]
    agreeing: int

    @property
    def converged(self) -> bool:
        """Whether the last optimizer ended by its own rule, not for lack of budget, time or progress."""
        return bool(self.links) and self.links[-1].ending == "finished"


def chain(name: str) -> list[str]:
    """Return the optimizers of a chain written with hyphens.

    Raises
    ------
    ConfigError
        If a part is empty, no such optimizer exists, or one that can only begin a chain stands later in it.
    """
    parts = name.split("-")
    if not all(parts):
        known = ", ".join(registry.names("optimizer"))
        raise ConfigError(f"optimizer chain '{name}' has an empty part: write names joined by single hyphens ({known})")
    for place, part in enumerate(parts):
        if _spec(part).kind == "start" and place:
            raise ConfigError(f"optimizer chain '{name}': {part} is a start, not a search: write it first")
    return parts


def check_options(parts: Sequence[str], given: Iterable[tuple[str, float]]) -> None:
    """Check what the user gives for options of several optimizers.

    Raises
    ------
    ConfigError
        If none of the optimizers has an option of the name, or its value is not allowed.
    """
    for name, value in given:
        owner, dot, own = name.rpartition(".")
        if dot and owner not in parts:
            raise ConfigError(f"--opt-set {name}: '{owner}' does not take part; {' and '.join(parts)} do")
        found = [o for part in parts if owner in ("", part) for o in _spec(part).options if o.name == own]
        if not found:
            known = dict.fromkeys(o.name for part in parts for o in _spec(part).options)
            there = f"they are {', '.join(known)}" if known else "it has none"
            raise ConfigError(f"--opt-set {name}: no option of {', '.join(dict.fromkeys(parts))}; {there}")
        for option in found:
            _check_value(option, value)


def _check_value(option: Option, value: float) -> None:
    if option.whole and value != round(value):
        raise ConfigError(f"--opt-set {option.name}={value:g}: takes whole numbers")
    if not option.low <= value <= option.high:
        raise ConfigError(f"--opt-set {option.name}={value:g}: takes {option.low:g} to {option.high:g}")


def options_of(part: str, given: Iterable[tuple[str, float]]) -> dict[str, float]:
    """Return the value of every option of one optimizer; what names the optimizer goes before what does not."""
    defaults = _spec(part).defaults
    own = sorted(((name, value) for name, value in given), key=lambda pair: "." in pair[0])
    found = {n.removeprefix(f"{part}."): v for n, v in own}
    return defaults | {n: v for n, v in found.items() if n in defaults}


def default_budget(chosen: str | Tuned, dimension: int) -> int:
    """Return the evaluations a chain asks for at this dimension."""
    tuned = _tuned(chosen)
    return sum(_wanted(part, tuned.given, dimension) for part in chain(tuned.name))


def seconds_left(deadline: float | None) -> float | None:
    """Return the seconds to a deadline of ``time.monotonic``, as ``run`` takes them: more than none; None for none."""
    return None if deadline is None else max(deadline - time.monotonic(), 1e-3)


def run(
    chosen: str | Tuned,
    objective: Objective,
    rng: np.random.Generator,
    budget: int | None = None,
    seconds: float | None = None,
    stall: float = PATIENCE,
) -> Outcome:
    """Minimise an objective by the named optimizer or chain; each link starts from the best point of those before it.

    Parameters
    ----------
    chosen
        Registry name, or several joined by hyphens (``pso-fmin``), and what is given for their options.
    objective
        What to minimise; its budget, patience and deadline are set here.
    rng
        Source of all randomness. Without ``seconds`` the outcome depends on nothing else.
    budget
        Evaluations for the whole chain, divided in proportion to what the links ask for, what a link leaves going to
        those after it. None gives every link what it asks for.
    seconds
        Wall-clock limit of the whole chain, looked at before every batch.
    stall
        Share of a global optimizer's evaluations after which it ends if they brought no progress; 1 for never.

    Raises
    ------
    ConfigError
        If an optimizer is unknown, or a limit is not positive.
    """
    tuned, names = _tuned(chosen), chain(_tuned(chosen).name)
    if budget is not None and budget < 1:
        raise ConfigError(f"a budget of {budget} evaluations allows no fit; give at least 1")
    if seconds is not None and not seconds > 0:
        raise ConfigError(f"a time limit of {seconds:g} s allows no fit; give a positive number")
    if not 0.0 < stall <= 1.0:
        raise ConfigError(f"--stall {stall:g} is no share of a search: give more than 0, and at most 1 for never")
    objective.deadline = None if seconds is None else time.monotonic() + seconds
    total = None if budget is None else objective.evaluations + budget
    links: list[Link] = []
    wanted = [_wanted(part, tuned.given, objective.dimension) for part in names]
    for position, part in enumerate(names):
        asked = sum(wanted[position:])
        left = asked if total is None else total - objective.evaluations
        allowed = min(max(round(left * (wanted[position] / asked)), 1), left)
        links.append(_run_link(Tuned(part, tuned.given), objective, rng, allowed, stall))
        if links[-1].ending == "time":
            break
    return Outcome(
        name=tuned.name,
        point=objective.best_point.copy(),
        cost=objective.best_cost,
        evaluations=objective.evaluations,
        nonfinite=objective.nonfinite,
        first_nonfinite=objective.first_nonfinite,
        links=tuple(links),
        descents=tuple(objective.descents),
        agreeing=objective.agreeing,
    )


def _tuned(chosen: str | Tuned) -> Tuned:
    return Tuned(chosen) if isinstance(chosen, str) else chosen


def _spec(name: str) -> OptimizerSpec:
    spec: OptimizerSpec = registry.load("optimizer", name).SPEC
    return spec


def _wanted(name: str, given: Given, dimension: int) -> int:
    return _spec(name).budget(dimension, options_of(name, given))


def _run_link(tuned: Tuned, objective: Objective, rng: np.random.Generator, allowed: int, stall: float) -> Link:
    module, spec = registry.load("optimizer", tuned.name), _spec(tuned.name)
    seen = InParameters(objective) if spec.coordinates == "parameters" else objective
    before, batches = objective.evaluations, len(objective.history)
    objective.budget = before + allowed
    objective.patience = max(1, round(stall * allowed)) if spec.kind == "global" else None
    objective.restart_patience()
    objective.verdict = ""
    ending: Ending
    try:
        module.minimise(seen, rng, options_of(tuned.name, tuned.given))
        ending = "budget" if not objective.verdict and not objective.remaining else "finished"
        reason = objective.verdict or f"its {allowed} evaluations are done"
    except TimeSpent:
        ending, reason = "time", "time limit reached"
    except Stalled as stall:
        ending, reason = "stalled", str(stall) or f"no progress in {objective.patience} evaluations"
    except BudgetSpent:
        ending, reason = "budget", f"budget of {allowed} evaluations spent"
    return Link(
        name=tuned.name,
        kind=spec.kind,
        allowed=allowed,
        evaluations=objective.evaluations - before,
        cost=objective.best_cost,
        ending=ending,
        reason=reason,
        history=tuple(objective.history[batches:]),
    )
