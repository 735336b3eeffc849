"""The report as one HTML file that opens offline: style and figures inside, no address outside."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from mrfit.core import registry
from mrfit.core.recording import RECORD_CONSTANTS
from mrfit.core.setting import SettingField, defined
from mrfit.io.outdated import remedy
from mrfit.io.schemas.determined import POOR
from mrfit.io.schemas.fit import Fit, MetricRow, Quantity, Result
from mrfit.report.determined import sentences, words_of
from mrfit.report.doubts import Doubt, doubts
from mrfit.report.figures import Figure
from mrfit.report.key import REPORT_TEMPLATE
from mrfit.report.loop_data import loop_json
from mrfit.report.numbers import MISSING_NUMBER, in_html, percent, significant, unit_html, with_interval
from mrfit.report.output_unit import OutputUnit, output_unit
from mrfit.report.prediction import PredictionRow
from mrfit.report.provenance import flux_section, recording_row, segment_rows
from mrfit.report.ranking import RankedFit, above_best, comparable, ranked
from mrfit.report.sections import SectionFigure, exact, figures_in_page, template_of
from mrfit.report.source import ReportSource
from mrfit.report.tables import METRIC_COLUMNS, ROLE_WORDS
from mrfit.report.verdict import GroupedWarning, cautions, open_directions, verdict
from mrfit.settings.fit import Settings as FitSettings
from mrfit.signal.metrics import METRICS

LONG_TABLE = 40
"""Rows from which a table is folded until it is asked for."""
WIDE_TABLE = 9
"""Columns of parameters from which a table of them is set out as several."""


def render(
    source: ReportSource,
    figures: dict[str, list[Figure]],
    predictions: Sequence[PredictionRow] = (),
    in_full: Collection[str] | None = None,
) -> str:
    """Return the page.

    Parameters
    ----------
    source
        What to report.
    figures
        Figures of each fit by its name.
    predictions
        Saved predictions by these fits.
    in_full
        Names of the fits of which every figure was drawn; default: all.
    """
    fits = [_fit(k, fit, figures[fit.name], source) for k, fit in enumerate(source.fits, start=1)]
    anchors = {f.fit.name: f.anchor for f in fits}
    return template_of(REPORT_TEMPLATE).render(
        fits=fits,
        outdated=source.outdated,
        remedy=remedy,
        brief=[fit.name for fit in source.fits if in_full is not None and fit.name not in in_full],
        rankings=rankings(source.fits, anchors),
        predictions=predictions,
        loops=loop_json(source),
        long=LONG_TABLE,
        poor=round(100.0 * POOR),
        definitions=METRICS,
        recordings=[recording_row(r) for r in source.ingest.recordings] if source.ingest else [],
        refused=source.ingest.refused if source.ingest else [],
        segments=segment_rows(source.segments),
        flux=flux_section(source.flux),
        version=next((f.versions["mrfit"] for f in source.fits if "mrfit" in f.versions), ""),
    )


@dataclass(frozen=True)
class ErrorRow:
    """Errors of a condition in a role, or ``pooled`` over all of them."""

    condition: str
    role: str
    pooled: bool
    samples: object
    values: Sequence[Markup]


@dataclass(frozen=True)
class QuantityRow:
    """A parameter or derived quantity with its interval, and what is to be noted of it."""

    quantity: Quantity
    unit: str
    value: Markup
    low: Markup | None
    high: Markup | None
    notes: Sequence[str]


@dataclass(frozen=True)
class SearchRow:
    """Search of a set of parameters: cost, costs of starts and passivity in words, in the unit of the page."""

    result: Result
    cost: Markup
    starts: str
    passive: str


@dataclass(frozen=True)
class FitSection:
    """All that the page says of one fit."""

    anchor: str
    fit: Fit
    unit: str
    facts: Sequence[tuple[str, str]]
    equations: Sequence[str]
    verdict: Sequence[str]
    doubts: Sequence[Doubt]
    cautions: Sequence[GroupedWarning]
    directions: Sequence[tuple[str, str]]
    errors: Sequence[ErrorRow]
    headings: Sequence[tuple[str, str]]
    parameters: Sequence["Sets"]
    derived: Sequence["Sets"]
    searches: Sequence[SearchRow]
    figures: Sequence[SectionFigure]


@dataclass(frozen=True)
class Sets:
    """Some columns of the table of quantities: for each set of parameters its condition and the quantities."""

    rows: Sequence[tuple[str, Sequence[QuantityRow]]]
    part: str


@dataclass(frozen=True)
class RankingPlace:
    """A fit in the ranking: errors over all conditions, criteria above the least, parameters the data determine."""

    ranked: RankedFit
    anchor: str
    best: bool
    determined: str
    train: Markup
    holdout: Markup
    floor: Markup
    aic: Markup
    bic: Markup


@dataclass(frozen=True)
class RankingGroup:
    """Fits that were judged on the same data, the best first, and in words what that was."""

    words: str
    places: Sequence[RankingPlace]


def number(value: float | None, text: str | None = None) -> Markup:
    """Return a number for a cell: every digit for machines, and what people see (three significant digits)."""
    shown = significant(value) if text is None else text
    return exact(value, shown)


def share(value: float | None) -> Markup:
    """Return a share for a cell in percent; for machines it stays a fraction."""
    return exact(value, MISSING_NUMBER if value is None else percent(value))


def _fit(position: int, fit: Fit, figures: Sequence[Figure], source: ReportSource) -> FitSection:
    anchor, scale = f"fit{position}", output_unit(fit)
    return FitSection(
        anchor=anchor,
        fit=fit,
        unit=scale.unit,
        facts=_facts(fit),
        equations=_equations(fit),
        verdict=[*verdict(fit), *sentences(fit)],
        doubts=doubts(fit, source),
        cautions=cautions(fit),
        directions=open_directions(fit),
        errors=[_errors(row, scale) for row in fit.metrics],
        headings=_headings(scale),
        parameters=_sets([(r.condition, r.parameters) for r in fit.results]),
        derived=_sets([(r.condition, r.derived) for r in fit.results if r.derived]),
        searches=[_search(r, scale) for r in fit.results],
        figures=figures_in_page(figures, f"{anchor}f"),
    )


def _sets(sets: Sequence[tuple[str, Sequence[Quantity]]]) -> list[Sets]:
    """Return tables of quantities, several of about equal width where there are many columns."""
    columns = max((len(quantities) for _, quantities in sets), default=0)
    if not columns:
        return []
    parts = 1 if len(sets) == 1 else -(-columns // WIDE_TABLE)
    edges = [round(k * columns / parts) for k in range(parts + 1)]
    return [
        Sets(
            [(condition, [quantity_row(q) for q in quantities[a:b]]) for condition, quantities in sets],
            f", {number} of {parts}" if parts > 1 else "",
        )
        for number, (a, b) in enumerate(zip(edges, edges[1:], strict=False), start=1)
    ]


def _equations(fit: Fit) -> list[str]:
    """Return the equations of a fit's model and of its effects, and the parameters that the current moves."""
    found = [*([fit.equation] if fit.equation else []), *registry.equations_of_effects(fit.model)]
    moved = fit.current_dependence.orders if fit.current_dependence else {}
    names = [name for name, order in moved.items() if order]
    return [*found, f"parameters over the current i: {', '.join(names)}"] if names else found


def _facts(fit: Fit) -> list[tuple[str, str]]:
    """Return the facts of a fit, as labels and words."""
    sets = "one set of parameters for all conditions" if fit.per == "all" else "one set of parameters per condition"
    facts = [
        ("Model", fit.model),
        ("Predicts", f"{fit.output} from {', '.join(n for n in fit.inputs if n not in RECORD_CONSTANTS)}"),
        ("Source", fit.reference),
        ("Optimizer", f"{fit.optimizer}, {sum(r.evaluations for r in fit.results)} evaluations in all"),
        ("Parameters", sets),
        ("Seed", "" if fit.seed is None else str(fit.seed)),
        ("Settings", changes(fit.settings)),
        ("Data", f"SHA-256 {fit.data_sha256[:16]}…" if fit.data_sha256 else ""),
        ("Versions", ", ".join(f"{k} {v}" for k, v in fit.versions.items())),
    ]
    return [(label, text) for label, text in facts if text]


def changes(settings: Mapping[str, Any], fields: Sequence[SettingField] = defined(FitSettings)) -> str:
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


def rankings(fits: Sequence[Fit], anchors: Mapping[str, str]) -> list[RankingGroup]:
    """Return a ranking for each group of fits whose errors can be compared; the best of several is marked."""
    order = ranked(fits)
    groups = comparable(order)
    several = len({fit.output for fit in fits}) > 1
    return [
        RankingGroup(
            (f"{group[0].fit.output.capitalize()}: " if several else "") + _judged(group[0], len(groups) > 1),
            [
                _place(order, row, anchors.get(row.fit.name, ""), best=number == 0 < len(group) - 1)
                for number, row in enumerate(group)
            ],
        )
        for group in groups
    ]


JUDGED = {
    "conditions": "Judged on whole conditions that were not fitted",
    "conditions and cycles": "Judged on whole conditions that were not fitted, and on other cycles of fitted ones",
    "other cycles": "Judged on other cycles of the conditions that were fitted",
    "nothing": "Nothing was held out: in the order of the training error",
}
"""The kind of data that fits were judged on, in words."""


def _judged(row: RankedFit, several: bool) -> str:
    return JUDGED[row.held_out] + (f" ({row.judged_samples} samples)" if several else "")


def _place(order: Sequence[RankedFit], row: RankedFit, anchor: str, *, best: bool) -> RankingPlace:
    aic, bic = (above_best(order, row, name) for name in ("aic", "bic"))
    return RankingPlace(
        ranked=row,
        anchor=anchor,
        best=best and not row.diverged,
        determined=row.count.words,
        train=share(row.train),
        holdout=share(row.holdout),
        floor=share(row.floor),
        aic=number(aic, "0" if aic == 0.0 else significant(aic)),
        bic=number(bic, "0" if bic == 0.0 else significant(bic)),
    )


def _headings(scale: OutputUnit) -> list[tuple[str, str]]:
    units = {"y": scale.unit, "y^2": scale.squared}
    measures = [(m.label, units.get(m.unit, "%")) for m in METRICS]
    return [("condition", ""), ("role", ""), ("samples", ""), *measures, ("noise floor", scale.unit)]


def _errors(row: MetricRow, scale: OutputUnit) -> ErrorRow:
    factors = {"y": scale.factor, "y^2": scale.factor**2, "1": 100.0}
    of_column = {m.name: factors.get(m.unit, 1.0) for m in METRICS}
    values = []
    for name in METRIC_COLUMNS[3:]:
        value, factor = getattr(row, name), of_column.get(name, scale.factor)
        values.append(number(value, significant(None if value is None else factor * value)))
    role = ROLE_WORDS.get(row.role, row.role)
    return ErrorRow(row.condition, role, pooled=row.condition == "all", samples=row.samples, values=values)


def quantity_row(q: Quantity) -> QuantityRow:
    """Return a parameter or derived quantity as the page shows it."""
    value, low, high = with_interval(q.value, q.low, q.high)
    notes = list(filter(None, [words_of(q)]))
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


def _search(result: Result, scale: OutputUnit) -> SearchRow:
    starts = [s for s in result.starts or [] if s is not None]
    least, most = (in_html(significant(scale.factor * f(starts))) if starts else "" for f in (min, max))
    active = [p for p in result.passivity if not p.passive]
    passive = (
        "–" if not result.passivity else "yes" if not active else f"no, in {len(active)} of {len(result.passivity)}"
    )
    cost = number(result.cost, significant(None if result.cost is None else scale.factor * result.cost))
    return SearchRow(result, cost, starts=f"{least} to {most} {scale.unit}" if starts else "–", passive=passive)
