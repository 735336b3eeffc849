"""Two effects of which neither is of use alone are found together, and none where nothing is missing."""

from pathlib import Path

import numpy as np

from mrfit.core import registry
from mrfit.core.progress import silent
from mrfit.discover.bench import build_bench
from mrfit.discover.decide import Verdict, duel
from mrfit.discover.pairs import best_pair
from mrfit.discover.refit import Fitter, Refit
from mrfit.discover.screen import screen
from mrfit.discover.trials import judge, try_out
from mrfit.fit.select import load_recordings
from mrfit.simulate.assembly import assemble
from tests.discover.studies import workspace

EFFECTS = [registry.load("effect", name).SPEC for name in ("inertia", "quadratic-drag", "coulomb-friction")]


def fitter_of(folder: Path, mass: float, drag: float) -> Fitter:
    """Return what fits a damper with a mass and an orifice loss, from a base that has neither."""
    study = workspace(folder, mass=mass, drag=drag)
    segments, _ = study.read_segments()
    bench = build_bench(segments, load_recordings(study, segments), assemble("tanh"), EFFECTS)
    return Fitter(bench, "tanh", None, {}, {}, lambda effects, point: None)


def found_in(folder: Path, mass: float, drag: float) -> Refit | None:
    """Return the best pair among three effects, of which only friction was tried alone."""
    fitter = fitter_of(folder, mass, drag)
    base = fitter.first(0)
    screened = screen(fitter, base, EFFECTS)
    trials = list(try_out(fitter, base, [s for s in screened if s.name == "coulomb-friction"], base))
    return best_pair(fitter, base, base, (screened, trials), silent)


def test_a_pair_is_found_though_neither_was_tried_alone(tmp_path: Path) -> None:
    found = found_in(tmp_path, mass=12.0, drag=2500.0)
    assert found is not None and found.effects == ("inertia", "quadratic-drag")
    assert found.chi("holdout") < 1.1


def test_no_pair_is_looked_for_where_only_noise_is_left(tmp_path: Path) -> None:
    assert found_in(tmp_path, mass=0.0, drag=0.0) is None


def test_a_rival_that_ended_in_a_local_minimum_is_fitted_again_from_where_it_stands_beside_the_other(
    tmp_path: Path,
) -> None:
    fitter = fitter_of(tmp_path, mass=12.0, drag=0.0)
    base = fitter.first(0)
    poor = base.values | {"inertia.m": 1.0}
    cube = fitter.cube(["inertia"])
    fitter.known["inertia",] = cube.to_points(np.array([[poor[p.name] for p in cube.params]]))[0]
    astray = judge("inertia", base, fitter.refit(["inertia"], [poor]), base)
    screened = {s.name: s for s in screen(fitter, base, EFFECTS)}
    other = next(try_out(fitter, base, [screened["quadratic-drag"]], base))
    winner, equals = duel(fitter, base, [astray, other], Verdict(base, base, base))
    assert astray.fit.chi("holdout") > 1.5 > 1.1 > winner.fit.chi("holdout")
    assert (winner.name, equals) == ("inertia", ())
