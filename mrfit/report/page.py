"""The report as one HTML file that opens offline: style and figures inside, no address outside."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrfit.core.setting import Defined, defined
from mrfit.io.schemas.fit import Fit, Quantity, Result
from mrfit.report.figures import Figure
from mrfit.report.numbers import in_html, percent, significant, unit_html, with_interval
from mrfit.report.provenance import flux_section, recording_row, segment_rows
from mrfit.report.source import Source
from mrfit.report.svg import inline
from mrfit.report.tables import METRIC_COLUMNS, ROLES, metric_cells
from mrfit.report.verdict import cautions, open_directions, verdict
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
        recordings=[recording_row(r) for r in source.ingest.get("recordings", [])],
        refused=source.ingest.get("refused", []),
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


def number(value: float | None, text: str | None = None) -> dict[str, Any]:
    """Return a number for a cell: every digit for machines, and what people see (three significant digits)."""
    shown = significant(value) if text is None else text
    return {"exact": None if value is None else repr(value), "shown": in_html(shown)}


def _fit(position: int, fit: Fit, figures: Sequence[Figure]) -> dict[str, Any]:
    anchor = f"fit{position}"
    return {
        "anchor": anchor,
        "fit": fit,
        "unit": unit_html(fit.unit),
        "facts": _facts(fit),
        "verdict": verdict(fit),
        "cautions": cautions(fit),
        "directions": open_directions(fit),
        "errors": [_errors(fit, k) for k in range(len(fit.metrics))],
        "headings": _headings(fit),
        "parameters": [(r.condition, [_quantity(q) for q in r.parameters]) for r in fit.results],
        "derived": [(r.condition, [_quantity(q) for q in r.derived]) for r in fit.results if r.derived],
        "searches": [_search(r, unit_html(fit.unit)) for r in fit.results],
        "figures": [
            {"figure": f, "svg": inline(f.svg, f"{anchor}f{k}", f.alt)} for k, f in enumerate(figures, start=1)
        ],
    }


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


def _overview(fit: Fit) -> dict[str, Any]:
    roles = {role: fit.pooled(role) for role in ROLES}
    return {
        "fit": fit,
        "sets": len(fit.results),
        "free": max(sum(not q.fixed for q in r.parameters) for r in fit.results),
        **{role: percent(row.nrmse) if row else "–" for role, row in roles.items()},
    }


def _headings(fit: Fit) -> list[tuple[str, str]]:
    unit = unit_html(fit.unit)
    squared = f"({unit})²" if set(unit) & set("·/") else f"{unit}²"
    units = {"y": unit, "y^2": squared if unit else "", "%": "%"}
    measures = [(m.label, units.get(m.unit, "")) for m in METRICS]
    return [("condition", ""), ("role", ""), ("samples", ""), *measures, ("noise floor", unit)]


def _errors(fit: Fit, index: int) -> dict[str, Any]:
    row = fit.metrics[index]
    values = [getattr(row, name) for name in METRIC_COLUMNS[3:]]
    return {
        "condition": row.condition,
        "role": ROLES.get(row.role, row.role),
        "pooled": row.condition == "all",
        "samples": metric_cells(row)[2],
        "values": [number(v) for v in values],
    }


def _quantity(q: Quantity) -> dict[str, Any]:
    value, low, high = with_interval(q.value, q.low, q.high)
    notes = [] if q.identifiable else ["not identifiable"]
    if q.at_bound:
        notes.append(f"at its bound {in_html(significant(q.bound))}" if q.bound is not None else "at a bound")
    if q.fixed:
        notes.append("held fixed")
    known = q.identifiable and not q.fixed
    return {
        "quantity": q,
        "unit": unit_html(q.unit),
        "value": number(q.value, value),
        "low": number(q.low, low) if known and low else None,
        "high": number(q.high, high) if known and high else None,
        "notes": notes,
    }


def _search(result: Result, unit: str) -> dict[str, Any]:
    starts = [s for s in result.starts or [] if s is not None]
    spread = f"{in_html(significant(min(starts)))} to {in_html(significant(max(starts)))} {unit}" if starts else "–"
    active = [p for p in result.passivity if not p.passive]
    passive = (
        "–" if not result.passivity else "yes" if not active else f"no, in {len(active)} of {len(result.passivity)}"
    )
    return {"result": result, "cost": number(result.cost), "starts": spread, "passive": passive}
