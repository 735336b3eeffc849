"""Source of an export: a fit's model with one set of parameters, and its logs, which tell its range."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from mrfit.core import registry
from mrfit.core.channels import unit_of
from mrfit.core.counting import few
from mrfit.core.recording import RECORD_CONSTANTS
from mrfit.core.specs import Array, EffectSpec, Index, ModelSpec, Steps
from mrfit.errors import ConfigError, DataError
from mrfit.io.schemas.fit import Fit
from mrfit.io.workspace import plain
from mrfit.signal.smoothing import TIME_CHANNEL
from mrfit.simulate.assembly import Assembly, assemble
from mrfit.simulate.current_dependence import CurrentDependence
from mrfit.simulate.uneven import simulate_unevenly

# Channels that no user sets: they follow from the others
SOURCE_INPUTS = (TIME_CHANNEL, *RECORD_CONSTANTS)
# Most samples on which an export is compared with the simulation
SAMPLES_COMPARED = 200_000


@dataclass(frozen=True)
class LogStretch:
    """One segment of the logs a fit was made from.

    Attributes
    ----------
    segment, condition, role
        As in the fit.
    dt
        Sample interval in s.
    inputs
        Channel name -> smoothed values (N,) that drove the model.
    measured, simulated
        Output (N,) as recorded, and as the fit has it.
    raw
        Channel name -> values (N,) as recorded, where the logs are at hand.
    """

    segment: str
    condition: str
    role: str
    dt: float
    inputs: Mapping[str, Array]
    measured: Array
    simulated: Array
    raw: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class EffectLink:
    """An effect of the chain with its parameters (Q,)."""

    spec: EffectSpec
    theta: Array


@dataclass(frozen=True)
class ExportSource:
    """A fit to be exported.

    Attributes
    ----------
    content
        Content of fit.json.
    assembly
        The model that is exported.
    condition
        Whose parameters these are; ``all`` of a joint fit.
    theta
        The parameters (K,) in the order of the assembly's SPEC.
    stretches
        The logs' segments; empty where they are not at hand.
    without
        Effects of the fit that were left out.
    """

    content: Fit
    assembly: Assembly
    condition: str
    theta: Array
    stretches: tuple[LogStretch, ...] = ()
    without: tuple[str, ...] = ()
    prefix: str = ""

    @property
    def name(self) -> str:
        """Name of the fit."""
        return self.content.name

    @property
    def spec(self) -> ModelSpec:
        """SPEC of the whole."""
        return self.assembly.spec

    @property
    def dependence(self) -> CurrentDependence | None:
        """Dependence of the base's parameters on current, None if there is none."""
        assert self.assembly.recipe is not None
        found = self.assembly.recipe[1]
        return found if found and found.varies else None

    @property
    def law_name(self) -> str:
        """Written name of the model, of a driven mass that of the law it hangs on."""
        return self.assembly.name.partition("@")[0]

    @property
    def is_driven(self) -> bool:
        """Whether it is a driven mass."""
        return "@" in self.assembly.name

    @cached_property
    def base(self) -> ModelSpec:
        """SPEC of the base model, as it stands in its file."""
        return registry.load("model", self.law_name.partition("+")[0]).SPEC

    @cached_property
    def links(self) -> tuple[EffectLink, ...]:
        """The effects in the order in which they act."""
        modules = [registry.load("effect", e) for e in self.law_name.split("+")[1:]]
        specs = sorted((m.SPEC for m in modules), key=lambda s: s.place)
        first = len(self.theta) - self.is_driven - sum(len(s.params) for s in specs)
        links = []
        for spec in specs:
            links.append(EffectLink(spec, self.theta[first : first + len(spec.params)]))
            first += len(spec.params)
        return tuple(links)

    @property
    def base_theta(self) -> Array:
        """Parameters of the base model at their nodes of current (K',)."""
        return self.theta[: len(self.theta) - self.is_driven - sum(len(link.theta) for link in self.links)]

    @property
    def channels(self) -> tuple[str, ...]:
        """The inputs a user sets, in the order of the SPEC."""
        return tuple(n for n in self.spec.inputs if n not in SOURCE_INPUTS)

    @cached_property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Least and greatest value in the logs of every input and of the output, SI; of rates, of either sign."""
        found = {}
        for name in (*self.channels, self.spec.output):
            values = [s.simulated if name == self.spec.output else s.inputs[name] for s in self.stretches]
            if values:
                low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
                if unit_of(name).endswith(("/s", "/s^2")):
                    low, high = -max(-low, high), max(-low, high)
                found[name] = low, high
        if self.dependence and "current" in found:
            # inputs are smoothed, and what a sensor shows about 0 A was tested too
            low, high = found["current"]
            found["current"] = min(low, self.dependence.low), max(high, self.dependence.high)
        return found

    @property
    def output_range(self) -> float:
        """Extent of the simulated output over all logs."""
        low, high = self.ranges.get(self.spec.output, (0.0, 0.0))
        return (high - low) or 1.0

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the fit's content."""
        text = json.dumps(plain(self.content), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def drive(self, stretch: LogStretch) -> Array:
        """Return the inputs of a stretch (C, N) in the order of the SPEC; time counts from its first sample."""
        samples = len(stretch.measured)
        constants = dict.fromkeys(RECORD_CONSTANTS, np.zeros(samples))
        rows = {TIME_CHANNEL: np.arange(samples) * stretch.dt, **constants, **stretch.inputs}
        return np.stack([np.asarray(rows[n], dtype=np.float64) for n in self.spec.inputs])

    def simulate(self, drive: Array, dt: Steps) -> Array:
        """Return the output (N,) of the simulation in Python, from rest at the first sample, of steps alike or not."""
        whole, theta = np.ascontiguousarray(drive), self.theta[None, :]
        with np.errstate(all="ignore"):
            if isinstance(dt, np.ndarray):
                return np.asarray(simulate_unevenly(self.assembly, whole, theta, dt)[0])
            return np.asarray(self.assembly.simulate(whole, theta, dt)[0])

    def compared(self) -> list[tuple[Array, float]]:
        """Return drives (C, N) of the logs with their dt in s, ``SAMPLES_COMPARED`` samples at most."""
        share = max(SAMPLES_COMPARED // max(len(self.stretches), 1), 500)
        return [(self.drive(s)[:, :share], s.dt) for s in self.stretches][: SAMPLES_COMPARED // 500]


def runs(time: Array) -> list[tuple[Index, float]]:
    """Return the places of samples without a gap between them, and their dt in s.

    What is held out of a segment may lie between what is not.
    """
    if len(time) < 2:
        return []
    # twelve digits: differences of times have rounding in them
    dt = float(f"{np.median(np.diff(time)):.12g}")
    cut = np.split(np.arange(len(time)), np.flatnonzero(np.abs(np.diff(time) - dt) > 0.5 * dt) + 1)
    return [(run, dt) for run in cut if len(run) > 1]


def source_of(
    content: Fit,
    assembly: Assembly,
    stretches: Sequence[LogStretch],
    condition: str = "",
    without: Sequence[str] = (),
) -> ExportSource:
    """Return the source of a fit's export.

    Parameters
    ----------
    content
        Content of fit.json.
    assembly
        Its model.
    stretches
        Its logs.
    condition
        Whose parameters, of a fit with several sets.
    without
        Effects to leave out.

    Raises
    ------
    ConfigError
        If there are several sets and none is named, no set has this name, or an effect is not in the model.
    """
    results = {r.condition: r for r in content.results}
    if not condition and len(results) > 1:
        raise ConfigError(
            f"{content.name}: has {len(results)} sets of parameters; name one with --condition "
            f"({few(list(results))}), or fit with --per all"
        )
    chosen = condition or next(iter(results))
    if chosen not in results:
        raise ConfigError(
            f"--condition '{chosen}': {content.name} has no parameters of it; there are {few(list(results))}"
        )
    values = {p.name: float(p.value) for p in results[chosen].parameters}
    own = tuple(s for s in stretches if chosen == "all" or s.condition == chosen)
    theta = assembly.spec.theta(values)
    if not np.all(np.isfinite(theta)):
        raise DataError(f"{content.name}: a parameter is not a number: fit again")
    whole = ExportSource(content, assembly, chosen, theta, own)
    return _left_out(whole, without) if without else whole


def _left_out(source: ExportSource, without: Sequence[str]) -> ExportSource:
    base, *effects = source.law_name.split("+")
    for name in without:
        if name not in effects:
            raise ConfigError(f"--without {name}: the model is {source.assembly.name}, which has no such effect")
    kept = source.assembly.name.replace(source.law_name, "+".join([base, *(e for e in effects if e not in without)]))
    assembly = assemble(kept, source.dependence)
    values = dict(zip(source.spec.names, source.theta, strict=True))
    theta = assembly.spec.theta(values)
    return replace(source, assembly=assembly, theta=theta, without=tuple(without))
