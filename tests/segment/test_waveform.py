import numpy as np
import pytest

from mrfit.segment.waveform import irregular_waveform, periodic_waveform
from mrfit.signal.harmonics import harmonic_fit

TURN = 2 * np.pi * np.arange(8000) / 1000
SHAPES = {
    "sine": np.sin(TURN + 0.4),
    "triangle": 2 / np.pi * np.arcsin(np.sin(TURN + 0.4)),
    "bent": np.sin(TURN) + 0.08 * np.sin(3 * TURN),
    "square": np.sign(np.sin(TURN + 0.001)),
    "sawtooth": (TURN / np.pi) % 2 - 1,
    "two-tone": np.sin(TURN) + 0.8 * np.sin(2 * TURN),
}
NAMES = {"sine": "sine", "triangle": "triangle", "bent": "sine"}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_periodic_shapes_are_told_apart(shape: str, noise: float) -> None:
    values = SHAPES[shape] + noise * np.random.default_rng(1).standard_normal(8000)
    assert periodic_waveform(harmonic_fit(values, 1e-3, 1.0)) == NAMES.get(shape, "periodic")


def noisy(values: np.ndarray, seed: int = 2) -> np.ndarray:
    return values + 0.005 * np.ptp(values) * np.random.default_rng(seed).standard_normal(len(values))


def test_plateaus_and_few_jumps_are_a_step() -> None:
    assert irregular_waveform(noisy(np.repeat([0.0, 1.0, 0.0, 2.0], 3000))) == "step"


@pytest.mark.parametrize("bit", [40, 100, 900])
def test_a_random_binary_sequence_is_random(bit: int) -> None:
    bits = np.random.default_rng(3).integers(0, 2, 200) * 2.0 - 1.0
    assert irregular_waveform(noisy(np.repeat(bits, bit))) == "random"


def test_band_limited_noise_is_random() -> None:
    white = np.random.default_rng(4).standard_normal(40_000)
    assert irregular_waveform(noisy(np.convolve(white, np.hanning(200), mode="valid"))) == "random"


def test_a_slow_sweep_is_quasi_static() -> None:
    sweep = np.interp(np.arange(20_000), [0, 4000, 12_000, 20_000], [0.0, 5.0, -5.0, 5.0])
    assert irregular_waveform(noisy(sweep)) == "quasi-static"


def test_many_ramps_of_growing_amplitude_are_quasi_static() -> None:
    corners = np.arange(41) * 500
    heights = np.where(np.arange(41) % 2, 1, -1) * np.arange(41) / 40
    assert irregular_waveform(noisy(np.interp(np.arange(20_001), corners, heights))) == "quasi-static"


def test_a_signal_at_rest_has_no_waveform() -> None:
    assert irregular_waveform(np.full(1000, 2.5)) is None
    assert irregular_waveform(np.random.default_rng(5).standard_normal(5000)) is None


def earthquake(seed: int, strong: float) -> np.ndarray:
    """Return a motion that is strong for a share of the record, and dies away slowly as that of a building does."""
    time = np.linspace(0.0, 1.0, 20_000)
    envelope = np.where(time < 0.1, 0.0, np.exp(-(time - 0.1) / strong))
    motion = np.convolve(np.random.default_rng(seed).standard_normal(len(time)), np.hanning(60), mode="same")
    return envelope * motion


@pytest.mark.parametrize("strong", [0.02, 0.05])
@pytest.mark.parametrize("seed", range(5))
def test_motion_between_rests_at_one_level_is_transient(strong: float, seed: int) -> None:
    assert irregular_waveform(earthquake(seed, strong)) == "transient"


@pytest.mark.parametrize("strong", [0.2, 0.5])
@pytest.mark.parametrize("seed", range(5))
def test_motion_that_lasts_is_random(strong: float, seed: int) -> None:
    assert irregular_waveform(earthquake(seed, strong)) == "random"


def test_a_pulse_that_is_held_is_a_step_and_a_bump_is_not() -> None:
    assert irregular_waveform(noisy(np.repeat([0.0, 1.0, 0.0], [4000, 2000, 4000]))) == "step"
    bump = np.concatenate([np.zeros(4000), np.sin(np.linspace(0.0, np.pi, 600)), np.zeros(4000)])
    assert irregular_waveform(noisy(bump)) == "transient"
