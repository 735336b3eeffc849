"""Tracking: exact where nothing stands in the way, and each thing that does has the error it must have."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.apply.calls import track
from mrfit.apply.laws import law_of
from mrfit.apply.motion import sine
from mrfit.apply.series import inversion
from mrfit.apply.stepper import Stepper, simulate
from mrfit.apply.tracking import SCHEMES, TrackingCase, regions
from mrfit.core import registry
from mrfit.errors import ConfigError
from tests.apply.dampers import monotone, paper_tanh

MOTION = sine(1.0, 0.01, 1.0, 2e-3)


def one(cases: tuple[TrackingCase, ...], scheme: str, lag: bool = True) -> TrackingCase:
    return next(c for c in cases if c.scheme == scheme and c.lag is lag)


def test_without_lag_the_feasible_force_is_given_exactly() -> None:
    study = track(monotone(), MOTION, ["c=1e4", "k=-1e5,c=1e4"], ["feedforward"])
    for case in study.cases:
        np.testing.assert_allclose(case.force, case.feasible, atol=1e-8)
        assert case.error < 1e-10 and case.err_energy < 1e-10
        # eq. 10: the damper does not push beyond what it has at its least current
        pushing = case.desired * case.velocity < -1e-9
        assert np.all(case.command[pushing] == 0.0)
    assert study.lag_costs == []


def test_a_lag_costs_what_its_inverse_gets_back() -> None:
    damper = paper_tanh(**{"current-lag.tau": 0.02})
    study = track(damper, MOTION, ["k=5e4,c=1e4"], SCHEMES)
    inverted, plain, feedback = (one(study.cases, n).error for n in ("feedforward", "uninverted", "feedback"))
    assert inverted < 0.7 * plain and inverted < feedback
    without = one(study.cases, "uninverted", lag=False).error
    assert without < 1e-9 < plain
    assert {(r.scheme, round(r.error, 12)) for r in study.lag_costs} >= {("uninverted", round(plain, 12))}
    assert one(study.cases, "feedforward").command.max() == pytest.approx(1.2), "1.2 of the greatest current"


def test_feedback_helps_where_the_plant_is_another() -> None:
    damper = monotone("tanh+current-lag", **{"current-lag.tau": 0.01})
    weak = monotone("tanh+current-lag", **{"current-lag.tau": 0.01, "fy@1A": 650.0, "c@1A": 3000.0})
    study = track(damper, MOTION, "c=1e4", ["feedforward", "both"], plant=weak)
    # against the force that the model makes of the desired one
    assert one(study.cases, "both").error < 0.8 * one(study.cases, "feedforward").error


def test_a_dead_time_is_foreseen() -> None:
    late = monotone("tanh+current-lag", **{"current-lag.t_d": 0.01})
    study = track(late, MOTION, "c=1e4", ["feedforward"])
    assert one(study.cases, "feedforward").error < 1e-6


def test_errors_are_those_of_the_papers_equations() -> None:
    t = np.linspace(0.0, 1.0, 1001)
    v, force = np.cos(2 * np.pi * t), 100.0 * np.cos(2 * np.pi * t)
    case = TrackingCase("m", "l", "s", True, t, force, 0.9 * force, force, t, t, t, np.where(t < 0.5, 1.0, 2.0), v)
    kept = t >= 0.1
    size = np.sqrt(np.mean(force[kept] ** 2))
    assert case.error == pytest.approx(0.1)
    assert case.err_peak == pytest.approx(0.1 * size / 100.0)  # eq. 12
    assert case.err_energy == pytest.approx(0.1)  # eq. 13
    total = sum(r.error**2 for r in case.regions if r.share)
    assert total == pytest.approx(case.error**2), "the paper's regions add up to the whole"
    assert sum(r.share for r in case.regions) == pytest.approx(1.0)


def test_a_step_between_the_ends_is_region_three_until_the_force_has_come() -> None:
    wanted = np.concatenate([np.full(10, 0.4), np.zeros(5), np.ones(35)])
    saturated = np.concatenate([np.zeros(10, dtype=bool), np.ones(40, dtype=bool)])
    feasible = np.where(wanted > 0.5, 100.0, 20.0)
    force = feasible - 80.0 * (wanted > 0.5) * np.exp(-(np.arange(50) - 15.0) / 5.0)
    region = regions(wanted, saturated, force, feasible)
    assert set(region[:10]) == {2.0} and set(region[10:15]) == {1.0}
    reached = 15 + int(np.ceil(5.0 * np.log(80.0 / 5.0)))
    assert set(region[15:reached]) == {3.0} and set(region[reached:]) == {1.0}


@settings(max_examples=30, deadline=None)
@given(st.floats(-1e5, 1e5), st.floats(0.0, 1e5))
def test_laws_are_their_written_form(k: float, c: float) -> None:
    x, v = np.array([0.01, -0.02]), np.array([0.1, 0.3])
    np.testing.assert_allclose(law_of(f"k={k!r},c={c!r}").force(x, v), k * x + c * v)
    body = v + np.array([-0.3, 0.1])
    sky = law_of(f"skyhook={c!r}").force(x, v, np.array([-0.3, 0.1]))
    np.testing.assert_allclose(sky, np.where(body * v > 0, c * body, 0.0))


@pytest.mark.parametrize("text", ["", "c", "k=1", "c=x", "c=1,skyhook=2", "q=3", "c=inf"])
def test_what_is_no_law_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="--law takes"):
        law_of(text)


BEHIND = {
    "delay": {"delay.tau": 0.01, "delay.s": 0.4},
    "force-filter": {"force-filter.T": 0.01},
}


@pytest.mark.parametrize("effect", BEHIND)
def test_what_lies_behind_the_force_is_inverted_where_the_desired_one_is_known_ahead(effect: str) -> None:
    late, prompt_one = monotone(f"tanh+{effect}", **BEHIND[effect]), monotone()
    x, v, _ = late.motion
    desired = law_of("c=1e4").force(MOTION.channels[x], MOTION.channels[v])
    found = inversion(late, MOTION.channels, desired, MOTION.dt)
    assert found.behind == (effect,) and found.dead_time == 0.0
    # the true errors: of the whole model under the commands
    force = simulate(Stepper(late), {**MOTION.channels, "current": found.current}, MOTION.dt)
    np.testing.assert_allclose(found.force[found.free], force[found.free], rtol=1e-3)
    assert found.free.mean() > 0.3
    assert found.summary.greatest_error_where_reached < 1e-4 * np.ptp(desired)
    # the command of the damper without it, sent to this one
    plain = inversion(prompt_one, MOTION.channels, desired, MOTION.dt)
    under = simulate(Stepper(late), {**MOTION.channels, "current": plain.current}, MOTION.dt)
    assert np.abs(under - desired)[found.free].max() > 0.02 * np.ptp(desired)


@pytest.mark.parametrize("effect", BEHIND)
def test_tracking_makes_up_for_what_lies_behind_the_force(effect: str) -> None:
    late = monotone(f"tanh+{effect}", **BEHIND[effect])
    inverted, uninverted = (c.error for c in track(late, MOTION, "c=1e4", ["feedforward", "uninverted"]).cases)
    assert inverted < 0.8 * uninverted


def test_a_record_that_is_early_counts_as_on_time() -> None:
    early = monotone("tanh+delay", **{"delay.tau": -0.01})
    assert track(early, MOTION, "c=1e4", ["feedforward"]).cases[0].error < 1e-9


@settings(max_examples=20, deadline=None)
@given(st.floats(0.0, 0.03), st.floats(0.002, 0.03), st.floats(0.1, 1.0), st.floats(0.2, 2.0))
def test_what_lies_behind_a_force_is_undone_for_smooth_ones(dead: float, tau: float, share: float, xi: float) -> None:
    dt = 5e-4
    t = dt * np.arange(1500)
    wanted = 300.0 * np.sin(2 * np.pi * 2.0 * t) + 100.0 * np.cos(2 * np.pi * 3.1 * t)
    late = {"delay.tau": dead + tau, "delay.s": tau / (dead + tau), "force-filter.T": tau, "force-filter.xi": xi}
    stepper = Stepper(monotone("tanh+delay+force-filter", **late, **{"force-filter.r_2": share}), shortest=dt)
    before = stepper.undone(wanted[None], dt)[0]
    got = before[None]
    for name, theta in (("delay", [dead + tau, tau / (dead + tau)]), ("force-filter", [])):
        module = registry.load("effect", name)
        own = np.array([theta or [late.get(f"{name}.{p.name}", p.start) for p in module.SPEC.params]])
        if name == "force-filter":
            own[0, 1] = share
        if name == "delay":
            ago = np.interp(t - dead, t, got[0])[None]
            got = module.shape(ago, {}, own, dt)
        else:
            got = module.shape(got, {}, own, dt)
    # a record's end is not known ahead
    settled = (t > min(0.6, stepper.lasting)) & (t < t[-1] - dead)
    assert np.abs(got[0] - wanted)[settled].max() < 2e-3 * np.ptp(wanted)
