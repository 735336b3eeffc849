import re

import numpy as np
import pytest

from mrfit.core.recording import Recording, Segment
from mrfit.errors import DataError
from mrfit.signal.smoothing import smooth


def recording(dt: float, condition: dict[str, float] | None = None, **channels: np.ndarray) -> Recording:
    return Recording("log", "log.csv", "0", "csv", dt, 0.0, channels, {}, condition=condition or {})


def segment(start: int, stop: int, warm_up: int, frequency: float, cycles: int, drive: str = "current") -> Segment:
    shape = "sine" if cycles else "random"
    level = (float("nan"), float("nan"))
    return Segment(
        "log#1", "c", "log", start, stop, warm_up, shape, drive, frequency, 5.0, 0.0, cycles, *level, "train"
    )


def reversals(values: np.ndarray) -> int:
    return int(np.sum(np.diff(np.sign(np.diff(values))) != 0))


@pytest.mark.parametrize("per_cycle", [200, 2000, 20_000])
@pytest.mark.parametrize("noise", [1e-4, 1e-3, 1e-2])
def test_a_noisy_sine_keeps_two_reversals_per_cycle(per_cycle: int, noise: float) -> None:
    rng = np.random.default_rng(1)
    t = np.arange(6 * per_cycle + per_cycle // 3) / per_cycle
    clean = 5 * np.sin(2 * np.pi * t + 0.3)
    log = recording(1 / per_cycle, current=clean + 5 * noise * rng.standard_normal(len(t)))
    drive = smooth(log, segment(len(t) - 5 * per_cycle, len(t), per_cycle, 1.003, 5), ("current",))
    begin = len(t) - 6 * per_cycle
    assert reversals(drive.values[0]) == 12
    assert np.std(drive.values[0] - clean[begin:]) < 5 * noise * 4 / np.sqrt(5 * per_cycle)
    assert drive.noise["current"] == pytest.approx(5 * noise, rel=0.1)
    assert drive.warm_up == per_cycle
    frequency = re.fullmatch(r"harmonic fit, 1 harmonic of ([\d.]+) Hz", drive.method)
    assert frequency is not None
    assert float(frequency[1]) == pytest.approx(1.0, rel=2e-3)


def test_the_series_of_a_periodic_drive_go_on_outside_the_segment() -> None:
    t = np.arange(5000) / 1000
    log = recording(1e-3, current=np.sin(2 * np.pi * 2 * t), flux=0.3 * np.sin(2 * np.pi * 2 * t - 0.2))
    drive = smooth(log, segment(1000, 5000, 500, 2.0, 8), ("flux", "current"))
    assert drive.fits is not None
    before = np.arange(-500, 0) * 1e-3
    assert drive.fits[1].evaluate(before) == pytest.approx(np.sin(2 * np.pi * 2 * (before + 0.5)), abs=1e-8)
    assert drive.fits[0].evaluate(np.arange(4500) * 1e-3) == pytest.approx(drive.values[0], abs=1e-9)


def test_a_settling_lead_in_does_not_bend_the_series() -> None:
    t = np.arange(9000) / 1000
    clean = np.sin(2 * np.pi * t)
    log = recording(1e-3, current=clean + 0.02 * np.exp(-t / 0.3))
    drive = smooth(log, segment(2000, 9000, 2000, 1.0, 7), ("current",))
    assert np.max(np.abs(drive.values[0] - clean)) < 2e-4


@pytest.mark.parametrize("periodic", [True, False])
def test_rates_that_were_not_recorded_are_derived(periodic: bool) -> None:
    rng = np.random.default_rng(2)
    t = np.arange(8000) / 2000
    turn = 2 * np.pi * 2.0
    x = 0.01 * np.sin(turn * t)
    log = recording(5e-4, displacement=x + 1e-6 * rng.standard_normal(len(t)))
    part = segment(0, 8000, 0, 2.0 if periodic else 0.0, 8 if periodic else 0, "displacement")
    values = smooth(log, part, ("displacement", "velocity", "acceleration")).values
    inner = slice(500, -500)
    expected = [x, 0.01 * turn * np.cos(turn * t), -(turn**2) * x]
    for row, truth, tolerance in zip(values, expected, (1e-4, 3e-3, 3e-2), strict=True):
        assert np.std((row - truth)[inner]) < tolerance * np.std(truth)


def test_acceleration_comes_from_a_recorded_velocity_first() -> None:
    t = np.arange(4000) / 1000
    log = recording(1e-3, displacement=np.sin(7 * t), velocity=np.cos(2 * np.pi * t))
    drive = smooth(log, segment(0, 4000, 0, 1.0, 4, "velocity"), ("acceleration",))
    assert drive.values[0] == pytest.approx(-2 * np.pi * np.sin(2 * np.pi * t), abs=1e-6)
    assert drive.method.endswith("of velocity")


def test_a_level_that_was_not_recorded_is_constant() -> None:
    t = np.arange(4000) / 1000
    log = recording(1e-3, {"current": 0.75}, displacement=np.sin(2 * np.pi * t))
    drive = smooth(log, segment(1000, 4000, 1000, 1.0, 3, "displacement"), ("displacement", "current"))
    assert np.all(drive.values[1] == 0.75)
    assert drive.fits is not None and drive.fits[1].evaluate(t) == pytest.approx(0.75)
    assert "current: constant" in drive.method


def test_a_channel_that_cannot_be_had_is_named_with_its_remedy() -> None:
    log = recording(1e-3, displacement=np.sin(np.arange(1000) / 50))
    for name, word in (("current", "level"), ("flux", "column"), ("angular_velocity", "angle")):
        with pytest.raises(DataError, match=f"log.csv: no {name} .*{word}"):
            smooth(log, segment(0, 1000, 0, 0.0, 0, "displacement"), (name,))


def test_noise_that_is_small_near_nyquist_does_not_stop_a_harmonic_fit() -> None:
    rng = np.random.default_rng(3)
    n = np.arange(9000)
    band_limited = np.convolve(rng.standard_normal(9050), np.hanning(51) / 4, mode="valid")[:9000]
    log = recording(1e-3, displacement=np.sin(2 * np.pi * n / 1000) + 1e-3 * band_limited)
    drive = smooth(log, segment(0, 9000, 0, 1.0, 9, "displacement"), ("displacement",))
    assert drive.fits is not None
    assert reversals(drive.values[0]) == 18


def test_a_drive_that_leaves_its_series_is_smoothed_locally() -> None:
    n = np.arange(9000)
    growing = np.sin(2 * np.pi * n / 1000) * (1 + n / 9000)
    rng = np.random.default_rng(4)
    log = recording(1e-3, current=growing + 0.005 * rng.standard_normal(9000))
    drive = smooth(log, segment(0, 9000, 0, 1.0, 9), ("current",))
    assert drive.fits is None and "savitzky-golay" in drive.method
    assert np.std(drive.values[0] - growing) < 0.002
    assert reversals(drive.values[0]) <= 22


def test_a_stepped_current_is_flat_between_its_steps() -> None:
    rng = np.random.default_rng(3)
    levels = np.repeat([0.4, 2.3, 0.0, 1.8, 0.8], 300)
    log = recording(2e-3, current=levels + 2e-3 * rng.standard_normal(len(levels)))
    drive = smooth(log, segment(300, len(levels), 300, 0.0, 0), ("current",))
    inner = (np.arange(len(levels)) % 300 > 2) & (np.arange(len(levels)) % 300 < 297)
    assert np.abs(drive.values[0] - levels)[inner].max() <= 4 * 2e-3 / np.sqrt(300)
    assert "held levels" in drive.method


def test_a_commanded_current_is_driven_as_recorded() -> None:
    commanded = np.repeat(np.random.default_rng(3).integers(0, 3, 80) * 1.0, 50)
    drive = smooth(recording(1e-3, current=commanded), segment(0, len(commanded), 0, 0.0, 0), ("current",))
    assert np.array_equal(drive.values[0], commanded)
    assert drive.method == "as recorded"


def test_the_resistance_of_a_reconstructed_flux_is_an_input_and_none_for_a_measured_one() -> None:
    values = np.sin(np.arange(400) / 9)
    for condition, expected in (({"flux_resistance": 2.1}, 2.1), ({}, 0.0)):
        log = recording(1e-3, condition, current=values)
        drive = smooth(log, segment(100, 400, 100, 0.0, 0), ("flux_resistance",))
        assert np.array_equal(drive.values[0], np.full(400, expected))


def trapezoid(t: np.ndarray, ramp: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a trapezoid of 0.8 Hz and amplitude 1 and its slope; it is a triangle for a ramp of half a cycle."""
    part = (0.8 * t + 0.137) % 1.0
    half, sign = part % 0.5, np.where(part < 0.5, 1.0, -1.0)
    return sign * np.where(half < ramp, 2 * half / ramp - 1, 1.0), sign * np.where(half < ramp, 1.6 / ramp, 0.0)


@pytest.mark.parametrize("ramp", [0.5, 0.2])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 1e-2])
@pytest.mark.parametrize("periodic", [True, False])
def test_velocity_keeps_the_corners_of_triangles_and_trapezoids(ramp: float, noise: float, periodic: bool) -> None:
    t = np.arange(10_000) / 1000
    clean, slope = trapezoid(t, ramp)
    log = recording(1e-3, displacement=clean + noise * np.random.default_rng(5).standard_normal(len(t)))
    part = segment(0, len(t), 0, 0.8 if periodic else 0.0, 8 if periodic else 0, "displacement")
    drive = smooth(log, part, ("displacement", "velocity"))
    assert np.std(drive.values[1] - slope) < (1e-9 if noise == 0.0 else 0.08) * np.std(slope)
    assert np.std(drive.values[0] - clean) <= noise / 5
    wiggles = reversals(drive.values[0][np.concatenate([[True], np.diff(drive.values[0]) != 0])])
    assert wiggles <= 18


def test_a_smooth_periodic_drive_of_many_harmonics_keeps_its_series() -> None:
    t = np.arange(10_000) / 1000
    clean = np.tanh(np.sin(2 * np.pi * 0.8 * t) / 0.3)
    log = recording(1e-3, displacement=clean + 0.01 * np.random.default_rng(6).standard_normal(len(t)))
    drive = smooth(log, segment(0, len(t), 0, 0.8, 8, "displacement"), ("displacement", "velocity"))
    assert drive.fits is not None and drive.fits[0].harmonics > 3


@pytest.mark.parametrize("drift", [0.0, 0.01])
@pytest.mark.parametrize("fitted", [4, 8])
def test_a_drift_of_the_stroke_sensor_costs_a_series_no_harmonics(drift: float, fitted: int) -> None:
    """A triangle with round corners."""
    t = np.arange(1250 * fitted) / 1000
    phase = 2 * np.pi * 0.8 * t
    clean = np.arcsin(0.95 * np.sin(phase))
    slope = 0.95 * 2 * np.pi * 0.8 * np.cos(phase) / np.sqrt(1 - (0.95 * np.sin(phase)) ** 2)
    noise = 1e-4 * np.random.default_rng(6).standard_normal(len(t))
    log = recording(1e-3, displacement=clean + noise + drift * np.sin(0.9 * t + 0.4))
    drive = smooth(log, segment(0, len(t), 0, 0.8, fitted, "displacement"), ("displacement", "velocity"))
    assert drive.fits is not None and drive.fits[0].harmonics >= 9
    assert np.std(drive.values[1] - slope) < 5e-3 * np.std(slope)


def resting(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a round stroke that rests a third of its time, and its slope."""
    phase = 2 * np.pi * 0.8 * t
    clean = np.tanh(np.sin(phase) / 0.3)
    return clean, (1 - clean**2) * 2 * np.pi * 0.8 * np.cos(phase) / 0.3


@pytest.mark.parametrize("drift", [0.0, 0.01, 0.05])
@pytest.mark.parametrize("noise", [0.0, 1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("fitted", [4, 8])
def test_a_stroke_that_rests_is_driven_at_rest(drift: float, noise: float, fitted: int) -> None:
    """A series that lacks harmonics beside a drift rings in the rests, where a friction turns with it."""
    t = np.arange(1250 * fitted) / 1000
    clean, slope = resting(t)
    drifts = drift * np.sin(0.9 * t + 0.4)
    white = noise * np.random.default_rng(6).standard_normal(len(t))
    log = recording(1e-3, displacement=clean + white + drifts)
    drive = smooth(log, segment(0, len(t), 0, 0.8, fitted, "displacement"), ("displacement", "velocity"))
    still = np.abs(slope) < 0.005
    error = drive.values[1] - slope
    with_drift = error - drift * 0.9 * np.cos(0.9 * t + 0.4)
    assert min(np.std(part[still]) for part in (error, with_drift)) < 1e-4 + 20 * noise
    assert np.std(error) < 5e-3 * np.std(slope) + drift
    assert drive.fits is not None or drift > 0.0 or noise == 0.0


@pytest.mark.parametrize("drift", [0.0, 2e-3])
def test_a_series_that_rings_beside_a_drift_gives_way_to_local_polynomials(drift: float) -> None:
    """Two cycles of a slow triangle with round corners: what a sensor drifts by must not cost the corners."""
    t = np.arange(4000) / 500
    clean, slope = trapezoid(t, 0.5)
    round_off = np.hanning(15) / np.hanning(15).sum()
    clean, slope = (np.convolve(np.pad(c, 7, "edge"), round_off, mode="valid") for c in (clean, slope))
    walk = np.cumsum(np.random.default_rng(3).standard_normal(len(t)))
    walk = drift * np.interp(t, t[::250], walk[::250]) / np.std(walk)
    log = recording(2e-3, displacement=clean + walk + 2e-4 * np.random.default_rng(4).standard_normal(len(t)))
    drive = smooth(log, segment(0, 2500, 0, 0.4, 2, "displacement"), ("displacement", "velocity"))
    beside = np.ones(2500, dtype=bool)
    for corner in np.flatnonzero(np.diff(np.sign(slope[:2500]))):
        beside[max(corner - 12, 0) : corner + 13] = False
    off = np.abs(drive.values[1] - slope[:2500])[beside]
    assert np.max(off[25:-25]) < 0.05 * np.max(slope)


def test_what_a_series_leaves_that_does_not_repeat_is_no_reason_to_follow_it() -> None:
    """Hum of a sensor beside a rounded stroke: a local polynomial would follow it."""
    t = np.arange(8000) / 1000
    clean = np.tanh(np.sin(2 * np.pi * 0.5 * t) / 0.3)
    hum = 3e-3 * np.sin(2 * np.pi * 21.3 * t + 1.0)
    noise = 1e-4 * np.random.default_rng(8).standard_normal(len(t))
    drive = smooth(
        recording(1e-3, displacement=clean + hum + noise), segment(0, 8000, 0, 0.5, 4, "displacement"), ("velocity",)
    )
    assert drive.fits is not None


def test_velocity_of_a_rounded_trapezoid_is_local_where_it_bends_and_wide_where_it_rests() -> None:
    t = np.arange(10_000) / 1000
    clean, _ = trapezoid(t, 0.2)
    rounded = np.convolve(np.pad(clean, 50, "edge"), np.hanning(101) / np.hanning(101).sum(), mode="valid")
    slope = np.gradient(rounded, 1e-3)
    log = recording(1e-3, displacement=rounded + 1e-3 * np.random.default_rng(7).standard_normal(len(t)))
    drive = smooth(log, segment(0, len(t), 0, 0.0, 0, "displacement"), ("velocity",))
    assert np.std((drive.values[0] - slope)[100:-100]) < 0.02 * np.std(slope)


def test_velocity_is_not_driven_by_noise_that_is_not_white() -> None:
    rng = np.random.default_rng(8)
    t = np.arange(20_000) / 1000
    arm = np.zeros(len(t))
    for k in range(1, len(t)):
        arm[k] = 0.9 * arm[k - 1] + rng.standard_normal()
    clean = np.sin(8.2 * t) + 0.4 * np.sin(13.7 * t)
    log = recording(1e-3, displacement=clean + 0.002 * arm / np.std(arm))
    drive = smooth(log, segment(0, len(t), 0, 0.0, 0, "displacement"), ("displacement", "velocity"))
    slope = 8.2 * np.cos(8.2 * t) + 0.4 * 13.7 * np.cos(13.7 * t)
    assert np.std(drive.values[1] - slope) < 0.02 * np.std(slope)
    assert reversals(drive.values[0]) == reversals(clean)


def test_a_rough_road_without_noise_is_left_as_recorded() -> None:
    from scipy.signal import butter, sosfilt

    road = sosfilt(butter(2, [1, 12], "band", fs=1000, output="sos"), np.random.default_rng(9).standard_normal(20_000))
    log = recording(1e-3, displacement=road)
    drive = smooth(log, segment(0, len(road), 0, 0.0, 0, "displacement"), ("displacement", "velocity"))
    assert np.array_equal(drive.values[0], road)
    assert np.std((drive.values[1] - np.gradient(road, 1e-3))[5:-5]) < 0.08 * np.std(drive.values[1])


def test_a_recorded_velocity_is_taken_rather_than_derived() -> None:
    t = np.arange(4000) / 1000
    log = recording(1e-3, displacement=np.sin(7 * t), velocity=np.cos(2 * np.pi * t))
    drive = smooth(log, segment(0, 4000, 0, 1.0, 4, "velocity"), ("velocity",))
    assert drive.values[0] == pytest.approx(np.cos(2 * np.pi * t), abs=1e-8)
