"""JSON: the whole fit, which ``mrfit.load`` reads, and beside it the model in plain numbers for other programs."""

import json
from typing import Any

import numpy as np

from mrfit.core.channels import unit_of
from mrfit.export.c import Difference, compared
from mrfit.export.c_parts import base_fields, prefix_of
from mrfit.export.head import head_lines
from mrfit.export.source import Source
from mrfit.export.stage import Files, Options
from mrfit.io.workspace import plain
from mrfit.simulate.current_dependence import Order
from mrfit.simulate.current_levels import assembly_of

# Samples of a segment from rest, with what the simulation makes of them, by which another program can be checked
CHECKED = 200


def files(source: Source, options: Options) -> Files:
    """Return one file."""
    difference = rebuilt(source, _text(source, ""))
    name = f"{prefix_of(source.name)}.json"
    text = _text(source, difference.text)
    return Files({name: text.encode()}, (difference.text,), difference.largest)


def _text(source: Source, told: str) -> str:
    content = dict(source.content)
    # how recordings were prepared is not known of a workspace's fit
    content.setdefault("preparation", None)
    content["export"] = {"head": head_lines(source, [told]), **plain_model(source)}
    return json.dumps(plain(content), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def plain_model(source: Source) -> dict[str, Any]:
    """Return the model in plain numbers: what each parameter is at a current, effects, units, ranges, samples."""
    return {
        "model": source.assembly.name,
        "base": source.base.name,
        "condition": source.condition,
        "sha256": source.digest,
        "inputs": [_channel(source, n) for n in source.channels],
        "output": _channel(source, source.spec.output),
        "current_range": [source.dependence.low, source.dependence.high] if source.dependence else None,
        "parameters": _parameters(source),
        "effects": [
            {
                "name": link.spec.name,
                "slot": link.spec.slot,
                "equation": link.spec.equation,
                "parameters": {p.name: float(v) for p, v in zip(link.spec.params, link.theta, strict=True)},
            }
            for link in source.links
        ],
        "check": _check(source),
    }


def _channel(source: Source, name: str) -> dict[str, Any]:
    return {"name": name, "unit": unit_of(name), "range": list(source.ranges.get(name, ())) or None}


def _parameters(source: Source) -> list[dict[str, Any]]:
    """Return the base's parameters; those that depend on current by the pieces of a polynomial through their nodes.

    ``ln`` says that it is the logarithm of the parameter that the polynomial gives.
    """
    dependence = source.dependence
    orders: dict[str, Order] = dict(dependence.orders) if dependence else {}
    found = []
    for p, row in zip(source.base.params, base_fields(source, []), strict=True):
        entry: dict[str, Any] = {"name": p.name, "unit": p.unit, "text": p.text}
        order = orders.get(p.name, 0)
        if not order or dependence is None:
            entry["value"] = row["values"][0]
        else:
            values = np.array(row["values"])
            entry["ln"] = row["log"]
            entry["pieces"] = [
                {"to": piece.high, "currents": piece.nodes.tolist(), "values": values[piece.columns].tolist()}
                for piece in dependence.pieces(order)
            ]
            entry["bounds"] = [p.low, p.high] if row["clip"] else None
        found.append(entry)
    return found


def _check(source: Source) -> dict[str, Any] | None:
    if not source.stretches:
        return None
    stretch = source.stretches[0]
    drive = source.drive(stretch)[:, :CHECKED]
    rows = {n: drive[source.spec.inputs.index(n)].tolist() for n in source.channels}
    return {"dt": stretch.dt, "inputs": rows, "output": source.simulate(drive, stretch.dt).tolist()}


def rebuilt(source: Source, text: str) -> Difference:
    """Return how far the model that is built again from a file's text is from the fit's."""
    if not source.stretches:
        return Difference(why_not="the fit's logs are not at hand")
    content = json.loads(text)
    assembly = assembly_of(content)
    result = next(r for r in content["results"] if r["condition"] == source.condition)
    values = {p["name"]: p["value"] for p in result["parameters"]}
    neutral = {
        f"{s.name}.{p.name}": value for s in _left_out(source) for p, value in zip(s.params, s.neutral, strict=True)
    }
    theta = np.array([neutral.get(n, values[n]) for n in assembly.spec.names])
    names = source.spec.inputs

    def run(drive: Any, dt: float) -> Any:
        # inputs of an effect that was left out do not matter
        rows = {n: drive[k] for k, n in enumerate(names)}
        whole = np.stack([rows.get(n, np.zeros(drive.shape[1])) for n in assembly.spec.inputs])
        return assembly.simulate(whole, theta[None], dt)[0]

    return compared(source, run)


def _left_out(source: Source) -> list[Any]:
    from mrfit.core import registry

    return [registry.load("effect", name).SPEC for name in source.without]
