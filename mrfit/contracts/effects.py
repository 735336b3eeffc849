"""Checks of every effect, independent of its equations."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pint

from mrfit.contracts.check import Check, check_of, need, need_close
from mrfit.contracts.signals import CONTRACT_SAMPLES, DT, for_effects
from mrfit.core import registry
from mrfit.core.channels import CHANNELS
from mrfit.core.protocols import SLOT_FUNCTIONS, Effect
from mrfit.core.recording import RECORD_CONSTANTS
from mrfit.core.specs import SLOTS, Array, EffectSpec
from mrfit.simulate.assembly import Assembly, assemble
from mrfit.simulate.current_dependence import CurrentDependence

_OUTPUTS = {"flux", "current", "force", "torque"}
BASES: dict[str, tuple[str, tuple[tuple[str, int], ...]]] = {
    "flux": ("boucwen-flux", ()),
    "current": ("stop-mmf", ()),
    "force": ("tanh", (("fy", 1),)),
    "torque": ("rotational-erf", (("alpha", 1),)),
}
"""A model for each output, and which of its parameters depend on current."""


DRIVE_SIZES = (1.0, 0.1, 10.0, 100.0)
"""Sizes of the channels, at one of which a parameter must show: a force may begin at a stroke that is none of these."""


@dataclass(frozen=True)
class EffectOnBase:
    """A base model, and the same with the effect, driven by channels of a size."""

    spec: EffectSpec
    base: Assembly
    whole: Assembly
    size: float = 1.0

    @property
    def drive(self) -> Array:
        """Input channels (C, N) of the whole."""
        made = for_effects()
        return np.stack([self.size * made[name] for name in self.whole.spec.inputs])

    def moved(self, rows: Array, share: float) -> bool:
        """Return whether the output of two parameter vectors (2, Q) differs by a share of its range, at some size."""
        for size in DRIVE_SIZES:
            out = replace(self, size=size).out(rows)
            if np.abs(out[1] - out[0]).max() >= share * np.ptp(out[0]) > 0.0:
                return True
        return False

    def theta(self, own: Array) -> Array:
        """Return the base's start values, growing with current, beside effect parameters (P, Q)."""
        start = self.whole.spec.start[: -len(self.spec.params)]
        start = start * np.array([2.0 if n.endswith("@2A") else 1.0 for n in self.whole.spec.names[: len(start)]])
        return np.column_stack([np.tile(start, (len(own), 1)), own])

    def out(self, own: Array) -> Array:
        """Return the output (P, N) with effect parameters (P, Q)."""
        return self.whole.simulate(self.drive, self.theta(own), DT)

    def without(self, own: Array) -> Array:
        """Return the base's output (P, N)."""
        drive = self.drive[: len(self.base.spec.inputs)]
        return self.base.simulate(drive, self.theta(own)[:, : -len(self.spec.params)], DT)


def pairs(effect: Effect) -> Iterator[EffectOnBase]:
    """Yield the effect on a base of each output it acts on."""
    for output in effect.SPEC.outputs:
        base, orders = BASES[output]
        dependence = CurrentDependence(orders, 0.0, 2.0)
        yield EffectOnBase(effect.SPEC, assemble(base, dependence), assemble(f"{base}+{effect.SPEC.name}", dependence))


def anywhere(spec: EffectSpec, count: int) -> Array:
    """Return effect parameters (P, Q) within the bounds, the bounds themselves first."""
    low, high = np.array([(p.low, p.high) for p in spec.params]).T
    share = np.random.default_rng(5).uniform(size=(count, len(low)))
    share[0], share[1] = 0.0, 1.0
    found: Array = low + share * (high - low)
    return found


def weak(spec: EffectSpec, count: int) -> Array:
    """Return effect parameters (P, Q): strengths near neutral, shapes (those on a log scale) at neutral."""
    near = np.array(spec.neutral) + 0.02 * (anywhere(spec, count) - np.array(spec.neutral))
    return np.where([p.scale == "log" for p in spec.params], spec.neutral, near)


def specification_is_sound(effect: Effect) -> None:
    """The SPEC names a slot, outputs and inputs that there are, and what each parameter means."""
    spec = effect.SPEC
    need(spec.title and spec.equation, "no title or no equation")
    need(spec.slot in SLOTS, f"no slot '{spec.slot}'")
    need(spec.outputs and set(spec.outputs) <= _OUTPUTS, f"outputs {spec.outputs}")
    needed = {p.needs for p in spec.params if p.needs}
    unknown = {*spec.inputs, *needed} - {*CHANNELS, "time", *RECORD_CONSTANTS}
    need(not unknown, f"unknown channel {', '.join(sorted(unknown))}")
    need(spec.params, "no parameter")
    for p in spec.params:
        need(p.name in spec.equation, f"{p.name} is not in the equation")
        need(p.text, f"{p.name} does not say what it means")


def function_is_that_of_the_slot(effect: Effect) -> None:
    """There is the function of the slot and no other slot's."""
    own, record = SLOT_FUNCTIONS[effect.SPEC.slot], SLOT_FUNCTIONS["record"]
    # a wrong input also misleads a reconstruction from it
    allowed = [{own}, {own, record}] if effect.SPEC.slot == "input" else [{own}]
    found = {f for f in SLOT_FUNCTIONS.values() if hasattr(effect, f)}
    need(found in allowed, f"slot '{effect.SPEC.slot}' with {', '.join(sorted(found)) or 'none'}")


def rivals_are_told_apart(effect: Effect) -> None:
    """It says what it is mistaken for, and in twelve words or more which test tells it from that."""
    need(effect.SPEC.aliases, "no aliases")
    need(len(effect.SPEC.experiment.split()) >= 12, "no experiment")


def rivals_are_known(effect: Effect) -> None:
    """What it is mistaken for are effects with an output in common, or models."""
    for alias in effect.SPEC.aliases:
        if alias in registry.names("effect"):
            shared = set(effect.SPEC.outputs) & set(registry.load("effect", alias).SPEC.outputs)
            need(shared, f"{alias} acts on other outputs")
        else:
            need(alias in registry.names("model"), f"'{alias}' is no effect and no model")


def units_are_known(effect: Effect) -> None:
    """Units are known to pint."""
    units: pint.UnitRegistry[float] = pint.UnitRegistry()
    for p in effect.SPEC.params:
        units.parse_units(p.unit)


def bounds_hold_the_neutral(effect: Effect) -> None:
    """Bounds are finite and hold the neutral value, which is the start."""
    spec = effect.SPEC
    need(len(spec.neutral) == len(spec.params), "not one neutral value for each parameter")
    for p, neutral in zip(spec.params, spec.neutral, strict=True):
        need(np.isfinite([p.low, p.high]).all() and p.low < p.high, f"{p.name}: bounds {p.low} to {p.high}")
        need(p.low <= neutral <= p.high, f"{p.name}: neutral {neutral} outside {p.low} to {p.high}")
        need(p.start == neutral, f"{p.name}: starts at {p.start}, not at the neutral {neutral}")
        need(p.scale == "linear" or p.low > 0, f"{p.name}: logarithmic from {p.low}")


def neutral_survives_the_unit_interval(effect: Effect) -> None:
    """The neutral value survives the way through the unit interval in which searches move."""
    for p, neutral in zip(effect.SPEC.params, effect.SPEC.neutral, strict=True):
        back = p.low + (p.high - p.low) * ((neutral - p.low) / (p.high - p.low))
        need(p.scale != "linear" or back == neutral, f"{p.name}: {neutral} comes back as {back}")


def neutral_leaves_the_base(effect: Effect) -> None:
    """The neutral value leaves the base model bit for bit, also in a batch that is not neutral."""
    for pair in pairs(effect):
        own = np.tile(pair.spec.neutral, (3, 1))
        need(np.array_equal(pair.out(own), pair.without(own)), f"{pair.base.name}: the neutral changes the output")
        mixed = weak(pair.spec, 4)
        mixed[2] = pair.spec.neutral
        same = np.array_equal(pair.out(mixed)[2:3], pair.without(mixed[2:3]))
        need(same, f"{pair.base.name}: the neutral changes the output in a batch that is not neutral")


def every_parameter_moves_the_output(effect: Effect) -> None:
    """Every parameter makes a difference, those for which the model must take a channel of another effect aside."""
    for pair in pairs(effect):
        rows = np.repeat(weak(pair.spec, 2)[1:], 2, axis=0)
        for q, p in enumerate(pair.spec.params):
            if p.needs and p.needs not in pair.whole.spec.inputs:
                continue
            moved = rows.copy()
            moved[1, q] = 0.8 * moved[0, q]
            need(pair.moved(moved, 1e-6), f"{p.name} does not on {pair.base.name}")


def sensitivity_does_not_vanish_at_neutral(effect: Effect) -> None:
    """The output moves with the first parameter, the strength, from the neutral on."""
    for pair in pairs(effect):
        first = pair.spec.params[0]
        for share in (1e-3, 1e-6):
            rows = np.tile(pair.spec.neutral, (2, 1))
            rows[1, 0] += share * (first.high - first.low)
            need(pair.moved(rows, 1e-2 * share), f"{first.name} moves it by less than its range on {pair.base.name}")


def output_is_finite_within_the_bounds(effect: Effect) -> None:
    """The output is finite anywhere within the bounds."""
    for pair in pairs(effect):
        out = pair.out(anywhere(pair.spec, 64))
        need(out.shape == (64, CONTRACT_SAMPLES), f"shape {out.shape}")
        need(np.isfinite(out).all(), f"not finite on {pair.base.name}")


def inputs_are_left_untouched(effect: Effect) -> None:
    """Inputs are left as they are, and may be read-only."""
    for pair in pairs(effect):
        drive, theta = pair.drive, pair.theta(anywhere(pair.spec, 3))
        before = drive.copy(), theta.copy()
        pair.whole.simulate(drive, theta, DT)
        need(np.array_equal(drive, before[0]) and np.array_equal(theta, before[1]), "it changes its inputs")
        drive.flags.writeable = theta.flags.writeable = False
        pair.whole.simulate(drive, theta, DT)


def output_is_deterministic(effect: Effect) -> None:
    """The output is the same at every call."""
    for pair in pairs(effect):
        own = anywhere(pair.spec, 3)
        need(np.array_equal(pair.out(own), pair.out(own)), "two calls differ")


def batch_equals_single_vectors(effect: Effect) -> None:
    """Every row of a batch is what its parameter vector gives by itself."""
    for pair in pairs(effect):
        own = anywhere(pair.spec, 9)
        batch = pair.out(own)
        single = np.vstack([pair.out(row[None]) for row in own])
        need_close(batch, single, 0.0, 1e-12 * float(np.abs(batch).max()), f"batch on {pair.base.name}")


def constant_channels_are_no_trouble(effect: Effect) -> None:
    """Channels that do not move are no trouble."""
    for pair in pairs(effect):
        drive = np.repeat(pair.drive[:, :1], 50, axis=1)
        out = pair.whole.simulate(drive, pair.theta(anywhere(pair.spec, 5)), DT)
        need(np.isfinite(out).all(), f"not finite on {pair.base.name}")


EFFECT_CHECKS: tuple[Check[Effect], ...] = (
    check_of(specification_is_sound),
    check_of(function_is_that_of_the_slot),
    check_of(rivals_are_told_apart, lambda e: e.SPEC.proposed),
    check_of(rivals_are_known),
    check_of(units_are_known),
    check_of(bounds_hold_the_neutral),
    check_of(neutral_survives_the_unit_interval),
    check_of(neutral_leaves_the_base),
    check_of(every_parameter_moves_the_output),
    check_of(sensitivity_does_not_vanish_at_neutral),
    check_of(output_is_finite_within_the_bounds),
    check_of(inputs_are_left_untouched),
    check_of(output_is_deterministic),
    check_of(batch_equals_single_vectors),
    check_of(constant_channels_are_no_trouble),
)
