"""Comparisons as one HTML file each that opens offline: tables and figures inside, no address outside."""

from collections import Counter
from collections.abc import Sequence

from mrfit.compare.figures import convergence, error_map
from mrfit.io.schemas.compare import LeftOut, ModelCaution, ModelRow, ModelsFile, OptimizersFile
from mrfit.report.numbers import in_html, percent, significant
from mrfit.report.ranking import has_diverged
from mrfit.report.sections import Section, SectionFigure, Table, hover_script, render
from mrfit.report.svg import inline


def labels(rows: Sequence[ModelRow]) -> dict[str, str]:
    """Return short names of fits beside each other: the model's, or the fit's own where several have the model."""
    count = Counter((row.output, row.model) for row in rows)
    return {row.fit: row.model if count[row.output, row.model] == 1 else row.fit for row in rows}


def together(rows: Sequence[ModelCaution | LeftOut], what: str) -> list[tuple[str, str]]:
    """Return (models by commas, text) once for every text, the attribute ``what``, that rows of models share."""
    texts = dict.fromkeys(str(getattr(row, what)) for row in rows)
    named = {text: dict.fromkeys(row.model for row in rows if getattr(row, what) == text) for text in texts}
    return [(", ".join(names), text) for text, names in named.items()]


def models_page(summary: ModelsFile) -> str:
    """Return the page of a comparison of models from the content of compare.json: a table and a map for each output."""
    errors = ("Hold-out NRMSE", "Hold-out fit", "Training NRMSE", "Training fit")
    heads, called = ("Model", "Fit", "Parameters", *errors, "Warnings"), labels(summary.models)
    sections: list[Section] = []
    for number, output in enumerate(dict.fromkeys(m.output for m in summary.models)):
        models = [m for m in summary.models if m.output == output]
        table = Table("All conditions together", heads, [_model_row(m) for m in models])
        fits = [m.fit for m in models]
        svg = error_map(fits, [m for m in summary.metrics if m.fit in fits], called)
        alt = f"NRMSE in percent of every model of {output} on every condition"
        caption = (
            f"NRMSE of {output} in percent of the measured range: one row a model, the best on top, one column a "
            "condition, held-out ones first; the darker, the larger. Empty: the model could not be tried there."
        )
        drawn = SectionFigure("", caption, inline(svg, f"m{number}", alt))
        sections.append(Section(f"Models of {output}", tables=[table], figures=[drawn]))
    told = together(summary.warnings, "text")
    for caption, shared in (("Logs left out", told), ("Models left out", together(summary.left_out, "reason"))):
        if shared:
            sections.append(Section(caption, tables=[Table("", ("Models", "Reason"), shared)]))
    settings = summary.settings
    per = "one set of parameters for all conditions" if settings["per"] == "all" else "parameters per condition"
    words = (
        f"Last fitted by {settings['optimizer']}, seed {settings['seed']}, {per}; names of fits hold what was set "
        "otherwise. NRMSE is the RMS error over the range, "
        "fit is 100·(1 − ‖y − ŷ‖/‖y − ȳ‖). Best on held-out data first, those that could be judged on fewer samples "
        "after the others."
    )
    return render("Models compared", words, (), sections, "compare.json, compare.csv", script=hover_script())


def _model_row(m: ModelRow) -> tuple[object, ...]:
    errors = [f(getattr(m, f"{role}_{n}")) for role in ("holdout", "train") for n, f in _SHOWN]
    warnings = [
        *["diverged"] * has_diverged(m.train_nrmse if m.holdout_nrmse is None else m.holdout_nrmse),
        *(w.replace("-", " ") for w in m.warnings),
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
    costs = Section("Cost over the seeds", tables=[Table("", heads, cells)], figures=[SectionFigure("", caption, svg)])
    return render("Optimizers compared", words, (), [costs], "optimizers.json, optimizers.csv", script=hover_script())


def _number(value: float | None) -> str:
    return in_html(significant(value, 5))
