"""Quantities of whole cycles against closed forms: without noise, with it, at few samples a cycle, with a skew."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.rig.closed_forms import KINDS, Rig
from mrfit.errors import DataError
from mrfit.measure.cycles import cycles_of
from mrfit.measure.forces import forces_of
from mrfit.segment.stage import Settings, cut
from tests.measure.rigs import cycles, known, of_rig, quantities, recording

FORCES = ("F0+", "F0-", "Fd+", "Fd-", "Fmax+", "Fmax-", "width+", "width-")


def scale(rig: Rig, name: str) -> float:
    truth = rig.truth()
    if name in FORCES:
        return max(abs(truth["Fmax+"]), abs(truth["Fmax-"]))
    sizes = {"width v": rig.speed, "free travel": rig.amplitude, "K_eff": truth["Fmax+"] / rig.amplitude}
    return sizes.get(name, abs(truth[name]))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("frequency", "rate"), [(0.5, 200.0), (1.0, 1000.0)])
def test_closed_forms_are_met_within_two_permille(kind: str, frequency: float, rate: float) -> None:
    rig = Rig(kind, frequency, rate, noise=1e-5, seed=3)
    found = known(quantities(cycles(of_rig(rig))))
    for name, truth in rig.truth().items():
        # between two samples nothing is known of a jump
        coarse = name in ("width v", "free travel") or (name == "K_0" and rig.rate / rig.frequency < 1000)
        allowed = 0.01 if coarse else 2e-3
        if name in found:
            assert abs(found[name].value - truth) <= allowed * scale(rig, name), name
        else:
            assert name == "xi_eff" or kind == "bilinear", name
    assert ("F_y" in found) == (kind == "bilinear")


@pytest.mark.parametrize("drift", [pytest.param(0.0, marks=pytest.mark.slow), 0.01])
def test_intervals_hold_the_truth(drift: float) -> None:
    held = []
    for seed in range(15):
        # the peak of the one is flat, that of the other is not
        rig = Rig(("alpha", "gas")[seed % 2], 2.0, 500.0, noise=0.005, drift=drift, seed=100 + seed)
        found, truth = known(quantities(cycles(of_rig(rig)))), rig.truth()
        held += [found[n].low <= truth[n] <= found[n].high for n in ("F0+", "F0-", "Fd+", "Fmax+", "E", "efficiency")]
    # 90 of them, correlated: 95 % less three standard deviations
    assert np.mean(held) >= 0.86


def test_twenty_samples_a_cycle_are_read_or_told_to_be_few() -> None:
    rig = Rig("viscous", 10.0, 200.0, noise=1e-4)
    found, truth = known(quantities(cycles(of_rig(rig)))), rig.truth()
    for name in ("F0+", "F0-", "Fmax+", "E", "C_eq"):
        assert found[name].value == pytest.approx(truth[name], rel=2e-3)
    # a corner beside the reversal is not told from a jump at it by so few samples, and widens the interval of more
    rough = {rate: quantities(cycles(of_rig(Rig("bilinear", 10.0, rate, noise=1e-3)))) for rate in (200.0, 480.0)}
    assert all("32 are needed" in rough[200.0][name].reason for name in ("Fd+", "Fd-", "K_eff", "xi_eff"))
    truth = Rig("bilinear", 10.0, 480.0).truth()
    held = known(rough[480.0])
    assert all(held[name].low <= truth[name] <= held[name].high for name in ("Fd+", "K_eff", "E"))


def test_peaks_are_those_of_the_central_part_of_the_stroke() -> None:
    time = np.arange(4000) / 500.0
    moved, speed = 0.02 * np.sin(9.0 * time), 0.18 * np.cos(9.0 * time)
    whole = cycles(recording("c", 1 / 500.0, displacement=moved, force=900.0 * speed + 3e4 * moved))
    for share in (1.0, 0.4, 0.1):
        # the spring moves the peak to the end of the part
        place = np.linspace(-0.02 * share, 0.02 * share, 100001)
        truth = np.max(900.0 * 9.0 * np.sqrt(0.02**2 - place**2) + 3e4 * place)
        found = float(forces_of(whole, share).peaks[True].values.mean())
        assert found == pytest.approx(truth, rel=2e-3)


def test_width_over_velocity_of_a_spring_beside_a_dashpot() -> None:
    rig_time = np.arange(6000) / 600.0
    moved, speed = 0.02 * np.sin(9.0 * rig_time), 0.18 * np.cos(9.0 * rig_time)
    found = known(quantities(cycles(recording("k", 1 / 600.0, displacement=moved, force=2500.0 * speed + 6e4 * moved))))
    assert found["width v"].value == pytest.approx(0.36 * np.sin(np.arctan(6e4 / 2500.0 / 9.0)), rel=2e-4)


@pytest.mark.parametrize("kind", ["gas", "bilinear"])
def test_a_drift_of_the_zero_does_no_work(kind: str) -> None:
    rig = Rig(kind, 1.0, 500.0, noise=1e-5, drift=0.02)
    assert known(quantities(cycles(of_rig(rig))))["E"].value == pytest.approx(rig.truth()["E"], rel=2e-4)


@pytest.mark.parametrize("kind", ["gas", "bilinear"])
def test_a_stated_skew_is_corrected(kind: str) -> None:
    rig = Rig(kind, 2.0, 500.0, noise=1e-5, skew=1.0)
    record = of_rig(rig)
    right, wrong = (known(quantities(cycles(record, skew))) for skew in (1.0 / rig.rate, 0.0))
    for name in ("F0+", "Fd+", "E"):
        assert abs(right[name].value - rig.truth()[name]) <= 2e-3 * scale(rig, name)
    if kind != "bilinear":
        assert abs(wrong["Fd+"].value - rig.truth()["Fd+"]) > 4e-3 * scale(rig, "Fd+")


def test_a_drift_is_told_where_there_is_one() -> None:
    drifts = {
        drift: [
            known(quantities(cycles(of_rig(Rig("viscous", 1.0, 500.0, noise=0.003, drift=drift, seed=s)))))["F0+"].drift
            for s in range(5)
        ]
        for drift in (0.0, 0.03)
    }
    assert sum(d != 0.0 for d in drifts[0.0]) <= 1 and all(d > 0.0 for d in drifts[0.03])


def test_planted_ripple_and_free_travel_are_found() -> None:
    rig = Rig("viscous", 1.0, 2000.0, noise=1e-3)
    displacement, force = rig.record()
    phase = np.unwrap(np.angle(np.exp(1j * 2 * np.pi * np.arange(len(force)) / 2000.0)))
    rippled = recording("r", 1 / 2000.0, displacement=displacement, force=force * (1.0 + 0.04 * np.sin(24.0 * phase)))
    assert known(quantities(cycles(rippled)))["ripple"].value == pytest.approx(0.04, rel=0.15)
    smooth = known(quantities(cycles(of_rig(rig))))["ripple"]
    assert abs(smooth.value) < 0.004
    # play of 2 mm: the force is zero for so long after every reversal
    time = np.arange(24000) / 2000.0
    moved = 0.01 * np.sin(2 * np.pi * time)
    held, behind = np.empty_like(moved), 0.0
    for k, x in enumerate(moved):
        behind = min(max(behind, x - 0.001), x + 0.001)
        held[k] = behind
    spring = np.clip((moved - held) / 0.001, -1.0, 1.0)
    force = np.where(np.abs(spring) > 0.999, 500.0 * spring, 0.0)
    force = np.convolve(np.pad(force, 5, mode="edge"), np.ones(11) / 11, mode="valid")
    found = known(quantities(cycles(recording("p", 1 / 2000.0, displacement=moved, force=force))))["free travel"]
    assert found.value == pytest.approx(0.002, rel=0.06)


def test_too_few_samples_a_cycle_are_refused() -> None:
    record = of_rig(Rig("viscous", 10.0, 120.0, cycles=30))
    segments, _ = cut([record], 1, Settings(drive="displacement", holdout="none"))
    with pytest.raises(DataError, match="12 samples a cycle; at least 16"):
        cycles_of(record, segments[0])


def test_a_viscous_damper_has_no_stiffness_and_no_yield() -> None:
    found = quantities(cycles(of_rig(Rig("viscous", 1.0, 1000.0, noise=0.002))))
    assert found["xi_eff"].reason == "K_eff is not distinct from zero"
    assert "no elastic unloading" in found["F_y"].reason
    assert found["K_eff"].estimate is not None and found["K_eff"].estimate.low <= 0.0 <= found["K_eff"].estimate.high


def test_forces_that_push_outward_have_a_stiffness_below_zero_and_no_damping_ratio() -> None:
    t = np.arange(0.0, 8.0, 5e-4)
    moved, speed = 0.015 * np.sin(2 * np.pi * t), 0.03 * np.pi * np.cos(2 * np.pi * t)
    found = quantities(cycles(recording("k", 5e-4, displacement=moved, force=1500.0 * speed - 500.0 * moved)))
    assert found["K_eff"].estimate is not None and found["K_eff"].estimate.high < 0.0
    assert found["xi_eff"].reason == "K_eff is below zero: the forces at the ends push outward"


@pytest.mark.parametrize("constant", [0.0, 150.0, 400.0, -400.0])
def test_a_constant_force_leaves_the_effective_stiffness(constant: float) -> None:
    t = np.arange(0.0, 8.0, 5e-4)
    moved, speed = 0.015 * np.sin(2 * np.pi * t), 0.03 * np.pi * np.cos(2 * np.pi * t)
    force = 9000.0 * moved + 1500.0 * speed + constant
    found = known(quantities(cycles(recording("gas", 5e-4, displacement=moved, force=force))))
    assert found["K_eff"].value == pytest.approx(9000.0, rel=2e-3)
    assert found["xi_eff"].value == pytest.approx(1500.0 * 2 * np.pi / (2 * 9000.0), rel=2e-3)


def test_a_reversal_at_a_sample_where_the_motion_still_moves_leaves_the_work() -> None:
    # as of a noisy motion; a spline through 0 there and the power of the sample had a work of 1e7 J
    time = np.arange(1001) / 100.0
    force = 300.0 * np.sin(2 * np.pi * time)
    whole = cycles(recording("a", 0.01, displacement=-0.01 * np.cos(2 * np.pi * time), force=force))
    for apart in (1e-14, 1e-7, 1e-4):
        moved = replace(whole, reversals=0.01 * np.round(100.0 * whole.reversals) + 0.01 - apart)
        assert moved.work.values == pytest.approx(np.full(whole.count, 3.0 * np.pi), rel=0.02)
