"""Noise floors against planted noise: drives without cycles, coloured noise, dropouts, repeats, sweeps, drift."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfiltfilt

from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.signal.noise_floor import NoiseFloor, measured_samples
from mrfit.signal.output_floor import output_floors, residual_floor

RATE, SAMPLES = 1000.0, 12_000
NOISE = 16.0
rng_of = np.random.default_rng


def random_stroke(seed: int) -> Array:
    white = rng_of(seed).standard_normal(SAMPLES + 4000)
    x = sosfiltfilt(butter(3, (0.4, 5.0), "bandpass", fs=RATE, output="sos"), white)[2000:-2000]
    return np.asarray(0.015 * x / np.abs(x).max())


def sweep() -> Array:
    t = np.arange(SAMPLES) / RATE
    return np.asarray(0.015 * np.sin(2 * np.pi * (0.4 * t + 0.25 * t**2)))


def triangle(per_cycle: int = 800) -> Array:
    phase = (np.arange(SAMPLES) / per_cycle + 0.25) % 1.0
    return np.asarray(0.015 * (1.0 - np.abs(4.0 * phase - 2.0)))


def force(x: Array) -> Array:
    """A law of no model here: an orifice loss, a hardening spring, and stops."""
    v = np.gradient(x, 1 / RATE)
    total = 3e4 * v * np.abs(v) + 4e8 * x**3
    for reach in (3e-4, 1e-3, 3e-3):
        state, stop = 0.0, np.empty(len(x))
        for k, move in enumerate(np.diff(x, prepend=x[0])):
            state = min(max(state + move, -reach), reach)
            stop[k] = state
        total = total + 60.0 * stop / reach
    return np.asarray(total)


def coloured(pole: float, seed: int, samples: int = SAMPLES) -> Array:
    drawn = rng_of(seed).standard_normal(samples + 2000)
    noise = lfilter([np.sqrt(1 - pole**2)], [1.0, -pole], drawn)[2000:]
    return np.asarray(NOISE * noise)


def record(
    x: Array, values: Array, cycles: int = 0, name: str = "a", frequency: float = 0.0
) -> tuple[Recording, Segment]:
    made = Recording(
        id=name,
        source=f"{name}.csv",
        sha256="",
        reader="none",
        dt=1 / RATE,
        start=0.0,
        channels={"displacement": x, "force": values},
        units={},
    )
    lead = 400
    segment = Segment(
        id=f"{name}#1",
        condition="c",
        recording=name,
        start=lead,
        stop=len(x),
        warm_up=lead,
        waveform="random",
        drive="displacement",
        frequency=frequency,
        amplitude=0.015,
        offset=0.0,
        cycles=cycles,
        current=float("nan"),
        temperature=float("nan"),
        role="train",
    )
    return made, segment


def floor_of(x: Array, values: Array, cycles: int = 0, frequency: float = 0.0):
    made, segment = record(x, values, cycles, frequency=frequency)
    return output_floors([segment], {"a": made}, [values[segment.start :]])[0]


@pytest.mark.parametrize("excitation", ["excitation_force", "base_acceleration"])
def test_the_motion_of_a_driven_mass_tells_no_noise_of_itself(excitation: str) -> None:
    x = random_stroke(1)
    moved = x + 2e-5 * rng_of(2).standard_normal(len(x))
    made, segment = record(moved, 500.0 * x)
    channels = {"displacement": moved, excitation: 500.0 * x}
    driven = replace(made, channels=channels), replace(segment, drive=excitation)
    (found,) = output_floors([driven[1]], {"a": driven[0]}, [moved[segment.start :]], "displacement")
    assert not found.known
    assert not residual_floor(found, *driven, (moved - x)[segment.start :], "displacement").known
    # the force of a damper on a shaken base is regressed on its motion as ever
    force_of = force(x) + coloured(0.5, 2)
    (told,) = output_floors([driven[1]], {"a": driven[0]}, [force_of[segment.start :]], "force")
    assert told.method == "regression"


@pytest.mark.parametrize("pole", [0.0, 0.5, 0.9, 0.98])
def test_noise_of_any_colour_is_found_without_cycles(pole: float) -> None:
    x, noise = random_stroke(1), coloured(pole, 2)
    found = floor_of(x, force(x) + noise)
    assert found.method == "regression"
    assert found.value == pytest.approx(np.std(noise[400:]), rel=0.15)
    assert found.low < np.std(noise[400:]) < found.high


def test_a_law_the_regression_cannot_follow_leaves_the_floor_unknown() -> None:
    x = random_stroke(3)
    # a force that is a sign of the stroke some time ago times the speed, and has hardly any noise
    past = 2e4 * np.gradient(x, 1 / RATE) * np.tanh(np.roll(x, 150) / 1e-4)
    noise = 0.02 * coloured(0.0, 4)
    found = floor_of(x, past + noise)
    assert not found.known and found.method == "not known"
    assert found.low <= 1.2 * np.std(noise) and found.high > np.std(noise)


@pytest.mark.parametrize(("share", "held"), [(0.3, False), (0.6, True)])
def test_what_was_filled_in_is_left_out(share: float, held: bool) -> None:
    x, noise, rng = random_stroke(5), coloured(0.5, 6), rng_of(7)
    values, kept = force(x) + noise, np.ones(SAMPLES, dtype=bool)
    while np.mean(~kept) < share:
        first, length = int(rng.integers(500, SAMPLES - 200)), int(rng.integers(10, 120))
        ends = values[first - 1], values[first - 1] if held else values[first + length]
        values[first : first + length] = np.linspace(*ends, length + 2)[1:-1]
        kept[first - 1 : first + length + 1] = False
    assert np.mean(measured_samples(values) == kept) > 0.99
    assert floor_of(x, values).value == pytest.approx(np.std(noise[400:][kept[400:]]), rel=0.15)


def test_a_grid_a_noisy_channel_and_a_short_straight_are_not_filled_in() -> None:
    smooth = np.sin(np.arange(4000) / 200.0)
    assert measured_samples(np.round(smooth / 0.05) * 0.05).all()
    noisy = smooth + 0.01 * rng_of(8).standard_normal(4000)
    assert measured_samples(noisy).all()
    noisy[100:106] = np.linspace(noisy[100], noisy[105], 6)
    assert measured_samples(noisy).all()


def test_cycles_of_a_corner_drive_are_compared() -> None:
    x, noise = triangle(), coloured(0.9, 9)
    found = floor_of(x + 1e-6 * rng_of(10).standard_normal(SAMPLES), force(x) + noise, 14, RATE / 800)
    assert found.method == "cycles"
    assert found.value == pytest.approx(np.std(noise), rel=0.15)


def test_neighbouring_cycles_of_a_sweep_are_no_repeats() -> None:
    x, noise = sweep(), coloured(0.5, 11)
    values = force(x) + noise
    made, segment = record(x, values)
    # two cycles near 4 Hz
    segment = replace(segment, start=7000, stop=7500, warm_up=0, cycles=2, frequency=4.0)
    found = output_floors([segment], {"a": made}, [values[7000:7500]])[0]
    assert not found.known or found.value == pytest.approx(NOISE, rel=0.3)


def test_repeats_of_one_drive_are_compared_and_other_drives_are_not() -> None:
    x, seen = random_stroke(12), rng_of(13)
    # an output no regression follows: only the repeat tells
    law = 2e4 * np.gradient(x, 1 / RATE) * np.tanh(np.roll(x, 150) / 1e-4)
    noises = [coloured(0.9, seed) for seed in (14, 15)]
    lag = 37
    first = record(x + 1e-6 * seen.standard_normal(SAMPLES), law + noises[0], name="a")
    moved = np.roll(x, lag) + 1e-6 * seen.standard_normal(SAMPLES)
    second = record(moved, np.roll(law, lag) + noises[1], name="b")
    recordings = {"a": first[0], "b": second[0]}
    outputs = [r.channels["force"][s.start :] for r, s in (first, second)]
    found = output_floors([first[1], second[1]], recordings, outputs)
    assert [f.method for f in found] == ["repeats", "repeats"]
    assert found[0].value == pytest.approx(NOISE, rel=0.1)
    apart = record(1.01 * moved, np.roll(law, lag) + noises[1], name="b")
    found = output_floors([first[1], apart[1]], {"a": first[0], "b": apart[0]}, outputs)
    assert all(f.method != "repeats" for f in found)


def test_a_residual_tells_a_floor_that_the_output_does_not() -> None:
    x, noise = random_stroke(16), 0.02 * coloured(0.5, 17)
    law = 2e4 * np.gradient(x, 1 / RATE) * np.tanh(np.roll(x, 150) / 1e-4)
    made, segment = record(x, law + noise)
    floor = output_floors([segment], {"a": made}, [(law + noise)[400:]])[0]
    assert not floor.known
    assert residual_floor(floor, made, segment, noise[400:]).value == pytest.approx(np.std(noise[400:]), rel=0.1)
    assert not residual_floor(floor, made, segment, (law + noise)[400:]).known


def test_a_floor_above_what_a_model_leaves_is_none() -> None:
    x, noise = random_stroke(16), coloured(0.5, 17)
    made, segment = record(x, force(x) + noise)
    size = float(np.std(noise[400:]))
    for share, kept in ((1.2, True), (1.5, False)):
        # cycles of a drive that wobbles differ by more than noise
        floor = NoiseFloor(share * size, "cycles", size, 2.0 * size)
        found = residual_floor(floor, made, segment, noise[400:])
        assert (found == floor) == kept
        assert kept or found.value == pytest.approx(size, rel=0.1)


def test_a_piece_too_short_to_tell_has_the_floor_of_the_rest_of_its_record() -> None:
    x, noise = random_stroke(21), coloured(0.9, 22)
    made, segment = record(x, force(x) + noise)
    long, short = replace(segment, stop=11_600), replace(segment, id="a#2", start=11_600)
    other = replace(short, id="b#1", recording="b")
    outputs = [made.channels["force"][s.start : s.stop] for s in (long, short)]
    rest, piece = output_floors([long, short], {"a": made}, outputs)
    assert piece.method == "other records" and rest.method == "regression"
    assert piece.value == pytest.approx(rest.value) and piece.value == pytest.approx(NOISE, rel=0.2)
    alone = output_floors([long, other], {"a": made, "b": replace(made, id="b")}, outputs)[1]
    assert not alone.known


def test_rounding_that_repeats_with_the_cycle_is_noise() -> None:
    t = np.arange(SAMPLES) / RATE
    x = 0.015 * np.sin(2 * np.pi * t)
    step = 60.0
    values = step * np.round(force(x) / step)
    found = floor_of(x + 1e-6 * rng_of(18).standard_normal(SAMPLES), values, 11, 1.0)
    assert found.value >= 0.99 * step / np.sqrt(12.0)


def test_an_output_that_was_filled_in_throughout_has_no_known_floor() -> None:
    x = random_stroke(19)
    found = floor_of(x, np.linspace(-1.0, 1.0, SAMPLES))
    assert not found.known and found.scale == 0.0 and found.most == np.inf
