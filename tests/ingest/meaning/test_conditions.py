from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.recording import Recording
from mrfit.errors import ConfigError
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.meaning.conditions import (
    condition_words,
    conditions_of,
    from_name,
    main_frequency,
    name_expression,
    wording,
)
from mrfit.ingest.refusal import Refusal

PATTERN = "{amplitude:mm}mm{frequency:Hz}Hz{current:A}A"


def _record(source: str = "x/25mm0x5Hz0x75A.txt", amplitude: float = 0.025, frequency: float = 0.5) -> Recording:
    time = np.arange(4000) * 5e-3
    x = amplitude * np.sin(2 * np.pi * frequency * time)
    return Recording("a", source, "", "delimited", 5e-3, 0.0, {"displacement": x}, {"displacement": "m"})


@pytest.mark.parametrize(
    ("stem", "pattern", "found"),
    [
        ("25mm0x5Hz0x75A", PATTERN, {"amplitude": 0.025, "frequency": 0.5, "current": 0.75}),
        ("2mm5Hz1A", PATTERN, {"amplitude": 0.002, "frequency": 5.0, "current": 1.0}),
        ("run7_2p5mm5Hz1,25A_b", PATTERN, {"amplitude": 0.0025, "frequency": 5.0, "current": 1.25}),
        ("T68F", "T{temperature:degF}F", {"temperature": pytest.approx(20.0)}),
        ("coil_05Hz_3A", "coil_{frequency:Hz}Hz_{amplitude:A}A", {"frequency": 5.0, "amplitude": 3.0}),
        ("t1_1_1_s5_n10_150psi", "*_s{speed}_n{cycles}_*", {"speed": 5.0, "cycles": 10.0}),
        ("calibration", PATTERN, {}),
        ("run-2Hz-1A", "{frequency:Hz}Hz*{current:A}A", {"frequency": 2.0, "current": 1.0}),
        ("run-2Hz-1A", "{frequency:Hz}Hz-{current:A}A", {"frequency": 2.0, "current": 1.0}),
        ("coil_2-5mm_2Hz", "{amplitude:mm}mm_{frequency:Hz}Hz", {"amplitude": 0.005, "frequency": 2.0}),
        ("2Hz-1A", "{frequency:Hz}Hz{current:A}A", {}),  # the pattern does not say what the hyphen is
        ("amp_-1A", "amp*{current:A}A", {"current": -1.0}),
        ("amp_-1A", "{current:A}A", {"current": -1.0}),
        ("-1A", "{current:A}A", {"current": -1.0}),
        ("I=-1A", "{current:A}A", {"current": -1.0}),
        ("0.5Hz--1A", "{frequency:Hz}Hz*{current:A}A", {"frequency": 0.5, "current": -1.0}),
        ("0.5Hz--1A", "{frequency:Hz}Hz-{current:A}A", {"frequency": 0.5, "current": -1.0}),
    ],
)
def test_conditions_in_names(stem: str, pattern: str, found: dict[str, float]) -> None:
    assert from_name(stem, pattern) == pytest.approx(found)


@pytest.mark.parametrize(
    ("stem", "pattern", "said"),
    [
        ("5bar-2Hz", "{pressure:bar}bar-{frequency:Hz}Hz", {"pressure": "5bar"}),
        ("5bar-2mm", "{pressure:bar}bar-{gap:mm}mm", {"pressure": "5bar", "gap": "gap2mm"}),
        ("5bar-700kPa", "{inner:bar}bar-{outer:kPa}kPa", {"inner": "inner5bar", "outer": "outer700kPa"}),
        ("60C-0x5mmps2", "{temperature:C}C-{a:mm/s^2}mm", {"temperature": "60degC", "a": "0.5mmps2"}),
        ("5bar-3", "{pressure}bar-{specimen}", {}),
        ("calibration", "{pressure:bar}bar", {}),
    ],
)
def test_quantities_are_worded_as_the_name_has_them(stem: str, pattern: str, said: dict[str, str]) -> None:
    assert wording(stem, Rules(pattern=pattern)) == said
    assert wording(stem, Rules(pattern=pattern, condition=dict.fromkeys(said, 1.0))) == {}
    assert wording(stem, Rules()) == {}


@pytest.mark.parametrize(
    ("pattern", "words"),
    [
        ("no keys", "names no condition"),
        ("", "names no condition"),
        ("{a:blurb}", "unknown unit 'blurb'"),
        ("{a:mm}{a:mm}", "a occurs twice"),
        ("{frequency:mm}mm", "frequency cannot be in 'mm'; write a unit such as Hz"),
        ("{frequency:rpm}rpm", "frequency cannot be in 'rpm'"),  # a turn is no radian per second
        ("{current:V}V", "current cannot be in 'V'; write a unit such as A"),
        ("{Amplitude:mm}mm{frequency:Hz}Hz", "a brace opens no key"),
        ("{amplitude:mm}mm{frequency:Hz", "a brace opens no key"),
    ],
)
def test_bad_patterns_are_configuration_errors(pattern: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words) as error:
        name_expression(pattern)
    assert f"name pattern '{pattern}'" in str(error.value) and "\n" not in str(error.value)


def test_name_that_agrees_with_the_data() -> None:
    condition, findings = conditions_of(_record(), 0, 1, {}, Rules(pattern=PATTERN, resistance=2.5))
    assert condition["amplitude"] == pytest.approx(0.025)
    assert condition["measured_amplitude"] == pytest.approx(0.025, rel=0.01)
    assert condition["measured_frequency"] == pytest.approx(0.5, rel=0.01)
    assert condition["resistance"] == 2.5
    assert findings == []


def test_name_that_disagrees_is_kept_beside_what_was_measured() -> None:
    record = _record(amplitude=0.018, frequency=0.8)
    condition, findings = conditions_of(record, 0, 1, {}, Rules(pattern=PATTERN))
    assert condition["amplitude"] == 0.025
    assert condition["measured_amplitude"] == pytest.approx(0.018, rel=0.01)
    assert [f.kind for f in findings] == ["condition-differs", "condition-differs"]
    assert all(f.channel == "displacement" for f in findings)


def test_name_without_the_pattern_is_said() -> None:
    _, findings = conditions_of(_record("x/calibration.txt"), 0, 1, {}, Rules(pattern=PATTERN))
    assert [f.kind for f in findings] == ["condition-unknown"]


@pytest.mark.parametrize(
    ("key", "meant"),
    [("temprature", "temperature"), ("freqency", "frequency"), ("gap", ""), ("temperature_2", ""), ("temperature", "")],
)
def test_a_condition_that_is_nearly_a_known_one_is_said(key: str, meant: str) -> None:
    condition, findings = conditions_of(_record(), 0, 1, {}, Rules(condition={key: 25.0}))
    assert condition[key] == 25.0
    assert [f.kind for f in findings] == ["condition-unknown"] * bool(meant)
    assert not meant or f"did you mean '{meant}'?" in findings[0].text


def test_one_value_for_every_run() -> None:
    rules = Rules("map.toml", condition={"current": [0.0, 0.5], "temperature": 25.0})
    condition, _ = conditions_of(_record(), 1, 2, {}, rules)
    assert condition == {"current": 0.5, "temperature": 25.0}
    with pytest.raises(Refusal, match="holds 3 runs but condition.current lists 2"):
        conditions_of(_record(), 0, 3, {}, rules)


def test_stated_current_is_checked_against_a_measured_one() -> None:
    record = _record()
    channels = {**record.channels, "current": np.full(4000, 0.5)}
    _, findings = conditions_of(replace(record, channels=channels), 0, 1, {}, Rules(pattern=PATTERN))
    assert [f.kind for f in findings] == ["condition-differs"]
    assert "0.75" in findings[0].text and "0.5" in findings[0].text


@pytest.mark.parametrize("frequency", [0.73, 5.0, 31.7])
def test_main_frequency_between_the_lines_of_the_spectrum(frequency: float) -> None:
    time = np.arange(900) * 5e-3
    assert main_frequency(3.0 + np.sin(2 * np.pi * frequency * time), 5e-3) == pytest.approx(frequency, rel=5e-3)


@pytest.mark.parametrize(
    ("condition", "channels", "words"),
    [
        ({"amplitude": 0.025, "measured_amplitude": 0.0244}, ["displacement"], "amplitude 25 mm (measured 24.4 mm)"),
        (
            {"amplitude": 2.0, "frequency": 5.0, "measured_frequency": 5.01},
            ["current"],
            "amplitude 2 A, frequency 5 Hz",
        ),
        ({"current": 0.5, "temperature": 40.0, "gap": 3.0}, ["force"], "current 0.5 A, temperature 40 °C, gap 3"),
        ({}, ["force"], ""),
    ],
)
def test_a_condition_is_said_with_units_and_what_the_data_say(condition, channels, words):
    assert condition_words(condition, channels) == words
