"""A test in words and as a drive, what a fit gains in words, and the table of a rig to copy."""

import tomllib
from typing import Any

import numpy as np
import pytest

from mrfit.advise.drives import Test
from mrfit.advise.rig import LEAST_SECONDS, rig_lines, rig_of
from mrfit.advise.specimen import Channels
from mrfit.advise.words import drive_csv, listed, number, of_parameters, of_rivals, test_words
from mrfit.core.recording import Segment
from mrfit.io.schemas.advice import AdvisedTest, Pair, Width

test_words.__test__ = False
FORCE, TORQUE, FLUX = map(Channels.of, ("force", "torque", "flux"))


def shown(kind: str, **numbers: float) -> Test:
    current = np.full(4, 1.0) if "current" in numbers else np.empty(0)
    return Test(kind, 0.25, np.arange(12.0).reshape(3, 4), current, np.empty(0), numbers=numbers)


SINE = {"frequency": 2.5, "amplitude": 0.0125}


@pytest.mark.parametrize(
    ("kind", "more", "said"),
    [
        ("sine", {}, "a sine of 2.5 Hz and 12.5 mm"),
        ("sine", {"current": 0.75}, "a sine of 2.5 Hz and 12.5 mm at 0.75 A"),
        ("triangle", {}, "a triangle of 2.5 Hz and 12.5 mm"),
        ("sweep", {"to": 20.0}, "a sweep from 2.5 to 20 Hz at constant speed, up to 12.5 mm"),
        ("sweep", {"to": 20.0, "current": 1.0}, "a sweep from 2.5 to 20 Hz at constant speed, up to 12.5 mm at 1 A"),
        (
            "steps",
            {"current": 2.0, "low": 0.5, "dwell": 0.3333},
            "a sine of 2.5 Hz and 12.5 mm under a current stepped between 0.5 and 2 A about every 0.333 s",
        ),
        ("repeat", {"wait": 12.34}, "a sine of 2.5 Hz and 12.5 mm, 12.3 s of rest, and the same again"),
        ("warm-up", {"current": 1.0}, "a sine of 2.5 Hz and 12.5 mm at 1 A, once cold and once warm"),
    ],
)
def test_an_operator_is_told_shape_size_and_current(kind: str, more: dict[str, float], said: str) -> None:
    assert test_words(shown(kind, **SINE, **more), FORCE) == said


def test_a_motion_is_told_in_the_unit_of_what_moves() -> None:
    assert test_words(shown("sine", **SINE), TORQUE).endswith("and 0.0125 rad")
    assert test_words(shown("sine", **SINE), FLUX).endswith("and 0.0125 A")


@pytest.mark.parametrize(("value", "text"), [(1234.5, "1230"), (0.00012345, "0.000123"), (2.0, "2"), (9.996, "10")])
def test_numbers_have_three_digits(value: float, text: str) -> None:
    assert number(value) == text


def columns(test: Test, channels: Channels, **driven: float) -> dict[str, list[str]]:
    head, *rows = drive_csv(test, channels, {n: np.full(4, v) for n, v in driven.items()}).splitlines()
    cells = [row.split(",") for row in rows]
    return {name: [row[k] for row in cells] for k, name in enumerate(head.split(","))}


def test_a_drive_is_time_motion_and_rate_with_the_current_beside_it() -> None:
    found = columns(shown("sine", **SINE, current=1.0), FORCE, current=1.0, temperature=20.0, humidity=3.0)
    assert [*found] == ["time [s]", "displacement [m]", "velocity [m/s]", "current [A]"]
    assert found["time [s]"] == ["0.0", "0.25", "0.5", "0.75"]
    assert found["velocity [m/s]"] == ["4.0", "5.0", "6.0", "7.0"] and found["current [A]"] == ["1.0"] * 4
    assert [*columns(shown("sine", **SINE), FORCE, current=1.0)] == [*found][:3]


def test_a_drive_of_a_coil_is_its_current_once_and_one_that_is_warmed_has_its_temperature() -> None:
    assert [*columns(shown("sine", **SINE), FLUX)] == ["time [s]", "current [A]"]
    warm = Test("warm-up", 0.25, np.zeros((3, 4)), np.empty(0), np.ones(4))
    assert columns(warm, FORCE, temperature=60.0)["temperature [degC]"] == ["60.0"] * 4


def test_no_number_of_a_drive_is_minus_nought() -> None:
    still = Test("sine", 0.25, np.full((3, 4), -1e-13), np.empty(0), np.empty(0))
    assert columns(still, FORCE)["displacement [m]"] == ["0.0"] * 4


@pytest.mark.parametrize(("words", "said"), [(["a"], "a"), (["a", "b"], "a or b"), (["a", "b", "c"], "a, b or c")])
def test_words_in_a_list(words: list[str], said: str) -> None:
    assert listed(words, "or") == said


def advised(**given: Any) -> AdvisedTest:
    about: dict[str, Any] = {
        "kind": "sine",
        "text": "a sine",
        "numbers": {},
        "seconds": 10.0,
        "waiting": 0.0,
        "worth": 1.0,
    }
    return AdvisedTest(**{**about, **given})


def width(before: float | None, after: float | None) -> Width:
    return Width(name="c", unit="N*s/m", value=1.0, before=before, after=after)


def test_what_a_fit_gains_is_the_geometric_mean_of_the_shares_that_are_known() -> None:
    said = of_parameters(
        [width(1.0, 0.9), width(2.0, 0.2), width(None, 3.0), width(3.0, None), width(0.0, 1.0)], advised()
    )
    # of 0.9 and 0.1
    assert "Run a sine, 10 s: intervals shrink to 30 % of their width, in the geometric mean." in said[0]
    [open_one] = of_parameters([width(None, 3.0)], advised(waiting=600.0))
    assert open_one == "Run a sine, 10 s and 600 s to warm it: the data there are leave every parameter open."


def test_a_second_test_is_told_and_where_no_pair_separates_none_is() -> None:
    pair = Pair(names=("a", "b"), before=0.5, separable=True)
    said = of_rivals([pair], [advised(distances=(5.0,))], advised(text="another", seconds=7.0))
    assert said[1] == "Then run another, 7 s, so that a test of this kind can be held out."
    alike = [Pair(names=n, before=0.5, separable=False) for n in (("a", "b"), ("a", "c"), ("b", "c"))]
    none = of_rivals(alike, [], None)
    assert "separates the rivals, a, b and c:" in none[0] and len(none) == 2 and "wider limits" in none[1]


def test_the_pair_that_is_least_apart_is_named_with_what_the_data_say_of_it() -> None:
    pairs = [Pair(names=n, before=b, separable=True) for n, b in ((("a", "b"), 0.5), (("c", "d"), 0.25))]
    [said] = of_rivals(pairs, [advised(distances=(50.0, 20.0))], None)
    assert "puts a, b, c and d at least 20 standard errors apart (c and d); in the data there are it is 0.25." in said


def segment(drive: str = "displacement", frequency: float = 2.0, amplitude: float = 0.01, **given: Any) -> Segment:
    about = {"id": "a#1", "condition": "c", "recording": "a", "start": 0, "stop": 9, "warm_up": 0, "waveform": "sine"}
    numbers = {"offset": 0.0, "cycles": 6, "current": np.nan, "temperature": np.nan, "role": "train"}
    return Segment(**{**about, **numbers, "drive": drive, "frequency": frequency, "amplitude": amplitude, **given})


def copied(*segments: Segment) -> dict[str, Any]:
    """The table that is proposed, as TOML reads it."""
    return tomllib.loads("\n".join(rig_lines(segments)))["rig"]  # type: ignore[no-any-return]


def test_a_rig_is_proposed_by_the_widest_the_fastest_and_the_longest_test() -> None:
    found = copied(
        segment(), segment(frequency=0.25, amplitude=0.02, current=1.5), segment(frequency=8.0, amplitude=0.004)
    )
    # 6 cycles of 0.25 Hz, twice 20 mm, and 4 mm at 8 Hz
    assert found == {"seconds": 24, "stroke": "40 mm", "speed": "201 mm/s", "current": [0.0, 1.5]}
    rig = rig_of(found)
    assert rig.stroke == pytest.approx(0.04) and rig.speed == pytest.approx(0.201) and rig.current == (0.0, 1.5)


def test_a_rotating_bench_and_a_coil_have_limits_of_their_own() -> None:
    assert copied(segment("angle", amplitude=0.5)) == {
        "seconds": LEAST_SECONDS, "stroke": "1 rad", "speed": "6.28 rad/s"
    }  # fmt: skip
    assert copied(segment("current", 5.0, 2.0), segment("current", 20.0, 1.0)) == {
        "seconds": LEAST_SECONDS, "frequency": 20.0, "current": [0.0, 2.0]
    }  # fmt: skip


def test_tests_at_rest_propose_no_motion_and_currents_below_nought_their_range() -> None:
    still = segment(frequency=0.0, amplitude=0.0)
    assert copied(still, segment(current=-1.0), segment(current=2.0))["current"] == [-1.0, 2.0]
    assert copied(still) == {"seconds": LEAST_SECONDS} == copied()
    assert "current" not in copied(segment(current=0.0))
    assert "speed" not in copied(segment(frequency=0.0)) and "stroke" in copied(segment(frequency=0.0))
