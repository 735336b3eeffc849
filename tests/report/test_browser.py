"""The report in a browser: hover, toggle, zoom, sort, fold, width of a phone. Skipped where there is no Chromium."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mrfit.io.workspace import Workspace
from mrfit.report.stage import Settings, run
from tests.report.studies import damper_study

playwright = pytest.importorskip("playwright.sync_api", reason="needs `pip install mrfit[browser]`")
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
PROGRAM = next(filter(None, map(shutil.which, BROWSERS)), None)
pytestmark = [pytest.mark.slow, pytest.mark.skipif(PROGRAM is None, reason="needs Chromium")]
CURVES = "#plot path.curve"


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the page of two fits of three conditions."""
    workspace = damper_study(tmp_path_factory.mktemp("browser") / "w")
    first = workspace.fit_folder("bingham.lsq.all")
    shutil.copytree(first, workspace.fit_folder("second"))
    return Path(run(Workspace(workspace.root), Settings()).index).as_uri()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as started:
        program = started.chromium.launch(executable_path=PROGRAM, args=["--no-sandbox"])
        yield program
        program.close()


@pytest.fixture
def page(browser: Any, address: str) -> Iterator[Any]:
    """Return the page at 1400 px; at the end it must have asked for nothing and raised no error."""
    made = browser.new_page(viewport={"width": 1400, "height": 900})
    errors: list[str] = []
    asked: list[str] = []
    made.on("pageerror", lambda error: errors.append(str(error)))
    made.on("request", lambda request: asked.append(request.url))
    made.goto(address)
    yield made
    made.close()
    assert not errors
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


def ticks(page: Any) -> list[str]:
    found: list[str] = page.locator("#plot text").all_text_contents()
    return found


def of_fit(page: Any, name: str) -> Any:
    """Return the box that shows or hides a fit."""
    return page.locator(".controls label", has_text=name).locator("input")


def middle_of(page: Any, selector: str) -> tuple[float, float]:
    """Return a point on a curve, in pixels of the window."""
    script = """path => { const p = path.getPointAtLength(0.3 * path.getTotalLength());
        const m = path.getScreenCTM(); return [p.x * m.a + m.e, p.y * m.d + m.f]; }"""
    x, y = page.locator(selector).first.evaluate(script)
    return float(x), float(y)


def test_pointing_at_a_loop_says_whose_it_is_and_sets_it_off(page: Any) -> None:
    page.locator("#plot").scroll_into_view_if_needed()
    told = page.locator("output.told")
    assert told.inner_text() == "Point at a loop to see whose it is."
    page.mouse.move(*middle_of(page, f"{CURVES}.fit1"))
    text = told.inner_text()
    assert "sine-2Hz-0.01m-" in text and "second" in text and "NRMSE" in text
    assert page.locator("#plot.chosen g.own").count() == 1
    page.mouse.move(2, 2)
    assert page.locator("#plot.chosen").count() == 0 and page.locator("g.own").count() == 0


def test_a_fit_and_the_measurement_are_taken_away_and_put_back(page: Any) -> None:
    assert {page.locator(f"{CURVES}.{c}").count() for c in ("measured", "fit0", "fit1")} == {2}
    of_fit(page, "second").uncheck()
    assert [page.locator(f"{CURVES}.{c}").count() for c in ("measured", "fit0", "fit1")] == [2, 2, 0]
    of_fit(page, "measured").uncheck()
    assert [page.locator(f"{CURVES}.{c}").count() for c in ("measured", "fit0", "fit1")] == [0, 2, 0]
    of_fit(page, "second").check()
    of_fit(page, "measured").check()
    page.get_by_role("button", name="all", exact=True).click()
    assert {page.locator(f"{CURVES}.{c}").count() for c in ("measured", "fit0", "fit1")} == {3}


def test_zoom_narrows_the_axes_and_whole_brings_them_back(page: Any) -> None:
    before = ticks(page)
    for _ in range(6):
        page.get_by_role("button", name="Zoom in").click()
    near = ticks(page)
    assert near != before and near[-2:] == before[-2:]
    page.get_by_role("button", name="Show whole loops").click()
    assert ticks(page) == before
    plot = page.locator("#plot")
    plot.focus()
    page.keyboard.press("+")
    page.keyboard.press("+")
    page.keyboard.press("+")
    assert ticks(page) != before
    page.keyboard.press("0")
    assert ticks(page) == before


def test_the_wheel_scrolls_the_page_until_the_plot_is_chosen_then_zooms_and_a_drag_moves(page: Any) -> None:
    plot = page.locator("#plot")
    plot.scroll_into_view_if_needed()
    before = ticks(page)
    box = plot.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.wheel(0, -120)
    assert ticks(page) == before
    plot.focus()
    for _ in range(6):
        page.mouse.wheel(0, -120)
    page.wait_for_function("old => document.querySelector('#plot').textContent !== old", arg="".join(before))
    near = page.locator(CURVES).first.get_attribute("d")
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2 + 60, box["y"] + box["height"] / 2, steps=4)
    page.mouse.up()
    assert page.locator(CURVES).first.get_attribute("d") != near
    plot.dblclick()
    assert ticks(page) == before


def test_another_axis_redraws_the_loops_over_it(page: Any) -> None:
    before = ticks(page)
    page.get_by_label("Over", exact=True).select_option(index=1)
    assert ticks(page)[-2] != before[-2] and page.locator(CURVES).count() == 6


def test_a_click_on_a_heading_sorts_and_another_turns_it_round(page: Any) -> None:
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    table = page.locator("table:has(button.sort):has(data)").first
    heading = table.locator("th.num button.sort").first
    place = heading.evaluate("b => b.closest('th').cellIndex")
    script = """(table, place) => [...table.tBodies[0].rows].filter(r => !r.classList.contains('pooled'))
        .map(r => r.cells[place].querySelector('data')).filter(Boolean).map(d => Number(d.value))"""
    heading.click()
    rising = table.evaluate(script, place)
    assert rising == sorted(rising)
    heading.click()
    assert table.evaluate(script, place) == sorted(rising, reverse=True)


@pytest.mark.parametrize("width", [400, 1400])
def test_nothing_scrolls_sideways(browser: Any, address: str, width: int) -> None:
    page = browser.new_page(viewport={"width": width, "height": 900})
    page.goto(address)
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.close()


def test_details_are_folded_on_the_screen_and_open_in_print(page: Any) -> None:
    opened = "[...document.querySelectorAll('details.fold')].map(d => d.open)"
    assert not any(folded := page.evaluate(opened)) and folded
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert all(page.evaluate(opened))
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert not any(page.evaluate(opened))
    # what scrolls in a box on the screen is all there on paper
    page.emulate_media(media="print")
    boxes = "[...document.querySelectorAll('.scroll')].map(b => getComputedStyle(b).overflowX)"
    assert set(page.evaluate(boxes)) == {"visible"}


def test_figures_are_dark_where_the_screen_is(browser: Any, address: str) -> None:
    colours = {}
    for scheme in ("light", "dark"):
        page = browser.new_page(color_scheme=scheme)
        page.goto(address)
        script = "e => getComputedStyle(e).backgroundColor"
        words = page.locator("figure svg text").first.evaluate("e => getComputedStyle(e).fill")
        colours[scheme] = [page.locator("body").evaluate(script), words]
        page.close()
    assert colours["light"][0] != colours["dark"][0] and colours["light"][1] != colours["dark"][1]
