"""What a log does not allow is said with its reason: steps of the current, energies and bilinear loops."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.measure.bilinear import PEAKS, by_peaks
from mrfit.measure.current_steps import RESPONSES, quantities
from mrfit.measure.quantity import Quantity

DT, RATE = 1e-3, 1000
LAG, SPEED = 0.02, 0.1


def answering(times: tuple[float, ...], seconds: float = 6.0, noise: float = 0.5) -> tuple[Array, Array]:
    """Return a current that is switched at times and a force that follows it as a first-order lag."""
    time = DT * np.arange(int(seconds * RATE))
    current, force = np.zeros(len(time)), np.full(len(time), 200.0)
    for number, begun in enumerate(times):
        up = number % 2 == 0
        current[time >= begun] = 1.0 if up else 0.0
        since = np.maximum(time - begun, 0.0)
        force += (400.0 if up else -400.0) * np.where(time >= begun, 1.0 - np.exp(-since / LAG), 0.0)
    return current, force + noise * np.random.default_rng(1).standard_normal(len(time))


def answers(current: Array, force: Array, velocity: Array | None = None) -> dict[str, Quantity]:
    speed = np.full(len(current), SPEED) if velocity is None else velocity
    return {q.name: q for q in quantities(current, force, speed, DT)}


def test_a_first_order_lag_is_found_up_and_down_by_its_time_constant() -> None:
    found = answers(*answering((2.0, 4.0)))
    for way in ("up", "down"):
        for name, expected in ((f"t63 {way}", LAG), (f"t90 {way}", LAG * np.log(10.0)), (f"dead time {way}", 0.0)):
            one = found[name].estimate
            assert one is not None and one.value == pytest.approx(expected, abs=2.5e-3), name


def test_of_one_way_alone_the_other_has_a_reason() -> None:
    found = answers(*answering((3.0,)))
    assert found["t63 up"].estimate and found["t63 down"].estimate is None
    assert found["t63 down"].reason == "no step to which the force answers and comes to rest"


def test_a_force_that_does_not_answer_is_no_response() -> None:
    current, _ = answering((3.0,))
    force = 200.0 + np.random.default_rng(1).standard_normal(len(current))
    assert all(q.estimate is None for q in answers(current, force).values())


def test_a_force_that_has_not_come_to_rest_is_no_response() -> None:
    current, force = answering((3.0,))
    drifting = force + np.where(current > 0.0, 300.0 * np.linspace(-1.0, 1.0, len(current)), 0.0)
    assert all(q.estimate is None for q in answers(current, drifting).values())


def test_a_current_that_never_rests_has_no_step_that_holds() -> None:
    rng = np.random.default_rng(2)
    current = np.repeat(rng.permutation(np.arange(300.0)), 3)
    found = answers(current, np.zeros(len(current)))
    assert {q.reason for q in found.values()} == {"no step of the current that holds before and after"}
    assert {q.name for q in found.values()} == {*RESPONSES}


def test_a_speed_that_changes_with_the_step_is_told() -> None:
    current, force = answering((3.0,))
    velocity = SPEED * np.where(np.arange(len(current)) % 8 < 4, 1.0, -1.0)
    assert "the speed does not hold" in answers(current, force, velocity)["t63 up"].reason


STIFF, SOFT, YIELD = 1e6, 2e5, 1e-3


def loading(amplitudes: tuple[float, ...]) -> tuple[Array, Array, Array]:
    """Return displacement, force and reversals of a bilinear element under growing cycles from rest on."""
    corners = [0.0, *(a * s for a in amplitudes for s in (1.0, -1.0)), 0.0]
    parts = [np.linspace(a, b, 200, endpoint=False) for a, b in zip(corners, corners[1:], strict=False)]
    x = np.concatenate(parts)
    slip, hysteretic, force = (STIFF - SOFT) * YIELD, 0.0, np.zeros(len(x))
    for k in range(1, len(x)):
        hysteretic = float(np.clip(hysteretic + (STIFF - SOFT) * (x[k] - x[k - 1]), -slip, slip))
        force[k] = SOFT * x[k] + hysteretic
    return x, force, 200 * np.arange(1, len(corners) - 1)


def peaks(*record: Array) -> dict[str, Quantity]:
    return {q.name: q for q in by_peaks(*record)}


def test_both_slopes_and_the_yield_of_a_bilinear_element_are_found_from_its_peaks() -> None:
    found = peaks(*loading((0.004, 0.006, 0.008, 0.01)))
    values = [q.estimate.value for q in found.values() if q.estimate]
    assert values == pytest.approx([STIFF, SOFT, STIFF * YIELD, YIELD], rel=1e-3)


@pytest.mark.parametrize(
    ("amplitudes", "changed", "reason"),
    [
        ((0.01,), 1.0, "reversals of growing amplitude"),
        ((0.01, 0.01, 0.01), 1.0, "reversals of growing amplitude"),
        ((0.0002, 0.0004, 0.0006, 0.0008), 1.0, "do not lie on a line flatter"),
        ((0.004, 0.006, 0.008, 0.01), -1.0, "do not lie on a line flatter"),
    ],
    ids=["one amplitude", "no growth", "elastic", "negative"],
)
def test_what_is_no_bilinear_loading_has_a_reason(amplitudes: tuple[float, ...], changed: float, reason: str) -> None:
    x, force, turns = loading(amplitudes)
    found = peaks(x, np.abs(force) * changed if changed < 0.0 else force, turns)
    assert {*found} == {*PEAKS} and all(q.estimate is None and reason in q.reason for q in found.values())


def test_too_few_samples_of_the_initial_loading_are_told() -> None:
    x, force, turns = loading((0.004, 0.006, 0.008, 0.01))
    keep = np.r_[0, 199 : len(x)]
    found = peaks(x[keep], force[keep], turns - 198)
    assert all("too few samples of the initial loading" in q.reason for q in found.values())
