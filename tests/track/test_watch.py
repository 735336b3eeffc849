"""A watched test stops when its intervals are reached, and what it says then holds."""

import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from mrfit.api.recordings import Recording
from mrfit.cli.main import app
from mrfit.errors import ConfigError, DataError
from mrfit.io.schemas.fit import Quantity
from mrfit.settings.watch import Settings
from mrfit.track.watch import LookAtTest, WatchedValue, replayed, watch, widened

FY, C = 250.0, 900.0


def record(cycles: int, noise: float = 5.0) -> Recording:
    t = np.arange(100 * cycles) / 100.0
    x, v = 0.01 * np.sin(2 * np.pi * t), 0.02 * np.pi * np.cos(2 * np.pi * t)
    force = FY * np.tanh(60.0 * v) + C * v + noise * np.random.default_rng(3).standard_normal(len(t))
    return Recording.from_arrays(dt=0.01, name="test", displacement=x, velocity=v, force=force)


def test_it_stops_when_the_planted_values_are_known() -> None:
    looks = list(watch(replayed(record(24)), "tanh", Settings(within=6.0, parameters=("fy", "c"))))
    last = looks[-1]
    assert last.reached and 4 <= last.cycles < 20
    assert not any(look.reached for look in looks[:-1])
    for value, planted in zip(last.values, (FY, C), strict=True):
        assert value.low is not None and value.high is not None and value.low <= planted <= value.high
        assert (value.high - value.low) / 2.0 <= 0.06 * value.value


def test_more_cycles_are_asked_where_the_intervals_are_wide() -> None:
    looks = list(watch(replayed(record(12)), "tanh", Settings(within=0.5, parameters=("c",))))
    last = looks[-1]
    assert not last.reached and last.needed is not None and last.needed > last.cycles
    # half the width takes four times the cycles
    (half,) = watch([record(12)], "tanh", Settings(within=0.25, parameters=("c",)))
    assert half.needed == pytest.approx(4 * last.needed, rel=0.05)


def test_values_of_another_look_that_an_interval_does_not_hold_are_named() -> None:
    def look(value: float, low: float | None) -> LookAtTest:
        return LookAtTest(4, 4.0, [WatchedValue("c", "N*s/m", value, low, 2.0, True)], True, 4)

    assert look(1.5, 1.0).missed(look(1.9, None)) == set()
    assert look(1.5, 1.0).missed(look(2.1, None)) == {"c"}
    assert look(1.5, None).missed(look(2.1, None)) == set()


def test_an_interval_includes_what_the_parameter_drifts() -> None:
    def quantity(value: float, half: float) -> Quantity:
        return Quantity(name="fy", value=value, low=value - half, high=value + half)

    whole, prior = quantity(100.0, 0.1), 1.0
    exact = widened(whole, [quantity(101.0, 1e-6), quantity(99.0, 1e-6)], prior)
    assert exact.high is not None and exact.high - 100.0 == pytest.approx(np.hypot(0.1, 1.96 * 4.0), rel=1e-6)
    # what tells nothing of a drift leaves that which is expected before
    for halves in ([None, quantity(99.0, 1e-6)], [quantity(101.0, 1e6), quantity(99.0, 1e6)]):
        open_one = widened(whole, halves, prior)
        assert open_one.low is not None and 100.0 - open_one.low == pytest.approx(np.hypot(0.1, 1.96), rel=1e-6)


def test_what_cannot_be_watched_is_said() -> None:
    with pytest.raises(ConfigError, match="--parameters: tanh has no 'cc'"):
        list(watch([record(6)], "tanh", Settings(parameters=("cc",))))
    still = Recording.from_arrays(dt=0.01, displacement=np.zeros(300), force=np.ones(300))
    with pytest.raises(DataError, match="no steady cycles"):
        list(replayed(still))


def _written(folder: Path, made: Recording, name: str = "test.csv") -> Path:
    rows = np.column_stack([np.arange(made.samples) * made.dt, *made.channels.values()])
    header = ",".join(["time (s)", *(f"{n} ({u})" for n, u in made.units.items())])
    np.savetxt(folder / name, rows, fmt="%.9g", delimiter=",", header=header, comments="")
    return folder / name


@pytest.mark.parametrize(
    ("within", "code", "says"), [("10", 0, "Stop after"), ("0.01", 1, "the intervals are not reached in 8 s; about")]
)
@pytest.mark.parametrize("how", [[], ["--follow", "--patience", "0.5"]])
def test_the_command_ends_with_0_when_a_test_may_stop(
    within: str, code: int, says: str, how: list[str], tmp_path: Path
) -> None:
    log = _written(tmp_path, record(8))
    words = ["measure", "watch", str(log), "--model", "tanh", "--parameters", "fy", "--within", within, *how]
    ended = CliRunner().invoke(app, words)
    assert ended.exit_code == code
    assert says in (ended.output if code == 0 else str(ended.exception))
    assert ("the next look decides" in ended.output) == (code == 0) and " N" in ended.output


def test_one_log_of_a_folder_is_watched_and_named_and_the_others_are_said(tmp_path: Path) -> None:
    for name, noise in (("a.csv", 5.0), ("b.csv", 4.0)):
        _written(tmp_path, record(8, noise), name)
    words = ["--model", "tanh", "--parameters", "fy", "--within", "10"]
    several = CliRunner().invoke(app, ["measure", "watch", str(tmp_path), *words])
    assert f"a of {tmp_path} is watched; left out: b" in several.output
    assert f"a of {tmp_path} after" in several.output
    # the share is one of the time, cycles before the first steady one included
    stopped = re.search(r"after ([\d.]+) s", several.output)
    saved = re.search(r"(\d+) % of the log saved", several.output)
    assert stopped and saved and int(saved[1]) == round(100.0 * (1.0 - float(stopped[1]) / 8.0))
    one = CliRunner().invoke(app, ["measure", "watch", str(tmp_path / "b.csv"), *words])
    assert "left out" not in one.output and f"{tmp_path / 'b.csv'} after" in one.output
    grows = CliRunner().invoke(app, ["measure", "watch", str(tmp_path), *words, "--follow"])
    assert isinstance(grows.exception, ConfigError) and "is a folder" in str(grows.exception)


@pytest.mark.parametrize(("within", "refused"), [("0", True), ("1e-3", False)])
def test_an_interval_of_no_width_is_refused(within: str, refused: bool, tmp_path: Path) -> None:
    log = _written(tmp_path, record(5))
    ended = CliRunner().invoke(app, ["measure", "watch", str(log), "--model", "tanh", "--within", within])
    assert ("--within takes a number above 0, not 0" in str(ended.exception)) == refused
