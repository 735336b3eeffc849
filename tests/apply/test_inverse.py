"""The current for a force: exact where it can be reached, nearest and flagged where not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.apply.damper import damper
from mrfit.apply.inverse import ABOVE, BELOW, BETWEEN, REACHED, Amplifier, Inverter, is_explicit, prompt
from mrfit.apply.laws import law_of
from mrfit.apply.motion import sine
from mrfit.apply.series import inversion
from mrfit.apply.stage import notes_of
from mrfit.apply.stepper import Stepper, simulate
from mrfit.core import registry
from mrfit.errors import ConfigError
from tests.apply.dampers import MODELS, STEP, controllable, monotone, paper_tanh, wandered


def check_exact(name: str, lanes: int, seed: int) -> None:
    stepper = Stepper(paper_tanh() if name == "004" else controllable(name))
    state, following = wandered(stepper, np.random.default_rng(seed), lanes)
    forces = stepper.inner(state, following, STEP, following["current"])
    found = Inverter(stepper).solve(state, following, STEP, forces)
    assert np.all(found.flag == REACHED)
    again = stepper.inner(state, following, STEP, found.field)
    size = np.maximum(np.abs(forces), 1.0)
    assert np.max(np.abs(again - forces) / size) < 1e-9
    if is_explicit(stepper.damper):
        assert np.all(found.field <= following["current"] + 1e-6), "of several currents the least"


@pytest.mark.parametrize("name", [*MODELS, "004"])
def test_the_current_gives_the_force_again(name: str) -> None:
    check_exact(name, 150 if name in ("spencer", "lugre", "boucwen") else 1000, 1)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*MODELS, "004"])
def test_the_current_gives_the_force_again_in_ten_thousand_states(name: str) -> None:
    check_exact(name, 10_000, 2)


def test_the_papers_model_is_inverted_in_closed_form() -> None:
    one = paper_tanh()
    assert is_explicit(one)
    v, x = np.full(3, 0.05), np.full(3, 0.002)
    # by hand, above 0.2 A: 004 Table 3 in N and mm
    arm = np.tanh(0.075 * 50.0 + 0.08 * 2.0)
    square = -719.6 * arm + 0.1429 * 50.0 + 16.28
    line = 1817.0 * arm + 2.669 * 50.0 - 29.55
    rest = -135.7 * arm + 0.84 * 50.0 + 0.27 * 2.0 - 11.67
    currents = np.array([0.3, 0.55, 0.9])
    forces = square * currents**2 + line * currents + rest
    stepper = Stepper(one)
    given = {"displacement": x, "velocity": v, "current": np.zeros(3)}
    found = Inverter(stepper).solve(stepper.rest(given), given, STEP, forces)
    np.testing.assert_allclose(found.field, currents, rtol=1e-9)
    assert not is_explicit(controllable("guo")), "its knee depends on current"


def test_a_force_out_of_reach_is_flagged_and_answered_by_the_nearest() -> None:
    stepper = Stepper(monotone())
    given = {"displacement": np.zeros(4), "velocity": np.full(4, 0.05), "current": np.zeros(4)}
    forces = np.array([1e5, -500.0, 400.0, np.nan_to_num(50.0)])
    found = Inverter(stepper).solve(stepper.rest(given), given, STEP, forces)
    assert list(found.flag) == [ABOVE, BELOW, REACHED, BELOW]
    np.testing.assert_allclose(found.field[[0, 1, 3]], [1.0, 0.0, 0.0])
    np.testing.assert_allclose(found.force[:2], [found.high[0], found.low[0]])


def test_a_force_in_the_gap_of_a_jump_is_flagged() -> None:
    stepper = Stepper(paper_tanh())
    given = {"displacement": np.zeros(1), "velocity": np.full(1, 0.01), "current": np.zeros(1)}
    state = stepper.rest(given)
    below, above = (float(stepper.inner(state, given, STEP, np.array([i]))[0]) for i in (0.2, 0.2 + 1e-12))
    assert abs(above - below) > 1.0
    found = Inverter(stepper).solve(state, given, STEP, np.array([0.5 * (below + above)]))
    inside = found.flag[0] == REACHED  # where the pieces overlap in force, another current gives it
    assert inside == (above < below) and (inside or (found.flag[0] == BETWEEN and abs(found.field[0] - 0.2) < 1e-9))


@pytest.mark.parametrize(("least", "fits"), [(2.39, True), (2.41, False)])
def test_a_least_command_above_the_greatest_is_refused(least: float, fits: bool) -> None:
    stepper = Stepper(paper_tanh())
    amplifier = Amplifier(least=least * stepper.damper.high / 2.0)
    if fits:
        assert Inverter(stepper, amplifier).inverse is not None
        return
    with pytest.raises(ConfigError, match="--least .* lies above the greatest command"):
        Inverter(stepper, amplifier)


def test_of_a_force_that_falls_again_with_current_the_least_current_is_taken() -> None:
    # yield force 100, 500, 100 N at 0, 0.5, 1 A: every force below the peak is given twice
    values = {"fy@0A": 100.0, "fy@0.5A": 500.0, "fy@1A": 100.0, "a1": 80.0, "a2": 0.0, "c": 100.0, "k": 0.0, "f0": 0.0}
    for one in (damper("tanh", values, {"fy": 2}), damper("tanh", values, {"fy": "log2"})):
        stepper = Stepper(one)
        given = {"displacement": np.zeros(2), "velocity": np.full(2, 0.1), "current": np.zeros(2)}
        state = stepper.rest(given)
        forces = stepper.inner(state, given, STEP, np.array([0.8, 0.51]))
        found = Inverter(stepper).solve(state, given, STEP, forces)
        np.testing.assert_allclose(found.field, [0.2, 0.49], atol=1e-7)
        np.testing.assert_allclose(found.high, 510.0, rtol=1e-6)


@settings(max_examples=8, deadline=None)
@given(st.floats(0.002, 0.05), st.floats(0.0, 0.004), st.floats(2e3, 3e4), st.floats(-5e4, 5e4))
def test_the_lag_of_the_field_is_made_up_for(tau: float, dead: float, c: float, k: float) -> None:
    one = monotone("tanh+current-lag", **{"current-lag.tau": tau, "current-lag.t_d": dead})
    motion = sine(1.0, 0.01, 0.5)
    found = inversion(
        one, motion.channels, law_of(f"c={c},k={k}").force(*list(motion.channels.values())[:2]), motion.dt
    )
    free = ~found.limited
    np.testing.assert_allclose(found.field[free], found.wanted[free], atol=1e-8)
    assert found.dead_time == prompt(one)[1] == dead
    assert found.current.max() <= 1.2 + 1e-12
    # the command by the lag's own equation, d(field)/dt = (command - field)/tau, without its dead time
    late = round(dead / motion.dt)
    said = " ".join(notes_of(found))
    assert (f"sent {1e3 * late * motion.dt:.3g} ms early" in said) == (late > 0)
    assert ("No command is sent early" in said) == (0.0 < dead and late == 0)
    kept, field = np.exp(-motion.dt / tau), found.field[late]
    for n in range(late + 1, motion.samples):
        field = found.current[n - late] + kept * (field - found.current[n - late])
        assert abs(field - found.field[n]) < 1e-8


def test_rate_and_voltage_hold_the_command_back() -> None:
    one, motion = monotone("tanh+current-lag", **{"current-lag.tau": 0.02}), sine(1.0, 0.01, 1.0)
    forces = law_of("c=1e4,k=-5e4").force(motion.channels["displacement"], motion.channels["velocity"])
    rms = {}
    for name, amplifier in {
        "free": Amplifier(),
        "rate": Amplifier(rate=5.0),
        "voltage": Amplifier(voltage=12.0, resistance=5.0, inductance=0.5),
        "drawn back": Amplifier(least=-1.0),
    }.items():
        found = inversion(one, motion.channels, forces, motion.dt, amplifier)
        steps = np.diff(found.current) / motion.dt
        rms[name] = found.summary.rms_error
        if name == "rate":
            assert np.max(np.abs(steps)) <= 5.0 + 1e-9
        if name == "voltage":
            volts = 5.0 * found.current[:-1] + 0.5 * steps
            assert np.max(np.abs(volts)) <= 12.0 + 1e-6
    assert rms["drawn back"] < rms["free"] < rms["voltage"] and rms["free"] < rms["rate"]
    with pytest.raises(ConfigError, match="inductance"):
        Amplifier(voltage=12.0)


def test_with_memory_a_series_is_followed_exactly() -> None:
    values = {p.name: p.start for p in registry.load("model", "boucwen").SPEC.params if p.name not in ("alpha", "c")}
    ends = {"alpha@0A": 100.0, "alpha@1A": 900.0, "c@0A": 300.0, "c@1A": 900.0}
    one, motion = damper("boucwen", {**values, **ends}, {"alpha": 1, "c": 1}), sine(1.0, 0.01, 0.5)
    current = 0.5 + 0.3 * np.sin(2 * np.pi * 3 * motion.time)
    forces = simulate(Stepper(one), {**motion.channels, "current": current}, motion.dt)
    found = inversion(one, motion.channels, forces, motion.dt)
    # of velocity 0 and no deflection no current is told by its force
    np.testing.assert_allclose(found.current[5:-5], current[5:-5], atol=1e-6)
    assert found.explicit and np.all(found.flag == REACHED)
    np.testing.assert_allclose(found.force, forces, atol=1e-9 * np.ptp(forces))
