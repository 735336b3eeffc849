import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from mrfit.report.figures import draw_all, drawings_of
from mrfit.report.source import OutputSeries, read_source


def texts(svg: str) -> list[str]:
    return [e.text or "" for e in ElementTree.fromstring(svg).iter() if e.tag.endswith("text")]


def drawings(study) -> dict[str, str]:
    paths = sorted(study[0].report_folder.glob("figures/*.svg"))
    return {p.stem.rpartition(".")[2]: p.read_text(encoding="utf-8") for p in paths}


@pytest.fixture(scope="module")
def drawn(coil, damper):
    return drawings(coil), drawings(damper)


def test_a_coil_has_a_flux_current_loop_and_a_damper_both_force_loops(drawn):
    coil, damper = ({re.sub(r"-\d+$", "", n) for n in d} for d in drawn)
    common = {"nrmse", "time-history", "residual", "convergence", "predicted", "correlation", "starts"}
    assert coil == {"loop-current", "profiles"} | common
    assert damper == {"loop-velocity", "loop-displacement"} | common


def test_axes_are_labelled_with_symbol_and_unit(drawn):
    coil, damper = drawn
    assert {"Flux λ (mWb)", "Current i (A)"} <= set(texts(coil["loop-current-1"]))
    assert {"Force F (N)", "Displacement x (mm)"} <= set(texts(damper["loop-displacement"]))
    assert {"Force F (N)", "Time t (s)", "measured", "simulated"} <= set(texts(damper["time-history"]))


def test_every_condition_has_its_panel(drawn):
    coil, _ = drawn
    panels = [t for k in (1, 2, 3) for t in texts(coil[f"time-history-{k}"]) if t.startswith("sine-")]
    assert [p.split(" ")[0] for p in panels] == [f"sine-{f}Hz-{a}A" for f in (1, 5, 10) for a in range(1, 6)]


def test_files_stay_small(drawn):
    assert max(len(svg) for figures in drawn for svg in figures.values()) < 250_000


def test_figures_say_what_they_show(coil):
    page = (coil[0].report_folder / "index.html").read_text(encoding="utf-8")
    assert 'aria-label="NRMSE of 15 conditions; largest 1.86 % at sine-10Hz-1A."' in page
    assert 'aria-label="Convergence of pso-fmin; costs reached: sine-1Hz-1A 0.226 mWb, ' in page
    assert "<strong>Residual, sine-5Hz.</strong>" in page


def plot_points(svg: str) -> int:
    return max(len(re.findall("[ML]", d)) for d in re.findall(r' d="([^"]*)"', svg))


def test_long_records_are_decimated(damper):
    fit = read_source(damper[0], ()).fits[0]
    rng = np.random.default_rng(1)
    noise = rng.standard_normal(100_000)
    condition = fit.metrics[0].condition
    long = OutputSeries(condition, "a#0", "train", np.arange(100_000) / 1e3, noise, 0.0 * noise, {}, 0.0)
    figures = {f.title: f for f in draw_all(drawings_of(fit, [long]))}
    assert plot_points(figures["Residual"].svg) <= 2000


def test_a_diverged_simulation_does_not_scale_the_figure(damper):
    source = read_source(damper[0], ())
    fit, one = source.fits[0], source.series[source.fits[0].name][0]
    wild = replace(one, simulated=1e3 * one.simulated)

    def largest(series):
        figures = {f.title: texts(f.svg) for f in draw_all(drawings_of(fit, [series]))}
        kinds = (figures["Time history"], figures["Force–velocity loop"])
        return [max(float(t.replace("−", "-")) for t in words if re.fullmatch(r"−?[\d.]+", t)) for words in kinds]

    for sound, scaled in zip(largest(one), largest(wild), strict=True):
        assert sound <= scaled <= 2.1 * sound


def test_diverged_fit_is_still_drawn(damper):
    fit = read_source(damper[0], ()).fits[0]
    rows = [replace(m, nrmse=None, rmse=None) for m in fit.metrics]
    results = [replace(r, history=[(10, None)], cost=None) for r in fit.results]
    lost = replace(fit, metrics=rows, results=results)
    time = np.arange(50) / 50.0
    one = OutputSeries(rows[0].condition, "a#0", "train", time, np.sin(time), np.full(50, np.nan), {}, 0.0)
    assert [f.title for f in draw_all(drawings_of(lost, [one]))] == ["Time history", "Residual"]


@pytest.mark.parametrize("thinned", [0, 3])
def test_best_cost_only_falls_and_that_on_thinned_data_is_a_line_of_its_own(damper, thinned, monkeypatch):
    from mrfit.report import figures

    fit = read_source(damper[0], ()).fits[0]
    # on thinned data the cost was lower; on all of them a point tried twice costs the same but for rounding
    history = [(10.0, None), (20.0, 5.0), (40.0, 2.0), (60.0, 3.0), (80.0, 2.5), (90.0, 2.5 + 1e-12)]
    changed = {"history": history, "preliminary": thinned}
    results = [replace(r, **changed) for r in fit.results]
    drawn = []
    monkeypatch.setattr(figures, "to_svg", lambda canvas, title: drawn.append(canvas) or "<svg/>")
    figure = figures.convergence_figure(replace(fit, results=results))
    curves = [line.get_ydata() for line in drawn[0].axes[0].lines]
    assert all(np.all(np.diff(curve) <= 0.0) for curve in curves)
    assert len(curves) == len(results) * (2 if thinned else 1)
    assert ("thinned data" in figure.caption) == bool(thinned)


def test_long_names_are_broken_not_overlapped(damper):
    fit = read_source(damper[0], ()).fits[0]
    time = np.arange(50) / 50.0
    names = [f"triangle-1.25Hz-0.02m-{k}.5A-25degC-repeat" for k in range(5)]
    many = [OutputSeries(n, f"{n}#0", "holdout", time, np.sin(time), np.sin(time), {}, 0.0) for n in names]
    figure = next(f for f in draw_all(drawings_of(fit, many)) if f.title == "Time history")
    lines = [t for t in texts(figure.svg) if "triangle" in t or "hold-out" in t or "held-out" in t]
    assert len(lines) == 10 and max(len(t) for t in lines) <= 48


@pytest.mark.parametrize("panels", [4, 9, 12])
def test_titles_stay_within_the_figure(panels, tmp_path):
    from mrfit.report import figures

    heading = figures._heading(
        OutputSeries("sine-1.25Hz-0.0125m-0.75A-20degC-again", "s", "holdout", *[np.zeros(2)] * 3, {}),
        "condition",
        0.01234,
        figures.TITLE_WIDTHS[figures.columns_of(panels)],
    )
    canvas = figures.canvas_of(figures.FIGURE_WIDTH, 4.0)
    axes = canvas.subplots(1, figures.columns_of(panels), squeeze=False)[0]
    with figures.style():
        titles = [a.set_title(heading, loc="left", fontsize=8.5) for a in axes]
        canvas.draw_without_rendering()
    assert max(t.get_window_extent().x1 for t in titles) <= canvas.bbox.x1
    for left, right in zip(titles, titles[1:], strict=False):
        assert left.get_window_extent().x1 < right.get_window_extent().x0
