"""The report as one HTML file that opens offline: style and figures inside, no address outside."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrfit.core.setting import Defined, defined
from mrfit.io.schemas.fit import Fit, MetricRow, Quantity, Result
from mrfit.report.figures import Figure
from mrfit.report.numbers import in_html, percent, significant, unit_html, with_interval
from mrfit.report.provenance import flux_section, recording_row, segment_rows
from mrfit.report.source import Source
from mrfit.report.svg import inline
from mrfit.report.tables import METRIC_COLUMNS, ROLES
from mrfit.report.verdict import Warned, cautions, open_directions, verdict
from mrfit.settings.fit import Settings as FitSettings
from mrfit.signal.metrics import METRICS

if TYPE_CHECKING:
    from jinja2 import Template

TEMPLATE = Path(__file__).with_name("index.html.jinja")
STYLE = Path(__file__).with_name("style.css.jinja")


def render(source: Source, figures: dict[str, list[Figure]]) -> str:
    """Return the page.

    Parameters
    ----------
    source
        What to report.
    figures
        Figures of each fit by its name.
    """
    fits = [_fit(k, fit, figures[fit.name]) for k, fit in enumerate(source.fits, start=1)]
    return template_of(TEMPLATE).render(
        fits=fits,
        outdated=source.outdated,
        comparison=[_overview(fit) for fit in source.fits],
        definitions=METRICS,
        recordings=[recording_row(r) for r in source.ingest.recordings] if source.ingest else [],
        refused=source.ingest.refused if source.ingest else [],
        segments=segment_rows(source.segments),
        flux=flux_section(source.flux),
        version=next((f.versions["mrfit"] for f in source.fits if "mrfit" in f.versions), ""),
    )


def template_of(path: Path) -> "Template":
    """Return a page's template, which may include others of its folder; what is put into it is text, not markup."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(path.parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    return environment.get_template(path.name)


@dataclass(frozen=True)
class Cell:
    """A number: every digit for machines, None where there is none, and what people see."""

    exact: str | None
    shown: str


@dataclass(frozen=True)
class ErrorRow:
    """Errors of a condition in a role, or ``pooled`` over all of them."""

    condition: str
    role: str
    pooled: bool
    samples: object
    values: Sequence[Cell]


@dataclass(frozen=True)
class QuantityRow:
    """A parameter or derived quantity with its interval, and what is to be noted of it."""

    quantity: Quantity
    unit: str
    value: Cell
    low: Cell | None
    high: Cell | None
    notes: Sequence[str]


@dataclass(frozen=True)
class SearchRow:
    """How a set of parameters was found: cost, costs of starts and passivity in words."""

    result: Result
    cost: Cell
    starts: str
    passive: str


@dataclass(frozen=True)
class Drawn:
    """A figure in the page."""

    figure: Figure
    svg: str


@dataclass(frozen=True)
class Section:
    """All that the page says of one fit."""

    anchor: str
    fit: Fit
    unit: str
    facts: Sequence[tuple[str, str]]
    verdict: Sequence[str]
    cautions: Sequence[Warned]
    directions: Sequence[tuple[str, str]]
    errors: Sequence[ErrorRow]
    headings: Sequence[tuple[str, str]]
    parameters: Sequence[tuple[str, Sequence[QuantityRow]]]
    derived: Sequence[tuple[str, Sequence[QuantityRow]]]
    searches: Sequence[SearchRow]
    figures: Sequence[Drawn]


@dataclass(frozen=True)
class Overview:
    """A fit beside others: sets of parameters, free ones in each, errors in training and on held-out data."""

    fit: Fit
    sets: int
    free: int
    train: str
    holdout: str


def number(value: float | None, text: str | None = None) -> Cell:
    """Return a number for a cell: every digit for machines, and what people see (three significant digits)."""
    shown = significant(value) if text is None else text
    return Cell(None if value is None else repr(value), in_html(shown))


def _fit(position: int, fit: Fit, figures: Sequence[Figure]) -> Section:
    anchor = f"fit{position}"
    return Section(
        anchor=anchor,
        fit=fit,
        unit=unit_html(fit.unit),
        facts=_facts(fit),
        verdict=verdict(fit),
        cautions=cautions(fit),
        directions=open_directions(fit),
        errors=[_errors(row) for row in fit.metrics],
        headings=_headings(fit),
        parameters=[(r.condition, [_quantity(q) for q in r.parameters]) for r in fit.results],
        derived=[(r.condition, [_quantity(q) for q in r.derived]) for r in fit.results if r.derived],
        searches=[_search(r, unit_html(fit.unit)) for r in fit.results],
        figures=[Drawn(f, inline(f.svg, f"{anchor}f{k}", f.alt)) for k, f in enumerate(figures, start=1)],
    )


def _facts(fit: Fit) -> list[tuple[str, str]]:
    """Return what was run, as label and words."""
    sets = "one set of parameters for all conditions" if fit.per == "all" else "one set of parameters per condition"
    facts = [
        ("Model", fit.model),
        ("Predicts", f"{fit.output} from {', '.join(fit.inputs)}"),
        ("Source", fit.reference),
        ("Optimizer", f"{fit.optimizer}, {sum(r.evaluations for r in fit.results)} evaluations in all"),
        ("Parameters", sets),
        ("Seed", "" if fit.seed is None else str(fit.seed)),
        ("Settings", changes(fit.settings)),
        ("Data", f"SHA-256 {fit.data_sha256[:16]}…" if fit.data_sha256 else ""),
        ("Versions", ", ".join(f"{k} {v}" for k, v in fit.versions.items())),
    ]
    return [(label, text) for label, text in facts if text]


def changes(settings: Mapping[str, Any], fields: Sequence[Defined] = defined(FitSettings)) -> str:
    """Return what the user set otherwise than the model and the optimizer have it, in words."""
    told = [
        (f, f.setting.told, settings[f.name]) for f in fields if f.setting and f.setting.told and f.name in settings
    ]
    items = [text.format(*item) for f, text, value in told if isinstance(f.default, tuple) for item in value or ()]
    single = [
        text.format(f.name.replace("_", " "), value)
        for f, text, value in sorted(told, key=lambda one: one[0].name)
        if not isinstance(f.default, tuple) and value != f.default
    ]
    return "; ".join([*items, *single])


def _overview(fit: Fit) -> Overview:
    free = max(sum(not q.fixed for q in r.parameters) for r in fit.results)
    train, holdout = (percent(row.nrmse) if row else "–" for row in map(fit.pooled, ("train", "holdout")))
    return Overview(fit, len(fit.results), free, train, holdout)


def _headings(fit: Fit) -> list[tuple[str, str]]:
    unit = unit_html(fit.unit)
    squared = f"({unit})²" if set(unit) & set("·/") else f"{unit}²"
    units = {"y": unit, "y^2": squared if unit else "", "%": "%"}
    measures = [(m.label, units.get(m.unit, "")) for m in METRICS]
    return [("condition", ""), ("role", ""), ("samples", ""), *measures, ("noise floor", unit)]


def _errors(row: MetricRow) -> ErrorRow:
    values = [number(getattr(row, name)) for name in METRIC_COLUMNS[3:]]
    role = ROLES.get(row.role, row.role)
    return ErrorRow(row.condition, role, pooled=row.condition == "all", samples=row.samples, values=values)


def _quantity(q: Quantity) -> QuantityRow:
    value, low, high = with_interval(q.value, q.low, q.high)
    notes = [] if q.identifiable else ["not identifiable"]
    if q.at_bound:
        notes.append(f"at its bound {in_html(significant(q.bound))}" if q.bound is not None else "at a bound")
    if q.fixed:
        notes.append("held fixed")
    known = q.identifiable and not q.fixed
    return QuantityRow(
        quantity=q,
        unit=unit_html(q.unit),
        value=number(q.value, value),
        low=number(q.low, low) if known and low else None,
        high=number(q.high, high) if known and high else None,
        notes=notes,
    )


def _search(result: Result, unit: str) -> SearchRow:
    starts = [s for s in result.starts or [] if s is not None]
    spread = f"{in_html(significant(min(starts)))} to {in_html(significant(max(starts)))} {unit}" if starts else "–"
    active = [p for p in result.passivity if not p.passive]
    passive = (
        "–" if not result.passivity else "yes" if not active else f"no, in {len(active)} of {len(result.passivity)}"
    )
    return SearchRow(result, number(result.cost), starts=spread, passive=passive)
