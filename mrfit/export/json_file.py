"""JSON: the whole fit, which ``mrfit.load`` reads, and beside it the model in plain numbers for other programs."""

import json
from collections.abc import Collection
from dataclasses import field, fields

import numpy as np

from mrfit.core.channels import unit_of
from mrfit.core.specs import Array, EffectSpec
from mrfit.export.c import Difference, compared
from mrfit.export.c_parts import base_fields, prefix_of
from mrfit.export.head import head_lines
from mrfit.export.source import EffectLink, ExportSource
from mrfit.export.stage import Files
from mrfit.io.schemas.fit import Fit, SavedFit
from mrfit.io.schemas.reading import Entry, of_json
from mrfit.io.workspace import plain
from mrfit.settings.export import Settings
from mrfit.simulate.current_dependence import Order, form_of, knee_of
from mrfit.simulate.current_levels import assembly_of

# Samples of a segment from rest, with what the simulation makes of them, by which another program can be checked
CHECKED = 200


class ChannelRange(Entry):
    """A channel, and what the fit has seen of it; None where that is not known."""

    name: str
    unit: str
    range: list[float] | None


class NodesOfPiece(Entry):
    """A polynomial through ``values`` at ``currents``, which holds up to a current."""

    to: float
    currents: list[float]
    values: list[float]


class BaseParameter(Entry):
    """A parameter of the base: its value, or the pieces of a polynomial of current through its nodes.

    ``ln`` says that it is the logarithm of the parameter that the polynomial gives; ``knee``, in A, that it is one of
    knee·tanh(current/knee), at the nodes as at the current asked for, None where it is one of the current itself.
    """

    name: str
    unit: str
    text: str
    value: float | None = None
    ln: bool = False
    knee: float | None = None
    pieces: list[NodesOfPiece] = field(default_factory=list)
    bounds: list[float] | None = None

    @property
    def absent(self) -> Collection[str]:
        """Either way of the two."""
        return ("value",) if self.pieces else ("ln", "knee", "pieces", "bounds")


class EffectValues(Entry):
    """An effect with its parameters by name."""

    name: str
    slot: str
    equation: str
    parameters: dict[str, float]


class CheckSamples(Entry):
    """Samples from rest, with what the simulation makes of them, by which another program can be checked."""

    dt: float
    inputs: dict[str, list[float]]
    output: list[float]


class PlainModel(Entry):
    """The model in plain numbers: what each parameter is at a current, effects, units, ranges, samples."""

    head: list[str]
    model: str
    base: str
    condition: str
    sha256: str
    inputs: list[ChannelRange]
    output: ChannelRange
    current_range: list[float] | None
    parameters: list[BaseParameter]
    effects: list[EffectValues]
    check: CheckSamples | None


class ExportedFit(SavedFit):
    """The whole file, which ``mrfit.load`` reads too."""

    export: PlainModel


def files(source: ExportSource, settings: Settings) -> Files:
    """Return one file."""
    difference = rebuilt(source, _text(source, ""))
    name = f"{prefix_of(source.prefix or source.name)}.json"
    text = _text(source, difference.text)
    return Files({name: text.encode()}, (difference.text,), difference.largest)


def _text(source: ExportSource, told: str) -> str:
    own = {f.name: getattr(source.content, f.name) for f in fields(Fit)}
    # how recordings were prepared is not known of a workspace's fit
    whole = ExportedFit(**own, preparation=None, export=plain_model(source, head_lines(source, [told])))
    return json.dumps(plain(whole), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def plain_model(source: ExportSource, head: list[str]) -> PlainModel:
    """Return the model in plain numbers."""
    dependence = source.dependence
    return PlainModel(
        head=head,
        model=source.assembly.name,
        base=source.base.name,
        condition=source.condition,
        sha256=source.digest,
        inputs=[_channel(source, n) for n in source.channels],
        output=_channel(source, source.spec.output),
        current_range=[dependence.low, dependence.high] if dependence else None,
        parameters=_parameters(source),
        effects=[_effect(link) for link in source.links],
        check=_check(source),
    )


def _effect(link: EffectLink) -> EffectValues:
    spec = link.spec
    values = {p.name: float(v) for p, v in zip(spec.params, link.theta, strict=True)}
    return EffectValues(name=spec.name, slot=spec.slot, equation=spec.equation, parameters=values)


def _channel(source: ExportSource, name: str) -> ChannelRange:
    return ChannelRange(name=name, unit=unit_of(name), range=list(source.ranges.get(name, ())) or None)


def _parameters(source: ExportSource) -> list[BaseParameter]:
    dependence = source.dependence
    orders: dict[str, Order] = dict(dependence.orders) if dependence else {}
    found = []
    for p, row in zip(source.base.params, base_fields(source, []), strict=True):
        order = orders.get(p.name, 0)
        if not order or dependence is None:
            found.append(BaseParameter(name=p.name, unit=p.unit, text=p.text, value=row.values[0]))
            continue
        values = np.array(row.values)
        pieces = [
            NodesOfPiece(to=piece.high, currents=piece.nodes.tolist(), values=values[piece.columns].tolist())
            for piece in dependence.pieces(order)
        ]
        bounds = [p.low, p.high] if row.clip else None
        knee = knee_of(form_of(order), (dependence.low, dependence.high)) or None
        own = BaseParameter(name=p.name, unit=p.unit, text=p.text, ln=row.log, knee=knee, pieces=pieces, bounds=bounds)
        found.append(own)
    return found


def _check(source: ExportSource) -> CheckSamples | None:
    if not source.stretches:
        return None
    stretch = source.stretches[0]
    drive = source.drive(stretch)[:, :CHECKED]
    rows = {n: drive[source.spec.inputs.index(n)].tolist() for n in source.channels}
    return CheckSamples(dt=stretch.dt, inputs=rows, output=source.simulate(drive, stretch.dt).tolist())


def rebuilt(source: ExportSource, text: str) -> Difference:
    """Return the difference of the model that is built again from a file's text from the fit's."""
    if not source.stretches:
        return Difference(why_not="the fit's logs are not at hand")
    content = of_json(Fit, text)
    assembly = assembly_of(content)
    result = next(r for r in content.results if r.condition == source.condition)
    values = {p.name: p.value for p in result.parameters}
    neutral = {
        f"{s.name}.{p.name}": value for s in _left_out(source) for p, value in zip(s.params, s.neutral, strict=True)
    }
    theta = np.array([neutral.get(n, values[n]) for n in assembly.spec.names])
    names = source.spec.inputs

    def run(drive: Array, dt: float) -> Array:
        # inputs of an effect that was left out do not matter
        rows = {n: drive[k] for k, n in enumerate(names)}
        whole = np.stack([rows.get(n, np.zeros(drive.shape[1])) for n in assembly.spec.inputs])
        simulated: Array = assembly.simulate(whole, theta[None], dt)[0]
        return simulated

    return compared(source, run)


def _left_out(source: ExportSource) -> list[EffectSpec]:
    from mrfit.core import registry

    return [registry.load("effect", name).SPEC for name in source.without]
