"""Limits of a command and the least root of a parabola, by their equations; what a flag says of a force."""

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mrfit.apply.damper import Damper, damper
from mrfit.apply.inverse import Inverter, is_explicit, pieces_of, prompt
from mrfit.apply.solving import CommandLimits, Inverse, _least_root, allowed
from mrfit.apply.stepper import Stepper
from mrfit.settings.apply import Amplifier
from tests.apply.dampers import controllable, monotone, paper_tanh

NONE = float("nan")


def python(kernel: Any) -> Any:
    """Return a compiled function as it is written."""
    return kernel.py_func


def ends(before: float, dt: float, **limits: float) -> tuple[float, float]:
    known = dict.fromkeys(("rate", "voltage", "resistance", "inductance"), NONE) | limits
    found: tuple[float, float] = python(allowed)(
        Inverse(np.zeros(3), 3, True, False, CommandLimits(0.0, 2.0, **known)), before, dt
    )
    return found


def test_a_command_keeps_its_range_its_rate_and_its_voltage() -> None:
    assert ends(1.0, 0.01) == (0.0, 2.0)
    assert ends(1.0, 0.01, rate=5.0) == (pytest.approx(0.95), pytest.approx(1.05))
    # within 0.05 A of an end that end holds
    assert ends(1.98, 0.01, rate=5.0) == (pytest.approx(1.93), 2.0)
    # L*di/dt = u - R*i: of 12 V and 5 ohm at 1 A 7 V are left to rise, 17 V to fall
    coil = {"voltage": 12.0, "resistance": 5.0, "inductance": 2.0}
    assert ends(1.0, 0.01, **coil) == (pytest.approx(1.0 - 0.085), pytest.approx(1.0 + 0.035))
    assert ends(1.0, 0.01, rate=5.0, **coil) == (pytest.approx(0.95), pytest.approx(1.035))


def test_a_command_above_its_limit_falls_as_fast_as_it_can() -> None:
    low, high = ends(3.0, 0.01, rate=5.0)
    # it may neither stay nor go to 2 A at once
    assert low == 2.0 and high == pytest.approx(2.95)


@given(st.floats(-5.0, 5.0), st.floats(0.01, 5.0), st.sampled_from([-1.0, 1.0]), st.floats(-2.0, 2.0))
def test_the_least_root_is_the_first_crossing_in_the_unit_interval(
    slope: float, size: float, sign: float, rest: float
) -> None:
    bend = sign * size
    # a curve that touches zero and turns may have a root or none, by rounding
    assume(abs(slope**2 - 4.0 * bend * rest) > 1e-6 and abs(rest) > 1e-9)
    found = python(_least_root)(*map(np.float64, (bend, slope, rest)))
    grid = np.linspace(0.0, 1.0, 4001)
    curve = (bend * grid + slope) * grid + rest
    crossing = np.flatnonzero(np.sign(curve[1:]) != np.sign(curve[:-1]))
    if np.isfinite(found):
        assert 0.0 <= found <= 1.0 and abs((bend * found + slope) * found + rest) < 1e-6
    if len(crossing):
        assert found <= grid[crossing[0] + 1] + 1e-9


def test_a_force_that_is_linear_in_current_has_one_root() -> None:
    with np.errstate(divide="ignore", invalid="ignore"):
        assert python(_least_root)(np.float64(0.0), np.float64(-4.0), np.float64(1.0)) == 0.25
        assert python(_least_root)(np.float64(0.0), np.float64(4.0), np.float64(-1.0)) == 0.25
        assert np.isnan(python(_least_root)(np.float64(0.0), np.float64(-4.0), np.float64(5.0)))


def test_pieces_of_a_range_meet_at_its_breaks_and_a_break_is_of_the_piece_below() -> None:
    (low, middle), (other, high) = pieces_of(paper_tanh())
    assert (low, middle, high) == (0.0, 0.2, 1.0) and other == np.nextafter(0.2, 1.0)
    assert pieces_of(monotone()) == [(0.0, 1.0)]


def with_order(order: int | str) -> Damper:
    """Return a tanh-like damper whose yield force has an order in current."""
    levels = (0.0, 0.5, 1.0) if order != 3 else (0.0, 0.3333, 0.6667, 1.0)
    values = {f"fy@{i:g}A": 100.0 + 400.0 * i for i in levels}
    return damper("tanh", {**values, "a1": 80.0, "a2": 60.0, "c": 900.0, "k": 270.0, "f0": 0.0}, {"fy": order})


@pytest.mark.parametrize(
    ("one", "explicit"),
    [
        (monotone(), True),
        (paper_tanh(), True),
        # a knee enters the force otherwise than linearly; a logarithm is no polynomial
        (controllable("tanh"), False),
        (with_order("log2"), False),
        (with_order(2), True),
        (with_order(3), False),
        (controllable("hammerstein-wiener"), False),
    ],
)  # fmt: skip
def test_a_force_is_a_polynomial_of_current_where_all_that_depends_on_it_enters_linearly(
    one: Damper, explicit: bool
) -> None:
    assert is_explicit(one) == explicit
    inverter = Inverter(Stepper(one))
    assert inverter.explicit == explicit and inverter.inverse.points == (3 if explicit else 17)
    assert len(inverter.inverse.grid) == inverter.inverse.points * len(pieces_of(one))


def test_limits_of_an_amplifier_stand_over_those_of_the_tests() -> None:
    limits = Inverter(Stepper(monotone()), Amplifier(most=1.5, least=-0.25, rate=3.0)).inverse.limits
    assert (limits.low, limits.high, limits.rate) == (-0.25, 1.5, 3.0) and np.isnan(limits.voltage)
    limits = Inverter(Stepper(monotone())).inverse.limits
    assert (limits.low, limits.high) == (0.0, 1.2) and np.isnan(limits.rate)


def test_dead_times_before_the_field_are_taken_out_and_added_up() -> None:
    late = monotone("tanh+current-lag+current-filter", **{"current-lag.t_d": 0.004, "current-filter.tau": 0.003})
    bare, dead = prompt(late)
    assert dead == pytest.approx(0.007)
    named = dict(bare.parameters)
    assert named["current-lag.t_d"] == named["current-filter.tau"] == 0.0 and bare.model == late.model
    kept = {n: v for n, v in late.parameters if n not in ("current-lag.t_d", "current-filter.tau")}
    assert {n: named[n] for n in kept} == kept
    assert prompt(monotone()) == (monotone(), 0.0)


@pytest.mark.parametrize(("field", "sent"), [(-0.4, 0.0), (0.3, 0.3), (1.4, 1.2)])
def test_without_a_lag_the_command_is_the_field_within_its_limits(field: float, sent: float) -> None:
    stepper = Stepper(monotone())
    given = {"displacement": np.zeros(1), "velocity": np.zeros(1), "current": np.zeros(1)}
    found = Inverter(stepper).command(stepper.rest(given), given, 1e-3, np.array([field]))
    assert found[0] == pytest.approx(sent)


def test_with_a_lag_the_command_leads_the_field_or_is_the_nearest() -> None:
    tau, dt = 0.02, 0.004
    stepper = Stepper(monotone("tanh+current-lag", **{"current-lag.tau": tau}))
    given = {"displacement": np.zeros(3), "velocity": np.zeros(3), "current": np.full(3, 0.5)}
    wanted = np.array([0.55, 0.9, 0.1])
    found = Inverter(stepper).command(stepper.rest(given), given, dt, wanted)
    # a first-order lag under a held command: field = command + (0.5 - command)*exp(-dt/tau)
    kept = np.exp(-dt / tau)
    lead = (wanted - 0.5 * kept) / (1.0 - kept)
    np.testing.assert_allclose(found, np.clip(lead, 0.0, 1.2), atol=1e-9)
    assert lead[1] > 1.2 and lead[2] < 0.0 < lead[0] < 1.2
