"""Comparisons as one HTML file each that opens offline: tables and figures inside, no address outside."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from mrfit.compare.figures import convergence, error_map
from mrfit.io.schemas.compare import ModelRow, ModelsFile, OptimizersFile
from mrfit.report.key import TEMPLATE
from mrfit.report.numbers import in_html, percent, significant
from mrfit.report.page import template_of
from mrfit.report.ranking import has_diverged
from mrfit.report.svg import inline

# Rows of a table that stand on the page at once; the others are unfolded
FIRST = 400
PAGE = TEMPLATE.with_name("compare.html.jinja")


@dataclass(frozen=True)
class Table:
    """A table of the page; ``words`` where no cells are numbers, ``first`` rows shown before it is unfolded.

    The columns under the heads in ``texts`` hold words between columns of numbers.
    """

    caption: str
    heads: Sequence[str]
    rows: Sequence[Sequence[object]]
    words: bool = False
    first: int = FIRST
    texts: Sequence[str] = ()


@dataclass(frozen=True)
class Drawn:
    """A figure of the page; one that is ``wide`` does not shrink with a narrow window, which then scrolls it."""

    svg: str
    caption: str
    wide: bool = False


class Told(Protocol):
    """What is said of a model."""

    @property
    def model(self) -> str:
        """Its name."""


def labels(rows: Sequence[ModelRow]) -> dict[str, str]:
    """Return what fits are called beside each other: their model's name, or their own where several have the model."""
    count = Counter((row.output, row.model) for row in rows)
    return {row.fit: row.model if count[row.output, row.model] == 1 else row.fit for row in rows}


def whole_page(
    title: str, words: str, tables: Sequence[Table], figures: Sequence[Drawn], details: Sequence[Table] = ()
) -> str:
    """Return a page of tables, figures and tables of details under a title and a few words."""
    return template_of(PAGE).render(title=title, words=words, tables=tables, figures=figures, details=details)


def together(rows: Sequence[Told], what: str) -> list[tuple[str, str]]:
    """Return (models by commas, text) once for every text, the attribute ``what``, that rows of models share."""
    texts = dict.fromkeys(str(getattr(row, what)) for row in rows)
    named = {text: dict.fromkeys(row.model for row in rows if getattr(row, what) == text) for text in texts}
    return [(", ".join(names), text) for text, names in named.items()]


def models_page(summary: ModelsFile) -> str:
    """Return the page of a comparison of models from the content of compare.json: a table and a map for each output."""
    errors = ("Hold-out NRMSE", "Hold-out fit", "Training NRMSE", "Training fit")
    heads, called = ("Model", "Fit", "Parameters", *errors, "Warnings"), labels(summary.models)
    tables: list[Table] = []
    figures: list[Drawn] = []
    for number, output in enumerate(dict.fromkeys(m.output for m in summary.models)):
        models = [m for m in summary.models if m.output == output]
        rows = [_model_row(m) for m in models]
        tables.append(Table(f"Models of {output}, all conditions together", heads, rows, texts=("Fit", "Warnings")))
        fits = [m.fit for m in models]
        svg = error_map(fits, [m for m in summary.metrics if m.fit in fits], called)
        alt = f"NRMSE in percent of every model of {output} on every condition"
        caption = (
            f"NRMSE of {output} in percent of the measured range: one row a model, the best on top, one column a "
            "condition, held-out ones first; the darker, the larger. Empty: the model could not be tried there."
        )
        figures.append(Drawn(inline(svg, f"m{number}", alt), caption))
    told = together(summary.warnings, "text")
    for caption, shared in (("Logs left out", told), ("Models left out", together(summary.left_out, "reason"))):
        if shared:
            tables.append(Table(caption, ("Models", "Reason"), shared, words=True))
    settings = summary.settings
    per = "one set of parameters for all conditions" if settings["per"] == "all" else "parameters per condition"
    words = (
        f"Last fitted by {settings['optimizer']}, seed {settings['seed']}, {per}; names of fits hold what was set "
        "otherwise. NRMSE is the RMS error over the range, "
        "fit is 100·(1 − ‖y − ŷ‖/‖y − ȳ‖). Best on held-out data first, those that could be judged on fewer samples "
        "after the others."
    )
    return whole_page("Models compared", words, tables, figures)


def _model_row(m: ModelRow) -> tuple[object, ...]:
    errors = [f(getattr(m, f"{role}_{n}")) for role in ("holdout", "train") for n, f in _SHOWN]
    warnings = [
        *["diverged"] * has_diverged(m.train_nrmse if m.holdout_nrmse is None else m.holdout_nrmse),
        *m.warnings,
    ]
    return (m.model, m.fit, m.parameters, *errors, ", ".join(warnings) or "–")


def _share(value: float | None) -> str:
    return percent(None if value is None else value / 100.0)


_SHOWN = (("nrmse", percent), ("fit_percent", _share))


def optimizers_page(summary: OptimizersFile) -> str:
    """Return the page of a comparison of optimizers from the content of optimizers.json."""
    rows = summary.rows
    unit = rows[0].unit if rows else ""
    heads = ("Condition", "Optimizer", f"Best ({unit})", f"Median ({unit})", f"Worst ({unit})", "Evaluations")
    cells = [
        (r.condition, r.optimizer, *(_number(cost) for cost in (r.best, r.median, r.worst)), r.evaluations)
        for r in rows
    ]
    settings = summary.settings
    words = (
        f"Model {settings['model']}, {settings['seeds']} seeds: seed 0 starts at the model's own start values, the "
        "others at random points, the same for all; auto also where the data say. Costs are RMS errors; curves are "
        "medians over the seeds."
    )
    svg = inline(convergence(summary.curves, unit), "o", "Median best cost against evaluations")
    caption = f"Median over the seeds of the best RMS error in {unit} found so far, against evaluations."
    return whole_page("Optimizers compared", words, [Table("Cost over the seeds", heads, cells)], [Drawn(svg, caption)])


def _number(value: float | None) -> str:
    return in_html(significant(value, 5))
