import numpy as np
import pytest

from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.ingest import series
from mrfit.ingest.meaning.sanity import channel_findings, relation_findings, shortened, shortening

DT = 1e-3
T = np.arange(4000) * DT
SINE = np.sin(2 * np.pi * 5 * T)


def _kinds(**channels: Array) -> list[tuple[str, str]]:
    record = Recording("a", "a.csv", "", "delimited", DT, 0.0, channels, dict.fromkeys(channels, ""))
    return [(f.kind, f.channel) for f in (*channel_findings(record), *relation_findings(record))]


def _rounded(values: Array, bits: int) -> Array:
    return np.round(values * 2 ** (bits - 1)) / 2 ** (bits - 1)


@pytest.mark.parametrize("bits", [8, 12, 24])
def test_a_sound_sine_raises_nothing(bits: int) -> None:
    noise = np.random.default_rng(0).normal(0, 0.01, len(T))
    assert _kinds(ch1=_rounded(SINE, bits)) == []
    assert _kinds(ch1=_rounded(SINE + noise, bits)) == []


@pytest.mark.parametrize("values", [np.sign(SINE), np.arcsin(SINE), np.sign(SINE) + 0.01 * SINE])
def test_square_and_triangle_waves_are_not_clipped(values: Array) -> None:
    assert _kinds(ch1=_rounded(values, 8)) == []


def test_constant_and_dead_channels() -> None:
    flicker = np.random.default_rng(0).integers(0, 2, len(T)) * 0.01
    assert _kinds(ch1=np.full(len(T), 3.0), ch2=flicker) == [("constant", "ch1"), ("dead", "ch2")]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_clipped_channel_with_the_time_it_begins(side: float) -> None:
    values = side * np.minimum(_rounded(SINE, 10), 0.8)
    record = Recording("a", "a.csv", "", "delimited", DT, 0.0, {"ch1": values}, {"ch1": "V"})
    (finding,) = channel_findings(record)
    assert (finding.kind, finding.channel) == ("clipped", "ch1")
    assert finding.at == pytest.approx(np.arcsin(0.8) / (2 * np.pi * 5), abs=2 * DT)


@pytest.mark.parametrize("wave", [np.sign(SINE), np.clip(5.0 * np.arcsin(SINE), -1.0, 1.0), np.tanh(5.0 * SINE)])
@pytest.mark.parametrize("noise", [0.02, 0.1])
def test_noise_that_is_cut_off_is_clipped_whatever_the_wave(wave: Array, noise: float) -> None:
    measured = wave + noise * np.random.default_rng(1).standard_normal(len(T))
    assert _kinds(force=_rounded(measured, 12)) == []
    assert _kinds(force=np.minimum(_rounded(measured, 12), 0.97)) == [("clipped", "force")]
    assert _kinds(force=np.maximum(_rounded(measured, 12), -0.97)) == [("clipped", "force")]


HOLDS = np.clip(5.0 * np.arcsin(SINE), -1.0, 1.0)


def _left(gap: int, times: int, depth: float, also: int = 0) -> Array:
    """Holds that are left ``times`` for ``gap`` samples by about a depth, and ``also`` for longer."""
    rng, values = np.random.default_rng(2), HOLDS.copy()
    inside = np.flatnonzero((values == 1.0) & (np.roll(values, 8) == 1.0) & (np.roll(values, -20) == 1.0))
    for k, place in enumerate(inside[np.linspace(0, len(inside) - 1, times + also).astype(int)]):
        length = gap if k < times else 12
        values[place : place + length] -= np.minimum(depth * np.abs(rng.standard_normal(length)), 1.9)
    return values


@pytest.mark.parametrize(
    ("values", "clipped"),
    [
        (_left(2, 20, 0.02), True),
        # for longer than noise leaves a limit, seldom, or by most of the range
        (_left(5, 20, 0.02), True),
        (_left(6, 20, 0.02), False),
        (_left(2, 9, 0.02), False),
        (_left(2, 20, 1.2), False),
        (_left(2, 10, 0.02, also=45), False),
    ],
)
def test_a_hold_is_clipped_where_it_is_left_briefly_often_and_by_little(values: Array, clipped: bool) -> None:
    assert _kinds(force=values) == [("clipped", "force")] * clipped


@pytest.mark.parametrize("stretch", [1.0, 1.0003])
def test_a_hold_that_flickers_by_a_code_is_not_clipped(stretch: float) -> None:
    code = 2.0**-11
    uniform = code * np.random.default_rng(1).uniform(-0.5, 0.5, len(T))
    held = _rounded(HOLDS * (1.0 - 0.1 * code) + uniform, 12)
    # the top code holds most samples of the hold, and the next below it the others
    assert 0.02 < np.mean(held[HOLDS == 1.0] < held.max()) < 0.3
    assert _kinds(force=np.interp(T * stretch, T, held)) == []


def test_a_current_that_a_controller_keeps_at_its_limit_is_not_clipped() -> None:
    noise = 0.02 * np.random.default_rng(1).standard_normal(len(T))
    command = np.clip(np.sign(SINE) + noise + 1.0, 0.0, 2.0)
    assert ("clipped", "current") not in _kinds(current=command, force=100.0 * SINE)


def test_standing_still_at_the_beginning_is_no_clipping() -> None:
    assert _kinds(ch1=np.concatenate([np.full(500, -1.0), _rounded(-np.cos(2 * np.pi * 5 * T), 12)])) == []


def test_offset_is_said_of_alternating_channels_only() -> None:
    assert _kinds(current=SINE + 0.5, temperature=SINE + 40.0) == [("offset", "current")]


def test_a_position_that_never_passes_zero_is_said_with_what_moves_it() -> None:
    assert _kinds(displacement=SINE + 0.5) == [("offset", "displacement")]
    assert _kinds(displacement=SINE + 6.0) == [("away-from-zero", "displacement")]
    assert _kinds(current=SINE + 6.0) == [("offset", "current")]


def test_current_of_a_damper_is_never_about_zero() -> None:
    assert ("offset", "current") not in _kinds(current=SINE + 1.5, force=100.0 * SINE)
    assert ("offset", "force") in _kinds(current=SINE + 1.5, force=100.0 * SINE + 80.0)


def test_force_against_velocity() -> None:
    velocity = np.cos(2 * np.pi * 5 * T)
    assert _kinds(displacement=SINE, force=velocity) == []
    assert _kinds(displacement=SINE, force=-velocity) == [("sign", "force")]
    assert _kinds(displacement=100 * velocity, force=SINE) == [("sign", "force")]  # exchanged columns


def test_velocity_against_displacement() -> None:
    velocity = 2 * np.pi * 5 * np.cos(2 * np.pi * 5 * T)
    assert _kinds(displacement=SINE, velocity=velocity) == []
    assert _kinds(displacement=SINE, velocity=-velocity) == [("sign", "velocity")]
    assert _kinds(displacement=SINE, velocity=1000 * velocity) == [("velocity-differs", "velocity")]
    assert _kinds(displacement=SINE, velocity=SINE) == [("velocity-differs", "velocity")]


def test_flux_against_current() -> None:
    assert _kinds(current=SINE, flux=0.1 * SINE) == []
    assert _kinds(current=SINE, flux=-0.1 * SINE) == [("sign", "flux")]


@pytest.mark.parametrize(("lag", "kinds"), [(45, []), (5, []), (85, []), (-10, [("skew", "current")]), (200, 1)])
def test_current_against_voltage(lag: float, kinds: object) -> None:
    current = np.sin(2 * np.pi * 5 * T - np.radians(lag))
    expected = [("sign", "current")] if kinds == 1 else kinds
    assert _kinds(current=current, voltage=SINE) == expected


@pytest.mark.parametrize("level", [1.4, -0.02])
def test_a_held_level_that_carries_noise_or_ripple_swings_about_nothing(level: float) -> None:
    noise = np.random.default_rng(0).normal(0.0, abs(level) / 50, len(T))
    assert _kinds(current=level + noise) == []
    assert _kinds(voltage=level * (1.0 + 0.01 * SINE)) == []


@pytest.mark.parametrize(("swing", "kind"), [(0.03, "away-from-zero"), (0.3, "away-from-zero"), (3.0, "offset")])
def test_a_swing_about_a_level_is_an_offset_even_under_noise(swing: float, kind: str) -> None:
    noise = np.random.default_rng(0).normal(0.0, 0.1 * swing, len(T))
    assert _kinds(displacement=1.0 + swing * SINE + noise) == [(kind, "displacement")]


def test_a_random_motion_whose_ends_are_not_alike_swings_about_zero() -> None:
    bump = np.exp(-0.5 * ((T - T.mean()) / (0.02 * np.ptp(T))) ** 2)
    motion = 0.3 * SINE + bump - bump.mean()
    assert _kinds(displacement=motion) == []
    assert _kinds(displacement=motion + 0.6) == [("away-from-zero", "displacement")]


def test_a_long_recording_is_judged_over_all_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is odd late in a log, or only in the phase of its channels, is found in chunks as it is in the whole."""
    late = np.where(T > 3.0, np.minimum(SINE, 0.8), 0.7 * SINE)
    channels = {"current": np.sin(2 * np.pi * 5 * T + 0.3), "voltage": SINE, "ch3": late, "ch4": np.ones(len(T))}
    record = Recording("a", "a.csv", "", "delimited", DT, 0.0, channels, dict.fromkeys(channels, ""))
    monkeypatch.setattr(series, "SERIES_CHUNK", 700)
    short = shortened(record)
    assert short.samples == 666 and short.dt == pytest.approx(6 * DT)
    found = [*channel_findings(record), *relation_findings(short), *shortening(record, short)]
    assert [(f.kind, f.channel) for f in found] == [
        ("clipped", "ch3"),
        ("constant", "ch4"),
        ("skew", "current"),
        ("judged-on-means", ""),
    ]
    assert found[0].at == pytest.approx(3.0, abs=0.06)
    assert "means over 6 samples" in found[-1].text


def test_a_recording_of_a_chunk_or_less_is_not_shortened() -> None:
    record = Recording("a", "a.csv", "", "delimited", DT, 0.0, {"ch1": SINE}, {"ch1": ""})
    short = shortened(record)
    np.testing.assert_array_equal(short.channels["ch1"], SINE)
    assert shortening(record, short) == []


def _spoilt(values: Array, samples: dict[int, float]) -> Array:
    spoilt = values.copy()
    for place, value in samples.items():
        spoilt[place] = value
    return spoilt


@pytest.mark.parametrize("samples", [{1234: 1e12}, {1234: -4e4}, {50: 1e12, 51: 1e12, 3999: -1e9}])
@pytest.mark.parametrize("values", [SINE, 24.0 + 0.01 * SINE, np.full(len(T), 5.0)])
def test_samples_out_of_all_proportion_are_said(values: Array, samples: dict[int, float]) -> None:
    record = Recording("a", "a.csv", "", "delimited", DT, 0.0, {"ch1": _spoilt(values, samples)}, {"ch1": "V"})
    (finding,) = channel_findings(record)
    assert (finding.kind, finding.at) == ("outlier", pytest.approx(min(samples) * DT))
    assert finding.text.startswith(f"{len(samples)} sample")


def test_spikes_of_switching_and_pulses_are_no_outliers() -> None:
    """A coil switched off kicks back, once or at every edge; a trigger is one sample long."""
    noise = np.random.default_rng(0).normal(0.0, 0.01, len(T))
    every = _spoilt(12.0 * np.sign(SINE) + noise, dict.fromkeys(range(99, 4000, 100), 400.0))
    once = _spoilt(0.1 * SINE + noise, {2000: 60.0, 2001: -25.0})
    trigger = _spoilt(np.zeros(len(T)), {100: 5.0})
    tails = np.random.default_rng(1).standard_t(2.0, len(T))
    for values in (every, once, trigger, tails):
        assert "outlier" not in {kind for kind, _ in _kinds(ch1=values)}


def test_an_outlier_late_in_a_long_recording_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(series, "SERIES_CHUNK", 700)
    assert _kinds(ch1=_spoilt(SINE, {3501: 1e12})) == [("outlier", "ch1")]
