import re
from dataclasses import replace

import numpy as np
import pytest

from mrfit.errors import ConfigError, DataError
from mrfit.io.schemas.fit import Level
from mrfit.report import paper_stage
from mrfit.report.paper import correlated
from mrfit.report.parameter_figure import parameters, quantity_of
from mrfit.report.profile_figure import profiles
from mrfit.report.source import read_source, with_integrals
from mrfit.settings.figure import FIGURE_KINDS, Settings


@pytest.mark.parametrize(
    ("text", "inches"), [("84mm", 84.0 / 25.4), ("17.4 cm", 17.4 / 2.54), ("3.3in", 3.3), ("239pt", 239.0 / 72.0)]
)
def test_widths_are_read_in_the_units_of_print(text, inches):
    assert paper_stage.width_of(text) == pytest.approx(inches)


@pytest.mark.parametrize("text", ["84", "3mm", "nan mm", "-84mm", "2m"])
def test_what_is_no_width_is_refused(text):
    with pytest.raises(ConfigError, match="--width takes 40mm to 500mm"):
        paper_stage.width_of(text)


@pytest.mark.parametrize("width", ["84mm", "174mm"])
@pytest.mark.parametrize("kind", [k for k in FIGURE_KINDS if k != "parameters"])
def test_a_figure_has_its_width_and_no_text_below_7_pt(coil, tmp_path, kind, width):
    written = paper_stage.run(coil[0], kind, Settings(width=width, formats=("svg",)), tmp_path)
    (svg,) = (path.read_text(encoding="utf-8") for path in tmp_path.iterdir())
    points = float(re.search(r'<svg[^>]* width="([\d.]+)pt"', svg)[1])
    assert points == pytest.approx(float(width.removesuffix("mm")) / 25.4 * 72.0, abs=0.1)
    sizes = [float(s) for s in re.findall(r"font(?:-size)?:[^;\"]*?([\d.]+)px", svg)]
    assert len(sizes) > 6 and min(sizes) >= 7.0
    assert [str(p) for p in tmp_path.iterdir()] == written.files


def test_a_pdf_is_the_same_bytes_every_time(damper, tmp_path):
    files = []
    for name in ("a", "b"):
        paper_stage.run(damper[0], "loops", Settings(formats=("pdf",)), tmp_path / name)
        files += [p.read_bytes() for p in (tmp_path / name).iterdir()]
    assert files[0] == files[1] and files[0].startswith(b"%PDF")


def test_correlation_finds_a_delay_and_that_a_signal_is_like_itself():
    rng = np.random.default_rng(3)
    first = rng.standard_normal(4000)
    lags, values = correlated(np.roll(first, 7), first, 50)
    assert lags[np.argmax(values)] == 7 and values.max() == pytest.approx(1.0, abs=0.01)
    lags, values = correlated(first, first, 50)
    assert values[lags == 0][0] == pytest.approx(1.0)
    direct = [np.sum((first - first.mean())[k:] * (first - first.mean())[: 4000 - k]) for k in (0, 1, 2)]
    assert values[50:53] == pytest.approx(np.array(direct) / direct[0], abs=1e-9)


def test_parameters_are_joined_where_conditions_differ_in_one_quantity_alone(coil):
    source = read_source(coil[0], ())
    fit = source.fits[0]
    at = [Level(frequency=f * (1.0 + 0.01 * (a % 2)), amplitude=float(a)) for f in (1, 5, 10) for a in range(1, 6)]
    known = replace(fit, results=[replace(r, at=level) for r, level in zip(fit.results, at, strict=True)])
    assert quantity_of(known, []) == "frequency" and quantity_of(fit, []) == ""
    canvas = parameters([known], [], "amplitude", 7.0)
    titles = [axes.get_title() for axes in canvas.axes]
    assert "Coil inductance, Lc (H)" in titles and not any("what D is" in t for t in titles)
    panel = canvas.axes[titles.index("Coil inductance, Lc (H)")]
    assert len(panel.lines) == 3
    x, y = panel.lines[0].get_data()
    assert x.tolist() == [1, 2, 3, 4, 5] and y == pytest.approx(0.0234567 - 0.001 * x)
    with pytest.raises(DataError, match="over current"):
        parameters([known], [], "current", 7.0)


def test_displacement_is_the_integral_of_velocity_in_a_periodic_test():
    time = np.arange(2000) / 1000.0
    velocity = 0.3 * np.cos(4.0 * np.pi * time) + 0.01
    found = with_integrals({"velocity": velocity}, time, 2.0)
    assert found["displacement"] == pytest.approx(0.3 / (4.0 * np.pi) * np.sin(4.0 * np.pi * time), abs=2e-5)
    assert "displacement" not in with_integrals({"velocity": velocity}, time, 0.0)
    assert with_integrals({"velocity": velocity, "displacement": time}, time, 2.0)["displacement"] is time


def test_what_cannot_be_drawn_is_said(coil, damper):
    with pytest.raises(ConfigError, match="no figure 'pie'"):
        paper_stage.run(coil[0], "pie", Settings())
    with pytest.raises(ConfigError, match="--format takes"):
        paper_stage.run(coil[0], "loops", Settings(formats=("gif",)))
    with pytest.raises(DataError, match=r"no condition is like square\*; give --condition one of \w+"):
        paper_stage.run(coil[0], "loops", Settings(conditions=("square*",)))
    with pytest.raises(DataError, match="no speed in the residuals of all fits; give --over one of .*, time"):
        paper_stage.run(coil[0], "loops", Settings(over="speed"))


def test_a_profile_is_drawn_through_what_was_computed_and_cut_at_its_interval(coil):
    fit = read_source(coil[0], ()).fits[0]
    (axes,) = profiles([fit], 3.3).axes
    profile = fit.results[0].profiles[0]
    limit, curve, dots = axes.lines[:3]
    assert limit.get_ydata()[0] == pytest.approx(1.96**2)
    assert dots.get_xdata() == pytest.approx(profile.values)
    assert dots.get_ydata() == pytest.approx(np.square(profile.rises))
    # the root is a straight line here: between the dots the curve is its square
    middle = fit.results[0].parameters[1].value
    expected = (0.98 * (curve.get_xdata() - middle) / 1.05e-4) ** 2
    assert curve.get_ydata() == pytest.approx(expected, abs=0.02)
    with pytest.raises(DataError, match="--intervals profile"):
        profiles([replace(fit, results=[replace(r, profiles=[]) for r in fit.results])], 3.3)
