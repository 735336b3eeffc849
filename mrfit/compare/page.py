"""Comparisons as one HTML file each that opens offline: tables and figures inside, no address outside."""

from typing import Any

from mrfit.compare.figures import convergence, error_map
from mrfit.report.numbers import in_html, percent, significant
from mrfit.report.svg import inline

STYLE = """body{font:15px/1.5 system-ui,sans-serif;color:#1e293b;max-width:72rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;font-size:.9rem}caption{text-align:left;font-weight:600;padding:.6rem 0}
th,td{padding:.2rem .7rem;border-bottom:1px solid #e2e8f0;text-align:left}td.n{text-align:right}
svg{max-width:100%;height:auto}.wide{overflow-x:auto}"""

PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">
<title>{{ title }}</title><style>{{ style|safe }}</style></head>
<body><h1>{{ title }}</h1><p>{{ words }}</p>
{% for table in tables %}<div class="wide"><table><caption>{{ table.caption }}</caption>
<thead><tr>{% for head in table.heads %}<th scope="col">{{ head }}</th>{% endfor %}</tr></thead><tbody>
{% for row in table.rows %}<tr>{% for cell in row %}<td{% if not loop.first %} class="n"{% endif %}>{{ cell }}</td>
{%- endfor %}</tr>
{% endfor %}</tbody></table></div>
{% endfor %}{% if figure %}<div class="wide">{{ figure|safe }}</div>{% endif %}
</body></html>
"""


def _page(title: str, words: str, tables: list[dict[str, Any]], figure: str) -> str:
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, trim_blocks=True, undefined=StrictUndefined)
    return environment.from_string(PAGE).render(title=title, words=words, tables=tables, figure=figure, style=STYLE)


def models_page(summary: dict[str, Any]) -> str:
    """Return the page of a comparison of models from the content of compare.json."""
    models = summary["models"]
    heads = ("Model", "Parameters", "Hold-out NRMSE", "Hold-out fit", "Training NRMSE", "Training fit", "Warnings")
    rows = [
        (
            m["model"],
            m["parameters"],
            percent(m["holdout_nrmse"]),
            _share(m["holdout_fit_percent"]),
            percent(m["train_nrmse"]),
            _share(m["train_fit_percent"]),
            ", ".join(m["warnings"]) or "–",
        )
        for m in models
    ]
    tables = [{"caption": "All conditions together", "heads": heads, "rows": rows}]
    if summary["left_out"]:
        left = [(one["model"], one["reason"]) for one in summary["left_out"]]
        tables.append({"caption": "Left out", "heads": ("Model", "Reason"), "rows": left})
    names = [m["model"] for m in models]
    alt = "NRMSE in percent of every model on every condition"
    figure = inline(error_map(names, summary["metrics"]), "m", alt)
    settings = summary["settings"]
    per = "one set of parameters for all conditions" if settings["per"] == "all" else "parameters per condition"
    words = (
        f"Fitted by {settings['optimizer']}, seed {settings['seed']}, {per}; NRMSE is the RMS error over the range, "
        "fit is 100·(1 − ‖y − ŷ‖/‖y − ȳ‖). Best on held-out data first."
    )
    return _page("Models compared", words, tables, figure)


def _share(value: float | None) -> str:
    return percent(None if value is None else value / 100.0)


def optimizers_page(summary: dict[str, Any]) -> str:
    """Return the page of a comparison of optimizers from the content of optimizers.json."""
    rows = summary["rows"]
    unit = rows[0]["unit"] if rows else ""
    heads = ("Condition", "Optimizer", f"Best ({unit})", f"Median ({unit})", f"Worst ({unit})", "Evaluations")
    cells = [
        (r["condition"], r["optimizer"], *(_number(r[n]) for n in ("best", "median", "worst")), r["evaluations"])
        for r in rows
    ]
    settings = summary["settings"]
    words = (
        f"Model {settings['model']}, {settings['seeds']} seeds: seed 0 starts at the model's own start values, the "
        "others at random points, the same for all. Costs are RMS errors; curves are medians over the seeds."
    )
    figure = inline(convergence(summary["curves"], unit), "o", "Median best cost against evaluations")
    table = {"caption": "Cost over the seeds", "heads": heads, "rows": cells}
    return _page("Optimizers compared", words, [table], figure)


def _number(value: float | None) -> str:
    return in_html(significant(value, 5))
