"""A chain of optimizers on one problem: who gets which share of the budget, and why each one stopped."""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrfit.core import registry
from mrfit.core.specs import Array, OptimizerSpec, Option, Options
from mrfit.errors import ConfigError, unknown_name
from mrfit.optimizers.cost.objective import BudgetSpent, InParameters, NoProgress, Objective, Termination, TimeSpent
from mrfit.search.limits import UNLIMITED, Limits, SearchContext
from mrfit.search.problem import Problem
from mrfit.search.result import ChainLink, Ending, SearchResult
from mrfit.search.strategy import Strategy

# Strategies that can be written as a part of a chain, and the optimizer that is their part in it
STRATEGY_PARTS = {"auto": "multistart", "staged": "lsq"}

# What the user gives for options: name, or OPTIMIZER.NAME, and value
Given = tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class ChainStep:
    """One optimizer of a chain, with the values of its options.

    Attributes
    ----------
    name
        As written in the chain.
    spec
        Its self-description.
    minimise
        The optimizer: minimises an objective, or one in parameters where its SPEC says so.
    options
        Value of every option.
    """

    name: str
    spec: OptimizerSpec
    minimise: Callable[..., Termination | None]
    options: Options

    def budget(self, dimension: int) -> int:
        """Return the evaluations that it asks for at this dimension."""
        return self.spec.budget(dimension, self.options)


@dataclass(frozen=True, slots=True)
class OptimizerChain(Strategy):
    """Strategy: one optimizer after another on all data, each from the best point of those before it.

    Attributes
    ----------
    name
        Optimizers joined by hyphens (``pso-fmin``).
    given
        What the user gives for their options.
    scored
        Whether a single start is simulated before the first optimizer, too; of several the best is needed anyway.
    """

    name: str
    given: Given = ()
    scored: bool = False

    @property
    def many_starts(self) -> bool:
        """Whether it makes more of several starts than to begin at the best of them."""
        return False

    @property
    def from_points(self) -> bool:
        """Whether it begins where the characteristic points of the data are, and nowhere else."""
        return self._start is not None and self._start.reads == "loops"

    @property
    def from_means(self) -> bool:
        """Whether it begins at the means of fits to the conditions of each current, and nowhere else."""
        return self._start is not None and self._start.reads == "conditions"

    @property
    def _start(self) -> OptimizerSpec | None:
        first = _spec(parts(self.name)[0])
        return first if first.kind == "start" else None

    @property
    def begins_with(self) -> str:
        """The name of what it begins with instead of the start that it is given; empty where it begins there."""
        return "fits of the conditions" if self.from_means else ""

    def check(self, model: str, per: str) -> None:
        """Refuse means over conditions where conditions are fitted one by one.

        Raises
        ------
        ConfigError
            If they are.
        """
        if self.from_means and per != "all":
            raise ConfigError(f"--opt {self.name} takes means over the conditions of each current: add --per all")

    @property
    def searches(self) -> bool:
        """Whether an optimizer goes on from the start."""
        return any(_spec(part).kind != "start" for part in parts(self.name))

    def budget(self, dimension: int) -> int:
        """Return the evaluations that all optimizers ask for together."""
        return sum(step.budget(dimension) for step in steps(self.name, self.given))

    def search(self, problem: Problem, starts: Array, how: SearchContext) -> SearchResult:
        """Return where the chain ends; it begins at the best of the starts (S, F)."""
        budget, seconds, stall = how.limits
        if budget is not None:
            starts = starts[: max(budget - 1, 1)]
        objective = Objective(
            problem.residuals, starts[0], len(starts), how.on_progress, starts, coordinates=problem.coordinates
        )
        if self.scored or len(starts) > 1:
            objective.costs(starts)
        left = None if budget is None else max(budget - objective.evaluations, 1)
        return run_steps(steps(self.name, self.given), objective, how.rng, Limits(left, seconds, stall))


def parts(name: str) -> list[str]:
    """Return the optimizers of a chain written with hyphens.

    Raises
    ------
    ConfigError
        If a part is empty, no such optimizer exists, or one that can only begin a chain stands later in it.
    """
    written = name.split("-")
    if not all(written):
        known = ", ".join(names())
        raise ConfigError(f"optimizer chain '{name}' has an empty part: write names joined by single hyphens ({known})")
    for place, part in enumerate(written):
        if _spec(part).kind == "start" and place:
            raise ConfigError(f"optimizer chain '{name}': {part} is a start, not a search: write it first")
    return written


def check_options(taking_part: Sequence[str], given: Iterable[tuple[str, float]]) -> None:
    """Check what the user gives for options of several optimizers.

    Raises
    ------
    ConfigError
        If none of the optimizers has an option of the name, or its value is not allowed.
    """
    for name, value in given:
        owner, dot, own = name.rpartition(".")
        if dot and owner not in taking_part:
            raise ConfigError(f"--opt-set {name}: '{owner}' does not take part; {' and '.join(taking_part)} do")
        found = [o for part in taking_part if owner in ("", part) for o in _spec(part).options if o.name == own]
        if not found:
            known = dict.fromkeys(o.name for part in taking_part for o in _spec(part).options)
            there = f"they are {', '.join(known)}" if known else "it has none"
            raise ConfigError(f"--opt-set {name}: no option of {', '.join(dict.fromkeys(taking_part))}; {there}")
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


def names() -> list[str]:
    """Return all that can be written in a chain, sorted.

    Raises
    ------
    ConfigError
        If an optimizer has the name of a strategy.
    """
    optimizers = registry.names("optimizer")
    for taken in sorted(set(STRATEGY_PARTS) & set(optimizers)):
        raise ConfigError(f"optimizer '{taken}' has the name of a strategy of mrfit's own; give it another")
    return sorted([*STRATEGY_PARTS, *optimizers])


def steps(name: str, given: Given = ()) -> list[ChainStep]:
    """Return the optimizers of a chain written with hyphens, with their options.

    Raises
    ------
    ConfigError
        As ``parts``.
    """
    return [ChainStep(p, _spec(p), _module(p).minimise, options_of(p, given)) for p in parts(name)]


def run(
    name: str, objective: Objective, rng: np.random.Generator, limits: Limits = UNLIMITED, given: Given = ()
) -> SearchResult:
    """Minimise an objective by a chain as written, with what is given for its options; see ``run_steps``."""
    return run_steps(steps(name, given), objective, rng, limits)


def run_steps(
    chain: Sequence[ChainStep], objective: Objective, rng: np.random.Generator, limits: Limits
) -> SearchResult:
    """Minimise an objective by one optimizer after another, each from the best point of those before it.

    Parameters
    ----------
    chain
        The optimizers.
    objective
        What to minimise; its allowance is set here.
    rng
        Source of all randomness. Without a limit in seconds the result depends on nothing else.
    limits
        Evaluations for the whole chain, divided in proportion to what the links ask for, what a link leaves going to
        those after it; None gives every link what it asks for. Seconds for the whole chain, looked at before every
        batch. Share of a global optimizer's evaluations after which it ends if they brought no progress; 1 for never.

    Raises
    ------
    ConfigError
        If a limit is not positive.
    """
    budget, seconds, stall = limits
    check(limits)
    deadline = None if seconds is None else time.monotonic() + seconds
    total = None if budget is None else objective.evaluations + budget
    links: list[ChainLink] = []
    ended = Termination()
    wanted = [step.budget(objective.dimension) for step in chain]
    for position, step in enumerate(chain):
        asked = sum(wanted[position:])
        left = asked if total is None else total - objective.evaluations
        allowed = min(max(round(left * (wanted[position] / asked)), 1), left)
        patience = max(1, round(stall * allowed)) if step.spec.kind == "global" else None
        objective.allow(allowed, patience, deadline)
        link, own = _run_link(step, objective, rng, allowed)
        links.append(link)
        ended = own if own.descents else ended
        if link.ending == "time":
            break
    return SearchResult(
        point=objective.best_point.copy(),
        cost=objective.best_cost,
        nfev=objective.evaluations,
        nonfinite=objective.nonfinite,
        first_nonfinite=objective.first_nonfinite,
        links=tuple(links),
        descents=ended.descents,
        agreeing=ended.agreeing,
    )


def check(limits: Limits) -> None:
    """Check the limits of a search.

    Raises
    ------
    ConfigError
        If one is not positive.
    """
    budget, seconds, stall = limits
    if budget is not None and budget < 1:
        raise ConfigError(f"a budget of {budget} evaluations allows no fit; give at least 1")
    if seconds is not None and not seconds > 0:
        raise ConfigError(f"a time limit of {seconds:g} s allows no fit; give a positive number")
    if not 0.0 < stall <= 1.0:
        raise ConfigError(f"--stall {stall:g} is no share of a search: give more than 0, and at most 1 for never")


def _module(part: str) -> Any:
    if part not in names():
        raise unknown_name("optimizer", part, names())
    return registry.load("optimizer", STRATEGY_PARTS.get(part, part))


def _spec(part: str) -> OptimizerSpec:
    spec: OptimizerSpec = _module(part).SPEC
    return spec


def _run_link(
    step: ChainStep, objective: Objective, rng: np.random.Generator, allowed: int
) -> tuple[ChainLink, Termination]:
    """Return what one optimizer did within its allowance, and what it says about its end."""
    seen = InParameters(objective) if step.spec.coordinates == "parameters" else objective
    before, batches = objective.evaluations, len(objective.history)
    ending: Ending
    try:
        own = step.minimise(seen, rng, step.options) or Termination()
        ending = "budget" if not own.reason and not objective.remaining else "finished"
        reason = own.reason or f"its {allowed} evaluations are done"
    except BudgetSpent as spent:
        own = spent.ended
        if isinstance(spent, TimeSpent):
            ending, reason = "time", "time limit reached"
        elif isinstance(spent, NoProgress):
            ending, reason = "stalled", str(spent) or f"no progress in {objective.allowance.patience} evaluations"
        else:
            ending, reason = "budget", f"budget of {allowed} evaluations spent"
    link = ChainLink(
        name=step.name,
        kind=step.spec.kind,
        allowed=allowed,
        evaluations=objective.evaluations - before,
        cost=objective.best_cost,
        ending=ending,
        reason=reason,
        history=tuple(objective.history[batches:]),
        ends=step.spec.kind == "local" or step.spec.ends,
    )
    return link, own
