"""The page of a comparison of fits: drifts, units that stand out, ranges of all units, and a figure of every trend."""

from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

from mrfit.core.counting import number_of
from mrfit.core.specs import Array
from mrfit.drift.analysis import COVARIATE_UNITS, DRIFT_LEVEL, LEAST_PROBABILITY, Trend
from mrfit.io.schemas.drift import DriftFile, ParameterOverUnits
from mrfit.report.figures import MEASURED, PALETTE, QUIET, SIMULATED, panels_of, plain_log
from mrfit.report.numbers import in_html, significant, unit_html
from mrfit.report.sections import Section, SectionFigure, Table, hover_script
from mrfit.report.sections import render as render_sections
from mrfit.report.svg import Axes, inline, style, to_svg

PANELS_DRAWN, PANELS_ACROSS = 60, 2
LINES_OF_UNITS = 12
"""Units whose tests are joined by lines."""
BAND_POINTS = 80
WIDE_LOGARITHMS = 1.0
"""Range of the logarithms of values from which on their axis is logarithmic."""
SLOPE_HEADS = ("Parameter", "Condition", "Covariate", "Per", "Change", "95 % interval", "p, all tests", "Drifts")
ODD_HEADS = ("Unit", "Condition", "Parameter", "Value", "Studentised", "p, all tests")
RANGE_HEADS = ("Parameter", "Condition", "Units", "Tests", "Mean", "95 % interval", "Between units", "Tolerance 95/95")
SPREAD_HEADS = ("Parameter", "Condition", "Repeatability", "Reproducibility", "95 % lie above", "95 % lie below")


def render(found: DriftFile, trends: Sequence[Trend]) -> str:
    """Return the page."""
    rows = found.parameters
    tables = {
        "Candidates": Table(
            "", ("Effect", "Condition", "Why"), [(c.effect, c.condition, c.text) for c in found.causes]
        ),
        "Changes with covariates": Table("", SLOPE_HEADS, slope_rows(rows)),
        "Steps": Table("", ("Parameter", "Condition", "Where", "Change", "p, all tests"), step_rows(rows)),
        "Units that stand out": Table("", ODD_HEADS, odd_rows(rows)),
        "Ranges of all units": Table("", RANGE_HEADS, range_rows(rows)),
        "Repeatability and bounds": Table("", SPREAD_HEADS, spread_rows(rows)),
        "Notes": Table("", ("What",), [(n,) for n in found.notes]),
    }
    sections = [Section(title, tables=[table]) for title, table in tables.items() if table.rows]
    if trends:
        what = found.over[0] if found.over else "unit"
        caption = (
            f"Parameters over {what}. Points: tests with 95 % intervals, at the mean of other covariates; line and "
            "dark band: mean and its 95 % interval; light band: 95 % of all units, with 95 % "
            "confidence; red: units that stand out."
        )
        drawn = inline(figure(trends), "d", "Every parameter over its covariate, or by unit")
        sections.append(Section(f"Trends over {what}", figures=[SectionFigure("", caption, drawn)]))
    words = (
        f"{number_of('unit', found.units)}, {number_of('test', found.tests)}. Means and "
        "deviations take units as normal, without those that stand out; ranges take all, with tails that may be "
        f"heavier. Chance names a drift in {100.0 * DRIFT_LEVEL:g} % of comparisons. "
        "Deviations and changes are shares of the value where its scale is logarithmic."
    )
    return render_sections("Drift and units", words, (), sections, "drift.json, drift.csv", script=hover_script())


def slope_rows(rows: Sequence[ParameterOverUnits]) -> list[tuple[object, ...]]:
    """Return changes with covariates, those that drift first."""
    made = [
        (s.probability, (r.parameter, r.condition, s.covariate, s.per, _change(r, s.value), _both(r, s.low, s.high)), s)
        for r in rows
        for s in r.slopes
    ]
    ordered = sorted(made, key=lambda one: (not one[2].drifts, one[0]))
    return [(*cells, _probability(s.probability), "yes" if s.drifts else "no") for _, cells, s in ordered]


def step_rows(rows: Sequence[ParameterOverUnits]) -> list[tuple[object, ...]]:
    """Return steps."""
    return [
        (r.parameter, r.condition, f"{c.covariate} {shown(c.at)}", _change(r, c.change), _probability(c.probability))
        for r in rows
        if (c := r.change)
    ]


def odd_rows(rows: Sequence[ParameterOverUnits]) -> list[tuple[object, ...]]:
    """Return the units that stand out, the clearest first."""
    every = [(o, r) for r in rows for o in r.stands_out]
    return [
        (o.specimen, r.condition, r.parameter, _value(r, o.value), shown(o.z), _probability(o.probability))
        for o, r in sorted(every, key=lambda one: -abs(one[0].z))
    ]


def range_rows(rows: Sequence[ParameterOverUnits]) -> list[tuple[object, ...]]:
    """Return mean, standard deviation between units and tolerance interval."""
    return [
        (
            *(r.parameter, r.condition, r.units, r.tests, _value(r, r.mean)),
            f"{shown(r.mean_low)} to {shown(r.mean_high)}",
            _between(r),
            f"{shown(r.tolerance_low)} to {shown(r.tolerance_high)}",
        )
        for r in rows
        if r.mean is not None
    ]


def _between(r: ParameterOverUnits) -> str:
    # an interval of nothing but 0: the note says why
    if r.between_high == 0.0:
        return "not told"
    return f"{_change(r, r.between)} ({_change(r, r.between_low)} to {_change(r, r.between_high)})"


def spread_rows(rows: Sequence[ParameterOverUnits]) -> list[tuple[object, ...]]:
    """Return repeatability, reproducibility and one-sided bounds."""
    return [
        (
            *(r.parameter, r.condition, _change(r, r.repeatability), _change(r, r.reproducibility)),
            *(_value(r, r.least), _value(r, r.greatest)),
        )
        for r in rows
        if r.mean is not None or r.repeatability is not None
    ]


def shown(value: float | None, digits: int = 4) -> str:
    """Return a number as the page and the terminal have it."""
    return in_html(significant(value, digits))


def _probability(value: float) -> str:
    return "< 10⁻⁶" if value < LEAST_PROBABILITY else shown(value)


def _value(row: ParameterOverUnits, value: float | None) -> str:
    return f"{shown(value)} {unit_html(row.unit)}".strip()


def _change(row: ParameterOverUnits, value: float | None) -> str:
    if value is None:
        return "–"
    return f"{shown(100.0 * value, 3)} %" if row.logarithmic else f"{shown(value, 3)} {unit_html(row.unit)}".strip()


def _both(row: ParameterOverUnits, low: float, high: float) -> str:
    return f"{_change(row, low)} to {_change(row, high)}"


def figure(trends: Sequence[Trend]) -> str:
    """Return an SVG with a panel for every parameter: its tests, the mean with its band, and the tolerance interval."""
    chosen = sorted(trends, key=lambda t: not t.odd and t.change is None)[:PANELS_DRAWN]
    with style():
        canvas, panels = panels_of(len(chosen), PANELS_ACROSS, 2.4)
        for axes, trend in zip(panels, chosen, strict=True):
            _panel(axes, trend)
        return to_svg(canvas, "Trends of all parameters")


def _panel(axes: "Axes", trend: Trend) -> None:
    """Draw a parameter over its first covariate, other covariates at their means; without one by unit."""
    first, back = trend.rows[0], np.exp if trend.rows[0].log_scale else np.asarray
    place = trend.values[:, 0] if trend.covariates else trend.units.astype(np.float64)
    others = trend.centred[:, 1:] @ trend.fitted.beta[2:] if trend.covariates and trend.fitted else 0.0
    y, width = trend.y - others, 1.96 * np.sqrt(trend.known)
    odd = np.isin(trend.units, [k for k, _, _ in trend.odd])
    for chosen, colour in ((~odd, MEASURED), (odd, SIMULATED)):
        ends = np.abs(back(np.stack([y - width, y + width])) - back(y))[:, chosen]
        axes.errorbar(
            place[chosen], back(y[chosen]), ends, fmt="o", markersize=3.0, color=colour, elinewidth=0.7, zorder=3
        )
    across = np.linspace(place.min(), place.max(), BAND_POINTS)
    if trend.covariates and trend.repeated and len(trend.names) <= LINES_OF_UNITS:
        for k in range(len(trend.names)):
            own = np.flatnonzero(trend.units == k)
            own = own[np.argsort(place[own], kind="stable")]
            axes.plot(place[own], back(y[own]), color=QUIET, linewidth=0.7)
    if (found := _mean_of(trend, across)) is not None:
        mean, half = found
        axes.plot(across, back(mean), color=PALETTE[0], linewidth=1.4)
        axes.fill_between(across, back(mean - half), back(mean + half), color=PALETTE[0], alpha=0.3, linewidth=0.0)
        if trend.population:
            # off the mean of the covariate the slope adds its error, here as to the mean
            whole = trend.population
            more = np.sqrt(np.maximum(half**2 - (np.ptp(whole.mean_interval) / 2.0) ** 2, 0.0))
            low, high = (np.maximum(np.hypot(end - whole.mean, more), half) for end in whole.tolerance)
            axes.fill_between(across, back(mean - low), back(mean + high), color=QUIET, alpha=0.2, linewidth=0.0)
    unit = unit_html(first.unit)
    named = f"{first.parameter} ({unit})" if unit else first.parameter
    axes.set_title(f"{named}, {first.condition}" if first.condition else named)
    if first.log_scale and np.ptp(y) > WIDE_LOGARITHMS:
        axes.set_yscale("log")
        plain_log(axes)
    over = trend.covariates[0] if trend.covariates else "unit"
    axes.set_xlabel(f"{over} ({COVARIATE_UNITS[over]})" if over in COVARIATE_UNITS else over, fontsize=8.0)


def _mean_of(trend: Trend, across: Array) -> tuple[Array, Array] | None:
    """Return the mean at places along the first covariate with half its 95 % interval; None of too few tests."""
    fitted, found = trend.fitted, trend.population
    half = np.full(BAND_POINTS, np.ptp(found.mean_interval) / 2.0 if found else np.nan)
    if not trend.covariates or not fitted:
        return (np.full(BAND_POINTS, found.mean), half) if found else None
    errors = np.sqrt(np.maximum(np.diag(fitted.covariance)[:2], 1e-300))
    if not found:
        # wider by what small samples leave open of the covariance
        wider = float(np.max(fitted.errors[:2] / errors))
        half[:] = float(stdtrit(fitted.degrees[:2].min(), 0.975)) * wider * errors[0]
    x = np.column_stack([np.ones(BAND_POINTS), across - trend.values[:, 0].mean()])
    spread = np.sqrt(np.einsum("na,ab,nb->n", x, fitted.covariance[:2, :2], x))
    return x @ fitted.beta[:2], half * spread / errors[0]


def table_cells(found: DriftFile) -> list[dict[str, str | float | bool | None]]:
    """Return a row for every parameter and covariate, as drift.csv has them."""
    made: list[dict[str, str | float | bool | None]] = []
    for row in found.parameters:
        own = {n: getattr(row, n) for n in CSV_COLUMNS if n in vars(row)}
        odd = "; ".join(o.specimen for o in row.stands_out)
        for s in row.slopes or [None]:  # type: ignore[list-item]
            change = (
                {} if s is None else {"covariate": s.covariate, "per": s.per, "change": s.value, "change_low": s.low}
            )
            more = {} if s is None else {"change_high": s.high, "probability": s.probability, "drifts": s.drifts}
            made.append({**own, **change, **more, "units_that_stand_out": odd})
    return made


CSV_COLUMNS = (
    *("parameter", "condition", "unit", "logarithmic", "units", "tests", "mean", "mean_low", "mean_high", "between"),
    *("between_low", "between_high", "repeatability", "reproducibility", "tolerance_low", "tolerance_high", "least"),
    *("greatest", "covariate", "per", "change", "change_low", "change_high", "probability", "drifts"),
    "units_that_stand_out",
)
