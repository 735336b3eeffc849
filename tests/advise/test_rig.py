"""The table [rig]: units, what is missing, what is impossible."""

from pathlib import Path

import pytest

from mrfit.advise.rig import current_reach, motion_reach, read_rig, rig_beside, rig_of
from mrfit.errors import ConfigError
from mrfit.ingest.meaning.channel_map import load_map

PRESS = {"seconds": 10, "stroke": "50 mm", "speed": "200 mm/s", "frequency": 7, "current": 2.8}


def test_quantities_are_numbers_in_si_or_have_a_unit():
    rig = rig_of({**PRESS, "temperature": [20, 50], "force": "4 kN", "current_rate": 100})
    assert (rig.stroke, rig.speed, rig.force) == pytest.approx((0.05, 0.2, 4000.0))
    assert rig.frequency == (0.0, 7.0) and rig.current == (0.0, 2.8) and rig.temperature == (20.0, 50.0)


@pytest.mark.parametrize(
    ("written", "read"),
    [("3 A", (0.0, 3.0)), ("500 mA", (0.0, 0.5)), (3, (0.0, 3.0)), (["0 A", "2 A"], (0.0, 2.0)), ([1, 2], (1.0, 2.0))],
)
def test_a_range_may_be_its_highest_value_alone_with_a_unit(written, read):
    rig = rig_of({**PRESS, "current": written, "frequency": "4 Hz"})
    assert rig.current == pytest.approx(read) and rig.frequency == (0.0, 4.0)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"strok": 1}, "strok"),
        ({"stroke": "5 kg"}, "stroke"),
        ({"stroke": -1.0}, "stroke"),
        ({"seconds": "soon"}, "seconds"),
        ({"frequency": [5, 2]}, "frequency"),
        ({"current": float("nan")}, "current"),
        ({"current": "3 N"}, "key 'current' takes a number, or a number with a unit of the kind of A, not '3 N'"),
    ],
)
def test_a_wrong_key_or_value_is_named(changed, said):
    with pytest.raises(ConfigError, match=said):
        rig_of({**PRESS, **changed}, "press.toml")


def test_what_a_motion_needs_is_asked_for():
    with pytest.raises(ConfigError, match="stroke"):
        motion_reach(rig_of({"seconds": 10, "speed": 0.2}), 8, 500.0)
    with pytest.raises(ConfigError, match="speed"):
        motion_reach(rig_of({"seconds": 10, "stroke": 0.1}), 8, 500.0)
    with pytest.raises(ConfigError, match="current"):
        current_reach(rig_of({"seconds": 10}), 8, 500.0)
    with pytest.raises(ConfigError, match="current_rate"):
        current_reach(rig_of({"seconds": 10, "current": 3}), 8, 500.0)


def test_limits_that_leave_no_test_are_refused():
    with pytest.raises(ConfigError, match=r"leaves no test: 8 cycles take 8 Hz or more in 1 s"):
        motion_reach(rig_of({**PRESS, "seconds": 1}), 8, 500.0)


def test_the_band_follows_speed_acceleration_sampling_and_length():
    reach = motion_reach(rig_of({"seconds": 20, "stroke": 0.1, "speed": 0.1}), 8, 1e4)
    assert (reach.amplitude, reach.low) == pytest.approx((0.05, 0.4))
    assert reach.high == pytest.approx(0.1 / (2 * 3.141592653589793 * 0.001))
    assert motion_reach(rig_of({**PRESS, "frequency": 100}), 8, 200.0).high == pytest.approx(8.0)


@pytest.mark.parametrize(
    ("current", "amplitude"), [(3.0, 3.0), ([0.0, 3.0], 3.0), ([-2.0, 3.0], 2.0), ([-5.0, 3.0], 3.0)]
)
def test_a_coil_is_driven_to_both_sides_within_both_ends_of_its_current(current: object, amplitude: float) -> None:
    reach = current_reach(rig_of({"seconds": 10, "current": current, "current_rate": 50}), 8, 1e4)
    assert (reach.amplitude, reach.speed) == (amplitude, 50.0)
    assert reach.high == pytest.approx(50.0 / (2.0 * 3.141592653589793 * 0.02 * amplitude))
    for own, said in (([-3.0, -1.0], "-3 to -1 A"), ([0.5, 3.0], "0.5 to 3 A")):
        with pytest.raises(ConfigError, match=f"current of {said}: a coil is driven to both sides of 0; write"):
            current_reach(rig_of({"seconds": 10, "current": own, "current_rate": 50}), 8, 1e4)


def test_limits_are_read_from_a_channel_map_too(tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert rig_beside([]) is None
    logs = tmp_path / "logs"
    logs.mkdir()
    text = 'rate = 500\n[channels]\nforce = {column = "F"}\n[rig]\nseconds = 10\nstroke = "5 cm"\n'
    (logs / "mrfit.toml").write_text(text)
    path = rig_beside([str(logs / "a.csv")])
    assert path is not None and read_rig(path).stroke == pytest.approx(0.05)
    assert load_map(path).rate == 500.0


def test_a_file_without_the_table_or_no_file_is_said(tmp_path: Path):
    (tmp_path / "a.toml").write_text("rate = 5\n")
    with pytest.raises(ConfigError, match=r"a.toml: no table \[rig\]"):
        read_rig(tmp_path / "a.toml")
    with pytest.raises(ConfigError, match="No such file"):
        read_rig(tmp_path / "b.toml")
    (tmp_path / "c.toml").write_text("rate = = 5\n")
    with pytest.raises(ConfigError, match="is not valid TOML"):
        read_rig(tmp_path / "c.toml")
