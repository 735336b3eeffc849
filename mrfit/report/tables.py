"""Parameter and error tables: CSV with every digit, LaTeX with the digits that mean something."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence

from mrfit.io.csv_table import csv_table
from mrfit.io.schemas.determined import State
from mrfit.io.schemas.fit import PARAMETER_COLUMNS, Fit, Quantity, Result
from mrfit.report.latex import EMPTY, HEAD, Cell, Table, number, tables_tex, with_uncertainty, words
from mrfit.report.numbers import escape_latex, in_html, unit_html, unit_latex
from mrfit.report.output_unit import output_unit
from mrfit.report.ranking import RankedFit, above_best, ranked
from mrfit.report.symbols import derived_symbol, symbols_of
from mrfit.signal.metrics import METRICS
from mrfit.simulate.current_dependence import CurrentNode, base_name, node_of
from mrfit.simulate.current_levels import exact_parameters

METRIC_COLUMNS = ("condition", "role", "samples", *(m.name for m in METRICS), "noise_floor")
ROLE_WORDS = {"train": "training", "holdout": "hold-out"}
COMPARISON_COLUMNS: Mapping[str, Callable[[RankedFit], object]] = {
    "fit": lambda r: r.fit.name,
    "model": lambda r: r.fit.model,
    "output": lambda r: r.fit.output,
    "held_out": lambda r: r.held_out,
    "holdout_nrmse": lambda r: r.holdout,
    "train_nrmse": lambda r: r.train,
    "noise_floor": lambda r: r.floor,
    "train_samples": lambda r: r.samples,
    "parameters": lambda r: r.count.free,
    "well": lambda r: r.count.well,
    "poorly": lambda r: r.count.poorly,
    "not_determined": lambda r: r.count.undetermined,
    "aic": lambda r: r.aic,
    "bic": lambda r: r.bic,
}


def parameters_csv(fits: Sequence[Fit]) -> str:
    """Return all parameters and derived quantities, one row per fit, condition and name; ``fit`` if there are several.

    Numbers carry every digit, in SI; ``low`` and ``high`` bound the 95 % interval and are empty where the data leave
    it open.
    """
    found = ((fit.name, *row) for fit in fits for row in exact_parameters(fit))
    rows = ({"fit": name, "condition": condition, "parameter": p.name, **vars(p)} for name, condition, p in found)
    return _of_fits(fits, PARAMETER_COLUMNS, rows)


def metrics_csv(fits: Sequence[Fit]) -> str:
    """Return all errors, one row per fit, condition and role and one ``all`` row per role; units as in ``METRICS``."""
    return _of_fits(fits, METRIC_COLUMNS, ({"fit": fit.name, **vars(m)} for fit in fits for m in fit.metrics))


def _of_fits(fits: Sequence[Fit], columns: Sequence[str], rows: Iterable[Mapping[str, object]]) -> str:
    return csv_table(("fit", *columns) if len(fits) > 1 else columns, rows)


def fit_tex(fit: Fit) -> str:
    """Return all tables of a fit for LaTeX: parameters, derived quantities and errors, values with their intervals."""
    return "\n".join([HEAD, *_quantity_tables(fit), tables_tex(_errors(fit))])


def _quantity_tables(fit: Fit) -> list[str]:
    symbols, made = symbols_of(fit), []
    for kind, title in (("parameters", "Parameters"), ("derived", "Derived quantities")):
        sets = [(r, r.derived if kind == "derived" else r.parameters) for r in fit.results]
        sets = [(r, quantities) for r, quantities in sets if quantities]
        if not sets:
            continue
        about = f"{title} of {fit.model} ({fit.optimizer})", f"tab:{fit.name}:{kind}"
        named = {q.name: _symbol(q, kind, symbols) for q in sets[0][1]}
        if len(sets) == 1:
            made.append(tables_tex(_joint(sets[0][1], named, about)))
        elif levels := _levels([r for r, _ in sets]):
            made.append(tables_tex(_over_current(levels, [quantities for _, quantities in sets], named, about)))
        else:
            made.append(tables_tex(_by_condition(sets, named, about)))
    return made


def _symbol(q: Quantity, kind: str, symbols: Mapping[str, str]) -> Cell:
    latex = derived_symbol(q.name, dict(symbols)) if kind == "derived" else symbols[q.name]
    return Cell(latex, base_name(q.name))


def _joint(quantities: Sequence[Quantity], named: Mapping[str, Cell], about: tuple[str, str]) -> Table:
    """Return one set of parameters, one a row; values at several currents stand side by side."""
    nodes = sorted({node for q in quantities if (node := node_of(q.name)) is not None})
    found: dict[str, dict[CurrentNode | None, Quantity]] = {}
    for q in quantities:
        found.setdefault(base_name(q.name), {})[node_of(q.name)] = q
    constant = any(None in row for row in found.values())
    columns: list[CurrentNode | None] = [*([None] if constant else []), *nodes]
    heads = [words("constant" if nodes else "value") if n is None else _level(n.current, n.side) for n in columns]
    rows = []
    for row in found.values():
        first = next(iter(row.values()))
        cells = [_value(row[c]) if c in row else EMPTY for c in columns]
        rows.append([named[first.name], _meaning(first), _unit(first.unit), *cells])
    header = [[words("Symbol"), words("Meaning"), words("Unit"), *heads]]
    return Table(*about, header, rows, "ltl" + "r" * len(columns), _note(quantities), fixed=3)


def _level(current: float, side: int = 0) -> Cell:
    """Return a current as a heading; below and above a jump with a sign."""
    text, sign = f"{current:.3g}", {-1: "-", 0: "", 1: "+"}[side]
    return Cell(rf"${text}{f'^{{{sign}}}' if sign else ''}$\,A", f"{in_html(text)}{sign} A")


def _meaning(q: Quantity) -> Cell:
    """Return the meaning of a parameter, without the current at which it is given."""
    if node_of(q.name) is not None:
        return words(q.text.rpartition(" at ")[0])
    if power := re.match(r"coefficient of i\^(\d)( of ln\(\w+\))?", q.text):
        of = escape_latex(power[2] or "")
        return Cell(f"coefficient of $i^{power[1]}${of}", f"coefficient of i1{of}")
    if power := re.match(r"coefficient of \(([\d.e+-]+) A\*tanh\(i/.*\)\)\^(\d)", q.text):
        # of a current that saturates
        knee = rf"{power[1]}\,\mathrm{{A}}"
        return Cell(rf"coefficient of $({knee}\tanh(i/{knee}))^{power[2]}$", "coefficient of (1.2 A tanh(i/1.2 A))1")
    return words(q.text)


def _levels(results: Sequence[Result]) -> list[float]:
    """Return the currents of results that differ in nothing else, none where they do."""
    others = {(r.at.frequency, r.at.amplitude) for r in results}
    currents = [r.at.current for r in results if r.at.current is not None]
    alike = len(others) == 1 and len(set(currents)) == len(results) == len(currents)
    return currents if alike else []


def _over_current(
    levels: Sequence[float], sets: Sequence[Sequence[Quantity]], named: Mapping[str, Cell], about: tuple[str, str]
) -> Table:
    """Return sets of parameters at several currents, one parameter a row, one current a column."""
    order = sorted(range(len(levels)), key=lambda k: levels[k])
    rows = [
        [named[q.name], _meaning(q), _unit(q.unit), *(_value(sets[k][n]) for k in order)] for n, q in enumerate(sets[0])
    ]
    header = [[words("Symbol"), words("Meaning"), words("Unit"), *(_level(levels[k]) for k in order)]]
    everything = [q for quantities in sets for q in quantities]
    return Table(*about, header, rows, "ltl" + "r" * len(order), _note(everything), fixed=3)


def _by_condition(
    sets: Sequence[tuple[Result, list[Quantity]]], named: Mapping[str, Cell], about: tuple[str, str]
) -> Table:
    """Return sets of parameters, one condition a row."""
    first = sets[0][1]
    header = [[words("Condition"), *(named[q.name] for q in first)], [EMPTY, *(_bracketed(q.unit) for q in first)]]
    rows = [[words(r.condition), *map(_value, quantities)] for r, quantities in sets]
    everything = [q for _, quantities in sets for q in quantities]
    return Table(*about, header, rows, "t" + "r" * len(first), _note(everything))


def _value(q: Quantity) -> Cell:
    cell = with_uncertainty(q.value, q.low, q.high)
    for mark, _, applies in MARKS:
        if applies(q):
            cell = cell.marked(f"$^{mark}$", "'")
    return cell


MARKS: Sequence[tuple[str, str, Callable[[Quantity], bool]]] = (
    (r"{\ast}", "ended at a bound", lambda q: q.at_bound),
    (r"{\dagger}", "not determined by the data", lambda q: q.determined is State.NOT),
    (r"{\ddagger}", "poorly determined", lambda q: q.determined is State.POORLY),
    (r"{\S}", "held fixed", lambda q: q.fixed),
)
"""Signs behind values, what they mean, and to which they apply."""


def _note(quantities: Sequence[Quantity]) -> str:
    """Return the legend of the digits and signs in a table."""
    said = [f"$^{mark}$ {text}" for mark, text, applies in MARKS if any(map(applies, quantities))]
    known = any(q.low is not None and q.high is not None and not q.fixed for q in quantities)
    digits = [r"$\pm$ is half of the 95\,\% interval"] if known else []
    return "; ".join([*digits, *said]) + "."


def _unit(unit: str) -> Cell:
    return Cell(unit_latex(unit) or "--", unit_html(unit) or "–")


def _bracketed(unit: str) -> Cell:
    text = unit_latex(unit)
    return Cell(f"({text})", f"({unit_html(unit)})") if text else EMPTY


def _errors(fit: Fit) -> Table:
    """Return the errors of a fit in the unit of its page, one condition and role a row; all measures are in the CSV."""
    scale = output_unit(fit)
    unit = f"({scale.unit})" if scale.unit else ""
    heads = [("Condition", ""), ("Role", ""), ("RMSE", unit), ("NRMSE", "(%)"), ("ESR", "(%)"), ("Fit", "(%)")]
    header = [[words(h) for h, _ in heads], [words(u) for _, u in heads]]
    header = [[*header[0], words("Noise")], [*header[1], words(unit)]]
    rows = []
    for row in fit.metrics:
        known = [
            _times(scale.factor, row.rmse),
            _times(100.0, row.nrmse),
            row.esr,
            row.fit_percent,
            _times(scale.factor, row.noise_floor),
        ]
        rows.append([words(row.condition), words(ROLE_WORDS.get(row.role, row.role)), *map(number, known)])
    said = ["NRMSE is over the range of the condition, in the rows all over that of all conditions."]
    said += [f"{c.text}." for c in fit.warnings]
    about = f"Errors of {fit.model} ({fit.optimizer})", f"tab:{fit.name}:metrics"
    return Table(*about, header, rows, "tl" + "r" * 5, escape_latex(" ".join(said)))


def _times(factor: float, value: float | None) -> float | None:
    return None if value is None else factor * value


def comparison_tex(fits: Sequence[Fit]) -> str:
    """Return the table of all fits for LaTeX, best on held-out data first, a table for each output."""
    order = ranked(fits)
    made = [HEAD]
    for output in dict.fromkeys(r.fit.output for r in order):
        own = [r for r in order if r.fit.output == output]
        heads = ("Fit", "Param.", "not det.", "Training", "Held out", "Noise", "$\\Delta$AIC", "$\\Delta$BIC")
        units = ("", "", "", "(%)", "(%)", "(%)", "", "")
        first = [Cell(h, h.replace("$\\Delta$", "D")) for h in heads]
        rows = []
        for r in own:
            shares = [number(_times(100.0, v)) for v in (r.train, r.holdout, r.floor)]
            criteria = [_criterion(above_best(order, r, name)) for name in ("aic", "bic")]
            counts = [words(str(n)) for n in (r.count.free, r.count.undetermined)]
            rows.append([words(r.fit.name), *counts, *shares, *criteria])
        about = f"Models of {output} compared", f"tab:comparison:{output}"
        note = (
            r"Errors are NRMSE, the RMS error over the range of the measured output in all conditions of the role. "
            r"Param.: fitted parameters, of which the data do not determine so many. $\Delta$: above the least of "
            r"fits to the same samples, residuals taken as independent."
        )
        made.append(tables_tex(Table(*about, [first, [words(u) for u in units]], rows, "t" + "r" * 7, note)))
    return "\n".join(made)


def _criterion(value: float | None) -> Cell:
    return words("--") if value is None else words(f"{value:.0f}" if value < 1e6 else f"{value:.3g}")


def comparison_csv(fits: Sequence[Fit]) -> str:
    """Return one row a fit, best on held-out data first: errors over all conditions, criteria, parameters determined.

    Errors are NRMSE as fractions; ``aic`` and ``bic`` hold up to a constant of the data.
    """
    rows = ({name: of(r) for name, of in COMPARISON_COLUMNS.items()} for r in ranked(fits))
    return csv_table(tuple(COMPARISON_COLUMNS), rows)
