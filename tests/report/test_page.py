import csv
import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest

from mrfit.io.schemas.fit import CurrentChoice, FitDependence
from mrfit.io.schemas.stages import FluxFile, FluxRow, FluxSettings
from mrfit.report.figures import draw_all, drawings_of, worst_and_typical
from mrfit.report.page import _equations, rankings, render
from mrfit.report.source import read_source

VOID = {"meta", "br", "link", "img", "hr", "input"}


class Page(HTMLParser):
    """Tables as rows of cells, each cell with its attributes, text and the exact values in it; every tag and link."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tables: dict[str, list[list[dict]]] = {}
        self.open: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.captions: dict[str, str] = {}
        self.unbalanced: list[str] = []
        self._table, self._cell, self._row = "", {}, {}
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.attributes += [(tag, k, v or "") for k, v in attrs]
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self._table = given["class"].split()[0]
            self.tables.setdefault(self._table, [])
        elif tag == "tr" and self._table:
            self.tables[self._table].append([])
            self._row = given
        elif tag in ("td", "th") and self._table:
            self._cell = {"exact": [], "shown": [], "text": "", **self._row, **given}
            self.tables[self._table][-1].append(self._cell)
        elif tag == "data":
            self._cell["exact"].append(given["value"])

    def handle_startendtag(self, tag, attrs):
        self.attributes += [(tag, k, v or "") for k, v in attrs]

    def handle_endtag(self, tag):
        if self.open.pop() != tag:
            self.unbalanced.append(tag)
        if tag == "table":
            self._table = ""

    def handle_data(self, data):
        if self._table and "caption" in self.open:
            self.captions[self._table] = self.captions.get(self._table, "") + data
        if self._table and self._cell:
            self._cell["text"] += data
            if self.open[-1] == "data":
                self._cell["shown"].append(data)


def plain(shown: str) -> float:
    digits = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--")
    mantissa, _, exponent = shown.partition("×10")
    return float(mantissa.translate(digits) + ("e" + exponent.translate(digits) if exponent else ""))


@pytest.fixture(scope="module", params=["coil", "damper"])
def study(request):
    workspace, _ = request.getfixturevalue(request.param)
    return workspace.report_folder


@pytest.fixture(scope="module")
def page(study) -> Page:
    return Page((study / "index.html").read_text(encoding="utf-8"))


def table(folder, name):
    return list(csv.DictReader((folder / name).read_text(encoding="utf-8").splitlines()))


def test_page_is_balanced_html(page):
    assert not page.open and not page.unbalanced


def test_every_error_equals_the_csv(study, page):
    written = table(study, "metrics.csv")
    shown = page.tables["metrics"][1:]
    assert len(shown) == len(written)
    roles = {"training": "train", "hold-out": "holdout"}
    for cells, row in zip(shown, written, strict=True):
        assert (cells[0]["text"], roles[cells[1]["text"]]) == (row["condition"], row["role"])
        values = list(row.values())[2:]
        assert [(c["exact"] or [""])[0] for c in cells[2:]] == values


def test_every_parameter_equals_the_csv(study, page):
    written = {(r["condition"], r["parameter"]): r for r in table(study, "parameters.csv")}
    seen: dict[tuple[str, str], list[str]] = {}
    for name in ("parameters", "derived"):
        for cells in page.tables.get(name, []):
            for cell in cells:
                if "data-name" in cell:
                    seen.setdefault((cell["data-condition"], cell["data-name"]), []).extend(cell["exact"])
    assert seen.keys() == written.keys()
    for key, exact in seen.items():
        row = written[key]
        held = row["low"] == row["high"]
        assert exact == [row["value"], *([] if held else [row["low"], row["high"]])]


def factor_of(heading: str, exact: str, shown: str) -> float:
    """By what the number shown is to exceed the exact one: the heading has the unit, shares are in percent."""
    if shown.endswith(" %") or "(%)" in heading and not re.match("ESR|fit", heading):
        return 100.0
    return {"mWb": 1e3, "mWb²": 1e6}.get(heading.partition("(")[2].strip().rstrip(")"), 1.0)


def test_shown_numbers_are_the_exact_ones_rounded_in_the_unit_of_the_heading(page):
    pairs = [
        (exact, shown, rows[0][column]["text"] if len(cells) == len(rows[0]) else "")
        for rows in page.tables.values()
        for cells in rows
        for column, cell in enumerate(cells)
        for exact, shown in zip(cell["exact"], cell["shown"], strict=True)
    ]
    assert len(pairs) > 30
    for exact, shown, heading in pairs:
        factor = factor_of(heading, exact, shown)
        assert plain(shown.removesuffix(" %")) == pytest.approx(factor * float(exact), rel=6e-3), (heading, shown)


def test_the_output_has_one_unit_on_the_page_and_in_its_figures(study):
    text = (study / "index.html").read_text(encoding="utf-8")
    unit = "mWb" if "boucwen-flux" in text else "N"
    named = set(
        re.findall(
            r"\b(?:µ|m|k)?(?:Wb|N)\b(?![·/²])",
            re.sub(r'<table class="(?:parameters|derived|flux).*?</table>|<pre>.*?</pre>', "", text, flags=re.S),
        )
    )
    assert named == {unit}


def test_what_is_not_identifiable_or_at_a_bound_is_said_in_words(coil):
    page = Page((coil[0].report_folder / "index.html").read_text(encoding="utf-8"))
    cells = {c["data-name"]: c["text"] for c in page.tables["parameters"][1] if "data-name" in c}
    assert "not determined" in cells["A"] and "determined" not in cells["Lc"]
    assert "at its bound 1.00" in cells["n"]
    assert "held fixed" in cells["D"]


def test_page_asks_for_nothing_from_outside(study, page):
    links = [v for tag, name, v in page.attributes if name in ("href", "src", "xlink:href", "srcset", "data", "action")]
    assert links and all(v.startswith("#") for v in links)
    text = (study / "index.html").read_text(encoding="utf-8")
    assert not re.search(r"https?:|//\w|@import|url\((?!#)", text)


def test_links_lead_somewhere_and_ids_are_unique(page):
    ids = [v for _, name, v in page.attributes if name == "id"]
    assert len(ids) == len(set(ids))
    assert {v[1:] for _, name, v in page.attributes if name in ("href", "xlink:href")} <= set(ids)


def test_tables_have_captions_and_figures_are_described(page):
    assert set(page.captions) == set(page.tables)
    drawings = [v for tag, name, v in page.attributes if tag == "svg" and name == "aria-label"]
    assert len(drawings) >= 5 and all(len(v) > 20 for v in drawings)
    assert sum(tag == "svg" and name == "role" for tag, name, _ in page.attributes) == len(drawings)


def test_text_from_files_is_not_taken_for_markup(coil, damper):
    assert "end of the range &lt;5 A&gt;" in (coil[0].report_folder / "index.html").read_text(encoding="utf-8")
    assert "yield force &lt;at rest&gt;" in (damper[0].report_folder / "index.html").read_text(encoding="utf-8")


def test_page_tells_what_was_run_and_read(coil):
    text = (coil[0].report_folder / "index.html").read_text(encoding="utf-8")
    for said in (
        "pso-fmin, 90000 evaluations in all",
        "bounds of n 1 to 10",
        "λ = A·Lc·i + (1−A)·Lc·z/D",
        "Tang et al., eq. 5",
        "logs/coil-10Hz-5A.csv",
        "no numeric rows; check the file",
        "2.5000 ± 0.010",
        "loop area = 0.01 J static hysteresis",
        "coil-1Hz-1A: measured flux kept",
        "determine 3 of 4 directions; free to move along −0.8·kappa +0.6·A",
        "no, in 1 of 1",
    ):
        assert said in text, said


@pytest.mark.parametrize(
    ("model", "moved", "said"),
    [
        ("tanh", None, []),
        ("tanh+current-lag", None, ["current-lag: d(i_sim)/dt = (i(t - t_d) - i_sim)/tau"]),
        ("tanh", {"fy": 2, "c": 0}, ["parameters over the current i: fy"]),
        ("tanh+not-loaded", None, []),
    ],
)
def test_the_equations_are_those_of_the_model_and_of_its_effects(coil, model, moved, said):
    dependence = moved and FitDependence(orders=moved, low=0.0, high=2.0)
    fit = replace(read_source(coil[0], ()).fits[0], model=model, equation="F = …", current_dependence=dependence)
    assert _equations(fit) == ["F = …", *said]


def test_several_fits_are_compared(coil):
    source = read_source(coil[0], ())
    other = replace(source.fits[0], name="second")
    both = type(source)([source.fits[0], other], source.series, source.ingest, source.flux, source.segments)
    figures = draw_all(drawings_of(source.fits[0], []))
    page = Page(render(both, {source.fits[0].name: figures, "second": figures}))
    assert [row[0]["text"] for row in page.tables["comparison"][1:]] == [source.fits[0].name, "second"]
    ids = [v for _, name, v in page.attributes if name == "id"]
    assert len(ids) == len(set(ids))


def test_the_best_of_fits_judged_on_the_same_data_is_bold_and_one_that_diverged_says_so(coil):
    fit = read_source(coil[0], ()).fits[0]

    def with_error(name, factor, role="holdout"):
        rows = [replace(m, nrmse=(m.nrmse or 0.0) * factor) for m in fit.metrics if role == "holdout" or m.role == role]
        return replace(fit, name=name, metrics=rows)

    fits = [with_error("b", 2.0), with_error("a", 1.0), with_error("wild", 1e4), with_error("unjudged", 0.1, "train")]
    first, second = rankings(fits, {})
    assert [(p.ranked.fit.name, p.best, p.ranked.diverged) for p in first.places] == [
        ("a", True, False),
        ("b", False, False),
        ("wild", False, True),
    ]
    assert "other cycles" in first.words and "training error" in second.words
    # alone in its table it is not better than others, however small its error
    assert [(p.ranked.fit.name, p.best) for p in second.places] == [("unjudged", False)]


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        (
            {"current_order": "auto", "only": "", "stall": 0.5, "intervals": "hac", "weight": "none", "seconds": None},
            "",
        ),
        ({"only": "MH", "current_order": "fy=1"}, "current order fy=1; only MH"),
        ({"stall": 0.1, "intervals": "profile", "fixed": [["fy", 2.0]]}, "fy fixed at 2; intervals profile; stall 0.1"),
    ],
)
def test_every_choice_of_the_user_is_on_the_page(small, settings, text):
    source = read_source(small, ())
    source.fits[0] = replace(source.fits[0], settings=settings)
    page = render(source, {source.fits[0].name: []})
    assert ("<dt>Settings</dt>" in page) == bool(text)
    assert f"<dt>Settings</dt><dd>{text}</dd>" in page or not text


def test_what_was_chosen_and_rejected_of_laws_of_current_is_on_the_page(small):
    source = read_source(small, ())
    assert "Dependence on current" not in render(source, {source.fits[0].name: []})
    told = ["law of current by the error", "fy: polynomial of order 2, 1.01; rejected plain1 4.02 <b>"]
    source.fits[0] = replace(source.fits[0], current_choice=CurrentChoice(text=told))
    page = render(source, {source.fits[0].name: []})
    assert "<li>fy: polynomial of order 2, 1.01; rejected plain1 4.02 &lt;b&gt;</li>" in page


def test_findings_of_the_flux_are_on_the_page(small):
    source = read_source(small, ())
    row = FluxRow(id="a", action="integrated", resistance=2.0)
    told = FluxFile(
        settings=FluxSettings(), recordings=[row], findings=["a: bias-change: the mean of the current changes"]
    )
    source = replace(source, flux=told)
    assert "a: bias-change: the mean" in render(source, {source.fits[0].name: []})


def test_nothing_is_hidden_where_scripts_do_not_run_or_the_page_is_printed(study):
    text = (study / "index.html").read_text(encoding="utf-8")
    assert re.findall("<details[^>]*>", text)
    assert all(" open" in d for d in re.findall('<details class="fold"[^>]*>', text))
    printed = text[text.index("@media print {\n@page") :]
    assert ".scroll { overflow: visible; }" in printed and "beforeprint" in text
    # a number breaks between words only
    assert "td.num { overflow-wrap: normal; }" in printed


def test_the_page_s_own_script_is_small(study):
    text = (study / "index.html").read_text(encoding="utf-8")
    (script,) = re.findall(r"<script>(.*?)</script>", text, flags=re.DOTALL)
    assert 1000 < len(script.encode()) <= 15_000
    assert "innerHTML" not in script and "eval(" not in script


def test_figures_in_the_page_take_its_colours(study):
    text = (study / "index.html").read_text(encoding="utf-8")
    drawn = "".join(re.findall(r"<figure.*?</figure>", text, flags=re.DOTALL))
    assert set(re.findall(r"#[0-9a-f]{6}", drawn)) <= {"#000000"}
    used = set(re.findall(r"var\(--(\w+)\)", drawn))
    for block in re.findall(r":root \{(.*?)\}", text, flags=re.DOTALL):
        assert used <= set(re.findall(r"--(\w+):", block))


def test_cells_say_their_heading_on_a_narrow_screen(page):
    labelled = {v for _, name, v in page.attributes if name == "data-label"}
    for name in ("metrics", "comparison"):
        rows = page.tables[name][1:]
        assert all("data-label" in cell for cells in rows for cell in cells[1:])
    assert {"hold-out NRMSE", "well determined"} <= labelled
    assert any(re.fullmatch(r"RMSE \(\w+\)", label) for label in labelled)


def test_of_many_conditions_the_worst_and_the_typical_are_drawn(coil):
    source = read_source(coil[0], ())
    fit = source.fits[0]
    series = source.series[fit.name]
    rows, many = [], []
    for k in range(60):
        one = next(m for m in fit.metrics if m.role == "train")
        rows.append(replace(one, condition=f"c{k}", nrmse=0.01 * (1 + (37 * k) % 60)))
        many.append(replace(series[0], condition=f"c{k}", role="train"))
    chosen = worst_and_typical(replace(fit, metrics=rows), many)
    errors = sorted(round(100.0 * next(r.nrmse for r in rows if r.condition == s.condition)) for s in chosen)
    assert errors == [28, 29, 30, 31, 32, 33, 55, 56, 57, 58, 59, 60]
    assert worst_and_typical(fit, many[:24]) == many[:24]
