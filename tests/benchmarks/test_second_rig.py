"""Closed forms of the second rig, and what its scorer calls right."""

import numpy as np
import pytest

from benchmarks.second_rig.coil import Coil, drive_coil
from benchmarks.second_rig.contrast import unabsorbed
from benchmarks.second_rig.laws import LAWS, travel_memory
from benchmarks.second_rig.motions import FINE_RATE, WAVES, make_motion
from benchmarks.second_rig.page import page
from benchmarks.second_rig.physics import lag, remanence
from benchmarks.second_rig.score import score
from benchmarks.second_rig.specimen import make_specimen

TRUTH = {"accepted": [["current-lag", "inertia"]], "accepted_verdicts": [], "harmless": ["current-saturation"]}
NULL = {"accepted": [], "accepted_verdicts": ["none"], "harmless": []}


def test_a_coil_on_full_voltage_rises_exponentially_and_falls_through_its_diode() -> None:
    coil = Coil(resistance=5.0, inductance=0.05, supply=10.0, switching=1000.0, clamp=0.7, gain=1e4)
    t = np.arange(400) / FINE_RATE
    rising, _ = drive_coil(coil, np.where(t > 0, 50.0, 0.0))
    np.testing.assert_allclose(rising[8:], 2.0 * (1 - np.exp(-(t[8:] - 0.001) / 0.01)), atol=1e-9)
    falling, _ = drive_coil(coil, np.where(t > 0, 0.0, 1.5))
    late = t[:80]  # it is at the first command for one period; after it the diode takes the current down
    start = falling[8]
    np.testing.assert_allclose(falling[8:88], -0.14 + (start + 0.14) * np.exp(-late / 0.01), atol=1e-9)


def test_lag_of_a_step_is_exponential_behind_its_dead_time() -> None:
    step = np.where(np.arange(800) >= 80, 1.0, 0.0)
    late = lag(step, 0.02, 0.005)
    t = (np.arange(800) - 120 + 1) / FINE_RATE
    np.testing.assert_allclose(late, np.where(t > 0, 1 - np.exp(-t / 0.02), 0.0), atol=1e-12)


def test_remanence_stays_after_the_current_has_gone() -> None:
    up_and_down = np.concatenate([np.linspace(0, 2, 500), np.linspace(2, 0, 500)])
    assert remanence(up_and_down, 0.1)[-1] == pytest.approx(0.1)


def test_memories_of_travel_follow_their_closed_forms() -> None:
    x = np.linspace(0, 0.004, 4001)
    np.testing.assert_allclose(travel_memory(x, 0.001), 1 - np.exp(-x / 0.001), atol=1e-12)
    loop, _ = LAWS["boucwen"].parts(x, np.ones_like(x), {"n": 2.0, "b": 0.6, "d": 0.001})
    np.testing.assert_allclose(loop, np.tanh(x / 0.001), atol=1e-6)


@pytest.mark.parametrize("wave", WAVES)
def test_a_motion_has_its_own_derivatives_and_speed(wave: str) -> None:
    motion = make_motion(wave, np.random.default_rng(3), 4.0, 0.01, 0.2)
    travelled = np.cumsum((motion.v[1:] + motion.v[:-1]) / 2) / FINE_RATE
    np.testing.assert_allclose(motion.x[1:] - motion.x[0], travelled, atol=2e-5)
    assert 0.1 < np.quantile(np.abs(motion.v), 0.999) < 0.4


def test_what_a_column_makes_is_absorbed() -> None:
    rng = np.random.default_rng(0)
    columns, other = rng.standard_normal((500, 3)), rng.standard_normal(500)
    assert unabsorbed(columns, columns @ [1.0, -2.0, 3.0]) < 1e-12
    assert unabsorbed(columns, other) == pytest.approx(1.0, abs=0.1)


def test_a_case_is_always_the_same() -> None:
    first, again = make_specimen(1, "null", 0), make_specimen(1, "null", 0)
    assert first.truth == again.truth
    assert all(a.equals(b) for a, b in zip(first.logs, again.logs, strict=True))


@pytest.mark.parametrize(
    ("truth", "verdict", "names", "outcome"),
    [
        (TRUTH, "named", ["inertia", "current-lag"], "right"),
        (TRUTH, "named", ["inertia", "current-lag", "current-saturation"], "right"),
        (TRUTH, "named", ["inertia"], "open"),
        (TRUTH, "unexplained", [], "open"),
        (TRUTH, "named", ["inertia", "stribeck"], "wrong"),
        (NULL, "none", [], "right"),
        (NULL, "unexplained", [], "null-called"),
        (NULL, "named", ["delay"], "null-called"),
        (NULL, "insufficient-data", [], "open"),
    ],
)
def test_score(truth: dict[str, object], verdict: str, names: list[str], outcome: str) -> None:
    assert score(truth, {"verdict": verdict, "names": names}) == outcome


def test_the_page_of_a_campaign_counts_outcomes_nulls_and_long_cases() -> None:
    row = {"case": "a", "seed": 7, "kind": "valves", "hidden": {"relief": {"contrast": 3.0}}, "outcome": "right"}
    row |= {"base": "tanh", "waves": ["road"], "commands": ["constant"], "fault": "none", "processor_time": 10.0}
    rows = [row] * 3 + [row | {"outcome": "wrong", "case": "b", "processor_time": 70.0, "names": ["delay"]}]
    rows += [row | {"kind": "null", "hidden": {}, "outcome": "null-called", "processor_time": 80.0, "left_out": ["x"]}]
    text = page(rows, "0a1b2c3d", "Cases of this seed are fresh.")
    assert "commit\n0a1b2c3d. Cases of this seed are fresh.\n" in text
    assert "| right | ≥ 88 % | 60.0 % (3/5; 95 %: 14.7 to 94.7) |" in text
    assert "| wrong name | ≤ 1 % | 20.0 % (1/5;" in text and "| nulls called anything | ≤ 2 % | 100.0 % (1/1;" in text
    assert "| least of a kind: right | ≥ 75 % | 0 % (null) |" in text
    assert "10 s / 80 s" in text and "| – / none | 2 / 1 |" in text
    assert "- `b` wrong (tanh" in text and text.count("- `a`") == 1
