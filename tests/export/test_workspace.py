"""Logs of a workspace's fit: pieces without gaps, of each segment and role, beside what was recorded."""

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.export import workspace as of_workspace
from mrfit.export.source import LogStretch
from mrfit.export.workspace import read_fit_and_logs
from mrfit.io.workspace import Workspace

DT = 0.1
RECORDED = np.arange(100.0)


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    """A workspace with a fit of velocity; the recording of its segments is there but for that of ``gone``."""
    found = Workspace(tmp_path)
    found.fit_folder("own").mkdir(parents=True)
    spec = SimpleNamespace(inputs=("velocity", "time", "heat_before"))
    monkeypatch.setattr(of_workspace, "read_fit", lambda workspace, name, compare: SimpleNamespace(name=name))
    monkeypatch.setattr(of_workspace, "assembly_of", lambda content: SimpleNamespace(spec=spec))
    segments = [SimpleNamespace(id=f"{n}#0", recording=n, start=20, stop=50) for n in ("log", "gone")]
    found.segments_file.touch()
    monkeypatch.setattr(Workspace, "read_segments", lambda self: segments)

    def recording(self: Workspace, identifier: str) -> Any:
        if identifier == "gone":
            raise DataError("no such recording")
        return SimpleNamespace(channels={"velocity": RECORDED, "force": -RECORDED})

    monkeypatch.setattr(Workspace, "read_recording", recording)
    return found


def rows(segment: str, places: list[int], role: str = "train", condition: str = "slow") -> dict[str, list[Any]]:
    """Return rows of samples of a segment."""
    at = np.array(places, float)
    numbers = {"time": DT * at, "velocity": 2.0 * at, "heat_before": 0.0 * at, "measured": 3.0 * at}
    words = {"segment": segment, "role": role, "condition": condition}
    columns: dict[str, list[Any]] = {n: [v] * len(places) for n, v in words.items()}
    return columns | {n: v.tolist() for n, v in {**numbers, "simulated": 4.0 * at}.items()}


def logs(workspace: Workspace, *given: Mapping[str, list[Any]]) -> tuple[LogStretch, ...]:
    table = pa.table({n: [v for one in given for v in one[n]] for n in given[0]})
    parquet.write_table(table, workspace.fit_folder("own") / "residuals.parquet")
    return read_fit_and_logs(workspace, "own").stretches


def places(log: LogStretch) -> list[int]:
    return np.rint(log.measured / 3.0).astype(int).tolist()


def recorded(log: LogStretch, name: str) -> list[float]:
    found: Array = log.raw[name]
    return found.tolist()


def test_a_log_has_its_inputs_and_what_was_recorded_at_its_samples(workspace: Workspace) -> None:
    (log,) = logs(workspace, rows("log#0", [0, 1, 2, 3]))
    assert (log.segment, log.condition, log.role, log.dt) == ("log#0", "slow", "train", DT)
    # what follows from the others is no input of a user
    assert list(log.inputs) == ["velocity"] and log.inputs["velocity"].tolist() == [0.0, 2.0, 4.0, 6.0]
    assert log.simulated.tolist() == [0.0, 4.0, 8.0, 12.0]
    assert recorded(log, "velocity") == [20.0, 21.0, 22.0, 23.0] and recorded(log, "force")[0] == -20.0


def test_samples_of_a_segment_that_were_held_out_are_pieces_of_their_own(workspace: Workspace) -> None:
    # three samples in the middle were held out, and their rows stand among the others
    found = logs(
        workspace, rows("log#0", [0, 1]), rows("log#0", [2, 3, 4], "holdout"), rows("log#0", [5, 6]), rows("a", [0, 1])
    )
    assert [(s.segment, s.role, places(s)) for s in found] == [
        ("log#0", "train", [0, 1]),
        ("log#0", "train", [5, 6]),
        ("log#0", "holdout", [2, 3, 4]),
        ("a", "train", [0, 1]),
    ]
    assert recorded(found[1], "velocity") == [25.0, 26.0]
    assert not found[3].raw, "no segment is called so"


def test_without_its_recording_or_beyond_its_end_a_log_has_nothing_recorded(workspace: Workspace) -> None:
    gone, late, last = logs(
        workspace, rows("gone#0", [0, 1]), rows("log#0", [29, 30]), rows("log#0", [28, 29], "holdout")
    )
    assert not gone.raw and gone.inputs["velocity"].tolist() == [0.0, 2.0]
    # the segment has 30 samples
    assert not late.raw and recorded(last, "velocity") == [48.0, 49.0]


def test_a_fit_without_logs_has_none_and_one_that_lacks_a_column_says_which(workspace: Workspace) -> None:
    assert read_fit_and_logs(workspace, "own").stretches == ()
    lacking = rows("log#0", [0, 1])
    del lacking["velocity"]
    with pytest.raises(DataError, match="residuals.parquet: lacks the column velocity; run `mrfit fit` again$"):
        logs(workspace, lacking)
    (workspace.fit_folder("own") / "residuals.parquet").write_bytes(b"no table")
    with pytest.raises(DataError, match="delete the fit's folder and run `mrfit fit` again"):
        read_fit_and_logs(workspace, "own")
