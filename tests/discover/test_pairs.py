"""Two effects of which neither is of use alone are found together, and none where nothing is missing."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from mrfit.core import registry
from mrfit.core.progress import silent
from mrfit.discover.evidence.bench import build_bench
from mrfit.discover.evidence.gather import SimulatedEvidence
from mrfit.discover.evidence.refit import Fitter
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.duels import Inquiry, duel
from mrfit.discover.selection.pairs import best_pair
from mrfit.discover.selection.questions import Fit, Join, Try, refit
from mrfit.fit.select import load_recordings
from mrfit.simulate.assembly import assemble
from tests.discover.studies import workspace
from tests.discover.world import World

EFFECTS = [registry.load("effect", name).SPEC for name in ("inertia", "quadratic-drag", "coulomb-friction")]


def inquiry_of(folder: Path, mass: float, drag: float) -> Inquiry:
    """Return the case of a damper with a mass and an orifice loss, from a base that has neither."""
    study = workspace(folder, mass=mass, drag=drag)
    segments = study.read_segments()
    bench = build_bench(segments, load_recordings(study, segments), assemble("tanh"), EFFECTS)
    fitter = Fitter(bench, "tanh", None, {}, {}, lambda effects, point: None)
    gathering = SimulatedEvidence(fitter, fitter.first(0), EFFECTS, STANDARD, 0, silent)
    return Inquiry(gathering, STANDARD, gathering.screen(gathering.base))


def found_in(folder: Path, mass: float, drag: float) -> Fit | None:
    """Return the best pair among three effects, of which only friction was tried alone."""
    inquiry = inquiry_of(folder, mass, drag)
    friction = next(c for c in inquiry.screening.candidates if c.name == "coulomb-friction")
    tried = refit(inquiry.source, Try(inquiry.base, friction))
    return best_pair(inquiry, inquiry.screening, [inquiry.judged(friction.name, inquiry.base, tried)])


def test_a_pair_is_found_though_neither_was_tried_alone(tmp_path: Path) -> None:
    found = found_in(tmp_path, mass=12.0, drag=2500.0)
    assert found is not None and found.effects == ("inertia", "quadratic-drag")
    assert found.holdout < 1.1


def test_no_pair_is_looked_for_where_only_noise_is_left(tmp_path: Path) -> None:
    assert found_in(tmp_path, mass=0.0, drag=0.0) is None


def test_a_rival_that_ended_in_a_local_minimum_is_fitted_again_from_where_it_stands_beside_the_other(
    tmp_path: Path,
) -> None:
    inquiry = inquiry_of(tmp_path, mass=12.0, drag=0.0)
    gathering, base = inquiry.source, inquiry.base
    assert isinstance(gathering, SimulatedEvidence)
    poor = {**base.values, "inertia.m": 1.0}
    cube = gathering.fitter.cube(["inertia"])
    gathering.fitter.known["inertia",] = cube.to_points(np.array([[poor[p.name] for p in cube.params]]))[0]
    astray = inquiry.judged("inertia", base, refit(gathering, Join(("inertia",), (poor,))))
    drag = next(c for c in inquiry.screening.candidates if c.name == "quadratic-drag")
    other = inquiry.judged(drag.name, base, refit(gathering, Try(base, drag)))
    ending = duel(inquiry, base, [astray, other])
    assert astray.fit.holdout > 1.5 > 1.1 > ending.winner.fit.holdout
    assert (ending.winner.name, ending.equals) == ("inertia", ())


def refits_of_pairs(world: World, policy: object = STANDARD) -> int:
    inquiry = Inquiry(world, STANDARD, world.ask_screening())
    inquiry = replace(inquiry, policy=policy)  # type: ignore[arg-type]
    best_pair(inquiry, inquiry.screening, [])
    return sum(isinstance(q[1], Join) for q in world.asked)


def test_no_more_pairs_are_refitted_than_the_policy_allows_and_none_after_one_that_leaves_little() -> None:
    errors = {(): 10.0} | {(n,): 10.0 for n in "abcde"}
    assert len(list(combinations("abcde", 2))) == 10 > STANDARD.most_pairs
    assert refits_of_pairs(World(errors)) == STANDARD.most_pairs
    assert refits_of_pairs(World(errors), replace(STANDARD, most_pairs=10)) == 10
    assert refits_of_pairs(World(errors | {("b", "d"): 1.05})) == 1
