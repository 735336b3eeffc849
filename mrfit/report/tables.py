"""Parameter and error tables: CSV with every digit, LaTeX with the digits that mean something."""

from collections.abc import Iterable, Mapping, Sequence

from mrfit.io.csv_table import csv_table
from mrfit.io.schemas.fit import Fit, MetricRow, Quantity, Result
from mrfit.report.numbers import (
    escape_latex,
    in_latex,
    significant,
    symbol_latex,
    unit_latex,
    with_interval,
)
from mrfit.signal.metrics import METRICS

Cell = str | int | float | bool | None

PARAMETER_COLUMNS = ("condition", "parameter", "value", "unit", "low", "high", "at_bound", "identifiable")
METRIC_COLUMNS = ("condition", "role", "samples", *(m.name for m in METRICS), "noise_floor")
ROLES = {"train": "training", "holdout": "hold-out"}
WIDE = 8
NOTE = r"$^{\ast}$ ended at a bound; $^{\dagger}$ not determined by the data."


def parameters_csv(fits: Sequence[Fit]) -> str:
    """Return all parameters and derived quantities, one row per fit, condition and name; ``fit`` if there are several.

    Numbers carry every digit, in SI; ``low`` and ``high`` bound the 95 % interval and are empty where the data leave
    it open.
    """
    rows = (
        {"fit": fit.name, "condition": result.condition, "parameter": q.name, **vars(q)}
        for fit in fits
        for result in fit.results
        for q in [*result.parameters, *result.derived]
    )
    return _of_fits(fits, PARAMETER_COLUMNS, rows)


def metrics_csv(fits: Sequence[Fit]) -> str:
    """Return all errors, one row per fit, condition and role and one ``all`` row per role; units as in ``METRICS``."""
    return _of_fits(fits, METRIC_COLUMNS, ({"fit": fit.name, **vars(m)} for fit in fits for m in fit.metrics))


def metric_cells(row: MetricRow) -> list[Cell]:
    """Return a row of errors in the order of ``METRIC_COLUMNS``."""
    return [getattr(row, name) for name in METRIC_COLUMNS]


def _of_fits(fits: Sequence[Fit], columns: Sequence[str], rows: Iterable[Mapping[str, object]]) -> str:
    return csv_table(("fit", *columns) if len(fits) > 1 else columns, rows)


def parameters_tex(fits: Sequence[Fit]) -> str:
    """Return LaTeX tables (booktabs) of parameters and of derived quantities, in the layout that suits their number.

    One set of parameters is set out one parameter a row with its interval; several sets one condition a row. Values
    are rounded where half of their 95 % interval has two significant digits.
    """
    tables = []
    for fit in fits:
        for kind, label in (("parameters", "Parameters"), ("derived", "Derived quantities")):
            sets = [(r, _quantities(r, kind)) for r in fit.results]
            if any(quantities for _, quantities in sets):
                caption = f"{label} of {fit.model} ({fit.optimizer})"
                tables.append(_quantity_table(sets, caption, f"tab:{fit.name}:{kind}"))
    return "\n".join(tables)


def _quantities(result: Result, kind: str) -> list[Quantity]:
    return result.derived if kind == "derived" else result.parameters


def _quantity_table(sets: Sequence[tuple[Result, list[Quantity]]], caption: str, label: str) -> str:
    if len(sets) == 1:
        header = ["Symbol", "Meaning", "Value", r"95\,\% interval", "Unit"]
        rows = [_long_row(q) for q in sets[0][1]]
        return latex_table([header], rows, "llrll", (caption, label, NOTE))
    header = ["Condition", *(symbol_latex(q.name) for q in sets[0][1])]
    units = ["", *(_bracketed(unit_latex(q.unit)) for q in sets[0][1])]
    rows = [[escape_latex(r.condition), *(_marked(q) for q in quantities)] for r, quantities in sets]
    return latex_table([header, units], rows, "l" + "r" * (len(header) - 1), (caption, label, NOTE))


def _long_row(q: Quantity) -> list[str]:
    interval = "held fixed" if q.fixed else _interval(q)
    return [symbol_latex(q.name), escape_latex(q.text), _marked(q), interval, unit_latex(q.unit) or "--"]


def _interval(q: Quantity) -> str:
    low, high = (in_latex(end) if end else "" for end in with_interval(q.value, q.low, q.high)[1:])
    if low and high:
        return f"[{low}, {high}]"
    return f"from {low}" if low else f"up to {high}" if high else "not determined"


def _marked(q: Quantity) -> str:
    value = in_latex(with_interval(q.value, q.low, q.high)[0])
    return value + (r"$^{\ast}$" if q.at_bound else "") + ("" if q.identifiable else r"$^{\dagger}$")


def _bracketed(unit: str) -> str:
    return f"({unit})" if unit else ""


def metrics_tex(fits: Sequence[Fit]) -> str:
    """Return LaTeX tables (booktabs) of the errors, three significant digits, one table per fit."""
    tables = []
    for fit in fits:
        unit = unit_latex(fit.unit)
        squared = f"({unit})$^{{2}}$" if set(fit.unit) & set("*/") else f"{unit}$^{{2}}$"
        known = {"y": unit, "y^2": squared if unit else "", "%": r"\%"}
        header = ["Condition", "Role", "Samples", *(escape_latex(m.label) for m in METRICS), "noise floor"]
        units = ["", "", "", *(_bracketed(known.get(m.unit, "")) for m in METRICS), _bracketed(unit)]
        rows = []
        for row in fit.metrics:
            name, role, samples, *values = metric_cells(row)
            numbers = [in_latex(significant(v if isinstance(v, float) else None)) for v in values]
            rows.append(
                [escape_latex(str(name)), ROLES.get(str(role), escape_latex(str(role))), str(samples), *numbers]
            )
        note = escape_latex(" ".join(f"{c.text}." for c in fit.warnings))
        about = (f"Errors of {fit.model} ({fit.optimizer})", f"tab:{fit.name}:metrics", note)
        tables.append(latex_table([header, units], rows, "llr" + "r" * (len(header) - 3), about))
    return "\n".join(tables)


def latex_table(
    header: Sequence[Sequence[str]], rows: Sequence[Sequence[str]], align: str, about: tuple[str, str, str]
) -> str:
    r"""Return a table float for ``\usepackage{booktabs}``; cells are LaTeX already.

    Parameters
    ----------
    header
        One or two rows of headings.
    rows
        Cells; every row as long as those of the header.
    align
        Column letters, as many as there are columns; more than eight columns are set closer and smaller.
    about
        Plain caption, label, and a LaTeX note below (empty for none).
    """
    caption, label, note = about
    size = r"\small" if len(align) <= WIDE else r"\scriptsize\setlength{\tabcolsep}{3pt}"
    lines = [
        r"\begin{table}[htbp]",
        rf"\centering{size}",
        rf"\caption{{{escape_latex(caption)}}}",
        rf"\label{{{label}}}",
        rf"\begin{{tabular}}{{@{{}}{align}@{{}}}}",
        r"\toprule",
        *(" & ".join(row) + r" \\" for row in header if any(row)),
        r"\midrule",
        *(" & ".join(row) + r" \\" for row in rows),
        r"\bottomrule",
        r"\end{tabular}",
        *([rf"\par\smallskip\footnotesize {note}"] if note else []),
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"
