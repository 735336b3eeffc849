"""Put a model together: a base model, its dependence on current, and a chain of effects in fixed slots.

The written name of the whole is ``BASE+EFFECT+EFFECT``. Whatever the order of writing, effects act in the order of
their slots, those of one slot by their turns and names:

    input (a channel is changed before the base sees it) -> loop (a channel is changed by what the output does)
    -> theta (parameters of a role are scaled over time) -> base -> add (a term is added to the output)
    -> output (the output is changed; one that is late is made by the channels of some time ago, behind input)
    -> record (what the instruments, or the reconstruction from them, add; it sees the channels as recorded)

Every effect has a neutral value at which it vanishes bit for bit, so that the base is nested in base + effect.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import accumulate, pairwise
from typing import cast

import numpy as np

from mrfit.core import protocols, registry
from mrfit.core.specs import Array, EffectSpec, ModelSpec, ReducedModel, Response, Sensitivities
from mrfit.errors import ConfigError
from mrfit.kernels.theta import by_rows, distinct
from mrfit.simulate.at_current import at_current
from mrfit.simulate.current_dependence import CurrentDependence, base_name, coefficients, expanded
from mrfit.simulate.middles import apart, between, halved, middles_of


@dataclass(frozen=True, slots=True)
class Assembly:
    """A model ready to simulate.

    Attributes
    ----------
    name
        As written on the command line.
    spec
        Specification of the whole: the base's parameters, then each effect's as ``EFFECT.PARAMETER``.
    simulate
        Batched response, see ``specs.Response``.
    derived
        Maps theta (P, K) to the derived quantities (P, D) of ``spec.derived``.
    start_values
        Maps (drive (C, N), output (N,), dt) to what start values the data give, by parameter name.
    rough
        As ``simulate``, less exact and faster: what a search may use far from its end.
    reduced
        The model in the fewest parameters that give its responses, where these are fewer or better to search in.
    sensitivities
        The response and its exact derivatives, where the model has them.
    far_starts
        Maps the same to start values of minima that a search hardly finds from these, where a base model knows of some.
    alone
        Whether it is a base model as it stands, without effects or dependence on current.
    bare
        Whether it is a base model without effects; its parameters may depend on current.
    adds
        Whether an effect adds a term to the base's output, or to the record.
    counts
        Whether the state of an effect grows from a recording's first sample, so that all of it leads a segment in.
    recipe
        What ``assemble`` made it from; None once anything has been replaced.
    """

    name: str
    spec: ModelSpec
    simulate: Response
    derived: Callable[[Array], Array]
    start_values: Callable[[Array, Array, float], dict[str, float]]
    rough: Response | None = None
    reduced: ReducedModel | None = None
    sensitivities: Sensitivities | None = None
    far_starts: Callable[[Array, Array, float], list[dict[str, float]]] | None = None
    alone: bool = False
    bare: bool = False
    adds: bool = False
    counts: bool = False
    recipe: tuple[str, CurrentDependence | None] | None = field(default=None, init=False, repr=False, compare=False)

    def __reduce__(self) -> tuple[Callable[..., "Assembly"], tuple[object, ...]]:
        """Send what it was assembled from to another process, where the same names mean the same functions.

        Raises
        ------
        TypeError
            If it was changed afterwards.
        """
        if self.recipe is None:
            raise TypeError(f"'{self.name}' is not as assembled and cannot be sent")
        return assemble, self.recipe


def _nothing_derived(theta: Array) -> Array:
    return np.empty((len(theta), 0))


def _no_start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    return {}


def assemble(name: str, dependence: CurrentDependence | None = None) -> Assembly:
    """Return the assembly of a written model name.

    Parameters
    ----------
    name
        ``BASE`` or ``BASE+EFFECT+…``.
    dependence
        Which of the base's parameters depend on current; None for none.

    Raises
    ------
    ConfigError
        If a name is in no registry, an effect is written twice, or it does not fit the base's output.
    """
    assembly = _assembled(name, dependence)
    object.__setattr__(assembly, "recipe", (name, dependence))
    return assembly


def _assembled(name: str, dependence: CurrentDependence | None) -> Assembly:
    if "@" in name:
        return _driven(name, dependence)
    base, *written = name.split("+")
    module = registry.load("model", base)
    effects = [registry.load("effect", e) for e in written]

    def built(response: Response) -> Assembly:
        whole = Assembly(
            name=name,
            spec=module.SPEC,
            simulate=response,
            derived=module.derived if isinstance(module, protocols.HasDerived) else _nothing_derived,
            start_values=module.start_values if isinstance(module, protocols.HasStartValues) else _no_start_values,
        )
        if dependence and dependence.varies:
            whole = _depending(whole, dependence)
        return _with_effects(whole, effects) if effects else whole

    whole = built(module.response)
    rough = built(module.rough_response).simulate if isinstance(module, protocols.HasRoughResponse) else None
    if effects or (dependence and dependence.varies):
        return replace(whole, rough=rough, bare=not effects)
    return replace(
        whole,
        rough=rough,
        reduced=module.REDUCED if isinstance(module, protocols.HasReduced) else None,
        sensitivities=module.sensitivities if isinstance(module, protocols.HasSensitivities) else None,
        far_starts=module.far_starts if isinstance(module, protocols.HasFarStarts) else None,
        alone=True,
        bare=True,
    )


def _driven(name: str, dependence: CurrentDependence | None) -> Assembly:
    """Return a mass on a force model, see ``driven.motion``."""
    # its loop is imported where something is driven only
    from mrfit.driven.motion import response_around, spec_around, split

    law = _assembled(split(name)[0], dependence)

    def derived(theta: Array) -> Array:
        return law.derived(theta[:, :-1])

    simulate = response_around(law.spec, name, dependence)
    return Assembly(name, spec_around(law.spec, name), simulate, derived, _no_start_values)


def _depending(base: Assembly, dependence: CurrentDependence) -> Assembly:
    spec = expanded(base.spec, dependence)
    row = spec.inputs.index("current")
    inputs = len(base.spec.inputs)

    def simulate(drive: Array, theta: Array, dt: float) -> Array:
        return base.simulate(drive[:inputs], at_current(base.spec, dependence, theta, drive[row]), dt)

    def derived(theta: Array) -> Array:
        return coefficients(base.spec, dependence, theta)

    def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
        starts = base.start_values(drive[:inputs], output, dt)
        return {n: starts[base_name(n)] for n in spec.names if base_name(n) in starts}

    return Assembly(base.name, spec, simulate, derived, start_values)


def _with_effects(base: Assembly, modules: list[protocols.Effect]) -> Assembly:
    modules = sorted(modules, key=lambda m: m.SPEC.place)
    specs = [m.SPEC for m in modules]
    for k, effect in enumerate(specs):
        if effect in specs[:k]:
            raise ConfigError(f"'{base.name}' names the effect {effect.name} twice")
        if base.spec.output not in effect.outputs:
            raise ConfigError(f"effect {effect.name} acts on {' or '.join(effect.outputs)}, not on {base.spec.output}")
    needed = dict.fromkeys((*base.spec.inputs, *(i for e in specs for i in e.inputs)))
    params = tuple(
        replace(p, name=f"{e.name}.{p.name}", fixed=p.fixed or bool(p.needs and p.needs not in needed))
        for e in specs
        for p in e.params
    )
    spec = replace(
        base.spec,
        name=base.name,
        inputs=tuple(needed),
        params=(*base.spec.params, *params),
        rate_independent=False,
    )
    erring, moving = (
        frozenset(m.SPEC.name for m in modules if isinstance(m, kind))
        for kind in (protocols.ErrsInRecord, protocols.MovesDrive)
    )
    chain = _Chain(base, spec, modules, specs, erring, moving)
    whole = replace(base, spec=spec, simulate=chain.simulate, derived=chain.derived, start_values=chain.start_values)
    adds = any(e.slot in ("add", "record") for e in specs)
    return replace(whole, adds=adds, counts=any(map(counts_from_the_beginning, modules)))


def counts_from_the_beginning(effect: protocols.Effect) -> bool:
    """Return whether the state of an effect grows from a recording's first sample: it remembers and is not steady."""
    return isinstance(effect, protocols.HasStep) and not effect.SPEC.steady


@dataclass(frozen=True, slots=True, eq=False)
class _Points:
    """Points of one simulation.

    Attributes
    ----------
    theta
        Parameters of the base and of all effects, shape (P, M).
    base
        The base's, shape (P, K).
    own
        Those of every effect.
    active
        By slot, the effects that some point does not hold at neutral, with their parameters.
    """

    theta: Array
    base: Array
    own: list[Array]
    active: Mapping[str, list[tuple[protocols.Effect, Array]]]


@dataclass(frozen=True, slots=True)
class _Chain:
    """The base between its effects; every method takes a batch."""

    base: Assembly
    spec: ModelSpec
    modules: list[protocols.Effect]
    effects: list[EffectSpec]
    erring: frozenset[str]
    moving: frozenset[str]

    def simulate(self, drive: Array, theta: Array, dt: float) -> Array:
        """Simulate points together that share the effects which change the drive itself."""
        batch = self._batch(theta)
        active = batch.active.get("output", [])
        shared = [p for p, e in zip(batch.own, self.effects, strict=True) if e.slot == "input"]
        shared += [p for module, p in active if module.SPEC.name in self.moving]
        if not shared:
            return self._recorded(self._closed(drive, batch, dt), drive, batch, dt)
        _, group = np.unique(np.hstack(shared), axis=0, return_inverse=True)
        output = np.empty((len(theta), drive.shape[1]))
        for number in range(group.max() + 1):
            members = np.flatnonzero(group == number)
            own = self._batch(theta[members])
            output[members] = self._closed(self._changed(drive, own, dt), own, dt)
        return self._recorded(output, drive, batch, dt)

    def derived(self, theta: Array) -> Array:
        """Return the base's derived quantities."""
        return self.base.derived(theta[:, : len(self.base.spec.params)])

    def start_values(self, drive: Array, output: Array, dt: float) -> dict[str, float]:
        """Return the base's start values."""
        return self.base.start_values(drive[: len(self.base.spec.inputs)], output, dt)

    def _batch(self, theta: Array) -> _Points:
        ends = list(accumulate((len(e.params) for e in self.effects), initial=len(self.base.spec.params)))
        # kernels are compiled for contiguous arrays
        base, *own = (np.ascontiguousarray(theta[:, first:last]) for first, last in pairwise([0, *ends]))
        active: dict[str, list[tuple[protocols.Effect, Array]]] = {}
        for module, effect, p in zip(self.modules, self.effects, own, strict=True):
            if not np.all(p == effect.neutral):
                active.setdefault(effect.slot, []).append((module, p))
        return _Points(theta, base, own, active)

    def _named(self, drive: Array) -> dict[str, Array]:
        return dict(zip(self.spec.inputs, drive, strict=True))

    def _changed(self, drive: Array, batch: _Points, dt: float) -> Array:
        channels = self._named(drive)
        for module, theta in batch.active.get("input", ()):
            channels |= cast(protocols.ChangesInput, module).transform(channels, theta[0], dt)
        for module, theta in batch.active.get("output", ()):
            if module.SPEC.name in self.moving:
                channels |= cast(protocols.MovesDrive, module).moved(channels, theta[0], dt)
        return np.stack([channels[n] for n in self.spec.inputs])

    def _closed(self, drive: Array, batch: _Points, dt: float) -> Array:
        """Close the loops around the base, the last one innermost; within a loop every point has its own drive."""
        loops = batch.active.get("loop", [])
        if not loops:
            return self._after_input(drive, batch, dt)
        output = np.empty((len(batch.theta), drive.shape[1]))
        for point in range(len(output)):
            # without the effects that only other points need
            own = self._batch(batch.theta[point : point + 1]) if len(output) > 1 else batch
            output[point] = self._around(loops, point, drive, own, dt)
        return output

    def _around(
        self, loops: list[tuple[protocols.Effect, Array]], point: int, drive: Array, batch: _Points, dt: float
    ) -> Array:
        if not loops:
            alone: Array = self._after_input(drive, batch, dt)[0]
            return alone
        (module, theta), *inner = loops
        row = self.spec.inputs.index(module.SPEC.inputs[0])

        def simulate(channel: Array) -> Array:
            changed = drive.copy()
            changed[row] = channel
            return self._around(inner, point, changed, batch, dt)

        return cast(protocols.ClosesLoop, module).closed(simulate, drive[row], theta[point], dt)

    def _after_input(self, drive: Array, batch: _Points, dt: float) -> Array:
        channels = self._named(drive)
        output = self._made(drive, channels, batch, dt)
        for module, theta in batch.active.get("output", ()):
            if module.SPEC.name in self.moving and cast(protocols.MovesDrive, module).needs_middles(theta[0]):
                # at uneven times ``dt`` are the steps, see ``uneven``
                moved = middles_of(drive)
                middles = self._made(moved, self._named(moved), batch, cast(float, apart(dt)))
                whole = between(output, middles)
                shaped = cast(protocols.ShapesOutput, module).shape(whole, {}, theta, cast(float, halved(dt)))
                output = np.ascontiguousarray(shaped[:, ::2])
            else:
                output = cast(protocols.ShapesOutput, module).shape(output, channels, theta, dt)
        return output

    def _made(self, drive: Array, channels: dict[str, Array], batch: _Points, dt: float) -> Array:
        """Return the output of the base and the added terms."""
        output = self._of_base(drive, channels, batch, dt)
        for module, theta in batch.active.get("add", ()):
            first, places = distinct(theta)
            output = output + cast(protocols.AddsTerm, module).term(channels, theta[first], dt)[places]
        return output

    def _recorded(self, output: Array, drive: Array, batch: _Points, dt: float) -> Array:
        channels = self._named(drive)
        for module, theta in (*batch.active.get("input", ()), *batch.active.get("record", ())):
            if module.SPEC.name in self.erring:
                output = output + cast(protocols.ErrsInRecord, module).error(channels, theta, dt)
        return output

    def _of_base(self, drive: Array, channels: dict[str, Array], batch: _Points, dt: float) -> Array:
        """Return the base's output under its scaled parameters; where these vary, of a few points at a time."""
        inputs = np.ascontiguousarray(drive[: len(self.base.spec.inputs)])
        scaling = batch.active.get("theta", [])
        first, places = distinct(np.hstack([batch.base, *(own for _, own in scaling)]) if scaling else batch.base)
        factors = self._factors(channels, [(module, own[first]) for module, own in scaling], dt)
        theta = batch.base[first].copy()
        if all(factor.shape[1] == 1 for _, factor in factors):
            for column, factor in factors:
                theta[:, column] *= factor[:, 0]
            return self.base.simulate(inputs, theta, dt)[places]

        def simulate(rows: slice) -> Array:
            own = theta[rows, :, None]
            varied = np.broadcast_to(own, (*own.shape[:2], drive.shape[1])).copy()
            for column, factor in factors:
                varied[:, column] *= factor[rows]
            return self.base.simulate(inputs, varied, dt)

        return by_rows(simulate, drive.shape[1], len(theta))[places]

    def _factors(
        self, channels: dict[str, Array], scaling: list[tuple[protocols.Effect, Array]], dt: float
    ) -> list[tuple[int, Array]]:
        """Return the factors on the base's parameters, (P, 1) or (P, N) by column, in the order of the effects."""
        params = self.base.spec.params
        return [
            (column, factor)
            for module, own in scaling
            for role, factor in cast(protocols.ScalesParameters, module).factors(channels, own, dt).items()
            for column, param in enumerate(params)
            if param.role == role
        ]
