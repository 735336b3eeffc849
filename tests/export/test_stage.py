"""Formats are made before any is written; what an earlier export left goes; names that a language has are refused."""

import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from mrfit.errors import ConfigError, DataError
from mrfit.export import stage
from mrfit.export.source import ExportSource
from mrfit.export.stage import Files, run
from mrfit.settings.export import Settings
from tests.export.rigs import rig

Made = Callable[..., None]


@pytest.fixture(scope="module")
def source() -> ExportSource:
    return rig("biviscous", seconds=0.05)


@pytest.fixture
def formats(monkeypatch: pytest.MonkeyPatch) -> dict[str, object]:
    """What formats give, by the names of their modules; an exception is raised."""
    given: dict[str, object] = {}

    def module(name: str) -> SimpleNamespace:
        found = given[name.rpartition(".")[2]]

        def files(source: ExportSource, settings: Settings) -> object:
            if isinstance(found, Exception):
                raise found
            return found(source) if callable(found) else found

        return SimpleNamespace(files=files)

    monkeypatch.setattr(stage, "importlib", SimpleNamespace(import_module=module))
    return given


def test_every_format_s_files_words_and_error_are_told(
    source: ExportSource, formats: dict[str, object], tmp_path: Path
) -> None:
    formats["c"] = Files({"a.c": b"int a;\n", "deep/a.h": b""}, ("one", "two"), 0.25)
    formats["ssv"] = Files({"a.ssv": b"<a/>"})
    told: list[tuple[object, ...]] = []
    written = run(source, ["c", "ssv", "c"], tmp_path, Settings(), lambda *given: told.append(given))
    assert written.files == {"c": ["a.c", "deep/a.h"], "ssv": ["a.ssv"]}
    assert written.said == {"c": ["one", "two"], "ssv": []} and written.errors == {"c": 0.25, "ssv": None}
    assert (tmp_path / "a.c").read_bytes() == b"int a;\n" and (tmp_path / "deep" / "a.h").read_bytes() == b""
    # a format that is named twice is made once
    assert [given[1:] for given in told] == [(0, 2), (1, 2), (2, 2)]


def test_files_of_an_earlier_export_that_match_go_and_others_stay(
    source: ExportSource, formats: dict[str, object], tmp_path: Path
) -> None:
    (tmp_path / "ssv").mkdir()
    for name in ("ssv/a_7.ssv", "ssv/a_8.ssv", "ssv/b_7.ssv", "a.c"):
        (tmp_path / name).write_text("old")
    formats["ssv"] = Files({"ssv/a_8.ssv": b"new"}, earlier="ssv/a_[0-9]*.ssv")
    run(source, ["ssv"], tmp_path, Settings())
    assert sorted(p.name for p in (tmp_path / "ssv").iterdir()) == ["a_8.ssv", "b_7.ssv"]
    assert (tmp_path / "ssv/a_8.ssv").read_text() == "new" and (tmp_path / "a.c").read_text() == "old"


def test_nothing_goes_or_is_written_where_no_format_can_be_made(
    source: ExportSource, formats: dict[str, object], tmp_path: Path
) -> None:
    (tmp_path / "a.c").write_text("old")
    formats["c"], formats["json_file"] = DataError("no form"), ConfigError("no compiler")
    with pytest.raises(ConfigError, match="^no compiler$"):
        run(source, ["c", "json"], tmp_path, Settings())
    assert [p.name for p in tmp_path.iterdir()] == ["a.c"]
    formats["ssv"] = Files({"a.ssv": b"<a/>"})
    written = run(source, ["c", "json", "ssv"], tmp_path, Settings())
    assert written.failed == {"c": "no form", "json": "no compiler"} and list(written.files) == ["ssv"]


def test_an_error_that_is_not_mrfit_s_own_is_not_hidden(
    source: ExportSource, formats: dict[str, object], tmp_path: Path
) -> None:
    formats["c"], formats["ssv"] = ZeroDivisionError(), Files({"a.ssv": b"<a/>"})
    with pytest.raises(ZeroDivisionError):
        run(source, ["ssv", "c"], tmp_path, Settings())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("prefix", ["front_damper", "a", "a23456789012345678901234", "Front2"])
def test_a_prefix_names_the_files(
    prefix: str, source: ExportSource, formats: dict[str, object], tmp_path: Path
) -> None:
    formats["c"] = lambda given: Files({f"{given.prefix}.c": b""})
    assert run(source, ["c"], tmp_path, Settings(prefix=prefix)).files == {"c": [f"{prefix}.c"]}


@pytest.mark.parametrize(
    "prefix",
    ["2front", "_front", "front damper", "front-damper", "a234567890123456789012345", "double", "tanh", "within", "é"],
)
def test_a_prefix_that_a_language_does_not_take_is_refused(
    prefix: str, source: ExportSource, formats: dict[str, object], tmp_path: Path
) -> None:
    formats["c"] = DataError("it was made")
    with pytest.raises(ConfigError, match=f"^--prefix takes up to 24 letters.* not '{prefix}'$"):
        run(source, ["c"], tmp_path, Settings(prefix=prefix))


@pytest.mark.parametrize(("asked", "taken"), [(["json", "ssv"], False), (["json", "c"], True), (["matlab"], True)])
def test_a_tracker_needs_a_format_that_has_one(
    asked: list[str], taken: bool, source: ExportSource, formats: dict[str, object], tmp_path: Path
) -> None:
    formats |= dict.fromkeys(("c", "json_file", "json", "ssv", "matlab"), Files({}))
    if taken:
        assert list(run(source, asked, tmp_path, Settings(track=("fy",))).files) == asked
        return
    with pytest.raises(ConfigError, match="^--track: a tracker is made beside the model with --to c or fmu or matlab$"):
        run(source, asked, tmp_path, Settings(track=("fy",)))


def test_a_folder_that_cannot_be_written_is_named_with_the_remedy(
    source: ExportSource, formats: dict[str, object], tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    formats["c"] = Files({"a.c": b""})
    with pytest.raises(DataError) as raised:
        run(source, ["c"], tmp_path / "file", Settings())
    assert str(raised.value).startswith(f"{tmp_path}{os.sep}file") and "; choose another --out" in str(raised.value)
    assert "\n" not in str(raised.value)
