"""Settings of a fit that cannot be kept, what a fit says of them, and which set of parameters suits a segment."""

from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import mrfit.fit.stage as stage
from mrfit.core.recording import Finding, Recording, Segment
from mrfit.errors import ConfigError, DataError
from mrfit.fit.predict import _with_output, closest_result
from mrfit.fit.select import doubtful_channels, left_out_warnings, read_dataset, usable
from mrfit.fit.stage import Settings
from mrfit.io.keys import fit_key
from mrfit.io.schemas.fit import Level, MetricRow, Result
from mrfit.simulate.assembly import assemble
from tests.fit.benches import Bench, planted_segments, write_workspace

TRUTH = np.array([300.0, 900.0, 5.0])


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"model": "no-such"}, "unknown model 'no-such'"),
        ({"optimizer": "no_such"}, "no_such"),
        ({"bounds": (("nosuch", 0.0, 1.0),)}, "nosuch"),
        ({"fixed": (("nosuch", 0.0),)}, "nosuch"),
        ({"current_order": "fy=9"}, "--current-order"),
        ({"options": (("nosuch", 1.0),)}, "nosuch"),
        ({"name": "a/b"}, "--name"),
        ({"forms": "evidence", "per": "all"}, "no effect of 'bingham' has several forms"),
    ],
)
def test_what_is_wrong_whatever_the_data_is_said_before_they_are_read(settings: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        stage.check(replace(Settings("bingham"), **settings))


def test_what_is_given_at_a_node_of_current_waits_for_the_data() -> None:
    asked = Settings(
        "bingham", per="all", bounds=(("fy@1A", 1.0, 9.0),), start=(("fy@1A", 3.0),), fixed=(("c@9A", 1.0),)
    )
    stage.check(asked)
    with pytest.raises(ConfigError, match="c"):
        stage.check(replace(asked, fixed=(("c", 1.0),)))


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (1e9, "C_inf is held at 1e+09, outside its bounds of {low:g} to {high:g} N*s/m; check its unit"),
        (0.0, "C_inf is held at 0, outside its bounds of {low:g} to {high:g} N*s/m"),
        (900.0, None),
    ],
)
def test_a_parameter_held_outside_its_bounds_may_be_in_another_unit_unless_it_is_zero(
    value: float, said: str | None
) -> None:
    assembly = assemble("biviscous")
    (param,) = (p for p in assembly.spec.params if p.name == "C_inf")
    assert 0.0 < param.low
    found = stage._held_outside_warnings(assembly, Settings("biviscous", fixed=(("C_inf", value),)))
    expected = [said.format(low=param.low, high=param.high)] if said else []
    assert [(w.kind, w.text) for w in found] == [("held-outside", text) for text in expected]
    assert stage._held_outside_warnings(assembly, Settings("biviscous", fixed=(("C_inf", param.high),))) == []


def test_a_fit_in_memory_has_the_key_and_the_hashes_of_the_same_data_in_a_workspace(tmp_path: Path) -> None:
    bench = Bench(assemble("bingham"), TRUTH, 0.01, 1)
    workspace = write_workspace(tmp_path, bench, ((1.0, 0.01), (2.0, 0.01)), (0.5,))
    settings = Settings("bingham", "lsq", per="all")
    made = stage.run(workspace, settings)
    origin = stage.origin_of(read_dataset(workspace), settings)
    assert (origin.key, origin.data_sha256, origin.segments_sha256) == (
        made.key,
        made.data_sha256,
        made.segments_sha256,
    )
    contents, cut = workspace.made_from(workspace.read_segments())
    assert origin.key == fit_key(asdict(settings), contents, cut) and origin.folder is None
    assert stage.run(workspace, settings).skipped and not made.skipped
    assert not stage.run(workspace, replace(settings, seed=1)).skipped
    # the setting that changes no result is not kept
    assert "jobs" not in made.settings and made.settings["seed"] == 0


def test_bounds_of_the_user_go_before_those_of_the_size_of_the_data(tmp_path: Path) -> None:
    large = Bench(assemble("bingham"), 1e4 * TRUTH, 0.01, 1)
    dataset = read_dataset(write_workspace(tmp_path, large, ((1.0, 0.01),), (0.5,)))
    spec = assemble("bingham").spec
    usual = {p.name: (p.low, p.high) for p in spec.params}

    def bounds(settings: Settings) -> dict[str, tuple[float, float]]:
        return {p.name: (p.low, p.high) for p in stage.prepare(dataset, settings).cube.params}

    assert all(high > usual[name][1] for name, (_, high) in bounds(Settings("bingham")).items())
    own = bounds(Settings("bingham", bounds=(("fy", 1.0, 7e6),)))
    assert own["fy"] == (1.0, 7e6) and own["C_inf"][1] > usual["C_inf"][1]


def test_groups_are_the_conditions_unless_all_are_fitted_together() -> None:
    segments = planted_segments(((1.0, 0.01), (2.0, 0.01)), (0.0, 1.0))
    segments += [replace(segments[0], id="again#1")]
    each = stage._groups(segments, Settings("bingham"))
    assert {name: [s.id for s in own] for name, own in each.items()}[segments[0].condition] == [
        segments[0].id,
        "again#1",
    ]
    assert len(each) == 4
    assert stage._groups(segments, Settings("bingham", per="all")) == {"all": segments}


def test_the_error_over_what_was_held_out_is_that_of_the_whole_role() -> None:
    rows = [
        MetricRow(condition=c, role=r, samples=1, nrmse=e) for c, r, e in (("all", "train", 0.1), ("a", "holdout", 0.2))
    ]
    assert stage.over_held_out(rows) is None
    assert stage.over_held_out([*rows, replace(rows[1], condition="all", nrmse=0.3)]) == 0.3


def test_a_fit_that_did_not_search_names_the_one_that_does() -> None:
    def strategy(searches: bool, from_means: bool) -> Any:
        return SimpleNamespace(searches=searches, from_means=from_means)

    assert stage._no_search_warnings(strategy(True, True), "lsq") == []
    (points,) = stage._no_search_warnings(strategy(False, False), "points")
    (means,) = stage._no_search_warnings(strategy(False, True), "means")
    assert "read off characteristic points" in points.text and points.text.endswith("points-lsq searches on from them")
    assert "means over the conditions of each current" in means.text and "means-lsq" in means.text


def fitted_at(condition: str, frequency: float | None, amplitude: float | None, current: float | None) -> Result:
    at = Level(frequency=frequency, amplitude=amplitude, current=current)
    return Result(condition=condition, at=at, evaluations=1, parameters=[])


RESULTS = [fitted_at("slow", 1.0, 0.01, 0.0), fitted_at("fast", 4.0, 0.01, 0.0), fitted_at("fast-2A", 4.0, 0.01, 2.0)]


@pytest.mark.parametrize(
    ("frequency", "amplitude", "current", "nearest"),
    [
        (1.9, 0.01, 0.0, "slow"),
        # on a scale of logarithms 2.1 Hz is nearer to 4 Hz than to 1 Hz
        (2.1, 0.01, 0.0, "fast"),
        (4.0, 0.02, 0.9, "fast"),
        (4.0, 0.02, 1.1, "fast-2A"),
        # a current that moves is none of 2 A
        (4.0, 0.01, float("nan"), "fast"),
    ],
)
def test_the_nearest_condition_is_that_by_ratios_of_motion_and_differences_of_current(
    frequency: float, amplitude: float, current: float, nearest: str
) -> None:
    (segment,) = planted_segments(((frequency, amplitude),), (current,))
    assert closest_result(RESULTS, segment).condition == nearest
    own = replace(segment, condition="slow")
    assert closest_result(RESULTS, own).condition == "slow"
    assert closest_result([fitted_at("all", None, None, None)], own).condition == "all"


def log(name: str, *channels: str) -> Recording:
    return Recording(name, f"{name}.csv", "0", "none", 1e-2, 0.0, {c: np.ones(900) for c in channels}, {})


def test_a_log_without_the_output_is_simulated_beside_zeros_and_known_as_such() -> None:
    logs = {"a": log("a", "velocity", "force"), "b": log("b", "velocity"), "c": log("c")}
    made, lacking = _with_output(logs, "force")
    assert lacking == {"b"} and made["a"] is logs["a"] and made["c"] is logs["c"]
    assert made["b"].channels["force"].tolist() == [0.0] * 900 and "force" not in logs["b"].channels


def of_log(name: str, role: str) -> Segment:
    (segment,) = planted_segments(((1.0, 0.01),), (1.0,))
    return replace(segment, id=f"{name}#1", recording=name, role=role)


def test_of_logs_that_lack_a_channel_each_has_its_reason_and_only_none_left_is_an_error() -> None:
    logs = {n: log(n, "velocity", "displacement", "current", *["force"] * (n == "a")) for n in "abc"}
    segments = [of_log("a", "train"), of_log("b", "train"), of_log("c", "holdout")]
    kept, left_out = usable(segments, logs, assemble("bingham"))
    assert [s.id for s in kept] == ["a#1"]
    assert [(row["source"], row["role"]) for row in left_out] == [("b.csv", "train"), ("c.csv", "holdout")]
    assert all(row["reason"].startswith("no force in this log") for row in left_out)
    (said,) = left_out_warnings(left_out, 3)
    assert said.text.startswith("2 of 3 segments (1 held out) take no part, those of b.csv, c.csv: no force")
    # what is held out trains no model
    held = [replace(segments[0], role="holdout"), *segments[1:]]
    with pytest.raises(DataError, match="b.csv: no force") as error:
        usable(held, logs, assemble("bingham"), ("train",))
    assert str(error.value).endswith("(1 more log cannot be used either)")


def test_of_many_logs_left_out_for_one_reason_six_are_named() -> None:
    rows = [{"reason": "no force", "source": f"{k}.csv", "role": "train"} for k in range(8)]
    (said,) = left_out_warnings([*rows, {**rows[0]}], 9)
    assert (
        said.text
        == "9 of 9 segments take no part, those of 0.csv, 1.csv, 2.csv, 3.csv, 4.csv, 5.csv and 2 more logs: no force"
    )


def test_what_ingest_found_wrong_is_told_of_channels_that_the_model_uses() -> None:
    def found(kind: str, channel: str) -> Finding:
        return Finding(kind, channel, None, f"{channel} {kind}")

    logs = [
        replace(log("a"), findings=(found("sign", "force"), found("clipped", "force"), found("sign", "angle"))),
        replace(log("b"), findings=(found("sign", "force"), found("velocity-differs", "velocity"))),
        replace(log("c"), findings=(found("outlier", "force"), found("offset", "force"))),
    ]
    assert [(w.kind, w.text) for w in doubtful_channels(logs, {"force", "velocity"})] == [
        ("sign", "force sign (a, and 2 of 3 logs in all)"),
        ("velocity-differs", "velocity velocity-differs (b, and 1 of 3 logs in all)"),
        ("outlier", "force outlier (c, and 1 of 3 logs in all)"),
    ]
