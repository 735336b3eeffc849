"""Recordings made in memory: units of columns, symbols of one letter, conditions in words, files of a pattern."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import mrfit
from mrfit.api.recordings import Recording
from mrfit.errors import ConfigError, DataError

K = np.arange(200)
TIME, WAVE = 0.01 * K, np.sin(0.3 * K)


def frame(**columns: Any) -> pd.DataFrame:
    return pd.DataFrame({"time": TIME, **columns})


@pytest.mark.parametrize(
    ("columns", "units", "channel", "factor"),
    [
        ({"force": WAVE}, None, "force", 1.0),
        ({"force (kN)": WAVE}, None, "force", 1e3),
        # what is given stands over what the name says
        ({"force (kN)": WAVE}, {"force (kN)": "mN"}, "force", 1e-3),
        ({"x": WAVE}, {"x": "mm"}, "displacement", 1e-3),
        ({"F": WAVE, "x": WAVE}, None, "force", 1.0),
    ],
)
def test_numbers_of_a_column_are_in_the_unit_that_is_said_of_it(
    columns: dict[str, Any], units: dict[str, str] | None, channel: str, factor: float
) -> None:
    log = Recording.from_frame(frame(**columns), units=units)
    np.testing.assert_allclose(log.channels[channel], factor * WAVE, rtol=1e-12)


@pytest.mark.parametrize(
    ("columns", "channels"),
    [
        # v is a velocity beside a force, a voltage beside a current
        (("v", "F"), {"velocity", "force"}),
        (("v", "i"), {"voltage", "current"}),
    ],
)
def test_a_letter_of_several_channels_is_told_by_the_others(columns: tuple[str, ...], channels: set[str]) -> None:
    log = Recording.from_frame(frame(**{name: WAVE + k for k, name in enumerate(columns)}))
    assert set(log.channels) == channels
    said = {f.channel for f in log.findings if f.kind == "unit-assumed"}
    assert said == {c for c, name in zip(log.channels, columns, strict=False) if c != name and len(name) == 1}


def test_times_of_a_named_column_are_in_its_unit() -> None:
    table = pd.DataFrame({"clock": 10.0 * K, "time": WAVE, "force": WAVE})
    log = Recording.from_frame(table, time="clock", units={"clock": "ms"})
    # another column of times is none of the channels
    assert log.dt == pytest.approx(0.01) and list(log.channels) == ["force"]
    assert Recording.from_frame(table, time="clock").dt == pytest.approx(10.0)


def test_another_column_that_is_called_as_times_are_is_said_to_be_left_out() -> None:
    time = np.arange(100) / 50.0
    table = pd.DataFrame({"T": 20.0 + time, "t": time, "force (N)": np.sin(time)})
    log = Recording.from_frame(table, time="t")
    assert log.dt == pytest.approx(0.02) and set(log.channels) == {"force"}
    assert [f.text for f in log.findings if f.kind == "not-read"] == [
        "'T': called as times are beside 't', and left out; units={…} tells what they are"
    ]
    told = Recording.from_frame(table, time="t", units={"T": "degC"})
    assert set(told.channels) == {"temperature", "force"} and not any(f.kind == "not-read" for f in told.findings)


def test_two_columns_of_one_name_are_refused() -> None:
    table = pd.DataFrame(np.column_stack([TIME, WAVE, WAVE]), columns=["time", "force", "force"])
    with pytest.raises(DataError, match="two columns have one name; rename one of them"):
        Recording.from_frame(table)


def test_a_recording_says_its_samples_its_units_and_its_condition() -> None:
    known = {"current": 1.23456, "frequency": 2.0}
    log = Recording.from_arrays(dt=0.01, name="press 7", force=WAVE, count=WAVE, condition=known)
    text = repr(log)
    assert text.startswith("<Recording 'press-7': 200 samples of 0.01 s; force (N), count")
    assert text.endswith("; current 1.235, frequency 2>")
    assert "count (" not in text
    plain = repr(Recording.from_arrays(dt=0.01, force=WAVE))
    assert plain == "<Recording 'recording': 200 samples of 0.01 s; force (N)>"


@pytest.mark.parametrize(
    ("condition", "name"),
    [({}, "recording"), ({"current": 0.5}, "current-0.5"), ({"frequency": 2.0, "current": 1}, "frequency-2-current-1")],
)
def test_a_log_without_a_name_is_called_by_its_condition(condition: dict[str, float], name: str) -> None:
    assert Recording.from_frame(frame(force=WAVE), condition=condition).id == name


def test_a_frame_of_a_recording_makes_it_again() -> None:
    log = Recording.from_arrays(dt=0.01, displacement=0.01 * WAVE, force=WAVE)
    table = log.to_frame()
    assert table.index.name == "time" and table.index[-1] == pytest.approx(1.99)
    again = Recording.from_frame(table)
    assert again.dt == pytest.approx(0.01) and list(again.channels) == list(log.channels)
    np.testing.assert_allclose(again.channels["displacement"], 0.01 * WAVE, atol=1e-15)


def test_a_name_that_is_there_is_no_pattern(tmp_path: Path) -> None:
    rows = "time (s),force (N)\n" + "".join(f"{t:.2f},{f:.6f}\n" for t, f in zip(TIME, WAVE, strict=True))
    others = "time (s),force (N)\n" + "".join(f"{t:.2f},{2.0 * f:.6f}\n" for t, f in zip(TIME, WAVE, strict=True))
    (tmp_path / "run[1].csv").write_text(rows)
    (tmp_path / "run1.csv").write_text(others)
    # as a pattern [1] means run1.csv
    (found,) = mrfit.read(tmp_path / "run[1].csv", progress=False)
    assert found.source.endswith("run[1].csv")
    assert len(mrfit.read(tmp_path / "run*.csv", progress=False)) == 2
    with pytest.raises(ConfigError, match=r"matches nothing; check the folder and the ending"):
        mrfit.read(tmp_path / "*.txt", progress=False)
    with pytest.raises(ConfigError, match="there is no option 'patern': did you mean pattern"):
        mrfit.read(tmp_path / "run1.csv", patern="{current:A}A")


@pytest.mark.parametrize("names", [("T (degC)", "time (s)"), ("time (s)", "T (degC)"), ("T", "t")])
def test_a_temperature_called_as_times_are_is_no_clock(names: tuple[str, str]) -> None:
    warmth = np.linspace(20.0, 21.0, len(K))
    columns = {n: warmth if n[0] == "T" else TIME for n in names}
    units = None if "T (degC)" in names else {"T": "degC", "t": "s"}
    clock = next(n for n in names if n[0] == "t")
    for time in (None, clock):
        found = Recording.from_frame(pd.DataFrame({**columns, "force": WAVE}), units=units, time=time)
        assert found.dt == pytest.approx(0.01)
        assert found.channels["temperature"] == pytest.approx(warmth)
