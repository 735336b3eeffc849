"""A coil that is put to use: the current of a flux linkage, and the voltage for a wanted one.

    u = R*i + d(flux)/dt,    i = i_m + G*d(flux)/dt,    flux = flux_static(i_m)

u voltage (V), i current (A), R resistance (ohm), i_m the magnetising part of the current (A), G conductance of the
eddy currents' path (S), 0 without the effect ``eddy-current``. The static flux at the end of a step rises with the
current: it is followed along its branch curve, whose current is found by Newton's method within bisection. The
terminal current is the one whose lag is i_m, by the chords with which ``eddy-current`` simulates.

Instruments err in records, not in coils: effects of the slot ``record``, and ``probe-skew``, are left out. A model that
gives the current of a flux linkage is simulated as it is.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, cast

import numpy as np

from mrfit.apply.circuit import Circuit, energised, energised_by_flux, magnetised, terminal
from mrfit.apply.damper import parameters_for_all
from mrfit.apply.framed import FramedResult
from mrfit.apply.history import fitted_history
from mrfit.core import registry
from mrfit.core.arguments import check_arguments
from mrfit.core.protocols import ErrsInRecord
from mrfit.core.setting import Setting
from mrfit.core.specs import Array, Mask, ModelSpec
from mrfit.effects import eddy_current
from mrfit.errors import ConfigError, DataError
from mrfit.settings.apply import CoilDrive
from mrfit.simulate.assembly import assemble
from mrfit.simulate.chain import DamperChain, followed, in_memory
from mrfit.simulate.program import DEFAULTS, DamperProgram
from mrfit.simulate.uneven import Stepped

if TYPE_CHECKING:
    from pandas import DataFrame

    from mrfit.api.fitting import FitResult

_CAUSALITIES = (("current", "flux"), ("flux", "current"))
_EDDY = eddy_current.SPEC.name
# How many times the greatest known current an unlogged one is looked for
_REACH = 3.0
# Share of a limit from which on it binds
BOUND = 1.0 - 1e-9
# A step in s in which every lag dies out
_SETTLED = 1e6

SampleInterval = Annotated[float, Setting("Sample interval in s.", above=0.0)]


@dataclass(frozen=True)
class Coil:
    """A coil's model.

    Attributes
    ----------
    name
        What it is called in tables: the fit's name.
    model
        Model as written, without the effects of instruments.
    parameters
        (name, value) of its parameters, SI.
    left_out
        Effects of instruments that were left out.
    """

    name: str
    model: str
    parameters: tuple[tuple[str, float], ...]
    left_out: tuple[str, ...] = ()

    @cached_property
    def spec(self) -> ModelSpec:
        """Specification of the whole."""
        return assemble(self.model).spec

    @property
    def conductance(self) -> float:
        """G in S, 0 without eddy currents."""
        return dict(self.parameters).get(f"{_EDDY}.G", 0.0)

    @cached_property
    def static(self) -> DamperProgram:
        """The flux of the magnetising current, ready to be stepped."""
        kept = [part for part in self.model.split("+") if part != _EDDY]
        values = np.array([v for n, v in self.parameters if not n.startswith(f"{_EDDY}.")])
        return DamperProgram("+".join(kept), values, None, held=False, shortest=1e-4)

    @property
    def chain(self) -> DamperChain:
        """The same for compiled loops, which search its drive: the current, or the flux where that is given."""
        found = self.static.chain
        if self.spec.output == "flux":
            return found
        return in_memory(found, self.static.channels.index("flux"))

    def channels(self, given: Mapping[str, Array], samples: int) -> Array:
        """Return its channels (N, C), the current 0.

        Raises
        ------
        DataError
            If one is missing.
        """
        known = {**given, "current": np.zeros(samples), "flux": np.zeros(samples)}
        if missing := [n for n in self.static.channels if n not in known and n not in DEFAULTS]:
            raise DataError(f"'{self.name}' needs {' and '.join(missing)}")
        rows = [np.broadcast_to(known.get(n, DEFAULTS.get(n, 0.0)), samples) for n in self.static.channels]
        return np.ascontiguousarray(np.stack(rows, axis=1), dtype=np.float64)


@check_arguments
def coil(model: str, parameters: Mapping[str, float], name: str = "") -> Coil:
    """Return a coil of parameters that are known, as those of a paper.

    Parameters
    ----------
    model
        Model of flux linkage, with effects.
    parameters
        Values by name, SI.
    name
        What it is called; default: the model.

    Raises
    ------
    ConfigError
        If a parameter is missing, or it is no model of flux linkage over current.
    """
    spec = assemble(model).spec
    if (spec.inputs[0], spec.output) not in _CAUSALITIES:
        raise ConfigError(f"'{name or model}' predicts {spec.output}: a coil's model predicts flux or current")
    if missing := [n for n in spec.names if n not in parameters]:
        raise ConfigError(f"'{model}' needs a value of {', '.join(missing)}")
    base, *effects = model.split("+")
    loaded = {e: registry.load("effect", e) for e in effects}
    erring = tuple(e for e, m in loaded.items() if m.SPEC.slot == "record" or isinstance(m, ErrsInRecord))
    kept = tuple((n, float(parameters[n])) for n in spec.names if n.partition(".")[0] not in erring)
    return Coil(name or model, "+".join([base, *(e for e in effects if e not in erring)]), kept, erring)


def coil_of(fit: "FitResult | Coil") -> Coil:
    """Return the coil that a fit describes, or a coil as it is.

    Raises
    ------
    DataError
        If the fit has several sets of parameters, or is not of flux linkage.
    """
    if isinstance(fit, Coil):
        return fit
    if fit.output not in ("flux", "current"):
        raise DataError(f"'{fit.name}' predicts {fit.output}: fit a coil's flux, as `mrfit fit --model boucwen-flux`")
    return coil(fit.model, dict(parameters_for_all(fit)), fit.name)


@dataclass(frozen=True, repr=False)
class FluxCurrent(FramedResult):
    """The current of a flux linkage.

    Attributes
    ----------
    current, magnetising
        Terminal current and its magnetising part in A, shape (N,); as known over the beginning.
    known
        Samples of the beginning.
    offset
        Constant in Wb of the flux as given, from the beginning; 0 without one.
    history
        Currents in A before the first sample from which the state comes; empty: z = 0 there.
    """

    current: Array
    magnetising: Array
    known: int
    offset: float
    history: Array

    def to_frame(self) -> "DataFrame":
        """Return terminal and magnetising current as a data frame."""
        from pandas import DataFrame

        return DataFrame({"current": self.current, "magnetising": self.magnetising})


@check_arguments
def current_of_flux(
    fit: "FitResult | Coil",
    flux: Array,
    dt: SampleInterval,
    known: Array | None = None,
    channels: Mapping[str, Array] | None = None,
) -> FluxCurrent:
    """Return the current of a flux linkage, by the model inverted along its branch curve.

    Parameters
    ----------
    fit
        A fit of flux linkage with one set of parameters, or ``mrfit.apply.coil(...)``.
    flux
        Flux linkage in Wb, shape (N,).
    dt
        Sample interval in s.
    known
        The current in A of the beginning, shape (M,): state and constant of the flux come from it. None: the state is
        that of a model at its first sample, and the flux has no constant.
    channels
        Other channels (N,) that the model needs, as ``temperature``.

    Raises
    ------
    DataError
        If no current gives the flux somewhere, or an array has a wrong length.
    """
    made = coil_of(fit)
    begun = np.zeros(0) if known is None else np.asarray(known, dtype=np.float64)
    flux = np.asarray(flux, dtype=np.float64)
    if flux.ndim != 1 or not len(begun) < len(flux) or not np.isfinite(flux).all() or not np.isfinite(begun).all():
        raise DataError("a flux needs finite samples (N,), and more of them than the current known at its beginning")
    if made.spec.output == "current":
        return _simulated(made, flux, dt, begun, channels or {})
    given, first = made.channels(channels or {}, len(flux)), len(begun)
    steps = np.full(len(flux), dt)
    if first:
        start = _KnownPart(made, flux[:first], begun, given[:first], dt)
        before, offset, history = start.magnetising, start.offset, start.history
        state = start.state
    else:
        before, offset, history = begun, 0.0, begun
        state, steps[0] = np.zeros(made.static.chain.places.whole), -1.0
    found = magnetised(made.static.chain, state, given[first:], steps[first:], flux[first:] - offset)
    whole = np.concatenate([before, found])
    if np.isnan(found).any():
        at = int(np.argmax(np.isnan(whole)))
        raise DataError(f"no current gives a flux of {flux[at]:.6g} Wb, at {at * dt:.6g} s, by '{made.name}'")
    current = np.concatenate([begun, found])
    if made.conductance > 0.0:
        # from the last known sample on, or from rest
        here = max(first - 1, 0)
        tail = terminal(flux[here:], whole[here:], current[here], made.conductance, np.abs(steps[here:]))
        current[here:] = tail
    return FluxCurrent(current, whole, first, offset, history)


def _simulated(made: Coil, flux: Array, dt: float, begun: Array, channels: Mapping[str, Array]) -> FluxCurrent:
    """Return the current by a model that gives it, from the history with which it is nearest to the beginning."""
    whole, first = assemble(made.model), len(begun)
    if missing := [n for n in whole.spec.inputs if n != "flux" and n not in channels]:
        raise DataError(f"'{made.name}' needs {' and '.join(missing)}")
    theta, simulate = np.array([[v for _, v in made.parameters]]), cast(Stepped, whole.simulate)

    def simulated(lead: Array, samples: int) -> Array:
        own = {**channels, "flux": flux}
        drive = np.stack([np.broadcast_to(own[n], len(flux))[:samples] for n in whole.spec.inputs])
        before = np.repeat(drive[:, :1], len(lead), axis=1)
        before[whole.spec.inputs.index("flux")] = lead
        # a history takes no time: what depends on it begins at the first sample
        steps = np.concatenate([np.zeros(len(lead) + 1), np.full(samples - 1, dt)])
        return np.asarray(simulate(np.hstack([before, drive]), theta, steps)[0, len(lead) :])

    history = np.empty(0)
    if first:
        own = [abs(v) for (_, v), p in zip(made.parameters, made.spec.params, strict=True) if p.unit == "Wb"]
        reach = max([float(np.max(np.abs(flux))), *own])
        history = fitted_history(lambda lead: float(np.sum((simulated(lead, first) - begun) ** 2)), reach)
    current = simulated(history, len(flux))
    return FluxCurrent(np.concatenate([begun, current[first:]]), current, first, 0.0, history)


class _KnownPart:
    """The beginning of a record whose current is known: history, state at its end and the constant of its flux."""

    def __init__(self, made: Coil, flux: Array, current: Array, given: Array, dt: float) -> None:
        self.made, self.flux, self.given, self.dt = made, flux, given, dt
        # at rest the whole current magnetises at first; one that was moving before is known by the flux
        self.still = self._from_rest(current)
        self.moving = current - made.conductance * np.gradient(flux, dt)
        self.history = fitted_history(self._error, _REACH * float(np.max(np.abs(current))))
        self.magnetising = self._magnetising(self.history)
        simulated, self.state = self._followed(self.magnetising, self.history)
        self.offset = float(np.mean(flux - simulated))

    def _followed(self, current: Array, lead: Array) -> tuple[Array, Array]:
        """Return the static flux of the beginning behind a lead, and the state at its end."""
        program = self.made.static
        rows = np.concatenate([np.repeat(self.given[:1], len(lead), axis=0), self.given])
        rows[:, program.channels.index("current")] = np.concatenate([lead, current])
        steps = np.concatenate([np.full(len(lead), _SETTLED), np.full(len(current), self.dt)])
        steps[0] = -1.0
        state = np.zeros(program.chain.places.whole)
        return followed(program.chain, state, rows, steps)[len(lead) :, 0].copy(), state

    def _from_rest(self, current: Array) -> Array:
        """Return the magnetising part of the known current of a coil that was at rest."""
        seen = [current]

        def static(magnetising: Array) -> Array:
            seen[0] = magnetising
            return self._followed(magnetising, np.empty(0))[0]

        if self.made.conductance > 0.0:
            eddy_current.closed(static, current, np.array([self.made.conductance]), self.dt)
        return np.asarray(seen[0])

    def _magnetising(self, lead: Array) -> Array:
        return self.moving if len(lead) else self.still

    def _error(self, lead: Array) -> float:
        off = self.flux - self._followed(self._magnetising(lead), lead)[0]
        return float(np.std(off))


@dataclass(frozen=True, repr=False)
class FluxCommand(FramedResult):
    """A wanted flux linkage, the voltage for it, and what comes of it.

    Attributes
    ----------
    time, wanted
        In s and Wb, shape (N,).
    voltage
        Command in V, held over the step that ends at its sample.
    flux, current
        Of the coil under this voltage, in Wb and A.
    predicted, commanded_current
        Flux in Wb and current in A that the model of the command expects; those of the coil where it is the same.
    at_limit
        Whether voltage or current is at its limit, (N,).
    """

    time: Array
    wanted: Array
    voltage: Array
    flux: Array
    current: Array
    predicted: Array
    commanded_current: Array
    at_limit: Mask

    @property
    def limited(self) -> float:
        """Share of the samples at which voltage or current is at its limit."""
        return float(np.mean(self.at_limit))

    @property
    def error(self) -> float:
        """Greatest difference of flux wanted and flux got, over the range of the wanted one."""
        return float(np.max(np.abs(self.flux - self.wanted)) / np.ptp(self.wanted))

    @property
    def rms_error(self) -> float:
        """Rms of the same."""
        return float(np.sqrt(np.mean((self.flux - self.wanted) ** 2)) / np.ptp(self.wanted))

    def to_frame(self) -> "DataFrame":
        """Return the courses as a data frame over time in s."""
        from pandas import DataFrame, Index

        names = ("wanted", "voltage", "flux", "current", "predicted", "commanded_current", "at_limit")
        return DataFrame({n: getattr(self, n) for n in names}, index=Index(self.time, name="time"))


@check_arguments
def flux_command(
    fit: "FitResult | Coil",
    wanted: Array,
    dt: SampleInterval,
    drive: CoilDrive,
    plant: "FitResult | Coil | None" = None,
) -> FluxCommand:
    """Return the voltage for a wanted flux linkage, and the flux of the coil under it.

    Parameters
    ----------
    fit
        A fit of flux linkage with one set of parameters, or ``mrfit.apply.coil(...)``.
    wanted
        Flux linkage in Wb, shape (N,), from rest.
    dt
        Sample interval in s, over which the voltage is held.
    drive
        Resistance of the coil, and limits.
    plant
        The coil that answers; default: the model itself.

    Raises
    ------
    DataError
        If the wanted flux is not finite or does not change, or the model's flux stops rising.
    """
    made = coil_of(fit)
    answering = made if plant is None else coil_of(plant)
    wanted = np.asarray(wanted, dtype=np.float64)
    if wanted.ndim != 1 or len(wanted) < 2 or not np.isfinite(wanted).all() or not np.ptp(wanted) > 0.0:
        raise DataError("a wanted flux needs two or more finite samples (N,) that differ")
    unknown = np.full(len(wanted), np.nan)
    commanded = _energised(made, drive, dt, wanted, unknown)
    voltage = commanded[:, 0]
    got = commanded if answering == made else _energised(answering, drive, dt, wanted, voltage)
    at_limit = np.zeros(len(wanted), dtype=bool)
    for course, limit in ((voltage, drive.voltage), (commanded[:, 3], drive.current)):
        if limit is not None:
            at_limit |= np.abs(course) >= BOUND * limit
    time = np.arange(len(wanted), dtype=np.float64) * np.float64(dt)
    return FluxCommand(time, wanted, voltage, got[:, 1], got[:, 3], commanded[:, 1], commanded[:, 3], at_limit)


def _energised(made: Coil, drive: CoilDrive, dt: float, wanted: Array, voltage: Array) -> Array:
    voltage_limit, current_limit = (np.inf if n is None else float(n) for n in (drive.voltage, drive.current))
    circuit = Circuit(float(drive.resistance), made.conductance, voltage_limit, current_limit, float(dt))
    run = energised if made.spec.output == "flux" else energised_by_flux
    state = np.zeros(made.chain.places.whole)
    found = run(made.chain, circuit, state, made.channels({}, len(wanted)), wanted, voltage)
    if not np.isfinite(found).all():
        at = int(np.argmax(~np.isfinite(found).all(axis=1)))
        raise DataError(
            f"no current gives a flux of {wanted[at]:.6g} Wb, at {at * dt:.6g} s, by '{made.name}': ask for less flux, "
            "or give --voltage"
        )
    return found
