"""A workspace that others have edited: whatever stands in its JSON, a command ends well or with one plain line."""

import contextlib
import copy
import io
import json
import os
import random
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import mrfit.report.discovery
import mrfit.report.figures
from mrfit.cli import console, main, output
from mrfit.io.workspace import Workspace
from tests.report.test_discovery import AMBIGUOUS, FOUND, OPEN, UNEXPLAINED
from tests.report.test_discovery import study as discovery_study

GONE = object()
VALUES: tuple[Any, ...] = (
    None,
    True,
    7,
    -1,
    0,
    1.5,
    1e308,
    "text",
    "",
    "/etc/x",
    [],
    [1],
    ["a", "b"],
    {},
    {"a": 1},
    GONE,
)
FIT = ("fit", "--model", "bingham", "--opt", "lsq", "--name", "bingham.lsq", "--jobs", "1")


def places(content: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Yield the path of every value, of a list its first member's."""
    if path:
        yield path
    items: list[tuple[str | int, Any]] = []
    if isinstance(content, dict):
        items = list(content.items())
    elif isinstance(content, list) and content:
        items = [(0, content[0])]
    for key, value in items:
        yield from places(value, (*path, key))


def changed(content: Any, path: tuple[str | int, ...], value: Any) -> Any:
    made = copy.deepcopy(content)
    inner = made
    for part in path[:-1]:
        inner = inner[part]
    if value is GONE:
        del inner[path[-1]]
    else:
        inner[path[-1]] = value
    return made


def ran(*arguments: str) -> None:
    """Run a command in this process; it must end well or with one plain line."""
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            main.app(list(arguments), standalone_mode=False)
        except Exception as error:
            text, code = console.explain(error)
            assert code in (1, 2), text
            assert "unexpected" not in text and "\n" not in text and text, (arguments, text)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with logs and a workspace in which every stage has run."""
    folder = tmp_path_factory.mktemp("edited")
    for name in ("logs", "other"):
        (folder / name).mkdir()
    time = np.arange(1600) / 400.0
    for k, folder_of in ((1, "logs"), (2, "logs"), (3, "other")):
        v = k * np.cos(4 * np.pi * time)
        i = 0.5 * np.sin(4 * np.pi * time)
        columns = (
            time,
            np.cumsum(v) / 400.0,
            5.0 * np.tanh(9 * v) + 3 * v,
            2.0 * i + 0.1 * np.gradient(i, 1 / 400.0),
            i,
        )
        rows = "\n".join(",".join(f"{x:.7g}" for x in row) for row in zip(*columns, strict=True))
        (folder / folder_of / f"t{k}.csv").write_text(f"time,displacement,force,voltage,current\n{rows}\n")
    (folder / "logs" / "odd.csv").write_text("no,log\nat,all\n")
    for command in (
        ("ingest", str(folder / "logs")),
        ("flux", "--resistance", "2"),
        ("segment", "--drive", "displacement", "--holdout", "none"),
        FIT,
        ("report",),
    ):
        ran(*command, "--work", str(folder / "w"))
    assert (folder / "w" / "report" / "index.html").is_file()
    return folder


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the drawing out, which takes most of the time of a report and reads no JSON."""
    monkeypatch.setattr(mrfit.report.figures, "draw_all", lambda drawings, jobs, progress: [])
    monkeypatch.setattr("mrfit.report.figures.drawings_of", lambda fit, series: [])
    monkeypatch.setattr("mrfit.report.stage.more_drawings", lambda fit, series, segments: [])
    monkeypatch.setattr("mrfit.report.discovery.figures_of", lambda discovery: [])


def commands_of(folder: Path) -> dict[str, tuple[tuple[str, ...], ...]]:
    ingest = ("ingest", str(folder / "logs"))
    # a log of another condition, for which the nearest one's parameters are taken
    predict = ("predict", "--fit", "bingham.lsq", str(folder / "other" / "t3.csv"))
    compare = ("compare", "--models", "bingham", "--opt", "lsq", "--per", "condition", "--jobs", "1")
    return {
        "ingest.json": (ingest, ("flux", "--resistance", "2"), FIT, ("report",)),
        "flux.json": (FIT, predict, ("report",), ("flux", "--resistance", "2")),
        "fits/bingham.lsq/fit.json": (predict, ("report",), compare, FIT),
        "report/report.json": (("report",),),
    }


def with_changes(
    folder: Path, file: str, read: Callable[[Path], Any], write: Callable[[Path, Any], None], share: float
) -> Iterator[Path]:
    """Yield workspaces in each of which one value of a file is another, a share of all there are."""
    content = read(folder / "w" / file)
    rng = random.Random(file)
    work = folder / "changed"
    for path in list(places(content)):
        for value in VALUES:
            if rng.random() >= share:
                continue
            shutil.rmtree(work, ignore_errors=True)
            shutil.copytree(folder / "w", work)
            write(work / file, changed(content, path, value))
            yield work


def read_json(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def write_json(path: Path, content: Any) -> None:
    path.write_text(json.dumps(content), encoding="utf-8")


def read_metadata(path: Path) -> Any:
    return json.loads(pq.read_metadata(path).metadata[b"mrfit"])


def write_metadata(path: Path, content: Any) -> None:
    table = pq.ParquetFile(path).read()
    kept = {**(table.schema.metadata or {}), b"mrfit": json.dumps(content).encode()}
    whole = {k: v for k, v in (pq.read_metadata(path).metadata or {}).items() if k != b"ARROW:schema"}
    pq.write_table(table.replace_schema_metadata({**whole, **kept}), path)


def read_row(path: Path) -> Any:
    return pq.ParquetFile(path).read().to_pylist()[0]


def write_row(path: Path, content: Any) -> None:
    import pyarrow as pa

    table = pq.ParquetFile(path).read()
    rows = [content, *table.to_pylist()[1:]]
    with contextlib.suppress(pa.ArrowException, OverflowError):
        # one type for a column, as Parquet has it
        columns = {n: [{**r, n: content.get(n, r[n])}[n] for r in rows] for n in content}
        made = pa.table({n: pa.array([content[n]] * len(rows) if n in content else v) for n, v in columns.items()})
        pq.write_table(made.replace_schema_metadata(table.schema.metadata), path)


SHARES = [pytest.param(0.004, id="some"), pytest.param(1.0, id="all", marks=pytest.mark.slow)]


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("file", ["ingest.json", "flux.json", "fits/bingham.lsq/fit.json", "report/report.json"])
def test_any_value_in_a_json_file_ends_in_success_or_one_line(
    file: str, share: float, finished: Path, no_figures: None
) -> None:
    for work in with_changes(finished, file, read_json, write_json, share):
        for command in commands_of(finished)[file]:
            ran(*command, "--work", str(work))


@pytest.mark.parametrize("share", SHARES)
def test_any_value_in_the_segments_metadata_ends_in_success_or_one_line(
    share: float, finished: Path, no_figures: None
) -> None:
    for work in with_changes(finished, "segments.parquet", read_metadata, write_metadata, share):
        for command in (FIT, ("report",), ("segment",)):
            ran(*command, "--work", str(work))


@pytest.mark.parametrize("share", [pytest.param(0.02, id="some"), pytest.param(1.0, id="all", marks=pytest.mark.slow)])
def test_any_value_in_a_row_of_segments_ends_in_success_or_one_line(
    share: float, finished: Path, no_figures: None
) -> None:
    for work in with_changes(finished, "segments.parquet", read_row, write_row, share):
        for command in ((*FIT, "--seed", "1"), ("report",)):
            ran(*command, "--work", str(work))


@pytest.mark.parametrize("share", SHARES)
def test_any_value_in_a_recordings_metadata_ends_in_success_or_one_line(
    share: float, finished: Path, no_figures: None
) -> None:
    for work in with_changes(finished, "recordings/t1.parquet", read_metadata, write_metadata, share):
        for command in (("flux", "--resistance", "3"), ("segment",), ("report",)):
            ran(*command, "--work", str(work))


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("found", [FOUND, AMBIGUOUS, UNEXPLAINED | {"suspects": AMBIGUOUS["suspects"]}, OPEN])
def test_any_value_in_discovery_json_ends_in_success_or_one_line(
    found: dict[str, Any], share: float, tmp_path: Path, no_figures: None
) -> None:
    workspace = discovery_study(tmp_path / "w", found)
    file = workspace.root / "discover" / "discovery.json"
    content, rng = read_json(file), random.Random(0)
    for path in list(places(content)):
        for value in VALUES:
            if rng.random() >= share:
                continue
            write_json(file, changed(content, path, value))
            ran("advise", "--work", str(workspace.root))
            page_and_words(workspace)


def page_and_words(workspace: Workspace) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            found = workspace.discovery()
            page = str(mrfit.report.discovery.run(workspace).path)
            output.discover({**found.to_json(), "skipped": False, "page": page}, workspace.root)
        except Exception as error:
            text, code = console.explain(error)
            assert code in (1, 2) and "unexpected" not in text and "\n" not in text, text


@pytest.mark.parametrize(
    ("file", "command"),
    [
        ("ingest.json", ("flux",)),
        ("flux.json", FIT),
        ("fits/bingham.lsq/fit.json", FIT),
        ("fits/bingham.lsq/fit.json", ("report",)),
        ("report/report.json", ("report",)),
    ],
)
def test_an_unknown_schema_is_refused_in_one_line_and_stays(
    file: str, command: tuple[str, ...], finished: Path
) -> None:
    work = finished / "changed"
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(finished / "w", work)
    write_json(work / file, {**read_json(work / file), "schema": "mrfit/later/9\n"})
    before = (work / file).read_bytes()
    with pytest.raises(console.MrfitError) as error:
        main.app([*command, "--work", str(work)], standalone_mode=False)
    said = str(error.value)
    assert said.startswith(f"{work / file}: of the schema 'mrfit/later/9 ', which this mrfit does not know")
    assert "\n" not in said and (work / file).read_bytes() == before


@pytest.mark.parametrize(
    ("file", "command"),
    [("flux.json", "flux"), ("segments.parquet", "segment"), ("fits/bingham.lsq/fit.json", "fit")],
)
def test_what_a_damaged_file_is_mended_by_mends_it(file: str, command: str, finished: Path) -> None:
    work = finished / "cut"
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(finished / "w", work)
    os.truncate(work / file, 10)
    given = [*(FIT if command == "fit" else [command]), "--work", str(work)]
    with pytest.raises(console.MrfitError, match=rf"delete it and run `mrfit {command}"):
        main.app(["report" if command == "fit" else command, "--work", str(work)], standalone_mode=False)
    (work / file).unlink()
    main.app(given, standalone_mode=False)
    assert (work / file).stat().st_size > 10


@pytest.mark.parametrize(
    ("file", "path", "value", "said"),
    [
        ("ingest.json", ("recordings", 0, "dt"), "1e-3", "recordings[0].dt takes a number, not '1e-3'"),
        ("ingest.json", ("recordings", 0, "id"), "../../x", "recordings[0].id takes a plain name of letters"),
        ("ingest.json", ("recordings", 0, "channels"), 3, "recordings[0].channels takes a list, not 3"),
        (
            "flux.json",
            ("settings", "resistance"),
            [2],
            "settings.resistance takes a number or 'auto' or text, not [2]",
        ),
        ("flux.json", ("settings", "window"), 3, "settings.window is no key mrfit knows"),
    ],
)
def test_a_wrong_type_is_said_with_its_file_and_value(
    file: str, path: tuple[str | int, ...], value: Any, said: str, finished: Path
) -> None:
    work = finished / "changed"
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(finished / "w", work)
    write_json(work / file, changed(read_json(work / file), path, value))
    with pytest.raises(console.MrfitError) as error:
        main.app([*FIT, "--work", str(work)], standalone_mode=False)
    assert str(error.value).startswith(f"{work / file}: damaged, or another mrfit's: {said}"), error.value
