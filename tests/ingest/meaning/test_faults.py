"""Faults of sensors and converters that were laid into channels are found, and none in sound ones."""

from collections.abc import Callable

import numpy as np
import pytest

from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.ingest.meaning.faults import fault_findings
from mrfit.ingest.meaning.sanity import channel_findings

DT = 2e-3
T = DT * np.arange(3000)
RNG = np.random.default_rng(0)
NOISE = RNG.normal(0.0, 1.0, len(T))
SINE = np.sin(2 * np.pi * 2 * T)
VELOCITY = np.cos(2 * np.pi * 2 * T)
FORCE = 600.0 * np.tanh(4.0 * VELOCITY) + 300.0 * VELOCITY + 2.0 * NOISE


def _faults(**channels: Array) -> list[tuple[str, str]]:
    record = Recording("a", "a.csv", "", "delimited", DT, 0.0, channels, dict.fromkeys(channels, ""))
    return [(f.kind, f.channel) for f in fault_findings(record)]


@pytest.mark.parametrize("noise", [0.2, 1.0, 3.0])
@pytest.mark.parametrize("rail", [500.0, 750.0])
def test_a_rail_under_noise(noise: float, rail: float) -> None:
    values = np.clip(1000.0 * SINE, -rail, rail) + noise * NOISE
    assert _faults(force=values) == [("saturated", "force"), ("saturated", "force")]
    assert _faults(force=np.maximum(values, -rail + 20.0)) == [("saturated", "force")]  # below: one exact level


@pytest.mark.parametrize("length", [40, 400])
@pytest.mark.parametrize("begin", [700, 1033])
def test_a_stuck_channel(length: int, begin: int) -> None:
    values = FORCE.copy()
    values[begin : begin + length] = values[begin]
    assert _faults(displacement=SINE + 1e-4 * NOISE, force=values) == [("stuck", "force")]
    if length > 40:
        assert _faults(force=np.round(values, 1)) == [("stuck", "force")]


def test_a_short_hold_is_seen_where_noise_leaves_no_two_samples_alike_and_not_elsewhere() -> None:
    values, smooth = FORCE.copy(), 900.0 * SINE
    for begin in (700, 1500, 2100):
        values[begin : begin + 10] = values[begin]
        smooth[begin : begin + 10] = smooth[begin]
    assert _faults(displacement=SINE + 1e-4 * NOISE, force=values) == [("stuck", "force")]
    assert _faults(displacement=SINE + 1e-4 * NOISE, force=smooth) == []


@pytest.mark.parametrize("end", [np.argmin, np.argmax])
def test_a_channel_that_is_stuck_at_the_end_of_its_own_range(end: Callable[[Array], int]) -> None:
    values, begin = FORCE.copy(), int(end(FORCE))
    values[begin : begin + 140] = values[begin]
    assert _faults(displacement=SINE + 1e-4 * NOISE, force=values) == [("stuck", "force")]


@pytest.mark.parametrize("begin", [700, 1033])
@pytest.mark.parametrize("codes", [[0, 1], [0, 0, 0, 0, 0, -1], [-1, 0, 1]])
@pytest.mark.parametrize("code", [0.1, 0.25, 1.0])
def test_a_channel_that_is_stuck_but_for_one_code(begin: int, codes: list[int], code: float) -> None:
    values = np.round(FORCE / code)
    values[begin : begin + 800] = values[begin] + RNG.choice(codes, 800)
    found = _faults(displacement=SINE + 1e-4 * NOISE, force=code * values)
    assert found == [("stuck", "force")]
    assert _faults(displacement=SINE + 1e-4 * NOISE, force=code * np.round(FORCE / code)) == []


@pytest.mark.parametrize("rail", [0.3, 0.5, 0.8, 0.95])
@pytest.mark.parametrize("noise", [0.0, 3e-4])
def test_a_wave_at_both_rails_and_a_trapezoid(rail: float, noise: float) -> None:
    def kinds(values: Array) -> set[str]:
        channels = {"displacement": np.round(values + noise * NOISE, 5)}
        record = Recording("a", "a.csv", "", "delimited", DT, 0.0, channels, {"displacement": "m"})
        found = [f.kind for f in (*fault_findings(record), *channel_findings(record))]
        assert len(found) in (0, 2)
        return set(found)

    assert kinds(np.clip(SINE, -rail, rail)) == {"saturated" if noise else "clipped"}
    assert kinds(np.clip(2.0 / np.pi * np.arcsin(SINE), -rail, rail)) == set()


@pytest.mark.parametrize("rows", [2, 3, 10])
def test_a_channel_that_is_held_between_its_values(rows: int) -> None:
    held = np.repeat(FORCE[::rows], rows)[: len(FORCE)]
    assert _faults(displacement=SINE + 1e-4 * NOISE, force=held) == [("held", "force")]
    assert _faults(displacement=SINE + 1e-4 * NOISE, current=np.repeat(NOISE[::rows], rows)[: len(T)]) == []


@pytest.mark.parametrize("code", [5.0, 20.0])
def test_a_coarse_converter_holds_nothing_in_step(code: float) -> None:
    quiet = code * np.round((600.0 * np.tanh(4.0 * VELOCITY) + 300.0 * VELOCITY) / code)
    assert "held" not in [kind for kind, _ in _faults(displacement=SINE + 1e-4 * NOISE, force=quiet)]


@pytest.mark.parametrize("rows", [16, 400])
def test_rows_at_an_end_in_which_every_channel_stands(rows: int) -> None:
    def stopped(values: Array, at_end: bool) -> Array:
        changed = values.copy()
        changed[-rows:] = 0.0 if not at_end else changed[-rows]
        return changed if at_end else changed[::-1]

    for at_end in (False, True):
        channels = {n: stopped(v, at_end) for n, v in (("displacement", SINE + 1e-4 * NOISE), ("force", FORCE))}
        assert ("standing", "") in _faults(**channels)
        channels["current"] = NOISE  # goes on
        assert ("standing", "") not in _faults(**channels)


def test_a_machine_at_rest_now_and_then_is_no_logger_that_stopped() -> None:
    rests = (T % 2.0 < 0.5) | (T > 5.8)
    channels = {n: np.where(rests, v[0], v) for n, v in (("displacement", SINE), ("force", FORCE))}
    assert ("standing", "") not in _faults(**channels)


def test_a_channel_that_is_stuck_until_the_end() -> None:
    values = FORCE.copy()
    values[2000:] = values[2000]
    assert _faults(displacement=SINE + 1e-4 * NOISE, force=values) == [("stuck", "force")]
    still = np.where(T < 4.0, SINE, SINE[2000])
    assert _faults(displacement=still + 1e-4 * NOISE, force=values) == []  # the machine has stopped


@pytest.mark.parametrize(("amplitude", "bits", "scale"), [(40000.0, 16, 1.0), (36000.0, 16, 0.0305), (2500.0, 12, 1.0)])
def test_a_converter_that_wraps_round(amplitude: float, bits: int, scale: float) -> None:
    counts = np.round(amplitude * SINE + 3.0 * NOISE)
    half = 2 ** (bits - 1)
    assert _faults(force=scale * ((counts + half) % (2 * half) - half)) == [("wrap-round", "force")]


def test_noise_on_a_level_that_drifts_does_not_wrap_round() -> None:
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(0.0, 0.05, len(T))
        assert _faults(temperature=np.round((noise + 0.2 * T / T[-1]) / 0.02)) == []


SOUND = {
    "sine": SINE + 0.002 * NOISE,
    "sine without noise": SINE,
    "sine of few bits": np.round(127 * SINE) / 127,
    "triangle": np.arcsin(SINE) + 0.002 * NOISE,
    "square": np.sign(SINE + 1e-9) + 0.01 * NOISE,
    "sawtooth": (2.0 * T) % 1.0 + 0.001 * NOISE,
    "rounded trapezoid": np.tanh(2.0 * SINE) + 0.002 * NOISE,
    "levels": np.array([0.0, 1.0, 2.0, 0.5])[(T // 0.7).astype(int) % 4] + 0.003 * NOISE,
    "levels of a readback": np.array([0.0, 1.0, 2.0, 0.5])[(T // 0.7).astype(int) % 4],
    "current that rises and falls": np.convolve(
        np.sign(SINE + 1e-9), np.exp(-np.arange(300) / 20.0) / 20.5, mode="full"
    )[: len(T)],
    "force of a damper": FORCE,
    "noise": NOISE,
    "random walk": np.cumsum(NOISE),
    "slow temperature": np.round(24.0 + 0.1 * T, 1),
    "beats": SINE * np.sin(2 * np.pi * 0.2 * T),
    "decay": np.exp(-T) * SINE,
    "angle of a turning shaft": (400.0 * T) % 360.0,
}


@pytest.mark.parametrize("name", SOUND)
def test_sound_channels_have_no_fault(name: str) -> None:
    assert _faults(displacement=SINE + 1e-3 * RNG.normal(0.0, 1.0, len(T)), ch1=SOUND[name]) == []
