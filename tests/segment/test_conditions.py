import itertools

import pytest

from mrfit.core.recording import Segment
from mrfit.errors import ConfigError
from mrfit.segment.conditions import assign_roles, hold_out_after, name_conditions

NAN = float("nan")


def segment(
    recording: str,
    frequency: float = 5.0,
    amplitude: float = 3.0,
    current: float = NAN,
    drive: str = "current",
    waveform: str = "sine",
    offset: float = 0.0,
    temperature: float = NAN,
) -> Segment:
    shape = (waveform, drive, frequency, amplitude, offset, 8 if frequency else 0)
    return Segment(f"{recording}#1", "", recording, 100, 900, 100, *shape, current, temperature, "train")


def names(
    segments: list[Segment],
    stated: dict[str, dict[str, float]] | None = None,
    wording: dict[str, dict[str, str]] | None = None,
) -> list[str]:
    return [s.condition for s in name_conditions(segments, stated or {}, wording)]


def test_a_coil_condition_is_named_by_frequency_and_amplitude() -> None:
    assert names([segment("a", 5.003, 2.984)]) == ["sine-5Hz-3A"]


def test_a_damper_condition_is_named_by_its_current_too() -> None:
    assert names([segment("a", 5.1, 0.00162, 0.2504, "displacement")]) == ["sine-5Hz-1.6mm-0.25A"]


def test_stated_values_name_what_the_data_agree_with() -> None:
    stated = {"a": {"frequency": 5.0, "amplitude": 0.002, "current": 0.25}}
    assert names([segment("a", 5.1, 0.00162, 0.25, "displacement")], stated) == ["sine-5Hz-2mm-0.25A"]
    stated = {"a": {"frequency": 1.5, "amplitude": 0.002, "current": 0.25}}
    assert names([segment("a", 7.03, 0.00102, 0.25, "displacement")], stated) == ["sine-7Hz-1mm-0.25A"]


def test_the_current_a_coil_log_states_is_its_amplitude() -> None:
    assert names([segment("a", 5.0, 2.8)], {"a": {"current": 3.0}}) == ["sine-5Hz-3A"]


def test_a_random_condition_has_no_frequency() -> None:
    assert names([segment("a", 0.0, 0.5, waveform="random")]) == ["random-0.5A"]


def test_a_bias_is_part_of_the_name() -> None:
    assert names([segment("a", offset=1.0), segment("b", offset=0.01)]) == ["sine-5Hz-3A-bias1A", "sine-5Hz-3A"]


def test_repeats_share_a_condition_and_others_do_not() -> None:
    repeats = [segment("a", 5.0, 2.949), segment("b", 5.01, 2.951), segment("c", 5.0, 3.5), segment("d", 6.0, 2.95)]
    found = names(repeats)
    assert found[0] == found[1]
    assert len(set(found)) == 3


def test_conditions_that_round_alike_get_more_digits() -> None:
    found = names([segment("a", 1.0, 0.0300), segment("b", 1.0, 0.0318)], {})
    assert len(set(found)) == 2
    hot = names([segment("a", temperature=25.0), segment("b", temperature=60.0)])
    assert hot == ["sine-5Hz-3A", "sine-5Hz-3A-60degC"]


def test_any_other_quantity_that_is_stated_makes_and_names_a_condition() -> None:
    logs = [segment(n, 2.0, 0.01, 1.0, "displacement") for n in "abc"]
    stated = {"a": {"pressure": 5e5, "measured_frequency": 2.01}, "b": {"pressure": 7e5}, "c": {"pressure": 5e5}}
    wording = {"a": {"pressure": "5bar"}, "b": {"pressure": "7bar"}, "c": {"pressure": "500kPa"}}
    high, low = "sine-2Hz-10mm-1A-7bar", "sine-2Hz-10mm-1A-500kPa"
    assert names(logs, stated, wording) == [low, high, low]
    assert names(logs[::-1], stated, wording) == [low, high, low]
    assert names(logs[:2], {"a": {"specimen": 1.0, "gap": 0.002}}) == [
        "sine-2Hz-10mm-1A-gap0.002-specimen1",
        "sine-2Hz-10mm-1A",
    ]


def test_a_stated_temperature_makes_conditions_closer_than_measured_ones_do() -> None:
    logs = [segment("a", temperature=20.0), segment("b", temperature=23.0)]
    assert names(logs) == ["sine-5Hz-3A", "sine-5Hz-3A"]
    stated = {"a": {"temperature": 20.0}, "b": {"temperature": 23.0}}
    assert names(logs, stated) == ["sine-5Hz-3A-20degC", "sine-5Hz-3A-23degC"]


def test_what_is_no_test_condition_does_not_part_repeats() -> None:
    logs = [segment("a", amplitude=0.05, drive="velocity"), segment("b", amplitude=0.05, drive="velocity")]
    stated = {"a": {"velocity": 0.05, "resistance": 2.0}, "b": {"resistance": 2.1, "measured_current": 0.3}}
    assert names(logs, stated) == ["sine-5Hz-50mmps", "sine-5Hz-50mmps"]


def grid() -> list[Segment]:
    return [segment(f"{f}-{a}", f, a) for f in (1.0, 5.0, 10.0) for a in (1.0, 2.0, 3.0, 4.0, 5.0)]


def test_names_do_not_depend_on_the_order_of_the_files() -> None:
    segments = [*grid(), segment("x", 5.0, 3.02), segment("y", 1.0, 3.0, offset=1.5)]
    expected = {s.id: s.condition for s in name_conditions(segments, {})}
    for k in (3, 7, 11):
        shuffled = segments[k:] + segments[:k][::-1]
        assert {s.id: s.condition for s in name_conditions(shuffled, {})} == expected


def roles(segments: list[Segment], holdout: str) -> dict[str, str]:
    return {s.condition: s.role for s in assign_roles(name_conditions(segments, {}), holdout)}


def test_a_quarter_is_held_out_from_inside_the_grid() -> None:
    held = sorted(c for c, role in roles(grid(), "auto").items() if role == "holdout")
    assert len(held) == 4
    assert {"sine-5Hz-2A", "sine-5Hz-3A", "sine-5Hz-4A"} <= set(held)
    assert roles(grid()[::-1], "auto") == roles(grid(), "auto")


def test_fewer_than_four_conditions_all_train() -> None:
    assert set(roles(grid()[:3], "auto").values()) == {"train"}


def test_records_without_cycles_are_tests_of_their_own() -> None:
    random = [segment(n, 0.0, a, waveform="random") for n, a in zip("abcd", (0.4, 0.5, 0.6, 0.501), strict=True)]
    assert list(roles(random, "auto").values()).count("holdout") == 1
    # four of five records share a condition: to hold it out would leave one to train on
    alike = [segment(n, 0.0, a, waveform="random") for n, a in zip("abcde", (0.4, 0.4, 0.4, 0.4, 0.6), strict=True)]
    assert sorted(roles(alike, "auto").values()) == ["holdout", "train"]
    assert [s.recording for s in assign_roles(name_conditions(alike, {}), "auto") if s.role == "holdout"] == ["e"]
    # one of three is too much, and a repeat of a sine is no other test
    assert set(roles(random[:3], "auto").values()) == {"train"}
    assert set(roles([*grid()[:3], segment("again", 1.0, 3.01)], "auto").values()) == {"train"}


@pytest.mark.parametrize("count", [4, 5, 8, 13])
def test_no_waveform_is_held_out_whole(count: int) -> None:
    mixed = grid()[:count] + [
        segment("r", 0.0, 0.5, waveform="random"),
        segment("q", 0.0, 5.0, waveform="quasi-static"),
    ]
    found = roles(mixed, "auto")
    assert found["random-0.5A"] == "train" and found["quasi-static-5A"] == "train"
    assert "holdout" in found.values()


@pytest.mark.parametrize("currents", [(0.0, 0.5, 1.0), (0.5, 1.0, 0.0), (1.0, 0.0, 0.5, 1.5), (0.0, 1.0)])
def test_every_level_of_current_and_temperature_keeps_a_test(currents: tuple[float, ...]) -> None:
    """No two tests are of one frequency, so that those at the least current may lie inside the grid."""
    tests = [(f, i, t) for f, t in ((0.5, 20.0), (8.0, 60.0)) for i in currents]
    segments = [
        segment(f"{k}", f * 1.05**k, 2.0, i, "displacement", temperature=t) for k, (f, i, t) in enumerate(tests)
    ]
    found = assign_roles(name_conditions(segments, {}), "auto")
    assert {s.role for s in found} == {"train", "holdout"}
    for name in ("current", "temperature"):
        assert {getattr(s, name) for s in found if s.role == "train"} == {getattr(s, name) for s in found}


def test_of_currents_with_one_test_each_none_at_an_end_is_held_out() -> None:
    tests = ((2.0, 0.0), (1.0, 0.4), (4.0, 0.8), (3.0, 1.2))
    segments = [segment(f"{i}", f, f, i, "displacement") for f, i in tests]
    found = assign_roles(name_conditions(segments, {}), "auto")
    assert [s.current for s in found if s.role == "holdout"] in ([0.4], [0.8])


@pytest.mark.parametrize(
    ("holdout", "held"),
    [
        ("none", set()),
        ("sine-5Hz-*", {f"sine-5Hz-{a}A" for a in (1, 2, 3, 4, 5)}),
        ("current=3", {f"sine-{f}Hz-3A" for f in (1, 5, 10)}),
        ("frequency=10", {f"sine-10Hz-{a}A" for a in (1, 2, 3, 4, 5)}),
        ("sine-1Hz-1A, sine-5Hz-2A", {"sine-1Hz-1A", "sine-5Hz-2A"}),
    ],
)
def test_conditions_are_held_out_as_asked(holdout: str, held: set[str]) -> None:
    assert {c for c, role in roles(grid(), holdout).items() if role == "holdout"} == held


@pytest.mark.parametrize(
    ("holdout", "words"),
    [
        ("sine-7Hz-*", "sine-1Hz-1A"),
        ("current=x", "number"),
        ("*", "nothing to train on"),
        ("current=9", "matches no"),
        ("current=1,5", "point"),
    ],
)
def test_a_choice_that_cannot_be_is_refused(holdout: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        roles(grid(), holdout)


def test_repeats_have_one_role() -> None:
    repeated = list(itertools.chain(grid(), [segment("again", 5.0, 3.0)]))
    named = assign_roles(name_conditions(repeated, {}), "auto")
    by_condition = {s.condition: {o.role for o in named if o.condition == s.condition} for s in named}
    assert all(len(r) == 1 for r in by_condition.values())


def test_hold_out_in_time_cuts_an_irregular_test_and_leads_the_rest_in_by_all_before_it() -> None:
    before, after = hold_out_after([segment("a", 0.0, waveform="random")], "2.5", {"a": 0.005})
    assert (before.start, before.stop, before.warm_up, before.role) == (100, 500, 100, "train")
    assert (after.start, after.stop, after.warm_up, after.role) == (500, 900, 500, "holdout")
    assert (before.id, after.id) == ("a#1", "a#2")


def test_hold_out_in_time_keeps_whole_cycles() -> None:
    before, after = hold_out_after([segment("a")], "2.6", {"a": 0.005})
    # 8 cycles of 100 samples from sample 100 on; 2.6 s is sample 520
    assert (before.stop, before.cycles, after.start, after.cycles, after.warm_up) == (500, 4, 500, 4, 500)


def test_hold_out_in_time_takes_each_recording_s_own_time() -> None:
    parts = hold_out_after([segment("a"), segment("b"), segment("b")], "1", {"a": 0.005, "b": 0.0005})
    assert [(p.id, p.role) for p in parts] == [("a#1", "train"), ("a#2", "holdout"), ("b#1", "train"), ("b#2", "train")]


@pytest.mark.parametrize(
    ("text", "words"), [("soon", "no number"), ("9", "nothing to hold out"), ("-1", "nothing to train on")]
)
def test_hold_out_in_time_says_what_is_wrong(text: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        hold_out_after([segment("a")], text, {"a": 0.005})
