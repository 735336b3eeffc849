"""Rivals on data: thinned samples keep their sums of squares, draws stay within the bounds and about the optimum."""

import numpy as np
import pytest

from mrfit.advise import standing
from mrfit.advise.rivals import NO_MORE_RIVALS, Rival
from mrfit.advise.stage import bench_of
from mrfit.api.preparing import as_asked, prepared
from mrfit.core.progress import silent
from mrfit.discover.evidence.bench import Bench
from tests.advise.lab import MASS, MODEL, NOISE, one_frequency


@pytest.fixture(scope="module")
def bench() -> Bench:
    logs = one_frequency({"inertia": MASS}, np.random.default_rng(21))
    return bench_of(prepared(logs, as_asked({}), silent).dataset, MODEL)


def fitted(bench: Bench, *rivals: Rival) -> list[standing.FittedRival]:
    return standing.fitted(bench, standing.RivalModel(MODEL, None, {}, 0), rivals, silent)


def test_a_rival_fits_to_the_noise_and_has_its_value(bench):
    base, mass = fitted(bench, Rival(NO_MORE_RIVALS, ()), Rival("inertia", ("inertia",)))
    assert mass.values["inertia.m"] == pytest.approx(MASS, rel=0.05)
    assert mass.chi == pytest.approx(1.0, abs=0.15) and base.chi > 5.0
    assert bench.of_role("train")[0].floor == pytest.approx(NOISE, rel=0.2)


def test_thinned_data_weigh_as_much(bench, monkeypatch):
    (whole,) = fitted(bench, Rival("inertia", ("inertia",)))
    monkeypatch.setattr(standing, "RIVAL_SAMPLES", 700)
    (thin,) = fitted(bench, Rival("inertia", ("inertia",)))
    assert len(thin.errors) < 0.3 * len(whole.errors)
    assert thin.chi == pytest.approx(whole.chi, rel=0.1)
    power = [np.diag(s.jacobian.T @ s.jacobian) for s in (whole, thin)]
    assert power[1] == pytest.approx(power[0], rel=0.1)


def test_draws_scatter_as_the_data_say_and_stay_within_the_bounds(bench):
    (mass,) = fitted(bench, Rival("inertia", ("inertia",)))
    drawn = mass.draws(400, np.random.default_rng(0))
    assert drawn[0] == pytest.approx(mass.point)
    assert drawn.min() >= 0.0 and drawn.max() <= 1.0
    information = mass.jacobian.T @ mass.jacobian / max(mass.chi, 1.0) ** 2 + np.diag(mass.prior**-2)
    assert drawn[1:].std(axis=0) == pytest.approx(np.sqrt(np.diag(np.linalg.inv(information))), rel=0.15)


def test_a_hidden_effect_is_taken_to_make_a_small_force(bench):
    base, hidden = fitted(bench, Rival(NO_MORE_RIVALS, ()), Rival("delay", ("delay",), hidden=True))
    at = [hidden.cube.params[k].name for k in hidden.cube.free].index("delay.tau")
    made = hidden.prior[at] * float(np.sqrt(np.mean(hidden.jacobian[:, at] ** 2)))
    assert made <= standing.HIDDEN_SHARE * bench.span / NOISE * 1.3
    assert hidden.errors == pytest.approx(base.errors, abs=1e-6)
