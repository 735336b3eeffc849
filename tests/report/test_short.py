"""The short report: two pages whatever the fit, beside a whole report that it leaves alone."""

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from mrfit.io.schemas.fit import Caution
from mrfit.io.workspace import Workspace
from mrfit.report import short
from mrfit.report.source import ReportSource, read_source
from mrfit.report.stage import Settings, run
from tests.report.test_page import Page

PROGRAM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def crowded(source: ReportSource) -> ReportSource:
    """A fit with more of everything than two pages hold, and twenty rivals."""
    fit = source.fits[0]
    result = fit.results[0]
    many = [replace(p, name=f"{p.name}{k}") for k in range(30) for p in result.parameters]
    warnings = [Caution(kind=f"kind-{k}", text="word " * 200) for k in range(9)]
    whole = replace(fit, warnings=warnings, results=[replace(result, parameters=many), *fit.results[1:]])
    rivals = [replace(whole, name=f"rival-{k}") for k in range(20)]
    series = dict.fromkeys([whole.name, *(r.name for r in rivals)], source.series[fit.name])
    return replace(source, fits=[whole, *rivals], series=series)


def test_the_short_report_is_written_beside_the_whole_one(small: Workspace) -> None:
    whole = run(small, Settings())
    before = {p: p.read_bytes() for p in small.report_folder.rglob("*") if p.is_file()}
    made = run(small, Settings(short=True))
    assert made.index == str(small.report_folder / "short.html")
    page = Page(Path(made.index).read_text(encoding="utf-8"))
    assert not page.open and not page.unbalanced and page.tables["parameters"]
    assert {p: p.read_bytes() for p in before} == before
    assert run(small, Settings()) == replace(whole, skipped=True)


def test_what_two_pages_have_no_room_for_is_counted(damper: tuple[Workspace, object]) -> None:
    page = short.render(crowded(read_source(damper[0], ())))
    fit = read_source(damper[0], ()).fits[0]
    shown = Page(page).tables
    assert len(shown["parameters"]) == 1 + short.SHORT_ROWS and len(shown["comparison"]) == 1 + short.SHORT_PLACES
    several = 30 * len(fit.results[0].parameters) + sum(len(r.parameters) for r in fit.results[1:])
    left = [int(n) for n in re.findall(r"(\d+) more in the whole report", page)]
    assert (
        left[0] == 21 - short.SHORT_PLACES and left[1] >= several - short.SHORT_ROWS and left[2] >= 9 - short.CAUTIONS
    )


@pytest.mark.slow
@pytest.mark.skipif(PROGRAM is None, reason="needs Chromium")
@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("study", ["coil", "damper"])
def test_it_prints_on_two_pages(request: pytest.FixtureRequest, tmp_path: Path, study: str, full: bool) -> None:
    source = read_source(request.getfixturevalue(study)[0], ())
    page, pdf = tmp_path / "short.html", tmp_path / "short.pdf"
    page.write_text(short.render(crowded(source) if full else source), encoding="utf-8")
    assert PROGRAM is not None
    command = [PROGRAM, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}"]
    subprocess.run([*command, f"--print-to-pdf={pdf}", page.as_uri()], check=True, capture_output=True, timeout=120)
    assert len(re.findall(rb"/Type\s*/Page\b", pdf.read_bytes())) == 2
    shutil.rmtree(tmp_path / "profile", ignore_errors=True)
