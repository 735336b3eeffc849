"""A page for each kind of item in the registry, of its SPECs and the docstrings of its modules."""

import inspect
from typing import Any

from docs.reference.markdown import documented, fenced, plain, table
from mrfit.core import registry
from mrfit.core.built_in import Kind, own_names
from mrfit.core.recording import RECORD_CONSTANTS
from mrfit.search import strategies

OPENING = {
    "model": "A model maps its input channels to its output. `mrfit show NAME` prints the same. The figures show the "
    "response at the start values: to a sine of 15 mm at 1 Hz, of 0.2 rad, or of 3 A. The current is 1 A.",
    "effect": "An effect is written behind a base model, as in `boucwen-flux+eddy-current`. At its neutral values it "
    "vanishes exactly. The figures show a base model without it (grey) and with it (orange), at a strength that moves "
    "the output by 8 % of its range (RMS).",
    "optimizer": "Names are chained by a hyphen, as in `pso-fmin`. `--opt-set NAME=VALUE` sets an option.",
    "reader": "A reader is chosen by the content of a file, not by its name. `mrfit ingest --preview` says which.",
}


def page(kind: Kind) -> str:
    """Return the page of a kind."""
    items = {name: registry.load(kind, name) for name in own_names(kind)}
    parts = [f"# {kind.capitalize()}s", OPENING[kind], _contents(items)]
    if kind == "optimizer":
        parts += [_strategy(name, own.spec.title, own.module) for name, own in strategies.REGISTERED_STRATEGIES.items()]
    return "\n\n".join([*parts, *(_item(kind, name, module) for name, module in items.items())]) + "\n"


def _contents(items: dict[str, Any]) -> str:
    return table(("name", "title"), [[f"[{n}](#{n})", plain(m.SPEC.title)] for n, m in items.items()])


def _strategy(name: str, title: str, module: Any) -> str:
    return "\n\n".join([f"({name})=\n## {name}", plain(title) + ".", documented(inspect.getdoc(module) or "")])


def _item(kind: Kind, name: str, module: Any) -> str:
    spec = module.SPEC
    text = inspect.getdoc(module) or ""
    parts = [f"({name})=\n## {name}", f"**{plain(spec.title)}**"]
    if kind in ("model", "effect"):
        if "\n\n    " not in text:
            parts.append(fenced(spec.equation.replace(";  ", "\n")))
        parts += [documented(text), f"![{name}](figures/{name}.svg)", _signature(spec), _parameters(spec)]
    else:
        parts.append(documented(text))
    if kind == "model" and spec.derived:
        rows = [[f"`{d.name}`", plain(d.unit), plain(d.text)] for d in spec.derived]
        parts.append(table(("derived quantity", "unit", "meaning"), rows))
    if kind == "effect" and spec.aliases:
        parts.append(f"Similar in the data: {', '.join(f'`{a}`' for a in spec.aliases)}.")
    if kind == "effect" and spec.experiment:
        parts.append(f"Test that tells them apart: {plain(spec.experiment)}.")
    if kind == "optimizer" and spec.options:
        rows = [[f"`{o.name}`", f"{o.default:g}", f"{o.low:g} to {o.high:g}", plain(o.text)] for o in spec.options]
        parts.append(table(("option", "default", "range", "meaning"), rows))
    if kind != "reader" and "Source" not in text:
        parts.append(f"Source: {plain(spec.reference)}.")
    return "\n\n".join(parts)


def _signature(spec: Any) -> str:
    inputs = ", ".join(n for n in spec.inputs if n not in RECORD_CONSTANTS) or "no channel"
    if hasattr(spec, "output"):
        return f"Inputs: {plain(inputs)}. Output: {plain(spec.output)}."
    return f"Slot: {spec.slot}. Acts on: {plain(', '.join(spec.outputs))}. Needs: {plain(inputs)}."


def _parameters(spec: Any) -> str:
    neutral = getattr(spec, "neutral", None)
    columns = ["parameter", "unit", "bounds", "start", "meaning"]
    rows = [
        [f"`{p.name}`", plain(p.unit), f"{p.low:g} to {p.high:g}", f"{p.start:g}", plain(p.text)] for p in spec.params
    ]
    if neutral:
        columns.insert(4, "neutral")
        for row, value in zip(rows, neutral, strict=True):
            row.insert(4, f"{value:g}")
    return table(columns, rows)
