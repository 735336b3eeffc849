"""Head of every export: model, equations, where it comes from, units, ranges, errors."""

from collections.abc import Sequence
from importlib.metadata import version

from mrfit.core.channels import unit_of
from mrfit.export.source import ExportSource
from mrfit.fit.extrapolation import ranges_text
from mrfit.io.schemas.fit import MetricRow

CAUSALITY = (
    "A fit is driven by smoothed inputs, free of noise and of delay; a controller is not. Give the velocity that you "
    "measure where you measure one; else derive it causally, which makes it late."
)


def head_lines(source: ExportSource, measured: Sequence[str] = ()) -> list[str]:
    """Return the head, a line each; ``measured`` says how far this export is from the simulation in Python."""
    content, spec = source.content, source.spec
    lines = [
        f"{source.assembly.name}: {source.base.title}",
        f"Exported by mrfit {version('mrfit')} from the fit {source.name}, parameters of '{source.condition}'.",
        f"SHA-256 of the fit {source.digest}; key {content.key or 'none'}; "
        f"SHA-256 of its logs {content.data_sha256 or 'not known'}.",
        "",
        f"Equations: {source.base.equation}  [{source.base.reference}]",
    ]
    lines += [f"  with {link.spec.name}: {link.spec.equation}  [{link.spec.reference}]" for link in source.links]
    found = [link.spec for link in source.links if link.spec.within]
    lines += [f"  {own.name} was found at {ranges_text(own.within)}" for own in found]
    if source.dependence:
        lines.append(
            "  parameters with values at several currents are polynomials through these, ln(...) exponentials of such; "
            f"the current is held within {source.dependence.low:.6g} to {source.dependence.high:.6g} A"
        )
    lines += [f"Left out of the fit's model: {name}" for name in source.without]
    if spec.free_offset:
        lines.append(f"The constant of a record's {spec.output} is not known, and not part of the model.")
    lines += ["", "Inputs and output, SI, with ranges in the fit's logs, held-out tests too; of rates, either sign:"]
    lines += [f"  {channel_text(source, name)}" for name in source.channels]
    whole = f", {' and '.join(source.without)} included," if source.without else ""
    lines += [f"  {channel_text(source, spec.output)}  (output)", "", f"Errors of the fit{whole} against the logs:"]
    own = [row for row in content.metrics if row.condition == source.condition]
    pooled = [row for row in content.metrics if row.condition == "all"]
    lines += [f"  {error_text(row, spec.output)}" for row in own or pooled]
    lines += ["", *measured]
    return lines


def channel_text(source: ExportSource, name: str) -> str:
    """Return a channel with its unit and its range in the logs."""
    unit = unit_of(name)
    if name not in source.ranges:
        return f"{name} in {unit}, range not known"
    low, high = source.ranges[name]
    return f"{name} in {unit}, {low:.6g} to {high:.6g}"


def error_text(row: MetricRow, output: str) -> str:
    """Return an error of the fit in words."""
    role = {"train": "training", "holdout": "held out", "predict": "prediction"}[row.role]
    rmse, nrmse = row.rmse, row.nrmse
    share = f", {100.0 * nrmse:.3g} % of the range" if nrmse is not None else ""
    return f"{role}: RMSE {rmse:.4g} {unit_of(output)}{share}" if rmse is not None else f"{role}: not known"
