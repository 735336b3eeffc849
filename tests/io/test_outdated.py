"""Each reason for which a result is out of date, and the state in which there is none."""

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from mrfit.cli.console import outdated_line
from mrfit.core.recording import Recording, Segment
from mrfit.io.keys import code_version, digest_of, fit_key, flux_key, segment_key, segments_digest
from mrfit.io.outdated import UNKNOWN_REASON, Inputs, flux_reason, law_reason, remedy, segment_reason
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.stages import About, FluxFile, FluxRow, FluxSettings, SegmentRow, SegmentSettings, SegmentsFile
from mrfit.io.workspace import Workspace, plain, write_json

OTHER_CODE = "0" * 16
SEGMENT = Segment("log#0", "sine", "log", 0, 40, 0, "sine", "current", 5.0, 1.0, 0.0, 2, 1.0, np.nan, "train")


def log(name: str, scale: float = 1.0) -> Recording:
    channels = {"current": np.sin(np.arange(40.0)), "flux": scale * np.cos(np.arange(40.0))}
    return Recording(name, f"{name}.csv", name, "csv", 1e-3, 0.0, channels, {"current": "A", "flux": "Wb"})


def ingested(root: Path, *names: str) -> Workspace:
    workspace = Workspace(root)
    for name in names:
        workspace.write_recording(log(name))
    state(workspace, *names)
    return workspace


def state(workspace: Workspace, *names: str) -> None:
    rows = [About.of(log(name)) for name in names]
    write_json(workspace.ingest_json, {"recordings": rows, "refused": []})


def with_flux(workspace: Workspace, code: str = "") -> None:
    settings, contents = FluxSettings(), workspace.contents(workspace.identifiers)
    rows = [FluxRow(id=name, action="passed through") for name in workspace.identifiers]
    key = flux_key(asdict(settings), contents, code)
    write_json(
        workspace.flux_json, FluxFile(key=key, code=code or code_version("flux"), settings=settings, recordings=rows)
    )


def with_segments(workspace: Workspace, code: str = "") -> None:
    settings, contents = SegmentSettings(), workspace.contents(workspace.identifiers, workspace.latest)
    rows = [SegmentRow(**{**asdict(SEGMENT), "temperature": None})]
    found = SegmentsFile(
        key=segment_key(asdict(settings), contents, code),
        code=code or code_version("segment"),
        settings=settings,
        segments=rows,
    )
    workspace.write_segments([SEGMENT], {"mrfit": json.dumps(plain(found))})


REASONS: list[tuple[Callable[[Workspace, str], None], Callable[[Workspace], str]]] = [
    (with_flux, flux_reason),
    (with_segments, segment_reason),
]


@pytest.mark.parametrize(("made", "reason"), REASONS)
def test_a_stage_is_up_to_date_until_a_recording_changes(made, reason, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    workspace = ingested(tmp_path, "log", "other")
    assert reason(workspace) == ""
    made(workspace, "")
    assert reason(workspace) == ""
    workspace.write_recording(log("log", scale=2.0))
    assert "changed" in reason(Workspace(tmp_path))


@pytest.mark.parametrize(("made", "reason"), REASONS)
def test_other_code_is_told_where_nothing_else_changed(made, reason, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    workspace = ingested(tmp_path, "log")
    made(workspace, OTHER_CODE)
    by_code = reason(workspace)
    assert by_code and "code" in by_code or "mrfit" in by_code
    workspace.write_recording(log("log", scale=2.0))
    assert reason(Workspace(tmp_path)) != by_code


@pytest.mark.parametrize(("made", "reason"), REASONS)
def test_without_a_state_of_ingest_nothing_is_said(made, reason, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    workspace = ingested(tmp_path, "log")
    made(workspace, OTHER_CODE)
    workspace.ingest_json.unlink()
    assert reason(workspace) == ""


def fitted(workspace: Workspace, made_by: str = "", **changed: object) -> Fit:
    contents, segments = workspace.made_from(workspace.segments())
    settings = {"model": "bingham", "seed": 0}
    about = Fit(
        name="f", model="bingham", optimizer="lsq", per="all", settings=settings, output="flux", inputs=["current"],
        equation="", reference="", results=[], metrics=[], versions={},
        key=fit_key(settings, contents, segments, made_by), code=made_by or code_version("fit"),
        data_sha256=digest_of(contents), segments_sha256=segments_digest(segments),
    )  # fmt: skip
    return replace(about, **changed)  # type: ignore[arg-type]


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    made = ingested(tmp_path, "log")
    with_segments(made)
    return made


def test_a_fit_of_what_is_here_has_no_reason(workspace: Workspace) -> None:
    fit = fitted(workspace)
    assert Inputs(workspace).reason(fit) == "" and Inputs(workspace).of_fits([fit]) == {}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"key": "other", "code": ""}, UNKNOWN_REASON),
        ({"key": "other", "data_sha256": "other"}, "its recordings have changed since"),
        ({"key": "other", "segments_sha256": "other"}, "the segments have changed since"),
        (
            {"key": "other", "segments_sha256": ""},
            "the segments, or a plug-in that it was made with, have changed since",
        ),
        ({"key": "other"}, "a plug-in that it was made with has changed since"),
    ],
)
def test_the_reason_is_what_differs(changed: dict[str, str], said: str, workspace: Workspace) -> None:
    fit = fitted(workspace, **changed)
    assert Inputs(workspace).reason(fit) == said
    assert Inputs(workspace).of_fits([fit]) == {"f": said}


def test_a_fit_by_other_code_says_so_and_one_without_a_key_says_nothing(workspace: Workspace) -> None:
    inputs = Inputs(workspace)
    assert "other data" not in inputs.reason(fitted(workspace, made_by=OTHER_CODE)) != ""
    assert inputs.of_fits([fitted(workspace, key="")]) == {}


def test_stages_before_that_are_out_of_date_are_told_first(workspace: Workspace) -> None:
    fit = fitted(workspace)
    workspace.write_recording(log("log", scale=2.0))
    assert Inputs(Workspace(workspace.root)).reason(fit).startswith("the segments are out of date: ")
    workspace.segments_file.unlink()
    said = Inputs(Workspace(workspace.root)).reason(fit)
    assert "no segments here" in said and str(workspace.root) not in said


@pytest.mark.parametrize(
    ("reason", "said"),
    [
        ("the plug-in model gone is not here, which --plugin names", "name its file"),
        ("f: the plug-in model gone is not here, which --plugin names", "name its file"),
        ("the segments have changed since; the plug-in model gone is not here, which --plugin names", "fit again"),
        ("the plug-in model gone (gone.py) has changed since", "fit again"),
    ],
)
def test_a_plugin_that_is_only_not_named_is_no_reason_to_fit_again(reason: str, said: str) -> None:
    assert remedy(reason) == said
    assert outdated_line(reason).endswith(f": {said}")


def test_the_law_of_a_fit_is_compared_file_by_file(workspace: Workspace) -> None:
    fit = fitted(workspace)
    assert law_reason(fit) == ""
    one = replace(fit, law={"models/bingham.py": "other"})
    assert "models/bingham.py" in law_reason(one) and "changed since" in law_reason(one)
    assert law_reason(replace(fit, law={"plug-in model gone": "x"})) == (
        "the plug-in model gone is not here, which --plugin names"
    )
