"""Loops for print: names, colours in grey, which samples are drawn, and pictures that were looked at."""

from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.testing.compare import compare_images

from mrfit.errors import DataError
from mrfit.report import paper, paper_stage
from mrfit.report.condition_names import differing_parts, spaced
from mrfit.report.loop_figure import _joined, evenly_along, loops, panels_of
from mrfit.report.paper import FitSeries
from mrfit.report.source import read_source
from mrfit.report.svg import style
from mrfit.settings.figure import FIGURE_KINDS, Settings
from tests.report.layout import collisions

GOLDEN = Path(__file__).parent / "golden"


@pytest.fixture(scope="module")
def fits(damper) -> list[FitSeries]:
    source = read_source(damper[0], ())
    first = FitSeries(source.fits[0], source.series[source.fits[0].name])
    return [first, FitSeries(replace(first.fit, name="tanh.lsq.all"), first.series)]


def legend(canvas: Figure) -> list[str]:
    return [text.get_text().replace("\u00a0", " ") for one in canvas.legends for text in one.get_texts()]


def titles(canvas: Figure) -> list[str]:
    return [axes.get_title().replace("\u00a0", " ").replace("\n", " ") for axes in canvas.axes]


@pytest.mark.parametrize(
    ("names", "separator", "expected"),
    [
        (["sine-5Hz-2mm-0A", "sine-5Hz-2mm-0.25A"], "-", ["0 A", "0.25 A"]),
        (["sine-5Hz-2mm-0A", "sine-3Hz-2mm-1A"], "-", ["5 Hz, 0 A", "3 Hz, 1 A"]),
        (["sine-5Hz--1A", "sine-5Hz-1A"], "-", ["-1 A", "1 A"]),
        (["step-1e-05m-1A", "step-1e-05m-2A"], "-", ["1 A", "2 A"]),
        (["sine-1A", "step-2Hz-1A"], "-", ["sine-1A", "step-2Hz-1A"]),
        (["tanh.auto.all", "spencer.auto.all"], ".", ["tanh", "spencer"]),
        (["tanh.auto.all", "tanh.lsq.all"], ".", ["auto", "lsq"]),
        (
            ["tanh.auto.all", "tanh.auto.all.again", "bingham.lsq.all"],
            ".",
            ["tanh, auto", "tanh, auto, again", "bingham, lsq"],
        ),
        (["tanh.auto", "tanh.auto.again"], ".", ["tanh.auto", "again"]),
        (["sine-5Hz-2mm-0A"], "-", [""]),
    ],
)
def test_names_are_reduced_to_what_differs(names, separator, expected):
    found = differing_parts(names, separator)
    assert [found[n].replace("\u00a0", " ") for n in names] == expected


@given(st.sets(st.from_regex(r"[a-z]{1,5}(-[0-9]{1,3}(\.[0-9])?(Hz|mm|A)){1,3}", fullmatch=True), min_size=2))
def test_reduced_names_tell_apart_what_whole_names_do(names):
    assert len(set(differing_parts(sorted(names), "-").values())) == len(names)


def test_only_a_value_before_letters_has_a_unit():
    assert [spaced(t) for t in ("0.25A", "sine", "2", "1e-05m")] == ["0.25\u00a0A", "sine", "2", "1e-05\u00a0m"]


def test_fits_on_shared_axes_share_the_measured_samples(fits):
    canvas = loops(fits, 3.3, "fits")
    assert len(canvas.axes) == 3 and legend(canvas) == ["measured", "bingham", "tanh"]
    assert all(len([one for one in axes.lines if one.get_marker() == "."]) == 1 for axes in canvas.axes)
    assert titles(canvas)[2].startswith("1.0 A:") and titles(canvas)[2].count("held out") == 1


@pytest.mark.parametrize(
    ("errors", "said"),
    [
        (("1 %", "2 % (held out)"), "1 %; 2 % (held out)"),
        (("1 % (held out)", "2 % (held out)"), "1 %; 2 % (both held out)"),
        (("1 % (held out)",) * 3, "1 %; 1 %; 1 % (all held out)"),
        (("1 % (held-out part)", "2 % (held-out part)"), "1 %; 2 % (held-out parts)"),
        (("1 % (held out)", "2 % (held-out part)"), "1 % (held out); 2 % (held-out part)"),
        (("1 % (held out)",), "1 % (held out)"),
    ],
)
def test_what_is_held_out_is_said_of_each_error_or_of_all(errors, said):
    assert _joined(errors) == said


def test_conditions_on_shared_axes_are_labelled_by_what_differs(fits):
    alone = loops(fits[:1], 3.3, "conditions")
    assert titles(alone) == [""] and [words.split(",")[0] for words in legend(alone)] == [
        "measured",
        "0.0 A",
        "0.5 A",
        "1.0 A",
    ]
    both = loops(fits, 3.3, "conditions")
    assert titles(both) == ["bingham", "tanh"] and legend(both) == ["measured", "0.0 A", "0.5 A", "1.0 A"]


def test_conditions_of_several_motions_have_a_panel_for_each(coil):
    source = read_source(coil[0], ())
    drawn = FitSeries(source.fits[0], source.series[source.fits[0].name])
    panels = panels_of([drawn], "conditions")
    assert [title.replace("\u00a0", " ") for title, _ in panels] == ["1 Hz", "5 Hz", "10 Hz"]
    assert all(
        [c.label.replace("\u00a0", " ") for c in curves[::2]] == [f"{a} A" for a in range(1, 6)] for _, curves in panels
    )


def test_curves_on_shared_axes_differ_in_lightness_and_dashes(fits):
    canvas = loops(fits[:1], 3.3, "conditions")
    curves = [one for one in canvas.axes[0].lines if one.get_marker() != "."]
    dots = [one for one in canvas.axes[0].lines if one.get_marker() == "."]
    assert [one.get_color() for one in curves] == [one.get_color() for one in dots]
    grey = [float(np.dot(to_rgb(one.get_color()), (0.2126, 0.7152, 0.0722))) for one in curves]
    assert min(np.diff(sorted(grey))) > 0.15 and max(grey) < 0.8
    assert len({str(one._dash_pattern) for one in curves}) == len(curves) == 3


def test_measured_samples_are_drawn_evenly_along_the_loop():
    phase = 2.0 * np.pi * np.arange(400) / 400
    across, up = np.sin(phase), np.tanh(20.0 * np.sin(phase))
    at = evenly_along(across, up, 50)
    scaled = np.column_stack([across, up])[at] / 2.0
    # evenly in time, the corner at zero speed would have its samples 25 times as far apart as the ends
    gaps = np.hypot(*np.diff(scaled, axis=0).T)
    assert gaps.max() < 3.0 * gaps.mean() and at[0] == 0 and len(at) > 40
    assert evenly_along(np.ones(5), np.ones(5), 4).tolist() == [0]


def test_a_channel_that_is_not_there_is_said(fits):
    with pytest.raises(DataError, match="no temperature"):
        loops(fits[:1], 3.3, "none", "temperature")


def test_conditions_without_room_are_named(coil, tmp_path):
    written = paper_stage.run(coil[0], "loops", Settings(formats=("png",)), tmp_path)
    assert written.conditions == 12 and len(written.left_out) == 3
    whole = paper_stage.run(coil[0], "loops", Settings(formats=("png",), overlay="conditions"), tmp_path)
    assert whole.conditions == 15 and whole.left_out == []


def drawn_figure(workspace, kind, overlay, width) -> Figure:
    """Return a figure as the command draws it, before it is written."""
    kept: list[Figure] = []
    write = paper_stage._write
    paper_stage._write = lambda canvas, path, form: kept.append(canvas) or path
    try:
        paper_stage.run(workspace, kind, Settings(width=width, formats=("png",), overlay=overlay))
    finally:
        paper_stage._write = write
    return kept[0]


DRAWN = [*((k, "none") for k in FIGURE_KINDS), ("loops", "conditions"), ("loops", "fits")]


@pytest.mark.parametrize(
    ("study", "kind", "overlay", "width"),
    [
        # every kind in both widths and of both studies; of these fours every other one is among the slow tests
        pytest.param(study, *DRAWN[k], width, marks=[pytest.mark.slow] if (i + j + k) % 2 else [])
        for k in range(len(DRAWN))
        for i, study in enumerate(("coil", "damper"))
        for j, width in enumerate(("84mm", "174mm"))
    ],
)
def test_no_text_covers_another_or_a_curve(request, study, kind, overlay, width):
    workspace = request.getfixturevalue(study)[0]
    try:
        canvas = drawn_figure(workspace, kind, overlay, width)
    except DataError as error:
        # the damper's fit has neither profiles nor values over current, the coil's none over current alone
        assert kind in ("parameters", "profiles", "starts"), error
        return
    with style():
        matplotlib.rcParams.update(paper.PRINT)
        assert collisions(canvas) == []


def test_a_legend_on_curves_is_found(fits):
    with style():
        canvas = loops(fits[:1], 3.3, "conditions")
        axes = canvas.axes[0]
        axes.legend(handles=canvas.legends[0].legend_handles, loc="center")
        assert any("on a curve" in line for line in collisions(canvas))


@pytest.mark.parametrize("overlay", ["conditions", "fits", "none"])
def test_pictures_are_those_that_were_looked_at(fits, tmp_path, overlay):
    with style():
        matplotlib.rcParams.update(paper.PRINT)
        canvas = loops(fits if overlay == "fits" else fits[:1], 84.0 / 25.4, overlay)
        made = tmp_path / f"loops-{overlay}.png"
        canvas.savefig(made, dpi=100, metadata={"Software": None})
    assert compare_images(str(GOLDEN / made.name), str(made), tol=3.0) is None
