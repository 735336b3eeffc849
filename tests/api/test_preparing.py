"""Preparation of recordings for a call, what a fit's own preparation leaves to its predictions, and threads of BLAS."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import mrfit
from mrfit.api.preparing import Preparation, as_asked, on_disk, prepared
from mrfit.api.recordings import Recording, several
from mrfit.api.threads import one_blas_thread
from mrfit.core.progress import silent
from mrfit.errors import ConfigError

TIME = 0.01 * np.arange(800)
STROKE = 0.01 * np.sin(2 * np.pi * TIME)


def log(name: str = "log", size: float = 1.0) -> Recording:
    speed = 0.02 * np.pi * size * np.cos(2 * np.pi * TIME)
    return Recording.from_arrays(dt=0.01, name=name, displacement=size * STROKE, velocity=speed, force=900.0 * speed)


def test_options_of_a_call_are_those_of_both_stages_and_others_are_left_alone() -> None:
    asked = as_asked({"resistance": 2.0, "holdout": "none", "model": "tanh"})
    assert asked.flux.resistance == 2.0 and asked.segment.holdout == "none" and asked.resistance is None
    assert as_asked({}) == Preparation()


def test_nothing_is_held_out_of_a_prediction_and_the_resistance_is_that_of_the_fit() -> None:
    fitted = Preparation(as_asked({}).flux, as_asked({"holdout": "current=2"}).segment, 1.75)
    other = fitted.to_predict(None)
    assert other.segment.holdout == "none" and fitted.segment.holdout == "current=2"
    assert other.flux == mrfit.flux.stage.to_predict(fitted.flux, 1.75, None)
    assert fitted.to_predict(2.5).flux == mrfit.flux.stage.to_predict(fitted.flux, 1.75, 2.5)
    assert fitted.to_predict(2.5).flux != other.flux


def test_segments_of_recordings_are_those_of_the_stage_and_each_keeps_its_log() -> None:
    made = prepared([log("b"), log("a", 2.0)], as_asked({"holdout": "none"}), silent)
    assert sorted(made.dataset.recordings) == ["a", "b"]
    assert {s.recording for s in made.dataset.segments} == {"a", "b"}
    assert {s.role for s in made.dataset.segments} == {"train"}
    amplitudes = {s.recording: s.amplitude for s in made.dataset.segments}
    assert amplitudes["a"] == pytest.approx(2.0 * amplitudes["b"], rel=0.01)


def test_a_workspace_of_a_call_holds_the_same_and_is_gone_behind_it() -> None:
    made = prepared([log()], as_asked({}), silent)
    with on_disk(made.dataset) as workspace:
        root = workspace.root
        assert [s.id for s in workspace.segments()] == [s.id for s in made.dataset.segments]
        assert (root / "recordings" / "log.parquet").is_file()
    assert not Path(root).exists()
    with pytest.raises(ZeroDivisionError), on_disk(made.dataset) as workspace:
        root = workspace.root
        raise ZeroDivisionError
    assert not Path(root).exists()


def test_recordings_are_sorted_and_those_of_one_name_are_told_apart() -> None:
    def stream() -> Iterator[Recording]:
        yield from (log("b"), log("a"), log("b"))

    found = several(stream())
    assert [one.id for one in found] == sorted(one.id for one in found)
    assert {"a", "b"} < {one.id for one in found} and len({one.id for one in found}) == 3
    assert [one.id for one in several(log("b"))] == ["b"]
    with pytest.raises(ConfigError, match="there are no recordings; give some of mrfit.read or"):
        several([])
    with pytest.raises(ConfigError, match="a str is no recording; make one by mrfit.read"):
        several([log(), "b.csv"])  # type: ignore[list-item]


def blas() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_blas_has_one_thread_for_the_time_of_a_call() -> None:
    with threadpool_limits(limits=2, user_api="blas"):
        before = blas()
        with pytest.raises(KeyError), one_blas_thread():
            assert blas() == {1}
            raise KeyError
        assert blas() == before
