"""From a fit's settings to its laws of current: as asked for, chosen where levels are held, else by role."""

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from mrfit.core.recording import Recording, Segment
from mrfit.fit.identify import SearchSettings, build_group, weights_of
from mrfit.fit.laws.choice import ChoiceLimits, Data, LawChoice, chosen_by_levels
from mrfit.search.cube import Cube, cube_of
from mrfit.search.starts import at_scales
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence, base_name
from mrfit.simulate.current_levels import base_of, default_orders, dependence_on_current, tested_currents, to_choose

# Share of the time allowed after which nothing is chosen any more
CHOICE_TIME = 0.5


class LawSettings(Protocol):
    """Settings of a fit, as its stage has them."""

    @property
    def model(self) -> str:
        """Model as written."""

    @property
    def optimizer(self) -> str:
        """Optimizer chain."""

    @property
    def per(self) -> str:
        """``all`` for a joint fit."""

    @property
    def seed(self) -> int:
        """Seed of every random choice."""

    @property
    def seconds(self) -> float | None:
        """Wall-clock limit."""

    @property
    def weight(self) -> str:
        """Weighting of conditions."""

    @property
    def bounds(self) -> tuple[tuple[str, float, float], ...]:
        """The user's bounds."""

    @property
    def start(self) -> tuple[tuple[str, float], ...]:
        """The user's start values."""

    @property
    def fixed(self) -> tuple[tuple[str, float], ...]:
        """The user's fixed values."""

    @property
    def current_order(self) -> str:
        """``auto``, an order, or ``NAME=ORDER,…``."""


def base_cube(asked: LawSettings) -> Cube:
    """Return the cube of the base model alone, with what the settings say of it."""
    spec = base_of(asked.model).spec
    own = {base_name(n) for n in spec.names}
    bounds = {n: (low, high) for n, low, high in asked.bounds if n in own}
    start, fixed = ({n: v for n, v in given if n in own} for given in (asked.start, asked.fixed))
    return cube_of(spec, bounds, start, fixed)


def dependence_of(
    asked: LawSettings,
    segments: Sequence[Segment],
    recordings: dict[str, Recording],
    held: Mapping[str, float] | None = None,
    constant: Collection[str] = (),
) -> tuple[CurrentDependence | None, LawChoice | None]:
    """Return how a fit's parameters depend on current, and how that was chosen, None where it was not.

    Parameters
    ----------
    asked
        Settings of the fit.
    segments, recordings
        What is fitted.
    held
        Parameters of the model's effects by name (SI), at which these act while laws are chosen. Without them laws are
        those of the base alone, which bend after what the effects do.
    constant
        Parameters that do not depend on current unless the settings give them at nodes of it.

    Raises
    ------
    DataError
        If the levels of current do not carry the order asked for.
    """
    if asked.per != "all":
        return None, None
    choice, fixed, currents = None, [n for n, _ in asked.fixed], tested_currents(segments, recordings)
    if to_choose(asked.model, asked.current_order, currents):
        # what is given for one node of current is for a parameter that varies
        given = [n for n, _, _ in asked.bounds] + [n for n, _ in (*asked.start, *asked.fixed)]
        at_nodes = {base_name(n) for n in given if "@" in n}
        orders = default_orders(base_of(asked.model).spec, currents.steps, fixed)
        search = SearchSettings(asked.optimizer, asked.seed, None, asked.seconds, asked.weight)
        deadline = None if asked.seconds is None else time.monotonic() + CHOICE_TIME * asked.seconds
        limits = ChoiceLimits(currents.low, currents.high, search.rng("all by current"), deadline)
        kept = dict.fromkeys(constant, 0) | {n: o for n, o in orders if n in at_nodes}
        choice = _chosen(asked, segments, recordings, kept, limits, held)
    if choice:
        return choice.dependence, choice
    return dependence_on_current(asked.model, asked.current_order, segments, recordings, fixed), None


def _chosen(
    asked: LawSettings,
    segments: Sequence[Segment],
    recordings: dict[str, Recording],
    kept: dict[str, int | str],
    limits: ChoiceLimits,
    held: Mapping[str, float] | None,
) -> LawChoice | None:
    base, cube = base_of(asked.model), base_cube(asked)
    own = len(cube.params)
    if held:
        base = assemble(asked.model)
        cube = replace(cube, params=(*cube.params, *cube_of(base.spec, {}, {}, held).params[own:]))
    training = [s for s in segments if s.role == "train"]
    group = build_group("all", training, recordings, base, split=False)
    cube = at_scales(cube, group.training, base)
    weights = weights_of(group.search, group.training_floors, asked.weight)
    data = Data(group.search, weights, np.array(group.training_floors))
    found = chosen_by_levels(base, cube, data, kept, limits)
    if found is None or not held:
        return found
    fits = [replace(f, theta=f.theta[:own]) for f in found.fits]
    return replace(found, fits=fits, theta=found.theta[:, :own])
