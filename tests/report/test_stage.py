import json
import re
import shutil
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from mrfit.core.recording import Recording
from mrfit.errors import DataError
from mrfit.io.keys import fit_key
from mrfit.io.workspace import Workspace, write_json
from mrfit.report import stage
from mrfit.report.stage import Settings, publish, run


def contents(workspace: Workspace) -> dict[str, bytes]:
    folder = workspace.report_folder
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_report_holds_tables_figures_and_page(coil):
    workspace, summary = coil
    files = set(contents(workspace))
    tables = {"parameters.csv", "metrics.csv", "comparison.csv", "comparison.tex", "tables/boucwen-flux.pso-fmin.tex"}
    assert {"index.html", "report.json", *tables} <= files
    assert files == {*summary.files, "report.json"}
    assert (summary.fits, summary.conditions, summary.skipped) == (["boucwen-flux.pso-fmin"], 15, False)


def test_every_figure_is_xml(coil, damper):
    for workspace, _ in (coil, damper):
        figures = sorted(workspace.report_folder.glob("figures/*.svg"))
        assert len(figures) >= 6
        for path in figures:
            assert ElementTree.parse(path).getroot().tag == "{http://www.w3.org/2000/svg}svg"


@pytest.mark.parametrize("jobs", [1, 3])
def test_same_input_gives_the_same_bytes_elsewhere_by_any_number_of_workers(damper, tmp_path, jobs):
    copy = Workspace(tmp_path / "copy")
    shutil.copytree(damper[0].root, copy.root, ignore=shutil.ignore_patterns("report"))
    run(copy, Settings(jobs=jobs))
    assert contents(copy) == contents(damper[0])


def test_of_many_fits_the_best_have_all_figures_and_stand_first(small):
    path = small.fit_folder("bingham.lsq.all")
    content = json.loads((path / "fit.json").read_text())
    for name, factor in (("a", 3.0), ("b", 1e5), ("c", 0.5), ("d", 2.0)):
        shutil.copytree(path, small.fit_folder(name))
        rows = [{**m, "nrmse": factor * m["nrmse"]} for m in content["metrics"]]
        write_json(small.fit_folder(name) / "fit.json", {**content, "name": name, "metrics": rows})
    run(small, Settings())
    page = (small.report_folder / "index.html").read_text(encoding="utf-8")
    assert re.findall(r"<h2>(\S+)</h2>\n<nav", page) == ["c", "bingham.lsq.all", "d", "a", "b"]
    drawn = {p.name for p in small.report_folder.glob("figures/*.residual.svg")}
    assert drawn == {f"{name}.residual.svg" for name in ("c", "bingham.lsq.all", "d")}
    assert page.count("<code>mrfit report --fit ") == 2 and "<code>mrfit report --fit b</code>" in page
    # the command that the page names draws them
    run(small, Settings(fits=("b",)))
    assert (small.report_folder / "figures" / "b.residual.svg").is_file()


def test_nothing_is_done_when_nothing_changed_and_progress_is_told_when_it_has(small):
    told = []
    first = run(small, Settings(), lambda what, done, total: told.append((what, done, total)))
    count = len(list((small.report_folder / "figures").iterdir()))
    assert told == [("figures", k, count) for k in range(count + 1)]
    before = {p: p.stat().st_mtime_ns for p in small.report_folder.rglob("*")}
    again = run(small, Settings(), lambda what, done, total: told.append((what, done, total)))
    assert (first.skipped, again.skipped, len(told)) == (False, True, count + 1)
    assert replace(again, skipped=False) == first
    assert {p: p.stat().st_mtime_ns for p in small.report_folder.rglob("*")} == before
    path = small.fit_folder("bingham.lsq.all") / "fit.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "seed": 9}))
    assert not run(small, Settings()).skipped
    assert "<dt>Seed</dt><dd>9</dd>" in (small.report_folder / "index.html").read_text(encoding="utf-8")


def test_every_input_and_lost_file_counts(damper, monkeypatch):
    workspace, summary = damper
    monkeypatch.setattr(stage, "_render", lambda *_: {"index.html": "made anew"})
    monkeypatch.setattr(stage, "publish", lambda folder, files, summary: None)
    settings = Settings()
    assert run(workspace, settings).skipped
    for name in ("comparison.tex", "figures/bingham.lsq.all.nrmse.svg"):
        path = workspace.report_folder / name
        kept = path.read_bytes()
        path.unlink()
        assert not run(workspace, settings).skipped
        path.write_bytes(kept)
    kept = workspace.ingest_json.read_bytes()
    workspace.ingest_json.write_bytes(kept + b"\n")
    assert not run(workspace, settings).skipped
    workspace.ingest_json.write_bytes(kept)
    assert run(workspace, settings).skipped


def test_figures_and_leftovers_of_older_reports_are_taken_away(tmp_path):
    folder = tmp_path / "report"
    publish(folder, {"index.html": "a", "figures/gone.svg": "g"}, {"files": ["index.html", "figures/gone.svg"]})
    (folder / "mine.txt").write_text("kept")
    for name in (".index.html.1.tmp", "figures/.a.svg.1.tmp"):
        (folder / name).write_text("half")
    publish(folder, {"index.html": "b", "figures/new.svg": "n"}, {"files": ["index.html", "figures/new.svg"]})
    left = {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()}
    assert left == {"index.html", "figures/new.svg", "report.json", "mine.txt"}


class Killed(BaseException):
    pass


@pytest.mark.parametrize("after", range(5))
def test_kill_while_publishing_leaves_whole_files_and_no_key(tmp_path, monkeypatch, after):
    workspace = Workspace(tmp_path)
    names = ["index.html", "metrics.csv", "figures/a.svg", "figures/b.svg"]
    publish(workspace.report_folder, {n: f"old {n}" for n in names}, {"key": "old", "files": names})
    replace, done = stage.Path.replace, []

    def killed(source, target):
        if len(done) == after:
            raise Killed
        done.append(target)
        return replace(source, target)

    monkeypatch.setattr(stage.Path, "replace", killed)
    with pytest.raises(Killed):
        publish(workspace.report_folder, {n: f"new {n}" for n in names}, {"key": "new", "files": names})
    left = {k: v.decode() for k, v in contents(workspace).items()}
    assert left == {n: f"{'new' if k < after else 'old'} {n}" for k, n in enumerate(names)}
    monkeypatch.undo()
    publish(workspace.report_folder, {n: f"new {n}" for n in names}, {"key": "new", "files": names})
    assert {*contents(workspace)} == {*names, "report.json"}


def test_folder_that_cannot_be_written_is_an_error_with_a_remedy(tmp_path):
    (tmp_path / "report").write_text("a file where the folder should be")
    with pytest.raises(DataError, match=r"report: cannot write \(.*\); choose another --work folder"):
        publish(tmp_path / "report", {"index.html": "x"}, {})


def test_fit_made_from_other_data_is_said_to_be(small):
    path = small.fit_folder("bingham.lsq.all") / "fit.json"
    fit = json.loads(path.read_text())
    for recording in {s.recording for s in small.read_segments()}:
        small.write_recording(Recording(recording, "", "a", "none", 1e-3, 0.0, {"force": np.zeros(3)}, {}))
    write_json(path, {**fit, "key": fit_key(fit["settings"], *small.made_from(small.read_segments()))})
    said = "Out of date: fit again"
    assert run(small, Settings()).outdated == []
    assert said not in (small.report_folder / "index.html").read_text(encoding="utf-8")
    segments = small.read_segments()
    small.write_segments([replace(s, role="train") for s in segments[:-1]], {})
    assert run(small, Settings()).outdated == ["bingham.lsq.all"]
    assert said in (small.report_folder / "index.html").read_text(encoding="utf-8")
